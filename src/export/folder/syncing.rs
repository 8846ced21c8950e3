//! Waiting for the disk beside the work.
//!
//! The first [`ONE_BY_ONE`] files of a folder are synced one by one. Where there are more (a file of thousands of components), the file system is asked once, at the end, to
//! write everything that it holds: that takes half a second for 40,000 files, where they take five one by one. It asks for what other programs wrote, too, so few files are not synced like that.

use crate::export::{Action, ExportError};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};

/// Files that may wait, so that they stay far below the number that a process may have open.
const WAITING: usize = 64;
/// The disk takes files of several threads in one go.
const THREADS: usize = 4;
/// Files that are synced one by one.
const ONE_BY_ONE: usize = 1000;

/// A file that is written, and what messages call it.
type Written = (File, PathBuf);

/// What syncs the files of one folder while others are written.
pub(super) struct Syncing {
    folder: PathBuf,
    queue: Mutex<Option<Queue>>,
}

struct Queue {
    files: SyncSender<Written>,
    threads: Vec<JoinHandle<Result<(), ExportError>>>,
    taken: usize,
    /// Where files after the first ones lie, opened before they were written: what the disk refuses since then is told there.
    whole: Option<whole::FileSystem>,
}

impl Syncing {
    /// For files in `folder`, and in those inside it.
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            queue: Mutex::default(),
        }
    }

    /// Takes a file to be synced.
    ///
    /// # Errors
    /// Where it is synced at once, because there are no threads.
    pub fn sync(&self, file: File, shown: PathBuf) -> Result<(), ExportError> {
        let files = {
            let mut queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
            let queue = queue.get_or_insert_with(|| Queue::begin(&self.folder));
            queue.taken += 1;
            if queue.taken > ONE_BY_ONE && queue.whole.is_some() {
                return Ok(());
            }
            queue.files.clone()
        };
        match files.send((file, shown)) {
            Ok(()) => Ok(()),
            Err(unsent) => synced(&unsent.0),
        }
    }

    /// Waits until the disk has every file. Whether it has the folders, too. `shown`: what messages call the folder.
    ///
    /// # Errors
    /// The first one that it would not take.
    pub fn wait(&self, shown: &Path) -> Result<bool, ExportError> {
        let mut queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        let queue = queue.take();
        let Some(Queue {
            files,
            threads,
            taken,
            whole,
        }) = queue
        else {
            return Ok(false);
        };
        drop(files);
        // All of them, whatever the first says.
        let results: Vec<_> = threads.into_iter().map(JoinHandle::join).collect();
        let of_thread = |result: std::thread::Result<_>| {
            result.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        results.into_iter().try_for_each(of_thread)?;
        match whole {
            Some(whole) if taken > ONE_BY_ONE => whole
                .sync()
                .map(|()| true)
                .map_err(ExportError::io(Action::Write, shown)),
            _ => Ok(false),
        }
    }
}

/// The file system that holds a folder, where a program can ask for all of it to be synced.
#[cfg(any(target_os = "linux", target_os = "android"))]
mod whole {
    use std::fs::File;
    use std::io;
    use std::path::Path;

    pub(super) struct FileSystem(File);

    impl FileSystem {
        pub fn of(folder: &Path) -> Option<Self> {
            File::open(folder).ok().map(Self)
        }

        pub fn sync(&self) -> io::Result<()> {
            Ok(rustix::fs::syncfs(&self.0)?)
        }
    }
}

#[cfg(not(any(target_os = "linux", target_os = "android")))]
mod whole {
    use std::io;
    use std::path::Path;

    pub(super) enum FileSystem {}

    impl FileSystem {
        pub fn of(_: &Path) -> Option<Self> {
            None
        }

        pub fn sync(&self) -> io::Result<()> {
            match *self {}
        }
    }
}

impl Queue {
    fn begin(folder: &Path) -> Self {
        let (files, written) = sync_channel(WAITING);
        let written = Arc::new(Mutex::new(written));
        let threads = (0..THREADS).map_while(|_| {
            let written = Arc::clone(&written);
            Builder::new().spawn(move || sync_all(&written)).ok()
        });
        let threads = threads.collect();
        Self {
            files,
            threads,
            taken: 0,
            whole: whole::FileSystem::of(folder),
        }
    }
}

/// Syncs files until no more come. Those after one that failed are let go.
fn sync_all(written: &Mutex<Receiver<Written>>) -> Result<(), ExportError> {
    let mut all = Ok(());
    loop {
        let next = written
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .recv();
        match next {
            Ok(file) if all.is_ok() => all = synced(&file),
            Ok(_) => {}
            Err(_) => return all,
        }
    }
}

fn synced((file, shown): &Written) -> Result<(), ExportError> {
    let synced: io::Result<()> = file.sync_all();
    synced.map_err(ExportError::io(Action::Write, shown))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn many_files_are_synced_with_their_folders_few_one_by_one() {
        let folder = tempfile::tempdir().unwrap();
        let has_whole = cfg!(any(target_os = "linux", target_os = "android"));
        for (count, with_folders) in [(0, false), (3, false), (ONE_BY_ONE + 3, has_whole)] {
            let syncing = Syncing::new(folder.path());
            for i in 0..count {
                let path = folder.path().join(i.to_string());
                fs::write(&path, "x").unwrap();
                syncing.sync(File::open(&path).unwrap(), path).unwrap();
            }
            assert_eq!(syncing.wait(folder.path()).unwrap(), with_folders);
            // A queue may be begun again.
            assert!(!syncing.wait(folder.path()).unwrap());
        }
    }
}
