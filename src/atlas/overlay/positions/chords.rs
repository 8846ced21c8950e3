//! Which chords of C a chord of A crosses inside one face of B, and in which order: integers only.
//!
//! Curves that do not cross each other and have no bigon with the sides of a triangle are known from their numbers N₀, N₁, N₂ on
//! the sides: the first ones of a side cut off its tail's corner, the last ones its head's, and those between
//! come from the corner opposite. So a chord is named by one of its ends, a side and a number on it (an *anchor*), no list of
//! chords is ever made, and the chords that a given chord crosses are found in order, as a few ranges.
//!
//! ```text
//!               corner 2
//!                /    \             side k runs from corner k to corner k + 1
//!      side 2   /      \  side 1
//!              /        \
//!      corner 0 -------- corner 1
//!                side 0
//! ```

/// The chords of C in one face of B.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FaceChords {
    /// Number of points on each side.
    on_side: [usize; 3],
    /// Number of chords that cut off each corner.
    around: [usize; 3],
    /// Number of chords from each corner to the side opposite; not zero at one corner at most.
    fan: [usize; 3],
}

/// An end of a chord on a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Anchor {
    /// The side, 0 to 2.
    pub side: usize,
    /// Number of points on it before this one.
    pub number: usize,
}

/// Where a chord ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChordEnd {
    /// In a corner of the face.
    Corner(usize),
    /// On a side, `number` points of C after the side's tail.
    Side(Anchor),
}

/// A chord of C that is crossed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Met {
    /// One end of it.
    pub anchor: Anchor,
    /// True where that end is on the left of the crossing chord.
    pub anchor_on_left: bool,
}

impl FaceChords {
    /// From the number of points on each side; `None` where no set of chords has these numbers.
    pub(super) fn new(on_side: [usize; 3]) -> Option<FaceChords> {
        let (mut around, mut fan) = ([0; 3], [0; 3]);
        let total: usize = on_side.iter().sum();
        match (0..3).find(|&k| 2 * on_side[k] > total) {
            Some(k) => {
                let (j, m) = ((k + 1) % 3, (k + 2) % 3);
                around[k] = on_side[m];
                around[j] = on_side[j];
                fan[m] = 2 * on_side[k] - total;
            }
            None if total % 2 == 1 => return None,
            None => around = [0, 1, 2].map(|k| total / 2 - on_side[(k + 1) % 3]),
        }
        Some(FaceChords {
            on_side,
            around,
            fan,
        })
    }

    /// The other end of the chord that has an end at `anchor`.
    pub(super) fn other_end(&self, anchor: Anchor) -> ChordEnd {
        let (k, j, m) = (anchor.side, (anchor.side + 1) % 3, (anchor.side + 2) % 3);
        let to_head = self.on_side[k] - 1 - anchor.number;
        if anchor.number < self.around[k] {
            ChordEnd::Side(Anchor {
                side: m,
                number: self.on_side[m] - 1 - anchor.number,
            })
        } else if to_head < self.around[j] {
            ChordEnd::Side(Anchor {
                side: j,
                number: to_head,
            })
        } else {
            ChordEnd::Corner(m)
        }
    }

    /// Puts into `met` the chords of C that the chord from `from` to `to` crosses, in order. The number of an end is that of
    /// points of C between the side's tail and it.
    pub(super) fn met(&self, from: ChordEnd, to: ChordEnd, met: &mut Vec<Met>) {
        met.clear();
        match (from, to) {
            (ChordEnd::Corner(k), ChordEnd::Side(end)) => self.leave_corner(k, end, met),
            (ChordEnd::Side(end), ChordEnd::Corner(k)) => {
                self.leave_corner(k, end, met);
                met.reverse();
                for chord in met {
                    chord.anchor_on_left ^= true;
                }
            }
            (ChordEnd::Side(from), ChordEnd::Side(to)) => self.across(from, to, met),
            (ChordEnd::Corner(_), ChordEnd::Corner(_)) => {}
        }
    }

    /// From corner k to the side opposite.
    fn leave_corner(&self, k: usize, end: Anchor, met: &mut Vec<Met>) {
        let (j, m) = ((k + 1) % 3, (k + 2) % 3);
        let mut add = |side, number, anchor_on_left| {
            met.push(Met {
                anchor: Anchor { side, number },
                anchor_on_left,
            });
        };
        for i in 0..self.around[k] {
            add(k, i, false);
        }
        // From corner j to side m, from corner m to side k: the nearest to corner k first.
        for i in (0..self.fan[j]).rev() {
            add(m, self.around[m] + i, true);
        }
        for i in 0..self.fan[m] {
            add(k, self.around[k] + i, false);
        }
        // Into the corner j or into the corner m, the outermost chord first.
        for i in (end.number..self.around[j]).rev() {
            add(j, i, true);
        }
        let to_head = self.on_side[j] - end.number;
        for i in (to_head..self.around[m]).rev() {
            add(j, self.on_side[j] - 1 - i, false);
        }
    }

    /// From side to side, cutting off the corner k between them. Corner a is the other end of the side where the chord begins,
    /// corner b that of the side where it ends.
    fn across(&self, from: Anchor, to: Anchor, met: &mut Vec<Met>) {
        let corner_on_left = to.side == (from.side + 2) % 3;
        let (k, a, b) = if corner_on_left {
            (from.side, (from.side + 1) % 3, to.side)
        } else {
            (to.side, from.side, (to.side + 1) % 3)
        };
        // Everything is counted from corner k; this turns such a number on a side into one from the side's tail.
        let place = |side: usize, number: usize| Anchor {
            side,
            number: if side == k {
                number
            } else {
                self.on_side[side] - 1 - number
            },
        };
        let from_k = |end: Anchor| {
            if end.side == k {
                end.number
            } else {
                self.on_side[end.side] - end.number
            }
        };
        let (p, q) = (from_k(from), from_k(to));
        let (near, around_a, around_b) = (self.around[k], self.around[a], self.around[b]);
        let mut add = |anchor, anchor_on_left| {
            met.push(Met {
                anchor,
                anchor_on_left,
            })
        };
        // Out of corner a.
        for i in self.on_side[from.side] - p..around_a {
            let number = self.on_side[from.side] - 1 - i;
            add(place(from.side, number), corner_on_left);
        }
        // Chords from corner b to the first side.
        for y in (near..p.min(near + self.fan[b])).rev() {
            add(place(from.side, y), corner_on_left);
        }
        // Chords that cut off corner k: those between the two ends.
        for i in p..q.min(near) {
            add(place(to.side, i), corner_on_left);
        }
        for i in (q..p.min(near)).rev() {
            add(place(from.side, i), corner_on_left);
        }
        // Chords from corner k to the side opposite, whose first end is a where corner k is on the left.
        let opposite = (k + 1) % 3;
        let opposite_tail = self.around[opposite];
        for i in 0..self.fan[k] {
            let i = if corner_on_left {
                i
            } else {
                self.fan[k] - 1 - i
            };
            let anchor = Anchor {
                side: opposite,
                number: opposite_tail + i,
            };
            add(anchor, !corner_on_left);
        }
        // Chords from corner a to the last side.
        for y in near..q.min(near + self.fan[a]) {
            add(place(to.side, y), corner_on_left);
        }
        // Into corner b.
        for i in (self.on_side[to.side] - q..around_b).rev() {
            let number = self.on_side[to.side] - 1 - i;
            add(place(to.side, number), corner_on_left);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where an end stands on the border, counterclockwise from corner 0; a chord that ends on a side ends just before
    /// the point of C with its number.
    fn border(end: ChordEnd, point_of_c: bool) -> f64 {
        match end {
            ChordEnd::Corner(k) => 1000.0 * k as f64,
            ChordEnd::Side(Anchor { side, number }) => {
                1000.0 * side as f64 + number as f64 + if point_of_c { 1.0 } else { 0.5 }
            }
        }
    }

    /// All chords of a face with their ends on the border, found from the anchors, and checked: every point has one chord,
    /// no two cross, none has both ends on a side.
    fn chords(face: &FaceChords) -> Vec<[f64; 2]> {
        let mut chords: Vec<[f64; 2]> = Vec::new();
        for side in 0..3 {
            for number in 0..face.on_side[side] {
                let anchor = Anchor { side, number };
                let other = face.other_end(anchor);
                if let ChordEnd::Side(back) = other {
                    assert_eq!(face.other_end(back), ChordEnd::Side(anchor));
                    assert_ne!(back.side, side);
                }
                let (x, y) = (border(ChordEnd::Side(anchor), true), border(other, true));
                chords.push([x.min(y), x.max(y)]);
            }
        }
        chords.sort_by(|a, b| a.partial_cmp(b).unwrap());
        chords.dedup();
        for a in &chords {
            for b in &chords {
                assert!(!(a[0] < b[0] && b[0] < a[1] && a[1] < b[1]), "{a:?} {b:?}");
            }
        }
        chords
    }

    /// The chords that the chord from p to q crosses, in order: those whose ends interleave with p and q, sorted by
    /// their right end and then their left end, going from p to q.
    fn expected(face: &FaceChords, p: f64, q: f64) -> Vec<[f64; 2]> {
        let around = |x: f64| (x - p).rem_euclid(3000.0);
        let mut found = Vec::new();
        for chord in chords(face) {
            let right = chord.map(|x| x != p && x != q && around(x) < around(q));
            if chord.contains(&p) || chord.contains(&q) || right[0] == right[1] {
                continue;
            }
            let (r, l) = if right[0] {
                (chord[0], chord[1])
            } else {
                (chord[1], chord[0])
            };
            found.push([around(r), 3000.0 - around(l)]);
        }
        found.sort_by(|a, b| a.partial_cmp(b).unwrap());
        for pair in found.windows(2) {
            assert!(pair[0][1] <= pair[1][1]);
        }
        found
    }

    #[test]
    fn chords_met_are_those_whose_ends_interleave() {
        let mut met = Vec::new();
        let mut compared = 0;
        for code in 0..6 * 6 * 6 {
            let on_side = [code % 6, code / 6 % 6, code / 36];
            let Some(face) = FaceChords::new(on_side) else {
                let total: usize = on_side.iter().sum();
                assert!(total % 2 == 1 && on_side.iter().all(|&n| 2 * n < total));
                continue;
            };
            let mut ends: Vec<ChordEnd> = (0..3).map(ChordEnd::Corner).collect();
            for (side, &points) in on_side.iter().enumerate() {
                for number in 0..=points {
                    ends.push(ChordEnd::Side(Anchor { side, number }));
                }
            }
            for &from in &ends {
                for &to in &ends {
                    let allowed = match (from, to) {
                        (ChordEnd::Corner(k), ChordEnd::Side(x))
                        | (ChordEnd::Side(x), ChordEnd::Corner(k)) => x.side == (k + 1) % 3,
                        (ChordEnd::Side(x), ChordEnd::Side(y)) => x.side != y.side,
                        _ => false,
                    };
                    if !allowed {
                        continue;
                    }
                    let (p, q) = (border(from, false), border(to, false));
                    let around = |x: f64| (x - p).rem_euclid(3000.0);
                    face.met(from, to, &mut met);
                    let got: Vec<[f64; 2]> = met
                        .iter()
                        .map(|chord| {
                            let near = border(ChordEnd::Side(chord.anchor), true);
                            let far = border(face.other_end(chord.anchor), true);
                            let (r, l) = if chord.anchor_on_left {
                                (far, near)
                            } else {
                                (near, far)
                            };
                            [around(r), 3000.0 - around(l)]
                        })
                        .collect();
                    assert_eq!(got, expected(&face, p, q), "{face:?} {from:?} {to:?}");
                    compared += got.len();
                }
            }
        }
        assert!(compared > 10_000);
    }
}
