//! Which component, and which of its vertices, the user means.

use super::error::ConeError;
use super::params::{BoundaryParams, ConeParams, ConeSpec, ConeStrategy};
use super::spread;
use crate::flow::features::FeatureParams;
use crate::flow::prescription::BoundaryCondition;
use crate::geometry::ids::{EdgeId, NONE, VertexId};
use crate::geometry::mesh::{Mesh, distance};
use crate::repair::Repaired;
use std::collections::BTreeMap;

/// A cone at a vertex of a component.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RequestedCone {
    /// Where.
    pub vertex: VertexId,
    /// The vertex of the input file that was named (or that a point or a strategy found).
    pub named: u32,
    /// K̄, radians.
    pub curvature: f64,
}

/// What the user named on one component.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Requests {
    /// Cones of the list.
    pub cones: Vec<RequestedCone>,
    /// Vertex for `single`.
    pub single: Option<VertexId>,
    /// Corners: vertex, and how the input names it.
    pub corners: Vec<(VertexId, u32)>,
    /// Boundary vertices with a curvature of their own.
    pub boundary: Vec<RequestedCone>,
    /// Edges that shall become lines.
    pub features: Vec<EdgeId>,
}

/// Finds the component and vertex of everything that the user names: one [`Requests`] a component, in their order.
/// What lies on a component that could not be repaired is left out, since nothing is built of it.
pub fn assign(
    repaired: &Repaired,
    cones: &ConeParams,
    boundary: &BoundaryParams,
    features: &FeatureParams,
) -> Result<Vec<Requests>, ConeError> {
    check_keys(cones, boundary, features)?;
    let mut requests = vec![Requests::default(); repaired.components.len()];
    for (i, spec) in cones.list.iter().enumerate() {
        let key = key_of_cone(cones, i, spec);
        let place = find(repaired, &key, spec.vertex, spec.point, |_, _| true)?;
        if let Some((component, vertex, named)) = place {
            requests[component].cones.push(RequestedCone {
                vertex,
                named,
                curvature: spec.curvature.radians(),
            });
        }
    }
    if let Some(vertex) = cones.vertex {
        let key = "cones.vertex";
        if let Some((component, vertex, _)) = find(repaired, key, Some(vertex), None, |_, _| true)?
        {
            requests[component].single = Some(vertex);
        }
    }
    let on_boundary = |mesh: &Mesh, v| mesh.connectivity.is_boundary_vertex(v);
    for (i, spec) in boundary.list.iter().enumerate() {
        let key = format!("boundary.list[{i}]");
        let place = find(repaired, &key, spec.vertex, spec.point, on_boundary)?;
        if let Some((component, vertex, named)) = place {
            requests[component].boundary.push(RequestedCone {
                vertex,
                named,
                curvature: spec.curvature.radians(),
            });
        }
    }
    for (i, spec) in boundary.corners.iter().enumerate() {
        let key = format!("boundary.corners[{i}]");
        let place = find(repaired, &key, spec.vertex, spec.point, on_boundary)?;
        if let Some((component, vertex, named)) = place {
            requests[component].corners.push((vertex, named));
        }
    }
    assign_features(repaired, features, &mut requests)?;
    Ok(requests)
}

/// Finds the edges of `features.list`. Where the input has an edge of more than two faces, repair leaves it in pieces: each is one.
fn assign_features(
    repaired: &Repaired,
    features: &FeatureParams,
    requests: &mut [Requests],
) -> Result<(), ConeError> {
    if features.list.is_empty() {
        return Ok(());
    }
    let meshes = repaired.components.iter().enumerate();
    let meshes = meshes.filter_map(|(i, component)| Some((i, component.mesh.as_ref().ok()?)));
    let mut edges_of: BTreeMap<[u32; 2], Vec<(usize, EdgeId)>> = BTreeMap::new();
    for (i, mesh) in meshes {
        for e in mesh.connectivity.edges() {
            let mut ends = mesh.connectivity.edge_vertices(e);
            ends.sort_by_key(|&v| mesh.source_vertex[v]);
            let ends = ends.map(|v| mesh.source_vertex[v]);
            edges_of.entry(ends).or_default().push((i, e));
        }
    }
    let first = features.file_first_vertex;
    let key = features
        .file
        .as_ref()
        .map_or("features.list", |_| "features.file");
    let given = |vertex: u32| u64::from(vertex) + u64::from(first);
    let key_of = |vertex: u32| match first {
        0 => key.to_owned(),
        _ => format!(
            "{key} ({} there, where vertices count from {first})",
            given(vertex)
        ),
    };
    for pair in features.list.iter().flat_map(|row| row.windows(2)) {
        let mut ends = [NONE; 2];
        let mut is_built = true;
        for (end, &vertex) in ends.iter_mut().zip(pair) {
            let place = find(repaired, &key_of(vertex), Some(vertex), None, |_, _| true)?;
            // The one that stands for all that were welded.
            match place {
                Some((i, v, _)) => {
                    let mesh = repaired.components[i].mesh.as_ref();
                    *end = mesh.map_or(NONE, |mesh| mesh.source_vertex[v]);
                }
                None => is_built = false,
            }
        }
        if !is_built || ends[0] == ends[1] {
            continue;
        }
        ends.sort_unstable();
        let Some(found) = edges_of.get(&ends) else {
            return Err(ConeError::NoSuchEdge {
                key: key.to_owned(),
                ends: [given(pair[0]), given(pair[1])],
            });
        };
        for &(i, e) in found {
            requests[i].features.push(e);
        }
    }
    Ok(())
}

/// How messages name an entry of the list: by its line where it was read from a file.
fn key_of_cone(cones: &ConeParams, index: usize, spec: &ConeSpec) -> String {
    match (cones.file_lines.get(index), spec.vertex) {
        (Some(line), Some(vertex)) if cones.file_first_vertex > 0 => format!(
            "cones.file line {line} ({} there, where vertices count from {})",
            u64::from(vertex) + u64::from(cones.file_first_vertex),
            cones.file_first_vertex
        ),
        (Some(line), _) => format!("cones.file line {line}"),
        (None, _) => format!("cones.list[{index}]"),
    }
}

/// Keys that say two different things.
fn check_keys(
    cones: &ConeParams,
    boundary: &BoundaryParams,
    features: &FeatureParams,
) -> Result<(), ConeError> {
    let conflict = |first: &str, second: String| {
        Err(ConeError::Conflict {
            first: first.into(),
            second,
        })
    };
    let name = |strategy: ConeStrategy| format!("cones.strategy = \"{}\"", strategy.name());
    let given = match &cones.file {
        None => "cones.list",
        Some(_) if !cones.list.is_empty() => "cones.file",
        // Only where somebody made the parameters by hand.
        Some(path) => return Err(ConeError::FileNotRead { path: path.clone() }),
    };
    match cones.strategy {
        ConeStrategy::Auto => {}
        ConeStrategy::Listed if cones.list.is_empty() => return Err(ConeError::EmptyList),
        ConeStrategy::Listed => {}
        other if !cones.list.is_empty() => return conflict(given, name(other)),
        _ => {}
    }
    if cones.vertex.is_some() && cones.strategy != ConeStrategy::Single {
        return conflict("cones.vertex", name(cones.strategy));
    }
    if cones.curvature.is_some() && cones.strategy != ConeStrategy::Spread {
        return conflict("cones.curvature", name(cones.strategy));
    }
    match (&features.file, cones.strategy) {
        // Only where somebody made the parameters by hand.
        (Some(path), _) if features.list.is_empty() => {
            return Err(ConeError::FeaturesNotRead { path: path.clone() });
        }
        (_, ConeStrategy::Field) => {}
        (file, other) if !features.list.is_empty() => {
            let given = file.as_ref().map_or("features.list", |_| "features.file");
            return conflict(given, name(other));
        }
        _ => {}
    }
    let condition = boundary.effective_condition();
    let shown = format!("boundary.condition = \"{}\"", condition.name());
    let by_total = matches!(
        condition,
        BoundaryCondition::Uniform | BoundaryCondition::Prescribed
    );
    if !boundary.totals.is_empty() && !by_total {
        return conflict("boundary.totals", shown);
    }
    if !boundary.list.is_empty() && condition != BoundaryCondition::Prescribed {
        return conflict("boundary.list", shown);
    }
    if boundary.list.is_empty() && condition == BoundaryCondition::Prescribed {
        return Err(ConeError::EmptyBoundaryList);
    }
    if !boundary.corners.is_empty() && condition != BoundaryCondition::Corners {
        return conflict("boundary.corners", shown);
    }
    Ok(())
}

impl ConeStrategy {
    /// As the configuration writes it.
    pub fn name(self) -> &'static str {
        match self {
            ConeStrategy::Auto => "auto",
            ConeStrategy::Listed => "listed",
            ConeStrategy::Field => "field",
            ConeStrategy::Single => "single",
            ConeStrategy::Spread => "spread",
            ConeStrategy::None => "none",
        }
    }
}

impl BoundaryCondition {
    /// As the configuration and the output write it.
    pub fn name(self) -> &'static str {
        match self {
            BoundaryCondition::Free => "free",
            BoundaryCondition::Uniform => "uniform",
            BoundaryCondition::Corners => "corners",
            BoundaryCondition::Prescribed => "prescribed",
        }
    }
}

/// Component, vertex and source vertex of a place; `None` where its component failed.
fn find(
    repaired: &Repaired,
    key: &str,
    vertex: Option<u32>,
    point: Option<[f64; 3]>,
    candidate: impl Fn(&Mesh, VertexId) -> bool,
) -> Result<Option<(usize, VertexId, u32)>, ConeError> {
    let key = || key.to_string();
    match (vertex, point) {
        (Some(vertex), None) => {
            let vertices = repaired.source_vertices();
            if vertex as usize >= vertices {
                return Err(ConeError::OutOfRange {
                    key: key(),
                    vertex,
                    vertices,
                });
            }
            let (component, v) = repaired
                .locate(vertex)
                .ok_or_else(|| ConeError::NotOnSurface { key: key(), vertex })?;
            let built = repaired.components[component].mesh.is_ok();
            Ok(built.then_some((component, v, vertex)))
        }
        (None, Some(point)) if point.iter().all(|x| x.is_finite()) => {
            Ok(nearest(repaired, point, candidate))
        }
        (None, Some(_)) => Err(ConeError::NonFinitePoint { key: key() }),
        _ => Err(ConeError::NoPlace { key: key() }),
    }
}

/// The candidate nearest to a point; the one with the lowest coordinates, then the lowest number, where there are several.
fn nearest(
    repaired: &Repaired,
    point: [f64; 3],
    candidate: impl Fn(&Mesh, VertexId) -> bool,
) -> Option<(usize, VertexId, u32)> {
    let meshes = repaired.components.iter().enumerate();
    meshes
        .filter_map(|(c, component)| Some((c, component.frame, component.mesh.as_ref().ok()?)))
        .flat_map(|(c, frame, mesh)| {
            mesh.positions
                .enumerate()
                .map(move |(v, p)| (c, mesh, v, frame.leave(*p)))
        })
        // Only vertices of the file: a name for the message is needed.
        .filter(|&(_, mesh, v, _)| mesh.source_vertex[v] != NONE && candidate(mesh, v))
        .min_by(|a, b| {
            let by_distance = distance(a.3, point).total_cmp(&distance(b.3, point));
            by_distance.then(spread::by_position(a.3, b.3))
        })
        .map(|(c, mesh, v, _)| (c, v, mesh.source_vertex[v]))
}
