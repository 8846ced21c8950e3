//! What files and folders of an output folder are called.

use super::error::ExportError;

/// The page of a run.
pub(super) const INDEX: &str = "index.html";
/// What the next run compares with.
pub(super) const HISTORY: &str = "history.jsonl";
/// The components of an asset, where they have no folders.
pub(crate) const COMPONENTS: &str = "components.json";
/// The record of the latest run.
pub(super) const MANIFEST: &str = "manifest.jsonl";
/// The picture that stands for a component.
pub(super) const PREVIEW: &str = "preview.png";
/// The page of a component.
pub(super) const REPORT: &str = "report.html";

/// Names in the output root that are not those of assets.
pub(crate) const RESERVED: [&str; 5] = [INDEX, HISTORY, "junit.xml", "logs", MANIFEST];

/// Whether a folder can have this name without meeting our own names.
pub(crate) fn is_asset_name(name: &str) -> bool {
    asset_name(name).is_ok()
}

/// The name, where it is one that a folder can have without meeting our own names.
pub(super) fn asset_name(name: &str) -> Result<&str, ExportError> {
    let bad = name.is_empty()
        || name.starts_with('.')
        || name.contains(['/', '\\', '\0'])
        || RESERVED.contains(&name);
    if bad {
        return Err(ExportError::AssetName { name: name.into() });
    }
    Ok(name)
}

/// The folder of one component of an asset that has several.
pub fn component_name(component: usize) -> String {
    format!("component-{component:03}")
}
