//! Patches divided where their parts hold the surface better with the same number of texels.
//!
//! *Enters:* patches, a budget of texels. *Leaves:* patches that fill their images better, vary less in scale, and meet along creases.
//!
//! What a patch costs is its error plus what its texels are worth, both by [`Demand`](super::demand::Demand) with the texel that makes the sum least. Costs add up, and a
//! division that lowers their sum lets all images together hold the surface better with as many texels: where the error falls with the square of their number,
//! the cube of the sum is what it comes to. So each division gains a number of decibels, and the best is made first, until none gains enough.
//!
//! Divisions that are tried: along creases, by straight lines, and between less scale and more. Parts of what is injective and within the range of scale are so too; each is
//! kept a disk. *Not guaranteed:* the best of all divisions.

mod candidates;

use super::bend::Bends;
use super::demand::{self, Budget, Demand, Sums};
use super::holes::split_at_holes;
use super::overlap::Triangle;
use super::params::PatchParams;
use super::placement::{Placement, place};
use super::rectangle::smallest;
use super::resolution::{coarsest, enough_long_side, shape};
use super::sets::{Sets, in_order};
use super::slit::Slit;
use crate::atlas::plane::wrap_angle;
use crate::geometry::ids::{FaceId, FaceVec};
use crate::parallel;
use candidates::Candidate;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::sync::{Mutex, PoisonError};

/// Decibels that each patch more must gain.
const LEAST_GAIN: f64 = 0.015;

/// A patch in parts.
struct Division {
    parts: Vec<Vec<FaceId>>,
    /// Their faces that have a side on their border.
    borders: Vec<Vec<FaceId>>,
    /// What they cost less.
    saved: f64,
}

/// A patch with the division that saves most.
struct Row {
    faces: Vec<FaceId>,
    division: Option<Division>,
}

/// What division needs to know of a surface.
pub(super) struct Divider<'a> {
    slit: &'a Slit<'a>,
    bends: Bends,
    budget: Budget,
    /// What a shorter side may ask for on the longer one.
    enough: f64,
    params: &'a PatchParams,
    scratch: Idle<Scratch<'a>>,
    /// Coordinates of copies.
    own: Idle<Vec<[f64; 2]>>,
}

/// Spaces that nobody works in at the moment: each is as large as the surface, and most patches are small.
struct Idle<T>(Mutex<Vec<T>>);

impl<T> Idle<T> {
    fn with<R>(&self, new: impl FnOnce() -> T, work: impl FnOnce(&mut T) -> R) -> R {
        let idle = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = idle().pop();
        let mut space = found.unwrap_or_else(new);
        let result = work(&mut space);
        idle().push(space);
        result
    }
}

/// Space to work in, for one set of faces at a time.
struct Scratch<'a> {
    sets: Sets<'a>,
    /// Of [`Divider::by_creases`].
    label: FaceVec<u32>,
}

impl<'a> Scratch<'a> {
    fn new(slit: &'a Slit<'a>) -> Self {
        Self {
            sets: Sets::new(slit),
            label: FaceVec::filled(0, slit.connectivity.face_count()),
        }
    }
}

impl Division {
    /// Decibels for each patch more, where all patches together cost `sum`.
    fn gain(&self, sum: f64) -> f64 {
        let more = self.parts.len().saturating_sub(1).max(1);
        let then = (sum - self.saved).max(f64::MIN_POSITIVE);
        30.0 * (sum / then).log10() / more as f64
    }
}

impl<'a> Divider<'a> {
    pub fn new(slit: &'a Slit<'a>, params: &'a PatchParams) -> Self {
        Self {
            slit,
            bends: Bends::new(slit),
            budget: Budget::default(),
            enough: f64::INFINITY,
            params,
            scratch: Idle(Mutex::default()),
            own: Idle(Mutex::default()),
        }
    }

    fn with_scratch<T>(&self, work: impl FnOnce(&mut Scratch<'a>) -> T) -> T {
        self.scratch.with(|| Scratch::new(self.slit), work)
    }

    fn with_sets<T>(&self, work: impl FnOnce(&mut Sets<'a>) -> T) -> T {
        self.with_scratch(|scratch| work(&mut scratch.sets))
    }

    fn with_own<T>(&self, work: impl FnOnce(&mut [[f64; 2]]) -> T) -> T {
        let new = || vec![[0.0; 2]; self.slit.development.copies];
        self.own.with(new, |own| work(own))
    }

    /// Areas and bend of patches.
    pub fn sums(&self, patches: &[Vec<FaceId>]) -> Vec<Sums> {
        parallel::map(patches, |_, faces| {
            self.with_sets(|sets| self.sums_and_border(faces, sets).0)
        })
    }

    /// Finds what a texel is worth where the images are these, and their cost together.
    fn appraise(&mut self, patches: &[Vec<FaceId>]) -> f64 {
        let demand = |sets: &mut Sets<'a>, own: &mut [[f64; 2]], faces: &Vec<FaceId>| {
            let (sums, border) = self.sums_and_border(faces, sets);
            let placement = self.placed(faces, &border, sets, own);
            self.outline(sums, &border, &placement).demand
        };
        let demands: Vec<Demand> = parallel::map(patches, |_, faces| {
            self.with_sets(|sets| self.with_own(|own| demand(sets, own, faces)))
        });
        self.enough = enough_long_side(demands.iter().map(shape), self.params);
        let coarsest = |d| coarsest(d, self.enough, self.params);
        let least: Vec<f64> = demands.iter().map(coarsest).collect();
        self.budget = demand::budget(&demands, &least, self.params);
        demands.iter().map(|d| self.cost(d)).sum()
    }

    /// Divides patches as long as one gains enough.
    ///
    /// What one gains grows while others lower the sum, so that in whichever order they are made they are the same ones, unless there is no room for all: then the best comes first.
    pub fn divide(&mut self, patches: Vec<Vec<FaceId>>) -> Vec<Vec<FaceId>> {
        let mut sum = self.appraise(&patches);
        let mut rows = self.best_divisions(patches);
        loop {
            let most = self.params.max_count;
            let room = most.map(|most| most.saturating_sub(rows.len()));
            let fits = |d: &&Division| room.is_none_or(|room| d.parts.len() <= room + 1);
            let gain = |row: &Row| {
                let division = row.division.as_ref().filter(fits);
                division.map_or(0.0, |division| division.gain(sum))
            };
            let mut now: Vec<usize> = (0..rows.len()).collect();
            now.retain(|&i| gain(&rows[i]) >= LEAST_GAIN);
            if most.is_some() {
                // Rounded: the last digits must not decide.
                let key = |&i: &usize| ((gain(&rows[i]) * 1e6) as i64, Reverse(i));
                now = now.into_iter().max_by_key(key).into_iter().collect();
            }
            if now.is_empty() {
                return in_order(rows.into_iter().map(|row| row.faces).collect());
            }
            let mut parts = Vec::new();
            for i in now.into_iter().rev() {
                let row = rows.swap_remove(i);
                if let Some(division) = row.division {
                    sum -= division.saved;
                    parts.extend(division.parts);
                }
            }
            rows.extend(self.best_divisions(parts));
        }
    }

    /// How patches are best divided.
    fn best_divisions(&self, patches: Vec<Vec<FaceId>>) -> Vec<Row> {
        // Of many, each is worked out by one thread: one that waits for others would begin the next, in a space more.
        let are_few = patches.len() < 2 * rayon::current_num_threads();
        let rows = patches.into_par_iter().with_max_len(1);
        rows.map(|faces| {
            let division = self.with_own(|own| self.best_division(&faces, own, are_few));
            Row { faces, division }
        })
        .collect()
    }

    /// Coordinates of a patch with its border.
    fn placed<'p>(
        &self,
        faces: &[FaceId],
        border: &[FaceId],
        sets: &mut Sets,
        own: &'p mut [[f64; 2]],
    ) -> Placement<'p>
    where
        'a: 'p,
    {
        let slit = self.slit;
        let root = faces.iter().copied().min().unwrap_or(FaceId::new(0));
        let stamp = sets.mark(faces);
        let member = |f: FaceId| sets.has(f, stamp);
        let highest = highest(slit, faces);
        // The border is as large as the patch.
        place(slit, border.iter().copied(), root, highest, member, own)
    }

    /// How a patch is best divided; `side_by_side`: whether candidates are worked out by several threads.
    fn best_division(
        &self,
        faces: &[FaceId],
        own: &mut [[f64; 2]],
        side_by_side: bool,
    ) -> Option<Division> {
        let slit = self.slit;
        let (placement, outline) = self.with_sets(|sets| {
            let (sums, border) = self.sums_and_border(faces, sets);
            let placement = self.placed(faces, &border, sets, own);
            let outline = self.outline(sums, &border, &placement);
            (placement, outline)
        });
        let now = self.cost(&outline.demand);
        let tried = self.candidates(faces, &placement, &outline);
        let division = |candidate: &Candidate| {
            self.with_scratch(|scratch| {
                let parts = self.connected(candidate, faces, &placement, &outline, scratch);
                self.in_parts(parts, now, &placement, &mut scratch.sets)
            })
        };
        let found = match side_by_side {
            true => parallel::map(&tried, |_, candidate| division(candidate)),
            false => tried.iter().map(division).collect(),
        };
        let mut found: Vec<(i64, Division)> = (found.into_iter().flatten())
            .map(|division| {
                let share = division.saved / now.max(f64::MIN_POSITIVE);
                let more = division.parts.len() as f64 - 1.0;
                (-(share / more * 1e9) as i64, division)
            })
            .collect();
        // Stable: of equals the first.
        found.sort_by_key(|f| f.0);
        let mut found = found.into_iter().map(|f| f.1);
        // What touches in the patch may overlap in a part, which is smaller and so is what counts as touching.
        let is_injective = |(faces, border): (&Vec<FaceId>, &Vec<FaceId>)| {
            let part = Placement::new(slit, placement.positions, border.iter().copied());
            self.with_sets(|sets| part.is_injective(sets, faces))
        };
        found.find(|division| {
            let (parts, borders) = (&division.parts, &division.borders);
            match side_by_side {
                true => (parts.par_iter().zip(borders).with_max_len(1)).all(is_injective),
                false => parts.iter().zip(borders).all(is_injective),
            }
        })
    }

    /// A division into the disks that connected parts are made of; `None` where there is one only, or they cost more.
    fn in_parts(
        &self,
        connected: Vec<Vec<FaceId>>,
        now: f64,
        placement: &Placement,
        sets: &mut Sets,
    ) -> Option<Division> {
        let mut parts = Vec::new();
        for part in connected {
            split_at_holes(sets, part, placement, &mut parts);
        }
        if parts.len() < 2 {
            return None;
        }
        let mut saved = now;
        let mut borders = Vec::with_capacity(parts.len());
        for faces in &parts {
            let (sums, border) = self.sums_and_border(faces, sets);
            let outline = self.outline(sums, &border, placement);
            saved -= self.cost(&outline.demand);
            borders.push(border);
            if saved <= 0.0 {
                return None;
            }
        }
        Some(Division {
            parts,
            borders,
            saved,
        })
    }

    /// Areas and bend of a patch, and its faces that have a side on its border.
    fn sums_and_border(&self, faces: &[FaceId], sets: &mut Sets) -> (Sums, Vec<FaceId>) {
        let slit = self.slit;
        let stamp = sets.mark(faces);
        let mut border = Vec::new();
        let mut sums = Sums::default();
        for &f in faces {
            let is_inside = |g| sets.has(g, stamp);
            let beside = slit.neighbours(f).filter(|&g| is_inside(g));
            let own = if beside.count() == 3 {
                self.bends.of_face[f]
            } else {
                border.push(f);
                self.bends.inside(slit, f, is_inside)
            };
            sums = sums.and(own);
        }
        (sums, border)
    }

    /// What a patch with these faces on its border asks for.
    fn outline(&self, sums: Sums, border: &[FaceId], placement: &Placement) -> Outline {
        let border = border.iter().map(|&f| placement.triangle(self.slit, f));
        let border: Vec<Triangle> = border.collect();
        let rectangle = smallest(&border);
        let sides = [rectangle.width, rectangle.width * rectangle.height];
        Outline {
            demand: Demand { sums, sides },
            angle: wrap_angle(rectangle.angle),
            border,
        }
    }

    /// Error and texels, as if they were one.
    fn cost(&self, demand: &Demand) -> f64 {
        let texel = demand
            .texel(&self.budget)
            .min(coarsest(demand, self.enough, self.params));
        let cost =
            demand.error(texel) + self.budget.worth * demand.texels(texel, self.budget.margin);
        // A patch without extent has no texel.
        if cost.is_finite() { cost } else { 0.0 }
    }
}

/// What a patch asks for, and where its rectangle lies.
struct Outline {
    demand: Demand,
    /// Direction of the rectangle's longer side.
    angle: f64,
    /// The faces that have a side on the border.
    border: Vec<Triangle>,
}

/// Greatest log scale of some faces.
fn highest(slit: &Slit, faces: &[FaceId]) -> f64 {
    let scales = faces.iter().map(|&f| slit.log_scale[f]);
    scales.fold(f64::NEG_INFINITY, f64::max)
}

#[cfg(test)]
mod tests;
