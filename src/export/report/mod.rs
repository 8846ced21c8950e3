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

use crate::export::atlas_json::{self, Document};
use crate::export::folder::Staging;
use crate::export::html::{self, escape, figure, link};
use crate::export::names;
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

/// What is written of a component for a browser (`[report]`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReportParams {
    /// Whether `report.html` is written.
    pub enabled: bool,
    /// Most faces of a surface that is drawn on the page.
    pub max_faces: usize,
    /// Standard deviation of the log scale above which a build warns of distortion, natural logarithm of length.
    pub distortion_warning: f64,
}

impl Default for ReportParams {
    /// 32 bytes a face, so that a page has about 16 MB at the most.
    fn default() -> Self {
        Self {
            enabled: true,
            max_faces: 500_000,
            distortion_warning: 0.5,
        }
    }
}

/// Writes the report of an atlas into a staging folder; `subfolder` as for
/// [`write_component`](crate::export::write_component).
pub fn write(
    staging: &Staging,
    subfolder: &str,
    atlas: &AffineAtlas,
    provenance: &Provenance,
    params: &ReportParams,
) -> Result<(), ExportError> {
    let path = match subfolder {
        "" => FILE_NAME.to_owned(),
        _ => format!("{subfolder}/{FILE_NAME}"),
    };
    let page =
        page(atlas, provenance, params).map_err(|error| error.at(&staging.target().join(&path)))?;
    staging.write(&path, page.as_bytes())
}

/// Why a page could not be made.
enum PageError {
    Export(ExportError),
    Pack(io::Error),
}

impl PageError {
    fn at(self, path: &std::path::Path) -> ExportError {
        match self {
            PageError::Export(error) => error,
            PageError::Pack(error) => ExportError::Encode {
                path: path.to_owned(),
                message: error.to_string(),
            },
        }
    }
}

/// The text of the page.
fn page(
    atlas: &AffineAtlas,
    provenance: &Provenance,
    params: &ReportParams,
) -> Result<String, PageError> {
    let document = atlas_json::describe(atlas, provenance).map_err(PageError::Export)?;
    let distortion = face_distortions(&atlas.mesh, &atlas.metric);
    let faces = atlas.mesh.connectivity.face_count();
    let drawing = match faces <= params.max_faces {
        true => Some(surface::draw(atlas, &distortion).map_err(PageError::Pack)?),
        false => None,
    };
    let mut body = String::new();
    header(&mut body, &document, provenance);
    match &drawing {
        Some(drawing) => views(&mut body, drawing),
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
    body.push_str(&tables::figures(&serde_json::json!(document)));
    let time = match document.metric.solver {
        Solver::Newton => "step",
        Solver::Gradient => "flow time",
    };
    let curve = plots::convergence(
        &document.metric.history,
        document.metric.curvature_tolerance,
        time,
    );
    let logs = Histogram::log_scale(distortion.iter().flatten());
    let angles = Histogram::angle_error(distortion.iter().flatten());
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
    Ok(html::page(
        &title,
        STYLE,
        &body,
        &scripts,
        html::Pictures::Inside,
    ))
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
    let cones = document.cones.len();
    let patches = document.patches.len();
    let _ = writeln!(
        body,
        "Made from <code>{}</code> by {} {}: {} faces, {cones} {}, {patches} {}.</p>",
        escape(&document.source.path),
        escape(&document.generator.name),
        escape(&document.generator.version),
        document.topology.faces,
        if cones == 1 { "cone" } else { "cones" },
        if patches == 1 { "patch" } else { "patches" },
    );
    body.push_str("<p>Files beside this page: ");
    let names = ["atlas.json", "atlas.npz", "surface.glb"];
    let links = names.map(|name| format!("<a href=\"{}\">{name}</a>", link(name)));
    let _ = writeln!(body, "{}.</p>", links.join(", "));
}

/// One view with its buttons.
fn view(body: &mut String, number: usize, name: &str, title: &str, more: &str, help: &str) {
    let _ = write!(
        body,
        "<figure class=\"view\"><figcaption><strong>{title}</strong>{more}\
         <span><button type=\"button\" data-view=\"{number}\" data-act=\"in\" aria-label=\"Zoom in\">+</button> \
         <button type=\"button\" data-view=\"{number}\" data-act=\"out\" aria-label=\"Zoom out\">−</button> \
         <button type=\"button\" data-view=\"{number}\" data-act=\"reset\">Reset</button></span></figcaption>\n\
         <canvas id=\"view-{name}\" width=\"600\" height=\"600\" tabindex=\"0\" role=\"img\" aria-label=\"{title}\" aria-describedby=\"read-{name}\"></canvas>\n\
         <output id=\"read-{name}\" data-empty=\"{help}\">{help}</output></figure>\n"
    );
}

fn views(body: &mut String, drawing: &Drawing) {
    body.push_str("<h2>Surface</h2>\n<form id=\"layers\" aria-label=\"What is shown\"><fieldset><legend>Colours</legend>\n");
    let layers = [
        ("board", "Checkerboard"),
        ("field", "Directions"),
        ("log-scale", "Log scale"),
        ("angle-error", "Angle error"),
        ("distance", "Distance of the images"),
        ("patches", "Patches"),
    ];
    for (value, words) in layers {
        let (state, hint) = match value {
            "board" => (" checked", ""),
            "distance" if drawing.scales.distance.is_none() => (" disabled", " (not measured)"),
            _ => ("", ""),
        };
        let _ = writeln!(
            body,
            "<label><input type=\"radio\" name=\"layer\" value=\"{value}\"{state}>{words}{hint}</label>"
        );
    }
    body.push_str("</fieldset><fieldset><legend>Lines and marks</legend>\n");
    for (name, words, state) in [
        ("cones", "Cones", " checked"),
        ("cut", "Cut", " checked"),
        ("features", "Features", " checked"),
        ("borders", "Borders of patches", ""),
        ("edges", "Edges of faces", ""),
    ] {
        if name == "features" && !drawing.has_features {
            continue;
        }
        let _ = writeln!(
            body,
            "<label><input type=\"checkbox\" name=\"{name}\"{state}>{words}</label>"
        );
    }
    body.push_str("</fieldset></form>\n");
    legends(body, &drawing.scales);
    body.push_str("<p id=\"surface-note\" role=\"status\">Unpacking …</p>\n<noscript><p>The views need JavaScript; figures and tables do not.</p></noscript>\n<div class=\"views\">\n");
    view(
        body,
        0,
        "space",
        "In space",
        "",
        "Drag or use the arrow keys to turn, with Shift to move, + and − to zoom, 0 to begin again; point, tap or press Enter to read a face.",
    );
    let choice = "<label><input type=\"radio\" name=\"plane\" value=\"packed\" checked>Patches</label><label><input type=\"radio\" name=\"plane\" value=\"chart\">Central chart</label>";
    view(
        body,
        1,
        "plane",
        "In the plane",
        choice,
        "Drag or use the arrow keys to move, + and − to zoom, 0 to begin again; point, tap or press Enter to read a face.",
    );
    body.push_str("</div>\n<ul class=\"key\">\
        <li><svg width=\"16\" height=\"16\" aria-hidden=\"true\"><path d=\"M8 2L15 14H1Z\" fill=\"var(--positive)\"/></svg>cone of positive curvature</li>\
        <li><svg width=\"16\" height=\"16\" aria-hidden=\"true\"><path d=\"M8 1L15 8L8 15L1 8Z\" fill=\"var(--negative)\"/></svg>cone of negative curvature</li>\
        <li><svg width=\"28\" height=\"10\" aria-hidden=\"true\"><path d=\"M0 5H28\" stroke=\"var(--halo)\" stroke-width=\"6\"/><path d=\"M0 5H28\" stroke=\"var(--cut)\" stroke-width=\"3\"/></svg>cut</li>\
        <li><svg width=\"28\" height=\"10\" aria-hidden=\"true\"><path d=\"M0 5H28\" stroke=\"var(--halo)\" stroke-width=\"6\"/><path d=\"M0 5H28\" stroke=\"var(--feature)\" stroke-width=\"3\"/></svg>feature that is a line</li>\
        <li><svg width=\"28\" height=\"10\" aria-hidden=\"true\"><path d=\"M0 5H28\" stroke=\"var(--ink)\" stroke-width=\"3\"/></svg>boundary</li>\
        <li><svg width=\"28\" height=\"10\" aria-hidden=\"true\"><path d=\"M0 5H28\" stroke=\"var(--border-line)\" stroke-width=\"1.5\"/></svg>border of patches</li></ul>\n");
}

/// What the colours mean.
fn legends(body: &mut String, scales: &Scales) {
    let rgb = |[r, g, b]: [u8; 3]| format!("rgb({r},{g},{b})");
    let diverging: Vec<String> = (0..7)
        .map(|i| {
            rgb(crate::export::pictures::colour::diverging(
                f64::from(i) / 3.0 - 1.0,
            ))
        })
        .collect();
    let rising: Vec<String> = RISING.iter().map(|&c| rgb(c)).collect();
    let [middle, reach] = scales.log_scale;
    let far = scales.distance.unwrap_or(0.0);
    body.push_str("<div class=\"legends\">\n<div class=\"legend\" data-legend=\"board\"><span class=\"words\">Squares are squares of the flat metric; where they would be too small or too large to see, sizes change by powers of two.</span></div>\n\
        <div class=\"legend\" data-legend=\"field\" hidden><span class=\"words\">Lines along both axes of the flat metric. Where all transitions turn by quarter turns they go on across the cut: a cross field, whose singular points are the cones.</span></div>\n");
    let mut bar = |layer: &str, words: &str, colours: &[String], ends: [f64; 3]| {
        let [low, mid, high] = ends.map(figure);
        let _ = writeln!(
            body,
            "<div class=\"legend\" data-legend=\"{layer}\" hidden><span class=\"words\">{words}</span><div class=\"bar\" style=\"background:linear-gradient(to right,{})\"></div><span>{low}</span><span>{mid}</span><span>{high}</span></div>",
            colours.join(",")
        );
    };
    bar(
        "log-scale",
        "½ ln(flat area / area in space) of a face; hatched where the flat metric shrinks it",
        &diverging,
        [middle - reach, middle, middle + reach],
    );
    bar(
        "angle-error",
        "Largest angle error of a face [rad]",
        &rising,
        [0.0, 0.5 * scales.angle_error, scales.angle_error],
    );
    bar(
        "distance",
        "Distance of the surface from the one rebuilt from the images [source units]",
        &rising,
        [0.0, 0.5 * far, far],
    );
    body.push_str("<div class=\"legend\" data-legend=\"patches\" hidden><span class=\"words\">One colour a patch, the same in space and in the plane; point at a face for its number.</span></div>\n</div>\n");
}

#[cfg(test)]
mod tests;
