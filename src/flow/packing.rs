//! The circle packing that keeps the source lengths best, (1) of the tutorial, and radii whose
//! inversive distances keep them exactly.
//!
//! *Enters:* connectivity and source lengths l̄. *Leaves:* radii γ⁰ and cos Φ (or I) of every edge.
//!
//! (1) minimises Σ (l_ij − l̄_ij)² over γ > 0 *and* Φ ∈ [0, π/2]. For fixed γ the best l_ij is l̄_ij clamped to
//! [√(γi² + γj²), γi + γj], so what is left is Σ dist(l̄_ij, [√(γi² + γj²), γi + γj])² over γ alone. Each
//! term is a square of the positive part of a convex function, l̄ − γi − γj or √(γi² + γj²) − l̄: the problem is
//! *convex*, and a stationary point is a global minimum.
//!
//! It has flat directions: where both neighbours' intervals hold l̄, moving γ costs nothing. A term
//! μ Σ (γi − γ̂i)² with μ = 1e-8 picks one, near the least change from the mean over faces
//! γ̂i = mean (l̄_ij + l̄_ik − l̄_jk)/2, and makes the minimum unique; it biases a gradient by at most μ |γ − γ̂|.
//! Radii stay above a thousandth of the shortest edge at their vertex, since a radius of zero has no logarithm.
//!
//! *Guaranteed:* the minimum to `GRADIENT_TOLERANCE`, checked, or an error. *Not guaranteed:* that the packing
//! satisfies (6), nor that it looks like the surface: lengths of well-shaped meshes are kept to a few per cent.
//! Taking γ as the minimum over faces instead, as is customary, puts Φ = 0 on every edge.

use crate::flow::solve::{SolveError, SymmetricSolver};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, VertexVec};

/// Weights μ of the term that makes the minimum unique, relative to that of one edge. Only the last counts; each of the others
/// gives a start from which few edges change sides. (Starting at the last, Newton wanders along the flat
/// directions for hundreds of steps.)
const TIKHONOV: [f64; 8] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8];
/// Bound on the projected gradient, in units of the mean source length.
const GRADIENT_TOLERANCE: f64 = 1e-10;
/// Most steps for one μ; a piecewise smooth convex function takes 5 to 40.
const MAX_STEPS: usize = 200;
/// Smallest radius, relative to the shortest edge at its vertex.
const RADIUS_FLOOR: f64 = 1e-3;

/// How well a circle packing keeps the lengths in space (1).
#[derive(
    Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
pub struct PackingFit {
    /// Mean over the edges of |l − l̄| / l̄.
    pub mean_length_error: f64,
    /// Largest |l − l̄| / l̄.
    pub max_length_error: f64,
    /// Share of the edges whose Φ lies at an end of [0, π/2].
    pub clamped: f64,
}

/// Radii and intersection angles.
#[derive(Clone, Debug)]
pub struct Packing {
    /// γ⁰ of every vertex, source units.
    pub radius: VertexVec<f64>,
    /// cos Φ of every edge, in [0, 1].
    pub cos_phi: EdgeVec<f64>,
    /// How well the lengths are kept.
    pub fit: PackingFit,
}

impl Packing {
    /// Φ of every edge, radians in [0, π/2].
    pub fn intersection_angles(&self) -> EdgeVec<f64> {
        self.cos_phi.iter().map(|x| x.acos()).collect()
    }
}

/// Why no packing was found.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PackingError {
    /// Newton did not reach the minimum of (1).
    #[error(
        "the circle packing nearest to the mesh was not found in {steps} steps (gradient {gradient:.1e}, bound {tolerance:.1e}); use the scheme `vertex-scaling` with flow.delaunay = true, or `tangential`"
    )]
    NotConverged {
        /// Steps taken.
        steps: usize,
        /// Largest projected gradient, in units of the mean length.
        gradient: f64,
        /// What it should have been.
        tolerance: f64,
    },
    /// The linear system could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
}

/// Mean over the faces at every vertex of (l_ij + l_ik − l_jk)/2, at least `RADIUS_FLOOR` of the shortest edge
/// there; source units. In a face these are the radii of three mutually tangent circles.
fn mean_radii(connectivity: &Connectivity, length: &EdgeVec<f64>) -> VertexVec<f64> {
    let floor = radius_floors(connectivity, length);
    connectivity
        .vertices()
        .map(|v| {
            let (mut sum, mut count) = (0.0, 0.0);
            for h in connectivity.outgoing(v) {
                let [ij, jk, ki] = [h, connectivity.next(h), connectivity.prev(h)]
                    .map(|h| length[connectivity.edge(h)]);
                sum += 0.5 * (ij + (ki - jk));
                count += 1.0;
            }
            (sum / count).max(floor[v])
        })
        .collect()
}

fn radius_floors(connectivity: &Connectivity, length: &EdgeVec<f64>) -> VertexVec<f64> {
    let mut floor = VertexVec::filled(f64::INFINITY, connectivity.vertex_count());
    for (e, &l) in length.enumerate() {
        for v in connectivity.edge_vertices(e) {
            floor[v] = floor[v].min(RADIUS_FLOOR * l);
        }
    }
    floor
}

/// Radii with γi² + γj² ≤ l_ij² on every edge, so that the inversive distance that keeps l_ij is ≥ 0.
///
/// Starts from the mean over faces. Where an edge is too short for its two circles, both shrink by l/√(γi² + γj²);
/// a vertex takes the smallest factor of its edges, so that one pass is enough.
pub fn exact_radii(connectivity: &Connectivity, length: &EdgeVec<f64>) -> VertexVec<f64> {
    let mean = mean_radii(connectivity, length);
    let mut factor = VertexVec::filled(1.0_f64, mean.len());
    for (e, &l) in length.enumerate() {
        let [i, j] = connectivity.edge_vertices(e);
        let needed = l / mean[i].hypot(mean[j]);
        for v in [i, j] {
            factor[v] = factor[v].min(needed);
        }
    }
    mean.enumerate().map(|(v, r)| r * factor[v]).collect()
}

/// I_ij = (l² − γi² − γj²)/(2 γi γj), not below 0: with [`exact_radii`] only rounding is cut off.
pub fn inversive_distances(
    connectivity: &Connectivity,
    length: &EdgeVec<f64>,
    radius: &VertexVec<f64>,
) -> EdgeVec<f64> {
    length
        .enumerate()
        .map(|(e, &l)| {
            let [a, b] = connectivity.edge_vertices(e).map(|v| radius[v]);
            // l² − γi² − γj² = (l − γi − γj)(l + γi + γj) + 2 γi γj, which keeps I ≈ 1 exact.
            (1.0 + (l - (a + b)) / a * ((l + (a + b)) / (2.0 * b))).max(0.0)
        })
        .collect()
}

/// One edge's part of the objective: value, gradient by both radii, Hessian (ii, jj, ij).
struct EdgeTerm {
    value: f64,
    gradient: [f64; 2],
    hessian: [f64; 3],
}

/// ½ dist(l, [√(a² + b²), a + b])² with its derivatives (of the active side).
fn edge_term(l: f64, a: f64, b: f64) -> EdgeTerm {
    let (sum, root) = (a + b, a.hypot(b));
    if l > sum {
        let r = sum - l;
        return EdgeTerm {
            value: 0.5 * r * r,
            gradient: [r, r],
            hessian: [1.0; 3],
        };
    }
    if l < root {
        let r = root - l;
        let (na, nb) = (a / root, b / root);
        let bend = r / root;
        return EdgeTerm {
            value: 0.5 * r * r,
            gradient: [r * na, r * nb],
            hessian: [
                na * na + bend * nb * nb,
                nb * nb + bend * na * na,
                na * nb * (1.0 - bend),
            ],
        };
    }
    EdgeTerm {
        value: 0.0,
        gradient: [0.0; 2],
        hessian: [0.0; 3],
    }
}

/// The objective in units of the mean length.
struct Objective {
    ends: Vec<[u32; 2]>,
    length: Vec<f64>,
    guess: Vec<f64>,
    floor: Vec<f64>,
}

impl Objective {
    fn gradient(&self, tikhonov: f64, radius: &[f64]) -> (f64, Vec<f64>) {
        let mut value = 0.0;
        let mut gradient = vec![0.0; radius.len()];
        for (&[i, j], &l) in self.ends.iter().zip(&self.length) {
            let (i, j) = (i as usize, j as usize);
            let term = edge_term(l, radius[i], radius[j]);
            value += term.value;
            gradient[i] += term.gradient[0];
            gradient[j] += term.gradient[1];
        }
        for (k, g) in gradient.iter_mut().enumerate() {
            let d = radius[k] - self.guess[k];
            value += 0.5 * tikhonov * d * d;
            *g += tikhonov * d;
        }
        (value, gradient)
    }

    /// True where the floor holds the radius up.
    fn held(&self, radius: &[f64], gradient: &[f64], k: usize) -> bool {
        radius[k] <= self.floor[k] && gradient[k] > 0.0
    }

    /// Largest component of the gradient that a feasible move can follow.
    fn stationarity(&self, radius: &[f64], gradient: &[f64]) -> f64 {
        (0..radius.len())
            .filter(|&k| !self.held(radius, gradient, k))
            .map(|k| gradient[k].abs())
            .fold(0.0, f64::max)
    }
}

/// Minimises (1) over γ and Φ; see the module docs. Lengths must be positive and finite.
pub fn fit(connectivity: &Connectivity, length: &EdgeVec<f64>) -> Result<Packing, PackingError> {
    let unit = length.iter().sum::<f64>() / length.len().max(1) as f64;
    let scaled = |values: VertexVec<f64>| values.iter().map(|v| v / unit).collect::<Vec<_>>();
    let objective = Objective {
        ends: connectivity
            .edges()
            .map(|e| connectivity.edge_vertices(e).map(|v| v.raw()))
            .collect(),
        length: length.iter().map(|l| l / unit).collect(),
        guess: scaled(mean_radii(connectivity, length)),
        floor: scaled(radius_floors(connectivity, length)),
    };
    let radius: VertexVec<f64> = minimise(&objective)?
        .into_iter()
        .map(|r| r * unit)
        .collect::<Vec<_>>()
        .into();
    let free = inversive_distances(connectivity, length, &radius);
    let cos_phi: EdgeVec<f64> = free.iter().map(|&c| c.min(1.0)).collect();
    let mut fit = PackingFit {
        mean_length_error: 0.0,
        max_length_error: 0.0,
        clamped: 0.0,
    };
    let edges = length.len().max(1) as f64;
    for (e, &l) in length.enumerate() {
        let [a, b] = connectivity.edge_vertices(e).map(|v| radius[v]);
        let error = (l.clamp(a.hypot(b), (a + b).max(a.hypot(b))) - l).abs() / l;
        fit.mean_length_error += error / edges;
        fit.max_length_error = fit.max_length_error.max(error);
        fit.clamped += f64::from(u8::from(cos_phi[e] <= 0.0 || cos_phi[e] >= 1.0)) / edges;
    }
    Ok(Packing {
        radius,
        cos_phi,
        fit,
    })
}

/// Minimises for every μ in turn, each from the minimum of the one before.
fn minimise(objective: &Objective) -> Result<Vec<f64>, PackingError> {
    let mut solver = SymmetricSolver::new(objective.guess.len(), &objective.ends)?;
    let mut radius = objective.guess.clone();
    for tikhonov in TIKHONOV {
        radius = newton(objective, tikhonov, radius, &mut solver)?;
    }
    Ok(radius)
}

/// Newton on the piecewise smooth objective, projected on the floors. The line search accepts a sufficient decrease of the
/// value, or a directional derivative that still points down, or half the gradient: all the same far from the
/// minimum, but the value alone no longer tells near it.
fn newton(
    objective: &Objective,
    tikhonov: f64,
    mut radius: Vec<f64>,
    solver: &mut SymmetricSolver,
) -> Result<Vec<f64>, PackingError> {
    let n = radius.len();
    let (mut value, mut gradient) = objective.gradient(tikhonov, &radius);
    let mut stationarity = objective.stationarity(&radius, &gradient);
    let mut off_diagonal = vec![0.0; objective.ends.len()];
    for step in 0..MAX_STEPS {
        if stationarity <= GRADIENT_TOLERANCE {
            return Ok(radius);
        }
        let held: Vec<bool> = (0..n)
            .map(|k| objective.held(&radius, &gradient, k))
            .collect();
        let mut diagonal: Vec<f64> = vec![tikhonov; n];
        for (k, &[i, j]) in objective.ends.iter().enumerate() {
            let (i, j) = (i as usize, j as usize);
            let term = edge_term(objective.length[k], radius[i], radius[j]);
            // A loop has both ends at one vertex: the solver adds its value to the diagonal once, the form needs it twice.
            let both = !(held[i] || held[j]);
            let times = if i == j { 2.0 } else { 1.0 };
            off_diagonal[k] = if both { times * term.hessian[2] } else { 0.0 };
            if !held[i] {
                diagonal[i] += term.hessian[0];
            }
            if !held[j] {
                diagonal[j] += term.hessian[1];
            }
        }
        let mut direction: Vec<f64> = (0..n)
            .map(|k| if held[k] { 0.0 } else { -gradient[k] })
            .collect();
        solver.factorize(&diagonal, &off_diagonal)?;
        solver.solve(&mut direction);
        let mut t = 1.0;
        loop {
            let trial: Vec<f64> = (0..n)
                .map(|k| (radius[k] + t * direction[k]).max(objective.floor[k]))
                .collect();
            let (trial_value, trial_gradient) = objective.gradient(tikhonov, &trial);
            let along = |gradient: &[f64]| -> f64 {
                (0..n).map(|k| gradient[k] * (trial[k] - radius[k])).sum()
            };
            let trial_stationarity = objective.stationarity(&trial, &trial_gradient);
            if trial_value <= value + 1e-4 * along(&gradient)
                || along(&trial_gradient) <= 0.0
                || trial_stationarity <= 0.5 * stationarity
            {
                (radius, value, gradient) = (trial, trial_value, trial_gradient);
                stationarity = trial_stationarity;
                break;
            }
            t *= 0.5;
            if t < 1e-12 {
                return Err(PackingError::NotConverged {
                    steps: step,
                    gradient: stationarity,
                    tolerance: GRADIENT_TOLERANCE,
                });
            }
        }
    }
    Err(PackingError::NotConverged {
        steps: MAX_STEPS,
        gradient: stationarity,
        tolerance: GRADIENT_TOLERANCE,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::ricci::shapes::{self, Shape};
    use crate::geometry::ids::VertexId;

    /// Σ dist² of (1) at any radii, written down once more, without the units and the regularisation above.
    fn misfit(shape: &Shape, radius: &VertexVec<f64>) -> f64 {
        shape
            .length
            .enumerate()
            .map(|(e, &l)| {
                let [a, b] = shape.connectivity.edge_vertices(e).map(|v| radius[v]);
                let best = l.max((a * a + b * b).sqrt()).min(a + b);
                (best - l).powi(2)
            })
            .sum()
    }

    #[test]
    fn edge_term_agrees_with_finite_differences() {
        for (l, a, b) in [
            (3.0, 1.0, 1.5),
            (1.0, 1.0, 1.5),
            (2.0, 1.0, 1.5),
            (0.1, 2.0, 0.3),
        ] {
            let h = 1e-6;
            let term = edge_term(l, a, b);
            let along_a = (edge_term(l, a + h, b).value - edge_term(l, a - h, b).value) / (2.0 * h);
            let along_b = (edge_term(l, a, b + h).value - edge_term(l, a, b - h).value) / (2.0 * h);
            assert!((term.gradient[0] - along_a).abs() < 1e-8);
            assert!((term.gradient[1] - along_b).abs() < 1e-8);
            let (up, down) = (
                edge_term(l, a + h, b).gradient,
                edge_term(l, a - h, b).gradient,
            );
            assert!((term.hessian[0] - (up[0] - down[0]) / (2.0 * h)).abs() < 1e-8);
            assert!((term.hessian[2] - (up[1] - down[1]) / (2.0 * h)).abs() < 1e-8);
            let (up, down) = (
                edge_term(l, a, b + h).gradient,
                edge_term(l, a, b - h).gradient,
            );
            assert!((term.hessian[1] - (up[1] - down[1]) / (2.0 * h)).abs() < 1e-8);
        }
    }

    #[test]
    fn no_radii_fit_better() {
        let mut random = shapes::sequence(17);
        for shape in shapes::small() {
            let packing = fit(&shape.connectivity, &shape.length).unwrap();
            let best = misfit(&shape, &packing.radius);
            let mean = shape.length.iter().sum::<f64>() / shape.length.len() as f64;
            let tolerance = 1e-7 * mean * mean;
            // From everywhere near and far, and one radius at a time: the objective is convex, so nothing may be lower.
            for round in 0..2000 {
                let reach = 10.0_f64.powf(-6.0 * random());
                let one = (round % 2 == 0)
                    .then(|| VertexId::new((random() * packing.radius.len() as f64) as usize));
                let moved: VertexVec<f64> = packing
                    .radius
                    .enumerate()
                    .map(|(v, &r)| match one {
                        Some(only) if only != v => r,
                        _ => r * (reach * (2.0 * random() - 1.0)).exp(),
                    })
                    .collect();
                let other = misfit(&shape, &moved);
                assert!(
                    other >= best - tolerance,
                    "{}: {other} < {best}",
                    shape.name
                );
            }
            // The mean and the minimum over faces are worse.
            assert!(best < misfit(&shape, &mean_radii(&shape.connectivity, &shape.length)));
            // Cos Φ and the lengths belong together.
            let mut worst: f64 = 0.0;
            for (e, &l) in shape.length.enumerate() {
                let [a, b] = shape
                    .connectivity
                    .edge_vertices(e)
                    .map(|v| packing.radius[v]);
                let c = packing.cos_phi[e];
                assert!((0.0..=1.0).contains(&c));
                let own = (a * a + b * b + 2.0 * a * b * c).sqrt();
                worst = worst.max((own - l).abs() / l);
            }
            assert!((worst - packing.fit.max_length_error).abs() < 1e-9);
            assert!(packing.fit.mean_length_error <= worst);
        }
    }

    #[test]
    fn a_grid_search_on_one_triangle_finds_nothing_better() {
        // The short edge cannot be kept: circles that reach along the long ones are too large for it.
        let shape = Shape::new(
            "triangle",
            &[[0, 1, 2]],
            &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.4, 0.0]],
        );
        let star = Shape::new(
            "star",
            &[[0, 1, 2], [0, 2, 3], [0, 3, 1]],
            &[
                [0.1, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [-0.5, 0.8, 0.0],
                [-0.2, -0.1, 0.0],
            ],
        );
        for shape in [shape, star] {
            let packing = fit(&shape.connectivity, &shape.length).unwrap();
            let best = misfit(&shape, &packing.radius);
            let n = packing.radius.len();
            let steps = if n == 3 { 80usize } else { 28 };
            let mut lowest = f64::INFINITY;
            for code in 0..steps.pow(n as u32) {
                let radius: VertexVec<f64> = (0..n)
                    .map(|k| (code / steps.pow(k as u32) % steps + 1) as f64 * 1.2 / steps as f64)
                    .collect();
                lowest = lowest.min(misfit(&shape, &radius));
            }
            assert!(
                best <= lowest + 1e-7,
                "{}: {best} against {lowest}",
                shape.name
            );
        }
    }

    #[test]
    fn lengths_of_a_packing_are_kept() {
        let mut random = shapes::sequence(23);
        for mut shape in shapes::small() {
            let radius: VertexVec<f64> = shape
                .connectivity
                .vertices()
                .map(|_| 0.7 + 0.6 * random())
                .collect();
            shape.length = shape
                .connectivity
                .edges()
                .map(|e| {
                    let [a, b] = shape.connectivity.edge_vertices(e).map(|v| radius[v]);
                    (a * a + b * b + 2.0 * a * b * random()).sqrt()
                })
                .collect();
            let packing = fit(&shape.connectivity, &shape.length).unwrap();
            assert!(packing.fit.max_length_error < 1e-6, "{:?}", packing.fit);
        }
    }

    #[test]
    fn inversive_distances_keep_lengths_exactly() {
        for shape in shapes::small() {
            let radius = exact_radii(&shape.connectivity, &shape.length);
            let inversive = inversive_distances(&shape.connectivity, &shape.length, &radius);
            for (e, &l) in shape.length.enumerate() {
                let [a, b] = shape.connectivity.edge_vertices(e).map(|v| radius[v]);
                assert!(a > 0.0 && b > 0.0 && inversive[e] >= 0.0);
                let own = (a * a + b * b + 2.0 * a * b * inversive[e]).sqrt();
                assert!((own - l).abs() <= 1e-14 * l);
            }
        }
    }

    #[test]
    #[cfg_attr(not(corpus), ignore = "needs AFFINE_ATLAS_CORPUS")]
    fn corpus_is_fitted() {
        are_fitted(shapes::corpus());
    }

    #[test]
    #[ignore = "long"]
    fn large_models_are_fitted() {
        are_fitted(shapes::large_models());
    }

    fn are_fitted(models: Vec<shapes::Shape>) {
        for shape in models {
            let packing = fit(&shape.connectivity, &shape.length).unwrap();
            println!("{:22} {:?}", shape.name, packing.fit);
            assert!(packing.fit.mean_length_error < 0.3);
        }
    }
}
