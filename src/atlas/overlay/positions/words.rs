//! Which edges of C a base edge crosses, and where, when both are drawn as geometry wants them in the faces of B.
//!
//! *Enters:* the points of A and of C on the edges of B. *Leaves:* for a base edge a list of crossings with places on both.
//! *Guaranteed:* for any coordinates the list is that of a curve on the surface that is homotopic to the base edge, so it
//! differs from the curve in minimal position by bigons only, those with a vertex as one end included.

use super::PositionsError;
use super::chords::{Anchor, ChordEnd, FaceChords, Met};
use super::crossed::{Crossed, twin};
use super::geodesic::{GeodesicPoint, Weights, on_shared_edge};
use super::straight::{StraightPoint, fraction};
use crate::flow::correspondence::Curves;
use crate::flow::intrinsic::Intrinsic;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, FaceId, HalfedgeId};

/// A base edge crosses an edge of C.
#[derive(Clone, Copy, Debug)]
pub(super) struct WordCrossing {
    /// The halfedge of C that is crossed, in the face that is left.
    pub halfedge: HalfedgeId,
    /// Fraction of the base edge.
    pub on_base: f64,
    /// Fraction of the flat edge, from the tail of its `edge_halfedge`.
    pub on_flat: f64,
}

/// Everything that lies on the edges of B.
pub(super) struct Drawing<'a> {
    pub intrinsic: &'a Intrinsic,
    /// A on B.
    pub base: &'a Curves,
    /// Where the crossings of `base` are.
    pub straight: Vec<StraightPoint>,
    /// For each crossing of `base`: number of points of C before it on the edge of B.
    pub before: Vec<u32>,
    /// B on C. Its crossings with one edge of B are the points of C on it, in order.
    pub delaunay: &'a Curves,
    /// Where the crossings of `delaunay` are.
    pub geodesic: Vec<GeodesicPoint>,
}

/// Lists that are used again for the next edge.
#[derive(Default)]
pub(super) struct Scratch {
    met: Vec<Met>,
}

/// A place on the border of a face of B.
#[derive(Clone, Copy)]
struct Place {
    end: ChordEnd,
    /// Weights of the three corners, sum 1.
    weights: [f64; 3],
    /// Fraction of the base edge.
    on_base: f64,
}

impl Drawing<'_> {
    /// For each crossing of A with an edge of B, the number of points of C before it: both lists are ordered on the
    /// edge, and are merged by place once for both faces. Places are made nondecreasing on the way.
    pub(super) fn merge(
        delaunay: &Connectivity,
        base_on: &Crossed,
        straight: &mut [StraightPoint],
        curves: &Curves,
        geodesic: &mut [GeodesicPoint],
    ) -> Vec<u32> {
        let mut before = vec![0; straight.len()];
        for e in delaunay.edges() {
            let points = &mut geodesic[curves.range(e)];
            let mut reached = 0.0f64;
            for point in points.iter_mut() {
                reached = reached.max(point.on_delaunay);
                point.on_delaunay = reached;
            }
            let (mut reached, mut passed) = (0.0f64, 0);
            for &i in base_on.on(e) {
                let point = &mut straight[i as usize];
                reached = reached.max(point.on_delaunay);
                point.on_delaunay = reached;
                while passed < points.len() && points[passed].on_delaunay < reached {
                    passed += 1;
                }
                before[i as usize] = passed as u32;
            }
        }
        before
    }

    /// Puts into `word` the crossings of base edge `e`, in order.
    pub(super) fn word(
        &self,
        e: EdgeId,
        scratch: &mut Scratch,
        word: &mut Vec<WordCrossing>,
    ) -> Result<(), PositionsError> {
        word.clear();
        let delaunay = &self.intrinsic.delaunay;
        if let Some(h) = self.base.coincident[e] {
            return self.along(h, word);
        }
        let range = self.base.range(e);
        let strip = &self.base.crossing[range.clone()];
        let (Some(start), Some(last)) = (strip.first(), strip.last()) else {
            return Err(PositionsError::Strip);
        };
        let mut from = corner_place(delaunay.corner(delaunay.prev(start.halfedge)), 0.0);
        for (i, x) in range.zip(strip) {
            self.chord(
                delaunay.face(x.halfedge),
                from,
                self.place(i, x.halfedge),
                scratch,
                word,
            )?;
            let beyond = twin(delaunay, x.halfedge)?;
            self.through(i, x.halfedge, word)?;
            from = self.place(i, beyond);
        }
        let last = twin(delaunay, last.halfedge)?;
        let to = corner_place(delaunay.corner(delaunay.prev(last)), 1.0);
        self.chord(delaunay.face(last), from, to, scratch, word)
    }

    /// The base edge is the halfedge `h` of B.
    fn along(&self, h: HalfedgeId, word: &mut Vec<WordCrossing>) -> Result<(), PositionsError> {
        let delaunay = &self.intrinsic.delaunay;
        let e = delaunay.edge(h);
        let points = self.delaunay.range(e);
        let forward = h == delaunay.edge_halfedge(e);
        for k in 0..points.len() {
            let j = if forward {
                points.start + k
            } else {
                points.end - 1 - k
            };
            let crossed = self.delaunay.crossing[j].halfedge;
            let (point, t) = (self.geodesic[j].weights, self.geodesic[j].on_delaunay);
            word.push(WordCrossing {
                halfedge: if forward {
                    crossed
                } else {
                    twin(&self.intrinsic.flat, crossed)?
                },
                on_base: if forward { t } else { 1.0 - t },
                on_flat: self.on_flat(self.intrinsic.flat.edge(crossed), point),
            });
        }
        Ok(())
    }

    /// Crossing `i` of A goes through the halfedge `x` of B, which may be an edge of C.
    fn through(
        &self,
        i: usize,
        x: HalfedgeId,
        word: &mut Vec<WordCrossing>,
    ) -> Result<(), PositionsError> {
        let (delaunay, flat) = (&self.intrinsic.delaunay, &self.intrinsic.flat);
        let e = delaunay.edge(x);
        let Some(same) = self.delaunay.coincident[e] else {
            return Ok(());
        };
        let c = flat.edge(same);
        let t = self.straight[i].on_delaunay;
        let forward = same == flat.edge_halfedge(c);
        let point = on_shared_edge(if forward { t } else { 1.0 - t });
        word.push(WordCrossing {
            halfedge: if x == delaunay.edge_halfedge(e) {
                same
            } else {
                twin(flat, same)?
            },
            on_base: self.straight[i].on_base,
            on_flat: self.on_flat(c, point),
        });
        Ok(())
    }

    /// The chord of A from `from` to `to` in a face of B.
    fn chord(
        &self,
        face: FaceId,
        from: Place,
        to: Place,
        scratch: &mut Scratch,
        word: &mut Vec<WordCrossing>,
    ) -> Result<(), PositionsError> {
        let (delaunay, flat) = (&self.intrinsic.delaunay, &self.intrinsic.flat);
        let sides = delaunay.face_halfedges(face);
        let on_side = sides.map(|h| self.delaunay.range(delaunay.edge(h)).len());
        if on_side == [0; 3] {
            return Ok(());
        }
        let chords = FaceChords::new(on_side).ok_or(PositionsError::Strip)?;
        chords.met(from.end, to.end, &mut scratch.met);
        for met in &scratch.met {
            let h = sides[met.anchor.side];
            let j = self.point(h, met.anchor.number);
            let crossed = self.delaunay.crossing[j].halfedge;
            let c = flat.edge(crossed);
            let run = flat.edge_halfedge(c);
            // Where B runs through a halfedge of C from its left to its right, that halfedge runs from the right of B to its left.
            let up = crossed == run;
            let enters = up == (h == delaunay.edge_halfedge(delaunay.edge(h)));
            let near = (self.weights_on(met.anchor, j, h), self.geodesic[j].weights);
            let far = match chords.other_end(met.anchor) {
                ChordEnd::Corner(k) => (
                    corner_weights(k),
                    if enters { Weights::HEAD } else { Weights::TAIL },
                ),
                ChordEnd::Side(anchor) => {
                    let h = sides[anchor.side];
                    let j = self.point(h, anchor.number);
                    (self.weights_on(anchor, j, h), self.geodesic[j].weights)
                }
            };
            let (x, y) = if enters { (near, far) } else { (far, near) };
            let (along_base, along_flat) = meet([from.weights, to.weights], [x.0, y.0]);
            let starts_left = enters == met.anchor_on_left;
            word.push(WordCrossing {
                halfedge: if starts_left { twin(flat, run)? } else { run },
                on_base: from.on_base + along_base * (to.on_base - from.on_base),
                on_flat: self.on_flat(c, Weights::between(x.1, y.1, along_flat)),
            });
        }
        Ok(())
    }

    /// Index of the point of C that is number `number` from the tail of the halfedge `h` of B.
    fn point(&self, h: HalfedgeId, number: usize) -> usize {
        let e = self.intrinsic.delaunay.edge(h);
        let points = self.delaunay.range(e);
        if h == self.intrinsic.delaunay.edge_halfedge(e) {
            points.start + number
        } else {
            points.end - 1 - number
        }
    }

    /// Weights of a point of C on the halfedge `h`.
    fn weights_on(&self, anchor: Anchor, point: usize, h: HalfedgeId) -> [f64; 3] {
        side_weights(
            anchor.side,
            self.seen_along(self.geodesic[point].on_delaunay, h),
        )
    }

    /// A fraction of an edge of B, counted from the tail of `h`.
    fn seen_along(&self, t: f64, h: HalfedgeId) -> f64 {
        let delaunay = &self.intrinsic.delaunay;
        if h == delaunay.edge_halfedge(delaunay.edge(h)) {
            t
        } else {
            1.0 - t
        }
    }

    /// Crossing `i` of A, seen in the face of the halfedge `h` of B.
    fn place(&self, i: usize, h: HalfedgeId) -> Place {
        let delaunay = &self.intrinsic.delaunay;
        let e = delaunay.edge(h);
        let side = delaunay.corner(h);
        let before = self.before[i] as usize;
        let number = if h == delaunay.edge_halfedge(e) {
            before
        } else {
            self.delaunay.range(e).len() - before
        };
        Place {
            end: ChordEnd::Side(Anchor { side, number }),
            weights: side_weights(side, self.seen_along(self.straight[i].on_delaunay, h)),
            on_base: self.straight[i].on_base,
        }
    }

    /// Fraction of the flat edge `c` from the tail of its halfedge.
    fn on_flat(&self, c: EdgeId, point: Weights) -> f64 {
        let [p, q] = self.intrinsic.flat.edge_vertices(c);
        point.on_flat(self.intrinsic.u[p], self.intrinsic.u[q])
    }
}

fn corner_weights(k: usize) -> [f64; 3] {
    let mut weights = [0.0; 3];
    weights[k] = 1.0;
    weights
}

fn side_weights(side: usize, t: f64) -> [f64; 3] {
    let mut weights = [0.0; 3];
    weights[side] = 1.0 - t;
    weights[(side + 1) % 3] = t;
    weights
}

fn corner_place(k: usize, on_base: f64) -> Place {
    Place {
        end: ChordEnd::Corner(k),
        weights: corner_weights(k),
        on_base,
    }
}

/// Where two segments meet, as fractions of both. Crossing is decided elsewhere: the answer is in [0, 1] in any case.
fn meet([p, q]: [[f64; 3]; 2], [x, y]: [[f64; 3]; 2]) -> (f64, f64) {
    let normal = |a: [f64; 3], b: [f64; 3]| {
        [0, 1, 2].map(|k| {
            let (j, m) = ((k + 1) % 3, (k + 2) % 3);
            a[j] * b[m] - a[m] * b[j]
        })
    };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (pq, xy) = (normal(p, q), normal(x, y));
    let (at_p, at_q) = (dot(xy, p), dot(xy, q));
    let (at_x, at_y) = (dot(pq, x), dot(pq, y));
    (fraction(at_p, at_p - at_q), fraction(at_x, at_x - at_y))
}
