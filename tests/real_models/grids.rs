//! Grids of a real model by the whole program: few and many cells, and an independent checker of the grid.

use super::{checked_by, comparable};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// How many cells are asked for.
const CELLS: [usize; 4] = [200, 500, 2000, 8000];
/// The one that the checkers, which take longer than the program, are asked about.
const CHECKED: usize = 2000;
/// Part by which the number may miss where there are at least so many cells for each irregular point.
const MISS: f64 = 0.1;
const CELLS_OF_POINT: usize = 10;
/// Most irregular points that a number of cells is asked of.
const MOST_POINTS: usize = 60;

/// Builds a model on grids by `build`, which takes settings and gives a folder and its `atlas.json`. Prints a line of a table for every number of cells.
pub fn grids<K, E: ToString>(
    model: &Path,
    build: impl Fn(&[&str]) -> Result<(K, PathBuf, Value), E>,
) -> Result<(), String> {
    for cells in CELLS {
        let number = format!("grid.cells={cells}");
        let settings = [
            "images.domain=\"grid\"",
            number.as_str(),
            "grid.samples_per_cell=4",
            "pictures.enabled=false",
            "report.enabled=false",
        ];
        let (_folder, atlas, json) = build(&settings).map_err(|e| e.to_string())?;
        let grid = &json["grid"];
        let number = |value: &Value| value.as_u64().map(|n| n as usize);
        let found = number(&grid["cells"]).ok_or("no grid was made")?;
        let points = grid["irregular"].as_array().map_or(0, Vec::len);
        let dirichlet = &grid["distortion"]["symmetric_dirichlet"]["mean"];
        println!(
            "| {} | {points} | {cells} | {found} | {} | {dirichlet:.3} |",
            model.file_stem().unwrap_or_default().to_string_lossy(),
            grid["blocks"],
        );
        if grid["turned_over"] != 0 {
            return Err(format!("{} faces turned over", grid["turned_over"]));
        }
        let is_asked = cells >= CELLS_OF_POINT * points && points <= MOST_POINTS;
        if is_asked && (found as f64 / cells as f64 - 1.0).abs() > MISS {
            return Err(format!("{found} cells for {cells}"));
        }
        if cells == CHECKED {
            checked_by("verify_grid.py", &atlas, comparable(model))?;
            checked_by("verify_atlas.py", &atlas, comparable(model))?;
        }
    }
    Ok(())
}
