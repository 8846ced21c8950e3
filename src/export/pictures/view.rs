//! Where to look from: a perspective camera that shows much of the surface.

use super::raster::{Band, NOTHING, sparse};
use crate::geometry::mesh::{bounding_box, cross, distance, dot, norm, sub};
use crate::parallel;

/// Vectors in space.
pub type Vec3 = [f64; 3];

/// a + s b
#[inline]
pub fn along(a: Vec3, s: f64, b: Vec3) -> Vec3 {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

/// Unit vector; the zero vector stays zero.
#[inline]
pub fn unit(a: Vec3) -> Vec3 {
    let n = norm(a);
    let inverse = 1.0 / n;
    match n > 0.0 && inverse.is_finite() {
        true => [a[0] * inverse, a[1] * inverse, a[2] * inverse],
        // Too small for its inverse.
        false if n > 0.0 => [a[0] / n, a[1] / n, a[2] / n],
        false => a,
    }
}

/// Camera axes, eye and the mapping to the screen.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Unit vectors in space: right and up on the screen, and from the scene to the eye.
    pub right: Vec3,
    pub up: Vec3,
    pub back: Vec3,
    /// Where the eye is.
    pub eye: Vec3,
    /// Its distance from the middle of the scene.
    pub depth: f64,
    /// Pixels a unit of (x / depth).
    pub zoom: f64,
    /// Its inverse.
    per_pixel: f64,
    /// Screen position of the axis of view.
    pub principal: [f64; 2],
}

/// Distance of the eye, in radii of the scene: mild perspective.
const EYE_DISTANCE: f64 = 6.0;
/// Share of the picture's side that the surface fills.
const FILL: f64 = 0.82;

impl Camera {
    /// Looks at the points from `direction` (from the scene to the eye, not vertical) so that they fill a square picture of `size` pixels.
    pub fn looking_from(direction: Vec3, points: &[Vec3], size: f64) -> Camera {
        let (low, high) = finite_box(points);
        let centre: Vec3 = std::array::from_fn(|i| 0.5 * (low[i] + high[i]));
        let radius = (0.5 * distance(low, high)).max(f64::MIN_POSITIVE);
        let back = unit(direction);
        let right = unit(cross([0.0, 1.0, 0.0], back));
        let mut camera = Camera {
            right,
            up: cross(back, right),
            back,
            eye: along(centre, EYE_DISTANCE * radius, back),
            depth: EYE_DISTANCE * radius,
            zoom: 1.0,
            per_pixel: 1.0,
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
            camera.per_pixel = 1.0 / camera.zoom;
            camera.principal =
                std::array::from_fn(|i| 0.5 * size - 0.5 * camera.zoom * (low[i] + high[i]));
        }
        camera
    }

    /// The unit vector with these parts to the right, upwards and towards the eye, of any length.
    pub fn oriented(&self, [right, up, back]: Vec3) -> Vec3 {
        let level = along(self.right.map(|x| right * x), up, self.up);
        unit(along(level, back, self.back))
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
    #[inline]
    pub fn sight(&self, screen: [f64; 2]) -> Vec3 {
        let x = (screen[0] - self.principal[0]) * self.per_pixel;
        let y = (self.principal[1] - screen[1]) * self.per_pixel;
        along(
            along(along([0.0; 3], x, self.right), y, self.up),
            -1.0,
            self.back,
        )
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
const TRIAL: usize = 48;
/// Turns around the vertical, and elevations in degrees, of the views that are tried.
const TURNS: usize = 24;
const ELEVATIONS: [f64; 3] = [26.0, 16.0, 42.0];
/// Turns that are tried from all elevations: the best from the first.
const PROMISING: usize = 4;

/// The direction to look from: of many three-quarter views from above, the one that shows most of the
/// surface's front, largely, and with its holes open. `y` is up, as in glTF and most OBJ files.
pub fn choose_direction(positions: &[Vec3], faces: &[[u32; 3]]) -> Vec3 {
    let candidate = |(turn, elevation): (usize, usize)| {
        let (sine, cosine) = ELEVATIONS[elevation].to_radians().sin_cos();
        let (x, z) = (360.0 / TURNS as f64 * turn as f64).to_radians().sin_cos();
        [cosine * x, sine, cosine * z]
    };
    let scored = |views: Vec<(usize, usize)>| -> Vec<(f64, (usize, usize))> {
        parallel::map(&views, |_, &view| {
            (score(candidate(view), positions, faces), view)
        })
    };
    let mut tried = scored((0..TURNS).map(|turn| (turn, 0)).collect());
    // Of equally good ones the first.
    tried.sort_by(|a, b| b.0.total_cmp(&a.0));
    let promising = tried[..PROMISING].iter().map(|(_, (turn, _))| *turn);
    let others = promising.flat_map(|turn| (1..ELEVATIONS.len()).map(move |e| (turn, e)));
    tried.extend(scored(others.collect()));
    let better = |best: (f64, _), next: (f64, _)| if next.0 > best.0 { next } else { best };
    candidate(tried.iter().copied().fold(tried[0], better).1)
}

/// How good a view is: visible front, size on the picture and open holes against what is dull.
fn score(direction: Vec3, positions: &[Vec3], faces: &[[u32; 3]]) -> f64 {
    let camera = Camera::looking_from(direction, positions, TRIAL as f64);
    let screen: Vec<Vec3> = (positions.iter())
        .map(|&p| sparse(camera.project(p)))
        .collect();
    let band = Band::of(TRIAL, 0..TRIAL, faces, &screen);
    let share = |n: usize| n as f64 / (TRIAL * TRIAL) as f64;
    let (mut front, mut back) = (0, 0);
    for &face in band.objects().iter().filter(|&&face| face != NOTHING) {
        match is_behind(&faces[face as usize].map(|v| screen[v as usize])) {
            true => back += 1,
            false => front += 1,
        }
    }
    let open = band.objects().iter().map(|&face| face == NOTHING);
    let holes = holes(open.collect());
    let hole_area: f64 = holes.iter().map(|&n| share(n)).sum();
    // A look along an axis is flat, and models face +z.
    let [x, _, z] = direction.map(f64::abs);
    let oblique = 1.0 - 5.0 * (x.max(z) / x.hypot(z) - 0.965).max(0.0);
    let elevation = 1.0 - 0.8 * (direction[1] - 0.36).abs();
    let shown = share(front) - 1.5 * share(back) + 0.06 * holes.len() as f64 + hole_area;
    shown * oblique * elevation + 0.02 * direction[2]
}

/// True where a triangle on the screen shows its back: rows run downwards, so the front has negative area.
pub fn is_behind([a, b, c]: &[Vec3; 3]) -> bool {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
}

/// Sizes of the regions of background that the surface encloses, specks left out.
fn holes(mut open: Vec<bool>) -> Vec<usize> {
    let mut sizes = Vec::new();
    for start in 0..open.len() {
        let (mut stack, mut size, mut enclosed) = (vec![start], 0, true);
        while let Some(at) = stack.pop() {
            if !std::mem::take(&mut open[at]) {
                continue;
            }
            size += 1;
            let (column, row) = (at % TRIAL, at / TRIAL);
            if column == 0 || row == 0 || column + 1 == TRIAL || row + 1 == TRIAL {
                enclosed = false;
            }
            let before = [1, TRIAL].map(|step| at.saturating_sub(step));
            let after = [1, TRIAL].map(|step| (at + step).min(open.len() - 1));
            stack.extend(before.into_iter().chain(after).filter(|&at| open[at]));
        }
        if enclosed && size >= 3 {
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
        square(8, 40).for_each(|at| open[at] = false);
        square(15, 25).for_each(|at| open[at] = true);
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
