//! Small triangulations of every kind: polygons glued along their sides, then split and flipped at random, so that edges are loops
//! or share both ends and faces are glued to themselves.

use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, FaceId, HalfedgeId, HalfedgeVec, VertexId};

/// A polygon by the letters of its sides, counterclockwise: the same letter, capital and small, is one side, run through there
/// and back. What stands there once is boundary.
pub(super) struct Word(pub &'static str);

/// Genus 0, 1, 2; one, two and three boundary loops; genus 1 with a hole.
pub(super) const CLOSED: [Word; 4] = [Word("aAbB"), Word("abAB"), Word("abAcCB"), Word("abABcdCD")];
pub(super) const BOUNDED: [Word; 4] = [Word("abcd"), Word("axAy"), Word("axAbyBz"), Word("abABx")];

impl Word {
    /// The polygon cut into a fan of triangles from its first corner, glued.
    pub fn glue(&self) -> Connectivity {
        let sides = self.0.as_bytes();
        let n = sides.len();
        // Triangle k has corners 0, k + 1, k + 2 of the polygon; its halfedges run 0 → k+1 → k+2 → 0.
        let triangles = n - 2;
        let mut twin: Vec<Option<usize>> = vec![None; 3 * triangles];
        for k in 1..triangles {
            (twin[3 * k], twin[3 * k - 1]) = (Some(3 * k - 1), Some(3 * k));
        }
        let halfedge = |side: usize| match side {
            0 => 0,
            s if s == n - 1 => 3 * triangles - 1,
            s => 3 * (s - 1) + 1,
        };
        for i in 0..n {
            let pair =
                |j: &usize| sides[*j] != sides[i] && sides[*j].eq_ignore_ascii_case(&sides[i]);
            twin[halfedge(i)] = (0..n).find(pair).map(halfedge).or(twin[halfedge(i)]);
        }
        // Corners that are glued are one vertex.
        let mut of: Vec<usize> = (0..twin.len()).collect();
        loop {
            let before = of.clone();
            for h in 0..twin.len() {
                let next = |h: usize| h / 3 * 3 + (h + 1) % 3;
                let prev = h / 3 * 3 + (h + 2) % 3;
                for other in [twin[h].map(next), twin[prev]].into_iter().flatten() {
                    let least = of[h].min(of[other]);
                    (of[h], of[other]) = (least, least);
                }
            }
            if of == before {
                break;
            }
        }
        let mut names = of.clone();
        names.sort_unstable();
        names.dedup();
        let number = |v: &usize| VertexId::new(names.binary_search(v).unwrap());
        let tail: HalfedgeVec<VertexId> = of.iter().map(number).collect();
        let twin: Vec<_> = twin.iter().map(|t| t.map(HalfedgeId::new)).collect();
        Connectivity::from_gluing(tail, &twin, names.len()).unwrap()
    }

    /// Split at random edges and faces up to so many vertices, then flipped at random.
    pub fn triangulate(&self, vertices: usize, random: &mut impl FnMut() -> f64) -> Connectivity {
        let mut c = self.glue();
        while c.vertex_count() < vertices {
            match random() < 0.5 {
                true => {
                    let e = EdgeId::new((random() * c.edge_count() as f64) as usize);
                    let h = c.edge_halfedge(e);
                    // An edge with one face on both sides cannot be split.
                    if c.twin(h).is_none_or(|t| c.face(t) != c.face(h)) {
                        c.split_edge(e);
                    }
                }
                false => {
                    let f = (random() * c.face_count() as f64) as usize;
                    c.split_face(FaceId::new(f));
                }
            }
        }
        for _ in 0..2 * c.edge_count() {
            let e = (random() * c.edge_count() as f64) as usize;
            c.flip(EdgeId::new(e));
        }
        c.validate().unwrap();
        c
    }
}

#[test]
fn words_are_the_surfaces_that_they_should_be() {
    let kinds = |words: &[Word]| -> Vec<(i64, usize)> {
        let kind = |w: &Word| {
            let t = w.glue().topology();
            (t.genus, t.boundary_loops)
        };
        words.iter().map(kind).collect()
    };
    assert_eq!(kinds(&CLOSED), [(0, 0), (1, 0), (1, 0), (2, 0)]);
    assert_eq!(kinds(&BOUNDED), [(0, 1), (0, 2), (0, 3), (1, 1)]);
}
