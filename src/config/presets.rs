//! Presets: one word that sets the defaults of several keys for a purpose.
//!
//! *Enters:* the word of `preset`. *Leaves:* a configuration text that lies below the user's own.
//!
//! A preset only changes defaults: keys in the file win over it, and `--set` over both. What is hashed and handed on are the
//! resulting values; a preset and the same keys written out are the same configuration.

use serde::{Deserialize, Serialize};

/// What the atlas is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Preset {
    /// Full grids, densely sampled, for spline fitters that take images.
    #[serde(rename = "spline-fit")]
    SplineFit,
    /// As many texels in all as a geometry image of 256 by 256 has.
    #[serde(rename = "geometry-image-256")]
    GeometryImage256,
    /// One image of 1024 by 1024 with all patches, at most 64 where that is possible (Yan et al. 2024, Object Images).
    #[serde(rename = "omage-1024")]
    Omage1024,
    /// A coarse grid: a tile of a pattern lies on each of its cells.
    #[serde(rename = "texture")]
    Texture,
}

/// The words, as a configuration writes them.
pub(super) const WORDS: &[&str] = &["spline-fit", "geometry-image-256", "omage-1024", "texture"];

impl Preset {
    /// All of them, in the order in which they are listed.
    pub const ALL: [Self; 4] = [
        Self::SplineFit,
        Self::GeometryImage256,
        Self::Omage1024,
        Self::Texture,
    ];

    /// The keys it sets, as a configuration.
    #[must_use]
    pub fn settings(self) -> &'static str {
        match self {
            Self::SplineFit => "[images]\ndomain = \"grid\"\n[grid]\nsamples_per_cell = 16\n",
            // More cones vary less in scale, and one texel of padding is what bilinear interpolation needs: at so few texels each counts.
            Self::GeometryImage256 => {
                "[cones]\ncount = 16\n[images]\ndomain = \"flat\"\nchannels = [\"normal\"]\n[patches]\n\
                 texel_budget = 65536\npadding = 1\n"
            }
            Self::Omage1024 => {
                "[images]\ndomain = \"flat\"\nchannels = [\"normal\"]\n[patches]\n\
                 texel_budget = 1048576\nmax_count = 64\npacked_side = 1024\n"
            }
            Self::Texture => "[images]\ndomain = \"grid\"\n[grid]\ncells = 500\n",
        }
    }
}
