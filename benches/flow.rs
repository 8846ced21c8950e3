//! The flow with flips against the machine itself: whole Newton solve in units of one ordering, factorisation and solve of
//! its final matrix; and the way to a seamless metric, cross field and Newton with all lengths, in units of that flow.
//!
//! `cargo bench --bench flow -- [--levels N] [--runs N] MESH…`: each mesh and its N midpoint subdivisions. One thread; each figure the
//! least of three.

mod common;

use affine_atlas::flow::cones::{
    self, BoundaryCondition, ConeParams, ConeStrategy, Prescription, Requests,
};
use affine_atlas::flow::ricci::{self, FlatMetric, FlowParams, Holonomy, Scheme};
use affine_atlas::flow::solve::SymmetricSolver;
use affine_atlas::geometry::connectivity::Connectivity;
use affine_atlas::geometry::ids::{EdgeId, EdgeVec, VertexId, VertexVec};
use common::{Arguments, Triangles, forget_peak, peak_mebibytes};
use std::f64::consts::PI;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()?;
    let arguments = Arguments::parse()?;
    for mesh in &arguments.meshes {
        let mut triangles = Triangles::read(mesh)?;
        for level in 0..=arguments.levels {
            if level > 0 {
                triangles.subdivide();
            }
            let name = format!("{} level {level}", mesh.display());
            forget_peak();
            let flow = measure(&name, &triangles, arguments.runs)?;
            let peak = peak_mebibytes();
            forget_peak();
            seamless(&triangles, arguments.runs, flow)?;
            println!(
                "    peak {:.2} of the flow's {peak:.0} MiB",
                peak_mebibytes() / peak
            );
        }
    }
    Ok(())
}

/// The stage with quarter turns by default; `flow`: seconds of the flow on the same mesh.
fn seamless(
    triangles: &Triangles,
    runs: usize,
    flow: f64,
) -> Result<(), Box<dyn std::error::Error>> {
    let mesh = triangles.mesh()?;
    let c = &mesh.connectivity;
    let length: EdgeVec<f64> = c.edges().map(|e| mesh.edge_length(e)).collect();
    let cones = ConeParams {
        strategy: ConeStrategy::Field,
        ..ConeParams::default()
    };
    let params = FlowParams {
        holonomy: Holonomy::QuarterTurns,
        ..FlowParams::default()
    };
    let (mut field, mut newton, mut steps) = (f64::INFINITY, f64::INFINITY, 0);
    for _ in 0..runs {
        let start = Instant::now();
        let requests = Requests::default();
        let (border, features) = (Default::default(), Default::default());
        let prescription = cones::prescribe(&mesh, &requests, &cones, &border, &features)?;
        field = field.min(start.elapsed().as_secs_f64());
        let start = Instant::now();
        let flat = ricci::flow(c, &length, &prescription, &params, &())?;
        newton = newton.min(start.elapsed().as_secs_f64());
        steps = flat.history.last().map_or(0, |s| s.iteration);
    }
    println!(
        "    quarter turns: field {field:.3} s, Newton {newton:.3} s in {steps} steps, {:.2} of the flow",
        (field + newton) / flow
    );
    Ok(())
}

/// Seconds of a flow.
fn measure(
    name: &str,
    Triangles { faces, positions }: &Triangles,
    runs: usize,
) -> Result<f64, Box<dyn std::error::Error>> {
    let connectivity = Connectivity::from_faces(faces, positions.len())?;
    let length: EdgeVec<f64> = connectivity
        .edges()
        .map(|e: EdgeId| {
            let [a, b] = connectivity.edge_vertices(e).map(|v| positions[v.index()]);
            (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
        })
        .collect();
    let prescription = eight_cones(&connectivity);
    let params = FlowParams {
        scheme: Scheme::VertexScaling,
        ..FlowParams::default()
    };
    let mut best = f64::INFINITY;
    let mut last = None;
    for _ in 0..runs {
        let start = Instant::now();
        let flat = ricci::flow(&connectivity, &length, &prescription, &params, &())?;
        best = best.min(start.elapsed().as_secs_f64());
        last = Some(flat);
    }
    let Some(flat) = last else { return Ok(best) };
    let solve = one_solve(&flat, runs)?;
    let steps = flat.history.last().map_or(0, |s| s.iteration);
    let flips: Vec<usize> = flat.history.iter().map(|s| s.flips).collect();
    println!(
        "{name}: {} vertices, {best:.3} s, {steps} steps, flips {flips:?}, one order + factor + solve {solve:.3} s, ratio {:.2}, |K − K̄| {:.1e}",
        connectivity.vertex_count(),
        best / solve,
        flat.max_curvature_error
    );
    Ok(best)
}

/// Cones of 2πχ / 8 at eight vertices, far apart in the list.
fn eight_cones(connectivity: &Connectivity) -> Prescription {
    let total = 2.0 * PI * connectivity.topology().euler_characteristic as f64;
    let mut target = VertexVec::filled(0.0, connectivity.vertex_count());
    for i in 0..8 {
        // The first vertices are those of the coarse mesh, whatever the subdivision.
        target[VertexId::new(i * 500)] = total / 8.0;
    }
    Prescription::new(target, BoundaryCondition::Free)
}

/// Least seconds of ordering, factorising and solving once the Hessian at the end.
fn one_solve(flat: &FlatMetric, runs: usize) -> Result<f64, Box<dyn std::error::Error>> {
    let intrinsic = flat.intrinsic.as_ref().ok_or("no flips")?;
    let c = &intrinsic.flat;
    let n = c.vertex_count() - 1;
    let mut diagonal = vec![0.0; n];
    let (mut pairs, mut values) = (Vec::new(), Vec::new());
    let cotangent = |h| {
        let f = c.face(h);
        let lengths = c.face_edges(f).map(|e| flat.length[e]);
        let all = affine_atlas::geometry::triangle::cotangents(lengths);
        all.map_or(0.0, |all| all[(c.corner(h) + 2) % 3])
    };
    for e in c.edges() {
        let h = c.edge_halfedge(e);
        let w = 0.5 * (cotangent(h) + c.twin(h).map_or(0.0, cotangent));
        let [i, j] = c.edge_vertices(e).map(VertexId::index);
        if i == j {
            continue;
        }
        for v in [i, j] {
            if v < n {
                diagonal[v] += w;
            }
        }
        if i < n && j < n {
            pairs.push([i as u32, j as u32]);
            values.push(-w);
        }
    }
    let mut best = f64::INFINITY;
    for _ in 0..runs {
        let mut rhs = vec![1.0; n];
        let start = Instant::now();
        let mut solver = SymmetricSolver::new(n, &pairs)?;
        solver.factorize(&diagonal, &values)?;
        solver.solve(&mut rhs);
        best = best.min(start.elapsed().as_secs_f64());
    }
    Ok(best)
}
