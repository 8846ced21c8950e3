//! Points in the order of the Morton curve, on which neighbours in space are mostly near each other.

use rayon::prelude::*;

/// Most bits of a coordinate in a code.
const BITS: u32 = 21;

/// The codes of some points in ascending order, and whose they are; points with the same code by their number. Coordinates must be small enough for their
/// differences to be finite.
pub(crate) fn along_curve(count: usize, point: impl Fn(usize) -> [f64; 3]) -> (Vec<u64>, Vec<u32>) {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in (0..count).map(&point) {
        for i in 0..3 {
            (low[i], high[i]) = (low[i].min(p[i]), high[i].max(p[i]));
        }
    }
    // Code and number in one word, which is quick to sort.
    let of_number = usize::BITS - count.leading_zeros();
    let bits = ((u64::BITS - of_number) / 3).min(BITS);
    let longest = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
    let cells = ((1_u64 << bits) - 1) as f64 / longest.max(f64::MIN_POSITIVE);
    let code = |p: [f64; 3]| {
        // Casts of what is no number are 0.
        let place = |i: usize| spread(((p[i] - low[i]) * cells) as u64);
        place(0) << 2 | place(1) << 1 | place(2)
    };
    let mut words: Vec<u64> = (0..count)
        .map(|number| code(point(number)) << of_number | number as u64)
        .collect();
    words.par_sort_unstable();
    let numbers = words
        .iter()
        .map(|word| (word & ((1 << of_number) - 1)) as u32);
    let numbers = numbers.collect();
    for word in &mut words {
        *word >>= of_number;
    }
    (words, numbers)
}

/// Two zeros before each of the last [`BITS`] bits.
fn spread(x: u64) -> u64 {
    let mut x = x & ((1 << BITS) - 1);
    for (shift, mask) in [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarters_come_one_after_the_other() {
        // A square of 8 by 8 points: the first sixteen are those of one quarter.
        let point = |i: usize| [(i % 8) as f64, (i / 8) as f64, 0.0];
        let (codes, order) = along_curve(64, point);
        assert!(codes.is_sorted());
        for (rank, &i) in order.iter().enumerate() {
            let [x, y, _] = point(i as usize).map(|c| usize::from(c >= 4.0));
            assert_eq!(rank / 16, 2 * x + y);
        }
        let (codes, order) = along_curve(3, |_| [1.0; 3]);
        assert_eq!((codes, order), (vec![0; 3], vec![0, 1, 2]));
        assert_eq!(along_curve(0, |_| [0.0; 3]), (Vec::new(), Vec::new()));
    }
}
