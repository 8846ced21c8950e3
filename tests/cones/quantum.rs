//! Cones of multiples of π/2.

use crate::models;
use affine_atlas::flow::cones::{BoundaryCondition, ConeParams, PiMultiple};
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// What is asked for of the mean of √J over √J of any curvatures, which is what both choices make least.
const MEAN_RATIO: f64 = 1.3;
/// Numbers of cones.
const COUNTS: [usize; 3] = [4, 8, 16];

/// Seamless, and hardly worse than with any curvatures.
pub fn quarter_turns(
    corpus: &Path,
    models: impl Iterator<Item = &'static str>,
) -> Result<(), String> {
    let quantum = PiMultiple::fraction(1, 2).ok_or("1/2")?;
    let mut ratios = Vec::new();
    for model in models {
        let triangles = models::read(&corpus.join(model));
        let mesh = models::mesh(&triangles);
        for count in COUNTS {
            let any = ConeParams {
                count: Some(count),
                ..ConeParams::default()
            };
            let multiples = ConeParams {
                quantum,
                ..any.clone()
            };
            let given = |params: &ConeParams| {
                let (given, _) = models::choose(&mesh, params, BoundaryCondition::Free)?;
                models::distortion(&mesh, &given)
            };
            let [free, whole] = [given(&any)?, given(&multiples)?];
            let ratio = (whole.cost / free.cost).sqrt();
            let atlas = models::finished(&triangles, multiples)?;
            let cones = &atlas.prescription.cones;
            println!(
                "| {model} | {} of {count} | {:.4} / {:.4} | {:.4} / {:.4} | {ratio:.3} |",
                cones.len(),
                free.area,
                free.cost.sqrt(),
                whole.area,
                whole.cost.sqrt()
            );
            let off = |k: f64| (k / FRAC_PI_2 - (k / FRAC_PI_2).round()).abs();
            if let Some(cone) = cones.iter().find(|cone| off(cone.curvature) > 1e-12) {
                return Err(format!("{model}: K̄ = {} is no multiple", cone.curvature));
            }
            if !atlas.seamless || cones.len() > count {
                return Err(format!(
                    "{model}, {count}: {} cones, not seamless",
                    cones.len()
                ));
            }
            ratios.push(ratio);
        }
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    println!("mean ratio {mean:.3}");
    match mean <= MEAN_RATIO {
        true => Ok(()),
        false => Err(format!(
            "mean ratio {mean:.3}, at most {MEAN_RATIO} asked for"
        )),
    }
}
