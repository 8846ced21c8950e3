//! The folder of an asset, filled component by component.
//!
//! *Enters:* one atlas after the other. *Leaves:* a folder that replaces the older one in one step. What does not pass the checks of
//! [`verify`](crate::verify) is not published; an older one stays in its place.

use super::error::{BuildError, Unverified};
use super::precision::Precision;
use crate::config::Config;
use crate::export::atlas_json::FORMAT_VERSION;
use crate::export::folder::{Staging, component_name};
use crate::export::glb::whole::Whole;
use crate::export::{self, ExportError, Provenance, pictures, report as report_page};
use crate::observe::{Observer, part};
use crate::product::AffineAtlas;
use crate::read::SourceAsset;
use crate::verify::{Extent, VerifyOptions, verify_atlas_and_measure, verify_whole};
use std::collections::BTreeMap;
use std::path::Path;

/// What all components of an asset are written with.
pub(super) struct Publication<'a> {
    asset: &'a SourceAsset,
    given: &'a str,
    output: &'a Path,
    id: &'a str,
    config_blake3: String,
    observer: &'a dyn Observer,
    /// Made for the first atlas: where there is none, nothing is touched.
    staging: Option<Staging>,
    /// Whether any atlas passed.
    new: bool,
    /// Subfolders of components that have no atlas.
    missing: Vec<String>,
    /// All that passed, where there are several, …
    whole: Whole,
    /// … and what a file of them is compared with.
    extents: BTreeMap<usize, Extent>,
}

impl<'a> Publication<'a> {
    /// A folder `output/id` that nothing has been written for. `given` is the path as the user wrote it.
    pub fn new(
        asset: &'a SourceAsset,
        given: &'a str,
        output: &'a Path,
        id: &'a str,
        config: &Config,
        observer: &'a dyn Observer,
    ) -> Self {
        Self {
            asset,
            given,
            output,
            id,
            config_blake3: config.hash(),
            observer,
            staging: None,
            new: false,
            missing: Vec::new(),
            whole: Whole::default(),
            extents: BTreeMap::new(),
        }
    }

    /// Name of a component's folder inside that of the asset; empty where it is the whole asset.
    pub fn subfolder(component: usize, components: usize) -> String {
        match components {
            1 => String::new(),
            _ => component_name(component),
        }
    }

    /// Notes that a component has no atlas: an older one of it stays.
    pub fn leave_out(&mut self, component: usize, components: usize) {
        self.missing.push(Self::subfolder(component, components));
    }

    /// Writes the atlas of a component, checks it and draws it; its images, which nothing else asks for, are gone then. The inner error says why it is
    /// not published.
    pub fn add(
        &mut self,
        component: usize,
        components: usize,
        atlas: &mut AffineAtlas,
        config: &Config,
    ) -> Result<Result<(), BuildError>, ExportError> {
        let observer = self.observer;
        let go_on = || match observer.cancelled() {
            true => Err(ExportError::Interrupted),
            false => Ok(()),
        };
        let staging = match &mut self.staging {
            Some(staging) => &*staging,
            none => &*none.insert(Staging::begin(self.output, self.id)?),
        };
        let subfolder = Self::subfolder(component, components);
        let provenance = Provenance {
            path: self.given,
            blake3: &self.asset.blake3,
            config_blake3: &self.config_blake3,
            component,
            components,
            parts: &self.asset.soup.parts,
            appearance: &self.asset.soup.appearance,
            asset: self.id,
        };
        observer.stage("write", component, components);
        let mut surface = None;
        match export::write_component(staging, &subfolder, atlas, &provenance) {
            // The fault is in this component alone.
            Err(error @ ExportError::NotFinite { .. }) => {
                staging.withdraw(&subfolder)?;
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
        let written = staging.path().join(&subfolder);
        let (verdicts, extent) =
            verify_atlas_and_measure(&written, &VerifyOptions::default(), None);
        if let Some(unverified) = Unverified::of(&verdicts) {
            staging.withdraw(&subfolder)?;
            let precision = Precision::of(&verdicts, atlas, &self.asset.soup);
            return Ok(Err(match precision {
                Some(precision) => precision.into(),
                None => unverified.into(),
            }));
        }
        self.new = true;
        if let (Some(surface), Some(extent)) = (surface, extent) {
            self.whole.add(component, surface, config.patches.padding);
            self.extents.insert(component, extent);
        }
        go_on()?;
        observer.stage("pages", component, components);
        let draw = || match config.pictures.enabled {
            true => {
                let _part = part!("pictures");
                pictures::write(staging, &subfolder, atlas, config.pictures.size)
            }
            false => Ok(()),
        };
        let describe = || match config.report.enabled {
            true => {
                let _part = part!("page");
                report_page::write(staging, &subfolder, atlas, &provenance, &config.report)
            }
            false => Ok(()),
        };
        let (drawn, described) = rayon::join(draw, describe);
        drawn?;
        described?;
        go_on()?;
        Ok(Ok(()))
    }

    /// Writes what all components have in common, and puts the folder in place, where any atlas passed.
    pub fn finish(self) -> Result<(), BuildError> {
        let Some(staging) = self.staging.filter(|_| self.new) else {
            return Ok(());
        };
        for subfolder in &self.missing {
            staging.keep_previous(subfolder)?;
        }
        if !self.whole.is_empty() {
            let appearance = &self.asset.soup.appearance;
            let bytes = self.whole.encode(self.id, FORMAT_VERSION, appearance)?;
            drop(self.whole);
            if let Some(bytes) = bytes {
                staging.write("surface.glb", &bytes)?;
                drop(bytes);
                let verdicts = verify_whole(staging.path(), &self.extents);
                if let Some(unverified) = Unverified::of(&verdicts) {
                    return Err(unverified.into());
                }
            }
        }
        Ok(staging.publish()?)
    }
}
