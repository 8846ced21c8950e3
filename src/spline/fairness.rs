//! Fairness: sums of control points that are as in the quad mesh where nothing else says what they are.
//!
//! *Enters:* a control mesh and the points of the quad mesh. *Leaves:* a [`Difference`] for every line through a point, and for every wave of edges around an irregular one.

use super::cage::{Cage, CellSide, Kind};
use std::f64::consts::PI;

/// A sum of control points that is to be near to one of points of the quad mesh.
#[derive(Clone)]
pub struct Difference {
    /// Control points and what each counts.
    pub points: Vec<(u32, f64)>,
    /// The point that it is about.
    pub at: u32,
    /// That of the quad mesh.
    pub wanted: [f64; 3],
}

impl Difference {
    /// The sum over points, of which `of` gives the coordinates.
    pub fn sum(&self, of: impl Fn(u32) -> [f64; 3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for &(v, x) in &self.points {
            let p = of(v);
            (0..3).for_each(|i| sum[i] += x * p[i]);
        }
        sum
    }
}

/// All differences of a control mesh; `quads`: points of the quad mesh.
pub fn differences(cage: &Cage, quads: &[[f64; 3]]) -> Vec<Difference> {
    let mut all = lines(cage);
    for difference in &mut all {
        difference.wanted = difference.sum(|v| quads[v as usize]);
    }
    all
}

/// Second differences along both lines through a regular point, along creases, and along lines through points with three cells or more between two creases; and how far the edges at an irregular point are from flat.
fn lines(cage: &Cage) -> Vec<Difference> {
    let kinds = cage.kinds();
    let mut all = Vec::new();
    for (v, side) in cage.leaving().into_iter().enumerate() {
        let Some(side) = side else { continue };
        let at = v as u32;
        let star = cage.star(side);
        let end = |&(c, k): &(u32, u8)| cage.cells[c as usize][usize::from((k + 1) & 3)];
        let second = |a: u32, b: u32| Difference {
            points: vec![(at, -2.0), (a, 1.0), (b, 1.0)],
            at,
            wanted: [0.0; 3],
        };
        match kinds[v] {
            Kind::Smooth if star.len() == 4 => {
                all.push(second(end(&star[0]), end(&star[2])));
                all.push(second(end(&star[1]), end(&star[3])));
            }
            Kind::Smooth | Kind::Dart => {
                let ends: Vec<u32> = star.iter().map(end).collect();
                all.extend(from_flat(at, &ends));
            }
            kind => {
                let least = if kind == Kind::Crease { 3 } else { 4 };
                let sectors = sectors(cage, &star);
                let mut lines: Vec<[u32; 2]> = sectors
                    .iter()
                    .filter(|ends| ends.len() >= least)
                    .flat_map(|ends| ends.iter().zip(&ends[2..]))
                    .map(|(&a, &b)| [a.min(b), a.max(b)])
                    .collect();
                lines.sort_unstable();
                lines.dedup();
                all.extend(lines.into_iter().map(|[a, b]| second(a, b)));
            }
        }
    }
    all
}

/// Of the cells between two creases around a point, the ends of the edges that leave it, creases first and last.
fn sectors(cage: &Cage, star: &[CellSide]) -> Vec<Vec<u32>> {
    let mut star = star.to_vec();
    let first = star.iter().position(|&s| cage.is_crease(s));
    star.rotate_left(first.unwrap_or(0));
    let mut sectors: Vec<Vec<u32>> = Vec::new();
    for &(c, k) in &star {
        let corners = cage.cells[c as usize];
        let end = |k: u8| corners[usize::from(k & 3)];
        if cage.is_crease((c, k)) || sectors.is_empty() {
            sectors.push(vec![end(k + 1)]);
        }
        if let Some(sector) = sectors.last_mut() {
            sector.push(end(k + 3));
        }
    }
    sectors
}

/// How far edges that leave a point are from those of a regular polygon after an affine map: waves around it but those that turn once. With four edges their squares add up to those of both second differences.
fn from_flat(at: u32, ends: &[u32]) -> Vec<Difference> {
    let n = ends.len();
    let wave = |k: usize, shift: f64| {
        let turn = 2.0 * PI * k as f64 / n as f64;
        // Sums of squares of a constant and of an alternating wave are twice those of others.
        let size = if (2 * k).is_multiple_of(n) { 2.0 } else { 4.0 };
        let weight = |i: usize| (size / n as f64).sqrt() * (turn * i as f64 - shift).cos();
        let weights: Vec<f64> = (0..n).map(weight).collect();
        let mut points: Vec<(u32, f64)> = ends.iter().copied().zip(weights.clone()).collect();
        points.push((at, -weights.iter().sum::<f64>()));
        Difference {
            points,
            at,
            wanted: [0.0; 3],
        }
    };
    let mut all = vec![wave(0, 0.0)];
    for k in 2..=n / 2 {
        all.push(wave(k, 0.0));
        if 2 * k < n {
            all.push(wave(k, PI / 2.0));
        }
    }
    all
}

#[cfg(test)]
#[path = "tests/fairness.rs"]
mod tests;
