//! `affine-atlas explain`.

use super::arguments::{Explain, Global};
use super::check::{one_of_many, show_failure, write_whole};
use super::inputs::{select, start_threads};
use super::problem::Problem;
use super::work::{ExplainRequest, Work};
use super::{exit, panics, terminal};
use affine_atlas::config::Config;
use affine_atlas::outcome::{Failure, FailureKind};
use std::path::{Path, PathBuf};

/// Explains every asset. Exit code 1 where one fails.
pub fn run(explain: &Explain, global: &Global, work: &Work) -> Result<u8, Problem> {
    if let Some(path) = explain.out.as_ref().filter(|path| !is_glb(path)) {
        return Err(Problem::NotGlb { path: path.clone() });
    }
    let mut worst = exit::GOOD;
    let requests = requests(explain, global)?;
    let several = requests.len() > 1;
    for request in requests {
        let name = request.asset.display().to_string();
        let said = panics::catch(|| (work.explain)(&request)).unwrap_or_else(|panic| {
            Err(Failure {
                kind: FailureKind::Internal,
                message: panic,
            })
        });
        match said {
            Ok(said) => {
                if several {
                    terminal::print(&format!("{name}\n"));
                }
                terminal::print(&said.text);
                if said.failed {
                    worst = worst.max(exit::SOME_FAILED);
                }
                match (&explain.out, said.glb) {
                    (Some(path), Some(glb)) => {
                        let stem = request.asset.file_stem().unwrap_or_default();
                        let path = match several {
                            true => {
                                &path.with_file_name(one_of_many(path, &stem.to_string_lossy()))
                            }
                            false => path,
                        };
                        write_whole(path, &glb)?;
                        terminal::print(&format!("faces: written to {}\n", path.display()));
                    }
                    (Some(path), None) => terminal::print(&format!(
                        "faces: none to show, {} was not written\n",
                        path.display()
                    )),
                    (None, _) => {}
                }
            }
            Err(failure) => {
                worst = worst.max(match failure.kind {
                    FailureKind::Internal => exit::INTERNAL,
                    _ => exit::SOME_FAILED,
                });
                show_failure(&name, &failure, global.log_format);
            }
        }
    }
    Ok(worst)
}

fn is_glb(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("glb"))
}

/// A folder, or the place of one, stands for itself; meshes come with their configuration.
fn requests(explain: &Explain, global: &Global) -> Result<Vec<ExplainRequest>, Problem> {
    let is_config = |path: &PathBuf| {
        path.extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("toml"))
    };
    let named = &explain.inputs.inputs;
    if let Some(asset) = named
        .iter()
        .find(|path| !path.is_file() && !is_config(path))
    {
        start_threads(global.threads, &Config::default())?;
        return Ok(vec![ExplainRequest {
            asset: asset.clone(),
            config: Config::default(),
        }]);
    }
    let selected = select(&explain.inputs, None)?;
    start_threads(global.threads, &selected.config)?;
    let requests = selected.assets.iter().zip(&selected.settings);
    Ok(requests
        .map(|(asset, settings)| ExplainRequest {
            asset: asset.path.clone(),
            config: settings.config.clone(),
        })
        .collect())
}
