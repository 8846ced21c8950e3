//! `affine-atlas texture`.

use super::arguments::{Global, LogFormat, Texture};
use super::check::show_failure;
use super::fit::beside;
use super::inputs::start_threads;
use super::problem::Problem;
use super::work::{TextureRequest, Work};
use super::{exit, interrupt, panics, terminal};
use affine_atlas::config::Config;
use affine_atlas::job::texture::TextureParams;
use affine_atlas::outcome::{Failure, FailureKind};
use std::path::Path;

/// Textures one asset. Exit code 1 where its folder or the pattern is refused.
pub fn run(texture: &Texture, global: &Global, work: &Work) -> Result<u8, Problem> {
    if !texture.folder.is_dir() {
        return Err(Problem::NoFolder {
            path: texture.folder.clone(),
        });
    }
    let out = match &texture.out {
        Some(out) => out.clone(),
        None => beside(&texture.folder, ".texture"),
    };
    let no_name = || Problem::NoName { path: out.clone() };
    let name = out.file_name().ok_or_else(no_name)?;
    let root = match out.parent() {
        Some(root) if !root.as_os_str().is_empty() => root,
        _ => Path::new("."),
    };
    start_threads(global.threads, &Config::default())?;
    let announce = !global.quiet && global.log_format == LogFormat::Text;
    interrupt::install(work.remove_staging, announce);
    let request = TextureRequest {
        folder: texture.folder.clone(),
        root: root.to_owned(),
        name: name.to_string_lossy().into_owned(),
        params: TextureParams {
            pattern: texture.pattern.clone(),
            tiles: texture.tiles,
            size: texture.size as usize,
        },
    };
    let textured = panics::catch(|| (work.texture)(&request)).unwrap_or_else(|panic| {
        Err(Failure {
            kind: FailureKind::Internal,
            message: panic,
        })
    });
    match textured {
        Ok(result) => {
            if texture.json {
                terminal::print(&format!("{:#}\n", result.json));
            } else if !global.quiet {
                terminal::print(&format!("{}written to {}\n", result.text, out.display()));
            }
            Ok(exit::GOOD)
        }
        Err(failure) => {
            let name = texture.folder.display().to_string();
            show_failure(&name, &failure, global.log_format);
            Ok(match failure.kind {
                FailureKind::Internal => exit::INTERNAL,
                _ => exit::SOME_FAILED,
            })
        }
    }
}
