//! A surface in the linear picture, with what is given on it.
//!
//! *Enters:* the linear picture, the curvature that is there without cones. *Leaves:* the log scale of any cones, what a unit of curvature at a
//! vertex adds to it, and the force on cones: the derivative of the objective by curvature, for all vertices at once.

use super::candidates::Samples;
use super::cells::Cells;
use super::neighbours::Neighbours;
use super::objective::State;
use super::picture::Picture;
use super::star::Star;
use super::tableau::Limits;
use crate::flow::solve::{LANES, Row};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::mesh::Mesh;
use std::collections::{BTreeMap, BTreeSet};

/// Numbers in the columns that are kept.
const KNOWN: usize = 1 << 24;
/// Cells of the surface: one for so many vertices, at least, and at most.
const SAMPLES: [usize; 3] = [8, 500, 1000];
/// Vertices of a small mesh.
const SMALL: usize = 2000;

/// Columns that were computed.
struct Known {
    vertices: Vec<usize>,
    columns: Vec<Row>,
}

/// Cones to be chosen.
pub(super) struct Placement<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) connectivity: &'a Connectivity,
    pub(super) neighbours: Neighbours,
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
    /// The search comes back to the same places again and again.
    known: Vec<Known>,
    /// Memory of columns that were forgotten.
    spare: Vec<Vec<Row>>,
}

impl<'a> Placement<'a> {
    /// `background`: the curvature that there is without cones minus that of the surface, radians; adds up to 0 unless the boundary is
    /// free.
    pub(super) fn new(
        mesh: &'a Mesh,
        picture: Picture,
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
        if !sunk.is_empty() {
            picture.solve(&mut sunk);
        }
        let connectivity = &mesh.connectivity;
        let neighbours = Neighbours::new(connectivity);
        let [each, least, most] = SAMPLES;
        let count = (base.len() / each).clamp(least, most);
        Self {
            samples: Samples::new(&neighbours, &allowed, &base, count),
            regions: Samples::none(),
            known: Vec::new(),
            spare: Vec::new(),
            mesh,
            connectivity,
            neighbours,
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
    pub(super) fn log_scale_of(&self, vertices: &[usize], curvature: &[f64]) -> Vec<f64> {
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

    /// The log scale that the mesh itself has with these cones. `linear`: what the linear picture says.
    pub(super) fn real_log_scale(
        &self,
        vertices: &[usize],
        curvature: &[f64],
        linear: &[f64],
    ) -> Vec<f64> {
        let mut target: Vec<f64> = self.background.clone();
        self.add_cones(&mut target, vertices, curvature);
        let own = target.iter_mut().zip(&self.picture.curvature);
        own.for_each(|(t, k)| *t += k);
        self.picture.corrected(linear, &target)
    }

    /// Counts from now on from what the mesh really does with some cones: adds to u without cones the difference between `real` and `linear`,
    /// what the linear picture says of them.
    pub(super) fn correct(&mut self, real: &[f64], linear: &[f64]) {
        let difference = real.iter().zip(linear).map(|(r, l)| r - l);
        let base = self.base.iter_mut().zip(difference);
        base.for_each(|(b, d)| *b += d);
    }

    /// Cells around some places.
    pub(super) fn cells<'b>(&self, weight: &'b [f64], places: &[usize]) -> Cells<'b> {
        let order = &self.picture.order;
        Cells::new(&self.neighbours, &self.samples, weight, order, places)
    }

    /// The answer of each place: the log scale that a unit of curvature there causes, on average in every cell.
    pub(super) fn answers(&mut self, places: &[usize], cells: &Cells) -> Vec<Vec<f64>> {
        let sunk = match self.sunk.is_empty() {
            true => vec![0.0; cells.weight.len()],
            false => cells.means(&self.sunk),
        };
        let mut answer: BTreeMap<usize, Vec<f64>> =
            places.iter().map(|&v| (v, Vec::new())).collect();
        let copies = self.picture.copies;
        let mut take = |vertices: &[usize], columns: &[Row]| {
            let means = cells.means_of(columns, copies);
            for (lane, v) in vertices.iter().enumerate() {
                if let Some(answer) = answer.get_mut(v) {
                    let means = means.iter().zip(&sunk);
                    *answer = means.map(|(m, s)| m[lane] - s).collect();
                }
            }
        };
        let known: BTreeSet<usize> = self
            .known
            .iter()
            .flat_map(|k| &k.vertices)
            .copied()
            .collect();
        let wanted = |known: &&Known| known.vertices.iter().any(|v| places.contains(v));
        for known in self.known.iter().filter(wanted) {
            take(&known.vertices, &known.columns);
        }
        let new: BTreeSet<usize> = places.iter().copied().collect();
        let mut new: Vec<usize> = new.difference(&known).copied().collect();
        // Neighbours in the order of elimination have most of the way to its end in common.
        new.sort_unstable_by_key(|&v| self.picture.position[v]);
        for vertices in new.chunks(LANES) {
            let mut columns = self.spare.pop().unwrap_or_default();
            self.picture.columns(vertices, &mut columns);
            take(vertices, &columns);
            match (self.known.len() + 1) * columns.len() <= KNOWN / LANES {
                true => self.known.push(Known {
                    vertices: vertices.to_vec(),
                    columns,
                }),
                false => self.spare.push(columns),
            }
        }
        let answers = places.iter().map(|v| answer.get(v).cloned());
        answers.map(Option::unwrap_or_default).collect()
    }

    /// Forgets all answers but those of some places, and of what is beside them.
    pub(super) fn keep(&mut self, places: &[usize]) {
        for known in std::mem::take(&mut self.known) {
            match known.vertices.iter().any(|v| places.contains(v)) {
                true => self.known.push(known),
                false => self.spare.push(known.columns),
            }
        }
    }

    /// ∂J/∂K of every vertex, at some log scale.
    pub(super) fn force(&self, u: &[f64]) -> Vec<f64> {
        let mut force = State::new([self.weight(); 2], u).derivative();
        self.picture.solve(&mut force);
        if !self.sink.is_empty() {
            let level: f64 = self.sink.iter().zip(&force).map(|(s, f)| s * f).sum();
            force.iter_mut().for_each(|x| *x -= level);
        }
        force
    }
}
