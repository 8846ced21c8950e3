//! Samples along the sides that two rectangles share: the same points in both images.
//!
//! *Enters:* a layout and the images of its patches. *Leaves:* the images, in which texel i of a side and texel n − 1 − i of the side
//! across hold one position and one log scale, to the last bit. Seams say which sides these are.
//!
//! Both were sampled at the same fraction of the same edge, but each with the third corner of its own face and in its own direction.
//! Seldom does this survive the rounding to `f32`; where it does the left one counts. Normals and faces stay each side's own.

use super::image::GeometryImage;
use crate::atlas::patch::{Domain, Patch, PatchLayout};
use std::collections::BTreeSet;

/// A side of an image: 0 is the bottom, then counterclockwise.
pub(super) type Side = usize;

/// Makes the images agree along shared sides.
pub(super) fn unite(layout: &PatchLayout, images: &mut [GeometryImage]) {
    for [(left, a), (right, b)] in pairs(layout) {
        let [from, to] = [(left, a), (right, b)].map(|(i, side)| texels(&images[i], side));
        let held: Vec<([f32; 3], f32)> = from
            .map(|at| (images[left].position[at], images[left].log_scale[at]))
            .collect();
        for (at, (position, log_scale)) in to.rev().zip(held) {
            images[right].position[at] = position;
            images[right].log_scale[at] = log_scale;
        }
    }
}

/// Sides of rectangles that lie along each other: patch and side, left and right of a seam.
pub(super) fn pairs(layout: &PatchLayout) -> BTreeSet<[(usize, Side); 2]> {
    let mut pairs = BTreeSet::new();
    for seam in &layout.seams {
        let Some(right) = seam.right else {
            continue;
        };
        for samples in seam.samples.windows(2) {
            let left = [samples[0].left, samples[1].left];
            let across = [samples[0].right, samples[1].right];
            let own = side(&layout.patches[seam.left.index()], left);
            let other = side(&layout.patches[right.index()], across);
            if let (Some(a), Some(b)) = (own, other) {
                pairs.insert([(seam.left.index(), a), (right.index(), b)]);
            }
        }
    }
    pairs
}

/// The side of a rectangle that both points lie on.
fn side(patch: &Patch, points: [[f64; 2]; 2]) -> Option<Side> {
    let height = patch.texel_to_patch[1][2];
    let on = |i: usize, value: f64| points.iter().all(|p| p[i] == value);
    let lies = [on(1, 0.0), on(0, 1.0), on(1, height), on(0, 0.0)];
    let is_rectangle = patch.domain == Domain::Rectangle;
    lies.iter().position(|&lies| lies && is_rectangle)
}

/// The texels of a side, counterclockwise.
pub(super) fn texels(
    image: &GeometryImage,
    side: Side,
) -> impl DoubleEndedIterator<Item = usize> + use<> {
    let (width, height) = (image.width, image.height);
    let count = if side.is_multiple_of(2) {
        width
    } else {
        height
    };
    (0..count).map(move |i| match side {
        0 => width * (height - 1) + i,
        1 => width * (height - i) - 1,
        2 => width - 1 - i,
        _ => width * i,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::patches::{samples, seams};
    use crate::geometry::ids::{FaceVec, PatchId};

    fn rectangle([width, height]: [usize; 2], top: f64) -> Patch {
        let [columns, rows] = [width, height].map(|n| (n - 1) as f64);
        Patch {
            domain: Domain::Rectangle,
            to_chart: None,
            width,
            height,
            texel_to_patch: [[1.0 / columns, 0.0, 0.0], [0.0, -top / rows, top]],
            packed_scale: 1.0,
            packed_offset: [0.0; 2],
        }
    }

    /// Two fans. The right side of the first lies along the bottom of the second, whose vertices are as far from its end as
    /// they are from the beginning of the first's.
    fn two_fans() -> (samples::Sample, PatchLayout) {
        let wall = [0.0, 1e-9, 0.013, 0.2, 1.0 / 3.0, 0.77, 0.9, 1.0];
        let (top, other_top) = (0.7, 0.9);
        let mut first = vec![[0.0, top], [0.0, 0.0]];
        first.extend(wall.map(|s| [1.0, s * top]));
        let mut second = vec![[1.0, other_top], [0.0, other_top]];
        second.extend(wall.iter().rev().map(|s| [1.0 - s, 0.0]));
        let n = wall.len();
        // The wall, two more corners and a centre of the first, the same of the second.
        let of_first: Vec<usize> = [n, n + 1].into_iter().chain(0..n).collect();
        let of_second: Vec<usize> = [n + 3, n + 4].into_iter().chain((0..n).rev()).collect();
        let (mut faces, mut uv) = (Vec::new(), Vec::new());
        for (vertices, places, apex, centre) in [
            (&of_first, &first, n + 2, [0.4, 0.3]),
            (&of_second, &second, n + 5, [0.3, 0.2]),
        ] {
            for i in 0..vertices.len() {
                let next = (i + 1) % vertices.len();
                faces.push([vertices[i] as u32, vertices[next] as u32, apex as u32]);
                uv.push([places[i], places[next], centre]);
            }
        }
        let position = |i: usize| [1.0, 2.0, 3.0].map(|k| (k * (i as f64 + 0.3)).sin());
        let positions = (0..n + 6).map(position).collect();
        let sample = samples::build(&faces, positions, uv.clone(), |_, _| false, [0.0; 2]);
        let patch = |f: usize| PatchId::new(f / of_first.len());
        let face_patch: FaceVec<PatchId> = (0..faces.len()).map(patch).collect();
        let uv: FaceVec<[[f64; 2]; 3]> = uv.into();
        let layout = PatchLayout {
            seams: seams(&sample.mesh, &sample.cut.is_cut, &face_patch, &uv),
            patches: vec![rectangle([9, 200], top), rectangle([200, 11], other_top)],
            face_patch,
            uv,
            packed: None,
        };
        (sample, layout)
    }

    #[test]
    fn both_images_of_a_wall_hold_the_same_points() {
        let (sample, layout) = two_fans();
        assert_eq!(pairs(&layout), BTreeSet::from([[(0, 1), (1, 0)]]));
        let mut images = super::super::sample(&sample.mesh, &layout, &sample.log_scale, [0.0; 3]);
        assert!(images.iter().all(|i| i.alpha.iter().all(|&a| a == 1.0)));
        // As if everything had been rounded up in the second image.
        let inner = images[1].width * 5 + 3;
        let kept = images[1].position[inner].map(f32::next_up);
        for position in &mut images[1].position {
            *position = position.map(f32::next_up);
        }
        unite(&layout, &mut images);
        assert_eq!(images[1].position[inner], kept);
        let [own, other] = [(0, 1), (1, 0)].map(|(i, side)| {
            let image: &GeometryImage = &images[i];
            let at = texels(image, side).map(|at| image.position[at]);
            at.collect::<Vec<[f32; 3]>>()
        });
        assert_eq!(own.len(), 200);
        assert!(own.iter().eq(other.iter().rev()));
        let p = |v: usize| sample.mesh.positions.as_slice()[v].map(|x| x as f32);
        assert_eq!((own[0], own[199]), (p(0), p(7)));
        // The point itself, from the wall alone: halfway from 0.2 to 1/3.
        let k = 199.0 * (0.2 + 1.0 / 3.0) / 2.0_f64;
        let t = (k.round() / 199.0 - 0.2) / (1.0 / 3.0 - 0.2);
        let [a, b] = [3, 4].map(|v| sample.mesh.positions.as_slice()[v]);
        for i in 0..3 {
            let want = a[i] + t * (b[i] - a[i]);
            assert!((f64::from(own[k.round() as usize][i]) - want).abs() < 1e-6);
        }
    }

    #[test]
    fn sides_run_counterclockwise_from_corner_to_corner() {
        let (sample, mut layout) = two_fans();
        layout.patches[0] = rectangle([3, 2], 0.7);
        layout.patches[1] = rectangle([2, 2], 0.9);
        let images = super::super::sample(&sample.mesh, &layout, &sample.log_scale, [0.0; 3]);
        let sides = [0, 1, 2, 3].map(|side| texels(&images[0], side).collect::<Vec<_>>());
        let expected = [vec![3, 4, 5], vec![5, 2], vec![2, 1, 0], vec![0, 3]];
        assert_eq!(sides, expected);
    }
}
