//! Where hyperbolic geodesics, the edges of the final triangulation C, cross the edges of B.
//!
//! *Enters:* the halfedges of B that an edge of C crosses. *Leaves:* for each the place on the edge of B and on the edge of C.
//! *Guaranteed:* logarithms with full relative accuracy however long the strip is: every number is a sum of positive ones.
//!
//! Let every vertex a be a vector v_a on the light cone with −2⟨v_a, v_b⟩ = λ_ab², where λ is the Penner length at u = 0. In
//! a face of B, whose three vectors are put at height 1 over its Euclidean triangle, the circumcircle is the light cone and geodesics
//! are straight. The geodesic pq meets the geodesic ab where x = α v_a + β v_b = γ v_p + δ v_q, and since |det(v_p, v_q, v_a)|
//! is proportional to λ_pq λ_qa λ_ap,
//!
//! ```text
//! α : β = λ_bp λ_bq : λ_ap λ_aq,    γ : δ = λ_aq λ_bq : λ_ap λ_bp,    α β λ_ab² = γ δ λ_pq².
//! ```
//!
//! The λ between p or q and the vertices of the strip follow from Ptolemy's theorem, face by face. With the scale u, v_p becomes
//! e^{u_p} v_p, so the same x has the barycentric weights γ e^{−u_p} and δ e^{−u_q} on the flat edge.

use super::PositionsError;
use super::crossed::twin;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, HalfedgeId};

/// An edge of C crosses an edge ab of B.
#[derive(Clone, Copy, Debug)]
pub(super) struct GeodesicPoint {
    /// Fraction of the edge of B, from the tail of its `edge_halfedge`.
    pub on_delaunay: f64,
    /// Where on the edge of C.
    pub weights: Weights,
}

/// A point x = γ v_p + δ v_q of an edge of C that runs from p to q, by the logarithms of γ and δ.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights {
    ln_gamma: f64,
    ln_delta: f64,
}

impl Weights {
    /// The end p.
    pub(super) const TAIL: Weights = Weights {
        ln_gamma: 0.0,
        ln_delta: f64::NEG_INFINITY,
    };
    /// The end q.
    pub(super) const HEAD: Weights = Weights {
        ln_gamma: f64::NEG_INFINITY,
        ln_delta: 0.0,
    };

    /// The point at a fraction of the straight segment from `from` to `to`; both at height 1 in one face.
    pub(super) fn between(from: Weights, to: Weights, fraction: f64) -> Weights {
        let (near, far) = ((1.0 - fraction).ln(), fraction.ln());
        Weights {
            ln_gamma: ln_sum(near + from.ln_gamma, far + to.ln_gamma),
            ln_delta: ln_sum(near + from.ln_delta, far + to.ln_delta),
        }
    }

    /// Fraction of the flat edge, where the logarithm of the scale is `u_tail` at p and `u_head` at q.
    pub(super) fn on_flat(self, u_tail: f64, u_head: f64) -> f64 {
        logistic(self.ln_delta - self.ln_gamma + u_tail - u_head)
    }
}

/// ln(e^a + e^b).
fn ln_sum(a: f64, b: f64) -> f64 {
    let (small, large) = if a < b { (a, b) } else { (b, a) };
    if small == f64::NEG_INFINITY {
        large
    } else {
        large + (small - large).exp().ln_1p()
    }
}

/// 1 / (1 + e^{−x}).
fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

/// λ between an end of the curve and both ends of a crossed halfedge, tail first, as logarithms.
type Reach = [f64; 2];

/// Appends one point a crossed halfedge. `forward` is scratch space.
///
/// `ln_length` has the logarithm of the length of every edge of B.
pub(super) fn geodesic(
    delaunay: &Connectivity,
    ln_length: &EdgeVec<f64>,
    strip: &[HalfedgeId],
    forward: &mut Vec<Reach>,
    points: &mut Vec<GeodesicPoint>,
) -> Result<(), PositionsError> {
    let (Some(&start), Some(&last)) = (strip.first(), strip.last()) else {
        return Ok(());
    };
    let ln = |h: HalfedgeId| ln_length[delaunay.edge(h)];
    // From p: across a→b to the apex c of the face beyond, whose sides are b→a, a→c and c→b.
    forward.clear();
    let mut reach = [ln(delaunay.prev(start)), ln(delaunay.next(start))];
    let mut ln_whole = 0.0;
    for (i, &h) in strip.iter().enumerate() {
        forward.push(reach);
        let t = twin(delaunay, h)?;
        let (ac, cb) = (delaunay.next(t), delaunay.prev(t));
        let beyond = ln_sum(reach[0] + ln(cb), reach[1] + ln(ac)) - ln(h);
        match strip.get(i + 1) {
            None => ln_whole = beyond,
            Some(&next) if next == ac => reach[1] = beyond,
            Some(&next) if next == cb => reach[0] = beyond,
            Some(_) => return Err(PositionsError::Strip),
        }
    }
    // From q, backward; each face again has the sides b→a, a→c and c→b, and one of a and b is new.
    let before = points.len();
    let t = twin(delaunay, last)?;
    let mut back = [ln(delaunay.next(t)), ln(delaunay.prev(t))];
    for (i, &h) in strip.iter().enumerate().rev() {
        if let Some(&next) = strip.get(i + 1) {
            let t = twin(delaunay, h)?;
            let (ac, cb) = (delaunay.next(t), delaunay.prev(t));
            if next == ac {
                back[1] = ln_sum(back[0] + ln(cb), back[1] + ln(h)) - ln(ac);
            } else {
                back[0] = ln_sum(back[0] + ln(h), back[1] + ln(ac)) - ln(cb);
            }
        }
        let [pa, pb] = forward[i];
        let [qa, qb] = back;
        let odds = (pa + qa) - (pb + qb);
        let t = logistic(odds);
        // ln α + ln β with α + β = 1, whichever of them is small.
        let ln_product = -odds.abs() - 2.0 * (-odds.abs()).exp().ln_1p();
        let sum = ln_product + 2.0 * (ln(h) - ln_whole);
        let difference = (pa + pb) - (qa + qb);
        let along = h == delaunay.edge_halfedge(delaunay.edge(h));
        points.push(GeodesicPoint {
            on_delaunay: if along { t } else { 1.0 - t },
            weights: Weights {
                ln_gamma: 0.5 * (sum - difference),
                ln_delta: 0.5 * (sum + difference),
            },
        });
    }
    points[before..].reverse();
    Ok(())
}

/// A point of an edge of C that is an edge of B too, at a fraction from p.
pub(super) fn on_shared_edge(fraction: f64) -> Weights {
    Weights::between(Weights::TAIL, Weights::HEAD, fraction)
}
