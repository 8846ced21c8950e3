//! Symmetric shapes get symmetric cones.

use crate::common::Triangles;
use crate::models::{self, Chosen, distance};
use affine_atlas::flow::cones::{BoundaryCondition, ConeParams};
use std::f64::consts::PI;

/// Flat faces: what bends the surface are the corners, and there is nothing left to distort.
pub fn platonic() -> Result<(), String> {
    let mut failed = Vec::new();
    for (name, mut shape, levels, corners) in [
        ("tetrahedron", tetrahedron(), 4, 4),
        ("octahedron", octahedron(), 3, 6),
        ("cube", cube(), 3, 8),
    ] {
        for level in 0..=levels {
            if level > 0 {
                shape.subdivide();
            }
            let mesh = models::mesh(&shape);
            for count in [corners, corners + 4] {
                let params = ConeParams {
                    count: Some(count),
                    ..ConeParams::default()
                };
                let (given, chosen) = models::choose(&mesh, &params, BoundaryCondition::Free)?;
                let curvature = 4.0 * PI / corners as f64;
                let expected = (0..corners as u32).map(|v| (v, curvature));
                let close = |(a, b): (&Chosen, Chosen)| a.0 == b.0 && (a.1 - b.1).abs() < 1e-9;
                if chosen.len() != corners || !chosen.iter().zip(expected).all(close) {
                    failed.push(format!("{name} level {level}, {count}: {chosen:?}"));
                }
                let distortion = models::distortion(&mesh, &given)?;
                if distortion.area > 1e-18 || distortion.std > 1e-9 {
                    failed.push(format!("{name} level {level}, {count}: {distortion:?}"));
                }
            }
        }
    }
    match failed.is_empty() {
        true => Ok(()),
        false => Err(failed.join("\n")),
    }
}

/// A shape with one plane of symmetry, connectivity included: each cone has its mirror image among the cones, or the choice is better
/// than both symmetric ones that half of it makes.
pub fn mirror() -> Result<(), String> {
    let shape = bumps();
    let mesh = models::mesh(&shape);
    let c = &mesh.connectivity;
    let edge = c.edges().map(|e| mesh.edge_length(e)).sum::<f64>() / c.edge_count() as f64;
    let at = |v: u32| shape.positions[v as usize];
    let reflect = |[x, y, z]: [f64; 3]| [-x, y, z];
    let image = |v: u32| {
        let to = reflect(at(v));
        let found = shape.positions.iter().position(|p| distance(*p, to) < 1e-9);
        found.map(|v| v as u32).ok_or("no mirror image")
    };
    let mut failed = Vec::new();
    for count in [4, 5, 6, 8, 10, 12, 16] {
        let params = ConeParams {
            count: Some(count),
            ..ConeParams::default()
        };
        let (given, chosen) = models::choose(&mesh, &params, BoundaryCondition::Free)?;
        let mut rest: Vec<&Chosen> = chosen.iter().collect();
        let mut worst = (0.0f64, 0.0f64);
        for a in &chosen {
            let far = |b: &Chosen| distance(reflect(at(a.0)), at(b.0));
            let nearest = (0..rest.len()).min_by(|&i, &j| far(rest[i]).total_cmp(&far(rest[j])));
            let Some(i) = nearest else { break };
            let b = rest.remove(i);
            worst = (worst.0.max(far(b) / edge), worst.1.max((a.1 - b.1).abs()));
        }
        let cost = models::distortion(&mesh, &given)?.cost.sqrt();
        println!(
            "{count}: {} cones, images up to {:.2} edges off, curvatures {:.4}; {cost:.5}",
            chosen.len(),
            worst.0,
            worst.1
        );
        if worst.0 <= 2.0 {
            continue;
        }
        for side in [1.0, -1.0] {
            let mut both = Vec::new();
            for &(v, k) in &chosen {
                let x = side * at(v)[0];
                if x.abs() <= edge {
                    both.push((v, k));
                } else if x > 0.0 {
                    both.extend([(v, k), (image(v)?, k)]);
                }
            }
            let missing = 4.0 * PI - both.iter().map(|c| c.1).sum::<f64>();
            let share = missing / both.len().max(1) as f64;
            both.iter_mut().for_each(|c| c.1 += share);
            if both.len() > count || both.len() < 3 {
                continue;
            }
            let given = models::prescribe(&mesh, &both, BoundaryCondition::Free);
            let other = given.and_then(|given| models::distortion(&mesh, &given));
            let Ok(other) = other.map(|d| d.cost.sqrt()) else {
                continue;
            };
            println!(
                "  {} symmetric cones made of one half: {other:.5}",
                both.len()
            );
            if other < cost {
                failed.push(format!(
                    "{count}: images {:.1} edges off, {cost:.5}; {} symmetric cones {other:.5}",
                    worst.0,
                    both.len()
                ));
            }
        }
    }
    match failed.is_empty() {
        true => Ok(()),
        false => Err(failed.join("\n")),
    }
}

/// A ball with five bumps, one of them on the plane of symmetry.
fn bumps() -> Triangles {
    let mut shape = octahedron();
    for _ in 0..5 {
        shape.subdivide();
    }
    for p in &mut shape.positions {
        let length = distance(*p, [0.0; 3]);
        let [x, y, z] = p.map(|x| x / length);
        let bump =
            |at: [f64; 3], sharp: f64| (-sharp * distance([x.abs(), y, z], at).powi(2)).exp();
        let r = 1.0
            + 0.9 * bump([0.8, 0.6, 0.0], 12.0)
            + 0.7 * bump([0.6, -0.48, 0.64], 20.0)
            + 1.1 * bump([0.0, 0.0, -1.0], 8.0);
        *p = [r * x, r * y, r * z];
    }
    shape
}

fn shape(positions: &[[f64; 3]], faces: &[[u32; 3]]) -> Triangles {
    Triangles {
        faces: faces.to_vec(),
        positions: positions.to_vec(),
    }
}

fn tetrahedron() -> Triangles {
    shape(
        &[
            [1.0, 1.0, 1.0],
            [1.0, -1.0, -1.0],
            [-1.0, 1.0, -1.0],
            [-1.0, -1.0, 1.0],
        ],
        &[[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
    )
}

pub fn octahedron() -> Triangles {
    shape(
        &[
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
        ],
        &[
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ],
    )
}

fn cube() -> Triangles {
    let corner = |i: u32| [i & 1, i >> 1 & 1, i >> 2 & 1].map(f64::from);
    let positions: Vec<[f64; 3]> = (0..8).map(corner).collect();
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    let faces: Vec<[u32; 3]> = quads.into_iter().flat_map(halves).collect();
    shape(&positions, &faces)
}
