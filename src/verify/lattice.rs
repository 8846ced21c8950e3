//! The integer grid: coordinates whose transitions are quarter turns and whole numbers, and the quad mesh of its cells.
//!
//! Checked with nothing but the arrays: every face lies the right way up, both ends of every edge obey its transition, areas add up to the number of
//! cells, every block is full of cells, and the quad mesh has the surface's Euler characteristic and the valences that the cones prescribe.

use super::Verdicts;
use super::arrays::Arrays;
use super::document::{Document, Irregular};
use super::formulas::{Point2, Worst, doubled_area2};
use super::surface::Surface;
use crate::read::bounded::read_bounded;
use crate::read::npz::Npz;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// Largest quad mesh that is read (bytes): 2,000,000 cells have 200 MB.
const OBJ_LIMIT: u64 = u32::MAX as u64;
/// By how much of a cell transitions may be off.
const TRANSITION_TOLERANCE: f64 = 1e-9;
/// By how much of itself the sum of areas may be off.
const AREA_TOLERANCE: f64 = 1e-9;

/// The arrays of a grid.
struct Grid {
    uv: Vec<[Point2; 3]>,
    turns: Vec<u8>,
    shift: Vec<[i64; 2]>,
    points: usize,
    positions: Vec<[f64; 3]>,
    quads: Vec<[u32; 4]>,
    patch: Vec<u32>,
    cell: Vec<[u32; 2]>,
}

/// `quads.obj` holds the arrays `quad_positions` and `quads`, row by row.
fn quad_file(folder: &Path, grid: &Grid, document: &Document, verdicts: &mut Verdicts) {
    let path = folder.join("quads.obj");
    if !path.exists() && !document.is_generated() {
        return;
    }
    let found = match read_bounded(&path, OBJ_LIMIT) {
        Ok(bytes) => difference(&String::from_utf8_lossy(&bytes), grid),
        Err(error) => Some(error.to_string()),
    };
    verdicts.note(
        "quads.obj holds the quad mesh",
        found.is_none(),
        found.unwrap_or_else(|| format!("{} quads", grid.quads.len())),
    );
}

/// The first line of an OBJ file that is not as the arrays have it.
fn difference(text: &str, grid: &Grid) -> Option<String> {
    let (mut points, mut quads) = (0, 0);
    for (line, number) in text.lines().zip(1..) {
        let mut words = line.split_ascii_whitespace();
        let own = match words.next() {
            Some("v") => {
                let point = grid.positions.get(points);
                points += 1;
                point.is_some_and(|p| words.map(str::parse).eq(p.iter().map(|&x: &f64| Ok(x))))
            }
            Some("f") => {
                let quad = grid.quads.get(quads);
                quads += 1;
                let corner = |word: &str| word.split('/').next().unwrap_or_default().parse::<u32>();
                quad.is_some_and(|q| words.map(corner).eq(q.iter().map(|&v| Ok(v + 1))))
            }
            _ => true,
        };
        if !own {
            let line: String = line.chars().take(80).collect();
            return Some(format!("line {number}, `{line}`, is not that of atlas.npz"));
        }
    }
    let (all, cells) = (grid.positions.len(), grid.quads.len());
    (points != all || quads != cells)
        .then(|| format!("{points} vertices and {quads} faces in place of {all} and {cells}"))
}

fn read(folder: &Path, faces: usize) -> Result<Grid, String> {
    let mut npz = Npz::open(&folder.join("atlas.npz"))?;
    let f = Some(faces);
    let (uv, _) = npz.read("grid_uv", &[f, Some(3), Some(2)])?;
    let (turns, _) = npz.read::<u8>("grid_turns", &[f, Some(3)])?;
    let (shift, _) = npz.read::<i64>("grid_shift", &[f, Some(3), Some(2)])?;
    let (positions, points) = npz.read::<f64>("quad_positions", &[None, Some(3)])?;
    let (quads, count) = npz.read("quads", &[None, Some(4)])?;
    let (patch, _) = npz.read("quad_patch", &[Some(count)])?;
    let (cell, _) = npz.read("quad_cell", &[Some(count), Some(2)])?;
    if let Some(at) = positions.iter().position(|x| !x.is_finite()) {
        return Err(format!(
            "row {} of quad_positions holds {}",
            at / 3,
            positions[at]
        ));
    }
    Ok(Grid {
        uv,
        turns,
        shift: shift.as_chunks::<2>().0.to_vec(),
        points,
        positions: positions.as_chunks::<3>().0.to_vec(),
        quads,
        patch,
        cell,
    })
}

pub(super) fn check(
    folder: &Path,
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    verdicts: &mut Verdicts,
) {
    let Some(stated) = &document.grid else {
        return;
    };
    let grid = match read(folder, arrays.faces.len()) {
        Ok(grid) => grid,
        Err(error) => {
            verdicts.note("the grid's arrays can be read", false, error);
            return;
        }
    };
    let areas: Vec<f64> = grid.uv.iter().map(|t| 0.5 * doubled_area2(*t)).collect();
    let over = areas
        .iter()
        .filter(|area| **area <= 0.0 || area.is_nan())
        .count();
    verdicts.note(
        "no face is turned over on the grid",
        over == 0 && stated.turned_over == 0,
        format!("{over} of {}", areas.len()),
    );
    let sum: f64 = areas.iter().sum();
    let cells = grid.quads.len() as f64;
    verdicts.note(
        "areas on the grid add up to its cells",
        (sum - cells).abs() <= AREA_TOLERANCE * cells && stated.cells == grid.quads.len(),
        format!("{sum} of {}", stated.cells),
    );
    quad_file(folder, &grid, document, verdicts);
    let worst = transitions(&grid, surface);
    verdicts.note(
        "transitions of the grid are quarter turns and whole numbers",
        worst.0 <= TRANSITION_TOLERANCE,
        format!("{:.3e} of a cell", worst.0),
    );
    blocks(&grid, document, verdicts);
    quads(
        &grid,
        surface,
        arrays,
        document,
        &stated.irregular,
        verdicts,
    );
}

/// R^turns p + shift.
fn across(p: Point2, turns: u8, shift: [i64; 2]) -> Point2 {
    let [x, y] = p;
    let [x, y] = match turns {
        0 => [x, y],
        1 => [-y, x],
        2 => [-x, -y],
        3 => [y, -x],
        _ => [f64::NAN; 2],
    };
    [x + shift[0] as f64, y + shift[1] as f64]
}

/// How far both ends of every edge are from obeying its transition, both ways.
fn transitions(grid: &Grid, surface: &Surface<'_>) -> Worst {
    let mut worst = Worst::default();
    let at = |corner: usize| grid.uv[corner / 3][corner % 3];
    for h in 0..surface.halfedges() {
        let Some(t) = surface.twin(h) else {
            worst.see(
                f64::from(grid.turns[h]) + (grid.shift[h][0].abs() + grid.shift[h][1].abs()) as f64,
            );
            continue;
        };
        for (own, other) in [
            (surface.tail_corner(h), surface.head_corner(t)),
            (surface.head_corner(h), surface.tail_corner(t)),
        ] {
            let p = across(at(own), grid.turns[h], grid.shift[h]);
            let q = at(other);
            worst.see((p[0] - q[0]).abs().max((p[1] - q[1]).abs()));
        }
    }
    worst
}

/// Every block is full of cells, each of which is in one.
fn blocks(grid: &Grid, document: &Document, verdicts: &mut Verdicts) {
    let mut seen = BTreeSet::new();
    let mut stray = 0;
    for (&patch, &[column, row]) in grid.patch.iter().zip(&grid.cell) {
        let cells = document.patches.get(patch as usize).and_then(|p| p.cells);
        let is_inside = cells.is_some_and(|[w, h]| (column as usize) < w && (row as usize) < h);
        stray += usize::from(!is_inside || !seen.insert((patch, column, row)));
    }
    let sizes = document.patches.iter().filter_map(|p| p.cells);
    let room = sizes.fold(0usize, |sum, [w, h]| {
        sum.saturating_add(w.saturating_mul(h))
    });
    verdicts.note(
        "every cell has a place of its own in a block, and blocks are full",
        stray == 0 && room == grid.quads.len(),
        format!("{stray} cells have none, {room} places"),
    );
}

/// Euler characteristic, valences and what is said to be irregular.
fn quads(
    grid: &Grid,
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    stated: &[Irregular],
    verdicts: &mut Verdicts,
) {
    let stray = grid
        .quads
        .iter()
        .flatten()
        .filter(|v| **v as usize >= grid.points)
        .count();
    if !verdicts.note(
        "quads have corners among the points",
        stray == 0,
        format!("{stray} have not"),
    ) {
        return;
    }
    let mut edges: BTreeMap<[u32; 2], [usize; 2]> = BTreeMap::new();
    for quad in &grid.quads {
        for k in 0..4 {
            let (a, b) = (quad[k], quad[(k + 1) % 4]);
            edges.entry([a.min(b), a.max(b)]).or_default()[usize::from(a > b)] += 1;
        }
    }
    let odd = edges
        .iter()
        .filter(|(ends, n)| ends[0] == ends[1] || n[0] > 1 || n[1] > 1);
    let odd = odd.count();
    verdicts.note(
        "quads meet along whole edges, two by two, in opposite directions",
        odd == 0,
        format!("{odd} of {} edges are otherwise", edges.len()),
    );
    let characteristic = grid.points as i64 - edges.len() as i64 + grid.quads.len() as i64;
    verdicts.note(
        "the quad mesh has the surface's Euler characteristic",
        characteristic == document.topology.euler_characteristic,
        format!(
            "{characteristic} and {}",
            document.topology.euler_characteristic
        ),
    );
    let mut valence = vec![0usize; grid.points];
    let mut is_border = vec![false; grid.points];
    for (ends, n) in &edges {
        for &v in ends {
            valence[v as usize] += 1;
            is_border[v as usize] |= n[0] + n[1] == 1;
        }
    }
    let regular = |v: usize| if is_border[v] { 3 } else { 4 };
    let found = (0..grid.points).filter(|&v| valence[v] != regular(v));
    let found: BTreeMap<usize, usize> = found.map(|v| (v, valence[v])).collect();
    let listed: BTreeMap<usize, usize> =
        stated.iter().map(|i| (i.quad_vertex, i.valence)).collect();
    verdicts.note(
        "irregular points are listed with their valences",
        found == listed && listed.len() == stated.len(),
        format!("{} found, {} listed", found.len(), stated.len()),
    );
    let mut unlike = 0;
    let mut told = BTreeSet::new();
    for point in stated {
        let prescribed = arrays.target_curvature.get(point.vertex);
        let on_border = surface
            .on_boundary
            .get(point.vertex)
            .copied()
            .unwrap_or(false);
        let expected = prescribed.map(|k| if on_border { 3.0 } else { 4.0 } - k / FRAC_PI_2);
        let fits = expected.is_some_and(|e| (e - point.valence as f64).abs() < 1e-6);
        unlike += usize::from(!fits || !told.insert(point.vertex));
    }
    let bent = arrays
        .target_curvature
        .iter()
        .filter(|k| k.abs() > 1e-6)
        .count();
    verdicts.note(
        "valences are those that the curvature prescribes",
        unlike == 0 && bent == told.len(),
        format!(
            "{unlike} of {} are others, {bent} vertices are prescribed",
            stated.len()
        ),
    );
}
