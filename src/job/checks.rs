//! Failed checks of an atlas, in words.

use crate::verify::{Check, Verdicts};

/// The checks that failed.
pub(super) fn failed_of(verdicts: &Verdicts) -> Vec<Check> {
    let failed = verdicts.checks.iter().filter(|check| !check.passed);
    failed.cloned().collect()
}

/// The first failed checks with their figures.
pub(super) fn listed(failed: &[Check]) -> String {
    let shown = failed.iter().take(LISTED_CHECKS);
    let mut words: Vec<String> = shown.map(|c| format!("{}: {}", c.name, c.figure)).collect();
    if failed.len() > LISTED_CHECKS {
        words.push(format!("{} more", failed.len() - LISTED_CHECKS));
    }
    words.join("; ")
}

/// Failed checks that a message quotes.
const LISTED_CHECKS: usize = 4;
