//! The `affine-atlas` command: arguments → configuration → one worker process an asset → exit code.
//!
//! Everything that computes lives in the library; [`cli`] only reads arguments, shows progress
//! and words results. What the command asks of the library stands in [`WORK`].

mod cli;

use affine_atlas::batch::cache::Verdict;
use affine_atlas::batch::merge::{self, Merged};
use affine_atlas::batch::plan::Plan;
use affine_atlas::batch::shard::Shard;
use affine_atlas::batch::{self, Batch, Task, Watcher};
use affine_atlas::config::Config;
use affine_atlas::config::assets::Asset;
use affine_atlas::export::folder::remove_all_staging;
use affine_atlas::export::manifest::Manifest;
use affine_atlas::export::{ExportError, index};
use affine_atlas::job::rebuild::RebuildAssetError;
use affine_atlas::job::survey::folder_name as survey_folder;
use affine_atlas::job::{self, BuildError};
use affine_atlas::observe::Observer;
use affine_atlas::outcome::{Failure, FailureKind};
use affine_atlas::read::{self, ReadParams};
use affine_atlas::verify::{self, SourceSurface, VerifyOptions};
use cli::work::{
    ExplainRequest, Explained, FitRequest, FitResult, Inspection, RebuildRequest, RebuildResult,
    Recorded, SurveyRequest, Surveyed, TextureRequest, TextureResult, VerifyRequest, VerifyResult,
    Work,
};
use std::process::ExitCode;

/// The one place where the command meets the library.
const WORK: Work = Work {
    batch,
    shard,
    collect,
    merge,
    decide,
    work: batch::worker::work,
    inspect,
    survey,
    survey_folder,
    verify,
    rebuild,
    fit,
    texture,
    explain,
    remove_staging,
};

fn main() -> ExitCode {
    cli::main(&WORK)
}

fn batch(batch: &Batch<'_>, tasks: &[Task], watcher: &dyn Watcher) -> Recorded {
    let (outcomes, recorded) = batch::run(batch, tasks, watcher);
    let page = || {
        let (manifest, _) = Manifest::load(batch.output)?;
        let ids = tasks.iter().map(|task| task.id.as_str()).collect();
        index::write(batch.output, &manifest.of(&ids))
    };
    let recorded = recorded.and_then(|()| page());
    (outcomes, recorded.map_err(failure))
}

fn shard(
    batch: &Batch<'_>,
    plan: &str,
    shard: Shard,
    tasks: &[Task],
    watcher: &dyn Watcher,
) -> Recorded {
    let (outcomes, recorded) = batch::run_shard(batch, plan, shard, tasks, watcher);
    (outcomes, recorded.map_err(failure))
}

fn collect(plan: &Plan) -> Result<Merged, Failure> {
    merge::collect(plan).map_err(failure)
}

fn merge(plan: &Plan, merged: &Merged) -> Result<(), Failure> {
    let write = || {
        let before = merge::history_before(plan)?;
        merged.save(plan)?;
        let output = &plan.header.output;
        let (manifest, _) = Manifest::load(output)?;
        let ids = plan.assets.iter().map(|asset| asset.task.id.as_str());
        index::write_against(output, &manifest.of(&ids.collect()), &before)?;
        merged.clear_up(plan);
        Ok(())
    };
    write().map_err(failure)
}

fn failure(error: ExportError) -> Failure {
    Failure::from(&BuildError::Export(error))
}

fn decide(batch: &Batch<'_>, tasks: &[Task]) -> Vec<Verdict> {
    let known = Manifest::load(batch.output).map(|(manifest, _)| manifest);
    batch::queue::decide(batch, tasks, &known.unwrap_or_default())
}

/// Ends what this program has started and removes what is half written.
fn remove_staging() {
    batch::queue::end_workers();
    remove_all_staging();
}

fn inspect(asset: &Asset, config: &Config) -> Result<Inspection, Failure> {
    let inspection = job::inspect(&asset.path, config).map_err(|e| Failure::from(&e))?;
    let region = inspection.region_glb().transpose();
    let region = region.map_err(failure)?;
    Ok(Inspection {
        region,
        text: inspection.to_string(),
        refused: !inspection.failures().is_empty(),
    })
}

fn survey(request: &SurveyRequest<'_>, observer: &dyn Observer) -> Surveyed {
    let SurveyRequest {
        asset,
        output,
        config,
        counts,
    } = *request;
    let given = asset.given.to_string_lossy();
    let (survey, outcome) = job::survey::run(
        &asset.path,
        &given,
        output,
        &asset.id,
        config,
        counts,
        observer,
    );
    Surveyed {
        text: survey.as_ref().map(ToString::to_string).unwrap_or_default(),
        json: survey.as_ref().map(|survey| survey.json(true)),
        suggested: survey
            .as_ref()
            .and_then(|survey| survey.suggested_config(&outcome.files)),
        outcome,
    }
}

fn verify(request: &VerifyRequest) -> Result<VerifyResult, Failure> {
    let refused = |message: String| Failure {
        kind: FailureKind::Input,
        message,
    };
    let options = VerifyOptions {
        cones: request.cones,
        ..VerifyOptions::default()
    };
    let source = match &request.source {
        Some(path) => Some(
            read::read(path, &ReadParams::default())
                .map_err(|error| refused(error.to_string()))?
                .soup,
        ),
        None => None,
    };
    let surface = source.as_ref().map(|soup| SourceSurface {
        positions: &soup.positions,
        faces: &soup.faces,
    });
    let verdicts = verify::verify_against(&request.folder, &options, surface.as_ref())
        .map_err(|error| refused(error.to_string()))?;
    Ok(VerifyResult {
        text: verdicts.to_string(),
        failed: verdicts.failed(),
        json: serde_json::json!(verdicts),
    })
}

fn rebuild(request: &RebuildRequest) -> Result<RebuildResult, Failure> {
    let asset = job::rebuild::rebuild(&request.folder, request.against.as_deref());
    let asset = asset.map_err(|error| Failure::from(&error))?;
    let glb = asset.glb();
    Ok(RebuildResult {
        glb: glb.map_err(|error| Failure::from(&RebuildAssetError::from(error)))?,
        text: asset.to_string(),
        json: asset.json(),
    })
}

fn fit(request: &FitRequest, observer: &dyn Observer) -> Result<FitResult, Failure> {
    let fitted = job::fit::fit(&request.input, &request.params, observer);
    let fitted = fitted.map_err(|error| Failure::from(&error))?;
    observer.stage("write", 0, 1);
    let written = fitted.write(&request.root, &request.name);
    written.map_err(|error| Failure::from(&error))?;
    Ok(FitResult {
        text: fitted.to_string(),
        json: serde_json::json!(fitted.document()),
        unfitted: fitted.unfitted,
    })
}

fn texture(request: &TextureRequest) -> Result<TextureResult, Failure> {
    let textured = job::texture::texture(&request.folder, &request.params);
    let textured = textured.map_err(|error| Failure::from(&error))?;
    let written = textured.write(&request.root, &request.name);
    written.map_err(|error| Failure::from(&error))?;
    Ok(TextureResult {
        text: textured.to_string(),
        json: textured.json(),
    })
}

fn explain(request: &ExplainRequest) -> Result<Explained, Failure> {
    let said = job::explain::asset(&request.asset, &request.config)?;
    let glb = said.glb().transpose();
    Ok(Explained {
        glb: glb.map_err(failure)?,
        failed: said.failed(),
        text: said.to_string(),
    })
}
