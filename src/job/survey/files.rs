//! What a survey leaves on disk: for each number of cones a configuration that builds it, the same cones as two-column
//! text and a picture, one picture of all, and the table.

use super::{ComponentSurvey, Figures, Row, Survey};
use crate::config::Config;
use crate::export::folder::{Contents, Staging, component_name, list_files};
use crate::export::pictures::{Gallery, Panel, encode_png};
use crate::export::{Action, ExportError};
use crate::flow::cones::{ConeSpec, ConeStrategy, file};
use crate::observe::Observer;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// What the name of an asset's folder ends with.
const FOLDER: &str = ".cones";

/// Name of the folder of an asset below the output folder.
pub fn folder_name(id: &str) -> String {
    format!("{id}{FOLDER}")
}

impl Survey {
    /// Name of the configuration for a number of cones.
    pub fn config_name(&self, count: usize) -> String {
        format!("{}.cones-{count}.toml", self.id)
    }

    /// The configuration of the number of cones that is suggested for the first component, where it is among `files`.
    pub fn suggested_config(&self, files: &[String]) -> Option<String> {
        let mut suggestions = self.components.iter().filter_map(|c| c.suggestion.as_ref());
        let name = self.config_name(suggestions.next()?.count);
        files.contains(&name).then_some(name)
    }
}

/// Writes the folder of a survey; gives its files. Nothing is written where no row could be built.
pub(super) fn write(
    survey: &Survey,
    mesh: &Path,
    output: &Path,
    config: &Config,
    observer: &dyn Observer,
) -> Result<Vec<String>, ExportError> {
    let rows = survey.components.iter().flat_map(ComponentSurvey::chosen);
    let counts: BTreeSet<usize> = rows
        .filter(|row| row.result.is_ok())
        .map(|row| row.asked)
        .collect();
    if counts.is_empty() {
        return Ok(Vec::new());
    }
    observer.stage("write", 0, 1);
    let name = folder_name(&survey.id);
    let staging = Staging::begin_with(Contents::Cones, output, &name)?;
    let mesh = mesh_from(output, &name, mesh)?;
    if mesh.to_str().is_none() {
        return Err(ExportError::NotUnicode { path: mesh });
    }
    for &count in &counts {
        let choice = Choice::of(survey, count);
        let Some(list) = &choice.list else { continue };
        let toml = configuration(survey, &choice, list, &mesh, config)?;
        staging.write(&survey.config_name(count), toml.as_bytes())?;
        if !list.is_empty() {
            let text = file::write(&choice.heading, &choice.cones);
            let name = format!("{}.cones-{count}.txt", survey.id);
            staging.write(&name, text.as_bytes())?;
        }
    }
    let table = format!("{:#}\n", survey.json(false));
    staging.write("cones.json", table.as_bytes())?;
    if config.pictures.enabled {
        for component in &survey.components {
            draw(survey, component, &staging, config.pictures.size, observer)?;
        }
    }
    staging.publish()?;
    list_files(&output.join(&name))
}

/// The cones of all components for one number of them.
struct Choice {
    count: usize,
    /// What the files say in comments.
    heading: Vec<String>,
    /// As the configuration writes them; none where one of them has no number in the file.
    list: Option<Vec<ConeSpec>>,
    /// The same: vertex, and radians.
    cones: Vec<(u32, f64)>,
}

impl Choice {
    fn of(survey: &Survey, count: usize) -> Choice {
        let mut heading = vec![format!("At most {count} cones for {}.", survey.given)];
        let mut list = Some(Vec::new());
        let mut cones = Vec::new();
        for component in &survey.components {
            let Some((row, figures)) = chosen(component, count) else {
                continue;
            };
            let place = match survey.components.len() {
                1 => String::new(),
                _ => format!("component {}: ", component.index),
            };
            heading.push(format!("{place}{}", figures_in_words(row, figures)));
            cones.extend(figures.cones.iter().copied());
            list = list
                .zip(figures.list.as_ref())
                .map(|(all, one)| [all, one.clone()].concat());
        }
        Choice {
            count,
            heading,
            list,
            cones,
        }
    }
}

/// The row of the automatic choice for a number of cones, where it could be built.
fn chosen(component: &ComponentSurvey, count: usize) -> Option<(&Row, &Figures)> {
    let mut rows = component.chosen();
    let row = rows.find(|row| row.asked == count)?;
    Some((row, row.result.as_ref().ok()?))
}

fn figures_in_words(row: &Row, figures: &Figures) -> String {
    let scale = &figures.log_scale;
    format!(
        "{}: {} placed, area distortion (9) {:.4}, log scale std {:.4}, {:+.2} to {:+.2}, mean angle error {}, cut {:.4}",
        row.name(),
        figures.cones.len(),
        figures.area_distortion,
        scale.std,
        scale.min,
        scale.max,
        format_args!("{:.4}π", figures.angle_error.mean / std::f64::consts::PI),
        figures.cut_length,
    )
}

/// The mesh as a path that starts at the folder that is written.
fn mesh_from(output: &Path, name: &str, mesh: &Path) -> Result<PathBuf, ExportError> {
    let real = |path: &Path| {
        path.canonicalize()
            .map_err(ExportError::io(Action::Read, path))
    };
    Ok(relative(&real(output)?.join(name), &real(mesh)?))
}

/// How to get from a folder to a file, both absolute.
fn relative(from: &Path, to: &Path) -> PathBuf {
    let (mut here, mut there) = (from.components(), to.components());
    let (mut rest, mut way) = (here.clone(), there.clone());
    let mut shared = 0;
    while let (Some(a), Some(b)) = (here.next(), there.next()) {
        if a != b {
            break;
        }
        shared += 1;
        (rest, way) = (here.clone(), there.clone());
    }
    // Nothing but the root in common: the way up would say nothing.
    if shared < 2 {
        return to.to_owned();
    }
    let up = rest.map(|_| Path::new(".."));
    up.chain([way.as_path()]).collect()
}

/// A configuration that builds exactly the rows of a number of cones: what was effective, but for the cones.
fn configuration(
    survey: &Survey,
    choice: &Choice,
    list: &[ConeSpec],
    mesh: &Path,
    config: &Config,
) -> Result<String, ExportError> {
    let unwritable = |message: String| ExportError::Encode {
        path: survey.config_name(choice.count).into(),
        message,
    };
    let mut text = String::new();
    for line in &choice.heading {
        let _ = writeln!(text, "# {line}");
    }
    let _ = writeln!(
        text,
        "# Build it with: affine-atlas build {}",
        survey.config_name(choice.count)
    );
    let paths = value(&[mesh]).map_err(unwritable)?;
    let _ = writeln!(
        text,
        "\n[input]\npaths = {paths}\n\n[output]\nfolder = \"..\""
    );

    let mut own = super::for_survey(config).map_err(|e| unwritable(e.to_string()))?;
    own.cones = super::with_cones(config, ConeStrategy::Listed, choice.count).cones;
    if list.is_empty() {
        own.cones.strategy = ConeStrategy::None;
    }
    let table =
        |config: &Config| toml::Table::try_from(config).map_err(|e| unwritable(e.to_string()));
    let (own, default) = (table(&own)?, table(&Config::default())?);
    for (section, keys) in own {
        let Some(keys) = keys
            .as_table()
            .filter(|_| section != "input" && section != "output")
        else {
            continue;
        };
        let is_changed = |key: &str, value: &toml::Value| {
            default.get(&section).and_then(|keys| keys.get(key)) != Some(value)
        };
        let changed: Vec<String> = (keys.iter())
            .filter(|(key, value)| {
                is_changed(key, value) && !(section == "cones" && *key == "list")
            })
            .map(|(key, value)| format!("{key} = {value}\n"))
            .collect();
        if section == "cones" || !changed.is_empty() {
            let _ = write!(text, "\n[{section}]\n{}", changed.concat());
        }
        if section == "cones" && !list.is_empty() {
            text.push_str("list = [\n");
            for (cone, (vertex, _)) in list.iter().zip(&choice.cones) {
                let curvature = value(&cone.curvature).map_err(unwritable)?;
                let _ = writeln!(text, "  {{ vertex = {vertex}, curvature = {curvature} }},");
            }
            text.push_str("]\n");
        }
    }
    Ok(text)
}

/// A value as TOML writes it on one line.
fn value<T: serde::Serialize>(of: &T) -> Result<toml::Value, String> {
    toml::Value::try_from(of).map_err(|error| error.to_string())
}

/// One picture for each number of cones, before and after, and one of all.
fn draw(
    survey: &Survey,
    component: &ComponentSurvey,
    staging: &Staging,
    size: usize,
    observer: &dyn Observer,
) -> Result<(), ExportError> {
    let Ok(surface) = &component.surface else {
        return Ok(());
    };
    let built: Vec<(&Row, &Figures)> = (component.chosen())
        .filter_map(|row| Some((row, row.result.as_ref().ok()?)))
        .collect();
    if built.is_empty() {
        return Ok(());
    }
    let of_component = match survey.components.len() {
        1 => String::new(),
        _ => format!(".{}", component_name(component.index)),
    };
    let save = |name: &str, image: image::RgbImage| {
        if observer.cancelled() {
            return Err(ExportError::Interrupted);
        }
        let path = format!("{name}{of_component}.png");
        let bytes = encode_png(&image).map_err(|error| ExportError::Encode {
            path: staging.target().join(&path),
            message: error.to_string(),
        })?;
        staging.write(&path, &bytes)
    };
    // Two panels, each from two sides, in about as many pixels as two of the full size.
    let gallery = Gallery::new(&surface.mesh, size * 3 / 4);
    for &(row, figures) in &built {
        let before = component.before(row.asked);
        let before = before.and_then(|row| Some((row, row.result.as_ref().ok()?)));
        let mut panels: Vec<Panel> = (before.into_iter())
            .filter(|(other, _)| other.name() != row.name())
            .map(|(row, figures)| panel(survey, row, figures))
            .collect();
        panels.push(panel(survey, row, figures));
        let name = format!("{}.cones-{}", survey.id, row.asked);
        save(&name, gallery.row(&panels))?;
    }
    let first = component.rows.first();
    let compared = first.and_then(|row| Some((row, row.result.as_ref().ok()?)));
    let mut panels: Vec<Panel> = (compared.into_iter())
        .filter(|(row, _)| row.strategy == ConeStrategy::Spread)
        .map(|(row, figures)| panel(survey, row, figures))
        .collect();
    panels.extend((built.iter()).map(|&(row, figures)| panel(survey, row, figures)));
    save(
        "cones",
        Gallery::new(&surface.mesh, size * 3 / 8).row(&panels),
    )
}

fn panel<'a>(survey: &Survey, row: &Row, figures: &'a Figures) -> Panel<'a> {
    let scale = &figures.log_scale;
    Panel {
        title: vec![
            format!(
                "{}: {}, {} placed",
                survey.id,
                row.name(),
                figures.cones.len()
            ),
            format!("(9) {:.3}  std {:.3}", figures.area_distortion, scale.std),
            format!("u {:+.2} to {:+.2}", scale.min, scale.max),
        ],
        log_scale: &figures.scene.log_scale,
        cut: &figures.scene.cut,
        cones: (figures.scene.cones.iter())
            .map(|cone| (cone.position, cone.curvature))
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_from_a_folder_to_a_file() {
        let way = |from: &str, to: &str| relative(Path::new(from), Path::new(to));
        for (from, to, there) in [
            ("/a/b/out/x.cones", "/a/b/x.obj", "../../x.obj"),
            ("/a/b/out/x.cones", "/a/c/x.obj", "../../../c/x.obj"),
            ("/a/out", "/a/out/x.obj", "x.obj"),
            ("/home/out/x.cones", "/data/x.obj", "/data/x.obj"),
            ("/", "/x.obj", "/x.obj"),
        ] {
            assert_eq!(way(from, to), Path::new(there), "{from} {to}");
        }
    }
}
