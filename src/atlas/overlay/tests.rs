//! The overlay of meshes with flipped copies of themselves that carry any flat lengths: its invariants hold whatever the
//! metric and wherever on its edges a crossing is put.

use super::*;
use crate::atlas::charts::chart;
use crate::atlas::cut::cut;
use crate::atlas::develop::{Development, develop};
use crate::atlas::patches::own_development_error;
use crate::flow::correspondence::Correspondence;
use crate::flow::prescription::BoundaryCondition;
use crate::geometry::ids::{FaceId, HalfedgeVec, VertexId};
use crate::geometry::mesh::{AttributeKind, CornerAttribute, cross, sub, triangle_area};
use crate::geometry::polycube::polycube;
use crate::geometry::triangle::{angles, area};
use crate::report;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{PI, TAU};

struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005);
        self.0 = self.0.wrapping_add(1442695040888963407);
        (self.0 >> 33) as usize % n
    }

    fn unit(&mut self) -> f64 {
        (self.below(1 << 20) as f64 + 0.5) / (1 << 20) as f64
    }

    /// Increasing numbers in (0, 1).
    fn increasing(&mut self, count: usize) -> Vec<f64> {
        let mut sum = 0.0;
        let mut values: Vec<f64> = (0..count)
            .map(|_| {
                sum += 0.1 + self.unit();
                sum
            })
            .collect();
        let end = sum + 0.1 + self.unit();
        values.iter_mut().for_each(|x| *x /= end);
        values
    }
}

/// Positions are also an attribute, so that it must be the position still.
fn mesh(positions: Vec<[f64; 3]>, faces: &[[u32; 3]]) -> Mesh {
    let count = positions.len();
    with_attribute(Mesh {
        connectivity: Connectivity::from_faces(faces, count).unwrap(),
        positions: positions.into(),
        source_vertex: (0..count as u32).collect(),
        source_face: (0..faces.len() as u32).collect(),
        face_material: (0..faces.len() as u32).map(|f| f % 3).collect(),
        attributes: Vec::new(),
    })
}

fn with_attribute(mut mesh: Mesh) -> Mesh {
    let c = &mesh.connectivity;
    let corners = c.halfedges().flat_map(|h| mesh.positions[c.tail(h)]);
    mesh.attributes = vec![CornerAttribute {
        kind: AttributeKind::Custom("position".into()),
        components: 3,
        values: corners.map(|x| x as f32).collect(),
    }];
    mesh
}

fn tetrahedron() -> Mesh {
    let positions = vec![
        [1.0, 1.0, 1.0],
        [1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.3],
    ];
    mesh(positions, &[[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
}

fn octahedron() -> Mesh {
    let positions = vec![
        [1.0, 0.0, 0.0],
        [0.0, 1.2, 0.0],
        [-1.0, 0.0, 0.1],
        [0.0, -1.0, 0.0],
        [0.1, 0.0, 1.0],
        [0.0, 0.0, -1.0],
    ];
    let ring = |i: u32| i % 4;
    let top = (0..4).map(|i| [ring(i), ring(i + 1), 4]);
    let bottom = (0..4).map(|i| [ring(i + 1), ring(i), 5]);
    mesh(positions, &top.chain(bottom).collect::<Vec<_>>())
}

fn ring_of_cubes() -> Mesh {
    let cubes = (0..9)
        .map(|i| [i % 3, i / 3, 0])
        .filter(|c| c[..2] != [1, 1]);
    with_attribute(polycube(cubes, |_, _, _| true))
}

fn fan() -> Mesh {
    let mut positions = vec![[0.0, 0.0, 0.5]];
    positions.extend((0..5).map(|i| {
        let (s, c) = (i as f64 * TAU / 5.0).sin_cos();
        [c, s, 0.0]
    }));
    let faces: Vec<[u32; 3]> = (0..5).map(|i| [0, 1 + i, 1 + (i + 1) % 5]).collect();
    mesh(positions, &faces)
}

fn open_box(holes: usize) -> Mesh {
    // A block of 3 × 3 × 2 cubes with squares taken away.
    let cubes = (0..3).flat_map(move |x| (0..3).flat_map(move |y| (0..2).map(move |z| [x, y, z])));
    with_attribute(polycube(cubes, |low, axis, sign| {
        let taken = [([1, 1, 2], 2, 1), ([1, 1, 0], 2, -1), ([0, 1, 0], 0, -1)];
        !taken[..holes].contains(&(low, axis, sign))
    }))
}

/// A surface with its mirror image sewn on along the boundary; the surface itself where it has none.
fn double(c: &Connectivity) -> Connectivity {
    if c.is_closed() {
        return c.clone();
    }
    let n = c.halfedge_count();
    let mut vertices = c.vertex_count();
    let mirrored: Vec<VertexId> = c
        .vertices()
        .map(|v| match c.is_boundary_vertex(v) {
            true => v,
            false => {
                vertices += 1;
                VertexId::new(vertices - 1)
            }
        })
        .collect();
    // Halfedge k of a mirrored face is halfedge 2 − k run backwards.
    let image = |h: HalfedgeId| HalfedgeId::new(n + 3 * (h.index() / 3) + 2 - h.index() % 3);
    let mut tail: HalfedgeVec<VertexId> = HalfedgeVec::filled(VertexId::new(0), 2 * n);
    let mut twin = vec![None; 2 * n];
    for h in c.halfedges() {
        tail[h] = c.tail(h);
        tail[image(h)] = mirrored[c.head(h).index()];
        twin[h.index()] = Some(c.twin(h).unwrap_or(image(h)));
        twin[image(h).index()] = Some(c.twin(h).map_or(h, image));
    }
    Connectivity::from_gluing(tail, &twin, vertices).unwrap()
}

/// A mesh with a flipped copy of its connectivity that has any lengths.
struct Case {
    mesh: Mesh,
    intrinsic: Intrinsic,
    length: EdgeVec<f64>,
    curves: Curves,
    places: Positions,
}

fn case(mesh: Mesh, flips: usize, seed: u64) -> Case {
    let mut random = Random(seed);
    let base = double(&mesh.connectivity);
    let c = &mesh.connectivity;
    let on_mirror = |v: VertexId| v.index() < c.vertex_count() && c.is_boundary_vertex(v);
    let mut flat = base.clone();
    let identity = Correspondence::identity(&base);
    let mut base_on_flat = identity.clone();
    for i in 0..flips {
        let mut e = EdgeId::new(random.below(flat.edge_count()));
        // Every other flip is near the mirror, if there is one.
        let near = |e: EdgeId| flat.edge_vertices(e).into_iter().all(on_mirror);
        for _ in 0..if i % 2 == 0 { 20 } else { 0 } {
            if near(e) {
                break;
            }
            e = EdgeId::new(random.below(flat.edge_count()));
        }
        if let Some(flip) = flat.flip(e) {
            base_on_flat.flipped(&flat, &flip);
        }
    }
    let curves = base_on_flat.trace(&base, &flat).unwrap();
    // Any three of them make a triangle.
    let length: EdgeVec<f64> = flat.edges().map(|_| 0.8 + 0.4 * random.unit()).collect();
    let mut on_base = Vec::new();
    let mut number = EdgeVec::filled(0, flat.edge_count());
    for e in base.edges() {
        on_base.extend(random.increasing(curves.range(e).len()));
    }
    for x in &curves.crossing {
        number[flat.edge(x.halfedge)] += 1;
    }
    let places: EdgeVec<Vec<f64>> = number.iter().map(|&n| random.increasing(n)).collect();
    let place = |x: &crate::flow::correspondence::Crossing| {
        let along = &places[flat.edge(x.halfedge)];
        match flat.edge_halfedge(flat.edge(x.halfedge)) == x.halfedge {
            true => along[x.rank as usize],
            false => along[along.len() - 1 - x.rank as usize],
        }
    };
    let on_flat = curves.crossing.iter().map(place).collect();
    let base_length = EdgeVec::filled(1.0, base.edge_count());
    let intrinsic = Intrinsic {
        front_faces: mesh.connectivity.face_count(),
        delaunay: base.clone(),
        delaunay_length: base_length.clone(),
        delaunay_penner: None,
        penner: EdgeVec::filled(0.0, flat.edge_count()),
        u: base.vertices().map(|_| random.unit() - 0.5).collect(),
        base_on_delaunay: identity,
        delaunay_on_flat: base_on_flat.clone(),
        base_on_flat,
        base_length,
        base,
        flat,
    };
    Case {
        mesh,
        intrinsic,
        length,
        curves,
        places: Positions {
            on_base,
            on_flat,
            unmatched: 0,
        },
    }
}

/// A geodesic triangulation of the surface's own metric, reached by Euclidean flips.
fn geodesic_case(mesh: Mesh, flips: usize, seed: u64) -> Case {
    let mut random = Random(seed);
    let base = double(&mesh.connectivity);
    let n = mesh.connectivity.halfedge_count();
    let c = &mesh.connectivity;
    let in_space = |e: EdgeId| {
        let h = base.edge_halfedge(e).index();
        let h = if h < n {
            h
        } else {
            3 * ((h - n) / 3) + 2 - h % 3
        };
        mesh.edge_length(c.edge(HalfedgeId::new(h)))
    };
    let base_length: EdgeVec<f64> = base.edges().map(in_space).collect();
    let (mut flat, mut length) = (base.clone(), base_length.clone());
    let identity = Correspondence::identity(&base);
    let mut base_on_flat = identity.clone();
    for _ in 0..flips {
        let e = EdgeId::new(random.below(flat.edge_count()));
        let h = flat.edge_halfedge(e);
        let t = flat.twin(h).unwrap();
        let side = |h: HalfedgeId| length[flat.edge(h)];
        let corner =
            |h: HalfedgeId| angles([side(flat.next(h)), side(flat.prev(h)), side(h)]).unwrap();
        let (upper, lower) = (corner(h), corner(t));
        // Angles at the two ends of the edge, in a strictly convex quad.
        let (at_tail, at_head) = (upper[0] + lower[1], upper[1] + lower[0]);
        if at_tail.max(at_head) > 3.0 {
            continue;
        }
        let (a, b) = (side(flat.prev(h)), side(flat.next(t)));
        let diagonal = (a * a + b * b - 2.0 * a * b * at_tail.cos()).sqrt();
        if let Some(flip) = flat.flip(e) {
            length[e] = diagonal;
            base_on_flat.flipped(&flat, &flip);
        }
    }
    let curves = base_on_flat.trace(&base, &flat).unwrap();
    let intrinsic = Intrinsic {
        front_faces: c.face_count(),
        delaunay: flat.clone(),
        delaunay_length: length.clone(),
        delaunay_penner: None,
        penner: length.iter().map(|l| l.ln()).collect(),
        u: VertexVec::filled(0.0, base.vertex_count()),
        base_on_delaunay: base_on_flat.clone(),
        delaunay_on_flat: Correspondence::identity(&flat),
        base_on_flat,
        base_length,
        base,
        flat,
    };
    let places = positions::positions(&intrinsic, &curves, SPACING).unwrap();
    assert_eq!(places.unmatched, 0);
    Case {
        mesh,
        intrinsic,
        length,
        curves,
        places,
    }
}

/// Angle sums by lengths.
fn angle_sums(c: &Connectivity, length: &EdgeVec<f64>) -> VertexVec<f64> {
    let mut sums = VertexVec::filled(0.0, c.vertex_count());
    for f in c.faces() {
        let angle = angles(c.face_edges(f).map(|e| length[e])).expect("a triangle");
        for (v, a) in c.face_vertices(f).into_iter().zip(angle) {
            sums[v] += a;
        }
    }
    sums
}

fn total_area(c: &Connectivity, length: &EdgeVec<f64>) -> f64 {
    let face = |f: FaceId| area(c.face_edges(f).map(|e| length[e])).expect("a triangle");
    c.faces().map(face).sum()
}

fn curvature(c: &Connectivity, length: &EdgeVec<f64>) -> VertexVec<f64> {
    let sums = angle_sums(c, length);
    let full = |v| if c.is_boundary_vertex(v) { PI } else { TAU };
    sums.enumerate().map(|(v, s)| full(v) - s).collect()
}

impl Case {
    fn overlay(&self) -> Overlay {
        let c = &self.mesh.connectivity;
        let metric = FlatMetric {
            log_scale: c.vertices().map(|v| self.intrinsic.u[v]).collect(),
            length: self.length.clone(),
            intrinsic: None,
            curvature: VertexVec::filled(0.0, c.vertex_count()),
            history: Vec::new(),
            max_curvature_error: 0.0,
            fit: None,
            opened: None,
            quarter_turns: None,
        };
        let target = VertexVec::filled(0.0, c.vertex_count());
        let prescription = Prescription::new(target, BoundaryCondition::Free);
        refine(
            self.mesh.clone(),
            metric,
            prescription,
            self.intrinsic.clone(),
            &self.curves,
            &self.places,
        )
        .unwrap()
    }

    fn is_closed(&self) -> bool {
        self.mesh.connectivity.is_closed()
    }

    /// Everything that must hold of an overlay in space, and of its edges as curves.
    fn check_surface(&self, o: &Overlay) {
        let (c, base) = (&o.mesh.connectivity, &self.mesh.connectivity);
        c.validate().unwrap();
        let (t, b) = (c.topology(), base.topology());
        assert_eq!(
            (t.euler_characteristic, t.genus, t.boundary_loops),
            (b.euler_characteristic, b.genus, b.boundary_loops)
        );
        // A base edge is a chain of overlay edges through its crossings, which lie where they were put.
        let edges: BTreeSet<[VertexId; 2]> = c
            .edges()
            .map(|e| {
                let [p, q] = c.edge_vertices(e);
                assert_ne!(p, q);
                [p.min(q), p.max(q)]
            })
            .collect();
        assert_eq!(edges.len(), c.edge_count(), "a simple mesh stays simple");
        let by_place: BTreeMap<[u64; 3], VertexId> = c
            .vertices()
            .map(|v| (o.mesh.positions[v].map(f64::to_bits), v))
            .collect();
        let mut crossings = 0;
        let doubled = &self.intrinsic.base;
        let front = |h: HalfedgeId| h.index() < base.halfedge_count();
        let is_ours = |e: EdgeId| {
            let h = doubled.edge_halfedge(e);
            front(h) || doubled.twin(h).is_some_and(front)
        };
        for e in doubled.edges().filter(|&e| is_ours(e)) {
            let [p, q] = doubled.edge_vertices(e).map(|v| self.mesh.positions[v]);
            let mut last = doubled.edge_vertices(e)[0];
            for i in self.curves.range(e) {
                let t = self.places.on_base[i];
                let at: [f64; 3] = std::array::from_fn(|i| (1.0 - t) * p[i] + t * q[i]);
                let v = by_place[&at.map(f64::to_bits)];
                assert!(edges.contains(&[v.min(last), v.max(last)]));
                assert_eq!(o.mesh.source_vertex[v], NONE);
                last = v;
                crossings += 1;
            }
            let end = doubled.edge_vertices(e)[1];
            assert!(edges.contains(&[end.min(last), end.max(last)]));
        }
        assert_eq!(c.vertex_count(), base.vertex_count() + crossings);
        for v in base.vertices() {
            assert_eq!(o.mesh.positions[v], self.mesh.positions[v]);
            assert_eq!(o.mesh.source_vertex[v], self.mesh.source_vertex[v]);
        }
        // Faces tile the base faces.
        let mut tiled = vec![0.0; base.face_count()];
        for f in c.faces() {
            let source = o.mesh.source_face[f] as usize;
            let outer = self.mesh.face_positions(FaceId::new(source));
            let inner = o.mesh.face_positions(f);
            let normal = |p: [[f64; 3]; 3]| cross(sub(p[1], p[0]), sub(p[2], p[0]));
            let n = normal(outer);
            let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            assert!(dot(n, normal(inner)) > 0.0, "turned over in space");
            for p in inner {
                for k in 0..3 {
                    let weight = dot(n, normal([p, outer[k], outer[(k + 1) % 3]])) / dot(n, n);
                    assert!(weight > -1e-14, "outside its source face");
                }
            }
            tiled[source] += triangle_area(inner);
            assert_eq!(
                o.mesh.face_material[f],
                self.mesh.face_material[FaceId::new(source)]
            );
            for (k, p) in inner.into_iter().enumerate() {
                let value = o.mesh.attributes[0].corner(f.index(), k);
                for i in 0..3 {
                    assert!((f64::from(value[i]) - p[i]).abs() < 1e-6);
                }
            }
        }
        for (f, area) in tiled.into_iter().enumerate() {
            let whole = triangle_area(self.mesh.face_positions(FaceId::new(f)));
            assert!((area - whole).abs() < 1e-12 * whole);
        }
    }

    /// Everything that must hold of its flat lengths.
    fn check_metric(&self, o: &Overlay) {
        let (c, layout) = (&o.mesh.connectivity, &o.layout);
        let under = &layout.connectivity;
        under.validate().unwrap();
        assert_eq!(under.topology().genus, c.topology().genus);
        assert_eq!(under.topology().boundary_loops, c.topology().boundary_loops);
        if self.is_closed() && !self.curves.crossing.is_empty() {
            assert_eq!(layout.connectivity, self.intrinsic.flat);
        }
        let area = total_area(under, &layout.length);
        assert!((total_area(c, &o.metric.length) - area).abs() < 1e-11 * area);
        // Crossings off the mirror are flat, whatever the lengths; all others have the curvature of the layout.
        let (k, k_under) = (
            curvature(c, &o.metric.length),
            curvature(under, &layout.length),
        );
        for v in c.vertices() {
            let expected = match v.index() < under.vertex_count() {
                true => k_under[v],
                false => 0.0,
            };
            assert!(
                (k[v] - expected).abs() < 1e-9,
                "vertex {v}: {} {expected}",
                k[v]
            );
        }
        // A layout edge is as long as its chain, and has its ends.
        for e in under.edges() {
            let h = under.edge_halfedge(e);
            let chain = layout.chain(h, c);
            assert_eq!(chain.is_empty(), !layout.may_cut[e]);
            let (Some(&first), Some(&last)) = (chain.first(), chain.last()) else {
                continue;
            };
            assert_eq!(
                (c.tail(first), c.head(last)),
                (under.tail(h), under.head(h))
            );
            assert!(chain.windows(2).all(|w| c.head(w[0]) == c.tail(w[1])));
            let sum: f64 = chain.iter().map(|&h| o.metric.length[c.edge(h)]).sum();
            assert!((sum - layout.length[e]).abs() < 1e-13);
        }
        for h in c.halfedges() {
            let carrier = layout.carrier(h);
            assert!((0.0..=1.0).contains(&carrier.fraction));
            let cell = layout.cell[under.face(carrier.halfedge)];
            assert_eq!(cell, layout.cell_under(c.face(h)));
        }
    }

    /// The whole way down: cut, development, charts, measured by the report.
    fn check_atlas(&self, o: &Overlay) {
        let (c, layout) = (&o.mesh.connectivity, &o.layout);
        let mut target = curvature(c, &o.metric.length);
        for v in c
            .vertices()
            .filter(|v| v.index() >= layout.connectivity.vertex_count())
        {
            target[v] = 0.0;
        }
        let prescription = Prescription::new(target, BoundaryCondition::Uniform);
        let layout_cut = cut(
            &layout.connectivity,
            &layout.cut_cost(&o.mesh),
            &prescription,
        )
        .unwrap();
        let cut = layout.lift(&layout_cut, c);
        let in_space: f64 = cut
            .is_cut
            .enumerate()
            .filter(|&(_, &is_cut)| is_cut)
            .map(|(e, _)| o.mesh.edge_length(e))
            .sum();
        let cost = layout.cut_cost(&o.mesh);
        let planned = layout_cut.is_cut.enumerate().filter(|&(_, &is_cut)| is_cut);
        let planned: f64 = planned.map(|(e, _)| cost[e]).sum();
        assert!((in_space - planned).abs() <= 1e-12 * planned);
        let unfolded = develop(layout, layout_cut).unwrap();
        let central = Development::place(c, &cut, layout, &unfolded);
        let charts = chart(c, &cut, &central, layout, &unfolded, &prescription).unwrap();
        let q = report::measure(&o.mesh, &o.metric, &cut, &central, &charts, &prescription);
        assert!(q.layout_closing_error < 1e-11, "{q:?}");
        assert!(q.transition_residual < 1e-11, "{q:?}");
        assert!(q.holonomy_error < 1e-9, "{q:?}");
        assert!(q.cocycle_error < 1e-11, "{q:?}");
        for (f, uv) in central.uv.enumerate() {
            let flat = area(c.face_edges(f).map(|e| o.metric.length[e])).unwrap();
            let doubled = crate::atlas::plane::doubled_area(*uv);
            assert!(
                (0.5 * doubled - flat).abs() < 1e-11,
                "face {f} in the plane"
            );
        }
        let under = Some((layout, &unfolded));
        let own = own_development_error(&o.mesh, &o.metric.length, &cut, &central, under);
        assert!(own < 1e-12, "{own}");
        let segments = &cut.segments;
        assert_eq!(charts.gluings.len(), segments.len());
        for segment in segments {
            let chained = segment.halfedges.windows(2);
            assert!(chained.into_iter().all(|w| c.head(w[0]) == c.tail(w[1])));
        }
    }

    fn check(&self) -> Overlay {
        let o = self.overlay();
        self.check_surface(&o);
        self.check_metric(&o);
        self.check_atlas(&o);
        o
    }
}

#[test]
fn closed_surfaces() {
    for (i, make) in [tetrahedron, octahedron, ring_of_cubes]
        .into_iter()
        .enumerate()
    {
        for flips in [1, 2, 3, 5, 8, 13, 21] {
            for seed in 0..6 {
                let case = case(make(), flips, 100 * i as u64 + seed);
                let o = case.check();
                assert!(case.curves.crossing.is_empty() || o.layout.refinement.is_some());
            }
        }
    }
}

#[test]
fn surfaces_with_boundary() {
    let shapes: [fn() -> Mesh; 5] = [
        fan,
        || open_box(1),
        || open_box(2),
        || open_box(3),
        || {
            mesh(
                vec![[0.0; 3], [1.0, 0.0, 0.0], [0.2, 1.0, 0.0]],
                &[[0, 1, 2]],
            )
        },
    ];
    let (mut diagonals, mut on_mirror) = (0, 0);
    for (i, make) in shapes.into_iter().enumerate() {
        for flips in [1, 2, 3, 5, 8, 13, 21, 60] {
            for seed in 0..6 {
                // Many flips of few edges wind too often around.
                if flips > 13 && make().connectivity.face_count() < 10 {
                    continue;
                }
                let o = case(make(), flips, 1000 + 100 * i as u64 + seed).check();
                diagonals += o.layout.may_cut.iter().filter(|&&may| !may).count();
                let vertices = o.mesh.source_vertex.iter().filter(|&&v| v != NONE);
                on_mirror += o.layout.connectivity.vertex_count() - vertices.count();
            }
        }
    }
    assert!(
        diagonals > 50 && on_mirror > 100,
        "the mirror passes through faces: {diagonals} {on_mirror}"
    );
}

#[test]
fn nothing_changes_where_nothing_was_flipped() {
    for make in [tetrahedron, fan] {
        let case = case(make(), 0, 5);
        let o = case.check();
        assert_eq!(o.mesh.connectivity, case.mesh.connectivity);
        assert!(o.layout.refinement.is_none());
    }
}

#[test]
fn broken_correspondences_are_refused() {
    let good = case(octahedron(), 6, 3);
    let count = good.curves.crossing.len();
    assert!(count > 4);
    let refuse = |change: &dyn Fn(&mut Case)| {
        let mut bad = case(octahedron(), 6, 3);
        change(&mut bad);
        let c = &bad.mesh.connectivity;
        let metric = FlatMetric {
            log_scale: VertexVec::filled(0.0, c.vertex_count()),
            length: bad.length.clone(),
            intrinsic: None,
            curvature: VertexVec::filled(0.0, c.vertex_count()),
            history: Vec::new(),
            max_curvature_error: 0.0,
            fit: None,
            opened: None,
            quarter_turns: None,
        };
        let target = VertexVec::filled(0.0, c.vertex_count());
        let prescription = Prescription::new(target, BoundaryCondition::Free);
        let (mesh, intrinsic) = (bad.mesh.clone(), bad.intrinsic.clone());
        let result = refine(
            mesh,
            metric,
            prescription,
            intrinsic,
            &bad.curves,
            &bad.places,
        );
        assert!(result.is_err());
    };
    refuse(&|c| c.places.on_base[0] = f64::NAN);
    refuse(&|c| c.places.on_flat[0] = 1.5);
    refuse(&|c| c.places.on_flat.truncate(1));
    refuse(&|c| c.intrinsic.front_faces -= 1);
    for i in 0..count {
        refuse(&|c| c.curves.crossing[i].rank += 1);
        refuse(&|c| {
            let h = c.curves.crossing[i].halfedge;
            c.curves.crossing[i].halfedge = c.intrinsic.flat.next(h);
        });
    }
}

#[test]
fn the_log_scale_lies_between_its_ends() {
    let case = case(octahedron(), 5, 9);
    let o = case.overlay();
    for (&place, x) in case.places.on_flat.iter().zip(&case.curves.crossing) {
        let flat = &case.intrinsic.flat;
        let [p, q] = flat
            .edge_vertices(flat.edge(x.halfedge))
            .map(|v| case.intrinsic.u[v]);
        let expected = ((1.0 - place) * p.exp() + place * q.exp()).ln();
        let found = o
            .metric
            .log_scale
            .iter()
            .any(|u| (u - expected).abs() < 1e-14);
        assert!(found);
    }
}

/// Where the flat metric is the surface's own, every edge of the overlay is as long as it is in space.
#[test]
fn the_own_metric_is_found_again() {
    let shapes: [fn() -> Mesh; 7] = [
        tetrahedron,
        octahedron,
        ring_of_cubes,
        fan,
        || open_box(1),
        || open_box(2),
        || open_box(3),
    ];
    for (i, make) in shapes.into_iter().enumerate() {
        for flips in [3, 10, 100] {
            for seed in 0..6 {
                let mut mesh = make();
                // No two edges are the same, and some faces are thin.
                let mut random = Random(77 + seed);
                for p in mesh.positions.as_mut_slice() {
                    *p = [
                        p[0] + 0.2 * random.unit(),
                        p[1] + 0.2 * random.unit(),
                        3.0 * p[2],
                    ];
                }
                let case = geodesic_case(with_attribute(mesh), flips, 500 * i as u64 + seed);
                let o = case.check();
                let c = &o.mesh.connectivity;
                for e in c.edges() {
                    let gap = o.metric.length[e] - o.mesh.edge_length(e);
                    assert!(gap.abs() < 1e-9, "{gap}");
                }
                // The mirror is straight.
                let k = curvature(c, &o.metric.length);
                for v in c.vertices().skip(case.mesh.connectivity.vertex_count()) {
                    assert!(k[v].abs() < 1e-7, "{}", k[v]);
                }
            }
        }
    }
}
