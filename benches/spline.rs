//! Spline surfaces: seconds by vertices, and beside the same fit on the quads of other programs.
//!
//! ```text
//! cargo bench --bench spline -- [--runs N] FOLDER…          folders of builds with a grid
//! cargo bench --bench spline -- --quads MESH QUADS.obj…     the same fit on any quad mesh: points, RMS and largest distance
//! ```

mod common;

use affine_atlas::spline::cage::Cage;
use affine_atlas::spline::evaluator::Evaluator;
use affine_atlas::spline::fit::Fitter;
use affine_atlas::spline::gridded::{Gridded, Sample};
use affine_atlas::spline::limit::{Limit, Place};
use affine_atlas::spline::measure::{errors, shape};
use affine_atlas::{job, spline};
use common::{Arguments, Triangles, cpu_seconds};
use rayon::prelude::*;
use std::collections::HashMap;
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let rest: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    if let [first, mesh, quads @ ..] = &rest[..]
        && first == "--quads"
    {
        return beside(Path::new(mesh), quads);
    }
    let given = Arguments::parse()?;
    println!("folder | vertices | cells | fit, CPU s | B-splines, CPU s");
    for folder in &given.meshes {
        let gridded = job::fit::gridded(folder)?;
        let mut best = [f64::INFINITY; 2];
        for _ in 0..given.runs {
            let start = cpu_seconds();
            let fitted = spline::fit(&gridded)?;
            let middle = cpu_seconds();
            fitted.b_splines(spline::DEFAULT_ANGLE.to_radians())?;
            let end = cpu_seconds();
            best = [best[0].min(middle - start), best[1].min(end - middle)];
        }
        let (vertices, cells) = (gridded.positions.len(), gridded.cells.len());
        println!(
            "{} | {vertices} | {cells} | {:.2} | {:.2}",
            folder.display(),
            best[0],
            best[1]
        );
    }
    Ok(())
}

/// Fits on quads of other programs, with places found by distance alone.
fn beside(mesh: &Path, files: &[String]) -> Result<(), Box<dyn Error>> {
    let source = Triangles::read(mesh)?;
    let (low, high) = affine_atlas::geometry::mesh::bounding_box(&source.positions);
    let diagonal = affine_atlas::geometry::mesh::distance(low, high);
    println!("quads | cells | points | RMS | max | 95 % of normals, degrees | turned over");
    for file in files {
        let (points, cells) = quads(Path::new(file))?;
        let gridded = Gridded {
            positions: source.positions.clone(),
            faces: source.faces.clone(),
            block: vec![0; source.faces.len()],
            // As if all lay in one place of one cell: a sample a face.
            uv: vec![[[0.25, 0.25], [0.4, 0.25], [0.25, 0.4]]; source.faces.len()],
            cell_block: vec![0; 1],
            cell_at: vec![[0; 2]; 1],
            cells: cells.clone(),
            points: points.clone(),
        };
        let mut samples = gridded.samples()?;
        let is_sharp = sharp(&points, &cells);
        let cage = Cage::new(
            points.len(),
            cells,
            |(c, k)| is_sharp[c as usize][usize::from(k)],
            vec![false; points.len()],
        )?;
        let evaluator = Evaluator::new(&cage);
        place(
            &Limit::new(&cage, &evaluator, &points),
            &mut samples,
            diagonal,
        );
        let control = Fitter::new(&cage, &evaluator)?.fit(&mut samples)?;
        let limit = Limit::new(&cage, &evaluator, &control);
        let (errors, shape) = (errors(&limit, &samples), shape(&limit, &samples).0);
        println!(
            "{file} | {} | {} | {:.2e} | {:.2e} | {:.2} | {:.1e}",
            cage.cells.len(),
            cage.vertices,
            errors.rms / diagonal,
            errors.max / diagonal,
            errors.p95_normal_angle.to_degrees(),
            shape.turned_over
        );
    }
    Ok(())
}

/// Sides of cells where they turn by more than 40°.
fn sharp(points: &[[f64; 3]], cells: &[[u32; 4]]) -> Vec<[bool; 4]> {
    use affine_atlas::geometry::mesh::{cross, dot, norm, sub};
    let normal = |c: &[u32; 4]| {
        let p = c.map(|v| points[v as usize]);
        cross(sub(p[2], p[0]), sub(p[3], p[1]))
    };
    let mut beside = HashMap::new();
    for (c, corners) in cells.iter().enumerate() {
        for k in 0..4 {
            beside.insert([corners[k], corners[(k + 1) % 4]], c);
        }
    }
    let is_sharp = |c: usize, k: usize| {
        let other = beside.get(&[cells[c][(k + 1) % 4], cells[c][k]]);
        other.is_some_and(|&d| {
            let (m, n) = (normal(&cells[c]), normal(&cells[d]));
            norm(cross(m, n)).atan2(dot(m, n)) > 40f64.to_radians()
        })
    };
    (0..cells.len())
        .map(|c| [0, 1, 2, 3].map(|k| is_sharp(c, k)))
        .collect()
}

/// A place with its point and normal.
type Near = (Place, [f64; 3], [f64; 3]);

/// Points and quads.
type QuadMesh = (Vec<[f64; 3]>, Vec<[u32; 4]>);

/// Nearest places: of the nearest points of a tessellation whose normals agree, then on the surface.
fn place(limit: &Limit<'_>, samples: &mut [Sample], diagonal: f64) {
    const PARTS: usize = 4;
    let size = diagonal / 100.0;
    let bin = |p: [f64; 3]| p.map(|x| (x / size).floor() as i64);
    let mut bins: HashMap<[i64; 3], Vec<Near>> = HashMap::new();
    let at = |i: usize| [i % PARTS, i / PARTS].map(|x| (x as f64 + 0.5) / PARTS as f64);
    for cell in 0..limit.cage.cells.len() as u32 {
        for i in 0..PARTS * PARTS {
            let (point, normal) = limit.normal(cell, at(i));
            let place = Place { cell, at: at(i) };
            bins.entry(bin(point))
                .or_default()
                .push((place, point, normal));
        }
    }
    samples.par_iter_mut().for_each(|sample| {
        let middle = bin(sample.point);
        let mut best: Option<(f64, Place)> = None;
        for reach in 0..200i64 {
            for x in -reach..=reach {
                for y in -reach..=reach {
                    for z in -reach..=reach {
                        if x.abs().max(y.abs()).max(z.abs()) != reach {
                            continue;
                        }
                        let found = bins.get(&[middle[0] + x, middle[1] + y, middle[2] + z]);
                        for (place, point, normal) in found.into_iter().flatten() {
                            let agree: f64 = (0..3).map(|i| normal[i] * sample.normal[i]).sum();
                            let off: f64 =
                                (0..3).map(|i| (point[i] - sample.point[i]).powi(2)).sum();
                            // One on the other side of a thin part is far.
                            let off = off * if agree > 0.3 { 1.0 } else { 25.0 };
                            if best.is_none_or(|(least, _)| off < least) {
                                best = Some((off, *place));
                            }
                        }
                    }
                }
            }
            // Farther away only where nothing is near.
            if reach > 2 && best.is_some() {
                break;
            }
        }
        if let Some((_, place)) = best {
            let mut place = place;
            for _ in 0..3 {
                place = limit.nearest(sample.point, place);
            }
            (sample.cell, sample.at) = (place.cell, place.at);
        }
    });
}

/// Points and quads of an OBJ; polygons that are none are refused.
fn quads(path: &Path) -> Result<QuadMesh, Box<dyn Error>> {
    let (mut points, mut cells) = (Vec::new(), Vec::new());
    for line in std::fs::read_to_string(path)?.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let numbers: Vec<f64> = words.map(str::parse).collect::<Result<_, _>>()?;
                points.push([numbers[0], numbers[1], numbers[2]]);
            }
            Some("f") => {
                let of = |w: &str| w.split('/').next().unwrap_or("").parse::<u32>();
                let numbers: Vec<u32> = words.map(of).collect::<Result<_, _>>()?;
                let [a, b, c, d] = numbers[..] else {
                    return Err(format!("{} has a polygon that is no quad", path.display()).into());
                };
                cells.push([a - 1, b - 1, c - 1, d - 1]);
            }
            _ => {}
        }
    }
    Ok((points, cells))
}
