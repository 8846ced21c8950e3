//! Sharp edges of noise and of solids: chains of the first are ridges as often as valleys.
//!
//! *Enters:* which edges of a chain are of a ridge. *Leaves:* the chance that noise has such a chain, and how small it must be that no more than a tenth of the chains that count are noise. *Source:* the sign test, and Benjamini and Hochberg, Controlling the false discovery rate, 1995.

use std::f64::consts::LN_2;

/// Part of the chains that count which may be noise.
const FALSE: f64 = 0.1;

/// How likely it is that, of as many edges that are of a ridge or of a valley by chance, as many or more are of the same kind as here (sign test, both ways).
pub(super) fn chance(kinds: &[bool]) -> f64 {
    let n = kinds.len();
    let ridges = kinds.iter().filter(|k| **k).count();
    let others = ridges.min(n - ridges);
    // Of all ways in which so few are others; logarithms, since 2⁻ⁿ may be too small for a number.
    let (mut ways, mut sum) = (-(n as f64) * LN_2, 0.0);
    for k in 0..=others {
        sum += f64::exp(ways);
        ways += ((n - k) as f64 / (k + 1) as f64).ln();
    }
    (2.0 * sum).min(1.0)
}

/// Most that the chance of a chain may be among these, so that of all chains that have no more, [`FALSE`] of them are noise on average; 0 where none is so unlikely.
pub(super) fn most(mut chances: Vec<f64>) -> f64 {
    chances.sort_by(f64::total_cmp);
    let n = chances.len() as f64;
    // Of noise alone, n times as many as the chance says have no greater one.
    let is_met =
        |(k, &chance): (usize, &f64)| (chance * n <= FALSE * (k + 1) as f64).then_some(chance);
    chances
        .iter()
        .enumerate()
        .rev()
        .find_map(is_met)
        .unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sharp edges of noise go up and down; those that marching cubes leave at a rim do so now and then.
    #[test]
    fn the_sign_test_is_that_of_tossed_coins() {
        let kinds =
            |ridges: usize, valleys: usize| [vec![true; ridges], vec![false; valleys]].concat();
        for n in 1..12usize {
            for ridges in 0..=n {
                // All that can come out.
                let others = ridges.min(n - ridges);
                let is_as_far = |toss: &u32| {
                    let ones = toss.count_ones() as usize;
                    ones.min(n - ones) <= others
                };
                let far = (0..1u32 << n).filter(is_as_far).count();
                let expected = far as f64 / f64::from(1u32 << n);
                assert!((chance(&kinds(ridges, n - ridges)) - expected).abs() < 1e-12);
            }
        }
        assert!(chance(&kinds(5, 0)) <= 1.0 / 16.0 && chance(&kinds(0, 5)) <= 1.0 / 16.0);
        assert!(chance(&kinds(4, 0)) > 1.0 / 16.0 && chance(&kinds(6, 1)) > 1.0 / 16.0);
        assert!(chance(&kinds(14, 3)) <= 1.0 / 16.0 && chance(&kinds(40, 37)) > 1.0 / 16.0);
        assert!(chance(&kinds(5000, 0)) <= 1.0 / 16.0 && chance(&kinds(900, 800)) <= 1.0 / 16.0);
    }

    #[test]
    fn a_tenth_of_what_counts_may_be_noise() {
        assert_eq!(most(Vec::new()), 0.0);
        // Five edges alike count by themselves, and however many there are.
        let five = 1.0 / 16.0;
        assert_eq!(most(vec![five]), five);
        assert_eq!(most(vec![five; 300]), five);
        // Among as many as noise has of them, none does; one of twelve alike does still.
        let noise: Vec<f64> = (1..=32).map(|k| f64::from(k) / 32.0).collect();
        assert_eq!(most(noise.clone()), 0.0);
        let twelve = 1.0 / 2048.0;
        assert_eq!(most([noise, vec![twelve]].concat()), twelve);
        // Beside many of a solid, those of five do too, and of noise a few in a hundred.
        let mixed = [vec![twelve; 20], vec![five; 10], vec![0.4; 10]].concat();
        assert_eq!(most(mixed), five);
    }
}
