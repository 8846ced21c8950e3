//! A surface in the linear picture, with what is given on it.
//!
//! *Enters:* the linear picture, the curvature that is there without cones. *Leaves:* the log scale of any cones, what a unit of curvature at a
//! vertex adds to it, and the force on cones: the derivative of the objective by curvature, for all vertices at once.

use super::candidates::Samples;
use super::cells::Cells;
use super::neighbours::Neighbours;
use super::objective::{Answers, State};
use super::picture::Picture;
use super::tableau::Limits;
use crate::flow::solve::{LANES, Row};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::mesh::Mesh;
use rayon::prelude::*;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

/// Numbers in the columns that are kept.
const KNOWN: usize = 1 << 24;
/// Cells of the surface: one for so many vertices, at least, and at most.
const SAMPLES: [usize; 3] = [8, 500, 1000];
/// Vertices of a small mesh.
const SMALL: usize = 2000;

/// Columns that were computed.
#[derive(Default)]
struct Known {
    vertices: Vec<usize>,
    columns: Vec<Row>,
    /// Their sums over the cells of the samples.
    sums: Vec<Row>,
}

/// Cones whose log scale was asked for.
#[derive(Default)]
struct Asked {
    vertices: Vec<usize>,
    curvature: Vec<f64>,
    /// What they add to u in the linear picture.
    added: Vec<f64>,
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
    /// Often the next question is about the same.
    last: RefCell<Asked>,
    /// Memory of columns that were forgotten.
    spare: Vec<Known>,
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
        let neighbours = Neighbours::new(mesh);
        let [each, least, most] = SAMPLES;
        let count = (base.len() / each).clamp(least, most);
        Self {
            samples: Samples::new(&neighbours, &allowed, &base, count),
            regions: Samples::none(),
            known: Vec::new(),
            last: RefCell::default(),
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
        let mut last = self.last.borrow_mut();
        if last.added.is_empty() || last.vertices != vertices || last.curvature != curvature {
            let mut added = vec![0.0; self.len()];
            self.add_cones(&mut added, vertices, curvature);
            self.picture.solve(&mut added);
            *last = Asked {
                vertices: vertices.to_vec(),
                curvature: curvature.to_vec(),
                added,
            };
        }
        let field = last.added.iter().zip(&self.base);
        let mut field: Vec<f64> = field.map(|(x, b)| x + b).collect();
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

    /// The answers of places: the log scale that a unit of curvature at each causes, on average in every cell.
    pub(super) fn answers(&mut self, places: &[usize], cells: &Cells) -> Answers {
        let sunk = match self.sunk.is_empty() {
            true => vec![0.0; cells.weight.len()],
            false => cells.means(&self.sunk),
        };
        // Where each is among the places.
        let index: BTreeMap<usize, usize> = places.iter().copied().zip(0..).collect();
        let points = sunk.len();
        let mut field = vec![0.0; places.len() * points];
        let copies = self.picture.copies;
        let mut take = |known: &Known| {
            let means = cells.means_of(&known.columns, &known.sums, copies);
            let lanes = known.vertices.iter().enumerate();
            for (lane, i) in lanes.filter_map(|(lane, v)| Some((lane, index.get(v)?))) {
                let answer = field[i * points..][..points].iter_mut();
                for ((x, mean), sunk) in answer.zip(&means).zip(&sunk) {
                    *x = mean[lane] - sunk;
                }
            }
        };
        let known = self.known.iter().flat_map(|k| &k.vertices);
        let known: BTreeSet<usize> = known.copied().collect();
        let wanted = |known: &&Known| known.vertices.iter().any(|v| index.contains_key(v));
        self.known.iter().filter(wanted).for_each(&mut take);
        let new = index.keys().copied().filter(|v| !known.contains(v));
        let mut new: Vec<usize> = new.collect();
        // Neighbours in the order of elimination have most of the way to its end in common.
        new.sort_unstable_by_key(|&v| self.picture.position[v]);
        let groups: Vec<&[usize]> = new.chunks(LANES).collect();
        // As many at a time as there are threads, unless they are large.
        let rows = self.picture.order.len().max(1);
        let most = (KNOWN / LANES / rows).clamp(1, rayon::current_num_threads());
        for groups in groups.chunks(most) {
            let fresh = groups.iter().map(|vertices| Known {
                vertices: vertices.to_vec(),
                ..self.spare.pop().unwrap_or_default()
            });
            let mut fresh: Vec<Known> = fresh.collect();
            let (picture, samples) = (&self.picture, &self.samples);
            fresh.par_iter_mut().with_max_len(1).for_each(|known| {
                picture.columns(&known.vertices, &mut known.columns);
                picture.sums(&known.columns, samples, &mut known.sums);
            });
            for known in fresh {
                take(&known);
                match (self.known.len() + 1) * known.columns.len() <= KNOWN / LANES {
                    true => self.known.push(known),
                    false => self.spare.push(known),
                }
            }
        }
        Answers {
            field,
            own: places.iter().map(|&v| cells.of(v)).collect(),
            star: places.iter().map(|&v| self.picture.star[v]).collect(),
        }
    }

    /// Forgets all answers but those of some places, and of what is beside them.
    pub(super) fn keep(&mut self, places: &[usize]) {
        for known in std::mem::take(&mut self.known) {
            match known.vertices.iter().any(|v| places.contains(v)) {
                true => self.known.push(known),
                false => self.spare.push(known),
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
