//! Sheets, fans and sides that are glued or come apart.

use super::*;

#[test]
fn the_fewest_faces_are_flipped() {
    let mut soup = cube(3);
    for f in [4, 17, 30] {
        soup.faces[f].swap(0, 1);
    }
    let result = repaired(&soup);
    let flipped: Vec<u32> = result
        .log
        .changes
        .iter()
        .filter_map(|c| match c {
            Change::FlippedFace { face } => Some(*face),
            _ => None,
        })
        .collect();
    assert_eq!(flipped, [4, 17, 30]);
    assert_eq!(chi(only(&result)), 2);
}

#[test]
fn a_vertex_with_two_fans_is_split() {
    let mut two = together(&octahedron(), &moved(&octahedron(), [0.0, 0.0, 2.0]));
    // The lower pole of the second (6 + 5) is the upper pole of the first.
    for v in two.faces.iter_mut().flatten().filter(|v| **v == 11) {
        *v = 0;
    }
    let result = repaired(&two);
    assert_eq!(count(&result, "split_vertices"), 1);
    assert_eq!(count(&result, "unreferenced_vertices"), 1);
    assert_eq!(result.components.len(), 2);
    for component in &result.components {
        assert_eq!(chi(component.mesh.as_ref().unwrap()), 2);
    }
    let second = result.components[1].mesh.as_ref().unwrap();
    assert_eq!(second.source_vertex.as_slice(), [6, 7, 8, 9, 10, 0]);
    assert_eq!(result.locate(0), Some((0, VertexId::new(0))));
    assert_eq!(result.locate(11), None);
    assert_eq!(result.components[0].log.counts()["split_vertices"], 1);
}

#[test]
fn solids_that_share_an_edge_come_apart() {
    // Two cubes that share an edge: four faces there.
    let cubes = together(&cube(1), &moved(&cube(1), [1.0, 1.0, 0.0]));
    let mut shared = exploded(&cubes);
    shared.faces.reverse();
    let result = repaired(&shared);
    assert_eq!(result.components.len(), 2);
    assert_eq!(count(&result, "cut_edges"), 1);
    for component in &result.components {
        let mesh = component.mesh.as_ref().unwrap();
        assert_eq!(chi(mesh), 2);
        assert!((area(mesh) - 6.0).abs() < 1e-12);
    }
}

#[test]
fn a_fin_does_not_tear_the_body() {
    // Outside and inside: the fin is left open either way.
    for tip in [[-1.0, -1.0, 0.5], [0.4, 0.4, 0.5]] {
        let mut soup = cube(1);
        let at = |p: [f64; 3]| soup.positions.iter().position(|&q| q == p).unwrap() as u32;
        let (a, b) = (at([0.0, 0.0, 0.0]), at([0.0, 0.0, 1.0]));
        for fin in [[a, b, 8], [b, a, 8]] {
            let mut soup = soup.clone();
            soup.positions.push(tip);
            soup.faces.insert(0, fin);
            soup.face_material.push(NONE);
            let result = repaired(&soup);
            assert_eq!(result.components.len(), 2);
            assert_eq!(chi(result.components[1].mesh.as_ref().unwrap()), 2);
            assert_eq!(result.components[0].faces, 1);
            assert_eq!(count(&result, "cut_edges"), 1);
        }
        soup.positions.clear();
    }
}

#[test]
fn doubled_edges_are_split_at_their_midpoint() {
    // Two cells of a grid that touch along an edge, joined above and below that edge: its ends stay
    // one vertex each, and the edge is there twice.
    let cells: Vec<[i32; 3]> = vec![
        [0, 0, 0],
        [1, 1, 0],
        [0, 0, 1],
        [1, 0, 1],
        [1, 1, 1],
        [0, 0, -1],
        [1, 0, -1],
        [1, 1, -1],
    ];
    let solid = |p: [i32; 3]| cells.contains(&p);
    let mut faces = Vec::new();
    let mut positions = Vec::new();
    for &cell in &cells {
        for axis in 0..3 {
            for side in [0, 1] {
                let mut next = cell;
                next[axis] += 2 * side - 1;
                if solid(next) {
                    continue;
                }
                let corner = |a: i32, b: i32| {
                    let mut p = cell;
                    p[axis] += side;
                    p[(axis + 1) % 3] += a;
                    p[(axis + 2) % 3] += b;
                    p.map(f64::from)
                };
                let q = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                let q = if side == 1 {
                    q
                } else {
                    [q[0], q[3], q[2], q[1]]
                };
                let start = positions.len() as u32;
                positions.extend(q);
                faces.extend([[start, start + 1, start + 2], [start, start + 2, start + 3]]);
            }
        }
    }
    let area_before = faces.len() as f64 / 2.0;
    let result = repaired(&soup(positions, faces));
    let mesh = only(&result);
    assert!((area(mesh) - area_before).abs() < 1e-12);
    assert_eq!(mesh.connectivity.topology().genus, 1);
    assert!(mesh.connectivity.is_closed());
    assert_eq!(count(&result, "cut_edges"), 1);
    assert_eq!(count(&result, "split_edges"), 1);
    let new: Vec<_> = mesh
        .source_vertex
        .enumerate()
        .filter(|(_, s)| **s == NONE)
        .collect();
    assert_eq!(mesh.positions[new[0].0], [1.0, 1.0, 0.5]);
}

#[test]
fn one_sided_strips_are_refused_and_the_others_built() {
    let both = together(&moebius(9), &octahedron());
    let result = repaired(&both);
    assert_eq!(result.components.len(), 2);
    let error = result.components[0].mesh.as_ref().unwrap_err();
    let ComponentError::NonOrientable {
        face,
        neighbour,
        faces,
    } = *error
    else {
        panic!("{error}");
    };
    assert!(face < 18 && neighbour < 18 && faces == 18);
    assert!(error.to_string().contains("Möbius"));
    assert_eq!(chi(result.components[1].mesh.as_ref().unwrap()), 2);
    assert_eq!(result.locate(3), Some((0, VertexId::new(3))));
    assert_eq!(count(&result, "flipped_faces"), 0);
}

#[test]
fn closed_components_that_look_inward_are_found() {
    use crate::repair::inside_out::inside_out;
    // Cubes beside each other, one in another, and an open one.
    let moved = |side: f64, by: f64, is_turned: bool| {
        let mut cube = cube(2);
        for p in &mut cube.positions {
            *p = p.map(|x| side * x + by);
        }
        if is_turned {
            cube.faces.iter_mut().for_each(|f| f.swap(1, 2));
        }
        cube
    };
    let mut all = moved(1.0, 0.0, false);
    let mut add = |other: Soup, open: usize| {
        let first = all.positions.len() as u32;
        all.positions.extend(other.positions);
        let faces = other.faces.into_iter().skip(open);
        all.faces.extend(faces.map(|f| f.map(|v| v + first)));
    };
    add(moved(0.5, 0.5, true), 0);
    add(moved(1.0, 10.0, true), 0);
    add(moved(1.0, 20.0, true), 1);
    add(moved(1.0, 30.0, false), 0);
    let soup = soup(all.positions, all.faces);
    let result = repaired(&soup);
    assert_eq!(result.components.len(), 5);
    assert_eq!(inside_out(&result.components), [2]);
}
