//! Parts of a surface between its sharp edges, and whether a grid needs cones inside of them.
//!
//! *Enters:* a mesh. *Leaves:* for every face whether lines along all sharp edges would leave cones to its part: whether 4 χ less the quarter turns that its border makes at its corners, rounded, is other than 0 (Gauss, Bonnet). A side of a
//! box needs none, an end of a cylinder four, a plate with a round hole four of five cells. *Not guaranteed:* that there are none where none are needed.

use crate::flow::features::{FeatureParams, bend, corner_angle};
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::ids::{FaceId, FaceVec, HalfedgeId};
use crate::geometry::mesh::Mesh;
use std::f64::consts::{FRAC_PI_2, PI};

/// See the module docs.
pub(super) fn need_cones(mesh: &Mesh) -> FaceVec<bool> {
    let c = &mesh.connectivity;
    let sharp = FeatureParams::default().angle.to_radians();
    let mut regions = UnionFind::new(c.face_count());
    for h in c.halfedges() {
        if let Some(t) = c.twin(h)
            && bend(mesh, c.edge(h)) < sharp
        {
            regions.join(c.face(h).index(), c.face(t).index());
        }
    }
    let region: FaceVec<usize> = c.faces().map(|f| regions.find(f.index())).collect();
    let of = |f: FaceId| region[f];
    let is_border = |h: HalfedgeId| c.twin(h).is_none_or(|t| of(c.face(t)) != of(c.face(h)));
    // Quarter turns of curvature by regions: 4 (F − E + V) without what lies on borders, which has as many edges as vertices.
    let mut quarters = vec![0i64; c.face_count()];
    for f in c.faces() {
        quarters[of(f)] += 4;
    }
    for e in c.edges() {
        let h = c.edge_halfedge(e);
        if !is_border(h) {
            quarters[of(c.face(h))] -= 4;
        }
    }
    for v in c.vertices() {
        let mut around = c.outgoing(v);
        let is_inside = !c.is_boundary_vertex(v) && !around.any(is_border);
        if is_inside {
            quarters[of(c.face(c.vertex_halfedge(v)))] += 4;
        }
    }
    for h in c.halfedges().filter(|&h| is_border(h)) {
        // Around its head, from the next halfedge to that on the border.
        let mut out = c.next(h);
        let mut angle = corner_angle(mesh, out);
        while !is_border(out)
            && let Some(t) = c.twin(out)
        {
            out = c.next(t);
            angle += corner_angle(mesh, out);
        }
        quarters[of(c.face(h))] -= ((PI - angle) / FRAC_PI_2).round() as i64;
    }
    c.faces().map(|f| quarters[of(f)] != 0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::polycube::polycube;
    use crate::grid::tests::{mesh, no_lines, plate};

    /// How many faces need cones, of how many.
    fn needed(mesh: &Mesh) -> (usize, usize) {
        let need = need_cones(mesh);
        (need.iter().filter(|n| **n).count(), need.len())
    }

    #[test]
    fn sides_of_boxes_need_no_cones() {
        assert_eq!(needed(&polycube([[0, 0, 0]], |_, _, _| true)).0, 0);
        // An L has six corners, one of them inward; around a hole there are four outward and four inward.
        let l = [[0, 0, 0], [1, 0, 0], [0, 1, 0]];
        assert_eq!(needed(&polycube(l, |_, _, _| true)).0, 0);
        let ring = (0..9).filter(|i| *i != 4).map(|i| [i % 3, i / 3, 0]);
        assert_eq!(needed(&polycube(ring, |_, _, _| true)).0, 0);
        assert_eq!(needed(&mesh(&plate(&[[0, 0]], 2, no_lines))).0, 0);
    }

    #[test]
    fn what_is_round_needs_cones() {
        let n = 24;
        let rim = |k: usize, z: f64| {
            let (y, x) = (2.0 * PI * k as f64 / f64::from(n)).sin_cos();
            [x, y, z]
        };
        let n = n as usize;
        let mut positions: Vec<[f64; 3]> = (0..2 * n).map(|k| rim(k % n, (k / n) as f64)).collect();
        positions.push([0.0, 0.0, 1.0]);
        let top = 2 * n as u32;
        let (mut side, mut end) = (Vec::new(), Vec::new());
        for k in 0..n as u32 {
            let (m, next) = (n as u32, (k + 1) % n as u32);
            side.extend([[k, next, m + next], [k, m + next, m + k]]);
            end.push([top, m + k, m + next]);
        }
        let faces: Vec<[u32; 3]> = side.iter().chain(&end).copied().collect();
        let soup = crate::geometry::mesh::Soup::from_triangles(positions, faces);
        let repaired = crate::repair::repair(&soup, &Default::default()).expect("a cup");
        let mesh = repaired.components.into_iter().next().expect("one").mesh;
        let mesh = mesh.expect("connected");
        // The end, and not the side.
        let need = need_cones(&mesh);
        let at = |f: FaceId| mesh.face_positions(f);
        for f in mesh.connectivity.faces() {
            let [p, q, r] = at(f);
            let is_end = p[2] == q[2] && q[2] == r[2];
            assert_eq!(need[f], is_end, "{:?}", at(f));
        }
        assert_eq!(needed(&mesh), (end.len(), mesh.connectivity.face_count()));
    }
}
