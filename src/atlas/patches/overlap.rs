//! Which triangles of the plane overlap: a grid of several cell sizes, and the separating-axis test.
//!
//! Triangles that only touch do not overlap. "Only" has a tolerance, since coordinates that come
//! out of a flow differ in their last digits from one machine to the next, and two sheets that meet
//! exactly along a cut must be judged the same way every time. It is far above rounding and far
//! below a texel, so an exact predicate would decide nothing better here.

use rustc_hash::FxHashMap as Map;

/// A triangle of the plane.
pub(super) type Triangle = [[f64; 2]; 3];

const END: u32 = u32::MAX;

/// A cell of the grid: level, column and row. A cell of level k measures 2^k.
type Cell = (i32, i64, i64);

/// Cells are stored in blocks of 8 by 8 of them: what is near in the plane is near in memory, and found at once.
const BLOCK: u32 = 3;
const BLOCK_CELLS: usize = 1 << (2 * BLOCK);

/// What lies in a cell.
#[derive(Clone, Copy)]
struct Content {
    /// First node of the list of triangles of the cell's own size.
    own: u32,
    /// Whether one of its four quarters holds anything.
    is_parent: bool,
}

const EMPTY: Content = Content {
    own: END,
    is_parent: false,
};

/// The block of a cell.
fn block_of((level, x, y): Cell) -> Cell {
    (level, x >> BLOCK, y >> BLOCK)
}

/// The place of a cell in its block.
fn place_in_block((_, x, y): Cell) -> usize {
    let low = (1 << BLOCK) - 1;
    ((x & low) << BLOCK | y & low) as usize
}

/// The triangles of a patch so far, found by place.
///
/// A triangle is kept in the cells of its own size. Larger ones are found by going up from there, smaller ones by going
/// down into the quarters that hold anything.
pub(super) struct TriangleIndex {
    triangles: Vec<Triangle>,
    /// Blocks that hold anything: where their cells begin.
    blocks: Map<Cell, usize>,
    cells: Vec<Content>,
    /// Linked lists: triangle and next node.
    nodes: Vec<(u32, u32)>,
    /// Least and greatest level of any triangle that will be added.
    levels: [i32; 2],
    /// Level at which all lies in a few cells, for triangles that are asked for and larger than any that was added.
    top: i32,
    /// Box of all triangles that were added.
    bounds: ([f64; 2], [f64; 2]),
    /// Levels that have triangles of their own, by their place above the least.
    used: [bool; DEPTH + 1],
    /// Deepest overlap that still counts as touching.
    tolerance: f64,
}

/// Levels below that of the largest triangle: finer than a thousandth of it pays no more.
const DEPTH: usize = 10;
/// Levels above it: a million triangles in a row reach no further.
const ABOVE: i32 = 20;

impl TriangleIndex {
    /// For adding triangles whose bounding boxes measure `sizes[0]` to `sizes[1]`. Others are found as well,
    /// only more slowly. Those asked for may have any size.
    pub fn new(sizes: [f64; 2], tolerance: f64) -> TriangleIndex {
        let largest = level(sizes[1]);
        let least = level(sizes[0]).clamp(largest - DEPTH as i32, largest);
        TriangleIndex {
            triangles: Vec::new(),
            blocks: Map::default(),
            cells: Vec::new(),
            nodes: Vec::new(),
            levels: [least, largest],
            top: largest + ABOVE,
            bounds: ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]),
            used: [false; DEPTH + 1],
            tolerance,
        }
    }

    /// Where the cells of a cell's block begin; `last` is the block that was asked for before.
    fn block(&self, cell: Cell, last: &mut (Cell, Option<usize>)) -> Option<usize> {
        let block = block_of(cell);
        if last.0 != block {
            *last = (block, self.blocks.get(&block).copied());
        }
        last.1
    }

    /// What lies in a cell.
    fn content(&self, cell: Cell, last: &mut (Cell, Option<usize>)) -> Content {
        let first = self.block(cell, last);
        let content = first.and_then(|first| self.cells.get(first + place_in_block(cell)));
        content.copied().unwrap_or(EMPTY)
    }

    /// The number of a cell, which gets a place if it has none.
    fn number(&mut self, cell: Cell) -> usize {
        let cells = &mut self.cells;
        let first = *self.blocks.entry(block_of(cell)).or_insert_with(|| {
            let first = cells.len();
            cells.resize(first + BLOCK_CELLS, EMPTY);
            first
        });
        first + place_in_block(cell)
    }

    /// Adds a triangle.
    pub fn insert(&mut self, t: Triangle) {
        let id = self.triangles.len() as u32;
        let own = level(size(&t)).clamp(self.levels[0], self.levels[1]);
        let (low, high) = bounds(&t);
        for i in 0..2 {
            self.bounds.0[i] = self.bounds.0[i].min(low[i]);
            self.bounds.1[i] = self.bounds.1[i].max(high[i]);
        }
        self.used[(own - self.levels[0]) as usize] = true;
        self.triangles.push(t);
        for (x, y) in cells((low, high), own) {
            let number = self.number((own, x, y));
            let content = &mut self.cells[number];
            let is_new = content.own == END && !content.is_parent;
            self.nodes.push((id, content.own));
            content.own = (self.nodes.len() - 1) as u32;
            let (mut at, mut go_on) = ((own, x, y), is_new);
            // Parents know already where anything was there before.
            while go_on && at.0 < self.top {
                // Shifts round down, as cells do.
                at = (at.0 + 1, at.1 >> 1, at.2 >> 1);
                let number = self.number(at);
                let parent = &mut self.cells[number];
                go_on = parent.own == END && !parent.is_parent;
                parent.is_parent = true;
            }
        }
    }

    /// True where the triangle overlaps one that was added.
    pub fn overlaps(&self, t: &Triangle) -> bool {
        let tolerance = self.tolerance;
        let (low, high) = bounds(t);
        let common = (
            [0, 1].map(|i| low[i].max(self.bounds.0[i])),
            [0, 1].map(|i| high[i].min(self.bounds.1[i])),
        );
        // NaN is no common part either.
        if !(0..2).all(|i| common.0[i] <= common.1[i]) {
            return false;
        }
        let own = level(size(t)).clamp(self.levels[0], self.top);
        let larger = |k: &i32| self.used[(k - self.levels[0]) as usize];
        let mut below: Vec<Cell> = Vec::new();
        // No cell has this level.
        let mut last = ((i32::MAX, 0, 0), None);
        for (x, y) in cells(common, own) {
            let content = self.content((own, x, y), &mut last);
            if self.meets_list(t, content.own, tolerance) {
                return true;
            }
            if content.is_parent {
                below.push((own, x, y));
            }
        }
        if (own + 1..=self.levels[1]).filter(larger).any(|k| {
            cells(common, k).any(|(x, y)| {
                let content = self.content((k, x, y), &mut last);
                self.meets_list(t, content.own, tolerance)
            })
        }) {
            return true;
        }
        while let Some((k, x, y)) = below.pop() {
            let [xs, ys] = cell_range(common, k - 1);
            for (x, y) in [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| (2 * x + i, 2 * y + j)) {
                if !(xs.contains(&x) && ys.contains(&y)) || is_outside(t, (k - 1, x, y)) {
                    continue;
                }
                let content = self.content((k - 1, x, y), &mut last);
                if self.meets_list(t, content.own, tolerance) {
                    return true;
                }
                if content.is_parent {
                    below.push((k - 1, x, y));
                }
            }
        }
        false
    }

    /// True where the triangle overlaps one of a list.
    fn meets_list(&self, t: &Triangle, mut node: u32, tolerance: f64) -> bool {
        while node != END {
            let (id, next) = self.nodes[node as usize];
            if overlap(t, &self.triangles[id as usize], tolerance) {
                return true;
            }
            node = next;
        }
        false
    }
}

/// The longer side of the bounding box.
pub(super) fn size(t: &Triangle) -> f64 {
    let (low, high) = bounds(t);
    (high[0] - low[0]).max(high[1] - low[1])
}

fn bounds(t: &Triangle) -> ([f64; 2], [f64; 2]) {
    let of = |i: usize, f: fn(f64, f64) -> f64| f(f(t[0][i], t[1][i]), t[2][i]);
    (
        [of(0, f64::min), of(1, f64::min)],
        [of(0, f64::max), of(1, f64::max)],
    )
}

fn level(size: f64) -> i32 {
    // Zero has no logarithm; nothing is smaller than the least normal number. The exponent is what the logarithm rounds down to.
    let bits = size.clamp(f64::MIN_POSITIVE, f64::MAX).to_bits();
    let exponent = (bits >> 52) as i32 - 1023;
    exponent + i32::from(bits << 12 != 0)
}

fn cells(bounds: ([f64; 2], [f64; 2]), level: i32) -> impl Iterator<Item = (i64, i64)> + use<> {
    let [xs, ys] = cell_range(bounds, level);
    xs.flat_map(move |x| ys.clone().map(move |y| (x, y)))
}

/// Whether a cell lies beyond a side of a counterclockwise triangle, by more than rounding.
fn is_outside(t: &Triangle, (level, x, y): Cell) -> bool {
    let side = power_of_two(level);
    let low = [x as f64 * side, y as f64 * side];
    (0..3).any(|k| {
        let (p, q) = (t[k], t[(k + 1) % 3]);
        let d = [q[0] - p[0], q[1] - p[1]];
        // The cell's corner that lies furthest in.
        let corner = [
            low[0] + if d[1] < 0.0 { side } else { 0.0 },
            low[1] + if d[0] > 0.0 { side } else { 0.0 },
        ];
        let inward = d[0] * (corner[1] - p[1]) - d[1] * (corner[0] - p[0]);
        let reach = corner[0].abs() + corner[1].abs() + p[0].abs() + p[1].abs();
        inward < -1e-14 * (d[0].abs() + d[1].abs()) * reach
    })
}

/// 2^k, for exponents that normal numbers have.
fn power_of_two(k: i32) -> f64 {
    let exponent = (1023 + i64::from(k)).clamp(1, 2046);
    f64::from_bits((exponent as u64) << 52)
}

/// Columns and rows of the cells that a box touches.
fn cell_range((low, high): ([f64; 2], [f64; 2]), level: i32) -> [std::ops::RangeInclusive<i64>; 2] {
    // A power of two: dividing by it and multiplying by its inverse are the same.
    let per_unit = power_of_two(-level);
    let at = |x: f64| floor(x * per_unit);
    [0, 1].map(|i| at(low[i])..=at(high[i]))
}

/// The greatest whole number that is not greater; saturates. (The library's function is a call on older processors.)
fn floor(x: f64) -> i64 {
    let whole = x as i64;
    whole.saturating_sub(i64::from((whole as f64) > x))
}

/// True where two counterclockwise triangles overlap by more than `tolerance`, that is, where no side
/// of either has the other one wholly on its outer side. The tolerance is taken no larger than a
/// hundredth of the smaller triangle, so that small triangles do not hide in it.
pub(super) fn overlap(a: &Triangle, b: &Triangle, tolerance: f64) -> bool {
    let (low_a, high_a) = bounds(a);
    let (low_b, high_b) = bounds(b);
    if (0..2).any(|i| low_a[i] >= high_b[i] || low_b[i] >= high_a[i]) {
        return false;
    }
    let tolerance = tolerance.min(0.01 * size(a).min(size(b)));
    !(separates(a, b, tolerance) || separates(b, a, tolerance))
}

fn separates(a: &Triangle, b: &Triangle, tolerance: f64) -> bool {
    (0..3).any(|k| {
        let (p, q) = (a[k], a[(k + 1) % 3]);
        let d = [q[0] - p[0], q[1] - p[1]];
        let farthest = b.iter().fold(f64::NEG_INFINITY, |m, r| {
            m.max(d[0] * (r[1] - p[1]) - d[1] * (r[0] - p[0]))
        });
        // The side's length is seldom needed, and its root costs more than the rest.
        farthest <= 0.0
            || farthest <= tolerance * 1.5 * (d[0].abs() + d[1].abs())
                && farthest <= tolerance * d[0].hypot(d[1])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const T: Triangle = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

    fn moved(t: Triangle, scale: f64, by: [f64; 2]) -> Triangle {
        t.map(|p| [scale * p[0] + by[0], scale * p[1] + by[1]])
    }

    #[test]
    fn touching_is_no_overlap_and_crossing_is() {
        let across = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert!(!overlap(&T, &across, 1e-12));
        assert!(!overlap(&T, &moved(T, 1.0, [1.0, 0.0]), 1e-12));
        assert!(overlap(&T, &moved(T, 1.0, [0.4, 0.4]), 1e-12));
        assert!(overlap(&T, &moved(T, 0.1, [0.2, 0.2]), 1e-12), "inside");
        assert!(overlap(&T, &T, 1e-12), "itself");
        // A star of David: no corner of one in the other.
        let up = [[-1.0, -0.5], [1.0, -0.5], [0.0, 1.2]];
        let down = [[0.0, -1.2], [1.0, 0.5], [-1.0, 0.5]];
        assert!(overlap(&up, &down, 1e-12));
        // The tolerance.
        assert!(!overlap(&T, &moved(across, 1.0, [-1e-9, 0.0]), 1e-8));
        assert!(overlap(&T, &moved(across, 1.0, [-1e-7, 0.0]), 1e-8));
    }

    #[test]
    fn the_index_agrees_with_brute_force() {
        // A fixed sequence of pseudo-random triangles of sizes from 1 to 1/4000.
        let mut state = 12345u64;
        let mut random = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        let mut index = TriangleIndex::new([1.0 / 4000.0, 1.0], 1e-12);
        let mut kept: Vec<Triangle> = Vec::new();
        let mut refused = 0;
        for _ in 0..3000 {
            let scale = (12.0 * random()).exp2() / 4096.0;
            let t = moved(T, scale, [8.0 * random() - 4.0, 8.0 * random() - 4.0]);
            let brute = kept.iter().any(|k| overlap(&t, k, 1e-12));
            assert_eq!(index.overlaps(&t), brute);
            if brute {
                refused += 1;
            } else {
                index.insert(t);
                kept.push(t);
            }
        }
        assert!(refused > 100 && kept.len() > 100);
        // Much larger ones, thin and thick, near and far, beside a few small ones.
        let mut index = TriangleIndex::new([1.0 / 4000.0, 1.0 / 4000.0], 1e-12);
        let few: Vec<Triangle> = (0..40)
            .map(|_| {
                moved(
                    T,
                    1.0 / 4000.0,
                    [8.0 * random() - 4.0, 8.0 * random() - 4.0],
                )
            })
            .collect();
        few.iter().for_each(|&t| index.insert(t));
        let mut answers = [0; 2];
        for i in 0..4000 {
            let (size, width) = (
                (40.0 * random()).exp2(),
                if i % 2 == 0 { 1e-3 } else { 1.0 },
            );
            let (s, c) = (7.0 * random()).sin_cos();
            let start = [8.0 * random() - 4.0, 8.0 * random() - 4.0];
            // Long, and turned: its box holds all the small ones, it itself few.
            let t = [[-0.5, 0.0], [0.5, 0.0], [0.0, width / size.max(1.0)]].map(|[x, y]| {
                let (x, y) = (size * x, size * y);
                [start[0] + c * x - s * y, start[1] + s * x + c * y]
            });
            let brute = few.iter().any(|k| overlap(&t, k, 1e-12));
            assert_eq!(index.overlaps(&t), brute, "{t:?}");
            answers[usize::from(brute)] += 1;
        }
        assert!(answers.iter().all(|&n| n > 100), "{answers:?}");
    }
}
