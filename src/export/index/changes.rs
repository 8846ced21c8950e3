//! What is different from the run before.

use super::assets::Asset;
use super::history::Past;
use crate::export::manifest::State;
use std::collections::BTreeMap;

/// Area distortion counts as worse where it is this many times what it was …
pub(super) const WORSE_FACTOR: f64 = 1.1;
/// … and this much more, so that what is hardly distorted is left in peace.
pub(super) const WORSE_BY: f64 = 0.01;

/// What happened to an asset since the run before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Change {
    /// It failed, and did not before, or is new.
    NewFailure,
    /// It was built, and failed before.
    Fixed,
    /// Its area distortion grew from the first to the second number.
    Worse(f64, f64),
    /// It was not there.
    New,
}

impl Change {
    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Change::NewFailure => "new failure",
            Change::Fixed => "fixed",
            Change::Worse(..) => "worse",
            Change::New => "new",
        }
    }
}

/// Changes against the run before.
pub(super) struct Changes {
    /// Whether there was one.
    pub compared: bool,
    /// By asset, as many as there are assets.
    pub of: Vec<Option<Change>>,
    /// Assets that were there.
    pub removed: Vec<String>,
}

/// Compares; `assets` stand in order of their ids.
pub(super) fn compare(before: &BTreeMap<String, Past>, assets: &[Asset<'_>]) -> Changes {
    let compared = !before.is_empty();
    let of = assets.iter().map(|asset| {
        let past = before.get(&asset.record.id);
        change(past, asset).filter(|_| compared)
    });
    let here = |id: &String| {
        assets
            .binary_search_by(|asset| asset.record.id.as_str().cmp(id))
            .is_ok()
    };
    Changes {
        compared,
        of: of.collect(),
        removed: before.keys().filter(|&id| !here(id)).cloned().collect(),
    }
}

fn change(past: Option<&Past>, asset: &Asset<'_>) -> Option<Change> {
    let failed = asset.record.state == State::Failed;
    let Some(past) = past else {
        return Some(if failed {
            Change::NewFailure
        } else {
            Change::New
        });
    };
    match (past.state == State::Failed, failed) {
        (false, true) => return Some(Change::NewFailure),
        (true, true) => return None,
        (true, false) if asset.record.state != State::Cancelled => return Some(Change::Fixed),
        _ => {}
    }
    let (old, new) = (past.figures.as_ref()?, asset.figures.as_ref()?);
    let (old, new) = (old.area_distortion, new.area_distortion);
    (new > WORSE_FACTOR * old && new > old + WORSE_BY).then_some(Change::Worse(old, new))
}
