//! How many texels every image gets along and across, where all images together may have so many.
//!
//! *Enters:* images of about even texels. *Leaves:* columns and rows for which the squared distance between the surface and the images is least.
//! Each image shows how the surface bends in it ([`bend`]), along its columns and along its rows; with that the numbers follow ([`shares`]).

mod bend;
mod shares;

pub(super) use bend::Bend;
pub(super) use shares::Shares;

/// Bends are measured on images with so many times the texels that they will have: coarser ones do not see what is between their texels, much finer ones see the
/// mesh's own edges.
pub(super) const FINER: usize = 2;
