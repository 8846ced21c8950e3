//! Ambient occlusion in screen space: how much of the light from all around does each part of the picture get?
//!
//! Points nearby that stand above a point's tangent plane take light from it (McGuire et al., *The Alchemy Screen-Space Ambient Obscurance
//! Algorithm*, 2011). Computed on a coarser picture and interpolated.

use super::view::Vec3;
use crate::geometry::mesh::{dot, sub};
use rayon::prelude::*;

/// Pixels of the picture along a side of a texel.
pub const COARSER: usize = 4;
/// Points nearby that are looked at.
const NEARBY: usize = 24;
/// How far they are at the most, in sides of the picture.
const REACH: f64 = 0.11;
/// How strongly they darken.
const STRENGTH: f64 = 2.6;

/// Texels whose openness differs by less are not told apart.
const ALIKE: f32 = 0.012;

/// A point of the surface with its unit normal.
pub type Point = (Vec3, Vec3);

/// The points that are seen and how open they are.
#[derive(Default)]
pub struct Ambient {
    side: usize,
    points: Vec<Option<Point>>,
    /// Not a number where nothing is seen.
    open: Vec<f32>,
    reach: f64,
}

impl Ambient {
    /// `points` row by row, `reach` source units along [`REACH`] of a side.
    pub fn new(points: Vec<Option<Point>>, side: usize, picture: f64) -> Ambient {
        let mut ambient = Ambient {
            side,
            points,
            open: Vec::new(),
            reach: REACH * picture,
        };
        // A spiral, denser towards its middle.
        let spiral: [[f64; 2]; NEARBY] = std::array::from_fn(|k| {
            let distance = (k as f64 + 0.5) / NEARBY as f64;
            let (s, c) = (2.4 * k as f64).sin_cos();
            [c, s].map(|x| REACH * side as f64 * distance * x)
        });
        let texels = (0..side * side).into_par_iter();
        ambient.open = texels.map(|at| ambient.openness(at, &spiral)).collect();
        ambient
    }

    fn openness(&self, at: usize, spiral: &[[f64; 2]]) -> f32 {
        let Some((p, n)) = self.points[at] else {
            return f32::NAN;
        };
        let (x, y) = ((at % self.side) as f64 + 0.5, (at / self.side) as f64 + 0.5);
        let hidden = |[dx, dy]: &[f64; 2]| {
            let (q, _) = self.point((x + dx) as i64, (y + dy) as i64)?;
            let away = sub(q, p);
            let above = dot(away, n) - 0.01 * self.reach;
            if above <= 0.0 {
                return None;
            }
            let away = dot(away, away);
            let fade = 1.0 - away / (self.reach * self.reach);
            (fade > 0.0).then(|| fade * above / away.sqrt())
        };
        let sum: f64 = spiral.iter().filter_map(hidden).sum();
        (1.0 - STRENGTH * sum / NEARBY as f64).max(0.0) as f32
    }

    /// Number of a texel that the picture has.
    fn texel(&self, column: i64, row: i64) -> Option<usize> {
        let side = 0..self.side as i64;
        let inside = side.contains(&column) && side.contains(&row);
        inside.then(|| row as usize * self.side + column as usize)
    }

    fn point(&self, column: i64, row: i64) -> Option<Point> {
        self.points[self.texel(column, row)?]
    }

    /// How open a point is that is seen at a place of the picture: the mean of what is near it there and on its tangent plane. `point` is
    /// asked for only where what is near is not alike.
    pub fn at(&self, place: [f64; 2], point: impl FnOnce() -> Point) -> f32 {
        let (x, y) = (
            place[0] / COARSER as f64 + 0.5,
            place[1] / COARSER as f64 + 0.5,
        );
        // Truncated, which is quicker than rounded down: places are not negative. Of the texels around, this is the last one.
        let (column, row) = (x as usize, y as usize);
        let (fx, fy) = (x - column as f64, y - row as f64);
        let weight = [
            (1.0 - fx) * (1.0 - fy),
            fx * (1.0 - fy),
            (1.0 - fx) * fy,
            fx * fy,
        ];
        if (1..self.side).contains(&column) && (1..self.side).contains(&row) {
            let last = row * self.side + column;
            let first = last - self.side - 1;
            let open = &self.open;
            let [a, b, c, d] = [open[first], open[first + 1], open[last - 1], open[last]];
            // False where one is not a number.
            if (b - a).abs() < ALIKE && (c - a).abs() < ALIKE && (d - a).abs() < ALIKE {
                let [_, of_b, of_c, of_d] = weight;
                let mean = of_b * f64::from(b - a) + of_c * f64::from(c - a);
                return (f64::from(a) + mean + of_d * f64::from(d - a)) as f32;
            }
        }
        let (p, n) = point();
        let (mut sum, mut whole) = (0.0, 0.0);
        for (k, share) in weight.into_iter().enumerate() {
            let at = self.texel((column + k % 2) as i64 - 1, (row + k / 2) as i64 - 1);
            if let Some((at, (q, m))) = at.and_then(|at| Some((at, self.points[at]?))) {
                let off = dot(sub(q, p), n).abs() / (0.1 * self.reach);
                let alike = (1.0 - off).max(0.0) * dot(m, n).max(0.0) + 1e-4;
                let weight = share * alike;
                sum += weight * f64::from(self.open[at]);
                whole += weight;
            }
        }
        if whole > 0.0 {
            (sum / whole) as f32
        } else {
            1.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane, and to the right a step above it.
    #[test]
    fn a_step_darkens_what_is_below_it() {
        let point = |at: usize| {
            let height = if at % 64 < 32 { 0.0 } else { 2.0 };
            let place = [(at % 64) as f64, (at / 64) as f64, height];
            (at / 64 < 60).then_some((place, [0.0, 0.0, 1.0]))
        };
        let points: Vec<_> = (0..64 * 64).map(point).collect();
        let ambient = Ambient::new(points.clone(), 64, 64.0);
        let open = |column: usize| {
            let place = [column, 30].map(|x| (COARSER * x) as f64 + 0.5 * COARSER as f64);
            points[30 * 64 + column].map(|point| ambient.at(place, || point))
        };
        assert_eq!([open(10), open(50)], [Some(1.0); 2]);
        assert!(
            open(30) < Some(0.9) && open(34) == Some(1.0),
            "{:?}",
            open(30)
        );
    }
}
