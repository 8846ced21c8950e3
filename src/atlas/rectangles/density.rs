//! How densely the places of a rectangle are to be sampled: where the surface bends, more.
//!
//! *Enters:* a rectangle, and the bend of the surface's faces. *Leaves:* at every vertex of the flow's triangulation, how many samples a length gets there in units of
//! the rectangle's mean. *Guaranteed:* positive numbers. *Not guaranteed:* that a map reaches them: it has whole grid lines to lay, and given corners.
//!
//! With b the bend of a place and h its texels' width, ∫ b h⁴ is least for as many texels where h ∝ b^{−1/6}. Walls have just this density, and maps have it where their border
//! and their grid lines allow.

use super::flow::Rectangle;
use crate::geometry::ids::{FaceVec, VertexVec};
use crate::geometry::subdivision::Subdivision;
use crate::geometry::triangle::area;

/// Density follows this power of the bend.
const POWER: f64 = 1.0 / 6.0;
/// Bends that differ by more from the mean say nothing.
const MOST_BENT: f64 = 20.0;

/// `bend` is that of the surface's faces, for an area; the rectangle's faces lie on those of `drawing`.
pub(super) fn density(
    rectangle: &Rectangle,
    drawing: &Subdivision,
    bend: &FaceVec<f64>,
) -> VertexVec<f64> {
    let c = &rectangle.layout.connectivity;
    let fine = &rectangle.fine.connectivity;
    // ∫ of the bend and area around every vertex.
    let mut sums = VertexVec::filled([0.0; 2], c.vertex_count());
    for f in fine.faces() {
        let lengths = fine.face_edges(f).map(|e| rectangle.fine.edge_length(e));
        let area = area(lengths).unwrap_or(0.0);
        let bend = bend[drawing.parent[rectangle.fine.parent[f]]];
        // Vertices of the flow come first.
        let known = fine.face_vertices(f).into_iter();
        for v in known.filter(|v| v.index() < c.vertex_count()) {
            sums[v] = [sums[v][0] + area * bend, sums[v][1] + area];
        }
    }
    // One face says little: all around a vertex's neighbours says more.
    let mut around = sums.clone();
    for e in c.edges() {
        let [a, b] = c.edge_vertices(e);
        for (v, w) in [(a, b), (b, a)] {
            around[v] = [0, 1].map(|i| around[v][i] + sums[w][i]);
        }
    }
    let whole = around
        .iter()
        .fold([0.0; 2], |whole, sum| [0, 1].map(|i| whole[i] + sum[i]));
    let mean = whole[0] / whole[1];
    let power = |&[bend, area]: &[f64; 2]| {
        let density = (bend / area / mean)
            .clamp(1.0 / MOST_BENT, MOST_BENT)
            .powf(POWER);
        // Where nothing bends at all, or nothing has an area.
        if density.is_finite() { density } else { 1.0 }
    };
    around.iter().map(power).collect()
}
