//! What happens on boundary loops.

use super::*;

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
