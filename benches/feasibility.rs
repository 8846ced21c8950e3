//! How long (6) takes to be decided: CPU seconds and peak memory on meshes named as arguments, for Φ ≡ 0 and for Thurston's Φ,
//! for cones that are possible and for such that are not.
//!
//! `cargo bench --bench feasibility -- [--levels N] [--runs N] MESH…`: each mesh and its N midpoint subdivisions, one thread, the
//! fastest of the runs.

mod common;

use affine_atlas::flow::cones::BoundaryCondition;
use affine_atlas::flow::feasibility::Constraint;
use affine_atlas::flow::packing;
use affine_atlas::geometry::connectivity::Connectivity;
use affine_atlas::geometry::ids::{EdgeVec, VertexId, VertexVec};
use common::{Arguments, Triangles, cpu_seconds, forget_peak, peak_mebibytes};
use std::error::Error;
use std::f64::consts::PI;

fn main() -> Result<(), Box<dyn Error>> {
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
            println!(
                "{} level {level}: {} vertices",
                mesh.display(),
                triangles.positions.len()
            );
            measure(&triangles, arguments.runs)?;
        }
    }
    Ok(())
}

fn measure(triangles: &Triangles, runs: usize) -> Result<(), Box<dyn Error>> {
    let c = Connectivity::from_faces(&triangles.faces, triangles.positions.len())?;
    let length: EdgeVec<f64> = c
        .edges()
        .map(|e| {
            let [a, b] = c.edge_vertices(e).map(|v| triangles.positions[v.index()]);
            (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
        })
        .collect();
    let phi = packing::fit(&c, &length)?.intersection_angles();
    for (cones, target) in prescriptions(&c) {
        for (scheme, phi) in [("tangential", None), ("thurston", Some(&phi))] {
            let (mut best, mut peak, mut verdict) = (f64::INFINITY, 0.0, String::new());
            for _ in 0..runs {
                forget_peak();
                let start = cpu_seconds();
                let free = BoundaryCondition::Free;
                let regions = Constraint::new(&c, phi, &target, free, 1.0).offending_regions();
                best = best.min(cpu_seconds() - start);
                peak = peak_mebibytes();
                let size: usize = regions.iter().map(|r| r.vertices.len()).sum();
                verdict = match regions.len() {
                    0 => "possible".into(),
                    count => format!("impossible: {size} vertices in {count} regions"),
                };
            }
            println!("  {cones:<28} {scheme:<11}{best:8.3} s {peak:6.0} MiB  {verdict}");
        }
    }
    Ok(())
}

/// Cones by edge-graph distance, with the total that a closed surface needs.
fn prescriptions(c: &Connectivity) -> Vec<(String, VertexVec<f64>)> {
    let total = 2.0 * PI * c.topology().euler_characteristic as f64;
    let spread = spread(c, 16);
    let prescribe = |cones: &[(VertexId, f64)]| {
        let mut target = VertexVec::filled(0.0, c.vertex_count());
        for &(v, k) in cones {
            target[v] += k;
        }
        target
    };
    let equal: Vec<_> = spread[..8].iter().map(|&v| (v, total / 8.0)).collect();
    let strong = |k: f64| -> Vec<(VertexId, f64)> {
        let rest = (total - k) / 15.0;
        let others = spread[1..].iter().map(|&v| (v, rest));
        std::iter::once((spread[0], k)).chain(others).collect()
    };
    // A ring of strong cones: a region that no single vertex tells of.
    let ring: Vec<VertexId> = c.neighbours(spread[0]).collect();
    let each = -3.5 * PI;
    let rest = (total - each * ring.len() as f64) / (c.vertex_count() - ring.len()) as f64;
    let mut crowded = VertexVec::filled(rest, c.vertex_count());
    for &v in &ring {
        crowded[v] = each;
    }
    vec![
        ("8 equal cones".into(), prescribe(&equal)),
        (
            "one of -3π, 15 for it".into(),
            prescribe(&strong(-3.0 * PI)),
        ),
        (
            "one of -12π, 15 for it".into(),
            prescribe(&strong(-12.0 * PI)),
        ),
        ("a ring of -3.5π, all for it".into(), crowded),
    ]
}

/// Vertices far from each other, by edges.
fn spread(c: &Connectivity, count: usize) -> Vec<VertexId> {
    let mut chosen = vec![VertexId::new(0)];
    let mut distance = VertexVec::filled(usize::MAX, c.vertex_count());
    while let Some(&last) = chosen.last() {
        distance[last] = 0;
        let mut queue = std::collections::VecDeque::from([last]);
        while let Some(v) = queue.pop_front() {
            for w in c.neighbours(v) {
                if distance[w] > distance[v] + 1 {
                    distance[w] = distance[v] + 1;
                    queue.push_back(w);
                }
            }
        }
        if chosen.len() == count {
            break;
        }
        let farthest = c.vertices().max_by_key(|&v| (distance[v], v));
        chosen.extend(farthest);
    }
    chosen
}
