//! Panics are bugs of this program: they are caught and worded, and other assets go on.

use std::panic::{AssertUnwindSafe, PanicHookInfo};
use std::sync::{Mutex, PoisonError};

static LAST: Mutex<Option<String>> = Mutex::new(None);

/// Keeps panics off the terminal; [`catch`] words them.
pub fn keep_quiet() {
    std::panic::set_hook(Box::new(|info| {
        *LAST.lock().unwrap_or_else(PoisonError::into_inner) = Some(describe(info));
    }));
}

fn describe(info: &PanicHookInfo<'_>) -> String {
    let payload = info.payload();
    let text = payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no message");
    match info.location() {
        Some(at) => format!("{text} ({}:{})", at.file(), at.line()),
        None => text.to_owned(),
    }
}

/// Runs `work`; a panic becomes a sentence for a bug report.
///
/// Nothing that `work` could leave half changed is used afterwards: it owns its data, and staging
/// folders clean up while unwinding.
pub fn catch<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    std::panic::catch_unwind(AssertUnwindSafe(work)).map_err(|_| {
        let what = LAST
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take()
            .unwrap_or_else(|| "no message".to_owned());
        format!(
            "internal error: {what}; this is a mistake of affine-atlas and not of your mesh: \
             please report it with the mesh and the configuration"
        )
    })
}
