//! The automatic choice of cones: better than what other tools choose, near the best there is, and the same whatever does not matter.
//!
//! `AFFINE_ATLAS_CORPUS` names a folder of real models; without it, cases that need one are reported as ignored, and some large models are for
//! `--ignored` anyway. With
//! `--nocapture`, every case prints the rows that `benches/README.md` shows.

#[path = "../../benches/common/mod.rs"]
mod common;
mod defaults;
mod dense;
mod genus;
mod limits;
mod linear;
mod models;
mod optimality;
mod peers;
mod quantum;
#[path = "../real_models/mod.rs"]
mod real_models;
mod stability;
mod symmetry;

use affine_atlas::flow::cones::BoundaryCondition;
use libtest_mimic::{Arguments, Failed, Trial};
use real_models::LARGE;
use std::path::{Path, PathBuf};

/// The clean models.
const MODELS: [&str; 18] = [
    "spot.obj",
    "bunny-closed.off",
    "nefertiti.obj",
    "fandisk.off",
    "bumpy-cube.obj",
    "rocker-arm.obj",
    "kitten.obj",
    "brezel.obj",
    "three-holes.off",
    "elephant-genus3.obj",
    "fertility.off",
    "face.obj",
    "camelhead.off",
    "lilium.obj",
    "lego.ply",
    "punctured-torus.obj",
    "stanford-bunny.obj",
    "beetle.obj",
];
/// The closed ones of genus 0.
const SPHERES: [&str; 5] = [
    "spot.obj",
    "bunny-closed.off",
    "nefertiti.obj",
    "fandisk.off",
    "bumpy-cube.obj",
];
/// Where finer meshes must get the same cones; with a boundary, under which condition.
const STABLE: [(&str, BoundaryCondition); 10] = [
    ("spot.obj", BoundaryCondition::Free),
    ("bunny-closed.off", BoundaryCondition::Free),
    ("bumpy-cube.obj", BoundaryCondition::Free),
    ("fandisk.off", BoundaryCondition::Free),
    ("nefertiti.obj", BoundaryCondition::Free),
    ("rocker-arm.obj", BoundaryCondition::Free),
    ("three-holes.off", BoundaryCondition::Free),
    ("kitten.obj", BoundaryCondition::Free),
    ("face.obj", BoundaryCondition::Free),
    ("face.obj", BoundaryCondition::Uniform),
];
/// Subdivided, they take half a minute or more each: for `--ignored`.
const SLOW: [&str; 3] = ["nefertiti.obj", "kitten.obj", "bumpy-cube.obj"];
/// Small ones with and without handles and boundary.
const VARIED: [&str; 5] = [
    "spot.obj",
    "bunny-closed.off",
    "rocker-arm.obj",
    "three-holes.off",
    "lilium.obj",
];

fn main() {
    let arguments = Arguments::from_args();
    let corpus = std::env::var_os("AFFINE_ATLAS_CORPUS").map(PathBuf::from);
    let mut trials = Vec::new();
    // The longest come first, so that no core waits for them in the end.
    trials.push(trial("peers".into(), corpus.clone(), peers::beaten));
    for (name, is_large) in [("quantum", false), ("quantum/large", true)] {
        let case = move |corpus: &Path| {
            let models = SPHERES.into_iter();
            quantum::quarter_turns(corpus, models.filter(|m| LARGE.contains(m) == is_large))
        };
        let is_ignored = is_large || corpus.is_none();
        let trial = trial(name.into(), corpus.clone(), case);
        trials.push(trial.with_ignored_flag(is_ignored));
    }
    for model in VARIED {
        let case = move |corpus: &Path| stability::invariance(&corpus.join(model));
        trials.push(trial(format!("invariance/{model}"), corpus.clone(), case));
    }
    trials.push(trial("platonic".into(), here(), |_| symmetry::platonic()));
    trials.push(trial("mirror".into(), here(), |_| symmetry::mirror()));
    for (model, condition) in STABLE {
        let case = move |corpus: &Path| stability::subdivision(&corpus.join(model), condition);
        let name = format!("subdivision/{model}, {}", condition.name());
        let is_slow = SLOW.contains(&model) || corpus.is_none();
        trials.push(trial(name, corpus.clone(), case).with_ignored_flag(is_slow));
    }
    let case = |corpus: &Path| limits::log_scale_bound(&corpus.join("spot.obj"));
    trials.push(trial("limits/log-scale".into(), corpus.clone(), case));
    let case = |corpus: &Path| limits::boundary_distance(&corpus.join("face.obj"));
    trials.push(trial("limits/boundary".into(), corpus.clone(), case));
    let case = |corpus: &Path| limits::curvatures(&corpus.join("spot.obj"));
    trials.push(trial("limits/curvatures".into(), corpus.clone(), case));
    for model in MODELS {
        let case = move |corpus: &Path| defaults::beside_spread(&corpus.join(model));
        let is_long = LARGE.contains(&model) || corpus.is_none();
        let trial = trial(format!("default/{model}"), corpus.clone(), case);
        trials.push(trial.with_ignored_flag(is_long));
    }
    for model in [
        "spot.obj",
        "bunny-closed.off",
        "rocker-arm.obj",
        "brezel.obj",
    ] {
        let case = move |corpus: &Path| linear::prediction(&corpus.join(model));
        trials.push(trial(format!("prediction/{model}"), corpus.clone(), case));
        let case = move |corpus: &Path| linear::stationary(&corpus.join(model));
        trials.push(trial(format!("stationary/{model}"), corpus.clone(), case));
    }
    for genus in [0, 5, 24, 47, 73, 100] {
        for is_open in [false, true] {
            let case = move |_: &Path| genus::by_default(genus, is_open);
            let name = format!("genus/{genus}{}", if is_open { ", open" } else { "" });
            trials.push(trial(name, here(), case));
        }
    }
    for shape in optimality::SHAPES {
        let case = move |_: &Path| optimality::brute_force(shape);
        trials.push(trial(format!("optimality/{shape:?}"), here(), case));
    }
    libtest_mimic::run(&arguments, trials).exit();
}

/// For cases that need no model.
fn here() -> Option<PathBuf> {
    Some(PathBuf::new())
}

/// A case that is ignored where what it needs is not there.
fn trial(
    name: String,
    folder: Option<PathBuf>,
    run: impl FnOnce(&Path) -> Result<(), String> + Send + 'static,
) -> Trial {
    let ignored = folder.is_none();
    let trial = Trial::test(name, move || match folder {
        Some(folder) => run(&folder).map_err(Failed::from),
        None => Err("AFFINE_ATLAS_CORPUS names no folder".into()),
    });
    trial.with_ignored_flag(ignored)
}
