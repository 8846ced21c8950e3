//! Seams as chains of chosen points, and the borders of patches made of them.
//!
//! A point of a chain is a sample of its seam or lies between two: there the surface is straight, so it is on the surface too.

use super::border::Side;
use super::frame::Frame;
use crate::atlas::patches::Seam;
use crate::atlas::plane;
use crate::geometry::mesh::{self, distance_to_segment};

/// A point of a seam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    /// The last sample that is not beyond it.
    pub sample: usize,
    /// Part of the way to the next sample, in [0, 1).
    pub fraction: f64,
    /// In space.
    pub position: [f64; 3],
    /// In the left and the right patch.
    pub uv: [[f64; 2]; 2],
    /// The same in texels.
    pub texel: [[f64; 2]; 2],
}

/// A seam with the points that stand for it: the first and the last sample, and some between.
pub(super) struct Chain<'a> {
    seam: &'a Seam,
    /// Samples in texels of the left and the right patch.
    texel: Vec<[[f64; 2]; 2]>,
    /// Length from the first sample, in texels of the finer side.
    along: Vec<f64>,
    /// Sides that are patches: 1 at the surface's boundary.
    sides: usize,
    pub points: Vec<Point>,
}

/// How far the samples between two points are from the straight line between these.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Deviation {
    /// In texels, on the worse side.
    pub plane: f64,
    /// In space, relative to the line's length.
    pub space: f64,
    /// The sample that is farthest in the plane, where there is any.
    pub farthest: Option<usize>,
    /// The sample that is farthest in space.
    pub farthest_in_space: Option<usize>,
}

/// The border of a patch.
#[derive(Clone, Debug, Default)]
pub(super) struct Polygon {
    /// Vertices in patch coordinates, counterclockwise.
    pub uv: Vec<[f64; 2]>,
    /// The same in texels.
    pub texel: Vec<[f64; 2]>,
    /// Seam and point of every vertex.
    pub point: Vec<(usize, usize)>,
    /// Seam and number of the chord from every vertex to the next; chord i of a chain begins at its point i.
    pub chord: Vec<(usize, usize)>,
}

impl<'a> Chain<'a> {
    /// A seam with its ends only. The frames of its patches must be there.
    pub fn new(seam: &'a Seam, frames: &[Frame]) -> Self {
        let left = &frames[seam.left.index()];
        let right = seam.right.map(|p| &frames[p.index()]);
        let texel: Vec<[[f64; 2]; 2]> = seam
            .samples
            .iter()
            .map(|s| {
                [
                    left.texel(s.left),
                    right.map_or([f64::NAN; 2], |r| r.texel(s.right)),
                ]
            })
            .collect();
        let sides = 1 + usize::from(right.is_some());
        let mut along = vec![0.0];
        for pair in texel.windows(2) {
            let length = (0..sides).map(|i| plane::distance(pair[0][i], pair[1][i]));
            along.push(along[along.len() - 1] + length.fold(0.0, f64::max));
        }
        let mut chain = Self {
            seam,
            texel,
            along,
            sides,
            points: Vec::new(),
        };
        chain.points = vec![chain.sample(0), chain.sample(seam.samples.len() - 1)];
        chain
    }

    /// The point at a sample.
    pub fn sample(&self, i: usize) -> Point {
        let sample = &self.seam.samples[i];
        Point {
            sample: i,
            fraction: 0.0,
            position: sample.position,
            uv: [sample.left, sample.right],
            texel: self.texel[i],
        }
    }

    /// Texels of the finer side from the first sample on, along the seam.
    fn place(&self, p: &Point) -> f64 {
        let next = (p.sample + 1).min(self.along.len() - 1);
        let (a, b) = (self.along[p.sample], self.along[next]);
        a + p.fraction * (b - a)
    }

    /// Texels of the finer side between two points, along the seam.
    pub fn along(&self, a: &Point, b: &Point) -> f64 {
        self.place(b) - self.place(a)
    }

    /// Texels of the finer side between two points, straight.
    pub fn length(&self, a: &Point, b: &Point) -> f64 {
        let sides = (0..self.sides).map(|i| plane::distance(a.texel[i], b.texel[i]));
        sides.fold(0.0, f64::max)
    }

    /// Samples strictly between two points.
    fn between(&self, a: &Point, b: &Point) -> std::ops::Range<usize> {
        let end = b.sample + usize::from(b.fraction > 0.0);
        a.sample + 1..end.max(a.sample + 1)
    }

    pub fn deviation(&self, a: &Point, b: &Point) -> Deviation {
        let mut worst = Deviation::default();
        let length = mesh::distance(a.position, b.position);
        let mut farthest = 0.0;
        for i in self.between(a, b) {
            let sides = (0..self.sides)
                .map(|k| distance_to_segment(self.texel[i][k], a.texel[k], b.texel[k]));
            let plane = sides.fold(0.0, f64::max);
            if plane > worst.plane || worst.farthest.is_none() {
                worst.plane = plane;
                worst.farthest = Some(i);
            }
            let p = self.seam.samples[i].position;
            let space = distance_to_segment(p, a.position, b.position);
            if space > farthest || worst.farthest_in_space.is_none() {
                farthest = space;
                worst.farthest_in_space = Some(i);
            }
        }
        if farthest > 0.0 {
            worst.space = farthest / length;
        }
        worst
    }

    /// The middle between two points along the seam: a sample where one lies in the middle part, and else a point between two.
    pub fn middle(&self, a: &Point, b: &Point) -> Option<Point> {
        const MIDDLE_PART: f64 = 0.3;
        let (from, to) = (self.place(a), self.place(b));
        let middle = 0.5 * (from + to);
        let samples = self.between(a, b);
        let off = |i: usize| (self.along[i] - middle).abs();
        let nearest = samples.min_by(|&i, &j| off(i).total_cmp(&off(j)));
        if let Some(i) = nearest.filter(|&i| off(i) <= (0.5 - MIDDLE_PART) * (to - from)) {
            return Some(self.sample(i));
        }
        let (i, fraction) = match nearest {
            // Both on one straight piece.
            None => {
                let end = if b.sample > a.sample { 1.0 } else { b.fraction };
                (a.sample, 0.5 * (a.fraction + end))
            }
            Some(sample) => {
                // The last sample that is not beyond the middle.
                let i = self
                    .along
                    .partition_point(|&x| x <= middle)
                    .checked_sub(1)?;
                let (start, end) = (self.along[i], *self.along.get(i + 1)?);
                let fraction = (middle - start) / (end - start);
                if !(fraction > 0.0 && fraction < 1.0) {
                    return Some(self.sample(sample));
                }
                (i, fraction)
            }
        };
        let place = (i, fraction);
        let is_between = place > (a.sample, a.fraction) && place < (b.sample, b.fraction);
        is_between.then(|| self.interpolate(i, fraction))
    }

    fn interpolate(&self, i: usize, fraction: f64) -> Point {
        fn mix<const N: usize>(a: [f64; N], b: [f64; N], t: f64) -> [f64; N] {
            std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
        }
        let (a, b) = (self.sample(i), self.sample(i + 1));
        Point {
            sample: i,
            fraction,
            position: mix(a.position, b.position, fraction),
            uv: [0, 1].map(|k| mix(a.uv[k], b.uv[k], fraction)),
            texel: [0, 1].map(|k| mix(a.texel[k], b.texel[k], fraction)),
        }
    }

    /// Puts one more point on each of these chords (ascending); false where there is none to put on any.
    pub fn split(
        &mut self,
        chords: &[usize],
        at: impl Fn(&Self, &Point, &Point) -> Option<Point>,
    ) -> bool {
        let mut points = Vec::with_capacity(self.points.len() + chords.len());
        let mut flagged = chords.iter().copied().peekable();
        let mut any = false;
        for (i, &point) in self.points.iter().enumerate() {
            points.push(point);
            if flagged.next_if_eq(&i).is_some()
                && let Some(next) = self.points.get(i + 1)
                && let Some(new) = at(self, &point, next)
            {
                points.push(new);
                any = true;
            }
        }
        self.points = points;
        any
    }
}

/// The polygon of a border.
pub(super) fn polygon(border: &[Side], chains: &[Chain]) -> Polygon {
    let mut polygon = Polygon::default();
    for side in border {
        let points = &chains[side.seam].points;
        let chords = points.len() - 1;
        let k = usize::from(side.is_right);
        for i in 0..chords {
            let (at, chord) = match side.is_right {
                false => (i, i),
                true => (chords - i, chords - i - 1),
            };
            polygon.uv.push(points[at].uv[k]);
            polygon.texel.push(points[at].texel[k]);
            polygon.point.push((side.seam, at));
            polygon.chord.push((side.seam, chord));
        }
    }
    polygon
}
