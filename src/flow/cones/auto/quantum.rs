//! Curvatures that are multiples of a quantum.
//!
//! *Enters:* cones of any curvature. *Leaves:* cones whose curvatures are whole numbers of quanta, of either sign, with the same total.
//!
//! Integers take the problem out of convex programming; Li et al. 2022 round and re-optimise. Here the energy is a quadratic function
//! with known columns, so local search is cheap: one quantum moves from one cone to another, a cone moves to another
//! place, with or without giving a quantum to another cone, cones of nothing disappear and new ones of one quantum appear.
//! Every step lowers the energy, so it ends.

use super::area::Points;
use super::arrangement::{Arrangement, Rule};
use super::climb::climb;
use super::found::Found;
use super::moves::FINE;
use super::placement::{Choice, Placement, Site};
use super::quadratic::Limits;
use crate::geometry::mesh::Mesh;

/// Share of the energy that a step must gain.
const LEAST_GAIN: f64 = 1e-3;
/// Rounds of moving cones and quanta for (9).
const ROUNDS: usize = 4;
/// Greatest numbers of quanta at a cone that are tried at most, the least first.
const CAPS: usize = 4;
/// Passes over all cones.
const PASSES: usize = 8;

/// Whole numbers of one quantum.
#[derive(Clone, Copy)]
pub(super) struct Quanta {
    /// One, radians.
    pub(super) size: f64,
    /// Least and greatest number at a cone.
    range: [i64; 2],
    /// Their sum, where it is fixed.
    total: Option<i64>,
}

impl Quanta {
    /// `None` where the total is no whole number of quanta.
    pub(super) fn new(size: f64, limits: Limits) -> Option<Self> {
        let [low, high] = limits.range;
        let rounding = 1e-9;
        let total = match limits.total {
            Some(total) => {
                let count = (total / size).round();
                if (total - count * size).abs() > rounding {
                    return None;
                }
                Some(count as i64)
            }
            None => None,
        };
        Some(Self {
            size,
            range: [
                (low / size - rounding).ceil() as i64,
                (high / size + rounding).floor() as i64,
            ],
            total,
        })
    }

    /// Limits with each greatest number of quanta at a cone that lets `count` cones meet the total.
    pub(super) fn caps(self, count: usize) -> Vec<Limits> {
        let [low, high] = self.range;
        let enough = |cap: i64| self.total.is_none_or(|total| cap * count as i64 >= total);
        let total = self.total.map(|k| k as f64 * self.size);
        (1..=high.max(1))
            .filter(|&cap| cap <= high && enough(cap))
            .take(CAPS)
            .map(|cap| Limits {
                range: [low as f64 * self.size, cap as f64 * self.size],
                total,
            })
            .collect()
    }

    fn allows(self, k: i64) -> bool {
        (self.range[0]..=self.range[1]).contains(&k)
    }

    fn radians(self, k: &[i64]) -> Vec<f64> {
        k.iter().map(|&k| k as f64 * self.size).collect()
    }

    /// Changes by one quantum at one or two of `count` cones: from −1 and to +1, `None` where the rest of the surface gives or takes it.
    fn transfers(self, count: usize) -> Vec<(Option<usize>, Option<usize>)> {
        let ends: Vec<Option<usize>> = match self.total {
            Some(_) => (0..count).map(Some).collect(),
            None => (0..count).map(Some).chain([None]).collect(),
        };
        let pairs = ends
            .iter()
            .flat_map(|&from| ends.iter().map(move |&to| (from, to)));
        pairs.filter(|(from, to)| from != to).collect()
    }

    /// The numbers after a transfer; `None` where it is not allowed.
    fn transferred(self, k: &[i64], from: Option<usize>, to: Option<usize>) -> Option<Vec<i64>> {
        let mut k = k.to_vec();
        for (end, change) in [(from, -1), (to, 1)] {
            if let Some(i) = end {
                k[i] += change;
                if !self.allows(k[i]) {
                    return None;
                }
            }
        }
        Some(k)
    }

    /// Rounds, then moves quanta so that the total is met, each time where `energy` is least.
    fn rounded(self, curvature: &[f64], energy: impl Fn(&[i64]) -> f64) -> Vec<i64> {
        let [low, high] = self.range;
        let near = |c: &f64| ((c / self.size).round() as i64).clamp(low, high);
        let mut k: Vec<i64> = curvature.iter().map(near).collect();
        let Some(total) = self.total else { return k };
        loop {
            let missing = total - k.iter().sum::<i64>();
            let ends = (0..k.len()).map(|i| match missing > 0 {
                true => (None, Some(i)),
                false => (Some(i), None),
            });
            let next = ends
                .filter_map(|(from, to)| self.transferred(&k, from, to))
                .map(|k| (energy(&k), k))
                .reduce(|a, b| if b.0 < a.0 { b } else { a });
            match next {
                Some((_, next)) if missing != 0 => k = next,
                _ => return k,
            }
        }
    }

    /// The best transfer that lowers `energy` from `now` by enough.
    fn best_transfer(
        self,
        k: &[i64],
        now: f64,
        energy: impl Fn(&[i64]) -> f64,
    ) -> Option<(f64, Vec<i64>)> {
        self.transfers(k.len())
            .into_iter()
            .filter_map(|(from, to)| self.transferred(k, from, to))
            .map(|k| (energy(&k), k))
            .reduce(|a, b| if b.0 < a.0 { b } else { a })
            .filter(|(e, _)| *e < now * (1.0 - LEAST_GAIN))
    }
}

/// Cones of whole quanta with little variance of the log scale, at most `count`: vertices and curvatures. `None` where the limits leave
/// no way to meet the total.
pub(super) fn quantise(
    placement: &mut Placement,
    choice: &Choice,
    quanta: Quanta,
    count: usize,
) -> Option<Found> {
    let mut sites = choice.sites.clone();
    let of = |placement: &Placement, sites: &[Site], k: &[i64]| {
        placement.energy(sites, &quanta.radians(k))
    };
    let mut k = quanta.rounded(&choice.best.curvature, |k| of(placement, &sites, k));
    if quanta
        .total
        .is_some_and(|total| k.iter().sum::<i64>() != total)
    {
        return None;
    }
    let mut energy = of(placement, &sites, &k);
    for _ in 0..PASSES {
        let before = energy;
        while let Some((e, next)) = quanta.best_transfer(&k, energy, |k| of(placement, &sites, k)) {
            (energy, k) = (e, next);
        }
        let kept: Vec<bool> = k.iter().map(|&k| k != 0).collect();
        let mut keep = kept.iter();
        sites.retain(|_| keep.next().copied().unwrap_or(false));
        k.retain(|&k| k != 0);
        // The last is a cone that is not there yet.
        let places = sites.len() + usize::from(sites.len() < count);
        for i in 0..places {
            let Some((vertex, numbers, promised)) = best_place(placement, &sites, &k, i, quanta)
            else {
                continue;
            };
            if promised >= energy * (1.0 - LEAST_GAIN) {
                continue;
            }
            let mut moved = sites.clone();
            moved.truncate(i);
            moved.extend(placement.sites(&[vertex]));
            moved.extend(sites.iter().skip(i + 1).cloned());
            let e = of(placement, &moved, &numbers);
            if e < energy * (1.0 - LEAST_GAIN) {
                (energy, sites, k) = (e, moved, numbers);
            }
        }
        if energy > before * (1.0 - LEAST_GAIN) {
            break;
        }
    }
    let mut cones: Vec<(usize, f64)> = sites
        .iter()
        .map(|s| s.vertex)
        .zip(quanta.radians(&k))
        .collect();
    cones.retain(|(_, c)| *c != 0.0);
    let (vertices, curvature) = cones.into_iter().unzip();
    Some(Found {
        vertices,
        curvature,
        cost: energy,
        distortion: 0.0,
    })
}

/// Where cone `i` would best be, with what numbers of quanta, and the energy then. `i` may be one past the last.
fn best_place(
    placement: &Placement,
    sites: &[Site],
    k: &[i64],
    i: usize,
    quanta: Quanta,
) -> Option<(usize, Vec<i64>, f64)> {
    let mut k = k.to_vec();
    k.resize(k.len().max(i + 1), 0);
    let stay = (k[i] != 0).then(|| k.clone());
    let transfers = quanta.transfers(k.len()).into_iter();
    let touching = transfers.filter(|(from, to)| *from == Some(i) || *to == Some(i));
    let others: Vec<Site> = (0..sites.len())
        .filter(|&j| j != i)
        .map(|j| sites[j].clone())
        .collect();
    touching
        .filter_map(|(from, to)| quanta.transferred(&k, from, to))
        .chain(stay)
        .filter(|k| k[i] != 0)
        .filter_map(|k| {
            let mut curvature = quanta.radians(&k);
            let c = curvature.remove(i);
            let rest = placement.energy(&others, &curvature);
            let worth = |v: usize, _: &mut Vec<f64>| {
                let e = placement.derivative(v, &others, &curvature);
                -c * (2.0 * e + c * placement.self_energy[v])
            };
            let taken = |v: usize| !placement.allowed[v] || others.iter().any(|s| s.vertex == v);
            let mut none = Vec::new();
            let samples = placement.samples.iter().map(|&v| (v, worth(v, &mut none)));
            let samples: Vec<(usize, f64)> = samples.collect();
            let tops = climb(placement.connectivity, samples.into_iter(), taken, worth);
            let &(vertex, gain) = tops.first()?;
            Some((vertex, k, rest - gain))
        })
        .reduce(|a, b| if b.2 < a.2 { b } else { a })
}

/// Moves cones, and quanta between them, as long as that lowers (9).
pub(super) fn lower_distortion(
    placement: &mut Placement,
    mesh: &Mesh,
    mut found: Found,
    quanta: Quanta,
) -> Found {
    found.cost = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = placement.arrangement(&found.vertices, &found.curvature, Rule::Fixed);
        let now = placement.lower_distortion(mesh, start, Rule::Fixed);
        let now = placement.near(mesh, now, Rule::Fixed, FINE);
        if now.value() >= found.cost * (1.0 - LEAST_GAIN) {
            break;
        }
        let curvature = transfer(placement.points(), &now, quanta);
        found = now.found();
        if curvature == found.curvature {
            break;
        }
        found.curvature = curvature;
        let kept: Vec<bool> = found.curvature.iter().map(|c| *c != 0.0).collect();
        let mut keep = kept.iter();
        (found.vertices).retain(|_| keep.next().copied().unwrap_or(true));
        found.curvature.retain(|c| *c != 0.0);
    }
    found
}

/// Moves quanta between cones that stay where they are, as long as that lowers (9).
fn transfer(points: Points, now: &Arrangement, quanta: Quanta) -> Vec<f64> {
    let answers = now.answers();
    let mut k: Vec<i64> = now
        .curvature()
        .iter()
        .map(|c| (c / quanta.size).round() as i64)
        .collect();
    let value = |k: &[i64]| points.value(&answers, &quanta.radians(k));
    let mut least = value(&k);
    while let Some((reached, next)) = quanta.best_transfer(&k, least, value) {
        (least, k) = (reached, next);
    }
    quanta.radians(&k)
}
