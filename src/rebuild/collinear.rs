//! Faces whose corners lie on a line in space turned into faces with area.
//!
//! *Enters:* faces of corner points. *Leaves:* the same surface, with the diagonal of the face and its neighbour exchanged where that helps.
//!
//! Along a straight crease or border of a flat region seam samples are collinear in space but not in the plane, so a Delaunay face between three of
//! them is sound in the plane and has no area in space. The face across its longest edge has, and so have the two that the other diagonal makes.

use crate::atlas::plane::doubled_area;
use crate::geometry::mesh::{distance, triangle_area};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeSet;

/// Area over the square of the longest edge below which corners are on a line: what `f32` tells apart.
const ON_A_LINE: f64 = 1e-7;

/// Faces as they are stitched.
pub(super) struct Faces<'a> {
    pub positions: &'a [[f64; 3]],
    /// Vertex of every corner point.
    pub vertex: &'a [u32],
    /// Its patch coordinates.
    pub uv: &'a [[f64; 2]],
    /// Corner points of every face.
    pub faces: &'a mut [[u32; 3]],
}

/// Which faces meet where, while diagonals are exchanged.
#[derive(Default)]
struct Meeting {
    /// The face on the left of every directed edge of corner points.
    across: FxHashMap<[u32; 2], usize>,
    /// Edges by their vertices.
    edges: FxHashSet<[u32; 2]>,
    /// Flat faces that would make an edge that there is already, by that edge.
    waiting: FxHashMap<[u32; 2], Vec<usize>>,
}

impl Faces<'_> {
    /// Exchanges diagonals; see the module docs. Where flat faces lie side by side, one after another gets area from the end where one has it: a flat
    /// face is looked at again when a face beside it or the edge in its way has changed, and at no other time. Returns how often one was looked at.
    pub fn give_area(&mut self) -> usize {
        let mut round: BTreeSet<usize> = (0..self.faces.len())
            .filter(|&f| self.is_collinear(self.faces[f]))
            .collect();
        let mut looks = 0;
        if round.is_empty() {
            return looks;
        }
        let mut meeting = Meeting::default();
        for (f, corners) in self.faces.iter().enumerate() {
            for k in 0..3 {
                let [a, b] = [corners[k], corners[(k + 1) % 3]];
                meeting.across.insert([a, b], f);
                meeting.edges.insert(self.edge(a, b));
            }
        }
        // Rounds in the order of the faces, each of those that may have become able.
        while !round.is_empty() {
            let mut next = BTreeSet::new();
            while let Some(f) = round.pop_first() {
                looks += 1;
                if !self.is_collinear(self.faces[f]) {
                    continue;
                }
                for g in self.exchange(f, &mut meeting) {
                    if self.is_collinear(self.faces[g]) {
                        let soon = if g > f { &mut round } else { &mut next };
                        soon.insert(g);
                    }
                }
            }
            round = next;
        }
        looks
    }

    /// Puts the other diagonal into a flat face and the one across its longest edge, where both then have area. Returns the faces for which this
    /// may change something.
    fn exchange(&mut self, f: usize, meeting: &mut Meeting) -> Vec<usize> {
        let corners = self.faces[f];
        let length = |k: usize| distance(self.place(corners[k]), self.place(corners[(k + 1) % 3]));
        let longest = (0..3).fold(0, |best, k| if length(k) > length(best) { k } else { best });
        let [p, q, r] = [0, 1, 2].map(|k| corners[(longest + k) % 3]);
        let Some(&other) = meeting.across.get(&[q, p]) else {
            return Vec::new();
        };
        let Some(s) = self.faces[other].into_iter().find(|c| ![p, q].contains(c)) else {
            return Vec::new();
        };
        let new = [[p, s, r], [s, q, r]];
        let is_sound = |t: [u32; 3]| {
            doubled_area(t.map(|c| self.uv[c as usize])) > 0.0 && !self.is_collinear(t)
        };
        let is_loop = self.vertex[r as usize] == self.vertex[s as usize];
        if is_loop || !new.into_iter().all(is_sound) {
            return Vec::new();
        }
        let [old_edge, new_edge] = [self.edge(p, q), self.edge(r, s)];
        if meeting.edges.contains(&new_edge) {
            meeting.waiting.entry(new_edge).or_default().push(f);
            return Vec::new();
        }
        meeting.edges.remove(&old_edge);
        meeting.edges.insert(new_edge);
        meeting.across.remove(&[p, q]);
        meeting.across.remove(&[q, p]);
        for (face, corners) in [f, other].into_iter().zip(new) {
            for k in 0..3 {
                let edge = [corners[k], corners[(k + 1) % 3]];
                meeting.across.insert(edge, face);
            }
            self.faces[face] = corners;
        }
        let outer = [[r, p], [p, s], [s, q], [q, r]];
        let beside = outer.into_iter().map(|[a, b]| meeting.across.get(&[b, a]));
        let mut touched: Vec<usize> = beside.flatten().copied().collect();
        touched.extend(meeting.waiting.remove(&old_edge).into_iter().flatten());
        touched
    }

    fn place(&self, corner: u32) -> [f64; 3] {
        self.positions[self.vertex[corner as usize] as usize]
    }

    /// Vertices of an edge, whichever way it is gone.
    fn edge(&self, a: u32, b: u32) -> [u32; 2] {
        let [a, b] = [a, b].map(|c| self.vertex[c as usize]);
        [a.min(b), a.max(b)]
    }

    fn is_collinear(&self, corners: [u32; 3]) -> bool {
        let p = corners.map(|c| self.place(c));
        let longest = (0..3)
            .map(|k| distance(p[k], p[(k + 1) % 3]))
            .fold(0.0, f64::max);
        triangle_area(p) <= ON_A_LINE * longest * longest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square whose lower side has a point in the middle, bent in the plane, straight in space.
    #[test]
    fn a_face_on_a_line_gets_area() {
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
        ];
        let uv = [[0.0, 0.0], [1.0, -0.2], [2.0, 0.0], [1.0, 1.0]];
        let mut faces = [[0, 1, 2], [2, 3, 0]];
        let vertex = [0, 1, 2, 3];
        let mut all = Faces {
            positions: &positions,
            vertex: &vertex,
            uv: &uv,
            faces: &mut faces,
        };
        assert!(all.is_collinear([0, 1, 2]));
        all.give_area();
        for t in faces {
            assert!(
                triangle_area(t.map(|c| positions[c as usize])) > 0.4,
                "{faces:?}"
            );
            assert!(doubled_area(t.map(|c| uv[c as usize])) > 0.0, "{faces:?}");
        }
    }

    /// A flat arc of `points` (odd) in the plane, straight in space, under one more point: all but one face of it are without area. Says how
    /// often a face was looked at.
    fn give_area_to_an_arc(points: u32) -> usize {
        let last = points - 1;
        let arc = (0..points).map(|i| 2.0 * f64::from(i) / f64::from(last) - 1.0);
        let mut positions: Vec<[f64; 3]> = arc.clone().map(|x| [x, 0.0, 0.0]).collect();
        positions.push([0.0, 1.0, 0.0]);
        let mut uv: Vec<[f64; 2]> = arc.map(|x| [x, 0.1 * (x * x - 1.0)]).collect();
        uv.push([0.0, 1.0]);
        // A zigzag from the arc's middle to its ends.
        let mut faces = vec![[last, points, 0]];
        let (mut low, mut high) = (0, last);
        while high - low > 1 {
            if low + high == last {
                faces.push([low, low + 1, high]);
                low += 1;
            } else {
                faces.push([low, high - 1, high]);
                high -= 1;
            }
        }
        // Those from which nothing can be done come first.
        faces.reverse();
        let vertex: Vec<u32> = (0..=points).collect();
        let looks = Faces {
            positions: &positions,
            vertex: &vertex,
            uv: &uv,
            faces: &mut faces,
        }
        .give_area();
        let area = |t: &[u32; 3]| triangle_area(t.map(|c| positions[c as usize]));
        let least = 0.4 / f64::from(last);
        assert!(faces.iter().all(|t| area(t) > least), "{faces:?}");
        assert!((faces.iter().map(area).sum::<f64>() - 1.0).abs() < 1e-12);
        let plane = faces
            .iter()
            .map(|t| doubled_area(t.map(|c| uv[c as usize])));
        assert!(plane.into_iter().all(|doubled| doubled > 0.0), "{faces:?}");
        looks
    }

    #[test]
    fn flat_faces_side_by_side_get_area_one_after_another() {
        give_area_to_an_arc(9);
    }

    /// However long the chain is, a face is looked at a few times.
    #[test]
    fn looks_grow_no_faster_than_faces() {
        let looks = [501, 1001].map(give_area_to_an_arc);
        assert!(looks[1] <= 5 * 1001, "{looks:?}");
        assert!(looks[1] <= 2 * looks[0] + 10, "{looks:?}");
    }
}
