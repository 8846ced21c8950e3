//! Closed polygons in the plane: whether they meet themselves, by exact predicates.
//!
//! *Enters:* the corners of a closed polygon; edge i runs from corner i to the next. *Leaves:* which edges meet, and whether any do.
//! *Guaranteed:* what is said of two edges is exact for the coordinates as they are, and [`is_simple`] looks at a number of pairs in proportion to the number
//! of edges, or says that this was not enough. *Not guaranteed:* an answer where very many edges lie close to each other without meeting.

use robust::{Coord, orient2d};

type Point = [f64; 2];

/// Sign of the area of a triangle, exactly.
fn orientation(a: Point, b: Point, c: Point) -> i8 {
    let coord = |[x, y]: Point| Coord { x, y };
    let area = orient2d(coord(a), coord(b), coord(c));
    i8::from(area > 0.0) - i8::from(area < 0.0)
}

/// True where edges i < j meet anywhere but at the corner they share.
pub(crate) fn meet(polygon: &[Point], [i, j]: [usize; 2]) -> bool {
    let n = polygon.len();
    let at = |i: usize| polygon[i % n];
    if j == i + 1 {
        return folds(at(i), at(j), at(j + 1));
    }
    if i == 0 && j == n - 1 {
        return folds(at(j), at(0), at(1));
    }
    let (a, b, c, d) = (at(i), at(i + 1), at(j), at(j + 1));
    let apart = |k: usize| a[k].max(b[k]) < c[k].min(d[k]) || c[k].max(d[k]) < a[k].min(b[k]);
    if apart(0) || apart(1) {
        return false;
    }
    orientation(a, b, c) * orientation(a, b, d) <= 0
        && orientation(c, d, a) * orientation(c, d, b) <= 0
}

/// Whether the edges a–b and b–c have more in common than b.
fn folds(a: Point, b: Point, c: Point) -> bool {
    let dot = (a[0] - b[0]) * (c[0] - b[0]) + (a[1] - b[1]) * (c[1] - b[1]);
    a == b || b == c || (dot > 0.0 && orientation(a, b, c) == 0)
}

/// True where a polygon that does not meet itself runs counterclockwise.
pub(crate) fn is_counterclockwise(polygon: &[Point]) -> bool {
    let n = polygon.len();
    let key = |&i: &usize| (polygon[i][0], polygon[i][1]);
    let lowest = (0..n).min_by(|a, b| {
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    lowest.is_some_and(|i| {
        orientation(polygon[(i + n - 1) % n], polygon[i], polygon[(i + 1) % n]) > 0
    })
}

/// Most pairs of runs of edges that are looked at, for each edge.
const MOST_LOOKS: usize = 64;

/// Whether no two edges meet but neighbours in their common corner; `None` where that is not known after [`MOST_LOOKS`] an edge.
pub(crate) fn is_simple(polygon: &[Point]) -> Option<bool> {
    looked_at(polygon, MOST_LOOKS * polygon.len()).0
}

/// A run of edges in a rectangle along the longest of them: edges that lie side by side at any angle stay apart.
struct Run {
    from: usize,
    to: usize,
    /// The halves of the run; none of one edge.
    halves: Option<[usize; 2]>,
    /// Unit vectors.
    axes: [Point; 2],
    low: Point,
    high: Point,
}

/// The answer of [`is_simple`] after so many looks at most, and how many it took.
fn looked_at(polygon: &[Point], most: usize) -> (Option<bool>, usize) {
    let n = polygon.len();
    if n < 3 {
        return (Some(false), 0);
    }
    let mut runs = Vec::with_capacity(2 * n);
    let all = add_run(&mut runs, polygon, 0, n);
    let mut looks = 0;
    let mut pairs = vec![[all, all]];
    while let Some([i, j]) = pairs.pop() {
        looks += 1;
        if looks > most {
            return (None, looks);
        }
        let (a, b) = (&runs[i], &runs[j]);
        if i == j {
            if let Some([k, l]) = a.halves {
                pairs.extend([[k, k], [l, l], [k, l]]);
            }
        } else if !a.is_apart_from(b) {
            // The longer run is halved.
            let is_first = a.to - a.from >= b.to - b.from;
            match if is_first { a.halves } else { b.halves } {
                Some([k, l]) if is_first => pairs.extend([[k, j], [l, j]]),
                Some([k, l]) => pairs.extend([[i, k], [i, l]]),
                None if meet(polygon, [a.from.min(b.from), a.from.max(b.from)]) => {
                    return (Some(false), looks);
                }
                None => {}
            }
        }
    }
    (Some(true), looks)
}

/// Adds a run and all its parts; returns its number.
fn add_run(runs: &mut Vec<Run>, polygon: &[Point], from: usize, to: usize) -> usize {
    let n = polygon.len();
    let halves = (to - from > 1).then(|| {
        let middle = from.midpoint(to);
        [(from, middle), (middle, to)].map(|(from, to)| add_run(runs, polygon, from, to))
    });
    let along = |i: usize| {
        let (p, q) = (polygon[i], polygon[(i + 1) % n]);
        [q[0] - p[0], q[1] - p[1]]
    };
    let length = |d: Point| d[0].hypot(d[1]);
    let longest =
        (from..to).map(along).fold(
            [0.0; 2],
            |best, d| {
                if length(d) > length(best) { d } else { best }
            },
        );
    let d = match length(longest) {
        l if l > 0.0 => longest.map(|x| x / l),
        _ => [1.0, 0.0],
    };
    let axes = [d, [-d[1], d[0]]];
    let points = || (from..=to).map(|i| polygon[i % n]);
    // Products and sums of two coordinates are rounded a few times.
    let reach = points().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
    let margin = 16.0 * f64::EPSILON * reach;
    let within = axes.map(|axis| {
        let places = points().map(|p| dot(axis, p));
        places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x - margin), high.max(x + margin)]
        })
    });
    runs.push(Run {
        from,
        to,
        halves,
        axes,
        low: within.map(|w| w[0]),
        high: within.map(|w| w[1]),
    });
    runs.len() - 1
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

impl Run {
    fn is_apart_from(&self, other: &Run) -> bool {
        self.has_beside(other) || other.has_beside(self)
    }

    /// True where a side of this rectangle has the other one beyond it.
    fn has_beside(&self, other: &Run) -> bool {
        let middle = [0, 1].map(|i| other.low[i].midpoint(other.high[i]));
        let half = [0, 1].map(|i| 0.5 * (other.high[i] - other.low[i]));
        (0..2).any(|k| {
            let [x, y] = other.axes.map(|axis| dot(axis, self.axes[k]));
            let (at, reach) = (
                middle[0] * x + middle[1] * y,
                half[0] * x.abs() + half[1] * y.abs(),
            );
            at - reach > self.high[k] || at + reach < self.low[k]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn brute(polygon: &[Point]) -> bool {
        let n = polygon.len();
        let mut pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| [i, j]));
        !pairs.any(|pair| meet(polygon, pair))
    }

    #[test]
    fn a_square_is_simple_and_what_touches_itself_is_not() {
        let square = vec![[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        assert_eq!(is_simple(&square), Some(true));
        assert!(is_counterclockwise(&square));
        let turned: Vec<Point> = square.iter().rev().copied().collect();
        assert!(!is_counterclockwise(&turned));
        let bow_tie = [[0.0, 0.0], [4.0, 4.0], [4.0, 0.0], [0.0, 4.0]];
        let notch = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 0.0], [0.0, 4.0]];
        let slit = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [2.0, 4.0],
            [2.0, 2.0],
            [2.0, 4.0],
        ];
        for polygon in [
            &bow_tie[..],
            &notch,
            &slit,
            &square[..2],
            &[[f64::NAN; 2]; 4],
        ] {
            assert_eq!(is_simple(polygon), Some(false), "{polygon:?}");
        }
    }

    #[test]
    fn the_search_agrees_with_all_pairs() {
        let mut state = 11u64;
        let mut random = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        let mut answers = [0; 2];
        for i in 0..400 {
            // A star with corners near and far, some moved to another ray; on whole numbers every other time.
            let corners = 4 + i % 30;
            let polygon: Vec<Point> = (0..corners)
                .map(|k| {
                    let off = if random() < 0.03 { 3.0 * random() } else { 0.0 };
                    let (s, c) = ((f64::from(k) + off) * TAU / f64::from(corners)).sin_cos();
                    let r = 0.1 + 20.0 * random();
                    let p = [r * c, r * s];
                    if i % 2 == 0 { p } else { p.map(f64::round) }
                })
                .collect();
            let simple = brute(&polygon);
            assert_eq!(is_simple(&polygon), Some(simple), "{polygon:?}");
            answers[usize::from(simple)] += 1;
        }
        assert!(answers.iter().all(|&n| n > 50), "{answers:?}");
    }

    /// A circle, one with spikes as long as its radius, and one whose edges shrink to nothing: the boxes of spikes along the axes all overlap.
    #[test]
    fn looks_grow_no_faster_than_edges() {
        let circle = |n: u32, r: fn(u32) -> f64| -> Vec<Point> {
            let at = |i: u32| {
                let (s, c) = (f64::from(i) * TAU / f64::from(n)).sin_cos();
                [r(i) * c, r(i) * s]
            };
            (0..n).map(at).collect()
        };
        let spiral = |n: u32| -> Vec<Point> {
            let at = |i: u32| 0.5_f64.powf(f64::from(i) * 0.1);
            let there = (0..n / 2).map(|i| [at(i), 0.1 * at(i)]);
            let back = (0..n / 2).rev().map(|i| [at(i), 0.2 * at(i)]);
            there.chain(back).rev().collect()
        };
        for shape in [0, 1, 2] {
            let looks = [2000, 4000, 8000].map(|n| {
                let polygon = match shape {
                    0 => circle(n, |_| 1.0),
                    1 => circle(n, |i| f64::from(1 + i % 2)),
                    _ => spiral(n.min(4000)),
                };
                let (simple, looks) = looked_at(&polygon, usize::MAX);
                assert_eq!(simple, Some(true), "{shape}");
                looks as f64 / polygon.len() as f64
            });
            assert!(
                looks.iter().all(|&l| l < 0.5 * MOST_LOOKS as f64),
                "{shape}: {looks:?}"
            );
            assert!(looks[2] < 1.5 * looks[0], "{shape}: {looks:?}");
        }
    }

    #[test]
    fn too_many_looks_are_no_answer() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        assert_eq!(looked_at(&square, 3).0, None);
    }
}
