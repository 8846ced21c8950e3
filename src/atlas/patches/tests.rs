//! Every promise of `layout` and `geometry_image::sample`, checked on hand-made slit disks by code that
//! shares nothing with them.

use super::samples::{self, Sample, build, ramp, square, strip};
use super::*;
use crate::atlas::geometry_image::{GeometryImage, image_origin, sample};
use crate::atlas::plane::{distance, doubled_area};
use crate::geometry::ids::VertexId;
use crate::geometry::mesh::norm;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

/// Area of the intersection of two counterclockwise triangles, by clipping one with the other.
fn common_area(a: [[f64; 2]; 3], b: [[f64; 2]; 3]) -> f64 {
    let mut polygon = a.to_vec();
    for k in 0..3 {
        let (p, q) = (b[k], b[(k + 1) % 3]);
        let side = |r: [f64; 2]| doubled_area([p, q, r]);
        let mut clipped = Vec::new();
        for i in 0..polygon.len() {
            let (r, s) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            let (dr, ds) = (side(r), side(s));
            if dr >= 0.0 {
                clipped.push(r);
            }
            if (dr > 0.0 && ds < 0.0) || (dr < 0.0 && ds > 0.0) {
                let t = dr / (dr - ds);
                clipped.push([r[0] + t * (s[0] - r[0]), r[1] + t * (s[1] - r[1])]);
            }
        }
        polygon = clipped;
    }
    (1..polygon.len().saturating_sub(1))
        .map(|i| 0.5 * doubled_area([polygon[0], polygon[i], polygon[i + 1]]))
        .sum()
}

struct Checked {
    layout: PatchLayout,
    faces: Vec<Vec<FaceId>>,
}

/// Lays out and samples, and checks everything that holds for every input.
fn check(s: &Sample, params: &PatchParams) -> Checked {
    let layout = layout(&s.mesh, &s.length, &s.cut, &s.development, None, params).unwrap();
    let images = sample(
        &s.mesh,
        &layout,
        &s.log_scale,
        image_origin(&s.mesh, &crate::geometry::frame::Frame::default()),
    );
    let mut faces = vec![Vec::new(); layout.patches.len()];
    for (f, p) in layout.face_patch.enumerate() {
        faces[p.index()].push(f);
    }
    assert_eq!(images.len(), layout.patches.len());
    for (p, faces) in faces.iter().enumerate() {
        check_disk(s, faces);
        check_plane(s, &layout, p, faces, params);
        check_image(s, &layout, p, faces, &images[p], params);
    }
    check_seams(s, &layout);
    check_packing(&layout, params);
    Checked { layout, faces }
}

fn check_disk(s: &Sample, faces: &[FaceId]) {
    let c = &s.mesh.connectivity;
    let set: BTreeSet<FaceId> = faces.iter().copied().collect();
    let mut reached = BTreeSet::from([faces[0]]);
    let mut stack = vec![faces[0]];
    let mut inner = 0;
    while let Some(f) = stack.pop() {
        for h in c.face_halfedges(f) {
            let Some(t) = c.twin(h).filter(|_| !s.cut.is_cut[c.edge(h)]) else {
                continue;
            };
            if set.contains(&c.face(t)) {
                inner += 1;
                if reached.insert(c.face(t)) {
                    stack.push(c.face(t));
                }
            }
        }
    }
    assert_eq!(reached, set, "connected");
    let copies: BTreeSet<u32> = faces
        .iter()
        .flat_map(|&f| c.face_halfedges(f).map(|h| s.development.copy[h]))
        .collect();
    let edges = 3 * faces.len() - inner / 2;
    assert_eq!(copies.len() + faces.len(), edges + 1, "a disk");
}

fn check_plane(s: &Sample, l: &PatchLayout, p: usize, faces: &[FaceId], params: &PatchParams) {
    let c = &s.mesh.connectivity;
    let patch = &l.patches[p];
    assert!(patch.to_chart.unwrap().scale > 0.0);
    let central: Vec<[f64; 2]> = s.development.uv.iter().flatten().copied().collect();
    let diameter = central
        .iter()
        .map(|&q| distance(q, central[0]))
        .fold(0.0, f64::max);
    for &f in faces {
        for k in 0..3 {
            let (a, b) = (l.uv[f][k], l.uv[f][(k + 1) % 3]);
            let lengths = c.face_edges(f).map(|e| s.length[e]);
            let longest = lengths.iter().fold(0.0f64, |m, &x| m.max(x));
            let error = patch.to_chart.unwrap().scale * distance(a, b) - lengths[(k + 2) % 3];
            assert!(
                error.abs() < 1e-9 * longest,
                "flat length {error:e} of {longest:e}"
            );
            let q = patch.to_chart.unwrap().apply(a);
            assert!(distance(q, s.development.uv[f][k]) < 1e-9 * diameter);
            assert!((0.0..=1.0).contains(&a[0]) && (0.0..=1.0 + 1e-6).contains(&a[1]));
        }
        assert!(doubled_area(l.uv[f]) > 0.0, "counterclockwise");
    }
    for (i, &f) in faces.iter().enumerate() {
        for &g in &faces[i + 1..] {
            let (a, b) = (l.uv[f], l.uv[g]);
            let smaller = doubled_area(a).min(doubled_area(b));
            assert!(common_area(a, b) < 1e-6 * smaller, "{f} and {g} overlap");
        }
    }
    let slit = Slit::new(&s.mesh, &s.length, &s.cut, &s.development, None);
    let scales = faces.iter().map(|&f| slit.log_scale[f]);
    let (low, high) = scales.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
    assert!(high - low <= params.log_scale_range);
}

fn check_image(
    s: &Sample,
    l: &PatchLayout,
    p: usize,
    faces: &[FaceId],
    image: &GeometryImage,
    params: &PatchParams,
) {
    let patch = &l.patches[p];
    assert_eq!((image.width, image.height), (patch.width, patch.height));
    assert!(image.width.max(image.height) <= MAX_SIDE);
    assert!(image.width.max(image.height) >= params.min_side);
    let m = patch.texel_to_patch;
    let size = s.mesh.diagonal();
    let origin = image_origin(&s.mesh, &crate::geometry::frame::Frame::default());
    let mut covered = vec![false; image.width * image.height];
    for row in 0..image.height {
        for column in 0..image.width {
            let at = image.width * row + column;
            let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
            let q = [
                m[0][0] * x + m[0][1] * y + m[0][2],
                m[1][0] * x + m[1][1] * y + m[1][2],
            ];
            for &f in faces {
                let t = l.uv[f];
                let area = doubled_area(t);
                let w = [
                    doubled_area([t[1], t[2], q]) / area,
                    doubled_area([t[2], t[0], q]) / area,
                    doubled_area([t[0], t[1], q]) / area,
                ];
                if w.iter().any(|&w| w < 1e-9) {
                    continue;
                }
                covered[at] = true;
                assert_eq!(image.alpha[at], 1.0, "covered inside a face");
                assert_eq!(image.face[at], f.raw());
                let corners = s.mesh.face_positions(f);
                let error = (0..3).map(|i| {
                    let want: f64 = (0..3).map(|k| w[k] * corners[k][i]).sum();
                    (f64::from(image.position[at][i]) + origin[i] - want).abs()
                });
                assert!(error.fold(0.0, f64::max) < 1e-6 * size);
            }
            assert!(image.position[at].iter().all(|x| x.is_finite()));
            let n = norm(image.normal[at].map(f64::from));
            assert!((n - 1.0).abs() < 1e-5);
            assert!(image.log_scale[at].is_finite());
            assert_eq!(
                l.face_patch[FaceId::new(image.face[at] as usize)].index(),
                p
            );
            let border = row == 0 || column == 0;
            let border = border || row + 1 == image.height || column + 1 == image.width;
            assert!(
                !border || params.padding == 0 || image.alpha[at] == 0.0,
                "margin"
            );
        }
    }
    assert!(covered.iter().filter(|&&c| c).count() >= 16, "fine enough");
}

fn check_seams(s: &Sample, l: &PatchLayout) {
    let c = &s.mesh.connectivity;
    // Every border edge once, by its two ends in space and the corners on both sides.
    let mut borders: BTreeMap<(VertexId, VertexId), bool> = BTreeMap::new();
    for h in c.halfedges() {
        let own = l.face_patch[c.face(h)];
        let other = c.twin(h).map(|t| l.face_patch[c.face(t)]);
        if other != Some(own) || s.cut.is_cut[c.edge(h)] {
            borders.insert((c.tail(h), c.head(h)), false);
        }
    }
    let vertex = |p: [f64; 3]| {
        let found = s.mesh.positions.enumerate().find(|(_, q)| **q == p);
        found.expect("a sample is a vertex").0
    };
    let mut ends: BTreeMap<VertexId, Vec<(PatchId, Option<PatchId>)>> = BTreeMap::new();
    for seam in &l.seams {
        assert!(seam.samples.len() >= 2);
        for pair in seam.samples.windows(2) {
            let (a, b) = (vertex(pair[0].position), vertex(pair[1].position));
            let h = c.outgoing(a).find(|&h| c.head(h) == b);
            let h = h.expect("the left face runs along the seam");
            let corner = |h: crate::geometry::ids::HalfedgeId| l.uv[c.face(h)][c.corner(h)];
            assert_eq!(l.face_patch[c.face(h)], seam.left);
            assert_eq!([corner(h), corner(c.next(h))], [pair[0].left, pair[1].left]);
            assert_eq!(c.twin(h).map(|t| l.face_patch[c.face(t)]), seam.right);
            match c.twin(h) {
                Some(t) => {
                    assert_eq!(
                        [corner(c.next(t)), corner(t)],
                        [pair[0].right, pair[1].right]
                    );
                    assert_eq!(borders.insert((b, a), true), Some(false));
                }
                None => assert!(pair.iter().all(|p| p.right.iter().all(|x| x.is_nan()))),
            }
            assert_eq!(borders.insert((a, b), true), Some(false), "an edge twice");
        }
        let (first, last) = (seam.samples[0], seam.samples[seam.samples.len() - 1]);
        if first.position != last.position {
            for end in [first, last] {
                let at = ends.entry(vertex(end.position)).or_default();
                at.push((seam.left, seam.right));
            }
        }
    }
    assert!(
        borders.values().all(|&seen| seen),
        "every border edge lies on a seam"
    );
    // Chains are maximal: two that meet alone in a vertex differ in their patches.
    for pairs in ends.values() {
        assert!(
            pairs.len() != 2 || pairs[0] != pairs[1],
            "could be one chain"
        );
    }
}

fn check_packing(l: &PatchLayout, params: &PatchParams) {
    let mut boxes: Vec<([f64; 2], [f64; 2], f64)> = l
        .patches
        .iter()
        .map(|p| ([f64::MAX; 2], [f64::MIN; 2], 1.0 / p.packed_scale))
        .collect();
    for (f, &p) in l.face_patch.enumerate() {
        let patch = &l.patches[p.index()];
        for uv in l.uv[f] {
            for (i, x) in uv.into_iter().enumerate() {
                let q = x * patch.packed_scale + patch.packed_offset[i];
                assert!((0.0..=1.0).contains(&q));
                let b = &mut boxes[p.index()];
                b.0[i] = b.0[i].min(q);
                b.1[i] = b.1[i].max(q);
            }
        }
    }
    // Side of a square as large as a texel, in the packed square: all patches have their image's density in it.
    let texel = |i: usize| {
        let [[width, ..], [_, height, _]] = l.patches[i].texel_to_patch;
        l.patches[i].packed_scale * (width * -height).sqrt()
    };
    for i in 0..boxes.len() {
        assert!((texel(i) / texel(0) - 1.0).abs() < 1e-9);
        for j in 0..i {
            let gap = (0..2)
                .map(|k| (boxes[i].0[k] - boxes[j].1[k]).max(boxes[j].0[k] - boxes[i].1[k]))
                .fold(f64::MIN, f64::max);
            let least = (2 * params.padding).max(1) as f64 * texel(0);
            assert!(gap > least * (1.0 - 1e-6), "{gap} {least}");
        }
    }
}

fn params() -> PatchParams {
    PatchParams {
        texel_budget: 4000,
        min_side: 32,
        ..Default::default()
    }
}

#[test]
fn a_flat_square_is_one_patch_with_one_closed_seam() {
    let checked = check(&square(6), &params());
    assert_eq!(checked.faces.len(), 1);
    assert_eq!(checked.layout.seams.len(), 1);
    let samples = &checked.layout.seams[0].samples;
    assert_eq!(samples.len(), 25);
    assert_eq!(samples[0].position, samples[24].position);
}

/// A band that winds around more than once in the plane, and rises in space.
fn helix(turns: f64) -> Sample {
    strip(
        (40.0 * turns) as usize,
        3,
        |s, t| {
            let (r, a) = (2.0 - t, TAU * turns * s);
            [r * a.cos(), r * a.sin(), 0.7 * a]
        },
        |s, t| {
            let (r, a) = (2.0 - t, TAU * turns * s);
            [r * a.cos(), r * a.sin()]
        },
        [0.0; 2],
    )
}

#[test]
fn a_band_that_covers_itself_is_divided() {
    let checked = check(&helix(2.5), &params());
    assert!(
        (2..=4).contains(&checked.faces.len()),
        "{}",
        checked.faces.len()
    );
    // Wound less than once it is injective.
    assert_eq!(check(&helix(0.95), &params()).faces.len(), 1);
}

#[test]
fn a_ramp_of_scale_is_divided_by_the_range() {
    for depth in [1.0, 6.0] {
        let checked = check(&ramp((20.0 * depth) as usize, 6, depth), &params());
        let least = (depth / 2.0).ceil() as usize;
        assert!((least..=least + 1).contains(&checked.faces.len()));
    }
}

#[test]
fn parts_a_millionth_of_a_billionth_of_the_chart_keep_full_precision() {
    // e^−36 = 2e-16: at the far end central coordinates hold no digit of a face.
    let s = ramp(200, 4, 36.0);
    let last = s.mesh.connectivity.faces().last().unwrap();
    let central = s.development.uv[last];
    assert!(doubled_area(central).abs() < 1e-30);
    let checked = check(&s, &params());
    assert!(
        (18..=21).contains(&checked.faces.len()),
        "{}",
        checked.faces.len()
    );
}

/// A ring, flat in the plane, slit along one of its rows.
fn slit_ring(columns: usize, rows: usize) -> Sample {
    let at = |i: usize, j: usize| ((i % columns) * (rows + 1) + j) as u32;
    let place = |i: usize, j: usize| {
        let (r, a) = (
            2.0 - j as f64 / rows as f64,
            TAU * i as f64 / columns as f64,
        );
        [r * a.cos(), r * a.sin()]
    };
    let (mut faces, mut uv) = (Vec::new(), Vec::new());
    for i in 0..columns {
        for j in 0..rows {
            let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            for t in [[0, 1, 2], [0, 2, 3]] {
                faces.push(t.map(|k| at(corners[k].0, corners[k].1)));
                uv.push(t.map(|k| place(corners[k].0, corners[k].1)));
            }
        }
    }
    let positions = (0..columns * (rows + 1))
        .map(|v| place(v / (rows + 1), v % (rows + 1)))
        .map(|p| [p[0], p[1], 0.1 * p[0] * p[1]])
        .collect();
    let first_row = (rows + 1) as u32;
    build(
        &faces,
        positions,
        uv,
        |a, b| a < first_row && b < first_row,
        [0.0; 2],
    )
}

#[test]
fn a_slit_ring_meets_itself_along_the_cut() {
    let checked = check(&slit_ring(24, 3), &params());
    assert_eq!(checked.faces.len(), 1, "touching is no overlap");
    let seams = &checked.layout.seams;
    let itself: Vec<_> = seams.iter().filter(|s| s.right == Some(s.left)).collect();
    assert_eq!(itself.len(), 1);
    assert_eq!(itself[0].samples.len(), 4);
    assert!(
        itself[0]
            .samples
            .iter()
            .all(|s| distance(s.left, s.right) < 1e-12)
    );
    assert_eq!(
        seams.len(),
        3,
        "and two borders that end where the cut does"
    );
}

/// A square with plateaus of another scale in it: in space they stick out as far as `height`.
fn square_with_islands(n: usize, islands: &[[f64; 2]], height: f64) -> Sample {
    let bump = |s: f64, t: f64| {
        let near = islands.iter().any(|c| (s - c[0]).hypot(t - c[1]) < 0.12);
        let (i, j) = (
            (s * n as f64).round() as usize,
            (t * n as f64).round() as usize,
        );
        if near {
            height * ((i + j) % 2) as f64
        } else {
            0.0
        }
    };
    strip(n, n, |s, t| [s, t, bump(s, t)], |s, t| [s, t], [0.0; 2])
}

#[test]
fn what_surrounds_another_scale_is_still_a_disk() {
    let one = check(&square_with_islands(20, &[[0.5, 0.5]], 30.0), &params());
    assert!((3..=6).contains(&one.faces.len()), "{}", one.faces.len());
    let centres = [[0.25, 0.3], [0.7, 0.25], [0.6, 0.75]];
    let three = check(&square_with_islands(24, &centres, 30.0), &params());
    assert!(
        (5..=14).contains(&three.faces.len()),
        "{}",
        three.faces.len()
    );
}

#[test]
fn a_needle_is_sampled_too() {
    for aspect in [50.0, 1e4, 1e7] {
        let s = strip(
            1,
            1,
            |s, t| [s, t / aspect, 0.0],
            |s, t| [s, t / aspect],
            [0.0; 2],
        );
        check(&s, &params());
    }
}

#[test]
fn padding_and_budget_are_kept() {
    for padding in [0, 1, 7] {
        let params = PatchParams {
            padding,
            ..params()
        };
        let checked = check(&ramp(60, 6, 6.0), &params);
        let texels: usize = checked
            .layout
            .patches
            .iter()
            .map(|p| p.width * p.height)
            .sum();
        assert!(texels > 2000, "{texels}");
    }
}

/// The same sample in other units, with other last digits.
fn perturbed(mut s: Sample, scale: f64) -> Sample {
    let mut state = 99u64;
    let mut wobble = |x: &mut f64| {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        *x *= scale * (1.0 + 1e-12 * ((state >> 33) as f64 / (1u64 << 31) as f64 - 0.5));
    };
    s.mesh
        .positions
        .as_mut_slice()
        .iter_mut()
        .flatten()
        .for_each(&mut wobble);
    s.length.as_mut_slice().iter_mut().for_each(&mut wobble);
    let mut places: BTreeMap<u32, [f64; 2]> = BTreeMap::new();
    for f in s.mesh.connectivity.faces() {
        for (k, h) in s
            .mesh
            .connectivity
            .face_halfedges(f)
            .into_iter()
            .enumerate()
        {
            let place = *places.entry(s.development.copy[h]).or_insert_with(|| {
                let mut p = s.development.uv[f][k];
                p.iter_mut().for_each(&mut wobble);
                p
            });
            s.development.uv[f][k] = place;
        }
    }
    s
}

#[test]
fn units_and_last_digits_change_nothing() {
    let make: [fn() -> Sample; 4] = [
        || helix(2.5),
        || ramp(60, 6, 6.0),
        || slit_ring(24, 3),
        || samples::square(9),
    ];
    for make in make {
        let run = |s: &Sample| {
            layout(&s.mesh, &s.length, &s.cut, &s.development, None, &params()).unwrap()
        };
        let reference = run(&make());
        for scale in [1.0, 1e-3, 1e3, 1e6] {
            let other = run(&perturbed(make(), scale));
            assert_eq!(reference.face_patch, other.face_patch);
            assert_eq!(reference.seams.len(), other.seams.len());
            for (a, b) in reference.patches.iter().zip(&other.patches) {
                assert_eq!((a.width, a.height), (b.width, b.height));
                assert!((a.packed_offset[0] - b.packed_offset[0]).abs() < 1e-9);
                assert!(
                    (a.to_chart.unwrap().scale * scale / b.to_chart.unwrap().scale - 1.0).abs()
                        < 1e-9
                );
            }
            let pairs = reference.uv.iter().flatten().zip(other.uv.iter().flatten());
            assert!(pairs.map(|(a, b)| distance(*a, *b)).fold(0.0, f64::max) < 1e-9);
        }
    }
}

#[test]
fn bad_parameters_and_numbers_are_refused() {
    let mut s = square(2);
    let run =
        |s: &Sample, p: &PatchParams| layout(&s.mesh, &s.length, &s.cut, &s.development, None, p);
    for bad in [
        PatchParams {
            log_scale_range: f64::NAN,
            ..params()
        },
        PatchParams {
            log_scale_range: 0.0,
            ..params()
        },
        PatchParams {
            texel_budget: 0,
            ..params()
        },
        PatchParams {
            min_side: 100_000,
            ..params()
        },
        PatchParams {
            padding: 1000,
            ..params()
        },
    ] {
        assert!(matches!(run(&s, &bad), Err(PatchError::Parameter { .. })));
    }
    let error = run(
        &s,
        &PatchParams {
            padding: 1000,
            ..params()
        },
    )
    .unwrap_err();
    assert_eq!(
        error.to_string(),
        "patches.padding is 1000; set it to a number from 0 to 64"
    );
    s.development.uv[FaceId::new(3)][1][0] = f64::INFINITY;
    let error = run(&s, &params()).unwrap_err();
    assert!(matches!(error, PatchError::NotFinite { face: 3, .. }));
}
