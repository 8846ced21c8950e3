//! Spline surfaces of a mesh: a grid as fine as asked for, on one flat metric.

use super::{FitAssetError, FitParams, Size, Splines, enter, of_spline};
use crate::config::{self, Config};
use crate::export::folder::component_name;
use crate::flow::cones;
use crate::grid::{self, GridError, MOST_CELLS, Spacing};
use crate::job::charting::{Charting, chart};
use crate::job::{BuildError, shares};
use crate::observe::Observer;
use crate::read;
use crate::repair::{self, Component};
use crate::spline::{self, Gridded, Spline};
use std::path::Path;

/// Cells that a search begins with.
const FIRST: usize = 200;
/// Most cells that it tries.
const MOST: usize = MOST_CELLS / 4;
/// By how many times cells grow from one try to the next, at least and at most.
const GROWTH: [f64; 2] = [1.5, 6.0];
/// Tries between the finest that is not near enough and the coarsest that is.
const BISECTIONS: usize = 3;

/// Surfaces of all components.
///
/// # Errors
/// What concerns the whole mesh.
pub(super) fn of_mesh(
    path: &Path,
    params: &FitParams,
    observer: &dyn Observer,
) -> Result<Splines, FitAssetError> {
    let mut keys = vec!["images.domain=grid".to_owned()];
    if let Size::Cells(cells) = params.size {
        keys.push(format!("grid.cells={cells}"));
    }
    let config = config::defaults(&keys)?.config;
    observer.stage("read", 0, 1);
    let asset = read::read(path, &config.limits).map_err(BuildError::from)?;
    observer.stage("repair", 0, 1);
    let repaired = repair::repair(&asset.soup, &config.repair).map_err(BuildError::from)?;
    let config = config.resolved()?;
    let requests = cones::assign(&repaired, &config.cones, &config.boundary, &config.features);
    let requests = requests.map_err(BuildError::from)?;
    let shares = shares::shares(&repaired.components);
    let stem = path.file_stem().unwrap_or("surface".as_ref());
    let stem = stem.to_string_lossy().into_owned();
    let count = repaired.components.len();
    let parts = repaired.components.into_iter().zip(requests).zip(shares);
    let mut splines = Vec::with_capacity(count);
    for (index, ((component, requests), share)) in parts.enumerate() {
        let name = match count {
            1 => stem.clone(),
            _ => component_name(index),
        };
        let config = shares::of_share(&config, share).map_err(BuildError::from)?;
        let enter = |stage| enter(observer, stage, index, count);
        let fitted = |component: Component, spacing: Spacing| {
            let charting = chart(component, &requests, &config, spacing, observer, &enter)?;
            let on = |cells: usize| one(&charting, &config, &name, cells, observer, &enter);
            match params.size {
                Size::Default | Size::Cells(_) => on(config.grid.cells),
                Size::OfDiagonal(part) => coarsest(&on, &name, |_| part),
                Size::Length(length) => coarsest(&on, &name, |d| length / d),
            }
        };
        let spacings = grid::spacings(config.grid.cells);
        let mesh = component.mesh.as_ref();
        let is_coarse = mesh.is_ok_and(|mesh| grid::is_coarse(mesh, spacings[0]));
        let mut spline = fitted(component.clone(), spacings[0]);
        for &spacing in spacings[1..].iter().filter(|_| is_coarse) {
            if !matches!(spline, Err(FitAssetError::Grid { .. })) {
                break;
            }
            spline = fitted(component.clone(), spacing);
        }
        if let Err(FitAssetError::Build(BuildError::Cancelled)) = spline {
            return Err(BuildError::Cancelled.into());
        }
        observer.finished(index, count);
        splines.push((name.clone(), spline));
    }
    Ok(splines)
}

/// The surface on a grid of about so many cells.
fn one(
    charting: &Charting,
    config: &Config,
    name: &str,
    cells: usize,
    observer: &dyn Observer,
    enter: &impl Fn(&'static str) -> Result<(), BuildError>,
) -> Result<Spline, FitAssetError> {
    enter("grid")?;
    let gridded = gridded(charting, config, cells, observer).map_err(|source| match source {
        GridError::Cancelled => BuildError::Cancelled.into(),
        source => FitAssetError::Grid {
            name: name.to_owned(),
            source,
        },
    })?;
    enter("spline")?;
    spline::fit(&gridded).map_err(of_spline(name))
}

/// The surface on the coarsest grid with which it is near enough; `on` gives it on a grid of about so many cells, `tolerance` is a part of the diagonal, which it is told.
fn coarsest(
    on: &impl Fn(usize) -> Result<Spline, FitAssetError>,
    name: &str,
    tolerance: impl Fn(f64) -> f64,
) -> Result<Spline, FitAssetError> {
    let (mut cells, mut too_coarse) = (FIRST, 0);
    let mut near = loop {
        let tried = on(cells);
        let growth = match &tried {
            Ok(spline) => {
                let (off, wanted) = (
                    spline.farthest() / spline.diagonal,
                    tolerance(spline.diagonal),
                );
                if off <= wanted {
                    break tried?;
                }
                if cells >= MOST {
                    return Err(FitAssetError::Tolerance {
                        name: name.to_owned(),
                        cells,
                        reached: off,
                        wanted,
                    });
                }
                // Distances go with the area of a cell.
                off / wanted
            }
            // Some cones lie nearer to each other than coarse cells.
            Err(FitAssetError::Grid { .. }) if cells < MOST => GROWTH[0],
            Err(_) => return tried,
        };
        too_coarse = cells;
        cells = ((cells as f64 * growth.clamp(GROWTH[0], GROWTH[1])) as usize).min(MOST);
    };
    for _ in 0..BISECTIONS {
        let middle = ((too_coarse as f64 * cells as f64).sqrt()) as usize;
        if too_coarse == 0 || middle <= too_coarse || middle >= cells {
            break;
        }
        match on(middle) {
            Ok(spline) if spline.farthest() <= tolerance(spline.diagonal) * spline.diagonal => {
                (near, cells) = (spline, middle);
            }
            Ok(_) | Err(FitAssetError::Grid { .. }) => too_coarse = middle,
            Err(error) => return Err(error),
        }
    }
    Ok(near)
}

/// A grid of about so many cells with the surface on it, in source units.
fn gridded(
    charting: &Charting,
    config: &Config,
    cells: usize,
    observer: &dyn Observer,
) -> Result<Gridded, GridError> {
    let mut params = config.grid.clone();
    params.cells = cells;
    let surface = charting.surface.clone();
    let (surface, layout, grid) = grid::grid(surface, &params, config.patches.padding, observer)?;
    let mut gridded = Gridded::new(&surface.mesh, &layout, &grid);
    for p in gridded.positions.iter_mut().chain(&mut gridded.points) {
        *p = charting.frame.leave(*p);
    }
    Ok(gridded)
}
