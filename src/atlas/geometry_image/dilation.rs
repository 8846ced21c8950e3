//! Where a texel outside the patch takes its values from.

/// For every texel the nearest source by Euclidean distance, exactly; the one further left, then
/// further up, where several are as near. A texel is its own source where there is none.
///
/// Two passes (Meijster, Roerdink, Hesselink 2000): the nearest source in each column, then along each
/// row the lower envelope of the parabolas `(x − column)² + distance²`. Whole numbers throughout.
pub(crate) fn nearest_sources(sources: &[bool], width: usize) -> Vec<usize> {
    let mut nearest: Vec<usize> = (0..sources.len()).collect();
    // Where all are sources, as in blocks, or none is.
    if width == 0 || !sources.contains(&true) || !sources.contains(&false) {
        return nearest;
    }
    let height = sources.len() / width;
    // Row of the nearest source in the column, `height` where the column has none.
    let mut in_column = vec![height; sources.len()];
    // Row by row, as they lie in memory: the last source above each texel, then the next one below.
    let mut near = vec![height; width];
    for (y, (row, sources)) in rows_of(&mut in_column, sources, width) {
        for (x, near) in near.iter_mut().enumerate() {
            if sources[x] {
                *near = y;
            }
            row[x] = *near;
        }
    }
    near.fill(height);
    for (y, (row, sources)) in rows_of(&mut in_column, sources, width).rev() {
        for (x, next) in near.iter_mut().enumerate() {
            if sources[x] {
                *next = y;
            }
            let above = row[x];
            if *next < height && (above == height || *next - y < y - above) {
                row[x] = *next;
            }
        }
    }
    // (column, first texel of the row for which it is the nearest)
    let mut envelope: Vec<(i64, i64)> = Vec::with_capacity(width);
    for y in 0..height {
        let row = &in_column[width * y..width * (y + 1)];
        let squared = |column: i64| {
            let d = row[column as usize] as i64 - y as i64;
            d * d
        };
        envelope.clear();
        for column in (0..width as i64).filter(|&c| row[c as usize] < height) {
            loop {
                let Some(&(other, from)) = envelope.last() else {
                    envelope.push((column, 0));
                    break;
                };
                // `column` is strictly nearer than `other` from this texel on.
                let twice = column * column - other * other + squared(column) - squared(other);
                let start = twice.div_euclid(2 * (column - other)) + 1;
                if start > from {
                    if start < width as i64 {
                        envelope.push((column, start));
                    }
                    break;
                }
                envelope.pop();
            }
        }
        let mut at = 0;
        for x in 0..width {
            while at + 1 < envelope.len() && envelope[at + 1].1 <= x as i64 {
                at += 1;
            }
            let column = envelope[at].0 as usize;
            nearest[width * y + x] = width * row[column] + column;
        }
    }
    nearest
}

/// Rows of two images of one width, numbered.
fn rows_of<'a>(
    a: &'a mut [usize],
    b: &'a [bool],
    width: usize,
) -> impl DoubleEndedIterator<Item = (usize, (&'a mut [usize], &'a [bool]))> {
    a.chunks_exact_mut(width)
        .zip(b.chunks_exact(width))
        .enumerate()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_sources_agree_with_brute_force() {
        let mut state = 3u64;
        for (width, height, share) in [
            (17, 11, 4),
            (1, 30, 8),
            (30, 1, 8),
            (24, 24, 60),
            (5, 5, 25),
        ] {
            let mut sources: Vec<bool> = (0..width * height)
                .map(|_| {
                    state = state
                        .wrapping_mul(6364136223846793005)
                        .wrapping_add(1442695040888963407);
                    (state >> 33).is_multiple_of(share)
                })
                .collect();
            sources[width * height / 2] = true;
            let nearest = nearest_sources(&sources, width);
            for (at, &found) in nearest.iter().enumerate() {
                let squared = |from: usize| {
                    let dx = (from % width).abs_diff(at % width);
                    let dy = (from / width).abs_diff(at / width);
                    dx * dx + dy * dy
                };
                // Nearest, then leftmost, then topmost.
                let brute = (0..sources.len())
                    .filter(|&s| sources[s])
                    .min_by_key(|&s| (squared(s), s % width, s / width));
                assert_eq!(Some(found), brute);
            }
        }
        assert_eq!(nearest_sources(&[false, false], 2), [0, 1]);
        assert_eq!(nearest_sources(&[], 0), [0usize; 0]);
    }
}
