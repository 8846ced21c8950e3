//! Random prescriptions on real models: the flow must reach every one that meets Gauss–Bonnet.

use super::models::{Model, Random};
use affine_atlas::flow::cones::{BoundaryCondition, Prescription};
use affine_atlas::geometry::ids::VertexVec;
use std::f64::consts::PI;
use std::path::Path;
use std::time::Instant;

/// Prescriptions a model.
pub const SEEDS: u64 = 20;
/// Least and greatest curvature of a cone, in units of π.
pub const RANGE: [f64; 2] = [-6.0, 1.9];
/// Most cones.
const MOST: usize = 12;

/// As few cones as can meet Gauss–Bonnet up to [`MOST`], each in `range` (units of π). Surfaces with boundary: even seeds leave it free, odd ones
/// spread what the cones leave evenly over it.
pub fn random(model: &Model, seed: u64, range: [f64; 2]) -> Prescription {
    let c = &model.connectivity;
    let topology = c.topology();
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ c.vertex_count() as u64);
    for _ in 0..8 {
        random.next();
    }
    let total = 2.0 * topology.euler_characteristic as f64;
    let (inner, outer): (Vec<_>, Vec<_>) = c.vertices().partition(|&v| !c.is_boundary_vertex(v));
    let [low, high] = range;
    // Units of π; what the cones may sum to.
    let (least, greatest) = if outer.is_empty() {
        (total, total)
    } else {
        // A boundary vertex may take less than π.
        (total - 0.9 * outer.len() as f64, f64::INFINITY)
    };
    let fewest = (0..=MOST)
        .find(|&k| {
            k as f64 * high >= least && k as f64 * low <= greatest && !(k == 1 && total == 0.0)
        })
        .unwrap();
    let mut count = fewest + random.below(MOST + 1 - fewest);
    if count == 1 && total == 0.0 && outer.is_empty() {
        count = 2;
    }
    let mut target = VertexVec::filled(0.0, c.vertex_count());
    let (mut least, mut greatest) = (least, greatest);
    for i in 0..count {
        let others = (count - i - 1) as f64;
        let from = low.max(least - others * high);
        let to = high.min(greatest - others * low);
        let curvature = random.between(from, to.max(from));
        let vertex = loop {
            let v = inner[random.below(inner.len())];
            if target[v] == 0.0 {
                break v;
            }
        };
        target[vertex] = curvature * PI;
        (least, greatest) = (least - curvature, greatest - curvature);
    }
    let boundary = if outer.is_empty() || seed.is_multiple_of(2) {
        BoundaryCondition::Free
    } else {
        let rest = total * PI - target.iter().sum::<f64>();
        for &v in &outer {
            target[v] = rest / outer.len() as f64;
        }
        BoundaryCondition::Uniform
    };
    Prescription::new(target, boundary)
}

/// All prescriptions of one model, with one line of the table.
pub fn converge(file: &Path) -> Result<(), String> {
    let model = Model::read(file);
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let mut failures = Vec::new();
    let (mut steps, mut flips, mut worst, mut range) = (Vec::new(), Vec::new(), 0.0f64, 0.0f64);
    let mut refined: Vec<f64> = Vec::new();
    let start = Instant::now();
    for seed in 0..SEEDS {
        let prescription = random(&model, seed, RANGE);
        match model.flow(&prescription, 1e-10) {
            Ok(flat) if flat.max_curvature_error <= 1e-10 => {
                let last = flat.history.last().unwrap();
                steps.push(last.iteration);
                flips.push(flat.history.iter().map(|s| s.flips).sum::<usize>());
                worst = worst.max(flat.max_curvature_error);
                let x = flat.intrinsic.as_ref().unwrap();
                let crossings = x.base_on_flat.crossings().map_err(|e| e.to_string())?;
                refined.push(1.0 + crossings as f64 / x.base.vertex_count() as f64);
                let u = flat.log_scale.iter();
                let (low, high) = u.fold((f64::MAX, f64::MIN), |(a, b), &u| (a.min(u), b.max(u)));
                range = range.max(high - low);
            }
            Ok(flat) => failures.push(format!("seed {seed}: {:e}", flat.max_curvature_error)),
            Err(error) => failures.push(format!("seed {seed}: {error}")),
        }
    }
    steps.sort_unstable();
    flips.sort_unstable();
    refined.sort_unstable_by(f64::total_cmp);
    let middle = |list: &[usize]| list.get(list.len() / 2).copied().unwrap_or(0);
    println!(
        "{name:22} {:7} vertices, {:2} of {SEEDS}, steps {} … {} … {}, flips {} … {}, overlay ×{:.2} … {:.2}, |K − K̄| ≤ {worst:.1e}, range of u ≤ {range:.1}, {:.2} s each",
        model.connectivity.vertex_count(),
        steps.len(),
        steps.first().unwrap_or(&0),
        middle(&steps),
        steps.last().unwrap_or(&0),
        middle(&flips),
        flips.last().unwrap_or(&0),
        refined.get(refined.len() / 2).unwrap_or(&f64::NAN),
        refined.last().unwrap_or(&f64::NAN),
        start.elapsed().as_secs_f64() / SEEDS as f64
    );
    match failures.is_empty() {
        true => Ok(()),
        false => Err(failures.join("\n")),
    }
}
