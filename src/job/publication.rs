//! The folder of an asset, filled component by component.
//!
//! *Enters:* components in any order, several at a time. *Leaves:* their folders in a staging folder, which an [`Assembly`](super::assembly::Assembly) completes and puts in
//! place. What does not pass the checks of [`verify`](crate::verify) is not published; an older one stays in its place.

use super::components::Part;
use super::error::{BuildError, Unverified};
use super::precision::Precision;
use super::warnings::warnings;
use crate::config::Config;
use crate::export::components::{Figures, Source};
use crate::export::folder::{Staging, component_name};
use crate::export::{self, ExportError, Provenance, glb, pictures, report as report_page};
use crate::observe::{Observer, part};
use crate::outcome::Summary;
use crate::product::AffineAtlas;
use crate::read::SourceAsset;
use crate::verify::{Extent, VerifyOptions, verify_atlas_and_measure};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// What all components of an asset are written with.
pub(super) struct Publication<'a> {
    pub asset: &'a SourceAsset,
    /// The path as the user wrote it.
    pub given: &'a str,
    output: &'a Path,
    pub id: &'a str,
    config_blake3: String,
    /// What is said of the whole asset, for its pages.
    notes: Vec<String>,
    observer: &'a dyn Observer,
    /// Made for the first atlas: where there is none, nothing is touched.
    staging: Mutex<Option<Arc<Staging>>>,
    /// Where components are written and read back that get no folder.
    scratch: Mutex<Option<Arc<Staging>>>,
}

/// What became of a component.
pub(super) struct Published {
    pub index: usize,
    pub components: usize,
    /// What it says beside that it is there.
    pub notes: Vec<String>,
    pub result: Result<Summary, BuildError>,
    /// What is shown of it beside the others, where there are several and it passed.
    pub shown: Option<Shown>,
    /// Whether it had no atlas at all: an older one stays.
    pub is_missing: bool,
}

/// What files of the whole asset show of a component.
pub(super) struct Shown {
    pub surface: glb::Surface,
    /// Texels around its patches.
    pub padding: usize,
    pub extent: Extent,
    pub exhibit: Option<pictures::Exhibit>,
    pub figures: Figures,
    /// Whether it has a page of its own.
    pub has_page: bool,
}

impl<'a> Publication<'a> {
    /// A folder `output/id` that nothing has been written for.
    pub fn new(
        asset: &'a SourceAsset,
        given: &'a str,
        output: &'a Path,
        id: &'a str,
        config: &Config,
        notes: Vec<String>,
        observer: &'a dyn Observer,
    ) -> Self {
        Self {
            asset,
            given,
            output,
            id,
            config_blake3: config.hash(),
            notes,
            observer,
            staging: Mutex::default(),
            scratch: Mutex::default(),
        }
    }

    /// Name of a component's folder inside that of the asset; empty where it is the whole asset.
    pub fn subfolder(component: usize, components: usize) -> String {
        match components {
            1 => String::new(),
            _ => component_name(component),
        }
    }

    /// Builds a component, of flat patches where its grid does not pass, and writes it.
    ///
    /// # Errors
    /// What concerns the whole asset: it was cancelled, or cannot be written.
    pub fn component(&self, part: Part<'_>) -> Result<Published, BuildError> {
        let (index, components, config) = (part.index, part.components, &part.config.clone());
        let published = |result, notes, shown| Published {
            index,
            components,
            notes,
            result,
            shown,
            is_missing: false,
        };
        let mut is_missing = true;
        let accepted = part.accepted(|mut atlas| {
            is_missing = false;
            let shown = self.add(index, components, &mut atlas, config)?;
            Ok(shown.map(|shown| (atlas, shown)))
        })?;
        let (atlas, shown) = match accepted {
            Ok(accepted) => accepted,
            Err(error) => {
                return Ok(Published {
                    is_missing,
                    ..published(Err(error), Vec::new(), None)
                });
            }
        };
        let notes = self.said_of(&atlas, index, components, config);
        let mut folder = self.output.join(self.id);
        if config.output.has_component_folders(components) {
            folder.push(Self::subfolder(index, components));
        }
        Ok(published(Ok(Summary::of(&atlas, folder)), notes, shown))
    }

    /// What the user should know of an atlas, in sentences.
    fn said_of(
        &self,
        atlas: &AffineAtlas,
        component: usize,
        components: usize,
        config: &Config,
    ) -> Vec<String> {
        let given = self.given;
        let whole = |note| match components {
            1 => format!("{given} {note}"),
            _ => format!("component {component} of {given} {note}"),
        };
        warnings(atlas, config).into_iter().map(whole).collect()
    }

    /// Writes the atlas of a component, checks it and draws it; its images, which nothing else asks for, are gone then. The inner error says why it is
    /// not published.
    fn add(
        &self,
        component: usize,
        components: usize,
        atlas: &mut AffineAtlas,
        config: &Config,
    ) -> Result<Result<Option<Shown>, BuildError>, ExportError> {
        let observer = self.observer;
        let go_on = || match observer.cancelled() {
            true => Err(ExportError::Interrupted),
            false => Ok(()),
        };
        let has_folder = config.output.has_component_folders(components);
        let mut staging = self.folder(&self.staging, Staging::begin)?;
        if !has_folder {
            staging = self.folder(&self.scratch, Staging::begin_scratch)?;
        }
        let staging = &*staging;
        let withdraw = |subfolder: &str| match has_folder {
            true => staging.withdraw(subfolder).map(drop),
            false => staging.discard(subfolder),
        };
        let subfolder = Self::subfolder(component, components);
        let provenance = self.provenance(component, components);
        observer.stage("write", component, components);
        let mut surface = None;
        match export::write_component(staging, &subfolder, atlas, &provenance) {
            // The fault is in this component alone.
            Err(error @ ExportError::NotFinite { .. }) => {
                withdraw(&subfolder)?;
                return Ok(Err(error.into()));
            }
            written => {
                let written = written?;
                if components > 1 {
                    surface = Some(written.surface);
                }
            }
        }
        // They are the largest part, and are read back one by one.
        atlas.images = Vec::new();
        let atlas = &*atlas;
        go_on()?;
        observer.stage("verify", component, components);
        let check = || {
            let written = staging.path().join(&subfolder);
            let found = verify_atlas_and_measure(&written, &VerifyOptions::default(), None);
            observer.stage("pages", component, components);
            found
        };
        let is_one_of_few = has_folder && components <= config.report.max_components;
        let has_page = config.report.enabled && is_one_of_few;
        let draw = || match config.pictures.enabled && is_one_of_few {
            true => {
                let _part = part!("pictures");
                pictures::write(staging, &subfolder, atlas, config.pictures.size)
            }
            false => Ok(()),
        };
        let describe = || match has_page {
            true => {
                let _part = part!("page");
                // Where there are several, what concerns them all is on the page of all.
                let of_asset = self.notes.iter().filter(|_| components == 1).cloned();
                let own = self.said_of(atlas, component, components, config);
                let notes: Vec<String> = of_asset.chain(own).collect();
                let params = &config.report;
                report_page::write(staging, &subfolder, atlas, &provenance, params, &notes)
            }
            false => Ok(()),
        };
        // One after another where there is one thread. What is drawn of an atlas that does not pass is withdrawn with it.
        let ((verdicts, extent), (drawn, described)) =
            rayon::join(check, || rayon::join(draw, describe));
        if let Some(unverified) = Unverified::of(&verdicts) {
            withdraw(&subfolder)?;
            let precision = Precision::of(&verdicts, atlas, &self.asset.soup);
            return Ok(Err(match precision {
                Some(precision) => precision.into(),
                None => unverified.into(),
            }));
        }
        drawn?;
        described?;
        go_on()?;
        if !has_folder {
            staging.discard(&subfolder)?;
        }
        let shown = surface.zip(extent).map(|(surface, extent)| Shown {
            surface,
            padding: config.patches.padding,
            extent,
            exhibit: (config.pictures.enabled).then(|| pictures::Exhibit::of(atlas)),
            figures: Figures::of(atlas),
            has_page,
        });
        Ok(Ok(shown))
    }

    /// A folder, made where there is none.
    fn folder(
        &self,
        slot: &Mutex<Option<Arc<Staging>>>,
        begin: impl FnOnce(&Path, &str) -> Result<Staging, ExportError>,
    ) -> Result<Arc<Staging>, ExportError> {
        let mut folder = slot.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(folder) = &*folder {
            return Ok(Arc::clone(folder));
        }
        let begun = Arc::new(begin(self.output, self.id)?);
        Ok(Arc::clone(folder.insert(begun)))
    }

    /// What the asset's files say of where it comes from.
    pub fn source(&self) -> Source {
        let provenance = self.provenance(0, 1);
        Source::of(&provenance)
    }

    fn provenance(&self, component: usize, components: usize) -> Provenance<'_> {
        Provenance {
            path: self.given,
            blake3: &self.asset.blake3,
            config_blake3: &self.config_blake3,
            component,
            components,
            parts: &self.asset.soup.parts,
            appearance: &self.asset.soup.appearance,
            asset: self.id,
        }
    }

    /// The staging folder, where anything was written.
    pub fn finish(self) -> Option<Staging> {
        let staging = self.staging.into_inner();
        Arc::into_inner(staging.unwrap_or_else(PoisonError::into_inner)?)
    }
}
