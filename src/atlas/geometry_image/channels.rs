//! What is stored in an image beside position and mask, and how.

use crate::atlas::patch::Domain;
use crate::geometry::ids::NONE;
use crate::geometry::mesh::{AttributeKind, CornerAttribute, Soup};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// A group of channels. Those of the surface are always there to be had; those of the source only where it has them.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Channel {
    /// `normal.X/Y/Z`: unit normal, the source's where it has one.
    Normal,
    /// `surface.face`: face of the atlas.
    Face,
    /// `surface.logScale`: logarithm of the length scale.
    LogScale,
    /// `sourceNormal.X/Y/Z`: the source's normals.
    SourceNormal,
    /// `color.R/G/B/A`: the source's first colours.
    Color,
    /// `texcoord0.U/V`: the source's first texture coordinates.
    Texcoord,
    /// `material.id`: the source's material.
    Material,
}

impl Channel {
    /// The word of configuration and `atlas.json`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Face => "face",
            Self::LogScale => "log-scale",
            Self::SourceNormal => "source-normal",
            Self::Color => "color",
            Self::Texcoord => "texcoord",
            Self::Material => "material",
        }
    }

    /// The attribute of the source that it samples.
    pub(super) fn attribute(self, attributes: &[CornerAttribute]) -> Option<&CornerAttribute> {
        let (kind, components) = match self {
            Self::SourceNormal => (AttributeKind::Normal, 3),
            Self::Color => (AttributeKind::Color(0), 4),
            Self::Texcoord => (AttributeKind::TexCoord(0), 2),
            Self::Normal | Self::Face | Self::LogScale | Self::Material => return None,
        };
        let mut attributes = attributes.iter();
        attributes.find(|a| a.kind == kind && a.components == components)
    }

    fn is_held_by(self, source: &Soup) -> bool {
        match self {
            Self::Normal | Self::Face | Self::LogScale => true,
            Self::Material => source.face_material.iter().any(|&m| m != NONE),
            Self::SourceNormal | Self::Color | Self::Texcoord => {
                self.attribute(&source.attributes).is_some()
            }
        }
    }
}

/// How normals are stored. Positions always have 32 bits: 16 would move them by a 2000th of their size.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Precision {
    /// 32-bit floats.
    #[default]
    Float,
    /// 16-bit floats: an angle of up to 0.03 degrees.
    Half,
}

/// `[images]`: geometry images.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImageParams {
    /// What an image is sampled over; absent: a grid, unless other settings need flat patches.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub domain: Option<Domain>,
    /// What it holds beside position and mask.
    pub channels: BTreeSet<Channel>,
    /// How `normal` and `sourceNormal` are stored.
    pub normal_precision: Precision,
}

impl Default for ImageParams {
    fn default() -> Self {
        Self {
            domain: None,
            channels: BTreeSet::from([Channel::Normal, Channel::Face, Channel::LogScale]),
            normal_precision: Precision::default(),
        }
    }
}

impl ImageParams {
    /// The channels that are asked for and that a source does not have.
    #[must_use]
    pub fn lacking(&self, source: &Soup) -> BTreeSet<Channel> {
        let channels = self.channels.iter().copied();
        channels.filter(|c| !c.is_held_by(source)).collect()
    }

    /// The same without the channels that a source does not have.
    #[must_use]
    pub fn held_by(&self, source: &Soup) -> Self {
        let lacking = self.lacking(source);
        Self {
            channels: self.channels.difference(&lacking).copied().collect(),
            ..self.clone()
        }
    }
}
