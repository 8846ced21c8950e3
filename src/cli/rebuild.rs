//! `affine-atlas rebuild`.

use super::arguments::{Global, Rebuild};
use super::check::{show_failure, write_whole};
use super::inputs::start_threads;
use super::problem::Problem;
use super::work::{RebuildRequest, Work};
use super::{exit, panics, terminal};
use affine_atlas::config::Config;
use affine_atlas::outcome::{Failure, FailureKind};

/// Rebuilds one asset. Exit code 1 where its folder does not make a mesh.
pub fn run(rebuild: &Rebuild, global: &Global, work: &Work) -> Result<u8, Problem> {
    if !rebuild.folder.is_dir() {
        return Err(Problem::NoFolder {
            path: rebuild.folder.clone(),
        });
    }
    let extension = rebuild.out.extension();
    if !extension.is_some_and(|e| e.eq_ignore_ascii_case("glb")) {
        return Err(Problem::NotGlb {
            path: rebuild.out.clone(),
        });
    }
    start_threads(global.threads, &Config::default())?;
    let request = RebuildRequest {
        folder: rebuild.folder.clone(),
        against: rebuild.against.clone(),
    };
    let rebuilt = panics::catch(|| (work.rebuild)(&request)).unwrap_or_else(|panic| {
        Err(Failure {
            kind: FailureKind::Internal,
            message: panic,
        })
    });
    match rebuilt {
        Ok(result) => {
            write_whole(&rebuild.out, &result.glb)?;
            if rebuild.json {
                terminal::print(&format!("{:#}\n", result.json));
            } else if !global.quiet {
                let path = rebuild.out.display();
                terminal::print(&format!("{}written to {path}\n", result.text));
            }
            Ok(exit::GOOD)
        }
        Err(failure) => {
            let name = rebuild.folder.display().to_string();
            show_failure(&name, &failure, global.log_format);
            Ok(match failure.kind {
                FailureKind::Internal => exit::INTERNAL,
                _ => exit::SOME_FAILED,
            })
        }
    }
}
