//! Regions of the plane as triangles.
//!
//! *Enters:* points and edges between them, some of which bound a region. *Leaves:* triangles of the constrained Delaunay triangulation.
//! *Guaranteed:* every triangle is positive by exact predicates, and together they cover what lies on the left of the edges up to the next one.
//! *Not guaranteed:* an answer where edges cross, or points are the same.

use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation, mitigate_underflow};

/// Triangles on the left of the fixed edges and as far as one comes from there without crossing one; `None` where edges cross, points are the same or a region is open.
pub(crate) fn fill(points: &[[f64; 2]], fixed: &[[usize; 2]]) -> Option<Vec<[u32; 3]>> {
    type Plane = ConstrainedDelaunayTriangulation<Point2<f64>>;
    let vertices = points
        .iter()
        .map(|p| mitigate_underflow(Point2::new(p[0], p[1])))
        .collect();
    let mut conflicts = 0;
    let plane = Plane::try_bulk_load_cdt(vertices, fixed.to_vec(), |_| conflicts += 1).ok()?;
    if conflicts > 0 || plane.num_vertices() != points.len() {
        return None;
    }
    let mut taken = vec![false; plane.num_all_faces()];
    let mut stack = Vec::new();
    for &[a, b] in fixed {
        let [a, b] = [a, b].map(FixedVertexHandle::from_index);
        let face = plane.get_edge_from_neighbors(a, b)?.face();
        stack.push(face.as_inner()?.fix());
    }
    let mut faces = Vec::new();
    while let Some(face) = stack.pop() {
        if std::mem::replace(&mut taken[face.index()], true) {
            continue;
        }
        let face = plane.face(face);
        faces.push(face.vertices().map(|v| v.fix().index() as u32));
        for edge in face.adjacent_edges() {
            if !edge.is_constraint_edge() {
                // Beyond the hull there is no border left to stop at.
                stack.push(edge.rev().face().as_inner()?.fix());
            }
        }
    }
    Some(faces)
}
