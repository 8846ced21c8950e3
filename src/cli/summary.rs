//! What became of every asset, in one line each.

use affine_atlas::export::folder::component_name;
use affine_atlas::outcome::{AssetOutcome, ComponentOutcome, Summary};
use console::{measure_text_width, style, truncate_str};
use std::path::Path;

/// Columns, and the order in which they are left out where the terminal is narrow.
const COLUMNS: [&str; 10] = [
    "mesh",
    "state",
    "vertices",
    "faces",
    "genus",
    "cones",
    "cells",
    "max error",
    "area distortion",
    "seconds",
];
const LEAVE_OUT: [usize; 7] = [9, 4, 5, 8, 2, 3, 6];
/// Columns that hold words; the others hold figures and are set flush right.
const WORDS: usize = 2;
const FOLDER: &str = "folder";

/// More assets than this are not listed one by one, and more components of one neither.
const MOST_LISTED: usize = 40;

/// What became of a batch: the table, of many assets only of those that are not as they should be, and counts where there are several.
pub fn results(outcomes: &[AssetOutcome], width: Option<usize>) -> String {
    let count = |state: &str| outcomes.iter().filter(|o| o.state_name() == state).count();
    let mut text = match outcomes.len() {
        0..=MOST_LISTED => table(outcomes, width),
        _ => {
            let rest = outcomes.iter().filter(|o| o.state_name() == "failed");
            let rest: Vec<AssetOutcome> = rest.cloned().collect();
            match rest.is_empty() {
                true => String::new(),
                false => table(&rest, width),
            }
        }
    };
    if outcomes.len() > 1 {
        let counts = ["built", "cached", "failed", "cancelled"].map(|state| (count(state), state));
        let counts = counts.iter().filter(|(count, _)| *count > 0);
        let counts: Vec<String> = counts
            .map(|(count, state)| format!("{count} {state}"))
            .collect();
        let warned = outcomes.iter().filter(|o| !o.notes.is_empty()).count();
        let warned = match warned {
            0 => String::new(),
            warned => format!("; {warned} with warnings, which manifest.jsonl and index.html keep"),
        };
        text.push_str(&format!(
            "{} meshes: {}{warned}\n",
            outcomes.len(),
            counts.join(", ")
        ));
    }
    text
}

struct Row {
    cells: [String; 10],
    folder: String,
    state: &'static str,
}

/// A table of all assets, one line each; a line a component below assets that have several.
/// `width` is that of the terminal, none where lines may be as long as they need.
pub fn table(outcomes: &[AssetOutcome], width: Option<usize>) -> String {
    let rows: Vec<Row> = outcomes.iter().flat_map(rows).collect();
    let widths: Vec<usize> = (0..COLUMNS.len())
        .map(|column| {
            let cells = rows
                .iter()
                .map(|row| measure_text_width(&row.cells[column]));
            cells.max().unwrap_or(0).max(COLUMNS[column].len())
        })
        .collect();
    let folder = rows
        .iter()
        .map(|row| measure_text_width(&row.folder))
        .max()
        .unwrap_or(0);
    let mut shown: Vec<usize> = (0..COLUMNS.len()).collect();
    let mut with_folder = true;
    if let Some(limit) = width {
        let length = |shown: &[usize]| {
            shown
                .iter()
                .map(|&column| widths[column] + 2)
                .sum::<usize>()
        };
        with_folder = length(&shown) + folder <= limit;
        for column in LEAVE_OUT {
            if length(&shown) > limit + 2 {
                shown.retain(|&other| other != column);
            }
        }
    }
    let mut text = String::new();
    let heading: Vec<String> = shown
        .iter()
        .map(|&column| pad(COLUMNS[column], widths[column], column))
        .collect();
    push_line(
        &mut text,
        heading.join("  "),
        with_folder.then_some(FOLDER),
        width,
    );
    for row in &rows {
        let cells: Vec<String> = shown
            .iter()
            .map(|&column| {
                let cell = pad(&row.cells[column], widths[column], column);
                match (column, row.state) {
                    (1, "built" | "cached") => style(cell).green().to_string(),
                    (1, "failed") => style(cell).red().to_string(),
                    (1, _) => style(cell).yellow().to_string(),
                    _ => cell,
                }
            })
            .collect();
        push_line(
            &mut text,
            cells.join("  "),
            with_folder.then_some(&row.folder),
            width,
        );
    }
    text
}

fn pad(cell: &str, width: usize, column: usize) -> String {
    let space = " ".repeat(width.saturating_sub(measure_text_width(cell)));
    if column < WORDS {
        format!("{cell}{space}")
    } else {
        format!("{space}{cell}")
    }
}

fn push_line(text: &mut String, mut line: String, folder: Option<&str>, width: Option<usize>) {
    if let Some(folder) = folder {
        line.push_str("  ");
        line.push_str(folder);
    }
    let line = line.trim_end();
    match width {
        Some(width) => text.push_str(&truncate_str(line, width, "…")),
        None => text.push_str(line),
    }
    text.push('\n');
}

fn rows(outcome: &AssetOutcome) -> Vec<Row> {
    let seconds = format!("{:.1}", outcome.seconds);
    let state = outcome.state_name();
    match &outcome.components[..] {
        [only] => {
            let figures = only.result.as_ref().ok();
            vec![row(
                outcome.id.clone(),
                state.to_owned(),
                state,
                figures,
                seconds,
            )]
        }
        [] => vec![row(
            outcome.id.clone(),
            state.to_owned(),
            state,
            None,
            seconds,
        )],
        several => {
            let built = several
                .iter()
                .filter(|component| component.result.is_ok())
                .count();
            let words = match state {
                "failed" => format!("{built} of {} built", several.len()),
                state => state.to_owned(),
            };
            let is_listed = several.len() <= MOST_LISTED;
            let (words, all) = match is_listed {
                true => (words, None),
                false => (
                    format!("{words} ({} components)", several.len()),
                    Some(together(several)),
                ),
            };
            let all = all.flatten();
            let mut rows = vec![row(outcome.id.clone(), words, state, all.as_ref(), seconds)];
            let listed = several.iter().filter(|c| is_listed || c.result.is_err());
            for component in listed {
                let state = match (&component.result, state) {
                    (Ok(_), "cached") => "cached",
                    (Ok(_), _) => "built",
                    (Err(_), _) => "failed",
                };
                rows.push(row(
                    format!("  component {}", component.index),
                    state.to_owned(),
                    state,
                    component.result.as_ref().ok(),
                    String::new(),
                ));
            }
            rows
        }
    }
}

/// Sums over components, and the worst of their errors.
fn together(components: &[ComponentOutcome]) -> Option<Summary> {
    let first = components.iter().find(|c| c.result.is_ok())?;
    let has_folder = |of: &Summary| of.folder.ends_with(component_name(first.index));
    let built = components.iter().filter_map(|c| c.result.as_ref().ok());
    let sum = built.cloned().reduce(|a, b| Summary {
        vertices: a.vertices + b.vertices,
        faces: a.faces + b.faces,
        genus: a.genus + b.genus,
        boundary_loops: a.boundary_loops + b.boundary_loops,
        cones: a.cones + b.cones,
        cells: match (a.cells, b.cells) {
            (Some(a), Some(b)) => Some(a + b),
            (a, b) => a.or(b),
        },
        max_curvature_error: a.max_curvature_error.max(b.max_curvature_error),
        limited_by_float64: a.limited_by_float64 || b.limited_by_float64,
        area_distortion: a.area_distortion.max(b.area_distortion),
        folder: a.folder,
    })?;
    let folder = match has_folder(&sum) {
        true => sum.folder.parent().map(Path::to_owned).unwrap_or_default(),
        false => sum.folder.clone(),
    };
    Some(Summary { folder, ..sum })
}

fn row(
    mesh: String,
    words: String,
    state: &'static str,
    figures: Option<&Summary>,
    seconds: String,
) -> Row {
    let figure = |of: &dyn Fn(&Summary) -> String| figures.map(of).unwrap_or_default();
    Row {
        cells: [
            mesh,
            words,
            figure(&|f| f.vertices.to_string()),
            figure(&|f| f.faces.to_string()),
            figure(&|f| f.genus.to_string()),
            figure(&|f| f.cones.to_string()),
            figure(&|f| f.cells.map_or("–".to_owned(), |cells| cells.to_string())),
            figure(&|f| match f.limited_by_float64 {
                true => format!("{:.1e} (float64)", f.max_curvature_error),
                false => format!("{:.1e}", f.max_curvature_error),
            }),
            figure(&|f| format!("{:.4}", f.area_distortion)),
            seconds,
        ],
        folder: figure(&|f| f.folder.display().to_string()),
        state,
    }
}

/// Every failure in one line, for standard error; empty where there is none.
pub fn failures(outcomes: &[AssetOutcome]) -> String {
    let mut text = String::new();
    for outcome in outcomes {
        for (component, failure) in outcome.failures() {
            let place = match component {
                Some(index) if outcome.components.len() > 1 => {
                    format!("{}, component {index}", outcome.id)
                }
                _ => outcome.id.clone(),
            };
            let label = style("failed").red().for_stderr();
            let kept = match outcome.kept {
                true => "; the older result was kept",
                false => "",
            };
            text.push_str(&format!(
                "{label}: {place} ({}): {}{kept}\n",
                failure.kind.name(),
                failure.message
            ));
        }
    }
    text
}

/// Figures and failures of an asset as structured log lines; with `--quiet` failures only.
pub fn log(outcome: &AssetOutcome) {
    for component in &outcome.components {
        if let Ok(figures) = &component.result {
            tracing::info!(
                target: "affine_atlas",
                asset = outcome.id,
                component = component.index,
                vertices = figures.vertices,
                faces = figures.faces,
                genus = figures.genus,
                boundary_loops = figures.boundary_loops,
                cones = figures.cones,
                cells = figures.cells,
                max_curvature_error = figures.max_curvature_error,
                limited_by_float64 = figures.limited_by_float64,
                area_distortion = figures.area_distortion,
                folder = %figures.folder.display(),
                "component built"
            );
        }
    }
    for (component, failure) in outcome.failures() {
        tracing::error!(
            target: "affine_atlas",
            asset = outcome.id,
            component,
            kind = failure.kind.name(),
            "{}",
            failure.message
        );
    }
    tracing::info!(
        target: "affine_atlas",
        asset = outcome.id,
        state = outcome.state_name(),
        seconds = outcome.seconds,
        "asset finished"
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use affine_atlas::outcome::{AssetState, Failure, FailureKind};

    fn sample() -> Vec<AssetOutcome> {
        // Also where the tests run on a terminal.
        console::set_colors_enabled(false);
        console::set_colors_enabled_stderr(false);
        let figures = Summary {
            vertices: 2930,
            faces: 5856,
            genus: 0,
            boundary_loops: 0,
            cones: 8,
            cells: Some(2004),
            max_curvature_error: 3.14e-13,
            limited_by_float64: false,
            area_distortion: 1.23456,
            folder: "out/spot".into(),
        };
        let failure = Failure {
            kind: FailureKind::Prescription,
            message: "the sum is 3 and must be 4; add a cone".to_owned(),
        };
        let component = |index, result| ComponentOutcome { index, result };
        vec![
            AssetOutcome {
                components: vec![component(0, Ok(figures.clone()))],
                ..AssetOutcome::whole("spot", AssetState::Built, 0.94)
            },
            AssetOutcome {
                components: vec![
                    component(0, Ok(figures)),
                    component(1, Err(failure.clone())),
                ],
                ..AssetOutcome::whole("truck", AssetState::Built, 12.0)
            },
            AssetOutcome::failed("möbius", failure, 0.1),
        ]
    }

    #[test]
    fn of_many_components_those_that_failed_are_listed() {
        let [spot, truck, ..] = &sample()[..] else {
            panic!("two at least");
        };
        let [built, failed] = [&spot.components[0], &truck.components[1]];
        let mut components = vec![built.clone(); MOST_LISTED];
        components.push(failed.clone());
        let figures = components[0].result.as_mut().expect("built");
        figures.folder = "out/many/component-000".into();
        let many = AssetOutcome {
            components,
            ..AssetOutcome::whole("many", AssetState::Built, 1.0)
        };
        let text = table(&[many], None);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 3, "{text}");
        assert!(lines[1].starts_with("many") && lines[1].ends_with("out/many"));
        assert!(lines[1].contains("built (41 components)"), "{text}");
        assert!(lines[1].contains(&(MOST_LISTED * 2930).to_string()));
        assert!(lines[2].contains("component 1") && lines[2].contains("failed"));
    }

    #[test]
    fn wide_table() {
        insta::assert_snapshot!(table(&sample(), None), @r"
        mesh           state         vertices  faces  genus  cones  cells  max error  area distortion  seconds  folder
        spot           built             2930   5856      0      8   2004    3.1e-13           1.2346      0.9  out/spot
        truck          1 of 2 built                                                                       12.0
          component 0  built             2930   5856      0      8   2004    3.1e-13           1.2346           out/spot
          component 1  failed
        möbius         failed                                                                              0.1
        ");
    }

    #[test]
    fn narrow_tables_fit() {
        for width in 20..140 {
            for line in table(&sample(), Some(width)).lines() {
                assert!(measure_text_width(line) <= width, "{width}: {line}");
            }
        }
        insta::assert_snapshot!(table(&sample(), Some(60)), @r"
        mesh           state         faces  cells  max error
        spot           built          5856   2004    3.1e-13
        truck          1 of 2 built
          component 0  built          5856   2004    3.1e-13
          component 1  failed
        möbius         failed
        ");
    }

    #[test]
    fn many_are_counted_and_only_failures_listed() {
        let mut outcomes = sample();
        for i in 0..50 {
            outcomes.push(AssetOutcome::whole(
                &format!("a{i}"),
                AssetState::Cached,
                0.0,
            ));
        }
        outcomes[2].kept = true;
        outcomes[3].notes.push("a3 has flat patches".to_owned());
        insta::assert_snapshot!(results(&outcomes, Some(60)), @r"
        mesh           state         faces  cells  max error
        truck          1 of 2 built
          component 0  built          5856   2004    3.1e-13
          component 1  failed
        möbius         failed
        53 meshes: 1 built, 50 cached, 2 failed; 1 with warnings, which manifest.jsonl and index.html keep
        ");
        assert!(failures(&outcomes).ends_with("add a cone; the older result was kept\n"));
        assert!(!results(&outcomes[..1], None).contains("meshes:"));
        assert_eq!(results(&outcomes[4..], None), "49 meshes: 49 cached\n");
    }

    #[test]
    fn failures_in_one_line_each() {
        insta::assert_snapshot!(failures(&sample()), @r"
        failed: truck, component 1 (prescription): the sum is 3 and must be 4; add a cone
        failed: möbius (prescription): the sum is 3 and must be 4; add a cone
        ");
    }
}
