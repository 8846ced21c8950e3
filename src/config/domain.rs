//! What images are sampled over, and what that implies.
//!
//! *Enters:* a configuration as it was written. *Leaves:* one whose domain is decided, and with it how cones are chosen and what loops turn by.
//!
//! Where no domain is written it is a grid, unless another setting has a meaning without one only: prescribed cones and borders, other flows,
//! and how flat patches are divided. A grid needs the cones of a field and quarter turns. A written domain that a setting contradicts is refused.

use super::{Config, ConfigError};
use crate::atlas::patch::Domain;
use crate::atlas::patches::PatchParams;
use crate::flow::cones::{BoundaryParams, ConeParams, ConeStrategy};
use crate::flow::refine::RefineParams;
use crate::flow::ricci::{FlowParams, Holonomy};
use crate::grid::GridParams;

impl Config {
    /// What images are sampled over. [`Config::resolved`] decides it, where that was not written.
    #[must_use]
    pub fn domain(&self) -> Domain {
        self.images.domain.unwrap_or_default()
    }

    /// The same with everything that the domain implies; see the module docs.
    ///
    /// # Errors
    /// Settings that contradict each other.
    pub fn resolved(self) -> Result<Self, ConfigError> {
        if self.grid.cell_size.is_some() && self.grid.cells != GridParams::default().cells {
            let (one, other) = ("grid.cells", "grid.cell_size");
            return Err(ConfigError::Both { one, other });
        }
        let (for_flat, for_grid) = (only_flat(&self), only_grid(&self));
        let contradicts = |key, domain| ConfigError::Domain { key, domain };
        match (self.images.domain, for_flat, for_grid) {
            (Some(Domain::Grid), Some(key), _) => Err(contradicts(key, Domain::Grid)),
            (Some(Domain::Flat), _, Some(key)) => Err(contradicts(key, Domain::Flat)),
            (None, Some(key), Some(other)) => Err(ConfigError::Domains {
                flat: key,
                grid: other,
            }),
            (None, None, _) | (Some(Domain::Grid), None, _) => Ok(self.on_grid()),
            (None, Some(_), None) | (Some(Domain::Flat), _, None) => {
                let mut config = self;
                config.images.domain = Some(Domain::Flat);
                Ok(config)
            }
        }
    }

    fn on_grid(mut self) -> Self {
        self.images.domain = Some(Domain::Grid);
        self.cones.strategy = ConeStrategy::Field;
        self.flow.holonomy = Holonomy::QuarterTurns;
        self
    }

    /// The same for flat patches: what is built where a grid cannot be made.
    #[must_use]
    pub fn on_flat_patches(&self) -> Self {
        let mut config = self.clone();
        config.images.domain = Some(Domain::Flat);
        if config.cones.strategy == ConeStrategy::Field {
            config.cones.strategy = ConeStrategy::Auto;
        }
        config.flow.holonomy = Holonomy::Free;
        // Lines are for fields only.
        config.features.list.clear();
        config.features.file = None;
        config
    }
}

/// The first key whose value has a meaning for flat patches only.
fn only_flat(config: &Config) -> Option<&'static str> {
    let (cones, cones0) = (&config.cones, ConeParams::default());
    let is_auto = cones.strategy == ConeStrategy::Auto;
    let (boundary, boundary0) = (&config.boundary, BoundaryParams::default());
    let (flow, flow0) = (&config.flow, FlowParams::default());
    let (patches, patches0) = (&config.patches, PatchParams::default());
    let keys = [
        (
            "cones.strategy",
            !is_auto && cones.strategy != ConeStrategy::Field,
        ),
        ("cones.file", cones.file.is_some()),
        ("cones.list", !cones.list.is_empty()),
        (
            "cones.log_scale_bound",
            is_auto && cones.log_scale_bound.is_some(),
        ),
        ("cones.quantum", is_auto && cones.quantum != cones0.quantum),
        (
            "cones.min_curvature",
            is_auto && cones.min_curvature != cones0.min_curvature,
        ),
        (
            "cones.max_curvature",
            is_auto && cones.max_curvature != cones0.max_curvature,
        ),
        (
            "cones.boundary_distance",
            is_auto && cones.boundary_distance != cones0.boundary_distance,
        ),
        ("boundary.condition", boundary.condition.is_some()),
        ("boundary.totals", boundary.totals != boundary0.totals),
        ("boundary.list", boundary.list != boundary0.list),
        ("boundary.corners", boundary.corners != boundary0.corners),
        ("connectivity.enabled", {
            let default = RefineParams::default();
            config.connectivity.enabled == Some(true) && default.enabled.is_none()
        }),
        ("flow.scheme", flow.scheme != flow0.scheme),
        ("flow.delaunay", flow.delaunay != flow0.delaunay),
        ("flow.solver", flow.solver != flow0.solver),
        (
            "patches.log_scale_range",
            patches.log_scale_range != patches0.log_scale_range,
        ),
        (
            "patches.texel_budget",
            patches.texel_budget != patches0.texel_budget,
        ),
        ("patches.min_side", patches.min_side != patches0.min_side),
        ("patches.max_count", patches.max_count.is_some()),
        ("patches.packed_side", patches.packed_side.is_some()),
    ];
    first(&keys)
}

/// The first key whose value has a meaning for grids only.
fn only_grid(config: &Config) -> Option<&'static str> {
    let default = GridParams::default();
    let keys = [
        ("grid.cells", config.grid.cells != default.cells),
        ("grid.cell_size", config.grid.cell_size.is_some()),
        ("grid.density", config.grid.density != default.density),
        (
            "grid.samples_per_cell",
            config.grid.samples_per_cell != default.samples_per_cell,
        ),
    ];
    first(&keys)
}

fn first(keys: &[(&'static str, bool)]) -> Option<&'static str> {
    keys.iter().find(|(_, is_set)| *is_set).map(|(key, _)| *key)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::parse;

    fn parsed(text: &str) -> Result<Config, ConfigError> {
        parse("f", text, &[])
    }

    #[test]
    fn a_grid_is_the_default_and_sets_what_it_needs() {
        for text in [
            "",
            "images.domain = \"grid\"",
            "cones.strategy = \"field\"",
            "cones.count = 20",
        ] {
            let config = parsed(text).expect(text);
            assert_eq!(config.domain(), Domain::Grid, "{text}");
            assert_eq!(config.cones.strategy, ConeStrategy::Field, "{text}");
            assert_eq!(config.flow.holonomy, Holonomy::QuarterTurns, "{text}");
        }
        let config = Config::default().resolved().expect("the default");
        assert_eq!(config, parsed("").expect("nothing"));
        assert_eq!(config.clone().resolved().expect("again"), config);
    }

    #[test]
    fn what_needs_flat_patches_implies_them() {
        for text in [
            "images.domain = \"flat\"",
            "cones.strategy = \"none\"",
            "cones.list = [{ vertex = 0, curvature = \"1/2\" }]",
            "cones.quantum = \"1/2\"",
            "boundary.condition = \"corners\"",
            "flow.scheme = \"thurston\"",
            "flow.solver = \"gradient\"",
            "patches.texel_budget = 65536",
            "patches.packed_side = 1024",
        ] {
            let config = parsed(text).expect(text);
            assert_eq!(config.domain(), Domain::Flat, "{text}");
            assert_eq!(config.flow.holonomy, Holonomy::Free, "{text}");
            assert_eq!(config.clone().resolved().expect("again"), config);
        }
        let field =
            parsed("images.domain = \"flat\"\ncones.strategy = \"field\"").expect("a field");
        assert_eq!(field.cones.strategy, ConeStrategy::Field);
        assert_eq!(field.on_flat_patches().cones.strategy, ConeStrategy::Auto);
    }

    #[test]
    fn contradictions_are_refused_by_both_names() {
        for (text, says) in [
            (
                "images.domain = \"grid\"\npatches.packed_side = 512",
                "`patches.packed_side` is for flat patches, but `images.domain` is \"grid\"",
            ),
            (
                "images.domain = \"grid\"\ncones.strategy = \"spread\"",
                "`cones.strategy` is for flat patches, but `images.domain` is \"grid\"",
            ),
            (
                "images.domain = \"flat\"\ngrid.cells = 500",
                "`grid.cells` is for grids, but `images.domain` is \"flat\"",
            ),
            (
                "patches.texel_budget = 5000\ngrid.cells = 500",
                "`patches.texel_budget` is for flat patches, but `grid.cells` is for grids",
            ),
        ] {
            let error = parsed(text).expect_err(text);
            assert!(error.to_string().contains(says), "{error}");
            assert!(error.remedy().contains("leave"), "{}", error.remedy());
        }
        let error = parsed("grid.cells = 500\ngrid.cell_size = 0.1").expect_err("both");
        let says = "`grid.cells` and `grid.cell_size` exclude each other";
        assert!(error.to_string().contains(says), "{error}");
    }
}
