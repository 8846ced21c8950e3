//! Surfaces, their cones, and what the true flow makes of them.

use crate::common::Triangles;
use affine_atlas::config::Config;
use affine_atlas::flow::cones::{
    self, BoundaryCondition, BoundaryParams, ConeParams, Prescription,
};
use affine_atlas::flow::ricci::{self, FlatMetric};
use affine_atlas::geometry::connectivity::Connectivity;
use affine_atlas::geometry::ids::{EdgeVec, VertexId};
use affine_atlas::geometry::mesh::{Mesh, Soup, triangle_area};
use affine_atlas::geometry::triangle;
use affine_atlas::product::AffineAtlas;
use affine_atlas::{atlas, build, repair};
use std::path::Path;

/// A chosen cone: vertex of the file, curvature in radians.
pub type Chosen = (u32, f64);

pub fn read(file: &Path) -> Triangles {
    Triangles::read(file).unwrap()
}

pub fn mesh(triangles: &Triangles) -> Mesh {
    let soup = soup(triangles);
    let mut repaired = repair::repair(&soup, &Default::default()).unwrap();
    assert_eq!(repaired.components.len(), 1, "one component");
    in_order_of_file(repaired.components.swap_remove(0).mesh.unwrap())
}

/// A mesh without attributes whose vertices and faces are all those of its file, in their order, which repair gives up for large ones.
fn in_order_of_file(mut mesh: Mesh) -> Mesh {
    if mesh.source_vertex.iter().is_sorted() {
        return mesh;
    }
    let (old, positions) = (mesh.source_vertex.clone(), mesh.positions.clone());
    let mut faces = vec![[0; 3]; mesh.source_face.len()];
    let given = mesh.connectivity.to_faces();
    for (face, &source) in given.iter().zip(mesh.source_face.iter()) {
        faces[source as usize] = face.map(|v| old[VertexId::new(v as usize)]);
    }
    for (v, &source) in old.enumerate() {
        mesh.positions[VertexId::new(source as usize)] = positions[v];
    }
    mesh.connectivity = Connectivity::from_faces(&faces, positions.len()).unwrap();
    mesh.source_vertex = (0..positions.len() as u32).collect::<Vec<_>>().into();
    mesh.source_face = (0..faces.len() as u32).collect();
    mesh
}

pub fn soup(triangles: &Triangles) -> Soup {
    Soup::from_triangles(triangles.positions.clone(), triangles.faces.clone())
}

pub fn boundary(condition: BoundaryCondition) -> BoundaryParams {
    BoundaryParams {
        condition: Some(condition),
        ..BoundaryParams::default()
    }
}

/// The cones that are chosen inside, by vertex of the file.
pub fn choose(
    mesh: &Mesh,
    params: &ConeParams,
    condition: BoundaryCondition,
) -> Result<(Prescription, Vec<Chosen>), String> {
    let given = cones::prescribe(
        mesh,
        &Default::default(),
        params,
        &boundary(condition),
        &Default::default(),
    );
    let given = given.map_err(|e| e.to_string())?;
    let inside = given
        .cones
        .iter()
        .filter(|cone| !mesh.connectivity.is_boundary_vertex(cone.vertex));
    let mut chosen: Vec<Chosen> = inside
        .map(|cone| (mesh.source_vertex[cone.vertex], cone.curvature))
        .collect();
    chosen.sort_by_key(|cone| cone.0);
    Ok((given, chosen))
}

/// The prescription with given cones inside; the boundary takes the rest.
pub fn prescribe(
    mesh: &Mesh,
    chosen: &[Chosen],
    condition: BoundaryCondition,
) -> Result<Prescription, String> {
    let cones = chosen
        .iter()
        .map(|&(vertex, curvature)| cones::RequestedCone {
            vertex: VertexId::new(vertex as usize),
            named: vertex,
            curvature,
        });
    let requests = cones::Requests {
        cones: cones.collect(),
        ..Default::default()
    };
    let params = ConeParams::default();
    cones::prescribe(
        mesh,
        &requests,
        &params,
        &boundary(condition),
        &Default::default(),
    )
    .map_err(|e| e.to_string())
}

pub fn flow(mesh: &Mesh, prescription: &Prescription) -> Result<FlatMetric, String> {
    let c = &mesh.connectivity;
    let length: EdgeVec<f64> = c.edges().map(|e| mesh.edge_length(e)).collect();
    ricci::flow(c, &length, prescription, &Default::default(), &()).map_err(|e| e.to_string())
}

/// What a choice costs.
#[derive(Clone, Copy, Debug)]
pub struct Distortion {
    /// (9).
    pub area: f64,
    /// Standard deviation of the log scale.
    pub std: f64,
    /// J = ln ∫e^{2u} + ln ∫e^{−2u}, which the choice makes least.
    pub cost: f64,
}

/// (9) and the standard deviation of ½ ln(flat/source area), both areas normalised, over the faces of the overlay.
pub fn distortion(mesh: &Mesh, prescription: &Prescription) -> Result<Distortion, String> {
    let metric = flow(mesh, prescription)?;
    let overlay = atlas::overlay::overlay(mesh.clone(), metric, prescription.clone());
    let overlay = overlay.map_err(|e| e.to_string())?;
    let c = &overlay.mesh.connectivity;
    let areas = |f| {
        let flat = c.face_edges(f).map(|e| overlay.metric.length[e]);
        let flat = triangle::area(flat).filter(|a| *a > 0.0)?;
        let source = triangle_area(overlay.mesh.face_positions(f));
        (source > 0.0).then_some([source, flat])
    };
    let rows: Vec<[f64; 2]> = c.faces().filter_map(areas).collect();
    let total = |i: usize| rows.iter().map(|r| r[i]).sum::<f64>();
    let (source, flat) = (total(0), total(1));
    let (mut area, mut mean, mut square, mut shrunk) = (0.0, 0.0, 0.0, 0.0);
    for [s, t] in rows {
        let (weight, share) = (s / source, t / flat);
        area += (share / weight - 1.0).powi(2) * weight;
        let log = 0.5 * (share / weight).ln();
        mean += weight * log;
        square += weight * log * log;
        // The mean factor of growing is 1 here.
        shrunk += weight * weight / share;
    }
    let std = (square - mean * mean).max(0.0).sqrt();
    let cost = shrunk.ln();
    Ok(Distortion { area, std, cost })
}

/// J = ln ∫e^{2u} + ln ∫e^{−2u} over the area of a number at each vertex.
pub fn cost(mesh: &Mesh, u: &[f64]) -> f64 {
    let c = &mesh.connectivity;
    let (mut total, mut grown, mut shrunk) = (0.0, 0.0, 0.0);
    for f in c.faces() {
        let share = triangle_area(mesh.face_positions(f)) / 3.0;
        for v in c.face_vertices(f) {
            let factor = (2.0 * u[v.index()]).exp();
            total += share;
            grown += share * factor;
            shrunk += share / factor;
        }
    }
    f64::ln(grown / total) + f64::ln(shrunk / total)
}

/// Standard deviation over the area of a number at each vertex.
pub fn deviation(mesh: &Mesh, u: &[f64]) -> f64 {
    let c = &mesh.connectivity;
    let (mut total, mut mean, mut square) = (0.0, 0.0, 0.0);
    for f in c.faces() {
        let share = triangle_area(mesh.face_positions(f)) / 3.0;
        for v in c.face_vertices(f) {
            let u = u[v.index()];
            total += share;
            mean += share * u;
            square += share * u * u;
        }
    }
    (square / total - (mean / total).powi(2)).max(0.0).sqrt()
}

/// The finished atlas of the one component.
pub fn finished(triangles: &Triangles, cones: ConeParams) -> Result<AffineAtlas, String> {
    let config = Config {
        cones,
        ..Config::default().on_flat_patches()
    };
    let mut built = build(&soup(triangles), &config, &()).map_err(|e| e.to_string())?;
    assert_eq!(built.len(), 1, "one component");
    built.swap_remove(0).map_err(|e| e.to_string())
}

/// exp of the mean logarithm.
pub fn geometric_mean(ratios: &[f64]) -> f64 {
    (ratios.iter().map(|r| r.ln()).sum::<f64>() / ratios.len() as f64).exp()
}

pub fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// Numbers in [0, 1) without pattern, reproducible.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f64 {
        // SplitMix64.
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A permutation of 0 … n − 1.
    pub fn permutation(&mut self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        for i in (1..n).rev() {
            let j = (self.next() * (i + 1) as f64) as usize;
            order.swap(i, j.min(i));
        }
        order
    }
}
