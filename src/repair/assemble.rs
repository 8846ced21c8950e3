//! From glued faces to meshes: one vertex a fan, one mesh a component, no doubled edge.

use crate::geometry::connectivity::Connectivity;
use crate::geometry::frame::Frame;
use crate::geometry::ids::{EdgeId, HalfedgeId, HalfedgeVec, NONE, VertexId, VertexVec};
use crate::geometry::mesh::{AttributeKind, CornerAttribute, Mesh, Soup, cross, sub};
use crate::geometry::morton::along_curve;
use crate::repair::clean::DraftFace;
use crate::repair::glue::Gluing;
use crate::repair::log::{Change, RepairLog};
use crate::repair::{Component, ComponentError, Repaired};
use rayon::prelude::*;

/// Faces of a component that keep the order of the file. Larger components take it from the Morton curve: neighbours that lie far from each other in memory, as in
/// files that were subdivided, make every stage half as slow again (200,000 vertices, `benches/README.md`); arrays of smaller ones fit into caches.
pub(super) const MOST_IN_ANY_ORDER: usize = 1 << 17;

/// Faces with their final corners, and who is joined to whom.
struct Glued {
    /// Welded vertices of the corners, flipped faces turned over.
    vertices: Vec<[u32; 3]>,
    /// Halfedge joined to each, or [`NONE`].
    twin: Vec<u32>,
    /// Fan of each corner, numbered by lowest corner.
    fan: Vec<u32>,
    /// Component of each face, numbered by lowest face.
    component: Vec<u32>,
    /// Number of components.
    components: usize,
}

/// Puts the meshes together; see the module docs of [`crate::repair`].
pub fn assemble(
    soup: &Soup,
    stands_for: &[u32],
    draft: &[DraftFace],
    gluing: &Gluing,
    mut changes: Vec<Change>,
) -> Repaired {
    let glued = turn_over(draft, gluing);
    let (surface_vertex, fan_home) = number_vertices(&glued, soup.positions.len(), &mut changes);
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); glued.components];
    let (mut local_vertex, mut local_face) = (vec![NONE; fan_home.len()], vec![NONE; draft.len()]);
    for (f, &c) in glued.component.iter().enumerate() {
        members[c as usize].push(f as u32);
    }
    let mut contradiction = vec![None; glued.components];
    for pair in &gluing.contradictions {
        let c = glued.component[pair[0] as usize] as usize;
        contradiction[c].get_or_insert(pair.map(|f| draft[f as usize].source));
    }
    let mut places = vec![[NONE; 2]; soup.positions.len()];
    let mut components = Vec::with_capacity(members.len());
    for (c, faces) in members.iter_mut().enumerate() {
        let corners_of = |f: u32| (0..3).map(move |k| 3 * f as usize + k);
        let vertex = |corner: usize| surface_vertex[glued.fan[corner] as usize];
        // Surface vertices ascend in the order of the file, copies last: so do the local ones.
        let mut vertices: Vec<u32> = (faces.iter())
            .flat_map(|&f| corners_of(f).map(vertex))
            .collect();
        vertices.sort_unstable();
        vertices.dedup();
        let position = |v: u32| soup.positions[fan_home[v as usize].0 as usize];
        let corners: Vec<[f64; 3]> = vertices.iter().map(|&v| position(v)).collect();
        let frame = Frame::of(&corners);
        drop(corners);
        if faces.len() > MOST_IN_ANY_ORDER {
            let centre = |i: usize| {
                let points =
                    corners_of(faces[i]).map(|corner| frame.enter(position(vertex(corner))));
                points.fold([0.0; 3], |sum, p| {
                    [sum[0] + p[0], sum[1] + p[1], sum[2] + p[2]]
                })
            };
            let (_, order) = along_curve(faces.len(), centre);
            *faces = order.iter().map(|&i| faces[i as usize]).collect();
            vertices.clear();
        }
        for (local, &v) in vertices.iter().enumerate() {
            local_vertex[v as usize] = local as u32;
        }
        for (local, &f) in faces.iter().enumerate() {
            local_face[f as usize] = local as u32;
            for v in corners_of(f).map(vertex) {
                if local_vertex[v as usize] == NONE {
                    local_vertex[v as usize] = vertices.len() as u32;
                    vertices.push(v);
                }
            }
        }
        for (local, &v) in vertices.iter().enumerate() {
            let (source, is_first) = fan_home[v as usize];
            if is_first {
                places[source as usize] = [c as u32, local as u32];
            }
        }
        let positions = vertices.iter().map(|&v| frame.enter(position(v))).collect();
        let mesh = match contradiction[c] {
            Some([face, neighbour]) => Err(ComponentError::NonOrientable {
                face,
                neighbour,
                faces: faces.len(),
            }),
            None => {
                let source = vertices.iter().map(|&v| fan_home[v as usize].0).collect();
                build(
                    soup,
                    draft,
                    gluing,
                    &glued,
                    faces,
                    source,
                    positions,
                    |corner| local_vertex[vertex(corner) as usize],
                    |face| local_face[face] as usize,
                    &mut changes,
                )
            }
        };
        let lowest_source = faces.iter().map(|&f| draft[f as usize].source).min();
        let lowest_vertex = vertices.iter().map(|&v| fan_home[v as usize].0).min();
        components.push(Component {
            mesh,
            faces: faces.len(),
            first_source_face: lowest_source.unwrap_or(NONE),
            first_source_vertex: lowest_vertex.unwrap_or(NONE),
            log: RepairLog::default(),
            frame,
        });
    }
    for v in 0..stands_for.len() {
        places[v] = places[stands_for[v] as usize];
    }
    share_log(&mut components, &changes, soup, draft, &glued, &places);
    Repaired {
        components,
        log: RepairLog { changes },
        places,
    }
}

fn turn_over(draft: &[DraftFace], gluing: &Gluing) -> Glued {
    // Corners 0 2 1: side k becomes side 2 − k.
    let side = |s: u32| {
        let (f, k) = (s / 3, s % 3);
        if gluing.flipped[f as usize] {
            3 * f + 2 - k
        } else {
            s
        }
    };
    let mut twin = vec![NONE; 3 * draft.len()];
    for (s, &t) in gluing
        .partner
        .iter()
        .enumerate()
        .filter(|(_, t)| **t != NONE)
    {
        twin[side(s as u32) as usize] = side(t);
    }
    let vertices: Vec<[u32; 3]> = draft
        .iter()
        .zip(&gluing.flipped)
        .map(|(face, &flipped)| {
            let [a, b, c] = face.vertices;
            if flipped { [a, c, b] } else { [a, b, c] }
        })
        .collect();
    let next = |h: usize| h - h % 3 + (h % 3 + 1) % 3;
    let vertex = |h: usize| vertices[h / 3][h % 3];
    let mut fans = Classes::new(3 * draft.len());
    let mut pieces = Classes::new(draft.len());
    for (h, &t) in twin.iter().enumerate().filter(|(_, t)| **t != NONE) {
        let t = t as usize;
        // On a one-sided sheet joined sides may run alike.
        let (at_tail, at_head) = if vertex(h) == vertex(t) {
            (t, next(t))
        } else {
            (next(t), t)
        };
        fans.join(h, at_tail);
        fans.join(next(h), at_head);
        pieces.join(h / 3, t / 3);
    }
    let (fan, _) = fans.numbered();
    let (component, components) = pieces.numbered();
    Glued {
        vertices,
        twin,
        fan,
        component,
        components,
    }
}

/// A vertex of the surface for every fan: the first fan of a vertex keeps its place in the order of the
/// file, the others follow at the end. Also the source vertex of each surface vertex, and whether it is the first.
fn number_vertices(
    glued: &Glued,
    source_vertices: usize,
    changes: &mut Vec<Change>,
) -> (Vec<u32>, Vec<(u32, bool)>) {
    let mut first_fan = vec![NONE; source_vertices];
    let mut extra: Vec<(u32, u32)> = Vec::new();
    let mut fans = 0;
    for (corner, &fan) in glued.fan.iter().enumerate() {
        if fan < fans {
            continue;
        }
        fans = fan + 1;
        let v = glued.vertices[corner / 3][corner % 3];
        if first_fan[v as usize] == NONE {
            first_fan[v as usize] = fan;
        } else {
            extra.push((v, fan));
        }
    }
    extra.sort_unstable();
    for same in extra.chunk_by(|a, b| a.0 == b.0) {
        changes.push(Change::SplitVertex {
            vertex: same[0].0,
            copies: same.len() as u32,
        });
    }
    let firsts = (0..source_vertices as u32)
        .map(|v| (v, first_fan[v as usize], true))
        .filter(|(_, fan, _)| *fan != NONE);
    let copies = extra.iter().map(|&(v, fan)| (v, fan, false));
    let mut surface_vertex = vec![NONE; fans as usize];
    let mut home = Vec::with_capacity(fans as usize);
    for (v, fan, is_first) in firsts.chain(copies) {
        surface_vertex[fan as usize] = home.len() as u32;
        home.push((v, is_first));
    }
    (surface_vertex, home)
}

#[expect(
    clippy::too_many_arguments,
    reason = "one call, all of it the state of assemble"
)]
fn build(
    soup: &Soup,
    draft: &[DraftFace],
    gluing: &Gluing,
    glued: &Glued,
    faces: &[u32],
    source_vertex: Vec<u32>,
    positions: VertexVec<[f64; 3]>,
    local_vertex: impl Fn(usize) -> u32,
    local_face: impl Fn(usize) -> usize,
    changes: &mut Vec<Change>,
) -> Result<Mesh, ComponentError> {
    let mut tail = HalfedgeVec::default();
    let mut twin = Vec::with_capacity(3 * faces.len());
    for &f in faces {
        for h in 3 * f as usize..3 * f as usize + 3 {
            tail.push(VertexId::new(local_vertex(h) as usize));
            let t = glued.twin[h] as usize;
            let joined = glued.twin[h] != NONE;
            twin.push(joined.then(|| HalfedgeId::new(3 * local_face(t / 3) + t % 3)));
        }
    }
    let connectivity = Connectivity::from_gluing(tail, &twin, source_vertex.len())?;
    let attributes = soup
        .attributes
        .iter()
        .map(|a| CornerAttribute {
            kind: a.kind.clone(),
            components: a.components,
            values: Vec::with_capacity(3 * faces.len() * a.components),
        })
        .collect();
    let mut mesh = Mesh {
        connectivity,
        positions,
        source_vertex: source_vertex.into(),
        source_face: faces.iter().map(|&f| draft[f as usize].source).collect(),
        face_material: faces
            .iter()
            .map(|&f| soup.face_material[draft[f as usize].source as usize])
            .collect(),
        attributes,
    };
    for &f in faces {
        let f = f as usize;
        push_attributes(&mut mesh.attributes, soup, &draft[f], gluing.flipped[f]);
    }
    split_doubled_edges(&mut mesh, changes);
    Ok(mesh)
}

/// Appends the corner attributes of a face. Where a face is turned over, normals that point against the new
/// side are negated (and the handedness of their tangents with them, which keeps the bitangent); normals
/// that point along it were right already and stay.
fn push_attributes(
    attributes: &mut [CornerAttribute],
    soup: &Soup,
    face: &DraftFace,
    flipped: bool,
) {
    let order = if flipped { [0, 2, 1] } else { [0, 1, 2] };
    let p = order.map(|k| soup.positions[face.vertices[k] as usize]);
    let side = cross(sub(p[1], p[0]), sub(p[2], p[0]));
    let against = |value: &[f32]| {
        let along: f64 = (0..3).map(|c| f64::from(value[c]) * side[c]).sum();
        along < 0.0
    };
    let value = |from: &CornerAttribute, k: usize| match &face.within {
        None => from.corner(face.source as usize, k).to_vec(),
        Some(weights) => interpolate(from, face.source as usize, weights[k]),
    };
    let is_normal = |a: &CornerAttribute| a.kind == AttributeKind::Normal && a.components == 3;
    let normals = soup.attributes.iter().find(|a| is_normal(a));
    for (from, to) in soup.attributes.iter().zip(attributes) {
        for k in order {
            let mut value_here = value(from, k);
            let turns = flipped && normals.is_some_and(|n| against(&value(n, k)));
            if turns && is_normal(from) {
                value_here.iter_mut().for_each(|x| *x = -*x);
            } else if turns && from.kind == AttributeKind::Tangent && from.components == 4 {
                value_here[3] = -value_here[3];
            }
            to.values.extend_from_slice(&value_here);
        }
    }
}

fn interpolate(attribute: &CornerAttribute, face: usize, weights: [f64; 3]) -> Vec<f32> {
    let mut sum: Vec<f64> = (0..attribute.components)
        .map(|c| {
            (0..3)
                .filter(|&k| weights[k] != 0.0)
                .map(|k| weights[k] * f64::from(attribute.corner(face, k)[c]))
                .sum()
        })
        .collect();
    let direction = matches!(
        attribute.kind,
        AttributeKind::Normal | AttributeKind::Tangent
    );
    if direction && sum.len() >= 3 {
        let length = sum[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 {
            sum[..3].iter_mut().for_each(|x| *x /= length);
        }
    }
    sum.into_iter().map(|x| x as f32).collect()
}

/// Splits all but the first of several edges between the same two vertices: files that list triangles
/// cannot tell them apart. A new vertex has new edges only, so no other edge is doubled by that.
fn split_doubled_edges(mesh: &mut Mesh, changes: &mut Vec<Change>) {
    for e in doubled_edges(&mesh.connectivity) {
        let ends = mesh.connectivity.edge_vertices(e);
        let face = mesh.connectivity.face(mesh.connectivity.edge_halfedge(e));
        changes.push(Change::SplitEdge {
            ends: ends.map(|v| mesh.source_vertex[v]),
            face: mesh.source_face[face],
        });
        mesh.split_edge(e, 0.5);
    }
}

/// Every edge whose two ends an earlier edge joins already.
pub fn doubled_edges(connectivity: &Connectivity) -> Vec<EdgeId> {
    let mut edges: Vec<(u32, u32, EdgeId)> = connectivity
        .edges()
        .map(|e| {
            let [a, b] = connectivity.edge_vertices(e).map(VertexId::raw);
            (a.min(b), a.max(b), e)
        })
        .collect();
    edges.par_sort_unstable();
    let mut doubled: Vec<EdgeId> = edges
        .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
        .flat_map(|same| same[1..].iter().map(|x| x.2))
        .collect();
    doubled.sort_unstable();
    doubled
}

/// Gives every component the changes that concern it.
fn share_log(
    components: &mut [Component],
    changes: &[Change],
    soup: &Soup,
    draft: &[DraftFace],
    glued: &Glued,
    places: &[[u32; 2]],
) {
    if let [only] = components {
        only.log.changes = changes.to_vec();
        return;
    }
    let mut of_face = vec![NONE; soup.faces.len()];
    for (face, &c) in draft.iter().zip(&glued.component) {
        let slot = &mut of_face[face.source as usize];
        *slot = (*slot).min(c);
    }
    let of_vertex = |v: u32| places[v as usize][0];
    for change in changes {
        let c = match *change {
            Change::WeldedVertex { onto, .. } => of_vertex(onto),
            Change::RemovedFace { face, .. } => soup.faces[face as usize]
                .iter()
                .map(|&v| of_vertex(v))
                .find(|&c| c != NONE)
                .unwrap_or(NONE),
            Change::SplitFace { face, .. }
            | Change::FlippedFace { face }
            | Change::CutEdge { face, .. }
            | Change::SplitEdge { face, .. } => of_face[face as usize],
            Change::SplitVertex { vertex, .. } | Change::UnreferencedVertex { vertex } => {
                of_vertex(vertex)
            }
        };
        if let Some(component) = components.get_mut(c as usize) {
            component.log.changes.push(*change);
        }
    }
}

/// Disjoint sets; the lowest member stands for its set.
struct Classes {
    parent: Vec<u32>,
}

impl Classes {
    fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).collect(),
        }
    }

    fn root(&mut self, x: usize) -> u32 {
        let mut x = x as u32;
        while self.parent[x as usize] != x {
            let next = self.parent[x as usize];
            self.parent[x as usize] = self.parent[next as usize];
            x = next;
        }
        x
    }

    fn join(&mut self, x: usize, y: usize) {
        let (x, y) = (self.root(x), self.root(y));
        self.parent[x.max(y) as usize] = x.min(y);
    }

    /// The number of every element's set, in the order of their lowest members, and how many there are.
    fn numbered(mut self) -> (Vec<u32>, usize) {
        let mut count = 0;
        let mut number = vec![NONE; self.parent.len()];
        for x in 0..self.parent.len() {
            let root = self.root(x) as usize;
            if number[root] == NONE {
                number[root] = count;
                count += 1;
            }
            number[x] = number[root];
        }
        (number, count as usize)
    }
}
