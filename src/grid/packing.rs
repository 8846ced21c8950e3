//! Islands of cells in a square: each goes to the lowest place where it fits, then the leftmost, turned by a quarter or not.
//!
//! Islands are drawn on a raster as wide as a gutter, each with its gutter; a row of the square is a row of bits, and all places in it are tried at once. Several widths of the square and two orders of the islands are tried. Whole
//! numbers, so the result is the same everywhere.

use crate::parallel;
use rustc_hash::FxHashMap;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Squares of the raster along a side of the square, about, at most.
const FINEST: usize = 512;
/// Widths that are tried: the side of a square without gaps, and so many twenty-fifths more.
const WIDTHS: usize = 10;
/// More islands are packed once.
const MANY: usize = 400;

/// An island to be packed.
pub(super) struct Outline {
    /// Cells of the rectangle around it.
    pub size: [usize; 2],
    /// Its cells there.
    pub cells: Vec<[usize; 2]>,
}

/// Where islands are.
#[derive(Clone, Debug, Default)]
pub(super) struct Packed {
    /// Texel at the lower left corner of the rectangle around each island.
    pub corner: Vec<[usize; 2]>,
    /// Whether it was turned by a quarter, counterclockwise.
    pub is_turned: Vec<bool>,
    /// Texels on a side of the square.
    pub side: usize,
}

/// Rows of an island that are alike, from the first to before the last, and their columns, from the first to before the last.
#[derive(PartialEq, Eq, Hash)]
struct Band {
    rows: [usize; 2],
    runs: Vec<[usize; 2]>,
}

/// An island on the raster.
#[derive(PartialEq, Eq, Hash)]
struct Mask {
    size: [usize; 2],
    /// From the one with the longest run on: what it does not fit need not be asked of others.
    bands: Vec<Band>,
}

impl Mask {
    fn new(outline: &Outline, is_turned: bool, samples: usize, gutter: usize, unit: usize) -> Self {
        let [w, h] = outline.size;
        let span = |n: usize| {
            [
                n * samples / unit,
                (n * samples + samples + gutter).div_ceil(unit),
            ]
        };
        let size = match is_turned {
            true => [h, w],
            false => [w, h],
        };
        let size = size.map(|n| span(n.max(1) - 1)[1]);
        let mut is_set = vec![false; size[0] * size[1]];
        for &[x, y] in &outline.cells {
            let [x, y] = match is_turned {
                true => [h - 1 - y, x],
                false => [x, y],
            };
            let ([left, right], [low, high]) = (span(x), span(y));
            for row in low..high {
                is_set[row * size[0] + left..row * size[0] + right].fill(true);
            }
        }
        let mut bands: Vec<Band> = Vec::new();
        for (r, row) in is_set.chunks(size[0]).enumerate() {
            let mut runs = Vec::new();
            let mut x = 0;
            while x < row.len() {
                let from = x;
                while x < row.len() && row[x] {
                    x += 1;
                }
                if x > from {
                    runs.push([from, x]);
                }
                x += 1;
            }
            match bands.last_mut() {
                Some(band) if band.runs == runs => band.rows[1] = r + 1,
                _ => bands.push(Band {
                    rows: [r, r + 1],
                    runs,
                }),
            }
        }
        let longest = |band: &Band| band.runs.iter().map(|[from, to]| to - from).max();
        bands.sort_by_key(|band| std::cmp::Reverse(longest(band)));
        Self { size, bands }
    }

    /// Columns that its longest run needs, in a row.
    fn needed(&self) -> usize {
        let runs = self.bands.first().map_or(&[][..], |band| &band.runs);
        runs.iter().map(|[from, to]| to - from).max().unwrap_or(0)
    }

    /// Squares of the raster.
    fn area(&self) -> usize {
        let of_band = |band: &Band| {
            let row: usize = band.runs.iter().map(|[from, to]| to - from).sum();
            row * (band.rows[1] - band.rows[0])
        };
        self.bands.iter().map(of_band).sum()
    }
}

/// Where an island lies, in squares of the raster, and whether it is turned.
type Placed = ([usize; 2], bool);

/// Rows of bits, 64 a word.
struct Rows {
    width: usize,
    words: usize,
    bits: Vec<u64>,
    /// The longest run that is not taken, of every row.
    free: Vec<usize>,
}

impl Rows {
    fn new(width: usize) -> Self {
        Self {
            width,
            words: width.div_ceil(64) + 1,
            bits: Vec::new(),
            free: Vec::new(),
        }
    }

    fn row(&self, y: usize) -> Option<&[u64]> {
        self.bits.get(y * self.words..(y + 1) * self.words)
    }

    /// Takes a mask's squares, moved by `at`.
    fn take(&mut self, mask: &Mask, [x, y]: [usize; 2]) {
        let needed = y + mask.size[1];
        if self.free.len() < needed {
            self.bits.resize(needed * self.words, 0);
            self.free.resize(needed, self.width);
        }
        for band in &mask.bands {
            for r in y + band.rows[0]..y + band.rows[1] {
                let row = &mut self.bits[r * self.words..][..self.words];
                for i in band.runs.iter().flat_map(|&[from, to]| x + from..x + to) {
                    row[i / 64] |= 1 << (i % 64);
                }
                self.free[r] = longest_free(row, self.width);
            }
        }
    }
}

/// The longest run of zeros among the first `width` bits.
fn longest_free(row: &[u64], width: usize) -> usize {
    let (mut longest, mut run, mut x) = (0, 0, 0);
    while x < width {
        let rest = row[x / 64] >> (x % 64);
        let left = (64 - x % 64).min(width - x);
        let zeros = (rest.trailing_zeros() as usize).min(left);
        run += zeros;
        longest = longest.max(run);
        if zeros < left {
            run = 0;
            let ones = ((rest >> zeros).trailing_ones() as usize).min(left - zeros);
            x += zeros + ones;
        } else {
            x += zeros;
        }
    }
    longest
}

/// What a row, moved to lower places by `by`, has in word `i`.
fn moved(row: &[u64], by: usize, i: usize) -> u64 {
    let (words, bits) = (by / 64, by % 64);
    let word = |i: usize| row.get(i + words).copied().unwrap_or(0);
    match bits {
        0 => word(i),
        _ => word(i) >> bits | word(i + 1) << (64 - bits),
    }
}

/// The lowest, then leftmost place of a mask from row `from` on, where nothing is higher than what is taken.
fn place(taken: &Rows, mask: &Mask, from: usize, below: usize) -> Option<[usize; 2]> {
    let last = taken.width.checked_sub(mask.size[0])?;
    let (first, needed) = (mask.bands.first()?, mask.needed());
    // Bits beyond the last place count as taken.
    let beyond = |i: usize| match (last + 1).saturating_sub(64 * i) {
        0 => u64::MAX,
        n if n >= 64 => 0,
        n => u64::MAX << n,
    };
    let none: Vec<u64> = (0..=last / 64).map(beyond).collect();
    let mut blocked = none.clone();
    let (mut joined, mut spread) = (vec![0u64; taken.words], vec![0u64; taken.words]);
    let mut next = from;
    while next <= below {
        let y = next;
        // Beyond the highest row without room for the longest run.
        let rows = y + first.rows[0]..(y + first.rows[1]).min(taken.free.len());
        if let Some(full) = rows.rev().find(|&r| taken.free[r] < needed) {
            next = full + 1 - first.rows[0];
            continue;
        }
        next += 1;
        blocked.copy_from_slice(&none);
        for band in &mask.bands {
            joined.fill(0);
            for row in (y + band.rows[0]..y + band.rows[1]).map_while(|r| taken.row(r)) {
                joined.iter_mut().zip(row).for_each(|(j, r)| *j |= r);
            }
            for &[from, to] in &band.runs {
                // Where any of the places from … to − 1 on is taken.
                let mut reach = 1;
                spread.copy_from_slice(&joined);
                while reach < to - from {
                    let by = reach.min(to - from - reach);
                    // Words are read before they are written, higher ones too.
                    for i in 0..spread.len() {
                        spread[i] |= moved(&spread, by, i);
                    }
                    reach += by;
                }
                for (i, b) in blocked.iter_mut().enumerate() {
                    *b |= moved(&spread, from, i);
                }
            }
            if blocked.iter().all(|b| *b == u64::MAX) {
                break;
            }
        }
        if let Some(i) = blocked.iter().position(|b| *b != u64::MAX) {
            return Some([64 * i + blocked[i].trailing_ones() as usize, y]);
        }
    }
    None
}

/// Packs into a strip of the given width; the height comes last. `None` where that gets higher than `most`.
fn strip(
    masks: &[[Mask; 2]],
    order: &[usize],
    width: usize,
    most: &AtomicUsize,
) -> Option<(Vec<Placed>, usize)> {
    let mut places = vec![([0; 2], false); masks.len()];
    let mut taken = Rows::new(width);
    // The row where a mask found its place: the next one alike finds none below.
    let mut lowest: FxHashMap<&Mask, usize> = FxHashMap::default();
    let mut height = 0;
    for &i in order {
        let mut best = None;
        for is_turned in [false, true] {
            let mask = &masks[i][usize::from(is_turned)];
            let from = lowest.get(mask).copied().unwrap_or(0);
            if let Some([x, y]) = place(&taken, mask, from, height) {
                lowest.insert(mask, y);
                let found = ((y + mask.size[1], y, x), is_turned);
                best = Some(best.map_or(found, |best| found.min(best)));
            }
        }
        // Every island fits into the strip lying down, above all that is taken.
        let Some(((top, y, x), is_turned)) = best else {
            continue;
        };
        taken.take(&masks[i][usize::from(is_turned)], [x, y]);
        places[i] = ([x, y], is_turned);
        height = height.max(top);
        if height > most.load(Ordering::Relaxed) {
            return None;
        }
    }
    Some((places, height))
}

/// Packs islands whose cells are `samples` texels wide, with so many texels between them, into a square whose sides have `most` texels at most, if they fit.
pub(super) fn pack(
    outlines: &[Outline],
    samples: usize,
    gutter: usize,
    most: usize,
) -> Option<Packed> {
    let cells: usize = outlines.iter().map(|o| o.cells.len()).sum();
    let texels = (cells as f64).sqrt() * samples as f64;
    let unit = gutter.max(1).max((texels / FINEST as f64).ceil() as usize);
    // As many squares of the raster to a cell as there can be without gaps.
    let unit = (1..=unit)
        .rev()
        .find(|u| samples.is_multiple_of(*u) && u * 4 > unit)
        .unwrap_or(unit);
    let mask =
        |o: &Outline| [false, true].map(|is_turned| Mask::new(o, is_turned, samples, gutter, unit));
    let masks = parallel::map(outlines, |_, o| mask(o));
    let area = |i: usize| masks[i][0].area();
    let total: usize = (0..masks.len()).map(area).sum();
    let root = (total as f64).sqrt();
    // The shorter side of the widest, so that all fit, turned or not.
    let widest = masks
        .iter()
        .map(|m| m[0].size[0].min(m[0].size[1]))
        .max()
        .unwrap_or(1);
    let by = |key: &dyn Fn(usize) -> usize| {
        let mut order: Vec<usize> = (0..masks.len()).collect();
        order.sort_by_key(|&i| (std::cmp::Reverse(key(i)), i));
        order
    };
    let orders = [
        by(&|i| masks[i][0].size[0].max(masks[i][0].size[1])),
        by(&area),
    ];
    let tries = if masks.len() > MANY { 1 } else { WIDTHS };
    let jobs: Vec<(usize, usize)> = (0..orders.len())
        .flat_map(|o| (0..tries).map(move |w| (o, w)))
        .collect();
    // The least side so far: a strip that gets higher is given up, whichever was first.
    let least = AtomicUsize::new(most / unit);
    let of = |&(o, w): &(usize, usize)| {
        let width = (root * (1.0 + 0.04 * w as f64)).ceil() as usize;
        let width = width.max(widest);
        let (places, height) = strip(&masks, &orders[o], width, &least)?;
        let reach = places.iter().zip(&masks);
        let reach = reach
            .map(|(([x, _], t), m)| x + m[usize::from(*t)].size[0])
            .max();
        let side = reach.unwrap_or(1).max(height);
        let before = least.fetch_min(side, Ordering::Relaxed);
        (side <= before).then_some((side, places))
    };
    let tried = parallel::map(&jobs, |_, job| of(job));
    let best = tried.into_iter().flatten().min_by_key(|(side, _)| *side);
    let (side, places) = best?;
    Some(Packed {
        corner: places
            .iter()
            .map(|(at, _)| at.map(|n| n * unit + gutter / 2))
            .collect(),
        is_turned: places.iter().map(|(_, is_turned)| *is_turned).collect(),
        side: side.max(1) * unit,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outline(rows: &[&str]) -> Outline {
        let mut cells = Vec::new();
        for (y, row) in rows.iter().rev().enumerate() {
            cells.extend(
                row.bytes()
                    .enumerate()
                    .filter(|(_, b)| *b == b'#')
                    .map(|(x, _)| [x, y]),
            );
        }
        Outline {
            size: [rows[0].len(), rows.len()],
            cells,
        }
    }

    /// Whether islands with their gutters overlap or lie outside.
    fn overlaps(outlines: &[Outline], packed: &Packed, samples: usize, gutter: usize) -> bool {
        let (before, after) = (gutter / 2, gutter.div_ceil(2));
        let mut taken = vec![0; packed.side * packed.side];
        for (i, o) in outlines.iter().enumerate() {
            let mut own = std::collections::BTreeSet::new();
            for &[x, y] in &o.cells {
                let [x, y] = match packed.is_turned[i] {
                    true => [o.size[1] - 1 - y, x],
                    false => [x, y],
                };
                let [left, low] = [0, 1].map(|k| packed.corner[i][k] + [x, y][k] * samples);
                for v in low - before..low + samples + after {
                    own.extend(
                        (left - before..left + samples + after).map(|u| v * packed.side + u),
                    );
                }
            }
            own.into_iter().for_each(|at: usize| taken[at] += 1);
        }
        taken.iter().any(|&n| n > 1)
    }

    #[test]
    fn the_longest_free_run_is_that_of_a_count_bit_by_bit() {
        let mut state = 11u64;
        for round in 0..500 {
            let mut row = [0u64; 4];
            let words = row.iter_mut();
            // Sparse, dense and whole words.
            words.for_each(|word| {
                let mut next = || {
                    state = state.wrapping_mul(6364136223846793005).wrapping_add(99);
                    (state >> 32) << 32 | state.rotate_left(17) >> 32
                };
                *word = match round % 4 {
                    0 => next() & next() & next() & next() & next(),
                    1 => next() | next() | next(),
                    2 if next() % 2 == 0 => 0,
                    2 => u64::MAX,
                    _ => next() & next(),
                };
            });
            let width = 1 + (state >> 33) as usize % 256;
            let is_free = |x: &usize| row[x / 64] >> (x % 64) & 1 == 0;
            let all: Vec<usize> = (0..width).collect();
            let runs = all.chunk_by(|a, b| is_free(a) == is_free(b));
            let free = runs.filter(|run| is_free(&run[0])).map(<[_]>::len);
            assert_eq!(longest_free(&row, width), free.max().unwrap_or(0));
        }
    }

    #[test]
    fn a_place_is_the_lowest_of_all() {
        let mask = |rows: &[&str]| Mask::new(&outline(rows), false, 1, 0, 1);
        let masks = [
            mask(&["####"]),
            mask(&["##.", ".##"]),
            mask(&["###", "#.."]),
            mask(&["#", "#", "#"]),
            mask(&["#.#", "###"]),
        ];
        let mut taken = Rows::new(70);
        for round in 0..400 {
            let mask = &masks[round * round % 5];
            let height = taken.free.len();
            let squares = |[x, y]: [usize; 2]| {
                let rows = |b: &Band| {
                    (b.rows[0]..b.rows[1])
                        .map(|r| (r, b.runs.clone()))
                        .collect()
                };
                let rows: Vec<(usize, Vec<[usize; 2]>)> =
                    mask.bands.iter().flat_map::<Vec<_>, _>(rows).collect();
                let of_row = move |(r, runs): (usize, Vec<[usize; 2]>)| {
                    let columns = runs.into_iter().flat_map(|[from, to]| from..to);
                    columns.map(move |c| [x + c, y + r]).collect::<Vec<_>>()
                };
                rows.into_iter().flat_map(of_row)
            };
            let is_taken = |[x, y]: [usize; 2]| {
                taken
                    .row(y)
                    .is_some_and(|row| row[x / 64] >> (x % 64) & 1 == 1)
            };
            let mut all = (0..=height).flat_map(|y| (0..=70 - mask.size[0]).map(move |x| [x, y]));
            let lowest = all.find(|&at| !squares(at).any(is_taken));
            let found = place(&taken, mask, 0, height);
            assert_eq!(found, lowest);
            taken.take(mask, found.unwrap());
        }
    }

    #[test]
    fn islands_interlock_and_keep_their_gutters() {
        let outlines = [
            outline(&["###.", "#...", "#..."]),
            outline(&["#####"]),
            outline(&["##", "##"]),
            outline(&["..#", "..#", "###"]),
            outline(&["#"]),
        ];
        for (samples, gutter) in [(8, 2), (4, 1), (8, 0), (5, 3), (1, 2), (64, 2)] {
            let packed = pack(&outlines, samples, gutter, usize::MAX).expect("fits");
            assert!(
                !overlaps(&outlines, &packed, samples, gutter),
                "{samples} {gutter}"
            );
            let cells: usize = outlines.iter().map(|o| o.cells.len()).sum();
            let filled = (cells * samples * samples) as f64 / (packed.side * packed.side) as f64;
            assert!(samples < 8 || gutter > 0 || filled > 0.55, "{filled}");
        }
        let none = pack(&[], 8, 2, usize::MAX).expect("fits");
        assert_eq!(none.corner.len(), 0);
    }

    #[test]
    fn many_rectangles_fill_the_square() {
        let mut state = 5u64;
        let mut random = |n: u64| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(99);
            ((state >> 33) % n) as usize + 1
        };
        let outlines: Vec<Outline> = (0..60)
            .map(|_| {
                let size = [random(9), random(6)];
                let cells = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y]));
                Outline {
                    size,
                    cells: cells.collect(),
                }
            })
            .collect();
        let packed = pack(&outlines, 16, 1, usize::MAX).expect("fits");
        assert!(!overlaps(&outlines, &packed, 16, 1));
        // Not into less than there is, but into what it takes.
        let side = |most| pack(&outlines, 16, 1, most).map(|packed| packed.side);
        assert_eq!(side(packed.side), Some(packed.side));
        assert_eq!(side(packed.side - 1), None);
        let cells: usize = outlines.iter().map(|o| o.cells.len()).sum();
        let filled = (cells * 256) as f64 / (packed.side * packed.side) as f64;
        assert!(filled > 0.75, "{filled}");
    }
}
