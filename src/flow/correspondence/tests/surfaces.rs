//! Small surfaces with everything that a Δ-complex may have: loops, double edges, faces glued to themselves, vertices of degree 1.

use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{HalfedgeId, HalfedgeVec, VertexId};

/// A polygon with its sides glued: sides of the same size are the same edge, and run against each other where the signs differ
/// (so they all do). Cut into a fan of triangles.
pub fn glued_polygon(sides: &[i32]) -> Connectivity {
    let faces = sides.len() - 2;
    let mut twin = vec![None; 3 * faces];
    // Face f has polygon corners 0, f + 1, f + 2.
    for f in 1..faces {
        twin[3 * f] = Some(HalfedgeId::new(3 * f - 1));
        twin[3 * f - 1] = Some(HalfedgeId::new(3 * f));
    }
    let halfedge = |side: usize| {
        HalfedgeId::new(match side {
            0 => 0,
            s if s == sides.len() - 1 => 3 * faces - 1,
            s => 3 * (s - 1) + 1,
        })
    };
    for (i, side) in sides.iter().enumerate() {
        let j = sides.iter().position(|s| *s == -side).unwrap();
        twin[halfedge(i).index()] = Some(halfedge(j));
    }
    glued(&twin)
}

/// The vertices follow from the gluing of a closed surface.
fn glued(twin: &[Option<HalfedgeId>]) -> Connectivity {
    let mut tail = HalfedgeVec::filled(None, twin.len());
    let mut count = 0;
    for start in tail.ids() {
        if tail[start].is_some() {
            continue;
        }
        let mut h = start;
        while tail[h].is_none() {
            tail[h] = Some(VertexId::new(count));
            let prev = 3 * (h.index() / 3) + (h.index() + 2) % 3;
            h = twin[prev].unwrap();
        }
        count += 1;
    }
    let tail = tail.iter().map(|v| v.unwrap()).collect();
    let c = Connectivity::from_gluing(tail, twin, count).unwrap();
    c.validate().unwrap();
    c
}

fn from_faces(faces: &[[u32; 3]], vertices: usize) -> Connectivity {
    Connectivity::from_faces(faces, vertices).unwrap()
}

pub fn torus_grid(n: u32) -> Connectivity {
    let at = |i: u32, j: u32| (i % n) * n + j % n;
    let mut faces = Vec::new();
    for i in 0..n {
        for j in 0..n {
            faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            faces.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    from_faces(&faces, (n * n) as usize)
}

pub fn square_grid(n: u32) -> Connectivity {
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let mut faces = Vec::new();
    for i in 0..n {
        for j in 0..n {
            faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            faces.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    from_faces(&faces, ((n + 1) * (n + 1)) as usize)
}

pub fn surfaces() -> Vec<(&'static str, Connectivity)> {
    // Each face glued to itself along two sides, the two loops glued to each other.
    let cones = [2, 1, 0, 5, 4, 3].map(|t| match t {
        1 => Some(HalfedgeId::new(4)),
        4 => Some(HalfedgeId::new(1)),
        t => Some(HalfedgeId::new(t)),
    });
    let octahedron = [
        [0, 1, 2],
        [0, 2, 3],
        [0, 3, 4],
        [0, 4, 1],
        [5, 2, 1],
        [5, 3, 2],
        [5, 4, 3],
        [5, 1, 4],
    ];
    vec![
        ("one-vertex torus", glued_polygon(&[1, 2, -1, -2])),
        (
            "one-vertex genus 2",
            glued_polygon(&[1, 2, -1, -2, 3, 4, -3, -4]),
        ),
        (
            "sphere of an octagon",
            glued_polygon(&[1, -1, 2, 3, -3, 4, -4, -2]),
        ),
        (
            "double of a triangle",
            from_faces(&[[0, 1, 2], [0, 2, 1]], 3),
        ),
        ("two cones", glued(&cones)),
        (
            "tetrahedron",
            from_faces(&[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], 4),
        ),
        ("octahedron", from_faces(&octahedron, 6)),
        ("torus grid", torus_grid(3)),
        ("square with boundary", square_grid(3)),
    ]
}
