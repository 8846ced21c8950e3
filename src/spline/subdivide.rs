//! One step of Catmull–Clark subdivision of a whole control mesh: four cells for one, with the same limit surface.

use super::cage::{Cage, Kind};
use super::error::SplineError;

/// A finer control mesh: cell 4c + k is the quarter of cell c at its corner k, its corners in the order of the cell's; points are
/// those of the coarse one, then one an edge, then one a cell.
pub fn subdivide(cage: &Cage, points: &[[f64; 3]]) -> Result<(Cage, Vec<[f64; 3]>), SplineError> {
    let (vertices, cells) = (cage.vertices, cage.cells.len());
    let edges: Vec<_> = cage.edges().collect();
    let mut edge = vec![[0u32; 4]; cells];
    for (e, &(c, k)) in edges.iter().enumerate() {
        edge[c as usize][usize::from(k)] = (vertices + e) as u32;
        if let Some((d, l)) = cage.across[c as usize][usize::from(k)] {
            edge[d as usize][usize::from(l)] = (vertices + e) as u32;
        }
    }
    let inner = |c: usize| (vertices + edges.len() + c) as u32;
    let quarter = |c: usize, k: usize| {
        let mut quad = [0; 4];
        quad[k] = cage.cells[c][k];
        quad[(k + 1) % 4] = edge[c][k];
        quad[(k + 2) % 4] = inner(c);
        quad[(k + 3) % 4] = edge[c][(k + 3) % 4];
        quad
    };
    let fine = (0..cells).flat_map(|c| (0..4).map(move |k| (c, k)));
    let fine: Vec<[u32; 4]> = fine.map(|(c, k)| quarter(c, k)).collect();
    let total = vertices + edges.len() + cells;
    let crease = |(f, side): (u32, u8)| {
        let (c, k) = (f as usize / 4, f as usize % 4);
        // Sides of a quarter on those of the cell: from its corner on, and to it.
        let side = usize::from(side);
        (side == k || side == (k + 3) % 4) && cage.crease[c][side]
    };
    let mut is_corner = cage.is_corner.clone();
    is_corner.resize(total, false);
    let fine = Cage::new(total, fine, crease, is_corner)?;

    let mean = |of: &[u32]| -> [f64; 3] {
        let sum = |i: usize| of.iter().map(|&v| points[v as usize][i]).sum::<f64>();
        [0, 1, 2].map(|i| sum(i) / of.len() as f64)
    };
    let middle: Vec<[f64; 3]> = cage.cells.iter().map(|c| mean(c)).collect();
    let kinds = cage.kinds();
    let mut new = Vec::with_capacity(total);
    for (v, side) in cage.leaving().into_iter().enumerate() {
        let own = points[v];
        let Some(side) = side else {
            new.push(own);
            continue;
        };
        let star = cage.star(side);
        let point = match kinds[v] {
            Kind::Corner => own,
            Kind::Crease => {
                let mut sum = own.map(|x| 0.75 * x);
                for &(c, k) in &star {
                    let corners = cage.cells[c as usize];
                    let k = usize::from(k);
                    // Each crease once: where its side leaves, and at the border where one comes in.
                    let mut ends = Vec::new();
                    if cage.crease[c as usize][k] {
                        ends.push(corners[(k + 1) % 4]);
                    }
                    if cage.across[c as usize][(k + 3) % 4].is_none() {
                        ends.push(corners[(k + 3) % 4]);
                    }
                    for x in ends {
                        (0..3).for_each(|i| sum[i] += points[x as usize][i] / 8.0);
                    }
                }
                sum
            }
            Kind::Smooth | Kind::Dart => {
                let n = star.len() as f64;
                let mut sum = own.map(|x| x * (n - 2.0) / n);
                for &(c, k) in &star {
                    let x = points[cage.cells[c as usize][(usize::from(k) + 1) % 4] as usize];
                    (0..3).for_each(|i| sum[i] += (x[i] + middle[c as usize][i]) / (n * n));
                }
                sum
            }
        };
        new.push(point);
    }
    for &(c, k) in &edges {
        let corners = cage.cells[c as usize];
        let ends = mean(&[corners[usize::from(k)], corners[(usize::from(k) + 1) % 4]]);
        new.push(match cage.across[c as usize][usize::from(k)] {
            Some((d, _)) if !cage.is_crease((c, k)) => {
                let both = [middle[c as usize], middle[d as usize]];
                std::array::from_fn(|i| (2.0 * ends[i] + both[0][i] + both[1][i]) / 4.0)
            }
            _ => ends,
        });
    }
    new.extend(middle);
    Ok((fine, new))
}
