//! What is said of images and seams that do not make surfaces.

use super::{alone, open_sides, sampled, seam, wavy};
use crate::fit::{FitError, Grids, Side, fit, grids};
use crate::geometry::ids::PatchId;
use crate::read::atlas::{BOUNDARY, ImageFolder, StatedTopology, StoredImage};

#[test]
fn what_does_not_fit_is_refused() {
    let said = |change: fn(&mut Grids)| {
        let mut grids = Grids {
            patches: vec![
                sampled([9, 12], wavy),
                sampled([9, 12], |u, v| wavy(1.0 + u, v)),
            ],
            seams: open_sides(2, &[(0, Side::East), (1, Side::West)]),
        };
        let shared = seam((0, Side::East, true), Some((1, Side::West, true)));
        grids.seams.push(shared);
        fit(&grids, 4.0).expect("fits as it is");
        change(&mut grids);
        fit(&grids, 4.0).expect_err("refused").to_string()
    };
    insta::assert_snapshot!(said(|g| g.patches.clear()), @"there are no patches to fit surfaces to");
    insta::assert_snapshot!(said(|g| g.seams.clear()), @"no seam runs along the west side of patch 0; the seams must close around every patch");
    insta::assert_snapshot!(said(|g| g.seams.truncate(6)), @"no seam runs along the east side of patch 0; the seams must close around every patch");
    insta::assert_snapshot!(said(|g| g.seams.push(g.seams[0].clone())), @"the seams along the west side of patch 0 cover 2.000000 of it; it must be exactly 1, by a whole side of one neighbour");
    insta::assert_snapshot!(said(|g| { g.seams[0].samples.pop(); }), @"the seams along the west side of patch 0 cover 0.400000 of it; it must be exactly 1, by a whole side of one neighbour");
    insta::assert_snapshot!(said(|g| g.seams[0].samples[1].left = [0.5, 0.2]), @"seam 0 runs through patch 0 at (0.000000, 0.000000) of its width and height; seams of rectangles run along their sides");
    insta::assert_snapshot!(said(|g| g.seams[0].samples[1].left = [f64::NAN, 0.2]), @"seam 0 runs through patch 0 at (0.000000, 0.000000) of its width and height; seams of rectangles run along their sides");
    insta::assert_snapshot!(said(|g| g.seams[6].right = Some(PatchId::new(7))), @"seam 6 names patch 7, but there are 2");
    insta::assert_snapshot!(said(|g| g.seams.push(seam((0, Side::East, true), None))), @"the east side of patch 0 meets the west side of patch 1 and the boundary; it must be a whole side of one neighbour");
    insta::assert_snapshot!(said(|g| g.seams[0] = seam((0, Side::West, true), Some((0, Side::West, false)))), @"the west side of patch 0 meets itself; it must meet a whole side of a neighbour");
    insta::assert_snapshot!(said(|g| g.patches[1] = sampled([9, 13], wavy)), @"the east side of patch 0 has 12 samples, but the west side of patch 1, which it meets, has 13; they must be equal");
    insta::assert_snapshot!(said(|g| g.patches[1] = sampled([3, 12], wavy)), @"the image of patch 1 has 3 columns and 12 rows, but a bicubic surface needs at least 4 of each: build the atlas again with a larger patches.texel_budget");
    insta::assert_snapshot!(said(|g| { g.patches[1].points.pop(); }), @"the grid of patch 1 has 9 columns and 12 rows, but 107 points");
    let apart = said(|g| g.patches[1].points[0][2] += 1.0);
    let start = "corner 1 of patch 0 lies 5.00e-1 from the other corners at its point, 1.";
    assert!(apart.starts_with(start), "{apart}");
    let grids = alone(sampled([9, 9], wavy));
    for spacing in [1.9, f64::NAN, f64::INFINITY] {
        let error = fit(&grids, spacing).expect_err("refused");
        assert!(matches!(error, FitError::Spacing { .. }), "{spacing}");
    }
}

/// A square of 5 by 4 samples, as a folder has it.
fn stored() -> ImageFolder {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.0, 0.5], [0.0, 0.0]];
    let position = (0..20u8).map(|i| [f32::from(i % 5), f32::from(3 - i / 5), 0.5]);
    ImageFolder {
        images: vec![StoredImage {
            width: 5,
            height: 4,
            texel_to_patch: [[0.25, 0.0, 0.0], [0.0, -0.5 / 3.0, 0.5]],
            is_rectangle: true,
            position: position.collect(),
            alpha: vec![1.0; 20],
        }],
        image_origin: [10.0, 0.0, 0.0],
        seam_offset: vec![0, 5],
        seam_position: vec![[0.0; 3]; 5],
        seam_uv: corners.map(|uv| [uv, [f64::NAN; 2]]).to_vec(),
        seam_patch: vec![[0, BOUNDARY]],
        topology: StatedTopology {
            euler_characteristic: 1,
            genus: 0,
            boundary_loops: 1,
        },
    }
}

#[test]
fn images_are_taken_over_with_row_0_at_the_top() {
    let taken = grids(&stored()).expect("grids");
    let [grid] = &taken.patches[..] else {
        panic!("{taken:?}");
    };
    assert_eq!(
        (grid.lattice.samples, grid.lattice.extent),
        ([5, 4], [1.0, 0.5])
    );
    assert_eq!(grid.points[0], [10.0, 0.0, 0.5]);
    assert_eq!(grid.points[4], [14.0, 0.0, 0.5]);
    assert_eq!(grid.points[19], [14.0, 3.0, 0.5]);
    let fitted = fit(&taken, 4.0).expect("fits");
    assert_eq!(fitted.patches[0].at([1.0, 0.0]).point, [14.0, 0.0, 0.5]);
    assert_eq!(fitted.neighbours.boundary.len(), 4);
}

#[test]
fn images_that_are_no_grids_are_refused() {
    let said = |change: fn(&mut ImageFolder)| {
        let mut folder = stored();
        change(&mut folder);
        grids(&folder).expect_err("refused").to_string()
    };
    insta::assert_snapshot!(said(|f| f.images[0].is_rectangle = false), @r#"patch 0 is "flat", an image with a mask; splines need full grids: build the atlas again with images.domain = "rectangle" (`affine-atlas build MESH --set images.domain=rectangle`)"#);
    insta::assert_snapshot!(said(|f| f.images[0].alpha[7] = 0.0), @r#"the sample in column 2, row 1 of patch 0 is a hole (A = 0); it must be finite and have A = 1, as the images of a build with images.domain = "rectangle" do"#);
    insta::assert_snapshot!(said(|f| f.images[0].position[19][1] = f32::NAN), @r#"the sample in column 4, row 3 of patch 0 is not finite; it must be finite and have A = 1, as the images of a build with images.domain = "rectangle" do"#);
    insta::assert_snapshot!(said(|f| f.images[0].texel_to_patch[0][2] = 0.1), @"texel_to_patch of patch 0 takes its first and last texels to ([0.1, 0.0]) and ([1.1, 0.5]), which is no rectangle from the origin");
    insta::assert_snapshot!(said(|f| f.image_origin[1] = f64::INFINITY), @"image_origin holds inf; it must be finite");
    insta::assert_snapshot!(said(|f| f.seam_patch[0][0] = 3), @"seam 0 names patch 3, but there are 1");
}
