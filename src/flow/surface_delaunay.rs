//! The intrinsic Delaunay triangulation of a surface's own metric: from A to B (`docs/method.md`, 2, "Flips").
//!
//! *Enters:* connectivity A and its lengths. *Leaves:* B with its lengths, and the edges of A on it. The surface stays as it is, so what is computed on B belongs to
//! the surface and not to its accidental edges. *Guaranteed:* the same B for the same ids and lengths.
//!
//! A surface with boundary is doubled. Its own edges are flipped first, those of its mirror image with them: that leads to the symmetric triangulation T, which holds the mirror.
//! Where a corner opposite the mirror is obtuse, the edge on the mirror is flipped too on the way from T to B, which need not be symmetric. Features are edges that T holds; along
//! some of them the surface may be cut open, so that they lie on the mirror.

use crate::flow::correspondence::Correspondence;
use crate::flow::delaunay::{Delaunay, PtolemyFlip};
use crate::flow::doubled::Doubled;
use crate::flow::intrinsic::Intrinsic;
use crate::flow::mirror::copies;
use crate::flow::opened::Opened;
use crate::geometry::connectivity::{Connectivity, ConnectivityError};
use crate::geometry::ids::{EdgeId, EdgeVec, VertexId, VertexVec};

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
    /// T, where the surface has a boundary or features.
    pub symmetric: Option<Box<Symmetric>>,
}

/// T and the way from there to B.
#[derive(Clone, Debug)]
pub struct Symmetric {
    /// T. Its first faces and vertices are the surface's own.
    pub connectivity: Connectivity,
    /// ln of the length of every edge of T, source units.
    pub log_length: EdgeVec<f64>,
    /// From T to B.
    pub flips: Vec<PtolemyFlip>,
}

impl SurfaceDelaunay {
    /// Flips the surface's edges; `source_length` has one length an edge, positive and finite.
    pub fn new(
        surface: &Connectivity,
        source_length: &EdgeVec<f64>,
    ) -> Result<Self, ConnectivityError> {
        Self::of(surface, source_length, surface, &[])
    }

    /// The same of a surface that was cut open along some of its `features`, edges of `surface`. All of them are edges of T, which is the same wherever it is cut open.
    pub fn along_features(
        surface: &Connectivity,
        source_length: &EdgeVec<f64>,
        opened: &Opened,
        features: &[EdgeId],
    ) -> Result<Self, ConnectivityError> {
        Self::of(surface, source_length, &opened.connectivity, features)
    }

    fn of(
        surface: &Connectivity,
        source_length: &EdgeVec<f64>,
        opened: &Connectivity,
        features: &[EdgeId],
    ) -> Result<Self, ConnectivityError> {
        let doubled = Doubled::new(opened)?;
        let length = |e| source_length[surface.edge(opened.edge_halfedge(e))];
        let length: EdgeVec<f64> = opened.edges().map(length).collect();
        let base_length = doubled.on_both(opened, &length);
        let Doubled {
            connectivity: base,
            original,
        } = doubled;
        let identity = Correspondence::identity(&base);
        let mut delaunay = Delaunay::new(base.clone(), &base_length, vec![identity]);
        let mut symmetric = None;
        if !opened.is_closed() || !features.is_empty() {
            flip_both(&mut delaunay, surface, source_length, features);
            symmetric = Some(Box::new(Symmetric {
                connectivity: delaunay.connectivity.clone(),
                log_length: delaunay.log_lengths(),
                flips: Vec::new(),
            }));
            delaunay.record = Some(Vec::new());
        }
        delaunay.flip_in_the_surface();
        if let Some(symmetric) = &mut symmetric {
            symmetric.flips = delaunay.record.take().unwrap_or_default();
        }
        Ok(Self {
            base,
            base_length,
            original,
            log_length: delaunay.log_lengths(),
            flips: delaunay.flips,
            base_on_delaunay: delaunay.correspondences.swap_remove(0),
            delaunay: delaunay.connectivity,
            symmetric,
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

    /// ln of the lengths of a metric on B from those on T (Penner coordinates); they are the same where the surface is closed.
    pub fn on_delaunay(&self, mut on_symmetric: EdgeVec<f64>) -> EdgeVec<f64> {
        let flips = self.symmetric.iter().flat_map(|s| &s.flips);
        flips.for_each(|flip| flip.swap(&mut on_symmetric));
        on_symmetric
    }

    /// The other way round.
    pub fn on_symmetric(&self, mut on_delaunay: EdgeVec<f64>) -> EdgeVec<f64> {
        let flips = self.symmetric.iter().flat_map(|s| &s.flips);
        flips.rev().for_each(|flip| flip.swap(&mut on_delaunay));
        on_delaunay
    }

    /// Length of every edge of B, source units.
    pub fn length(&self) -> EdgeVec<f64> {
        self.log_length.iter().map(|l| l.exp()).collect()
    }
}

/// Flips `both`, the double of `surface` or of what is left of it, to T: the surface's own edges but the features until they are Delaunay, and their mirror images alike.
fn flip_both(
    both: &mut Delaunay,
    surface: &Connectivity,
    source_length: &EdgeVec<f64>,
    features: &[EdgeId],
) {
    let double = both.connectivity.clone();
    let is_double = double.halfedge_count() > surface.halfedge_count();
    let mut held = EdgeVec::filled(false, surface.edge_count());
    features.iter().for_each(|&e| held[e] = true);
    let mut alone = Delaunay::new(surface.clone(), source_length, Vec::new()).holding(held);
    alone.record = Some(Vec::new());
    alone.flip_in_the_surface();
    let log_length = alone.log_lengths();
    for flip in alone.record.iter().flatten() {
        let copies = match is_double {
            true => copies(surface, &double, surface.halfedge_count(), flip.edge),
            false => [double.edge(surface.edge_halfedge(flip.edge)); 2],
        };
        for &e in &copies[..1 + usize::from(is_double)] {
            both.flip_to(e, log_length[flip.edge]);
        }
    }
}
