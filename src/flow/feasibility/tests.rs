mod brute;
mod gluing;

use super::*;
use crate::flow::metric::{Evaluation, Metric};
use crate::flow::prescription::{BoundaryCondition, Prescription};
use crate::flow::ricci::shapes::{self, Shape};
use crate::flow::schemes::{ConformalStructure, Law};
use crate::geometry::ids::{EdgeId, EdgeVec, VertexId, VertexVec};
use std::f64::consts::PI;

fn octahedron() -> Shape {
    let mut faces = Vec::new();
    for k in 0..4u32 {
        let (a, b) = (1 + k, 1 + (k + 1) % 4);
        faces.extend([[0, a, b], [5, b, a]]);
    }
    let positions = [
        [0.0, 0.0, 1.0],
        [1.0, 0.1, 0.0],
        [0.0, 1.2, 0.0],
        [-0.9, 0.0, 0.1],
        [0.0, -1.0, 0.0],
        [0.1, 0.0, -1.3],
    ];
    Shape::new("octahedron", &faces, &positions)
}

/// The torus with 7 vertices, whose edge graph is complete.
fn seven_vertex_torus() -> Shape {
    let faces: Vec<[u32; 3]> = (0..7)
        .flat_map(|i| [[i, (i + 1) % 7, (i + 3) % 7], [i, (i + 3) % 7, (i + 2) % 7]])
        .collect();
    let mut random = shapes::sequence(53);
    let positions: Vec<_> = (0..7).map(|_| [(); 3].map(|_| random())).collect();
    Shape::new("seven", &faces, &positions)
}

/// 8 vertices around a disk and its centre region: 3 × 3 quads.
fn disk() -> Shape {
    shapes::sheet(3, false)
}

fn subsets(vertices: &[VertexId]) -> impl Iterator<Item = Vec<VertexId>> + '_ {
    (1..1u32 << vertices.len()).map(|bits| {
        vertices
            .iter()
            .enumerate()
            .filter(|(k, _)| bits >> k & 1 == 1)
            .map(|(_, &v)| v)
            .collect()
    })
}

fn random_phi(shape: &Shape, seed: u64) -> EdgeVec<f64> {
    let mut random = shapes::sequence(seed);
    let share = |x: f64| (1.5 * x - 0.25).clamp(0.0, 1.0);
    shape
        .connectivity
        .edges()
        .map(|_| share(random()) * 0.5 * PI)
        .collect()
}

/// The right side of (6) as printed: −Σ_{Lk(I)} (π − Φ) + 2π χ(F_I).
fn printed_bound(shape: &Shape, phi: &EdgeVec<f64>, set: &[VertexId]) -> f64 {
    let c = &shape.connectivity;
    let inside = |v: VertexId| set.contains(&v);
    let mut bound = 0.0;
    for h in c.halfedges() {
        if inside(c.apex(h)) && !inside(c.tail(h)) && !inside(c.head(h)) {
            bound -= PI - phi[c.edge(h)];
        }
    }
    let edges = c
        .edges()
        .filter(|&e| c.edge_vertices(e).into_iter().all(inside));
    let faces = c
        .faces()
        .filter(|&f| c.face_vertices(f).into_iter().all(inside));
    let chi = set.len() as f64 - edges.count() as f64 + faces.count() as f64;
    bound + 2.0 * PI * chi
}

#[test]
fn slack_is_the_printed_constraint_and_its_complement() {
    for shape in [octahedron(), seven_vertex_torus()] {
        let c = &shape.connectivity;
        let all: Vec<VertexId> = c.vertices().collect();
        let zero = EdgeVec::filled(0.0, c.edge_count());
        let mut random = shapes::sequence(59);
        let mut target: VertexVec<f64> = all.iter().map(|_| random() - 0.5).collect();
        let required = 2.0 * PI * c.topology().euler_characteristic as f64;
        let missing = required - target.iter().sum::<f64>();
        target[VertexId::new(0)] += missing;
        for (given, phi) in [(false, zero), (true, random_phi(&shape, 61))] {
            let mut constraint = Constraint::new(
                c,
                given.then_some(&phi),
                &target,
                BoundaryCondition::Free,
                1.0,
            );
            for set in subsets(&all) {
                let total: f64 = set.iter().map(|&v| target[v]).sum();
                let slack = constraint.slack(&set);
                assert!((slack.upper - (total - printed_bound(&shape, &phi, &set))).abs() < 1e-11);
                let rest: Vec<VertexId> =
                    all.iter().copied().filter(|v| !set.contains(v)).collect();
                let opposite = constraint.slack(&rest);
                assert!((slack.lower - opposite.upper).abs() < 1e-11);
            }
        }
    }
}

#[test]
fn every_packing_satisfies_every_subset() {
    // What packings of random radii, some e^±6, really have as curvature is feasible, with and without boundary.
    for shape in [octahedron(), seven_vertex_torus(), disk()] {
        let c = &shape.connectivity;
        let closed = c.is_closed();
        let prescribed: Vec<VertexId> = c.vertices().collect();
        let mut random = shapes::sequence(67);
        for round in 0..6 {
            let phi = random_phi(&shape, 71 + round);
            let structure = ConformalStructure {
                law: Law::Packing(phi.iter().map(|p| p.cos()).collect()),
                start: VertexVec::filled(0.0, c.vertex_count()),
                fit: None,
            };
            let reach = [0.5, 3.0, 6.0][round as usize % 3];
            let u: VertexVec<f64> = c
                .vertices()
                .map(|_| reach * (2.0 * random() - 1.0))
                .collect();
            let mut now = Evaluation::default();
            Metric::new(c, &structure).evaluate(&u, &mut now);
            let mut constraint = Constraint::new(
                c,
                Some(&phi),
                &now.curvature,
                BoundaryCondition::Uniform,
                1.0,
            );
            for set in subsets(&prescribed).step_by(if closed { 1 } else { 37 }) {
                let slack = constraint.slack(&set);
                let whole = set.len() == c.vertex_count();
                let interior = set.iter().all(|&v| !c.is_boundary_vertex(v));
                if whole {
                    assert!(slack.upper.abs() < 1e-10 && slack.lower.abs() < 1e-10);
                } else {
                    assert!(
                        slack.upper > 0.0 && slack.lower > 0.0,
                        "{interior} {slack:?}"
                    );
                }
            }
        }
    }
}

fn constraint<'a>(
    shape: &'a Shape,
    phi: Option<&'a EdgeVec<f64>>,
    prescription: &'a Prescription,
    margin: f64,
) -> Constraint<'a> {
    let (target, boundary) = (&prescription.target, prescription.boundary);
    Constraint::new(&shape.connectivity, phi, target, boundary, margin)
}

fn verdict(
    shape: &Shape,
    phi: Option<&EdgeVec<f64>>,
    prescription: &Prescription,
) -> Result<(), Violation> {
    check(&mut constraint(shape, phi, prescription, 1.0))
}

/// Turns edges of a copy that stay without doubling an edge: a random triangulation of the same surface.
fn shuffled(shape: &Shape, flips: usize, random: &mut impl FnMut() -> f64) -> Shape {
    let mut c = shape.connectivity.clone();
    let edges = c.edge_count() as f64;
    for _ in 0..flips {
        let e = EdgeId::new((random() * edges) as usize);
        let h = c.edge_halfedge(e);
        let Some(t) = c.twin(h) else { continue };
        let (a, b) = (c.apex(h), c.apex(t));
        let keeps_three = c.edge_vertices(e).into_iter().all(|v| c.valence(v) > 3);
        if a != b && keeps_three && !c.neighbours(a).any(|v| v == b) {
            c.flip(e);
        }
    }
    c.validate().unwrap();
    Shape {
        name: shape.name.clone(),
        length: EdgeVec::filled(1.0, c.edge_count()),
        connectivity: c,
    }
}

/// Random curvatures in steps of π/4 that meet Gauss–Bonnet (Φ ≡ 0 or multiples of π/4 then reach equality often).
fn random_prescription(
    shape: &Shape,
    boundary: BoundaryCondition,
    strength: f64,
    random: &mut impl FnMut() -> f64,
) -> Option<Prescription> {
    let c = &shape.connectivity;
    let free = boundary == BoundaryCondition::Free && !c.is_closed();
    let prescribed: Vec<VertexId> = c
        .vertices()
        .filter(|&v| !(free && c.is_boundary_vertex(v)))
        .collect();
    let mut quarters = vec![0i64; c.vertex_count()];
    for &v in &prescribed {
        quarters[v.index()] = (strength * (2.0 * random() - 1.0)) as i64;
    }
    let mut missing = 8 * c.topology().euler_characteristic - quarters.iter().sum::<i64>();
    while !free && missing != 0 {
        let v = prescribed[(random() * prescribed.len() as f64) as usize];
        let step = missing.clamp(-2, 2);
        quarters[v.index()] += step;
        missing -= step;
    }
    let most = |v: VertexId| if c.is_boundary_vertex(v) { 4 } else { 8 };
    let angles = prescribed.iter().all(|&v| quarters[v.index()] < most(v));
    let target = quarters.iter().map(|&q| q as f64 * PI / 4.0);
    angles.then(|| Prescription::new(target.collect(), boundary))
}

#[test]
fn the_flow_decides_what_all_subsets_say() {
    let mut random = shapes::sequence(97);
    let closed = [octahedron(), seven_vertex_torus(), shapes::torus(3, 3)];
    let disks = [shapes::sheet(4, false), shapes::sheet(2, false)];
    // [holds, fails by a deficit, fails by equality alone] for closed, free and prescribed boundaries.
    let mut outcomes = [[0; 3]; 3];
    for round in 0..576 {
        let (kind, base, boundary) = match round % 4 {
            0 => (1, &disks[0], BoundaryCondition::Free),
            1 => (2, &disks[1], BoundaryCondition::Uniform),
            _ => (0, &closed[round / 4 % 3], BoundaryCondition::Free),
        };
        let shape = shuffled(base, 12, &mut random);
        let c = &shape.connectivity;
        let phi = match round / 12 % 3 {
            0 => None,
            1 => Some(random_phi(&shape, 101 + round as u64)),
            _ => Some(
                c.edges()
                    .map(|_| (3.0 * random()).floor() * 0.25 * PI)
                    .collect(),
            ),
        };
        let strength = [3.0, 5.0, 8.0, 14.0][round / 36 % 4];
        let Some(prescription) = random_prescription(&shape, boundary, strength, &mut random)
        else {
            continue;
        };
        for margin in [1.0, 1.3] {
            let mut constraint = constraint(&shape, phi.as_ref(), &prescription, margin);
            let counted: Vec<VertexId> = c
                .vertices()
                .filter(|&v| constraint.is_prescribed(v))
                .collect();
            let (mut below, mut above) = (f64::INFINITY, f64::INFINITY);
            for set in subsets(&counted) {
                if set.len() < c.vertex_count() {
                    let slack = constraint.slack(&set);
                    below = below.min(slack.upper);
                    above = above.min(slack.lower);
                }
            }
            let least = below.min(above);
            // Nothing in between: multiples of π/4 and random numbers do not come so close to zero.
            assert!(!(1e-11..1e-8).contains(&least.abs()), "{least}");
            let regions = constraint.offending_regions();
            assert_eq!(
                regions.is_empty(),
                least > 1e-9,
                "round {round}: {least} {regions:?}"
            );
            for region in &regions {
                let slack = constraint.slack(&region.vertices);
                let own = match region.side {
                    Side::Below => slack.upper,
                    Side::Above => slack.lower,
                };
                assert!(own == region.slack && own < 1e-9);
                assert!(!constraint.link(region).is_empty());
            }
            // All regions of the least set together lack what the worst set lacks.
            let total: f64 = regions.iter().map(|r| r.slack).sum();
            let worst = match regions.first().map(|r| r.side) {
                Some(Side::Above) => above,
                _ => below,
            };
            assert!(
                (total - worst.min(0.0)).abs() < 1e-8,
                "round {round}: {total} {worst}"
            );
            if margin == 1.0 {
                let outcome = usize::from(least <= 1e-9) + usize::from(least.abs() <= 1e-9);
                outcomes[kind][outcome] += 1;
                assert_eq!(check(&mut constraint).is_ok(), outcome == 0);
            }
        }
    }
    println!("{outcomes:?}");
    assert!(
        outcomes.iter().all(|kind| kind.iter().all(|&n| n >= 3)),
        "{outcomes:?}"
    );
}

#[test]
fn violations_name_the_vertex_or_the_region() {
    let torus = shapes::torus(9, 7);
    // Valence 6 and Φ ≡ 0: six faces hold less than 6π, −4π needs exactly that.
    let tight = torus.prescribe(&[(10, -4.0 * PI), (40, PI), (41, PI), (50, PI), (59, PI)]);
    let found = verdict(&torus, None, &tight).unwrap_err();
    assert_eq!(found.vertex, VertexId::new(10));
    assert_eq!((found.size, found.side), (1, Side::Below));
    assert!((found.bound + 4.0 * PI).abs() < 1e-12);
    assert!((found.curvature + 4.0 * PI).abs() < 1e-12);
    assert!(
        found
            .to_string()
            .contains("vertex 10 must have more than -4π of curvature by (6), but exactly that")
    );
    // A little less fits the vertex.
    let fits = torus.prescribe(&[
        (10, -3.9 * PI),
        (40, PI),
        (41, PI),
        (50, PI),
        (58, 0.9 * PI),
    ]);
    assert!(!matches!(verdict(&torus, None, &fits), Err(v) if v.size == 1));
    // Six cones of almost −4π around a vertex: each fits, their ring does not.
    let around: Vec<usize> = torus
        .connectivity
        .neighbours(VertexId::new(30))
        .map(|v| v.index())
        .collect();
    let mut cones: Vec<_> = around.iter().map(|&v| (v, -3.5 * PI)).collect();
    let spare: Vec<usize> = (0..63)
        .filter(|v| !around.contains(v) && *v != 30)
        .collect();
    cones.extend(spare.iter().map(|&v| (v, 21.0 * PI / spare.len() as f64)));
    let crowded = torus.prescribe(&cones);
    let found = verdict(&torus, None, &crowded).unwrap_err();
    assert!(found.size > 1 && found.side == Side::Below);
    assert!(found.curvature < found.bound);
    // A flat vertex of valence 4 cannot be flat where all its opposite edges have Φ = π/2.
    let flat = octahedron();
    let right = EdgeVec::filled(0.5 * PI, flat.connectivity.edge_count());
    let cones: Vec<_> = (1..5).map(|v| (v, PI)).collect();
    let found = verdict(&flat, Some(&right), &flat.prescribe(&cones)).unwrap_err();
    assert_eq!((found.size, found.side), (1, Side::Below));
    assert!([0, 5].contains(&found.vertex.index()));
    // And a ring of large positive cones leaves less than the six faces inside it have.
    let ring: Vec<usize> = around.iter().copied().chain([30]).collect();
    let mut cones: Vec<_> = ring.iter().map(|&v| (v, 1.5 * PI)).collect();
    cones.extend(spare.iter().map(|&v| (v, -10.5 * PI / spare.len() as f64)));
    let own = verdict(&torus, None, &torus.prescribe(&cones)).unwrap_err();
    assert_eq!((own.size, own.side), (7, Side::Above));
    // Seven cone angles of π/2 against six faces inside: 14π − 6π of curvature is the limit.
    assert!((own.curvature - 10.5 * PI).abs() < 1e-12 && (own.bound - 8.0 * PI).abs() < 1e-12);
    assert!(own.to_string().contains("must have less than 8π"));
}

#[test]
fn free_boundaries_count_interior_vertices_only() {
    let shape = shapes::sheet(7, false);
    assert_eq!(verdict(&shape, None, &shape.prescribe(&[])), Ok(()));
    let inside = shape
        .connectivity
        .vertices()
        .find(|&v| !shape.connectivity.is_boundary_vertex(v))
        .unwrap();
    let cone = shape.prescribe(&[(inside.index(), -5.0 * PI)]);
    let found = verdict(&shape, None, &cone).unwrap_err();
    assert_eq!(found.vertex, inside);
}
