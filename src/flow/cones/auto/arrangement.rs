//! Cones at places, and their area distortion (9).
//!
//! *Enters:* vertices. *Leaves:* the log scale that each of them causes, the best curvatures, and (9) in the linear picture.

use super::area::{Points, Weighed};
use super::found::Found;
use super::placement::Placement;
use super::quadratic::Limits;
use std::sync::Arc;

/// Newton steps for the curvatures at most.
pub(super) const STEPS: usize = 12;

/// What may become of the curvatures while cones move.
#[derive(Clone, Copy)]
pub(super) enum Rule {
    /// The best within limits.
    Best(Limits),
    /// They stay.
    Fixed,
}

impl Rule {
    pub(super) fn apply(
        self,
        points: Points,
        answers: &[&[f64]],
        curvature: &[f64],
        steps: usize,
    ) -> Weighed {
        match self {
            Rule::Best(limits) => points.best(answers, curvature, limits, steps),
            Rule::Fixed => points.fixed(answers, curvature),
        }
    }

    pub(super) fn limits(self) -> Option<Limits> {
        match self {
            Rule::Best(limits) => Some(limits),
            Rule::Fixed => None,
        }
    }
}

/// A cone, and the log scale that a unit of curvature causes there.
#[derive(Clone)]
pub(super) struct Place {
    pub(super) vertex: usize,
    pub(super) answer: Arc<[f64]>,
}

/// Cones and their area distortion.
#[derive(Clone)]
pub(super) struct Arrangement {
    pub(super) places: Vec<Place>,
    pub(super) weighed: Weighed,
}

impl Arrangement {
    pub(super) fn found(self) -> Found {
        Found {
            vertices: self.vertices(),
            cost: self.value(),
            curvature: self.weighed.curvature,
            distortion: 0.0,
        }
    }

    /// ln (F + 1).
    pub(super) fn value(&self) -> f64 {
        self.weighed.value
    }

    /// Radians.
    pub(super) fn curvature(&self) -> &[f64] {
        &self.weighed.curvature
    }

    pub(super) fn vertices(&self) -> Vec<usize> {
        self.places.iter().map(|p| p.vertex).collect()
    }

    pub(super) fn answers(&self) -> Vec<&[f64]> {
        answers(&self.places)
    }
}

/// The answers of some places.
pub(super) fn answers(places: &[Place]) -> Vec<&[f64]> {
    places.iter().map(|p| &*p.answer).collect()
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

    pub(super) fn places(&mut self, vertices: &[usize]) -> Vec<Place> {
        let n = self.len().max(1);
        let fields = self.responses(vertices);
        let places = vertices.iter().zip(fields.chunks(n));
        places
            .map(|(&vertex, answer)| Place {
                vertex,
                answer: Arc::from(answer),
            })
            .collect()
    }

    /// Cones at these vertices, with curvatures from where Newton's method leads.
    pub(super) fn arrangement(
        &mut self,
        vertices: &[usize],
        curvature: &[f64],
        rule: Rule,
    ) -> Arrangement {
        let places = self.places(vertices);
        self.arrange(places, curvature, rule, STEPS)
    }

    /// Cones at these places, after at most `steps` of Newton's method for the curvatures.
    pub(super) fn arrange(
        &self,
        places: Vec<Place>,
        curvature: &[f64],
        rule: Rule,
        steps: usize,
    ) -> Arrangement {
        let weighed = rule.apply(self.points(), &answers(&places), curvature, steps);
        Arrangement { places, weighed }
    }

    /// What (9) gains by curvature at every vertex, for all vertices at once: ∂ ln(F + 1) / ∂K.
    pub(super) fn force(&mut self, now: &Arrangement) -> Vec<f64> {
        let mut force = self.points().derivative(&now.weighed);
        self.dual(&mut force);
        force
    }
}
