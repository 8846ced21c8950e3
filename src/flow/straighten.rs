//! Lines of a flat metric that its Delaunay triangulation crosses become edges of the triangulation.
//!
//! *Enters:* a flat triangulation, and edges of the triangulation that it was flipped from, which are known to be straight: those on the mirror of a symmetric double. *Leaves:*
//! the same surface with these lines as edges, and how the new lengths depend on the old ones. *Guaranteed:* the metric stays as it is. *Not guaranteed:* that the
//! triangulation stays Delaunay.
//!
//! The faces that a line crosses are laid out in the plane, where they make a polygon with the line as a diagonal. An edge across the line is flipped where the quad around it is
//! convex, until none is left; then those that do not cross it are flipped until they are Delaunay (Sloan 1993). Flips that make faces with corners nearly on one line wait for others: there are such corners
//! wherever borders are straight, and from the lengths of such a face no angle can be told.

use super::correspondence::{CorrespondenceError, Crossing, Followed};
use super::delaunay::Delaunay;
use crate::geometry::connectivity::{Connectivity, Flip};
use crate::geometry::ids::{EdgeId, FaceId, FaceVec, HalfedgeId};
use std::collections::VecDeque;

/// Double areas of a face, by the square of the longer diagonal, below which a flip that makes it waits for others, one after the other: corners on one line have one that is rounding, or
/// the little by which the metric is not there yet, and from the lengths of such a face no angle can be told.
const FLAT: [f64; 7] = [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 0.0];

/// Part of the square of both diagonals that the corners of a quad may be off one circle.
const ROUNDING: f64 = 1e-10;

/// A flip that keeps the metric, and how the new length depends on the old ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EuclidFlip {
    /// What happened to the halfedges.
    pub flip: Flip,
    /// The edge that was flipped: `ab` before, `dc` after.
    pub edge: EdgeId,
    /// The edges `ca`, `ad`, `db`, `bc`.
    pub outer: [EdgeId; 4],
    /// ∂ ln l_dc / ∂ ln l of `ab`, `ca`, `ad`, `db`, `bc`.
    pub by: [f64; 5],
}

/// What was done.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Straightened {
    /// In order.
    pub flips: Vec<EuclidFlip>,
    /// The edge that every line has become.
    pub edge: Vec<EdgeId>,
}

/// Why a line is no edge.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StraightenError {
    /// The line could not be traced.
    #[error(transparent)]
    Correspondence(#[from] CorrespondenceError),
    /// The line is not straight in the metric, or faces beside it have no width.
    #[error("edge {edge} is not straight in the flat metric")]
    Bent {
        /// Edge of the first triangulation.
        edge: EdgeId,
    },
}

/// Makes `lines`, edges of `base`, edges again. The first of the correspondences of `flat` must be that of `base`.
pub fn straighten(
    flat: &mut Delaunay,
    base: &Connectivity,
    lines: &[EdgeId],
) -> Result<Straightened, StraightenError> {
    let mut flips = Vec::new();
    let mut edge: Vec<Option<EdgeId>> = vec![None; lines.len()];
    let mut left: Vec<usize> = (0..lines.len()).collect();
    while let Some(&first) = left.first() {
        let c = &flat.connectivity;
        let runs: Vec<HalfedgeId> = (left.iter())
            .map(|&i| base.edge_halfedge(lines[i]))
            .collect();
        let Some(integers) = flat.correspondences.first() else {
            break;
        };
        let curves = integers.follow(base, c, &runs)?;
        // What was said of lines through faces that flips have changed is out of date: they are for the next round.
        let mut is_changed = FaceVec::filled(false, c.face_count());
        let mut later = Vec::new();
        // Flips move halfedges, not edges.
        let along = |curve: &Followed| curve.along.map(|h| c.edge(h));
        let along: Vec<Option<EdgeId>> = curves.iter().map(along).collect();
        for ((&i, along), Followed { crossing, .. }) in left.iter().zip(along).zip(&curves) {
            if along.is_some() {
                edge[i] = along;
                continue;
            }
            let c = &flat.connectivity;
            let mut faces = crossing.iter().flat_map(|x| faces_beside(c, x.halfedge));
            if faces.any(|f| is_changed[f]) {
                later.push(i);
                continue;
            }
            let before = flips.len();
            let strip = Strip::new(flat, crossing);
            edge[i] = strip.and_then(|mut strip| strip.clear(flat, &mut flips));
            for flip in &flips[before..] {
                // Halfedges keep their faces.
                let faces = [flip.flip.h, flip.flip.t].map(|h| flat.connectivity.face(h));
                faces.into_iter().for_each(|f| is_changed[f] = true);
            }
            let is_edge = |e: &EdgeId| flat.correspondences[0].is_base_edge(*e);
            if edge[i].filter(is_edge).is_none() {
                return Err(StraightenError::Bent { edge: lines[i] });
            }
        }
        if later.len() == left.len() {
            return Err(StraightenError::Bent { edge: lines[first] });
        }
        left = later;
    }
    Ok(Straightened {
        flips,
        edge: edge.into_iter().flatten().collect(),
    })
}

fn faces_beside(c: &Connectivity, h: HalfedgeId) -> [FaceId; 2] {
    [h, c.twin(h).unwrap_or(h)].map(|h| c.face(h))
}

/// On which side of the line a corner of the polygon lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Left,
    Right,
    /// An end of the line.
    On,
}

/// The polygon of faces that a line crosses, laid out in the plane.
struct Strip {
    place: Vec<[f64; 2]>,
    side: Vec<Side>,
    /// Every crossed edge, and the corners that its halfedge runs between.
    crossed: VecDeque<(EdgeId, [usize; 2])>,
    faces: Vec<[usize; 3]>,
    /// ln of the unit of the plane.
    log_unit: f64,
}

impl Strip {
    /// `None` where the lengths make no polygon.
    fn new(flat: &Delaunay, crossing: &[Crossing]) -> Option<Self> {
        let c = &flat.connectivity;
        let log_unit = flat.log_length(c.edge(crossing.first()?.halfedge));
        let length = |h: HalfedgeId| (flat.log_length(c.edge(h)) - log_unit).exp();
        let mut strip = Self {
            place: Vec::new(),
            side: Vec::new(),
            crossed: VecDeque::new(),
            faces: Vec::new(),
            log_unit,
        };
        // The first face: the line begins opposite the first edge, which runs from the right of the line to the left.
        let first = crossing.first()?.halfedge;
        strip.add([0.0; 2], Side::On);
        let from = length(c.prev(first));
        strip.add([from, 0.0], Side::Right);
        let ends = [[0.0; 2], [from, 0.0]];
        let place = apex(ends, [from, length(first)], length(c.next(first)))?;
        strip.add(place, Side::Left);
        strip.faces.push([0, 1, 2]);
        let (mut right, mut left) = (1, 2);
        for (i, x) in crossing.iter().enumerate() {
            let h = x.halfedge;
            let edge = c.edge(h);
            strip.crossed.push_back((
                edge,
                match c.edge_halfedge(edge) == h {
                    true => [right, left],
                    false => [left, right],
                },
            ));
            // Its twin runs from left to right, with the next face beyond.
            let t = c.twin(h)?;
            let base = [left, right].map(|at| strip.place[at]);
            let beyond = apex(
                [base[0], base[1]],
                [length(t), length(c.next(t))],
                length(c.prev(t)),
            )?;
            let next = crossing.get(i + 1).map(|x| x.halfedge);
            let side = match next {
                Some(h) if h == c.next(t) => Side::Left,
                Some(h) if h == c.prev(t) => Side::Right,
                None => Side::On,
                Some(_) => return None,
            };
            let at = strip.add(beyond, side);
            strip.faces.push([left, right, at]);
            match side {
                Side::Left => left = at,
                Side::Right => right = at,
                Side::On => {}
            }
        }
        Some(strip)
    }

    fn add(&mut self, place: [f64; 2], side: Side) -> usize {
        self.place.push(place);
        self.side.push(side);
        self.place.len() - 1
    }

    /// Flips until no edge crosses the line; the edge that the line has become.
    fn clear(&mut self, flat: &mut Delaunay, flips: &mut Vec<EuclidFlip>) -> Option<EdgeId> {
        let mut left_over = 8 * FLAT.len() * (self.crossed.len() + 1).pow(2);
        let (mut line, mut level, mut tried) = (None, 0, 0);
        let mut beside = VecDeque::new();
        while let Some((edge, corners)) = self.crossed.pop_front() {
            left_over = left_over.checked_sub(1)?;
            // All that are left were looked at, and as many cross the line as before.
            if tried > self.crossed.len() && level + 1 < FLAT.len() {
                (level, tried) = (level + 1, 0);
            }
            tried += 1;
            let [a, b] = corners;
            let (above, below) = self.beside(a, b)?;
            let [c, d] = [above.1, below.1];
            let quad = [a, b, c, d].map(|at| self.place[at]);
            let Some(by) = derivatives(quad, FLAT[level]) else {
                self.crossed.push_back((edge, corners));
                continue;
            };
            let corners = self.flip(flat, edge, [a, b, c, d], [above.0, below.0], by, flips)?;
            let sides = corners.map(|at| self.side[at]);
            if let [Side::Left, Side::Right] | [Side::Right, Side::Left] = sides {
                self.crossed.push_back((edge, corners));
                continue;
            }
            (level, tried) = (0, 0);
            match sides {
                [Side::On, Side::On] => line = Some(edge),
                _ => beside.push_back((edge, corners)),
            }
        }
        self.improve(flat, beside, flips)?;
        line
    }

    /// Flips edges that are not Delaunay, `beside` and what is inside the polygon around them; the line stays.
    fn improve(
        &mut self,
        flat: &mut Delaunay,
        mut beside: VecDeque<(EdgeId, [usize; 2])>,
        flips: &mut Vec<EuclidFlip>,
    ) -> Option<()> {
        let count = beside.len();
        let mut left_over = 8 * (count + 1).pow(2);
        let mut settled = 0;
        // Once round without a flip.
        while settled < count && left_over > 0 {
            left_over -= 1;
            settled += 1;
            let Some((edge, [a, b])) = beside.pop_front() else {
                break;
            };
            let (above, below) = self.beside(a, b)?;
            let corners = [a, b, above.1, below.1];
            let quad = corners.map(|at| self.place[at]);
            let by = match is_delaunay(quad) {
                true => None,
                false => derivatives(quad, 0.0),
            };
            let ends = match by {
                None => [a, b],
                Some(by) => {
                    settled = 0;
                    self.flip(flat, edge, corners, [above.0, below.0], by, flips)?
                }
            };
            beside.push_back((edge, ends));
        }
        Some(())
    }

    /// Flips an edge from a to b with c on its left and d on its right, in two faces; the corners that its halfedge runs between then.
    fn flip(
        &mut self,
        flat: &mut Delaunay,
        edge: EdgeId,
        [a, b, c, d]: [usize; 4],
        [above, below]: [usize; 2],
        by: [f64; 5],
        flips: &mut Vec<EuclidFlip>,
    ) -> Option<[usize; 2]> {
        let length = distance(self.place[c], self.place[d]).ln() + self.log_unit;
        let flip = flat.flip_to(edge, length)?;
        let k = &flat.connectivity;
        flips.push(EuclidFlip {
            flip,
            edge,
            outer: flip.moves.map(|(_, to)| k.edge(to)),
            by,
        });
        self.faces[above] = [d, c, a];
        self.faces[below] = [c, d, b];
        Some(match k.edge_halfedge(edge) == flip.h {
            true => [d, c],
            false => [c, d],
        })
    }

    /// The faces left and right of the way from a to b, with the corners opposite.
    fn beside(&self, a: usize, b: usize) -> Option<((usize, usize), (usize, usize))> {
        let other = |way: [usize; 2]| {
            let runs = |face: &[usize; 3], k: usize| [face[k], face[(k + 1) % 3]] == way;
            let faces = self.faces.iter().enumerate();
            faces
                .flat_map(|(f, face)| (0..3).map(move |k| (f, face, k)))
                .find(|&(_, face, k)| runs(face, k))
                .map(|(f, face, k)| (f, face[(k + 2) % 3]))
        };
        Some((other([a, b])?, other([b, a])?))
    }
}

/// The corner on the left of the way from p to q, `base` long, that is `from_q` and `from_p` away from them.
fn apex([p, q]: [[f64; 2]; 2], [base, from_q]: [f64; 2], from_p: f64) -> Option<[f64; 2]> {
    let direction = [(q[0] - p[0]) / base, (q[1] - p[1]) / base];
    let along = 0.5 * (from_p * from_p - from_q * from_q + base * base) / base;
    let across = (from_p - along) * (from_p + along);
    let across = Some(across).filter(|a| *a > 0.0)?.sqrt();
    Some([
        p[0] + along * direction[0] - across * direction[1],
        p[1] + along * direction[1] + across * direction[0],
    ])
}

fn distance(p: [f64; 2], q: [f64; 2]) -> f64 {
    (p[0] - q[0]).hypot(p[1] - q[1])
}

/// Twice the signed area.
fn area([p, q, r]: [[f64; 2]; 3]) -> f64 {
    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
}

/// Whether the angles at c, on the left of the way from a to b, and d, on the right, are half a turn together at most, but for rounding.
fn is_delaunay([a, b, c, d]: [[f64; 2]; 4]) -> bool {
    let dot = |p: [f64; 2], [q, r]: [[f64; 2]; 2]| {
        (q[0] - p[0]) * (r[0] - p[0]) + (q[1] - p[1]) * (r[1] - p[1])
    };
    let (above, below) = (area([a, b, c]), area([b, a, d]));
    let sine = dot(c, [a, b]) * below + dot(d, [a, b]) * above;
    let size = distance(a, b) * distance(c, d);
    sine >= -ROUNDING * size * size
}

/// ∂ ln l_dc / ∂ ln l of ab, ca, ad, db, bc for c on the left of ab and d on the right; `None` where the quad is not strictly convex, or a face of the other diagonal smaller than `least`.
///
/// The six distances of four points in the plane keep Σ ω_ij l_ij dl_ij = 0 with ω_ij = 1 / (A_ijk A_ijl), A the signed areas.
fn derivatives([a, b, c, d]: [[f64; 2]; 4], least: f64) -> Option<[f64; 5]> {
    let (abc, abd) = (area([a, b, c]), area([a, b, d]));
    let (dca, dcb) = (area([d, c, a]), area([d, c, b]));
    let size = [distance(a, b), distance(c, d)]
        .into_iter()
        .fold(0.0, f64::max);
    let least = least * size * size;
    let is_convex = abc > 0.0 && abd < 0.0 && dca > least && dcb < -least;
    if !is_convex {
        return None;
    }
    // Orientations in the order of the names of each edge: [ca b], [ca d], and so on.
    let stress = |x: f64, y: f64| 1.0 / (x * y);
    let (cab, cad) = (abc, dca);
    let (adb, adc) = (-abd, dca);
    let (dba, dbc) = (-abd, -dcb);
    let (bca, bcd) = (abc, -dcb);
    let squared = |p, q| {
        let l: f64 = distance(p, q);
        l * l
    };
    let whole = stress(dca, dcb) * squared(d, c);
    let parts = [
        stress(abc, abd) * squared(a, b),
        stress(cab, cad) * squared(c, a),
        stress(adb, adc) * squared(a, d),
        stress(dba, dbc) * squared(d, b),
        stress(bca, bcd) * squared(b, c),
    ];
    let by = parts.map(|part| -part / whole);
    by.iter().all(|x| x.is_finite()).then_some(by)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_those_of_the_distance() {
        let quad = [[0.0, 0.0], [2.0, 0.1], [0.9, 1.3], [1.2, -0.4]];
        let [a, b, c, d] = quad;
        let sides = [[a, b], [c, a], [a, d], [d, b], [b, c]].map(|[p, q]| distance(p, q));
        let diagonal = |[ab, ca, ad, db, bc]: [f64; 5]| {
            let ends = [[0.0, 0.0], [ab, 0.0]];
            let c = apex(ends, [ab, bc], ca).unwrap();
            let d = apex([ends[1], ends[0]], [ab, ad], db).unwrap();
            distance(c, d).ln()
        };
        let by = derivatives(quad, FLAT[1]).unwrap();
        for k in 0..5 {
            let h = 1e-6;
            let at = |h: f64| {
                let mut sides = sides;
                sides[k] *= h.exp();
                diagonal(sides)
            };
            let slope = (at(h) - at(-h)) / (2.0 * h);
            assert!(
                (slope - by[k]).abs() < 1e-8,
                "{k}: {slope} against {}",
                by[k]
            );
        }
        assert_eq!(derivatives([a, b, c, [3.0, 0.2]], 0.0), None);
        // The corners a, c and d on one line but for rounding: the flip would make a face of them.
        let on_line = [[0.0, 1e-13], [2.0, 0.1], [0.5, 1.0], [-0.5, -1.0]];
        assert_eq!(derivatives(on_line, FLAT[5]), None);
        assert!(derivatives(on_line, 0.0).is_some());
    }
}
