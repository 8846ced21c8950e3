//! A choice of places, and what every other place would add to it.
//!
//! *Enters:* the linear picture, and what curvature is given. *Leaves:* the best curvatures at given places, the variance of the log scale
//! then, and what a cone anywhere else would lower it by.
//!
//! With u = u₀ + Σ c_i g_i, where g_v answers a unit of curvature at v, the variance of u over the area is a quadratic function of the
//! curvatures c. Its matrix is the biharmonic Green's function B(v, w) = ∫ g_v g_w, and one column of B takes two
//! back-substitutions. The columns of the cones alone tell *for every vertex at once* what the best cones with that vertex would be worth:
//!
//! * half the derivative e(v) of the energy by curvature at v, with all else at its best, is a sum of columns;
//! * its second derivative s(v) is what B(v, v) leaves after projection on the columns (the power function of kriging);
//! * so the energy falls by e²/s, and no solve is needed to know it.
//!
//! [`climb`](super::climb) looks for the vertex worth most, [`search`](super::search) puts cones there.

use super::climb::{climb, sample};
use super::dot::dot;
use super::picture::Picture;
use super::quadratic::{Best, Limits, Quadratic};
use crate::flow::solve::solve_dense;
use crate::geometry::connectivity::Connectivity;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Numbers in the columns that are kept.
const KNOWN: usize = 1 << 25;
/// Vertices that are looked at everywhere; from the best of them the search climbs to a vertex that is better than its neighbours.
const SAMPLES: usize = 2000;
/// Vertices to climb from where every step takes the best curvatures of all cones.
const CLIMBS: usize = 3;
/// Samples whose worth is told side by side.
const PIECE: usize = 256;

/// Cones to be chosen; see the module docs.
pub(super) struct Placement<'a> {
    pub(super) picture: &'a mut Picture,
    pub(super) connectivity: &'a Connectivity,
    /// Curvature without cones minus that of the surface, radians.
    background: Vec<f64>,
    /// u without cones.
    pub(super) base: Vec<f64>,
    /// Where the curvature of a cone comes from, adding up to 1; empty where the boundary is free.
    pub(super) sink: Vec<f64>,
    pub(super) limits: Limits,
    /// Where cones may be.
    pub(super) allowed: Vec<bool>,
    /// Variance without cones.
    base_energy: f64,
    /// b of every vertex.
    slope: Vec<f64>,
    /// B(v, v) of every vertex.
    pub(super) self_energy: Vec<f64>,
    /// Where the search begins.
    pub(super) samples: Vec<usize>,
    /// Columns of B that were computed: the search comes back to the same places again and again.
    known: BTreeMap<usize, Site>,
    /// Places answered so far.
    pub(super) answered: usize,
}

/// A vertex with its column of B.
#[derive(Clone)]
pub(super) struct Site {
    pub(super) vertex: usize,
    column: Arc<[f64]>,
    /// The column at the samples.
    sampled: Arc<[f64]>,
}

/// Chosen places and their best curvatures.
#[derive(Clone)]
pub(super) struct Choice {
    pub(super) sites: Vec<Site>,
    pub(super) best: Best,
    /// Variance of the log scale.
    pub(super) energy: f64,
}

impl Choice {
    pub(super) fn vertices(&self) -> Vec<usize> {
        self.sites.iter().map(|s| s.vertex).collect()
    }

    /// Standard deviation of the log scale.
    pub(super) fn deviation(&self) -> f64 {
        self.energy.max(0.0).sqrt()
    }
}

impl<'a> Placement<'a> {
    /// `background`: the curvature that there is without cones minus that of the surface, radians; adds up to 0 unless the boundary is
    /// free.
    pub(super) fn new(
        picture: &'a mut Picture,
        connectivity: &'a Connectivity,
        background: Vec<f64>,
        sink: Vec<f64>,
        limits: Limits,
        allowed: Vec<bool>,
    ) -> Self {
        let mut base = background.clone();
        picture.solve(&mut base);
        let mut placement = Self {
            base_energy: 0.0,
            slope: Vec::new(),
            self_energy: picture.self_energies(&sink),
            samples: sample(connectivity, &allowed, &base, SAMPLES),
            base,
            background,
            picture,
            connectivity,
            sink,
            limits,
            allowed,
            known: BTreeMap::new(),
            answered: 0,
        };
        placement.weigh_base();
        placement
    }

    fn weigh_base(&mut self) {
        let mut slope = self.base.clone();
        self.picture.centre(&mut slope);
        self.base_energy = dot(&slope, &self.base);
        self.dual(&mut slope);
        self.slope = slope;
    }

    /// The log scale that the mesh itself has with these cones.
    pub(super) fn real_log_scale(&mut self, vertices: &[usize], curvature: &[f64]) -> Vec<f64> {
        let cones = || vertices.iter().zip(curvature);
        let linear = self.log_scale_of(cones());
        let mut target: Vec<f64> = self.background.clone();
        self.add_cones(&mut target, cones());
        let own = target.iter_mut().zip(&self.picture.curvature);
        own.for_each(|(t, k)| *t += k);
        self.picture.corrected(&linear, &target)
    }

    /// Counts from now on from what the mesh really does with these cones: adds to u without cones the difference between `real` and the linear
    /// picture.
    pub(super) fn correct(&mut self, vertices: &[usize], curvature: &[f64], real: &[f64]) {
        let linear = self.log_scale_of(vertices.iter().zip(curvature));
        let difference = real.iter().zip(&linear).map(|(r, l)| r - l);
        let base = self.base.iter_mut().zip(difference);
        base.for_each(|(b, d)| *b += d);
        self.weigh_base();
    }

    fn add_cones<'c>(&self, field: &mut [f64], cones: impl Iterator<Item = (&'c usize, &'c f64)>) {
        for (&v, c) in cones {
            field[v] += c;
            field
                .iter_mut()
                .zip(&self.sink)
                .for_each(|(x, s)| *x -= c * s);
        }
    }

    /// u of some cones, with mean 0 unless the boundary is free.
    pub(super) fn log_scale_of<'c>(
        &mut self,
        cones: impl Iterator<Item = (&'c usize, &'c f64)>,
    ) -> Vec<f64> {
        let mut field = vec![0.0; self.len()];
        self.add_cones(&mut field, cones);
        self.picture.solve(&mut field);
        field.iter_mut().zip(&self.base).for_each(|(x, b)| *x += b);
        if !self.sink.is_empty() {
            let mean = self.picture.mean(&field);
            field.iter_mut().for_each(|x| *x -= mean);
        }
        field
    }

    /// Number of vertices.
    pub(super) fn len(&self) -> usize {
        self.base.len()
    }

    /// g of some vertices, one after another: the log scale that a unit of curvature causes there.
    pub(super) fn responses(&mut self, vertices: &[usize]) -> Vec<f64> {
        self.answered += vertices.len();
        let mut fields = Vec::with_capacity(vertices.len() * self.len());
        for &v in vertices {
            let from = fields.len();
            match self.sink.is_empty() {
                true => fields.resize(from + self.base.len(), 0.0),
                false => fields.extend(self.sink.iter().map(|x| -x)),
            }
            fields[from + v] += 1.0;
        }
        self.picture.solve(&mut fields);
        fields
    }

    /// Replaces derivatives by log scale, one field after another, by derivatives by curvature.
    pub(super) fn dual(&mut self, fields: &mut [f64]) {
        self.picture.solve(fields);
        if self.sink.is_empty() {
            return;
        }
        for field in fields.chunks_mut(self.sink.len()) {
            let level = dot(&self.sink, field);
            field.iter_mut().for_each(|x| *x -= level);
        }
    }

    /// Columns of B.
    pub(super) fn sites(&mut self, vertices: &[usize]) -> Vec<Site> {
        let n = self.len();
        if (self.known.len() + vertices.len()) * n > KNOWN {
            self.known.clear();
        }
        let mut new: Vec<usize> = vertices.to_vec();
        new.retain(|v| !self.known.contains_key(v));
        new.sort_unstable();
        new.dedup();
        let mut fields = self.responses(&new);
        for field in fields.chunks_mut(n) {
            self.picture.centre(field);
        }
        self.dual(&mut fields);
        for (&vertex, column) in new.iter().zip(fields.chunks(n)) {
            let site = Site {
                vertex,
                column: Arc::from(column),
                sampled: self.samples.iter().map(|&v| column[v]).collect(),
            };
            self.known.insert(vertex, site);
        }
        let known = vertices.iter().map(|v| self.known.get(v).cloned());
        known.flatten().collect()
    }

    /// The best curvatures at given places; `None` where the places are too close to each other to tell them apart.
    pub(super) fn choose(&self, sites: Vec<Site>) -> Option<Choice> {
        let best = self.program(&sites).minimise(self.limits)?;
        let energy = self.base_energy + best.energy;
        energy.is_finite().then_some(Choice {
            sites,
            best,
            energy,
        })
    }

    fn program(&self, sites: &[Site]) -> Quadratic {
        let rows = sites.iter().flat_map(|a| {
            sites
                .iter()
                .map(|b| 0.5 * (a.column[b.vertex] + b.column[a.vertex]))
        });
        Quadratic {
            slope: sites.iter().map(|s| self.slope[s.vertex]).collect(),
            matrix: rows.collect(),
        }
    }

    /// Vertices that are worth most beside `choice`, and the variance that each promises at the least; near a vertex, or anywhere.
    ///
    /// Where curvatures are at a limit, the search begins at places for cones that stay there, and at places for cones that need not, because
    /// the new one relieves them. The second matter most where too few cones must make up the total and all are at their limits.
    pub(super) fn best_additions(&self, choice: &Choice, from: Option<usize>) -> Vec<(usize, f64)> {
        self.additions(choice, from, 1)
    }

    /// The same, but as many as `most` of either kind.
    pub(super) fn additions(
        &self,
        choice: &Choice,
        from: Option<usize>,
        most: usize,
    ) -> Vec<(usize, f64)> {
        let others = || {
            let found = self.beside(&choice.sites, &choice.best, from);
            found.unwrap_or_default()
        };
        let mut found = if choice.best.is_inside.iter().all(|inside| *inside) {
            others()
        } else {
            let starts: Vec<usize> = match from {
                Some(vertex) => vec![vertex],
                None => {
                    let unlimited = Limits {
                        range: [f64::NEG_INFINITY, f64::INFINITY],
                        ..self.limits
                    };
                    let relieved = self.program(&choice.sites).minimise(unlimited);
                    let relieved =
                        relieved.and_then(|best| self.beside(&choice.sites, &best, from));
                    let both = relieved.into_iter().flatten().chain(others());
                    both.map(|found| found.0).collect()
                }
            };
            self.within_limits(&choice.sites, &starts)
        };
        found.truncate(most);
        found
    }

    /// Vertices that are worth most beside `sites`, uphill from some, the best first, and the variance with each. Promises are too low where
    /// curvatures are at their limits, so here the best curvatures of all are found for every vertex that is looked at.
    fn within_limits(&self, sites: &[Site], from: &[usize]) -> Vec<(usize, f64)> {
        let known = self.program(sites);
        let gain = |v: usize, row: &mut Vec<f64>| -> f64 {
            row.clear();
            row.extend(sites.iter().map(|s| s.column[v]));
            let with = known.with_one_more(row, self.self_energy[v], self.slope[v]);
            let best = with.minimise(self.limits);
            best.map_or(f64::NEG_INFINITY, |best| -best.energy)
        };
        let taken = |v: usize| !self.allowed[v] || sites.iter().any(|s| s.vertex == v);
        let mut row = Vec::new();
        let mut starts: Vec<(usize, f64)> = from.iter().map(|&v| (v, gain(v, &mut row))).collect();
        // Stable: of equals the first.
        starts.sort_by(|a, b| b.1.total_cmp(&a.1));
        starts.truncate(CLIMBS);
        let tops = climb(self.connectivity, starts.into_iter(), taken, gain).into_iter();
        tops.map(|(v, gain)| (v, self.base_energy - gain)).collect()
    }

    /// Vertices that are worth most beside cones of given curvatures, the best first, and the variance that each promises.
    fn beside(
        &self,
        sites: &[Site],
        chosen: &Best,
        from: Option<usize>,
    ) -> Option<Vec<(usize, f64)>> {
        let has_total = self.limits.total.is_some();
        let inside: Vec<usize> = (0..sites.len()).filter(|&i| chosen.is_inside[i]).collect();
        let system = self
            .program(sites)
            .system(&inside, has_total && !inside.is_empty());
        let size = inside.len() + usize::from(has_total && !inside.is_empty());
        let mut inverse = Vec::with_capacity(size * size);
        for i in 0..size {
            let mut unit = vec![0.0; size];
            unit[i] = 1.0;
            inverse.extend(solve_dense(&system, &unit)?);
        }
        let [low, high] = self.limits.for_count(sites.len() + 1).range;
        let first = sites.is_empty().then_some(self.limits.total).flatten();
        let taken = |v: usize| !self.allowed[v] || sites.iter().any(|s| s.vertex == v);
        let worth = |e: f64, explained: f64, own: f64| -> f64 {
            let s = (own - explained).max(1e-6 * own);
            let c = first.unwrap_or((-e / s).clamp(low, high));
            match c == 0.0 {
                // The first of several that add up to 0: where a positive cone is wanted.
                true => -e,
                false => -c * (2.0 * e + c * s),
            }
        };
        let gain = |v: usize, row: &mut Vec<f64>| -> f64 {
            let e = chosen.multiplier + self.derivative(v, sites, &chosen.curvature);
            row.clear();
            row.extend(inside.iter().map(|&i| sites[i].column[v]));
            row.resize(size, 1.0);
            let explained: f64 = (0..size)
                .map(|i| row[i] * dot(&inverse[i * size..][..size], row))
                .sum();
            worth(e, explained, self.self_energy[v])
        };
        // All samples side by side.
        let piece = |(piece, samples): (usize, &[usize])| -> Vec<(usize, f64)> {
            let here = piece * PIECE..piece * PIECE + samples.len();
            let mut e: Vec<f64> = samples.iter().map(|&v| self.slope[v]).collect();
            for (site, c) in sites.iter().zip(&chosen.curvature) {
                add_scaled(&mut e, *c, &site.sampled[here.clone()]);
            }
            let mut explained = vec![0.0; samples.len()];
            let ones = [1.0; PIECE];
            let row = |i: usize| match inside.get(i) {
                Some(&site) => &sites[site].sampled[here.clone()],
                None => &ones[..samples.len()],
            };
            for i in 0..size {
                // The matrix is symmetric.
                let mut sum = vec![0.0; samples.len()];
                add_scaled(&mut sum, inverse[i * size + i], row(i));
                for j in 0..i {
                    add_scaled(&mut sum, 2.0 * inverse[i * size + j], row(j));
                }
                let terms = explained.iter_mut().zip(row(i)).zip(&sum);
                terms.for_each(|((x, r), s)| *x += r * s);
            }
            let terms = samples.iter().zip(&e).zip(&explained);
            terms
                .map(|((&v, e), explained)| {
                    let e = chosen.multiplier + e;
                    (v, worth(e, *explained, self.self_energy[v]))
                })
                .collect()
        };
        let starts: Vec<(usize, f64)> = match from {
            Some(v) => vec![(v, gain(v, &mut Vec::new()))],
            None => {
                let pieces = self.samples.par_chunks(PIECE).enumerate().map(piece);
                pieces.collect::<Vec<_>>().concat()
            }
        };
        let now = self.base_energy + chosen.energy;
        let tops = climb(self.connectivity, starts.into_iter(), taken, gain).into_iter();
        Some(tops.map(|(v, gain)| (v, now - gain)).collect())
    }

    /// Half the derivative of the energy by curvature at `v`, with these cones.
    pub(super) fn derivative(&self, v: usize, sites: &[Site], curvature: &[f64]) -> f64 {
        let cones = sites.iter().zip(curvature);
        self.slope[v] + cones.map(|(site, c)| c * site.column[v]).sum::<f64>()
    }

    /// Variance of the log scale with these cones.
    pub(super) fn energy(&self, sites: &[Site], curvature: &[f64]) -> f64 {
        self.base_energy + self.program(sites).energy(curvature)
    }

    /// The best of `sites` with one of some vertices put at a place of the list.
    pub(super) fn with_one_of(
        &mut self,
        sites: &[Site],
        at: usize,
        vertices: &[usize],
    ) -> Option<Choice> {
        let new = self.sites(vertices);
        let choices = new.into_iter().filter_map(|site| {
            let mut sites = sites.to_vec();
            sites.insert(at, site);
            self.choose(sites)
        });
        choices.reduce(|a, b| if b.energy < a.energy { b } else { a })
    }

    /// Adds the best vertex; `None` where nothing can be added.
    pub(super) fn add(&mut self, choice: &Choice) -> Option<Choice> {
        let vertices: Vec<usize> = self
            .best_additions(choice, None)
            .iter()
            .map(|v| v.0)
            .collect();
        self.with_one_of(&choice.sites, choice.sites.len(), &vertices)
    }

    /// Takes away one cone.
    pub(super) fn without(&self, choice: &Choice, i: usize) -> Option<Choice> {
        let mut sites = choice.sites.clone();
        sites.remove(i);
        self.choose(sites)
    }
}

/// Adds c times b to a.
fn add_scaled(a: &mut [f64], c: f64, b: &[f64]) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += c * b);
}
