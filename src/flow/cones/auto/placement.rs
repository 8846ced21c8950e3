//! A choice of places, and what every other place would add to it.
//!
//! *Enters:* the linear picture, and what curvature is given. *Leaves:* the cones whose log scale has the least variance that the search
//! finds.
//!
//! With u = u₀ + Σ c_i g_i, where g_v answers a unit of curvature at v, the variance of u over the area is a quadratic function of the
//! curvatures c. Its matrix is the biharmonic Green's function B(v, w) = ∫ g_v g_w, and one column of B takes two
//! back-substitutions. The columns of the cones alone tell *for every vertex at once* what the best cones with that vertex would be worth:
//!
//! * half the derivative e(v) of the energy by curvature at v, with all else at its best, is a sum of columns;
//! * its second derivative s(v) is what B(v, v) leaves after projection on the columns (the power function of kriging);
//! * so the energy falls by e²/s, and no solve is needed to know it.
//!
//! Greedy addition of the best vertex is Ben-Chen, Gotsman and Bunin 2008 with the least variance in place of the largest
//! value; that few cones are enough is what Soliman, Slepčev and Crane 2018 and Fang et al. 2021 show with convex relaxations.
//! Ours is the exact gain for every vertex and the exchange: each cone in turn is taken away and put where it is worth most, until
//! none wants to move. B(v, v) is known at vertices far from each other and interpolated between, which costs a little optimality
//! and no correctness, because a vertex is taken only when its own column says that the energy falls.

use super::picture::Picture;
use super::quadratic::{Best, Limits, Quadratic};
use crate::flow::solve::solve_dense;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::VertexId;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Share of the energy that an exchange must gain while the search looks for the right part of the surface …
const COARSE_GAIN: f64 = 1e-2;
/// … and at the end, for the right vertex: below this places differ by less than an edge.
const FINE_GAIN: f64 = 1e-4;
/// Most rounds of adding and taking away.
const ROUNDS: usize = 3;
/// A cone is idle that lowers the standard deviation of the log scale by less than this share …
const IDLE: f64 = 0.01;
/// … and so is every one where it is below this without.
const NOTHING: f64 = 1e-6;
/// Share of the energy that may be rounding.
const ROUNDING: f64 = 1e-7;
/// Vertices of all searches from a first cone of their own.
const STARTS: usize = 20_000;
/// Passes of exchanges over all cones.
const PASSES: usize = 12;
/// Vertices that are looked at everywhere; from the best of them the search climbs to a vertex that is better than its neighbours.
const SAMPLES: usize = 2000;
/// Samples to climb from.
const SUMMITS: usize = 6;
/// Numbers in the columns that are kept.
const KNOWN: usize = 1 << 25;
/// Samples a thread looks at in one go.
const PIECE: usize = 256;

/// Cones to be chosen; see the module docs.
pub(super) struct Placement<'a> {
    pub(super) picture: &'a mut Picture,
    connectivity: &'a Connectivity,
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
    known: BTreeMap<usize, Arc<[f64]>>,
}

/// A vertex with its column of B.
#[derive(Clone)]
pub(super) struct Site {
    pub(super) vertex: usize,
    column: Arc<[f64]>,
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
    fn len(&self) -> usize {
        self.base.len()
    }

    /// g of some vertices, one after another: the log scale that a unit of curvature causes there.
    pub(super) fn responses(&mut self, vertices: &[usize]) -> Vec<f64> {
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
        let columns = new.iter().zip(fields.chunks(n));
        self.known
            .extend(columns.map(|(&v, column)| (v, Arc::from(column))));
        let site = |&vertex: &usize| {
            let column = self.known.get(&vertex)?.clone();
            Some(Site { vertex, column })
        };
        vertices.iter().filter_map(site).collect()
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
    /// Where curvatures are at a limit, two are named: one for cones that stay there, and one for cones that need not, because the new one
    /// relieves them. The second matters most where too few cones must make up the total and all are at their limits.
    pub(super) fn best_additions(&self, choice: &Choice, from: Option<usize>) -> Vec<(usize, f64)> {
        let mut found: Vec<(usize, f64)> = Vec::new();
        if choice.best.is_inside.iter().any(|inside| !inside) {
            let unlimited = Limits {
                range: [f64::NEG_INFINITY, f64::INFINITY],
                ..self.limits
            };
            let relieved = self.program(&choice.sites).minimise(unlimited);
            found.extend(relieved.and_then(|best| self.best_beside(&choice.sites, &best, from)));
        }
        if let Some(other) = self.best_beside(&choice.sites, &choice.best, from)
            && found.iter().all(|one| one.0 != other.0)
        {
            found.push(other);
        }
        found
    }

    /// The vertex that is worth most beside cones of given curvatures, and the variance that it promises.
    fn best_beside(
        &self,
        sites: &[Site],
        chosen: &Best,
        from: Option<usize>,
    ) -> Option<(usize, f64)> {
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
        let gain = |v: usize, row: &mut Vec<f64>| -> f64 {
            let e = chosen.multiplier + self.derivative(v, sites, &chosen.curvature);
            row.clear();
            row.extend(inside.iter().map(|&i| sites[i].column[v]));
            row.resize(size, 1.0);
            let explained: f64 = (0..size)
                .map(|i| row[i] * dot(&inverse[i * size..][..size], row))
                .sum();
            let own = self.self_energy[v];
            let s = (own - explained).max(1e-6 * own);
            let c = first.unwrap_or((-e / s).clamp(low, high));
            match c == 0.0 {
                // The first of several that add up to 0: where a positive cone is wanted.
                true => -e,
                false => -c * (2.0 * e + c * s),
            }
        };
        let best = self.climb(from, taken, gain)?;
        Some((best.0, self.base_energy + chosen.energy - best.1))
    }

    /// The vertex worth most: uphill from one vertex, or from the best of the samples. `worth` gets a buffer of its own.
    pub(super) fn climb(
        &self,
        from: Option<usize>,
        taken: impl Fn(usize) -> bool + Sync,
        worth: impl Fn(usize, &mut Vec<f64>) -> f64 + Sync,
    ) -> Option<(usize, f64)> {
        let starts = match &from {
            Some(vertex) => std::slice::from_ref(vertex),
            None => &self.samples,
        };
        let scored: Vec<(usize, f64)> = starts
            .par_iter()
            .with_min_len(PIECE)
            .filter(|&&v| !taken(v))
            .map_init(Vec::new, |row, &v| (v, worth(v, row)))
            .collect();
        let mut row = Vec::new();
        let mut best: Option<(usize, f64)> = None;
        for mut top in summits(&scored) {
            loop {
                let around = self.connectivity.neighbours(VertexId::new(top.0));
                let next = around
                    .map(VertexId::index)
                    .filter(|&w| !taken(w))
                    .map(|w| (w, worth(w, &mut row)))
                    .fold(top, |a, b| if b.1 > a.1 { b } else { a });
                if next.0 == top.0 {
                    break;
                }
                top = next;
            }
            if best.is_none_or(|b| top.1 > b.1) {
                best = Some(top);
            }
        }
        best
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

    /// Moves cones one by one to where they are worth most, anywhere or (`nearby`) uphill from where they are, until none gains more than
    /// `least_gain` of the energy.
    pub(super) fn exchange(&mut self, mut choice: Choice, least_gain: f64, nearby: bool) -> Choice {
        let count = choice.sites.len();
        // Cones that stayed where they were since anything moved.
        let (mut stayed, mut next) = (0, 0);
        let mut looked = 0;
        while stayed < count && looked < PASSES * count {
            looked += 1;
            let from = nearby.then(|| choice.sites[next].vertex);
            let moved = self.without(&choice, next).and_then(|rest| {
                let vertices = self.best_additions(&rest, from).into_iter();
                let vertices: Vec<usize> = vertices
                    .filter(|v| v.1 <= choice.energy * (1.0 - least_gain))
                    .map(|v| v.0)
                    .collect();
                self.with_one_of(&rest.sites, next, &vertices)
            });
            match moved.filter(|moved| moved.energy < choice.energy * (1.0 - least_gain)) {
                Some(moved) => {
                    choice = moved;
                    stayed = 0;
                }
                None => stayed += 1,
            }
            next = (next + 1) % count;
        }
        choice
    }

    /// `count` cones, or fewer where there are no more places.
    ///
    /// Exchange finds a local optimum. So as many cones again are added, the least valuable of all are taken away, and cones are
    /// exchanged once more, as long as that helps.
    pub(super) fn search(&mut self, count: usize) -> Option<Choice> {
        if count == 0 {
            return self.choose(Vec::new());
        }
        let mut choice = self.first_choice(count)?;
        for _ in 0..ROUNDS {
            let more = self.grow(choice.clone(), 2 * count.max(2));
            let Some(fewer) = self.prune(more, count) else {
                break;
            };
            let other = self.exchange(fewer, COARSE_GAIN, false);
            let gained = choice.energy - other.energy;
            let go_on = gained > COARSE_GAIN * choice.energy;
            if gained > 0.0 {
                choice = other;
            }
            if !go_on {
                break;
            }
        }
        choice = self.exchange_pairs(choice, COARSE_GAIN);
        Some(self.exchange(choice, FINE_GAIN, false))
    }

    /// From nothing to cones that no single move improves much. On a small mesh, where that is cheap, the first cone is put at several places
    /// in turn.
    fn first_choice(&mut self, count: usize) -> Option<Choice> {
        let starts = (STARTS / self.len().max(1)).min(self.samples.len());
        let step = self.samples.len().div_ceil(starts.max(1)).max(1);
        let firsts = self.samples.iter().copied().step_by(step).take(starts);
        let mut starts = vec![Vec::new()];
        for first in firsts.collect::<Vec<usize>>() {
            starts.push(self.sites(&[first]));
        }
        let mut best: Option<Choice> = None;
        for start in starts {
            let Some(start) = self.choose(start) else {
                continue;
            };
            let start = self.grow(start, count);
            let choice = self.exchange(start, COARSE_GAIN, false);
            // Starts that end at the same places differ by rounding.
            let is_better = |b: &Choice| choice.energy < b.energy * (1.0 - ROUNDING);
            if best.as_ref().is_none_or(is_better) {
                best = Some(choice);
            }
        }
        best
    }

    /// Adds the best vertex again and again.
    fn grow(&mut self, mut choice: Choice, count: usize) -> Choice {
        while choice.sites.len() < count {
            let Some(next) = self.add(&choice) else { break };
            choice = next;
        }
        choice
    }

    /// Takes away the cones that are worth least, one by one, until `count` are left.
    pub(super) fn prune(&self, mut choice: Choice, count: usize) -> Option<Choice> {
        while choice.sites.len() > count {
            choice = self.cheapest_removal(&choice)?;
        }
        Some(choice)
    }

    /// The best curvatures at these places and near them, after u without cones has changed.
    pub(super) fn settle(&mut self, choice: Choice) -> Option<Choice> {
        let weighed = self.choose(choice.sites)?;
        Some(self.exchange(weighed, FINE_GAIN, true))
    }

    /// Takes away cones that do not pay, as long as more than `least` are left: those without which the standard deviation of the log
    /// scale grows by less than a share of it, or stays nothing.
    pub(super) fn drop_idle(&self, mut choice: Choice, least: usize) -> Choice {
        while choice.sites.len() > least {
            let Some(fewer) = self.cheapest_removal(&choice) else {
                break;
            };
            let (with, without) = (choice.deviation(), fewer.deviation());
            if without > NOTHING && without > with * (1.0 + IDLE) {
                break;
            }
            choice = fewer;
        }
        choice
    }

    /// The fewest cones, from `least` to `most`, with |u − mean| within `bound` on every face, or `most` of them.
    pub(super) fn search_bounded(
        &mut self,
        least: usize,
        most: usize,
        bound: f64,
    ) -> Option<Choice> {
        let mut choice = self.search(least)?;
        while self.largest_deviation(&choice) > bound && choice.sites.len() < most {
            let Some(more) = self.add(&choice) else { break };
            choice = self.exchange(more, COARSE_GAIN, false);
        }
        Some(self.exchange(choice, FINE_GAIN, false))
    }

    /// max |u − mean| over the faces, u of a face being that of its corners on average.
    fn largest_deviation(&mut self, choice: &Choice) -> f64 {
        let vertices = choice.vertices();
        let u = self.log_scale_of(vertices.iter().zip(&choice.best.curvature));
        let mean = self.picture.mean(&u);
        let faces = self.connectivity.faces();
        faces
            .map(|f| {
                let corners = self.connectivity.face_vertices(f);
                let own = corners.iter().map(|v| u[v.index()]).sum::<f64>() / 3.0;
                (own - mean).abs()
            })
            .fold(0.0, f64::max)
    }

    /// Without the cone that is worth least.
    pub(super) fn cheapest_removal(&self, choice: &Choice) -> Option<Choice> {
        (0..choice.sites.len())
            .filter_map(|i| self.without(choice, i))
            .reduce(|a, b| if b.energy < a.energy { b } else { a })
    }
}

/// The few that are worth most.
fn summits(scored: &[(usize, f64)]) -> Vec<(usize, f64)> {
    let mut best: Vec<(usize, f64)> = Vec::with_capacity(SUMMITS + 1);
    for &one in scored {
        let place = best.partition_point(|b| b.1 >= one.1);
        if place < SUMMITS {
            best.insert(place, one);
            best.truncate(SUMMITS);
        }
    }
    best
}

/// Vertices spread over the surface, about `count` of them: those of the lowest `order` first, none within some edges of another.
fn sample(
    connectivity: &Connectivity,
    allowed: &[bool],
    order: &[f64],
    count: usize,
) -> Vec<usize> {
    let mut vertices: Vec<usize> = (0..order.len()).filter(|&v| allowed[v]).collect();
    vertices.sort_by(|&v, &w| order[v].total_cmp(&order[w]).then(v.cmp(&w)));
    if vertices.len() <= 2 * count {
        return vertices;
    }
    let radius = ((vertices.len() / count) as f64).sqrt().round().max(1.0) as usize;
    let mut is_near = vec![false; order.len()];
    let mut samples = Vec::new();
    for v in vertices {
        if is_near[v] {
            continue;
        }
        samples.push(v);
        is_near[v] = true;
        let (mut ring, mut within) = (vec![v], vec![v]);
        for _ in 0..radius {
            let mut next = Vec::new();
            for &x in &ring {
                for w in connectivity
                    .neighbours(VertexId::new(x))
                    .map(VertexId::index)
                {
                    if !within.contains(&w) {
                        within.push(w);
                        next.push(w);
                        is_near[w] = true;
                    }
                }
            }
            ring = next;
        }
    }
    samples
}

/// Σ a b in a fixed order.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
