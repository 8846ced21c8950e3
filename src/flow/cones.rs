//! Which curvature every vertex shall have (tutorial 5.2).
//!
//! *Enters:* a mesh and what the user asks for. *Leaves:* a [`Prescription`] that meets
//! Gauss–Bonnet (5), or an error with both totals.
//!
//! An asset may have several components, and Gauss–Bonnet holds for each: [`assign`] finds the component of every
//! vertex and point that the user names, [`prescribe`] then works on one component. Without any wish the program chooses places and
//! curvatures by itself (the private module `auto`), so that areas grow and shrink least:
//!
//! | component | cones |
//! | --- | --- |
//! | closed, of any genus | 8 that add up to 2πχ, or twice as many as that needs; more where each gains much |
//! | with boundary | 8, or twice as many as the curvature of the interior needs; none where the surface is flat; the boundary is free |
//! | with a boundary that is prescribed | no more than Gauss–Bonnet and the handles need: none on a disk |
//!
//! Cones that would gain less than a hundredth are left out. A component to which a list names no cone is treated as
//! if there were no list.
//!
//! *Guaranteed:* cone angles are positive, ΣK̄ = 2πχ (to rounding) unless the boundary is free, and then Σ over the interior
//! exceeds 2πχ − π·(boundary vertices). *Not guaranteed:* that a circle packing with this curvature exists
//! (constraint (6), see [`super::feasibility`]), nor that the cones keep the distortion low: [`spread`](ConeStrategy::Spread) knows distances only.

mod auto;
mod boundary;
mod error;
mod field;
pub mod file;
mod params;
mod request;
mod spread;

pub use error::ConeError;
pub use params::{BoundaryParams, BoundarySpec, ConeParams, ConeSpec, ConeStrategy, CornerSpec};
pub use request::{RequestedCone, Requests, assign};

pub(crate) use super::pi_multiple::in_pi;
pub use super::pi_multiple::{NotAMultiple, PiMultiple};
pub use super::prescription::{BoundaryCondition, Cone, Prescription};

use super::features::FeatureParams;
use super::prescription::GAUSS_BONNET_TOLERANCE;
use crate::geometry::connectivity::Topology;
use crate::geometry::ids::{VertexId, VertexVec};
use crate::geometry::mesh::Mesh;
use params::DEFAULT_COUNT;
use std::f64::consts::{PI, TAU};

/// Largest miss of Gauss–Bonnet for each cone of a file of another program, whose curvatures are rounded to few digits, radians;
/// it is shared out among the cones.
const ROUNDING_OF_TEXT: f64 = 1e-4;

/// The target curvature of one component; `requests` are those that [`assign`] found for it.
pub fn prescribe(
    mesh: &Mesh,
    requests: &Requests,
    cones: &ConeParams,
    boundary: &BoundaryParams,
    features: &FeatureParams,
) -> Result<Prescription, ConeError> {
    let topology = mesh.connectivity.topology();
    let condition = match (topology.boundary_loops, cones.strategy) {
        (0, _) => BoundaryCondition::Free,
        (_, ConeStrategy::Field) if *boundary == BoundaryParams::default() => {
            BoundaryCondition::Prescribed
        }
        (_, ConeStrategy::Field) => return Err(ConeError::FieldOnGivenBoundary),
        _ => boundary.effective_condition(),
    };
    let mut target = VertexVec::filled(0.0, mesh.connectivity.vertex_count());
    // By what name each vertex got its curvature.
    let mut named = VertexVec::filled(None, mesh.connectivity.vertex_count());
    let on_boundary = boundary::prescribed_total(&topology, requests, condition, boundary)?;
    let mut from_field = None;
    let chosen = match (cones.strategy, requests.cones.is_empty()) {
        (ConeStrategy::Field, _) => {
            let (chosen, found) = field::select(mesh, features, &requests.features, cones.count)?;
            from_field = Some(Box::new(found));
            chosen
        }
        (ConeStrategy::Auto | ConeStrategy::Listed, true) => {
            auto::select(mesh, &topology, requests, condition, cones, boundary)?
        }
        _ => choose(mesh, &topology, requests, cones, on_boundary)?,
    };
    for cone in &chosen {
        if cone.curvature == 0.0 {
            return Err(ConeError::ZeroCurvature { vertex: cone.named });
        }
        if mesh.connectivity.is_boundary_vertex(cone.vertex) {
            let vertex = cone.named;
            match condition {
                BoundaryCondition::Corners => return Err(ConeError::OnCornerBoundary { vertex }),
                BoundaryCondition::Free => return Err(ConeError::OnFreeBoundary { vertex }),
                BoundaryCondition::Uniform | BoundaryCondition::Prescribed => {}
            }
        }
    }
    for cone in chosen.iter().chain(boundary::listed(mesh, requests)?) {
        let v = cone.vertex;
        if let Some(first) = named[v].replace(cone.named) {
            return Err(ConeError::Twice {
                first,
                second: cone.named,
                vertex: mesh.source_vertex[v],
            });
        }
        target[v] = cone.curvature;
    }
    // Before the rest of the boundary, so that a message gives what the user wrote.
    check_angles(mesh, &target)?;
    boundary::prescribe(
        mesh,
        &topology,
        requests,
        condition,
        boundary,
        &named,
        &mut target,
    )?;
    check_angles(mesh, &target)?;
    let rounding = match (&cones.file, requests.cones.len()) {
        (Some(_), count) if count > 0 => ROUNDING_OF_TEXT * count as f64,
        _ => GAUSS_BONNET_TOLERANCE,
    };
    check_total(mesh, &topology, condition, rounding, &mut target)?;
    Ok(Prescription {
        field: from_field,
        ..Prescription::new(target, condition)
    })
}

/// The cones that the user names or that a strategy other than the automatic choice yields.
fn choose(
    mesh: &Mesh,
    topology: &Topology,
    requests: &Requests,
    params: &ConeParams,
    on_boundary: f64,
) -> Result<Vec<RequestedCone>, ConeError> {
    let total = TAU * topology.euler_characteristic as f64 - on_boundary;
    match params.strategy {
        // Where there are none, they are chosen automatically.
        ConeStrategy::Auto | ConeStrategy::Listed => Ok(requests.cones.clone()),
        ConeStrategy::None | ConeStrategy::Field => Ok(Vec::new()),
        ConeStrategy::Spread => {
            let count = params.count.unwrap_or(DEFAULT_COUNT);
            if count == 0 {
                return Err(ConeError::NoCount);
            }
            let share = total / count as f64;
            let curvature = params.curvature.map_or(share, PiMultiple::radians);
            if curvature == 0.0 {
                return Err(ConeError::NothingToSpread {
                    count,
                    chi: topology.euler_characteristic,
                });
            }
            spread_cones(mesh, count, curvature)
        }
        ConeStrategy::Single if total == 0.0 => Ok(Vec::new()),
        ConeStrategy::Single => {
            if total >= TAU - GAUSS_BONNET_TOLERANCE {
                return Err(ConeError::SingleTooLarge {
                    required: total,
                    chi: topology.euler_characteristic,
                });
            }
            let none = ConeError::TooFewVertices {
                wanted: 1,
                interior: 0,
            };
            let vertex = requests.single.or_else(|| spread::central(mesh));
            let vertex = vertex.ok_or(none)?;
            Ok(vec![RequestedCone {
                vertex,
                named: mesh.source_vertex[vertex],
                curvature: total,
            }])
        }
    }
}

fn spread_cones(
    mesh: &Mesh,
    count: usize,
    curvature: f64,
) -> Result<Vec<RequestedCone>, ConeError> {
    let connectivity = &mesh.connectivity;
    let interior = connectivity
        .vertices()
        .filter(|&v| !connectivity.is_boundary_vertex(v))
        .count();
    // Before the search, which would visit every vertex in vain.
    let refused = ConeError::TooFewVertices {
        wanted: count,
        interior,
    };
    if interior < count {
        return Err(refused);
    }
    let vertices = spread::spread(mesh, count);
    if vertices.len() < count {
        return Err(refused);
    }
    let cone = |vertex: VertexId| RequestedCone {
        vertex,
        named: mesh.source_vertex[vertex],
        curvature,
    };
    Ok(vertices.into_iter().map(cone).collect())
}

/// Cone angles are positive: K̄ < 2π in the interior, K̄ < π on the boundary.
fn check_angles(mesh: &Mesh, target: &VertexVec<f64>) -> Result<(), ConeError> {
    for (v, &curvature) in target.enumerate() {
        let on_boundary = mesh.connectivity.is_boundary_vertex(v);
        let bound = if on_boundary { PI } else { TAU };
        if curvature >= bound - GAUSS_BONNET_TOLERANCE {
            return Err(ConeError::NoAngleLeft {
                vertex: mesh.source_vertex[v],
                curvature,
                bound,
                place: if on_boundary {
                    "on the boundary"
                } else {
                    "in the interior"
                },
            });
        }
    }
    Ok(())
}

/// Gauss–Bonnet (5), or its counterpart for a free boundary. What misses it by at most `tolerance`, radians, is shared out.
fn check_total(
    mesh: &Mesh,
    topology: &Topology,
    condition: BoundaryCondition,
    tolerance: f64,
    target: &mut VertexVec<f64>,
) -> Result<(), ConeError> {
    let chi = topology.euler_characteristic;
    let required = TAU * chi as f64;
    let given: f64 = target.iter().sum();
    let cones = target.iter().filter(|k| **k != 0.0).count();
    if topology.boundary_loops > 0 && condition == BoundaryCondition::Free {
        let boundary_vertices = mesh
            .connectivity
            .vertices()
            .filter(|&v| mesh.connectivity.is_boundary_vertex(v))
            .count();
        let bound = required - PI * boundary_vertices as f64;
        if given <= bound + GAUSS_BONNET_TOLERANCE {
            return Err(ConeError::FreeBoundaryTotal {
                given,
                bound,
                chi,
                boundary_vertices,
            });
        }
        return Ok(());
    }
    if topology.boundary_loops == 0 && cones == 0 && chi != 0 {
        return Err(ConeError::NeedsCones {
            chi,
            genus: topology.genus,
            required,
        });
    }
    if topology.boundary_loops == 0 && chi == 2 && cones < 3 {
        return Err(ConeError::TooFewOnSphere { cones });
    }
    if (given - required).abs() > tolerance {
        return Err(ConeError::GaussBonnet {
            given,
            required,
            chi,
            genus: topology.genus,
            boundary_loops: topology.boundary_loops,
        });
    }
    // Rounding of the sum itself is no miss: what was written exactly stays exact.
    let rounding = 1e-15 * (1.0 + target.iter().map(|k| k.abs()).sum::<f64>());
    if cones > 0 && (required - given).abs() > rounding {
        if (required - given).abs() > GAUSS_BONNET_TOLERANCE {
            tracing::warn!(
                "the curvatures of cones.file sum to {given:.9} rad instead of {required:.9}, as far off as rounding of their text can be: shared out among {cones} cones"
            );
        }
        let share = (required - given) / cones as f64;
        for k in target.as_mut_slice().iter_mut().filter(|k| **k != 0.0) {
            *k += share;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
