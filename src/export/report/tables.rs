//! Tables of the page. Every number is that of `atlas.json`, in full in `data-value`.

use crate::export::atlas_json::{ChartDomain, Document, Motion};
use crate::export::html::{escape, figure, link};
use crate::repair::RepairLog;
use serde_json::Value;
use std::f64::consts::PI;
use std::fmt::Write as _;

/// Changes of repair that are listed one by one.
const LISTED: usize = 200;

/// Figures: where in `atlas.json`, what they are, and their unit.
const FIGURES: [(&str, &str, &str); 27] = [
    ("/topology/vertices", "Vertices", ""),
    ("/topology/edges", "Edges", ""),
    ("/topology/faces", "Faces", ""),
    ("/topology/euler_characteristic", "Euler characteristic", ""),
    ("/topology/genus", "Genus", ""),
    ("/topology/boundary_loops", "Boundary loops", ""),
    ("/metric/iterations", "Steps of the flow", ""),
    ("/metric/flips", "Edges flipped", ""),
    (
        "/metric/max_curvature_error",
        "Largest curvature error",
        "rad",
    ),
    (
        "/metric/curvature_tolerance",
        "Curvature error asked for",
        "rad",
    ),
    ("/quality/area_distortion", "Area distortion (9)", ""),
    ("/quality/log_scale/min", "Least log scale", ""),
    ("/quality/log_scale/max", "Greatest log scale", ""),
    (
        "/quality/log_scale/std",
        "Standard deviation of the log scale",
        "",
    ),
    ("/quality/angle_error/mean", "Mean angle error", "rad"),
    ("/quality/angle_error/max", "Largest angle error", "rad"),
    (
        "/quality/conformal_error/rms",
        "Distance from a conformal map (rms of ln of squared lengths)",
        "",
    ),
    ("/quality/cut_length", "Length of the cut", "source units"),
    (
        "/quality/layout_closing_error",
        "Closing error of the layout",
        "source units",
    ),
    (
        "/quality/transition_residual",
        "Residual of transitions",
        "chart diameters",
    ),
    ("/quality/holonomy_error", "Holonomy error", "rad"),
    ("/quality/cocycle_error", "Cocycle error", "chart diameters"),
    (
        "/quality/image_psnr_db",
        "Surface rebuilt from the images: PSNR",
        "dB",
    ),
    (
        "/quality/image_hausdorff",
        "Largest distance of the rebuilt surface",
        "source units",
    ),
    (
        "/quality/image_normal_error/mean",
        "Mean angle of its normals",
        "rad",
    ),
    ("/connectivity/splits", "Splits around cones", ""),
    (
        "/flags/seamless",
        "Seamless (all gluings are quarter turns)",
        "",
    ),
];

/// A cell with a number.
fn cell(value: f64) -> String {
    number(value, &figure(value))
}

fn number(value: f64, words: &str) -> String {
    format!("<td class=\"number\" data-value=\"{value:?}\">{words}</td>")
}

fn whole(value: usize) -> String {
    format!("<td class=\"number\" data-value=\"{value}\">{value}</td>")
}

fn vertex_of_file(vertex: Option<u32>) -> String {
    match vertex {
        Some(v) => whole(v as usize),
        None => "<td data-value=\"\">made by repair</td>".to_owned(),
    }
}

/// Rows in a table that scrolls by itself; heads with a `#` stand over numbers.
fn table(id: &str, label: &str, heads: &[&str], rows: &str) -> String {
    let mut out = format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{label}\"><table id=\"{id}\" data-sortable><thead><tr>"
    );
    for head in heads {
        let _ = match head.strip_prefix('#') {
            Some(words) => write!(out, "<th scope=\"col\" class=\"number\">{words}</th>"),
            None => write!(out, "<th scope=\"col\">{head}</th>"),
        };
    }
    let _ = write!(out, "</tr></thead><tbody>\n{rows}</tbody></table></div>\n");
    out
}

/// What is in `atlas.json` of these figures.
pub(super) fn figures(document: &Value) -> String {
    let mut rows = String::new();
    for (pointer, words, unit) in FIGURES {
        let shown = match document.pointer(pointer) {
            Some(Value::Bool(true)) => "yes".to_owned(),
            Some(Value::Bool(false)) => "no".to_owned(),
            Some(Value::Number(n)) if n.is_f64() => figure(n.as_f64().unwrap_or(f64::NAN)),
            Some(Value::Number(n)) => n.to_string(),
            // What was not measured.
            _ => continue,
        };
        let value = document
            .pointer(pointer)
            .map(Value::to_string)
            .unwrap_or_default();
        let _ = writeln!(
            rows,
            "<tr><th scope=\"row\">{words}</th><td class=\"number\" data-key=\"{pointer}\" data-value=\"{value}\">{shown}</td><td>{unit}</td></tr>"
        );
    }
    format!(
        "<div class=\"scroll whole\" tabindex=\"0\" role=\"region\" aria-label=\"Figures\"><table class=\"figures\" id=\"figures\"><tbody>\n{rows}</tbody></table></div>\n"
    )
}

/// Cones with their curvature.
pub(super) fn cones(document: &Document) -> String {
    let mut rows = String::new();
    for cone in &document.cones {
        let sign = if cone.curvature > 0.0 {
            "▲ positive"
        } else {
            "◆ negative"
        };
        let _ = writeln!(
            rows,
            "<tr>{}{}{}{}<td>{sign}</td></tr>",
            whole(cone.vertex),
            vertex_of_file(cone.source_vertex),
            number(cone.curvature, &format!("{:.4}π", cone.curvature / PI)),
            cell(cone.curvature),
        );
    }
    let heads = [
        "#vertex",
        "#vertex of the file",
        "#curvature",
        "#[rad]",
        "mark",
    ];
    table("cones", "Cones", &heads, &rows)
}

fn motion(m: &Motion) -> String {
    let quarters = match m.quarter_turns {
        Some(n) => whole(usize::from(n)),
        None => "<td class=\"number\" data-value=\"\">–</td>".to_owned(),
    };
    format!(
        "{}{quarters}{}{}{}",
        cell(m.rotation),
        cell(m.translation[0]),
        cell(m.translation[1]),
        cell(m.residual)
    )
}

/// Transitions between charts.
pub(super) fn transitions(document: &Document) -> String {
    let mut rows = String::new();
    for t in &document.transitions {
        let kind = document
            .charts
            .get(t.to as usize)
            .map(|chart| match chart.domain {
                ChartDomain::Central => "central".to_owned(),
                ChartDomain::Boundary { segment } => format!("boundary, segment {segment}"),
                ChartDomain::Node { vertex } => format!("node, vertex {vertex}"),
            });
        let _ = writeln!(
            rows,
            "<tr>{}{}<td>{}</td>{}{}{}</tr>",
            whole(t.from as usize),
            whole(t.to as usize),
            kind.unwrap_or_default(),
            whole(usize::from(t.sector)),
            motion(&t.motion),
            whole(t.faces)
        );
    }
    let heads = [
        "#from",
        "#to",
        "kind",
        "#sector",
        "#rotation [rad]",
        "#quarters",
        "#x",
        "#y",
        "#residual",
        "#faces",
    ];
    table("transitions", "Transitions", &heads, &rows)
}

/// Segments of the cut with their gluings.
pub(super) fn segments(document: &Document) -> String {
    let mut rows = String::new();
    for s in &document.segments {
        let _ = writeln!(
            rows,
            "<tr>{}{}{}{}{}</tr>",
            whole(s.id),
            whole(s.from as usize),
            whole(s.to as usize),
            whole(s.vertices.len().saturating_sub(1)),
            motion(&s.gluing)
        );
    }
    let heads = [
        "#segment",
        "#from vertex",
        "#to vertex",
        "#edges",
        "#rotation [rad]",
        "#quarters",
        "#x",
        "#y",
        "#residual",
    ];
    table("segments", "Segments of the cut", &heads, &rows)
}

/// Patches with their images.
pub(super) fn patches(document: &Document, faces: &[usize]) -> String {
    let mut rows = String::new();
    for patch in &document.patches {
        let _ = writeln!(
            rows,
            "<tr>{}{}{}{}<td><a href=\"{}\">{}</a></td></tr>",
            whole(patch.id),
            whole(faces.get(patch.id).copied().unwrap_or(0)),
            whole(patch.width),
            whole(patch.height),
            link(&patch.image),
            escape(&patch.image)
        );
    }
    let heads = ["#patch", "#faces", "#columns", "#rows", "image"];
    table("patches", "Patches", &heads, &rows)
}

/// What repair changed: counts, then change by change.
pub(super) fn repair(document: &Document, log: &RepairLog) -> String {
    if document.repair.values().all(|&n| n == 0) {
        return "<p>Nothing was changed.</p>\n".to_owned();
    }
    let mut rows = String::new();
    for (name, &count) in document.repair.iter().filter(|&(_, &n)| n > 0) {
        let _ = writeln!(
            rows,
            "<tr><th scope=\"row\">{}</th><td class=\"number\" data-key=\"/repair/{}\" data-value=\"{count}\">{count}</td></tr>",
            escape(&name.replace('_', " ")),
            escape(name),
        );
    }
    let mut out = format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Counts of repairs\"><table class=\"figures\"><tbody>\n{rows}</tbody></table></div>\n"
    );
    if log.is_empty() {
        return out;
    }
    let _ = writeln!(
        out,
        "<details><summary>Change by change ({}), by vertices and faces of the file</summary><ol>",
        log.changes.len()
    );
    for change in log.changes.iter().take(LISTED) {
        let _ = writeln!(out, "<li>{}</li>", escape(&change.to_string()));
    }
    out.push_str("</ol>");
    if log.changes.len() > LISTED {
        let _ = write!(out, "<p>… and {} more.</p>", log.changes.len() - LISTED);
    }
    out.push_str("</details>\n");
    out
}

/// The steps of the flow in numbers.
pub(super) fn history(document: &Document) -> String {
    let mut rows = String::new();
    for step in &document.metric.history {
        let _ = writeln!(
            rows,
            "<tr>{}{}{}{}{}</tr>",
            whole(step.iteration),
            cell(step.max_error),
            cell(step.energy),
            cell(step.step),
            whole(step.flips)
        );
    }
    let heads = [
        "#step",
        "#max error [rad]",
        "#energy",
        "#step length",
        "#flips",
    ];
    let table = table("history", "Steps of the flow", &heads, &rows);
    format!("<details><summary>In numbers</summary>{table}</details>\n")
}
