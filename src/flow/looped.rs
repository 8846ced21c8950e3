//! The closed triangulation on which cross fields and seamless metrics are found, with its loops.
//!
//! *Enters:* a surface with its Delaunay triangulation. *Leaves:* that triangulation, or the symmetric one of the double where the surface has a boundary, with
//! loops whose turnings decide those of all others. A surface that was cut open along features may be in several pieces. *Guaranteed:* the same loops, in the same order, for the same surface: what is found for them by one
//! part of the program serves another.

use super::holonomy::{DualLoops, HolonomyError, homology_basis, mirrored_basis};
use super::mirror::{Reflection, front};
use super::opened::Opened;
use super::surface_delaunay::SurfaceDelaunay;
use crate::geometry::connectivity::{Connectivity, ConnectivityError};
use crate::geometry::ids::{EdgeId, EdgeVec, VertexId, VertexVec};

/// See the module docs.
#[derive(Clone, Debug)]
pub struct LoopedSurface<'a> {
    /// Closed.
    pub connectivity: &'a Connectivity,
    /// Length of every edge in the surface, source units.
    pub length: EdgeVec<f64>,
    /// The part of it that is the surface's own, with the same halfedges, faces and vertices, and how the other part mirrors it; `None` where all of it is.
    pub half: Option<(Connectivity, Reflection)>,
    /// Loops on `connectivity`.
    pub loops: DualLoops,
    /// Where the surface was cut open along features: the vertex of which every own vertex is a sector.
    pub sector: Option<&'a VertexVec<VertexId>>,
    /// Edges of `connectivity`, on the mirror, that are both sides of a feature.
    pub glued: Vec<[EdgeId; 2]>,
}

/// Why there are no loops.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LoopedError {
    /// The surface is not what loops are made on.
    #[error(transparent)]
    Holonomy(#[from] HolonomyError),
    /// The front half could not be taken out of the double.
    #[error(transparent)]
    Half(#[from] ConnectivityError),
}

impl<'a> LoopedSurface<'a> {
    /// `ground` must be that of `surface`.
    pub fn new(surface: &Connectivity, ground: &'a SurfaceDelaunay) -> Result<Self, LoopedError> {
        let Some(symmetric) = &ground.symmetric else {
            return Ok(Self {
                connectivity: &ground.delaunay,
                length: ground.length(),
                half: None,
                loops: homology_basis(&ground.delaunay)?,
                sector: None,
                glued: Vec::new(),
            });
        };
        if surface.is_closed() {
            return Ok(Self {
                connectivity: &symmetric.connectivity,
                length: symmetric.log_length.iter().map(|l| l.exp()).collect(),
                half: None,
                loops: homology_basis(&symmetric.connectivity)?,
                sector: None,
                glued: Vec::new(),
            });
        }
        let double = &symmetric.connectivity;
        let (faces, vertices) = (surface.face_count(), surface.vertex_count());
        let half = front(double, faces, vertices)?;
        let reflection = Reflection::new(double, faces);
        Ok(Self {
            connectivity: double,
            length: symmetric.log_length.iter().map(|l| l.exp()).collect(),
            loops: mirrored_basis(&half, double, &reflection)?,
            half: Some((half, reflection)),
            sector: None,
            glued: Vec::new(),
        })
    }

    /// The same of a surface that was cut open; `ground` must be that of what is left.
    pub fn along_features(
        opened: &'a Opened,
        ground: &'a SurfaceDelaunay,
    ) -> Result<Self, LoopedError> {
        let sides = opened.glued.iter();
        Ok(Self {
            sector: Some(&opened.vertex),
            glued: sides
                .map(|pair| pair.map(|h| ground.base.edge(h)))
                .collect(),
            ..Self::new(&opened.connectivity, ground)?
        })
    }

    /// The surface's own part.
    pub fn own(&self) -> &Connectivity {
        match &self.half {
            Some((half, _)) => half,
            None => self.connectivity,
        }
    }

    /// The reflection of a double.
    pub fn reflection(&self) -> Option<&Reflection> {
        self.half.as_ref().map(|(_, reflection)| reflection)
    }

    /// Lengths by the edges of [`own`](Self::own).
    pub fn own_length(&self) -> EdgeVec<f64> {
        let (own, c) = (self.own(), self.connectivity);
        own.edges()
            .map(|e| self.length[c.edge(own.edge_halfedge(e))])
            .collect()
    }

    /// Which edges of `connectivity` are sides of features.
    pub fn is_feature(&self) -> EdgeVec<bool> {
        let mut is_feature = EdgeVec::filled(false, self.connectivity.edge_count());
        let sides = self.glued.iter().flatten();
        sides.for_each(|&e| is_feature[e] = true);
        is_feature
    }
}
