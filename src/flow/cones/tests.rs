use super::*;
use crate::repair::corpus::{self, soup};
use crate::repair::{RepairParams, Repaired, repair};
use std::collections::BTreeSet;

/// A flat sheet of n × n squares, a disk.
fn sheet(n: u32) -> crate::geometry::mesh::Soup {
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let positions = (0..=n)
        .flat_map(|i| (0..=n).map(move |j| [f64::from(i), f64::from(j), 0.0]))
        .collect();
    let faces = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    soup(positions, faces)
}

/// A torus of n × n squares with the squares of `holes` left out.
fn torus(n: u32, holes: &[u32]) -> crate::geometry::mesh::Soup {
    let at = |i: u32, j: u32| i % n * n + j % n;
    let angle = |i: u32| TAU * f64::from(i) / f64::from(n);
    let positions = (0..n * n)
        .map(|v| {
            let (s, t) = (angle(v / n), angle(v % n));
            let r = 2.0 + t.cos() + 0.1 * (2.0 * s).sin();
            [r * s.cos(), r * s.sin(), t.sin()]
        })
        .collect();
    let faces = (0..n * n)
        .filter(|q| !holes.contains(q))
        .flat_map(|q| {
            let (i, j) = (q / n, q % n);
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    soup(positions, faces)
}

/// A sphere of latitudes.
fn sphere(n: u32) -> crate::geometry::mesh::Soup {
    let mut positions = vec![[0.0, 0.0, 1.3]];
    for i in 1..n {
        let t = PI * f64::from(i) / f64::from(n);
        for j in 0..n {
            let s = TAU * f64::from(j) / f64::from(n);
            positions.push([t.sin() * s.cos(), 1.1 * t.sin() * s.sin(), 1.3 * t.cos()]);
        }
    }
    positions.push([0.0, 0.0, -1.3]);
    let at = |i: u32, j: u32| match i {
        0 => 0,
        _ if i == n => 1 + (n - 1) * n,
        _ => 1 + (i - 1) * n + j % n,
    };
    let faces = (0..n)
        .flat_map(|i| (0..n).map(move |j| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .filter(|f| f[0] != f[1] && f[1] != f[2] && f[2] != f[0])
        .collect();
    soup(positions, faces)
}

fn multiple(n: i64, d: i64) -> PiMultiple {
    PiMultiple::fraction(n, d).unwrap()
}

fn at_vertex(vertex: u32, n: i64, d: i64) -> ConeSpec {
    ConeSpec {
        vertex: Some(vertex),
        point: None,
        curvature: multiple(n, d),
    }
}

fn listed(list: Vec<ConeSpec>) -> ConeParams {
    ConeParams {
        list,
        ..ConeParams::default()
    }
}

fn by(strategy: ConeStrategy) -> ConeParams {
    ConeParams {
        strategy,
        ..ConeParams::default()
    }
}

fn uniform() -> BoundaryParams {
    BoundaryParams {
        condition: Some(BoundaryCondition::Uniform),
        ..BoundaryParams::default()
    }
}

fn all(
    repaired: &Repaired,
    cones: &ConeParams,
    boundary: &BoundaryParams,
) -> Result<Vec<Prescription>, ConeError> {
    let requests = assign(repaired, cones, boundary)?;
    let components = repaired.components.iter().zip(&requests);
    components
        .map(|(c, r)| prescribe(c.mesh.as_ref().unwrap(), r, cones, boundary))
        .collect()
}

fn one(
    soup: &crate::geometry::mesh::Soup,
    cones: &ConeParams,
    boundary: &BoundaryParams,
) -> Result<Prescription, ConeError> {
    let repaired = repair(soup, &RepairParams::default()).unwrap();
    assert_eq!(repaired.components.len(), 1);
    let prescription = all(&repaired, cones, boundary)?.remove(0);
    let mesh = repaired.components[0].mesh.as_ref().unwrap();
    let topology = mesh.connectivity.topology();
    // Gauss–Bonnet, positive angles, and a list of cones that says what the targets say.
    let total: f64 = prescription.target.iter().sum();
    let required = TAU * topology.euler_characteristic as f64;
    if topology.boundary_loops == 0 || prescription.boundary != BoundaryCondition::Free {
        assert!(
            (total - required).abs() < 1e-12 * (1.0 + required.abs()),
            "{total} {required}"
        );
    }
    for (v, &k) in prescription.target.enumerate() {
        let on_boundary = mesh.connectivity.is_boundary_vertex(v);
        assert!(k < if on_boundary { PI } else { TAU });
        let cone = prescription.cones.iter().find(|c| c.vertex == v);
        assert_eq!(cone.map_or(0.0, |c| c.curvature), k);
    }
    Ok(prescription)
}

fn curvatures(prescription: &Prescription) -> Vec<f64> {
    prescription
        .cones
        .iter()
        .map(|c| c.curvature / PI)
        .collect()
}

fn message(result: Result<Prescription, ConeError>) -> String {
    result.unwrap_err().to_string()
}

/// What the automatic choice promises of its cones inside the surface, beside what [`one`] checks of every prescription.
fn assert_within_limits(prescription: &Prescription) {
    let params = ConeParams::default();
    let given = curvatures(prescription);
    assert!(given.len() <= DEFAULT_COUNT, "{given:?}");
    let range = params.min_curvature.multiple() - 1e-9..=params.max_curvature.multiple() + 1e-9;
    assert!(given.iter().all(|k| range.contains(k)), "{given:?}");
}

#[test]
fn defaults_are_at_most_eight_cones_within_their_limits() {
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
    let plain = sphere(9);
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
            let result = one(soup, &by(strategy), &BoundaryParams::default()).unwrap();
            let places: BTreeSet<String> = result
                .cones
                .iter()
                .map(|c| format!("{:?}", soup.positions[c.vertex.index()]))
                .collect();
            assert_eq!(places.len(), 8);
            places
        });
        assert_eq!(cones[0], cones[1]);
    }
}

#[test]
fn spread_cones_keep_off_the_boundary_and_each_other() {
    let cones = ConeParams {
        strategy: ConeStrategy::Spread,
        count: Some(2),
        curvature: Some(multiple(1, 4)),
        ..ConeParams::default()
    };
    let plain = sheet(12);
    let result = one(&plain, &cones, &BoundaryParams::default()).unwrap();
    for cone in &result.cones {
        let p = plain.positions[cone.vertex.index()];
        assert!(p[..2].iter().all(|&x| (2.0..=10.0).contains(&x)), "{p:?}");
    }
    assert_eq!(curvatures(&result), [0.25; 2]);
}

#[test]
fn welded_vertices_are_found_by_any_of_their_names() {
    let plain = sphere(6);
    let positions: Vec<[f64; 3]> = plain
        .faces
        .iter()
        .flatten()
        .map(|&v| plain.positions[v as usize])
        .collect();
    let faces: Vec<[u32; 3]> = (0..plain.faces.len() as u32)
        .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
        .collect();
    let exploded = soup(positions.clone(), faces);
    let last = positions.len() as u32 - 1;
    let first = positions
        .iter()
        .position(|p| *p == positions[last as usize])
        .unwrap() as u32;
    let others: Vec<u32> = [1, 23, 60].into_iter().filter(|&v| v != first).collect();
    let mut list = vec![at_vertex(last, 1, 1)];
    list.extend(others.iter().map(|&v| at_vertex(v, 1, 1)));
    assert_eq!(list.len(), 4);
    let result = one(&exploded, &listed(list.clone()), &BoundaryParams::default()).unwrap();
    assert_eq!(curvatures(&result), [1.0; 4]);
    list[1] = at_vertex(first, 1, 1);
    let error = message(one(&exploded, &listed(list), &BoundaryParams::default()));
    assert!(
        error.contains(&format!("vertices {last} and {first} are both named")),
        "{error}"
    );
}

#[test]
fn points_and_vertices_find_their_component() {
    let mut two = sphere(6);
    let offset = two.positions.len() as u32;
    let far = sphere(6);
    two.positions
        .extend(far.positions.iter().map(|p| [p[0] + 10.0, p[1], p[2]]));
    two.faces
        .extend(far.faces.iter().map(|f| f.map(|v| v + offset)));
    two.positions.push([50.0; 3]);
    two.face_material = vec![crate::geometry::ids::NONE; two.faces.len()];
    let repaired = repair(&two, &RepairParams::default()).unwrap();
    let near = |point: [f64; 3]| ConeSpec {
        vertex: None,
        point: Some(point),
        curvature: multiple(4, 3),
    };
    let list = vec![
        near([10.0, 0.0, 9.0]),
        near([10.0, 0.0, -9.0]),
        at_vertex(offset + 14, 4, 3),
    ];
    let results = all(&repaired, &listed(list.clone()), &BoundaryParams::default()).unwrap();
    // No entry: the default, as if the component were alone.
    let alone = one(
        &sphere(6),
        &ConeParams::default(),
        &BoundaryParams::default(),
    );
    assert_eq!(results[0].cones, alone.unwrap().cones);
    let strictly = ConeParams {
        strategy: ConeStrategy::Listed,
        ..listed(list.clone())
    };
    let strictly = all(&repaired, &strictly, &BoundaryParams::default()).unwrap();
    assert_eq!(strictly[0].cones, results[0].cones);
    assert_eq!(strictly[1].cones, results[1].cones);
    assert_eq!(results[1].cones.len(), 3);
    assert_eq!(results[1].cones[0].vertex, VertexId::new(0));
    for (spec, text) in [
        (
            at_vertex(2 * offset, 1, 1),
            format!("cones.list[0] names vertex {}, which no face", 2 * offset),
        ),
        (
            at_vertex(999, 1, 1),
            format!("the file has {} vertices", 2 * offset + 1),
        ),
        (
            near([f64::NAN; 3]),
            "cones.list[0].point has a coordinate".into(),
        ),
    ] {
        let error = all(&repaired, &listed(vec![spec]), &BoundaryParams::default());
        let error = error.unwrap_err().to_string();
        assert!(error.contains(&text), "{error}");
    }
    let mut both = list[0];
    both.vertex = Some(1);
    let error = all(&repaired, &listed(vec![both]), &BoundaryParams::default());
    assert!(matches!(error, Err(ConeError::NoPlace { .. })));
}

#[test]
fn impossible_cones_are_refused() {
    let none = BoundaryParams::default();
    let cases: Vec<(ConeParams, &str)> = vec![
        (
            listed(vec![at_vertex(3, 1, 2), at_vertex(3, 1, 2)]),
            "vertex 3 is named twice",
        ),
        (
            listed(vec![at_vertex(3, 2, 1), at_vertex(5, 2, 1)]),
            "vertex 3 has curvature 2π",
        ),
        (
            listed(vec![at_vertex(3, 3, 2), at_vertex(5, 3, 2)]),
            "needs at least 3 cones",
        ),
        (
            listed(vec![at_vertex(3, 0, 2), at_vertex(5, 3, 2)]),
            "curvature 0",
        ),
        (
            by(ConeStrategy::Single),
            "a single cone would need curvature 4π",
        ),
        (by(ConeStrategy::None), "needs cones of total curvature 4π"),
        (by(ConeStrategy::Listed), "cones.list is empty"),
        (
            listed(vec![
                at_vertex(3, 1, 1),
                at_vertex(5, 1, 1),
                at_vertex(9, 1, 1),
            ]),
            "sum to 3π (9.424777961 rad), but Gauss–Bonnet requires 2πχ = 4π (12.566370614 rad) on a surface with χ = 2 (genus 0, 0 boundary loops): change the total by 1π",
        ),
        (
            ConeParams {
                strategy: ConeStrategy::Spread,
                count: Some(0),
                ..ConeParams::default()
            },
            "cones.count is 0",
        ),
        (
            ConeParams {
                strategy: ConeStrategy::Spread,
                count: Some(1000),
                ..ConeParams::default()
            },
            "has 32 interior vertices",
        ),
        (
            ConeParams {
                strategy: ConeStrategy::Spread,
                count: Some(2),
                ..ConeParams::default()
            },
            "less than 2π",
        ),
        (
            ConeParams {
                strategy: ConeStrategy::Spread,
                ..listed(vec![at_vertex(3, 1, 1)])
            },
            "cones.list and cones.strategy = \"spread\" exclude each other",
        ),
    ];
    for (params, text) in cases {
        let error = message(one(&sphere(6), &params, &none));
        assert!(error.contains(text), "{error}");
    }
    let spread = message(one(&torus(5, &[]), &by(ConeStrategy::Spread), &none));
    assert!(spread.contains("χ = 0"), "{spread}");
}

#[test]
fn rounding_of_decimals_is_shared_out() {
    let third = |v: u32| ConeSpec {
        vertex: Some(v),
        point: None,
        curvature: PiMultiple::decimal(1.33333333333).unwrap(),
    };
    let list = vec![third(0), third(9), third(20)];
    // `one` checks the sum to 1e-12.
    assert_eq!(
        one(&sphere(6), &listed(list), &BoundaryParams::default())
            .unwrap()
            .cones
            .len(),
        3
    );
}

#[test]
fn a_free_boundary_takes_what_it_can() {
    let none = BoundaryParams::default();
    let (corner, inner) = (0, 3 * 6 + 3);
    let result = one(&sheet(5), &listed(vec![at_vertex(inner, -3, 1)]), &none).unwrap();
    assert_eq!(curvatures(&result), [-3.0]);
    let error = message(one(
        &sheet(5),
        &listed(vec![at_vertex(corner, 1, 2)]),
        &none,
    ));
    assert!(
        error.contains("vertex 0 lies on a free boundary"),
        "{error}"
    );
    // 20 boundary vertices, χ = 1: the interior must exceed 2π − 20π.
    let error = message(one(
        &sheet(5),
        &listed(vec![at_vertex(inner, -18, 1)]),
        &none,
    ));
    assert!(error.contains("must exceed 2πχ − 20π = -18π"), "{error}");
    assert!(one(&sheet(5), &listed(vec![at_vertex(inner, -71, 4)]), &none).is_ok());
    // A single cone on a punctured torus.
    let result = one(&torus(8, &[0]), &by(ConeStrategy::Single), &none).unwrap();
    assert_eq!(curvatures(&result), [-2.0]);
}

#[test]
fn a_uniform_boundary_shares_what_the_cones_leave() {
    let auto = ConeParams::default();
    let flat = one(&sheet(5), &auto, &uniform()).unwrap();
    assert_eq!(flat.cones.len(), 20);
    assert!(
        flat.cones
            .iter()
            .all(|c| (c.curvature - TAU / 20.0).abs() < 1e-15)
    );
    let (corner, inner) = (0, 3 * 6 + 3);
    let list = vec![at_vertex(inner, 1, 1), at_vertex(corner, 1, 2)];
    let mixed = one(&sheet(5), &listed(list), &uniform()).unwrap();
    assert_eq!(mixed.cones.len(), 21);
    assert_eq!(mixed.target[VertexId::new(corner as usize)], PI / 2.0);
    assert!((mixed.target[VertexId::new(1)] - PI / 2.0 / 19.0).abs() < 1e-15);
    let error = message(one(
        &sheet(5),
        &listed(vec![at_vertex(corner, 1, 1)]),
        &uniform(),
    ));
    assert!(
        error.contains("on the boundary it must be less than 1π"),
        "{error}"
    );
    // A torus with two holes: χ = −2, one total a loop.
    let two = torus(8, &[0, 36]);
    let totals = |totals: Vec<PiMultiple>| BoundaryParams {
        totals,
        ..BoundaryParams::default()
    };
    let result = one(&two, &auto, &totals(vec![multiple(-3, 1), multiple(-1, 1)])).unwrap();
    assert_eq!(result.boundary, BoundaryCondition::Uniform);
    assert_eq!(result.target[VertexId::new(0)], -3.0 * PI / 4.0);
    let error = message(one(&two, &auto, &totals(vec![multiple(-4, 1)])));
    assert!(
        error.contains("has 1 entries, but the component has 2 boundary loops"),
        "{error}"
    );
    // Totals that miss Gauss–Bonnet are an error without cones; the automatic choice places what is missing, in as few as can take it.
    let much = totals(vec![multiple(-3, 1); 2]);
    let error = message(one(&two, &by(ConeStrategy::None), &much));
    assert!(error.contains("sum to -6π"), "{error}");
    let filled = one(&two, &auto, &much).unwrap();
    let inside: Vec<f64> = filled.cones.iter().map(|c| c.curvature / PI).collect();
    let inside: Vec<f64> = inside.into_iter().filter(|&k| k > 0.0).collect();
    assert_eq!(inside.len(), 2, "2π in parts of at most 9/8 π: {inside:?}");
}

fn on_boundary(vertex: u32, n: i64, d: i64) -> BoundarySpec {
    BoundarySpec {
        vertex: Some(vertex),
        point: None,
        curvature: multiple(n, d),
    }
}

fn prescribed(list: Vec<BoundarySpec>) -> BoundaryParams {
    BoundaryParams {
        list,
        ..BoundaryParams::default()
    }
}

#[test]
fn listed_boundary_vertices_keep_their_curvature_and_the_others_share_the_rest() {
    let auto = ConeParams::default();
    // 20 boundary vertices. Three corners of a triangle take all there is: the others get exactly nothing.
    let corners = [0, 5, 35].map(|v| on_boundary(v, 2, 3)).to_vec();
    let triangle = one(&sheet(5), &auto, &prescribed(corners)).unwrap();
    assert_eq!(triangle.boundary, BoundaryCondition::Prescribed);
    assert_eq!(triangle.cones.len(), 3);
    assert!(curvatures(&triangle).iter().all(|&k| k == 2.0 / 3.0));
    // One corner, and a vertex that shall be straight: 18 share 2π − π/2.
    let list = vec![on_boundary(0, 1, 2), on_boundary(5, 0, 1)];
    let drop = one(&sheet(5), &auto, &prescribed(list)).unwrap();
    assert_eq!(drop.target[VertexId::new(0)], PI / 2.0);
    assert_eq!(drop.target[VertexId::new(5)], 0.0);
    assert_eq!(drop.cones.len(), 19);
    assert!((drop.target[VertexId::new(1)] - 1.5 * PI / 18.0).abs() < 1e-15);
    // A point finds the nearest vertex of the boundary, even where one inside is nearer.
    let near = BoundarySpec {
        vertex: None,
        point: Some([0.7, 2.1, 0.0]),
        curvature: multiple(1, 4),
    };
    let point = one(&sheet(5), &auto, &prescribed(vec![near])).unwrap();
    assert_eq!(point.target[VertexId::new(2)], PI / 4.0);
    // Cones inside count, and so do those of the other list on the boundary.
    let inner = 3 * 6 + 3;
    let cones = listed(vec![at_vertex(inner, -1, 1), at_vertex(5, 1, 2)]);
    let both = one(&sheet(5), &cones, &prescribed(vec![on_boundary(0, 1, 2)])).unwrap();
    assert!((both.target[VertexId::new(1)] - 2.0 * PI / 18.0).abs() < 1e-15);
    // A single cone takes what the list leaves, and the others are straight.
    let two = vec![on_boundary(0, 1, 2), on_boundary(35, 1, 2)];
    let single = one(&sheet(5), &by(ConeStrategy::Single), &prescribed(two)).unwrap();
    assert_eq!(single.cones.len(), 3);
}

#[test]
fn listed_boundary_vertices_and_totals_of_loops() {
    // A torus with two holes of four vertices each: χ = −2.
    let two = torus(8, &[0, 36]);
    let boundary = BoundaryParams {
        totals: vec![multiple(-3, 1), multiple(-1, 1)],
        ..prescribed(vec![on_boundary(0, 1, 2)])
    };
    let result = one(&two, &ConeParams::default(), &boundary).unwrap();
    assert_eq!(result.target[VertexId::new(0)], PI / 2.0);
    for v in [1, 8, 9] {
        let given = result.target[VertexId::new(v)];
        assert!((given + 3.5 * PI / 3.0).abs() < 1e-14, "{given}");
    }
    assert_eq!(result.target[VertexId::new(36)], -PI / 4.0);
}

#[test]
fn impossible_boundary_vertices_are_refused() {
    let auto = ConeParams::default();
    let inner = 3 * 6 + 3;
    let four = |n, d| [0, 5, 30, 35].map(|v| on_boundary(v, n, d)).to_vec();
    let mut all_but_two: Vec<BoundarySpec> = (0..=5)
        .flat_map(|i| [i, 30 + i, 6 * i, 6 * i + 5])
        .collect::<BTreeSet<u32>>()
        .into_iter()
        .map(|v| on_boundary(v, 0, 1))
        .collect();
    all_but_two.drain(..2);
    let every: Vec<BoundarySpec> = (0..=5)
        .flat_map(|i| [i, 30 + i, 6 * i, 6 * i + 5])
        .collect::<BTreeSet<u32>>()
        .into_iter()
        .map(|v| on_boundary(v, 1, 20))
        .collect();
    for (list, text) in [
        (
            vec![on_boundary(inner, 1, 2)],
            "boundary.list names vertex 21, which does not lie on the boundary",
        ),
        (
            vec![on_boundary(3, 1, 2), on_boundary(3, 1, 4)],
            "vertex 3 is named twice",
        ),
        (
            vec![on_boundary(3, 1, 1)],
            "vertex 3 has curvature 1π (3.141593 rad), but on the boundary it must be less than 1π",
        ),
        (
            all_but_two,
            "2 boundary vertices are left to share a curvature of 2π, 1π each",
        ),
        (
            every,
            "sum to 1π (3.141592654 rad), but Gauss–Bonnet requires 2πχ = 2π",
        ),
    ] {
        let error = message(one(&sheet(5), &by(ConeStrategy::None), &prescribed(list)));
        assert!(error.contains(text), "{error}");
    }
    // Both lists.
    let cones = listed(vec![at_vertex(5, 1, 2)]);
    let error = message(one(&sheet(5), &cones, &prescribed(four(1, 4))));
    assert!(error.contains("vertex 5 is named twice"), "{error}");
    // More than there is may be listed: the others make up for it.
    let star = one(&sheet(5), &auto, &prescribed(four(3, 4))).unwrap();
    assert!((star.target[VertexId::new(1)] + PI / 16.0).abs() < 1e-15);
    // Conditions that do not go together, and a surface without boundary.
    let condition = |condition, list| BoundaryParams {
        condition: Some(condition),
        ..prescribed(list)
    };
    let error = message(one(
        &sheet(5),
        &auto,
        &condition(BoundaryCondition::Free, four(1, 2)),
    ));
    assert!(
        error.contains("boundary.list and boundary.condition = \"free\" exclude each other"),
        "{error}"
    );
    let error = message(one(
        &sheet(5),
        &auto,
        &condition(BoundaryCondition::Prescribed, Vec::new()),
    ));
    assert!(error.contains("boundary.list is empty"), "{error}");
    let error = message(one(
        &sphere(6),
        &auto,
        &prescribed(vec![on_boundary(3, 1, 2)]),
    ));
    assert!(error.contains("does not lie on the boundary"), "{error}");
}

#[test]
fn corners_make_a_rectangle() {
    let corners = BoundaryParams {
        condition: Some(BoundaryCondition::Corners),
        ..BoundaryParams::default()
    };
    let auto = ConeParams::default();
    let result = one(&sheet(6), &auto, &corners).unwrap();
    assert_eq!(curvatures(&result), [0.5; 4]);
    // Six a side: any four that are six apart.
    let picks: Vec<[f64; 3]> = result
        .cones
        .iter()
        .map(|c| sheet(6).positions[c.vertex.index()])
        .collect();
    assert_eq!(picks[0], [0.0; 3], "ties go to the lowest coordinates");
    let named = |vertices: &[u32]| BoundaryParams {
        corners: vertices
            .iter()
            .map(|&v| CornerSpec {
                vertex: Some(v),
                point: None,
            })
            .collect(),
        ..BoundaryParams::default()
    };
    let result = one(&sheet(6), &auto, &named(&[0, 2, 6, 48])).unwrap();
    let vertices: Vec<usize> = result.cones.iter().map(|c| c.vertex.index()).collect();
    assert_eq!(vertices, [0, 2, 6, 48]);
    for (boundary, text) in [
        (named(&[0, 2, 6]), "names 3"),
        (named(&[0, 2, 6, 2]), "named twice"),
        (named(&[0, 2, 6, 8]), "does not lie on the boundary"),
    ] {
        let error = message(one(&sheet(6), &auto, &boundary));
        assert!(error.contains(text), "{error}");
    }
    let error = message(one(&torus(6, &[0]), &auto, &corners));
    assert!(error.contains("needs a disk"), "{error}");
    let error = message(one(&sheet(6), &listed(vec![at_vertex(24, 1, 2)]), &corners));
    assert!(error.contains("sum to 2.5π"), "{error}");
    let triangle = soup(
        vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        vec![[0, 1, 2]],
    );
    let error = message(one(&triangle, &auto, &corners));
    assert!(error.contains("the boundary has 3"), "{error}");
}

#[test]
fn parameters_survive_toml() {
    let text = "strategy = \"listed\"\n\n[[list]]\nvertex = 4\ncurvature = \"1/2\"\n\n[[list]]\npoint = [0.0, 1.0, 2.0]\ncurvature = -8\n";
    let params: ConeParams = toml::from_str(text).unwrap();
    assert_eq!(params.list[1].curvature.multiple(), -8.0);
    let again: ConeParams = toml::from_str(&toml::to_string(&params).unwrap()).unwrap();
    assert_eq!(again, params);
    assert!(toml::from_str::<ConeParams>("cuont = 3").is_err());
    let boundary: BoundaryParams = toml::from_str("totals = [\"1/2\", 1.5]").unwrap();
    assert_eq!(boundary.effective_condition(), BoundaryCondition::Uniform);
    assert_eq!(
        toml::from_str::<ConeParams>("").unwrap(),
        ConeParams::default()
    );
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
