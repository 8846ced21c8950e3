//! Points that are one.

use super::*;

#[test]
fn an_unwelded_soup_is_closed_again() {
    let result = repaired(&exploded(&cube(2)));
    let topology = only(&result).connectivity.topology();
    assert_eq!((topology.vertices, topology.boundary_loops), (26, 0));
    assert_eq!(count(&result, "welded_vertices"), 3 * 48 - 26);
    // All copies of a corner are found again.
    let located = result.locate(3 * 48 - 1).unwrap().1;
    assert_eq!(
        only(&result).positions[located],
        exploded(&cube(2)).positions[3 * 48 - 1]
    );
}

#[test]
fn minus_zero_is_zero() {
    let mut halves = exploded(&soup(
        vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
        ],
        vec![[0, 1, 2], [0, 3, 1]],
    ));
    halves.positions[3] = [-0.0, 0.0, -0.0];
    assert_eq!(only(&repaired(&halves)).connectivity.vertex_count(), 4);
}

#[test]
fn closed_sheets_that_touch_stay_apart() {
    let cubes = together(&cube(2), &moved(&cube(2), [2.0, 0.0, 0.0]));
    let result = repaired(&cubes);
    assert_eq!(result.components.len(), 2);
    assert!(result.log.is_empty());
    let separate = RepairParams {
        weld: false,
        ..RepairParams::default()
    };
    // Without welding an unwelded soup falls to pieces, one a face.
    let pieces = repair(&exploded(&octahedron()), &separate).unwrap();
    assert_eq!(pieces.components.len(), 8);
    let few = RepairParams {
        max_components: 7,
        ..separate
    };
    let error = repair(&exploded(&octahedron()), &few)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("8 components") && error.contains("max_components = 7"),
        "{error}"
    );
}

#[test]
fn tolerant_welding_is_not_transitive() {
    let mut soup = exploded(&cube(1));
    for (i, p) in soup.positions.iter_mut().enumerate() {
        p[0] += 1e-6 * ((i * 7 % 5) as f64 - 2.0);
    }
    let tolerant = RepairParams {
        weld_tolerance: 1e-5,
        ..RepairParams::default()
    };
    let result = repair(&soup, &tolerant).unwrap();
    check(&result, &soup);
    assert_eq!(only(&result).connectivity.topology().vertices, 8);
    assert_eq!(chi(only(&result)), 2);
    let bad = RepairParams {
        weld_tolerance: 0.5,
        ..RepairParams::default()
    };
    assert!(matches!(
        repair(&soup, &bad),
        Err(RepairError::WeldTolerance { .. })
    ));
}

#[test]
fn an_edge_of_length_zero_is_collapsed() {
    let mut cube = cube(4);
    // Two neighbours in the middle of the bottom.
    let at = |p: [f64; 3]| cube.positions.iter().position(|&q| q == p).unwrap();
    let (v, w) = (at([2.0, 2.0, 0.0]), at([2.0, 3.0, 0.0]));
    cube.positions[v] = cube.positions[w];
    let result = repaired(&cube);
    assert_eq!(chi(only(&result)), 2);
    assert_eq!(count(&result, "welded_vertices"), 1);
    assert_eq!(count(&result, "removed_degenerate_faces"), 2);
    assert_eq!(result.locate(v as u32), result.locate(w as u32));
}

#[test]
fn what_float32_rounds_twice_is_one_point() {
    // Two neighbours in the middle of the bottom, so near that all faces at their edge are needles, or not quite.
    for (apart, welded) in [(1e-7, 1), (1e-4, 0)] {
        let mut cube = cube(4);
        let at = |p: [f64; 3]| cube.positions.iter().position(|&q| q == p).unwrap();
        let (v, w) = (at([2.0, 2.0, 0.0]), at([2.0, 3.0, 0.0]));
        cube.positions[v] = [2.0, 3.0 - apart, 0.0];
        let result = repaired(&cube);
        assert_eq!(chi(only(&result)), 2);
        assert_eq!(count(&result, "welded_vertices"), welded);
        assert_eq!(count(&result, "removed_degenerate_faces"), 2 * welded);
        assert_eq!(
            result.locate(v as u32) == result.locate(w as u32),
            welded == 1
        );
    }
    // On a mesh that is large beside its faces, coordinates are rounded more than these are: a corner far away makes it so.
    for (apart, far, welded) in [(5e-5, 1e3, 1), (5e-5, 4.0, 0), (5e-4, 1e3, 0)] {
        let mut cube = cube(4);
        let at = |p: [f64; 3]| cube.positions.iter().position(|&q| q == p).unwrap();
        let (v, top) = (at([2.0, 2.0, 0.0]), at([4.0, 4.0, 4.0]));
        cube.positions[v] = [2.0, 3.0 - apart, 0.0];
        cube.positions[top] = [far; 3];
        let result = repaired(&cube);
        assert_eq!(count(&result, "welded_vertices"), welded, "{apart} {far}");
        assert_eq!(chi(only(&result)), 2);
    }
    // A short edge with one face that is no needle stays, and so does a chain that is long in all.
    let positions: Vec<[f64; 3]> = (0..=3)
        .map(|i| [1.5e-6 * f64::from(i), 0.0, 0.0])
        .chain([[0.0, 1.0, 0.0], [2e-6, -2e-6, 0.0]])
        .collect();
    let fan: Vec<[u32; 3]> = (0..3).map(|i| [i, i + 1, 4]).collect();
    let soup_of_fan = soup(positions.clone(), fan.clone());
    let welded = count(
        &repair(&soup_of_fan, &RepairParams::default()).unwrap(),
        "welded_vertices",
    );
    assert_eq!(welded, 2);
    let below = soup(
        positions,
        [fan, vec![[1, 0, 5], [2, 1, 5], [3, 2, 5]]].concat(),
    );
    assert_eq!(count(&repaired(&below), "welded_vertices"), 0);
}

#[test]
fn an_edge_that_a_point_hides_is_one_point_too() {
    // A tetrahedron whose tip is a face with one edge that float32 would round away, and two that are a unit in its last place.
    let positions = vec![
        [0.0; 3],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [3e-8, 0.0, 1.0],
        [0.0, 1e-15, 1.0],
    ];
    let sides = [
        [0, 1, 4],
        [0, 4, 3],
        [1, 2, 5],
        [1, 5, 4],
        [2, 0, 3],
        [2, 3, 5],
    ];
    let faces = [vec![[0, 2, 1], [3, 4, 5]], sides.to_vec()].concat();
    let result = repaired(&corpus::soup(positions, faces));
    let mesh = only(&result);
    assert_eq!(
        (mesh.positions.len(), mesh.connectivity.face_count()),
        (4, 4)
    );
    assert_eq!(chi(mesh), 2);
}
