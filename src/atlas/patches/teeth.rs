//! Teeth taken off the borders between patches: they widen the rectangles of both and hold nothing.
//!
//! *Enters:* disks. *Leaves:* disks, as many, with shorter borders. *Guaranteed:* they are injective and within the range of log scale as before; borders along
//! creases stay, and no patch loses more than a tenth of its area. *Not guaranteed:* straight borders.
//!
//! A tooth is a face with two sides on the border to one other patch, to which it goes: the third side is shorter than the two. Longer ways round, over fans of
//! faces, were tried: borders wander off the lines that they follow, at a loss of a tenth of a decibel or more.

use super::merge::Part;
use super::overlap::{Triangle, TriangleIndex};
use super::placement::Placement;
use super::slit::Slit;
use crate::geometry::ids::{EdgeVec, FaceId, FaceVec};

/// A patch keeps this part of its area.
const KEPT: f64 = 0.9;
/// Rounds over all borders: one tooth may lie behind another.
const ROUNDS: usize = 16;

/// A patch while faces come and go.
struct Patch {
    part: Part,
    /// What its area may not fall below.
    least_area: f64,
    /// Made when a face is to be added.
    index: Option<TriangleIndex>,
}

/// Takes teeth off; see the module docs. Patches too small for central coordinates get none.
pub(super) fn trim(
    slit: &Slit,
    sets: Vec<Vec<FaceId>>,
    is_crease: &EdgeVec<bool>,
    range: f64,
) -> Vec<Vec<FaceId>> {
    let c = slit.connectivity;
    let mut label = FaceVec::filled(0u32, c.face_count());
    let mut patches: Vec<Patch> = Vec::with_capacity(sets.len());
    for (i, faces) in (0u32..).zip(sets) {
        faces.iter().for_each(|&f| label[f] = i);
        let part = Part::new(slit, faces);
        patches.push(Patch {
            least_area: KEPT * part.area,
            part,
            index: None,
        });
    }
    let mut round: Vec<FaceId> = c.faces().collect();
    for _ in 0..ROUNDS {
        let mut next = Vec::new();
        for &f in &round {
            let Some(other) = takes(slit, f, &label, is_crease) else {
                continue;
            };
            let [from, to] = [label[f], other].map(|i| i as usize);
            let rest = patches[from].part.area - slit.source_area[f];
            if rest < patches[from].least_area || !patches[to].fits(slit, f, other, &label, range) {
                continue;
            }
            label[f] = other;
            patches[from].give(slit, f, &label);
            patches[to].take(slit, f);
            next.extend(slit.neighbours(f));
        }
        if next.is_empty() {
            break;
        }
        next.sort();
        next.dedup();
        round = next;
    }
    let mut sets: Vec<Vec<FaceId>> = vec![Vec::new(); patches.len()];
    for f in c.faces() {
        sets[label[f] as usize].push(f);
    }
    sets
}

/// The patch that takes a tooth; none where the face is none, or a side on the border is a crease. The patch's own border then runs along the third side, beyond
/// which it must go on.
fn takes(slit: &Slit, f: FaceId, label: &FaceVec<u32>, is_crease: &EdgeVec<bool>) -> Option<u32> {
    let c = slit.connectivity;
    let mut other = None;
    let mut inside = 0;
    for h in c.face_halfedges(f) {
        let beside = label[slit.beside(h)?];
        if beside == label[f] {
            inside += 1;
        } else if is_crease[c.edge(h)] || other.is_some_and(|other| other != beside) {
            return None;
        } else {
            other = Some(beside);
        }
    }
    other.filter(|_| inside == 1)
}

impl Patch {
    fn take(&mut self, slit: &Slit, f: FaceId) {
        self.part.log_scale = self.log_scale_with(slit, f);
        self.part.area += slit.source_area[f];
        if let Some(index) = &mut self.index {
            index.insert(central(slit, f));
        }
    }

    fn log_scale_with(&self, slit: &Slit, f: FaceId) -> [f64; 2] {
        let ([low, high], scale) = (self.part.log_scale, slit.log_scale[f]);
        [low.min(scale), high.max(scale)]
    }

    /// What lies behind the face is on the border now.
    fn give(&mut self, slit: &Slit, f: FaceId, label: &FaceVec<u32>) {
        self.part.area -= slit.source_area[f];
        if let Some(index) = &mut self.index {
            let behind = slit.neighbours(f).filter(|&g| label[g] != label[f]);
            behind.for_each(|g| index.insert(central(slit, g)));
        }
    }

    /// True where the patch, which has this label, stays within the range of scale and injective with one face more.
    ///
    /// A face beside an injective disk overlaps it only where the disk's border runs into the face: looking at the faces on the border is enough. Those that
    /// it gave away are looked at as well, and refuse nothing, since nothing else of the disk lay there.
    fn fits(&mut self, slit: &Slit, f: FaceId, own: u32, label: &FaceVec<u32>, range: f64) -> bool {
        let [low, high] = self.log_scale_with(slit, f);
        if high - low > range || slit.is_deep(high) {
            return false;
        }
        let faces = &self.part.faces;
        let index = self.index.get_or_insert_with(|| {
            let placement = Placement::new(slit, slit.central.as_slice(), faces.iter().copied());
            let inner = |g: FaceId| slit.neighbours(g).filter(|&n| label[n] == own).count() == 3;
            let border = faces.iter().copied();
            let border: Vec<FaceId> = border.filter(|&g| label[g] == own && !inner(g)).collect();
            let mut index = placement.index(slit, &border);
            border.iter().for_each(|&g| index.insert(central(slit, g)));
            index
        });
        !index.overlaps(&central(slit, f))
    }
}

fn central(slit: &Slit, f: FaceId) -> Triangle {
    slit.copies(f).map(|copy| slit.central[copy])
}

#[cfg(test)]
mod tests {
    use super::super::samples::square;
    use super::*;
    use crate::geometry::ids::EdgeVec;

    const N: usize = 8;

    /// A square's left half, with the upper triangles of the next column, and the rest.
    fn jagged() -> Vec<Vec<FaceId>> {
        let faces = (0..2 * N * N).map(FaceId::new);
        let is_left = |f: &FaceId| {
            let (column, upper) = (f.index() / (2 * N), f.index() % 2 == 1);
            column < N / 2 || column == N / 2 && upper
        };
        let (left, right) = faces.partition(is_left);
        vec![left, right]
    }

    fn trimmed(creases: bool, range: f64) -> Vec<Vec<FaceId>> {
        let s = square(N);
        let slit = Slit::new(&s.mesh, &s.length, &s.cut, &s.development, None);
        let is_crease = EdgeVec::filled(creases, s.mesh.connectivity.edge_count());
        trim(&slit, jagged(), &is_crease, range)
    }

    #[test]
    fn a_jagged_border_becomes_straight() {
        let sets = trimmed(false, 1.0);
        let left: Vec<usize> = sets[0].iter().map(|f| f.index()).collect();
        // The last one has a side on the square's border, which is no side of the other patch.
        let mut straight: Vec<usize> = (0..N * N).collect();
        straight.push(N * N + 2 * N - 1);
        assert_eq!(left, straight);
        assert_eq!(sets[0].len() + sets[1].len(), 2 * N * N);
    }

    #[test]
    fn creases_and_the_range_of_scale_hold() {
        assert_eq!(trimmed(true, 1.0), jagged());
        // A square has one scale: no range below nothing.
        assert_eq!(trimmed(false, -1.0), jagged());
    }
}
