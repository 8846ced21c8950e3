//! Small slit disks made by hand, for tests.

use crate::atlas::cut::{CutGraph, slit_copies};
use crate::atlas::develop::Development;
use crate::atlas::plane;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceVec, NONE, VertexVec};
use crate::geometry::mesh::Mesh;

/// What `layout` takes.
pub(crate) struct Sample {
    pub mesh: Mesh,
    pub length: EdgeVec<f64>,
    pub cut: CutGraph,
    pub development: Development,
    pub log_scale: VertexVec<f64>,
}

/// Builds a sample from faces, positions, and plane coordinates a corner. An edge is cut where its two
/// faces do not agree on its ends or where `also_cut` says so. `offset` is added to the
/// central coordinates after the lengths are taken, which costs them digits.
pub(crate) fn build(
    faces: &[[u32; 3]],
    positions: Vec<[f64; 3]>,
    uv: Vec<[[f64; 2]; 3]>,
    also_cut: impl Fn(u32, u32) -> bool,
    offset: [f64; 2],
) -> Sample {
    let c = Connectivity::from_faces(faces, positions.len()).unwrap();
    let uv: FaceVec<_> = uv.into();
    let length: EdgeVec<f64> = c
        .edges()
        .map(|e| {
            let h = c.edge_halfedge(e);
            let (t, k) = (uv[c.face(h)], c.corner(h));
            plane::distance(t[k], t[(k + 1) % 3])
        })
        .collect();
    let is_cut: EdgeVec<bool> = c
        .edges()
        .map(|e| {
            let [a, b] = c.edge_vertices(e).map(|v| v.raw());
            !c.is_boundary_edge(e) && (also_cut(a, b) || also_cut(b, a))
        })
        .collect();
    let (copy, copies) = slit_copies(&c, &is_cut);
    let central = uv
        .iter()
        .map(|t| t.map(|p| [p[0] + offset[0], p[1] + offset[1]]));
    Sample {
        length,
        cut: CutGraph {
            segment: EdgeVec::filled(NONE, c.edge_count()),
            is_cut,
            segments: Vec::new(),
            nodes: Vec::new(),
        },
        development: Development::from_coordinates(central.collect(), copy, copies),
        log_scale: VertexVec::filled(0.0, positions.len()),
        mesh: Mesh {
            source_vertex: (0..positions.len() as u32).collect(),
            source_face: (0..faces.len() as u32).collect(),
            face_material: FaceVec::filled(NONE, faces.len()),
            attributes: Vec::new(),
            positions: positions.into(),
            connectivity: c,
        },
    }
}

/// A strip of columns × rows squares; the vertex (i, j) is `i * (rows + 1) + j`.
pub(crate) fn strip(
    columns: usize,
    rows: usize,
    position: impl Fn(f64, f64) -> [f64; 3],
    place: impl Fn(f64, f64) -> [f64; 2],
    offset: [f64; 2],
) -> Sample {
    let at = |i: usize, j: usize| (i * (rows + 1) + j) as u32;
    let st = |v: u32| {
        let (i, j) = (v as usize / (rows + 1), v as usize % (rows + 1));
        (i as f64 / columns as f64, j as f64 / rows as f64)
    };
    let mut faces = Vec::new();
    for i in 0..columns {
        for j in 0..rows {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    let count = ((columns + 1) * (rows + 1)) as u32;
    let positions = (0..count).map(st).map(|(s, t)| position(s, t)).collect();
    let uv = faces
        .iter()
        .map(|f| f.map(|v| place(st(v).0, st(v).1)))
        .collect();
    build(&faces, positions, uv, |_, _| false, offset)
}

/// A flat unit square.
pub(crate) fn square(n: usize) -> Sample {
    strip(n, n, |s, t| [s, t, 0.0], |s, t| [s, t], [0.0; 2])
}

/// A flat strip mapped by the exponential: the log scale runs from 0 down to −`depth`.
pub(crate) fn ramp(columns: usize, rows: usize, depth: f64) -> Sample {
    let width = depth * rows as f64 / columns as f64;
    strip(
        columns,
        rows,
        |s, t| [depth * s, width * t, 0.0],
        |s, t| {
            let (radius, angle) = ((-depth * s).exp(), -width * t);
            [radius * angle.cos(), radius * angle.sin()]
        },
        [1.0, -2.0],
    )
}

/// A strip wound around a point so many times, clockwise; as thick as said where the inner radius is 1.
pub(crate) fn wound(columns: usize, rows: usize, turns: f64, thickness: f64) -> Sample {
    let place = |s: f64, t: f64| {
        let (sin, cos) = (-std::f64::consts::TAU * turns * s).sin_cos();
        [(1.0 + thickness * t) * cos, (1.0 + thickness * t) * sin]
    };
    strip(columns, rows, |s, t| [s, t, 0.0], place, [0.0; 2])
}
