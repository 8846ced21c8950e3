//! JUnit XML, as build servers read it: one test case an asset.
//!
//! *Enters:* outcomes. *Leaves:* the text of `junit.xml`. There is no standard; the elements and attributes are those that
//! Jenkins and GitLab document: `testsuite` with counts, `testcase` with `failure` (the mesh, the settings or their limits), `error` (this
//! program or the disk) or `skipped` (stopped before it was built). An asset that is cached passes, and says so in its output, where warnings stand, too.

use crate::outcome::{AssetOutcome, AssetState, FailureKind};
use std::fmt::Write;

/// The file's text.
#[must_use]
pub fn junit(outcomes: &[AssetOutcome]) -> String {
    let (mut failures, mut errors, mut skipped, mut seconds) = (0, 0, 0, 0.0);
    let mut cases = String::new();
    for outcome in outcomes {
        seconds += outcome.seconds;
        // Writing to a string cannot fail, here and below.
        let _ = write!(
            cases,
            "    <testcase classname=\"affine-atlas.build\" name=\"{}\" time=\"{:.3}\">",
            escaped(&outcome.id),
            outcome.seconds
        );
        match outcome.failures().next() {
            Some((_, first)) => {
                let element = match first.kind {
                    FailureKind::Internal | FailureKind::Output => {
                        errors += 1;
                        "error"
                    }
                    _ => {
                        failures += 1;
                        "failure"
                    }
                };
                let mut all = String::new();
                for (component, failure) in outcome.failures() {
                    if let Some(component) = component {
                        let _ = write!(all, "component {component}: ");
                    }
                    let _ = writeln!(all, "{} ({})", failure.message, failure.kind.name());
                }
                let _ = write!(
                    cases,
                    "<{element} type=\"{}\" message=\"{}\">{}</{element}>",
                    first.kind.name(),
                    escaped(&first.message),
                    escaped(all.trim_end())
                );
            }
            None if outcome.state == AssetState::Cancelled => {
                skipped += 1;
                cases.push_str("<skipped message=\"stopped\"/>");
            }
            None => {}
        }
        let warnings = outcome
            .notes
            .iter()
            .map(|note| format!("\nwarning: {note}"));
        let said = format!("{}{}", outcome.state_name(), warnings.collect::<String>());
        let _ = write!(cases, "<system-out>{}</system-out>", escaped(&said));
        cases.push_str("</testcase>\n");
    }
    let counts = format!(
        "tests=\"{}\" failures=\"{failures}\" errors=\"{errors}\" skipped=\"{skipped}\" time=\"{seconds:.3}\"",
        outcomes.len()
    );
    let plain = counts.replace(&format!(" skipped=\"{skipped}\""), "");
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites {plain}>\n  <testsuite name=\"affine-atlas\" {counts}>\n{cases}  </testsuite>\n</testsuites>\n"
    )
}

/// Text that may stand in an element or an attribute. Control characters, which XML cannot hold in any way, become U+FFFD.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' => out.push_str("&#10;"),
            '\t' => out.push_str("&#9;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::{ComponentOutcome, Failure};

    #[test]
    fn a_parser_finds_every_case_and_count() {
        let failure = |kind, message: &str| Failure {
            kind,
            message: message.into(),
        };
        let mut old = AssetOutcome::whole("old", AssetState::Cached, 0.0);
        old.notes.push("old.obj has <2> & \"more\"".into());
        let mut half = AssetOutcome::whole("half", AssetState::Built, 2.5);
        half.components.push(ComponentOutcome {
            index: 3,
            result: Err(failure(
                FailureKind::Prescription,
                "the sum is 3 & must be <4>\nadd a \"cone\"\u{1}",
            )),
        });
        let outcomes = [
            AssetOutcome::whole("good", AssetState::Built, 1.0),
            old,
            half,
            AssetOutcome::failed("disk", failure(FailureKind::Output, "full"), 0.5),
            AssetOutcome::whole("later", AssetState::Cancelled, 0.0),
        ];
        let text = junit(&outcomes);
        let document = roxmltree::Document::parse(&text).expect("XML");
        let suite = document
            .descendants()
            .find(|n| n.has_tag_name("testsuite"))
            .unwrap();
        for (name, value) in [
            ("tests", "5"),
            ("failures", "1"),
            ("errors", "1"),
            ("skipped", "1"),
            ("time", "4.000"),
        ] {
            assert_eq!(suite.attribute(name), Some(value), "{name}");
        }
        let cases: Vec<_> = suite
            .children()
            .filter(|n| n.has_tag_name("testcase"))
            .collect();
        assert_eq!(cases.len(), 5);
        let output = cases[1].first_element_child().and_then(|n| n.text());
        assert_eq!(output, Some("cached\nwarning: old.obj has <2> & \"more\""));
        assert_eq!(cases[2].attribute("name"), Some("half"));
        let found = cases[2].first_element_child().unwrap();
        assert_eq!(
            (found.tag_name().name(), found.attribute("type")),
            ("failure", Some("prescription"))
        );
        let message = found.attribute("message").unwrap();
        assert_eq!(
            message,
            "the sum is 3 & must be <4>\nadd a \"cone\"\u{fffd}"
        );
        assert!(found.text().unwrap().starts_with("component 3: the sum"));
    }
}
