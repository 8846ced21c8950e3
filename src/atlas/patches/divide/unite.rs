//! Neighbouring patches united where one image of both costs less than two: margins and floors weigh most on small patches.
//!
//! The pair that saves most comes first. A union is a disk, injective and within the range of log scale, as all patches are.

use super::super::merge::{Part, joins_to_a_disk, overlaps, within};
use super::super::placement::place;
use super::{Divider, Scratch};
use crate::atlas::patches::demand::Sums;
use crate::geometry::ids::{FaceId, FaceVec};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// A patch with what a union of it would cost.
struct Piece {
    part: Part,
    sums: Sums,
    /// The faces that have a side on the border.
    border: Vec<FaceId>,
    cost: f64,
}

impl Divider<'_> {
    /// Unites patches; see the module docs.
    pub(super) fn unite(&mut self, patches: Vec<Vec<FaceId>>, range: f64) -> Vec<Vec<FaceId>> {
        let sum = self.appraise(&patches).max(f64::MIN_POSITIVE);
        let mut scratch = Scratch::new(self.slit);
        let mut label = FaceVec::filled(0, self.slit.connectivity.face_count());
        let mut pieces: Vec<Piece> = Vec::with_capacity(patches.len());
        for (i, faces) in (0u32..).zip(patches) {
            faces.iter().for_each(|&f| label[f] = i);
            pieces.push(self.piece(Part::new(self.slit, faces), &mut scratch));
        }
        // What each pair saves in billionths, so that the last digits do not decide.
        let mut saves: BTreeMap<[u32; 2], i64> = BTreeMap::new();
        let mut changed: Vec<u32> = (0..pieces.len() as u32).collect();
        loop {
            for one in changed.drain(..) {
                for other in self.neighbours(&pieces, one, &label) {
                    let pair = [one.min(other), one.max(other)];
                    saves.entry(pair).or_insert_with(|| {
                        let saved = self.saved(&pieces, pair, &label, range, &mut scratch.own);
                        (saved / sum * 1e9) as i64
                    });
                }
            }
            let best = saves
                .iter()
                .min_by_key(|(pair, saved)| (Reverse(**saved), **pair));
            let Some((&pair, _)) = best.filter(|(_, saved)| **saved > 0) else {
                break;
            };
            let [a, b] = pair.map(|i| &pieces[i as usize].part);
            if overlaps(self.slit, a, b, &label, pair, &mut scratch.own) {
                saves.insert(pair, 0);
                continue;
            }
            let [to, from] = pair;
            let mut faces = std::mem::take(&mut pieces[to as usize].part.faces);
            let moved = std::mem::take(&mut pieces[from as usize].part.faces);
            moved.iter().for_each(|&f| label[f] = to);
            faces.extend(moved);
            pieces[to as usize] = self.piece(Part::new(self.slit, faces), &mut scratch);
            saves.retain(|p, _| !p.contains(&to) && !p.contains(&from));
            changed.push(to);
        }
        let faces = pieces.into_iter().map(|piece| piece.part.faces);
        faces.filter(|faces| !faces.is_empty()).collect()
    }

    fn piece(&self, part: Part, scratch: &mut Scratch) -> Piece {
        let Scratch { sets, own, .. } = scratch;
        let (sums, border) = self.sums_and_border(&part.faces, sets);
        let placement = self.placed(&part.faces, &border, sets, own);
        let outline = self.outline(sums, &border, &placement);
        Piece {
            cost: self.cost(&outline.demand),
            part,
            sums,
            border,
        }
    }

    /// The pieces that have a side in common with one.
    fn neighbours(&self, pieces: &[Piece], one: u32, label: &FaceVec<u32>) -> BTreeSet<u32> {
        let border = pieces[one as usize].border.iter();
        let beside = border.flat_map(|&f| self.slit.neighbours(f));
        beside.map(|g| label[g]).filter(|&l| l != one).collect()
    }

    /// What two neighbours cost less together; nothing where they do not go together.
    fn saved(
        &self,
        pieces: &[Piece],
        pair: [u32; 2],
        label: &FaceVec<u32>,
        range: f64,
        own: &mut [[f64; 2]],
    ) -> f64 {
        let slit = self.slit;
        let [a, b] = pair.map(|i| &pieces[i as usize]);
        if !within(&a.part, &b.part, range) || !joins_to_a_disk(slit, &a.part, label, pair) {
            return 0.0;
        }
        let mut sums = a.sums.and(b.sums);
        // Edges between the two are inside now.
        for (piece, other) in [(a, pair[1]), (b, pair[0])] {
            for &f in &piece.border {
                let between = self.bends.inside(slit, f, |g| label[g] == other).bend;
                (0..2).for_each(|i| sums.bend[i] += between[i]);
            }
        }
        let border: Vec<FaceId> = a.border.iter().chain(&b.border).copied().collect();
        let Some(&root) = border.iter().min() else {
            return 0.0;
        };
        let highest = a.part.log_scale[1].max(b.part.log_scale[1]);
        let member = |f: FaceId| pair.contains(&label[f]);
        let placement = place(slit, border.iter().copied(), root, highest, member, own);
        let outline = self.outline(sums, &border, &placement);
        a.cost + b.cost - self.cost(&outline.demand)
    }
}
