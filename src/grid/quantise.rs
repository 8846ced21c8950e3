//! From lengths to whole numbers of cells (`docs/method.md`, 9).
//!
//! *Enters:* a cone triangulation, how many cells are wanted. *Leaves:* a [`Lattice`] where nothing is missing. *Guaranteed:* steps close around every face, every face has a positive area, angles around vertices and
//! between lines are those of the surface, lines lie on the lattice; or an error. The same bytes every time. *Not guaranteed:* the least E: walks are taken one by one as long as each lowers it.
//!
//! Steps are rounded, and faces closed by shortest paths from a surplus to a lack. Then faces without area are mended, each by the cheapest walk that takes away from what is missing in all; then walks that lower E are taken.
//! Sides are flipped to be Delaunay on the lattice, which moves what single walks can reach, and walks are tried again.

use super::complex::{Complex, turned};
use super::error::GridError;
use super::lattice::{Lattice, UNIT};
use super::params::MOST_CELLS;
use super::walk::{Entry, State, Walks};
use crate::geometry::ids::{FaceId, HalfedgeId, VertexVec};
use std::collections::{BTreeMap, BinaryHeap};

/// Most cells for every one that is wanted or cone there is, and beside those.
const MOST_FOR_CELL: f64 = 32.0;
const MOST_BESIDE: f64 = 20_000.0;
/// Most cells along a side, whose squares stay within 64 bits.
const LONGEST: f64 = 1e9;
/// Rounds of mending in which nothing is gained, before it is tried at a larger size.
const MOST_STUCK: usize = 40;
/// Factor between sizes.
const GROWTH: f64 = std::f64::consts::SQRT_2;
const MOST_GROWTHS: usize = 24;
/// Cost from which on walks are no longer followed where they are to lower E: each side costs about one.
const MOST_COST: f64 = 40.0;
/// Rounds of walks over all sides.
const MOST_ROUNDS: usize = 20;
/// Rounds of walks and flips.
const MOST_FLIP_ROUNDS: usize = 4;
/// States that searches may visit in all to lower E, about four seconds; a hundred cones need a tenth of it.
const MOST_VISITS: usize = 30_000_000;
/// Least decrease of E that counts.
const GAIN: f64 = 1e-9;
/// Cost of a side without length.
const NO_LENGTH: f64 = 1000.0;
/// The number of cells is mended by the size where it misses what is wanted by more than this part.
const NEAR: f64 = 0.05;
const MOST_SIZES: usize = 6;
/// Smaller sizes one after the other at which nothing changes, before no fewer cells are thought to fit.
const MOST_UNCHANGED: usize = 2;

/// Steps for about as many cells as are wanted: as near as can be, but no fewer than the cones need.
pub fn quantise(complex: &Complex, vertices: usize, cells: f64) -> Result<Lattice, GridError> {
    let most = MOST_CELLS as f64;
    let is_number = (1.0..=most).contains(&cells);
    if !is_number {
        return Err(GridError::Cells { cells, most });
    }
    let area: f64 = complex.faces().map(|f| 0.5 * complex.double_area(f)).sum();
    let wanted = (cells / area).sqrt();
    let mut walks = Walks::default();
    let mut lattice = first(complex, vertices, wanted, &mut walks)?;
    let angles = Lattice::new(complex.clone(), wanted).angles(vertices, false);
    // From where faces could be mended to where they are wanted: nothing is missing on the way.
    lattice.settle(vertices, &angles, &mut walks);
    while lattice.scale > wanted {
        lattice.scale = (lattice.scale / GROWTH).max(wanted);
        lattice.settle(vertices, &angles, &mut walks);
    }
    // Whole numbers may fall to one side: then the size is to blame.
    let mut best = lattice.clone();
    let miss = |lattice: &Lattice| (cells / lattice.cells() as f64).ln();
    let (mut low, mut high) = (None, None);
    let mut unchanged = 0;
    for _ in 0..MOST_SIZES {
        let off = miss(&lattice);
        if off.abs() < NEAR {
            break;
        }
        match off > 0.0 {
            true => low = Some(lattice.scale),
            false => high = Some(lattice.scale),
        }
        lattice.scale = match (low, high) {
            (Some(low), Some(high)) => f64::sqrt(low * high),
            // Farther where the last size was too near for a walk.
            _ => lattice.scale * (0.5 * (1 + unchanged) as f64 * off).exp(),
        };
        let before = lattice.cells();
        lattice.settle(vertices, &angles, &mut walks);
        if miss(&lattice).abs() < miss(&best).abs() {
            best = lattice.clone();
        }
        unchanged = if lattice.cells() == before {
            unchanged + 1
        } else {
            0
        };
        // No fewer fit between the cones.
        if off < 0.0 && unchanged == MOST_UNCHANGED {
            break;
        }
    }
    let most = MOST_FOR_CELL * (cells + vertices as f64) + MOST_BESIDE;
    let found = best.cells();
    match found as f64 > most {
        true => Err(GridError::TooMany {
            cells: found,
            wanted: cells,
            least: (found as f64 - MOST_BESIDE) / MOST_FOR_CELL,
        }),
        false => Ok(best),
    }
}

/// Steps where nothing is missing, at a size as wanted or so much larger that faces can be mended: rounding matters less and less.
fn first(
    complex: &Complex,
    vertices: usize,
    wanted: f64,
    walks: &mut Walks,
) -> Result<Lattice, GridError> {
    let mut scale = wanted;
    for _ in 0..MOST_GROWTHS {
        let mut lattice = Lattice::new(complex.clone(), scale);
        let sides = complex.sides().flat_map(|h| lattice.wanted(h));
        if sides.fold(0.0, |most, x| f64::max(most, x.abs())) > LONGEST {
            break;
        }
        let angles = lattice.angles(vertices, false);
        lattice.round();
        lattice.close()?;
        if lattice.mend(walks) && lattice.angles(vertices, true) == angles {
            return Ok(lattice);
        }
        scale *= GROWTH;
    }
    Err(GridError::NoCells)
}

impl Lattice {
    /// The nearest steps; none is zero.
    fn round(&mut self) {
        let sides: Vec<HalfedgeId> = self.complex.sides().collect();
        for h in sides {
            if self.complex.side(h).twin.is_some_and(|t| t < h) {
                continue;
            }
            let wanted = self.wanted(h);
            let steps = match self.direction(h) {
                Some(d) => {
                    let along = wanted[0].abs().max(wanted[1].abs()).round().max(1.0) as i64;
                    UNIT[usize::from(d)].map(|x| along * x)
                }
                None => match wanted.map(|x| x.round() as i64) {
                    [0, 0] if wanted[0].abs() > wanted[1].abs() => [wanted[0].signum() as i64, 0],
                    [0, 0] => [0, if wanted[1] > 0.0 { 1 } else { -1 }],
                    steps => steps,
                },
            };
            self.complex.set_steps(h, steps);
        }
    }

    /// Moves what is left of the sum of one face to where it is missing, or out over the border.
    fn close(&mut self) -> Result<(), GridError> {
        let faces: Vec<FaceId> = self.complex.faces().collect();
        let mut surplus: BTreeMap<FaceId, [i64; 2]> = BTreeMap::new();
        for &f in &faces {
            surplus.insert(f, self.surplus(f));
        }
        for &f in &faces {
            while let Some(d) = largest(surplus[&f]) {
                let walk = self.way_out(f, d, &surplus).ok_or(GridError::NoCells)?;
                let changes = |walk: &[State]| -> Vec<(FaceId, [i64; 2])> {
                    let mut at: Vec<FaceId> = Vec::new();
                    for &(h, _) in walk {
                        at.push(self.complex.face(h));
                        at.extend(self.complex.side(h).twin.map(|t| self.complex.face(t)));
                    }
                    at.into_iter().map(|f| (f, [0; 2])).collect()
                };
                let touched = changes(&walk);
                self.apply(&walk, -1);
                for (f, _) in touched {
                    surplus.insert(f, self.surplus(f));
                }
            }
        }
        Ok(())
    }

    /// The cheapest way of a surplus: sides that each get one less, in a direction.
    fn way_out(
        &self,
        begin: FaceId,
        d: u8,
        surplus: &BTreeMap<FaceId, [i64; 2]>,
    ) -> Option<Vec<State>> {
        let complex = &self.complex;
        let number = |f: FaceId, d: u8| 4 * f.raw() + u32::from(d);
        let mut known: BTreeMap<u32, (f64, Option<State>)> = BTreeMap::new();
        let mut heap = BinaryHeap::new();
        known.insert(number(begin, d), (0.0, None));
        heap.push(Entry {
            cost: 0.0,
            state: number(begin, d),
        });
        // One number beyond all states: out over the border.
        let out = 4 * complex.places() as u32;
        let mut end = None;
        while let Some(Entry { cost, state: at }) = heap.pop() {
            if at == out {
                end = Some(at);
                break;
            }
            if known[&at].0 < cost {
                continue;
            }
            let (f, direction) = (FaceId::new(at as usize / 4), (at % 4) as u8);
            let along = turned(surplus[&f], 4 - direction)[0];
            let is_lack = match f == begin {
                false => along < 0,
                // Half of a surplus that comes back as a lack.
                true => {
                    direction == (d + 2) & 3 && along <= -2 || (direction ^ d) & 1 == 1 && along < 0
                }
            };
            if is_lack {
                end = Some(at);
                break;
            }
            for k in 0..3 {
                let h = HalfedgeId::new(3 * f.index() + k);
                if !self.may_change(h, direction) {
                    continue;
                }
                let side = complex.side(h);
                let e = UNIT[usize::from(direction)];
                let steps = [side.steps[0] - e[0], side.steps[1] - e[1]];
                let more = self.energy_of(h, steps) - self.energy_of(h, side.steps);
                let short = if steps == [0, 0] { 1 } else { 0 };
                let short = short + self.missing_of_line(h, steps);
                let total = cost + 1.0 + more.max(0.0) + NO_LENGTH * short as f64;
                let there = match side.twin {
                    Some(t) => number(complex.face(t), (direction + side.turns) & 3),
                    None => out,
                };
                if known.get(&there).is_none_or(|k| total < k.0) {
                    known.insert(there, (total, Some((h, direction))));
                    heap.push(Entry {
                        cost: total,
                        state: there,
                    });
                }
            }
        }
        let mut at = end?;
        let mut walk = Vec::new();
        while let Some((_, Some((h, d)))) = known.get(&at) {
            walk.push((*h, *d));
            at = number(complex.face(*h), *d);
        }
        Some(walk)
    }

    /// Gives every face an area. False where that does not succeed.
    fn mend(&mut self, walks: &mut Walks) -> bool {
        let mut random = sequence();
        let mut stuck = 0;
        loop {
            let bad: Vec<FaceId> = self
                .complex
                .faces()
                .filter(|&f| self.missing(f) > 0)
                .collect();
            if bad.is_empty() {
                return true;
            }
            let mut has_gained = false;
            for &f in &bad {
                if self.missing(f) == 0 {
                    continue;
                }
                if let Some((_, walk)) = self.cheapest_walk(f, walks) {
                    let before = self.missing_on(&walk);
                    self.apply(&walk, 1);
                    match self.missing_on(&walk) < before {
                        true => has_gained = true,
                        false => self.apply(&walk, -1),
                    }
                }
            }
            if has_gained {
                continue;
            }
            stuck += 1;
            if stuck > MOST_STUCK {
                return false;
            }
            // The least harm among walks that give one face more area, whatever others lose.
            let f = bad[(random() * bad.len() as f64) as usize % bad.len()];
            let mut best: Option<(f64, Vec<State>)> = None;
            for (_, walk) in self.walks_of(f, walks) {
                let (before, area) = (self.missing_on(&walk), self.double_area(f));
                self.apply(&walk, 1);
                let harm = (self.missing_on(&walk) - before) as f64;
                let gain = if self.double_area(f) > area { 0.5 } else { 0.0 };
                self.apply(&walk, -1);
                let value = harm - gain + 0.3 * random();
                if best.as_ref().is_none_or(|(least, _)| value < *least) {
                    best = Some((value, walk));
                }
            }
            let Some((_, walk)) = best else { return false };
            self.apply(&walk, 1);
        }
    }

    /// The cheapest walk that begins with a side of a face.
    fn cheapest_walk(&self, f: FaceId, walks: &mut Walks) -> Option<(f64, Vec<State>)> {
        states_of(f).fold(None, |best: Option<(f64, Vec<State>)>, state| {
            let most = best.as_ref().map_or(f64::INFINITY, |b| b.0);
            self.walk(state, most, walks).or(best)
        })
    }

    /// The cheapest walk of every state of a face.
    fn walks_of(&self, f: FaceId, walks: &mut Walks) -> Vec<(f64, Vec<State>)> {
        let walk = |state| self.walk(state, f64::INFINITY, walks);
        states_of(f).filter_map(walk).collect()
    }

    /// Lowers E by walks and flips; `angles` stay as they are.
    fn settle(&mut self, vertices: usize, angles: &VertexVec<Vec<i64>>, walks: &mut Walks) {
        for _ in 0..MOST_FLIP_ROUNDS {
            let last = self.clone();
            self.improve(walks);
            if self.angles(vertices, true) != *angles {
                *self = last;
                return;
            }
            if self.make_delaunay() == 0 {
                return;
            }
        }
    }

    /// Takes walks that lower E and let nothing be missing.
    fn improve(&mut self, walks: &mut Walks) {
        let sides: Vec<HalfedgeId> = self.complex.sides().collect();
        for _ in 0..MOST_ROUNDS {
            let mut has_gained = false;
            for &h in &sides {
                for d in 0..4 {
                    if walks.visits > MOST_VISITS {
                        return;
                    }
                    // Some side of a walk that lowers E lowers it by itself.
                    let steps = self.complex.side(h).steps;
                    let e = UNIT[usize::from(d)];
                    let changed = [steps[0] + e[0], steps[1] + e[1]];
                    if self.energy_of(h, changed) >= self.energy_of(h, steps) {
                        continue;
                    }
                    let Some((_, walk)) = self.walk((h, d), MOST_COST, walks) else {
                        continue;
                    };
                    let (energy, missing) = (self.energy_of_walk(&walk), self.missing_on(&walk));
                    self.apply(&walk, 1);
                    let is_better = self.missing_on(&walk) <= missing
                        && self.energy_of_walk(&walk) < energy - GAIN;
                    match is_better {
                        true => has_gained = true,
                        false => self.apply(&walk, -1),
                    }
                }
            }
            if !has_gained {
                break;
            }
        }
    }
}

/// Sides of a face, each in four directions.
fn states_of(f: FaceId) -> impl Iterator<Item = State> {
    (0..12).map(move |i| (HalfedgeId::new(3 * f.index() + i / 4), (i % 4) as u8))
}

/// The direction in which most is left.
fn largest([x, y]: [i64; 2]) -> Option<u8> {
    match (x, y) {
        (0, 0) => None,
        _ if x.abs() >= y.abs() => Some(if x > 0 { 0 } else { 2 }),
        _ => Some(if y > 0 { 1 } else { 3 }),
    }
}

/// Numbers without pattern in [0, 1), the same every time.
fn sequence() -> impl FnMut() -> f64 {
    let mut state: u64 = 0x9e37_79b9_7f4a_7c15;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}
