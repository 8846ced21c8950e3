//! The page itself.

use super::assets::Asset;
use super::changes::{Change, Changes, WORSE_BY, WORSE_FACTOR};
use crate::export::html::{self, escape, link};
use crate::export::manifest::State;
use crate::export::names::{self, component_name};
use std::fmt::Write as _;

const STYLE: &str = include_str!("index.css");
const SCRIPT: &str = include_str!("index.js");

/// Rows of the lists of slowest and worst.
const LEADING: usize = 10;
/// Links to reports that stand beside an asset; one of many components has more.
const REPORTS: usize = 3;
/// Warnings of an asset that are shown.
const WARNINGS: usize = 4;

fn name(state: State) -> &'static str {
    match state {
        State::Built => "built",
        State::Cached => "cached",
        State::Failed => "failed",
        State::Cancelled => "cancelled",
    }
}

/// A sign beside the word, so that states differ without colour.
fn sign(state: State) -> &'static str {
    match state {
        State::Built => "●",
        State::Cached => "○",
        State::Failed => "✕",
        State::Cancelled => "–",
    }
}

/// The whole page.
pub(super) fn page(assets: &[Asset<'_>], changes: &Changes) -> String {
    let mut body = String::from("<h1>Atlases</h1>\n");
    counts(&mut body, assets);
    compared(&mut body, assets, changes);
    failures(&mut body, assets);
    warnings(&mut body, assets);
    leading(&mut body, assets);
    all(&mut body, assets, changes);
    let version = concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION"));
    let _ = writeln!(
        body,
        "<p class=\"soft\">Written by {version} from manifest.jsonl and the atlas.json of each asset.</p>"
    );
    html::page(
        "Atlases",
        STYLE,
        &body,
        &[html::TABLES, SCRIPT],
        html::BESIDE,
    )
}

fn counts(body: &mut String, assets: &[Asset<'_>]) {
    let seconds: f64 = assets.iter().map(|a| a.record.seconds).sum();
    let _ = writeln!(
        body,
        "<p>{} asset{}, {} of work together.</p>\n<div class=\"counts\" role=\"group\" aria-label=\"Show assets by state\">",
        assets.len(),
        if assets.len() == 1 { "" } else { "s" },
        duration(seconds)
    );
    let _ = writeln!(
        body,
        "<button type=\"button\" data-state=\"\" aria-pressed=\"true\"><b>{}</b> all</button>",
        assets.len()
    );
    for state in [State::Failed, State::Cancelled, State::Built, State::Cached] {
        let count = assets.iter().filter(|a| a.record.state == state).count();
        let _ = writeln!(
            body,
            "<button type=\"button\" class=\"{0}\" data-state=\"{0}\" aria-pressed=\"false\"><b>{count}</b> {1} {0}</button>",
            name(state),
            sign(state)
        );
    }
    body.push_str("</div>\n");
}

/// Seconds as people say them.
pub(super) fn duration(seconds: f64) -> String {
    let whole = seconds.clamp(0.0, 1e12).round() as u64;
    match (whole / 3600, whole / 60 % 60) {
        (0, 0) if seconds < 10.0 => format!("{seconds:.2} s"),
        (0, 0) => format!("{seconds:.1} s"),
        (0, minutes) => format!("{minutes} min {} s", whole % 60),
        (hours, minutes) => format!("{hours} h {minutes} min"),
    }
}

/// A number with three digits, and a power of ten where it is very large or small.
pub(super) fn three_digits(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".to_owned()
    } else if !x.is_finite() || !(1e-3..1e5).contains(&size) {
        format!("{x:.2e}")
    } else {
        let digits = (2 - size.log10().floor() as i32).clamp(0, 5) as usize;
        format!("{x:.digits$}")
    }
}

/// A count with its thousands apart.
pub(super) fn count(x: f64) -> String {
    let digits = format!("{x:.0}");
    let mut out = String::with_capacity(digits.len() + digits.len() / 3 * 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

/// Bytes as people say them.
pub(super) fn memory(bytes: f64) -> String {
    match bytes {
        b if b < 1e6 => format!("{:.0} kB", b / 1e3),
        b if b < 1e9 => format!("{:.0} MB", b / 1e6),
        b => format!("{:.1} GB", b / 1e9),
    }
}

/// An angle in radians as people say it.
pub(super) fn angle(radians: f64) -> String {
    format!("{}°", three_digits(radians.to_degrees()))
}

/// The picture of an asset that was built, or of its first component, if pictures were drawn. The browser fetches it when it comes into view.
fn thumbnail(asset: &Asset<'_>) -> String {
    let record = asset.record;
    if !matches!(record.state, State::Built | State::Cached) {
        return String::new();
    }
    let ending = format!("/{}", names::PREVIEW);
    let inside = |file: &&String| file.ends_with(&ending) && !file.split('/').any(|p| p == "..");
    let mut pictures = record.files.iter().filter(inside);
    let own = format!("{}{ending}", record.id);
    match pictures
        .clone()
        .find(|file| **file == own)
        .or_else(|| pictures.next())
    {
        Some(file) => format!(
            "<img src=\"{}\" alt=\"\" width=\"64\" height=\"64\" loading=\"lazy\" decoding=\"async\">",
            link(file)
        ),
        None => String::new(),
    }
}

/// The id with a link to its folder, and to its reports.
fn linked(asset: &Asset<'_>) -> String {
    let id = &asset.record.id;
    if asset.record.files.is_empty() {
        return escape(id);
    }
    let mut out = format!("<a href=\"{}\">{}</a>", link(&format!("{id}/")), escape(id));
    let ending = format!("/{}", names::REPORT);
    let mut reports: Vec<&String> = (asset.record.files.iter())
        .filter(|file| file.ends_with(&ending))
        .collect();
    // That of the asset links to those of its components.
    let own = format!("{id}{ending}");
    if reports.iter().any(|file| **file == own) {
        reports.retain(|file| **file == own);
    }
    for file in reports.iter().take(REPORTS) {
        let words = match component(file) {
            Some(number) => format!("report {number}"),
            None => "report".to_owned(),
        };
        let _ = write!(out, " · <a href=\"{}\">{words}</a>", link(file));
    }
    if reports.len() > REPORTS {
        let _ = write!(out, " · {} more", reports.len() - REPORTS);
    }
    out
}

/// The number of the component whose folder a file lies in, where an asset has several.
fn component(file: &str) -> Option<usize> {
    let (folder, _) = file.rsplit_once('/')?;
    let (_, name) = folder.rsplit_once('/')?;
    let number = name.rsplit_once('-')?.1.parse().ok()?;
    (name == component_name(number)).then_some(number)
}

fn sentence(asset: &Asset<'_>) -> String {
    let record = asset.record;
    let kind = record.kind.map_or("", |kind| kind.name());
    let error = record.error.as_deref().unwrap_or("no reason was recorded");
    let kept = match record.files.is_empty() {
        true => "",
        false => " <span class=\"soft\">– the result of an earlier run is still in place</span>",
    };
    format!("<b>{kind}</b>: {}{kept}", escape(error))
}

fn compared(body: &mut String, assets: &[Asset<'_>], changes: &Changes) {
    body.push_str("<h2>Changes against the run before</h2>\n");
    if !changes.compared {
        body.push_str("<p>There was none.</p>\n");
        return;
    }
    let mut any = false;
    type Belongs = fn(Change) -> bool;
    let groups: [(&str, Belongs); 4] = [
        ("New failures", |c| c == Change::NewFailure),
        ("Fixed", |c| c == Change::Fixed),
        ("Worse distortion", |c| matches!(c, Change::Worse(..))),
        ("New", |c| c == Change::New),
    ];
    for (title, is_in) in groups {
        let rows: Vec<(&Asset<'_>, Change)> = (assets.iter().zip(&changes.of))
            .filter_map(|(asset, change)| Some((asset, (*change)?)))
            .filter(|&(_, change)| is_in(change))
            .collect();
        if rows.is_empty() {
            continue;
        }
        any = true;
        let note = match rows[0].1 {
            Change::Worse(..) => format!(
                " <span class=\"soft\">(area distortion more than {WORSE_FACTOR} times what it was, and {WORSE_BY} more)</span>"
            ),
            _ => String::new(),
        };
        let open = match rows[0].1 {
            Change::New => "",
            _ => " open",
        };
        let _ = writeln!(
            body,
            "<details class=\"change\"{open}><summary><b>{}</b> {title}{note}</summary><ul>",
            rows.len()
        );
        for (asset, change) in rows {
            let more = match change {
                Change::NewFailure => format!(": {}", sentence(asset)),
                Change::Worse(old, new) => {
                    format!(": {} → {}", three_digits(old), three_digits(new))
                }
                Change::Fixed | Change::New => String::new(),
            };
            let _ = writeln!(body, "<li>{}{more}</li>", linked(asset));
        }
        body.push_str("</ul></details>\n");
    }
    if !changes.absent.is_empty() {
        any = true;
        let _ = writeln!(
            body,
            "<details class=\"change\"><summary><b>{}</b> Not in this run</summary><ul>",
            changes.absent.len()
        );
        for id in &changes.absent {
            let _ = writeln!(body, "<li>{}</li>", escape(id));
        }
        body.push_str("</ul></details>\n");
    }
    if !any {
        body.push_str("<p>None.</p>\n");
    }
}

fn failures(body: &mut String, assets: &[Asset<'_>]) {
    let failed: Vec<&Asset<'_>> = (assets.iter())
        .filter(|a| a.record.state == State::Failed)
        .collect();
    if failed.is_empty() {
        return;
    }
    let _ = write!(
        body,
        "<h2>Failures</h2>\n<details open><summary><b>{}</b> failed</summary><ul id=\"failures\">\n",
        failed.len()
    );
    for asset in failed {
        let _ = writeln!(body, "<li>{}: {}</li>", linked(asset), sentence(asset));
    }
    body.push_str("</ul></details>\n");
}

/// What was said of assets when they were built.
fn warnings(body: &mut String, assets: &[Asset<'_>]) {
    let warned = || assets.iter().filter(|a| !a.record.warnings.is_empty());
    let count = warned().count();
    if count == 0 {
        return;
    }
    let _ = write!(
        body,
        "<h2>Warnings</h2>\n<details><summary><b>{count}</b> with warnings</summary><ul id=\"warnings\">\n"
    );
    for asset in warned() {
        let all = asset.record.warnings.iter();
        let shown: Vec<String> = all.take(WARNINGS).map(|text| escape(text)).collect();
        let more = asset.record.warning_count.saturating_sub(shown.len());
        let more = match more {
            0 => String::new(),
            more => format!("<br><span class=\"soft\">{more} more</span>"),
        };
        let _ = writeln!(
            body,
            "<li>{}: {}{more}</li>",
            linked(asset),
            shown.join("<br>")
        );
    }
    body.push_str("</ul></details>\n");
}

/// The slowest, and those with the worst distortion.
fn leading(body: &mut String, assets: &[Asset<'_>]) {
    let mut slowest: Vec<(&Asset<'_>, f64)> = (assets.iter())
        .filter(|a| a.record.state != State::Cached)
        .map(|a| (a, a.record.seconds))
        .collect();
    let mut worst: Vec<(&Asset<'_>, f64)> = (assets.iter())
        .filter_map(|a| Some((a, a.figures.as_ref()?.area_distortion)))
        .collect();
    body.push_str("<div class=\"leading\">\n");
    type Words = fn(f64) -> String;
    for (title, words, rows) in [
        ("Slowest", duration as Words, &mut slowest),
        ("Worst area distortion", three_digits, &mut worst),
    ] {
        rows.sort_by(|a, b| b.1.total_cmp(&a.1));
        let _ = write!(body, "<section><h2>{title}</h2>\n<ol>\n");
        for (asset, value) in rows.iter().take(LEADING) {
            let _ = writeln!(body, "<li>{}: {}</li>", linked(asset), words(*value));
        }
        body.push_str("</ol></section>\n");
    }
    body.push_str("</div>\n");
}

/// Columns of the table: head, whether it holds numbers, and what these are.
const HEADS: [(&str, bool, &str); 18] = [
    ("asset", false, "links to its folder and its reports"),
    ("state", false, "what became of it in this run"),
    ("change", false, "against the runs before"),
    ("time", true, "wall time of its build"),
    ("memory", true, "most memory that its process took"),
    ("faces", true, "faces of the surface in atlas.npz"),
    ("genus", true, "handles of all components"),
    ("loops", true, "boundary loops of all components"),
    ("cones", true, "vertices of prescribed curvature"),
    ("patches", true, "geometry images"),
    (
        "cells",
        true,
        "of the grids of all components; none: flat patches",
    ),
    ("irregular", true, "irregular points of these grids"),
    (
        "area distortion",
        true,
        "(9) of the tutorial, the worst component; 0 is none",
    ),
    (
        "log scale",
        true,
        "standard deviation of the logarithm of the length scale, the worst component; 0 is none",
    ),
    (
        "angle error",
        true,
        "mean difference of corner angles, the worst component",
    ),
    (
        "images",
        true,
        "PSNR of the surface rebuilt from the images, the worst component",
    ),
    ("warnings", true, "what was said of it when it was built"),
    ("kind", false, "of a failure"),
];

fn all(body: &mut String, assets: &[Asset<'_>], changes: &Changes) {
    body.push_str(
        "<h2 id=\"all\">All assets</h2>\n<form id=\"filter\" role=\"search\"><label>Find <input type=\"search\" name=\"text\" autocomplete=\"off\" placeholder=\"id, kind, words of a failure or warning\"></label> <output id=\"shown\" aria-live=\"polite\"></output></form>\n\
         <div class=\"scroll tall\" tabindex=\"0\" role=\"region\" aria-label=\"All assets\"><table id=\"assets\" data-sortable><thead><tr>",
    );
    for (head, is_number, meaning) in HEADS {
        let class = if is_number { " class=\"number\"" } else { "" };
        let _ = write!(
            body,
            "<th scope=\"col\"{class} title=\"{meaning}\">{head}</th>"
        );
    }
    body.push_str("</tr></thead><tbody>\n");
    for (asset, change) in assets.iter().zip(&changes.of) {
        row(body, asset, *change);
    }
    body.push_str("</tbody></table></div>\n");
}

fn row(body: &mut String, asset: &Asset<'_>, change: Option<Change>) {
    let record = asset.record;
    let state = name(record.state);
    let said = record.error.iter().chain(&record.warnings);
    let said: Vec<&str> = said.map(String::as_str).collect();
    let _ = write!(
        body,
        "<tr data-state=\"{state}\" data-words=\"{}\"><td data-value=\"{}\">{}<span>{}</span></td><td class=\"{state}\" data-value=\"{state}\">{} {state}</td><td>{}</td>",
        escape(&said.join(" ")),
        escape(&record.id),
        thumbnail(asset),
        linked(asset),
        sign(record.state),
        change.map_or("", Change::name)
    );
    let mut number = |value: Option<f64>, words: &dyn Fn(f64) -> String| {
        let _ = match value {
            Some(value) => write!(
                body,
                "<td class=\"number\" data-value=\"{value:?}\">{}</td>",
                words(value)
            ),
            None => write!(body, "<td class=\"number\" data-value=\"\">–</td>"),
        };
    };
    // What was kept from an earlier run took no time in this one.
    let built = record.state != State::Cached;
    number(built.then_some(record.seconds), &duration);
    number(record.peak_memory.map(|bytes| bytes as f64), &memory);
    let of = asset.figures.as_ref();
    number(of.map(|f| f.faces as f64), &count);
    number(of.map(|f| f.genus as f64), &count);
    number(of.map(|f| f.boundary_loops as f64), &count);
    number(of.map(|f| f.cones as f64), &count);
    number(of.map(|f| f.patches as f64), &count);
    number(of.and_then(|f| f.cells).map(|n| n as f64), &count);
    number(of.and_then(|f| f.irregular).map(|n| n as f64), &count);
    number(of.map(|f| f.area_distortion), &three_digits);
    number(of.map(|f| f.log_scale_std), &three_digits);
    number(of.map(|f| f.angle_error_mean), &angle);
    number(of.and_then(|f| f.image_psnr_db), &|x| format!("{x:.1} dB"));
    number(Some(record.warning_count as f64), &count);
    let kind = record.kind.map_or("", |kind| kind.name());
    let _ = writeln!(body, "<td>{kind}</td></tr>");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_have_the_numbers_of_their_components() {
        assert_eq!(component("spot/report.html"), None);
        assert_eq!(component("spot/component-002/report.html"), Some(2));
        assert_eq!(component("spot/component-1000/report.html"), Some(1000));
        // Assets may have such names.
        assert_eq!(component("component-002/report.html"), None);
        assert_eq!(component("spot/component-2/report.html"), None);
    }
}
