//! What must not matter: how fine the mesh is, where and how large it is, the order of its vertices, the number of threads.

use crate::common::Triangles;
use crate::models::{self, Chosen, Random, distance};
use affine_atlas::flow::cones::{BoundaryCondition, ConeParams};
use affine_atlas::geometry::mesh::Mesh;
use std::path::Path;

/// Numbers of cones.
const COUNTS: [usize; 2] = [4, 8];
/// Share by which another choice may be better.
const TIE: f64 = 0.02;
/// Greatest difference of a curvature, radians.
const CURVATURE: f64 = 1e-9;

/// On the midpoint-subdivided model every cone lies within two edge lengths of the coarse model of the coarse model's cone, one to one;
/// or each set of cones is the better one on its own mesh: what strong cones are worth depends on the mesh by some hundredths.
///
/// The edge length is the mean of the mesh or the longest edge at the cone, whichever is longer.
pub fn subdivision(file: &Path, condition: BoundaryCondition) -> Result<(), String> {
    let coarse = models::read(file);
    let mut fine = models::read(file);
    fine.subdivide();
    let (coarse, fine) = (models::mesh(&coarse), models::mesh(&fine));
    let mut failed = Vec::new();
    // Near a cone of −2π the area that shrinks, ∫e^{−2u}, is infinite on a smooth surface: what such cones are worth depends on the mesh alone.
    let strong = -coarse.connectivity.topology().euler_characteristic as f64;
    for count in COUNTS.into_iter().filter(|&c| c as f64 > strong) {
        let params = params(count);
        let (_, few) = models::choose(&coarse, &params, condition)?;
        let (_, many) = models::choose(&fine, &params, condition)?;
        let (off, shift) = pair(&coarse, &few, &fine, &many);
        println!(
            "{count}: {} and {} cones, curvatures differ by up to {shift:.3}, apart in edges {off:.2?}",
            few.len(),
            many.len()
        );
        let worst = off.iter().fold(0.0f64, |a, b| a.max(*b));
        if few.len() == many.len() && worst <= 2.0 {
            continue;
        }
        // Two optima, or a miss? Vertices of the coarse mesh keep their numbers in the fine one; the other way the nearest is taken.
        let nearest = |at: [f64; 3]| {
            let far = |v: &usize| distance(at, coarse.positions.as_slice()[*v]);
            let vertices = 0..coarse.positions.len();
            vertices.min_by(|a, b| far(a).total_cmp(&far(b)))
        };
        let mut moved = Vec::new();
        for (v, k) in &many {
            let v = nearest(fine.positions.as_slice()[*v as usize]).ok_or("no vertex")?;
            moved.push((v as u32, *k));
        }
        let mut worth = Vec::new();
        for (mesh, own, other) in [(&coarse, &few, &moved), (&fine, &many, &few)] {
            let of = |cones: &[Chosen]| {
                let given = models::prescribe(mesh, cones, condition)?;
                Ok::<_, String>(models::distortion(mesh, &given)?.cost.sqrt())
            };
            worth.push([of(own)?, of(other)?]);
        }
        println!("{count}: its own and the other's: {worth:.5?}");
        if worth.iter().all(|[own, other]| *own < other * (1.0 + TIE)) {
            continue;
        }
        failed.push(format!(
            "{count}: {} and {} cones up to {worst:.1} edges apart; on each mesh with its own and the other's: {worth:.5?}",
            few.len(),
            many.len()
        ));
    }
    match failed.is_empty() {
        true => Ok(()),
        false => Err(failed.join("; ")),
    }
}

/// The same cones after a rigid motion, at another size, with other numbers, and with other threads.
pub fn invariance(file: &Path) -> Result<(), String> {
    let triangles = models::read(file);
    let condition = BoundaryCondition::Free;
    for count in COUNTS {
        let params = params(count);
        let of = |triangles: &Triangles| {
            let (_, chosen) = models::choose(&models::mesh(triangles), &params, condition)?;
            Ok::<_, String>(chosen)
        };
        let chosen = of(&triangles)?;
        for scale in [1.0, 1e-3, 1e3] {
            let moved = of(&moved(&triangles, scale))?;
            same(&chosen, &moved).map_err(|e| format!("{count}, turned, times {scale}: {e}"))?;
        }
        let (shuffled, place) = shuffled(&triangles);
        let mut back: Vec<Chosen> = of(&shuffled)?;
        for cone in &mut back {
            let found = place.iter().position(|&to| to == cone.0 as usize);
            cone.0 = found.ok_or("no such vertex")? as u32;
        }
        back.sort_by_key(|cone| cone.0);
        same(&chosen, &back).map_err(|e| format!("{count}, vertices shuffled: {e}"))?;
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let pool = pool.build().map_err(|e| e.to_string())?;
            let other = pool.install(|| of(&triangles))?;
            let bits = |c: &[Chosen]| c.iter().map(|c| (c.0, c.1.to_bits())).collect::<Vec<_>>();
            if bits(&other) != bits(&chosen) {
                return Err(format!(
                    "{count}, {threads} threads: {other:?}, not {chosen:?}"
                ));
            }
        }
    }
    Ok(())
}

fn params(count: usize) -> ConeParams {
    ConeParams {
        count: Some(count),
        ..ConeParams::default()
    }
}

fn same(a: &[Chosen], b: &[Chosen]) -> Result<(), String> {
    let close = |(a, b): (&Chosen, &Chosen)| a.0 == b.0 && (a.1 - b.1).abs() <= CURVATURE;
    match a.len() == b.len() && a.iter().zip(b).all(close) {
        true => Ok(()),
        false => Err(format!("{b:?}, not {a:?}")),
    }
}

/// Nearest pairs first: distances in edges of the coarse mesh, and the greatest difference of curvatures.
fn pair(coarse: &Mesh, few: &[Chosen], fine: &Mesh, many: &[Chosen]) -> (Vec<f64>, f64) {
    let c = &coarse.connectivity;
    let mean = c.edges().map(|e| coarse.edge_length(e)).sum::<f64>() / c.edge_count() as f64;
    let mut pairs = Vec::new();
    for (i, a) in few.iter().enumerate() {
        let v = c.vertices().nth(a.0 as usize).unwrap();
        let at = coarse.positions[v];
        let unit = c
            .neighbours(v)
            .map(|w| distance(at, coarse.positions[w]))
            .fold(mean, f64::max);
        for (j, b) in many.iter().enumerate() {
            let other = fine.positions.as_slice()[b.0 as usize];
            pairs.push((distance(at, other) / unit, i, j));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut left, mut right) = (vec![false; few.len()], vec![false; many.len()]);
    let mut off = Vec::new();
    let mut shift = 0.0f64;
    for (far, i, j) in pairs {
        if !left[i] && !right[j] {
            (left[i], right[j]) = (true, true);
            off.push(far);
            shift = shift.max((few[i].1 - many[j].1).abs());
        }
    }
    (off, shift)
}

fn moved(triangles: &Triangles, scale: f64) -> Triangles {
    let (s, c) = 0.7_f64.sin_cos();
    let turn = |[x, y, z]: [f64; 3]| [c * x - s * y, s * x + c * y, z];
    let positions = triangles.positions.iter().map(|&p| {
        let [x, y, z] = turn(p);
        let [y, z, x] = turn([y, z, x]);
        [x + 0.5, y - 0.2, z + 1.1].map(|x| scale * x)
    });
    Triangles {
        faces: triangles.faces.clone(),
        positions: positions.collect(),
    }
}

/// Other numbers of vertices and faces, and other first corners; where each vertex went.
fn shuffled(triangles: &Triangles) -> (Triangles, Vec<usize>) {
    let mut random = Random(99);
    let place = random.permutation(triangles.positions.len());
    let mut positions = triangles.positions.clone();
    for (v, &to) in place.iter().enumerate() {
        positions[to] = triangles.positions[v];
    }
    let order = random.permutation(triangles.faces.len());
    let faces = order.iter().enumerate().map(|(i, &f)| {
        let mut face = triangles.faces[f].map(|v| place[v as usize] as u32);
        face.rotate_left(i % 3);
        face
    });
    let faces = faces.collect();
    (Triangles { faces, positions }, place)
}
