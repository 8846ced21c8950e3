use super::*;
use crate::flow::metric::face_lengths;
use crate::flow::ricci::shapes::{self, Shape};
use crate::geometry::ids::{EdgeId, EdgeVec, VertexId};
use crate::geometry::triangle;
use std::f64::consts::PI;

/// A triangulation with lengths and loops, flipped in the plane of two faces at a time.
struct Flipped {
    connectivity: Connectivity,
    length: EdgeVec<f64>,
    loops: DualLoops,
    /// Closed chains of edges, with multiplicities, homotopic to what they were.
    chains: Vec<EdgeVec<i64>>,
}

fn closed() -> Vec<Shape> {
    vec![
        shapes::plate(0, 2),
        shapes::torus(9, 7),
        shapes::plate(2, 1),
        shapes::plate(3, 2),
    ]
}

fn angle(c: &Connectivity, length: &EdgeVec<f64>, corner: HalfedgeId) -> f64 {
    triangle::angles(face_lengths(c, length, c.face(corner))).unwrap()[c.corner(corner)]
}

/// Once counterclockwise around every vertex.
fn around_vertices(c: &Connectivity) -> Vec<Vec<Passage>> {
    let around = |v| {
        let turn = |h| Passage {
            enter: h,
            leave: c.prev(h),
        };
        c.outgoing(v).map(turn).collect()
    };
    c.vertices().map(around).collect()
}

/// One closed chain for every edge that is not in a tree of vertices: together they generate the homology.
fn chains(c: &Connectivity) -> Vec<EdgeVec<i64>> {
    let mut to_root: Vec<Option<Vec<HalfedgeId>>> = vec![None; c.vertex_count()];
    to_root[0] = Some(Vec::new());
    let mut queue = vec![VertexId::new(0)];
    let mut in_tree = EdgeVec::filled(false, c.edge_count());
    let mut next = 0;
    while next < queue.len() {
        let v = queue[next];
        next += 1;
        for h in c.outgoing(v) {
            let w = c.head(h);
            if to_root[w.index()].is_none() {
                let mut way = to_root[v.index()].clone().unwrap();
                way.push(h);
                to_root[w.index()] = Some(way);
                in_tree[c.edge(h)] = true;
                queue.push(w);
            }
        }
    }
    let closing = c.edges().filter(|&e| !in_tree[e]);
    closing
        .map(|e| {
            let mut chain = EdgeVec::filled(0, c.edge_count());
            let h = c.edge_halfedge(e);
            chain[e] += 1;
            let ends = [(c.tail(h), 1), (c.head(h), -1)];
            for (v, sign) in ends {
                for &way in to_root[v.index()].as_ref().unwrap() {
                    chain[c.edge(way)] += sign * direction(c, way);
                }
            }
            chain
        })
        .collect()
}

/// 1 for the halfedge that stands for its edge, −1 for the other.
fn direction(c: &Connectivity, h: HalfedgeId) -> i64 {
    if c.edge_halfedge(c.edge(h)) == h {
        1
    } else {
        -1
    }
}

impl Flipped {
    fn new(c: &Connectivity, length: &EdgeVec<f64>) -> Self {
        let basis = homology_basis(c).unwrap();
        let mut loops = around_vertices(c);
        loops.extend((0..basis.len()).map(|of| basis.passages(of).collect()));
        Self {
            connectivity: c.clone(),
            length: length.clone(),
            loops: DualLoops::new(c, &loops).unwrap(),
            chains: chains(c),
        }
    }

    fn turning(&self) -> Vec<f64> {
        let corner = |h| angle(&self.connectivity, &self.length, h);
        self.loops.turning(&self.connectivity, corner)
    }

    /// How often every loop crosses every chain from left to right.
    fn crossings(&self) -> Vec<i64> {
        let c = &self.connectivity;
        let mut counts = Vec::new();
        for of in 0..self.loops.len() {
            for chain in &self.chains {
                let ways = self.loops.passages(of);
                let crossed = ways.map(|w| direction(c, w.leave) * chain[c.edge(w.leave)]);
                counts.push(crossed.sum());
            }
        }
        counts
    }

    /// Flips an edge where its two faces make a quad that is strictly convex in the plane.
    fn flip(&mut self, e: EdgeId) -> bool {
        let c = &self.connectivity;
        let h = c.edge_halfedge(e);
        let t = c.twin(h).unwrap();
        let at = |h: HalfedgeId| angle(c, &self.length, h);
        let at_tail = at(h) + at(c.next(t));
        let at_head = at(c.next(h)) + at(t);
        if c.face(h) == c.face(t) || at_tail.max(at_head) > PI - 0.05 {
            return false;
        }
        let side = |h: HalfedgeId| self.length[c.edge(h)];
        let (p, q) = (side(c.prev(h)), side(c.next(t)));
        let diagonal = ((p - q).powi(2) + 4.0 * p * q * (0.5 * at_tail).sin().powi(2)).sqrt();
        // Chains go around the new diagonal by its one side; sides and signs as they are before.
        let detour = [c.prev(h), c.next(h)];
        for chain in &mut self.chains {
            // a → b becomes a → c → b: against c → a and b → c.
            let times = direction(c, h) * std::mem::take(&mut chain[e]);
            for d in detour {
                chain[c.edge(d)] -= times * direction(c, d);
            }
        }
        // A halfedge that stands for its edge may be another one afterwards.
        let before: Vec<HalfedgeId> = c.edges().map(|e| c.edge_halfedge(e)).collect();
        let flip = self.connectivity.flip(e).unwrap();
        let c = &self.connectivity;
        let moved = |h: HalfedgeId| flip.moves.iter().find(|m| m.0 == h).map_or(h, |m| m.1);
        for chain in &mut self.chains {
            for (of, &old) in c.edges().zip(&before) {
                if of != e {
                    chain[of] *= direction(c, moved(old));
                }
            }
        }
        self.length[e] = diagonal;
        self.loops.flipped(c, &flip);
        true
    }

    /// Loops are closed, and every face lists what passes it.
    fn validate(&self) {
        let c = &self.connectivity;
        c.validate().unwrap();
        let all: Vec<Vec<Passage>> = (0..self.loops.len())
            .map(|of| self.loops.passages(of).collect())
            .collect();
        let anew = DualLoops::new(c, &all).unwrap();
        for f in c.faces() {
            let sorted = |loops: &DualLoops| {
                let mut turns: Vec<_> = loops
                    .turns_in(c, f)
                    .map(|t| (t.of, t.corner, t.sign > 0.0))
                    .collect();
                turns.sort();
                turns
            };
            assert_eq!(sorted(&self.loops), sorted(&anew));
        }
    }
}

#[test]
fn around_a_vertex_a_loop_turns_by_its_angle() {
    for shape in closed() {
        let c = &shape.connectivity;
        let loops = DualLoops::new(c, &around_vertices(c)).unwrap();
        let turning = loops.turning(c, |h| angle(c, &shape.length, h));
        for (v, turned) in c.vertices().zip(turning) {
            let theta: f64 = c.outgoing(v).map(|h| angle(c, &shape.length, h)).sum();
            assert!((turned - theta).abs() < 1e-12);
        }
    }
}

#[test]
fn flips_in_the_plane_of_two_faces_change_no_turning_and_no_class() {
    let mut random = shapes::sequence(53);
    let mut done = 0;
    for shape in closed() {
        let mut flipped = Flipped::new(&shape.connectivity, &shape.length);
        let (turning, crossings) = (flipped.turning(), flipped.crossings());
        let edges = shape.connectivity.edge_count();
        for round in 0..8 * edges {
            let e = EdgeId::new((random() * edges as f64) as usize);
            done += usize::from(flipped.flip(e));
            if round % edges == 0 {
                flipped.validate();
            }
        }
        flipped.validate();
        assert_eq!(flipped.crossings(), crossings, "{}", shape.name);
        for (now, before) in flipped.turning().iter().zip(&turning) {
            assert!((now - before).abs() < 1e-8, "{now} against {before}");
        }
    }
    assert!(done > 1000, "{done}");
}

/// Two faces, one vertex: every quad is glued to itself. On equilateral faces the torus is flat, and nothing turns.
#[test]
fn loops_follow_flips_of_quads_that_are_glued_to_themselves() {
    let c = shapes::glued(&["abc", "ABC"]);
    let length = EdgeVec::filled(1.0, 3);
    let mut flipped = Flipped::new(&c, &length);
    let crossings = flipped.crossings();
    assert!(crossings.iter().any(|&n| n != 0));
    let mut random = shapes::sequence(59);
    let mut done = 0;
    while done < 40 {
        done += usize::from(flipped.flip(EdgeId::new((random() * 3.0) as usize)));
        flipped.validate();
        assert_eq!(flipped.crossings(), crossings);
        let turning = flipped.turning();
        assert!((turning[0] - 2.0 * PI).abs() < 1e-6);
        assert!(turning[1..].iter().all(|t| t.abs() < 1e-6));
    }
}

/// A square torus with diagonals: the corners of every square lie on a circle, and flipping a diagonal changes nothing.
#[test]
fn flips_of_cocircular_quads_change_no_turning() {
    let n = 5;
    let at = |i: usize, j: usize| (n * (i % n) + j % n) as u32;
    let mut faces = Vec::new();
    for i in 0..n {
        for j in 0..n {
            let q = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            faces.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        }
    }
    let c = Connectivity::from_faces(&faces, n * n).unwrap();
    let is_diagonal = |e: EdgeId| {
        let steps = c.edge_vertices(e).map(|v| [v.index() / n, v.index() % n]);
        (0..2).all(|k| steps[0][k] != steps[1][k])
    };
    let length = c
        .edges()
        .map(|e| if is_diagonal(e) { 2.0_f64.sqrt() } else { 1.0 });
    let mut flipped = Flipped::new(&c, &length.collect());
    let before = flipped.turning();
    let diagonals: Vec<EdgeId> = c.edges().filter(|&e| is_diagonal(e)).collect();
    for e in diagonals.into_iter().step_by(2) {
        assert!(flipped.flip(e));
        for (now, before) in flipped.turning().iter().zip(&before) {
            assert!((now - before).abs() < 1e-12);
        }
    }
}

/// Rank of the crossings of 2g loops with the chains: the intersection form has no kernel.
#[test]
fn there_are_2g_loops_and_they_are_independent() {
    for shape in closed() {
        let c = &shape.connectivity;
        let basis = homology_basis(c).unwrap();
        assert_eq!(basis.len() as i64, 2 * c.topology().genus);
        let chains = chains(c);
        let mut rows: Vec<Vec<f64>> = (0..basis.len())
            .map(|of| {
                let ways: Vec<Passage> = basis.passages(of).collect();
                let mut faces: Vec<FaceId> = ways.iter().map(|w| c.face(w.enter)).collect();
                faces.sort_unstable();
                faces.dedup();
                assert_eq!(faces.len(), ways.len(), "the loop is simple");
                let crossed = |chain: &EdgeVec<i64>| {
                    let ways = ways.iter().map(|w| w.leave);
                    let crossed = ways.map(|h| direction(c, h) * chain[c.edge(h)]);
                    crossed.sum::<i64>() as f64
                };
                chains.iter().map(crossed).collect()
            })
            .collect();
        let mut rank = 0;
        for column in 0..chains.len() {
            let found = (rank..rows.len()).find(|&r| rows[r][column].abs() > 1e-9);
            let Some(pivot) = found else { continue };
            rows.swap(rank, pivot);
            let (above, below) = rows.split_at_mut(rank + 1);
            let lead = &above[rank];
            for row in below {
                let t = row[column] / lead[column];
                row.iter_mut().zip(lead).for_each(|(x, l)| *x -= t * l);
            }
            rank += 1;
        }
        assert_eq!(rank, basis.len(), "{}", shape.name);
    }
}

#[test]
fn broken_loops_and_surfaces_with_boundary_are_refused() {
    let shape = shapes::torus(5, 4);
    let c = &shape.connectivity;
    let mut loops = around_vertices(c);
    loops[3].swap(0, 1);
    let error = DualLoops::new(c, &loops).unwrap_err();
    assert!(matches!(error, HolonomyError::Broken { of: 3, .. }));
    assert!(DualLoops::new(c, &[Vec::new()]).is_err());
    let sheet = shapes::sheet(7, false);
    let error = homology_basis(&sheet.connectivity).unwrap_err();
    assert_eq!(error, HolonomyError::NotClosed { boundary_loops: 1 });
}
