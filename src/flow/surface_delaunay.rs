//! The intrinsic Delaunay triangulation of a surface's own metric: from A to B (`docs/method.md`, 2, "Flips").
//!
//! *Enters:* connectivity A and its lengths. *Leaves:* B with its lengths, and the edges of A on it. The surface stays as it is, so what is computed on B belongs to
//! the surface and not to its accidental edges. *Guaranteed:* the same B for the same ids and lengths. A surface with boundary is doubled.

use crate::flow::correspondence::Correspondence;
use crate::flow::delaunay::Delaunay;
use crate::flow::doubled::Doubled;
use crate::flow::intrinsic::Intrinsic;
use crate::geometry::connectivity::{Connectivity, ConnectivityError};
use crate::geometry::ids::{EdgeVec, VertexId, VertexVec};

/// A and B.
#[derive(Clone, Debug)]
pub struct SurfaceDelaunay {
    /// A, doubled where the surface has a boundary.
    pub base: Connectivity,
    /// Length of every edge of A, source units.
    pub base_length: EdgeVec<f64>,
    /// Every vertex as one of the surface.
    pub original: VertexVec<VertexId>,
    /// B.
    pub delaunay: Connectivity,
    /// ln of the length of every edge of B, source units.
    pub log_length: EdgeVec<f64>,
    /// Number of flips from A to B.
    pub flips: usize,
    /// Edges of A on B.
    pub base_on_delaunay: Correspondence,
}

impl SurfaceDelaunay {
    /// Flips the surface's edges; `source_length` has one length an edge, positive and finite.
    pub fn new(
        surface: &Connectivity,
        source_length: &EdgeVec<f64>,
    ) -> Result<Self, ConnectivityError> {
        let doubled = Doubled::new(surface)?;
        let base_length = doubled.on_both(surface, source_length);
        let Doubled {
            connectivity: base,
            original,
        } = doubled;
        let identity = Correspondence::identity(&base);
        let mut delaunay = Delaunay::new(base.clone(), &base_length, vec![identity]);
        delaunay.flip_in_the_surface();
        Ok(Self {
            base,
            base_length,
            original,
            log_length: delaunay.log_lengths(),
            flips: delaunay.flips,
            base_on_delaunay: delaunay.correspondences.swap_remove(0),
            delaunay: delaunay.connectivity,
        })
    }

    /// The three triangulations. `flat`: C, with the correspondences of A and of B with it, in that order; the other values as in [`Intrinsic`].
    pub fn leave(
        self,
        front_faces: usize,
        mut flat: Delaunay,
        penner: EdgeVec<f64>,
        u: VertexVec<f64>,
        delaunay_penner: Option<EdgeVec<f64>>,
    ) -> Intrinsic {
        let delaunay_length = self.length();
        let delaunay_on_flat = flat.correspondences.swap_remove(1);
        let base_on_flat = flat.correspondences.swap_remove(0);
        Intrinsic {
            base: self.base,
            base_length: self.base_length,
            front_faces,
            delaunay: self.delaunay,
            delaunay_length,
            delaunay_penner,
            flat: flat.connectivity,
            penner,
            u,
            base_on_delaunay: self.base_on_delaunay,
            delaunay_on_flat,
            base_on_flat,
        }
    }

    /// Length of every edge of B, source units.
    pub fn length(&self) -> EdgeVec<f64> {
        self.log_length.iter().map(|l| l.exp()).collect()
    }
}
