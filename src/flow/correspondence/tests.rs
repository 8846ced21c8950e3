//! Against curves that are kept as words and rewritten at each flip, without any counting; against straight segments in the
//! plane; and against what must hold of any curves in minimal position.

mod surfaces;
mod words;

use super::trace::Tracer;
use super::*;
use crate::geometry::ids::VertexId;
use surfaces::{glued_polygon, square_grid, surfaces, torus_grid};
use words::{Square, Word};

struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005);
        self.0 = self.0.wrapping_add(1442695040888963407);
        (self.0 >> 33) as usize % n
    }
}

#[test]
fn the_surfaces_are_the_ones_meant() {
    let found: Vec<_> = surfaces()
        .iter()
        .map(|(_, c)| {
            let t = c.topology();
            (t.vertices, t.genus, t.boundary_loops)
        })
        .collect();
    let meant = [
        (1, 1, 0),
        (1, 2, 0),
        (5, 0, 0),
        (3, 0, 0),
        (3, 0, 0),
        (4, 0, 0),
        (6, 0, 0),
        (9, 1, 0),
        (16, 0, 1),
    ];
    assert_eq!(found, meant);
}

/// A triangulation under flips, with integers and with words.
struct Walk {
    base: Connectivity,
    current: Connectivity,
    integers: Correspondence,
    words: Vec<Word>,
}

impl Walk {
    fn new(base: Connectivity) -> Walk {
        Walk {
            current: base.clone(),
            integers: Correspondence::identity(&base),
            words: base
                .edges()
                .map(|e| Word::Along(base.edge_halfedge(e)))
                .collect(),
            base,
        }
    }

    fn flip(&mut self, e: EdgeId) -> bool {
        let before = self.current.clone();
        let Some(flip) = self.current.flip(e) else {
            return false;
        };
        self.integers.flipped(&self.current, &flip);
        let square = Square { flip };
        for word in &mut self.words {
            *word = square.rewrite(&before, word);
        }
        true
    }

    /// A random flip, undone where it makes the curves too long to go on.
    fn random_flip(&mut self, random: &mut Random, most: u128) {
        let e = EdgeId::new(random.below(self.current.edge_count()));
        if self.flip(e) && self.integers.crossings().unwrap() > most {
            for _ in 0..3 {
                assert!(self.flip(e));
            }
        }
    }

    fn trace(&self) -> Curves {
        self.integers.trace(&self.base, &self.current).unwrap()
    }

    fn agrees_with_words(&self) {
        let curves = self.trace();
        for e in self.base.edges() {
            let crossings = &curves.crossing[curves.range(e)];
            let traced: Vec<_> = crossings.iter().map(|c| c.halfedge).collect();
            match &self.words[e.index()] {
                Word::Along(h) => {
                    assert_eq!(curves.coincident[e], Some(*h));
                    assert!(traced.is_empty());
                }
                Word::Across {
                    start,
                    crossed,
                    end,
                } => {
                    assert_eq!(curves.coincident[e], None);
                    assert_eq!(&traced, crossed);
                    let (c, first) = (&self.current, traced[0]);
                    assert_eq!(c.prev(first), *start);
                    let back = c.twin(traced[traced.len() - 1]).unwrap();
                    assert_eq!(c.prev(back), *end);
                    let [tail, head] = self.base.edge_vertices(e);
                    assert_eq!((c.tail(*start), c.tail(*end)), (tail, head));
                }
            }
        }
    }

    /// Each halfedge's rank seen from the other side.
    fn other_side(&self, c: Crossing) -> Crossing {
        let n = self.integers.crossings_on(self.current.edge(c.halfedge)) as u32;
        Crossing {
            halfedge: self.current.twin(c.halfedge).unwrap(),
            rank: n - 1 - c.rank,
        }
    }

    fn reversed(&self, path: &[Crossing]) -> Vec<Crossing> {
        path.iter().rev().map(|c| self.other_side(*c)).collect()
    }

    fn is_in_minimal_position(&self) {
        let (c, curves) = (&self.current, self.trace());
        let places = self.ranks_are_permutations(&curves);
        // Of each face, the arcs as pairs of places on its boundary, corner k at 2 k and side k at 2 k + 1.
        let mut arcs = vec![Vec::new(); c.face_count()];
        let on_side = |x: Crossing| (2 * c.corner(x.halfedge) + 1, x.rank);
        for e in self.base.edges() {
            let path = &curves.crossing[curves.range(e)];
            let (Some(first), Some(last)) = (path.first(), path.last()) else {
                continue;
            };
            let corner = |x: Crossing| (2 * ((c.corner(x.halfedge) + 2) % 3), 0);
            let back = self.other_side(*last);
            arcs[c.face(first.halfedge).index()].push((corner(*first), on_side(*first)));
            arcs[c.face(back.halfedge).index()].push((corner(back), on_side(back)));
            for pair in path.windows(2) {
                let enter = self.other_side(pair[0]);
                assert_eq!(c.face(enter.halfedge), c.face(pair[1].halfedge));
                assert_ne!(enter.halfedge, pair[1].halfedge, "backtracks");
                arcs[c.face(enter.halfedge).index()].push((on_side(enter), on_side(pair[1])));
            }
        }
        for arcs in &arcs {
            for (i, &(a, b)) in arcs.iter().enumerate() {
                for &(p, q) in &arcs[..i] {
                    let (low, high) = (a.min(b), a.max(b));
                    let within = |x| low < x && x < high;
                    let beyond = |x| x < low || high < x;
                    let cross = within(p) && beyond(q) || within(q) && beyond(p);
                    assert!(!cross, "{a:?}–{b:?} crosses {p:?}–{q:?}");
                }
            }
        }
        self.vertices_see_the_base_order(&curves, &places);
    }

    /// Checks `by_current_edge` and returns it.
    fn ranks_are_permutations(&self, curves: &Curves) -> (Vec<u32>, Vec<u32>) {
        let (first, crossing) = curves.by_current_edge(&self.current);
        let mut all = crossing.clone();
        all.sort_unstable();
        assert!(all.iter().enumerate().all(|(i, c)| i == *c as usize));
        assert_eq!(all.len(), curves.crossing.len());
        for e in self.current.edges() {
            let on = &crossing[first[e.index()] as usize..first[e.index() + 1] as usize];
            assert_eq!(on.len() as u64, self.integers.crossings_on(e));
            let coincident = curves.coincident.iter().flatten();
            let bases = coincident.filter(|h| self.current.edge(**h) == e).count();
            assert_eq!(self.integers.is_base_edge(e), bases == 1);
            assert_eq!(on.is_empty(), bases == 1);
            for (place, i) in on.iter().enumerate() {
                let mut c = curves.crossing[*i as usize];
                if c.halfedge != self.current.edge_halfedge(e) {
                    c = self.other_side(c);
                }
                assert_eq!(c.halfedge, self.current.edge_halfedge(e));
                assert_eq!(c.rank as usize, place);
            }
        }
        (first, crossing)
    }

    fn vertices_see_the_base_order(&self, curves: &Curves, places: &(Vec<u32>, Vec<u32>)) {
        let (c, base) = (&self.current, &self.base);
        // What sets out from the corner at the tail of a current halfedge: base halfedge, by rank.
        let mut out = vec![Vec::new(); c.halfedge_count()];
        for e in base.edges() {
            let b = base.edge_halfedge(e);
            if let Some(h) = curves.coincident[e] {
                out[h.index()].push((-1, b));
                if let (Some(t), Some(bt)) = (c.twin(h), base.twin(b)) {
                    out[t.index()].push((-1, bt));
                }
                continue;
            }
            let path = &curves.crossing[curves.range(e)];
            let back = self.reversed(path);
            for (x, b) in [(path[0], b), (back[0], base.twin(b).unwrap())] {
                out[c.prev(x.halfedge).index()].push((i64::from(x.rank), b));
            }
        }
        for v in base.vertices() {
            let mut around = Vec::new();
            for h in c.outgoing(v) {
                out[h.index()].sort_unstable();
                around.extend(out[h.index()].iter().map(|x| x.1));
            }
            let expected: Vec<_> = base.outgoing(v).collect();
            assert_eq!(around.len(), expected.len());
            let shift = around.iter().position(|b| *b == expected[0]).unwrap();
            around.rotate_left(shift);
            assert_eq!(around, expected);
        }
        assert_eq!(places.1.len() as u128, self.integers.crossings().unwrap());
    }

    fn runs_back_the_same_way(&self) {
        let tracer = Tracer::new(&self.integers, &self.base, &self.current).unwrap();
        for e in self.base.edges() {
            let b = self.base.edge_halfedge(e);
            let Some(t) = self.base.twin(b) else { continue };
            let (mut there, mut back) = (Vec::new(), Vec::new());
            let along = tracer.follow(b, usize::MAX, &mut there).unwrap();
            let against = tracer.follow(t, usize::MAX, &mut back).unwrap();
            assert_eq!(self.reversed(&there), back);
            assert_eq!(along.and_then(|h| self.current.twin(h)), against);
        }
    }
}

#[test]
fn the_identity_has_no_crossing() {
    for (_, base) in surfaces() {
        let walk = Walk::new(base);
        let curves = walk.trace();
        assert!(curves.crossing.is_empty());
        for e in walk.base.edges() {
            assert_eq!(curves.coincident[e], Some(walk.base.edge_halfedge(e)));
        }
        walk.is_in_minimal_position();
    }
}

#[test]
fn one_flip_makes_one_crossing() {
    for (name, base) in surfaces() {
        for e in base.edges() {
            let mut walk = Walk::new(base.clone());
            if walk.flip(e) {
                assert_eq!(walk.integers.crossings_on(e), 1, "{name}");
                assert_eq!(walk.integers.crossings(), Ok(1));
                walk.agrees_with_words();
                walk.is_in_minimal_position();
            }
        }
    }
}

#[test]
fn random_flips_agree_with_words() {
    for (i, (name, base)) in surfaces().into_iter().enumerate() {
        let mut random = Random(i as u64 + 1);
        let mut walk = Walk::new(base);
        let mut longest = 0;
        for step in 0..1500 {
            walk.random_flip(&mut random, 1200);
            longest = longest.max(walk.integers.crossings().unwrap());
            walk.agrees_with_words();
            if step % 10 == 0 {
                walk.is_in_minimal_position();
                walk.runs_back_the_same_way();
            }
        }
        // A sphere with three vertices has few triangulations, all close to each other.
        let few = walk.base.vertex_count() == 3;
        let far = if few { 1 } else { 500 };
        assert!(longest >= far, "{name} was never far from its base");
    }
}

/// The second flip of an edge restores it with the halfedges exchanged, the fourth restores everything.
#[test]
fn flips_are_undone_by_flips() {
    for (i, (name, base)) in surfaces().into_iter().enumerate() {
        let mut random = Random(i as u64 + 77);
        let mut walk = Walk::new(base);
        for _ in 0..150 {
            walk.random_flip(&mut random, 800);
            let e = EdgeId::new(random.below(walk.current.edge_count()));
            let (integers, current) = (walk.integers.clone(), walk.current.clone());
            if walk.flip(e) {
                assert_ne!(walk.integers, integers);
                assert!(walk.flip(e));
                assert_eq!(walk.integers.normal, integers.normal, "{name}");
                assert!(walk.flip(e) && walk.flip(e));
                assert_eq!(walk.current.to_faces(), current.to_faces());
                assert_eq!(walk.integers, integers, "{name}");
            }
        }
    }
}

/// Going back along a long way flip by flip ends at the base.
#[test]
fn the_way_back_ends_at_the_base() {
    for (i, (name, base)) in surfaces().into_iter().enumerate() {
        let mut random = Random(i as u64 + 400);
        let mut walk = Walk::new(base);
        let mut flips = Vec::new();
        while flips.len() < 40 && walk.integers.crossings().unwrap() < 4000 {
            let e = EdgeId::new(random.below(walk.current.edge_count()));
            if walk.flip(e) {
                flips.push(e);
            }
        }
        assert!(flips.len() > 10, "{name}");
        for e in flips.into_iter().rev() {
            assert!(walk.flip(e));
        }
        assert_eq!(walk.integers.crossings(), Ok(0), "{name}");
        let curves = walk.trace();
        for (e, h) in curves.coincident.enumerate() {
            assert_eq!(h.map(|h| walk.current.edge(h)), Some(e));
        }
    }
}

/// Flips of a triangulation of the plane: straight segments are in minimal position.
#[test]
fn crossings_are_those_of_straight_segments() {
    let n = 5;
    let base = square_grid(n);
    let mut random = Random(9);
    let points: Vec<[i64; 2]> = (0..(n + 1) * (n + 1))
        .map(|i| {
            let at = [i / (n + 1), i % (n + 1)];
            at.map(|x| 1_000_000 * i64::from(x) + random.below(250_000) as i64)
        })
        .collect();
    let at = |v: VertexId| points[v.index()];
    let turn = |p: [i64; 2], q: [i64; 2], r: [i64; 2]| {
        ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])).signum()
    };
    let cross = |[a, b]: [VertexId; 2], [c, d]: [VertexId; 2]| {
        let [a, b, c, d] = [at(a), at(b), at(c), at(d)];
        turn(a, b, c) * turn(a, b, d) < 0 && turn(c, d, a) * turn(c, d, b) < 0
    };
    let mut walk = Walk::new(base);
    let mut flips = 0;
    while flips < 1500 {
        let e = EdgeId::new(random.below(walk.current.edge_count()));
        let c = &walk.current;
        let h = c.edge_halfedge(e);
        let Some(t) = c.twin(h) else { continue };
        if !cross(c.edge_vertices(e), [c.apex(h), c.apex(t)]) {
            continue;
        }
        assert!(walk.flip(e));
        flips += 1;
        if flips % 25 == 0 {
            let curves = walk.trace();
            for b in walk.base.edges() {
                let base_ends = walk.base.edge_vertices(b);
                let mut found: Vec<_> = curves.crossing[curves.range(b)]
                    .iter()
                    .map(|x| walk.current.edge(x.halfedge))
                    .collect();
                found.sort_unstable();
                let expected: Vec<_> = walk
                    .current
                    .edges()
                    .filter(|e| cross(base_ends, walk.current.edge_vertices(*e)))
                    .collect();
                assert_eq!(found, expected);
            }
        }
    }
    assert!(walk.integers.crossings().unwrap() > 50);
}

/// Flipping the three edges of a one-vertex torus in turn multiplies the crossings by more than the golden ratio.
#[test]
fn too_many_crossings_are_an_error() {
    let base = glued_polygon(&[1, 2, -1, -2]);
    let mut current = base.clone();
    let mut integers = Correspondence::identity(&base);
    let (mut long, mut overflow) = (0, 0);
    for i in 0..400 {
        let e = EdgeId::new(i % 3);
        let flip = current.flip(e).unwrap();
        integers.flipped(&current, &flip);
        if i < 25 {
            let curves = integers.trace(&base, &current).unwrap();
            assert_eq!(curves.crossing.len() as u128, integers.crossings().unwrap());
        }
        match integers.trace_if_long(&base, &current) {
            Some(CorrespondenceError::TooManyCrossings { count }) => {
                assert!(count > u128::from(u32::MAX));
                assert_eq!(overflow, 0);
                long += 1;
            }
            Some(CorrespondenceError::Overflow { .. }) => overflow += 1,
            Some(other) => panic!("{other}"),
            None => assert_eq!((long, overflow), (0, 0)),
        }
    }
    assert!(long > 20 && overflow > 200, "{long} {overflow}");
    assert!(matches!(
        integers.crossings(),
        Err(CorrespondenceError::Overflow { .. })
    ));
}

impl Correspondence {
    /// The error of `trace`, which is not run where it would make a long list.
    fn trace_if_long(
        &self,
        base: &Connectivity,
        current: &Connectivity,
    ) -> Option<CorrespondenceError> {
        match self.crossings() {
            Ok(n) if n <= u128::from(u32::MAX) => None,
            _ => self.trace(base, current).err(),
        }
    }
}

#[test]
fn wrong_integers_are_an_error() {
    for (i, (name, base)) in surfaces().into_iter().enumerate() {
        let mut random = Random(i as u64 + 5);
        let mut walk = Walk::new(base);
        for _ in 0..60 {
            walk.random_flip(&mut random, 500);
            for e in walk.current.edges() {
                for more in [1, 2, 7] {
                    let mut wrong = walk.integers.clone();
                    wrong.normal[e] += more;
                    let found = wrong.trace(&walk.base, &walk.current);
                    assert!(
                        matches!(found, Err(CorrespondenceError::Inconsistent(_))),
                        "{name}: {e} + {more}: {found:?}"
                    );
                }
            }
            // A closed curve around a vertex, which belongs to no base edge.
            let mut wrong = walk.integers.clone();
            let v = VertexId::new(random.below(walk.base.vertex_count()));
            for h in walk.current.outgoing(v) {
                let n = &mut wrong.normal[walk.current.edge(h)];
                *n = n.max(&mut 0).saturating_add(1);
            }
            assert!(wrong.trace(&walk.base, &walk.current).is_err(), "{name}");
            // One base halfedge too far around.
            let h = HalfedgeId::new(random.below(walk.current.halfedge_count()));
            let valence = walk.integers.valence[walk.current.tail(h)];
            let mut wrong = walk.integers.clone();
            wrong.roundabout[h] = (wrong.roundabout[h] + 1) % valence;
            if let Ok(curves) = wrong.trace(&walk.base, &walk.current) {
                // No base edge sets out between this halfedge and the next: its number is not used yet.
                assert_eq!(curves, walk.trace(), "{name}");
            }
        }
    }
}

#[test]
fn another_triangulation_is_an_error() {
    let mut walk = Walk::new(torus_grid(3));
    let other = torus_grid(4);
    assert_eq!(
        walk.integers.trace(&other, &walk.current),
        Err(CorrespondenceError::OtherSize)
    );
    let mut flipped_other = other.clone();
    let flip = flipped_other.flip(EdgeId::new(0)).unwrap();
    walk.integers.flipped(&flipped_other, &flip);
    assert_eq!(
        walk.integers.trace(&walk.base, &walk.current),
        Err(CorrespondenceError::OtherSize)
    );
    // A flip that was not told.
    let mut walk = Walk::new(torus_grid(3));
    let mut random = Random(3);
    for _ in 0..50 {
        walk.random_flip(&mut random, 300);
    }
    let untold = walk.current.edges().filter(|e| {
        let mut current = walk.current.clone();
        current.flip(*e).is_some() && walk.integers.trace(&walk.base, &current).is_ok()
    });
    assert_eq!(untold.count(), 0);
}
