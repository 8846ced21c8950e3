//! Where base edges cross the edges of the final triangulation: places for the vertices of the overlay.
//!
//! *Enters:* the three triangulations of the flow, and the edges of A as curves on C. *Leaves:* for every crossing its place on
//! the base edge and on the flat edge. *Guaranteed:* whatever the rounding, places increase strictly along every base edge in
//! the order of the curve and along every flat edge in the order of the ranks, with room between them ([`SPACING`], [`SPACING_UNDER_GRID`]):
//! the integers say what crosses what, geometry only where. *Not guaranteed:* that a place is exact. Where two crossings would
//! be closer than the spacing they are pushed apart, and where the drawn curves bound a bigon that minimal position
//! does not have, the places are those before it was removed.
//!
//! How: edges of A are straight in the metric of B (`straight`), edges of C are hyperbolic geodesics (`geodesic`); both are straight
//! segments inside the faces of B, so that each base edge gets a list of drawn crossings (`words`, `chords`). That holds where the flat metric is not
//! conformal too: a point with barycentric coordinates b over a face's triangle is then Σ b_i v_i of the vectors v of B's Penner lengths
//! at u = 0, which is a projective map on each face and agrees on their sides. Drawn curves need
//! not be in minimal position; reduced, they are the curves that the integers say (`matching`), and pass their places on to them. At last
//! the places are put in order (`spacing`).

mod chords;
mod crossed;
mod geodesic;
mod matching;
mod spacing;
mod straight;
mod words;

pub use spacing::{SPACING, SPACING_UNDER_GRID};

use crate::flow::correspondence::{CorrespondenceError, Curves};
use crate::flow::intrinsic::Intrinsic;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, EdgeVec, HalfedgeId};
use crossed::{Crossed, gather, twin};
use geodesic::GeodesicPoint;
use words::{Drawing, Scratch};

/// Where base edges (A) and final edges (C) cross. Both vectors go with `Curves::crossing`.
#[derive(Clone, Debug, PartialEq)]
pub struct Positions {
    /// Fraction of the base edge's length, from the tail of `base.edge_halfedge(e)`; in (0, 1).
    pub on_base: Vec<f64>,
    /// Fraction of the flat edge's length (the metric of C with the scale u), from the tail of `flat.edge_halfedge(c)`; in (0, 1).
    pub on_flat: Vec<f64>,
    /// Number of crossings that the drawn curves do not have, so that their places are guessed from their
    /// neighbours'. 0 where the three correspondences belong together.
    pub unmatched: usize,
}

/// Why there are no positions.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PositionsError {
    /// One of the correspondences cannot be traced.
    #[error(transparent)]
    Correspondence(#[from] CorrespondenceError),
    /// Curves, lengths and triangulations are not of one surface.
    #[error(
        "curves, lengths and triangulations do not have the same numbers of edges, faces and vertices"
    )]
    Sizes,
    /// A length is not a positive number.
    #[error("edge {edge} of the Delaunay triangulation has length {length}")]
    Length {
        /// Edge of B.
        edge: usize,
        /// Its length.
        length: f64,
    },
    /// The ranks of the crossings on an edge are not 0, 1, 2, ….
    #[error("the crossings on edge {edge} are not numbered one by one")]
    Ranks {
        /// Edge that is crossed.
        edge: usize,
    },
    /// Two successive crossings of a curve are not in one face.
    #[error("a curve leaves a face that it has not entered")]
    Strip,
    /// An edge has one face only.
    #[error("a triangulation has a boundary; it must be doubled")]
    Open,
}

/// Places of all crossings of base edges with final edges.
///
/// `curves` are the edges of A on C, traced from `intrinsic.base_on_flat`. Linear in the number of crossings among the three
/// triangulations; the result does not depend on the number of threads. `spacing`: room between the crossings of an edge, as in [`SPACING`].
pub fn positions(
    intrinsic: &Intrinsic,
    curves: &Curves,
    spacing: f64,
) -> Result<Positions, PositionsError> {
    let (base, delaunay, flat) = (&intrinsic.base, &intrinsic.delaunay, &intrinsic.flat);
    let (base_on_delaunay, delaunay_on_flat) = rayon::join(
        || intrinsic.base_on_delaunay.trace(base, delaunay),
        || intrinsic.delaunay_on_flat.trace(delaunay, flat),
    );
    placed(
        intrinsic,
        &base_on_delaunay?,
        &delaunay_on_flat?,
        curves,
        spacing,
    )
}

/// The same from curves that are traced already: A on B, B on C and A on C.
fn placed(
    intrinsic: &Intrinsic,
    base_on_delaunay: &Curves,
    delaunay_on_flat: &Curves,
    curves: &Curves,
    spacing: f64,
) -> Result<Positions, PositionsError> {
    let (base, delaunay, flat) = (&intrinsic.base, &intrinsic.delaunay, &intrinsic.flat);
    for (curves, from, to) in [
        (base_on_delaunay, base, delaunay),
        (delaunay_on_flat, delaunay, flat),
        (curves, base, flat),
    ] {
        check(curves, from, to)?;
    }
    let ln_length = logarithms(intrinsic)?;
    let on_flat = Crossed::new(curves, flat)?;

    // Where A and C meet the edges of B.
    let base_on = Crossed::new(base_on_delaunay, delaunay)?;
    let length = &intrinsic.delaunay_length;
    let mut straight = gather(base.edge_count(), Vec::new, |e, placed, points| {
        let strip = &base_on_delaunay.crossing[base_on_delaunay.range(EdgeId::new(e))];
        straight::straight(delaunay, length, strip, placed, points)
    })?;
    let mut geodesic = geodesics(delaunay, flat, &ln_length, delaunay_on_flat)?;
    let before = Drawing::merge(
        delaunay,
        &base_on,
        &mut straight,
        delaunay_on_flat,
        &mut geodesic,
    );
    let drawing = Drawing {
        intrinsic,
        base: base_on_delaunay,
        straight,
        before,
        delaunay: delaunay_on_flat,
        geodesic,
    };

    // Where they meet each other, then in order.
    let missing = [f64::NAN; 2];
    let mut places = gather(
        base.edge_count(),
        || (Scratch::default(), Vec::new(), Vec::new(), Vec::new()),
        |e, (scratch, word, values, blocks), places| {
            let minimal = &curves.crossing[curves.range(EdgeId::new(e))];
            if minimal.is_empty() {
                return Ok(());
            }
            drawing.word(EdgeId::new(e), scratch, word)?;
            matching::reduce(flat, word);
            let first = places.len();
            places.resize(first + minimal.len(), (missing, false));
            matching::matched(flat, word, minimal, |i, drawn| {
                places[first + i] = ([drawn.on_base, drawn.on_flat], true);
            });
            values.clear();
            values.extend(places[first..].iter().map(|place| place.0[0]));
            spacing::fill(values);
            spacing::spread(values, spacing, blocks);
            for (place, &value) in places[first..].iter_mut().zip(values.iter()) {
                place.0[0] = value;
            }
            Ok(())
        },
    )?;
    let ordered = gather(
        flat.edge_count(),
        || (Vec::new(), Vec::new()),
        |c, (values, blocks), ordered| {
            let crossings = on_flat.on(EdgeId::new(c));
            values.clear();
            values.extend(crossings.iter().map(|&i| places[i as usize].0[1]));
            spacing::fill(values);
            spacing::spread(values, spacing, blocks);
            ordered.extend(crossings.iter().copied().zip(values.iter().copied()));
            Ok(())
        },
    )?;
    for (i, value) in ordered {
        places[i as usize].0[1] = value;
    }
    Ok(Positions {
        on_base: places.iter().map(|place| place.0[0]).collect(),
        on_flat: places.iter().map(|place| place.0[1]).collect(),
        unmatched: places.iter().filter(|place| !place.1).count(),
    })
}

/// The edges of C on B, and where they cross: one point a crossing of the edges of B on C, in that order.
fn geodesics(
    delaunay: &Connectivity,
    flat: &Connectivity,
    ln_length: &EdgeVec<f64>,
    curves: &Curves,
) -> Result<Vec<GeodesicPoint>, PositionsError> {
    let crossed = Crossed::new(curves, flat)?;
    // The edge of B of every crossing.
    let mut edge = Vec::with_capacity(curves.crossing.len());
    for e in delaunay.edges() {
        edge.resize(edge.len() + curves.range(e).len(), e);
    }
    let found = gather(
        flat.edge_count(),
        || (Vec::new(), Vec::new(), Vec::new()),
        |c, (strip, forward, points), found| {
            let c = EdgeId::new(c);
            strip.clear();
            for &j in crossed.on(c) {
                let run = delaunay.edge_halfedge(edge[j as usize]);
                // B runs through the halfedge of C from its left to its right: that one comes from the right of B.
                let up = curves.crossing[j as usize].halfedge == flat.edge_halfedge(c);
                strip.push(if up { twin(delaunay, run)? } else { run });
            }
            if let Some(&start) = strip.first() {
                check_start(delaunay, flat, c, start)?;
            }
            points.clear();
            geodesic::geodesic(delaunay, ln_length, strip, forward, points)?;
            found.extend(crossed.on(c).iter().copied().zip(points.iter().copied()));
            Ok(())
        },
    )?;
    let mut points = vec![None; curves.crossing.len()];
    for (j, point) in found {
        points[j as usize] = Some(point);
    }
    points
        .into_iter()
        .collect::<Option<Vec<_>>>()
        .ok_or(PositionsError::Sizes)
}

/// An edge of C must begin in the vertex opposite the first edge of B that it crosses.
fn check_start(
    delaunay: &Connectivity,
    flat: &Connectivity,
    c: EdgeId,
    start: HalfedgeId,
) -> Result<(), PositionsError> {
    if flat.edge_vertices(c)[0] == delaunay.apex(start) {
        Ok(())
    } else {
        Err(PositionsError::Strip)
    }
}

/// ln of the lengths that B has at u = 0, and a check of the sizes of everything that is indexed.
fn logarithms(intrinsic: &Intrinsic) -> Result<EdgeVec<f64>, PositionsError> {
    let (delaunay, flat) = (&intrinsic.delaunay, &intrinsic.flat);
    let length = &intrinsic.delaunay_length;
    let vertices = intrinsic.u.len();
    let penner = intrinsic.delaunay_penner.as_ref();
    if length.len() != delaunay.edge_count()
        || penner.is_some_and(|penner| penner.len() != delaunay.edge_count())
        || [&intrinsic.base, delaunay, flat]
            .iter()
            .any(|surface| surface.vertex_count() != vertices)
    {
        return Err(PositionsError::Sizes);
    }
    if let Some((e, &length)) = length
        .enumerate()
        .find(|&(_, &length)| !(length > 0.0 && length.is_finite()))
    {
        let edge = e.index();
        return Err(PositionsError::Length { edge, length });
    }
    Ok(match penner {
        Some(penner) => penner.clone(),
        None => length.iter().map(|length| length.ln()).collect(),
    })
}

/// Curves of the edges of `from` on `to`: as many as there are edges, and halfedges that exist.
fn check(curves: &Curves, from: &Connectivity, to: &Connectivity) -> Result<(), PositionsError> {
    let first = &curves.first;
    let fits = first.len() == from.edge_count() + 1
        && first.first() == Some(&0)
        && first.is_sorted()
        && first
            .last()
            .is_some_and(|&n| n as usize == curves.crossing.len())
        && curves.coincident.len() == from.edge_count()
        && curves
            .crossing
            .iter()
            .map(|x| x.halfedge)
            .chain(curves.coincident.iter().copied().flatten())
            .all(|h| h.index() < to.halfedge_count());
    fits.then_some(()).ok_or(PositionsError::Sizes)
}

#[cfg(test)]
mod tests;
