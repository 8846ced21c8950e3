//! Cones chosen by the program (tutorial 5.2, Problem 21).

mod area;
mod moves;
mod pairs;
mod picture;
mod placement;
mod quadratic;
mod quantum;

use super::{
    BoundaryCondition, BoundaryParams, ConeError, ConeObjective, ConeParams, RequestedCone,
    Requests, boundary,
};
use crate::geometry::connectivity::Topology;
use crate::geometry::ids::{VertexId, VertexVec};
use crate::geometry::mesh::Mesh;
use picture::Picture;
use placement::Placement;
use quadratic::Limits;
use std::f64::consts::TAU;

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
    let is_free = topology.boundary_loops > 0 && condition == BoundaryCondition::Free;
    let t = std::time::Instant::now();
    let mut picture = Picture::new(mesh, is_free).map_err(|e| ConeError::NotChosen {
        reason: e.to_string(),
    })?;
    let weight = picture.weight.clone();
    let mut background: Vec<f64> = given
        .curvature
        .iter()
        .zip(&picture.curvature)
        .map(|(a, b)| a - b)
        .collect();
    let mut sink = given.sink;
    if let Some(total) = given.total {
        background
            .iter_mut()
            .zip(&weight)
            .for_each(|(b, w)| *b += total * w);
        sink = weight;
    }
    if is_free {
        sink = Vec::new();
    }
    let c = &mesh.connectivity;
    let allowed: Vec<bool> = c.vertices().map(|v| !c.is_boundary_vertex(v)).collect();
    let limits = Limits {
        range: [cones.min_curvature.radians(), cones.max_curvature.radians()],
        total: given.total,
    };
    let mut placement = Placement::new(&mut picture, c, background, sink, limits, allowed);
    let choice = placement
        .search(cones.count)
        .ok_or_else(|| ConeError::NotChosen {
            reason: "the places for cones cannot be told apart".into(),
        })?;
    let (mut vertices, mut curvature): (Vec<usize>, Vec<f64>) = (
        choice.sites.iter().map(|s| s.vertex).collect(),
        choice.best.curvature.clone(),
    );
    if cones.objective == ConeObjective::AreaDistortion || std::env::var("AREA").is_ok() {
        let done = moves::lower_distortion(
            &mut placement,
            mesh,
            &vertices,
            &curvature,
            moves::Rule::Best(limits),
        );
        vertices = done.places.iter().map(|p| p.vertex).collect();
        curvature = done.curvature;
        eprintln!("area {:?} F {}", t.elapsed(), done.value.exp() - 1.0);
    }
    let cone = |(&v, &curvature): (&usize, &f64)| {
        let vertex = VertexId::new(v);
        RequestedCone {
            vertex,
            named: mesh.source_vertex[vertex],
            curvature,
        }
    };
    Ok(vertices.iter().zip(&curvature).map(cone).collect())
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
