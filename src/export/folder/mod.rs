//! Folders that appear complete or not at all.
//!
//! Files are written into a hidden staging folder beside the target, synced to disk, and the two
//! folders are exchanged in one step. Whatever goes wrong before leaves the older folder untouched.
//!
//! A staging folder's name carries the machine and the process that made it. It disappears when
//! the value is dropped, when [`remove_all_staging`] is called on Ctrl-C, and, after a crash, when
//! a later run on the same machine finds that its process is gone.
//! *Not guaranteed:* that two runs which write the same asset at the same time see each other; the
//! later one wins, whole.

mod syncing;
mod unfinished;

pub use crate::export::names::component_name;
pub(crate) use crate::export::names::{COMPONENTS, RESERVED, is_asset_name};

use crate::export::names::asset_name;
use crate::export::{Action, ExportError};
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};
use syncing::Syncing;
use unfinished::{process_is_gone, remove_folder, replace, staging_name, sweep, unfinished_name};

/// Bytes at the start of a `components.json` that say whose it is.
const START: u64 = 256;

/// Removes the staging folders of this process and refuses every further write, for the handler of
/// Ctrl-C. A folder that is just being put in place is waited for: it is finished and stays.
pub fn remove_all_staging() {
    REGISTRY.close();
}

/// Finishes what dead runs of this machine left in an output folder: their staging folders are removed, and a
/// folder that was set aside and not replaced goes back in place. Done once for each folder by [`Staging::begin`].
pub fn sweep_stale(output_root: &Path) -> Result<(), ExportError> {
    sweep(output_root, &process_is_gone).map_err(ExportError::io(Action::Read, output_root))
}

/// Tells that [`sweep_stale`] was done in an output folder lately, so that [`Staging::begin`] leaves it out: a batch
/// does it once for all its processes.
pub fn mark_swept(output_root: &Path) {
    REGISTRY.lock().swept.insert(output_root.to_owned());
}

/// All live staging folders of a process.
struct Registry {
    state: Mutex<RegistryState>,
}

#[derive(Default)]
struct RegistryState {
    live: BTreeSet<PathBuf>,
    swept: BTreeSet<PathBuf>,
    closed: bool,
}

static REGISTRY: LazyLock<Registry> = LazyLock::new(Registry::new);

impl Registry {
    fn new() -> Self {
        Self {
            state: Mutex::default(),
        }
    }

    /// The state; a panic elsewhere leaves it valid, because every change is one call.
    fn lock(&self) -> MutexGuard<'_, RegistryState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lock_open(&self) -> Result<MutexGuard<'_, RegistryState>, ExportError> {
        let state = self.lock();
        if state.closed {
            return Err(ExportError::Interrupted);
        }
        Ok(state)
    }

    fn close(&self) {
        let mut state = self.lock();
        state.closed = true;
        for path in std::mem::take(&mut state.live) {
            remove_folder(&path);
        }
    }
}

/// What a folder holds, so that one of another kind is never replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contents {
    /// An atlas, or a folder a component.
    Atlas,
    /// A survey of cones.
    Cones,
    /// Spline surfaces.
    Fit,
    /// Textures.
    Texture,
}

impl Contents {
    /// Whether an entry of this name is found in complete folders of this kind only.
    fn has(self, name: &OsStr) -> bool {
        match self {
            Contents::Atlas => {
                name == "atlas.json"
                    || name == COMPONENTS
                    || name.to_string_lossy().starts_with("component-")
            }
            Contents::Cones => name == "cones.json",
            Contents::Fit => name == "fit.json",
            Contents::Texture => name == "texture.json",
        }
    }
}

/// A folder that is being written; see the module docs.
pub struct Staging {
    contents: Contents,
    registry: &'static Registry,
    output_root: PathBuf,
    target: PathBuf,
    path: PathBuf,
    /// Absent where nothing is to stay.
    syncing: Option<Syncing>,
}

impl Staging {
    /// Makes the staging folder of `output_root/asset`, and `output_root` where it is missing.
    /// Refuses a name that is no folder name and a target that this program did not write.
    pub fn begin(output_root: &Path, asset: &str) -> Result<Staging, ExportError> {
        Self::begin_with(Contents::Atlas, output_root, asset)
    }

    /// The same for other contents.
    pub fn begin_with(
        contents: Contents,
        output_root: &Path,
        name: &str,
    ) -> Result<Staging, ExportError> {
        Self::begin_in(&REGISTRY, contents, output_root, name)
    }

    /// A folder for files that are read back and never put in place: they are not synced to disk.
    pub fn begin_scratch(output_root: &Path, asset: &str) -> Result<Staging, ExportError> {
        let mut staging = Self::begin(output_root, asset)?;
        staging.syncing = None;
        Ok(staging)
    }

    fn begin_in(
        registry: &'static Registry,
        contents: Contents,
        output_root: &Path,
        asset: &str,
    ) -> Result<Staging, ExportError> {
        let target = output_root.join(asset_name(asset)?);
        fs::create_dir_all(output_root)
            .map_err(ExportError::io(Action::CreateFolder, output_root))?;
        let mut state = registry.lock_open()?;
        if state.swept.insert(output_root.to_owned())
            && let Err(error) = sweep_stale(output_root)
        {
            // What others left must not keep this run from writing.
            tracing::warn!(%error, "could not clear up after earlier runs");
        }
        check_target(contents, &target)?;
        let path = output_root.join(staging_name());
        fs::create_dir(&path).map_err(ExportError::io(Action::CreateFolder, &path))?;
        state.live.insert(path.clone());
        drop(state);
        Ok(Staging {
            contents,
            registry,
            output_root: output_root.to_owned(),
            target,
            syncing: Some(Syncing::new(&path)),
            path,
        })
    }

    /// The staging folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Where it will be put.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Opens a new file; folders on the way (`images/`) are made. `relative` uses forward slashes.
    pub fn create(&self, relative: &str) -> Result<StagedFile<'_>, ExportError> {
        let path = self.inside(relative)?;
        // Under the lock, so that nothing is made again after Ctrl-C removed everything.
        let _state = self.registry.lock_open()?;
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(ExportError::io(Action::CreateFolder, folder))?;
        }
        let file = File::create(&path).map_err(ExportError::io(Action::Write, &path))?;
        Ok(StagedFile {
            shown: self.target.join(relative),
            file: BufWriter::new(file),
            syncing: self.syncing.as_ref(),
        })
    }

    /// Writes a whole file.
    pub fn write(&self, relative: &str, bytes: &[u8]) -> Result<(), ExportError> {
        let mut file = self.create(relative)?;
        file.write_all(bytes)
            .map_err(ExportError::io(Action::Write, file.path()))?;
        file.finish()
    }

    /// Keeps a subfolder of the older output, such as that of a component that failed this time. Gives
    /// false where the older output has none that is complete (no `atlas.json` in it).
    pub fn keep_previous(&self, subfolder: &str) -> Result<bool, ExportError> {
        let to = self.inside(subfolder)?;
        let from = self.target.join(subfolder);
        if !from.join("atlas.json").is_file() {
            return Ok(false);
        }
        for name in list_files(&from)? {
            let source = from.join(&name);
            let bytes = fs::read(&source).map_err(ExportError::io(Action::Read, &source))?;
            self.write(&format!("{subfolder}/{name}"), &bytes)?;
        }
        debug_assert!(to.is_dir());
        Ok(true)
    }

    /// Takes back what was written of a component, and keeps what the older output has of it, as [`Staging::keep_previous`] does. Where
    /// the component is the whole asset (no subfolder), there is nothing left to publish.
    pub fn withdraw(&self, subfolder: &str) -> Result<bool, ExportError> {
        if subfolder.is_empty() {
            let emptied = fs::remove_dir_all(&self.path).and_then(|()| fs::create_dir(&self.path));
            emptied.map_err(ExportError::io(Action::Write, &self.path))?;
            return Ok(false);
        }
        self.discard(subfolder)?;
        self.keep_previous(subfolder)
    }

    /// Takes back what was written into a subfolder.
    pub fn discard(&self, subfolder: &str) -> Result<(), ExportError> {
        let path = self.inside(subfolder)?;
        match path.exists() {
            true => fs::remove_dir_all(&path).map_err(ExportError::io(Action::Write, &path)),
            false => Ok(()),
        }
    }

    /// Puts the folder in place. On an error the older folder is where it was.
    pub fn publish(self) -> Result<(), ExportError> {
        let syncing = self.syncing.as_ref();
        if !syncing.map_or(Ok(false), |syncing| syncing.wait(&self.target))? {
            sync_folders(&self.path).map_err(ExportError::io(Action::Publish, &self.target))?;
        }
        {
            let _state = self.registry.lock_open()?;
            check_target(self.contents, &self.target)?;
            replace(&self.path, &self.target)
                .map_err(ExportError::io(Action::Publish, &self.target))?;
        }
        // The exchange is done: a folder that cannot be synced is still complete.
        if let Err(error) = sync_folder(&self.output_root) {
            tracing::warn!(path = %self.output_root.display(), %error, "could not sync the output folder");
        }
        // Dropping removes what is now at the staging path: the older folder, or nothing.
        Ok(())
    }

    fn inside(&self, relative: &str) -> Result<PathBuf, ExportError> {
        let normal = |c| matches!(c, Component::Normal(_));
        if relative.is_empty() || !Path::new(relative).components().all(normal) {
            return Err(ExportError::Encode {
                path: self.target.join(relative),
                message: "the path leaves the asset's folder".into(),
            });
        }
        Ok(self.path.join(relative))
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        remove_folder(&self.path);
        self.registry.lock().live.remove(&self.path);
    }
}

/// A file in a staging folder. Call [`StagedFile::finish`]: dropping it may lose an error.
pub struct StagedFile<'a> {
    shown: PathBuf,
    file: BufWriter<File>,
    syncing: Option<&'a Syncing>,
}

impl StagedFile<'_> {
    /// Where the file will be once its folder is in place; what error messages name.
    pub fn path(&self) -> &Path {
        &self.shown
    }

    /// Writes what is buffered. [`Staging::publish`] waits until the disk has it.
    pub fn finish(self) -> Result<(), ExportError> {
        let Self {
            shown,
            file,
            syncing,
        } = self;
        match file.into_inner() {
            Ok(file) => syncing.map_or(Ok(()), |syncing| syncing.sync(file, shown)),
            Err(error) => Err(ExportError::io(Action::Write, &shown)(error.into_error())),
        }
    }
}

impl Write for StagedFile<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }
    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl Seek for StagedFile<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

/// A name that no other process of any machine gives to a file, while this one runs.
pub(crate) fn unique_name() -> String {
    unfinished_name("", "")
        .trim_start_matches(unfinished::PREFIX)
        .trim_matches('-')
        .to_owned()
}

/// Whether a process of this machine is known to have ended.
pub(crate) fn process_has_ended(process: u32) -> bool {
    process_is_gone(process)
}

/// Replaces a file in one step: a reader sees the old text or the new one. Used for the manifest.
pub(crate) fn write_file_atomically(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    stream_file_atomically(path, |out| out.write_all(bytes))
}

/// The same for what is written bit by bit.
pub(crate) fn stream_file_atomically(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), ExportError> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    fs::create_dir_all(folder).map_err(ExportError::io(Action::CreateFolder, folder))?;
    let temporary = folder.join(staging_name());
    let written = (|| {
        let mut file = BufWriter::new(File::create(&temporary)?);
        write(&mut file)?;
        file.flush()?;
        file.get_ref().sync_all()?;
        fs::rename(&temporary, path)?;
        sync_folder(folder)
    })();
    if written.is_err() {
        let _ = fs::remove_file(&temporary);
    }
    written.map_err(ExportError::io(Action::Write, path))
}

/// The same without waiting for the disk, for files that say themselves whether they are whole: after a loss of power this one may be
/// empty or cut.
pub(crate) fn write_unsynced(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    fs::create_dir_all(folder).map_err(ExportError::io(Action::CreateFolder, folder))?;
    let temporary = folder.join(staging_name());
    let written = fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        let _ = fs::remove_file(&temporary);
    }
    written.map_err(ExportError::io(Action::Write, path))
}

/// All regular files under a folder, relative with forward slashes, in ascending order.
pub fn list_files(folder: &Path) -> Result<Vec<String>, ExportError> {
    let mut files = Vec::new();
    let mut pending = vec![(folder.to_owned(), String::new())];
    while let Some((path, prefix)) = pending.pop() {
        let read = ExportError::io(Action::Read, &path);
        let entries = fs::read_dir(&path).and_then(|e| e.collect::<io::Result<Vec<_>>>());
        for entry in entries.map_err(read)? {
            let kind = entry
                .file_type()
                .map_err(ExportError::io(Action::Read, &entry.path()))?;
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            if kind.is_dir() {
                pending.push((entry.path(), format!("{name}/")));
            } else if kind.is_file() {
                files.push(name);
            }
        }
    }
    files.sort();
    Ok(files)
}

/// Replacing deletes what was there, so it must be nothing, an empty folder, or an earlier one of the same kind.
fn check_target(contents: Contents, target: &Path) -> Result<(), ExportError> {
    let kind = match fs::symlink_metadata(target) {
        Ok(metadata) => metadata.file_type(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(ExportError::io(Action::Publish, target)(error)),
    };
    if !kind.is_dir() {
        return Err(ExportError::NotAFolder {
            path: target.into(),
        });
    }
    let entries = fs::read_dir(target).and_then(|e| e.collect::<io::Result<Vec<_>>>());
    let names = entries.map_err(ExportError::io(Action::Read, target))?;
    // Other programs have files of that name.
    let is_ours =
        |e: &fs::DirEntry| e.file_name() != COMPONENTS || is_list_of_components(&e.path());
    let has = |e: &fs::DirEntry| contents.has(&e.file_name()) && is_ours(e);
    if names.is_empty() || names.iter().any(has) {
        return Ok(());
    }
    Err(ExportError::ForeignFolder {
        path: target.into(),
    })
}

/// Whether a file is a `components.json` of this program.
fn is_list_of_components(path: &Path) -> bool {
    let mut start = Vec::new();
    let read = File::open(path).and_then(|file| file.take(START).read_to_end(&mut start));
    read.is_ok() && String::from_utf8_lossy(&start).contains("\"format\": \"affine-atlas\"")
}

/// Waits until the disk has the entries of a folder and of all folders in it.
fn sync_folders(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            sync_folders(&entry.path())?;
        }
    }
    sync_folder(folder)
}

#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    match File::open(folder)?.sync_all() {
        // Some network file systems cannot sync folders; their renames are safe by themselves.
        Err(error) if error.kind() == io::ErrorKind::InvalidInput => Ok(()),
        other => other,
    }
}

#[cfg(not(unix))]
fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests;
