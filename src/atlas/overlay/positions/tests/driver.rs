//! A test driver: takes a surface from A over B to C by flips, and checks what is promised about positions.

use super::super::*;
use crate::flow::correspondence::Correspondence;
use crate::geometry::ids::{HalfedgeVec, VertexId, VertexVec};
use crate::geometry::triangle;

/// Repeatable random numbers in [0, 1).
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        let mixed = (self.0 ^ (self.0 >> 29)).wrapping_mul(0xbf58476d1ce4e5b9);
        (mixed >> 11) as f64 / (1u64 << 53) as f64
    }
    pub(super) fn below(&mut self, n: usize) -> usize {
        (self.next() * n as f64) as usize
    }
}

/// Sides of the two faces at an edge: ij, and with the apex k on the left and m on the right, jk, ki, im, mj.
pub(super) fn quad(c: &Connectivity, e: EdgeId) -> [EdgeId; 5] {
    let h = c.edge_halfedge(e);
    let t = c.twin(h).unwrap();
    [h, c.next(h), c.prev(h), c.next(t), c.prev(t)].map(|h| c.edge(h))
}

/// The three triangulations on their way from A to C.
pub(super) struct Driver {
    pub(super) intrinsic: Intrinsic,
}

impl Driver {
    pub(super) fn new(base: Connectivity, length: EdgeVec<f64>) -> Driver {
        let same = Correspondence::identity(&base);
        let u = VertexVec::filled(0.0, base.vertex_count());
        Driver {
            intrinsic: Intrinsic {
                front_faces: base.face_count(),
                penner: length.iter().map(|l| l.ln()).collect(),
                base_length: length.clone(),
                delaunay: base.clone(),
                delaunay_length: length,
                delaunay_penner: None,
                flat: base.clone(),
                base,
                u,
                base_on_delaunay: same.clone(),
                delaunay_on_flat: same.clone(),
                base_on_flat: same,
            },
        }
    }

    /// Flips an edge of B with its Euclidean length, where the quad is convex.
    pub(super) fn euclidean_flip(&mut self, e: EdgeId) -> bool {
        let x = &mut self.intrinsic;
        let [ij, jk, ki, im, mj] = quad(&x.delaunay, e).map(|e| x.delaunay_length[e]);
        let (Some(upper), Some(lower)) =
            (triangle::area([ij, jk, ki]), triangle::area([ij, mj, im]))
        else {
            return false;
        };
        // From the middle of ij; k is above, m below.
        let place = |at_i: f64, at_j: f64| 0.5 * (at_i - at_j) / ij * (at_i + at_j);
        let (xk, xm) = (place(ki, jk), place(im, mj));
        let (yk, ym) = (2.0 * upper / ij, 2.0 * lower / ij);
        let crossing = (xk * ym + xm * yk) / (yk + ym);
        let length = (xk - xm).hypot(yk + ym);
        if crossing.abs() > 0.499 * ij {
            return false;
        }
        let Some(flip) = x.delaunay.flip(e) else {
            return false;
        };
        x.delaunay_length[e] = length;
        x.base_on_delaunay.flipped(&x.delaunay, &flip);
        true
    }

    /// C becomes B; after Euclidean flips.
    pub(super) fn start_flat(&mut self) {
        let x = &mut self.intrinsic;
        x.flat = x.delaunay.clone();
        x.penner = x.delaunay_length.iter().map(|l| l.ln()).collect();
        x.delaunay_on_flat = Correspondence::identity(&x.flat);
        x.base_on_flat = x.base_on_delaunay.clone();
    }

    /// Flips an edge of C with Ptolemy's theorem.
    pub(super) fn ptolemy_flip(&mut self, e: EdgeId) -> bool {
        let x = &mut self.intrinsic;
        let [ij, jk, ki, im, mj] = quad(&x.flat, e).map(|e| x.penner[e]);
        let (a, b) = (ki + mj, im + jk);
        let length = a.max(b) + (-(a - b).abs()).exp().ln_1p() - ij;
        let Some(flip) = x.flat.flip(e) else {
            return false;
        };
        x.penner[e] = length;
        x.delaunay_on_flat.flipped(&x.flat, &flip);
        x.base_on_flat.flipped(&x.flat, &flip);
        true
    }

    /// Sum of the cosines of the angles opposite an edge of a triangulation with lengths e^ln; below 0 it wants a flip.
    pub(super) fn cosines(c: &Connectivity, ln: impl Fn(EdgeId) -> f64, e: EdgeId) -> f64 {
        let [ij, jk, ki, im, mj] = quad(c, e).map(&ln);
        let terms = |a: f64, b: f64| [a - b, b - a, 2.0 * ij - a - b];
        let (upper, lower) = (terms(jk, ki), terms(im, mj));
        let largest = upper.iter().chain(&lower).fold(f64::MIN, |a, &b| a.max(b));
        let sum =
            |t: [f64; 3]| (t[0] - largest).exp() + (t[1] - largest).exp() - (t[2] - largest).exp();
        sum(upper) + sum(lower)
    }

    /// B becomes Delaunay, and C becomes B.
    pub(super) fn delaunay(&mut self, may_flip: impl Fn(EdgeId) -> bool) {
        for _ in 0..200 {
            let mut done = true;
            for e in self.intrinsic.base.edges() {
                let x = &self.intrinsic;
                let wanted = Self::cosines(&x.delaunay, |e| x.delaunay_length[e].ln(), e) < -1e-9;
                if wanted && may_flip(e) && self.euclidean_flip(e) {
                    done = false;
                }
            }
            if done {
                self.start_flat();
                return;
            }
        }
        panic!("too many rounds");
    }

    /// C becomes Delaunay for the scale u.
    pub(super) fn flat_delaunay(&mut self) {
        for _ in 0..2000 {
            let mut done = true;
            for e in self.intrinsic.base.edges() {
                let x = &self.intrinsic;
                let scaled = |e| {
                    let [i, j] = x.flat.edge_vertices(e);
                    x.penner[e] + 0.5 * (x.u[i] + x.u[j])
                };
                let wanted = Self::cosines(&x.flat, scaled, e) < -1e-9;
                if wanted && self.ptolemy_flip(e) {
                    done = false;
                }
            }
            if done {
                return;
            }
        }
        panic!("too many rounds");
    }

    pub(super) fn curves(&self) -> Curves {
        let x = &self.intrinsic;
        x.base_on_flat.trace(&x.base, &x.flat).unwrap()
    }

    /// Positions, after a check of everything that is promised.
    pub(super) fn checked(&self) -> (Curves, Positions) {
        let curves = self.curves();
        let got = positions(&self.intrinsic, &curves, SPACING).unwrap();
        assert_eq!(got.unmatched, 0);
        promised(&self.intrinsic, &curves, &got);
        (curves, got)
    }
}

/// Order and room along all edges.
pub(super) fn promised(x: &Intrinsic, curves: &Curves, got: &Positions) {
    let room = |values: Vec<f64>| {
        let step = 0.99 * SPACING / (values.len() + 1) as f64;
        let mut last = 0.0;
        for value in values.into_iter().chain([1.0]) {
            assert!(value - last > step, "{last} {value}");
            last = value;
        }
    };
    for e in x.base.edges() {
        room(got.on_base[curves.range(e)].to_vec());
    }
    let mut on_flat = vec![Vec::new(); x.flat.edge_count()];
    for (i, crossing) in curves.crossing.iter().enumerate() {
        on_flat[x.flat.edge(crossing.halfedge).index()].push(i);
    }
    for (c, on) in on_flat.iter_mut().enumerate() {
        let run = x.flat.edge_halfedge(EdgeId::new(c));
        let n = on.len() as u32;
        on.sort_by_key(|&i| {
            let crossing = curves.crossing[i];
            if crossing.halfedge == run {
                crossing.rank
            } else {
                n - 1 - crossing.rank
            }
        });
        room(on.iter().map(|&i| got.on_flat[i]).collect());
    }
}

/// One vertex, three loops, two faces.
pub(super) fn one_vertex_torus() -> Connectivity {
    let twin = [3, 4, 5, 0, 1, 2].map(|t| Some(HalfedgeId::new(t)));
    Connectivity::from_gluing(HalfedgeVec::filled(VertexId::new(0), 6), &twin, 1).unwrap()
}

pub(super) fn octahedron() -> Connectivity {
    let faces = [
        [0, 1, 2],
        [0, 2, 3],
        [0, 3, 4],
        [0, 4, 1],
        [5, 2, 1],
        [5, 3, 2],
        [5, 4, 3],
        [5, 1, 4],
    ];
    Connectivity::from_faces(&faces, 6).unwrap()
}

pub(super) fn torus(n: usize, m: usize) -> Connectivity {
    let at = |i: usize, j: usize| (i % n * m + j % m) as u32;
    let mut faces = Vec::new();
    for i in 0..n {
        for j in 0..m {
            faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            faces.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    Connectivity::from_faces(&faces, n * m).unwrap()
}

/// Two triangles glued along their whole border.
pub(super) fn pillow() -> Connectivity {
    let twin = [3, 5, 4, 0, 2, 1].map(|t| Some(HalfedgeId::new(t)));
    let tail = [0, 1, 2, 1, 0, 2].map(VertexId::new).to_vec();
    Connectivity::from_gluing(tail.into(), &twin, 3).unwrap()
}

pub(super) fn surfaces() -> Vec<Connectivity> {
    let tetrahedron =
        Connectivity::from_faces(&[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], 4).unwrap();
    vec![
        one_vertex_torus(),
        pillow(),
        tetrahedron,
        octahedron(),
        torus(4, 5),
    ]
}

/// Lengths between 1 and 2 always make triangles.
pub(super) fn random_lengths(base: &Connectivity, random: &mut Random) -> EdgeVec<f64> {
    base.edges().map(|_| 1.0 + 0.999 * random.next()).collect()
}
