//! What the program chooses where nothing is prescribed.

use super::*;

#[test]
fn defaults_are_few_cones_within_their_limits() {
    let (auto, none) = (ConeParams::default(), BoundaryParams::default());
    let on_sphere = one(&sphere(8), &auto, &none).unwrap();
    // 4π in parts of at most 9/8 π.
    assert!(on_sphere.cones.len() >= 4);
    assert_within_limits(&on_sphere);
    assert_within_limits(&one(&torus(6, &[]), &auto, &none).unwrap());
    let with_hole = one(&torus(8, &[0]), &auto, &none).unwrap();
    assert_eq!(with_hole.boundary, BoundaryCondition::Free);
    assert_within_limits(&with_hole);
    let flat = one(&sheet(4), &auto, &none).unwrap();
    assert!(flat.cones.is_empty() && flat.boundary == BoundaryCondition::Free);
}

#[test]
fn where_every_vertex_may_be_a_cone_the_metric_stays() {
    let tetrahedron = soup(
        vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]],
    );
    let params = ConeParams {
        max_curvature: PiMultiple::fraction(3, 2).unwrap(),
        ..ConeParams::default()
    };
    let result = one(&tetrahedron, &params, &BoundaryParams::default()).unwrap();
    // Angle defects: three right angles at the first vertex; two of π/4 and one of π/3 at each of the others.
    let defects = [0.5, 7.0 / 6.0, 7.0 / 6.0, 7.0 / 6.0];
    let given = curvatures(&result);
    assert_eq!(given.len(), 4);
    assert!(
        given
            .iter()
            .zip(defects)
            .all(|(k, defect)| (k - defect).abs() < 1e-9),
        "{given:?}"
    );
}

#[test]
fn genus_two_meets_its_total() {
    // Two tori joined along the border of a square hole.
    let n = 6;
    let mut first = torus(n, &[0]);
    let second = torus(n, &[0]);
    let offset = first.positions.len() as u32;
    let joined = [0, n, n + 1, 1];
    let there = |v: u32| match joined.iter().position(|&w| w == v) {
        // The mirror image, so that orientations agree.
        Some(k) => joined[k],
        None => v + offset,
    };
    first
        .positions
        .extend(second.positions.iter().map(|p| [p[0], p[1] - 9.0, -p[2]]));
    first.faces.extend(
        second
            .faces
            .iter()
            .map(|f| [there(f[0]), there(f[2]), there(f[1])]),
    );
    first.face_material = vec![crate::geometry::ids::NONE; first.faces.len()];
    let result = one(&first, &ConeParams::default(), &BoundaryParams::default()).unwrap();
    // `one` checks that they add up to −4π, which one cone could take alone.
    assert!(!result.cones.is_empty());
    assert_within_limits(&result);
    let single = one(
        &first,
        &by(ConeStrategy::Single),
        &BoundaryParams::default(),
    )
    .unwrap();
    assert_eq!(curvatures(&single), [-4.0]);
}

#[test]
fn the_choice_does_not_depend_on_the_numbering() {
    // Without symmetries: places that are worth the same may be chosen by number.
    let mut plain = sphere(9);
    for p in &mut plain.positions {
        let [x, y, z] = *p;
        *p = [
            1.4 * x + 0.2 * y * y,
            y + 0.3 * x * z + 0.1 * z,
            0.8 * z + 0.15 * x * y,
        ];
    }
    let n = plain.positions.len() as u32;
    let renamed = |v: u32| (v * 5 + 3) % n;
    assert_ne!(n % 5, 0);
    let mut other = plain.clone();
    for v in 0..n {
        other.positions[renamed(v) as usize] = plain.positions[v as usize];
    }
    other.faces = plain.faces.iter().rev().map(|f| f.map(renamed)).collect();
    for strategy in [ConeStrategy::Auto, ConeStrategy::Spread] {
        let cones = [&plain, &other].map(|soup| {
            let params = ConeParams {
                count: Some(8),
                ..by(strategy)
            };
            let result = one(soup, &params, &BoundaryParams::default()).unwrap();
            let places: BTreeSet<String> = result
                .cones
                .iter()
                .map(|c| format!("{:?}", soup.positions[c.vertex.index()]))
                .collect();
            assert!((1..=8).contains(&places.len()), "{places:?}");
            places
        });
        assert_eq!(cones[0], cones[1]);
    }
}

#[test]
#[cfg_attr(not(corpus), ignore = "needs AFFINE_ATLAS_CORPUS")]
fn real_models_get_their_defaults() {
    let Some(folder) = corpus::folder("real_models_get_their_defaults") else {
        return;
    };
    for name in [
        "spot.obj",
        "rocker-arm.obj",
        "three-holes.off",
        "fertility.off",
        "beetle.obj",
    ] {
        let soup = corpus::load(&folder.join(name));
        let result = one(&soup, &ConeParams::default(), &BoundaryParams::default()).unwrap();
        assert!(!result.cones.is_empty(), "{name}");
        assert_within_limits(&result);
    }
}

#[test]
fn impossible_automatic_choices_are_refused_with_both_numbers() {
    let pi = |n, d| PiMultiple::fraction(n, d).unwrap();
    let quarter = ConeParams {
        count: Some(6),
        max_curvature: pi(1, 2),
        ..ConeParams::default()
    };
    let cases = [
        (
            quarter.clone(),
            "cones.count = 6, but cones must add up to 4π here, and within cones.min_curvature and cones.max_curvature that takes 8",
        ),
        (
            ConeParams {
                quantum: pi(3, 5),
                ..ConeParams::default()
            },
            "which is no multiple of cones.quantum = 0.6π",
        ),
        (
            ConeParams {
                count: Some(8),
                quantum: pi(2, 3),
                max_curvature: pi(3, 5),
                ..quarter
            },
            "are multiples of cones.quantum = 2/3π and add up to 4π",
        ),
    ];
    for (params, expected) in cases {
        let error = one(&sphere(8), &params, &BoundaryParams::default()).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    }
}
