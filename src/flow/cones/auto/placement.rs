//! A surface in the linear picture, with what is given on it.
//!
//! *Enters:* the linear picture, the curvature that is there without cones. *Leaves:* the log scale of any cones, what a unit of curvature at a
//! vertex adds to it, and the force on cones: the derivative of the objective by curvature, for all vertices at once.

use super::candidates::Samples;
use super::objective::State;
use super::picture::Picture;
use super::star::Star;
use super::tableau::Limits;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::mesh::Mesh;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Numbers in the answers that are kept.
const KNOWN: usize = 1 << 24;
/// Cells of the surface: one for so many vertices, at least, and at most.
const SAMPLES: [usize; 3] = [8, 500, 1000];
/// Vertices of a small mesh.
const SMALL: usize = 2000;
/// Places that are answered side by side.
const TOGETHER: usize = 32;

/// Cones to be chosen.
pub(super) struct Placement<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) connectivity: &'a Connectivity,
    picture: Picture,
    /// Curvature without cones minus that of the surface, radians.
    background: Vec<f64>,
    /// u without cones.
    pub(super) base: Vec<f64>,
    /// Where the curvature of a cone comes from, adding up to 1; empty where the boundary is free.
    sink: Vec<f64>,
    /// What taking that does to u.
    sunk: Vec<f64>,
    pub(super) limits: Limits,
    /// Where cones may be.
    pub(super) allowed: Vec<bool>,
    pub(super) samples: Samples,
    /// Regions of the surface, from each of which places for cones are taken.
    pub(super) regions: Samples,
    /// Answers that were computed: the search comes back to the same places again and again.
    known: BTreeMap<usize, Arc<[f64]>>,
}

impl<'a> Placement<'a> {
    /// `background`: the curvature that there is without cones minus that of the surface, radians; adds up to 0 unless the boundary is
    /// free.
    pub(super) fn new(
        mesh: &'a Mesh,
        mut picture: Picture,
        background: Vec<f64>,
        sink: Vec<f64>,
        limits: Limits,
        allowed: Vec<bool>,
    ) -> Self {
        let mut base = background.clone();
        picture.solve(&mut base);
        for (u, bent) in base.iter_mut().zip(picture.bent(&background)) {
            *u += bent;
        }
        let mut sunk = sink.clone();
        picture.solve(&mut sunk);
        let connectivity = &mesh.connectivity;
        let [each, least, most] = SAMPLES;
        let count = (base.len() / each).clamp(least, most);
        Self {
            samples: Samples::new(connectivity, &allowed, &base, count),
            regions: Samples::none(),
            known: BTreeMap::new(),
            mesh,
            connectivity,
            picture,
            background,
            base,
            sink,
            sunk,
            limits,
            allowed,
        }
    }

    /// Area of every vertex, all together 1.
    pub(super) fn weight(&self) -> &[f64] {
        &self.picture.weight
    }

    /// The faces around a vertex.
    pub(super) fn star(&self, vertex: usize) -> Star {
        self.picture.star[vertex]
    }

    /// J of a log scale; infinite where that is no number.
    pub(super) fn cost(&self, u: &[f64]) -> f64 {
        let value = State::new([self.weight(); 2], u).value;
        if value.is_finite() {
            value
        } else {
            f64::INFINITY
        }
    }

    /// Whether so few vertices stand for each cone that the linear picture may be far off, and looking at more costs little.
    pub(super) fn is_small(&self) -> bool {
        self.len() <= SMALL
    }

    fn len(&self) -> usize {
        self.base.len()
    }

    fn add_cones(&self, field: &mut [f64], vertices: &[usize], curvature: &[f64]) {
        for (&v, c) in vertices.iter().zip(curvature) {
            field[v] += c;
        }
        let total: f64 = curvature.iter().sum();
        let sink = field.iter_mut().zip(&self.sink);
        sink.for_each(|(x, s)| *x -= total * s);
    }

    /// u of some cones.
    pub(super) fn log_scale_of(&mut self, vertices: &[usize], curvature: &[f64]) -> Vec<f64> {
        let mut field = vec![0.0; self.len()];
        self.add_cones(&mut field, vertices, curvature);
        self.picture.solve(&mut field);
        field.iter_mut().zip(&self.base).for_each(|(x, b)| *x += b);
        for (&v, c) in vertices.iter().zip(curvature) {
            field[v] += self.picture.star[v].excess(*c);
        }
        field
    }

    /// Mean of a field over the area.
    pub(super) fn mean(&self, field: &[f64]) -> f64 {
        self.picture.mean(field)
    }

    /// The log scale that the mesh itself has with these cones.
    pub(super) fn real_log_scale(&mut self, vertices: &[usize], curvature: &[f64]) -> Vec<f64> {
        let linear = self.log_scale_of(vertices, curvature);
        let mut target: Vec<f64> = self.background.clone();
        self.add_cones(&mut target, vertices, curvature);
        let own = target.iter_mut().zip(&self.picture.curvature);
        own.for_each(|(t, k)| *t += k);
        self.picture.corrected(&linear, &target)
    }

    /// Counts from now on from what the mesh really does with these cones: adds to u without cones the difference between `real` and the linear
    /// picture.
    pub(super) fn correct(&mut self, vertices: &[usize], curvature: &[f64], real: &[f64]) {
        let linear = self.log_scale_of(vertices, curvature);
        let difference = real.iter().zip(&linear).map(|(r, l)| r - l);
        let base = self.base.iter_mut().zip(difference);
        base.for_each(|(b, d)| *b += d);
    }

    /// Hands the answer of each place (the log scale that a unit of curvature there causes) to `take`, in order.
    pub(super) fn answer(&mut self, vertices: &[usize], mut take: impl FnMut(&[f64])) {
        let n = self.len();
        for some in vertices.chunks(TOGETHER) {
            let is_new = |v: &usize| !self.known.contains_key(v);
            let mut new: Vec<usize> = some.iter().copied().filter(is_new).collect();
            new.sort_unstable();
            new.dedup();
            let mut fields = Vec::with_capacity(new.len() * n);
            for &v in &new {
                let from = fields.len();
                fields.resize(from + n, 0.0);
                fields[from + v] = 1.0;
            }
            self.picture.solve(&mut fields);
            for field in fields.chunks_mut(n.max(1)) {
                let sunk = field.iter_mut().zip(&self.sunk);
                sunk.for_each(|(u, s)| *u -= s);
            }
            let fields = new.iter().copied().zip(fields.chunks(n.max(1)));
            let fresh: BTreeMap<usize, &[f64]> = fields.collect();
            for v in some {
                match fresh.get(v) {
                    Some(field) => take(field),
                    None => take(self.known.get(v).map_or(&[][..], |known| known)),
                }
            }
            for (v, field) in fresh {
                if (self.known.len() + 1) * n <= KNOWN {
                    self.known.insert(v, Arc::from(field));
                }
            }
        }
    }

    /// Forgets all answers but those of some places.
    pub(super) fn keep(&mut self, vertices: &[usize]) {
        self.known.retain(|v, _| vertices.contains(v));
    }

    /// ∂J/∂K of every vertex, at some log scale.
    pub(super) fn force(&mut self, u: &[f64]) -> Vec<f64> {
        let mut force = State::new([self.weight(); 2], u).derivative();
        self.picture.solve(&mut force);
        if !self.sink.is_empty() {
            let level: f64 = self.sink.iter().zip(&force).map(|(s, f)| s * f).sum();
            force.iter_mut().for_each(|x| *x -= level);
        }
        force
    }
}
