//! Plates with holes, of any genus, closed and with a boundary.

use std::collections::HashMap;

/// Corners in space.
pub type Positions = Vec<[f64; 3]>;
/// Corners of triangles, counterclockwise.
pub type Faces = Vec<[u32; 3]>;

/// Squares along an edge of a hole.
const FINE: usize = 4;
/// Rounds of [`rounded`]: no edge is sharp after them.
const ROUNDS: usize = 8;

/// A square plate with `genus` square holes through it, `FINE` squares thick. `is_open`: without one square of its top.
pub fn plate(genus: usize, is_open: bool) -> (Positions, Faces) {
    let side = (1..).find(|k| k * k >= genus).unwrap_or(1);
    let width = (2 * side + 1) * FINE;
    let is_hole = |i: usize, j: usize| {
        let (a, b) = (i / FINE, j / FINE);
        a % 2 == 1 && b % 2 == 1 && (a / 2) * side + b / 2 < genus
    };
    // Cells are counted from 1, so that there is one beside each.
    let is_full = |i: usize, j: usize| {
        (1..=width).contains(&i) && (1..=width).contains(&j) && !is_hole(i - 1, j - 1)
    };
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    let mut number: HashMap<[usize; 3], u32> = HashMap::new();
    let mut quad = |corners: [[usize; 3]; 4]| {
        let [a, b, c, d] = corners.map(|p| {
            *number.entry(p).or_insert_with(|| {
                positions.push(p.map(|x| x as f64 / FINE as f64));
                positions.len() as u32 - 1
            })
        });
        faces.extend([[a, b, c], [a, c, d]]);
    };
    for i in 1..=width {
        for j in (1..=width).filter(|&j| is_full(i, j)) {
            let (k, l, top) = (i + 1, j + 1, FINE);
            // The first cell of the top is the hole of an open plate.
            if !(is_open && (i, j) == (2, 2)) {
                quad([[i, j, top], [k, j, top], [k, l, top], [i, l, top]]);
            }
            quad([[i, j, 0], [i, l, 0], [k, l, 0], [k, j, 0]]);
            let sides = [
                (i - 1, j, [i, l], [i, j]),
                (i + 1, j, [k, j], [k, l]),
                (i, j - 1, [i, j], [k, j]),
                (i, j + 1, [k, l], [i, l]),
            ];
            for (_, _, p, q) in sides.into_iter().filter(|s| !is_full(s.0, s.1)) {
                for z in 0..FINE {
                    let [a, b] = [p, q].map(|[x, y]| move |z| [x, y, z]);
                    quad([a(z), b(z), b(z + 1), a(z + 1)]);
                }
            }
        }
    }
    (positions, faces)
}

/// The closed plate, bent and rounded: every vertex is moved to the mean of its neighbours a few times.
pub fn rounded(genus: usize) -> (Positions, Faces) {
    let (mut positions, faces) = plate(genus, false);
    for [x, y, z] in &mut positions {
        *z += 0.4 * (0.9 * *x).sin() * (0.7 * *y).cos();
        *x += 0.2 * (1.1 * *y).sin();
    }
    for _ in 0..ROUNDS {
        let mut sum = vec![([0.0; 3], 0.0); positions.len()];
        for face in &faces {
            for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                let (total, count) = &mut sum[face[from] as usize];
                (0..3).for_each(|i| total[i] += positions[face[to] as usize][i]);
                *count += 1.0;
            }
        }
        positions = sum.iter().map(|(p, n)| p.map(|x| x / n)).collect();
    }
    (positions, faces)
}

/// The text of an OBJ file.
pub fn obj((positions, faces): &(Positions, Faces)) -> String {
    let vertices = positions.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let faces = faces
        .iter()
        .map(|f| format!("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1));
    vertices.chain(faces).collect()
}
