//! Verification of atlases that are right, damaged in one place, or damaged byte by byte.

mod fixture;
mod good;
mod hostile;
mod mutations;
