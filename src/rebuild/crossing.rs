//! Where a closed polygon crosses or touches itself, by exact predicates.

use robust::{Coord, orient2d};
use rustc_hash::FxHashMap;

fn coord(p: [f64; 2]) -> Coord<f64> {
    Coord { x: p[0], y: p[1] }
}

/// Sign of the area of a triangle, exactly.
fn orientation(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> i8 {
    let area = orient2d(coord(a), coord(b), coord(c));
    i8::from(area > 0.0) - i8::from(area < 0.0)
}

/// Pairs of edges (edge i runs from vertex i to the next) that meet anywhere but at the vertex they share, ascending. `texel` are the
/// vertices in units of about an edge, for the search only.
pub(super) fn crossings(polygon: &[[f64; 2]], texel: &[[f64; 2]]) -> Vec<[usize; 2]> {
    let n = polygon.len();
    let mut cells: FxHashMap<[i64; 2], Vec<u32>> = FxHashMap::default();
    for i in 0..n {
        for cell in cells_along(texel[i], texel[(i + 1) % n]) {
            cells.entry(cell).or_default().push(i as u32);
        }
    }
    let mut found = Vec::new();
    for edges in cells.into_values() {
        for (at, &i) in edges.iter().enumerate() {
            for &j in &edges[..at] {
                let pair = [i.min(j) as usize, i.max(j) as usize];
                if meet(polygon, pair) {
                    found.push(pair);
                }
            }
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// True where a polygon that does not cross itself runs counterclockwise.
pub(super) fn is_counterclockwise(polygon: &[[f64; 2]]) -> bool {
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

/// Unit cells that a segment passes within a millionth, and some more.
pub(super) fn cells_along(a: [f64; 2], b: [f64; 2]) -> impl Iterator<Item = [i64; 2]> {
    const WIDER: f64 = 1e-6;
    // Column by column: the rows that the segment has there.
    let (a, b) = if a[0] <= b[0] { (a, b) } else { (b, a) };
    let slope = (b[1] - a[1]) / (b[0] - a[0]).max(f64::MIN_POSITIVE);
    let columns = (a[0] - WIDER).floor() as i64..=(b[0] + WIDER).floor() as i64;
    columns.flat_map(move |column| {
        let at = |x: f64| {
            let x = x.clamp(a[0], b[0]);
            let y = a[1] + slope * (x - a[0]);
            y.clamp(a[1].min(b[1]), a[1].max(b[1]))
        };
        let (first, last) = match b[0] - a[0] < WIDER {
            true => (a[1], b[1]),
            false => (at(column as f64 - WIDER), at(column as f64 + 1.0 + WIDER)),
        };
        let rows =
            (first.min(last) - WIDER).floor() as i64..=(first.max(last) + WIDER).floor() as i64;
        rows.map(move |row| [column, row])
    })
}

fn meet(polygon: &[[f64; 2]], [i, j]: [usize; 2]) -> bool {
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
fn folds(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> bool {
    let dot = (a[0] - b[0]) * (c[0] - b[0]) + (a[1] - b[1]) * (c[1] - b[1]);
    a == b || b == c || (dot > 0.0 && orientation(a, b, c) == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brute(polygon: &[[f64; 2]]) -> Vec<[usize; 2]> {
        let n = polygon.len();
        let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| [i, j]));
        pairs.filter(|&pair| meet(polygon, pair)).collect()
    }

    #[test]
    fn simple_polygons_have_none() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        assert!(crossings(&square, &square).is_empty());
        assert!(is_counterclockwise(&square));
        let turned: Vec<_> = square.into_iter().rev().collect();
        assert!(!is_counterclockwise(&turned));
    }

    #[test]
    fn bowties_slits_and_spikes_are_found() {
        let bowtie = [[0.0, 0.0], [4.0, 4.0], [4.0, 0.0], [0.0, 4.0]];
        assert_eq!(crossings(&bowtie, &bowtie), [[0, 2]]);
        // A closed slit from the left side.
        let slit = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 4.0],
            [0.0, 4.0],
            [0.0, 2.0],
            [2.0, 2.0],
            [0.0, 2.0],
        ];
        assert_eq!(crossings(&slit, &slit), brute(&slit));
        assert!(crossings(&slit, &slit).contains(&[4, 5]));
        let touching = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 0.0], [0.0, 4.0]];
        assert_eq!(crossings(&touching, &touching), [[0, 2], [0, 3]]);
    }

    #[test]
    fn the_search_agrees_with_all_pairs() {
        let mut state = 7u64;
        let mut random = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        for size in [3.0, 30.0] {
            for _ in 0..40 {
                let polygon: Vec<[f64; 2]> = (0..25)
                    .map(|_| [size * random(), (4.0 * size * random()).round() / 4.0])
                    .collect();
                assert_eq!(crossings(&polygon, &polygon), brute(&polygon));
            }
        }
    }
}
