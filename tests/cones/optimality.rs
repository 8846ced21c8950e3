//! The choice against every choice there is, on tiny meshes, in the linear picture written out in full matrices.

use crate::common::Triangles;
use crate::dense::Matrix;
use crate::models::{self, Chosen, Random, distance};
use crate::symmetry::octahedron;
use affine_atlas::flow::cones::{BoundaryCondition, ConeParams, ConeStrategy, PiMultiple};
use affine_atlas::geometry::ids::{EdgeVec, VertexId};
use affine_atlas::geometry::mesh::{Mesh, triangle_area};
use affine_atlas::geometry::triangle;
use std::f64::consts::{PI, TAU};

/// What is asked for: the variance of the choice in the linear picture, or the square root of its true J, over the least.
const EXCESS: f64 = 1.05;
/// Choices whose metric is looked at.
const KEPT: usize = 12;
/// Shapes of each kind.
const SEEDS: u64 = 12;

/// A kind of surface.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// Ball with bumps, 18 vertices.
    Ball,
    /// Torus, 30 vertices.
    Torus,
    /// Hill with a border that takes what curvature it likes.
    FreeHill,
    /// Hill with a border of even curvature.
    EvenHill,
}

pub const SHAPES: [Shape; 4] = [Shape::Ball, Shape::Torus, Shape::FreeHill, Shape::EvenHill];

/// The selected cones are as good as the best subset of the same size: in the linear picture, or as the flow itself tells the best few
/// apart.
pub fn brute_force(shape: Shape) -> Result<(), String> {
    let condition = match shape {
        Shape::EvenHill => BoundaryCondition::Uniform,
        _ => BoundaryCondition::Free,
    };
    let counts = match shape {
        Shape::Ball => 3..=4,
        Shape::Torus => 2..=3,
        _ => 1..=3,
    };
    let (mut looked, mut hits, mut worst) = (0, 0, 1.0f64);
    let mut failed = Vec::new();
    for seed in 0..SEEDS {
        let mesh = models::mesh(&generate(shape, &mut Random(seed)));
        let Some(energy) = Energy::new(&mesh, condition) else {
            continue;
        };
        for count in counts.clone() {
            let params = ConeParams {
                count: Some(count),
                // Wide enough for three on a ball.
                max_curvature: PiMultiple::fraction(3, 2).unwrap(),
                ..ConeParams::default()
            };
            let (_, chosen) = models::choose(&mesh, &params, condition)?;
            let mut all = vec![0.0; energy.size()];
            for (v, k) in &chosen {
                all[*v as usize] = *k;
            }
            let linear = energy.of(&all);
            let ours = real_cost(&mesh, &chosen, condition)?;
            let range = [
                params.min_curvature.radians(),
                params.max_curvature.radians(),
            ];
            // The best few of the linear picture, by what the flow makes of them.
            let ranked = energy.ranked(&energy.interior, count, range);
            if chosen.len() == count && linear < ranked[0].0 * (1.0 - 1e-6) {
                return Err(format!(
                    "{shape:?} {seed}, {count}: {linear} below the least {}",
                    ranked[0].0
                ));
            }
            let ranked_least = ranked[0].0;
            let mut best = (f64::INFINITY, Vec::new());
            for (_, cones) in ranked {
                let cones: Vec<_> = cones.into_iter().map(|(v, k)| (v as u32, k)).collect();
                let variance = real_cost(&mesh, &cones, condition)?;
                if variance < best.0 {
                    best = (variance, cones);
                }
            }
            let in_picture = match chosen.len() == count {
                true => linear / ranked_least,
                false => f64::INFINITY,
            };
            let ratio = (ours / best.0).sqrt().min(in_picture);
            looked += 1;
            hits += usize::from(ratio < 1.0 + 1e-9);
            worst = worst.max(ratio);
            if ratio > EXCESS {
                failed.push(format!(
                    "{shape:?} {seed}, {count}: {ours:.5} with {chosen:.3?}, {:.5} with {:.3?}",
                    best.0, best.1
                ));
            }
        }
    }
    println!("{shape:?}: the best of all in {hits} of {looked}, worst {worst:.4} ×");
    if looked <= 6 {
        return Err(format!("only {looked} cases are Delaunay"));
    }
    match failed.is_empty() {
        true => Ok(()),
        false => Err(failed.join("\n")),
    }
}

/// Variance in the linear picture, and the cones.
type Ranked = (f64, Vec<(usize, f64)>);

/// J of the u that the flow finds.
fn real_cost(mesh: &Mesh, chosen: &[Chosen], condition: BoundaryCondition) -> Result<f64, String> {
    let metric = models::flow(mesh, &models::prescribe(mesh, chosen, condition)?)?;
    Ok(models::cost(mesh, metric.log_scale.as_slice()))
}

/// Variance of u as a quadratic function of the curvature of the interior vertices.
struct Energy {
    /// Gradient's linear part and half the second derivative: E = E₀ + 2 bᵀc + cᵀBc.
    constant: f64,
    slope: Vec<f64>,
    matrix: Matrix,
    /// What cones must add up to.
    total: Option<f64>,
    interior: Vec<usize>,
}

impl Energy {
    /// `None` where the mesh has a border and is not its own intrinsic Delaunay triangulation.
    fn new(mesh: &Mesh, condition: BoundaryCondition) -> Option<Self> {
        let surface = &mesh.connectivity;
        let n = surface.vertex_count();
        // Only flips in the surface itself are taken from the program; a border is looked at as it is.
        let edges = surface.edges();
        let mut intrinsic = (
            surface.clone(),
            edges.map(|e| mesh.edge_length(e)).collect(),
        );
        if surface.is_closed() {
            let spread = ConeParams {
                strategy: ConeStrategy::Spread,
                count: Some(4),
                ..ConeParams::default()
            };
            let strategy = match surface.topology().euler_characteristic {
                0 => ConeStrategy::None,
                _ => spread.strategy,
            };
            let spread = ConeParams { strategy, ..spread };
            let (given, _) = models::choose(mesh, &spread, condition).ok()?;
            let flipped = models::flow(mesh, &given).ok()?.intrinsic?;
            intrinsic = (flipped.delaunay, flipped.delaunay_length);
        }
        let (c, length) = &intrinsic;
        let length: &EdgeVec<f64> = length;
        let mut laplacian = Matrix::zero(n);
        let mut area = vec![0.0; n];
        for f in surface.faces() {
            for v in surface.face_vertices(f) {
                area[v.index()] += triangle_area(mesh.face_positions(f)) / 3.0;
            }
        }
        let on_boundary = |v: usize| c.is_boundary_vertex(VertexId::new(v));
        let full = |v: usize| if on_boundary(v) { PI } else { TAU };
        let mut curvature: Vec<f64> = (0..n).map(full).collect();
        let mut opposite = vec![0.0; c.edge_count()];
        for f in c.faces() {
            let angle = triangle::angles(c.face_edges(f).map(|e| length[e]))?;
            for (k, h) in c.face_halfedges(f).into_iter().enumerate() {
                let [i, j] = [c.tail(h), c.head(h)].map(VertexId::index);
                let across = angle[(k + 2) % 3];
                let weight = 0.5 / across.tan();
                opposite[c.edge(h).index()] += across;
                for (a, b, w) in [(i, i, 1.0), (j, j, 1.0), (i, j, -1.0), (j, i, -1.0)] {
                    laplacian.add(a, b, w * weight);
                }
                curvature[i] -= angle[k];
            }
        }
        // A boundary edge has its mirror image on the other side.
        let bound = |e| if c.is_boundary_edge(e) { PI / 2.0 } else { PI };
        if c.edges().any(|e| opposite[e.index()] > bound(e) + 1e-9) {
            return None;
        }
        let total_area: f64 = area.iter().sum();
        area.iter_mut().for_each(|a| *a /= total_area);
        let boundary: Vec<usize> = (0..n).filter(|&v| on_boundary(v)).collect();
        let interior: Vec<usize> = (0..n).filter(|&v| !on_boundary(v)).collect();
        let is_free = !boundary.is_empty() && condition == BoundaryCondition::Free;
        // Rows and columns of what is fixed become those of the unit matrix.
        let fixed: Vec<usize> = match is_free {
            true => boundary.clone(),
            false => vec![n - 1],
        };
        for &v in &fixed {
            for w in 0..n {
                laplacian.entry[v * n + w] = 0.0;
                laplacian.entry[w * n + v] = 0.0;
            }
            laplacian.entry[v * n + v] = 1.0;
        }
        let inverse = laplacian.inverse()?;
        let log_scale = |mut k: Vec<f64>| {
            fixed.iter().for_each(|&v| k[v] = 0.0);
            let mut u = inverse.apply(&k);
            let mean: f64 = u.iter().zip(&area).map(|(u, a)| u * a).sum();
            u.iter_mut().for_each(|u| *u -= mean);
            u
        };
        let share = 1.0 / boundary.len().max(1) as f64;
        let even = |k: &mut Vec<f64>, total: f64| {
            for &v in boundary.iter().filter(|_| !is_free) {
                k[v] += total * share;
            }
        };
        let euler = c.topology().euler_characteristic as f64;
        let mut base: Vec<f64> = curvature.iter().map(|k| -k).collect();
        even(&mut base, TAU * euler);
        let base = log_scale(base);
        let response = |v: usize| {
            let mut k = vec![0.0; n];
            k[v] = 1.0;
            even(&mut k, -1.0);
            log_scale(k)
        };
        let responses: Vec<Vec<f64>> = (0..n).map(response).collect();
        let product = |a: &[f64], b: &[f64]| -> f64 {
            a.iter()
                .zip(b)
                .zip(&area)
                .map(|((a, b), w)| w * a * b)
                .sum()
        };
        let mut matrix = Matrix::zero(n);
        for i in 0..n {
            for j in 0..n {
                matrix.add(i, j, product(&responses[i], &responses[j]));
            }
        }
        Some(Self {
            constant: product(&base, &base),
            slope: responses.iter().map(|g| product(g, &base)).collect(),
            matrix,
            total: boundary.is_empty().then_some(TAU * euler),
            interior,
        })
    }

    fn size(&self) -> usize {
        self.slope.len()
    }

    fn of(&self, c: &[f64]) -> f64 {
        let bent = self.matrix.apply(c);
        let terms = c.iter().zip(&self.slope).zip(bent);
        self.constant + terms.map(|((c, b), m)| c * (2.0 * b + m)).sum::<f64>()
    }

    /// The choices of `count` of `places` with the least variance, the best first.
    fn ranked(&self, places: &[usize], count: usize, range: [f64; 2]) -> Vec<Ranked> {
        let mut best: Vec<Ranked> = Vec::new();
        let mut subset: Vec<usize> = (0..count).collect();
        loop {
            let sites: Vec<usize> = subset.iter().map(|&i| places[i]).collect();
            if let Some((energy, c)) = self.curvatures(&sites, range) {
                let at = best.partition_point(|b| b.0 <= energy);
                if at < KEPT {
                    best.insert(at, (energy, sites.into_iter().zip(c).collect()));
                    best.truncate(KEPT);
                }
            }
            let last = (0..count)
                .rev()
                .find(|&i| subset[i] + count < places.len() + i);
            let Some(i) = last else { return best };
            subset[i] += 1;
            for j in i + 1..count {
                subset[j] = subset[j - 1] + 1;
            }
        }
    }

    /// The best curvatures at some places: every way to have each at its least, at its greatest or between.
    fn curvatures(&self, sites: &[usize], range: [f64; 2]) -> Option<(f64, Vec<f64>)> {
        let count = sites.len();
        let mut best: Option<(f64, Vec<f64>)> = None;
        for way in 0..3usize.pow(count as u32) {
            let state: Vec<usize> = (0..count as u32).map(|i| way / 3usize.pow(i) % 3).collect();
            let mut c: Vec<f64> = state
                .iter()
                .map(|&s| if s < 2 { range[s] } else { 0.0 })
                .collect();
            let inside: Vec<usize> = (0..count).filter(|&i| state[i] == 2).collect();
            let outside: Vec<usize> = (0..count).filter(|&i| state[i] < 2).collect();
            let size = inside.len() + usize::from(self.total.is_some());
            let mut system = Matrix::zero(size);
            let mut right = vec![0.0; size];
            for (a, &i) in inside.iter().enumerate() {
                right[a] = -self.slope[sites[i]];
                for &j in &outside {
                    right[a] -= self.matrix.at(sites[i], sites[j]) * c[j];
                }
                for (b, &j) in inside.iter().enumerate() {
                    system.add(a, b, self.matrix.at(sites[i], sites[j]));
                }
                if self.total.is_some() {
                    system.add(a, size - 1, 1.0);
                    system.add(size - 1, a, 1.0);
                }
            }
            if let Some(total) = self.total {
                right[size - 1] = total - outside.iter().map(|&j| c[j]).sum::<f64>();
            }
            let solved = match inside.is_empty() {
                true => right.iter().all(|r| r.abs() < 1e-12).then(Vec::new),
                false => system.solve(&right),
            };
            let Some(solved) = solved else { continue };
            for (&i, x) in inside.iter().zip(solved) {
                c[i] = x;
            }
            let within = |k: &f64| (range[0] - 1e-12..=range[1] + 1e-12).contains(k);
            if !c.iter().all(within) {
                continue;
            }
            let mut all = vec![0.0; self.size()];
            sites.iter().zip(&c).for_each(|(&v, &k)| all[v] = k);
            let energy = self.of(&all);
            if best.as_ref().is_none_or(|b| energy < b.0) {
                best = Some((energy, c));
            }
        }
        best
    }
}

fn generate(shape: Shape, random: &mut Random) -> Triangles {
    match shape {
        Shape::Ball => {
            let mut ball = octahedron();
            ball.subdivide();
            for p in &mut ball.positions {
                let length = distance(*p, [0.0; 3]);
                let r = 1.0 + 0.35 * random.next();
                *p = p.map(|x| x / length * r);
            }
            ball
        }
        Shape::Torus => {
            let (around, across) = (6, 5);
            let mut positions = Vec::new();
            for i in 0..around {
                for j in 0..across {
                    let turn = |k: usize, n: usize, r: f64| TAU * (k as f64 + 0.2 * r) / n as f64;
                    let (s, c) = turn(i, around, random.next()).sin_cos();
                    let (t, d) = turn(j, across, random.next()).sin_cos();
                    let tube = 0.6 + 0.1 * random.next();
                    let r = 1.4 + tube * d;
                    positions.push([r * c, r * s, tube * t]);
                }
            }
            let at = |i: usize, j: usize| i % around * across + j % across;
            let quads = (0..around).flat_map(|i| (0..across).map(move |j| (i, j)));
            let faces = quads.flat_map(|(i, j)| {
                let quad = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                halves(quad, &positions)
            });
            Triangles {
                faces: faces.collect(),
                positions: positions.clone(),
            }
        }
        Shape::FreeHill | Shape::EvenHill => {
            let side = 6;
            let mut positions = Vec::new();
            for i in 0..side {
                for j in 0..side {
                    let inner = |k: usize| 0 < k && k + 1 < side;
                    let shake = if inner(i) && inner(j) { 0.3 } else { 0.0 };
                    let x = i as f64 + shake * (random.next() - 0.5);
                    let y = j as f64 + shake * (random.next() - 0.5);
                    positions.push([x, y, shake * 3.0 * random.next()]);
                }
            }
            let at = |i: usize, j: usize| i * side + j;
            let quads = (0..side - 1).flat_map(|i| (0..side - 1).map(move |j| (i, j)));
            let faces = quads.flat_map(|(i, j)| {
                let quad = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                halves(quad, &positions)
            });
            Triangles {
                faces: faces.collect(),
                positions: positions.clone(),
            }
        }
    }
}

/// A quad cut along its shorter diagonal.
fn halves([a, b, c, d]: [usize; 4], positions: &[[f64; 3]]) -> [[u32; 3]; 2] {
    let along = |i: usize, j: usize| distance(positions[i], positions[j]);
    let faces = match along(a, c) <= along(b, d) {
        true => [[a, b, c], [a, c, d]],
        false => [[b, c, d], [b, d, a]],
    };
    faces.map(|f| f.map(|v| v as u32))
}
