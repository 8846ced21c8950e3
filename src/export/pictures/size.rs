//! How large pictures may be.

/// Sides that pictures are held to, pixels: smaller ones show nothing, larger ones are a mistake.
pub const SIDE_RANGE: [usize; 2] = [64, 8192];

/// The size asked for, held to [`SIDE_RANGE`].
pub(super) fn side(size: usize) -> usize {
    size.clamp(SIDE_RANGE[0], SIDE_RANGE[1])
}
