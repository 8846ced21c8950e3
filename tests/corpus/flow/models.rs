//! Real models as the flow sees them, and numbers without pattern.

use affine_atlas::flow::cones::{BoundaryCondition, Prescription};
use affine_atlas::flow::ricci::{self, FlatMetric, FlowError, FlowParams, Scheme};
use affine_atlas::geometry::connectivity::Connectivity;
use affine_atlas::geometry::ids::{EdgeVec, VertexId, VertexVec};
use affine_atlas::{read, repair};
use std::path::Path;

/// A surface for the flow, with the positions that its lengths come from.
#[derive(Clone)]
pub struct Model {
    pub connectivity: Connectivity,
    pub length: EdgeVec<f64>,
    pub positions: Vec<[f64; 3]>,
    /// Vertices of the file.
    pub source_vertex: Vec<u32>,
}

impl Model {
    pub fn new(faces: &[[u32; 3]], positions: Vec<[f64; 3]>) -> Self {
        let connectivity = Connectivity::from_faces(faces, positions.len()).unwrap();
        Self::with(connectivity, positions)
    }

    pub fn with(connectivity: Connectivity, positions: Vec<[f64; 3]>) -> Self {
        let length = |e| {
            let [a, b] = connectivity
                .edge_vertices(e)
                .map(|v: VertexId| positions[v.index()]);
            (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
        };
        let length = connectivity.edges().map(length).collect();
        Self {
            source_vertex: (0..positions.len() as u32).collect(),
            connectivity,
            length,
            positions,
        }
    }

    /// The largest component of a file.
    pub fn read(path: &Path) -> Self {
        let asset = read::read(path, &Default::default()).unwrap();
        let repaired = repair::repair(&asset.soup, &Default::default()).unwrap();
        let mut components = repaired.components;
        components.sort_by_key(|c| std::cmp::Reverse(c.faces));
        let mesh = components.swap_remove(0).mesh.unwrap();
        let positions = mesh.positions.as_slice().to_vec();
        Self {
            source_vertex: mesh.source_vertex.as_slice().to_vec(),
            ..Self::with(mesh.connectivity, positions)
        }
    }

    /// Flow with flips.
    pub fn flow(
        &self,
        prescription: &Prescription,
        tolerance: f64,
    ) -> Result<FlatMetric, FlowError> {
        let params = FlowParams {
            scheme: Scheme::VertexScaling,
            delaunay: true,
            curvature_tolerance: tolerance,
            ..Default::default()
        };
        ricci::flow(&self.connectivity, &self.length, prescription, &params, &())
    }

    /// Cones at given vertices; every other vertex flat; free boundary.
    pub fn prescribe(&self, cones: &[(usize, f64)]) -> Prescription {
        let mut target = VertexVec::filled(0.0, self.connectivity.vertex_count());
        for &(v, curvature) in cones {
            target[VertexId::new(v)] = curvature;
        }
        Prescription::new(target, BoundaryCondition::Free)
    }
}

/// Numbers in [0, 1) without pattern, reproducible.
pub struct Random(pub u64);

impl Random {
    /// SplitMix64 (Steele, Lea, Flood 2014).
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        (z >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + self.next() * (high - low)
    }

    pub fn below(&mut self, count: usize) -> usize {
        ((self.next() * count as f64) as usize).min(count - 1)
    }
}
