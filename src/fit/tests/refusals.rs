//! What is said of images and blocks that do not make surfaces.

use super::{alone, interface, sampled, wavy};
use crate::fit::{FitError, Grids, Side, fit, grids};
use crate::read::atlas::{ImageFolder, StatedTopology, StoredBlock, StoredImage, StoredPiece};

#[test]
fn what_does_not_fit_is_refused() {
    let said = |change: fn(&mut Grids)| {
        let mut grids = Grids {
            patches: vec![
                sampled([9, 12], wavy),
                sampled([9, 12], |u, v| wavy(1.0 + u, v)),
            ],
            interfaces: vec![interface((0, Side::East), (1, Side::West), true)],
        };
        fit(&grids, 4.0).expect("fits as it is");
        change(&mut grids);
        fit(&grids, 4.0).expect_err("refused").to_string()
    };
    insta::assert_snapshot!(said(|g| g.patches.clear()), @"there are no patches to fit surfaces to");
    insta::assert_snapshot!(said(|g| g.interfaces[0].second.patch = 7), @"an interface names the west side of surface 7, but there are 2 surfaces");
    insta::assert_snapshot!(said(|g| g.interfaces.push(interface((1, Side::South), (0, Side::East), true))), @"the interfaces name the east side of surface 0 more than once; it must meet one other side at most");
    insta::assert_snapshot!(said(|g| g.interfaces[0].second = g.interfaces[0].first), @"the interfaces name the east side of surface 0 more than once; it must meet one other side at most");
    insta::assert_snapshot!(said(|g| g.patches[1] = sampled([9, 13], wavy)), @"the east side of surface 0 has 12 samples, but the west side of surface 1, which it meets, has 13; they must be equal");
    insta::assert_snapshot!(said(|g| g.patches[1] = sampled([3, 12], wavy)), @"a surface on patch 0 has 3 columns and 12 rows of samples, but a bicubic surface needs at least 4 of each: build the atlas again with grid.samples_per_cell = 3 or more");
    insta::assert_snapshot!(said(|g| { g.patches[1].points.pop(); }), @"the grid of surface 1 has 9 columns and 12 rows, but 107 points");
    let grids = alone(sampled([9, 9], wavy));
    for spacing in [1.9, f64::NAN, f64::INFINITY] {
        let error = fit(&grids, spacing).expect_err("refused");
        assert!(matches!(error, FitError::Spacing { .. }), "{spacing}");
    }
}

const SAMPLES: usize = 3;

/// A piece as `atlas.json` has it.
fn piece(start: usize, length: usize, across: Option<(usize, usize, usize)>) -> StoredPiece {
    StoredPiece {
        start,
        length,
        patch: across.map(|a| a.0),
        side: across.map(|a| a.1),
        other_start: across.map(|a| a.2),
        reversed: across.is_some(),
    }
}

/// Samples of a plane over a rectangle of cells.
fn image(first: [usize; 2], cells: [usize; 2], sides: [Vec<StoredPiece>; 4]) -> StoredImage {
    let [width, height] = cells.map(|n| SAMPLES * n + 1);
    let texels = (0..height).flat_map(|row| (0..width).map(move |column| [column, row]));
    let position = texels.map(|[column, row]| {
        let at = |i: usize, texel: usize| (SAMPLES * first[i] + texel) as f32;
        [at(0, column), at(1, row), 0.5]
    });
    let step = 1.0 / SAMPLES as f64;
    StoredImage {
        width,
        height,
        texel_to_patch: [[step, 0.0, 0.0], [0.0, step, 0.0]],
        is_rectangle: true,
        block: Some(StoredBlock {
            cells,
            samples_per_cell: SAMPLES,
            sides: sides.to_vec(),
        }),
        position: position.collect(),
        alpha: vec![1.0; width * height],
    }
}

/// Two blocks above a third that is as wide as both.
///
/// ```text
/// ┌───┬───────┐
/// │ 1 │   2   │
/// ├───┴───────┤
/// │     0     │
/// └───────────┘
/// ```
fn stored() -> ImageFolder {
    let border = |length| vec![piece(0, length, None)];
    let below = vec![piece(0, 2, Some((2, 0, 0))), piece(2, 1, Some((1, 0, 0)))];
    ImageFolder {
        images: vec![
            image([0, 0], [3, 1], [border(3), border(1), below, border(1)]),
            image(
                [0, 1],
                [1, 2],
                [
                    vec![piece(0, 1, Some((0, 2, 2)))],
                    vec![piece(0, 2, Some((2, 3, 0)))],
                    border(1),
                    border(2),
                ],
            ),
            image(
                [1, 1],
                [2, 2],
                [
                    vec![piece(0, 2, Some((0, 2, 0)))],
                    border(2),
                    border(2),
                    vec![piece(0, 2, Some((1, 1, 0)))],
                ],
            ),
        ],
        image_origin: [10.0, 0.0, 0.0],
        seam_offset: vec![0],
        seam_position: Vec::new(),
        seam_uv: Vec::new(),
        seam_patch: Vec::new(),
        topology: StatedTopology {
            euler_characteristic: 1,
            genus: 0,
            boundary_loops: 1,
        },
    }
}

#[test]
fn images_are_taken_over_with_row_0_at_the_bottom() {
    let taken = grids(&stored()).expect("grids");
    let parts: Vec<_> = taken.patches.iter().map(|grid| grid.part).collect();
    let stated = parts
        .iter()
        .map(|part| (part.block, part.first, part.cells));
    assert_eq!(
        stated.collect::<Vec<_>>(),
        [
            (0, [0, 0], [1, 1]),
            (0, [1, 0], [2, 1]),
            (1, [0, 0], [1, 2]),
            (2, [0, 0], [2, 2]),
        ]
    );
    let corners = taken.patches.iter().map(|grid| {
        let last = grid.points.len() - 1;
        [grid.points[0], grid.points[last]].map(|p| [p[0], p[1]])
    });
    assert_eq!(
        corners.collect::<Vec<_>>(),
        [
            [[10.0, 0.0], [13.0, 3.0]],
            [[13.0, 0.0], [19.0, 3.0]],
            [[10.0, 3.0], [13.0, 9.0]],
            [[13.0, 3.0], [19.0, 9.0]],
        ]
    );
    assert_eq!(taken.patches[1].samples, [7, 4]);
    let fitted = fit(&taken, 4.0).expect("fits");
    assert_eq!(fitted.patches[3].at([0.0, 1.0]).point, [13.0, 9.0, 0.5]);
    let neighbours = &fitted.neighbours;
    assert_eq!((neighbours.corners, neighbours.interfaces.len()), (9, 4));
    assert_eq!(neighbours.boundary.len(), 8);
}

/// The piece of side `side` of patch `patch`.
fn change(folder: &mut ImageFolder, at: [usize; 3], edit: impl Fn(&mut StoredPiece)) {
    if let Some(block) = &mut folder.images[at[0]].block {
        edit(&mut block.sides[at[1]][at[2]]);
    }
}

fn refusal(change: impl Fn(&mut ImageFolder)) -> String {
    let mut folder = stored();
    change(&mut folder);
    grids(&folder).expect_err("refused").to_string()
}

#[test]
fn images_that_are_no_blocks_are_refused() {
    let block = |edit: fn(&mut StoredBlock)| {
        refusal(|folder| folder.images[1].block.iter_mut().for_each(edit))
    };
    insta::assert_snapshot!(refusal(|f| f.images[1].block = None), @r#"patch 1 is no block of a grid; splines need images without a mask whose sides have the same samples: build the atlas again with images.domain = "grid" (`affine-atlas build MESH --set images.domain=grid`)"#);
    insta::assert_snapshot!(refusal(|f| f.images[0].alpha[7] = 0.0), @r#"the sample in column 7, row 0 of patch 0 is a hole (A = 0); it must be finite and have A = 1, as the images of a build with images.domain = "grid" do"#);
    insta::assert_snapshot!(refusal(|f| f.images[1].position[9][1] = f32::NAN), @r#"the sample in column 1, row 2 of patch 1 is not finite; it must be finite and have A = 1, as the images of a build with images.domain = "grid" do"#);
    insta::assert_snapshot!(refusal(|f| f.image_origin[1] = f64::INFINITY), @"image_origin holds inf; it must be finite");
    insta::assert_snapshot!(block(|b| b.cells[1] = 3), @"the image of patch 1 has 4 columns and 7 rows, but 1 by 3 cells of 3 samples make a multiple of that number and 1 more each");
    insta::assert_snapshot!(block(|b| b.cells[0] = usize::MAX), @"the image of patch 1 has 4 columns and 7 rows, but 18446744073709551615 by 2 cells of 3 samples make a multiple of that number and 1 more each");
    insta::assert_snapshot!(block(|b| b.samples_per_cell = 4), @"patch 1 has 4 samples on a side of a cell, but patch 0 has 3; they must be equal");
    insta::assert_snapshot!(block(|b| b.sides.truncate(3)), @"patches[1].sides has 3 entries; a block has 4 sides");
    // One texel of a side of two pieces, to the last bit: the eighth from the right.
    insta::assert_snapshot!(refusal(|f| f.images[0].position[32][2] = 0.5f32.next_up()), @"texel 7 along patches[0].sides[2] is (2, 3, 0.50000006), but (2, 3, 0.5) in patch 1, which meets it there; build the atlas again, or give its own images");
}

#[test]
fn sides_that_do_not_fit_each_other_are_refused() {
    let said = |at: [usize; 3], edit: fn(&mut StoredPiece)| refusal(|f| change(f, at, edit));
    insta::assert_snapshot!(said([0, 2, 1], |p| p.start = 1), @"patches[0].sides[2][1] starts at cell 1, but the pieces before it end at cell 2; the pieces of a side must cover it in order");
    insta::assert_snapshot!(said([0, 2, 1], |p| p.length = usize::MAX), @"patches[0].sides[2][1] has 18446744073709551615 cells; it must have from 1 to the 1 that are left of its side");
    insta::assert_snapshot!(said([0, 2, 1], |p| p.length = 0), @"patches[0].sides[2][1] has 0 cells; it must have from 1 to the 1 that are left of its side");
    insta::assert_snapshot!(said([2, 3, 0], |p| p.length = 1), @"the pieces of patches[2].sides[3] cover 1 of its 2 cells; they must cover all");
    insta::assert_snapshot!(said([0, 2, 0], |p| p.patch = Some(3)), @"patches[0].sides[2][0] names patch 3, but there are 3");
    insta::assert_snapshot!(said([0, 2, 0], |p| p.side = Some(4)), @"patches[0].sides[2][0] names side 4, but a block has 4, from 0 on");
    insta::assert_snapshot!(said([0, 2, 0], |p| p.side = None), @r#"patches[0].sides[2][0] must have "patch", "side" and "other_start" and be "reversed", or have none of them on the boundary"#);
    insta::assert_snapshot!(said([0, 2, 0], |p| p.reversed = false), @r#"patches[0].sides[2][0] must have "patch", "side" and "other_start" and be "reversed", or have none of them on the boundary"#);
    insta::assert_snapshot!(said([0, 2, 0], |p| p.other_start = Some(usize::MAX)), @"patches[0].sides[2][0] says that cell 18446744073709551615 of patches[2].sides[0] lies across, but no piece of as many cells begins there that says the same of it");
    insta::assert_snapshot!(said([0, 2, 0], |p| p.side = Some(1)), @"patches[0].sides[2][0] says that cell 0 of patches[2].sides[1] lies across, but no piece of as many cells begins there that says the same of it");
    // The boundary on one side alone.
    insta::assert_snapshot!(said([2, 0, 0], |p| *p = piece(0, 2, None)), @"patches[0].sides[2][0] says that cell 0 of patches[2].sides[0] lies across, but no piece of as many cells begins there that says the same of it");
    insta::assert_snapshot!(said([1, 2, 0], |p| *p = piece(0, 1, Some((1, 2, 0)))), @"patches[1].sides[2][0] lies across itself; another must");
    insta::assert_snapshot!(refusal(|f| f.images[2].block.iter_mut().for_each(|b| b.sides[2].clear())), @"the pieces of patches[2].sides[2] cover 0 of its 2 cells; they must cover all");
}
