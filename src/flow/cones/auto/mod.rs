//! Cones chosen by the program (tutorial 5.2, Problem 21: number, positions and curvatures of the singularities with least distortion).
//!
//! *Enters:* a mesh, what happens on its boundary, how many cones there may be. *Leaves:* vertices and curvatures that meet Gauss–Bonnet.
//!
//! | step | follows | ours |
//! | --- | --- | --- |
//! | log scale as a linear function of curvature, one factorisation ([`picture`]) | Ben-Chen, Gotsman, Bunin 2008 | |
//! | the distortion of area, growing and shrinking alike ([`objective`]) | the aim of Soliman, Slepčev, Crane 2018 and Fang et al. 2021 with another measure | convex, of any size |
//! | what a cone does to its own vertex ([`star`]) | vertex scaling in a regular star | |
//! | places for cones: where a little curvature gains most ([`candidates`], [`search`]) | conditional gradients on measures, Bredies and Pikkarainen 2013 | a pool of them |
//! | the best few of them ([`pool`], [`tableau`]) | | every exchange read off one pivoted matrix |
//! | cones moved on the surface ([`moves`]) | Li et al. 2023 | rings of candidates along the force |
//! | multiples of a quantum ([`quantum`]) | the aim of Li et al. 2022 | local search in the same model |
//! | what the mesh really does ([`picture`]) | | some steps with the same factor |
//!
//! How many: what Gauss–Bonnet and the limits need on a closed surface; on a free boundary, which can take any curvature, what the
//! interior has by itself and would leave to it; a cone's worth for each loop, 2π, is left to it at most. Twice that number, and 8 at least, is what is looked for where `cones.count` is absent. Of these, cones that gain less
//! than a hundredth are left out; beyond them come up to 16 more, as long as each lowers the square root of a large objective by a twenty-fifth.
//!
//! *Guaranteed:* the same choice for the same surface, moved, scaled or numbered otherwise, unless places tie; never more cones than asked
//! for; with a quantum every curvature a multiple of it. *Not guaranteed:* the global optimum.

mod candidates;
mod cells;
mod moves;
mod neighbours;
mod objective;
mod picture;
mod placement;
mod pool;
mod quantum;
mod search;
mod star;
mod tableau;

use super::error::ConeError;
use super::params::{BoundaryParams, ConeParams, DEFAULT_COUNT};
use super::request::{RequestedCone, Requests};
use super::{boundary, spread};
use crate::flow::prescription::BoundaryCondition;
use crate::geometry::connectivity::Topology;
use crate::geometry::ids::{VertexId, VertexVec};
use crate::geometry::mesh::Mesh;
use objective::NOTHING;
use picture::Picture;
use placement::Placement;
use pool::{Cones, Rule};
use quantum::Quanta;
use search::Count;
use std::f64::consts::TAU;
use tableau::Limits;

/// Cones beyond the number that is looked for first, at most, …
const MORE: usize = 16;
/// … where that is no more than this.
const MANY: usize = 48;
/// Share of the real objective by which the linear picture may be wrong before it is corrected, and on a small mesh.
const AS_PROMISED: [f64; 2] = [0.05, 0.01];
/// Radii of the rings on which cones move after a correction, in square roots of the area.
const SETTLED_RADII: [f64; 1] = [0.01];
/// How often all of a small mesh is looked at anew at most.
const LOOKS: usize = 4;
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
    let least = least_count(limits.range, given.total.unwrap_or(0.0));
    let count = match cones.count {
        Some(count) if count < least => {
            return Err(ConeError::TooFewCones {
                count,
                least,
                total: given.total.unwrap_or(0.0),
            });
        }
        Some(count) => Count {
            least,
            wanted: count.min(places),
            most: count.min(places),
        },
        None => {
            let needed = least.max(needed(mesh, topology, condition, limits.range, &given));
            let [wanted, most] = match condition {
                BoundaryCondition::Free => {
                    let wanted = DEFAULT_COUNT.max(2 * needed);
                    // Of many, each gains little.
                    let more = if wanted <= MANY { MORE } else { 0 };
                    [wanted, wanted + more]
                }
                // Whoever asks for a rectangle wants one.
                _ => [needed; 2],
            };
            Count {
                least,
                wanted: wanted.min(places),
                most: most.min(places),
            }
        }
    };
    if places < least {
        return Err(ConeError::TooFewVertices {
            wanted: least,
            interior: places,
        });
    }
    let quanta = match cones.quantum.radians() {
        size if size > 0.0 => Some(quanta(size, limits)?),
        _ => None,
    };
    if count.most == 0 {
        return Ok(Vec::new());
    }
    let is_free = topology.boundary_loops > 0 && condition == BoundaryCondition::Free;
    let picture = Picture::new(mesh, is_free)?;
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
    let mut placement = Placement::new(mesh, picture, background, sink, limits, allowed);
    let search = |placement: &mut Placement| match cones.log_scale_bound {
        Some(bound) => placement.search_bounded(count, bound),
        None => placement.search(count),
    };
    let mut found = search(&mut placement);
    if is_free {
        // A short border is little area, however much curvature it takes.
        let own = own_inside(mesh, topology);
        let total: f64 = found.iter().take(1).flat_map(|best| &best.curvature).sum();
        let slack = TAU * topology.boundary_loops as f64;
        let within = total.clamp(own - slack, own + slack);
        if (total - within).abs() > ROUNDING
            && least_count(limits.range, within) <= count.wanted
            && quanta.is_none()
        {
            placement.limits.total = Some(within);
            found = search(&mut placement);
        }
    }
    let (found, rule) = match quanta {
        Some(quanta) => {
            let best = found.into_iter().next().unwrap_or_default();
            let found = in_quanta(&mut placement, best, quanta, count.most);
            let found = found.ok_or_else(|| ConeError::NoQuanta {
                quantum: cones.quantum.radians(),
                total: given.total.unwrap_or(0.0),
                count: count.most,
            })?;
            (vec![found], Rule::Fixed)
        }
        None => (found, Rule::Best),
    };
    let mut found = settle(&mut placement, found, rule, search);
    // A thousand times what may add up; and limits are wider where there are too few for them.
    let are_met = placement.limits.are_met(&found.curvature, 1e3 * ROUNDING);
    if rule == Rule::Best && (!are_met || found.vertices.len() < count.least) {
        found = placement.equal(count);
    }
    let cone = |(&v, &curvature): (&usize, &f64)| {
        let vertex = VertexId::new(v);
        RequestedCone {
            vertex,
            named: mesh.source_vertex[vertex],
            curvature,
        }
    };
    let cones = found.vertices.iter().zip(&found.curvature).map(cone);
    Ok(cones
        .filter(|cone| cone.curvature.abs() > ROUNDING)
        .collect())
}

/// Whole quanta near some cones: among them, the places of a first pool, and then on rings.
fn in_quanta(
    placement: &mut Placement,
    found: Cones,
    quanta: Quanta,
    count: usize,
) -> Option<Cones> {
    let mut places = found.vertices.clone();
    let others = placement.first_pool(count).vertices;
    places.extend(others.into_iter().filter(|v| !found.vertices.contains(v)));
    let u = placement.log_scale_of(&found.vertices, &found.curvature);
    let pool = pool::Pool::new(placement, places, &u);
    let members: Vec<usize> = (0..found.vertices.len()).collect();
    let start = pool.weigh(members, &found.curvature, Rule::Best);
    // From the choice, and from the same without some of its cones, in whose stead others appear; and with smaller and smaller numbers of quanta at
    // one cone, since a few large ones and many small ones are different surfaces.
    let mut best: Option<pool::Set> = None;
    for quanta in quanta.caps(count) {
        for fewer in 0..=start.members.len().div_ceil(2) {
            let start = pool.prune(&start, start.members.len() - fewer);
            let set = quanta.search(&pool, &start, count);
            best = set
                .into_iter()
                .chain(best)
                .min_by(|a, b| a.value.total_cmp(&b.value));
        }
    }
    let set = best?;
    let mut found = approached(placement, &pool, set);
    // Once more in a pool of what the force wants now, as long as that gains.
    for _ in 0..LOOKS {
        let mut places = found.vertices.clone();
        places.extend(pool.vertices.iter().filter(|v| !found.vertices.contains(v)));
        let now = std::slice::from_ref(&found);
        let (wider, starts) = placement.widened_around(places, now, count, Rule::Fixed);
        let Some(start) = starts.first() else { break };
        let Some(set) = quanta.search(&wider, start, count) else {
            break;
        };
        if set.value > start.value * (1.0 - search::ROUND_GAIN) {
            break;
        }
        found = approached(placement, &wider, set);
    }
    Some(found)
}

/// Some places of a pool, moved on rings.
fn approached(placement: &mut Placement, pool: &pool::Pool, set: pool::Set) -> Cones {
    placement.approach(pool.cones(&set), &moves::RADII, Rule::Fixed)
}

/// The optimum that is best by the log scale that the mesh really has; then another look, with that in place of the linear picture: where that promised something else,
/// places and curvatures are improved near where they are, and kept if the mesh agrees that they are better. On a small mesh, where strong cones
/// stand for few faces each and the picture may be far off, all places are looked at anew as well, again and again as long as that gains.
fn settle(
    placement: &mut Placement,
    optima: Vec<Cones>,
    rule: Rule,
    search: impl Fn(&mut Placement) -> Vec<Cones>,
) -> Cones {
    let is_small = placement.is_small() && rule == Rule::Best;
    let optima = optima
        .into_iter()
        .map(|cones| Outcome::new(placement, cones));
    let mut now = match optima.min_by(|a, b| a.cost.total_cmp(&b.cost)) {
        Some(best) => best,
        None => return Cones::default(),
    };
    let as_promised = AS_PROMISED[usize::from(is_small)];
    let off = (now.cost - placement.cost(&now.linear)).abs();
    if off <= as_promised * now.cost || now.cost <= NOTHING || now.cost == f64::INFINITY {
        return now.cones;
    }
    for _ in 0..if is_small { LOOKS } else { 1 } {
        placement.correct(&now.real, &now.linear);
        let mut tried = vec![placement.approach(now.cones.clone(), &SETTLED_RADII, rule)];
        if is_small {
            tried.extend(search(placement));
        }
        let before = now.cost;
        for cones in tried {
            let there = Outcome::new(placement, cones);
            if there.cost < now.cost {
                now = there;
            }
        }
        if now.cost >= before {
            break;
        }
    }
    now.cones
}

/// Cones and what they come to.
struct Outcome {
    cones: Cones,
    /// Log scale of the linear picture.
    linear: Vec<f64>,
    /// Log scale that the mesh really has.
    real: Vec<f64>,
    /// J of that.
    cost: f64,
}

impl Outcome {
    fn new(placement: &Placement, cones: Cones) -> Self {
        let linear = placement.log_scale_of(&cones.vertices, &cones.curvature);
        let real = placement.real_log_scale(&cones.vertices, &cones.curvature, &linear);
        Self {
            cost: placement.cost(&real),
            cones,
            linear,
            real,
        }
    }
}

/// The fewest cones that can make up a total within limits.
fn least_count([low, high]: [f64; 2], total: f64) -> usize {
    let share = match total {
        _ if total > ROUNDING => (total - ROUNDING) / high,
        _ if total < -ROUNDING => (total + ROUNDING) / low,
        _ => 0.0,
    };
    share.ceil() as usize
}

/// The fewest cones without which a boundary that takes what is left would have to take what is not its own: on a free boundary the curvature
/// that the interior has, on one that shares what is left that of the handles.
fn needed(
    mesh: &Mesh,
    topology: &Topology,
    condition: BoundaryCondition,
    range: [f64; 2],
    given: &Given,
) -> usize {
    if topology.boundary_loops == 0 || given.total.is_some() {
        return 0;
    }
    let left = match condition {
        BoundaryCondition::Free => own_inside(mesh, topology),
        _ => -2.0 * TAU * topology.genus as f64,
    };
    least_count(range, left)
}

/// The curvature that the interior of the surface has in space, radians.
fn own_inside(mesh: &Mesh, topology: &Topology) -> f64 {
    TAU * topology.euler_characteristic as f64 - boundary::own_total(mesh)
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
