//! Narrow corners, which a field shall see as right angles.
//!
//! Lines that meet at less than half a right angle are no different from parallel ones to a cross field. But a cell at the corner has both as sides, a quarter turn, so a quarter turn is taken from a vertex nearby: next to the corner, where it leaves no room for cells. So both sides count as if they
//! opened to a right angle at the corner, and less and less so along them: the field turns back in between, and has its cone where that costs least.
//!
//! *Enters:* a surface with boundary and its corner angles. *Leaves:* by how much the direction that each boundary halfedge shall count for differs from its own. *Guaranteed:* 0 but beside narrow corners, to half the way to the next corner, and no farther than a few widths of the piece of surface. *Not guaranteed:* a quarter turn
//! at every one of them.

use crate::geometry::connectivity::Connectivity;
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::ids::{EdgeVec, FaceVec, HalfedgeVec, VertexId, VertexVec};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Corners of less are narrow, radians: fields make quarter turns of two thirds of a right angle and more by themselves. No angle that is common.
const NARROW: f64 = 55.0 / 180.0 * PI;

/// How far along its sides a corner counts as wider at most, in areas of its piece of surface over lengths of that one's border: of a long strip four times its width, of a triangle more than half of its sides.
const FARTHEST: f64 = 8.0;

/// Area over length of the border of the piece of surface that every vertex is on.
fn widths(c: &Connectivity, area: &FaceVec<f64>, length: &EdgeVec<f64>) -> VertexVec<f64> {
    let mut joined = UnionFind::new(c.vertex_count());
    for e in c.edges() {
        let [a, b] = c.edge_vertices(e);
        joined.join(a.index(), b.index());
    }
    let mut sums = vec![[0.0; 2]; c.vertex_count()];
    for h in c.halfedges() {
        let [areas, border] = &mut sums[joined.find(c.tail(h).index())];
        *areas += area[c.face(h)] / 3.0;
        *border += if c.twin(h).is_none() {
            length[c.edge(h)]
        } else {
            0.0
        };
    }
    let of = |v: VertexId| {
        let [area, border] = sums[joined.find(v.index())];
        area / border
    };
    c.vertices().map(of).collect()
}

/// See the module docs; `area` in the square of the unit of `length`.
pub fn open_narrow(
    c: &Connectivity,
    angle: &FaceVec<[f64; 3]>,
    area: &FaceVec<f64>,
    length: &EdgeVec<f64>,
) -> HalfedgeVec<f64> {
    let width = widths(c, area, length);
    let mut leans = HalfedgeVec::filled(0.0, c.halfedge_count());
    let vertices = c.vertex_count();
    let mut sum = VertexVec::filled(0.0, vertices);
    let mut out = VertexVec::filled(None, vertices);
    let mut back = VertexVec::filled(None, vertices);
    for h in c.halfedges() {
        sum[c.tail(h)] += angle[c.face(h)][c.corner(h)];
        if c.twin(h).is_none() {
            out[c.tail(h)] = Some(h);
            back[c.head(h)] = Some(h);
        }
    }
    let is_corner = |v: VertexId| (sum[v] - PI).abs() > FRAC_PI_4;
    for corner in c.vertices().filter(|&v| sum[v] < NARROW) {
        // With the inside on the left, the side ahead opens clockwise.
        for (ways, is_ahead, sign) in [(&out, true, -0.5), (&back, false, 0.5)] {
            let mut side = Vec::new();
            let (mut next, mut far) = (ways[corner], 0.0);
            while let Some(h) = next {
                side.push((h, [far, far + length[c.edge(h)]]));
                far += length[c.edge(h)];
                let end = if is_ahead { c.head(h) } else { c.tail(h) };
                next = if is_corner(end) { None } else { ways[end] };
            }
            let reach = (0.5 * far).min(FARTHEST * width[corner]);
            if reach <= 0.0 || reach.is_nan() {
                // Of faces without area.
                continue;
            }
            // Of 1 − s / reach at s from the corner, up to there; its integral from there.
            let integral = |s: f64| s.min(reach) * (1.0 - 0.5 * s.min(reach) / reach);
            for (h, [from, to]) in side {
                let part = (integral(to) - integral(from)) / (to - from);
                leans[h] += sign * part * (FRAC_PI_2 - sum[corner]);
            }
        }
    }
    leans
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::field::{CrossField, cross_field};
    use crate::flow::metric::face_lengths;
    use crate::geometry::ids::{FaceId, HalfedgeId};
    use crate::geometry::triangle;

    /// A right-angled triangle whose legs are 1 and `height`, of n² faces.
    struct RightAngled {
        at: Vec<[f64; 2]>,
        c: Connectivity,
        angle: FaceVec<[f64; 3]>,
        area: FaceVec<f64>,
        length: EdgeVec<f64>,
    }

    impl RightAngled {
        fn new(n: u32, height: f64) -> Self {
            let number = |i: u32, j: u32| j * (2 * n + 3 - j) / 2 + i;
            let (mut at, mut faces) = (Vec::new(), Vec::new());
            for (i, j) in (0..=n).flat_map(|j| (0..=n - j).map(move |i| (i, j))) {
                at.push([
                    f64::from(i) / f64::from(n),
                    height * f64::from(j) / f64::from(n),
                ]);
                if i + j < n {
                    faces.push([number(i, j), number(i + 1, j), number(i, j + 1)]);
                }
                if i + j + 1 < n {
                    faces.push([number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)]);
                }
            }
            let c = Connectivity::from_faces(&faces, at.len()).unwrap();
            let span = |e| {
                let [p, q]: [[f64; 2]; 2] = c.edge_vertices(e).map(|v| at[v.index()]);
                (p[0] - q[0]).hypot(p[1] - q[1])
            };
            let length: EdgeVec<f64> = c.edges().map(span).collect();
            let sides = |f: FaceId| face_lengths(&c, &length, f);
            let angle = c.faces().map(|f| triangle::angles(sides(f)).unwrap());
            let area = c.faces().map(|f| triangle::area(sides(f)).unwrap());
            let (angle, area) = (angle.collect(), area.collect());
            Self {
                at,
                c,
                angle,
                area,
                length,
            }
        }

        fn field(&self, lean: &HalfedgeVec<f64>) -> CrossField {
            let pull = FaceVec::filled([0.0; 2], self.c.face_count());
            cross_field(&self.c, &self.angle, &self.area, &pull, lean).unwrap()
        }

        /// Quarter turns of the corners, largest angle first, and places of cones inside.
        fn cones(&self, lean: &HalfedgeVec<f64>) -> ([i64; 3], Vec<[f64; 2]>) {
            let cone = self.field(lean).cones(&self.c, &self.angle).unwrap();
            let corner = |p: [f64; 2]| {
                let nearest = |v: &VertexId| {
                    let q = self.at[v.index()];
                    (p[0] - q[0]).hypot(p[1] - q[1])
                };
                let by = |v: &VertexId, w: &VertexId| nearest(v).total_cmp(&nearest(w));
                self.c.vertices().min_by(by).unwrap()
            };
            let height = self.at.iter().map(|p| p[1]).fold(0.0, f64::max);
            let corners = [[0.0, 0.0], [0.0, height], [1.0, 0.0]].map(corner);
            let is_plain = |v: VertexId| if self.c.is_boundary_vertex(v) { 2 } else { 4 };
            let others = self.c.vertices().filter(|v| !corners.contains(v));
            let others = others.filter(|&v| cone[v] != is_plain(v));
            (
                corners.map(|v| cone[v]),
                others.map(|v| self.at[v.index()]).collect(),
            )
        }
    }

    #[test]
    fn narrow_corners_have_a_quarter_turn_and_a_cone_far_away() {
        for degrees in [25.0_f64, 30.0, 35.0, 40.0] {
            let triangle = RightAngled::new(24, degrees.to_radians().tan());
            let none = HalfedgeVec::filled(0.0, triangle.c.halfedge_count());
            assert_eq!(triangle.cones(&none).0[2], 0, "{degrees}");
            let lean = open_narrow(
                &triangle.c,
                &triangle.angle,
                &triangle.area,
                &triangle.length,
            );
            let (corners, cones) = triangle.cones(&lean);
            assert_eq!(corners, [1, 1, 1], "{degrees}");
            // One of three quarter turns, by Gauss and Bonnet; nowhere near the corner.
            assert_eq!(cones.len(), 1, "{degrees}");
            let [x, y] = cones[0];
            assert!((1.0 - x).hypot(y) > 0.2, "{degrees}: {x} {y}");
        }
    }

    #[test]
    fn sides_open_to_a_right_angle_and_close_again() {
        let (n, tangent) = (20, 30.0_f64.to_radians().tan());
        let triangle = RightAngled::new(n, tangent);
        let (c, length) = (&triangle.c, &triangle.length);
        let lean = open_narrow(c, &triangle.angle, &triangle.area, length);
        let hypotenuse = 1.0_f64.hypot(tangent);
        let width = 0.5 * tangent / (1.0 + tangent + hypotenuse);
        // From the corner of 30°, with the inside on the left: along the base away from it backwards.
        let is_base = |h: HalfedgeId| {
            let ends = [c.tail(h), c.head(h)];
            ends.iter().all(|v| triangle.at[v.index()][1] < 1e-9)
        };
        let is_leg = |h: HalfedgeId| {
            let ends = [c.tail(h), c.head(h)];
            ends.iter().all(|v| triangle.at[v.index()][0] < 1e-9)
        };
        let opening = 30.0_f64.to_radians();
        for (whole, sign) in [(1.0, 1.0), (hypotenuse, -1.0)] {
            let border = c.halfedges().filter(|&h| c.twin(h).is_none() && !is_leg(h));
            let side: Vec<HalfedgeId> = border.filter(|&h| is_base(h) == (sign > 0.0)).collect();
            let reach = (0.5 * whole).min(FARTHEST * width);
            // A triangle over the way to there, and nothing beyond.
            let sum: f64 = side.iter().map(|&h| lean[h] * length[c.edge(h)]).sum();
            assert!((sum - sign * 0.5 * reach * opening).abs() < 1e-12);
            let most = side
                .iter()
                .map(|&h| sign * lean[h])
                .fold(f64::NEG_INFINITY, f64::max);
            let first = 1.0 - 0.5 * whole / f64::from(n) / reach;
            assert!((most - first * opening).abs() < 1e-12);
            assert!(side.iter().all(|&h| sign * lean[h] >= -1e-15));
        }
        let others = c.halfedges().filter(|&h| c.twin(h).is_some() || is_leg(h));
        assert_eq!(others.map(|h| lean[h].abs()).fold(0.0, f64::max), 0.0);
    }

    #[test]
    fn nothing_opens_without_narrow_corners() {
        let square = Connectivity::from_faces(&[[0, 1, 2], [0, 2, 3]], 4).unwrap();
        let (area, length) = (
            FaceVec::filled(0.5, 2),
            EdgeVec::filled(1.0, square.edge_count()),
        );
        let opens = |angle: [[f64; 3]; 2]| {
            let lean = open_narrow(&square, &angle.to_vec().into(), &area, &length);
            lean.iter().any(|&x| x != 0.0)
        };
        let half = FRAC_PI_4;
        assert!(!opens([[half, FRAC_PI_2, half], [half, half, FRAC_PI_2]]));
        assert!(opens([[half; 3]; 2]));
    }
}
