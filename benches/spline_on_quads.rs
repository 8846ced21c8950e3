//! The fit of `affine-atlas fit` on any quads, so that those of other programs can be held beside those of the atlas: `benches/peers/splines.py` calls it.
//!
//! ```text
//! cargo bench --bench spline_on_quads -- QUADS.obj SAMPLES.txt SHARP.txt SURFACE.obj FACETS
//! ```
//!
//! * SAMPLES.txt: a line each, x y z, normal, area, cell, s t in it
//! * SHARP.txt: a line an edge of cells that sharp edges cover, its ends, and the parts of it that those above 20° and above 40° cover
//! * FACETS: faces of the surface that samples are of
//!
//! Prints figures as JSON, and writes the surface as triangles, cell by cell.

use affine_atlas::spline::creases::creased;
use affine_atlas::spline::equations::Equations;
use affine_atlas::spline::evaluator::Evaluator;
use affine_atlas::spline::fit::fit;
use affine_atlas::spline::gridded::Sample;
use affine_atlas::spline::limit::Limit;
use affine_atlas::spline::measure::shape;
use affine_atlas::spline::tessellation::tessellate;
use std::collections::HashMap;
use std::error::Error;
use std::fs::{File, read_to_string};
use std::io::{BufWriter, Write};
use std::str::FromStr;

/// Parts of a cell along a side.
const PARTS: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let files: Vec<&str> = given.iter().map(String::as_str).collect();
    let files: Vec<&str> = files.into_iter().filter(|a| *a != "--bench").collect();
    let [quads, samples, sharp, surface, facets] = files[..] else {
        return Err("QUADS.obj SAMPLES.txt SHARP.txt SURFACE.obj FACETS".into());
    };
    let (mut points, mut cells) = (Vec::new(), Vec::new());
    for line in read_to_string(quads)?.lines() {
        match line.split_at_checked(2) {
            Some(("v ", rest)) => points.push(numbers::<f64, 3>(rest)?),
            Some(("f ", rest)) => cells.push(numbers::<u32, 4>(rest)?.map(|v| v - 1)),
            _ => {}
        }
    }
    let mut covered: HashMap<[u32; 2], [f64; 2]> = HashMap::new();
    for line in read_to_string(sharp)?.lines() {
        let [a, b, blunt, sharp] = numbers::<f64, 4>(line)?;
        covered.insert([a as u32, b as u32], [blunt, sharp]);
    }
    let of = |line: &str| -> Result<Sample, Box<dyn Error>> {
        let [x, y, z, nx, ny, nz, area, cell, s, t] = numbers::<f64, 10>(line)?;
        Ok(Sample {
            point: [x, y, z],
            normal: [nx, ny, nz],
            area,
            weight: 1.0,
            cell: cell as u32,
            at: [s, t],
            border: None,
        })
    };
    let text = read_to_string(samples)?;
    let mut samples: Vec<Sample> = text.lines().map(of).collect::<Result<_, _>>()?;
    let cage = creased(points.len(), &cells, |ends| {
        covered.get(&ends).copied().unwrap_or_default()
    })?;
    let evaluator = Evaluator::new(&cage);
    let mut equations = Equations::new(&cage, &evaluator, &points, facets.parse()?)?;
    let control = fit(&mut equations, &mut samples)?;
    let limit = Limit::new(&cage, &evaluator, &control);
    let inside = |&(c, k): &(u32, u8)| {
        cage.across[c as usize][usize::from(k)].is_some() && cage.is_crease((c, k))
    };
    println!(
        "{{\"cells\": {}, \"control_points\": {}, \"crease_edges\": {}, \"turned_over_area\": {:.2e}}}",
        cage.cells.len(),
        cage.vertices,
        cage.edges().filter(inside).count(),
        shape(&limit).turned_over,
    );
    let triangles = tessellate(&limit, PARTS);
    let mut out = BufWriter::new(File::create(surface)?);
    for [x, y, z] in &triangles.points {
        writeln!(out, "v {x:.9} {y:.9} {z:.9}")?;
    }
    for [a, b, c] in triangles.faces.iter().map(|f| f.map(|v| v + 1)) {
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(out.flush()?)
}

fn numbers<T: FromStr, const N: usize>(line: &str) -> Result<[T; N], Box<dyn Error>>
where
    T::Err: Error + 'static,
{
    let all: Vec<T> = line
        .split_whitespace()
        .map(str::parse)
        .collect::<Result<_, _>>()?;
    let wrong = |all: Vec<T>| format!("{line}: {} numbers in place of {N}", all.len());
    Ok(all.try_into().map_err(wrong)?)
}
