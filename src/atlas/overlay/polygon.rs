//! Convex polygons with three to six corners, cut into the best triangles.
//!
//! *Enters:* distances between the corners, in one metric or in two. *Leaves:* triangles with counterclockwise corners, appended
//! to a growing surface. *Guaranteed:* of all triangulations the one whose smallest angle is greatest (the smaller of
//! the two metrics counts), ties going to lower corners.

use crate::geometry::ids::{HalfedgeId, VertexId};
use crate::geometry::triangle::area;

/// Most corners of a polygon.
pub(super) const MOST: usize = 6;

/// Distances between all pairs of corners.
pub(super) type Distances = [[f64; MOST]; MOST];

/// All distances between `count` corners.
pub(super) fn distances(count: usize, between: impl Fn(usize, usize) -> f64) -> Distances {
    let mut all = [[0.0; MOST]; MOST];
    for (i, row) in all.iter_mut().enumerate().take(count) {
        for (j, d) in row.iter_mut().enumerate().take(count) {
            // The same value both ways.
            *d = if i == j {
                0.0
            } else {
                between(i.min(j), i.max(j))
            };
        }
    }
    all
}

/// Faces under construction: tail, twin and flat length of every halfedge, three a face.
#[derive(Default)]
pub(super) struct Faces {
    pub tail: Vec<VertexId>,
    pub twin: Vec<Option<HalfedgeId>>,
    pub length: Vec<f64>,
    /// True inside a polygon.
    pub is_diagonal: Vec<bool>,
}

/// Where a polygon went.
pub(super) struct Laid {
    /// Halfedge along the side from corner i to the next one.
    pub side: [HalfedgeId; MOST],
    /// Corners of the polygon at the corners of its triangles, in the order of the new faces.
    pub triangles: [[usize; 3]; MOST - 2],
    /// Number of triangles.
    pub count: usize,
}

impl Faces {
    pub fn with_capacity(faces: usize) -> Self {
        Self {
            tail: Vec::with_capacity(3 * faces),
            twin: Vec::with_capacity(3 * faces),
            length: Vec::with_capacity(3 * faces),
            is_diagonal: Vec::with_capacity(3 * faces),
        }
    }

    /// Number of faces so far.
    pub fn count(&self) -> usize {
        self.tail.len() / 3
    }

    /// Pairs two halfedges.
    pub fn pair(&mut self, a: HalfedgeId, b: HalfedgeId) {
        self.twin[a.index()] = Some(b);
        self.twin[b.index()] = Some(a);
    }

    /// Appends one triangle; halfedge k runs from corner k.
    pub fn triangle(&mut self, corners: [VertexId; 3], length: [f64; 3]) -> [HalfedgeId; 3] {
        let first = self.tail.len();
        self.tail.extend(corners);
        self.twin.extend([None; 3]);
        self.length.extend(length);
        self.is_diagonal.extend([false; 3]);
        [0, 1, 2].map(|k| HalfedgeId::new(first + k))
    }

    /// Appends the triangles of a polygon; sides are left unpaired. `flat` gives the lengths, and with `space` the shape.
    pub fn polygon(
        &mut self,
        corners: &[VertexId],
        flat: &Distances,
        space: Option<&Distances>,
    ) -> Laid {
        let mut laid = Laid {
            side: [HalfedgeId::new(0); MOST],
            triangles: [[0, 1, 2]; MOST - 2],
            count: 0,
        };
        triangulate(corners.len(), flat, space, &mut laid);
        let mut halfedge = [[None; MOST]; MOST];
        for triangle in &laid.triangles[..laid.count] {
            let [a, b, c] = *triangle;
            let sides = self.triangle(
                triangle.map(|i| corners[i]),
                [flat[a][b], flat[b][c], flat[c][a]],
            );
            for (k, h) in sides.into_iter().enumerate() {
                let (p, q) = (triangle[k], triangle[(k + 1) % 3]);
                halfedge[p][q] = Some(h);
                if q == (p + 1) % corners.len() {
                    laid.side[p] = h;
                } else {
                    self.is_diagonal[h.index()] = true;
                    if let Some(t) = halfedge[q][p] {
                        self.pair(h, t);
                    }
                }
            }
        }
        laid
    }
}

/// The triangulation with the greatest smallest angle: best[i][j] of the part from corner i to corner j.
fn triangulate(count: usize, flat: &Distances, space: Option<&Distances>, laid: &mut Laid) {
    if count == 3 {
        laid.count = 1;
        return;
    }
    let mut best = [[f64::INFINITY; MOST]; MOST];
    let mut apex = [[0; MOST]; MOST];
    for span in 2..count {
        for i in 0..count - span {
            let j = i + span;
            best[i][j] = f64::NEG_INFINITY;
            for k in i + 1..j {
                let sharpest = |d: &Distances| smallest_sine([d[i][k], d[k][j], d[j][i]]);
                let shape = space.map_or(f64::INFINITY, sharpest).min(sharpest(flat));
                let worst = shape.min(best[i][k]).min(best[k][j]);
                if worst > best[i][j] {
                    best[i][j] = worst;
                    apex[i][j] = k;
                }
            }
        }
    }
    let mut parts = [(0, 0); MOST];
    parts[0] = (0, count - 1);
    let mut open = 1;
    while open > 0 {
        open -= 1;
        let (i, j) = parts[open];
        let k = apex[i][j].clamp(i + 1, j - 1);
        laid.triangles[laid.count] = [i, k, j];
        laid.count += 1;
        for part in [(k, j), (i, k)] {
            if part.1 > part.0 + 1 {
                parts[open] = part;
                open += 1;
            }
        }
    }
}

/// Sine of the smallest angle; 0 where the lengths make no triangle.
fn smallest_sine(length: [f64; 3]) -> f64 {
    let shortest = length[0].min(length[1]).min(length[2]);
    let area = area(length).unwrap_or(0.0);
    // 2A = (product of the two longer sides) · sin, and the product of all three is at hand in any order.
    match area > 0.0 {
        true => 2.0 * area / length[0] / length[1] / length[2] * shortest,
        false => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(points: &[[f64; 2]]) -> (Faces, Laid) {
        let corners: Vec<VertexId> = (0..points.len()).map(VertexId::new).collect();
        let between =
            |i: usize, j: usize| (points[i][0] - points[j][0]).hypot(points[i][1] - points[j][1]);
        let flat = distances(points.len(), between);
        let mut faces = Faces::default();
        let laid = faces.polygon(&corners, &flat, None);
        (faces, laid)
    }

    #[test]
    fn a_kite_is_halved_the_short_way() {
        let (faces, laid) = polygon(&[[0.0, -3.0], [1.0, 0.0], [0.0, 3.0], [-1.0, 0.0]]);
        let diagonals = faces.is_diagonal.iter().filter(|&&d| d).count();
        assert_eq!((laid.count, diagonals), (2, 2));
        for (h, &is_diagonal) in faces.is_diagonal.iter().enumerate() {
            assert_eq!(faces.twin[h].is_some(), is_diagonal);
            assert!(!is_diagonal || (faces.length[h] - 2.0).abs() < 1e-15);
        }
    }

    #[test]
    fn polygons_keep_their_area_and_every_side() {
        for n in 3..=MOST {
            let points: Vec<[f64; 2]> = (0..n)
                .map(|i| (i as f64 * 6.0 / n as f64).sin_cos())
                .map(|(s, c)| [2.0 * c, s])
                .collect();
            let shoelace: f64 = (0..n)
                .map(|i| (points[i], points[(i + 1) % n]))
                .map(|(p, q)| 0.5 * (p[0] * q[1] - p[1] * q[0]))
                .sum();
            let (faces, laid) = polygon(&points);
            assert_eq!((laid.count, faces.count()), (n - 2, n - 2));
            let areas = faces
                .length
                .chunks(3)
                .map(|l| area([l[0], l[1], l[2]]).unwrap());
            assert!((areas.sum::<f64>() - shoelace).abs() < 1e-12);
            for (i, &h) in laid.side[..n].iter().enumerate() {
                assert_eq!(faces.tail[h.index()], VertexId::new(i));
                assert!(faces.twin[h.index()].is_none());
            }
        }
    }
}
