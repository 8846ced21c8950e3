//! Cones of multiples of π/2.

use crate::{SPHERES, models};
use affine_atlas::flow::cones::{ConeParams, PiMultiple};
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// What is asked for of the mean of (9) over (9) of any curvatures.
const MEAN_RATIO: f64 = 1.3;
/// Numbers of cones.
const COUNTS: [usize; 3] = [4, 8, 16];

/// Seamless, and hardly worse than with any curvatures.
pub fn quarter_turns(corpus: &Path) -> Result<(), String> {
    let quantum = PiMultiple::fraction(1, 2).ok_or("1/2")?;
    let mut ratios = Vec::new();
    for model in SPHERES {
        let triangles = models::read(&corpus.join(model));
        for count in COUNTS {
            let any = ConeParams {
                count: Some(count),
                ..ConeParams::default()
            };
            let multiples = ConeParams {
                quantum,
                ..any.clone()
            };
            let free = models::finished(&triangles, any)?;
            let atlas = models::finished(&triangles, multiples)?;
            let cones = &atlas.prescription.cones;
            let (area, free) = (atlas.quality.area_distortion, free.quality.area_distortion);
            println!(
                "| {model} | {} of {count} | {free:.4} | {area:.4} | {:.3} |",
                cones.len(),
                area / free
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
            ratios.push(area / free);
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
