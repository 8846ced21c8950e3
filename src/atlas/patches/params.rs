//! What a user may choose about patches, with the defaults.

use crate::atlas::patch::MAX_SIDE;

/// Fewer texels on a side of the packed image hold no patches worth the name.
const LEAST_PACKED_SIDE: usize = 64;

/// Parameters of patches and packing.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PatchParams {
    /// Largest log-scale range inside a patch (natural logarithm of the length scale).
    pub log_scale_range: f64,
    /// Texels of all images of a component together (about).
    pub texel_budget: usize,
    /// Least texels on the longer side of an image. Beyond that a patch keeps half as many, and at most 8, on its shorter side, and some inside,
    /// so that a budget too small for all patches together is exceeded.
    pub min_side: usize,
    /// Texels between patches in the packed square, and around each image.
    pub padding: usize,
    /// Most patches: where there are more, `log_scale_range` is doubled until there are not, or it is as wide as a configuration may ask for.
    pub max_count: Option<usize>,
    /// Columns and rows of one image of all flat patches. Patches get fewer texels than the budget has where they would not fit.
    pub packed_side: Option<usize>,
}

impl Default for PatchParams {
    fn default() -> Self {
        Self {
            log_scale_range: 2.0,
            texel_budget: 512 * 512,
            min_side: 16,
            padding: 2,
            max_count: None,
            packed_side: None,
        }
    }
}

/// Why there are no patches.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PatchError {
    /// A parameter is out of its range.
    #[error("patches.{name} is {value}; set it to a number from {least} to {most}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// What was given.
        value: f64,
        /// Least allowed.
        least: f64,
        /// Most allowed.
        most: f64,
    },
    /// The central chart or the metric has no numbers for a face.
    #[error(
        "face {face} has no finite place in the plane (coordinate or flat length {value}); its scale is beyond what can be computed, use more cones or smaller ones"
    )]
    NotFinite {
        /// The face.
        face: u32,
        /// The number.
        value: f64,
    },
}

impl PatchParams {
    /// Refuses values that no layout can have.
    pub fn validate(&self) -> Result<(), PatchError> {
        let bounds = [
            ("log_scale_range", self.log_scale_range, 1e-3, 1e3),
            ("texel_budget", self.texel_budget as f64, 1.0, 1e9),
            ("min_side", self.min_side as f64, 1.0, 4096.0),
            ("padding", self.padding as f64, 0.0, 64.0),
            ("max_count", self.max_count.unwrap_or(1) as f64, 1.0, 1e9),
            (
                "packed_side",
                self.packed_side.unwrap_or(LEAST_PACKED_SIDE) as f64,
                LEAST_PACKED_SIDE as f64,
                MAX_SIDE as f64,
            ),
        ];
        for (name, value, least, most) in bounds {
            if !(least..=most).contains(&value) {
                return Err(PatchError::Parameter {
                    name,
                    value,
                    least,
                    most,
                });
            }
        }
        Ok(())
    }
}
