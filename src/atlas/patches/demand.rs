//! What a patch asks of its image: texels for its rectangle, and as many of them as its surface bends.
//!
//! *Enters:* a patch's areas, bend and rectangle. *Leaves:* the texels and the squared error of an image, and the texel that is worth it.
//!
//! An edge inside a patch with dihedral angle θ and length L, whose faces' middles lie a apart, adds about θ² L ℓ³ (1 + ℓ / a) to the integral
//! of the squared distance between the surface and what texels of width ℓ hold of it: a crease where texels are small, a part of a bent surface where they are
//! large. An edge between patches adds nothing, because seam samples are exact. In the plane a texel is h = ℓ e^u wide, so a patch's error is
//! b₃ h³ + b₄ h⁴ with sums over its edges. An image of a rectangle of area B has about B / h² texels. Where all images together may have so many, the error is
//! least when one texel more would lower it by as much in each (a Lagrange multiplier, here *worth*); smooth surfaces of one scale then get h ∝ (B / b₄)^{1/6}.
//!
//! Where nothing bends a texel still is of use, to normals and to what is laid over the images. So none is wider than [`COARSEST`] times what an even spread
//! over the surface gives.

use super::params::PatchParams;

/// Most widths of an even texel. A quarter of the texels at the least.
const COARSEST: f64 = 2.0;

/// What is added up over the faces of a patch.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    /// In space.
    pub area: f64,
    /// In the plane.
    pub flat: f64,
    /// b₃ and b₄.
    pub bend: [f64; 2],
}

impl Sums {
    pub fn and(self, other: Self) -> Self {
        Self {
            area: self.area + other.area,
            flat: self.flat + other.flat,
            bend: [0, 1].map(|i| self.bend[i] + other.bend[i]),
        }
    }

    pub fn times(self, factor: f64) -> Self {
        Self {
            area: factor * self.area,
            flat: factor * self.flat,
            bend: self.bend.map(|bend| factor * bend),
        }
    }
}

/// A patch as its image sees it, in units of the plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Demand {
    pub sums: Sums,
    /// Longer and shorter side of its rectangle.
    pub sides: [f64; 2],
}

/// What all images together may have.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Budget {
    /// Texels an area in space, inside patches, if all had as many.
    pub density: f64,
    /// By how much the squared error must fall for one texel more; 0: texels are spread evenly.
    pub worth: f64,
    /// Texels on either side of a patch.
    pub margin: f64,
}

impl Demand {
    /// Texels of the whole image with texels of this width.
    pub fn texels(&self, texel: f64, margin: f64) -> f64 {
        let [longer, shorter] = self.sides.map(|side| side / texel + 2.0 * margin);
        longer * shorter
    }

    /// ∫ of the squared distance.
    pub fn error(&self, texel: f64) -> f64 {
        let [b3, b4] = self.sums.bend;
        b3 * texel.powi(3) + b4 * texel.powi(4)
    }

    /// Width of a texel where all have one density.
    pub fn even(&self, density: f64) -> f64 {
        (self.sums.flat / (density * self.sums.area)).sqrt()
    }

    /// Width of the texel that is worth it.
    pub fn texel(&self, budget: &Budget) -> f64 {
        let even = self.even(budget.density);
        if budget.worth <= 0.0 {
            return even;
        }
        // One texel more lowers the error by (3 b₃ h⁵ + 4 b₄ h⁶) / 2B.
        let [b3, b4] = self.sums.bend;
        let square = 2.0 * self.sides[0] * self.sides[1];
        let falls = |h: f64| (3.0 * b3 + 4.0 * b4 * h) * h.powi(5) / square;
        let (mut low, mut high) = (0.0, COARSEST * even);
        if falls(high) <= budget.worth {
            return high;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if falls(middle) > budget.worth {
                high = middle;
            } else {
                low = middle;
            }
        }
        high
    }
}

/// What images of these patches may have together, so that they hold `params.texel_budget`. `least` says how wide a texel of each may be at the most.
pub(super) fn budget(demands: &[Demand], least: &[f64], params: &PatchParams) -> Budget {
    let margin = params.padding as f64;
    let texels = |i: usize, texel: f64| demands[i].texels(texel.min(least[i]), margin);
    budget_of(demands, params, texels)
}

/// The same where the image of a patch has so many texels when those of this width are worth it.
pub(super) fn budget_of(
    demands: &[Demand],
    params: &PatchParams,
    texels: impl Fn(usize, f64) -> f64,
) -> Budget {
    let margin = params.padding as f64;
    let most = params.texel_budget as f64;
    let fits = |budget: &Budget| {
        let rows = demands.iter().enumerate();
        let texels = rows.map(|(i, d)| texels(i, d.texel(budget)));
        texels.sum::<f64>() <= most
    };
    let area: f64 = demands.iter().map(|d| d.sums.area).sum();
    let even = |density| Budget {
        density,
        worth: 0.0,
        margin,
    };
    // A patch never fills more than its rectangle.
    let densest = most / area.max(f64::MIN_POSITIVE);
    let (mut low, mut high) = (0.0, densest);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if fits(&even(middle)) {
            low = middle;
        } else {
            high = middle;
        }
    }
    let density = low.max(densest * 1e-9);
    if demands.iter().all(|d| d.sums.bend == [0.0; 2]) {
        return even(density);
    }
    let with = |worth: f64| Budget {
        worth,
        ..even(density)
    };
    // In logarithms: errors are of any size. Where even the coarsest texels are too many, the floors rule.
    let falls = |d: &Demand| d.error(d.even(density)) / d.texels(d.even(density), 0.0);
    let typical = demands
        .iter()
        .map(falls)
        .fold(f64::MIN_POSITIVE, f64::max)
        .ln();
    let (mut low, mut high) = (typical - 60.0, typical + 60.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if fits(&with(middle.exp())) {
            high = middle;
        } else {
            low = middle;
        }
    }
    with(high.exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn demands(count: usize, bends: f64) -> Vec<Demand> {
        let mut state = 5u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(99);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let patch = |_| {
            let longer = 0.2 + random();
            let shorter = longer * (0.2 + 0.8 * random());
            let flat = longer * shorter * (0.4 + 0.6 * random());
            Demand {
                sums: Sums {
                    area: flat * (random() - 0.5).exp(),
                    flat,
                    bend: [0.2 * bends * random(), bends * (4.0 * random()).exp()],
                },
                sides: [longer, shorter],
            }
        };
        (0..count).map(patch).collect()
    }

    fn texels_of(demands: &[Demand], budget: &Budget) -> f64 {
        let texels = demands
            .iter()
            .map(|d| d.texels(d.texel(budget), budget.margin));
        texels.sum()
    }

    #[test]
    fn no_exchange_of_texels_lowers_the_error() {
        let params = PatchParams {
            padding: 0,
            ..PatchParams::default()
        };
        let demands = demands(12, 1.0);
        let free = vec![f64::INFINITY; demands.len()];
        let budget = budget(&demands, &free, &params);
        let total = texels_of(&demands, &budget);
        assert!(
            (total / params.texel_budget as f64 - 1.0).abs() < 1e-6,
            "{total}"
        );
        let mut exchanges = 0;
        for giver in &demands {
            for taker in demands.iter().filter(|d| !std::ptr::eq(*d, giver)) {
                let [from, to] = [giver, taker].map(|d| d.texel(&budget));
                // Nobody gives texels that it must have.
                if from > 0.99 * COARSEST * giver.even(budget.density) {
                    continue;
                }
                let moved = 0.02 * giver.texels(from, 0.0).min(taker.texels(to, 0.0));
                let width = |d: &Demand, texels: f64| (d.sides[0] * d.sides[1] / texels).sqrt();
                let less = width(giver, giver.texels(from, 0.0) - moved);
                let more = width(taker, taker.texels(to, 0.0) + moved);
                let change =
                    giver.error(less) - giver.error(from) + taker.error(more) - taker.error(to);
                // The margins of half a texel are not part of the condition.
                assert!(change > -1e-3 * giver.error(from), "{giver:?} {taker:?}");
                exchanges += 1;
            }
        }
        assert!(exchanges > 60, "{exchanges}");
    }

    #[test]
    fn without_bends_texels_are_spread_evenly() {
        let demands = demands(7, 0.0);
        let free = vec![f64::INFINITY; demands.len()];
        let budget = budget(&demands, &free, &PatchParams::default());
        let of = |d: &Demand| d.sums.flat / d.texel(&budget).powi(2) / d.sums.area;
        for d in &demands {
            assert!((of(d) / of(&demands[0]) - 1.0).abs() < 1e-9);
        }
        let total = texels_of(&demands, &budget);
        assert!((total / (512.0 * 512.0) - 1.0).abs() < 1e-6, "{total}");
    }
}
