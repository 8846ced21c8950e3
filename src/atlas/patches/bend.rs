//! How much a surface bends: what each of its edges adds to the error of an image.
//!
//! *Enters:* the slit disk. *Leaves:* areas and bend of faces and of sets of them, as [`Demand`](super::demand::Demand) wants them.
//!
//! Faces that are parts of one face of the source lie in its plane however narrow they are, so that normals, and the distance between the middles
//! of two faces, are those of source faces.

use super::demand::Sums;
use super::slit::Slit;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceId, FaceVec, HalfedgeId};
use crate::geometry::mesh::{Mesh, cross, norm, sub};
use rayon::prelude::*;

/// Cosine of the dihedral angle of a crease.
const CREASE: f64 = 0.8;

/// The bend of all edges.
pub(super) struct Bends {
    /// θ² L, and that over the distance of the faces' middles; zero where the edge is cut.
    of_edge: EdgeVec<[f64; 2]>,
    /// Where the surface turns sharply.
    pub is_crease: EdgeVec<bool>,
    /// Areas of every face, and the bend of its edges, half of which belongs to the face on the other side.
    pub of_face: FaceVec<Sums>,
}

/// θ² L of every edge with faces of two source faces beside it, and that over the distance of their middles; whether the surface turns sharply there. `area` is that of every face in space,
/// `beside` the face across a halfedge.
pub(crate) fn edge_bends(
    mesh: &Mesh,
    area: &FaceVec<f64>,
    beside: impl Fn(HalfedgeId) -> Option<FaceId> + Sync,
) -> (EdgeVec<[f64; 2]>, EdgeVec<bool>) {
    let c = &mesh.connectivity;
    let extent = mesh.diagonal().max(f64::MIN_POSITIVE);
    let source = numbers(&mesh.source_face);
    let count = source.iter().max().map_or(0, |&most| most as usize + 1);
    let mut normals = vec![([0.0; 3], 0.0); count];
    for f in c.faces() {
        let p = mesh.face_positions(f);
        let side = |k: usize| sub(p[k], p[0]).map(|x| x / extent);
        let n = cross(side(1), side(2));
        let (sum, whole): &mut ([f64; 3], f64) = &mut normals[source[f] as usize];
        (0..3).for_each(|i| sum[i] += n[i]);
        *whole += area[f];
    }
    let between = |e: EdgeId| {
        let h = c.edge_halfedge(e);
        let (f, g) = (source[c.face(h)], source[beside(h)?]);
        (f != g).then(|| (f.min(g), f.max(g)))
    };
    // Edges between two source faces together, in ascending order as sums must be.
    let edges = (0..c.edge_count()).into_par_iter().map(EdgeId::new);
    let edges = edges.filter_map(|e| Some((between(e)?, e)));
    let mut edges: Vec<((u32, u32), EdgeId)> = edges.collect();
    edges.par_sort_unstable();
    let mut bend = EdgeVec::filled([0.0; 2], c.edge_count());
    let mut is_crease = EdgeVec::filled(false, c.edge_count());
    let of_group = |group: &[((u32, u32), EdgeId)]| {
        let mut rows = Vec::with_capacity(group.len());
        let lengths = group.iter().map(|&(_, e)| mesh.edge_length(e));
        let lengths: Vec<f64> = lengths.collect();
        let length: f64 = lengths.iter().sum();
        let Some(&((f, g), _)) = group.first() else {
            return rows;
        };
        let ((n, of_n), (m, of_m)) = (normals[f as usize], normals[g as usize]);
        let cosine = (0..3).map(|i| n[i] * m[i]).sum::<f64>() / (norm(n) * norm(m));
        let square = cosine.clamp(-1.0, 1.0).acos().powi(2);
        let apart = (of_n + of_m) / (3.0 * length);
        for (&(_, e), length) in group.iter().zip(lengths) {
            let crease = square * length;
            if crease.is_finite() && apart > 0.0 && apart.is_finite() {
                rows.push((e, [crease, crease / apart], cosine < CREASE));
            }
        }
        rows
    };
    let groups = edges.par_chunk_by(|a, b| a.0 == b.0);
    let rows: Vec<_> = groups.flat_map_iter(of_group).collect();
    for (e, bent, is_sharp) in rows {
        (bend[e], is_crease[e]) = (bent, is_sharp);
    }
    (bend, is_crease)
}

impl Bends {
    pub fn new(slit: &Slit) -> Self {
        let c = slit.connectivity;
        let (of_edge, is_crease) = edge_bends(slit.mesh, &slit.source_area, |h| slit.beside(h));
        let mut bends = Self {
            of_edge,
            is_crease,
            of_face: FaceVec::default(),
        };
        let faces = (0..c.face_count()).into_par_iter().map(FaceId::new);
        let of_face = faces.map(|f| bends.inside(slit, f, |_| true));
        bends.of_face = of_face.collect::<Vec<_>>().into();
        bends
    }

    /// Areas of a face, and the bend of those of its edges beyond which `is_inside` accepts the face.
    pub fn inside(&self, slit: &Slit, f: FaceId, is_inside: impl Fn(FaceId) -> bool) -> Sums {
        let shrunk = (-slit.log_scale[f]).exp();
        let mut bend = [0.0; 2];
        for h in slit.connectivity.face_halfedges(f) {
            if slit.beside(h).is_some_and(&is_inside) {
                // Half of it belongs to the face on the other side.
                let [crease, bent] = self.of_edge[slit.connectivity.edge(h)];
                bend[0] += 0.5 * crease * shrunk.powi(3);
                bend[1] += 0.5 * bent * shrunk.powi(4);
            }
        }
        Sums {
            area: slit.source_area[f],
            flat: slit.flat_area[f],
            bend,
        }
    }
}

/// Whole numbers from 0 on in the place of ids, the same where they are the same.
fn numbers(ids: &FaceVec<u32>) -> FaceVec<u32> {
    let mut order: Vec<(u32, FaceId)> = ids.enumerate().map(|(f, &id)| (id, f)).collect();
    order.par_sort_unstable();
    let mut numbers = FaceVec::filled(0, order.len());
    for (number, group) in (0..).zip(order.chunk_by(|a, b| a.0 == b.0)) {
        group.iter().for_each(|&(_, f)| numbers[f] = number);
    }
    numbers
}
