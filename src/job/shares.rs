//! What each component gets of what is asked for of a mesh.
//!
//! *Enters:* components and a configuration. *Leaves:* for each component a configuration whose cells, texels and pixels go with its part of the mesh's
//! area: cells and texels are about as large on all of them, and hundreds of components do not cost hundreds of times what one does.

use crate::config::Config;
use crate::export::pictures::SIDE_RANGE;
use crate::geometry::mesh::triangle_area;
use crate::grid::{GridError, MOST_CELLS};
use crate::repair::Component;

/// A component with at least this part of the area gets pictures as large as the configuration asks for, a smaller one smaller.
const WHOLE: f64 = 1.0 / 16.0;

/// No component gets fewer texels, …
const LEAST_TEXELS: usize = 512;

/// … or fewer cells: those of a cube.
const LEAST_CELLS: usize = 6;

/// No longer side of a picture gets shorter.
const LEAST_SIDE: usize = 2 * SIDE_RANGE[0];

/// What each component is of the mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share {
    /// Its part of the mesh's area, in [0, 1].
    part: f64,
    /// Its area, square source units.
    area: f64,
}

/// The shares of components.
pub(super) fn shares(components: &[Component]) -> Vec<Share> {
    let area = |component: &Component| {
        let Ok(mesh) = &component.mesh else {
            return 0.0;
        };
        let faces = mesh.connectivity.faces();
        let corners = |f| {
            mesh.connectivity
                .face_vertices(f)
                .map(|v| mesh.positions[v])
        };
        component
            .frame
            .area(faces.map(|f| triangle_area(corners(f))).sum())
    };
    let areas: Vec<f64> = components.iter().map(area).collect();
    let whole: f64 = areas.iter().sum();
    // Areas that float64 does not hold tell nothing.
    let share = |area: f64| Share {
        part: match whole.is_normal() {
            true => (area / whole).min(1.0),
            false => 1.0,
        },
        area,
    };
    areas.into_iter().map(share).collect()
}

/// The configuration of a component with this share.
///
/// # Errors
/// A size of cells that asks for too many.
pub(super) fn of_share(config: &Config, Share { part, area }: Share) -> Result<Config, GridError> {
    let mut config = config.clone();
    let at_least = |whole: usize, part: f64, least: usize| {
        (whole as f64 * part).round().max(least.min(whole) as f64) as usize
    };
    config.patches.texel_budget = at_least(config.patches.texel_budget, part, LEAST_TEXELS);
    config.grid.cells = match config.grid.cell_size {
        Some(size) => {
            let cells = area / (size * size);
            if cells > MOST_CELLS as f64 {
                return Err(GridError::CellSize {
                    size,
                    area,
                    cells,
                    most: MOST_CELLS,
                    least: (area / MOST_CELLS as f64).sqrt(),
                });
            }
            cells.round().max(1.0) as usize
        }
        None => at_least(config.grid.cells, part, LEAST_CELLS),
    };
    config.pictures.size = at_least(config.pictures.size, (part / WHOLE).min(1.0), LEAST_SIDE);
    Ok(config)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_components_get_less_down_to_a_floor() {
        let mut config = Config::default();
        config.patches.texel_budget = 100_000;
        config.pictures.size = 1000;
        config.grid.cells = 2000;
        let share = |part| Share { part, area: 1.0 };
        let of = |part: f64| {
            let config = of_share(&config, share(part)).unwrap();
            let texels = config.patches.texel_budget;
            (texels, config.grid.cells, config.pictures.size)
        };
        assert_eq!(of(1.0), (100_000, 2000, 1000));
        assert_eq!(of(0.25), (25_000, 500, 1000));
        assert_eq!(of(1.0 / 64.0), (1563, 31, 250));
        assert_eq!(of(0.0), (LEAST_TEXELS, LEAST_CELLS, LEAST_SIDE));
        config.patches.texel_budget = 400;
        config.pictures.size = 64;
        let small = of_share(&config, share(0.01)).unwrap();
        assert_eq!((small.patches.texel_budget, small.pictures.size), (400, 64));
        // Cells of a size are as many as have the area.
        config.grid.cell_size = Some(0.1);
        let sized = of_share(
            &config,
            Share {
                area: 5.0,
                ..share(0.01)
            },
        );
        assert_eq!(sized.unwrap().grid.cells, 500);
        config.grid.cell_size = Some(1e-4);
        let refused = of_share(&config, share(1.0)).unwrap_err().to_string();
        let says = "grid.cell_size = 0.0001 asks for 1.000e8 cells on an area of 1.000e0 square units, and a grid has at most 1000000: at least 1.000e-3 is possible";
        assert_eq!(refused, says);
    }
}
