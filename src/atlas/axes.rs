//! Which way the axes of a chart point where all transitions are quarter turns.
//!
//! *Enters:* the central chart of such a surface. *Leaves:* the angle that brings the axes to the lines of the atlas: features and straight borders, and where there
//! are none to the directions of principal curvature, as far as one angle can. So textures and grids follow them. *Guaranteed:*
//! lines are parallel to the axes to rounding. *Not guaranteed:* that curvature decides anything on a sphere.
//!
//! The curvature tensor of a face is that of its edges, Σ β |e| ē ⊗ ē over bends β (Cohen-Steiner, Morvan 2003); its part without trace is the
//! number z = Σ β |e| e^{2iθ}. Crosses have the square, and weigh as much as the curvature: the axes are along ¼ arg Σ z² / |z|.

use super::develop::Development;
use crate::atlas::cut::CutGraph;
use crate::flow::features::Feature;
use crate::geometry::ids::{FaceId, HalfedgeId, VertexId};
use crate::geometry::mesh::{Mesh, cross, dot, norm};
use std::collections::BTreeSet;
use std::f64::consts::FRAC_PI_2;

/// A border is straight where its edges are as near to the directions of the axes as this, over the chart's diameter.
const STRAIGHT: f64 = 1e-9;

/// The angle from the first axis of the chart to the nearest direction that the surface has, radians, in [−π/4, π/4].
pub fn axis(mesh: &Mesh, cut: &CutGraph, central: &Development, lines: &[Feature]) -> f64 {
    let along = along_features(mesh, central, lines).or_else(|| along_border(mesh, central));
    let direction = match along {
        Some([x, y]) => y.atan2(x),
        None => along_curvature(mesh, cut, central),
    };
    direction - (direction / FRAC_PI_2).round() * FRAC_PI_2
}

/// A halfedge in the plane.
fn flat(mesh: &Mesh, central: &Development, h: HalfedgeId) -> [f64; 2] {
    let c = &mesh.connectivity;
    let (uv, k) = (&central.uv[c.face(h)], c.corner(h));
    let (p, q) = (uv[k], uv[(k + 1) % 3]);
    [q[0] - p[0], q[1] - p[1]]
}

fn longest(vectors: impl Iterator<Item = [f64; 2]>) -> Option<[f64; 2]> {
    let length = |[x, y]: [f64; 2]| x.hypot(y);
    vectors.fold(None, |best, v| match best {
        Some(b) if length(b) >= length(v) => best,
        _ => Some(v),
    })
}

fn along_features(mesh: &Mesh, central: &Development, lines: &[Feature]) -> Option<[f64; 2]> {
    let c = &mesh.connectivity;
    let pairs = lines.iter().flat_map(|line| line.vertices.windows(2));
    let edges: BTreeSet<[VertexId; 2]> = pairs
        .map(|pair| [pair[0].min(pair[1]), pair[0].max(pair[1])])
        .collect();
    if edges.is_empty() {
        return None;
    }
    let is_line = |h: &HalfedgeId| {
        let (a, b) = (c.tail(*h), c.head(*h));
        edges.contains(&[a.min(b), a.max(b)])
    };
    longest(
        c.halfedges()
            .filter(is_line)
            .map(|h| flat(mesh, central, h)),
    )
}

/// Nothing where borders are not all parallel to two axes.
fn along_border(mesh: &Mesh, central: &Development) -> Option<[f64; 2]> {
    let c = &mesh.connectivity;
    let border = || {
        let halfedges = c.halfedges().filter(|&h| c.twin(h).is_none());
        halfedges.map(|h| flat(mesh, central, h))
    };
    let [x, y] = longest(border())?;
    let unit = [x / x.hypot(y), y / x.hypot(y)];
    let off = |[x, y]: [f64; 2]| {
        let (along, beside) = (x * unit[0] + y * unit[1], x * unit[1] - y * unit[0]);
        along.abs().min(beside.abs())
    };
    let allowed = STRAIGHT * central.diameter();
    border().all(|v| off(v) <= allowed).then_some([x, y])
}

fn along_curvature(mesh: &Mesh, cut: &CutGraph, central: &Development) -> f64 {
    let c = &mesh.connectivity;
    // Pieces of one face of the file are flat together, and may be too thin to have a normal alone.
    let count = mesh.source_face.iter().max().map_or(0, |&f| f as usize + 1);
    let source = |f: FaceId| mesh.source_face[f] as usize;
    let mut normal = vec![[0.0; 3]; count];
    for f in c.faces() {
        let [p, q, r] = mesh.face_positions(f);
        let sub = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| a[i] - b[i]) };
        let n = cross(sub(q, p), sub(r, p));
        (0..3).for_each(|i| normal[source(f)][i] += n[i]);
    }
    let mut z = vec![Some([0.0; 2]); count];
    for h in c.halfedges() {
        let Some(t) = c.twin(h) else { continue };
        let (own, other) = (source(c.face(h)), source(c.face(t)));
        if own == other {
            // Its pieces are turned to each other.
            if cut.is_cut[c.edge(h)] {
                z[own] = None;
            }
            continue;
        }
        let [p, q] = [c.tail(h), c.head(h)].map(|v| mesh.positions[v]);
        let edge: [f64; 3] = std::array::from_fn(|i| q[i] - p[i]);
        let (m, n) = (normal[own], normal[other]);
        let length = norm(edge);
        let bend = (dot(cross(m, n), edge) / length).atan2(dot(m, n));
        let [x, y] = flat(mesh, central, h);
        let square = x * x + y * y;
        if let Some(z) = z[own].as_mut().filter(|_| length > 0.0 && square > 0.0) {
            z[0] += bend * length * (x * x - y * y) / square;
            z[1] += bend * length * 2.0 * x * y / square;
        }
    }
    let mut sum = [0.0; 2];
    for [x, y] in z.into_iter().flatten() {
        let weight = x.hypot(y);
        if weight > 0.0 {
            sum[0] += (x * x - y * y) / weight;
            sum[1] += 2.0 * x * y / weight;
        }
    }
    0.25 * sum[1].atan2(sum[0])
}
