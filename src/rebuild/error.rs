//! Why images do not make a mesh.

/// Images and seams that do not make a mesh, and what is wrong with them.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RebuildError {
    /// There is nothing to rebuild.
    #[error("there are no patches to rebuild a mesh from")]
    NoPatches,
    /// An image's data has not its size.
    #[error(
        "the image of patch {patch} has {width} columns and {height} rows, but {found} {what}; they must be one a texel"
    )]
    ImageSize {
        /// Patch.
        patch: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Which data.
        what: &'static str,
        /// How many.
        found: usize,
    },
    /// Texels cannot be placed in the patch.
    #[error(
        "texel_to_patch of patch {patch} has determinant {determinant:e}; it must be finite and not zero"
    )]
    Transform {
        /// Patch.
        patch: usize,
        /// Of its linear part.
        determinant: f64,
    },
    /// Positions cannot be placed in space.
    #[error("image_origin holds {value}; it must be finite")]
    OriginNotFinite {
        /// The number.
        value: f64,
    },
    /// A texel inside a patch without a position.
    #[error(
        "the texel in column {column}, row {row} of patch {patch} has the position {value}; it must be finite"
    )]
    TexelNotFinite {
        /// Patch.
        patch: usize,
        /// Column.
        column: usize,
        /// Row.
        row: usize,
        /// The number.
        value: f32,
    },
    /// A seam without extent.
    #[error("seam {seam} has {samples} samples; a seam has at least 2")]
    SeamTooShort {
        /// Seam.
        seam: usize,
        /// How many.
        samples: usize,
    },
    /// A seam of a patch that is not there.
    #[error("seam {seam} names patch {patch}, but there are {patches}")]
    SeamPatch {
        /// Seam.
        seam: usize,
        /// What it names.
        patch: usize,
        /// How many there are.
        patches: usize,
    },
    /// A sample without a place.
    #[error("sample {sample} of seam {seam} has the {what} {value}; it must be finite")]
    SeamNotFinite {
        /// Seam.
        seam: usize,
        /// Sample of the seam, from 0.
        sample: usize,
        /// Position or coordinate.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A sample that is not on its patch.
    #[error(
        "sample {sample} of seam {seam} lies at column {}, row {} of patch {patch}, whose image has {width} columns and {height} rows",
        texels(*column), texels(*row)
    )]
    SeamOutside {
        /// Seam.
        seam: usize,
        /// Sample of the seam, from 0.
        sample: usize,
        /// Patch.
        patch: usize,
        /// In texels.
        column: f64,
        /// In texels.
        row: f64,
        /// Columns of the image.
        width: usize,
        /// Rows of the image.
        height: usize,
    },
    /// A patch that no seam bounds.
    #[error("no seam runs along patch {patch}; the seams must close around every patch")]
    NoBorder {
        /// Patch.
        patch: usize,
    },
    /// The border of a patch has a gap.
    #[error(
        "the seams do not close around patch {patch}: where seam {seam} ends, no seam begins (the nearest begins {} texels away)", texels(*gap)
    )]
    BorderGap {
        /// Patch.
        patch: usize,
        /// Seam that ends there.
        seam: usize,
        /// Distance to the nearest beginning of a seam.
        gap: f64,
    },
    /// A patch with holes.
    #[error(
        "the seams around patch {patch} make {loops} closed chains; a patch is a disk and has one"
    )]
    BorderLoops {
        /// Patch.
        patch: usize,
        /// How many chains.
        loops: usize,
    },
    /// A border that is longer than any on that many texels.
    #[error(
        "the border of patch {patch} is {} texels long, more than the {} that an image of {width} columns and {height} rows can need",
        texels(*length), texels(*limit)
    )]
    BorderTooLong {
        /// Patch.
        patch: usize,
        /// In texels.
        length: f64,
        /// Most.
        limit: f64,
        /// Columns of the image.
        width: usize,
        /// Rows of the image.
        height: usize,
    },
    /// A border that crosses itself.
    #[error(
        "the border of patch {patch} crosses itself: seam {first} and seam {second} meet near column {column:.1}, row {row:.1}"
    )]
    BorderCrossing {
        /// Patch.
        patch: usize,
        /// One seam.
        first: usize,
        /// The other.
        second: usize,
        /// Where, in texels.
        column: f64,
        /// Where, in texels.
        row: f64,
    },
    /// The triangles of a patch do not end at its border.
    #[error(
        "patch {patch} could not be triangulated: {missing} of the {edges} edges between its border and its whole cells are missing; please report this with the folder"
    )]
    Triangulation {
        /// Patch.
        patch: usize,
        /// Fixed edges without a face.
        missing: usize,
        /// Edges of the border and around the whole cells.
        edges: usize,
    },
    /// More vertices than indices.
    #[error("the mesh would have {vertices} vertices; at most {most} can be numbered")]
    TooLarge {
        /// How many.
        vertices: usize,
        /// Most.
        most: usize,
    },
    /// The mesh is no surface.
    #[error("the patches do not make a surface: {problem}")]
    NotManifold {
        /// What is wrong.
        problem: String,
    },
    /// The mesh has not the topology that was stated.
    #[error(
        "the mesh rebuilt from the images has {what} {found}, but {stated} is stated; images, seams and atlas.json do not belong together"
    )]
    Topology {
        /// Euler characteristic, genus or boundary loops.
        what: &'static str,
        /// Of the mesh.
        found: i64,
        /// Of the surface.
        stated: i64,
    },
}

/// A number of texels for a reader: short however large it is.
fn texels(x: f64) -> String {
    match x.abs() < 1e6 {
        true => format!("{:.3}", x),
        false => format!("{x:.3e}"),
    }
}
