//! `affine-atlas cones`.

use super::arguments::{Cones, Global, LogFormat};
use super::batch::exit_code;
use super::inputs::{Selection, select, start_threads};
use super::problem::Problem;
use super::progress::Progress;
use super::work::{SurveyRequest, Surveyed, Work};
use super::{interrupt, panics, summary, terminal};
use affine_atlas::config::Config;
use affine_atlas::config::assets::Asset;
use affine_atlas::observe::Observer;
use affine_atlas::outcome::{AssetOutcome, AssetState, Failure, FailureKind};
use console::style;
use std::time::Instant;

/// Surveys every asset, shows the tables, and gives the exit code.
pub fn run(cones: &Cones, global: &Global, work: &Work) -> Result<u8, Problem> {
    let selected = select(&cones.inputs, cones.out.as_deref())?;
    selected.keep_inputs(|asset| selected.output.join((work.survey_folder)(&asset.id)))?;
    start_threads(global.threads, &selected.config)?;
    let counts: Option<Vec<usize>> =
        (cones.counts.as_ref()).map(|counts| counts.iter().map(|&count| count as usize).collect());
    let announce = !global.quiet && global.log_format == LogFormat::Text;
    interrupt::install(work.remove_staging, announce);
    let progress = Progress::new(global, selected.assets.len()).calling_it("surveyed");
    let mut surveyed = Vec::with_capacity(selected.assets.len());
    for (index, (asset, settings)) in selected.items().enumerate() {
        let observer = progress.asset(&asset.id, index);
        let one = survey_one(
            &selected,
            asset,
            &settings.config,
            counts.as_deref(),
            &observer,
            work,
        );
        progress.done(&one.outcome, index);
        surveyed.push(one);
    }
    progress.finish();
    if cones.json {
        let records: Vec<_> = surveyed.iter().filter_map(|s| s.json.clone()).collect();
        terminal::print(&format!("{:#}\n", serde_json::Value::Array(records)));
    } else if !global.quiet {
        for (asset, one) in selected.assets.iter().zip(&surveyed) {
            terminal::print(&show(&selected, asset, one, work));
        }
    }
    let outcomes: Vec<AssetOutcome> = surveyed.into_iter().map(|s| s.outcome).collect();
    if global.log_format == LogFormat::Text {
        terminal::print_error(&summary::failures(&outcomes));
    }
    if interrupt::requested() {
        (work.remove_staging)();
    }
    Ok(exit_code(&outcomes))
}

/// A panic while an asset is surveyed is that asset's failure; the others go on.
fn survey_one(
    selected: &Selection,
    asset: &Asset,
    config: &Config,
    counts: Option<&[usize]>,
    observer: &dyn Observer,
    work: &Work,
) -> Surveyed {
    let without_table = |outcome: AssetOutcome| Surveyed {
        text: String::new(),
        json: None,
        suggested: None,
        outcome,
    };
    let start = Instant::now();
    if observer.cancelled() {
        return without_table(AssetOutcome::whole(&asset.id, AssetState::Cancelled, 0.0));
    }
    let request = SurveyRequest {
        asset,
        output: &selected.output,
        config,
        counts,
    };
    let survey = || (work.survey)(&request, observer);
    panics::catch(survey).unwrap_or_else(|panic| {
        let failure = Failure {
            kind: FailureKind::Internal,
            message: panic,
        };
        let seconds = start.elapsed().as_secs_f64();
        without_table(AssetOutcome::failed(&asset.id, failure, seconds))
    })
}

/// The table of an asset and what to do with it; empty where there is none.
fn show(selected: &Selection, asset: &Asset, one: &Surveyed, work: &Work) -> String {
    if one.text.is_empty() {
        return String::new();
    }
    let heading = style(format!("{} ({})", asset.id, asset.path.display())).bold();
    let mut text = format!("{heading}\n{}\n", one.text.trim_end());
    let folder = selected.output.join((work.survey_folder)(&asset.id));
    if !one.outcome.files.is_empty() {
        text.push_str(&format!(
            "wrote {} ({} files)\n",
            folder.display(),
            one.outcome.files.len()
        ));
    }
    if let Some(config) = &one.suggested {
        let config = folder.join(config);
        text.push_str(&format!(
            "build it with: affine-atlas build {}\n",
            config.display()
        ));
    }
    text
}
