//! Grids of a real model by the whole program: few and many cells, and an independent checker of the grid.

use super::arrays::array;
use super::{checked_by, comparable};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// How many cells are asked for.
pub const CELLS: [usize; 4] = [200, 500, 2000, 8000];
/// The one that the checkers, which take longer than the program, are asked about.
const CHECKED: usize = 2000;
/// Part by which the number may miss where there are at least so many cells for each irregular point.
const MISS: f64 = 0.1;
const CELLS_OF_POINT: usize = 10;
/// Most irregular points that a number of cells is asked of.
const MOST_POINTS: usize = 60;
/// Most that the mean of ‖J‖² + ‖J⁻¹‖² may be: faces that nothing is left of on the grid make it thousands.
const MOST_DIRICHLET: f64 = 50.0;

/// Builds a model on grids by `build`, which takes settings and gives a folder and its `atlas.json`. Prints a line of a table for every number of cells.
pub fn grids<K, E: ToString>(
    model: &Path,
    cells: &[usize],
    build: impl Fn(&[&str]) -> Result<(K, PathBuf, Value), E>,
) -> Result<(), String> {
    for &cells in cells {
        let number = format!("grid.cells={cells}");
        let settings = [
            "images.domain=\"grid\"",
            number.as_str(),
            "grid.samples_per_cell=4",
            "pictures.enabled=false",
            "report.enabled=false",
        ];
        let (_folder, atlas, json) = build(&settings).map_err(|e| e.to_string())?;
        wanted(model, &json, cells)?;
        if cells == CHECKED {
            checked_by("verify_grid.py", &atlas, comparable(model))?;
            checked_by("verify_atlas.py", &atlas, comparable(model))?;
        }
    }
    Ok(())
}

/// About as many cells as were asked for, none turned over, and hardly any squeezed. Prints a line of a table.
pub fn wanted(model: &Path, json: &Value, cells: usize) -> Result<(), String> {
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
    if dirichlet.as_f64().is_none_or(|mean| mean > MOST_DIRICHLET) {
        return Err(format!("mean of ‖J‖² + ‖J⁻¹‖²: {dirichlet}"));
    }
    let is_asked = cells >= CELLS_OF_POINT * points && points <= MOST_POINTS;
    if is_asked && (found as f64 / cells as f64 - 1.0).abs() > MISS {
        return Err(format!("{found} cells for {cells}"));
    }
    Ok(())
}

/// √(texels per area) over the surface, 95 % over 5 %, and the part of the square of texture coordinates that is covered.
pub fn density(atlas: &Path, json: &Value) -> [f64; 2] {
    let positions: Vec<f64> = array(atlas, "positions");
    let faces: Vec<u32> = array(atlas, "faces");
    let patch: Vec<u32> = array(atlas, "patch");
    let uv: Vec<f64> = array(atlas, "patch_uv");
    let scale = |p: u32| json["patches"][p as usize]["patch_to_packed"]["scale"].as_f64();
    let (mut rows, mut filled) = (Vec::new(), 0.0);
    for (f, corners) in faces.as_chunks::<3>().0.iter().enumerate() {
        let at = |k: usize, i: usize| positions[3 * corners[k] as usize + i];
        let side = |k: usize| -> [f64; 3] { std::array::from_fn(|i| at(k, i) - at(0, i)) };
        let (a, b) = (side(1), side(2));
        let normal = [0, 1, 2].map(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            a[j] * b[k] - a[k] * b[j]
        });
        let area = 0.5 * normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        let plane = |k: usize| [0, 1].map(|i| uv[6 * f + 2 * k + i] - uv[6 * f + i]);
        let (a, b) = (plane(1), plane(2));
        let covered = 0.5 * (a[0] * b[1] - a[1] * b[0]) * scale(patch[f]).expect("a scale").powi(2);
        filled += covered;
        rows.push(((covered / area).sqrt(), area));
    }
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole: f64 = rows.iter().map(|row| row.1).sum();
    let quantile = |share: f64| {
        let mut below = 0.0;
        let found = rows.iter().find(|row| {
            below += row.1;
            below >= share * whole
        });
        found.map_or(f64::NAN, |row| row.0)
    };
    [quantile(0.95) / quantile(0.05), filled]
}
