//! A stand-in for surfaces of very many faces, where a small picture is all that is drawn of them.
//!
//! *Enters:* vertices with their normals, and triangles. *Leaves:* the same surface on the vertices of a grid: all that lie in one
//! cell and face the same way become one, at their mean, and triangles that this leaves no area are left out. Neighbours stay
//! neighbours, so no gap opens, and both sides of a thin wall stay apart. The number of triangles is bounded by that of the cells
//! the surface goes through.
//!
//! Not guaranteed: details smaller than a cell.

use super::view::{Vec3, finite_box};
use std::collections::HashMap;

/// Vertices and triangles.
pub struct Coarse {
    /// Mean positions.
    pub positions: Vec<Vec3>,
    /// Triangles.
    pub faces: Vec<[u32; 3]>,
}

/// The surface on a grid of `cells` cells along the longest side of its bounding box.
pub fn coarse(positions: &[Vec3], normals: &[Vec3], faces: &[[u32; 3]], cells: u32) -> Coarse {
    let (low, high) = finite_box(positions);
    let longest = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
    let per_unit = f64::from(cells) / longest.max(f64::MIN_POSITIVE);
    let mut numbers: HashMap<[u32; 4], u32> = HashMap::new();
    // Sum of the positions, and how many; in the order of the first vertex of each.
    let mut sums: Vec<(Vec3, f64)> = Vec::new();
    let cluster: Vec<u32> = positions
        .iter()
        .zip(normals)
        .map(|(p, n)| {
            let cell = [0, 1, 2].map(|i| ((p[i] - low[i]) * per_unit) as u32);
            let octant = (0..3).fold(0, |bits, i| 2 * bits + u32::from(n[i] < 0.0));
            // What has no place has it alone, and spoils nobody else's.
            let is_finite = p.iter().all(|x| x.is_finite());
            let octant = if is_finite { octant } else { 8 };
            let key = [cell[0], cell[1], cell[2], octant];
            let number = *numbers.entry(key).or_insert_with(|| {
                sums.push(([0.0; 3], 0.0));
                sums.len() as u32 - 1
            });
            let (sum, count) = &mut sums[number as usize];
            *sum = std::array::from_fn(|i| sum[i] + p[i]);
            *count += 1.0;
            number
        })
        .collect();
    let faces = faces
        .iter()
        .map(|face| face.map(|v| cluster[v as usize]))
        .filter(|[a, b, c]| a != b && b != c && c != a);
    Coarse {
        faces: faces.collect(),
        positions: sums
            .into_iter()
            .map(|(sum, count)| sum.map(|x| x / count))
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::{norm, triangle_area};

    /// A sphere of rows and columns, and its normals.
    fn sphere(n: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let at = |row: u32, column: u32| row * n + column % n;
        let mut positions = Vec::new();
        let mut faces = Vec::new();
        for row in 0..=n {
            let (s, c) = (std::f64::consts::PI * f64::from(row) / f64::from(n)).sin_cos();
            for column in 0..n {
                let (t, u) = (std::f64::consts::TAU * f64::from(column) / f64::from(n)).sin_cos();
                positions.push([s * t, c, s * u]);
                if row < n {
                    let [a, b] = [at(row, column), at(row, column + 1)];
                    let [c, d] = [at(row + 1, column + 1), at(row + 1, column)];
                    faces.extend([[a, c, b], [a, d, c]]);
                }
            }
        }
        (positions, faces)
    }

    #[test]
    fn a_sphere_keeps_its_shape_with_a_bounded_number_of_faces() {
        let mut counts = Vec::new();
        for n in [150, 300] {
            let (positions, faces) = sphere(n);
            let few = coarse(&positions, &positions, &faces, 24);
            assert!(few.positions.iter().all(|p| (norm(*p) - 1.0).abs() < 0.01));
            let area = |p: &[Vec3], f: &[[u32; 3]]| -> f64 {
                let corners = |t: &[u32; 3]| t.map(|v| p[v as usize]);
                f.iter().map(|t| triangle_area(corners(t))).sum()
            };
            let ratio = area(&few.positions, &few.faces) / area(&positions, &faces);
            assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
            counts.push(few.faces.len());
        }
        assert!(
            counts[0] < 9000 && counts[1] < counts[0] * 5 / 4,
            "{counts:?}"
        );
    }

    #[test]
    fn both_sides_of_a_sheet_stay_and_what_has_no_place_is_alone() {
        let sheet = |y: f64| [[0.0, y, 0.0], [9.0, y, 0.0], [0.0, y, 9.0]];
        let mut positions: Vec<Vec3> = [sheet(0.0), sheet(0.001)].concat();
        positions.push([f64::NAN, 0.0, 0.0]);
        let normals = [[[0.0, -1.0, 0.0]; 3], [[0.0, 1.0, 0.0]; 3]].concat();
        let normals = [normals, vec![[0.0, 1.0, 0.0]]].concat();
        let few = coarse(&positions, &normals, &[[0, 1, 2], [3, 5, 4], [0, 1, 6]], 8);
        assert_eq!(few.faces, [[0, 1, 2], [3, 5, 4], [0, 1, 6]]);
        assert_eq!(&few.positions[..6], &positions[..6]);
        assert!(few.positions[6][0].is_nan());
    }
}
