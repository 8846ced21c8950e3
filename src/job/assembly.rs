//! What all components of an asset have in common.
//!
//! *Enters:* published components in their order. *Leaves:* beside their folders, where there are several, one `surface.glb`, one picture and one page of all of them; the folder
//! replaces the older one in one step.

use super::error::{BuildError, Unverified};
use super::publication::{Publication, Published};
use crate::config::Config;
use crate::export::ExportError;
use crate::export::atlas_json::FORMAT_VERSION;
use crate::export::components::{Document, Entry};
use crate::export::glb::whole::Whole;
use crate::export::pictures::{self, Scene};
use crate::export::report::whole::{self as page, Row};
use crate::observe::part;
use crate::outcome::{ComponentOutcome, Failure};
use crate::verify::{Extent, verify_whole};
use std::collections::BTreeMap;

/// See the module docs.
#[derive(Default)]
pub(super) struct Assembly {
    /// Whether any atlas passed.
    new: bool,
    /// Subfolders of components that have no atlas.
    missing: Vec<String>,
    /// All that passed, where there are several, …
    whole: Whole,
    /// … what a file of them is compared with, …
    extents: BTreeMap<usize, Extent>,
    /// … what a picture shows …
    scene: Scene,
    /// … and what a page or a list says.
    rows: Vec<Row>,
}

impl Assembly {
    /// Notes what became of a component, and gives what the manifest says of it.
    pub fn add(&mut self, published: Published) -> ComponentOutcome {
        let Published {
            index,
            components,
            result,
            shown,
            is_missing,
            ..
        } = published;
        self.new |= result.is_ok();
        if is_missing {
            self.missing.push(Publication::subfolder(index, components));
        }
        let outcome = ComponentOutcome {
            index,
            result: result.map_err(|error| Failure::from(&error)),
        };
        if components > 1 {
            self.rows.push(Row {
                has_page: shown.as_ref().is_some_and(|s| s.has_page),
                outcome: outcome.clone(),
                figures: shown.as_ref().map(|s| s.figures.clone()),
            });
        }
        if let Some(shown) = shown {
            self.whole.add(index, shown.surface, shown.padding);
            self.extents.insert(index, shown.extent);
            if let Some(exhibit) = shown.exhibit {
                self.scene.add(exhibit);
            }
        }
        outcome
    }

    /// Writes what all have in common, and puts the folder in place, where any atlas passed. `notes`: what is said of the asset and its components.
    pub fn finish(
        self,
        publication: Publication<'_>,
        config: &Config,
        notes: &[String],
    ) -> Result<(), BuildError> {
        let (asset, id) = (publication.asset, publication.id);
        let source = publication.source();
        let has_folders = config.output.has_component_folders(self.rows.len());
        let Some(staging) = publication.finish().filter(|_| self.new) else {
            return Ok(());
        };
        for subfolder in self.missing.iter().filter(|_| has_folders) {
            staging.keep_previous(subfolder)?;
        }
        if !has_folders {
            let entries = self.rows.iter();
            let entries = entries.map(|row| Entry::new(&row.outcome, row.figures.clone()));
            Document::new(source.clone(), entries.collect()).write(&staging)?;
        }
        if !self.whole.is_empty() {
            let appearance = &asset.soup.appearance;
            let bytes = self.whole.encode(id, FORMAT_VERSION, appearance)?;
            drop(self.whole);
            if bytes.is_none() && !has_folders {
                let (components, most) = (self.rows.len(), config.output.component_folders);
                return Err(ExportError::TooFarApart { components, most }.into());
            }
            if let Some(bytes) = bytes {
                staging.write("surface.glb", &bytes)?;
                drop(bytes);
                let verdicts = verify_whole(staging.path(), &self.extents);
                if let Some(unverified) = Unverified::of(&verdicts) {
                    return Err(unverified.into());
                }
            }
            if config.pictures.enabled {
                let _part = part!("pictures");
                pictures::write_whole(&staging, self.scene, config.pictures.size)?;
            }
            if config.report.enabled {
                let _part = part!("page");
                page::write(&staging, id, &source.path, config, &self.rows, notes)?;
            }
        }
        Ok(staging.publish()?)
    }
}
