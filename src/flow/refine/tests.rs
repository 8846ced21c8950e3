use super::*;
use crate::flow::cones::{
    BoundaryParams, ConeParams, ConeSpec, ConeStrategy, PiMultiple, assign, prescribe,
};
use crate::flow::feasibility::{self, Constraint};
use crate::flow::packing;
use crate::flow::prescription::BoundaryCondition;
use crate::flow::ricci::{FlowParams, Scheme};
use crate::geometry::ids::{EdgeId, FaceId, NONE, VertexVec};
use crate::geometry::mesh::{Soup, triangle_area};
use crate::repair::assemble::doubled_edges;
use crate::repair::corpus::{self, soup};
use crate::repair::{RepairParams, repair};
use std::f64::consts::TAU;

fn mesh_of(soup: &Soup) -> Mesh {
    let repaired = repair(soup, &RepairParams::default()).unwrap();
    assert_eq!(repaired.components.len(), 1);
    repaired
        .components
        .into_iter()
        .next()
        .unwrap()
        .mesh
        .unwrap()
}

fn octahedron() -> Soup {
    let positions = vec![
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, -1.0],
    ];
    let faces = (1..5)
        .map(|i| [0, i, i % 4 + 1])
        .chain((1..5).map(|i| [5, i % 4 + 1, i]))
        .collect();
    soup(positions, faces)
}

/// A torus of n × m squares, all of valence 6, but for the squares of `holes`.
fn torus(n: u32, m: u32, holes: &[u32]) -> Soup {
    let at = |i: u32, j: u32| i % n * m + j % m;
    let positions = (0..n * m)
        .map(|v| {
            let (s, t) = (
                TAU * f64::from(v / m) / f64::from(n),
                TAU * f64::from(v % m) / f64::from(m),
            );
            let r = 3.0 + t.cos() * (1.2 + 0.2 * (2.0 * s).cos());
            [r * s.cos(), r * s.sin(), t.sin()]
        })
        .collect();
    let faces = (0..n * m)
        .filter(|q| !holes.contains(q))
        .flat_map(|q| {
            let (i, j) = (q / m, q % m);
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    soup(positions, faces)
}

/// Targets in multiples of π at some vertices.
fn targets(mesh: &Mesh, boundary: BoundaryCondition, cones: &[(usize, f64)]) -> Prescription {
    let mut target = VertexVec::filled(0.0, mesh.connectivity.vertex_count());
    for &(v, multiple) in cones {
        target[VertexId::new(v)] = multiple * PI;
    }
    Prescription::new(target, boundary)
}

fn area(mesh: &Mesh) -> f64 {
    let faces = mesh.connectivity.faces();
    faces.map(|f| triangle_area(mesh.face_positions(f))).sum()
}

/// Edges from `cone`, breadth first; boundary vertices are left out where the boundary is free.
fn levels(mesh: &Mesh, prescription: &Prescription, cone: VertexId) -> Vec<Option<usize>> {
    let c = &mesh.connectivity;
    let mut level = vec![None; c.vertex_count()];
    level[cone.index()] = Some(0);
    let mut queue = std::collections::VecDeque::from([cone]);
    while let Some(v) = queue.pop_front() {
        for w in c.neighbours(v) {
            let out = prescription.boundary == BoundaryCondition::Free && c.is_boundary_vertex(w);
            if level[w.index()].is_none() && !out {
                level[w.index()] = level[v.index()].map(|k| k + 1);
                queue.push_back(w);
            }
        }
    }
    level
}

/// |Lk(I)| and D(I) of the vertices up to a level, counted plainly: F_I has the vertices, edges and faces inside I as (6) has it.
fn link_and_demand(
    mesh: &Mesh,
    prescription: &Prescription,
    level: &[Option<usize>],
    k: usize,
) -> (usize, f64) {
    let c = &mesh.connectivity;
    let inside = |v: VertexId| level[v.index()].is_some_and(|l| l <= k);
    let corners = |f: FaceId| c.face_vertices(f).iter().filter(|&&v| inside(v)).count();
    let link = c.faces().filter(|&f| corners(f) == 1).count();
    // χ(F_I): F_I is the union of the open faces, edges and vertices that touch I.
    let edge_inside = |e: &EdgeId| c.edge_vertices(*e).iter().any(|&v| inside(v));
    let vertices = c.vertices().filter(|&v| inside(v)).count() as f64;
    let edges = c.edges().filter(edge_inside).count() as f64;
    let faces = c.faces().filter(|&f| corners(f) > 0).count() as f64;
    let curvature: f64 = c
        .vertices()
        .filter(|&v| inside(v))
        .map(|v| prescription.target[v])
        .sum();
    // Open star: χ = V − E + F; the link edges have both ends outside.
    let chi = vertices - edges + faces;
    (link, TAU * chi - curvature)
}

/// Everything that must hold afterwards, counted independently.
fn check(
    before: (&Mesh, &Prescription),
    after: (&Mesh, &Prescription),
    repair: ConnectivityRepair,
    params: &RefineParams,
) {
    let ((old, old_targets), (new, targets)) = (before, after);
    let c = &new.connectivity;
    c.validate().unwrap();
    assert_eq!(doubled_edges(c), []);
    let (was, is) = (old.connectivity.topology(), c.topology());
    assert_eq!(was.euler_characteristic, is.euler_characteristic);
    assert_eq!(was.boundary_loops, is.boundary_loops);
    assert_eq!(is.vertices - was.vertices, repair.splits);
    assert_eq!((repair.flips, repair.hausdorff), (0, 0.0));
    let (a, b) = (area(old), area(new));
    assert!((a - b).abs() <= 1e-12 * a, "{a} {b}");
    for v in old.connectivity.vertices() {
        assert_eq!(old.positions[v], new.positions[v]);
        assert_eq!(old.source_vertex[v], new.source_vertex[v]);
        assert!(old.connectivity.valence(v) <= c.valence(v));
    }
    assert_eq!(targets.target.len(), is.vertices);
    assert_eq!(targets.boundary, old_targets.boundary);
    let sums = [old_targets, targets].map(|p| p.target.iter().sum::<f64>());
    assert!((sums[0] - sums[1]).abs() < 1e-12 * (1.0 + sums[0].abs()));
    let interior = |v: VertexId| !c.is_boundary_vertex(v);
    let cones: Vec<VertexId> = targets.cones.iter().map(|c| c.vertex).collect();
    for &v in cones.iter().filter(|&&v| interior(v)) {
        let k = targets.target[v];
        assert_eq!(k, old_targets.target[v]);
        assert!(c.valence(v) as f64 >= 4.0 - 2.0 * k / PI - 1e-9);
        let level = levels(new, targets, v);
        for w in c
            .vertices()
            .filter(|&w| interior(w) && targets.target[w] == 0.0)
        {
            // Levels avoid a free boundary, so they may say more than the distance, never less.
            if level[w.index()].is_some_and(|l| l <= params.rings) {
                assert!(
                    c.valence(w) >= params.ring_valence,
                    "{w} at {:?}",
                    level[w.index()]
                );
            }
        }
        if k < 0.0 {
            let deepest = level.iter().flatten().max().copied().unwrap_or(0);
            for l in 0..=deepest {
                let (link, demand) = link_and_demand(new, targets, &level, l);
                let margin = if l <= params.rings { 2.0 } else { 1.5 };
                if targets.boundary == BoundaryCondition::Free {
                    let wanted = margin * demand / PI - 1e-6;
                    assert!(link as f64 >= wanted, "level {l}: {link} {demand}");
                }
            }
        }
    }
}

fn refined(mesh: &Mesh, prescription: &Prescription) -> (Mesh, Prescription, ConnectivityRepair) {
    let params = RefineParams::default();
    let (new, targets, repair) = refine(mesh.clone(), prescription.clone(), &params).unwrap();
    check((mesh, prescription), (&new, &targets), repair, &params);
    // Nothing is left to do.
    let (_, _, again) = refine(new.clone(), targets.clone(), &params).unwrap();
    assert_eq!(again.splits, 0);
    (new, targets, repair)
}

#[test]
fn nothing_happens_where_the_criteria_hold() {
    let mesh = mesh_of(&torus(12, 12, &[]));
    let free = BoundaryCondition::Free;
    for cones in [
        vec![],
        vec![(0, 0.5), (70, -0.5)],
        vec![(0, 1.0), (70, -1.0)],
    ] {
        let (_, _, repair) = refined(&mesh, &targets(&mesh, free, &cones));
        assert_eq!(repair, ConnectivityRepair::default());
    }
}

#[test]
fn repair_is_for_flows_that_keep_the_connectivity_unless_it_is_asked_for() {
    let schemes = [
        (Scheme::Tangential, true, true),
        (Scheme::Thurston, true, true),
        (Scheme::InversiveDistance, true, true),
        (Scheme::VertexScaling, false, true),
        (Scheme::VertexScaling, true, false),
    ];
    for (scheme, delaunay, expected) in schemes {
        let flow = FlowParams {
            scheme,
            delaunay,
            ..FlowParams::default()
        };
        assert_eq!(RefineParams::default().is_enabled(&flow), expected);
        for asked in [false, true] {
            let params = RefineParams {
                enabled: Some(asked),
                ..RefineParams::default()
            };
            assert_eq!(params.is_enabled(&flow), asked);
        }
    }
}

/// Splits edge 0; what boundaries share is shared twice, which must be the same.
fn split_once(mesh: Mesh, prescription: Prescription) -> (Mesh, Prescription, ConnectivityRepair) {
    let mut editor = Editor::new(mesh, prescription, 1);
    editor.split_edge(EdgeId::new(0)).unwrap();
    assert!(editor.split_edge(EdgeId::new(0)).is_err());
    editor.share_uniform_curvature();
    editor.finish()
}

/// What was prescribed vertex by vertex stays; a new boundary vertex is straight.
#[test]
fn a_split_prescribed_boundary_keeps_every_vertex() {
    let triangle = mesh_of(&soup(
        vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        vec![[0, 1, 2]],
    ));
    let given = [(0, 2.0 / 3.0), (1, 2.0 / 3.0), (2, 2.0 / 3.0)];
    let prescribed = targets(&triangle, BoundaryCondition::Prescribed, &given);
    let (_, after, repair) = split_once(triangle, prescribed.clone());
    assert_eq!(repair.splits, 1);
    assert_eq!(after.boundary, BoundaryCondition::Prescribed);
    assert_eq!(after.target.as_slice()[..3], *prescribed.target.as_slice());
    assert_eq!(after.target.as_slice()[3..], [0.0]);
}

#[test]
fn a_strong_cone_gets_edges_in_every_ring() {
    let mesh = mesh_of(&torus(16, 12, &[]));
    // Positive cones far away make up for it.
    let others = [95, 97, 99, 101, 103, 119, 121].map(|v| (v, 8.0 / 7.0));
    let mut cones = vec![(0, -8.0)];
    cones.extend(others);
    let prescription = targets(&mesh, BoundaryCondition::Free, &cones);
    let (new, _, repair) = refined(&mesh, &prescription);
    assert!(new.connectivity.valence(VertexId::new(0)) >= 20);
    assert!(repair.splits > 14);
}

#[test]
fn small_spheres_can_be_refined() {
    let mesh = mesh_of(&octahedron());
    for cones in [
        vec![(0, 1.0), (1, 1.0), (3, 1.0), (5, 1.0)],
        vec![(0, 4.0 / 3.0), (1, 4.0 / 3.0), (5, 4.0 / 3.0)],
        vec![(0, -5.0), (1, 1.8), (2, 1.8), (3, 1.8), (4, 1.8), (5, 1.8)],
    ] {
        refined(&mesh, &targets(&mesh, BoundaryCondition::Free, &cones));
    }
}

#[test]
fn random_prescriptions_end() {
    let mut state = 11u64;
    let mut below = |n: u64| {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        ((state >> 33) % n) as usize
    };
    let soups = [
        octahedron(),
        torus(4, 3, &[]),
        torus(5, 4, &[0]),
        torus(6, 5, &[0, 14]),
    ];
    let meshes = soups.map(|s| mesh_of(&s));
    for _ in 0..60 {
        let mesh = &meshes[below(4)];
        let c = &mesh.connectivity;
        let inner: Vec<VertexId> = c.vertices().filter(|&v| !c.is_boundary_vertex(v)).collect();
        let mut cones = std::collections::BTreeMap::new();
        for _ in 0..1 + below(4) {
            let v = inner[below(inner.len() as u64)].index();
            let k = [-4.0, -2.0, -1.0, 0.5, 1.0, 1.5][below(6)];
            cones.insert(v, k);
        }
        let cones: Vec<(usize, f64)> = cones.into_iter().collect();
        // The totals need not meet Gauss–Bonnet for the criteria to make sense, but where the disk is everything the
        // demand must be 0: the rest goes to one vertex as positive cones would take it.
        let total: f64 = cones.iter().map(|c| c.1).sum();
        let required = 2.0 * c.topology().euler_characteristic as f64;
        if c.is_closed() && (total - required).abs() > 1e-9 {
            let Some(rest) = inner
                .iter()
                .find(|v| cones.iter().all(|c| c.0 != v.index()))
            else {
                continue;
            };
            let k = required - total;
            if k >= 2.0 {
                continue;
            }
            let mut cones = cones.clone();
            cones.push((rest.index(), k));
            refined(mesh, &targets(mesh, BoundaryCondition::Free, &cones));
        } else {
            refined(mesh, &targets(mesh, BoundaryCondition::Free, &cones));
        }
    }
}

#[test]
fn ears_of_a_prescribed_boundary_get_a_second_face() {
    let square = soup(
        vec![
            [0.0; 3],
            [2.0, 0.0, 0.0],
            [2.0, 2.0, 0.0],
            [0.0, 2.0, 0.0],
            [1.0, -1.0, 0.0],
        ],
        vec![[0, 1, 2], [0, 2, 3], [1, 0, 4]],
    );
    let mesh = mesh_of(&square);
    // Corners at 0, 1, 2, 3: vertex 4 is flat and has one face only.
    let corners = targets(
        &mesh,
        BoundaryCondition::Corners,
        &[(0, 0.5), (1, 0.5), (2, 0.5), (3, 0.5)],
    );
    let (new, _, repair) = refined(&mesh, &corners);
    assert_eq!(new.connectivity.outgoing(VertexId::new(4)).count(), 2);
    assert_eq!(repair.splits, 1);
}

#[test]
fn a_split_uniform_boundary_keeps_its_total() {
    // One face: every opposite edge is a boundary edge.
    let triangle = mesh_of(&soup(
        vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        vec![[0, 1, 2]],
    ));
    let uniform = targets(
        &triangle,
        BoundaryCondition::Uniform,
        &[(0, 2.0 / 3.0), (1, 2.0 / 3.0), (2, 2.0 / 3.0)],
    );
    let (new, targets, repair) = split_once(triangle, uniform);
    assert_eq!(repair.splits, 1);
    assert_eq!(new.connectivity.vertex_count(), 4);
    assert!(targets.target.iter().all(|&k| (k - PI / 2.0).abs() < 1e-15));
    assert_eq!(targets.cones.len(), 4);
}

#[test]
fn flat_vertices_of_valence_three_can_be_raised() {
    let mut mesh = mesh_of(&torus(6, 6, &[]));
    let center = mesh.split_face(FaceId::new(7), [1.0 / 3.0; 3]);
    assert_eq!(mesh.connectivity.valence(center), 3);
    let flat = targets(&mesh, BoundaryCondition::Free, &[]);
    let params = RefineParams {
        flat_vertex_valence: 4,
        ..RefineParams::default()
    };
    let (new, _, repair) = refine(mesh, flat, &params).unwrap();
    assert_eq!(repair.splits, 1);
    let c = &new.connectivity;
    assert!(c.vertices().all(|v| c.valence(v) >= 4));
    let wrong = RefineParams { rings: 4, ..params };
    let mesh = mesh_of(&octahedron());
    let flat = targets(&mesh, BoundaryCondition::Free, &[]);
    let error = refine(mesh, flat, &wrong).unwrap_err();
    assert_eq!(
        error.to_string(),
        "connectivity.rings is 4, but must be 0 to 3"
    );
}

/// Whatever Φ the lengths call for, and however strong the cones: (6) holds afterwards, exactly, or the region is named.
#[test]
fn repair_ends_with_a_packing_that_exists() {
    let mut state = 5u64;
    let mut below = |n: u64| {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 33) % n
    };
    let soups = [
        octahedron(),
        torus(8, 7, &[]),
        torus(9, 6, &[0, 30]),
        torus(7, 7, &[3]),
    ];
    let (mut tried, mut splits, mut spoilt) = (0, 0, 0);
    for round in 0..96 {
        let mut shape = soups[round % 4].clone();
        // Lengths for which Φ comes out as it likes.
        for x in shape.positions.iter_mut().flatten() {
            *x += (below(1000) as f64 / 1000.0 - 0.5) * 0.7;
        }
        let mesh = mesh_of(&shape);
        let c = &mesh.connectivity;
        let chi = c.topology().euler_characteristic as f64;
        let inner: Vec<usize> = (c.vertices())
            .filter(|&v| !c.is_boundary_vertex(v))
            .map(VertexId::index)
            .collect();
        let boundary = match round / 4 % 2 {
            0 => BoundaryCondition::Free,
            _ => BoundaryCondition::Uniform,
        };
        let mut multiple = vec![0.0; c.vertex_count()];
        let strong = inner[below(inner.len() as u64) as usize];
        multiple[strong] = -2.0 * below(4) as f64;
        let border: Vec<usize> = (c.vertices())
            .filter(|&v| c.is_boundary_vertex(v))
            .map(VertexId::index)
            .collect();
        // The rest evenly over the boundary, or over all others.
        let rest: Vec<usize> = match (border.is_empty(), boundary) {
            (false, BoundaryCondition::Uniform) => border,
            (false, _) => Vec::new(),
            _ => inner.iter().copied().filter(|&v| v != strong).collect(),
        };
        let share = (2.0 * chi - multiple[strong]) / rest.len().max(1) as f64;
        for v in &rest {
            multiple[*v] = share;
        }
        // Cone angles are positive.
        if share > 0.9 {
            continue;
        }
        let cones: Vec<(usize, f64)> = multiple.into_iter().enumerate().collect();
        let prescription = targets(&mesh, boundary, &cones);
        let scheme = [Scheme::Tangential, Scheme::Thurston][round / 8 % 2];
        let done = ConnectivityRepair::default();
        let holds = |mesh: &Mesh, prescription: &Prescription| {
            let c = &mesh.connectivity;
            let length = c.edges().map(|e| mesh.edge_length(e)).collect();
            let phi = (scheme == Scheme::Thurston)
                .then(|| packing::fit(c, &length).unwrap().intersection_angles());
            let (target, boundary) = (&prescription.target, prescription.boundary);
            let mut constraint = Constraint::new(c, phi.as_ref(), target, boundary, 1.0);
            feasibility::check(&mut constraint).is_ok()
        };
        spoilt += usize::from(!holds(&mesh, &prescription));
        let (old, old_prescription) = (mesh.clone(), prescription.clone());
        let (new, after, repair) = make_packable(mesh, prescription, done, scheme).unwrap();
        assert!(holds(&new, &after), "round {round}");
        new.connectivity.validate().unwrap();
        assert_eq!(doubled_edges(&new.connectivity), []);
        let counts = [&new, &old].map(|m| m.connectivity.vertex_count());
        assert_eq!(counts[0] - counts[1], repair.splits);
        let sums = [&old_prescription, &after].map(|p| p.target.iter().sum::<f64>());
        assert!((sums[0] - sums[1]).abs() < 1e-9);
        splits += repair.splits;
        tried += 1;
    }
    println!("{spoilt} of {tried} needed {splits} splits");
    assert!(tried > 60 && spoilt > 20);
}

/// Where the bound on splits is reached, the repair ends and says which region is still in the way.
#[test]
fn repair_that_is_not_done_says_so() {
    let mesh = mesh_of(&torus(8, 7, &[]));
    let mut cones: Vec<(usize, f64)> = (0..56).map(|v| (v, 16.0 / 55.0)).collect();
    cones[3].1 = -16.0;
    let prescription = targets(&mesh, BoundaryCondition::Free, &cones);
    for bound in [0, 1, 5] {
        let mut editor = Editor::new(mesh.clone(), prescription.clone(), bound);
        let error = packable::widen(&mut editor, Scheme::Tangential).unwrap_err();
        let said = error.to_string();
        let RefineError::StillInfeasible { splits, violation } = error else {
            panic!("{said}");
        };
        assert_eq!(splits, bound);
        assert!(violation.slack < 0.0 && violation.vertices.iter().all(|v| v.index() < 56));
        let start = format!("no circle packing exists, even after {bound} splits");
        assert!(said.starts_with(&start), "{said}");
    }
    let done = ConnectivityRepair::default();
    let (_, _, repair) = make_packable(mesh, prescription, done, Scheme::Tangential).unwrap();
    println!("{} splits are enough", repair.splits);
}

#[test]
fn attributes_and_origins_follow_the_splits() {
    let mut source = torus(8, 8, &[]);
    source.face_material = (0..128).map(|f| f % 3).collect();
    let mesh = mesh_of(&source);
    let others = [36, 37, 44, 45].map(|v| (v, 1.5));
    let mut cones = vec![(0, -6.0)];
    cones.extend(others);
    let (new, _, repair) = refined(&mesh, &targets(&mesh, BoundaryCondition::Free, &cones));
    assert!(repair.splits > 0);
    for f in new.connectivity.faces() {
        assert_eq!(new.face_material[f], new.source_face[f] % 3);
    }
    let added = new.source_vertex.iter().filter(|&&v| v == NONE).count();
    assert_eq!(added, repair.splits);
}

#[test]
#[cfg_attr(not(corpus), ignore = "needs AFFINE_ATLAS_CORPUS")]
fn single_cones_of_real_models() {
    let Some(folder) = corpus::folder("single_cones_of_real_models") else {
        return;
    };
    for (name, valence) in [("three-holes.off", 20), ("fertility.off", 28)] {
        let soup = corpus::load(&folder.join(name));
        let repaired = repair(&soup, &RepairParams::default()).unwrap();
        let mesh = repaired.components[0].mesh.as_ref().unwrap();
        for list in [vec![], vec![0], vec![1234]] {
            let cones = ConeParams {
                strategy: if list.is_empty() {
                    ConeStrategy::Single
                } else {
                    ConeStrategy::Auto
                },
                list: list
                    .into_iter()
                    .map(|v| ConeSpec {
                        vertex: Some(v),
                        point: None,
                        curvature: PiMultiple::fraction((4 - i64::from(valence)) / 2, 1).unwrap(),
                    })
                    .collect(),
                ..ConeParams::default()
            };
            let boundary = BoundaryParams::default();
            let requests = assign(&repaired, &cones, &boundary, &Default::default()).unwrap();
            let prescription =
                prescribe(mesh, &requests[0], &cones, &boundary, &Default::default()).unwrap();
            let cone = prescription.cones[0];
            let start = std::time::Instant::now();
            let (new, _, repair) = refined(mesh, &prescription);
            println!(
                "{name}: cone {} of {:.3}π at vertex {}, {} splits, {:?}",
                cone.vertex,
                cone.curvature / PI,
                mesh.source_vertex[cone.vertex],
                repair.splits,
                start.elapsed()
            );
            assert!(new.connectivity.valence(cone.vertex) >= valence as usize);
        }
    }
}
