//! `report.html` of an asset of several components: all of them in one picture and one table.
//!
//! *Enters:* what became of each component. *Leaves:* a page beside their folders, which shows `preview.png` beside it and links to what is in the folders.

use super::tables::{cell, row, table, whole};
use super::{FILE_NAME, STYLE, list_notes};
use crate::config::Config;
use crate::export::ExportError;
use crate::export::components::Figures;
use crate::export::folder::Staging;
use crate::export::html::{self, escape, link};
use crate::export::names::{COMPONENTS, PREVIEW, component_name};
use crate::outcome::ComponentOutcome;
use std::fmt::Write as _;

/// A line of the table.
pub struct Row {
    /// Figures, or why there are none.
    pub outcome: ComponentOutcome,
    /// Of its atlas, where it has one.
    pub figures: Option<Figures>,
    /// Whether it has a page of its own.
    pub has_page: bool,
}

/// Writes the page into a staging folder. `given`: the input as files name it; `notes`: what the build said of it and its components.
pub fn write(
    staging: &Staging,
    asset: &str,
    given: &str,
    config: &Config,
    rows: &[Row],
    notes: &[String],
) -> Result<(), ExportError> {
    let page = page(asset, given, config, rows, notes);
    staging.write(FILE_NAME, page.as_bytes())
}

fn page(asset: &str, given: &str, config: &Config, rows: &[Row], notes: &[String]) -> String {
    let failed = rows.iter().filter(|r| r.outcome.result.is_err()).count();
    let mut body = format!(
        "<h1>{}</h1>\n<p>Made from <code>{}</code>: {} components, counted from 0",
        escape(asset),
        escape(given),
        rows.len(),
    );
    if failed > 0 {
        let _ = write!(body, ", of which {failed} failed");
    }
    body.push_str(". <a href=\"./surface.glb\">surface.glb</a> holds all of them.");
    let has_folders = config.output.has_component_folders(rows.len());
    if !has_folders {
        let _ = write!(
            body,
            " They are more than the {} of <code>output.component_folders</code>: they have no folders of their own, and \
             <a href=\"./{COMPONENTS}\">{COMPONENTS}</a> has their figures.",
            config.output.component_folders
        );
    } else if rows.len() > config.report.max_components {
        let _ = write!(
            body,
            " They are more than the {} of <code>report.max_components</code>: they have no pages and pictures of their own.",
            config.report.max_components
        );
    }
    body.push_str("</p>\n");
    if config.pictures.enabled {
        let _ = writeln!(
            body,
            "<img src=\"./{PREVIEW}\" alt=\"All components with a checkerboard in flat coordinates\" style=\"max-width: min(100%, 40rem)\">"
        );
    }
    list_notes(&mut body, notes);
    let _ = write!(
        body,
        "<h2>Components</h2>\n{}",
        components(rows, has_folders)
    );
    let title = format!("{asset} · affine atlas");
    html::page(&title, STYLE, &body, &[html::TABLES], html::BESIDE)
}

fn components(rows: &[Row], has_folders: bool) -> String {
    let heads = "Component|#Vertices|#Faces|#Genus|#Boundary loops|#Cones|#Cells|#Largest curvature error [rad]|#Area distortion (9)|#PSNR [dB]|";
    let line = |r: &Row| {
        let name = component_name(r.outcome.index);
        let number = r.outcome.index;
        match &r.outcome.result {
            Ok(summary) => row(&[
                match has_folders {
                    true => format!(
                        "<td data-value=\"{number}\"><a href=\"{}\">{name}</a></td>",
                        link(&format!("{name}/"))
                    ),
                    false => format!("<td data-value=\"{number}\">{number}</td>"),
                },
                whole(summary.vertices),
                whole(summary.faces),
                whole(summary.genus),
                whole(summary.boundary_loops),
                whole(summary.cones),
                (r.figures.as_ref().and_then(|f| f.cells)).map_or_else(none, whole),
                cell(summary.max_curvature_error),
                cell(summary.area_distortion),
                (r.figures.as_ref().and_then(|f| f.image_psnr_db)).map_or_else(none, cell),
                match r.has_page {
                    true => format!(
                        "<td><a href=\"{}\">report</a></td>",
                        link(&format!("{name}/{FILE_NAME}"))
                    ),
                    false => "<td></td>".to_owned(),
                },
            ]),
            Err(failure) => format!(
                "<tr><td data-value=\"{number}\">{name}</td><td colspan=\"10\" data-value=\"\"><b>{}</b>: {}</td></tr>\n",
                failure.kind.name(),
                escape(&failure.message)
            ),
        }
    };
    let lines: String = rows.iter().map(line).collect();
    table("components", "Components", heads, &lines)
}

fn none() -> String {
    "<td class=\"number\" data-value=\"\"></td>".to_owned()
}
