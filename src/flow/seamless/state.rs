//! Cone angles and turnings at one λ.
//!
//! *Enters:* λ on the given triangulation. *Leaves:* the Delaunay triangulation of those Penner coordinates, with angles, loops and the flips that lead there.
//! *Guaranteed:* every evaluation starts from the given triangulation, so it depends on λ alone.

use crate::flow::delaunay::{Delaunay, PtolemyFlip};
use crate::flow::holonomy::DualLoops;
use crate::flow::mirror::Reflection;
use crate::flow::schemes::FaceShape;
use crate::flow::signature::Signature;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceVec, VertexId, VertexVec};
use std::f64::consts::FRAC_PI_2;

/// What is solved: angles are to reach those of a signature.
pub(super) struct Problem<'a> {
    pub(super) base: &'a Connectivity,
    loops: &'a DualLoops,
    /// Θ̂, radians.
    theta: VertexVec<f64>,
    /// κ̂, radians.
    turning: Vec<f64>,
    /// The edge with which an edge moves: itself, or its mirror image where that has the lower id.
    pub(super) shares: EdgeVec<EdgeId>,
    /// The same of vertices.
    pub(super) vertex_shares: VertexVec<VertexId>,
    /// The number of every vertex's equation: the first has none, since its angle follows from Gauss–Bonnet, and none has one whose mirror image has.
    pub(super) equation: VertexVec<Option<u32>>,
    /// Number of equations of cone angles, which come first.
    pub(super) cone_equations: usize,
}

/// What an evaluation finds.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// The Delaunay triangulation.
    pub(super) connectivity: Connectivity,
    /// ln of the lengths of its edges.
    pub(super) log_length: EdgeVec<f64>,
    pub(super) shape: FaceVec<FaceShape>,
    /// The loops on it.
    pub(super) loops: DualLoops,
    /// From the given triangulation to this one.
    pub(super) flips: Vec<PtolemyFlip>,
    /// By how much the angles miss, radians: every vertex with an equation, then the loops.
    pub(super) missing: Vec<f64>,
    /// Largest error of an angle, that of the first vertex too, radians; infinite where some angle is no number.
    pub(super) max_error: f64,
}

impl<'a> Problem<'a> {
    pub(super) fn new(
        base: &'a Connectivity,
        loops: &'a DualLoops,
        signature: &Signature,
        reflection: Option<&Reflection>,
    ) -> Self {
        let shares = |e: EdgeId| reflection.map_or(e, |r| e.min(r.edge[e]));
        let vertex_shares = |v: VertexId| reflection.map_or(v, |r| v.min(r.vertex[v]));
        let mut cone_equations = 0;
        let equation = base.vertices().map(|v| {
            let has_one = v.index() > 0 && vertex_shares(v) == v;
            cone_equations += usize::from(has_one);
            has_one.then(|| cone_equations as u32 - 1)
        });
        Self {
            base,
            loops,
            equation: equation.collect(),
            cone_equations,
            shares: base.edges().map(shares).collect(),
            vertex_shares: base.vertices().map(vertex_shares).collect(),
            theta: signature
                .cone
                .iter()
                .map(|&k| k as f64 * FRAC_PI_2)
                .collect(),
            turning: signature
                .turning
                .iter()
                .map(|&k| k as f64 * FRAC_PI_2)
                .collect(),
        }
    }

    /// Number of equations.
    pub(super) fn equations(&self) -> usize {
        self.cone_equations + self.turning.len()
    }

    /// Flips to Delaunay and measures.
    pub(super) fn evaluate(&self, penner: &EdgeVec<f64>) -> State {
        let log_length = penner.iter().map(|l| 0.5 * l).collect();
        let mut delaunay = Delaunay::from_logs(self.base.clone(), log_length, Vec::new());
        delaunay.record = Some(Vec::new());
        let mut shape = FaceVec::default();
        let still = VertexVec::filled(0.0, self.base.vertex_count());
        delaunay.evaluate(&still, &mut shape);
        let flips = delaunay.record.take().unwrap_or_default();
        let log_length = delaunay.log_lengths();
        let c = delaunay.connectivity;
        let mut loops = self.loops.clone();
        for flip in &flips {
            loops.flipped(&c, &flip.flip);
        }
        let mut theta = self.theta.clone();
        for (f, shape) in shape.enumerate() {
            for (v, angle) in c.face_vertices(f).into_iter().zip(shape.angle) {
                theta[v] -= angle;
            }
        }
        let turning = loops.turning(&c, |corner| shape[c.face(corner)].angle[c.corner(corner)]);
        let turning = self.turning.iter().zip(turning).map(|(to, now)| to - now);
        let turning: Vec<f64> = turning.collect();
        let mut angles = theta.iter().copied().chain(turning.iter().copied());
        let largest = angles.clone().fold(0.0, |m: f64, x| m.max(x.abs()));
        let is_finite = angles.all(f64::is_finite);
        // Zero but for π in float64 being too small, which comes to 1e-11 on 50,000 vertices and must not gather at the first.
        let mean = theta.iter().sum::<f64>() / theta.len().max(1) as f64;
        let cones = theta
            .enumerate()
            .filter(|&(v, _)| self.equation[v].is_some());
        let cones = cones.map(|(_, x)| x - mean);
        let missing = cones.chain(turning.iter().copied()).collect();
        State {
            log_length,
            shape,
            loops,
            flips,
            missing,
            max_error: if is_finite { largest } else { f64::INFINITY },
            connectivity: c,
        }
    }
}
