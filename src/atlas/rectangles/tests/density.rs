//! More samples where the surface bends, and walls where images turn out worst.

use super::super::attempt::{self, Attempt};
use super::super::density::density;
use super::super::division::{part, places, regions};
use super::super::sides::Role;
use super::super::{finish, sizes};
use super::*;
use crate::atlas::patches::PatchParams;

/// Faces on one side of a plane bend a hundred times as much.
fn bends(fine: &Subdivision) -> FaceVec<f64> {
    let c = &fine.connectivity;
    let is_bent = |f| {
        let heights = c.face_vertices(f).map(|v| fine.position[v][0]);
        heights.iter().sum::<f64>() > 3.0
    };
    let faces = fine.parent.iter().map(|f| f.index() + 1).max().unwrap();
    let mut bend = FaceVec::filled(1.0, faces);
    for f in c.faces().filter(|&f| is_bent(f)) {
        bend[fine.parent[f]] = 100.0;
    }
    bend
}

/// Over faces of a rectangle that bend and over the others: texels for an area in space, if the image has one.
fn texels(rectangle: &Rectangle, bent: impl Fn(crate::geometry::ids::FaceId) -> bool) -> [f64; 2] {
    let fine = &rectangle.fine;
    let c = &fine.connectivity;
    let mut sums = [[0.0; 2]; 2];
    for f in c.faces() {
        let corners = c.face_halfedges(f);
        let lengths = c.face_edges(f).map(|e| fine.edge_length(e));
        let in_space = crate::geometry::triangle::area(lengths).unwrap_or(0.0);
        let in_image = 0.5 * doubled_area(corners.map(|h| fine.corner[h].uv)) / rectangle.height;
        let sum = &mut sums[usize::from(bent(fine.parent[f]))];
        *sum = [sum[0] + in_image, sum[1] + in_space];
    }
    sums.map(|[image, space]| image / space)
}

#[test]
fn what_bends_gets_more_texels() {
    let mut divided = 0;
    for (name, (fine, quads)) in surfaces() {
        let bend = bends(&fine);
        let is_bent = |f| bend[fine.parent[f]] > 1.0;
        let even = FaceVec::filled(1.0, bend.len());
        let (evenly, _) = placed(&fine, &even, &quads, TOLERANCE).unwrap();
        let (densely, _) = placed(&fine, &bend, &quads, TOLERANCE).unwrap();
        for (evenly, densely) in evenly.iter().zip(&densely) {
            let parents = || densely.fine.parent.iter();
            let here = parents().filter(|&&f| is_bent(f)).count();
            let asked = density(densely, &fine, &bend);
            if here == 0 || here == parents().count() {
                // Relative to the rectangle's own mean.
                assert!(asked.iter().all(|d| (d - 1.0).abs() < 1e-9), "{name}");
                continue;
            }
            let (least, most) = asked
                .iter()
                .fold((f64::INFINITY, 0.0f64), |(l, m), &d| (l.min(d), m.max(d)));
            // The power of what differs a hundredfold, but for the clamp at both ends.
            assert!(most <= 100f64.powf(1.0 / 6.0) * least * (1.0 + 1e-9));
            if here < 20 || parents().count() - here < 20 {
                continue;
            }
            divided += 1;
            let ratio = |r| {
                let [flat, bent] = texels(r, is_bent);
                bent / flat
            };
            let gained = ratio(densely) / ratio(evenly);
            assert!((1.05..6.0).contains(&gained), "{name}: {gained}");
        }
    }
    assert!(divided >= 4, "{divided}");
}

/// A sheet of even squares with a narrow bump, in nine patches: what they are off by is far from even.
fn bump() -> Drawing {
    let squares = (0..36 * 36).map(|i| [i % 36, i / 36, 0]);
    let mut mesh = polycube(squares, |_, axis, sign| axis == 2 && sign == 1);
    for p in mesh.positions.as_mut_slice() {
        let away = (p[0] - 17.3).powi(2) + (p[1] - 18.9).powi(2);
        p[2] += 4.0 * (-away / 8.0).exp();
    }
    let c = &mesh.connectivity;
    let patch = |f| {
        let p = mesh.face_positions(f);
        let [x, y] = [0, 1].map(|i| ((p[0][i] + p[1][i] + p[2][i]) / 36.0) as usize);
        PatchId::new(3 * y.min(2) + x.min(2))
    };
    let face_patch: FaceVec<PatchId> = c.faces().map(patch).collect();
    let is_cut = crate::geometry::ids::EdgeVec::filled(false, c.edge_count());
    let mut drawing = Drawing::new(&mesh, &is_cut, &face_patch).unwrap();
    finish(&mut drawing).unwrap();
    drawing
}

#[test]
fn the_worst_region_is_divided() {
    let drawing = bump();
    let starts = regions(&drawing);
    assert_eq!(starts.len(), 9);
    let faces = |drawing: &Drawing, start| part(drawing, start).unwrap().faces.len();
    let mut divisible = 0;
    for worst in 0..starts.len() {
        let errors = (0..starts.len()).map(|i| if i == worst { 1e3 } else { 1.0 });
        let measured: Vec<_> = starts.iter().copied().zip(errors).collect();
        let mut divided = drawing.clone();
        let drawn = sizes::divide_measured(&mut divided, &measured, 40_000).unwrap();
        // A line leaves four sides on both sides of it, which three have no room for.
        let disk = part(&drawing, starts[worst]).unwrap();
        if places(&drawing, &disk, |role| role == Role::Node).count() < 4 {
            assert_eq!(drawn, 0);
            continue;
        }
        divisible += 1;
        assert_eq!(drawn, 1);
        assert_eq!(regions(&divided).len(), starts.len() + 1);
        // What the line crosses is split, and no other region gets a face more but its neighbours where the line ends.
        let most = (0..starts.len())
            .max_by_key(|&i| faces(&drawing, starts[i]).saturating_sub(faces(&divided, starts[i])));
        assert_eq!(most, Some(worst));
    }
    // Where nothing is off there is nothing to gain.
    let exact: Vec<_> = starts.iter().map(|&f| (f, 0.0)).collect();
    let mut same = drawing.clone();
    assert_eq!(
        sizes::divide_measured(&mut same, &exact, 40_000).unwrap(),
        0
    );
    assert!(divisible >= 5, "{divisible}");
}

#[test]
fn further_walls_are_kept_only_where_they_help() {
    let params = PatchParams {
        texel_budget: 40_000,
        ..PatchParams::default()
    };
    let first = Attempt::new(bump(), &params, TOLERANCE).unwrap();
    let best = attempt::best(bump(), &params, TOLERANCE).unwrap();
    assert!(
        best.error < 0.95 * first.error,
        "{} {}",
        best.error,
        first.error
    );
    assert!(best.rectangles.len() > first.rectangles.len());
    let texels: usize = best.samples.iter().map(|[m, n]| m * n).sum();
    assert!(texels <= params.texel_budget);
    assert_eq!(best.samples.len(), best.rectangles.len());
}
