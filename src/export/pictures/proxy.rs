//! A coarse stand-in for a surface where single faces do not matter: to choose the view, and for the shadow on the floor.
//!
//! Vertices in one cell of a lattice become one at their mean (Rossignac and Borrel, *Multi-resolution 3D approximations for rendering
//! complex scenes*, 1993), so that what is drawn with it hardly costs more for a million faces than for a thousand.

use super::view::{Vec3, finite_box};

/// Cells of the lattice along the longest side of the box.
const CELLS: usize = 24;
/// Surfaces of no more faces stand for themselves.
const FEW: usize = 1500;
/// No vertex.
const NONE: u32 = u32::MAX;

/// Vertices and faces.
pub struct Proxy {
    pub positions: Vec<Vec3>,
    pub faces: Vec<[u32; 3]>,
}

impl Proxy {
    /// Of a surface; faces without a finite place are left out where it is simplified.
    pub fn of(positions: &[Vec3], faces: &[[u32; 3]]) -> Proxy {
        if faces.len() <= FEW {
            return Proxy {
                positions: positions.to_vec(),
                faces: faces.to_vec(),
            };
        }
        let (low, high) = finite_box(positions);
        let longest = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
        let cells = CELLS as f64 / longest.max(f64::MIN_POSITIVE);
        // Vertex of each cell, the sum of the places there and their number.
        let mut of_cell = vec![NONE; CELLS * CELLS * CELLS];
        let mut sums: Vec<(Vec3, f64)> = Vec::new();
        let mut united = Vec::with_capacity(positions.len());
        for p in positions {
            if !p.iter().all(|x| x.is_finite()) {
                united.push(NONE);
                continue;
            }
            let cell = (0..3).fold(0, |cell, i| {
                cell * CELLS + (((p[i] - low[i]) * cells) as usize).min(CELLS - 1)
            });
            if of_cell[cell] == NONE {
                of_cell[cell] = sums.len() as u32;
                sums.push(([0.0; 3], 0.0));
            }
            united.push(of_cell[cell]);
            let (sum, count) = &mut sums[of_cell[cell] as usize];
            *sum = std::array::from_fn(|i| sum[i] + (p[i] - low[i]));
            *count += 1.0;
        }
        let mean = |(sum, count): (Vec3, f64)| std::array::from_fn(|i| low[i] + sum[i] / count);
        let mut left: Vec<[u32; 3]> = (faces.iter())
            .map(|face| face.map(|v| united[v as usize]))
            .filter(|[a, b, c]| a != b && b != c && c != a && ![*a, *b, *c].contains(&NONE))
            .map(|face| {
                let first = (0..3).fold(0, |k, i| if face[i] < face[k] { i } else { k });
                [0, 1, 2].map(|i| face[(first + i) % 3])
            })
            .collect();
        left.sort_unstable();
        left.dedup();
        Proxy {
            positions: sums.into_iter().map(mean).collect(),
            faces: left,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dense_sheet_becomes_a_coarse_one_in_its_place() {
        let side = 200;
        let positions: Vec<Vec3> = (0..side * side)
            .map(|at| [f64::from(at % side), f64::from(at / side), f64::NAN])
            .enumerate()
            .map(|(at, [x, y, z])| [x, y, if at == 5 { z } else { 1.0 }])
            .collect();
        let faces: Vec<[u32; 3]> = (0..side - 1)
            .flat_map(|y| (0..side - 1).map(move |x| (y * side + x) as u32))
            .flat_map(|a| {
                let side = side as u32;
                [[a, a + 1, a + side + 1], [a, a + side + 1, a + side]]
            })
            .collect();
        let proxy = Proxy::of(&positions, &faces);
        assert!(proxy.positions.len() <= CELLS * CELLS && proxy.faces.len() < 3 * CELLS * CELLS);
        let doubled = |f: &[u32; 3]| {
            let [a, b, c] = f.map(|v| proxy.positions[v as usize]);
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        let area: f64 = proxy.faces.iter().map(doubled).sum::<f64>() / 2.0;
        let whole = f64::from((side - 1) * (side - 1));
        assert!((0.85..1.0).contains(&(area / whole)), "{area} of {whole}");
        // Few faces stand for themselves.
        assert_eq!(Proxy::of(&positions, &faces[..9]).faces, faces[..9]);
    }
}
