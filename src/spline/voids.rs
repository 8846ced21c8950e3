//! Closed surfaces that bound cavities of others, and those that are inside out.
//!
//! *Enters:* closed surfaces as triangles. *Leaves:* of each that is turned inside out and lies inside another, which that is. *Source:* winding numbers as sums of solid angles, van Oosterom and Strackee, The solid angle of a plane triangle, 1983.

use crate::geometry::mesh::{bounding_box, cross, dot, norm, sub};
use std::f64::consts::PI;

/// A closed surface.
#[derive(Clone, Copy, Debug)]
pub struct Closed<'a> {
    /// Points.
    pub points: &'a [[f64; 3]],
    /// Triangles, counterclockwise seen from outside; from inside where it bounds a cavity.
    pub faces: &'a [[u32; 3]],
}

impl Closed<'_> {
    fn corners(&self, from: [f64; 3]) -> impl Iterator<Item = [[f64; 3]; 3]> {
        let at = move |v: u32| sub(self.points[v as usize], from);
        self.faces.iter().map(move |face| face.map(at))
    }

    /// Its volume, negative where it is inside out; cubed source units.
    pub fn volume(&self) -> f64 {
        let from = self.points.first().copied().unwrap_or_default();
        let six = self.corners(from).map(|[p, q, r]| dot(p, cross(q, r)));
        six.sum::<f64>() / 6.0
    }

    /// How often it goes around a point that is not on it.
    fn winding(&self, point: [f64; 3]) -> f64 {
        let angle = |[p, q, r]: [[f64; 3]; 3]| {
            let [a, b, c] = [p, q, r].map(norm);
            let below = a * b * c + dot(p, q) * c + dot(q, r) * a + dot(r, p) * b;
            2.0 * dot(p, cross(q, r)).atan2(below)
        };
        self.corners(point).map(angle).sum::<f64>() / (4.0 * PI)
    }

    fn contains(&self, other: &Self) -> bool {
        let Some(&point) = other.points.first() else {
            return false;
        };
        let (low, high) = bounding_box(self.points);
        let (from, to) = bounding_box(other.points);
        (0..3).all(|i| low[i] <= from[i] && to[i] <= high[i]) && self.winding(point).abs() > 0.5
    }
}

/// Of every surface which one it is a cavity of: the smallest that is not inside out and has it inside. `None` for those that are not closed.
pub fn voids(surfaces: &[Option<Closed<'_>>]) -> Vec<Option<usize>> {
    let volumes: Vec<f64> = surfaces
        .iter()
        .map(|s| s.map_or(0.0, |s| s.volume()))
        .collect();
    let around = |(void, &volume): (usize, &f64)| {
        let inner = surfaces[void].filter(|_| volume < 0.0)?;
        let outer = (0..surfaces.len()).filter(|&i| {
            volumes[i] > -volume && surfaces[i].is_some_and(|outer| outer.contains(&inner))
        });
        outer.min_by(|&a, &b| volumes[a].total_cmp(&volumes[b]))
    };
    volumes.iter().enumerate().map(around).collect()
}

/// Of every surface whether it is inside out: whether the largest that has it inside, or itself where none has, looks inward. `false` of those that are not closed.
pub fn inside_out(surfaces: &[Option<Closed<'_>>]) -> Vec<bool> {
    let volumes: Vec<f64> = surfaces
        .iter()
        .map(|s| s.map_or(0.0, |s| s.volume()))
        .collect();
    if volumes.iter().all(|&volume| volume >= 0.0) {
        return vec![false; surfaces.len()];
    }
    let outermost = |(own, surface): (usize, &Option<Closed<'_>>)| {
        let Some(inner) = surface else { return false };
        let outer = (0..surfaces.len()).filter(|&i| {
            volumes[i].abs() > volumes[own].abs()
                && surfaces[i].is_some_and(|outer| outer.contains(inner))
        });
        let largest = outer.max_by(|&a, &b| volumes[a].abs().total_cmp(&volumes[b].abs()));
        volumes[largest.unwrap_or(own)] < 0.0
    };
    surfaces.iter().enumerate().map(outermost).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::polycube::polycube;

    /// A cube of a side about a middle, turned inside out or not.
    fn cube(side: f64, middle: [f64; 3], is_void: bool) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
        let mesh = polycube([[0, 0, 0]], |_, _, _| true);
        let (low, high) = bounding_box(mesh.positions.as_slice());
        let place = |p: &[f64; 3]| {
            [0, 1, 2].map(|i| middle[i] + side * ((p[i] - low[i]) / (high[i] - low[i]) - 0.5))
        };
        let points = mesh.positions.iter().map(place).collect();
        let turned = |[a, b, c]: [u32; 3]| if is_void { [a, c, b] } else { [a, b, c] };
        (
            points,
            mesh.connectivity
                .to_faces()
                .into_iter()
                .map(turned)
                .collect(),
        )
    }

    #[test]
    fn cavities_belong_to_the_nearest_solid_around_them() {
        let far = [1e6, -2e5, 3.0];
        let beside = [far[0] + 20.0, far[1], far[2]];
        let parts = [
            cube(6.0, far, false),
            cube(4.0, far, true),
            // A solid in the cavity, with one of its own.
            cube(2.0, far, false),
            cube(1.0, far, true),
            // Inside out with nothing around it, and inside another but no cavity.
            cube(1.0, beside, true),
            cube(0.5, [far[0] + 2.5, far[1], far[2]], false),
            cube(0.25, [far[0] - 2.5, far[1] + 2.5, far[2]], true),
        ];
        let surfaces: Vec<Option<Closed>> = parts
            .iter()
            .map(|(points, faces)| Some(Closed { points, faces }))
            .collect();
        for (surface, (side, sign)) in
            surfaces
                .iter()
                .zip([(6.0, 1.0), (4.0, -1.0), (2.0, 1.0), (1.0, -1.0)])
        {
            let expected: f64 = sign * side * side * side;
            assert!((surface.unwrap().volume() - expected).abs() < 1e-8);
        }
        let expected = vec![None, Some(0), None, Some(2), None, None, Some(0)];
        assert_eq!(voids(&surfaces), expected);
        let is_beside = |i: usize| i == 4;
        let expected: Vec<bool> = (0..7).map(is_beside).collect();
        assert_eq!(inside_out(&surfaces), expected);
        // Turned over with all that is in it.
        let turned: Vec<_> = parts
            .iter()
            .map(|(points, faces)| {
                let faces: Vec<[u32; 3]> = faces.iter().map(|&[a, b, c]| [a, c, b]).collect();
                (points, faces)
            })
            .collect();
        let turned: Vec<Option<Closed>> = turned
            .iter()
            .map(|(points, faces)| Some(Closed { points, faces }))
            .collect();
        let expected: Vec<bool> = (0..7).map(|i| !is_beside(i)).collect();
        assert_eq!(inside_out(&turned), expected);
        let mut open = surfaces;
        open[0] = None;
        assert_eq!(voids(&open), [None, None, None, Some(2), None, None, None]);
    }
}
