//! Everything that is linear on the faces of a surface, carried over to a subdivision of it.
//!
//! *Enters:* a surface with metric, cut and charts, and a subdivision. *Leaves:* the same on the finer faces. *Guaranteed:* the same
//! surface, the same flat metric, the same charts and transitions: only faces are divided. Flat lengths come from differences of weights
//! in the face that they lie in, so small faces keep their relative accuracy (`docs/method.md`, 6), and pieces of an edge add up to it.

use crate::atlas::charts::{Chart, ChartFace, Charts, Transition};
use crate::atlas::cut::{CutGraph, Segment, slit_copies};
use crate::atlas::develop::Development;
use crate::atlas::rounding;
use crate::flow::prescription::Prescription;
use crate::flow::ricci::FlatMetric;
use crate::geometry::ids::{
    EdgeId, EdgeVec, FaceId, FaceVec, HalfedgeId, NONE, VertexId, VertexVec,
};
use crate::geometry::mesh::Mesh;
use crate::geometry::subdivision::Subdivision;
use crate::geometry::triangle::area;
use std::f64::consts::{PI, TAU};

/// A surface with its flat metric, slit, developed and covered by charts.
#[derive(Clone, Debug)]
pub struct Charted {
    /// The surface.
    pub mesh: Mesh,
    /// Flat metric on its edges.
    pub metric: FlatMetric,
    /// Target curvature of its vertices.
    pub prescription: Prescription,
    /// The cut on it.
    pub cut: CutGraph,
    /// The central chart.
    pub central: Development,
    /// All others.
    pub charts: Charts,
}

/// Carries over; the subdivision's connectivity and positions become the surface's own.
pub(crate) fn lift(coarse: Charted, fine: &Subdivision) -> Charted {
    let Charted {
        mesh,
        metric,
        prescription,
        cut,
        central,
        charts,
    } = coarse;
    let cut_fine = lift_cut(&mesh, &cut, fine);
    let central = lift_central(&central, fine, &cut_fine);
    let charts = lift_charts(charts, fine, mesh.connectivity.face_count());
    let vertices = fine.connectivity.vertex_count();
    let extended = |values: VertexVec<f64>| -> VertexVec<f64> {
        let mut values = values.into_vec();
        values.resize(vertices, 0.0);
        values.into()
    };
    let mut length = flat_lengths(&mesh, &metric.length, fine);
    // Old vertices have the angles that they had, new ones are flat.
    let mut wanted = rounding::angle_sums(&mesh.connectivity, &metric.length).into_vec();
    let c = &fine.connectivity;
    wanted.extend(
        c.vertices()
            .skip(wanted.len())
            .map(|v| match c.is_boundary_vertex(v) {
                true => PI,
                false => TAU,
            }),
    );
    rounding::round(c, &mut length, &wanted.into());
    Charted {
        metric: FlatMetric {
            length,
            log_scale: lift_log_scale(&mesh, &metric.log_scale, fine),
            curvature: extended(metric.curvature),
            ..metric
        },
        prescription: Prescription {
            target: extended(prescription.target),
            ..prescription
        },
        cut: cut_fine,
        central,
        charts,
        mesh: lift_mesh(mesh, fine),
    }
}

fn between<const N: usize>(values: [[f64; N]; 3], weights: [f64; 3]) -> [f64; N] {
    match weights.iter().position(|&w| w == 1.0) {
        Some(k) => values[k],
        None => std::array::from_fn(|i| (0..3).map(|k| weights[k] * values[k][i]).sum()),
    }
}

/// A mesh with finer faces; attributes are interpolated.
pub(crate) fn lift_mesh(mesh: Mesh, fine: &Subdivision) -> Mesh {
    let c = &fine.connectivity;
    let mut source_vertex = mesh.source_vertex.into_vec();
    source_vertex.resize(c.vertex_count(), NONE);
    let attributes = mesh.attributes.iter().map(|attribute| {
        let mut values = Vec::with_capacity(c.halfedge_count() * attribute.components);
        for (h, corner) in fine.corner.enumerate() {
            let parent = fine.parent[c.face(h)].index();
            match corner.weights.iter().position(|&w| w == 1.0) {
                Some(k) => values.extend_from_slice(attribute.corner(parent, k)),
                None => {
                    let terms = [0, 1, 2].map(|k| (k, corner.weights[k]));
                    values.extend(attribute.mix(parent, &terms));
                }
            }
        }
        attribute.with_values(values)
    });
    let of_parent = |values: &FaceVec<u32>| -> FaceVec<u32> {
        fine.parent.iter().map(|&f| values[f]).collect()
    };
    Mesh {
        attributes: attributes.collect(),
        source_vertex: source_vertex.into(),
        source_face: of_parent(&mesh.source_face),
        face_material: of_parent(&mesh.face_material),
        positions: fine.position.clone(),
        connectivity: c.clone(),
    }
}

/// A face laid in the plane by its flat lengths, from corner 0 on: where corners 1 and 2 lie, seen from there.
fn frame(length: [f64; 3]) -> [[f64; 2]; 2] {
    let [opposite, l2, l1] = length;
    // Corner 1 lies on the first axis. From sorted differences, so that slivers keep their height.
    let height = 2.0 * area(length).unwrap_or(0.0) / l1;
    let along = ((l2 - opposite) * (l2 + opposite) / l1 + l1) / 2.0;
    [[l1, 0.0], [along, height]]
}

fn flat_lengths(mesh: &Mesh, length: &EdgeVec<f64>, fine: &Subdivision) -> EdgeVec<f64> {
    let (c, base) = (&fine.connectivity, &mesh.connectivity);
    let flat = |e: EdgeId| {
        let h = c.edge_halfedge(e);
        let parent = fine.parent[c.face(h)];
        let [p, q] = [h, c.next(h)].map(|h| fine.corner[h].weights);
        let d: [f64; 3] = std::array::from_fn(|k| q[k] - p[k]);
        match fine.side_of_parent(h) {
            Some(k) => {
                let whole = length[base.edge(base.corner_halfedge(parent, k))];
                // Weights of a corner that is far off have all their digits, those of a near one are what is left of 1.
                let far = match p[k].min(q[k]) > 0.5 {
                    true => (k + 1) % 3,
                    false => k,
                };
                let towards = d[far].abs().min(1.0);
                if towards == 1.0 {
                    whole
                } else {
                    whole * towards
                }
            }
            None => {
                // Seen from the nearest corner, for the same reason.
                let near = [1, 2].into_iter().fold(0, |near, k| {
                    if p[k] + q[k] > p[near] + q[near] {
                        k
                    } else {
                        near
                    }
                });
                let of = |k: usize| (near + k) % 3;
                let edges = base.face_edges(parent);
                let [b, c] = frame([0, 1, 2].map(|k| length[edges[of(k)]]));
                let (s, t) = (d[of(1)], d[of(2)]);
                (s * b[0] + t * c[0]).hypot(s * b[1] + t * c[1])
            }
        }
    };
    c.edges().map(flat).collect()
}

fn lift_log_scale(mesh: &Mesh, log_scale: &VertexVec<f64>, fine: &Subdivision) -> VertexVec<f64> {
    let (c, base) = (&fine.connectivity, &mesh.connectivity);
    let value = |v: VertexId| {
        if v.index() < log_scale.len() {
            return log_scale[v];
        }
        let h = c.vertex_halfedge(v);
        let corners = base.face_vertices(fine.parent[c.face(h)]);
        between(corners.map(|v| [log_scale[v]]), fine.corner[h].weights)[0]
    };
    c.vertices().map(value).collect()
}

/// Cut edges become chains.
fn lift_cut(mesh: &Mesh, cut: &CutGraph, fine: &Subdivision) -> CutGraph {
    let (c, base) = (&fine.connectivity, &mesh.connectivity);
    // (halfedge of the surface, where on it a fine one begins, the fine one)
    let mut pieces: Vec<(HalfedgeId, f64, HalfedgeId)> = Vec::new();
    for h in c.halfedges() {
        let Some(k) = fine.side_of_parent(h) else {
            continue;
        };
        let along = base.corner_halfedge(fine.parent[c.face(h)], k);
        if cut.is_cut[base.edge(along)] {
            pieces.push((along, fine.corner[h].weights[(k + 1) % 3], h));
        }
    }
    pieces.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let chain = |along: HalfedgeId| {
        let first = pieces.partition_point(|p| p.0 < along);
        let last = pieces.partition_point(|p| p.0 <= along);
        pieces[first..last].iter().map(|p| p.2)
    };
    let mut lifted = CutGraph {
        is_cut: EdgeVec::filled(false, c.edge_count()),
        segment: EdgeVec::filled(NONE, c.edge_count()),
        segments: Vec::with_capacity(cut.segments.len()),
        nodes: cut.nodes.clone(),
    };
    for (i, segment) in cut.segments.iter().enumerate() {
        let halfedges: Vec<HalfedgeId> = segment.halfedges.iter().flat_map(|&h| chain(h)).collect();
        for &h in &halfedges {
            lifted.is_cut[c.edge(h)] = true;
            lifted.segment[c.edge(h)] = i as u32;
        }
        lifted.segments.push(Segment { halfedges });
    }
    lifted
}

fn lift_central(central: &Development, fine: &Subdivision, cut: &CutGraph) -> Development {
    let c = &fine.connectivity;
    let (copy, copies) = slit_copies(c, &cut.is_cut);
    // One place a copy: its corners agree up to rounding only.
    let mut position = vec![[f64::NAN; 2]; copies];
    for h in c.halfedges() {
        let place = &mut position[copy[h] as usize];
        if place[0].is_nan() {
            *place = between(central.uv[fine.parent[c.face(h)]], fine.corner[h].weights);
        }
    }
    let corners = |f| c.face_halfedges(f).map(|h| position[copy[h] as usize]);
    Development {
        uv: c.faces().map(corners).collect(),
        copy,
        copies,
        closing_error: central.closing_error,
    }
}

fn lift_charts(charts: Charts, fine: &Subdivision, faces: usize) -> Charts {
    let c = &fine.connectivity;
    let mut children: Vec<(FaceId, FaceId)> = c.faces().map(|f| (fine.parent[f], f)).collect();
    children.sort_unstable();
    let mut first = vec![0usize; faces + 1];
    for (parent, _) in &children {
        first[parent.index() + 1] += 1;
    }
    for f in 0..faces {
        first[f + 1] += first[f];
    }
    let of = |parent: FaceId| &children[first[parent.index()]..first[parent.index() + 1]];
    let divided = |entry: ChartFace| {
        let uv = move |f: FaceId| {
            let corners = c.face_halfedges(f);
            corners.map(|h| between(entry.uv, fine.corner[h].weights))
        };
        of(entry.face).iter().map(move |&(_, face)| ChartFace {
            face,
            sector: entry.sector,
            uv: uv(face),
        })
    };
    let lifted: Vec<Chart> = charts
        .charts
        .into_iter()
        .map(|chart| Chart {
            kind: chart.kind,
            faces: chart.faces.into_iter().flat_map(divided).collect(),
        })
        .collect();
    let transitions = charts.transitions.into_iter().map(|t| {
        let faces = lifted[t.to.index()].faces.iter();
        Transition {
            faces: faces.filter(|f| f.sector == t.sector).count(),
            ..t
        }
    });
    Charts {
        transitions: transitions.collect(),
        charts: lifted,
        gluings: charts.gluings,
    }
}
