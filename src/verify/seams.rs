//! Seams: they run along every border of every patch, and every sample is the same point on both sides.

use super::Verdicts;
use super::arrays::{Arrays, NONE};
use super::document::Document;
use super::formulas::{
    Extent2, Point2, Point3, Worst, diagonal3, distance2, distance3, doubled_area2, sub2,
};
use super::grid::Grid;
use super::patches::{Groups, extent};
use super::surface::Surface;
use crate::parallel;
use rayon::prelude::*;

/// A border edge of a patch: planar and spatial ends.
struct Border {
    uv: Vec<[Point2; 2]>,
    ends: Vec<[Point3; 2]>,
    size: f64,
    grid: Option<Grid>,
}

impl Border {
    fn new(uv: Vec<[Point2; 2]>, ends: Vec<[Point3; 2]>) -> Self {
        let extent = Extent2::of(uv.as_flattened().iter().copied());
        let size = extent.diagonal().max(1e-300);
        let limit = (4096 * uv.len() + 100_000).min(NONE as usize - 1);
        let grid = Grid::new(&uv, 1e-6 * size, limit).ok();
        Self {
            uv,
            ends,
            size,
            grid,
        }
    }

    /// Least distance in space from `x` to a border point that has the planar coordinates `p`; infinite where
    /// `p` lies on no border edge.
    fn distance(&self, p: Point2, x: Point3) -> f64 {
        let Some(grid) = self
            .grid
            .as_ref()
            .filter(|_| p.iter().all(|c| c.is_finite()))
        else {
            return f64::INFINITY;
        };
        let mut least = f64::INFINITY;
        for edge in grid.near(p) {
            let [a, b] = self.uv[*edge as usize];
            let (along, from) = (sub2(b, a), sub2(p, a));
            let length2 = along[0] * along[0] + along[1] * along[1];
            let t = (from[0] * along[0] + from[1] * along[1]) / length2.max(1e-300);
            let t = t.clamp(0.0, 1.0);
            let foot = [a[0] + t * along[0], a[1] + t * along[1]];
            if distance2(foot, p) < 1e-7 * self.size {
                let [a, b] = self.ends[*edge as usize];
                let there = std::array::from_fn(|i| a[i] + t * (b[i] - a[i]));
                least = least.min(distance3(there, x));
            }
        }
        least
    }
}

pub(super) fn check(
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    groups: &Groups,
    verdicts: &mut Verdicts,
) {
    let cut = arrays.cut.as_flattened();
    let patch = |h: usize| arrays.patch[h / 3];
    let is_border = |h: usize| match surface.twin(h) {
        Some(t) => cut[h] != 0 || patch(h) != patch(t),
        None => true,
    };
    let place = |h: usize| [surface.tail(h), surface.head(h)].map(|v| arrays.positions[v]);
    let length = |h: usize| {
        let [a, b] = place(h);
        distance3(a, b)
    };
    let (mut inner, mut outer) = (0.0, 0.0);
    let mut sides = vec![(Vec::new(), Vec::new()); document.patches.len()];
    let border: Vec<usize> = (0..surface.halfedges()).filter(|h| is_border(*h)).collect();
    for &h in &border {
        match surface.twin(h) {
            Some(_) => inner += 0.5 * length(h),
            None => outer += length(h),
        }
        let (f, k) = (h / 3, h % 3);
        let uv = arrays.patch_uv[f];
        let side = &mut sides[arrays.patch[f] as usize];
        side.0.push([uv[(k + 1) % 3], uv[(k + 2) % 3]]);
        side.1.push(place(h));
    }
    let borders: Vec<Border> = sides
        .into_par_iter()
        .map(|(uv, ends)| Border::new(uv, ends))
        .collect();
    let (mut sampled_inner, mut sampled_outer) = (0.0, 0.0);
    for (seam, pair) in arrays.seam_patch.iter().enumerate() {
        let samples = &arrays.seam_position[arrays.seam_range(seam)];
        let run: f64 = samples.windows(2).map(|w| distance3(w[0], w[1])).sum();
        if pair[1] == NONE {
            sampled_outer += run;
        } else {
            sampled_inner += run;
        }
    }
    verdicts.note(
        "seams run along every patch border",
        inner == 0.0 || (sampled_inner - inner).abs() <= 1e-6 * inner,
        format!("{sampled_inner:.6} vs {inner:.6}"),
    );
    if document.is_generated() {
        verdicts.note(
            "seams run along the surface's boundary",
            outer == 0.0 || (sampled_outer - outer).abs() <= 1e-6 * outer,
            format!("{sampled_outer:.6} vs {outer:.6}"),
        );
    }
    let size = diagonal3(&arrays.positions);
    let tallies = parallel::map_numbers(arrays.seam_patch.len(), |seam| {
        let (mut off, mut ill) = (0, 0);
        let mut worst = Worst::default();
        for sample in arrays.seam_range(seam) {
            for side in 0..2 {
                let uv = arrays.seam_uv[sample][side];
                let patch = arrays.seam_patch[seam][side];
                let is_nan = uv.iter().all(|x| x.is_nan());
                if patch == NONE {
                    ill += usize::from(!is_nan);
                    continue;
                }
                ill += usize::from(!uv.iter().all(|x| x.is_finite()));
                let gap = borders[patch as usize].distance(uv, arrays.seam_position[sample]);
                off += usize::from(gap > 1e-6 * size);
                worst.see(gap / size);
            }
        }
        (off, ill, worst)
    });
    let (mut off, mut ill, mut worst) = (0, 0, Worst::default());
    for tally in tallies {
        off += tally.0;
        ill += tally.1;
        worst.see(tally.2.0);
    }
    verdicts.note(
        "seam samples hold the surface point on both sides",
        off == 0,
        format!("{off}; worst {:.2e} of the diagonal", worst.0),
    );
    verdicts.note(
        "seam coordinates are NaN beyond the surface's boundary only",
        ill == 0,
        ill,
    );
    if document.is_generated() {
        let (gap, area) = around_patches(arrays, document, groups);
        verdicts.note(
            "seams close once around every patch",
            gap.0 <= 1e-9 && area.0 <= 1e-6,
            format!("gap {:.2e} of the patch, area off by {:.2e}", gap.0, area.0),
        );
    }
    let lost = unsampled_vertices(surface, arrays, &border, document.is_generated());
    verdicts.note(
        "seams sample every vertex of their chains",
        lost == 0,
        format!("{lost} vertices without a sample"),
    );
}

/// Walked with the patch on the left, its seams must add up to nothing and enclose the area of its faces: what they leave open,
/// relative to the patch's extent, and the error of the area, relative to it.
fn around_patches(arrays: &Arrays, document: &Document, groups: &Groups) -> (Worst, Worst) {
    let count = document.patches.len();
    let area = |patch: usize| -> f64 {
        let faces = groups.of(patch).iter();
        faces
            .map(|f| doubled_area2(arrays.patch_uv[*f as usize]))
            .sum()
    };
    let mut sum = vec![[0.0; 2]; count];
    let mut enclosed = vec![0.0; count];
    for (seam, patches) in arrays.seam_patch.iter().enumerate() {
        for (side, &patch) in patches.iter().enumerate().filter(|(_, p)| **p != NONE) {
            let patch = patch as usize;
            let sign = if side == 0 { 1.0 } else { -1.0 };
            // Seen from a point of the patch, so that nothing is lost.
            let Some(face) = groups.of(patch).first() else {
                continue;
            };
            let from = arrays.patch_uv[*face as usize][0];
            for pair in arrays.seam_uv[arrays.seam_range(seam)].windows(2) {
                let (a, b) = (pair[0][side], pair[1][side]);
                enclosed[patch] += sign * doubled_area2([from, a, b]);
                let step = sub2(b, a);
                for (sum, step) in sum[patch].iter_mut().zip(step) {
                    *sum += sign * step;
                }
            }
        }
    }
    let (mut gap, mut off) = (Worst::default(), Worst::default());
    for patch in 0..count {
        let extent = extent(arrays, groups.of(patch)).diagonal().max(1e-300);
        gap.see(distance2(sum[patch], [0.0; 2]) / extent);
        off.see((enclosed[patch] / area(patch) - 1.0).abs());
    }
    (gap, off)
}

/// Border vertices at which no sample lies.
fn unsampled_vertices(
    surface: &Surface<'_>,
    arrays: &Arrays,
    border: &[usize],
    with_boundary: bool,
) -> usize {
    let key = |p: &Point3| p.map(|x| (x + 0.0).to_bits());
    let samples: std::collections::HashSet<[u64; 3]> =
        arrays.seam_position.iter().map(key).collect();
    let mut needed = vec![false; arrays.positions.len()];
    for &h in border {
        if with_boundary || surface.twin(h).is_some() {
            needed[surface.tail(h)] = true;
            needed[surface.head(h)] = true;
        }
    }
    (0..needed.len())
        .filter(|v| needed[*v] && !samples.contains(&key(&arrays.positions[*v])))
        .count()
}
