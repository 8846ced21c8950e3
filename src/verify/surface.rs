//! Halfedges paired from `faces`, and the topology that follows.
//!
//! Halfedge 3f + k is the edge of face f opposite its corner k, from corner k+1 to corner k+2, the order
//! of `flat_length`, `cut` and `segment`.

use super::Verdicts;
use super::arrays::{Arrays, NONE};
use super::document::Document;

/// Groups of the same two ends larger than this are paired in file order instead of by length.
const MATCH_LIMIT: usize = 32;

/// Connectivity of the faces.
pub(super) struct Surface<'a> {
    faces: &'a [[u32; 3]],
    twin: Vec<u32>,
    /// Whether a vertex lies on the surface's boundary.
    pub on_boundary: Vec<bool>,
    corner_start: Vec<u32>,
    corners: Vec<u32>,
    /// Of every vertex: into how many fans its faces fall.
    pub fans_of: Vec<u32>,
    /// Halfedges that share both ends with another of the same direction, or that end where they begin.
    pub doubled: usize,
}

impl<'a> Surface<'a> {
    pub fn new(arrays: &'a Arrays) -> Self {
        let faces = &arrays.faces;
        let mut surface = Surface {
            faces,
            twin: vec![NONE; 3 * faces.len()],
            on_boundary: vec![false; arrays.positions.len()],
            corner_start: vec![0; arrays.positions.len() + 1],
            corners: vec![0; 3 * faces.len()],
            fans_of: Vec::new(),
            doubled: 0,
        };
        surface.pair(arrays.flat_length.as_flattened());
        for h in 0..surface.halfedges() {
            if surface.twin[h] == NONE {
                let (a, b) = (surface.tail(h), surface.head(h));
                surface.on_boundary[a] = true;
                surface.on_boundary[b] = true;
            }
        }
        for v in faces.as_flattened() {
            surface.corner_start[*v as usize + 1] += 1;
        }
        for v in 1..surface.corner_start.len() {
            surface.corner_start[v] += surface.corner_start[v - 1];
        }
        let mut next = surface.corner_start.clone();
        for (corner, v) in faces.as_flattened().iter().enumerate() {
            surface.corners[next[*v as usize] as usize] = corner as u32;
            next[*v as usize] += 1;
        }
        let fans = (0..arrays.positions.len()).map(|v| surface.fans(v, |_| true) as u32);
        let fans_of = fans.collect();
        Surface { fans_of, ..surface }
    }

    /// Pairs opposite halfedges; among several of the same ends, those whose lengths are nearest.
    fn pair(&mut self, length: &[f64]) {
        let (faces, vertices) = (self.faces, self.on_boundary.len());
        by_ends(faces, vertices, |low, group| {
            let high = group[0].0;
            if low == high {
                self.doubled += group.len();
                return;
            }
            // Nearly every edge: one face on each side.
            if let [(_, h), (_, t)] = *group
                && self.tail(h as usize) != self.tail(t as usize)
            {
                self.twin[h as usize] = t;
                self.twin[t as usize] = h;
                return;
            }
            let (mut back, forth): (Vec<u32>, Vec<u32>) = group
                .iter()
                .map(|key| key.1)
                .partition(|h| self.tail(*h as usize) as u32 == high);
            self.doubled += forth.len().saturating_sub(1) + back.len().saturating_sub(1);
            for h in forth {
                let gap = |t: &u32| (length[*t as usize] - length[h as usize]).abs();
                let nearest = if back.len() > MATCH_LIMIT {
                    back.len().checked_sub(1)
                } else {
                    (0..back.len()).min_by(|i, j| gap(&back[*i]).total_cmp(&gap(&back[*j])))
                };
                if let Some(nearest) = nearest {
                    let t = back.swap_remove(nearest);
                    self.twin[h as usize] = t;
                    self.twin[t as usize] = h;
                }
            }
        });
    }

    pub fn halfedges(&self) -> usize {
        3 * self.faces.len()
    }

    /// The next halfedge of the same face.
    pub fn next(&self, h: usize) -> usize {
        h - h % 3 + (h % 3 + 1) % 3
    }

    /// Vertex that a halfedge leaves.
    pub fn tail(&self, h: usize) -> usize {
        self.faces[h / 3][(h % 3 + 1) % 3] as usize
    }

    /// Vertex that a halfedge reaches.
    pub fn head(&self, h: usize) -> usize {
        self.faces[h / 3][(h % 3 + 2) % 3] as usize
    }

    /// The opposite halfedge, none on the boundary.
    pub fn twin(&self, h: usize) -> Option<usize> {
        (self.twin[h] != NONE).then_some(self.twin[h] as usize)
    }

    /// Corner (3f + k) where a halfedge leaves.
    pub fn tail_corner(&self, h: usize) -> usize {
        h - h % 3 + (h % 3 + 1) % 3
    }

    /// Corner (3f + k) where a halfedge arrives.
    pub fn head_corner(&self, h: usize) -> usize {
        h - h % 3 + (h % 3 + 2) % 3
    }

    /// Halfedge that leaves the vertex of a corner, on that corner's face.
    pub fn outgoing(&self, corner: usize) -> usize {
        corner - corner % 3 + (corner % 3 + 2) % 3
    }

    /// Halfedge that reaches the vertex of a corner, on that corner's face.
    pub fn incoming(&self, corner: usize) -> usize {
        corner - corner % 3 + (corner % 3 + 1) % 3
    }

    /// All corners at a vertex, in the order of the faces.
    pub fn corners_of(&self, v: usize) -> &[u32] {
        &self.corners[self.corner_start[v] as usize..self.corner_start[v + 1] as usize]
    }

    /// Into how many fans the faces at a vertex fall: what hangs together across the edges whose halfedge that leaves `passes` lets through.
    pub fn fans(&self, v: usize, passes: impl Fn(usize) -> bool) -> usize {
        let corners = self.corners_of(v);
        let ahead = |corner: usize| {
            let twin = self.twin(self.incoming(corner)).filter(|t| passes(*t))?;
            Some(self.tail_corner(twin))
        };
        let behind = |corner: usize| {
            let outgoing = self.outgoing(corner);
            let twin = self.twin(outgoing).filter(|_| passes(outgoing))?;
            Some(self.head_corner(twin))
        };
        let Some(first) = corners.first().map(|c| *c as usize) else {
            return 0;
        };
        // Both steps undo each other, so a walk comes to an end or back to where it began.
        let mut met = 1;
        let mut end = ahead(first);
        while let Some(corner) = end.filter(|c| *c != first) {
            met += 1;
            end = ahead(corner);
        }
        if end.is_none() {
            let mut start = behind(first);
            while let Some(corner) = start {
                met += 1;
                start = behind(corner);
            }
        }
        if met == corners.len() {
            return 1;
        }
        let mut fans = UnionFind::new(corners.len());
        for (at, corner) in corners.iter().enumerate() {
            let next =
                ahead(*corner as usize).and_then(|c| corners.binary_search(&(c as u32)).ok());
            if let Some(next) = next {
                fans.join(at, next);
            }
        }
        fans.sets()
    }

    /// Pairs of halfedges, each once.
    pub fn inner_edges(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        (0..self.halfedges()).filter_map(|h| self.twin(h).filter(|t| h < *t).map(|t| (h, t)))
    }

    pub fn edges(&self) -> usize {
        let boundary = self.twin.iter().filter(|t| **t == NONE).count();
        (self.halfedges() + boundary) / 2
    }

    pub fn vertices_used(&self) -> usize {
        self.corner_start.windows(2).filter(|w| w[0] < w[1]).count()
    }

    pub fn euler_characteristic(&self) -> i64 {
        self.vertices_used() as i64 - self.edges() as i64 + self.faces.len() as i64
    }
}

/// Tells every group of halfedges that have both ends in common, whichever way they run: the lower end, and of each its higher end and its number, ascending.
/// Vertices are sorted into buckets by counting, as a bucket holds but a few edges.
pub(super) fn by_ends(
    faces: &[[u32; 3]],
    vertices: usize,
    mut tell: impl FnMut(u32, &[(u32, u32)]),
) {
    let sides = |face: &[u32; 3]| [1, 2, 0].map(|k| (face[k], face[(k + 1) % 3]));
    let mut start = vec![0u32; vertices + 1];
    for (a, b) in faces.iter().flat_map(sides) {
        start[a.min(b) as usize + 1] += 1;
    }
    for v in 0..vertices {
        start[v + 1] += start[v];
    }
    let mut entries = vec![(0, 0); 3 * faces.len()];
    for (h, (a, b)) in (0u32..).zip(faces.iter().flat_map(sides)) {
        // Every start moves to the end of its bucket, which is where the next one began.
        let slot = &mut start[a.min(b) as usize];
        entries[*slot as usize] = (a.max(b), h);
        *slot += 1;
    }
    let mut from = 0;
    for (v, to) in (0u32..).zip(&start[..vertices]) {
        let bucket = &mut entries[from..*to as usize];
        from = *to as usize;
        bucket.sort_unstable();
        for group in bucket.chunk_by(|x, y| x.0 == y.0) {
            tell(v, group);
        }
    }
}

/// Disjoint sets of small integers.
pub(super) struct UnionFind(Vec<u32>);

impl UnionFind {
    pub fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    pub fn find(&mut self, a: usize) -> usize {
        let mut a = a as u32;
        while self.0[a as usize] != a {
            let up = self.0[self.0[a as usize] as usize];
            self.0[a as usize] = up;
            a = up;
        }
        a as usize
    }

    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b)] = a.min(b) as u32;
    }

    pub fn sets(&mut self) -> usize {
        (0..self.0.len())
            .filter(|a| self.0[*a] == *a as u32)
            .count()
    }
}

/// Topology of the surface as it is and as `atlas.json` states it.
pub(super) fn check(
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    verdicts: &mut Verdicts,
) {
    let stated = &document.topology;
    let (vertices, faces) = (arrays.positions.len(), arrays.faces.len());
    verdicts.note(
        "edges pair up (overlay is a simple mesh)",
        surface.doubled == 0,
        format!("{} doubled edges", surface.doubled),
    );
    let used = surface.vertices_used();
    verdicts.note(
        "every vertex used",
        used == vertices,
        format!("{} unused", vertices - used),
    );
    let edges = surface.edges();
    verdicts.note(
        "vertices, edges and faces as stated",
        (vertices as u64, edges as u64, faces as u64)
            == (stated.vertices, stated.edges, stated.faces),
        format!(
            "{vertices}, {edges}, {faces} vs {}, {}, {}",
            stated.vertices, stated.edges, stated.faces
        ),
    );
    let chi = surface.euler_characteristic();
    verdicts.note(
        "Euler characteristic as stated",
        chi == stated.euler_characteristic,
        chi,
    );
    let mut sheets = UnionFind::new(faces);
    for (h, t) in surface.inner_edges() {
        sheets.join(h / 3, t / 3);
    }
    let pinched = surface.fans_of.iter().filter(|fans| **fans > 1).count();
    verdicts.note("vertices are manifold", pinched == 0, pinched);
    let mut border = UnionFind::new(vertices);
    for h in (0..surface.halfedges()).filter(|h| surface.twin(*h).is_none()) {
        border.join(surface.tail(h), surface.head(h));
    }
    let loops = (0..vertices)
        .filter(|v| surface.on_boundary[*v] && border.find(*v) == *v)
        .count() as i64;
    let components = sheets.sets();
    verdicts.note(
        "one component",
        components == 1,
        format!("{components} components"),
    );
    verdicts.note(
        "boundary loops as stated",
        loops == stated.boundary_loops,
        loops,
    );
    let handles = 2 - loops - chi;
    verdicts.note(
        "genus as stated",
        stated.genus.checked_mul(2) == Some(handles),
        handles as f64 / 2.0,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disjoint_sets_join_and_count() {
        let mut sets = UnionFind::new(5);
        sets.join(3, 1);
        sets.join(4, 3);
        assert_eq!(sets.sets(), 3);
        assert_eq!(sets.find(4), 1);
    }

    #[test]
    fn edges_are_grouped_by_their_ends() {
        let faces = [[0, 1, 2], [2, 1, 3], [1, 1, 3]];
        let mut groups = Vec::new();
        by_ends(&faces, 5, |low, group| groups.push((low, group.to_vec())));
        let expected = [
            (0, vec![(1, 2)]),
            (0, vec![(2, 1)]),
            (1, vec![(1, 8)]),
            (1, vec![(2, 0), (2, 5)]),
            (1, vec![(3, 3), (3, 6), (3, 7)]),
            (2, vec![(3, 4)]),
        ];
        assert_eq!(groups, expected);
    }
}
