//! More samples where the surface bends.

use super::super::density::density;
use super::*;

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
