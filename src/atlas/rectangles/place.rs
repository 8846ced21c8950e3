//! Where the vertices of a rectangle lie, when it is known where those on its border do.
//!
//! *Enters:* a rectangle, and the fractions of its sides at which its border vertices are to lie. *Leaves:* coordinates in
//! [0, 1] × [0, height], linear on its faces. *Guaranteed:* border vertices lie where they are to, to the last bit, corners on corners; the
//! map is one to one up to rounding (see [`harmonic`](super::harmonic)): a harmonic map of a disk to a convex one.
//!
//! The flow's own map of a quad to its rectangle is conformal, and so harmonic. With other values on the border the harmonic map is no
//! longer conformal, but differs from it smoothly; where nothing moves they are nearly the same (weights of edges that the border cut are
//! raised). It is computed on the flow's flat triangulation, whose faces are well shaped, and linear on these; so slivers never decide about it.

// Blending the four side maps across the rectangle needs no equations, but it folds: near a crowded corner one side map may rise like
// t^{1/9} and another one not. It flipped faces in 7 to 24 % of the rectangles of seven models, where harmonic maps flipped none.

use super::RectangleError;
use super::flow::Rectangle;
use super::harmonic::{weights, with_weights};
use super::walls::Fractions;
use crate::atlas::plane::{distance, doubled_area};
use crate::geometry::ids::{HalfedgeId, VertexVec};
use crate::geometry::mesh::{cross, norm, sub};

/// How often the weights follow the stretch, at most.
const SPREADS: usize = 6;
/// Stretches that differ by more from the mean say nothing.
const MOST_STRETCHED: f64 = 8.0;

/// What rounding moves a corner by, at most, in widths of the rectangle.
const ROUNDING: f64 = 1e-15;

/// Sets the coordinates of all corners. `border` says for every piece of the border which side it lies on, and the fractions where
/// it begins; `number` is that of the quad, for errors.
pub(super) fn place(
    rectangle: &mut Rectangle,
    border: &[(usize, Fractions)],
    number: usize,
) -> Result<(), RectangleError> {
    place_in_rounds(rectangle, border, number, SPREADS)
}

/// The same with as many rounds of spreading at the most.
pub(super) fn place_in_rounds(
    rectangle: &mut Rectangle,
    border: &[(usize, Fractions)],
    number: usize,
    rounds: usize,
) -> Result<(), RectangleError> {
    let c = &rectangle.fine.connectivity;
    let mut at: VertexVec<Option<[f64; 2]>> = VertexVec::filled(None, c.vertex_count());
    for (piece, &(side, fractions)) in rectangle.border.iter().zip(border) {
        let tail = c.tail(c.edge_halfedge(piece.edge));
        let side = (side + 4 - rectangle.origin) % 4;
        at[tail] = Some(on_side(side, fractions, rectangle.height));
    }
    let error = || RectangleError::Inconsistent {
        what: "the border of a quad",
    };
    let flat = &rectangle.layout.connectivity;
    let loops = flat.boundary_loops();
    let [border] = &loops[..] else {
        return Err(error());
    };
    let given: Vec<[f64; 2]> = border
        .iter()
        .map(|&h| at[flat.tail(h)].ok_or_else(error))
        .collect::<Result<_, _>>()?;
    let given = [0, 1].map(|i| given.iter().map(|p| p[i]).collect::<Vec<f64>>());
    let mut weight = weights(flat, &rectangle.layout.length);
    let mut best: Option<(f64, VertexVec<Option<[f64; 2]>>)> = None;
    for _ in 0..=rounds {
        let solved = with_weights(flat, &weight, border, &given)?;
        let mut at = at.clone();
        let most = [1.0, rectangle.height];
        let carried = |h: HalfedgeId| {
            let v = flat.tail(h);
            // The maximum principle, whatever the rounding.
            std::array::from_fn(|i| solved[i][v].clamp(0.0, most[i]))
        };
        for (v, &carrier) in rectangle.carrier.enumerate() {
            at[v].get_or_insert_with(|| carrier.place(flat, carried));
        }
        let stretch = Stretch::new(rectangle, &at);
        if best
            .as_ref()
            .is_some_and(|(least, _)| stretch.whole >= *least)
        {
            break;
        }
        for e in flat.edges() {
            let [a, b] = flat.edge_vertices(e).map(|v| stretch.at[v]);
            weight[e] /= (a * b).sqrt();
        }
        best = Some((stretch.whole, at));
    }
    let at = best.ok_or_else(error)?.1;
    let mut folded = 0;
    for f in c.faces() {
        let mut uv = [[0.0; 2]; 3];
        for (uv, v) in uv.iter_mut().zip(c.face_vertices(f)) {
            *uv = at[v].ok_or_else(error)?;
        }
        for (h, uv) in c.face_halfedges(f).into_iter().zip(uv) {
            rectangle.fine.corner[h].uv = uv;
        }
        folded += usize::from(is_folded(uv));
    }
    match folded {
        0 => Ok(()),
        _ => Err(RectangleError::Folded {
            quad: number,
            folded,
            faces: c.face_count(),
        }),
    }
}

/// How much larger than its place in the unit square a rectangle's surface is: the mean squared length of what is a unit long there,
/// with a weight where it is to be sampled densely.
struct Stretch {
    /// At the vertices of the flat triangulation; 1 on the mean.
    at: VertexVec<f64>,
    /// ∫ over the surface; infinite where a face has no place.
    whole: f64,
}

impl Stretch {
    fn new(rectangle: &Rectangle, at: &VertexVec<Option<[f64; 2]>>) -> Self {
        let c = &rectangle.fine.connectivity;
        let count = rectangle.layout.connectivity.vertex_count();
        let mut sums = VertexVec::filled([0.0; 2], count);
        let mut all = [0.0; 2];
        for f in c.faces() {
            let corners = c.face_vertices(f);
            let p = corners.map(|v| rectangle.fine.position[v]);
            let area = 0.5 * norm(cross(sub(p[1], p[0]), sub(p[2], p[0])));
            let uv = corners.map(|v| at[v].unwrap_or_default());
            let uv = uv.map(|[u, v]| [u, v / rectangle.height]);
            // With a weight d⁴ the sum of squares is least where d times the stretch is the same everywhere, since the surface's images, 1 / stretch² an area, have
            // one size in all.
            let densities = corners.map(|v| rectangle.density.as_slice().get(v.index()));
            let known = || densities.iter().flatten().map(|d| d.powi(4));
            let weight = known().sum::<f64>() / known().count().max(1) as f64;
            let weight = if weight > 0.0 { weight } else { 1.0 };
            let squared = weight * squared_stretch(p, uv);
            if !(area > 0.0 && squared.is_finite()) {
                continue;
            }
            // Others were made later.
            for v in corners.into_iter().filter(|v| v.index() < count) {
                sums[v] = [sums[v][0] + area * squared, sums[v][1] + area];
            }
            all = [all[0] + area * squared, all[1] + area];
        }
        let mean = (all[0] / all[1]).sqrt();
        let at = sums.iter().map(|&[sum, area]| {
            let stretch = (sum / area).sqrt() / mean;
            match stretch.is_finite() {
                true => stretch.clamp(1.0 / MOST_STRETCHED, MOST_STRETCHED),
                false => 1.0,
            }
        });
        Self {
            at: at.collect(),
            whole: all[0],
        }
    }
}

/// Half the squared Frobenius norm of the map from the plane to space that is linear on a triangle.
fn squared_stretch(p: [[f64; 3]; 3], uv: [[f64; 2]; 3]) -> f64 {
    let determinant = doubled_area(uv);
    let along = |i: usize| -> [f64; 3] {
        // The derivative by coordinate i: corners weighted by the differences of the other coordinate.
        let other = 1 - i;
        let sign = if i == 0 { 1.0 } else { -1.0 };
        std::array::from_fn(|x| {
            let sum: f64 = (0..3)
                .map(|k| p[k][x] * (uv[(k + 1) % 3][other] - uv[(k + 2) % 3][other]))
                .sum();
            sign * sum / determinant
        })
    };
    0.5 * (norm(along(0)).powi(2) + norm(along(1)).powi(2))
}

/// Whether a face is turned over by more than the rounding of its corners, which lie in the unit square.
fn is_folded(t: [[f64; 2]; 3]) -> bool {
    let longest = [0, 1, 2].map(|k| distance(t[k], t[(k + 1) % 3]));
    let longest = longest.into_iter().fold(0.0, f64::max);
    doubled_area(t) < -ROUNDING * longest
}

/// A point on a side, counterclockwise from the origin on.
fn on_side(side: usize, [before, behind]: Fractions, height: f64) -> [f64; 2] {
    match side {
        0 => [before, 0.0],
        1 => [1.0, before * height],
        2 => [behind, height],
        _ => [0.0, behind * height],
    }
}
