//! Patterns laid over a whole surface: one texture for all patches.
//!
//! *Enters:* the [`GriddedSurface`](crate::read::gridded::GriddedSurface) of an atlas and an [`Exemplar`], an image that repeats. *Leaves:* the
//! [`Painted`] square of `surface.glb`'s texture coordinates, the [`TileSize`] on the surface, and how visible the seams are ([`Steps`]).
//!
//! An integer grid has coordinates whose transitions are quarter turns and whole translations. A [`Tiling`] puts a whole number of
//! square tiles along a side of a cell, so that every transition takes tiles to tiles: a pattern that looks the same after a quarter turn
//! has no seams on any surface, but for what sampling does, and no tile is turned over. Other patterns jump where frames turn.

mod error;
mod exemplar;
mod paint;
mod step;
mod tiling;

pub use error::ExemplarError;
pub use exemplar::{Border, Exemplar, Symmetry};
pub use paint::{MARGIN, Painted, paint};
pub use step::{Steps, steps};
pub use tiling::{MOST_COPIES, TileSize, Tiling, tile_size};
