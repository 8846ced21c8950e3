//! `affine-atlas build`.

use super::arguments::{Build, Global, LogFormat};
use super::plan::{Plan, plan, start_threads};
use super::problem::Problem;
use super::progress::Progress;
use super::work::Work;
use super::{exit, interrupt, panics, summary, terminal};
use affine_atlas::config::assets::Asset;
use affine_atlas::observe::Observer;
use affine_atlas::outcome::{AssetOutcome, AssetState, Failure, FailureKind};
use std::time::Instant;

/// Builds every asset, shows what became of each, and gives the exit code.
pub fn run(build: &Build, global: &Global, work: &Work) -> Result<u8, Problem> {
    let plan = plan(&build.inputs, build.out.as_deref())?;
    plan.keep_inputs(|asset| plan.folder(asset))?;
    start_threads(global.threads, &plan.config)?;
    let announce = !global.quiet && global.log_format == LogFormat::Text;
    interrupt::install(work.remove_staging, announce);
    let progress = Progress::new(global, plan.assets.len());
    let outcomes = build_all(&plan, &progress, work);
    progress.finish();
    let recorded = (work.record)(&plan.output, &plan.config, &outcomes);
    if !global.quiet {
        terminal::print(&summary::table(&outcomes, terminal::stdout_width()));
    }
    if global.log_format == LogFormat::Text {
        terminal::print_error(&summary::failures(&outcomes));
    }
    if interrupt::requested() {
        (work.remove_staging)();
    }
    if let Err(failure) = recorded {
        return Err(Problem::NotRecorded {
            path: plan.output.join("manifest.jsonl"),
            reason: failure.message,
        });
    }
    Ok(exit_code(&outcomes))
}

fn build_all(plan: &Plan, progress: &Progress, work: &Work) -> Vec<AssetOutcome> {
    let mut outcomes = Vec::with_capacity(plan.assets.len());
    for (index, asset) in plan.assets.iter().enumerate() {
        let observer = progress.asset(&asset.id, index);
        let outcome = build_one(plan, asset, &observer, work);
        progress.done(&outcome, index);
        outcomes.push(outcome);
    }
    outcomes
}

/// A panic while an asset is built is that asset's failure; the others go on.
fn build_one(plan: &Plan, asset: &Asset, observer: &dyn Observer, work: &Work) -> AssetOutcome {
    let start = Instant::now();
    if observer.cancelled() {
        return AssetOutcome::whole(&asset.id, AssetState::Cancelled, 0.0);
    }
    let build = || (work.build)(asset, &plan.output, &plan.config, observer);
    panics::catch(build).unwrap_or_else(|panic| {
        let failure = Failure {
            kind: FailureKind::Internal,
            message: panic,
        };
        AssetOutcome::failed(&asset.id, failure, start.elapsed().as_secs_f64())
    })
}

/// The worst that happened.
pub(super) fn exit_code(outcomes: &[AssetOutcome]) -> u8 {
    let any = |test: &dyn Fn(&AssetOutcome) -> bool| outcomes.iter().any(test);
    if any(&|outcome| outcome.state == AssetState::Cancelled) {
        exit::INTERRUPTED
    } else if any(&|outcome| {
        outcome
            .failures()
            .any(|(_, failure)| failure.kind == FailureKind::Internal)
    }) {
        exit::INTERNAL
    } else if any(&|outcome| outcome.failures().next().is_some()) {
        exit::SOME_FAILED
    } else {
        exit::GOOD
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::work::Surveyed;
    use affine_atlas::config::Config;
    use affine_atlas::outcome::ComponentOutcome;
    use std::path::{Path, PathBuf};

    fn built(id: &str) -> AssetOutcome {
        AssetOutcome::whole(id, AssetState::Built, 0.0)
    }

    fn failure(kind: FailureKind) -> Failure {
        Failure {
            kind,
            message: "wrong".to_owned(),
        }
    }

    /// Does what the asset's name says.
    fn fake(asset: &Asset, _: &Path, _: &Config, _: &dyn Observer) -> AssetOutcome {
        match asset.id.as_str() {
            "panics" => panic!("index {} out of range", 7),
            "refused" => AssetOutcome::failed(&asset.id, failure(FailureKind::Input), 0.0),
            "half" => AssetOutcome {
                components: vec![ComponentOutcome {
                    index: 3,
                    result: Err(failure(FailureKind::Prescription)),
                }],
                ..built(&asset.id)
            },
            id => built(id),
        }
    }

    const FAKE: Work = Work {
        build: fake,
        record: |_, _, _| Ok(()),
        inspect: |_, _| {
            Err(Failure {
                kind: FailureKind::Input,
                message: String::new(),
            })
        },
        survey: |request, _| Surveyed {
            text: String::new(),
            json: None,
            suggested: None,
            outcome: built(&request.asset.id),
        },
        survey_folder: str::to_owned,
        verify: |_| {
            Err(Failure {
                kind: FailureKind::Input,
                message: String::new(),
            })
        },
        rebuild: |_| {
            Err(Failure {
                kind: FailureKind::Input,
                message: String::new(),
            })
        },
        fit: |_| {
            Err(Failure {
                kind: FailureKind::Input,
                message: String::new(),
            })
        },
        texture: |_| {
            Err(Failure {
                kind: FailureKind::Input,
                message: String::new(),
            })
        },
        explain: |_| {
            Err(Failure {
                kind: FailureKind::Input,
                message: String::new(),
            })
        },
        remove_staging: || {},
    };

    fn outcomes(names: &[&str]) -> Vec<AssetOutcome> {
        let paths: Vec<PathBuf> = names
            .iter()
            .map(|name| format!("{name}.obj").into())
            .collect();
        let plan = Plan {
            config: Config::default(),
            output: PathBuf::from("out"),
            assets: affine_atlas::config::assets::name_assets(&paths, Path::new("")),
        };
        let quiet = Global {
            quiet: true,
            ..Global::default()
        };
        build_all(&plan, &Progress::new(&quiet, names.len()), &FAKE)
    }

    #[test]
    fn exit_codes() {
        assert_eq!(exit_code(&outcomes(&["a", "b"])), exit::GOOD);
        assert_eq!(exit_code(&outcomes(&["a", "refused"])), exit::SOME_FAILED);
        assert_eq!(exit_code(&outcomes(&["half"])), exit::SOME_FAILED);
        let mut cancelled = outcomes(&["a", "refused"]);
        cancelled[0].state = AssetState::Cancelled;
        assert_eq!(exit_code(&cancelled), exit::INTERRUPTED);
    }

    #[test]
    fn a_panic_fails_one_asset_and_the_others_go_on() {
        let outcomes = outcomes(&["a", "panics", "b"]);
        let states: Vec<&str> = outcomes.iter().map(AssetOutcome::state_name).collect();
        assert_eq!(states, ["built", "failed", "built"]);
        let (_, failure) = outcomes[1].failures().next().expect("one failure");
        assert!(failure.message.starts_with("internal error:"));
        assert_eq!(exit_code(&outcomes), exit::INTERNAL);
    }
}
