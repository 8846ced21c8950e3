//! Sharp edges and borders between materials, as chains that shall become straight lines of the atlas.
//!
//! *Enters:* a mesh, and edges that the user names. *Leaves:* chains of edges between junctions, the most important first. *Guaranteed:* the chains of a spanning forest come before those that close
//! cycles, since a cycle may ask for more than any metric has and a forest never does; the same order for the same mesh. *Not guaranteed:* that all of them can be met.

mod beside;
mod chains;
pub mod file;
mod noise;
mod solid;

use self::chains::feature;
use self::solid::{Kind, Surface};
pub use self::solid::{LEAST_EDGES, LEAST_LENGTH, LONG};
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::ids::{EdgeId, EdgeVec, HalfedgeId, VertexId};
use crate::geometry::mesh::{Mesh, cross, dot, sub, triangle_area};
use std::cmp::Ordering;
use std::path::PathBuf;

/// Sine of the angle at a corner below which a face has no direction.
const FLAT: f64 = 1e-6;

/// What a cross field follows and which edges shall become lines; for cones of a field and quarter turns only.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FeatureParams {
    /// Edges whose faces' normals differ by this or more, degrees; 180: none.
    pub angle: f64,
    /// Edges between faces of different materials too.
    pub materials: bool,
    /// Edges by name, in place of those that `angle` finds: vertices of the input file in a row, each joined to the next.
    pub list: Vec<Vec<u32>>,
    /// File with rows of vertices, one a line. [`crate::config::load`] puts them into `list`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Number of the first vertex in `file`: 0 or 1.
    pub file_first_vertex: u32,
    /// Weight of principal curvature beside smoothness.
    pub curvature: f64,
    /// Side of the cells of the grid that the field is for, in square roots of the component's area; 0: unknown, or as small as one likes. A build sets it.
    #[serde(skip)]
    pub cell: f64,
}

impl Default for FeatureParams {
    fn default() -> Self {
        Self {
            angle: 40.0,
            materials: false,
            list: Vec::new(),
            file: None,
            file_first_vertex: 0,
            curvature: 0.003,
            cell: 0.0,
        }
    }
}

/// A chain of edges, from junction to junction, end to end, or closed.
#[derive(Clone, Debug, PartialEq)]
pub struct Feature {
    /// Its vertices in order; the first is the last again where it is closed.
    pub vertices: Vec<VertexId>,
    /// Its edges in order, one fewer.
    pub edges: Vec<EdgeId>,
    /// Length in space, source units.
    pub length: f64,
    /// Mean angle between the normals of both sides, weighed by length, radians.
    pub angle: f64,
}

impl Feature {
    /// How much it counts beside others.
    fn importance(&self) -> f64 {
        self.length * self.angle
    }
}

/// Edges that shall be followed: named ones, sharp ones and those between materials; not on the border.
fn wanted(mesh: &Mesh, params: &FeatureParams, named: &[EdgeId]) -> EdgeVec<bool> {
    let c = &mesh.connectivity;
    let least = params.angle.to_radians();
    let by_angle = params.list.is_empty() && params.angle < 180.0;
    let mut is_named = EdgeVec::filled(false, c.edge_count());
    named.iter().for_each(|&e| is_named[e] = true);
    let is_wanted = |e: EdgeId| {
        let between = params.materials && is_between_materials(mesh, e);
        let is_one = between || is_named[e] || (by_angle && bend(mesh, e) >= least);
        is_one && !c.is_boundary_edge(e)
    };
    c.edges().map(is_wanted).collect()
}

/// What there is to follow.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features {
    /// The most important first.
    pub chains: Vec<Feature>,
    /// Part of the length of all chains of sharp edges that is of a solid, as it seems (neither noise nor steps as wide as edges of the mesh), and in no feature; chains shorter than [`LEAST_LENGTH`] aside.
    pub left_out: f64,
}

/// The features of a mesh; see the module docs. `named` are the edges of the list that it has.
pub fn features(mesh: &Mesh, params: &FeatureParams, named: &[EdgeId]) -> Features {
    let c = &mesh.connectivity;
    let bend: EdgeVec<f64> = c.edges().map(|e| bend(mesh, e)).collect();
    let mut is_named = EdgeVec::filled(false, c.edge_count());
    named.iter().for_each(|&e| is_named[e] = true);
    let area: f64 = c
        .faces()
        .map(|f| triangle_area(mesh.face_positions(f)))
        .sum();
    let surface = Surface {
        mesh,
        bend: &bend,
        least: params.angle.to_radians(),
        is_named: &is_named,
        side: area.sqrt(),
    };
    let lines = wanted(mesh, params, named);
    let all = chains::chains(mesh, &lines, |_| false).into_iter();
    let all: Vec<Feature> = all.map(|chain| feature(mesh, &bend, chain)).collect();
    let kinds = surface.kinds(&all, &lines);
    let all: Vec<_> = all.into_iter().zip(kinds).collect();
    let total = |is_one: &dyn Fn(Kind) -> bool| -> f64 {
        let some = all.iter().filter(|(_, kind)| is_one(*kind));
        let lengths = some.map(|(f, _)| f.length);
        lengths.filter(|l| l / surface.side >= LEAST_LENGTH).sum()
    };
    let (lost, whole) = (total(&|kind| kind == Kind::Crowded), total(&|_| true));
    let mut found = undivided(mesh, &bend, &lines, &all);
    found.sort_by(|a, b| {
        let order = b.importance().partial_cmp(&a.importance());
        order.unwrap_or(Ordering::Equal)
    });
    let mut joined = UnionFind::new(c.vertex_count());
    // The border belongs together as it is.
    for e in c.edges().filter(|&e| c.is_boundary_edge(e)) {
        let [a, b] = c.edge_vertices(e);
        joined.join(a.index(), b.index());
    }
    let joins = |f: &Feature| {
        let ends = [f.vertices.first(), f.vertices.last()];
        matches!(ends, [Some(a), Some(b)] if joined.join(a.index(), b.index()))
    };
    let (mut forest, cycles): (Vec<_>, Vec<_>) = found.into_iter().partition(joins);
    forest.extend(cycles);
    Features {
        chains: forest,
        left_out: if lost > 0.0 { lost / whole } else { 0.0 },
    }
}

/// The chains that shall become lines, of all. Where only edges of noise meet a line, it goes on, unless it turns by more than 60° there.
fn undivided(
    mesh: &Mesh,
    bend: &EdgeVec<f64>,
    sharp: &EdgeVec<bool>,
    all: &[(Feature, Kind)],
) -> Vec<Feature> {
    let of = |is_one: &dyn Fn(Kind) -> bool| {
        let mut edges = EdgeVec::filled(false, mesh.connectivity.edge_count());
        for (f, _) in all.iter().filter(|(_, kind)| is_one(*kind)) {
            f.edges.iter().for_each(|&e| edges[e] = true);
        }
        edges
    };
    let (lines, meant) = (of(&|k| k == Kind::Line), of(&|k| k != Kind::Noise));
    let degrees = [sharp, &meant, &lines].map(|edges| chains::degrees(mesh, edges));
    let [of_sharp, of_meant, of_lines] = &degrees;
    let is_joint = |v: VertexId| {
        let is_met = of_sharp[v] != of_lines[v];
        is_met && (of_meant[v] != of_lines[v] || !chains::goes_on(mesh, &lines, v))
    };
    let chains = chains::chains(mesh, &lines, is_joint).into_iter();
    chains.map(|chain| feature(mesh, bend, chain)).collect()
}

/// The angle of a face at the tail of a halfedge, radians; 0 where it has none.
pub(crate) fn corner_angle(mesh: &Mesh, h: HalfedgeId) -> f64 {
    let c = &mesh.connectivity;
    let at = |v: VertexId| mesh.positions[v];
    let (p, q, r) = (at(c.tail(h)), at(c.head(h)), at(c.apex(h)));
    let (a, b) = (sub(q, p), sub(r, p));
    let across = cross(a, b);
    dot(across, across).sqrt().atan2(dot(a, b))
}

/// The angle between the normals of both sides, radians; 0 on the boundary and where a face has no normal.
pub(crate) fn bend(mesh: &Mesh, e: EdgeId) -> f64 {
    let c = &mesh.connectivity;
    let h = c.edge_halfedge(e);
    let Some(t) = c.twin(h) else { return 0.0 };
    let normal = |h| {
        let [p, q, r] = mesh.face_positions(c.face(h));
        let (a, b) = (sub(q, p), sub(r, p));
        let normal = cross(a, b);
        let has_width = dot(normal, normal) > FLAT * FLAT * dot(a, a) * dot(b, b);
        has_width.then_some(normal)
    };
    let (Some(m), Some(n)) = (normal(h), normal(t)) else {
        return 0.0;
    };
    let across = cross(m, n);
    dot(across, across).sqrt().atan2(dot(m, n))
}

fn is_between_materials(mesh: &Mesh, e: EdgeId) -> bool {
    let c = &mesh.connectivity;
    let h = c.edge_halfedge(e);
    let of = |h| mesh.face_material.as_slice().get(c.face(h).index());
    c.twin(h).is_some_and(|t| of(h) != of(t))
}

/// Whether faces at an edge look away from each other, as at a ridge, and not towards each other, as in a valley.
fn is_ridge(mesh: &Mesh, e: EdgeId) -> bool {
    let c = &mesh.connectivity;
    let h = c.edge_halfedge(e);
    let [p, q, r] = mesh.face_positions(c.face(h));
    let beyond = c.twin(h).map_or(p, |t| mesh.positions[c.apex(t)]);
    dot(cross(sub(q, p), sub(r, p)), sub(beyond, p)) < 0.0
}

#[cfg(test)]
mod tests;
