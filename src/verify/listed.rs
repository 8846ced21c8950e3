//! Assets whose components have no folders: `components.json` lists them, `surface.glb` holds them.

use super::glb::{self, Extent};
use super::{Verdicts, VerifyOptions};
use crate::read::bounded::{JSON_LIMIT, read_bounded};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the list.
pub(super) const FILE_NAME: &str = "components.json";

#[derive(Deserialize)]
struct Document {
    format: String,
    version: u64,
    components: Vec<Component>,
}

#[derive(Deserialize)]
struct Component {
    component: usize,
    state: String,
    figures: Option<Figures>,
}

#[derive(Deserialize)]
struct Figures {
    faces: usize,
    low: [f64; 3],
    high: [f64; 3],
    cones: usize,
}

/// The list, and the surface by what it says.
pub(super) fn check(
    folder: &Path,
    options: &VerifyOptions,
    has_source: bool,
    verdicts: &mut Verdicts,
) {
    let read = read_bounded(&folder.join(FILE_NAME), JSON_LIMIT).map_err(|e| e.to_string());
    let read = read.and_then(|bytes| parse(&bytes));
    let note = verdicts.note(
        "components.json can be read",
        read.is_ok(),
        read.as_ref().err().map_or("", String::as_str),
    );
    let (true, Ok(parts)) = (note, read) else {
        return;
    };
    if has_source || options.log_scale_range.is_some() {
        let figure = "output.component_folders asks for them";
        verdicts.note("components have folders to compare", false, figure);
    }
    if let Some(most) = options.cones {
        let cones = parts.values().map(|(_, cones)| *cones).max();
        let cones = cones.unwrap_or(0);
        verdicts.note(
            "no more cones than prescribed",
            cones <= most,
            format!("{cones} of at most {most}"),
        );
    }
    let parts = parts
        .into_iter()
        .map(|(place, (extent, _))| (place, extent));
    let parts: BTreeMap<usize, Extent> = parts.collect();
    if glb::check_whole(folder, &parts, verdicts) {
        return;
    }
    verdicts.note("surface.glb is there", false, "the components are nowhere");
}

/// The components that were built, with their cones.
fn parse(bytes: &[u8]) -> Result<BTreeMap<usize, (Extent, usize)>, String> {
    let document: Document = serde_json::from_slice(bytes).map_err(|error| error.to_string())?;
    if document.format != "affine-atlas" || !(1..=2).contains(&document.version) {
        let (format, version) = (document.format, document.version);
        return Err(format!("is of format {format:?}, version {version}"));
    }
    let mut parts = BTreeMap::new();
    for (place, entry) in document.components.iter().enumerate() {
        if entry.component != place {
            return Err(format!("entry {place} is of component {}", entry.component));
        }
        match (entry.state.as_str(), &entry.figures) {
            ("built", Some(figures)) => {
                let extent = Extent::stated(figures.faces, figures.low, figures.high);
                parts.insert(place, (extent, figures.cones));
            }
            ("failed", None) => {}
            (state, figures) => {
                let has = if figures.is_some() { "has" } else { "has no" };
                return Err(format!("component {place} is {state:?} and {has} figures"));
            }
        }
    }
    match parts.is_empty() {
        true => Err("lists no component that was built".to_owned()),
        false => Ok(parts),
    }
}
