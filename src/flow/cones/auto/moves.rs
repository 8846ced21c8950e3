//! Cones moved until the area distortion (9) is least.
//!
//! *Enters:* cones that keep the variance of the log scale low. *Leaves:* cones whose (9), in the linear picture, no move that is tried
//! lowers.
//!
//! (9) is no quadratic function, so gains are not known for every vertex at once. Two searches in turn:
//!
//! * far: on cells of the surface, each cone is tried at each of some tens of landmarks, with the best curvatures of all cones at each
//!   trial. A trial costs sums over cells and no solve.
//! * near: the derivative of (9) by curvature, p = Δ⁻¹ ∂(9)/∂u, is one back-substitution for all vertices. By symmetry of the answers a cone
//!   of curvature c at x feels the force −c ∇p(x), so it is tried at the vertex of a ring around x where c p is least; the ring shrinks
//!   when that does not help. This moves cones as Li et al. 2023 do, with sets of candidates in place of a line search.

use super::Found;
use super::area::Points;
use super::placement::Placement;
use super::quadratic::Limits;
use crate::flow::cones::spread;
use crate::geometry::ids::VertexId;
use crate::geometry::mesh::Mesh;
use rayon::prelude::*;

/// Places tried for every cone in the far search.
const LANDMARKS: usize = 32;
/// Gain of ln(F + 1), relative to itself, that a far move must promise …
const FAR_GAIN: f64 = 1e-2;
/// … and that a near move must have.
const NEAR_GAIN: f64 = 1e-4;
/// Rounds of far and near moves.
const ROUNDS: usize = 3;
/// Passes over all cones and landmarks in a far search.
const FAR_PASSES: usize = 2;
/// Far moves tried in full a cone, those first that promise most after one step of their curvatures.
const TRIALS: usize = 3;
/// Newton steps for the curvatures at most.
const STEPS: usize = 12;
/// The same for a near move, after which curvatures change little.
const NEAR_STEPS: usize = 1;
/// First radius of the rings, in square roots of the area.
const FIRST_RADIUS: f64 = 0.15;
/// The same where cones are all but placed.
const LAST_RADIUS: f64 = 0.02;

/// What may become of the curvatures while cones move.
#[derive(Clone, Copy)]
pub(super) enum Rule {
    /// The best within limits.
    Best(Limits),
    /// They stay.
    Fixed,
}

/// A cone, and the log scale that a unit of curvature causes there.
#[derive(Clone)]
pub(super) struct Place {
    pub(super) vertex: usize,
    answer: Vec<f64>,
}

/// Cones and their area distortion.
#[derive(Clone)]
pub(super) struct Arrangement {
    pub(super) places: Vec<Place>,
    /// Radians.
    pub(super) curvature: Vec<f64>,
    /// ln (F + 1).
    pub(super) value: f64,
}

impl Arrangement {
    pub(super) fn found(self) -> Found {
        Found {
            vertices: self.vertices(),
            curvature: self.curvature,
            cost: self.value,
            distortion: 0.0,
        }
    }

    pub(super) fn vertices(&self) -> Vec<usize> {
        self.places.iter().map(|p| p.vertex).collect()
    }

    pub(super) fn answers(&self) -> Vec<&[f64]> {
        self.places.iter().map(|p| p.answer.as_slice()).collect()
    }
}

impl Rule {
    fn apply(
        self,
        points: Points,
        answers: &[&[f64]],
        curvature: &[f64],
        steps: usize,
    ) -> (Vec<f64>, f64) {
        match self {
            Rule::Best(limits) => points.curvatures(answers, curvature, limits, steps),
            Rule::Fixed => (curvature.to_vec(), points.value(answers, curvature)),
        }
    }
}

/// Moves the cones at `vertices`; `curvature` is where their curvatures start.
pub(super) fn lower_distortion(
    placement: &mut Placement,
    mesh: &Mesh,
    vertices: &[usize],
    curvature: &[f64],
    rule: Rule,
) -> Arrangement {
    let places = placement.places(vertices);
    let mut now = arrange(placement, places, curvature, rule, STEPS);
    if vertices.is_empty() {
        return now;
    }
    let cells = Cells::new(placement, mesh);
    let mut landmarks: Vec<usize> = spread::spread(mesh, LANDMARKS)
        .iter()
        .map(|v| v.index())
        .filter(|&v| placement.allowed[v])
        .collect();
    landmarks.extend(vertices);
    let mut at_landmarks: Vec<Vec<f64>> = Vec::new();
    for some in landmarks.chunks(16) {
        let places = placement.places(some);
        at_landmarks.extend(places.iter().map(|p| cells.means(&p.answer)));
    }
    let base = cells.means(&placement.base);
    let coarse = Points {
        weight: &cells.weight,
        base: &base,
    };
    for _ in 0..ROUNDS {
        now = near(placement, mesh, now, rule, FIRST_RADIUS);
        let Some(moved) = far(&cells, coarse, &landmarks, &at_landmarks, &now, rule) else {
            break;
        };
        let mut places = now.places.clone();
        for (place, (vertex, _)) in places.iter_mut().zip(&moved) {
            if place.vertex != *vertex {
                *place = placement.place(*vertex);
            }
        }
        let start: Vec<f64> = moved.iter().map(|(_, c)| *c).collect();
        let next = arrange(placement, places, &start, rule, STEPS);
        let next = near(placement, mesh, next, rule, FIRST_RADIUS);
        if next.value > now.value * (1.0 - FAR_GAIN) {
            if next.value < now.value {
                now = next;
            }
            break;
        }
        now = next;
    }
    now
}

/// The best curvatures at these places and near them, after u without cones has changed.
pub(super) fn settle(
    placement: &mut Placement,
    mesh: &Mesh,
    vertices: &[usize],
    curvature: &[f64],
    rule: Rule,
) -> Arrangement {
    let places = placement.places(vertices);
    let now = arrange(placement, places, curvature, rule, STEPS);
    near(placement, mesh, now, rule, LAST_RADIUS)
}

fn arrange(
    placement: &Placement,
    places: Vec<Place>,
    curvature: &[f64],
    rule: Rule,
    steps: usize,
) -> Arrangement {
    let answers: Vec<&[f64]> = places.iter().map(|p| p.answer.as_slice()).collect();
    let (curvature, value) = rule.apply(placement.points(), &answers, curvature, steps);
    Arrangement {
        places,
        curvature,
        value,
    }
}

impl Placement<'_> {
    /// The surface with u without cones.
    pub(super) fn points(&self) -> Points<'_> {
        self.at(&self.base)
    }

    /// The surface with any u.
    pub(super) fn at<'u>(&'u self, u: &'u [f64]) -> Points<'u> {
        Points {
            weight: &self.picture.weight,
            base: u,
        }
    }

    fn place(&mut self, vertex: usize) -> Place {
        Place {
            vertex,
            answer: self.responses(&[vertex]),
        }
    }

    fn places(&mut self, vertices: &[usize]) -> Vec<Place> {
        let answers = self.responses(vertices);
        let answers = answers.chunks(self.base.len().max(1)).map(<[f64]>::to_vec);
        let places = vertices.iter().zip(answers);
        places
            .map(|(&vertex, answer)| Place { vertex, answer })
            .collect()
    }
}

/// Best exchanges of cones for landmarks, one after another, as the cells see them: vertex and curvature of every cone. `None` where
/// there is none.
fn far(
    cells: &Cells,
    points: Points,
    landmarks: &[usize],
    at_landmarks: &[Vec<f64>],
    now: &Arrangement,
    rule: Rule,
) -> Option<Vec<(usize, f64)>> {
    let mut vertices = now.vertices();
    let mut answers: Vec<Vec<f64>> = now.places.iter().map(|p| cells.means(&p.answer)).collect();
    let (mut curvature, mut best) = rule.apply(points, &views(&answers), &now.curvature, STEPS);
    let mut moved = false;
    for _ in 0..FAR_PASSES {
        let trials = (0..vertices.len()).flat_map(|i| (0..landmarks.len()).map(move |m| (i, m)));
        let trials: Vec<(usize, usize)> = trials
            .filter(|&(_, m)| !vertices.contains(&landmarks[m]))
            .collect();
        let mut tried: Vec<(f64, usize, usize)> = trials
            .par_iter()
            .map(|&(i, m)| {
                let mut with = views(&answers);
                with[i] = &at_landmarks[m];
                (rule.apply(points, &with, &curvature, 1).1, i, m)
            })
            .collect();
        // Stable: of equals the first.
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut moved_now = vec![false; vertices.len()];
        for &(_, i, m) in tried.iter().take(TRIALS * vertices.len()) {
            if moved_now[i] || vertices.contains(&landmarks[m]) {
                continue;
            }
            let mut with = views(&answers);
            with[i] = &at_landmarks[m];
            let (c, reached) = rule.apply(points, &with, &curvature, STEPS);
            if reached < best * (1.0 - FAR_GAIN) {
                vertices[i] = landmarks[m];
                answers[i].clone_from(&at_landmarks[m]);
                (best, curvature) = (reached, c);
                (moved, moved_now[i]) = (true, true);
            }
        }
        if !moved_now.contains(&true) {
            break;
        }
    }
    moved.then(|| vertices.into_iter().zip(curvature).collect())
}

fn views(answers: &[Vec<f64>]) -> Vec<&[f64]> {
    answers.iter().map(Vec::as_slice).collect()
}

/// Moves along the force, in rings that shrink down to the neighbours.
fn near(
    placement: &mut Placement,
    mesh: &Mesh,
    mut now: Arrangement,
    rule: Rule,
    first_radius: f64,
) -> Arrangement {
    let area = super::picture::total_area(mesh);
    let mut radius = vec![first_radius * area.sqrt(); now.places.len()];
    loop {
        let answers = now.answers();
        let mut force = placement.points().derivative(&answers, &now.curvature);
        placement.dual(&mut force);
        let mut candidates = Vec::new();
        for (i, place) in now.places.iter().enumerate() {
            // At zero only the neighbours are left, and then nothing.
            if radius[i] < 0.0 {
                continue;
            }
            let around = spread::around(mesh, VertexId::new(place.vertex), radius[i]);
            if around.iter().all(|(_, d)| *d <= 0.5 * radius[i]) {
                radius[i] = -1.0;
            }
            let c = now.curvature[i];
            let taken = |v: usize| now.places.iter().any(|p| p.vertex == v);
            let best = around
                .iter()
                .filter(|(_, d)| *d > 0.5 * radius[i])
                .map(|(v, _)| v.index())
                .filter(|&v| placement.allowed[v] && !taken(v))
                .reduce(|v, w| if c * force[w] < c * force[v] { w } else { v });
            match best {
                Some(v) => candidates.push((i, v)),
                None => radius[i] *= 0.5,
            }
        }
        if radius.iter().all(|r| *r < 0.0) {
            let places = now.places;
            return arrange(placement, places, &now.curvature, rule, STEPS);
        }
        if candidates.is_empty() {
            continue;
        }
        let vertices: Vec<usize> = candidates.iter().map(|(_, v)| *v).collect();
        for ((i, _), place) in candidates.into_iter().zip(placement.places(&vertices)) {
            let mut places = now.places.clone();
            places[i] = place;
            let next = arrange(placement, places, &now.curvature, rule, NEAR_STEPS);
            if next.value < now.value * (1.0 - NEAR_GAIN) {
                now = next;
            } else {
                radius[i] *= 0.5;
            }
        }
    }
}

/// The surface in cells around the samples.
struct Cells {
    /// Cell of every vertex.
    cell: Vec<u32>,
    /// Area of every vertex and of every cell, all together 1.
    vertex_weight: Vec<f64>,
    weight: Vec<f64>,
}

impl Cells {
    fn new(placement: &Placement, mesh: &Mesh) -> Self {
        let cell = spread::nearest_of(&mesh.connectivity, &placement.samples);
        let mut weight = vec![0.0; placement.samples.len()];
        for (&c, w) in cell.iter().zip(&placement.picture.weight) {
            weight[c as usize] += w;
        }
        Self {
            cell,
            vertex_weight: placement.picture.weight.clone(),
            weight,
        }
    }

    fn means(&self, field: &[f64]) -> Vec<f64> {
        let mut means = vec![0.0; self.weight.len()];
        for ((&c, w), x) in self.cell.iter().zip(&self.vertex_weight).zip(field) {
            means[c as usize] += w * x;
        }
        for (m, w) in means.iter_mut().zip(&self.weight) {
            *m = if *w > 0.0 { *m / w } else { 0.0 };
        }
        means
    }
}
