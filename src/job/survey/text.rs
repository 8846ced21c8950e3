//! The table of a survey, for people and for programs.

use super::{ComponentSurvey, Figures, Row, Survey};
use crate::flow::cones::{ConeStrategy, in_pi};
use crate::job::listing::counted;
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::fmt::{self, Write as _};

/// Headings; the first column is flush left.
const COLUMNS: [&str; 10] = [
    "cones",
    "placed",
    "distortion (9)",
    "std of u",
    "least u",
    "greatest u",
    "angle error",
    "cut",
    "cut/√area",
    "seconds",
];

impl Row {
    /// `spread 8`, `auto 16`, `none`.
    pub fn name(&self) -> String {
        match self.strategy {
            ConeStrategy::None => self.strategy.name().to_owned(),
            strategy => format!("{} {}", strategy.name(), self.asked),
        }
    }
}

impl fmt::Display for Survey {
    /// Topology, table and suggestion of every component; u is the log scale a face, relative to the whole.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        for component in &self.components {
            if self.components.len() > 1 {
                writeln!(f, "component {}:", component.index)?;
            }
            let surface = match &component.surface {
                Ok(surface) => surface,
                Err(failure) => {
                    writeln!(f, "  refused: {}", failure.message)?;
                    continue;
                }
            };
            let t = &surface.topology;
            let required = in_pi(2.0 * PI * t.euler_characteristic as f64);
            writeln!(
                f,
                "  {}, {}, genus {}, {}: cones{} need {required} in total",
                counted(t.vertices, "vertex", "vertices"),
                counted(t.faces, "triangle", "triangles"),
                t.genus,
                counted(t.boundary_loops, "boundary loop", "boundary loops"),
                if t.boundary_loops > 0 {
                    " and boundary"
                } else {
                    ""
                }
            )?;
            f.write_str(&table(component, surface.area.sqrt()))?;
            for row in component.chosen() {
                if row
                    .result
                    .as_ref()
                    .is_ok_and(|figures| figures.list.is_none())
                {
                    writeln!(
                        f,
                        "  note: no list is written for {}: a cone lies where repair split or made a vertex, which has no number of its own in the file",
                        row.name()
                    )?;
                }
            }
            if let Some(suggestion) = &component.suggestion {
                let count = suggestion.count;
                writeln!(f, "  suggested: {count}, for {}", suggestion.reason)?;
            }
        }
        Ok(())
    }
}

/// The rows that are shown: of those for comparison only the first.
fn shown(component: &ComponentSurvey) -> impl Iterator<Item = &Row> {
    let rows = component.rows.iter().enumerate();
    rows.filter(|(i, row)| *i == 0 || row.strategy != ConeStrategy::Spread)
        .map(|(_, row)| row)
}

fn table(component: &ComponentSurvey, side: f64) -> String {
    let heading = COLUMNS.map(str::to_owned);
    let mut rows = vec![Ok(heading)];
    rows.extend(shown(component).map(|row| match &row.result {
        Ok(figures) => Ok(cells(row, figures, side)),
        Err(failure) => Err((row.name(), failure.message.as_str())),
    }));
    let width = |column: usize| {
        let cells = rows.iter().map(|row| match row {
            Ok(cells) => cells[column].chars().count(),
            Err((name, _)) if column == 0 => name.len(),
            Err(_) => 0,
        });
        cells.max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..COLUMNS.len()).map(width).collect();
    let mut text = String::new();
    for row in &rows {
        let line = match row {
            Ok(cells) => {
                let mut line = format!("{:<1$}", cells[0], widths[0]);
                for (cell, width) in cells.iter().zip(&widths).skip(1) {
                    let _ = write!(line, "  {cell:>width$}");
                }
                line
            }
            Err((name, message)) => format!("{name:<0$}  {message}", widths[0]),
        };
        let _ = writeln!(text, "  {line}");
    }
    text
}

fn cells(row: &Row, figures: &Figures, side: f64) -> [String; 10] {
    let scale = &figures.log_scale;
    [
        row.name(),
        figures.cones.len().to_string(),
        format!("{:.4}", figures.area_distortion),
        format!("{:.4}", scale.std),
        signed(scale.min),
        signed(scale.max),
        format!("{:.4}π", figures.angle_error.mean / PI),
        format!("{:.4}", figures.cut_length),
        format!("{:.2}", figures.cut_length / side),
        format!("{:.1}", row.seconds),
    ]
}

/// With its sign and two decimals, and no negative zero.
fn signed(x: f64) -> String {
    format!("{:+.2}", (100.0 * x).round() / 100.0 + 0.0)
}

impl Survey {
    /// The table for programs, every row included. Without `seconds` equal inputs give equal text.
    pub fn json(&self, seconds: bool) -> Value {
        let components: Vec<Value> = (self.components.iter())
            .map(|component| component_json(component, seconds))
            .collect();
        json!({
            "id": self.id,
            "path": self.given,
            "notes": self.notes,
            "components": components,
        })
    }
}

fn component_json(component: &ComponentSurvey, seconds: bool) -> Value {
    let surface = match &component.surface {
        Ok(surface) => surface,
        Err(failure) => return json!({ "component": component.index, "error": failure }),
    };
    let t = &surface.topology;
    let rows: Vec<Value> = (component.rows.iter())
        .map(|row| row_json(row, surface.area.sqrt(), seconds))
        .collect();
    let suggestion = component.suggestion.as_ref();
    json!({
        "component": component.index,
        "vertices": t.vertices,
        "faces": t.faces,
        "genus": t.genus,
        "boundary_loops": t.boundary_loops,
        "euler_characteristic": t.euler_characteristic,
        "required_curvature": 2.0 * PI * t.euler_characteristic as f64,
        "area": surface.area,
        "rows": rows,
        "suggestion": suggestion.map(|s| json!({ "count": s.count, "reason": s.reason })),
    })
}

fn row_json(row: &Row, side: f64, seconds: bool) -> Value {
    let mut value = match &row.result {
        Err(failure) => json!({ "error": failure }),
        Ok(figures) => {
            let cone = |&(vertex, curvature): &(u32, f64)| json!({ "vertex": vertex, "curvature": curvature });
            json!({
                "placed": figures.cones.len(),
                "area_distortion": figures.area_distortion,
                "log_scale": figures.log_scale,
                "angle_error": figures.angle_error,
                "cut_length": figures.cut_length,
                "cut_length_by_root_of_area": figures.cut_length / side,
                "max_curvature_error": figures.max_curvature_error,
                "cones": figures.cones.iter().map(cone).collect::<Vec<_>>(),
            })
        }
    };
    value["strategy"] = json!(row.strategy);
    value["asked"] = json!(row.asked);
    if seconds {
        value["seconds"] = json!(row.seconds);
    }
    value
}
