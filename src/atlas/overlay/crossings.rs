//! Crossings of base edges (A) with final edges (C), seen from either.
//!
//! *Enters:* the curves of A on C and a fraction along both for every crossing. *Leaves:* the i-th crossing of a base
//! halfedge, and the place of a crossing along a final halfedge. *Guaranteed:* ranks on every final edge are a
//! permutation, fractions are strictly inside (0, 1) and increase along both edges; anything else is an error.

use super::OverlayError;
use super::flat_face::Fractions;
use crate::flow::correspondence::Curves;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, HalfedgeId, NONE};

/// Crossings with their fractions; see the module docs.
pub(super) struct Crossings<'a> {
    pub base: &'a Connectivity,
    pub flat: &'a Connectivity,
    pub curves: &'a Curves,
    pub on_base: &'a [f64],
    pub on_flat: &'a [f64],
    /// Crossings on final edge e, from the tail of `edge_halfedge(e)`: `along[along_first[e]..along_first[e + 1]]`.
    pub along: Vec<u32>,
    pub along_first: Vec<u32>,
}

/// A crossing met on the way along a base halfedge.
#[derive(Clone, Copy)]
pub(super) struct Met {
    /// Index into `curves.crossing`.
    pub index: usize,
    /// The final halfedge through which its face is left; the twin is in the face that is entered.
    pub leaves: HalfedgeId,
}

impl<'a> Crossings<'a> {
    pub fn new(
        base: &'a Connectivity,
        flat: &'a Connectivity,
        curves: &'a Curves,
        on_base: &'a [f64],
        on_flat: &'a [f64],
    ) -> Result<Self, OverlayError> {
        let count = curves.crossing.len();
        if on_base.len() != count || on_flat.len() != count {
            return Err(OverlayError::Positions);
        }
        let mut first = vec![0u32; flat.edge_count() + 1];
        for x in &curves.crossing {
            first[flat.edge(x.halfedge).index() + 1] += 1;
        }
        for e in 0..flat.edge_count() {
            first[e + 1] += first[e];
        }
        let mut this = Self {
            base,
            flat,
            curves,
            on_base,
            on_flat,
            along: vec![NONE; count],
            along_first: first,
        };
        for index in 0..count {
            let e = flat.edge(curves.crossing[index].halfedge);
            let rank = this.rank(index, flat.edge_halfedge(e));
            let range = this.range(e);
            match this.along[range].get_mut(rank) {
                Some(place) if *place == NONE => *place = index as u32,
                _ => return Err(OverlayError::inconsistent("final edge", e.index())),
            }
        }
        this.check_order()?;
        Ok(this)
    }

    fn check_order(&self) -> Result<(), OverlayError> {
        for e in self.base.edges() {
            let range = self.curves.range(e);
            if !increases(self.on_base[range].iter().copied()) {
                return Err(OverlayError::Positions);
            }
        }
        for e in self.flat.edges() {
            let range = &self.along[self.range(e)];
            if !increases(range.iter().map(|&i| self.on_flat[i as usize])) {
                return Err(OverlayError::Positions);
            }
        }
        Ok(())
    }

    /// Crossings on a final edge, as a range of `along`.
    pub fn range(&self, flat_edge: EdgeId) -> std::ops::Range<usize> {
        let e = flat_edge.index();
        self.along_first[e] as usize..self.along_first[e + 1] as usize
    }

    /// Number of crossings on the edge of a final halfedge.
    #[inline]
    pub fn count(&self, flat_halfedge: HalfedgeId) -> usize {
        self.range(self.flat.edge(flat_halfedge)).len()
    }

    /// Number of crossings before this one along a halfedge of its final edge.
    #[inline]
    pub fn rank(&self, index: usize, along: HalfedgeId) -> usize {
        let x = self.curves.crossing[index];
        match x.halfedge == along {
            true => x.rank as usize,
            // Wraps where the rank is out of range: then it is in no range.
            false => self
                .count(along)
                .wrapping_sub(1)
                .wrapping_sub(x.rank as usize),
        }
    }

    /// Fraction of a crossing along a halfedge of its final edge.
    #[inline]
    pub fn fraction(&self, index: usize, along: HalfedgeId) -> f64 {
        self.fractions(index, along)[0]
    }

    /// Fractions of a halfedge of the final edge before a crossing and behind it.
    #[inline]
    pub fn fractions(&self, index: usize, along: HalfedgeId) -> Fractions {
        let s = self.on_flat[index];
        match self.flat.edge_halfedge(self.flat.edge(along)) == along {
            true => [s, 1.0 - s],
            false => [1.0 - s, s],
        }
    }

    /// Number of crossings on a base halfedge.
    #[inline]
    pub fn met(&self, base_halfedge: HalfedgeId) -> usize {
        self.curves.range(self.base.edge(base_halfedge)).len()
    }

    /// The i-th crossing on a base halfedge, from 1.
    #[inline]
    pub fn meet(&self, base_halfedge: HalfedgeId, i: usize) -> Result<Met, OverlayError> {
        let e = self.base.edge(base_halfedge);
        let range = self.curves.range(e);
        let (index, forward) = match self.base.edge_halfedge(e) == base_halfedge {
            true => (range.start + i - 1, true),
            false => (range.end - i, false),
        };
        let halfedge = self.curves.crossing[index].halfedge;
        let leaves = match forward {
            true => halfedge,
            false => self.other(halfedge)?,
        };
        Ok(Met { index, leaves })
    }

    /// Fractions of a base halfedge before a crossing and behind it.
    #[inline]
    pub fn base_fractions(&self, index: usize, base_halfedge: HalfedgeId) -> Fractions {
        let s = self.on_base[index];
        match self.base.edge_halfedge(self.base.edge(base_halfedge)) == base_halfedge {
            true => [s, 1.0 - s],
            false => [1.0 - s, s],
        }
    }

    /// The final halfedge that a base halfedge is, where nothing crosses it.
    pub fn coincident(&self, base_halfedge: HalfedgeId) -> Result<HalfedgeId, OverlayError> {
        let edge = self.base.edge(base_halfedge);
        let error = || OverlayError::inconsistent("base edge", edge.index());
        let same = self.curves.coincident[edge].ok_or_else(error)?;
        match self.base.edge_halfedge(edge) == base_halfedge {
            true => Ok(same),
            false => self.other(same),
        }
    }

    /// The other halfedge of a final edge. The final triangulation is closed.
    #[inline]
    pub fn other(&self, flat_halfedge: HalfedgeId) -> Result<HalfedgeId, OverlayError> {
        let edge = self.flat.edge(flat_halfedge).index();
        let twin = self.flat.twin(flat_halfedge);
        twin.ok_or_else(|| OverlayError::inconsistent("final edge", edge))
    }
}

/// True where the values lie strictly between 0 and 1, each above the one before.
fn increases(values: impl Iterator<Item = f64>) -> bool {
    let mut last = 0.0;
    for x in values {
        // NaN is above nothing.
        if x <= last || x.is_nan() {
            return false;
        }
        last = x;
    }
    last < 1.0
}
