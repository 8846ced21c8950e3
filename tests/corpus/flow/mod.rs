//! The flow with flips: that it cannot fail, and that it finds what it should.
//!
//! `AFFINE_ATLAS_CORPUS` names a folder of real models; without it, cases that need one are reported as ignored.
//! Large models are for `--ignored`. `AFFINE_ATLAS_CHECKER` names an independent checker; `reference_u.npz` beside it holds the u of an independent prototype.

mod checked;
mod invariance;
mod models;
mod prescriptions;
mod reference;
mod refinement;
mod stress;

use crate::real_models::{CLEAN, LARGE};
use libtest_mimic::{Failed, Trial};
use std::path::PathBuf;

pub fn trials() -> Vec<Trial> {
    let folder = |name| std::env::var_os(name).map(PathBuf::from);
    let corpus = folder("AFFINE_ATLAS_CORPUS");
    let beside_checker = folder("AFFINE_ATLAS_CHECKER")
        .and_then(|c| c.parent().map(|f| f.join("reference_u.npz")))
        .filter(|f| f.is_file());
    let is_long = |name: &str| corpus.is_none() || LARGE.contains(&name);
    let mut trials = Vec::new();
    for (name, ..) in CLEAN {
        let file = corpus.as_ref().map(|c| c.join(name));
        trials.push(
            trial(format!("flow/prescriptions/{name}"), file, |file| {
                prescriptions::converge(&file)
            })
            .with_ignored_flag(is_long(name)),
        );
    }
    for (name, ..) in CLEAN {
        let file = corpus.as_ref().map(|c| c.join(name));
        trials.push(
            trial(format!("flow/checked/{name}"), file, |file| {
                checked::first_prescription(&file)
            })
            .with_ignored_flag(is_long(name)),
        );
    }
    for (name, genus) in [
        ("brezel.obj", 2),
        ("three-holes.off", 3),
        ("fertility.off", 4),
    ] {
        let file = corpus.as_ref().map(|c| c.join(name));
        trials.push(trial(
            format!("flow/single-cone/{name}"),
            file,
            move |file| checked::single_cone(&file, genus),
        ));
    }
    type Case = fn(&std::path::Path) -> Result<(), String>;
    let stress: [(&str, Case); 3] = [
        ("squashed", stress::squashed),
        ("needles", stress::needles),
        ("decimated", stress::decimated),
    ];
    for (what, run) in stress {
        for (name, ..) in CLEAN {
            let file = corpus.as_ref().map(|c| c.join(name));
            let run = move |file: PathBuf| run(&file);
            let trial = trial(format!("flow/stress/{what}/{name}"), file, run);
            trials.push(trial.with_ignored_flag(is_long(name)));
        }
    }
    for name in [
        "spot.obj",
        "bunny-closed.off",
        "three-holes.off",
        "lilium.obj",
    ] {
        let file = corpus.as_ref().map(|c| c.join(name));
        let run = |file: PathBuf| invariance::hold(&file);
        trials.push(trial(format!("flow/invariance/{name}"), file, run));
    }
    trials.push(trial("flow/refinement/torus".into(), Some(()), |()| {
        refinement::torus()
    }));
    let both = corpus.clone().zip(beside_checker);
    trials.push(trial("flow/reference".into(), both, |(corpus, file)| {
        reference::agree(&corpus, &file)
    }));
    trials
}

/// A case that is ignored where what it needs is not there.
fn trial<T: Send + 'static>(
    name: String,
    needs: Option<T>,
    run: impl FnOnce(T) -> Result<(), String> + Send + 'static,
) -> Trial {
    let ignored = needs.is_none();
    let trial = Trial::test(name, move || match needs {
        Some(needs) => run(needs).map_err(Failed::from),
        None => Err("AFFINE_ATLAS_CORPUS or AFFINE_ATLAS_CHECKER names nothing".into()),
    });
    trial.with_ignored_flag(ignored)
}
