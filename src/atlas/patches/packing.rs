//! Rectangles in a square, by skyline: each goes to the lowest place, then the leftmost.

/// Lower left corners of rectangles (width, height) that overlap nowhere, and the side of a square that
/// holds them all. Whole numbers, so the result is the same everywhere.
pub(crate) fn pack(sizes: &[[usize; 2]]) -> (Vec<[usize; 2]>, usize) {
    let order = highest_first(sizes);
    let widest = sizes.iter().map(|s| s[0]).max().unwrap_or(1);
    let area: usize = sizes.iter().map(|s| s[0] * s[1]).sum();
    let root = (area as f64).sqrt();
    // A wider strip is a lower one; the best square is found by trying.
    (0..=16)
        .map(|i| (root * (1.0 + 0.05 * f64::from(i))).ceil() as usize)
        .map(|width| width.max(widest))
        .map(|width| strip(sizes, &order, width))
        .min_by_key(|(_, side)| *side)
        .unwrap_or_default()
}

/// Lower left corners in a square of a given side, where they fit into it.
pub(super) fn pack_into(sizes: &[[usize; 2]], side: usize) -> Option<Vec<[usize; 2]>> {
    if sizes.iter().flatten().any(|&n| n > side) {
        return None;
    }
    let (corners, found) = strip(sizes, &highest_first(sizes), side);
    let narrow = (found > side).then(|| pack(sizes));
    let (corners, found) = narrow.unwrap_or((corners, found));
    (found <= side).then_some(corners)
}

fn highest_first(sizes: &[[usize; 2]]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&i| (std::cmp::Reverse([sizes[i][1], sizes[i][0]]), i));
    order
}

/// Packs into a strip of the given width; the side is that of the square around what came out.
fn strip(sizes: &[[usize; 2]], order: &[usize], width: usize) -> (Vec<[usize; 2]>, usize) {
    let mut corners = vec![[0; 2]; sizes.len()];
    // (left end, height) of every step of the skyline; the last one ends at `width`.
    let mut skyline = vec![(0usize, 0usize)];
    let mut side = 1;
    for &i in order {
        let [w, h] = sizes[i];
        let mut best: Option<(usize, usize)> = None;
        for (first, &(x, _)) in skyline.iter().enumerate() {
            if x + w > width {
                break;
            }
            let under = skyline[first..].iter().take_while(|s| s.0 < x + w);
            let y = under.map(|s| s.1).max().unwrap_or(0);
            if best.is_none_or(|b| (y, x) < b) {
                best = Some((y, x));
            }
        }
        // No rectangle is wider than the strip, so the leftmost step always has a place.
        let (y, x) = best.unwrap_or_default();
        corners[i] = [x, y];
        side = side.max(x + w).max(y + h);
        raise(&mut skyline, x, x + w, y + h, width);
    }
    (corners, side)
}

/// The skyline after a rectangle from `left` to `right` with its top at `top`.
fn raise(skyline: &mut Vec<(usize, usize)>, left: usize, right: usize, top: usize, width: usize) {
    let behind = skyline
        .iter()
        .rev()
        .find(|s| s.0 <= right)
        .map_or(0, |s| s.1);
    skyline.retain(|s| s.0 < left || s.0 > right);
    let at = skyline.partition_point(|s| s.0 < left);
    skyline.insert(at, (left, top));
    if right < width {
        skyline.insert(at + 1, (right, behind));
    }
    skyline.dedup_by_key(|s| s.1);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_lie_apart_inside_the_square() {
        let mut state = 7u64;
        let mut random = |n: u64| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(99);
            ((state >> 33) % n) as usize + 1
        };
        for count in [1usize, 2, 7, 60, 200] {
            let sizes: Vec<[usize; 2]> = (0..count).map(|_| [random(90), random(40)]).collect();
            let (corners, side) = pack(&sizes);
            let mut taken = vec![false; side * side];
            for (c, s) in corners.iter().zip(&sizes) {
                assert!(c[0] + s[0] <= side && c[1] + s[1] <= side);
                for y in c[1]..c[1] + s[1] {
                    for x in c[0]..c[0] + s[0] {
                        assert!(!std::mem::replace(&mut taken[side * y + x], true));
                    }
                }
            }
            let area: usize = sizes.iter().map(|s| s[0] * s[1]).sum();
            assert!(count < 60 || area as f64 > 0.7 * (side * side) as f64);
        }
        assert_eq!(pack_into(&[[5, 3], [5, 2]], 5), Some(vec![[0, 0], [0, 3]]));
        assert_eq!(pack_into(&[[5, 3], [5, 3]], 5), None);
        assert_eq!(pack_into(&[[6, 1]], 5), None);
        assert_eq!(pack(&[[5, 5]]), (vec![[0, 0]], 5));
        assert_eq!(pack(&[[5, 3]]).1, 5);
    }
}
