//! Which triangle does a sample see? A depth-buffered rasteriser that leaves shading for later.

use std::ops::Range;

/// What stands where no triangle is seen.
pub const NOTHING: u32 = u32::MAX;

/// A triangle on the screen: column, row, and closeness (larger is nearer) at each corner.
///
/// Closeness must be linear on the screen: 1 / depth under perspective, −depth without.
pub type ScreenTriangle = [[f64; 3]; 3];

/// The nearest triangle at every sample of some rows of the screen.
pub struct Band {
    width: usize,
    /// First row.
    top: usize,
    closeness: Vec<f32>,
    object: Vec<u32>,
}

impl Band {
    /// Rows `top..top + rows`, nothing drawn yet.
    pub fn new(width: usize, top: usize, rows: usize) -> Band {
        Band {
            width,
            top,
            closeness: vec![f32::NEG_INFINITY; width * rows],
            object: vec![NOTHING; width * rows],
        }
    }

    /// Draws a triangle, whichever way it is turned. Of equally close ones the first stays.
    pub fn draw(&mut self, triangle: &ScreenTriangle, object: u32) {
        let rows = self.object.len() / self.width.max(1);
        let (top, width) = (self.top, self.width);
        covered(
            triangle,
            [width, top + rows],
            top,
            |column, row, weights| {
                let near = (0..3).map(|k| weights[k] * triangle[k][2]).sum::<f64>() as f32;
                let at = (row - top) * width + column;
                if near > self.closeness[at] {
                    self.closeness[at] = near;
                    self.object[at] = object;
                }
            },
        );
    }

    /// The triangle seen at a sample, [`NOTHING`] where none is.
    pub fn object(&self, column: usize, row: usize) -> u32 {
        self.object[(row - self.top) * self.width + column]
    }

    /// Closeness of what is seen, −∞ where nothing is.
    pub fn closeness(&self, column: usize, row: usize) -> f32 {
        self.closeness[(row - self.top) * self.width + column]
    }
}

/// Calls `visit(column, row, weights)` for every sample (the centre of a cell of the grid) inside a triangle; weights sum to 1.
/// A sample on the common edge of two triangles belongs to exactly one of them.
/// `end` holds the columns and the row after the last, `top` is the first row.
pub fn covered(
    triangle: &ScreenTriangle,
    end: [usize; 2],
    top: usize,
    mut visit: impl FnMut(usize, usize, [f64; 3]),
) {
    if triangle.iter().flatten().any(|x| !x.is_finite()) {
        return;
    }
    let [a, b, c] = triangle;
    let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if area == 0.0 {
        return;
    }
    let range = |axis: usize, first: usize, end: usize| {
        let low = a[axis].min(b[axis]).min(c[axis]);
        let high = a[axis].max(b[axis]).max(c[axis]);
        // Rounded up and down by casts, which saturate; the library's functions are calls on older processors.
        let low = (low - 0.5).max(first as f64);
        let from = low as usize + usize::from((low as usize as f64) < low);
        let high = high - 0.5;
        let to = if high < 0.0 {
            0
        } else {
            (high as usize).saturating_add(1).min(end)
        };
        from..to
    };
    let columns = range(0, 0, end[0]);
    let rows = range(1, top, end[1]);
    // Most faces of a fine mesh lie between samples.
    if columns.is_empty() || rows.is_empty() {
        return;
    }
    let sides = [(b, c), (c, a), (a, b)].map(|(from, to)| Side::new(from, to, area));
    for row in rows {
        let y = row as f64 + 0.5;
        let rises = sides
            .each_ref()
            .map(|side| side.run[0] * (y - side.from[1]));
        let mut entered = false;
        for column in between(&columns, &sides, &rises) {
            let x = column as f64 + 0.5;
            let parts = [0, 1, 2].map(|k| sides[k].part(x, rises[k]));
            if let [Some(x), Some(y), Some(z)] = parts {
                entered = true;
                let sum = x + y + z;
                if sum > 0.0 {
                    visit(column, row, [x / sum, y / sum, z / sum]);
                }
            } else if entered {
                // A row of a convex shape is left once.
                break;
            }
        }
    }
}

/// The columns of a row that may lie inside: where the sides meet the row, and a sample more at both ends, so that [`Side::part`] alone
/// decides. Walking over the whole box of a long thin triangle takes as long as filling it.
fn between(columns: &Range<usize>, sides: &[Side; 3], rises: &[f64; 3]) -> Range<usize> {
    let (mut low, mut high) = (columns.start as f64, columns.end as f64);
    for (side, &rise) in sides.iter().zip(rises) {
        let along = rise / side.run[1];
        if !along.is_finite() {
            continue;
        }
        let column = side.from[0] + along - 0.5;
        let slack = 1.0 + 1e-12 * (along.abs() + side.from[0].abs());
        // The distance falls from left to right where the side rises.
        match side.inward_is_positive == (side.run[1] > 0.0) {
            true => high = high.min(column + slack + 1.0),
            false => low = low.max(column - slack),
        }
    }
    // Casts saturate.
    low as usize..high as usize
}

/// The line through two corners of a triangle.
///
/// It runs from the lower end whichever way the edge does, so that both triangles at an edge get the same
/// numbers, and a sample exactly on it goes to the one whose side counts as positive.
struct Side {
    from: [f64; 2],
    run: [f64; 2],
    inward_is_positive: bool,
}

impl Side {
    fn new(a: &[f64; 3], b: &[f64; 3], area: f64) -> Side {
        let swapped = (a[0], a[1]) > (b[0], b[1]);
        let (from, to) = if swapped { (b, a) } else { (a, b) };
        Side {
            from: [from[0], from[1]],
            run: [to[0] - from[0], to[1] - from[1]],
            inward_is_positive: (area > 0.0) != swapped,
        }
    }

    /// Distance of a sample from the line times the side's length, where it lies on the triangle's side of it.
    /// `rise` is the row's part of the cross product.
    #[inline]
    fn part(&self, x: f64, rise: f64) -> Option<f64> {
        let cross = rise - self.run[1] * (x - self.from[0]);
        if self.inward_is_positive {
            (cross >= 0.0).then_some(cross)
        } else {
            (cross < 0.0).then_some(-cross)
        }
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
        // The centre lies on a sample, and so do many edges.
        let centre = [9.5, 9.5, 1.0];
        let mut count = vec![0; 400];
        for k in 0..rim.len() {
            let corner = |k: usize| [rim[k % 6][0], rim[k % 6][1], 1.0];
            // Every second one is turned the other way round.
            let (a, b) = if k % 2 == 0 { (k, k + 1) } else { (k + 1, k) };
            covered(&[centre, corner(a), corner(b)], [20, 20], 0, |x, y, w| {
                assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                count[20 * y + x] += 1;
            });
        }
        assert!(count.iter().all(|&c| c <= 1));
        let inside = (3..15).flat_map(|y| (5..15).map(move |x| (x, y)));
        for (x, y) in inside {
            assert_eq!(count[20 * y + x], 1, "at {x}, {y}");
        }
    }

    #[test]
    fn the_nearer_triangle_wins_in_any_order() {
        let big = |near: f64| [[0.0, 0.0, near], [40.0, 0.0, near], [0.0, 40.0, near]];
        for order in [[0, 1], [1, 0]] {
            let mut band = Band::new(10, 0, 10);
            for object in order {
                band.draw(&big(1.0 + f64::from(object)), object);
            }
            assert_eq!(band.object(3, 3), 1);
            assert_eq!(band.closeness(3, 3), 2.0);
        }
    }

    #[test]
    fn what_cannot_be_drawn_is_left_out() {
        let mut band = Band::new(10, 5, 5);
        band.draw(
            &[[f64::NAN, 0.0, 1.0], [9.0, 0.0, 1.0], [0.0, 90.0, 1.0]],
            0,
        );
        band.draw(&[[0.0, 0.0, 1.0], [5.0, 5.0, 1.0], [9.0, 9.0, 1.0]], 1);
        band.draw(
            &[[-1e300, -1e300, 1.0], [-1e299, 0.0, 1.0], [-9.0, 9.0, 1.0]],
            2,
        );
        for row in 5..10 {
            for column in 0..10 {
                assert_eq!(band.object(column, row), NOTHING);
            }
        }
    }
}
