//! Cone angles and turnings at one λ.
//!
//! *Enters:* λ on the given triangulation. *Leaves:* the Delaunay triangulation of those Penner coordinates, with angles, loops and the flips that lead there.
//! *Guaranteed:* every evaluation starts from the given triangulation, so it depends on λ alone.

use super::Start;
use crate::flow::correspondence::Correspondence;
use crate::flow::delaunay::{Delaunay, PtolemyFlip};
use crate::flow::holonomy::DualLoops;
use crate::flow::mirror::Reflection;
use crate::flow::schemes::FaceShape;
use crate::flow::signature::Signature;
use crate::flow::straighten::{EuclidFlip, StraightenError, Straightened, straighten};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceVec, VertexId, VertexVec};
use crate::observe::part;
use std::f64::consts::FRAC_PI_2;

/// What is solved: angles are to reach those of a signature.
pub(super) struct Problem<'a> {
    pub(super) base: &'a Connectivity,
    loops: &'a DualLoops,
    /// Where `base` is a double.
    reflection: Option<&'a Reflection>,
    /// Θ̂, radians.
    theta: VertexVec<f64>,
    /// κ̂, radians.
    turning: Vec<f64>,
    /// The edge with which an edge moves: itself, or its mirror image where that has the lower id.
    pub(super) shares: EdgeVec<EdgeId>,
    /// The same of vertices.
    pub(super) vertex_shares: VertexVec<VertexId>,
    /// The number of every vertex's equation: the first of every piece has none, since its angle follows from Gauss–Bonnet, and none has one whose mirror image has.
    pub(super) equation: VertexVec<Option<u32>>,
    /// Number of equations of cone angles, which come first.
    pub(super) cone_equations: usize,
    /// Both sides of features; one equation each, after those of cones.
    glued: &'a [[EdgeId; 2]],
    /// Where there are features: the identity on `base`.
    identity: Option<Correspondence>,
    /// The piece of every vertex, as one of its vertices.
    piece: VertexVec<VertexId>,
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
    /// From the given triangulation to the Delaunay one.
    pub(super) flips: Vec<PtolemyFlip>,
    /// From there to this one, which has the sides of features as edges.
    pub(super) straightened: Vec<EuclidFlip>,
    /// A side of a feature that could not be made an edge, if there is one.
    pub(super) bent: Option<EdgeId>,
    /// The sides of features.
    pub(super) glued: Vec<[EdgeId; 2]>,
    /// By how much the angles miss, radians: every vertex with an equation; by how much λ of the sides of features differ; the loops.
    pub(super) missing: Vec<f64>,
    /// Largest error, that of the first vertices too; infinite where some angle is no number.
    pub(super) max_error: f64,
}

impl<'a> Problem<'a> {
    pub(super) fn new(start: &Start<'a>, loops: &'a DualLoops, signature: &Signature) -> Self {
        let (base, reflection) = (start.connectivity, start.reflection);
        let shares = |e: EdgeId| reflection.map_or(e, |r| e.min(r.edge[e]));
        let vertex_shares = |v: VertexId| reflection.map_or(v, |r| v.min(r.vertex[v]));
        let mut joined = UnionFind::new(base.vertex_count());
        for e in base.edges() {
            let [a, b] = base.edge_vertices(e);
            joined.join(a.index(), b.index());
        }
        let piece = |v: VertexId| VertexId::new(joined.find(v.index()));
        let piece: VertexVec<VertexId> = base.vertices().map(piece).collect();
        let mut is_opened = VertexVec::filled(false, base.vertex_count());
        let mut cone_equations = 0;
        let equation = base.vertices().map(|v| {
            let is_own = vertex_shares(v) == v;
            let has_one = is_own && std::mem::replace(&mut is_opened[piece[v]], true);
            cone_equations += usize::from(has_one);
            has_one.then(|| cone_equations as u32 - 1)
        });
        Self {
            base,
            loops,
            reflection,
            equation: equation.collect(),
            cone_equations,
            glued: start.glued,
            identity: (!start.glued.is_empty()).then(|| Correspondence::identity(base)),
            piece,
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
        self.local_equations() + self.turning.len()
    }

    /// Number of those that few edges have part in: all but the loops'.
    pub(super) fn local_equations(&self) -> usize {
        self.cone_equations + self.glued.len()
    }

    /// What is missing at every vertex; what is missing of an edge counts at both ends.
    pub(super) fn missing_at(&self, state: &State) -> VertexVec<f64> {
        let of = |v: VertexId| {
            let row = self.equation[self.vertex_shares[v]];
            row.map_or(0.0, |row| state.missing[row as usize].abs())
        };
        let mut missing: VertexVec<f64> = self.base.vertices().map(of).collect();
        let unequal = &state.missing[self.cone_equations..self.local_equations()];
        for (pair, unequal) in self.glued.iter().zip(unequal) {
            for v in pair.iter().flat_map(|&e| self.base.edge_vertices(e)) {
                missing[v] = missing[v].max(unequal.abs());
            }
        }
        missing
    }

    /// The edges that the sides of features have become; flips that keep the metric where they are none. Or a side that cannot be made an edge.
    fn sides(&self, delaunay: &mut Delaunay) -> Result<Straightened, EdgeId> {
        let sides = self.glued.as_flattened();
        // Of the least important feature, if it cannot be told.
        let Some(&last) = sides.last() else {
            return Ok(Straightened::default());
        };
        straighten(delaunay, self.base, sides).map_err(|error| match error {
            StraightenError::Bent { edge } => edge,
            StraightenError::Correspondence(_) => last,
        })
    }

    /// Flips to Delaunay and measures.
    pub(super) fn evaluate(&self, penner: &EdgeVec<f64>) -> State {
        let _part = part!("flips and angles");
        let log_length = penner.iter().map(|l| 0.5 * l).collect();
        let correspondences = self.identity.iter().cloned().collect();
        let mut delaunay = Delaunay::from_logs(self.base.clone(), log_length, correspondences);
        delaunay.record = Some(Vec::new());
        let mut shape = FaceVec::default();
        let still = VertexVec::filled(0.0, self.base.vertex_count());
        match self.reflection {
            Some(reflection) => delaunay.evaluate_mirrored(reflection, &mut shape),
            None => delaunay.evaluate(&still, &mut shape),
        }
        let flips = delaunay.record.take().unwrap_or_default();
        let sides = self.sides(&mut delaunay);
        let bent = sides.as_ref().err().copied();
        let sides = sides.unwrap_or_default();
        for flip in &sides.flips {
            delaunay.update_faces_beside(flip.edge, &still, &mut shape);
        }
        let glued: Vec<[EdgeId; 2]> = match bent.is_none() {
            true => (sides.edge.chunks_exact(2))
                .map(|pair| [pair[0], pair[1]])
                .collect(),
            false => self.glued.to_vec(),
        };
        let log_length = delaunay.log_lengths();
        let c = delaunay.connectivity;
        let mut loops = self.loops.clone();
        let all = flips.iter().map(|f| &f.flip);
        for flip in all.chain(sides.flips.iter().map(|f| &f.flip)) {
            loops.flipped(&c, flip);
        }
        let mut theta = self.theta.clone();
        for (f, shape) in shape.enumerate() {
            for (v, angle) in c.face_vertices(f).into_iter().zip(shape.angle) {
                theta[v] -= angle;
            }
        }
        let unequal = glued
            .iter()
            .map(|&[h, t]| 2.0 * (log_length[t] - log_length[h]));
        let unequal: Vec<f64> = unequal.collect();
        let turning = loops.turning(&c, |corner| shape[c.face(corner)].angle[c.corner(corner)]);
        let turning = self.turning.iter().zip(turning).map(|(to, now)| to - now);
        let turning: Vec<f64> = turning.collect();
        let errors = theta.iter().chain(&unequal).chain(&turning);
        let largest = errors.clone().fold(0.0, |m: f64, x| m.max(x.abs()));
        let is_finite = bent.is_none() && errors.clone().all(|x| x.is_finite());
        // Zero but for π in float64 being too small, which comes to 1e-11 on 50,000 vertices and must not gather at the first.
        let mut sum = VertexVec::filled((0.0, 0.0), theta.len());
        for (v, x) in theta.enumerate() {
            let (total, count) = &mut sum[self.piece[v]];
            (*total, *count) = (*total + x, *count + 1.0);
        }
        let mean = |v| {
            let (total, count): (f64, f64) = sum[self.piece[v]];
            total / count
        };
        let cones = theta
            .enumerate()
            .filter(|&(v, _)| self.equation[v].is_some());
        let mut missing: Vec<f64> = cones.map(|(v, x)| x - mean(v)).collect();
        missing.extend(&unequal);
        missing.extend(&turning);
        State {
            log_length,
            shape,
            loops,
            flips,
            straightened: sides.flips,
            bent,
            glued,
            missing,
            max_error: if is_finite { largest } else { f64::INFINITY },
            connectivity: c,
        }
    }
}
