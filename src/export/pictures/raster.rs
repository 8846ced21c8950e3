//! Which triangle does a sample see? Scan conversion with a depth buffer; shading comes later.
//!
//! A pixel has [`SAMPLES`] samples, one in each of as many rows, at staggered columns, so that nearly upright and nearly level edges get as
//! many shades as there are samples. Rows are rows of samples, columns are columns of pixels.

use crate::geometry::mesh::sub;
use std::ops::Range;

/// Samples of a pixel.
pub const SAMPLES: usize = 4;
/// Where the samples of a pixel lie between its left and its right.
const COLUMNS: [f64; SAMPLES] = [0.375, 0.875, 0.125, 0.625];
/// What stands where nothing is seen.
pub const NOTHING: u32 = u32::MAX;

/// Where a sample lies, in pixels.
pub fn place(column: usize, row: usize) -> [f64; 2] {
    let y = (row as f64 + 0.5) / SAMPLES as f64;
    [column as f64 + COLUMNS[row % SAMPLES], y]
}

/// A point of the screen for a picture of one sample a pixel, whose rows of samples are rows of pixels.
pub fn sparse([x, y, near]: [f64; 3]) -> [f64; 3] {
    [x, y / SAMPLES as f64, near]
}

/// Rounds up; below 0 it is 0. A cast, since the library's function is a call on older processors, and to a signed number, which is quicker.
#[inline]
fn up(x: f64) -> usize {
    let whole = x as i32;
    whole.max(0) as usize + usize::from(f64::from(whole) < x)
}

/// The first row of samples at or below a height in pixels.
#[inline]
pub fn row_at(y: f64) -> usize {
    up(y * SAMPLES as f64 - 0.5)
}

/// The columns of a row whose samples lie from `low` up to `high`.
#[inline]
fn columns(row: usize, low: f64, high: f64, width: usize) -> Range<usize> {
    let shift = COLUMNS[row % SAMPLES];
    up(low - shift)..up(high - shift).min(width)
}

/// Calls `visit(row, columns)` for every row of a triangle given in pixels, whichever way it is turned. A sample on the common edge of two
/// triangles belongs to exactly one of them.
pub fn covered(
    corners: [[f64; 2]; 3],
    width: usize,
    rows: Range<usize>,
    mut visit: impl FnMut(usize, Range<usize>),
) {
    if corners.iter().flatten().any(|x| !x.is_finite()) {
        return;
    }
    // From top to bottom, so that an edge has the same numbers in both of its triangles.
    let [mut a, mut b, mut c] = corners;
    if b[1] < a[1] {
        std::mem::swap(&mut a, &mut b);
    }
    if c[1] < b[1] {
        std::mem::swap(&mut b, &mut c);
        if b[1] < a[1] {
            std::mem::swap(&mut a, &mut b);
        }
    }
    let (first, middle) = (row_at(a[1]).max(rows.start), row_at(b[1]));
    let end = row_at(c[1]).min(rows.end);
    if first >= end {
        return;
    }
    let (long, upper, lower) = (Side::new(a, c), Side::new(a, b), Side::new(b, c));
    for row in first..end {
        let y = (row as f64 + 0.5) / SAMPLES as f64;
        let (long, short) = (
            long.crossing(y),
            match row < middle {
                true => upper.crossing(y),
                false => lower.crossing(y),
            },
        );
        let columns = columns(row, long.min(short), long.max(short), width);
        if !columns.is_empty() {
            visit(row, columns);
        }
    }
}

/// A side of a triangle from its upper end to its lower one.
struct Side {
    from: [f64; 2],
    /// Columns a row.
    slope: f64,
    /// What its columns are held to.
    low: f64,
    high: f64,
}

impl Side {
    fn new(p: [f64; 2], q: [f64; 2]) -> Side {
        Side {
            from: p,
            slope: (q[0] - p[0]) / (q[1] - p[1]),
            low: p[0].min(q[0]),
            high: p[0].max(q[0]),
        }
    }

    /// Its column at a height.
    #[inline]
    fn crossing(&self, y: f64) -> f64 {
        let x = self.from[0] + self.slope * (y - self.from[1]);
        x.max(self.low).min(self.high)
    }
}

/// Calls `visit(column, row, t, d²)` for every sample at most `radius` away from a segment, all in pixels: `t` from 0 to 1 says where on the
/// segment the nearest point lies, `d²` is the squared distance from it.
pub fn stroked(
    [a, b]: [[f64; 2]; 2],
    radius: f64,
    width: usize,
    rows: Range<usize>,
    mut visit: impl FnMut(usize, usize, f64, f64),
) {
    if !a.iter().chain(&b).all(|x| x.is_finite()) {
        return;
    }
    let axis = [b[0] - a[0], b[1] - a[1]];
    let length2 = axis[0] * axis[0] + axis[1] * axis[1];
    let top = row_at(a[1].min(b[1]) - radius).max(rows.start);
    for row in top..row_at(a[1].max(b[1]) + radius).min(rows.end) {
        // The part of the segment that is near this row.
        let y = (row as f64 + 0.5) / SAMPLES as f64;
        let (at, half) = ((y - a[1]) / axis[1], radius / axis[1].abs());
        let ends = match half.is_finite() {
            true => [at - half, at + half].map(|t| a[0] + axis[0] * t.clamp(0.0, 1.0)),
            false => [a[0], b[0]],
        };
        let low = ends[0].min(ends[1]) - radius;
        for column in columns(row, low, ends[0].max(ends[1]) + radius, width) {
            let [x, y] = place(column, row);
            let d = [x - a[0], y - a[1]];
            let along = d[0] * axis[0] + d[1] * axis[1];
            let t = if along > 0.0 {
                (along / length2).min(1.0)
            } else {
                0.0
            };
            let off = [d[0] - t * axis[0], d[1] - t * axis[1]];
            let d2 = off[0] * off[0] + off[1] * off[1];
            if d2 <= radius * radius {
                visit(column, row, t, d2);
            }
        }
    }
}

/// The nearest object at every sample of some rows.
pub struct Band {
    width: usize,
    /// First row.
    top: usize,
    /// The nearest objects, row by row, …
    objects: Vec<u32>,
    /// … and their closeness.
    near: Vec<f32>,
}

impl Band {
    /// Nothing drawn yet.
    pub fn new(width: usize, rows: Range<usize>) -> Band {
        let count = width * rows.len();
        Band {
            width,
            top: rows.start,
            objects: vec![NOTHING; count],
            near: vec![f32::NEG_INFINITY; count],
        }
    }

    /// Faces on the screen, each with its number.
    pub fn of(width: usize, rows: Range<usize>, faces: &[[u32; 3]], screen: &[[f64; 3]]) -> Band {
        let mut band = Band::new(width, rows);
        for (number, face) in (0..).zip(faces) {
            band.draw(&face.map(|v| screen[v as usize]), number);
        }
        band
    }

    /// Its rows.
    fn rows(&self) -> Range<usize> {
        self.top..self.top + self.objects.len() / self.width.max(1)
    }

    /// Draws a triangle of column, row (in pixels) and closeness. Closeness must be linear on the screen: 1 / depth under perspective, −depth
    /// without. Of equally close ones the first stays.
    pub fn draw(&mut self, triangle: &[[f64; 3]; 3], object: u32) {
        let (width, top, rows) = (self.width, self.top, self.rows());
        let [a, b, c] = triangle;
        let (ab, ac) = (sub(*b, *a), sub(*c, *a));
        let area = ab[0] * ac[1] - ab[1] * ac[0];
        let slope = [
            (ab[2] * ac[1] - ac[2] * ab[1]) / area,
            (ac[2] * ab[0] - ab[2] * ac[0]) / area,
        ];
        // Triangles seen edge-on have no slope.
        let (low, high) = (a[2].min(b[2]).min(c[2]), a[2].max(b[2]).max(c[2]));
        let (step, low_end, high_end) = (slope[0] as f32, low as f32, high as f32);
        covered(
            [[a[0], a[1]], [b[0], b[1]], [c[0], c[1]]],
            width,
            rows,
            |row, columns| {
                let [x, y] = place(columns.start, row);
                let first = a[2] + slope[0] * (x - a[0]) + slope[1] * (y - a[1]);
                let first = first.max(low).min(high) as f32;
                let at = (row - top) * width;
                let span = at + columns.start..at + columns.end;
                let samples = self.near[span.clone()].iter_mut();
                for (k, (near, seen)) in (0_u16..).zip(samples.zip(&mut self.objects[span])) {
                    let new = (first + step * f32::from(k)).max(low_end).min(high_end);
                    let is_nearer = new > *near;
                    *seen = if is_nearer { object } else { *seen };
                    *near = if is_nearer { new } else { *near };
                }
            },
        );
    }

    /// Draws a ball, or a round bar with round ends, by the ends of its axis and its radius; `bulge` is the closeness relative to the axis of
    /// what is a pixel nearer.
    pub fn draw_bar(&mut self, [a, b]: [[f64; 3]; 2], radius: f64, bulge: f64, object: u32) {
        let (width, top, rows) = (self.width, self.top, self.rows());
        let axis = [a, b].map(|p| [p[0], p[1]]);
        stroked(axis, radius, width, rows, |column, row, t, d2| {
            let near = a[2] + t * (b[2] - a[2]);
            let near = near * (1.0 + bulge * (radius * radius - d2).max(0.0).sqrt());
            let at = (row - top) * width + column;
            if near as f32 > self.near[at] {
                (self.objects[at], self.near[at]) = (object, near as f32);
            }
        });
    }

    /// What is seen at each sample, row by row; [`NOTHING`] where nothing is.
    pub fn objects(&self) -> &[u32] {
        &self.objects
    }

    /// What is seen at a sample, and its closeness.
    pub fn seen(&self, column: usize, row: usize) -> (u32, f32) {
        let at = (row - self.top) * self.width + column;
        (self.objects[at], self.near[at])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fan of triangles around a point must cover every sample of its hull once.
    #[test]
    fn triangles_that_share_edges_share_no_sample() {
        let rim = [
            [1.0, 1.5],
            [9.5, 0.5],
            [18.5, 2.5],
            [19.5, 10.5],
            [15.5, 19.5],
            [4.5, 17.5],
        ];
        // The centre lies on a sample.
        let centre = place(9, 38);
        let mut count = vec![0; 20 * 80];
        for k in 0..rim.len() {
            let corner = |k: usize| rim[k % 6];
            // Every second one is turned the other way round.
            let (a, b) = if k % 2 == 0 { (k, k + 1) } else { (k + 1, k) };
            covered([centre, corner(a), corner(b)], 20, 0..80, |row, columns| {
                columns.for_each(|column| count[20 * row + column] += 1);
            });
        }
        assert!(count.iter().all(|&c| c <= 1));
        let inside = (12..60).flat_map(|y| (5..15).map(move |x| (x, y)));
        for (x, y) in inside {
            assert_eq!(count[20 * y + x], 1, "at {x}, {y}");
        }
    }

    #[test]
    fn the_nearer_triangle_wins_in_any_order() {
        let big = |near: f64| [[0.0, 0.0, near], [40.0, 0.0, near], [0.0, 40.0, near]];
        for order in [[0, 1], [1, 0]] {
            let mut band = Band::new(10, 0..40);
            for object in order {
                band.draw(&big(1.0 + f64::from(object)), object);
            }
            assert_eq!(band.seen(3, 12), (1, 2.0));
        }
    }

    #[test]
    fn what_cannot_be_drawn_is_left_out() {
        let mut band = Band::new(10, 20..40);
        band.draw(
            &[[f64::NAN, 0.0, 1.0], [9.0, 0.0, 1.0], [0.0, 90.0, 1.0]],
            0,
        );
        band.draw(&[[0.0, 0.0, 1.0], [5.0, 5.0, 1.0], [9.0, 9.0, 1.0]], 1);
        band.draw(
            &[[-1e300, -1e300, 1.0], [-1e299, 0.0, 1.0], [-9.0, 9.0, 1.0]],
            2,
        );
        band.draw_bar([[f64::NAN, 7.0, 1.0], [5.0, 7.0, 1.0]], 3.0, 0.1, 3);
        band.draw_bar([[-1e300, -9.0, 1.0], [1e300, -9.0, 1.0]], 3.0, 0.1, 4);
        for row in 20..40 {
            for column in 0..10 {
                assert_eq!(band.seen(column, row).0, NOTHING);
            }
        }
    }
}
