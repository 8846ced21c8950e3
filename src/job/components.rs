//! The components of a mesh, each from repair to its atlas.
//!
//! Small ones are built side by side, large ones, which keep all cores busy by themselves, one after the other; what becomes of them is told in their order.

use super::shares;
use super::{BuildError, pipeline::pipeline};
use crate::atlas::patch::Domain;
use crate::config::Config;
use crate::flow::cones::{self, Requests};
use crate::geometry::mesh::{Mesh, Soup};
use crate::grid::{self, Spacing};
use crate::observe::Observer;
use crate::parallel;
use crate::product::AffineAtlas;
use crate::repair::inside_out::inside_out;
use crate::repair::{self, Component};

/// Components of more faces are built alone.
const SMALL: usize = 10_000;

/// Components of more faces are not built again with vertices that are closer or farther.
const FEW: usize = 2_000;

/// Who watches which component.
pub(super) struct Observed<'a> {
    pub observer: &'a dyn Observer,
    pub component: usize,
    pub components: usize,
}

impl Observed<'_> {
    /// Tells that a stage begins, unless the job was to stop.
    pub fn enter(&self, stage: &'static str) -> Result<(), BuildError> {
        if self.observer.cancelled() {
            return Err(BuildError::Cancelled);
        }
        self.observer.stage(stage, self.component, self.components);
        Ok(())
    }

    fn build(
        &self,
        component: Component,
        requests: &Requests,
        config: &Config,
        spacing: Spacing,
        no_grid: Option<String>,
    ) -> Result<AffineAtlas, BuildError> {
        let enter = |stage| self.enter(stage);
        let observer = self.observer;
        pipeline(
            component, requests, config, spacing, no_grid, observer, &enter,
        )
    }
}

/// A component, with what it is asked for.
pub(super) struct Part<'a> {
    pub index: usize,
    /// Of the mesh.
    pub components: usize,
    component: Component,
    requests: Requests,
    /// With its share of cells, texels and pixels.
    pub config: Config,
    /// The same on flat patches.
    flat: (Requests, Config),
    observer: &'a dyn Observer,
}

/// A way to build a component on a grid.
struct Way {
    spacing: Spacing,
    config: Config,
    /// Whether it is for surfaces one of whose grids was built and refused.
    for_refused: bool,
}

impl<'a> Part<'a> {
    /// Its atlas, of flat patches where a grid cannot be made.
    pub fn atlas(self) -> Result<AffineAtlas, BuildError> {
        self.accepted(|atlas| Ok(Ok(atlas)))?
    }

    /// What `accept` makes of the first atlas that it takes: on its grid; on others, where faces are too thin for that one or it is not taken; at last of flat patches. The inner error is that of
    /// the component, and the first of them; the outer one ends the job.
    pub fn accepted<T>(
        self,
        mut accept: impl FnMut(AffineAtlas) -> Result<Result<T, BuildError>, BuildError>,
    ) -> Result<Result<T, BuildError>, BuildError> {
        let mut first = None;
        let mut is_refused = false;
        for way in self.ways() {
            if way.for_refused && !is_refused {
                continue;
            }
            let component = self.component.clone();
            let (observed, requests) = (self.observed(), &self.requests);
            let error = match observed.build(component, requests, &way.config, way.spacing, None) {
                Ok(atlas) => {
                    let has_grid = atlas.grid.is_some();
                    match accept(atlas)? {
                        Err(error) if has_grid => {
                            is_refused = true;
                            error
                        }
                        taken => return Ok(taken),
                    }
                }
                Err(BuildError::Cancelled) => return Err(BuildError::Cancelled),
                Err(error) => {
                    // Other triangles may do. What else is wrong with a grid stays so.
                    let may_do = matches!(&error, BuildError::Grid(e) if e.is_of_thin_faces());
                    if !may_do && !is_refused {
                        first.get_or_insert(error);
                        break;
                    }
                    error
                }
            };
            tracing::debug!(%error, "again on another grid, or on flat patches");
            first.get_or_insert(error);
        }
        match first {
            Some(error) if self.component.mesh.is_err() => Ok(Err(error)),
            reason => match self.of_flat_patches(reason.map(|error| error.to_string())) {
                Ok(atlas) => accept(atlas),
                Err(BuildError::Cancelled) => Err(BuildError::Cancelled),
                Err(error) => Ok(Err(error)),
            },
        }
    }

    /// Grids one after the other, where one was asked for: with fewer vertices, with more, whose triangles are less thin, and with its own; then, where one was refused, with more cells, whose lines leave no slivers where those
    /// of fewer did, and without sharp edges as lines.
    fn ways(&self) -> impl Iterator<Item = Way> {
        let first = self.spacings()[0];
        let (mut more, mut smooth) = (self.config.clone(), self.config.clone());
        more.grid.cells = (1.1 * more.grid.cells as f64).round() as usize;
        smooth.features.angle = 180.0;
        let way = |for_refused| {
            move |(spacing, config)| Way {
                spacing,
                config,
                for_refused,
            }
        };
        // Found out only where they are needed.
        let others = std::iter::once_with(|| self.other_spacings()).flatten();
        let spacings = std::iter::once(first).chain(others);
        let spaced = spacings.map(|spacing| (spacing, self.config.clone()));
        let last = [more, smooth].map(|config| (first, config));
        let ways = spaced
            .map(way(false))
            .chain(last.into_iter().map(way(true)));
        let is_grid = self.config.domain() == Domain::Grid;
        ways.take_while(move |_| is_grid)
    }

    /// Those of new vertices, at first and where that fails.
    fn spacings(&self) -> Vec<Spacing> {
        grid::spacings(self.config.grid.cells)
    }

    /// Spacings other than the first with which the mesh becomes another one.
    fn other_spacings(&self) -> Vec<Spacing> {
        let mesh = self.component.mesh.as_ref();
        // Of a mesh with many vertices others change little.
        let few = |mesh: &&Mesh| mesh.connectivity.face_count() <= FEW;
        let Some(mesh) = mesh.ok().filter(few) else {
            return Vec::new();
        };
        let mut spacings = self.spacings();
        let mut sizes = Vec::new();
        spacings.retain(|&spacing| {
            let size = grid::refined(mesh.clone(), spacing).positions.len();
            let is_new = !sizes.contains(&size);
            sizes.push(size);
            is_new
        });
        spacings.split_off(1)
    }

    /// Builds it of flat patches, from all that is left of it; `reason` is why it has no grid, where one was asked for.
    fn of_flat_patches(self, reason: Option<String>) -> Result<AffineAtlas, BuildError> {
        let (observed, spacing) = (self.observed(), self.spacings()[0]);
        let (requests, config) = match self.config.domain() {
            Domain::Grid => self.flat,
            Domain::Flat => (self.requests, self.config),
        };
        observed.build(self.component, &requests, &config, spacing, reason)
    }

    fn observed(&self) -> Observed<'a> {
        Observed {
            observer: self.observer,
            component: self.index,
            components: self.components,
        }
    }

    fn is_small(&self) -> bool {
        let mesh = self.component.mesh.as_ref();
        mesh.map_or(true, |m| m.connectivity.face_count() <= SMALL)
    }
}

/// Hands each component to `work`, and what that makes of it to `take`, in order. Gives those that are inside out.
pub(super) fn each<T: Send>(
    soup: &Soup,
    config: &Config,
    observer: &dyn Observer,
    work: impl Fn(Part<'_>) -> T + Sync,
    mut take: impl FnMut(T) -> Result<(), BuildError>,
) -> Result<Vec<usize>, BuildError> {
    config.check()?;
    observer.stage("repair", 0, 1);
    let repaired = repair::repair(soup, &config.repair)?;
    if !repaired.log.is_empty() {
        tracing::info!("repair: {}", repaired.log.summary());
    }
    let config = config.clone().resolved()?;
    let config = &Config {
        images: config.images.held_by(soup),
        ..config
    };
    let assigned = |c: &Config| cones::assign(&repaired, &c.cones, &c.boundary, &c.features);
    let requests = assigned(config)?;
    let otherwise = assigned(&config.on_flat_patches())?;
    let shares = shares::shares(&repaired.components);
    let inside_out = inside_out(&repaired.components);
    let components = repaired.components.len();
    let wanted = requests.into_iter().zip(otherwise).zip(shares);
    let each = repaired.components.into_iter().zip(wanted).enumerate();
    let parts = each.map(|(index, (component, ((requests, otherwise), share)))| {
        let config = shares::of_share(config, share)?;
        Ok(Part {
            index,
            components,
            component,
            requests,
            flat: (otherwise, config.on_flat_patches()),
            config,
            observer,
        })
    });
    let parts: Vec<Part<'_>> = parts.collect::<Result<_, BuildError>>()?;
    let worked = |part: Part<'_>| {
        let index = part.index;
        let made = work(part);
        observer.finished(index, components);
        made
    };
    let mut small = Vec::new();
    for part in parts {
        match part.is_small() {
            true => small.push(part),
            false => {
                let before = parallel::beside(std::mem::take(&mut small), worked);
                before.into_iter().try_for_each(&mut take)?;
                take(worked(part))?;
            }
        }
    }
    let others = parallel::beside(small, worked);
    others.into_iter().try_for_each(take)?;
    Ok(inside_out)
}
