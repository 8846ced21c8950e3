//! Clusters, their quads, and diagonals of the flow's cells.

use super::super::candidate::{in_cluster_drawing, missed};
use super::super::clusters::clusters;
use super::super::division::{part, places, regions};
use super::super::sides::{Drawing, Role};
use super::{TOLERANCE, annulus_mesh, clustered, flow, shaken, sphere_mesh, surfaces, torus_mesh};
use crate::atlas::geometry_image::GeometryImage;
use crate::atlas::overlay::Carrier;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceId};
use crate::geometry::mesh::{Mesh, triangle_area};
use crate::geometry::polycube::polycube;
use std::collections::BTreeSet;

fn meshes() -> [(&'static str, Mesh); 4] {
    // A plate with a long finger.
    let plate = (0..25).map(|i| [i % 5, i / 5, 0]);
    let finger = (1..9).map(|k| [2, 2, k]);
    [
        ("sphere", sphere_mesh()),
        ("torus", torus_mesh()),
        ("annulus", annulus_mesh()),
        (
            "finger",
            shaken(polycube(plate.chain(finger), |_, _, _| true)),
        ),
    ]
}

/// Every part between walls is taken out as a disk, or this fails.
fn corners_of_all(drawing: &Drawing) -> Vec<usize> {
    let starts = regions(drawing).into_iter();
    let count = |start| {
        let disk = part(drawing, start).unwrap();
        places(drawing, &disk, |role| role == Role::Node).count()
    };
    starts.map(count).collect()
}

#[test]
fn clusters_are_disks_and_no_fingers() {
    for (name, mesh) in meshes() {
        for count in [1, 2, 6, 15, 40] {
            let found = clusters(&mesh, count);
            assert_eq!(found.as_slice(), clusters(&mesh, count).as_slice());
            let most = found.iter().map(|p| p.index()).max().unwrap();
            let nothing = EdgeVec::filled(false, mesh.connectivity.edge_count());
            let drawing = Drawing::new(&mesh, &nothing, &found).unwrap();
            let starts = regions(&drawing);
            assert_eq!(starts.len(), most + 1, "{name} {count}");
            assert!(most + 1 >= count, "{name} {count}");
            for start in starts {
                let disk = part(&drawing, start).unwrap();
                let fine = &drawing.fine;
                let edges = disk.border.iter().map(|&h| disk.edge(fine, h));
                let perimeter: f64 = edges.map(|e| fine.edge_length(e)).sum();
                let corners = |&f| fine.connectivity.face_vertices(f).map(|v| fine.position[v]);
                let area: f64 = disk.faces.iter().map(corners).map(triangle_area).sum();
                let faces: BTreeSet<FaceId> = disk.faces.iter().map(|&f| fine.parent[f]).collect();
                assert!(
                    faces.len() == 1 || area < 0.131 * perimeter.powi(2),
                    "{name} {count}"
                );
            }
        }
    }
}

#[test]
fn what_bends_is_in_smaller_clusters() {
    // A sheet, flat on its left, wavy on its right.
    let squares = (0..1600).map(|i| [i % 40, i / 40, 0]);
    let mut mesh = polycube(squares, |_, axis, sign| axis == 2 && sign == 1);
    for p in mesh.positions.as_mut_slice() {
        let out = (p[0] - 20.0).max(0.0);
        p[2] += 0.3 * (1.3 * out).sin() * (1.1 * p[1]).sin();
    }
    let found = clusters(&mesh, 40);
    let mut sides = [BTreeSet::new(), BTreeSet::new()];
    for f in mesh.connectivity.faces() {
        let x = mesh.face_positions(f).iter().map(|p| p[0]).sum::<f64>() / 3.0;
        sides[usize::from(x > 20.0)].insert(found[f]);
    }
    let [flat, wavy] = sides.map(|side| side.len());
    assert!(wavy > 2 * flat, "{flat} {wavy}");
}

#[test]
fn all_regions_become_quads() {
    for (name, mesh) in meshes() {
        for count in [6, 15] {
            let drawing = in_cluster_drawing(&mesh, count).unwrap();
            let corners = corners_of_all(&drawing);
            assert!(
                corners.iter().all(|&n| n == 4),
                "{name} {count}: {corners:?}"
            );
            // No more than two and a half a cluster: six sides make two, and halved sides a few more.
            let nothing = EdgeVec::filled(false, mesh.connectivity.edge_count());
            let before = Drawing::new(&mesh, &nothing, &clusters(&mesh, count)).unwrap();
            let before = regions(&before).len();
            assert!(
                2 * corners.len() <= 5 * before,
                "{name} {count}: {} {before}",
                corners.len()
            );
        }
    }
}

/// The faces of the flow's triangulation on which a place lies.
fn faces_at(flat: &Connectivity, carrier: Carrier) -> BTreeSet<FaceId> {
    let h = carrier.halfedge;
    let vertex = match carrier.fraction {
        0.0 => flat.tail(h),
        1.0 => flat.head(h),
        _ => {
            let both = [Some(h), flat.twin(h)].into_iter().flatten();
            return both.map(|h| flat.face(h)).collect();
        }
    };
    flat.outgoing(vertex).map(|h| flat.face(h)).collect()
}

/// So what is linear on the faces of the flow, and turns none of them over, turns none of a rectangle's over.
#[test]
fn every_face_lies_in_a_face_of_the_flow() {
    let mut diagonals = 0;
    let cubes = (0..216).map(|i| [i % 6, i / 6 % 6, i / 36]);
    let cube = shaken(polycube(cubes, |_, _, _| true));
    let large = [6, 9, 12].map(|count| ("cube", clustered(&cube, count)));
    for (name, (fine, quads)) in surfaces().into_iter().chain(large) {
        for (i, quad) in quads.iter().enumerate() {
            let rectangle = flow::flatten(&fine, quad, i, TOLERANCE).unwrap();
            let layout = &rectangle.layout;
            let flat = &layout.connectivity;
            diagonals += flat.edges().filter(|&e| !layout.may_cut[e]).count();
            let c = &rectangle.fine.connectivity;
            c.validate().unwrap();
            assert_eq!(rectangle.carrier.len(), c.vertex_count());
            for f in c.faces() {
                let [p, q, r] = c
                    .face_vertices(f)
                    .map(|v| faces_at(flat, rectangle.carrier[v]));
                let common = p.iter().any(|f| q.contains(f) && r.contains(f));
                assert!(common, "{name}: face {} of rectangle {i}", f.index());
            }
        }
    }
    assert!(diagonals >= 10, "{diagonals}");
}

#[test]
fn what_an_image_misses_is_measured_between_its_samples() {
    // z = x² over the unit square, in cells of a quarter: halfway it is h²/4 off, on every other sample.
    let (columns, rows) = (9, 5);
    let place = |i: usize| {
        let (x, y) = ((i % columns) as f32 / 8.0, (i / columns) as f32 / 4.0);
        [x, y, x * x]
    };
    let count = columns * rows;
    let image = GeometryImage {
        width: columns,
        height: rows,
        position: (0..count).map(place).collect(),
        alpha: vec![1.0; count],
        normal: vec![[0.0, 0.0, 1.0]; count],
        face: vec![0; count],
        log_scale: vec![0.0; count],
        attributes: Vec::new(),
    };
    let h: f64 = 0.25;
    let area: f64 = (0..4)
        .map(|k| {
            let [a, b] = [k, k + 1].map(|k| f64::from(k) * h);
            (h * h + (b * b - a * a).powi(2)).sqrt()
        })
        .sum();
    let expected = area * 0.5 * (h * h / 4.0).powi(2);
    assert!((missed(&image, 2) / expected - 1.0).abs() < 1e-6);
}
