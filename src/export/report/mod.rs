//! `report.html`: one component to look at in a browser.
//!
//! *Enters:* an [`AffineAtlas`] and its [`Provenance`]. *Leaves:* one file that needs nothing else, not even a network: the surface in
//! space and in the plane, drawn by `surface.js` with checkerboard, log scale, angle error, distance of the images, patches, cones and
//! cut; plots of flow and distortion; tables of figures, cones, transitions, segments, patches and repairs.
//!
//! *Guaranteed:* the same bytes for the same atlas and provenance; the numbers are those of `atlas.json`; names and messages are text,
//! whatever they hold; without WebGL 2 everything but the two views is there.
//! *Not guaranteed:* that a surface of more than `report.max_faces` faces is drawn.

mod pack;
mod plots;
mod surface;
mod tables;
pub mod whole;

use crate::export::atlas_json::{self, Document};
use crate::export::folder::Staging;
use crate::export::html::{self, escape, figure, link};
use crate::export::names;
use crate::export::pictures::colour::diverging;
use crate::export::{ExportError, Provenance};
use crate::flow::ricci::Solver;
use crate::product::AffineAtlas;
use crate::report::face_distortions;
use plots::Histogram;
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::io;
use surface::{Drawing, RISING, Scales};

/// Name of the file in the folder of a component.
pub const FILE_NAME: &str = names::REPORT;

const STYLE: &str = include_str!("report.css");
const SURFACE: &str = include_str!("surface.js");
const SCRIPT: &str = include_str!("report.js");
const VIEWS: &str = include_str!("views.html");

/// What is written of a component for a browser (`[report]`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReportParams {
    /// Whether `report.html` is written.
    pub enabled: bool,
    /// Most faces of a surface that is drawn on the page.
    pub max_faces: usize,
    /// Most components of an asset that have pages and pictures of their own, beside those of the asset.
    pub max_components: usize,
    /// Standard deviation of the log scale above which a build warns of distortion, natural logarithm of length.
    pub distortion_warning: f64,
}

impl Default for ReportParams {
    /// 32 bytes a face, so that a page has about 16 MB at the most.
    fn default() -> Self {
        Self {
            enabled: true,
            max_faces: 500_000,
            max_components: 16,
            distortion_warning: 0.5,
        }
    }
}

/// Writes the report of an atlas into a staging folder; `subfolder` as for
/// [`write_component`](crate::export::write_component), `notes` what the build said of it.
pub fn write(
    staging: &Staging,
    subfolder: &str,
    atlas: &AffineAtlas,
    provenance: &Provenance,
    params: &ReportParams,
    notes: &[String],
) -> Result<(), ExportError> {
    let path = match subfolder {
        "" => FILE_NAME.to_owned(),
        _ => format!("{subfolder}/{FILE_NAME}"),
    };
    let encoding = |error: io::Error| ExportError::Encode {
        path: staging.target().join(&path),
        message: error.to_string(),
    };
    let page = page(atlas, provenance, params, notes, encoding)?;
    staging.write(&path, page.as_bytes())
}

/// The text of the page; `encoding` tells what becomes of an error of packing the surface.
fn page(
    atlas: &AffineAtlas,
    provenance: &Provenance,
    params: &ReportParams,
    notes: &[String],
    encoding: impl Fn(io::Error) -> ExportError,
) -> Result<String, ExportError> {
    let document = atlas_json::describe(atlas, provenance)?;
    let distortion = face_distortions(&atlas.mesh, &atlas.metric);
    let faces = atlas.mesh.connectivity.face_count();
    let drawing = match faces <= params.max_faces {
        true => Some(surface::draw(atlas, &distortion).map_err(encoding)?),
        false => None,
    };
    let mut body = String::new();
    header(&mut body, &document, provenance);
    list_notes(&mut body, notes);
    match &drawing {
        Some(drawing) => body.push_str(&views(drawing)),
        None => {
            let _ = write!(
                body,
                "<h2>Surface</h2>\n<p>The surface has {faces} faces, more than the {} of <code>report.max_faces</code>, so it is not drawn here. \
                 Raise that, or open <a href=\"./surface.glb\">surface.glb</a>.</p>\n",
                params.max_faces
            );
        }
    }
    body.push_str("<h2>Figures</h2>\n");
    body.push_str(&tables::figures(&document.to_value()));
    let time = match document.metric.solver {
        Solver::Newton => "step",
        Solver::Gradient => "flow time",
    };
    let curve = plots::convergence(
        &document.metric.history,
        document.metric.curvature_tolerance,
        time,
    );
    let of_faces = || distortion.iter().flatten();
    let logs = Histogram::new(of_faces().map(|d| (d.log_scale, d.weight)));
    let of_corners = of_faces().flat_map(|d| d.angle_error.map(|error| (error, d.weight / 3.0)));
    let angles = Histogram::new(of_corners);
    let quality = &document.quality;
    let _ = write!(
        body,
        "<h2>Flow and distortion</h2>\n<div class=\"plots\">\n\
         <figure><figcaption>Convergence; dashed: what was asked for</figcaption>{curve}</figure>\n\
         <figure><figcaption>Log scale, from {} to {}</figcaption>{}</figure>\n\
         <figure><figcaption>Angle error of corners, mean {} rad, largest {} rad</figcaption>{}</figure>\n</div>\n",
        figure(quality.log_scale.min),
        figure(quality.log_scale.max),
        logs.draw(
            "Histogram of the log scale by area",
            "½ ln(flat area / source area)"
        ),
        figure(quality.angle_error.mean),
        figure(quality.angle_error.max),
        angles.draw("Histogram of angle errors by area", "angle error [rad]"),
    );
    body.push_str(&tables::history(&document));
    let mut patch_faces = vec![0usize; document.patches.len()];
    for patch in atlas.patches.face_patch.iter() {
        if let Some(count) = patch_faces.get_mut(patch.index()) {
            *count += 1;
        }
    }
    for (title, table) in [
        ("Cones", tables::cones(&document)),
        ("Transitions", tables::transitions(&document)),
        ("Segments of the cut", tables::segments(&document)),
        ("Patches", tables::patches(&document, &patch_faces)),
        ("Repair", tables::repair(&document, &atlas.repair_log)),
    ] {
        let _ = write!(body, "<h2>{title}</h2>\n{table}");
    }
    let _ = writeln!(
        body,
        "<p class=\"soft\">Input <code>{}</code>, configuration <code>{}</code> (BLAKE3).</p>",
        escape(&document.source.blake3),
        escape(&document.source.config_blake3)
    );
    let _ = writeln!(
        body,
        "<p class=\"soft\">Lengths are in the units of the mesh file, angles in radians. Faces and vertices are rows of <code>atlas.npz</code> unless they are said to be of the file.</p>"
    );
    if let Some(drawing) = &drawing {
        let _ = write!(
            body,
            "<script type=\"application/json\" id=\"surface-meta\">{}</script>\n<script type=\"text/plain\" id=\"surface-data\">{}</script>\n",
            html::json(&drawing.meta),
            drawing.data
        );
    }
    let title = format!("{} · affine atlas", provenance.asset);
    let scripts = [html::TABLES, SURFACE, SCRIPT];
    Ok(html::page(&title, STYLE, &body, &scripts, html::INSIDE))
}

/// What the build said on standard error, for who comes later.
fn list_notes(body: &mut String, notes: &[String]) {
    if notes.is_empty() {
        return;
    }
    body.push_str("<h2>Notes</h2>\n<ul>\n");
    for note in notes {
        let _ = writeln!(body, "<li>{}</li>", escape(note));
    }
    body.push_str("</ul>\n");
}

fn header(body: &mut String, document: &Document, provenance: &Provenance) {
    let _ = write!(body, "<h1>{}</h1>\n<p>", escape(provenance.asset));
    if provenance.components > 1 {
        let _ = write!(
            body,
            "Component {} of {}, counted from 0. ",
            provenance.component, provenance.components
        );
    }
    let counted = |n: usize, words: [&str; 2]| format!("{n} {}", words[usize::from(n != 1)]);
    let _ = writeln!(
        body,
        "Made from <code>{}</code> by {} {}: {} faces, {}, {}.</p>",
        escape(&document.source.path),
        escape(&document.generator.name),
        escape(&document.generator.version),
        document.topology.faces,
        counted(document.cones.len(), ["cone", "cones"]),
        counted(document.patches.len(), ["patch", "patches"]),
    );
    body.push_str("<p>Files beside this page: ");
    let names = ["atlas.json", "atlas.npz", "surface.glb"];
    let links = names.map(|name| format!("<a href=\"{}\">{name}</a>", link(name)));
    let _ = writeln!(body, "{}.</p>", links.join(", "));
}

/// Both views of the surface, what can be shown in them, and what colours and lines mean.
fn views(drawing: &Drawing) -> String {
    let Scales {
        log_scale: [middle, reach],
        angle_error,
        distance,
    } = drawing.scales;
    let bar = |stops: Vec<[u8; 3]>, ends: [f64; 3]| {
        let rgb = stops.iter().map(|[r, g, b]| format!("rgb({r},{g},{b})"));
        let stops = rgb.collect::<Vec<_>>().join(",");
        let ends = ends.map(|x| format!("<span>{}</span>", figure(x))).concat();
        format!(
            "<div class=\"bar\" style=\"background:linear-gradient(to right,{stops})\"></div>{ends}"
        )
    };
    let both_ways = (0..7)
        .map(|i| diverging(f64::from(i) / 3.0 - 1.0))
        .collect();
    let upward = |most: f64| bar(RISING.to_vec(), [0.0, 0.5 * most, most]);
    let features = "<label><input type=\"checkbox\" name=\"features\" checked>Features</label>\n";
    let [state, hint] = match distance {
        Some(_) => ["", ""],
        None => [" disabled", " (not measured)"],
    };
    let texts = [
        ("{distance-state}", state.to_owned()),
        ("{distance-hint}", hint.to_owned()),
        (
            "{features}",
            if drawing.has_features { features } else { "" }.to_owned(),
        ),
        (
            "{log-scale}",
            bar(both_ways, [middle - reach, middle, middle + reach]),
        ),
        ("{angle-error}", upward(angle_error)),
        ("{distance}", upward(distance.unwrap_or(0.0))),
    ];
    let fill = |page: String, (name, text): (&str, String)| page.replace(name, &text);
    texts.into_iter().fold(VIEWS.to_owned(), fill)
}

#[cfg(test)]
mod tests;
