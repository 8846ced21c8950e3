//! Where the faces of a region lie in the plane, and whether any of them overlap.

use super::borders::closed_path;
use super::overlap::{Triangle, TriangleIndex, size};
use super::sets::Sets;
use super::slit::Slit;
use crate::geometry::ids::{FaceId, HalfedgeId};
use crate::geometry::polygon::is_simple;

/// Two sheets that overlap by no more than this part of the *patch's* extent touch. The chart's extent would
/// not do: a patch may be a thousandth of it, and what touches there overlaps in the patch.
pub(super) const TOUCHING: f64 = 1e-10;

/// A rounded positive number: equal up to six digits, comparable.
pub(super) fn rounded_ln(x: f64) -> i64 {
    (x.max(f64::MIN_POSITIVE).ln() * 1e6).round() as i64
}

pub(super) fn centroid(t: &Triangle) -> [f64; 2] {
    std::array::from_fn(|i| (t[0][i] + t[1][i] + t[2][i]) / 3.0)
}

/// Where the faces of a region lie, and what counts as touching there.
pub(super) struct Placement<'a> {
    pub positions: &'a [[f64; 2]],
    /// Diagonal of the faces' bounding box.
    pub extent: f64,
}

impl<'a> Placement<'a> {
    pub fn new(
        slit: &Slit,
        positions: &'a [[f64; 2]],
        faces: impl IntoIterator<Item = FaceId>,
    ) -> Placement<'a> {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for copy in faces.into_iter().flat_map(|f| slit.copies(f)) {
            for i in 0..2 {
                low[i] = low[i].min(positions[copy][i]);
                high[i] = high[i].max(positions[copy][i]);
            }
        }
        // A set without extent is measured by nothing, but nothing is divided by zero.
        let extent = crate::atlas::plane::distance(low, high).max(f64::MIN_POSITIVE);
        Placement { positions, extent }
    }

    pub fn triangle(&self, slit: &Slit, f: FaceId) -> Triangle {
        slit.copies(f).map(|c| self.positions[c])
    }

    /// The ends of a halfedge.
    pub fn side(&self, slit: &Slit, h: HalfedgeId) -> [[f64; 2]; 2] {
        let c = slit.connectivity;
        [h, c.next(h)].map(|h| self.positions[slit.development.copy[h] as usize])
    }

    pub fn tolerance(&self) -> f64 {
        TOUCHING * self.extent
    }

    /// True where the border of a part of the slit disk, its `sides` in any order, is known to be one simple closed curve. Then no two of its faces overlap: a
    /// disk of counterclockwise faces covers a point as often as its border winds around it. Where faces are long and all meet in one point, every pair
    /// of them is near each other; pairs of edges of the border are not.
    ///
    /// False says nothing: borders that touch, as both sides of a cut may, are left to the comparison of faces and its tolerance.
    pub fn has_simple_border(
        &self,
        slit: &Slit,
        sides: &[HalfedgeId],
        member: impl Fn(FaceId) -> bool,
    ) -> bool {
        closed_path(slit, sides, member).is_some_and(|path| {
            let at = |h: HalfedgeId| self.positions[slit.development.copy[h] as usize];
            let points: Vec<[f64; 2]> = path.into_iter().map(at).collect();
            is_simple(&points) == Some(true)
        })
    }

    /// True where no two faces of a disk overlap.
    ///
    /// Where its border is not known to be simple, faces with a side on the border are compared. They are enough: where two sheets of a disk overlap the border of
    /// one ends, and it crosses the border of the other, since an immersed disk whose border is a simple curve is embedded.
    pub fn is_injective(&self, sets: &mut Sets, faces: &[FaceId]) -> bool {
        let slit = sets.slit;
        let sides = sets.sides(faces);
        let set = sets.last;
        self.has_simple_border(slit, &sides, |f| sets.has(f, set))
            || self.is_free_of_overlaps(slit, &sets.border(faces))
    }

    /// True where no two of these faces overlap.
    pub fn is_free_of_overlaps(&self, slit: &Slit, border: &[FaceId]) -> bool {
        let mut index = self.index(slit, border);
        border.iter().all(|&f| {
            let triangle = self.triangle(slit, f);
            let free = !index.overlaps(&triangle);
            index.insert(triangle);
            free
        })
    }

    /// An index for triangles as large as those of these faces.
    pub fn index(&self, slit: &Slit, faces: &[FaceId]) -> TriangleIndex {
        let sizes = faces
            .iter()
            .fold([f64::INFINITY, 0.0f64], |[low, high], &f| {
                let s = size(&self.triangle(slit, f));
                [low.min(s), high.max(s)]
            });
        TriangleIndex::new(sizes, self.tolerance())
    }
}

/// Coordinates of a connected set of faces, central or own as its log scale asks for. `own` is
/// scratch space, a place a copy.
pub(super) fn place<'a>(
    slit: &'a Slit,
    faces: impl IntoIterator<Item = FaceId>,
    root: FaceId,
    highest: f64,
    member: impl Fn(FaceId) -> bool,
    own: &'a mut [[f64; 2]],
) -> Placement<'a> {
    let positions = if slit.is_deep(highest) {
        slit.develop(root, member, own);
        &*own
    } else {
        slit.central.as_slice()
    };
    Placement::new(slit, positions, faces)
}

#[cfg(test)]
mod tests {
    use super::super::overlap::overlap;
    use super::super::samples::wound;
    use super::super::sets::Sets;
    use super::*;

    /// The border decides like all pairs of faces.
    #[test]
    fn the_border_shows_whether_a_disk_overlaps_itself() {
        let mut answers = Vec::new();
        for turns in [0.3, 0.8, 0.97, 1.03, 1.2, 2.5] {
            let s = wound(60, 6, turns, 1.0);
            let slit = Slit::new(&s.mesh, &s.length, &s.cut, &s.development, None);
            let faces: Vec<FaceId> = s.mesh.connectivity.faces().collect();
            let placement = Placement::new(&slit, &slit.central, faces.iter().copied());
            let border = Sets::new(&slit).border(&faces);
            assert!(border.len() < faces.len() / 2);
            let corners = |f: FaceId| placement.triangle(&slit, f);
            let pairs = (0..faces.len()).flat_map(|i| (0..i).map(move |j| [i, j]));
            let overlaps = |[i, j]: [usize; 2]| {
                overlap(
                    &corners(faces[i]),
                    &corners(faces[j]),
                    placement.tolerance(),
                )
            };
            let brute = !pairs.into_iter().any(overlaps);
            assert_eq!(
                placement.is_free_of_overlaps(&slit, &border),
                brute,
                "{turns}"
            );
            let mut sets = Sets::new(&slit);
            assert_eq!(placement.is_injective(&mut sets, &faces), brute, "{turns}");
            answers.push(brute);
        }
        assert_eq!(answers, [true, true, true, false, false, false]);
    }
}
