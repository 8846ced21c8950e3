//! Where to look from: a perspective camera that shows much of the surface.

use super::raster::{Band, NOTHING};
use crate::geometry::mesh::{bounding_box, cross, distance, dot, norm, sub};
use rayon::prelude::*;

/// Vectors in space.
pub type Vec3 = [f64; 3];

/// a + s b
pub fn along(a: Vec3, s: f64, b: Vec3) -> Vec3 {
    std::array::from_fn(|i| a[i] + s * b[i])
}

/// Unit vector; the zero vector stays zero.
pub fn unit(a: Vec3) -> Vec3 {
    let n = norm(a);
    if n > 0.0 { a.map(|x| x / n) } else { a }
}

/// Camera axes, eye and the mapping to the screen.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Unit vectors in space: right and up on the screen, and from the scene to the eye.
    pub right: Vec3,
    /// See `right`.
    pub up: Vec3,
    /// See `right`.
    pub back: Vec3,
    /// Where the eye is.
    pub eye: Vec3,
    /// Pixels a unit of (x / depth).
    pub zoom: f64,
    /// Screen position of the axis of view.
    pub principal: [f64; 2],
}

/// Distance of the eye, in radii of the scene: mild perspective.
const EYE_DISTANCE: f64 = 6.0;
/// Share of the picture's side that the surface fills.
const FILL: f64 = 0.82;

impl Camera {
    /// Looks at the points from `direction` (unit, from the scene to the eye) so that they fill a square picture of `size` pixels.
    pub fn looking_from(direction: Vec3, points: &[Vec3], size: f64) -> Camera {
        let (low, high) = finite_box(points);
        let centre: Vec3 = std::array::from_fn(|i| 0.5 * (low[i] + high[i]));
        let radius = (0.5 * distance(low, high)).max(f64::MIN_POSITIVE);
        let back = unit(direction);
        let vertical = if back[1].abs() > 0.999 {
            [0.0, 0.0, -1.0]
        } else {
            [0.0, 1.0, 0.0]
        };
        let right = unit(cross(vertical, back));
        let mut camera = Camera {
            right,
            up: cross(back, right),
            back,
            eye: along(centre, EYE_DISTANCE * radius, back),
            zoom: 1.0,
            principal: [0.0; 2],
        };
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in points {
            let s = camera.project(*p);
            if s.iter().all(|x| x.is_finite()) {
                low = [low[0].min(s[0]), low[1].min(s[1])];
                high = [high[0].max(s[0]), high[1].max(s[1])];
            }
        }
        let extent = (high[0] - low[0]).max(high[1] - low[1]);
        if extent > 0.0 && extent.is_finite() {
            camera.zoom = FILL * size / extent;
            camera.principal =
                std::array::from_fn(|i| 0.5 * size - 0.5 * camera.zoom * (low[i] + high[i]));
        }
        camera
    }

    /// Column, row and closeness (1 / depth) of a point in space.
    pub fn project(&self, p: Vec3) -> [f64; 3] {
        let d = sub(p, self.eye);
        let near = -1.0 / dot(d, self.back);
        [
            self.principal[0] + self.zoom * dot(d, self.right) * near,
            self.principal[1] - self.zoom * dot(d, self.up) * near,
            near,
        ]
    }

    /// Direction (not unit; depth 1) of the line of sight through a point of the screen.
    pub fn sight(&self, screen: [f64; 2]) -> Vec3 {
        let x = (screen[0] - self.principal[0]) / self.zoom;
        let y = (self.principal[1] - screen[1]) / self.zoom;
        std::array::from_fn(|i| x * self.right[i] + y * self.up[i] - self.back[i])
    }
}

/// Bounding box of the finite points; a unit box where there are none.
pub fn finite_box(points: &[Vec3]) -> (Vec3, Vec3) {
    let finite: Vec<Vec3> = (points.iter().copied())
        .filter(|p| p.iter().all(|x| x.is_finite()))
        .collect();
    if finite.is_empty() {
        ([-0.5; 3], [0.5; 3])
    } else {
        bounding_box(&finite)
    }
}

/// Pixels along a side of the trial pictures.
const TRIAL: usize = 112;

/// The direction to look from: of many three-quarter views from above, the one that shows most of the
/// surface's front, largely, and with its holes open. `y` is up, as in glTF and most OBJ files.
pub fn choose_direction(positions: &[Vec3], faces: &[[u32; 3]]) -> Vec3 {
    let mut candidates: Vec<Vec3> = Vec::new();
    for degrees in [12.0_f64, 22.0, 35.0, 52.0] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        for k in 0..36 {
            let (x, z) = f64::from(10 * k).to_radians().sin_cos();
            candidates.push([cosine * x, sine, cosine * z]);
        }
    }
    let scores: Vec<f64> = candidates
        .par_iter()
        .map(|&d| score(d, positions, faces))
        .collect();
    let best =
        (0..candidates.len()).fold(0, |best, k| if scores[k] > scores[best] { k } else { best });
    candidates[best]
}

/// How good a view is: visible front, size on the picture and open holes against what is dull.
fn score(direction: Vec3, positions: &[Vec3], faces: &[[u32; 3]]) -> f64 {
    let camera = Camera::looking_from(direction, positions, TRIAL as f64);
    let screen: Vec<[f64; 3]> = positions.iter().map(|&p| camera.project(p)).collect();
    let mut band = Band::new(TRIAL, 0, TRIAL);
    for (f, face) in faces.iter().enumerate() {
        band.draw(&face.map(|v| screen[v as usize]), f as u32);
    }
    let (mut front, mut back) = (0.0, 0.0);
    let mut open = vec![false; TRIAL * TRIAL];
    for row in 0..TRIAL {
        for column in 0..TRIAL {
            let seen = band.object(column, row);
            if seen == NOTHING {
                open[row * TRIAL + column] = true;
                continue;
            }
            let [a, b, c] = faces[seen as usize].map(|v| screen[v as usize]);
            // Rows run downwards: a counterclockwise face has negative area on the screen.
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            *(if area < 0.0 { &mut front } else { &mut back }) += 1.0;
        }
    }
    let pixels = (TRIAL * TRIAL) as f64;
    let holes = holes(open);
    let hole_area: f64 = holes.iter().map(|&n| n as f64 / pixels).sum();
    let facing = front / pixels - 1.5 * back / pixels;
    // A look along an axis is flat, and models face +z.
    let [x, _, z] = direction.map(f64::abs);
    let oblique = 1.0 - 5.0 * (x.max(z) / x.hypot(z) - 0.965).max(0.0);
    let elevation = 1.0 - 0.8 * (direction[1] - 0.36).abs();
    (facing + 0.06 * holes.len() as f64 + hole_area) * oblique * elevation + 0.02 * direction[2]
}

/// Sizes of the regions of background that the surface encloses, specks left out.
fn holes(mut open: Vec<bool>) -> Vec<usize> {
    let mut sizes = Vec::new();
    for start in 0..open.len() {
        if !std::mem::take(&mut open[start]) {
            continue;
        }
        let (mut stack, mut size, mut enclosed) = (vec![start], 0, true);
        while let Some(at) = stack.pop() {
            size += 1;
            let (column, row) = (at % TRIAL, at / TRIAL);
            let neighbours = [
                (column > 0).then(|| at - 1),
                (column + 1 < TRIAL).then_some(at + 1),
                (row > 0).then(|| at - TRIAL),
                (row + 1 < TRIAL).then_some(at + TRIAL),
            ];
            enclosed &= neighbours.iter().all(Option::is_some);
            for next in neighbours.into_iter().flatten() {
                if std::mem::take(&mut open[next]) {
                    stack.push(next);
                }
            }
        }
        if enclosed && size >= 12 {
            sizes.push(size);
        }
    }
    sizes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_projected_point_lies_on_its_line_of_sight() {
        let points = [[-3.0, 1.0, 2.0], [5.0, -2.0, 0.5], [0.0, 7.0, 1.0]];
        let camera = Camera::looking_from(unit([0.3, 0.5, 0.9]), &points, 500.0);
        for p in points {
            let [column, row, near] = camera.project(p);
            let seen = along(camera.eye, 1.0 / near, camera.sight([column, row]));
            assert!(distance(seen, p) < 1e-12 * 50.0, "{seen:?} {p:?}");
            assert!((0.0..500.0).contains(&column) && (0.0..500.0).contains(&row));
        }
    }

    #[test]
    fn enclosed_background_is_a_hole() {
        let mut open = vec![true; TRIAL * TRIAL];
        let square = |low: usize, high: usize| {
            (low..high).flat_map(move |y| (low..high).map(move |x| y * TRIAL + x))
        };
        square(20, 60).for_each(|at| open[at] = false);
        square(30, 40).for_each(|at| open[at] = true);
        assert_eq!(holes(open), [100]);
    }

    #[test]
    fn an_open_sheet_is_seen_from_its_front() {
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        let front = choose_direction(&positions, &[[0, 1, 2], [0, 2, 3]]);
        let behind = choose_direction(&positions, &[[0, 2, 1], [0, 3, 2]]);
        assert!(front[2] > 0.3 && behind[2] < -0.3, "{front:?} {behind:?}");
    }
}
