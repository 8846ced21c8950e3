//! How far two triangle meshes are from each other.
//!
//! *Enters:* two surfaces as positions and faces. *Leaves:* a [`Deviation`]: symmetric root mean square and Hausdorff distance, and angles
//! between normals.
//!
//! Each surface is sampled and the exact distance of every sample from the other surface is measured (point to triangle,
//! through a tree of boxes). Samples are area-weighted: the surface, its faces laid one after the other, is divided into as many
//! equal parts as there are samples, and the face in the middle of each part gets one point, at a place that follows from its number.
//!
//! *Guaranteed:* distances of single samples to rounding; the same result for any number of threads.
//! *Not guaranteed:* `rms` is an estimate over the samples (from n of them its relative error is about 1/√n, less where the
//! distance varies little); `hausdorff` is a lower bound of the true Hausdorff distance: that over the samples and the vertices
//! that were tested, which lie about √(area / n) apart. Cignoni, Rocchini, Scopigno, *Metro* (1998), and Aspert,
//! Santa-Cruz, Ebrahimi, *MESH* (2002) measure in the same way.

mod boxes;

use crate::geometry::mesh::{cross, norm, sub, triangle_area};
use crate::parallel;
use boxes::BoxTree;
use rayon::prelude::*;

/// Samples that are worked on in one go: neighbours on the surface, so that each search starts where the last one ended.
const RUN: usize = 512;

/// Triangles in space. Indices must be in range.
#[derive(Clone, Copy, Debug)]
pub struct Triangles<'a> {
    /// Vertices.
    pub positions: &'a [[f64; 3]],
    /// Corners of the faces.
    pub faces: &'a [[u32; 3]],
}

/// What is measured between two surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Deviation {
    /// √((∫_A d² + ∫_B d²) / (area of A + area of B)), d the distance from the other surface.
    pub rms: f64,
    /// The largest distance of a sample or tested vertex of either from the other: a lower bound of the Hausdorff distance.
    pub hausdorff: f64,
    /// Mean angle between the normal of a sample's face and that of the nearest face of the other surface, radians, by area.
    pub mean_normal_angle: f64,
    /// The largest such angle; near creases it can be large however near the surfaces are.
    pub max_normal_angle: f64,
}

impl Deviation {
    /// 20 log10(diagonal / RMS); none where the surfaces agree exactly.
    pub fn psnr(&self, diagonal: f64) -> Option<f64> {
        Some(20.0 * (diagonal / self.rms).log10()).filter(|x| x.is_finite())
    }
}

/// How densely surfaces are sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// Samples on each surface.
    pub samples: usize,
    /// Most vertices that are tested on each surface, evenly spread over their numbers.
    pub vertices: usize,
}

/// Sums over the samples of one surface.
#[derive(Clone, Copy, Debug, Default)]
struct OneSided {
    squares: f64,
    farthest: f64,
    angles: f64,
    largest_angle: f64,
}

/// Measures two surfaces against each other; `None` where one has no area.
pub fn deviation(a: Triangles<'_>, b: Triangles<'_>, sampling: Sampling) -> Option<Deviation> {
    deviation_and_distances(a, b, sampling, &[]).map(|found| found.0)
}

/// The same, and the distance of each point from the surface `b`.
pub fn deviation_and_distances(
    a: Triangles<'_>,
    b: Triangles<'_>,
    sampling: Sampling,
    points: &[[f64; 3]],
) -> Option<(Deviation, Vec<f64>)> {
    let (tree_a, tree_b) = rayon::join(|| BoxTree::new(a), || BoxTree::new(b));
    let tree_b = tree_b?;
    let (area_a, from_a) = one_sided(a, &tree_b, sampling)?;
    let (area_b, from_b) = one_sided(b, &tree_a?, sampling)?;
    let n = sampling.samples.max(1) as f64;
    let mean = |x: f64, y: f64| (area_a * x / n + area_b * y / n) / (area_a + area_b);
    let found = Deviation {
        rms: mean(from_a.squares, from_b.squares).sqrt(),
        hausdorff: from_a.farthest.max(from_b.farthest),
        mean_normal_angle: mean(from_a.angles, from_b.angles),
        max_normal_angle: from_a.largest_angle.max(from_b.largest_angle),
    };
    Some((found, from_tree(points, &tree_b)))
}

/// Area of a surface, and its samples against another.
fn one_sided(
    surface: Triangles<'_>,
    other: &BoxTree,
    sampling: Sampling,
) -> Option<(f64, OneSided)> {
    let mut total = 0.0;
    let up_to: Vec<f64> = surface
        .faces
        .iter()
        .map(|&f| {
            total += triangle_area(corners(surface, f));
            total
        })
        .collect();
    if !(total > 0.0 && total.is_finite()) {
        return None;
    }
    let samples = sampling.samples.max(1);
    let runs = parallel::map_numbers(samples.div_ceil(RUN), |run| {
        let range = run * RUN..samples.min((run + 1) * RUN);
        sample_run(surface, other, &up_to, range, samples)
    });
    let step = surface
        .positions
        .len()
        .div_ceil(sampling.vertices.max(1))
        .max(1);
    let tested: Vec<[f64; 3]> = match sampling.vertices {
        0 => Vec::new(),
        _ => surface.positions.iter().copied().step_by(step).collect(),
    };
    let mut sum = OneSided {
        farthest: from_tree(&tested, other).into_iter().fold(0.0, f64::max),
        ..OneSided::default()
    };
    for run in runs {
        sum.squares += run.squares;
        sum.angles += run.angles;
        sum.farthest = sum.farthest.max(run.farthest);
        sum.largest_angle = sum.largest_angle.max(run.largest_angle);
    }
    Some((total, sum))
}

/// Distance of each point from a surface; `None` where that has no faces. Quick where points that follow each other are near each other.
pub fn distances(points: &[[f64; 3]], surface: Triangles<'_>) -> Option<Vec<f64>> {
    Some(from_tree(points, &BoxTree::new(surface)?))
}

fn from_tree(points: &[[f64; 3]], tree: &BoxTree) -> Vec<f64> {
    let runs = points.par_chunks(RUN).flat_map_iter(|run| {
        let mut near = 0;
        run.iter().map(move |&p| {
            let nearest = tree.nearest(p, near);
            near = nearest.face;
            nearest.distance
        })
    });
    runs.collect()
}

fn corners(surface: Triangles<'_>, face: [u32; 3]) -> [[f64; 3]; 3] {
    face.map(|v| surface.positions[v as usize])
}

fn sample_run(
    surface: Triangles<'_>,
    other: &BoxTree,
    up_to: &[f64],
    range: std::ops::Range<usize>,
    samples: usize,
) -> OneSided {
    let total = up_to.last().copied().unwrap_or(0.0);
    let place = |i: usize| (i as f64 + 0.5) / samples as f64 * total;
    let mut face = up_to.partition_point(|&x| x < place(range.start));
    let mut near = 0;
    let mut sum = OneSided::default();
    for i in range {
        while face + 1 < up_to.len() && up_to[face] < place(i) {
            face += 1;
        }
        let triangle = corners(surface, surface.faces[face.min(up_to.len() - 1)]);
        let nearest = other.nearest(point_in(triangle, i), near);
        near = nearest.face;
        let angle = angle(normal(triangle), other.normal(nearest.face));
        sum.squares += nearest.distance * nearest.distance;
        sum.farthest = sum.farthest.max(nearest.distance);
        sum.angles += angle;
        sum.largest_angle = sum.largest_angle.max(angle);
    }
    sum
}

/// The point that belongs to a number: over many numbers evenly spread over a triangle (the sequence R₂ of Roberts, 2018, on the
/// square, which the map to the triangle keeps even).
fn point_in(t: [[f64; 3]; 3], i: usize) -> [f64; 3] {
    /// Powers of the root of x³ = x + 1, inverted.
    const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    let [r, s] = STEPS.map(|step| (0.5 + i as f64 * step).fract());
    let r = r.sqrt();
    let weights = [1.0 - r, r * (1.0 - s), r * s];
    std::array::from_fn(|x| (0..3).map(|k| weights[k] * t[k][x]).sum())
}

/// Normal of a triangle, of any length.
fn normal(t: [[f64; 3]; 3]) -> [f64; 3] {
    cross(sub(t[1], t[0]), sub(t[2], t[0]))
}

/// Angle between two directions; 0 where one has no length.
pub(crate) fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let dot: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
    norm(cross(a, b)).atan2(dot)
}

#[cfg(test)]
mod tests;
