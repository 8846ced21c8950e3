//! What a build says about an atlas beside that it is there.

use crate::config::Config;
use crate::product::AffineAtlas;

/// Sides of cells that differ by a greater factor are told.
const MOST_UNEVEN: f64 = 10.0;

/// More cells than asked for are told where they are more than so many times as many …
const TIMES_AS_MANY: usize = 2;
/// … and so many were asked for: small parts of a file have the fewest that there are.
const FEW_CELLS: usize = 200;

/// A greater part of sharp edges that are no lines is told.
const MOST_LEFT_OUT: f64 = 0.1;

/// A greater part of irregular points among cells is told.
const MOST_IRREGULAR: f64 = 0.1;

/// What is said where a part of sharp edges is in no feature.
pub(super) fn sharp_edges_left_out(part: f64) -> String {
    format!(
        "{:.0} % of the length of its sharp edges in no feature: they are short, or meet others at small angles; those that shall be lines all the same can be named in features.file",
        100.0 * part
    )
}

/// What is said where components are too many for folders.
pub(super) fn without_folders(given: &str, components: usize, config: &Config) -> Option<String> {
    let output = &config.output;
    (!output.has_component_folders(components)).then(|| {
        format!(
            "{given} has {components} components, more than the {} of output.component_folders: surface.glb has them all and components.json their figures, and none has quads.obj, atlas.json or images of its own",
            output.component_folders
        )
    })
}

/// What is said where closed components look inward; they are given by number.
pub(super) fn inside_out(given: &str, components: &[usize]) -> Option<String> {
    let first = components.first()?;
    let which = match components.len() {
        1 => format!("component {first} of {given} is closed and inside out: its faces look"),
        n => format!(
            "{n} components of {given}, the first of them {first}, are closed and inside out: their faces look"
        ),
    };
    Some(format!(
        "{which} inward, in surface.glb as in the file; turn them over in the program that made them (`affine-atlas fit` does of itself)"
    ))
}

/// What was asked for and could not be had, and much distortion, beginning with a verb.
pub(super) fn warnings(atlas: &AffineAtlas, config: &Config) -> Vec<String> {
    let mut notes = Vec::new();
    let (quality, most) = (&atlas.quality, config.report.distortion_warning);
    let flat =
        "images.domain = \"flat\" follows no sharp edges and borders, and is drawn more evenly";
    if quality.log_scale.std > most {
        notes.push(format!(
            "is drawn unevenly: the log scale deviates by {:.2} (report.distortion_warning = {most}), area distortion (9) is {:.2}; {}; `affine-atlas explain` shows where",
            quality.log_scale.std,
            quality.area_distortion,
            match atlas.grid {
                Some(_) => flat,
                None => "more cones help (`affine-atlas cones` shows how much)",
            }
        ));
    } else if let Some(grid) = &atlas.grid
        && grid.distortion.edge_ratio.p95 > MOST_UNEVEN * grid.distortion.edge_ratio.p05
    {
        let [p05, p95] = [
            grid.distortion.edge_ratio.p05,
            grid.distortion.edge_ratio.p95,
        ];
        notes.push(format!(
            "has cells of very different sizes: 5 % of their sides are shorter than {p05:.2} of that of a mean cell, 5 % longer than {p95:.2} of it; more cells (grid.cells) give thin parts more room, and {flat}"
        ));
    }
    if let Some(grid) = &atlas.grid
        && config.grid.cells >= FEW_CELLS
        && grid.cells() > TIMES_AS_MANY * config.grid.cells
    {
        notes.push(format!(
            "has {} cells, where grid.cells asks for {}: its {} irregular points and its lines along sharp edges and borders leave no room for fewer",
            grid.cells(),
            config.grid.cells,
            grid.irregular().len()
        ));
    }
    if let Some(met) = &atlas.metric.quarter_turns
        && !met.given_up.is_empty()
    {
        let all = met.lines.len() + met.given_up.len();
        notes.push(format!(
            "has {} of {all} features as lines: no metric was found with the others, too; `affine-atlas explain` says where they are, and features.file can name the edges that matter",
            met.lines.len()
        ));
    }
    if let Some(met) = &atlas.metric.quarter_turns
        && met.left_out > MOST_LEFT_OUT
    {
        notes.push(format!("has {}", sharp_edges_left_out(met.left_out)));
    }
    if let Some(grid) = &atlas.grid
        && grid.distortion.scaled_jacobian.not_positive > 0
    {
        let cells = grid.distortion.scaled_jacobian;
        notes.push(format!(
            "has {} of {} cells that are turned over at a corner or flat there, drawn with straight edges (least scaled Jacobian {:.2}): where sharp edges meet at small angles, or the surface is rough or bends within a cell; fewer lines along edges (a larger features.angle) or more cells (grid.cells) can help",
            cells.not_positive,
            grid.cells(),
            cells.min
        ));
    }
    if let Some(grid) = &atlas.grid
        && grid.irregular().len() as f64 > MOST_IRREGULAR * grid.cells() as f64
        && grid.cells() >= FEW_CELLS
    {
        notes.push(format!(
            "has {} irregular points in {} cells: its surface is rough, or has many sharp edges; smoothing it, a larger features.angle (fewer lines along edges) or cones.count (fewer cones) gives fewer",
            grid.irregular().len(),
            grid.cells()
        ));
    }
    if let Some(reason) = &atlas.no_grid {
        notes.push(format!("has flat patches instead of a grid: {reason}"));
    }
    let params = &config.patches;
    let count = atlas.patches.patches.len();
    if let Some(most) = params.max_count.filter(|&most| count > most) {
        notes.push(format!(
            "has {count} patches, more than the {most} of patches.max_count: with fewer, patches would overlap"
        ));
    }
    let side = atlas.patches.packed.as_ref().map(|packed| packed.side);
    if let (Some(most), Some(side)) = (params.packed_side, side)
        && side > most
    {
        notes.push(format!(
            "needs a packed image of {side} by {side} texels, more than the {most} of patches.packed_side: each of its {count} patches has at least patches.min_side texels"
        ));
    }
    notes
}
