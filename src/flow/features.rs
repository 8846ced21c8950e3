//! Sharp edges and borders between materials, as chains that shall become straight lines of the atlas.
//!
//! *Enters:* a mesh, and edges that the user names. *Leaves:* chains of edges between junctions, the most important first. *Guaranteed:* the chains of a spanning forest come before those that close
//! cycles, since a cycle may ask for more than any metric has and a forest never does; the same order for the same mesh. *Not guaranteed:* that all of them can be met.

pub mod file;

use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::ids::{EdgeId, EdgeVec, HalfedgeId, NONE, VertexId, VertexVec};
use crate::geometry::mesh::{Mesh, cross, dot, sub, triangle_area};
use std::cmp::Ordering;
use std::f64::consts::{LN_2, PI};
use std::path::PathBuf;

/// Fewest edges of a chain that counts where nobody named them: shorter ones are mostly noise, …
pub const LEAST_EDGES: usize = 5;
/// … unless they are as long as this, in square roots of the surface's area, ridges or valleys throughout, and have room on both sides: edges of a solid.
pub const LONG: f64 = 0.05;
/// The angle, radians, between such a chain and the next sharp edge at its ends that is room enough for cells.
const SHARPEST: f64 = 29.0 / 180.0 * PI;
/// Least length of a chain of many edges, in square roots of the surface's area: about a side of the cells when there are 2,000. What is shorter has no place in a grid, however
/// many edges it has.
pub const LEAST_LENGTH: f64 = 0.02;

/// Most that the chance may be by which edges of a chain are of a ridge, or of a valley, as often as they are: that of five alike. Those of noise are as often one as the other.
const CHANCE: f64 = 1.0 / 16.0;

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
    /// Part of the length of all chains of sharp edges that is in no feature, of those that have a place in a grid ([`LEAST_LENGTH`]); 0 where there are none.
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
    let counts = |f: &Feature| {
        let length = f.length / area.sqrt();
        let kinds = f.edges.iter().filter(|&&e| bend[e] >= least);
        let kinds: Vec<bool> = kinds.map(|&e| is_ridge(mesh, e)).collect();
        let is_long = given_edges(mesh, f) >= LEAST_EDGES && length >= LEAST_LENGTH;
        // What is not sharp is between materials.
        let is_material = kinds.len() < f.edges.len();
        let are_alike = kinds.iter().all(|&k| k == kinds[0]);
        is_long && (is_material || chance(&kinds) <= CHANCE)
            || length >= LONG && (is_material || are_alike) && has_room(mesh, &sharp, f)
            || f.edges.iter().any(|&e| is_named[e])
    };
    let all = chains(mesh, &sharp).into_iter();
    let all = all.map(|chain| feature(mesh, &bend, chain));
    let (mut found, others): (Vec<Feature>, Vec<Feature>) = all.partition(counts);
    let total = |chains: &[Feature]| -> f64 {
        let lengths = chains.iter().map(|f| f.length);
        lengths.filter(|l| l / area.sqrt() >= LEAST_LENGTH).sum()
    };
    let (kept, lost) = (total(&found), total(&others));
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
        left_out: if lost > 0.0 {
            lost / (kept + lost)
        } else {
            0.0
        },
    }
}

/// Edges of a chain that the input has: not parts of them.
fn given_edges(mesh: &Mesh, f: &Feature) -> usize {
    let is_given = |v: &&VertexId| mesh.source_vertex[**v] != NONE;
    f.vertices[1..].iter().filter(is_given).count()
}

/// Whether there is room for cells on both sides of a chain at both ends: the next sharp edge or border is not nearer than [`SHARPEST`], and there is one, unless the chain is closed.
fn has_room(mesh: &Mesh, sharp: &EdgeVec<bool>, f: &Feature) -> bool {
    let c = &mesh.connectivity;
    let ends = [
        (f.vertices.first(), f.edges.first()),
        (f.vertices.last(), f.edges.last()),
    ];
    let is_line = |e: EdgeId| sharp[e] || c.is_boundary_edge(e);
    let is_closed = f.vertices.first() == f.vertices.last();
    ends.into_iter().all(|(v, e)| {
        let (Some(&v), Some(&e)) = (v, e) else {
            return false;
        };
        let mut around: Vec<HalfedgeId> = c.outgoing(v).collect();
        let Some(at) = around.iter().position(|&h| c.edge(h) == e) else {
            return false;
        };
        let sum = |part: &[HalfedgeId]| part.iter().map(|&h| corner_angle(mesh, h)).sum::<f64>();
        let is_line = |h: &HalfedgeId| is_line(c.edge(*h));
        let is_end = around.iter().filter(|h| is_line(h)).count() < 3;
        if is_end && !is_closed && !c.is_boundary_vertex(v) {
            return false;
        }
        // Counterclockwise from this edge to the next line, and clockwise.
        let (left, right) = match c.is_boundary_vertex(v) {
            true => around.split_at(at),
            false => {
                around.rotate_left(at);
                (&around[..0], &around[..])
            }
        };
        let next = right.iter().skip(1).position(is_line);
        let next = next.map_or(right.len(), |i| i + 1);
        let before = if left.is_empty() { right } else { left };
        let last = before.iter().rposition(is_line).unwrap_or(0);
        [&right[..next], &before[last..]]
            .map(sum)
            .iter()
            .all(|&angle| angle >= SHARPEST)
    })
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

/// How likely it is that, of as many edges that are of a ridge or of a valley by chance, as many or more are of the same kind as here (sign test, both ways).
fn chance(kinds: &[bool]) -> f64 {
    let n = kinds.len();
    let ridges = kinds.iter().filter(|k| **k).count();
    let others = ridges.min(n - ridges);
    // Of all ways in which so few are others; logarithms, since 2⁻ⁿ may be too small for a number.
    let (mut ways, mut sum) = (-(n as f64) * LN_2, 0.0);
    for k in 0..=others {
        sum += f64::exp(ways);
        ways += ((n - k) as f64 / (k + 1) as f64).ln();
    }
    (2.0 * sum).min(1.0)
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
mod tests {
    use super::*;
    use crate::geometry::mesh::Soup;
    use crate::geometry::polycube::polycube;
    use crate::repair::{RepairParams, repair};

    /// A unit square with two squares of other materials, of sides 0.5 and 0.004, each between grid lines with `n` edges on every side.
    fn marked(n: u32) -> Mesh {
        let breaks = [0.0, 0.1, 0.6, 0.75, 0.754, 1.0];
        let mut line: Vec<f64> = breaks
            .windows(2)
            .flat_map(|part| {
                (0..n).map(|k| part[0] + (part[1] - part[0]) * f64::from(k) / f64::from(n))
            })
            .collect();
        line.push(1.0);
        let count = line.len() as u32;
        let positions = line.iter().flat_map(|y| line.iter().map(|x| [*x, *y, 0.0]));
        let mut faces = Vec::new();
        let mut materials = Vec::new();
        for (i, j) in (0..5 * n).flat_map(|j| (0..5 * n).map(move |i| (i, j))) {
            let a = count * j + i;
            faces.extend([[a, a + 1, a + count + 1], [a, a + count + 1, a + count]]);
            let material = match [i / n, j / n] {
                [1, 1] => 1,
                [3, 3] => 2,
                _ => 0,
            };
            materials.extend([material; 2]);
        }
        let mut soup = Soup::from_triangles(positions.collect(), faces);
        soup.face_material = materials;
        let repaired = repair(&soup, &RepairParams::default()).expect("a plain square");
        let first = repaired.components.into_iter().next().expect("one");
        first.mesh.expect("connected")
    }

    fn surface(positions: Vec<[f64; 3]>, faces: Vec<[u32; 3]>) -> Mesh {
        let soup = Soup::from_triangles(positions, faces);
        let repaired = repair(&soup, &RepairParams::default()).expect("a plain surface");
        let first = repaired.components.into_iter().next().expect("one");
        first.mesh.expect("connected")
    }

    #[test]
    fn single_edges_count_where_there_is_room_beside_them() {
        let sharp = |mesh: &Mesh| features(mesh, &FeatureParams::default(), &[]).chains.len();
        // All edges of a box, whichever way its sides are divided.
        let cube = polycube([[0, 0, 0]], |_, _, _| true);
        assert_eq!(sharp(&cube), 12);
        // Without a side: nothing is lost but the border.
        let faces = cube.connectivity.to_faces();
        let open = surface(cube.positions.as_slice().to_vec(), faces[2..].to_vec());
        assert_eq!(sharp(&open), 8);
        // Corners of 45° and 60°, …
        let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        let tetrahedron = |height| {
            let corners = [
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
                [0.0, 0.0, height],
            ];
            surface(corners.to_vec(), faces.clone())
        };
        assert_eq!(sharp(&tetrahedron(1.0)), 6);
        // … and of 18° and less, where three edges end: what is left are the three around the foot.
        assert_eq!(sharp(&tetrahedron(3.0)), 3);
    }

    #[test]
    fn chains_of_few_edges_count_where_they_are_ridges_or_valleys_throughout() {
        // Four edges in a row along the middle of a strip, each with a corner on both sides that lies as high as asked.
        let strip = |heights: [f64; 4]| {
            let middle = (0..5).map(|i| [f64::from(i) * 4.0, 0.0, 0.0]);
            let side = |y: f64| (0..4).map(move |i| [2.0 + 4.0 * f64::from(i), y]);
            let sides = [1.0, -1.0].map(|y| side(y).zip(heights).map(|([x, y], z)| [x, y, z]));
            let positions = middle.chain(sides.into_iter().flatten()).collect();
            let at = |i: u32| [[i, i + 1, i + 5], [i + 1, i, i + 9]];
            let between = |i: u32| [[i + 1, i + 6, i + 5], [i + 1, i + 9, i + 10]];
            let faces = (0..4).flat_map(at).chain((0..3).flat_map(between));
            surface(positions, faces.collect())
        };
        let all = |heights| features(&strip(heights), &FeatureParams::default(), &[]);
        let found = |heights| {
            let found = all(heights);
            assert_eq!(
                found.left_out,
                if found.chains.is_empty() { 1.0 } else { 0.0 }
            );
            found.chains.len()
        };
        assert_eq!(found([0.5; 4]), 1);
        assert_eq!(found([-0.5; 4]), 1);
        assert_eq!(found([0.5, -0.5, 0.5, -0.5]), 0);
        assert_eq!(found([0.5, 0.5, 0.5, -0.5]), 0);
    }

    /// Sharp edges of noise go up and down; those that marching cubes leave at a rim do so now and then.
    #[test]
    fn the_sign_test_is_that_of_tossed_coins() {
        let kinds =
            |ridges: usize, valleys: usize| [vec![true; ridges], vec![false; valleys]].concat();
        for n in 1..12usize {
            for ridges in 0..=n {
                // All that can come out.
                let others = ridges.min(n - ridges);
                let is_as_far = |toss: &u32| {
                    let ones = toss.count_ones() as usize;
                    ones.min(n - ones) <= others
                };
                let far = (0..1u32 << n).filter(is_as_far).count();
                let expected = far as f64 / f64::from(1u32 << n);
                assert!((chance(&kinds(ridges, n - ridges)) - expected).abs() < 1e-12);
            }
        }
        assert!(chance(&kinds(5, 0)) <= CHANCE && chance(&kinds(0, 5)) <= CHANCE);
        assert!(chance(&kinds(4, 0)) > CHANCE && chance(&kinds(6, 1)) > CHANCE);
        assert!(chance(&kinds(14, 3)) <= CHANCE && chance(&kinds(40, 37)) > CHANCE);
        assert!(chance(&kinds(5000, 0)) <= CHANCE && chance(&kinds(900, 800)) <= CHANCE);
    }

    #[test]
    fn ridges_look_away_from_each_other() {
        let cube = polycube([[0, 0, 0]], |_, _, _| true);
        let c = &cube.connectivity;
        let sharp = |e: &EdgeId| bend(&cube, *e) > 1.0;
        assert!(c.edges().filter(sharp).all(|e| is_ridge(&cube, e)));
        let faces = c.to_faces().into_iter().map(|[a, b, c]| [a, c, b]);
        let inside_out = surface(cube.positions.as_slice().to_vec(), faces.collect());
        let c = &inside_out.connectivity;
        let sharp = |e: &EdgeId| bend(&inside_out, *e) > 1.0;
        assert!(c.edges().filter(sharp).all(|e| !is_ridge(&inside_out, e)));
    }

    #[test]
    fn which_chains_count_does_not_depend_on_the_density_of_the_mesh() {
        let params = FeatureParams {
            angle: 180.0,
            materials: true,
            ..FeatureParams::default()
        };
        for n in [2, 4, 8] {
            let found = features(&marked(n), &params, &[]).chains;
            assert_eq!(found.len(), 1, "{n}");
            assert_eq!(found[0].edges.len(), 4 * n as usize);
            assert!((found[0].length - 2.0).abs() < 1e-12);
        }
    }
}
