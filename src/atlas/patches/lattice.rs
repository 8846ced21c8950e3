//! Texels of all patches on one lattice of the central chart.
//!
//! *Enters:* patches whose rectangles are parallel to the chart's axes. *Leaves:* rasters whose texels are the squares of a lattice through the chart's origin, or squares two, four, … times as
//! wide or narrow on lattices that the first refines or is refined by.
//!
//! *Guaranteed:* where two patches meet off the cut, texels of one size are the same squares, and each texel of the coarser patch is 4, 16, … whole texels of the finer one. Across the
//! cut rows go on as rows or columns where the transition is a quarter turn; the squares themselves coincide only where its translation is a whole number of texels, which a
//! metric with given curvatures does not promise. As far as float64 resolves the chart, except for patches that are too thin for square texels.
//!
//! A texel's width is one of a power of two apart, so budgets are met less exactly than without a lattice; of a few first widths between two powers the one with the least error is taken.

use super::demand::{self, Sums};
use super::params::PatchParams;
use super::rectangle::Oriented;
use super::resolution::{
    MOST_TO_COVER, Raster, coarsest_of, covered, demands, densest, enough_long_side, least_covered,
    shapes, stretched,
};
use crate::atlas::patch::MAX_SIDE;
use crate::atlas::plane::rotate;
use rayon::prelude::*;

/// First widths that are tried between one and twice that.
const FIRST_WIDTHS: usize = 8;
/// A rectangle's side that lies on a line of the lattice but for its last digits gains no texel: in texels.
const ON_LINE: f64 = 1e-6;

/// Rasters of all patches; `sums` are their areas and bends.
pub(super) fn rasters(patches: &[Oriented], sums: &[Sums], params: &PatchParams) -> Vec<Raster> {
    let demands = demands(patches, sums);
    let coarsest = coarsest_of(patches, enough_long_side(shapes(patches), params), params);
    let tried = (0..FIRST_WIDTHS).into_par_iter().map(|i| {
        let first = (i as f64 / FIRST_WIDTHS as f64).exp2();
        let snapped = |i: usize, texel: f64| {
            let level = level(first, texel.min(coarsest[i]), coarsest[i]);
            first * level.max(finest(first, &patches[i], params)).exp2()
        };
        let texels = |i: usize, texel: f64| {
            let raster = on_lattice(&patches[i], snapped(i, texel), params);
            (raster.width * raster.height) as f64
        };
        let budget = demand::budget_of(&demands, params, texels);
        let widths: Vec<f64> = (0..patches.len())
            .map(|i| snapped(i, demands[i].texel(&budget)))
            .collect();
        let error: f64 = demands.iter().zip(&widths).map(|(d, &w)| d.error(w)).sum();
        let used: f64 = (0..patches.len()).map(|i| texels(i, widths[i])).sum();
        (error, -used, widths)
    });
    let tried: Vec<(f64, f64, Vec<f64>)> = tried.collect();
    // Of equals, as where nothing bends, the one with most texels; never more than the budget if that is possible.
    let over = |used: f64| -used > params.texel_budget as f64;
    let best = tried.into_iter().min_by(|a, b| {
        over(a.1)
            .cmp(&over(b.1))
            .then(a.0.total_cmp(&b.0))
            .then(a.1.total_cmp(&b.1))
    });
    let widths = best.map_or(Vec::new(), |best| best.2);
    let rows = patches.par_iter().zip(widths);
    rows.map(|(patch, width)| whole(patch, width, params))
        .collect()
}

/// The power of two by which the first width is nearest to a texel's in the logarithm, but not above the coarsest.
fn level(first: f64, texel: f64, coarsest: f64) -> f64 {
    let level = (texel / first).log2().round();
    if first * level.exp2() > coarsest {
        (coarsest / first).log2().floor()
    } else {
        level
    }
}

/// The lowest power whose image is not too large.
fn finest(first: f64, patch: &Oriented, params: &PatchParams) -> f64 {
    // One texel more than the rectangle has, since its sides need not lie on lines.
    let most = MAX_SIDE as f64 - 2.0 * params.padding as f64 - 1.0;
    (patch.to_chart.scale / most / first).log2().ceil()
}

/// The raster with texels of this width or, where these miss the patch, of half or a quarter of it, as long as its image does not get large for that.
fn whole(patch: &Oriented, mut width: f64, params: &PatchParams) -> Raster {
    let least = least_covered(params);
    loop {
        let raster = on_lattice(patch, width, params);
        if covered(patch, &raster, least) >= least {
            return raster;
        }
        let is_finest = 2 * raster.width.max(raster.height) > MAX_SIDE
            || raster.width * raster.height >= MOST_TO_COVER;
        if is_finest {
            // Whole texels, or rounding would take them from the margin.
            let columns = raster.density[0].ceil().clamp(1.0, densest(params));
            return stretched(patch.height, columns, params.padding as f64);
        }
        width *= 0.5;
    }
}

/// The squares of this width, in units of the chart, that the patch's rectangle touches.
fn on_lattice(patch: &Oriented, width: f64, params: &PatchParams) -> Raster {
    let margin = params.padding as f64;
    let to_chart = &patch.to_chart;
    let density = to_chart.scale / width;
    // The chart's origin from the rectangle's lower left corner, in texels.
    let origin = rotate(to_chart.translation.map(|t| -t / width), -to_chart.rotation);
    let along = |i: usize, extent: f64| {
        // Beyond 2⁵² texels from the origin no line is known, and the rectangle begins on one.
        let into_first = -origin[i] - (-origin[i] + ON_LINE).floor();
        let count = (into_first + extent * density - ON_LINE).ceil().max(1.0);
        (margin + into_first, count + 2.0 * margin)
    };
    let (left, columns) = along(0, 1.0);
    let (below, rows) = along(1, patch.height);
    Raster {
        width: columns as usize,
        height: rows as usize,
        texel_to_patch: [
            [1.0 / density, 0.0, -left / density],
            [0.0, -1.0 / density, (rows - below) / density],
        ],
        density: [density; 2],
        margin,
        low: [left, below],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::patches::rectangle::{Directions, in_rectangle};
    use crate::atlas::raster::to_texel;
    use std::f64::consts::FRAC_PI_4;

    /// A patch that is a square on its corner, which fills half of its rectangle, or is squeezed.
    fn patch(middle: [f64; 2], radius: [f64; 2]) -> (Oriented, Sums) {
        let corner = |k: usize| {
            let (sine, cosine) = (2.0 * FRAC_PI_4 * k as f64).sin_cos();
            [middle[0] + radius[0] * cosine, middle[1] + radius[1] * sine]
        };
        let corners = [0, 2].map(|k| [corner(k), corner(k + 1), corner((k + 2) % 4)]);
        let flat = 2.0 * radius[0] * radius[1];
        let sums = Sums {
            area: flat,
            flat,
            bend: [0.0, 3.0 * flat * radius[0].powi(-4)],
        };
        (in_rectangle(&corners, flat, Directions::Axes), sums)
    }

    fn patches() -> (Vec<Oriented>, Vec<Sums>) {
        let mut state = 11u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(99);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let rows = (0..20).map(|_| {
            let middle = [0, 1].map(|_| 20.0 * random() - 10.0);
            let radius = [0, 1].map(|_| (3.0 * random() - 2.0).exp());
            patch(middle, radius)
        });
        rows.unzip()
    }

    fn used(rasters: &[Raster]) -> usize {
        rasters.iter().map(|r| r.width * r.height).sum()
    }

    #[test]
    fn corners_of_texels_are_points_of_the_lattice() {
        let (patches, sums) = patches();
        for padding in [0, 3] {
            let params = PatchParams {
                padding,
                ..PatchParams::default()
            };
            let rasters = rasters(&patches, &sums, &params);
            let budget = params.texel_budget;
            assert!((budget * 3 / 4..=budget).contains(&used(&rasters)));
            let widths: Vec<f64> = rasters
                .iter()
                .zip(&patches)
                .map(|(r, p)| p.to_chart.scale / r.density[0])
                .collect();
            let levels: std::collections::BTreeSet<i64> = widths
                .iter()
                .map(|w| (w / widths[0]).log2().round() as i64)
                .collect();
            assert!(levels.len() >= 2, "{levels:?}");
            for ((r, p), width) in rasters.iter().zip(&patches).zip(&widths) {
                let level = (width / widths[0]).log2();
                assert!((level - level.round()).abs() < 1e-12);
                for corner in [[0, 0], [r.width, r.height], [0, r.height]] {
                    let [x, y] = corner.map(|k| k as f64);
                    let m = r.texel_to_patch;
                    let q = m.map(|[a, b, c]| a * x + b * y + c);
                    let q = p.to_chart.apply(q).map(|q| q / width);
                    assert!(q.iter().all(|q| (q - q.round()).abs() < 1e-9), "{q:?}");
                }
                // The rectangle lies inside, and no row or column more than needed.
                let margin = padding as f64;
                for (q, is_upper) in [([0.0, 0.0], false), ([1.0, p.height], true)] {
                    let [x, y] = to_texel(&r.texel_to_patch, q);
                    let y = r.height as f64 - y;
                    let inside = if is_upper {
                        [r.width as f64 - x, r.height as f64 - y]
                    } else {
                        [x, y]
                    };
                    let fits = |d: f64| (-1e-5..1.0).contains(&(d - margin));
                    assert!(inside.into_iter().all(fits), "{inside:?}");
                }
            }
        }
    }

    #[test]
    fn no_level_higher_or_lower_lowers_the_error_for_as_many_texels() {
        let (patches, sums) = patches();
        let params = PatchParams {
            padding: 0,
            ..PatchParams::default()
        };
        let rasters = rasters(&patches, &sums, &params);
        let demands = demands(&patches, &sums);
        let width = |i: usize| patches[i].to_chart.scale / rasters[i].density[0];
        let mut tried = 0;
        for giver in 0..patches.len() {
            for taker in (0..patches.len()).filter(|&i| i != giver) {
                let (from, to) = (width(giver), width(taker));
                let coarse = on_lattice(&patches[giver], 2.0 * from, &params);
                let fine = on_lattice(&patches[taker], 0.5 * to, &params);
                let spent = used(&[fine]) + used(&[coarse]);
                if spent
                    > rasters[giver].width * rasters[giver].height
                        + rasters[taker].width * rasters[taker].height
                {
                    continue;
                }
                let change = demands[giver].error(2.0 * from) - demands[giver].error(from)
                    + demands[taker].error(0.5 * to)
                    - demands[taker].error(to);
                // Widths are nearest in the logarithm, which is within a factor of √2 of what is worth it.
                assert!(change > -0.5 * demands[taker].error(to), "{giver} {taker}");
                tried += 1;
            }
        }
        assert!(tried > 20, "{tried}");
    }

    #[test]
    fn patches_out_of_reach_of_numbers_are_covered() {
        let params = PatchParams {
            texel_budget: 5000,
            ..PatchParams::default()
        };
        for radius in [[1e-20, 1e-20], [1e3, 1e-9], [1e-300, 1e-300], [1.0, 0.0]] {
            let (far, of_far) = patch([3.0, -5.0], [1.0, 1.0]);
            let (mut tiny, mut sums) = patch([0.0, 0.0], radius);
            tiny.to_chart.translation = [2.0, 7.0];
            sums.bend = [0.0; 2];
            let height = tiny.height;
            let rasters = rasters(&[far, tiny], &[of_far, sums], &params);
            let r = &rasters[1];
            assert!(r.width.max(r.height) <= MAX_SIDE, "{r:?}");
            for q in [[0.0, 0.0], [1.0, height]] {
                let [x, y] = to_texel(&r.texel_to_patch, q);
                let margin = params.padding as f64 - 1e-5;
                assert!(
                    x >= margin && x <= r.width as f64 - margin,
                    "{radius:?} {r:?}"
                );
                assert!(
                    y >= margin && y <= r.height as f64 - margin,
                    "{radius:?} {r:?}"
                );
            }
        }
    }

    #[test]
    fn where_nothing_bends_the_budget_is_used() {
        let (patch, sums) = patch([0.3, 0.4], [1.0, 0.9]);
        let sums = Sums {
            bend: [0.0; 2],
            ..sums
        };
        let params = PatchParams {
            padding: 0,
            ..PatchParams::default()
        };
        let texels = used(&rasters(&[patch], &[sums], &params));
        // The eighth of a power of two between tried widths is this factor of texels.
        let least = params.texel_budget as f64 / 2f64.powf(2.0 / FIRST_WIDTHS as f64) - 2048.0;
        assert!(
            (least..=params.texel_budget as f64).contains(&(texels as f64)),
            "{texels}"
        );
    }
}
