//! Curvature on the boundary: none prescribed, the same everywhere, the four corners of a rectangle, or vertex by vertex.
//!
//! Where single vertices are listed, the others share evenly what is left to meet Gauss–Bonnet (or the total of their loop): a
//! polygon whose corners take all of it has straight sides, and one corner on a disk leaves the rest of the border round.
//! Nothing need be counted by hand, and a total that is meant to leave nothing leaves exactly nothing. On a component of which no
//! vertex is listed all share alike.

use super::error::ConeError;
use super::params::BoundaryParams;
use super::request::{RequestedCone, Requests};
use super::spread::by_position;
use crate::flow::pi_multiple::PiMultiple;
use crate::flow::prescription::{BoundaryCondition, GAUSS_BONNET_TOLERANCE};
use crate::geometry::connectivity::Topology;
use crate::geometry::ids::{HalfedgeId, VertexId, VertexVec};
use crate::geometry::mesh::{Mesh, distance};
use crate::geometry::triangle::angles;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// The curvature that the boundary takes whatever the cones are, radians; also checks that the condition fits the surface.
pub(super) fn prescribed_total(
    topology: &Topology,
    requests: &Requests,
    condition: BoundaryCondition,
    params: &BoundaryParams,
) -> Result<f64, ConeError> {
    let loops = topology.boundary_loops;
    match condition {
        BoundaryCondition::Corners if topology.euler_characteristic != 1 => {
            Err(ConeError::NotADisk {
                genus: topology.genus,
                loops,
            })
        }
        BoundaryCondition::Corners => Ok(TAU),
        BoundaryCondition::Uniform | BoundaryCondition::Prescribed
            if ![0, loops].contains(&params.totals.len()) =>
        {
            Err(ConeError::TotalsCount {
                given: params.totals.len(),
                loops,
            })
        }
        BoundaryCondition::Prescribed if params.totals.is_empty() => {
            Ok(requests.boundary.iter().map(|b| b.curvature).sum())
        }
        BoundaryCondition::Uniform | BoundaryCondition::Prescribed => {
            Ok(params.totals.iter().map(|t| t.radians()).sum())
        }
        BoundaryCondition::Free => Ok(0.0),
    }
}

/// The boundary vertices that got a curvature of their own; an error where one is not on the boundary.
pub(super) fn listed<'a>(
    mesh: &Mesh,
    requests: &'a Requests,
) -> Result<&'a [RequestedCone], ConeError> {
    let inside = |b: &&RequestedCone| !mesh.connectivity.is_boundary_vertex(b.vertex);
    match requests.boundary.iter().find(inside) {
        Some(b) => Err(ConeError::NotOnBoundary {
            key: "boundary.list",
            vertex: b.named,
        }),
        None => Ok(&requests.boundary),
    }
}

/// The curvature that the boundary has in space, radians: π less the angles of the faces at each of its vertices. A face without angles counts as
/// one of π in all.
pub(super) fn own_total(mesh: &Mesh) -> f64 {
    let c = &mesh.connectivity;
    let mut total = 0.0;
    for v in c.vertices().filter(|&v| c.is_boundary_vertex(v)) {
        total += PI;
        for h in c.outgoing(v) {
            let lengths = c.face_edges(c.face(h)).map(|e| mesh.edge_length(e));
            let angles = angles(lengths).unwrap_or([PI / 3.0; 3]);
            let corner = c.corner(h);
            total -= angles[corner];
        }
    }
    total
}

/// Adds the curvature of the boundary to `target`, which holds that of the vertices that are `named`. On a uniform or prescribed
/// boundary those keep their own, and the others share what is left.
pub(super) fn prescribe(
    mesh: &Mesh,
    topology: &Topology,
    requests: &Requests,
    condition: BoundaryCondition,
    params: &BoundaryParams,
    named: &VertexVec<Option<u32>>,
    target: &mut VertexVec<f64>,
) -> Result<(), ConeError> {
    match condition {
        BoundaryCondition::Free => Ok(()),
        BoundaryCondition::Corners => {
            for v in corners(mesh, requests)? {
                target[v] = FRAC_PI_2;
            }
            Ok(())
        }
        BoundaryCondition::Uniform | BoundaryCondition::Prescribed => {
            let loops: Vec<Vec<VertexId>> = mesh
                .connectivity
                .boundary_loops()
                .iter()
                .map(|chain| tails(mesh, chain))
                .collect();
            let groups: Vec<(Vec<VertexId>, f64)> = if params.totals.is_empty() {
                let interior: f64 = mesh
                    .connectivity
                    .vertices()
                    .filter(|&v| !mesh.connectivity.is_boundary_vertex(v))
                    .map(|v| target[v])
                    .sum();
                let total = TAU * topology.euler_characteristic as f64 - interior;
                vec![(loops.concat(), total)]
            } else {
                let totals = params.totals.iter().copied().map(PiMultiple::radians);
                loops.into_iter().zip(totals).collect()
            };
            for (vertices, total) in groups {
                share(&vertices, total, named, target)?;
            }
            Ok(())
        }
    }
}

/// Equal parts of what the total leaves to the vertices that are not named; nothing where only rounding is left.
fn share(
    vertices: &[VertexId],
    total: f64,
    named: &VertexVec<Option<u32>>,
    target: &mut VertexVec<f64>,
) -> Result<(), ConeError> {
    let listed: f64 = vertices.iter().map(|&v| target[v]).sum();
    let others = vertices.iter().filter(|&&v| named[v].is_none()).count();
    let rest = total - listed;
    if others == 0 || rest.abs() <= GAUSS_BONNET_TOLERANCE {
        return Ok(());
    }
    let share = rest / others as f64;
    if share >= PI - GAUSS_BONNET_TOLERANCE {
        return Err(ConeError::RestTooLarge {
            rest,
            others,
            share,
        });
    }
    for &v in vertices.iter().filter(|&&v| named[v].is_none()) {
        target[v] = share;
    }
    Ok(())
}

fn tails(mesh: &Mesh, chain: &[HalfedgeId]) -> Vec<VertexId> {
    chain.iter().map(|&h| mesh.connectivity.tail(h)).collect()
}

fn corners(mesh: &Mesh, requests: &Requests) -> Result<Vec<VertexId>, ConeError> {
    let named = &requests.corners;
    if named.is_empty() {
        return best_corners(mesh);
    }
    for (i, &(v, name)) in named.iter().enumerate() {
        if !mesh.connectivity.is_boundary_vertex(v) {
            return Err(ConeError::NotOnBoundary {
                key: "boundary.corners",
                vertex: name,
            });
        }
        if let Some(&(_, first)) = named[..i].iter().find(|(w, _)| *w == v) {
            return Err(ConeError::CornerTwice {
                first,
                second: name,
                vertex: mesh.source_vertex[v],
            });
        }
    }
    if named.len() != 4 {
        return Err(ConeError::CornerCount { given: named.len() });
    }
    Ok(named.iter().map(|&(v, _)| v).collect())
}

/// The four boundary vertices whose shortest distance along the boundary is greatest, among the choices that start at
/// any vertex and take the nearest to each further quarter of the length; ties go to the lowest coordinates of the start.
fn best_corners(mesh: &Mesh) -> Result<Vec<VertexId>, ConeError> {
    let chain = mesh.connectivity.boundary_loops().concat();
    let vertices = tails(mesh, &chain);
    let m = vertices.len();
    if m < 4 {
        return Err(ConeError::BoundaryTooShort { given: m });
    }
    // Arc length from vertex 0, twice around.
    let mut arc = vec![0.0];
    for i in 0..2 * m {
        let (p, q) = (
            mesh.positions[vertices[i % m]],
            mesh.positions[vertices[(i + 1) % m]],
        );
        arc.push(arc[i] + distance(p, q));
    }
    let length = arc[m];
    let choice = |start: usize| -> ([usize; 4], f64) {
        let mut picks = [start; 4];
        for k in 1..4 {
            let wanted = arc[start] + length * k as f64 / 4.0;
            let above = arc.partition_point(|&s| s < wanted).min(2 * m);
            let below = above.saturating_sub(1);
            let nearer = if wanted - arc[below] <= arc[above] - wanted {
                below
            } else {
                above
            };
            picks[k] = nearer.clamp(picks[k - 1] + 1, start + m - 4 + k);
        }
        let gaps = (0..4).map(|k| {
            let next = if k == 3 {
                arc[start] + length
            } else {
                arc[picks[k + 1]]
            };
            next - arc[picks[k]]
        });
        (picks, gaps.fold(f64::INFINITY, f64::min))
    };
    let mut best = (0, choice(0));
    for start in 1..m {
        let candidate = choice(start);
        let (p, q) = (
            mesh.positions[vertices[start]],
            mesh.positions[vertices[best.0]],
        );
        let order = candidate.1.total_cmp(&best.1.1).then(by_position(q, p));
        if order.is_gt() {
            best = (start, candidate);
        }
    }
    Ok(best.1.0.iter().map(|&i| vertices[i % m]).collect())
}
