//! Ctrl-C: the first asks the job to stop, the second (or patience at its end) stops at once.
//! Either way no staging folder stays behind.

use super::exit;
use super::terminal;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Duration;

/// Time that a running stage gets to notice the first Ctrl-C.
const PATIENCE: Duration = Duration::from_secs(5);

static REQUESTS: AtomicU32 = AtomicU32::new(0);
static FINISHED: AtomicBool = AtomicBool::new(false);

/// Installs the handler for Ctrl-C and termination; `remove_staging` removes what is half written,
/// `announce` says on standard error what happens.
pub fn install(remove_staging: fn(), announce: bool) {
    let installed = ctrlc::set_handler(move || {
        if REQUESTS.fetch_add(1, Ordering::SeqCst) > 0 {
            stop(remove_staging);
        }
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
    REQUESTS.load(Ordering::SeqCst) > 0
}

/// The command ends by itself; nothing needs to be stopped any more.
pub fn finish() {
    FINISHED.store(true, Ordering::SeqCst);
}
