//! Samples of a surface, and what they add up to.

use super::{Deviation, Triangles, corners};
use crate::geometry::mesh::triangle_area;
use crate::parallel;

/// Samples that are worked on in one go: neighbours on the surface, so that each search starts where the last one ended.
pub(super) const RUN: usize = 512;

/// What samples of one surface find on another, each for the area that it stands for.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct OneSided {
    area: f64,
    squares: f64,
    farthest: f64,
    angles: f64,
    largest_angle: f64,
}

impl OneSided {
    /// A sample: its distance, and the angle between the normals there.
    pub fn add(&mut self, area: f64, distance: f64, angle: f64) {
        self.area += area;
        self.squares += area * distance * distance;
        self.angles += area * angle;
        self.largest_angle = self.largest_angle.max(angle);
        self.reach(distance);
    }

    /// A distance that matters for the largest only.
    pub fn reach(&mut self, distance: f64) {
        self.farthest = self.farthest.max(distance);
    }

    /// Those of two parts of a surface.
    pub fn and(self, other: Self) -> Self {
        Self {
            area: self.area + other.area,
            squares: self.squares + other.squares,
            farthest: self.farthest.max(other.farthest),
            angles: self.angles + other.angles,
            largest_angle: self.largest_angle.max(other.largest_angle),
        }
    }

    /// What one surface's samples and the other's say together.
    pub fn together(self, other: Self) -> Deviation {
        let both = self.and(other);
        Deviation {
            rms: (both.squares / both.area).sqrt(),
            hausdorff: both.farthest,
            mean_normal_angle: both.angles / both.area,
            max_normal_angle: both.largest_angle,
        }
    }
}

/// Samples that are spread evenly over the area of a surface.
pub(crate) struct EvenSamples {
    /// Area of each face and all before it.
    up_to: Vec<f64>,
    count: usize,
}

impl EvenSamples {
    /// So many, one at the least; `None` where there is no area.
    pub fn new(surface: Triangles<'_>, count: usize) -> Option<Self> {
        let mut total = 0.0;
        let up_to: Vec<f64> = surface
            .faces
            .iter()
            .map(|&f| {
                total += triangle_area(corners(surface, f));
                total
            })
            .collect();
        (total > 0.0 && total.is_finite()).then(|| Self {
            up_to,
            count: count.max(1),
        })
    }

    /// What one sample stands for.
    pub fn area(&self) -> f64 {
        self.total() / self.count as f64
    }

    fn total(&self) -> f64 {
        self.up_to.last().copied().unwrap_or(0.0)
    }

    /// Adds up all samples: `visit` gets a face and the barycentric weights of a point in it, and what the sample before it left as a hint.
    pub fn sum<H: Default>(
        &self,
        visit: impl Fn(&mut OneSided, &mut H, usize, [f64; 3]) + Sync,
    ) -> OneSided {
        let runs = parallel::map_numbers(self.count.div_ceil(RUN), |run| {
            let range = run * RUN..self.count.min((run + 1) * RUN);
            let (mut sum, mut hint) = (OneSided::default(), H::default());
            let place = |i: usize| (i as f64 + 0.5) / self.count as f64 * self.total();
            let mut face = self.up_to.partition_point(|&x| x < place(range.start));
            for i in range {
                while face + 1 < self.up_to.len() && self.up_to[face] < place(i) {
                    face += 1;
                }
                let face = face.min(self.up_to.len() - 1);
                visit(&mut sum, &mut hint, face, weights(evenly(i)));
            }
            sum
        });
        runs.into_iter().fold(OneSided::default(), OneSided::and)
    }
}

/// The point of the unit square that belongs to a number: over many numbers evenly spread (the sequence R₂ of Roberts, 2018).
pub(crate) fn evenly(i: usize) -> [f64; 2] {
    /// Powers of the root of x³ = x + 1, inverted.
    const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    STEPS.map(|step| (0.5 + i as f64 * step).fract())
}

/// A point of the square as weights of the corners of a triangle, which keeps points even.
fn weights([r, s]: [f64; 2]) -> [f64; 3] {
    let r = r.sqrt();
    [1.0 - r, r * (1.0 - s), r * s]
}
