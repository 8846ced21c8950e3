//! Patterns laid over a whole surface: one texture for all patches.
//!
//! *Enters:* the [`FlatSurface`](crate::read::flat::FlatSurface) of an atlas and an [`Exemplar`], an image that repeats. *Leaves:* tile
//! coordinates of every corner ([`Field`]), the [`Painted`] square of `surface.glb`'s texture coordinates, and how visible the seams are
//! ([`Steps`]).
//!
//! An affine atlas has flat coordinates whose transitions are rotations and translations. Where all rotations are quarter turns, the flat
//! coordinates are deformed a little so that translations become whole tiles (`field`); a pattern that looks the same after a
//! quarter turn then has no seams at all, but for what sampling does. Elsewhere flat coordinates are taken as they are, and the pattern
//! jumps at the cut.
//!
//! D. Bommes, H. Zimmer, L. Kobbelt. *Mixed-integer quadrangulation.* SIGGRAPH 2009, is where rounding transitions one at a time comes from;
//! here the energy is reduced to the translations first, so that nothing is solved again for each of them.

mod error;
mod exemplar;
mod field;
mod gaussian;
mod paint;
mod rounding;
mod step;
mod transitions;

pub use error::{ExemplarError, TextureError};
pub use exemplar::{Border, Exemplar, Symmetry};
pub use field::{Field, Fitted, Tile, as_it_is, fit, flat_area};
pub use gaussian::Complex;
pub use paint::{MARGIN, Painted, paint};
pub use step::{Steps, steps};
