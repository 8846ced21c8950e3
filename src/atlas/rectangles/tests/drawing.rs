//! Walls that are contracted and drawn anew: what stays as it was.

use super::super::disk::Disk;
use super::super::division::{part, places, regions};
use super::super::sides::Role;
use super::super::{contract, relax, sizes};
use super::*;

/// Length of the walls that stay, sides of patches in ascending order, length of the shortest side.
#[derive(Debug)]
struct State {
    fixed: f64,
    sides: Vec<usize>,
    shortest: f64,
    /// Mean of the widest angles at nodes inside the surface, radians.
    widest: f64,
}

fn widest(drawing: &Drawing, disks: &[Disk]) -> f64 {
    let mut at_node: BTreeMap<VertexId, f64> = BTreeMap::new();
    for disk in disks {
        let (c, length) = (&disk.connectivity, disk.lengths(&drawing.fine));
        let mut angle = VertexVec::filled(0.0, c.vertex_count());
        for h in c.faces().flat_map(|f| c.face_halfedges(f)) {
            let [a, opposite, b] = [h, c.next(h), c.next(c.next(h))].map(|h| length[c.edge(h)]);
            let cosine = (a * a + b * b - opposite * opposite) / (2.0 * a * b);
            angle[c.tail(h)] += cosine.clamp(-1.0, 1.0).acos();
        }
        for place in places(drawing, disk, |role| role == Role::Node) {
            let widest = at_node.entry(disk.border_vertex(place)).or_default();
            *widest = widest.max(angle[c.tail(disk.border[place])]);
        }
    }
    let c = &drawing.fine.connectivity;
    let is_inside = |v: &VertexId| !c.is_boundary_vertex(*v);
    let inside = at_node
        .iter()
        .filter(|row| is_inside(row.0))
        .map(|row| *row.1);
    let inside: Vec<f64> = inside.collect();
    inside.iter().sum::<f64>() / inside.len() as f64
}

/// Every patch must be a disk with three sides at least, which together have all faces; no wall that stays is none.
fn state(drawing: &Drawing) -> State {
    let c = &drawing.fine.connectivity;
    let length = |is: &dyn Fn(crate::geometry::ids::EdgeId) -> bool| -> f64 {
        let edges = c.edges().filter(|&e| is(e));
        edges.map(|e| drawing.fine.edge_length(e)).sum()
    };
    for e in c.edges().filter(|&e| drawing.is_fixed[e]) {
        assert!(drawing.is_wall[e], "{e:?} is no wall any more");
    }
    // A part is refused where it is no disk.
    let disks = regions(drawing)
        .into_iter()
        .map(|f| part(drawing, f).unwrap());
    let disks: Vec<Disk> = disks.collect();
    let faces: usize = disks.iter().map(|disk| disk.faces.len()).sum();
    assert_eq!(faces, c.face_count());
    let nodes = |disk: &Disk| places(drawing, disk, |role| role == Role::Node).count();
    let mut sides: Vec<usize> = disks.iter().map(nodes).collect();
    sides.sort_unstable();
    assert!(sides.iter().all(|&n| n >= 3), "{sides:?}");
    let lengths = drawing
        .chains()
        .into_iter()
        .map(|chain| drawing.length(&chain));
    State {
        fixed: length(&|e| drawing.is_fixed[e]),
        sides,
        shortest: lengths.fold(f64::INFINITY, f64::min),
        widest: widest(drawing, &disks),
    }
}

/// A sheet of 24 × 24 shaken squares in patches, by where the middle of a face lies.
fn sheet(patch: impl Fn([f64; 2]) -> [i32; 2]) -> Drawing {
    let squares = (0..24 * 24).map(|i| [i % 24, i / 24, 0]);
    let mut mesh = polycube(squares, |_, axis, sign| axis == 2 && sign == 1);
    for (v, p) in mesh.positions.as_mut_slice().iter_mut().enumerate() {
        p[0] += 0.2 * (12.9898 * v as f64).sin();
        p[1] += 0.2 * (78.233 * v as f64).sin();
    }
    let c = &mesh.connectivity;
    let mut number = BTreeMap::new();
    let numbered = c.faces().map(|f| {
        let p = mesh.face_positions(f);
        let middle = [0, 1].map(|i| (p[0][i] + p[1][i] + p[2][i]) / 3.0);
        let next = number.len();
        PatchId::new(*number.entry(patch(middle)).or_insert(next))
    });
    let face_patch: FaceVec<PatchId> = numbered.collect();
    let is_cut = crate::geometry::ids::EdgeVec::filled(false, c.edge_count());
    Drawing::new(&mesh, &is_cut, &face_patch).unwrap()
}

/// Patches laid like bricks, in courses each of which is shifted by a quarter of a brick: walls meet at straight angles, a short side apart.
fn bricks() -> Drawing {
    sheet(|[x, y]| {
        let course = (y / 8.0).floor();
        let place = ((x - 2.0 * course) / 8.0).floor();
        [course, place].map(|i| i as i32)
    })
}

/// With many creases, and with none.
fn drawings() -> [(&'static str, Drawing); 3] {
    let cubes = (0..216).map(|i| [i % 6, i / 6 % 6, i / 36]);
    let ring = (0..9).filter(|&i| i != 4).map(|i| [i % 3, i / 3, 0]);
    let cube = shaken(polycube(cubes, |_, _, _| true));
    let torus = shaken(polycube(ring, |_, _, _| true));
    let drawn = |mesh: &Mesh, cones: &[usize]| {
        let mut drawing = undivided(mesh, cones);
        division::divide(&mut drawing).unwrap();
        sizes::divide(&mut drawing, 40_000).unwrap();
        drawing
    };
    [
        ("cube", drawn(&cube, &[0, 40, 90, 130])),
        ("torus", drawn(&torus, &[])),
        ("bricks", bricks()),
    ]
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9 * a.abs()
}

#[test]
fn contracted_patches_are_the_same_disks_with_fewer_sides() {
    let mut fewer = 0;
    for (name, mut drawing) in drawings() {
        let before = state(&drawing);
        contract::contract(&mut drawing).unwrap();
        let after = state(&drawing);
        assert_eq!(before.sides.len(), after.sides.len(), "{name}");
        assert!(
            close(before.fixed, after.fixed),
            "{name}: {before:?} {after:?}"
        );
        let sum = |state: &State| state.sides.iter().sum::<usize>();
        assert!(sum(&after) <= sum(&before), "{name}");
        assert!(
            after.shortest >= before.shortest * (1.0 - 1e-9),
            "{name}: {before:?} {after:?}"
        );
        fewer += usize::from(sum(&after) < sum(&before));
    }
    assert!(fewer > 0);
}

#[test]
fn walls_drawn_anew_keep_patches_and_sides_and_meet_more_evenly() {
    for (name, mut drawing) in drawings() {
        let before = state(&drawing);
        relax::relax(&mut drawing).unwrap();
        let after = state(&drawing);
        assert_eq!(before.sides, after.sides, "{name}");
        assert!(
            close(before.fixed, after.fixed),
            "{name}: {before:?} {after:?}"
        );
        assert!(
            after.widest <= before.widest + 1e-9,
            "{name}: {before:?} {after:?}"
        );
        if name == "bricks" {
            // Straight angles at first. In one round they go a third of the way to even ones at least: where a wall ends its other end may move, too.
            let even = 2.0 * std::f64::consts::FRAC_PI_3;
            assert!(before.widest > 2.8, "{before:?}");
            let way = (before.widest - after.widest) / (before.widest - even);
            assert!(way > 1.0 / 3.0, "{before:?} {after:?}");
        }
    }
}
