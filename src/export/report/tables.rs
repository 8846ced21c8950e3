//! Tables of the page. Every number is that of `atlas.json`, in full in `data-value`.

use crate::export::atlas_json::{ChartDomain, Document, Motion};
use crate::export::html::{escape, figure, link};
use crate::repair::RepairLog;
use serde_json::Value;
use std::f64::consts::PI;
use std::fmt::Write as _;

/// Changes of repair that are listed one by one.
const LISTED: usize = 200;

/// Figures: where in `atlas.json`, what they are, and their unit, one a line.
const FIGURES: &str = "\
/topology/vertices|Vertices|\n\
/topology/edges|Edges|\n\
/topology/faces|Faces|\n\
/topology/euler_characteristic|Euler characteristic|\n\
/topology/genus|Genus|\n\
/topology/boundary_loops|Boundary loops|\n\
/metric/iterations|Steps of the flow|\n\
/metric/flips|Edges flipped|\n\
/metric/max_curvature_error|Largest curvature error|rad\n\
/metric/curvature_tolerance|Curvature error asked for|rad\n\
/quality/area_distortion|Area distortion (9)|\n\
/quality/log_scale/min|Least log scale|\n\
/quality/log_scale/max|Greatest log scale|\n\
/quality/log_scale/std|Standard deviation of the log scale|\n\
/quality/angle_error/mean|Mean angle error|rad\n\
/quality/angle_error/max|Largest angle error|rad\n\
/quality/conformal_error/rms|Distance from a conformal map (rms of ln of squared lengths)|\n\
/quality/cut_length|Length of the cut|source units\n\
/quality/layout_closing_error|Closing error of the layout|source units\n\
/quality/transition_residual|Residual of transitions|chart diameters\n\
/quality/holonomy_error|Holonomy error|rad\n\
/quality/cocycle_error|Cocycle error|chart diameters\n\
/quality/image_psnr_db|Surface rebuilt from the images: PSNR|dB\n\
/quality/image_hausdorff|Largest distance of the rebuilt surface|source units\n\
/quality/image_normal_error/mean|Mean angle of its normals|rad\n\
/connectivity/splits|Splits around cones|\n\
/flags/seamless|Seamless (all gluings are quarter turns)|";

/// A cell with a number.
pub(super) fn cell(value: f64) -> String {
    number(value, &figure(value))
}

fn number(value: f64, words: &str) -> String {
    format!("<td class=\"number\" data-value=\"{value:?}\">{words}</td>")
}

pub(super) fn whole(value: usize) -> String {
    format!("<td class=\"number\" data-value=\"{value}\">{value}</td>")
}

fn vertex_of_file(vertex: Option<u32>) -> String {
    match vertex {
        Some(v) => whole(v as usize),
        None => "<td data-value=\"\">made by repair</td>".to_owned(),
    }
}

/// Rows in a table that scrolls by itself; heads have `|` between them, and those with a `#` stand over numbers.
pub(super) fn table(id: &str, label: &str, heads: &str, rows: &str) -> String {
    let mut out = format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{label}\"><table id=\"{id}\" data-sortable><thead><tr>"
    );
    for head in heads.split('|') {
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
    for line in FIGURES.lines() {
        let [pointer, words, unit] = [0, 1, 2].map(|k| line.split('|').nth(k).unwrap_or_default());
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

pub(super) fn row(cells: &[String]) -> String {
    format!("<tr>{}</tr>\n", cells.concat())
}

/// Cones with their curvature.
pub(super) fn cones(document: &Document) -> String {
    let rows = document.cones.iter().map(|cone| {
        let sign = match cone.curvature > 0.0 {
            true => "▲ positive",
            false => "◆ negative",
        };
        row(&[
            whole(cone.vertex),
            vertex_of_file(cone.source_vertex),
            number(cone.curvature, &format!("{:.4}π", cone.curvature / PI)),
            cell(cone.curvature),
            format!("<td>{sign}</td>"),
        ])
    });
    let heads = "#vertex|#vertex of the file|#curvature|#[rad]|mark";
    table("cones", "Cones", heads, &rows.collect::<String>())
}

fn motion(m: &Motion) -> String {
    let quarters = match m.quarter_turns {
        Some(n) => whole(usize::from(n)),
        None => "<td class=\"number\" data-value=\"\">–</td>".to_owned(),
    };
    let [x, y] = m.translation.map(cell);
    [cell(m.rotation), quarters, x, y, cell(m.residual)].concat()
}

/// Transitions between charts.
pub(super) fn transitions(document: &Document) -> String {
    let rows = document.transitions.iter().map(|t| {
        let chart = document.charts.get(t.to as usize);
        let kind = match chart.map(|chart| &chart.domain) {
            Some(ChartDomain::Central) => "central".to_owned(),
            Some(ChartDomain::Boundary { segment }) => format!("boundary, segment {segment}"),
            Some(ChartDomain::Node { vertex }) => format!("node, vertex {vertex}"),
            None => String::new(),
        };
        row(&[
            whole(t.from as usize),
            whole(t.to as usize),
            format!("<td>{kind}</td>"),
            whole(usize::from(t.sector)),
            motion(&t.motion),
            whole(t.faces),
        ])
    });
    let heads = "#from|#to|kind|#sector|#rotation [rad]|#quarters|#x|#y|#residual|#faces";
    table(
        "transitions",
        "Transitions",
        heads,
        &rows.collect::<String>(),
    )
}

/// Segments of the cut with their gluings.
pub(super) fn segments(document: &Document) -> String {
    let rows = document.segments.iter().map(|s| {
        let ends = [s.from, s.to].map(|v| whole(v as usize)).concat();
        let edges = whole(s.vertices.len().saturating_sub(1));
        row(&[whole(s.id), ends, edges, motion(&s.gluing)])
    });
    let heads = "#segment|#from vertex|#to vertex|#edges|#rotation [rad]|#quarters|#x|#y|#residual";
    table(
        "segments",
        "Segments of the cut",
        heads,
        &rows.collect::<String>(),
    )
}

/// Patches with their images.
pub(super) fn patches(document: &Document, faces: &[usize]) -> String {
    let rows = document.patches.iter().map(|patch| {
        let (to, name) = (link(&patch.image), escape(&patch.image));
        row(&[
            whole(patch.id),
            whole(faces.get(patch.id).copied().unwrap_or(0)),
            whole(patch.width),
            whole(patch.height),
            format!("<td><a href=\"{to}\">{name}</a></td>"),
        ])
    });
    let heads = "#patch|#faces|#columns|#rows|image";
    table("patches", "Patches", heads, &rows.collect::<String>())
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
    let rows = document.metric.history.iter().map(|step| {
        let [error, energy, length] = [step.max_error, step.energy, step.step].map(cell);
        row(&[
            whole(step.iteration),
            error,
            energy,
            length,
            whole(step.flips),
        ])
    });
    let heads = "#step|#max error [rad]|#energy|#step length|#flips";
    let table = table(
        "history",
        "Steps of the flow",
        heads,
        &rows.collect::<String>(),
    );
    format!("<details><summary>In numbers</summary>{table}</details>\n")
}
