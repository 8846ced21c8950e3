//! Where a closed polygon crosses or touches itself, by exact predicates.

use crate::geometry::polygon::meet;
use rustc_hash::FxHashMap;

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
