//! libFuzzer around one of [`targets::TARGETS`], which the environment variable `TARGET` names.

#![no_main]

mod targets;

use libfuzzer_sys::fuzz_target;
use std::sync::OnceLock;

static RUN: OnceLock<fn(&[u8])> = OnceLock::new();

fn chosen() -> fn(&[u8]) {
    let name = std::env::var("TARGET").unwrap_or_default();
    match targets::TARGETS.iter().find(|(known, _)| *known == name) {
        Some((_, run)) => *run,
        None => {
            let names: Vec<&str> = targets::TARGETS.iter().map(|(name, _)| *name).collect();
            eprintln!("set TARGET to one of: {}", names.join(" "));
            std::process::exit(2);
        }
    }
}

fuzz_target!(
    init: {
        // Panics of decoders that are not ours are caught by the readers; one that gets out still ends the process.
        std::panic::set_hook(Box::new(|info| {
            if std::env::var_os("SHOW_PANICS").is_some() {
                eprintln!("{info}");
            }
        }));
        // On this thread alone: counters of coverage are not shared, and no time goes to waking others.
        let one = rayon::ThreadPoolBuilder::new().num_threads(1);
        one.use_current_thread().build_global().expect("the first pool");
        RUN.get_or_init(chosen);
    },
    |bytes: &[u8]| RUN.get_or_init(chosen)(bytes)
);
