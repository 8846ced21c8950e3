//! The smallest rectangle around a patch, and patch coordinates: the rectangle's longer side is the
//! interval [0, 1] of u, its lower left corner the origin.
//!
//! The direction of the smallest rectangle is one of the convex hull's edges, but where two
//! directions are as good as each other the last digits must not decide. So only hull edges long enough
//! to have a direction are candidates, beside a fan of fixed ones, and equal areas go to the smallest angle.

use super::placement::{Placement, place};
use super::slit::Slit;
use crate::atlas::plane::{Similarity, rotate, rotation, wrap_angle};
use crate::geometry::ids::FaceId;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Central coordinates with a larger error in a face's lengths than this, relative to its longest
/// side, are compared with the patch's own development and give way if that is better.
const GOOD_LENGTHS: f64 = 1e-11;

/// By this part of itself a side must be longer than another to be the longer one.
const TIE: f64 = 1e-6;

/// A patch in its own coordinates.
pub(super) struct Oriented {
    /// Corners of the faces, in the order of the faces given.
    pub uv: Vec<[[f64; 2]; 3]>,
    /// Height of the rectangle; its width is 1.
    pub height: f64,
    /// Area in patch coordinates.
    pub area: f64,
    /// To central coordinates.
    pub to_chart: Similarity,
}

/// Coordinates of a patch, which is what `member` accepts; `own` is scratch space, a place a copy.
pub(super) fn orient(
    slit: &Slit,
    faces: &[FaceId],
    member: impl Fn(FaceId) -> bool,
    own: &mut [[f64; 2]],
) -> Oriented {
    let highest = faces.iter().map(|&f| slit.log_scale[f]);
    let highest = highest.fold(f64::NEG_INFINITY, f64::max);
    // The largest face of all is the best conditioned one to start from.
    let area_bits = |f: FaceId| slit.flat_area[f].to_bits();
    let root = faces
        .iter()
        .copied()
        .max_by_key(|&f| (area_bits(f), std::cmp::Reverse(f)))
        .unwrap_or(FaceId::new(0));
    let placement = place(slit, faces.iter().copied(), root, highest, &member, own);
    let mut frame = Frame::new(slit, faces, &placement, slit.is_deep(highest));
    if !frame.own {
        let error = slit.length_error(faces, placement.positions);
        if error > GOOD_LENGTHS {
            slit.develop(root, member, own);
            if slit.length_error(faces, own) < 0.1 * error {
                let placement = Placement::new(slit, own, faces.iter().copied());
                frame = Frame::new(slit, faces, &placement, true);
                // Both ways give one orientation.
                frame.turn_like_chart(slit, faces);
            }
        }
    }
    frame.orient(slit, faces)
}

struct Frame {
    corners: Vec<[[f64; 2]; 3]>,
    own: bool,
}

impl Frame {
    fn new(slit: &Slit, faces: &[FaceId], placement: &Placement, own: bool) -> Frame {
        let corners = faces.iter().map(|&f| placement.triangle(slit, f)).collect();
        Frame { corners, own }
    }

    /// Turns own coordinates so that their axes are those of the central chart.
    fn turn_like_chart(&mut self, slit: &Slit, faces: &[FaceId]) {
        let turned = rotation(fit(slit, faces, &self.corners, 1.0).rotation);
        for p in self.corners.iter_mut().flatten() {
            *p = turned(*p);
        }
    }

    fn orient(self, slit: &Slit, faces: &[FaceId]) -> Oriented {
        let flat: f64 = faces.iter().map(|&f| slit.flat_area[f]).sum();
        let mut oriented = in_rectangle(&self.corners, flat);
        if self.own {
            let scale = oriented.to_chart.scale;
            oriented.to_chart = fit(slit, faces, &oriented.uv, scale);
        }
        oriented
    }
}

/// Triangles of a given total area in the coordinates of their smallest rectangle; `to_chart` leads back.
pub(super) fn in_rectangle(corners: &[[[f64; 2]; 3]], area: f64) -> Oriented {
    let Smallest {
        angle,
        low,
        width,
        height,
    } = smallest(corners);
    let turned = rotation(-angle);
    let to_patch = |p: [f64; 2]| {
        let q = turned(p);
        [(q[0] - low[0]) / width, (q[1] - low[1]) / width]
    };
    Oriented {
        uv: corners.iter().map(|t| t.map(to_patch)).collect(),
        height,
        area: area / (width * width),
        to_chart: Similarity {
            scale: width,
            rotation: wrap_angle(angle),
            translation: rotate(low, angle),
        },
    }
}

/// The smallest rectangle around triangles.
pub(super) struct Smallest {
    /// Of its longer side.
    pub angle: f64,
    /// Its lower left corner, turned by minus that.
    pub low: [f64; 2],
    /// Its longer side.
    pub width: f64,
    /// Its shorter side, as part of the longer one.
    pub height: f64,
}

/// The smallest rectangle around triangles. Those on a patch's border have the same as all.
pub(super) fn smallest(corners: &[[[f64; 2]; 3]]) -> Smallest {
    let points = || corners.iter().flatten().copied();
    let angle = best_angle(&convex_hull(outer(points)));
    let (low, high) = extents(points().map(rotation(-angle)));
    let width = high[0] - low[0];
    // A patch without any extent keeps its coordinates.
    let width = if width > 0.0 { width } else { 1.0 };
    Smallest {
        angle,
        low,
        width,
        height: (high[1] - low[1]) / width,
    }
}

/// The similarity of known scale that takes patch coordinates nearest to the central ones, where a
/// patch is smaller than the central chart resolves, its rotation means nothing and its translation is right.
fn fit(slit: &Slit, faces: &[FaceId], uv: &[[[f64; 2]; 3]], scale: f64) -> Similarity {
    let central = |f: FaceId, k: usize| slit.development.uv[f][k];
    let pairs = || {
        let rows = faces.iter().zip(uv);
        rows.flat_map(|(&f, t)| (0..3).map(move |k| (t[k], central(f, k))))
    };
    let n = (3 * faces.len()).max(1) as f64;
    let (mut from, mut to) = ([0.0; 2], [0.0; 2]);
    let origin = faces.first().map_or([0.0; 2], |&f| central(f, 0));
    for (p, q) in pairs() {
        for i in 0..2 {
            from[i] += p[i] / n;
            // Relative to one corner, so that the sum loses nothing.
            to[i] += (q[i] - origin[i]) / n;
        }
    }
    let (mut dot, mut cross) = (0.0, 0.0);
    for (p, q) in pairs() {
        let p = [p[0] - from[0], p[1] - from[1]];
        let q = [q[0] - origin[0] - to[0], q[1] - origin[1] - to[1]];
        dot += p[0] * q[0] + p[1] * q[1];
        cross += p[0] * q[1] - p[1] * q[0];
    }
    let rotation = match (dot, cross) {
        (0.0, 0.0) => 0.0,
        _ => wrap_angle(cross.atan2(dot)),
    };
    let turned = rotate(from, rotation);
    Similarity {
        scale,
        rotation,
        translation: std::array::from_fn(|i| origin[i] + (to[i] - scale * turned[i])),
    }
}

fn extents(points: impl Iterator<Item = [f64; 2]>) -> ([f64; 2], [f64; 2]) {
    let start = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    points.fold(start, |(low, high), p| {
        (
            std::array::from_fn(|i| low[i].min(p[i])),
            std::array::from_fn(|i| high[i].max(p[i])),
        )
    })
}

/// The points that may be corners of the convex hull: what lies well inside the octagon of those farthest out is left out, which
/// is nearly all of a patch.
fn outer<P: Iterator<Item = [f64; 2]>>(points: impl Fn() -> P) -> Vec<[f64; 2]> {
    const DIRECTIONS: usize = 8;
    /// Rounding is far less than this part of the distance between two points.
    const WELL: f64 = 1e-9;
    let along: [[f64; 2]; DIRECTIONS] = std::array::from_fn(|i| {
        let (s, c) = (TAU * i as f64 / DIRECTIONS as f64).sin_cos();
        [c, s]
    });
    let mut farthest = [(f64::NEG_INFINITY, [0.0; 2]); DIRECTIONS];
    for p in points() {
        for (d, best) in along.iter().zip(&mut farthest) {
            let reach = d[0] * p[0] + d[1] * p[1];
            if reach > best.0 {
                *best = (reach, p);
            }
        }
    }
    // Left of each side of the octagon by more than rounding could be wrong.
    let sides: [([f64; 2], [f64; 2]); DIRECTIONS] = std::array::from_fn(|i| {
        let (p, q) = (farthest[i].1, farthest[(i + 1) % DIRECTIONS].1);
        (p, [q[0] - p[0], q[1] - p[1]])
    });
    let sides: Vec<_> = sides.into_iter().filter(|s| s.1 != [0.0; 2]).collect();
    let size = farthest.iter().fold(0.0, |m: f64, f| m.max(f.0.abs()));
    let is_inside = |p: &[f64; 2]| {
        !sides.is_empty()
            && sides.iter().all(|(from, d)| {
                let turn = d[0] * (p[1] - from[1]) - d[1] * (p[0] - from[0]);
                turn > WELL * size * (d[0].abs() + d[1].abs())
            })
    };
    points().filter(|p| !is_inside(p)).collect()
}

/// Corners of the convex hull, counterclockwise (Andrew's monotone chain with an exact predicate).
fn convex_hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    let coord = |p: [f64; 2]| robust::Coord { x: p[0], y: p[1] };
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut hull: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while let [.., a, b] = hull[..] {
                if robust::orient2d(coord(a), coord(b), coord(p)) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(p);
        }
        hull
    };
    let mut hull = chain(&mut points.iter().copied());
    let back = chain(&mut points.iter().rev().copied());
    hull.pop();
    hull.extend(back);
    if hull.len() > 1 {
        hull.pop();
    }
    hull
}

/// The angle of the longer side of the smallest rectangle, in [−1e-6, π − 1e-6).
fn best_angle(hull: &[[f64; 2]]) -> f64 {
    const FAN: usize = 90;
    let edges: Vec<[f64; 2]> = (0..hull.len())
        .map(|i| {
            let (p, q) = (hull[i], hull[(i + 1) % hull.len()]);
            [q[0] - p[0], q[1] - p[1]]
        })
        .collect();
    let perimeter: f64 = edges.iter().map(|e| e[0].hypot(e[1])).sum();
    let long = edges.iter().filter(|e| e[0].hypot(e[1]) > 0.02 * perimeter);
    let mut candidates: Vec<f64> = long.map(|e| e[1].atan2(e[0])).collect();
    candidates.extend((0..FAN).map(|i| FRAC_PI_2 * i as f64 / FAN as f64));
    candidates.extend(longest_diagonal(hull).map(|d| d[1].atan2(d[0])));
    let rank = |angle: f64| {
        // Modulo a quarter turn, and the same just below it as just above.
        let angle = (angle + 1e-6).rem_euclid(FRAC_PI_2) - 1e-6;
        let (low, high) = extents(hull.iter().copied().map(rotation(-angle)));
        let (w, h) = (high[0] - low[0], high[1] - low[1]);
        let area = w * h / (perimeter * perimeter).max(f64::MIN_POSITIVE);
        let angle = if h > w * (1.0 + TIE) {
            angle + FRAC_PI_2
        } else {
            angle
        };
        // Thin patches: the area alone would not tell 1e-6 apart from 0.
        let score = ((area + 1e-12).ln() * 1e6).round() as i64;
        ((score, (angle * 1e5).round() as i64), angle)
    };
    candidates
        .into_iter()
        .map(rank)
        .min_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)))
        .map_or(0.0, |best| best.1.clamp(-TAU, TAU))
}

/// From one end of a longest diagonal to the other: antipodal pairs by rotating calipers.
fn longest_diagonal(hull: &[[f64; 2]]) -> Option<[f64; 2]> {
    let n = hull.len();
    if n < 2 {
        return None;
    }
    let doubled =
        |a: [f64; 2], b: [f64; 2], c: [f64; 2]| crate::atlas::plane::doubled_area([a, b, c]).abs();
    let mut best: (f64, [f64; 2]) = (-1.0, [0.0; 2]);
    let mut j = 1;
    for i in 0..n {
        let next = hull[(i + 1) % n];
        let mut steps = 0;
        while steps < n
            && doubled(hull[i], next, hull[(j + 1) % n]) > doubled(hull[i], next, hull[j])
        {
            j = (j + 1) % n;
            steps += 1;
        }
        for p in [hull[i], next] {
            let d = [hull[j][0] - p[0], hull[j][1] - p[1]];
            let length = d[0].hypot(d[1]);
            if length > best.0 * (1.0 + 1e-9) {
                best = (length, d);
            }
        }
    }
    Some(best.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hull_of_a_grid_is_its_square() {
        let points = (0..25).map(|i| [f64::from(i % 5), f64::from(i / 5)]);
        let hull = convex_hull(points.collect());
        assert_eq!(hull, [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]]);
        assert_eq!(convex_hull(vec![[1.0, 2.0]; 3]), [[1.0, 2.0]]);
    }

    fn turned_box(width: f64, height: f64, angle: f64) -> Vec<[f64; 2]> {
        let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]];
        corners.map(|p| rotate(p, angle)).to_vec()
    }

    #[test]
    fn the_box_of_a_turned_box_is_itself() {
        for (width, height, angle) in [
            (3.0, 1.0, 0.3),
            (2.0, 1.0, -0.9),
            (50.0, 0.01, 1.1),
            (1.0, 4.0, 0.2),
        ] {
            let best = best_angle(&turned_box(width, height, angle));
            let (low, high) = extents(
                turned_box(width, height, angle)
                    .into_iter()
                    .map(|p| rotate(p, -best)),
            );
            let (long, short) = (width.max(height), width.min(height));
            assert!((high[0] - low[0] - long).abs() < 1e-9 * long);
            assert!((high[1] - low[1] - short).abs() < 1e-9 * long);
        }
    }

    #[test]
    fn what_is_left_out_inside_does_not_change_the_hull() {
        let mut state = 77u64;
        let mut random = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        for [width, height] in [[1.0, 1.0], [1.0, 1e-3], [1e-40, 2e-40], [1.0, 0.0]] {
            // Far from the origin too, where rounding is largest.
            for offset in [0.0, 100.0] {
                let offset = offset * width;
                let points: Vec<[f64; 2]> = (0..2000)
                    .map(|_| [width * random() + offset, height * random() - offset])
                    .collect();
                let few = outer(|| points.iter().copied());
                assert!(height == 0.0 || few.len() < 1500);
                assert_eq!(convex_hull(few), convex_hull(points.clone()));
            }
        }
    }

    #[test]
    fn last_digits_do_not_turn_the_box() {
        // A square whose sides carry many nearly collinear points, at an angle where a tie is likeliest.
        let wobble = |seed: u64| {
            let mut state = seed;
            let points = (0..200).map(|i| {
                let s = f64::from(i % 50) / 50.0;
                let p = [[s, 0.0], [1.0, s], [1.0 - s, 1.0], [0.0, 1.0 - s]][i as usize / 50];
                p.map(|x| {
                    state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
                    x + 1e-11 * ((state >> 33) as f64 / (1u64 << 31) as f64 - 0.5)
                })
            });
            best_angle(&convex_hull(points.collect()))
        };
        let first = wobble(1);
        for seed in 2..20 {
            assert!((wobble(seed) - first).abs() < 1e-9);
        }
    }

    #[test]
    fn diagonal_agrees_with_brute_force() {
        let points = (0..40).map(|i| {
            let a = f64::from(i) * 0.7;
            [3.0 * a.cos() + 0.2 * (5.0 * a).sin(), a.sin()]
        });
        let hull = convex_hull(points.collect());
        let d = longest_diagonal(&hull).unwrap();
        let brute = hull
            .iter()
            .flat_map(|p| hull.iter().map(|q| (p[0] - q[0]).hypot(p[1] - q[1])))
            .fold(0.0, f64::max);
        assert!((d[0].hypot(d[1]) - brute).abs() < 1e-12);
    }
}
