//! The triangulation that is flipped until it is Delaunay, at any scale `u` (`docs/method.md`, 2, "Flips").
//!
//! *Enters:* a closed triangulation with lengths, then one `u` after another. *Leaves:* the Delaunay triangulation of the lengths
//! e^{(u_i + u_j)/2} l⁰, with the shapes of its faces. Lengths are logarithms (Penner coordinates): flips by Ptolemy's
//! theorem commute with scaling, and face shapes are computed after a face's own scale is divided out, so no scale overflows.
//!
//! A logarithm is the sum of two numbers, and [`Delaunay::rebase`] takes the `u` reached so far into it. In a face whose sides differ by
//! a factor of 1e6, one unit in the last place of `u` or of a length turns an angle by 1e-10: a `u` near 10 could not be
//! written down well enough to meet the tolerance. Relative to the last accepted step it can.
//!
//! *Guaranteed:* it ends, whatever the rounding; where it ends with every edge Delaunay, every face is a triangle (Gu, Luo, Sun, Wu 2018).
//! A flip is never undone when `u` goes back. *Not guaranteed:* which of the diagonals of a cocircular quad is chosen.
//!
//! The test uses lengths only: the edge ij with opposite corners k, m is Delaunay iff cos θ_k + cos θ_m ≥ 0, where a
//! cosine is (l_ik² + l_jk² − l_ij²) / (2 l_ik l_jk) even where the three lengths make no triangle. Where they do, the same
//! is decided by θ_k + θ_m ≤ π from angles that keep their digits in needles.

use crate::flow::correspondence::Correspondence;
use crate::flow::mirror::Reflection;
use crate::flow::schemes::FaceShape;
use crate::geometry::connectivity::{Connectivity, Flip};
use crate::geometry::ids::{EdgeId, EdgeVec, FaceId, FaceVec, HalfedgeId, VertexVec};
use crate::geometry::triangle;
use rayon::prelude::*;
use std::f64::consts::PI;

/// By how much θ_k + θ_m may exceed π (or cos θ_k + cos θ_m fall below 0) before an edge is flipped, radians: above the
/// rounding of angles, far below what a step of the flow could feel.
const SLACK: f64 = 1e-12;
/// Units in the last place of lengths that angles may be wrong by, and what they come to in a needle: an angle of a face turns by as much of a
/// radian as the face's least angle has it longer than wide.
const LENGTH_ROUNDING: f64 = 16.0 * f64::EPSILON;
/// The slack never exceeds this, however thin a face is.
const MOST_SLACK: f64 = 1e-9;
/// Factor on the slack for every so many times that the edge was flipped already at this `u`: rounding may make both
/// diagonals of a nearly cocircular quad look wrong, and this ends the quarrel. In a fan of a thousand faces an edge is rightly flipped a hundred times.
const SLACK_GROWTH: f64 = 4.0;
const PATIENCE: u16 = 64;
/// Below this many items a piece is not worth another thread.
const PIECE: usize = 4096;

/// A triangulation with Penner coordinates.
#[derive(Clone, Debug)]
pub struct Delaunay {
    /// The triangulation now.
    pub connectivity: Connectivity,
    /// ln of every edge's length at `scale`, leading part.
    high: EdgeVec<f64>,
    /// What is left of it, below one unit in the last place of `high`.
    low: EdgeVec<f64>,
    /// The u that the lengths contain.
    scale: VertexVec<f64>,
    /// Told of every flip.
    pub correspondences: Vec<Correspondence>,
    /// Every flip by Ptolemy's theorem, in order, for whoever needs its derivative; `None` where nobody does.
    pub record: Option<Vec<PtolemyFlip>>,
    /// Flips so far.
    pub flips: usize,
    /// How often every edge was flipped at this `u`; all zero between evaluations.
    tired: EdgeVec<u16>,
    /// Edges that stay, Delaunay or not; `None` where none need do.
    held: Option<EdgeVec<bool>>,
}

/// A flip by Ptolemy's theorem, and how the new length depends on the old ones:
/// d ln l_dc = −d ln l_ab + `share` (d ln l_ad + d ln l_bc) + (1 − `share`) (d ln l_ca + d ln l_db).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PtolemyFlip {
    /// What happened to the halfedges.
    pub flip: Flip,
    /// The edge that was flipped: `ab` before, `dc` after.
    pub edge: EdgeId,
    /// The edges `ca`, `ad`, `db`, `bc`.
    pub outer: [EdgeId; 4],
    /// l_ad l_bc as a share of l_ad l_bc + l_ca l_db.
    pub share: f64,
}

/// How a flip finds the length of the new diagonal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Diagonal {
    /// l_km = (l_ik l_jm + l_im l_jk) / l_ij: keeps the conformal class.
    Ptolemy,
    /// The distance in the plane where both faces are laid out: keeps the surface.
    Euclid,
}

impl PtolemyFlip {
    /// Logarithms of lengths after this flip from those before it, or the other way round: Ptolemy's theorem knows no direction.
    pub fn swap(&self, log_length: &mut EdgeVec<f64>) {
        let [ca, ad, db, bc] = self.outer.map(|e| log_length[e]);
        log_length[self.edge] = log_sum(ca + db, ad + bc) - log_length[self.edge];
    }
}

impl Delaunay {
    /// Starts with `length` (one an edge, positive and finite) and no flip done.
    pub fn new(
        connectivity: Connectivity,
        length: &EdgeVec<f64>,
        correspondences: Vec<Correspondence>,
    ) -> Self {
        let log_length = length.iter().map(|l| l.ln()).collect();
        Self::from_logs(connectivity, log_length, correspondences)
    }

    /// The same with the logarithms of the lengths.
    pub fn from_logs(
        connectivity: Connectivity,
        log_length: EdgeVec<f64>,
        correspondences: Vec<Correspondence>,
    ) -> Self {
        Self {
            high: log_length,
            low: EdgeVec::filled(0.0, connectivity.edge_count()),
            scale: VertexVec::filled(0.0, connectivity.vertex_count()),
            tired: EdgeVec::filled(0, connectivity.edge_count()),
            connectivity,
            correspondences,
            record: None,
            flips: 0,
            held: None,
        }
    }

    /// The same with edges that are never flipped.
    pub fn holding(self, held: EdgeVec<bool>) -> Self {
        Self {
            held: Some(held),
            ..self
        }
    }

    /// Flips to the intrinsic Delaunay triangulation of the surface itself: from A to B. The surface stays the same. An edge whose
    /// other diagonal has no positive length (a face that is folded onto another) stays.
    pub fn flip_in_the_surface(&mut self) {
        let u = VertexVec::filled(0.0, self.connectivity.vertex_count());
        let mut shape = FaceVec::default();
        self.update_shapes(&u, &mut shape);
        self.flip_all(&u, &mut shape, Diagonal::Euclid);
    }

    /// Flips an edge whatever the test says, to the length whose logarithm is given; `None` where it has no other diagonal.
    pub fn flip_to(&mut self, e: EdgeId, log_length: f64) -> Option<Flip> {
        let flip = self.connectivity.flip(e)?;
        (self.high[e], self.low[e]) = (log_length, 0.0);
        for correspondence in &mut self.correspondences {
            correspondence.flipped(&self.connectivity, &flip);
        }
        self.flips += 1;
        Some(flip)
    }

    /// Flips to the Delaunay triangulation at `u` (relative to [`scale`](Self::scale)) by Ptolemy's theorem, and leaves the shapes of all faces in `shape`, whose
    /// buffer is reused.
    pub fn evaluate(&mut self, u: &VertexVec<f64>, shape: &mut FaceVec<FaceShape>) {
        self.update_shapes(u, shape);
        self.flip_all(u, shape, Diagonal::Ptolemy);
    }

    /// The same at u = 0 on a triangulation that is its own mirror image, of which one half tells about the other. Flips need not come in pairs.
    pub fn evaluate_mirrored(&mut self, reflection: &Reflection, shape: &mut FaceVec<FaceShape>) {
        let u = VertexVec::filled(0.0, self.connectivity.vertex_count());
        let c = &self.connectivity;
        let mut shapes = vec![FaceShape::default(); c.face_count()];
        let (front, back) = shapes.split_at_mut(c.face_count() / 2);
        let own = front.par_iter_mut().with_min_len(PIECE);
        own.enumerate().for_each(|(f, shape)| {
            *shape = log_face(self.log_sides(&u, FaceId::new(f)));
        });
        let front = &*front;
        let images = back.par_iter_mut().with_min_len(PIECE);
        images.enumerate().for_each(|(f, shape)| {
            let corners = c.face_halfedges(FaceId::new(front.len() + f));
            // A halfedge's image runs the other way, so the corner that it leaves is the image of the one where that ends.
            let of = corners.map(|h| c.next(reflection.halfedge[h]));
            let own = &front[c.face(of[0]).index()];
            let of = of.map(|h| c.corner(h));
            *shape = FaceShape {
                angle: of.map(|k| own.angle[k]),
                weight: of.map(|k| own.weight[k]),
                broken: own.broken,
            };
        });
        *shape = shapes.into();
        let mut is_wrong = EdgeVec::filled(false, self.connectivity.edge_count());
        for (e, &image) in reflection.edge.enumerate().filter(|(e, image)| e <= *image) {
            is_wrong[e] = self.is_wrong(&u, shape, e);
            is_wrong[image] = is_wrong[e];
        }
        let wrong = self.connectivity.edges().filter(|&e| is_wrong[e]);
        let wrong = wrong.collect();
        self.flip_from(wrong, &u, shape, Diagonal::Ptolemy);
    }

    /// Takes `u` into the lengths: from now on it is counted from there.
    pub fn rebase(&mut self, u: &VertexVec<f64>) {
        for e in self.connectivity.edges() {
            let [i, j] = self.connectivity.edge_vertices(e);
            let (sum, rest) = two_sum(self.high[e], 0.5 * (u[i] + u[j]));
            (self.high[e], self.low[e]) = two_sum(sum, rest + self.low[e]);
        }
        for (v, u) in u.enumerate() {
            self.scale[v] += u;
        }
    }

    /// All of u that was taken into the lengths.
    pub fn scale(&self) -> &VertexVec<f64> {
        &self.scale
    }

    /// ln of the length of one edge with what was taken into it.
    pub fn log_length(&self, e: EdgeId) -> f64 {
        self.high[e] + self.low[e]
    }

    /// ln of the length of every edge with what was taken into it.
    pub fn log_lengths(&self) -> EdgeVec<f64> {
        let parts = self.high.iter().zip(self.low.iter());
        parts.map(|(high, low)| high + low).collect()
    }

    /// The shapes of all faces at `u`, whose buffer is reused.
    pub fn update_shapes(&self, u: &VertexVec<f64>, shape: &mut FaceVec<FaceShape>) {
        if shape.len() != self.connectivity.face_count() {
            *shape = FaceVec::filled(FaceShape::default(), self.connectivity.face_count());
        }
        let faces = shape.as_mut_slice().par_iter_mut().with_min_len(PIECE);
        faces.enumerate().for_each(|(f, shape)| {
            *shape = log_face(self.log_sides(u, FaceId::new(f)));
        });
    }

    /// The same of the faces beside an edge alone.
    pub fn update_faces_beside(
        &self,
        e: EdgeId,
        u: &VertexVec<f64>,
        shape: &mut FaceVec<FaceShape>,
    ) {
        let c = &self.connectivity;
        let h = c.edge_halfedge(e);
        let sides = [Some(h), c.twin(h)].into_iter().flatten();
        for f in sides.map(|h| c.face(h)) {
            shape[f] = log_face(self.log_sides(u, f));
        }
    }

    /// ln of the sides of a face at `u`, `k` opposite corner `k`, relative to the longest side. The sides' common
    /// factor e^{(u_i + u_j + u_k)/2} changes no angle.
    #[inline]
    fn log_sides(&self, u: &VertexVec<f64>, face: FaceId) -> [f64; 3] {
        let c = &self.connectivity;
        let edges = c.face_edges(face);
        let half: [f64; 3] = c.face_vertices(face).map(|v| 0.5 * u[v]);
        let side: [f64; 3] = std::array::from_fn(|k| self.high[edges[k]] - half[k]);
        let mut longest = 0;
        for k in 1..3 {
            if side[k] > side[longest] {
                longest = k;
            }
        }
        let mut log = std::array::from_fn(|k| {
            let (gap, rest) = two_sum(self.high[edges[k]], -self.high[edges[longest]]);
            let rest = rest + (self.low[edges[k]] - self.low[edges[longest]]);
            (gap - (half[k] - half[longest])) + rest
        });
        // Rounding may have taken another side for the longest of two that are equal but for their last digits.
        let most = log[0].max(log[1]).max(log[2]);
        if most > 0.0 {
            log = log.map(|l| l - most);
        }
        log
    }

    fn flip_all(&mut self, u: &VertexVec<f64>, shape: &mut FaceVec<FaceShape>, diagonal: Diagonal) {
        let edges = (0..self.connectivity.edge_count()).into_par_iter();
        let wrong = edges.with_min_len(PIECE).map(EdgeId::new);
        let wrong = wrong.filter(|&e| self.is_wrong(u, shape, e)).collect();
        self.flip_from(wrong, u, shape, diagonal);
    }

    /// Flips the edges that are wrong, and those that become so.
    fn flip_from(
        &mut self,
        wrong: Vec<EdgeId>,
        u: &VertexVec<f64>,
        shape: &mut FaceVec<FaceShape>,
        diagonal: Diagonal,
    ) {
        // Last in, first out: what a flip disturbs is looked at while it is in the cache.
        let mut stack = wrong;
        stack.reverse();
        let mut flipped = Vec::new();
        while let Some(e) = stack.pop() {
            if !self.is_wrong(u, shape, e) {
                continue;
            }
            let Some(length) = self.diagonal(shape, e, diagonal) else {
                continue;
            };
            let Some(flip) = self.connectivity.flip(e) else {
                continue;
            };
            (self.high[e], self.low[e]) = (length, 0.0);
            for correspondence in &mut self.correspondences {
                correspondence.flipped(&self.connectivity, &flip);
            }
            if let Some(record) = &mut self.record {
                let outer = flip.moves.map(|(_, to)| self.connectivity.edge(to));
                let [ca, ad, db, bc] = outer.map(|e| self.high[e] + self.low[e]);
                record.push(PtolemyFlip {
                    flip,
                    edge: e,
                    outer,
                    share: 1.0 / (1.0 + ((ca + db) - (ad + bc)).exp()),
                });
            }
            self.flips += 1;
            self.tired[e] = self.tired[e].saturating_add(1);
            flipped.push(e);
            self.look_around(u, shape, flip, &mut stack);
        }
        for e in flipped {
            self.tired[e] = 0;
        }
    }

    /// New shapes of the two faces, and their outer edges to look at again.
    fn look_around(
        &self,
        u: &VertexVec<f64>,
        shape: &mut FaceVec<FaceShape>,
        flip: Flip,
        stack: &mut Vec<EdgeId>,
    ) {
        let c = &self.connectivity;
        for h in [flip.h, flip.t] {
            let f = c.face(h);
            shape[f] = log_face(self.log_sides(u, f));
        }
        stack.extend(flip.moves.map(|(_, to)| c.edge(to)));
    }

    fn is_wrong(&self, u: &VertexVec<f64>, shape: &FaceVec<FaceShape>, e: EdgeId) -> bool {
        let c = &self.connectivity;
        let h = c.edge_halfedge(e);
        let Some(t) = c.twin(h) else {
            return false;
        };
        if self.held.as_ref().is_some_and(|held| held[e]) {
            return false;
        }
        let (f, g) = (c.face(h), c.face(t));
        // A face glued to itself has both angles inside, so their sum is below π.
        if f == g {
            return false;
        }
        let slack = SLACK * SLACK_GROWTH.powi(i32::from(self.tired[e] / PATIENCE));
        if shape[f].broken || shape[g].broken {
            let cosine = |h: HalfedgeId| {
                let sides = self.log_sides(u, c.face(h));
                cosine(sides, (c.corner(h) + 2) % 3)
            };
            cosine(h) + cosine(t) < -slack
        } else {
            let angle = |h: HalfedgeId| shape[c.face(h)].angle[(c.corner(h) + 2) % 3];
            let sum = angle(h) + angle(t);
            sum > PI + slack && sum > PI + slack.max(self.rounding(shape, [f, g]))
        }
    }

    /// What the lengths of two faces leave open of their angles. Corners of a regular polygon are cocircular, and the faces of a fan over it so thin that
    /// rounding would flip every edge, some of them over and over.
    fn rounding(&self, shape: &FaceVec<FaceShape>, faces: [FaceId; 2]) -> f64 {
        let angles = faces.iter().flat_map(|f| shape[*f].angle);
        let least = angles.fold(f64::INFINITY, f64::min);
        (LENGTH_ROUNDING / least).min(MOST_SLACK)
    }

    /// ln of the length of the other diagonal; `None` where it has none.
    fn diagonal(&self, shape: &FaceVec<FaceShape>, e: EdgeId, rule: Diagonal) -> Option<f64> {
        let c = &self.connectivity;
        let h = c.edge_halfedge(e);
        let t = c.twin(h)?;
        // ab is the edge, c and d are opposite: next(h) = bc, prev(h) = ca, next(t) = ad, prev(t) = db.
        let side = |h: HalfedgeId| self.high[c.edge(h)] + self.low[c.edge(h)];
        let (bc, ca, ad, db) = (
            side(c.next(h)),
            side(c.prev(h)),
            side(c.next(t)),
            side(c.prev(t)),
        );
        let length = match rule {
            Diagonal::Ptolemy => log_sum(ca + db, ad + bc) - side(h),
            Diagonal::Euclid => {
                let angle = |h: HalfedgeId| shape[c.face(h)].angle[c.corner(h)];
                // Around the end where both outer sides are shorter, so that little is subtracted.
                let (p, q, theta) = if ca.max(ad) <= bc.max(db) {
                    (ca, ad, angle(h) + angle(c.next(t)))
                } else {
                    (bc, db, angle(c.next(h)) + angle(t))
                };
                // (p − q)² + 4 p q sin²(θ/2), with the longer of p and q divided out.
                let (long, ratio) = (p.max(q), (p.min(q) - p.max(q)).exp());
                let gap = -(p.min(q) - p.max(q)).exp_m1();
                let sine = (0.5 * theta).sin();
                long + 0.5 * (gap * gap + 4.0 * ratio * sine * sine).ln()
            }
        };
        length.is_finite().then_some(length)
    }
}

/// ln(e^a + e^b).
pub fn log_sum(a: f64, b: f64) -> f64 {
    a.max(b) + (a.min(b) - a.max(b)).exp().ln_1p()
}

/// A face of vertex scaling from logarithms of its sides, the greatest of which is 0; ∂θ_i/∂u_j = ½ cot θ_k.
fn log_face(side: [f64; 3]) -> FaceShape {
    match triangle::angles_and_cotangents_of_logs(side) {
        Some((angle, cotangent)) => FaceShape {
            angle,
            weight: cotangent.map(|c| 0.5 * c),
            broken: false,
        },
        None => {
            let mut longest = 0;
            for k in 1..3 {
                if side[k] > side[longest] {
                    longest = k;
                }
            }
            FaceShape::broken_at(longest)
        }
    }
}

/// The sum in float64 and what rounding left out of it, exactly (Knuth).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let part = sum - a;
    (sum, (a - (sum - part)) + (b - part))
}

/// (a² + b² − c²) / (2 a b) at `corner`, from logarithms of the sides; also where they make no triangle.
fn cosine(side: [f64; 3], corner: usize) -> f64 {
    let (a, b) = (side[(corner + 1) % 3], side[(corner + 2) % 3]);
    let ratio = (a - b).exp();
    0.5 * (ratio + 1.0 / ratio) - 0.5 * (2.0 * side[corner] - a - b).exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::metric::{Evaluation, Metric, curvature, total_area};
    use crate::flow::ricci::shapes;
    use crate::geometry::ids::VertexId;

    /// One-vertex torus, double of a triangle, a pillow of two self-glued faces (degree-1 vertices), one-vertex genus 2.
    fn tiny() -> Vec<(&'static str, Connectivity)> {
        vec![
            ("one-vertex torus", shapes::glued(&["abc", "ABC"])),
            ("double of a triangle", shapes::glued(&["abc", "CBA"])),
            ("two-triangle sphere", shapes::glued(&["aAb", "BcC"])),
            (
                "one-vertex genus 2",
                shapes::glued(&["abx", "XAy", "YBz", "ZcW", "wdv", "VCD"]),
            ),
        ]
    }

    /// Lengths between 1 and 2 make triangles of any three… but for a sum of two that is just 2: stay below.
    fn lengths(c: &Connectivity, random: &mut impl FnMut() -> f64) -> EdgeVec<f64> {
        c.edges().map(|_| 1.0 + 0.9 * random()).collect()
    }

    fn assert_delaunay(delaunay: &Delaunay, u: &VertexVec<f64>) {
        let c = &delaunay.connectivity;
        c.validate().unwrap();
        for e in c.edges() {
            let h = c.edge_halfedge(e);
            let t = c.twin(h).unwrap();
            let cosine = |h| cosine(delaunay.log_sides(u, c.face(h)), (c.corner(h) + 2) % 3);
            assert!(c.face(h) == c.face(t) || cosine(h) + cosine(t) > -1e-6);
        }
    }

    #[test]
    fn every_scale_of_the_tiniest_surfaces_has_triangles() {
        let mut random = shapes::sequence(23);
        for (name, c) in tiny() {
            let chi = c.topology().euler_characteristic as f64;
            for _ in 0..40 {
                let length = lengths(&c, &mut random);
                let mut delaunay = Delaunay::new(c.clone(), &length, Vec::new());
                delaunay.flip_in_the_surface();
                for range in [1.0, 10.0, 300.0] {
                    let u = c
                        .vertices()
                        .map(|_| range * (2.0 * random() - 1.0))
                        .collect();
                    let mut shape = FaceVec::default();
                    delaunay.evaluate(&u, &mut shape);
                    assert_delaunay(&delaunay, &u);
                    let angles: f64 = shape.iter().flat_map(|s| s.angle).sum();
                    assert!(shape.iter().all(|s| !s.broken), "{name} at ±{range}");
                    let total = 2.0 * PI * c.vertex_count() as f64 - angles;
                    assert!((total - 2.0 * PI * chi).abs() < 1e-9, "{name}");
                }
            }
        }
    }

    #[test]
    fn flips_in_the_surface_keep_curvature_and_area() {
        let mut random = shapes::sequence(29);
        let tiny = tiny().into_iter().map(|(_, c)| {
            let length = lengths(&c, &mut random);
            (c, length)
        });
        let real = shapes::small()
            .into_iter()
            .filter(|s| s.connectivity.is_closed());
        let real = real.map(|s| (s.connectivity, s.length));
        let mut flips = 0;
        for (c, length) in tiny.chain(real).collect::<Vec<_>>() {
            let mut delaunay = Delaunay::new(c.clone(), &length, Vec::new());
            delaunay.flip_in_the_surface();
            flips += delaunay.flips;
            let after: EdgeVec<f64> = delaunay.log_lengths().iter().map(|l| l.exp()).collect();
            let before = curvature(&c, &length).unwrap();
            let now = curvature(&delaunay.connectivity, &after).unwrap();
            for (a, b) in before.iter().zip(now.iter()) {
                assert!((a - b).abs() < 1e-11);
            }
            let areas = [
                total_area(&c, &length),
                total_area(&delaunay.connectivity, &after),
            ];
            assert!((areas[0] / areas[1] - 1.0).abs() < 1e-12);
            assert_delaunay(&delaunay, &VertexVec::filled(0.0, c.vertex_count()));
        }
        assert!(flips > 20);
    }

    /// All its corners lie on a circle, so any triangulation of it is Delaunay; rounding must not choose another one for faces that are thin.
    #[test]
    fn the_fan_of_a_regular_polygon_stays() {
        for corners in [500, 4000, 60_000] {
            let at = |i: usize| {
                let (s, c) = (std::f64::consts::TAU * i as f64 / corners as f64).sin_cos();
                [c, s, 0.0]
            };
            let faces: Vec<[u32; 3]> = (2..corners as u32).map(|i| [0, i - 1, i]).collect();
            let c = Connectivity::from_faces(&faces, corners).unwrap();
            let length = c.edges().map(|e| {
                let [a, b] = c.edge_vertices(e).map(|v| at(v.index()));
                crate::geometry::mesh::distance(a, b)
            });
            let length: EdgeVec<f64> = length.collect();
            let mut delaunay = Delaunay::new(c, &length, Vec::new());
            delaunay.flip_in_the_surface();
            assert_eq!(delaunay.flips, 0, "{corners}");
        }
    }

    #[test]
    fn curvature_depends_on_u_alone_and_not_on_the_way_there() {
        let mut random = shapes::sequence(31);
        for shape in shapes::small() {
            if !shape.connectivity.is_closed() {
                continue;
            }
            let mut delaunay = Delaunay::new(shape.connectivity, &shape.length, Vec::new());
            delaunay.flip_in_the_surface();
            let mut copy = delaunay.clone();
            let mut direct = Metric::flipping(&mut copy);
            let mut roundabout = Metric::flipping(&mut delaunay);
            let n = direct.connectivity().vertex_count();
            let mut random_u = |range: f64| -> VertexVec<f64> {
                (0..n).map(|_| range * (2.0 * random() - 1.0)).collect()
            };
            let goal = random_u(2.0);
            let (mut one, mut other) = (Evaluation::default(), Evaluation::default());
            direct.evaluate(&goal, &mut one);
            for range in [1.0, 5.0, 20.0] {
                roundabout.evaluate(&random_u(range), &mut other);
            }
            // Half of the way taken into the lengths.
            let mut half: VertexVec<f64> = goal.iter().map(|u| 0.5 * u).collect();
            roundabout.rebase(&mut half);
            let rest = goal.iter().map(|u| 0.5 * u).collect();
            roundabout.evaluate(&rest, &mut other);
            assert!(roundabout.flips() > direct.flips());
            for (a, b) in one.curvature.iter().zip(other.curvature.iter()) {
                assert!((a - b).abs() < 1e-10, "{a} against {b}");
            }
        }
    }

    #[test]
    fn hessian_with_flips_agrees_with_finite_differences() {
        let shape = shapes::torus(9, 7);
        let mut delaunay = Delaunay::new(shape.connectivity, &shape.length, Vec::new());
        delaunay.flip_in_the_surface();
        let mut metric = Metric::flipping(&mut delaunay);
        let n = metric.connectivity().vertex_count();
        let mut random = shapes::sequence(37);
        let u: VertexVec<f64> = (0..n).map(|_| 2.0 * random() - 1.0).collect();
        let (mut up, mut down, mut now) = Default::default();
        for v in (0..n).step_by(5).map(VertexId::new) {
            let h = 1e-5;
            let mut moved = u.clone();
            moved[v] += h;
            metric.evaluate(&moved, &mut up);
            moved[v] -= 2.0 * h;
            metric.evaluate(&moved, &mut down);
            metric.evaluate(&u, &mut now);
            let weight = metric.edge_weights(&now);
            let mut unit = VertexVec::filled(0.0, n);
            unit[v] = 1.0;
            let exact = metric.apply_hessian(&weight, &unit);
            let scale = exact.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let _: &Evaluation = &now;
            for (w, entry) in exact.enumerate() {
                let difference = (up.curvature[w] - down.curvature[w]) / (2.0 * h);
                assert!(
                    (entry - difference).abs() < 1e-5 * scale,
                    "{entry} against {difference}"
                );
            }
        }
    }

    #[test]
    fn ptolemy_on_a_cocircular_quad_is_the_distance() {
        // Four points on a circle; both rules agree there.
        let points = [0.3_f64, 1.9, 3.0, 5.1].map(|t| [t.cos(), t.sin()]);
        let distance = |i: usize, j: usize| {
            let ([a, b], [c, d]) = (points[i], points[j]);
            (a - c).hypot(b - d).ln()
        };
        let by_rule = log_sum(
            distance(0, 1) + distance(2, 3),
            distance(1, 2) + distance(3, 0),
        ) - distance(0, 2);
        assert!((by_rule - distance(1, 3)).abs() < 1e-14);
        assert_eq!(log_sum(700.0, -700.0), 700.0);
        assert!((log_sum(900.0, 900.0) - 900.0 - 2.0_f64.ln()).abs() < 1e-12);
    }
}
