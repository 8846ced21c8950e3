//! Ctrl-C: the first asks the job to stop, the second (or patience at its end) stops at once.
//! Either way no staging folder stays behind.

use super::exit;
use super::terminal;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time that everything gets to end by itself after the first Ctrl-C: workers have four seconds of it, and what they leave may be thousands of files to be removed.
const PATIENCE: Duration = Duration::from_secs(20);

/// Who stops a program may signal it and its group, as `timeout` does: two requests that are no farther apart are one.
const TOGETHER: Duration = Duration::from_millis(300);

static FIRST: OnceLock<Instant> = OnceLock::new();
static REQUESTED: AtomicBool = AtomicBool::new(false);
static FINISHED: AtomicBool = AtomicBool::new(false);

/// Installs the handler for Ctrl-C and termination; `remove_staging` removes what is half written,
/// `announce` says on standard error what happens.
pub fn install(remove_staging: fn(), announce: bool) {
    let installed = ctrlc::set_handler(move || {
        let now = Instant::now();
        let first = *FIRST.get_or_init(|| now);
        if first != now {
            if now - first > TOGETHER {
                stop(remove_staging);
            }
            return;
        }
        REQUESTED.store(true, Ordering::SeqCst);
        if announce {
            terminal::print_error("stopping; press Ctrl-C again to stop at once\n");
        }
        std::thread::spawn(move || {
            std::thread::sleep(PATIENCE);
            if !FINISHED.load(Ordering::SeqCst) {
                stop(remove_staging);
            }
        });
    });
    if let Err(error) = installed {
        tracing::warn!("Ctrl-C may leave a hidden temporary folder behind: {error}");
    }
}

fn stop(remove_staging: fn()) -> ! {
    remove_staging();
    std::process::exit(i32::from(exit::INTERRUPTED))
}

/// Whether Ctrl-C was pressed.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}

/// The command ends by itself; nothing needs to be stopped any more.
pub fn finish() {
    FINISHED.store(true, Ordering::SeqCst);
}
