//! Sharp edges and borders between materials, as chains that shall become straight lines of the atlas.
//!
//! *Enters:* a mesh, and edges that the user names. *Leaves:* chains of edges between junctions, the most important first. *Guaranteed:* the chains of a spanning forest come before those that close
//! cycles, since a cycle may ask for more than any metric has and a forest never does; the same order for the same mesh. *Not guaranteed:* that all of them can be met.

mod beside;
pub mod file;
mod noise;

use self::beside::Beside;
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::ids::{EdgeId, EdgeVec, HalfedgeId, NONE, VertexId, VertexVec};
use crate::geometry::mesh::{Mesh, cross, dot, sub, triangle_area};
use std::cmp::Ordering;
use std::path::PathBuf;

/// Fewest edges of a chain that counts where nobody named them: shorter ones are mostly noise, …
pub const LEAST_EDGES: usize = 5;
/// … unless they are as long as this, in square roots of the surface's area, ridges or valleys throughout, have room on both sides, and a flat side or long edges: edges of a solid.
pub const LONG: f64 = 0.05;
/// Least length of a chain of many edges, in square roots of the surface's area: about a side of the cells when there are 2,000. What is shorter has no place in a grid, however
/// many edges it has.
pub const LEAST_LENGTH: f64 = 0.02;
/// Length of edges on average, in square roots of the surface's area, from which a mesh is coarse and its edges are more than noise.
const COARSE: f64 = 0.1;

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
    let least = params.angle.to_radians();
    let sharp = wanted(mesh, params, named);
    let mut is_named = EdgeVec::filled(false, c.edge_count());
    named.iter().for_each(|&e| is_named[e] = true);
    let area: f64 = c
        .faces()
        .map(|f| triangle_area(mesh.face_positions(f)))
        .sum();
    // Which edges are of a ridge, of those that are sharp; others are between materials.
    let kinds = |f: &Feature| -> Vec<bool> {
        let sharp = f.edges.iter().filter(|&&e| bend[e] >= least);
        sharp.map(|&e| is_ridge(mesh, e)).collect()
    };
    let is_long =
        |f: &Feature| given_edges(mesh, f) >= LEAST_EDGES && f.length / area.sqrt() >= LEAST_LENGTH;
    let all = chains(mesh, &sharp).into_iter();
    let all: Vec<Feature> = all.map(|chain| feature(mesh, &bend, chain)).collect();
    let is_material = |f: &Feature| f.edges.iter().any(|&e| bend[e] < least);
    let tested = all.iter().filter(|f| is_long(f) && !is_material(f));
    let most = noise::most(tested.map(|f| noise::chance(&kinds(f))).collect());
    let is_no_chance = |f: &Feature| is_material(f) || noise::chance(&kinds(f)) <= most;
    let beside = Beside {
        mesh,
        sharp: &sharp,
        bend: &bend,
        least,
    };
    // Edges of a solid, as it seems, …
    let is_meant = |f: &Feature| {
        let kinds = kinds(f);
        let are_alike = kinds.iter().all(|&k| k == kinds[0]);
        let is_coarse = f.length / area.sqrt() >= COARSE * given_edges(mesh, f) as f64;
        let stands_out = || are_alike && (is_coarse || beside.has_flat_side(f));
        // Long single edges may be sides of a hole of eight.
        let may_be_step = given_edges(mesh, f) > 1 || f.length / area.sqrt() < LONG;
        let is_step = || may_be_step && beside.is_step(f);
        let is_one = (is_long(f) && is_no_chance(f) || stands_out()) && !is_step();
        is_material(f) || is_one
    };
    // … and those that have a place in a grid.
    let counts = |f: &Feature| {
        let has_place = || f.length / area.sqrt() >= LONG && beside.has_room(f);
        is_long(f) && is_no_chance(f) || has_place()
    };
    let total = |chains: &[Feature]| -> f64 {
        let lengths = chains.iter().map(|f| f.length);
        lengths.filter(|l| l / area.sqrt() >= LEAST_LENGTH).sum()
    };
    let whole = total(&all);
    let is_named = |f: &Feature| f.edges.iter().any(|&e| is_named[e]);
    let meant = all.into_iter().filter(|f| is_named(f) || is_meant(f));
    let (mut found, lost): (Vec<Feature>, Vec<Feature>) =
        meant.partition(|f| is_named(f) || counts(f));
    let lost = total(&lost);
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

/// Edges of a chain that the input has: not parts of them.
fn given_edges(mesh: &Mesh, f: &Feature) -> usize {
    let is_given = |v: &&VertexId| mesh.source_vertex[**v] != NONE;
    f.vertices[1..].iter().filter(is_given).count()
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

/// Maximal chains of sharp edges between vertices where other than two of them meet, or which lie on the boundary; then closed ones.
fn chains(mesh: &Mesh, sharp: &EdgeVec<bool>) -> Vec<Vec<VertexId>> {
    let c = &mesh.connectivity;
    let mut degree = VertexVec::filled(0, c.vertex_count());
    for (e, _) in sharp.enumerate().filter(|(_, s)| **s) {
        c.edge_vertices(e).into_iter().for_each(|v| degree[v] += 1);
    }
    let mut is_walked = EdgeVec::filled(false, c.edge_count());
    let neighbours = |v: VertexId| {
        let ways = c.outgoing(v).flat_map(|h| [h, c.prev(h)]);
        ways.map(|h| c.edge(h)).filter(|&e| sharp[e])
    };
    let other = |e: EdgeId, v: VertexId| {
        let [a, b] = c.edge_vertices(e);
        if a == v { b } else { a }
    };
    let is_end = |v: VertexId| degree[v] != 2 || c.is_boundary_vertex(v);
    let mut chains = Vec::new();
    let mut walk = |start: VertexId, is_walked: &mut EdgeVec<bool>| {
        while let Some(first) = neighbours(start).find(|&e| !is_walked[e]) {
            let mut chain = vec![start];
            let (mut v, mut e) = (start, first);
            loop {
                is_walked[e] = true;
                v = other(e, v);
                chain.push(v);
                if v == start || is_end(v) {
                    break;
                }
                match neighbours(v).find(|&e| !is_walked[e]) {
                    Some(next) => e = next,
                    None => break,
                }
            }
            chains.push(chain);
        }
    };
    for v in c.vertices().filter(|&v| degree[v] > 0 && is_end(v)) {
        walk(v, &mut is_walked);
    }
    for v in c.vertices().filter(|&v| degree[v] > 0) {
        walk(v, &mut is_walked);
    }
    chains
}

fn feature(mesh: &Mesh, bend: &EdgeVec<f64>, vertices: Vec<VertexId>) -> Feature {
    let c = &mesh.connectivity;
    let between = |pair: &[VertexId]| {
        let ways = c.outgoing(pair[0]).flat_map(|h| [h, c.prev(h)]);
        let mut edges = ways.map(|h| c.edge(h));
        edges.find(|&e| c.edge_vertices(e).contains(&pair[1]))
    };
    let edges: Vec<EdgeId> = vertices.windows(2).filter_map(between).collect();
    let length: f64 = edges.iter().map(|&e| mesh.edge_length(e)).sum();
    let turned: f64 = edges.iter().map(|&e| mesh.edge_length(e) * bend[e]).sum();
    Feature {
        vertices,
        edges,
        length,
        angle: if length > 0.0 { turned / length } else { 0.0 },
    }
}

#[cfg(test)]
mod tests;
