//! Cones chosen by the program (tutorial 5.2, Problem 21: number, positions and curvatures of the singularities with least distortion).
//!
//! *Enters:* a mesh, what happens on its boundary, how many cones there may be. *Leaves:* vertices and curvatures that meet Gauss–Bonnet.
//!
//! | step | follows | ours |
//! | --- | --- | --- |
//! | log scale as a linear function of curvature, one factorisation ([`picture`]) | Ben-Chen, Gotsman, Bunin 2008 | variance of every answer at once, from the diagonal of an inverse |
//! | few cones with little variance of the log scale ([`placement`], [`search`]) | the aim of Soliman, Slepčev, Crane 2018 and Fang et al. 2021 | exact gain of every vertex without a solve; exchange |
//! | multiples of a quantum ([`quantum`]) | the aim of Li et al. 2022 | local search on a quadratic function of integers |
//! | what the mesh really does ([`Placement::correct`]) | | some Newton steps of the flow |
//! | cones moved until (9) is least ([`area`], [`near`], [`far`], [`moves`]) | moving cones: Li et al. 2023 | the force on every vertex at once; far moves on cells |
//!
//! The two objectives differ. The standard deviation of the log scale counts shrinking and growing alike. (9) is ruled by what grows: an ear
//! that shrinks to nothing costs it no more than the ear's area, so with few cones its optimum may be a surface that lost its ears.
//!
//! *Guaranteed:* the same choice for the same surface, moved, scaled or numbered otherwise, unless places tie; never more cones than asked
//! for; with a quantum every curvature a multiple of it. *Not guaranteed:* the global optimum. With `count` cones, those that do not pay are left
//! out.

mod area;
mod arrangement;
mod cells;
mod climb;
mod dot;
mod far;
mod found;
mod moves;
mod near;
mod picture;
mod placement;
mod quadratic;
mod quantum;
mod search;

use super::error::ConeError;
use super::params::{BoundaryParams, ConeObjective, ConeParams, DEFAULT_COUNT};
use super::request::{RequestedCone, Requests};
use super::{boundary, spread};
use crate::flow::prescription::BoundaryCondition;
use crate::geometry::connectivity::Topology;
use crate::geometry::ids::{VertexId, VertexVec};
use crate::geometry::mesh::Mesh;
use arrangement::Rule;
use found::{Found, cheapest};
use moves::FINE;
use picture::Picture;
use placement::{Choice, Placement};
use quadratic::Limits;
use quantum::Quanta;
use std::f64::consts::TAU;

/// Share of the real cost by which the linear picture may be wrong before it is corrected.
const AS_PROMISED: f64 = 0.02;
/// Curvatures in excess of a limit that are rounding, radians.
const ROUNDING: f64 = 1e-9;

/// The cones of one component.
pub(super) fn select(
    mesh: &Mesh,
    topology: &Topology,
    requests: &Requests,
    condition: BoundaryCondition,
    cones: &ConeParams,
    boundary: &BoundaryParams,
) -> Result<Vec<RequestedCone>, ConeError> {
    let given = given(mesh, topology, requests, condition, boundary)?;
    let limits = Limits {
        range: [cones.min_curvature.radians(), cones.max_curvature.radians()],
        total: given.total,
    };
    let allowed = allowed(mesh, cones.boundary_distance);
    let places = allowed.iter().filter(|&&a| a).count();
    let least = least_count(limits);
    let wanted = match (cones.count, condition) {
        (Some(count), _) => count,
        (None, BoundaryCondition::Free) => DEFAULT_COUNT.max(least),
        // Whoever asks for a rectangle wants one.
        (None, _) => least,
    };
    let most = wanted.min(places);
    if most < least {
        return Err(match places < least {
            true => ConeError::TooFewVertices {
                wanted: least,
                interior: places,
            },
            false => ConeError::TooFewCones {
                count: wanted,
                least,
                total: given.total.unwrap_or(0.0),
            },
        });
    }
    let quanta = match cones.quantum.radians() {
        size if size > 0.0 => Some(quanta(size, limits)?),
        _ => None,
    };
    if most == 0 {
        return Ok(Vec::new());
    }
    let is_free = topology.boundary_loops > 0 && condition == BoundaryCondition::Free;
    let mut picture = Picture::new(mesh, is_free)?;
    let mut background: Vec<f64> = given.curvature;
    let own = background.iter_mut().zip(&picture.curvature);
    own.for_each(|(b, k)| *b -= k);
    let mut sink = given.sink;
    if let Some(total) = given.total {
        // Cones take their curvature from everywhere, where there is just what they must add up to.
        let area = background.iter_mut().zip(&picture.weight);
        area.for_each(|(b, w)| *b += total * w);
        sink.clone_from(&picture.weight);
    }
    let c = &mesh.connectivity;
    let mut placement = Placement::new(&mut picture, c, background, sink, limits, allowed);
    let search = Search {
        mesh,
        cones,
        least,
        most,
        quanta,
    };
    // Where curvatures are quanta, many small ones and a few large ones are different surfaces: each greatest number is tried.
    let caps = match quanta {
        Some(quanta) => quanta.caps(most),
        None => vec![limits],
    };
    let mut found = Vec::new();
    for limits in caps {
        placement.limits = limits;
        found.extend(search.run(&mut placement)?);
    }
    let best = cheapest(found);
    let Some(Found {
        vertices,
        curvature,
        ..
    }) = best
    else {
        return Err(ConeError::NoQuanta {
            quantum: cones.quantum.radians(),
            total: given.total.unwrap_or(0.0),
            count: most,
        });
    };
    let cone = |(&v, &curvature): (&usize, &f64)| {
        let vertex = VertexId::new(v);
        RequestedCone {
            vertex,
            named: mesh.source_vertex[vertex],
            curvature,
        }
    };
    let cones = vertices.iter().zip(&curvature).map(cone);
    Ok(cones
        .filter(|cone| cone.curvature.abs() > ROUNDING)
        .collect())
}

/// What is searched for.
struct Search<'a> {
    mesh: &'a Mesh,
    cones: &'a ConeParams,
    least: usize,
    most: usize,
    quanta: Option<Quanta>,
}

impl Search<'_> {
    /// The best cones within the limits of the placement; `None` where no whole quanta meet the total.
    fn run(&self, placement: &mut Placement) -> Result<Vec<Found>, ConeError> {
        let objective = self.cones.objective;
        let is_start = objective == ConeObjective::AreaDistortion
            && self.quanta.is_none()
            && self.cones.log_scale_bound.is_none();
        let choice = match self.cones.log_scale_bound {
            Some(bound) => placement.search_bounded(self.least, self.most, bound),
            // What is moved by another measure needs no more.
            None if is_start => placement.start(self.most),
            None => placement.search(self.most),
        };
        let mut choice =
            choice.ok_or_else(|| ConeError::not_chosen("places for cones cannot be told apart"))?;
        if !is_start {
            choice = placement.drop_idle(choice, self.least);
        }
        let mut found = Found {
            vertices: choice.vertices(),
            curvature: choice.best.curvature.clone(),
            cost: choice.energy,
            distortion: 0.0,
        };
        if found.vertices.is_empty() {
            return Ok(vec![found]);
        }
        if let Some(quanta) = self.quanta {
            return Ok(self.in_quanta(placement, &choice, quanta));
        }
        let rule = Rule::Best(placement.limits);
        if objective == ConeObjective::AreaDistortion {
            let start = placement.arrangement(&found.vertices, &found.curvature, rule);
            let moved = placement.lower_distortion(self.mesh, start, rule);
            found = placement.drop_idle_of(moved, self.least, rule).found();
        }
        Ok(vec![self.settle(placement, choice, found, rule)])
    }

    /// Whole quanta from a choice, and from the same without some of its cones, in whose stead others appear.
    fn in_quanta(&self, placement: &mut Placement, choice: &Choice, quanta: Quanta) -> Vec<Found> {
        let count = choice.sites.len();
        let mut found = Vec::new();
        for fewer in 0..=count.div_ceil(2) {
            let start = placement.prune(choice.clone(), count - fewer.min(count));
            let whole = start.and_then(|s| quantum::quantise(placement, &s, quanta, self.most));
            let Some(mut whole) = whole else { continue };
            if self.cones.objective == ConeObjective::AreaDistortion {
                whole = quantum::lower_distortion(placement, self.mesh, whole, quanta);
            } else {
                let u = placement.log_scale_of(whole.vertices.iter().zip(&whole.curvature));
                whole.distortion = placement.at(&u).value(&[], &[]);
            }
            found.push(whole);
        }
        found
    }

    /// Another look, with the log scale that the mesh really has in place of that of the linear picture: where that promised something else
    /// (or the finest moves are still to come, for (9)), places and curvatures are improved near where they are, and kept if the mesh agrees that they are better.
    fn settle(&self, placement: &mut Placement, choice: Choice, found: Found, rule: Rule) -> Found {
        let objective = self.cones.objective;
        let cost = |placement: &Placement, u: &[f64]| match objective {
            ConeObjective::LogScale => placement.picture.variance(u),
            ConeObjective::AreaDistortion => placement.at(u).value(&[], &[]),
        };
        let mut found = found;
        let mut real = placement.real_log_scale(&found.vertices, &found.curvature);
        let mut now = cost(placement, &real);
        let is_as_promised = (now - found.cost).abs() <= AS_PROMISED * now;
        if objective == ConeObjective::LogScale && is_as_promised {
            return found;
        }
        if objective == ConeObjective::AreaDistortion {
            // Strong cones may make the linear picture promise too much: then what it started from is better.
            let (vertices, curvature) = (choice.vertices(), &choice.best.curvature);
            let promised = placement.log_scale_of(vertices.iter().zip(curvature));
            if cost(placement, &promised) < now {
                let first = placement.real_log_scale(&vertices, curvature);
                if cost(placement, &first) < now {
                    now = cost(placement, &first);
                    real = first;
                    (found.vertices, found.curvature) = (vertices, curvature.clone());
                }
            }
        }
        let (vertices, curvature) = (&found.vertices, &found.curvature);
        placement.correct(vertices, curvature, &real);
        let mut moved = match objective {
            ConeObjective::LogScale => match placement.settle(choice) {
                Some(choice) => Found {
                    vertices: choice.vertices(),
                    curvature: choice.best.curvature,
                    cost: now,
                    distortion: 0.0,
                },
                None => return found,
            },
            ConeObjective::AreaDistortion => {
                let start = placement.arrangement(vertices, curvature, rule);
                placement.near(self.mesh, start, rule, FINE).found()
            }
        };
        let next = placement.real_log_scale(&moved.vertices, &moved.curvature);
        moved.cost = cost(placement, &next);
        if moved.cost < now { moved } else { found }
    }
}

/// The fewest cones that can make up the total within the limits.
fn least_count(limits: Limits) -> usize {
    let [low, high] = limits.range;
    let share = match limits.total {
        Some(total) if total > ROUNDING => (total - ROUNDING) / high,
        Some(total) if total < -ROUNDING => (total + ROUNDING) / low,
        _ => 0.0,
    };
    share.ceil() as usize
}

fn quanta(size: f64, limits: Limits) -> Result<Quanta, ConeError> {
    Quanta::new(size, limits).ok_or(ConeError::NotInQuanta {
        quantum: size,
        total: limits.total.unwrap_or(0.0),
    })
}

/// Interior vertices that are no nearer to the boundary than `distance`, in square roots of the area.
fn allowed(mesh: &Mesh, distance: f64) -> Vec<bool> {
    let c = &mesh.connectivity;
    let boundary: Vec<VertexId> = c.vertices().filter(|&v| c.is_boundary_vertex(v)).collect();
    let mut nearest = VertexVec::filled(f64::INFINITY, c.vertex_count());
    if distance > 0.0 {
        spread::approach(mesh, &boundary, &mut nearest);
    }
    let least = distance * picture::total_area(mesh).sqrt();
    let far = |v| !c.is_boundary_vertex(v) && nearest[v] >= least;
    c.vertices().map(far).collect()
}

/// What there is without cones.
struct Given {
    /// Curvature of the boundary, radians; 0 in the interior.
    curvature: Vec<f64>,
    /// What the cones must add up to; `None` where the boundary takes what is left.
    total: Option<f64>,
    /// How the boundary shares what is left, adding up to 1.
    sink: Vec<f64>,
}

fn given(
    mesh: &Mesh,
    topology: &Topology,
    requests: &Requests,
    condition: BoundaryCondition,
    params: &BoundaryParams,
) -> Result<Given, ConeError> {
    let c = &mesh.connectivity;
    let count = c.vertex_count();
    let required = TAU * topology.euler_characteristic as f64;
    let mut target = VertexVec::filled(0.0, count);
    let mut named = VertexVec::filled(None, count);
    for cone in boundary::listed(mesh, requests)? {
        target[cone.vertex] = cone.curvature;
        named[cone.vertex] = Some(cone.named);
    }
    let mut sink = vec![0.0; count];
    let shares = matches!(
        condition,
        BoundaryCondition::Uniform | BoundaryCondition::Prescribed
    ) && params.totals.is_empty();
    let others: Vec<usize> = c
        .vertices()
        .filter(|&v| shares && c.is_boundary_vertex(v) && named[v].is_none())
        .map(|v| v.index())
        .collect();
    if topology.boundary_loops > 0 && condition == BoundaryCondition::Free {
        return Ok(Given {
            curvature: target.into_vec(),
            total: None,
            sink: Vec::new(),
        });
    }
    if others.is_empty() {
        if topology.boundary_loops > 0 {
            boundary::prescribe(
                mesh,
                topology,
                requests,
                condition,
                params,
                &named,
                &mut target,
            )?;
        }
        let total = required - target.iter().sum::<f64>();
        return Ok(Given {
            curvature: target.into_vec(),
            total: Some(total),
            sink,
        });
    }
    let rest = required - target.iter().sum::<f64>();
    let mut curvature = target.into_vec();
    for &v in &others {
        sink[v] = 1.0 / others.len() as f64;
        curvature[v] = rest * sink[v];
    }
    Ok(Given {
        curvature,
        total: None,
        sink,
    })
}
