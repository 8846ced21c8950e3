//! Test surfaces that are flat cone metrics by themselves: the boundary of a set of unit cubes.
//!
//! Every corner angle is right, so curvatures are multiples of π/2 that come from counting, not from a flow.

use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, NONE, VertexVec};
use crate::geometry::mesh::Mesh;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The boundary of the cubes whose lowest corners are given, each square halved.
/// `keep` says which squares (lowest corner, axis of the normal, outward sign) stay: others leave holes.
pub fn polycube(
    cubes: impl IntoIterator<Item = [i32; 3]>,
    keep: impl Fn([i32; 3], usize, i32) -> bool,
) -> Mesh {
    let cubes: BTreeSet<[i32; 3]> = cubes.into_iter().collect();
    let mut numbers: BTreeMap<[i32; 3], u32> = BTreeMap::new();
    let mut positions = Vec::new();
    let mut faces = Vec::new();
    for &cube in &cubes {
        for axis in 0..3 {
            for sign in [-1, 1] {
                let mut beyond = cube;
                beyond[axis] += sign;
                let mut low = cube;
                low[axis] += (sign + 1) / 2;
                if cubes.contains(&beyond) || !keep(low, axis, sign) {
                    continue;
                }
                let (mut u, mut v) = ([0; 3], [0; 3]);
                u[(axis + 1) % 3] = 1;
                v[(axis + 2) % 3] = 1;
                if sign < 0 {
                    std::mem::swap(&mut u, &mut v);
                }
                let corner = |a: i32, b: i32| std::array::from_fn(|i| low[i] + a * u[i] + b * v[i]);
                let square = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                let q = square.map(|p: [i32; 3]| {
                    *numbers.entry(p).or_insert_with(|| {
                        positions.push(p.map(f64::from));
                        positions.len() as u32 - 1
                    })
                });
                faces.push([q[0], q[1], q[2]]);
                faces.push([q[0], q[2], q[3]]);
            }
        }
    }
    let count = positions.len();
    Mesh {
        connectivity: Connectivity::from_faces(&faces, count).expect("a manifold polycube"),
        positions: positions.into(),
        source_vertex: (0..count as u32).collect::<Vec<_>>().into(),
        source_face: (0..faces.len() as u32).collect::<Vec<_>>().into(),
        face_material: vec![NONE; faces.len()].into(),
        attributes: Vec::new(),
    }
}

/// A plate one cube thick, `width` × `height`, with square holes at the given places.
pub fn plate(width: i32, height: i32, holes: &[[i32; 2]]) -> Mesh {
    let cubes = (0..width).flat_map(|x| (0..height).map(move |y| [x, y, 0]));
    let cubes = cubes.filter(|c| !holes.contains(&[c[0], c[1]]));
    polycube(cubes, |_, _, _| true)
}

/// Lengths in space.
pub fn lengths(mesh: &Mesh) -> EdgeVec<f64> {
    let edges = mesh.connectivity.edges();
    edges.map(|e| mesh.edge_length(e)).collect()
}

/// Curvature by counting angles: exact multiples of π/2 (π/4 for a halved corner, twice).
pub fn curvature(mesh: &Mesh) -> VertexVec<f64> {
    let c = &mesh.connectivity;
    c.vertices()
        .map(|v| {
            let eighths: i32 = c
                .outgoing(v)
                .map(|h| {
                    // A halved square has its right angle where both sides have length 1.
                    let sides = [c.edge(h), c.edge(c.prev(h))];
                    let long = sides.iter().any(|&e| mesh.edge_length(e) > 1.1);
                    if long { 1 } else { 2 }
                })
                .sum();
            let full = if c.is_boundary_vertex(v) { PI } else { TAU };
            full - f64::from(eighths) * FRAC_PI_2 / 2.0
        })
        .collect()
}
