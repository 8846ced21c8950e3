//! How many texels each patch gets: as its [demand](super::demand) says, so that the error is as small as the budget lets it be, with a floor so
//! that no patch is too coarse to be of use.
//!
//! First texels are square ([`rasters`]). Images with such texels tell how the surface bends along and across each patch; with that, columns and rows get
//! numbers of their own ([`adapted`]), since on a tube texels along it may be longer.

use super::demand::{self, Demand, Sums};
use super::params::PatchParams;
use super::rectangle::Oriented;
use crate::atlas::patch::MAX_SIDE;
use crate::atlas::raster::{cover, to_texel};
use crate::atlas::texels::{Bend, Shares};

/// Least texels on the shorter side, where that does not make the longer one absurd …
const MIN_SHORT_SIDE: f64 = 8.0;
/// … or this part of what the longer side must have, where that is less: who asks for small images wants them narrow too.
const MIN_SHORT_PART: f64 = 0.5;
/// The shorter side asks for no more than this on the longer one …
const ENOUGH_LONG_SIDE: f64 = 1024.0;
/// … and for half as much, and so on, where the least images of all patches together have more texels than this, and than the budget this many times:
/// thousands of patches a thousand times as long as wide are no reason for fifty times the texels.
const MOST_IN_FLOORS: f64 = (1 << 20) as f64;
/// See [`MOST_IN_FLOORS`].
const MOST_BUDGETS: f64 = 4.0;
/// An image gets no larger than this only to have texel centres inside a patch that is a thin arc.
pub(super) const MOST_TO_COVER: usize = 1 << 16;
/// Part of the texels in a square of the least shorter side whose centres a patch covers.
const MIN_COVERED: f64 = 0.375;

/// The raster of one patch.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Raster {
    /// Columns of the image.
    pub width: usize,
    /// Rows of the image.
    pub height: usize,
    /// See [`super::Patch::texel_to_patch`].
    pub texel_to_patch: [[f64; 3]; 2],
    /// Texels a unit of u, and as many of v.
    pub density: [f64; 2],
    /// Columns and rows between the image's border and the patch's rectangle, at least.
    pub margin: f64,
    /// Columns left of the rectangle, and rows below it.
    pub low: [f64; 2],
}

/// Rasters of all patches; `sums` are their areas and bends.
pub(super) fn rasters(patches: &[Oriented], sums: &[Sums], params: &PatchParams) -> Vec<Raster> {
    let margin = params.padding as f64;
    let most = densest(params);
    let demands = demands(patches, sums);
    let coarsest = coarsest_of(patches, enough_long_side(shapes(patches), params), params);
    let budget = demand::budget(&demands, &coarsest, params);
    let least = least_covered(params);
    let texels = demands.iter().zip(&coarsest);
    let texels = texels.map(|(demand, &coarsest)| demand.texel(&budget).min(coarsest));
    patches
        .iter()
        .zip(texels)
        .map(|(patch, texel)| {
            let density = patch.to_chart.scale / texel;
            // Whole texels on the longer side. Half a texel off a floor there is no tie.
            let mut columns = (density.min(most) + 0.5).floor().max(1.0);
            loop {
                let raster = isotropic(patch.height, columns, margin);
                if covered(patch, &raster, least) >= least {
                    return raster;
                }
                if columns >= most || raster.width * raster.height >= MOST_TO_COVER {
                    return stretched(patch.height, columns, margin);
                }
                columns = (2.0 * columns).min(most);
            }
        })
        .collect()
}

/// What patches ask for; `sums` are their areas and bends.
pub(super) fn demands(patches: &[Oriented], sums: &[Sums]) -> Vec<Demand> {
    let demand = |(patch, sums): (&Oriented, &Sums)| {
        let width = patch.to_chart.scale;
        let sides = [width, width * patch.height];
        Demand { sums: *sums, sides }
    };
    patches.iter().zip(sums).map(demand).collect()
}

/// Height and area of patches in units of their longer sides.
pub(super) fn shapes(patches: &[Oriented]) -> impl Iterator<Item = [f64; 2]> + Clone + '_ {
    patches.iter().map(|p| [p.height, p.area])
}

/// What the shorter side may ask for on the longer one, for patches of these heights and areas.
pub(super) fn enough_long_side(
    shapes: impl Iterator<Item = [f64; 2]> + Clone,
    params: &PatchParams,
) -> f64 {
    let margin = 2.0 * params.padding as f64;
    let most = (MOST_BUDGETS * params.texel_budget as f64).max(MOST_IN_FLOORS);
    let texels = |enough: f64| -> f64 {
        let of = shapes.clone().map(|[height, area]| {
            let columns = least_density(height, area, enough, params);
            (columns + margin) * ((columns * height).max(1.0) + margin)
        });
        of.sum()
    };
    let mut enough = ENOUGH_LONG_SIDE;
    while enough > params.min_side as f64 && texels(enough) > most {
        enough *= 0.5;
    }
    enough
}

/// The widest texels that the images of patches may have; `enough` is [`enough_long_side`].
pub(super) fn coarsest_of(patches: &[Oriented], enough: f64, params: &PatchParams) -> Vec<f64> {
    patches
        .iter()
        .map(|p| p.to_chart.scale / least_density(p.height, p.area, enough, params))
        .collect()
}

/// Rasters with as many texels together as the budget has, for which the error is least; those given are about even.
pub(super) fn adapted(
    patches: &[Oriented],
    even: &[Raster],
    bends: &[Bend],
    params: &PatchParams,
) -> Vec<Raster> {
    let margin = params.padding as f64;
    let enough = enough_long_side(shapes(patches), params);
    let least = patches.iter().flat_map(|patch| {
        let by_area = area_floor(patch.area, enough, params);
        let columns = by_area.max(params.min_side as f64).min(densest(params));
        [columns, least_short(params).max(by_area * patch.height)]
    });
    let content = patches
        .iter()
        .zip(even)
        .flat_map(|(patch, r)| r.content(patch));
    let shares = Shares {
        of_image: (0..patches.len()).map(|i| [2 * i, 2 * i + 1]).collect(),
        least: least.collect(),
        border: 2.0 * margin,
    };
    let intervals = shares.bent(bends, content.collect(), params.texel_budget);
    let covered_least = least_covered(params);
    let raster = |(patch, intervals): (&Oriented, &[f64])| {
        let mut intervals = intervals.to_vec();
        loop {
            let [columns, rows] = intervals[..] else {
                return isotropic(patch.height, densest(params), margin);
            };
            let density = [columns, rows / patch.height.max(1e-12)];
            let raster = raster(patch.height, columns, density, rows, margin);
            let is_finest = columns.max(rows) >= densest(params)
                || raster.width * raster.height >= MOST_TO_COVER;
            if is_finest || covered(patch, &raster, covered_least) >= covered_least {
                return raster;
            }
            let finer = |k: &f64| (2.0 * k).min(densest(params));
            intervals = intervals.iter().map(finer).collect();
        }
    };
    patches
        .iter()
        .zip(intervals.chunks(2))
        .map(raster)
        .collect()
}

impl Raster {
    /// Columns and rows of the patch's rectangle.
    pub fn content(&self, patch: &Oriented) -> [f64; 2] {
        [self.density[0], self.density[1] * patch.height]
    }
}

/// Most texels on the longer side of a patch: its image must have room in the packed square, too.
pub(super) fn densest(params: &PatchParams) -> f64 {
    let side = params.packed_side.unwrap_or(MAX_SIDE).min(MAX_SIDE);
    side.saturating_sub(2 * params.padding.max(1)).max(1) as f64
}

/// Least texels on the shorter side.
fn least_short(params: &PatchParams) -> f64 {
    (MIN_SHORT_PART * params.min_side as f64).min(MIN_SHORT_SIDE)
}

/// Least texel centres inside a patch.
pub(super) fn least_covered(params: &PatchParams) -> usize {
    (MIN_COVERED * least_short(params).powi(2)).ceil() as usize
}

/// Least texels on the longer side of a patch, of which its shorter side and its area are parts.
fn least_density(height: f64, area: f64, enough: f64, params: &PatchParams) -> f64 {
    let least = least_short(params);
    let short_side = least / height.max(f64::MIN_POSITIVE);
    (params.min_side as f64)
        .max(short_side.min(enough))
        .max(area_floor(area, enough, params))
        .min(densest(params))
}

/// Least texels on the longer side of a patch, of whose square its area is a part.
fn area_floor(area: f64, enough: f64, params: &PatchParams) -> f64 {
    let side = least_short(params) / area.max(f64::MIN_POSITIVE).sqrt();
    side.min(enough)
}

/// The widest texel that the image of a patch may have; `enough` is [`enough_long_side`].
pub(super) fn coarsest(demand: &Demand, enough: f64, params: &PatchParams) -> f64 {
    let [height, area] = shape(demand);
    demand.sides[0] / least_density(height, area, enough, params)
}

/// Height and area in units of the longer side.
pub(super) fn shape(demand: &Demand) -> [f64; 2] {
    let [longer, shorter] = demand.sides;
    [shorter / longer, demand.sums.flat / (longer * longer)]
}

/// Square texels, `columns` of them on the patch's width; its height in the middle of the rows.
fn isotropic(height: f64, columns: f64, margin: f64) -> Raster {
    // A height of a whole number of texels must not gain a row by its last digits.
    let rows = (columns * height - 1e-6).ceil().max(1.0);
    raster(height, columns, [columns, columns], rows, margin)
}

/// Last resort for patches thousands of times longer than wide: rows closer together than columns.
pub(super) fn stretched(height: f64, columns: f64, margin: f64) -> Raster {
    let rows = 2.0 * MIN_SHORT_SIDE;
    let density = rows / height.max(1e-12);
    raster(height, columns, [columns, density], rows, margin)
}

fn raster(height: f64, columns: f64, density: [f64; 2], rows: f64, margin: f64) -> Raster {
    let image = [columns, rows].map(|n| (n + 2.0 * margin).round());
    let left = 0.5 * (image[0] - density[0]);
    let bottom = 0.5 * (image[1] - density[1] * height);
    Raster {
        width: image[0] as usize,
        height: image[1] as usize,
        texel_to_patch: [
            [1.0 / density[0], 0.0, -left / density[0]],
            [0.0, -1.0 / density[1], (image[1] - bottom) / density[1]],
        ],
        density,
        margin,
        low: [left, bottom],
    }
}

/// Number of texel centres inside the patch, up to a little more than what is asked for.
pub(super) fn covered(patch: &Oriented, raster: &Raster, least: usize) -> usize {
    let mut seen = std::collections::BTreeSet::new();
    for t in &patch.uv {
        let t = t.map(|p| to_texel(&raster.texel_to_patch, p));
        cover(t, raster.width, raster.height, |x, y, _| {
            if seen.len() < least {
                seen.insert((x, y));
            }
        });
        if seen.len() >= least {
            break;
        }
    }
    seen.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::plane::Similarity;

    fn rectangle(height: f64) -> Oriented {
        let (a, b, c, d) = ([0.0, 0.0], [1.0, 0.0], [1.0, height], [0.0, height]);
        Oriented {
            uv: vec![[a, b, c], [a, c, d]],
            height,
            area: height,
            to_chart: Similarity {
                scale: 1.0,
                rotation: 0.0,
                translation: [0.0; 2],
            },
        }
    }

    /// Nothing bends.
    fn even(area: f64, flat: f64) -> Sums {
        let bend = [0.0; 2];
        Sums { area, flat, bend }
    }

    #[test]
    fn one_square_patch_gets_the_budget() {
        let params = PatchParams::default();
        let r = rasters(&[rectangle(1.0)], &[even(1.0, 1.0)], &params);
        assert_eq!((r[0].width, r[0].height), (512, 512));
        // The same up to the last digits.
        for height in [1.0 - 1e-11, 1.0 + 1e-11] {
            let near = rasters(&[rectangle(height)], &[even(3.0, height)], &params);
            assert_eq!((near[0].width, near[0].height), (512, 512));
        }
    }

    #[test]
    fn texels_follow_source_area_down_to_the_floor() {
        let params = PatchParams::default();
        let patches = [
            rectangle(1.0),
            rectangle(0.5),
            rectangle(0.25),
            rectangle(1.0),
        ];
        let areas = [4.0, 1.0, 1.0, 1e-9];
        let sums = [0, 1, 2, 3].map(|i| even(areas[i], patches[i].height));
        let r = rasters(&patches, &sums, &params);
        let inside = |i: usize| r[i].density[0] * r[i].density[1] * patches[i].height;
        assert!((inside(0) / inside(1) / 4.0 - 1.0).abs() < 0.02);
        assert!((inside(1) / inside(2) - 1.0).abs() < 0.02);
        assert_eq!(r[3].density[0], params.min_side as f64);
        let total: f64 = r.iter().map(|r| (r.width * r.height) as f64).sum();
        assert!((total / params.texel_budget as f64 - 1.0).abs() < 0.02);
    }

    #[test]
    fn small_least_sides_hold_for_the_shorter_side_too() {
        let columns = |min_side| {
            let params = PatchParams {
                texel_budget: 1,
                min_side,
                ..PatchParams::default()
            };
            rasters(&[rectangle(0.1)], &[even(1.0, 0.1)], &params)[0].density[0]
        };
        assert_eq!([4, 8, 16, 32].map(columns), [20.0, 40.0, 80.0, 80.0]);
    }

    #[test]
    fn many_long_patches_do_not_ask_for_many_budgets() {
        let params = PatchParams::default();
        let texels = |count: usize| {
            let patches: Vec<Oriented> = (0..count).map(|_| rectangle(1e-3)).collect();
            let r = rasters(&patches, &vec![even(1.0, 1e-3); count], &params);
            let texels = r.iter().map(|r| r.width * r.height);
            texels.sum::<usize>() as f64 / params.texel_budget as f64
        };
        // A few keep what makes them useful; very many never fall below the least longer side.
        assert!(texels(10) * 262144.0 > 10.0 * 1024.0);
        assert!(texels(1000) < 1.2 * MOST_BUDGETS, "{}", texels(1000));
        assert!(
            texels(4000) < 4000.0 * 20.0 * 30.0 / 262144.0,
            "{}",
            texels(4000)
        );
    }

    #[test]
    fn every_patch_lies_in_its_image_and_is_covered() {
        for padding in [0, 1, 5] {
            let params = PatchParams {
                padding,
                texel_budget: 1,
                ..Default::default()
            };
            for height in [1.0, 0.3, 0.01, 1e-5, 1e-9, 0.0] {
                let patch = rectangle(height);
                let r = &rasters(&[rectangle(height)], &[even(1.0, height)], &params)[0];
                for p in patch.uv.iter().flatten() {
                    let [x, y] = to_texel(&r.texel_to_patch, *p);
                    let margin = padding as f64 - 1e-5;
                    assert!(x >= margin && x <= r.width as f64 - margin);
                    assert!(y >= margin && y <= r.height as f64 - margin, "{y} {r:?}");
                }
                assert!(r.width.max(r.height) <= MAX_SIDE);
                assert!(height == 0.0 || covered(&patch, r, 24) >= least_covered(&params));
            }
        }
    }
}
