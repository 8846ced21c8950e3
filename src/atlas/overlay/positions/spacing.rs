//! Positions that keep a prescribed order, with room between them.
//!
//! *Enters:* wanted fractions of an edge, in the order that the integers say. *Leaves:* fractions that increase strictly.
//! *Guaranteed:* for any input (NaN included) neighbours, and the ends 0 and 1, are at least about `spacing` / (n + 1) apart.
//! *Not guaranteed:* that a value stays where it was wanted; where the order allows it, it does.

/// Fraction of an edge that all its crossings together may be pushed to make room: n crossings keep a distance of
/// `SPACING / (n + 1)` from each other and from the ends. For flat patches, which are to be as conformal as the flow left them.
pub const SPACING: f64 = 1e-7;
/// The same for a grid, whose map is relaxed afterwards: what lies between crossings that are nearer is too thin for float64 to tell angles from lengths, or lines from vertices.
pub const SPACING_UNDER_GRID: f64 = 1e-4;

/// Replaces what is not finite by even steps between its known neighbours; 0 and 1 stand before and after the list.
pub(super) fn fill(values: &mut [f64]) {
    let mut start = 0;
    while start < values.len() {
        if values[start].is_finite() {
            start += 1;
            continue;
        }
        let end = (start..values.len())
            .find(|&i| values[i].is_finite())
            .unwrap_or(values.len());
        let before = if start == 0 { 0.0 } else { values[start - 1] };
        let after = if end == values.len() {
            1.0
        } else {
            values[end]
        };
        let step = (after - before) / (end - start + 1) as f64;
        for (k, value) in values[start..end].iter_mut().enumerate() {
            *value = before + step * (k + 1) as f64;
        }
        start = end;
    }
}

/// Moves the values, which must be finite, as little as needed (least squares) to make them increase by steps of at least
/// `spacing / (n + 1)`, the ends 0 and 1 included. `blocks` is scratch space.
pub(super) fn spread(values: &mut [f64], spacing: f64, blocks: &mut Vec<(f64, usize)>) {
    let step = spacing / (values.len() + 1) as f64;
    // Without the steps that it must keep, the sequence has only to be nondecreasing within [0, 1 − spacing]:
    // isotonic regression by pooling adjacent violators. Clamping commutes with it.
    blocks.clear();
    for (i, &value) in values.iter().enumerate() {
        let wanted = (value - (i + 1) as f64 * step).clamp(0.0, 1.0 - spacing);
        let mut block = (wanted, 1);
        while let Some(&(mean, count)) = blocks.last() {
            if mean <= block.0 {
                break;
            }
            let total = count + block.1;
            block.0 += (mean - block.0) * (count as f64 / total as f64);
            block.1 = total;
            blocks.pop();
        }
        blocks.push(block);
    }
    let mut i = 0;
    for &(mean, count) in blocks.iter() {
        for _ in 0..count {
            values[i] = mean + (i + 1) as f64 * step;
            i += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Smallest distance between neighbours, ends included, in units of the promised one.
    fn smallest_gap(values: &[f64], spacing: f64) -> f64 {
        let ends = [0.0].iter().chain(values).zip(values.iter().chain(&[1.0]));
        let promised = spacing / (values.len() + 1) as f64;
        ends.map(|(a, b)| (b - a) / promised)
            .fold(f64::INFINITY, f64::min)
    }

    fn done(values: &[f64]) -> Vec<f64> {
        with_room(values, SPACING)
    }

    fn with_room(values: &[f64], spacing: f64) -> Vec<f64> {
        let mut values = values.to_vec();
        fill(&mut values);
        spread(&mut values, spacing, &mut Vec::new());
        values
    }

    #[test]
    fn what_is_in_order_stays() {
        let wanted = [0.1, 0.2, 0.200_001, 0.9];
        for (a, b) in done(&wanted).iter().zip(wanted) {
            assert!((a - b).abs() < 1e-15);
        }
        assert!(done(&[]).is_empty());
    }

    #[test]
    fn missing_values_are_spaced_evenly() {
        let n = f64::NAN;
        let got = done(&[n, 0.5, n, n, 0.8, f64::INFINITY]);
        for (a, b) in got.iter().zip([0.25, 0.5, 0.6, 0.7, 0.8, 0.9]) {
            assert!((a - b).abs() < 1e-12, "{got:?}");
        }
        assert!((done(&[n])[0] - 0.5).abs() < 1e-12);
    }

    #[test]
    fn any_input_leaves_room() {
        let mut state = 7u64;
        let mut random = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        for n in [1, 2, 3, 10, 1000, 100_000] {
            let cases: [Vec<f64>; 5] = [
                vec![0.0; n],
                vec![1.0; n],
                (0..n).map(|i| 1.0 - i as f64 / n as f64).collect(),
                (0..n).map(|_| random()).collect(),
                (0..n).map(|_| 1e3 * (random() - 0.5)).collect(),
            ];
            for case in cases {
                for spacing in [SPACING, SPACING_UNDER_GRID] {
                    let gap = smallest_gap(&with_room(&case, spacing), spacing);
                    assert!(gap > 0.99, "{n}: {gap}");
                }
            }
        }
    }
}
