//! Spline surfaces: seconds by vertices, distances in parts of the diagonal, part of the area that is turned over.
//!
//! ```text
//! cargo bench --bench spline -- [--runs N] FOLDER…          folders of builds with a grid
//! ```

mod common;

use affine_atlas::{job, spline};
use common::{Arguments, cpu_seconds};
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let given = Arguments::parse()?;
    println!("folder | vertices | cells | fit, CPU s | B-splines, CPU s | RMS | max | turned over");
    for folder in &given.meshes {
        let gridded = job::fit::gridded(folder)?;
        let mut best = [f64::INFINITY; 2];
        let mut figures = [0.0; 3];
        for _ in 0..given.runs {
            let start = cpu_seconds();
            let fitted = spline::fit(&gridded)?;
            figures = [
                fitted.errors.rms / fitted.diagonal,
                fitted.errors.max / fitted.diagonal,
                fitted.shape.turned_over,
            ];
            let middle = cpu_seconds();
            fitted.b_splines(spline::DEFAULT_ANGLE.to_radians())?;
            let end = cpu_seconds();
            best = [best[0].min(middle - start), best[1].min(end - middle)];
        }
        let (vertices, cells) = (gridded.positions.len(), gridded.cells.len());
        println!(
            "{} | {vertices} | {cells} | {:.2} | {:.2} | {:.3e} | {:.3e} | {:.1e}",
            folder.display(),
            best[0],
            best[1],
            figures[0],
            figures[1],
            figures[2]
        );
    }
    Ok(())
}
