//! Waiting for the disk beside the work.

use crate::export::{Action, ExportError};
use std::fs::File;
use std::io;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};

/// Files that may wait, so that they stay far below the number that a process may have open.
const WAITING: usize = 64;
/// The disk takes files of several threads in one go.
const THREADS: usize = 4;

/// A file that is written, and what messages call it.
type Written = (File, PathBuf);

/// Threads that sync files while others are written; none before the first file.
#[derive(Default)]
pub(super) struct Syncing(Mutex<Option<Queue>>);

struct Queue {
    files: SyncSender<Written>,
    threads: Vec<JoinHandle<Result<(), ExportError>>>,
}

impl Syncing {
    /// Takes a file to be synced.
    ///
    /// # Errors
    /// Where it is synced at once, because there are no threads.
    pub fn sync(&self, file: File, shown: PathBuf) -> Result<(), ExportError> {
        let files = {
            let mut queue = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let queue = queue.get_or_insert_with(Queue::begin);
            queue.files.clone()
        };
        match files.send((file, shown)) {
            Ok(()) => Ok(()),
            Err(unsent) => synced(&unsent.0),
        }
    }

    /// Waits until the disk has every file.
    ///
    /// # Errors
    /// The first one that it would not take.
    pub fn wait(&self) -> Result<(), ExportError> {
        let queue = self.0.lock().unwrap_or_else(PoisonError::into_inner).take();
        let Some(Queue { files, threads }) = queue else {
            return Ok(());
        };
        drop(files);
        // All of them, whatever the first says.
        let results: Vec<_> = threads.into_iter().map(JoinHandle::join).collect();
        let of_thread = |result: std::thread::Result<_>| {
            result.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        };
        results.into_iter().try_for_each(of_thread)
    }
}

impl Queue {
    fn begin() -> Self {
        let (files, written) = sync_channel(WAITING);
        let written = Arc::new(Mutex::new(written));
        let threads = (0..THREADS).map_while(|_| {
            let written = Arc::clone(&written);
            Builder::new().spawn(move || sync_all(&written)).ok()
        });
        let threads = threads.collect();
        Self { files, threads }
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
