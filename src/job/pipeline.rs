//! From a component to its atlas: all stages, each with what the ones before it made.

use super::BuildError;
use super::charting::{Charting, chart};
use crate::atlas::charted::Charted;
use crate::atlas::patches::Domain;
use crate::atlas::{geometry_image, patches};
use crate::config::Config;
use crate::flow::cones::Requests;
use crate::geometry::deviation::Triangles;
use crate::grid::{self, Spacing};
use crate::observe::{Observer, part};
use crate::product::AffineAtlas;
use crate::repair::Component;
use crate::report::{self, SurfaceImages};

/// The pipeline. `enter` is told each stage's name before it begins, and may stop the job; `spacing` is that of vertices that a coarse mesh gets for a grid,
/// `no_grid` says why there is none where one was wanted.
pub(super) fn pipeline(
    component: Component,
    requests: &Requests,
    config: &Config,
    spacing: Spacing,
    no_grid: Option<String>,
    observer: &dyn Observer,
    enter: &impl Fn(&'static str) -> Result<(), BuildError>,
) -> Result<AffineAtlas, BuildError> {
    let Charting {
        surface,
        layout,
        unfolded,
        given,
        given_faces,
        source,
        frame,
        log,
        connectivity_repair,
    } = chart(component, requests, config, spacing, observer, enter)?;
    let (surface, patches, grid, no_grid) = match config.domain() {
        Domain::Flat => {
            enter("patches")?;
            let patches = patches::layout(
                &surface.mesh,
                &surface.metric.length,
                &surface.cut,
                &surface.central,
                Some((&layout, &unfolded)),
                &config.patches,
            )?;
            (surface, patches, None, no_grid)
        }
        Domain::Grid => {
            enter("grid")?;
            let (surface, patches, grid) =
                grid::grid(surface, &config.grid, config.patches.padding, observer)?;
            (surface, patches, Some(grid), None)
        }
    };
    let Charted {
        mesh,
        metric,
        prescription,
        cut,
        central,
        charts,
    } = surface;
    enter("images")?;
    let image_origin = geometry_image::image_origin(&mesh, &frame);
    let origin = frame.enter(image_origin);
    let images = geometry_image::sample(&mesh, &patches, &metric.log_scale, origin);
    let images = match &source {
        Some(source) => geometry_image::sample_attributes(&mesh, &patches, images, source),
        None => images,
    };
    let mut images = images;
    if let Some(grid) = &grid {
        grid.unite(&mut images);
    }
    enter("report")?;
    let topology = mesh.connectivity.topology();
    let quality = report::measure(&mesh, &metric, &cut, &central, &charts, &prescription);
    let given = Triangles {
        positions: given.as_slice(),
        faces: &given_faces,
    };
    let _part = part!("image error");
    let surface_images = SurfaceImages {
        mesh: &mesh,
        layout: &patches,
        images: &images,
        origin,
    };
    let (quality, image_distance) = report::measure_images(
        quality,
        given,
        &surface_images,
        topology,
        config.patches.texel_budget,
        // What only the page shows.
        config.report.enabled,
    );
    let atlas = AffineAtlas {
        topology,
        seamless: report::is_seamless(&charts),
        repair: log.counts(),
        repair_log: log,
        image_distance: image_distance.map(Into::into),
        flow: config.flow.clone(),
        mesh,
        prescription,
        metric,
        cut,
        central,
        charts,
        patches,
        grid,
        no_grid,
        images,
        image_params: config.images.clone(),
        image_origin,
        connectivity_repair,
        quality,
    };
    Ok(atlas.leave(&frame))
}
