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
mod samples;

use crate::geometry::mesh::{cross, norm, sub};
use boxes::BoxTree;
pub(crate) use boxes::squared_distance;
use rayon::prelude::*;
use samples::RUN;
pub(crate) use samples::{EvenSamples, OneSided, evenly};

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
    let from_a = one_sided(a, &tree_b, sampling)?;
    let from_b = one_sided(b, &tree_a?, sampling)?;
    let distances = from_tree(points, &tree_b);
    Some((
        from_a.together(from_b),
        distances.into_iter().map(|found| found.distance).collect(),
    ))
}

/// The samples of a surface against another.
fn one_sided(surface: Triangles<'_>, other: &BoxTree, sampling: Sampling) -> Option<OneSided> {
    let samples = EvenSamples::new(surface, sampling.samples)?;
    let mut sum = samples.sum(|sum, near, face, weights| {
        let triangle = corners(surface, surface.faces[face]);
        let nearest = other.nearest(point_in(triangle, weights), *near);
        *near = nearest.face;
        let angle = angle(normal(triangle), other.normal(nearest.face));
        sum.add(samples.area(), nearest.distance, angle);
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
    for found in from_tree(&tested, other) {
        sum.reach(found.distance);
    }
    Some(sum)
}

/// The nearest point of a surface to another point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Near {
    pub distance: f64,
    /// Normal of its face, of any length.
    pub normal: [f64; 3],
}

/// What of a surface is nearest to each point; `None` where it has no faces. Quick where points that follow each other are near each other.
pub(crate) fn nearest(points: &[[f64; 3]], surface: Triangles<'_>) -> Option<Vec<Near>> {
    Some(from_tree(points, &BoxTree::new(surface)?))
}

fn from_tree(points: &[[f64; 3]], tree: &BoxTree) -> Vec<Near> {
    let runs = points.par_chunks(RUN).flat_map_iter(|run| {
        let mut near = 0;
        run.iter().map(move |&p| {
            let nearest = tree.nearest(p, near);
            near = nearest.face;
            Near {
                distance: nearest.distance,
                normal: tree.normal(nearest.face),
            }
        })
    });
    runs.collect()
}

fn corners(surface: Triangles<'_>, face: [u32; 3]) -> [[f64; 3]; 3] {
    face.map(|v| surface.positions[v as usize])
}

/// The point of a triangle with these weights.
pub(crate) fn point_in(t: [[f64; 3]; 3], weights: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|x| (0..3).map(|k| weights[k] * t[k][x]).sum())
}

/// Normal of a triangle, of any length.
pub(crate) fn normal(t: [[f64; 3]; 3]) -> [f64; 3] {
    cross(sub(t[1], t[0]), sub(t[2], t[0]))
}

/// Angle between two directions; 0 where one has no length.
pub(crate) fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
    let dot: f64 = a.iter().zip(b).map(|(x, y)| x * y).sum();
    norm(cross(a, b)).atan2(dot)
}

#[cfg(test)]
mod tests;
