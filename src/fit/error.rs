//! Why images do not make surfaces.

use super::side::PatchSide;

/// Images and blocks that do not make spline surfaces, and what is wrong with them.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The patches are no blocks.
    #[error(
        "patch {patch} is no block of a grid; splines need images without a mask whose sides have the same samples: build the atlas again with images.domain = \"grid\" (`affine-atlas build MESH --set images.domain=grid`)"
    )]
    NoGrid {
        /// The first such patch.
        patch: usize,
    },
    /// There is nothing to fit.
    #[error("there are no patches to fit surfaces to")]
    NoPatches,
    /// An origin that is no point.
    #[error("image_origin holds {value}; it must be finite")]
    Origin {
        /// What it holds.
        value: f64,
    },
    /// Knot intervals that are too short or no length.
    #[error(
        "a knot interval of {spacing} sample steps was asked for; it must be a number from {least} on (--spacing)"
    )]
    Spacing {
        /// As given.
        spacing: f64,
        /// Least that determines the surfaces well.
        least: f64,
    },
    /// Too few samples for a cubic.
    #[error(
        "a surface on patch {block} has {columns} columns and {rows} rows of samples, but a bicubic surface needs at least 4 of each: build the atlas again with grid.samples_per_cell = 3 or more"
    )]
    TooFewSamples {
        /// Patch of the atlas.
        block: usize,
        /// Columns of samples.
        columns: usize,
        /// Rows of samples.
        rows: usize,
    },
    /// A grid whose data has not its size.
    #[error(
        "the grid of surface {patch} has {columns} columns and {rows} rows, but {points} points"
    )]
    GridSize {
        /// Surface.
        patch: usize,
        /// Its columns.
        columns: usize,
        /// Its rows.
        rows: usize,
        /// Its points.
        points: usize,
    },
    /// A block of no cells.
    #[error("patch {patch} has {} columns and {} rows of cells; it must have one of each at least", cells[0], cells[1])]
    NoCells {
        /// Patch.
        patch: usize,
        /// Columns and rows.
        cells: [usize; 2],
    },
    /// An image that is not that of its cells.
    #[error(
        "the image of patch {patch} has {} columns and {} rows, but {} by {} cells of {samples_per_cell} samples make a multiple of that number and 1 more each", samples[0], samples[1], cells[0], cells[1]
    )]
    ImageCells {
        /// Patch.
        patch: usize,
        /// Columns and rows of texels.
        samples: [usize; 2],
        /// Columns and rows of cells.
        cells: [usize; 2],
        /// Texels on a side of a cell.
        samples_per_cell: usize,
    },
    /// Cells that are sampled differently.
    #[error(
        "patch {patch} has {} samples on a side of a cell, but patch 0 has {}; they must be equal", samples_per_cell[0], samples_per_cell[1]
    )]
    SamplesPerCell {
        /// Patch.
        patch: usize,
        /// Its own, and those of the first.
        samples_per_cell: [usize; 2],
    },
    /// A block with more or fewer sides.
    #[error("patches[{patch}].sides has {sides} entries; a block has 4 sides")]
    Sides {
        /// Patch.
        patch: usize,
        /// Their number.
        sides: usize,
    },
    /// A piece that begins elsewhere.
    #[error(
        "{} starts at cell {start}, but the pieces before it end at cell {end}; the pieces of a side must cover it in order",
        piece(place)
    )]
    PieceStart {
        /// Patch, side, number.
        place: [usize; 3],
        /// Where it begins.
        start: usize,
        /// Where it should.
        end: usize,
    },
    /// A piece without cells, or with too many.
    #[error(
        "{} has {length} cells; it must have from 1 to the {left} that are left of its side",
        piece(place)
    )]
    PieceLength {
        /// Patch, side, number.
        place: [usize; 3],
        /// Its cells.
        length: usize,
        /// Cells of the side behind the pieces before it.
        left: usize,
    },
    /// A side with a rest.
    #[error(
        "the pieces of patches[{patch}].sides[{side}] cover {end} of its {cells} cells; they must cover all"
    )]
    NotCovered {
        /// Patch.
        patch: usize,
        /// Side.
        side: usize,
        /// Where the last piece ends.
        end: usize,
        /// Cells of the side.
        cells: usize,
    },
    /// A piece that states some of what lies across.
    #[error(
        "{} must have \"patch\", \"side\" and \"other_start\" and be \"reversed\", or have none of them on the boundary",
        piece(place)
    )]
    PieceAcross {
        /// Patch, side, number.
        place: [usize; 3],
    },
    /// A piece across a patch that is not there.
    #[error("{} names patch {patch}, but there are {patches}", piece(place))]
    PiecePatch {
        /// Patch, side, number.
        place: [usize; 3],
        /// What it names.
        patch: usize,
        /// How many there are.
        patches: usize,
    },
    /// A piece across a side that is not there.
    #[error("{} names side {side}, but a block has 4, from 0 on", piece(place))]
    PieceSide {
        /// Patch, side, number.
        place: [usize; 3],
        /// What it names.
        side: usize,
    },
    /// A piece across which none names it.
    #[error(
        "{} says that cell {} of patches[{}].sides[{}] lies across, but no piece of as many cells begins there that says the same of it", piece(place), across[2], across[0], across[1]
    )]
    NotMutual {
        /// Patch, side, number.
        place: [usize; 3],
        /// Patch, side and first cell across.
        across: [usize; 3],
    },
    /// A piece that is glued to itself.
    #[error("{} lies across itself; another must", piece(place))]
    Folded {
        /// Patch, side, number.
        place: [usize; 3],
    },
    /// Texels that should be the same point.
    #[error(
        "texel {} along patches[{}].sides[{}] is ({}), but ({}) in patch {other}, which meets it there; build the atlas again, or give its own images", at[2], at[0], at[1], point(&points[0]), point(&points[1])
    )]
    Apart {
        /// Patch, side and texel along it, counterclockwise.
        at: [usize; 3],
        /// The patch across.
        other: usize,
        /// Both, from the image origin, source units.
        points: [[f32; 3]; 2],
    },
    /// A sample without a place.
    #[error(
        "the sample in column {column}, row {row} of patch {patch} is {value}; it must be finite and have A = 1, as the images of a build with images.domain = \"grid\" do"
    )]
    Sample {
        /// Patch.
        patch: usize,
        /// Column.
        column: usize,
        /// Row.
        row: usize,
        /// What it is.
        value: &'static str,
    },
    /// An interface of a surface that is not there.
    #[error("an interface names {side}, but there are {patches} surfaces")]
    NoPatch {
        /// What it names.
        side: PatchSide,
        /// How many there are.
        patches: usize,
    },
    /// A side that is named twice.
    #[error("the interfaces name {side} more than once; it must meet one other side at most")]
    Met {
        /// Which.
        side: PatchSide,
    },
    /// Sides with different numbers of samples.
    #[error(
        "{} has {} samples, but {}, which it meets, has {}; they must be equal", sides[0], samples[0], sides[1], samples[1]
    )]
    Counts {
        /// Which.
        sides: [PatchSide; 2],
        /// Of them.
        samples: [usize; 2],
    },
    /// Control points that the samples do not determine.
    #[error(
        "{samples} samples do not determine {control_points} control points: please report this with the folder, and use a larger --spacing meanwhile"
    )]
    Undetermined {
        /// Along a side.
        samples: usize,
        /// Along it.
        control_points: usize,
    },
    /// There is no surface to measure against.
    #[error("the mesh to measure against has no faces")]
    NoSurface,
}

fn piece([patch, side, number]: &[usize; 3]) -> String {
    format!("patches[{patch}].sides[{side}][{number}]")
}

fn point([x, y, z]: &[f32; 3]) -> String {
    format!("{x}, {y}, {z}")
}
