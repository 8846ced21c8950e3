//! Surfaces end where the mesh does.

use super::*;
use crate::spline::equations::Equations;
use crate::spline::evaluator::Evaluator;
use crate::spline::fit::fit;
use crate::spline::limit::Limit;

/// Cells along a side, and faces along a cell.
const CELLS: u32 = 6;
const FINE: u32 = 5;

/// A curved sheet in the shape of an L.
fn sheet() -> Gridded {
    let is_in = |[i, j]: [u32; 2]| 2 * i < CELLS || 2 * j < CELLS;
    let at = |n: u32, [i, j]: [u32; 2]| {
        let [x, y] = [i, j].map(|k| 2.0 * f64::from(k) / f64::from(n) - 1.0);
        [
            x,
            y + 0.2 * x * x,
            0.5 * x * x - 0.3 * y * x + 0.3 * (2.0 * y).cos(),
        ]
    };
    let mut sheet = Gridded {
        positions: Vec::new(),
        faces: Vec::new(),
        block: Vec::new(),
        uv: Vec::new(),
        points: Vec::new(),
        cells: Vec::new(),
        cell_block: Vec::new(),
        cell_at: Vec::new(),
    };
    // Squares of both sizes, with numbers for the corners that they use.
    let squares = |n: u32, part: u32, points: &mut Vec<[f64; 3]>| {
        let mut number = FxHashMap::default();
        let all = (0..n).flat_map(|j| (0..n).map(move |i| [i, j]));
        let all = all.filter(|&[i, j]| is_in([i / part, j / part]));
        all.map(|[i, j]| {
            let corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
            let named = corners.map(|corner| {
                *number.entry(corner).or_insert_with(|| {
                    points.push(at(n, corner));
                    points.len() as u32 - 1
                })
            });
            ([i, j], corners, named)
        })
        .collect::<Vec<_>>()
    };
    for (cell, _, named) in squares(CELLS, 1, &mut sheet.points) {
        sheet.cells.push(named);
        sheet.cell_at.push(cell);
        sheet.cell_block.push(0);
    }
    for (_, corners, named) in squares(CELLS * FINE, FINE, &mut sheet.positions) {
        for k in [[0, 1, 2], [0, 2, 3]] {
            sheet.faces.push(k.map(|k| named[k]));
            sheet
                .uv
                .push(k.map(|k| corners[k].map(|x| f64::from(x) / f64::from(FINE))));
            sheet.block.push(0);
        }
    }
    sheet
}

/// The largest distance of samples of the border from that of the surface, and of corners from corners.
fn off(sheet: &Gridded, keep: impl Fn(&Sample) -> bool) -> f64 {
    let cage = sheet.cage().unwrap();
    let mut samples = sheet.samples().unwrap();
    let mut border: Vec<Sample> = samples.clone();
    // Around the corner inside, with three cells, borders are smooth.
    let is_beside = |s: &Sample| norm(sub(s.point, [0.0, 0.0, 0.3])) < 0.4;
    border.retain(|s| s.border.is_some() && !is_beside(s));
    samples.retain(keep);
    let evaluator = Evaluator::new(&cage);
    let mut equations = Equations::new(&cage, &evaluator, &sheet.points, sheet.facets()).unwrap();
    let control = fit(&mut equations, &mut samples).unwrap();
    let limit = Limit::new(&cage, &evaluator, &control);
    for sample in &mut border {
        for _ in 0..3 {
            let side = sample.border.unwrap();
            let (place, side) = limit.nearest_on_border(sample.point, sample.place(), side);
            (sample.cell, sample.at, sample.border) = (place.cell, place.at, Some(side));
            assert!(cage.across[place.cell as usize][usize::from(side)].is_none());
        }
    }
    let of = |s: &Sample| norm(sub(limit.at(s.cell, s.at).point, s.point));
    border.iter().map(of).fold(0.0, f64::max)
}

#[test]
fn samples_of_the_border_are_all_around() {
    let sheet = sheet();
    let samples = sheet.samples().unwrap();
    let border = samples.iter().filter(|s| s.border.is_some());
    let area: f64 = samples.iter().map(Sample::own_area).sum();
    let width = (area / sheet.cells.len() as f64).sqrt();
    // Every edge of the border is longer than none of its pieces.
    let length: f64 = border.map(|s| s.area).sum::<f64>() / width;
    let corners = [0, 1, 2].map(|k| (k, (k + 1) % 3));
    let ends = |f: &[u32; 3]| corners.map(|(a, b)| [f[a], f[b]]);
    let all: FxHashSet<[u32; 2]> = sheet.faces.iter().flat_map(ends).collect();
    let at = |v: u32| sheet.positions[v as usize];
    let open = all.iter().filter(|[a, b]| !all.contains(&[*b, *a]));
    let wanted: f64 = open.map(|&[a, b]| norm(sub(at(b), at(a)))).sum();
    assert!((length - wanted).abs() < 1e-9 * wanted, "{length} {wanted}");
}

#[test]
fn surfaces_end_where_the_mesh_does() {
    let sheet = sheet();
    let with = off(&sheet, |_| true);
    let without = off(&sheet, |s| s.border.is_none());
    assert!(with < 0.01 && without > 3.0 * with, "{with} {without}");
}
