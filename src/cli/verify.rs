//! `affine-atlas verify`.

use super::arguments::{Global, Verify};
use super::check::show_failure;
use super::inputs::start_threads;
use super::problem::Problem;
use super::work::{VerifyRequest, Work};
use super::{exit, panics, terminal};
use affine_atlas::config::Config;
use affine_atlas::outcome::{Failure, FailureKind};
use console::style;

/// Checks every folder. Exit code 1 where a check failed.
pub fn run(verify: &Verify, global: &Global, work: &Work) -> Result<u8, Problem> {
    if let Some(missing) = verify.folders.iter().find(|folder| !folder.is_dir()) {
        return Err(Problem::NoFolder {
            path: missing.clone(),
        });
    }
    start_threads(global.threads, &Config::default())?;
    let mut code = exit::GOOD;
    let mut records = Vec::new();
    for folder in &verify.folders {
        let request = VerifyRequest {
            folder: folder.clone(),
            source: verify.source.clone(),
            cones: verify.cones,
        };
        let verified = panics::catch(|| (work.verify)(&request)).unwrap_or_else(|panic| {
            Err(Failure {
                kind: FailureKind::Internal,
                message: panic,
            })
        });
        let name = folder.display().to_string();
        match verified {
            Ok(result) => {
                if result.failed > 0 {
                    code = code.max(exit::SOME_FAILED);
                }
                records.push(serde_json::json!({ "folder": name, "verdicts": result.json }));
                if !verify.json && (!global.quiet || result.failed > 0) {
                    let heading = if verify.folders.len() > 1 {
                        format!("{}\n", style(&name).bold())
                    } else {
                        String::new()
                    };
                    terminal::print(&format!("{heading}{}\n", result.text.trim_end()));
                }
            }
            Err(failure) => {
                code = code.max(match failure.kind {
                    FailureKind::Internal => exit::INTERNAL,
                    _ => exit::SOME_FAILED,
                });
                records.push(serde_json::json!({ "folder": name, "error": failure.message }));
                show_failure(&name, &failure, global.log_format);
            }
        }
    }
    if verify.json {
        terminal::print(&format!("{:#}\n", serde_json::Value::Array(records)));
    }
    Ok(code)
}
