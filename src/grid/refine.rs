//! Coarse meshes with vertices wherever cones of a grid may be wanted.
//!
//! *Enters:* a mesh. *Leaves:* the same surface, with vertices on long edges so that no wide part of it is without. *Guaranteed:* new vertices lie on old edges and keep their distance from each other and from old ones; there are not more than
//! fit on a wide surface of that area; old vertices keep their numbers; a mesh without long edges stays as it is.
//!
//! Cones are vertices. A tetrahedron needs eight cones of three quarter turns and has four vertices; a flat end of a cylinder, all of whose vertices lie around it, wants four cones of three
//! cells inside, and would have cells there with a corner of half a turn. Where sharp edges leave cones to a part of the surface, vertices are about a cell apart, elsewhere more.

use super::regions::need_cones;
use crate::atlas::charted::lift_mesh;
use crate::geometry::ids::{EdgeId, FaceId, FaceVec};
use crate::geometry::mesh::{Mesh, cross, distance, dot, sub, triangle_area};
use crate::geometry::subdivision::Subdivision;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The squares of the least distances between new vertices, in parts of the surface's area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spacing {
    /// Where cones are needed.
    needed: f64,
    elsewhere: f64,
}

/// Places for cones on the smallest parts of a file: four times as many as a tetrahedron needs.
const FEWEST: f64 = 32.0;
/// The spacing of a hundred.
const ENOUGH: f64 = 0.01;

/// Those of a first attempt, for a number of cells, and of others where float64 does not hold what comes of the first: as wide everywhere, as close, wider; with the last a mesh stays as it is.
pub(crate) fn spacings(cells: usize) -> Vec<Spacing> {
    // About a cell and two cells, but for small parts of a file and for very fine grids.
    let of = |cells: f64, most| 1.0 / cells.clamp(FEWEST, most);
    let close = of(0.8 * cells as f64, 1600.0);
    let wide = of(0.2 * cells as f64, 400.0);
    let all = [
        [close, wide],
        // On small parts they may be too few.
        [wide.min(ENOUGH); 2],
        [wide; 2],
        [0.25 * wide; 2],
        [4.0 * wide; 2],
        [f64::INFINITY; 2],
    ];
    let mut all = all
        .map(|[needed, elsewhere]| Spacing { needed, elsewhere })
        .to_vec();
    all.dedup();
    all
}

/// Where an edge may be split, one after another. Not in halves, where texels of a cell lie, too: these would be on edges of faces, which say little of them.
const PARTS: [f64; 16] = [
    0.47, 0.53, 0.38, 0.62, 0.44, 0.56, 0.41, 0.59, 0.35, 0.65, 0.32, 0.68, 0.29, 0.71, 0.26, 0.74,
];

/// The least distance between new vertices, by faces; edges of more than twice that are long.
fn apart(mesh: &Mesh, spacing: Spacing) -> FaceVec<f64> {
    let faces = mesh.connectivity.faces();
    let area: f64 = faces.map(|f| triangle_area(mesh.face_positions(f))).sum();
    let need = need_cones(mesh);
    let of_face = need.iter().map(|need| match need {
        true => (spacing.needed * area).sqrt(),
        false => (spacing.elsewhere * area).sqrt(),
    });
    of_face.collect()
}

/// Whether a mesh has long edges.
pub(crate) fn is_coarse(mesh: &Mesh, spacing: Spacing) -> bool {
    has_long_edges(mesh, &apart(mesh, spacing))
}

fn has_long_edges(mesh: &Mesh, apart: &FaceVec<f64>) -> bool {
    let c = &mesh.connectivity;
    let mut halfedges = c.halfedges();
    halfedges.any(|h| mesh.edge_length(c.edge(h)) > 2.0 * apart[c.face(h)])
}

/// See the module docs.
pub(crate) fn refined(mesh: Mesh, spacing: Spacing) -> Mesh {
    let apart = apart(&mesh, spacing);
    if !has_long_edges(&mesh, &apart) {
        return mesh;
    }
    let mut places = Places::new(apart.iter().fold(0.0, |most: f64, &x| most.max(x)));
    for &p in mesh.positions.as_slice() {
        places.take(p, None);
    }
    let mut fine = Subdivision::identity(&mesh);
    // Lengths of equal edges may differ in their last digits.
    let length = |fine: &Subdivision, e: EdgeId| {
        let [a, b] = fine.connectivity.edge_vertices(e);
        distance(fine.position[a], fine.position[b]) as f32
    };
    let apart = |fine: &Subdivision, e: EdgeId| {
        let beside = faces(fine, e).map(|f| apart[fine.parent[f]]);
        beside.fold(f64::INFINITY, f64::min)
    };
    let mut longest = BinaryHeap::new();
    let push = |longest: &mut BinaryHeap<_>, fine: &Subdivision, e: EdgeId| {
        let length = length(fine, e);
        if f64::from(length) > 2.0 * apart(fine, e) {
            longest.push((length.to_bits(), Reverse(e)));
        }
    };
    for e in mesh.connectivity.edges() {
        push(&mut longest, &fine, e);
    }
    // Discs around them, as dense as discs are at most. On needles, which have no room for discs, there would be more.
    let mut left = (2.0 / (3.0_f64.sqrt() * spacing.needed)) as usize;
    while left > 0
        && let Some((bits, Reverse(e))) = longest.pop()
    {
        if bits != length(&fine, e).to_bits() {
            continue;
        }
        let (normal, apart) = (normal(&fine, e), apart(&fine, e));
        let [a, b] = fine.connectivity.edge_vertices(e).map(|v| fine.position[v]);
        let at = |t: f64| std::array::from_fn(|i| (1.0 - t) * a[i] + t * b[i]);
        let is_free = |&t: &f64| places.is_free(at(t), normal, apart);
        let Some(part) = PARTS.into_iter().find(is_free) else {
            continue;
        };
        left -= 1;
        let vertex = fine.split_edge(e, part);
        places.take(fine.position[vertex], Some(normal));
        let c = &fine.connectivity;
        let around: Vec<EdgeId> = c.outgoing(vertex).map(|h| c.edge(h)).collect();
        for e in around {
            push(&mut longest, &fine, e);
        }
    }
    lift_mesh(mesh, &fine)
}

/// One or two.
fn faces(fine: &Subdivision, e: EdgeId) -> impl Iterator<Item = FaceId> {
    let c = &fine.connectivity;
    let h = c.edge_halfedge(e);
    [Some(h), c.twin(h)]
        .into_iter()
        .flatten()
        .map(|h| c.face(h))
}

/// Sum of the normals of an edge's faces, by their areas.
fn normal(fine: &Subdivision, e: EdgeId) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for f in faces(fine, e) {
        let vertices = fine.connectivity.face_vertices(f);
        let [p, q, r] = vertices.map(|v| fine.position[v]);
        let normal = cross(sub(q, p), sub(r, p));
        (0..3).for_each(|i| sum[i] += normal[i]);
    }
    sum
}

/// A point and, if it is new, its normal.
type Place = ([f64; 3], Option<[f64; 3]>);

/// Points in space that others keep their distance from.
struct Places {
    /// Side of the cubes: the greatest distance that is asked for.
    side: f64,
    /// By cubes.
    taken: FxHashMap<[i64; 3], Vec<Place>>,
}

impl Places {
    fn new(side: f64) -> Self {
        Self {
            side,
            taken: FxHashMap::default(),
        }
    }

    fn cube(&self, p: [f64; 3]) -> [i64; 3] {
        p.map(|x| (x / self.side).floor() as i64)
    }

    fn take(&mut self, p: [f64; 3], normal: Option<[f64; 3]>) {
        self.taken
            .entry(self.cube(p))
            .or_default()
            .push((p, normal));
    }

    /// No point is near, but new ones on the other side of something thin.
    fn is_free(&self, p: [f64; 3], normal: [f64; 3], apart: f64) -> bool {
        let [x, y, z] = self.cube(p);
        let around = |x: i64| x.saturating_sub(1)..=x.saturating_add(1);
        let cubes =
            around(x).flat_map(|x| around(y).flat_map(move |y| around(z).map(move |z| [x, y, z])));
        let mut near = cubes.filter_map(|cube| self.taken.get(&cube)).flatten();
        near.all(|&(q, other)| {
            distance(p, q) >= apart || other.is_some_and(|n| dot(n, normal) < 0.0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::Soup;
    use crate::geometry::polycube::polycube;
    use crate::repair::{RepairParams, repair};
    use std::f64::consts::TAU;

    const SPACING: Spacing = Spacing {
        needed: 1.0 / 1600.0,
        elsewhere: 1.0 / 400.0,
    };

    fn area(mesh: &Mesh) -> f64 {
        let faces = mesh.connectivity.faces();
        faces
            .map(|f| triangle_area(mesh.face_positions(f)))
            .sum::<f64>()
    }

    /// Refines; checks what is guaranteed, and returns the surface and the least distance of new vertices where cones are needed.
    fn checked(mesh: &Mesh) -> (Mesh, f64) {
        let apart = (SPACING.needed * area(mesh)).sqrt();
        let fine = refined(mesh.clone(), SPACING);
        assert!((area(&fine) - area(mesh)).abs() < 1e-12 * area(mesh));
        let (old, new) = (mesh.positions.as_slice(), fine.positions.as_slice());
        assert_eq!(&new[..old.len()], old);
        let topology = |mesh: &Mesh| mesh.connectivity.topology().euler_characteristic;
        assert_eq!(topology(&fine), topology(mesh));
        for (i, &p) in new.iter().enumerate().skip(old.len()) {
            let nearest = new[..i].iter().map(|&q| distance(p, q));
            let nearest = nearest.fold(f64::INFINITY, f64::min);
            assert!(nearest >= apart, "{nearest} of {apart}");
        }
        (fine, apart)
    }

    #[test]
    fn a_cube_gets_vertices_on_its_edges_and_faces() {
        let (fine, apart) = checked(&polycube([[0, 0, 0]], |_, _, _| true));
        let c = &fine.connectivity;
        let longest = c.edges().map(|e| fine.edge_length(e)).fold(0.0, f64::max);
        // No face of a cube needs a cone.
        assert!(longest < 6.0 * apart, "{longest} of {apart}");
        assert!(
            (150..400).contains(&c.vertex_count()),
            "{}",
            c.vertex_count()
        );
        // Once is enough, nearly.
        let again = refined(fine.clone(), SPACING).positions.len();
        assert!(again < fine.positions.len() + 10);
    }

    #[test]
    fn bars_thinner_than_the_spacing_get_vertices_all_along() {
        let mut bar = polycube([[0, 0, 0]], |_, _, _| true);
        bar.positions
            .as_mut_slice()
            .iter_mut()
            .for_each(|p| p[0] *= 200.0);
        let wide = (SPACING.elsewhere * area(&bar)).sqrt();
        assert!(wide > 1.2);
        let (fine, _) = checked(&bar);
        let c = &fine.connectivity;
        let longest = c.edges().map(|e| fine.edge_length(e)).fold(0.0, f64::max);
        assert!(longest < 20.0 * wide, "{longest} of {wide}");
    }

    #[test]
    fn ends_of_a_cylinder_get_vertices_inside() {
        let n = 48u32;
        let corner = |k: u32, z: f64| {
            let (y, x) = (TAU * f64::from(k) / f64::from(n)).sin_cos();
            [x, y, z]
        };
        let positions = (0..2 * n).map(|k| corner(k % n, f64::from(k / n)));
        let mut faces = Vec::new();
        for k in 0..n {
            let next = (k + 1) % n;
            faces.extend([[k, next, n + next], [k, n + next, n + k]]);
        }
        for k in 1..n - 1 {
            faces.extend([[0, k + 1, k], [n, n + k, n + k + 1]]);
        }
        let soup = Soup::from_triangles(positions.collect(), faces);
        let repaired = repair(&soup, &RepairParams::default()).expect("a cylinder");
        let component = repaired.components.into_iter().next().expect("one");
        let frame = component.frame;
        let (fine, apart) = checked(&component.mesh.expect("connected"));
        // Wherever one stands on an end, a vertex is not far.
        let ends = |p: &[f64; 3]| (frame.leave(*p)[2] - 0.5).abs() > 0.5 - 1e-9;
        let vertices: Vec<_> = fine.positions.iter().filter(|p| ends(p)).collect();
        for (i, j) in (-9..10).flat_map(|i| (-9..10).map(move |j| (i, j))) {
            let at = [f64::from(i) / 10.0, f64::from(j) / 10.0, 0.0];
            if at[0].hypot(at[1]) < 1.0 {
                let p = frame.enter(at);
                let near = vertices.iter().map(|q| distance(p, **q));
                let near = near.fold(f64::INFINITY, f64::min);
                assert!(near < 2.0 * apart, "{at:?}: {near} of {apart}");
            }
        }
    }

    #[test]
    fn a_fine_mesh_stays() {
        let cubes = (0..20).flat_map(|i| (0..20).map(move |j| [i, j, 0]));
        let mesh = polycube(cubes, |_, _, _| true);
        let fine = refined(mesh.clone(), SPACING);
        assert_eq!(fine.connectivity, mesh.connectivity);
    }
}
