use super::*;
use crate::export::manifest::{Record, State};
use crate::outcome::FailureKind;
use std::fs;

fn record(id: &str, state: State) -> Record {
    let failed = state == State::Failed;
    Record {
        id: id.into(),
        input_hash: Some("00".into()),
        config_hash: "ff".into(),
        state,
        kind: failed.then_some(FailureKind::Prescription),
        error: failed.then(|| "the total is <b>4</b>, 2 & more".into()),
        warnings: Vec::new(),
        warning_count: 0,
        checked: 1_795_996_800,
        seconds: 1.5,
        host: None,
        kept: false,
        peak_memory: Some(3 << 20),
        files: match failed {
            true => Vec::new(),
            false => vec![format!("{id}/atlas.json"), format!("{id}/report.html")],
        },
        components: Vec::new(),
    }
}

/// An output root whose assets have these states and area distortions.
fn night(root: &Path, assets: &[(&str, State, f64)]) -> (Manifest, String) {
    let mut manifest = Manifest::default();
    for &(id, state, distortion) in assets {
        manifest.insert(record(id, state));
        let folder = root.join(id);
        fs::create_dir_all(&folder).unwrap();
        let document = serde_json::json!({
            "topology": {"faces": 20, "genus": 1, "boundary_loops": 0, "vertices": 1},
            "cones": [{}, {}],
            "patches": [{}],
            "quality": {
                "area_distortion": distortion,
                "log_scale": {"std": 0.25, "min": -1.0},
                "angle_error": {"mean": 0.125},
            },
        });
        fs::write(folder.join("atlas.json"), document.to_string()).unwrap();
    }
    write(root, &manifest).unwrap();
    let text = fs::read_to_string(root.join(FILE_NAME)).unwrap();
    (manifest, text)
}

/// The text of a group of changes.
fn group<'a>(text: &'a str, title: &str) -> Option<&'a str> {
    let start = text.find(&format!("</b> {title}"))?;
    let end = text[start..].find("</details>")?;
    Some(&text[start..start + end])
}

#[test]
fn changes_are_told_from_the_run_before() {
    use State::{Built, Cached, Failed};
    let root = tempfile::tempdir().unwrap();
    let (_, first) = night(
        root.path(),
        &[
            ("breaks", Built, 0.1),
            ("broken", Failed, 0.0),
            ("gone", Built, 0.1),
            ("mended", Failed, 0.0),
            ("same", Built, 0.1),
            ("worse", Built, 0.1),
        ],
    );
    assert!(first.contains("There was none."));
    let (_, second) = night(
        root.path(),
        &[
            ("breaks", Failed, 0.1),
            ("broken", Failed, 0.0),
            ("fresh", Built, 0.1),
            ("freshly-broken", Failed, 0.1),
            ("mended", Built, 0.1),
            ("same", Cached, 0.1),
            ("worse", Built, 0.5),
        ],
    );
    let of = |title: &str| group(&second, title).unwrap_or_else(|| panic!("no {title}"));
    let failures = of("New failures");
    assert!(failures.contains("breaks") && failures.contains("freshly-broken"));
    assert_eq!(failures.matches("<li>").count(), 2);
    assert!(failures.contains("the total is &lt;b&gt;4&lt;/b&gt;, 2 &amp; more"));
    assert!(of("Fixed").contains("mended"));
    assert!(of("Worse").contains("0.100 → 0.500"));
    assert!(of("New</summary>").contains(">fresh<"));
    assert!(of("Not in this run").contains("gone"));
    // New failures stand first.
    let place = |title: &str| second.find(&format!("</b> {title}")).unwrap();
    assert!(place("New failures") < place("Fixed") && place("Fixed") < place("Worse"));
    // Nothing changes in a run that changes nothing.
    let (_, third) = night(
        root.path(),
        &[
            ("breaks", Failed, 0.1),
            ("broken", Failed, 0.0),
            ("fresh", Cached, 0.1),
            ("freshly-broken", Failed, 0.1),
            ("mended", Cached, 0.1),
            ("same", Cached, 0.1),
            ("worse", Cached, 0.5),
        ],
    );
    assert!(third.contains("<p>None.</p>"), "{third}");
}

#[test]
fn durations_are_read_at_a_glance() {
    for (seconds, words) in [
        (0.04, "0.04 s"),
        (59.4, "59.4 s"),
        (61.0, "1 min 1 s"),
        (7_260.0, "2 h 1 min"),
        (f64::NAN, "NaN s"),
    ] {
        assert_eq!(page::duration(seconds), words);
    }
}

#[test]
fn figures_are_read_at_a_glance() {
    use page::{angle, count, memory, three_digits};
    for (x, words) in [
        (0.0, "0"),
        (0.576_1, "0.576"),
        (12.34, "12.3"),
        (1234.0, "1234"),
        (2.5e-7, "2.50e-7"),
        (f64::INFINITY, "inf"),
    ] {
        assert_eq!(three_digits(x), words);
    }
    for (x, words) in [
        (7.0, "7"),
        (63_396.0, "63\u{202f}396"),
        (1e6, "1\u{202f}000\u{202f}000"),
    ] {
        assert_eq!(count(x), words);
    }
    for (x, words) in [(9e4, "90 kB"), (253e6, "253 MB"), (1.43e9, "1.4 GB")] {
        assert_eq!(memory(x), words);
    }
    assert_eq!(angle(0.04665), "2.67°");
}

#[test]
fn assets_of_other_runs_are_left_out_and_not_forgotten() {
    use State::Built;
    let root = tempfile::tempdir().unwrap();
    let both = [("one", Built, 0.1), ("other", Built, 0.1)];
    night(root.path(), &both);
    let (_, second) = night(root.path(), &both[..1]);
    assert_eq!(second.matches("<tr data-state").count(), 1);
    assert!(group(&second, "Not in this run").unwrap().contains("other"));
    // It is not missed a second time, and no new one when it comes back.
    let (_, third) = night(root.path(), &both[..1]);
    assert!(third.contains("<p>None.</p>"), "{third}");
    let (_, fourth) = night(root.path(), &[both[0], ("other", Built, 0.5)]);
    assert_eq!(group(&fourth, "New</summary>"), None);
    assert!(group(&fourth, "Worse").unwrap().contains("0.100 → 0.500"));
}

#[test]
fn what_was_built_is_shown_where_pictures_were_drawn() {
    let root = tempfile::tempdir().unwrap();
    let mut manifest = Manifest::default();
    let pictured = |id: &str, state, files: &[&str]| {
        let mut record = record(id, state);
        record.files = files.iter().map(|file| format!("{id}/{file}")).collect();
        record
    };
    let two = ["component-000/preview.png", "component-001/preview.png"];
    manifest.insert(pictured("a b", State::Built, &two));
    manifest.insert(pictured("plain", State::Cached, &["atlas.json"]));
    manifest.insert(pictured("kept", State::Failed, &["preview.png"]));
    manifest.insert(pictured("out", State::Built, &["../preview.png"]));
    write(root.path(), &manifest).unwrap();
    let text = fs::read_to_string(root.path().join(FILE_NAME)).unwrap();
    assert_eq!(text.matches("<img").count(), 1, "{text}");
    assert!(text.contains("<img src=\"./a%20b/component-000/preview.png\""));
    assert!(text.contains("loading=\"lazy\""));
    // The asset's own picture and page come before those of its components.
    let whole = ["component-000/report.html", "component-000/preview.png"];
    let whole = [whole, ["preview.png", "report.html"]].concat();
    manifest.insert(pictured("a b", State::Built, &whole));
    write(root.path(), &manifest).unwrap();
    let text = fs::read_to_string(root.path().join(FILE_NAME)).unwrap();
    assert!(text.contains("<img src=\"./a%20b/preview.png\""));
    assert!(text.contains("<a href=\"./a%20b/report.html\">report</a>"));
    assert!(!text.contains("component-000"), "{text}");
}

#[test]
fn cached_assets_are_not_read_again() {
    let root = tempfile::tempdir().unwrap();
    night(root.path(), &[("spot", State::Built, 0.125)]);
    fs::remove_file(root.path().join("spot/atlas.json")).unwrap();
    let mut manifest = Manifest::default();
    manifest.insert(record("spot", State::Cached));
    write(root.path(), &manifest).unwrap();
    let text = fs::read_to_string(root.path().join(FILE_NAME)).unwrap();
    assert!(text.contains("data-value=\"0.125\""));
    // With another input the figures are another's.
    let mut other = record("spot", State::Cached);
    other.input_hash = Some("11".into());
    manifest.insert(other);
    write(root.path(), &manifest).unwrap();
    let text = fs::read_to_string(root.path().join(FILE_NAME)).unwrap();
    assert!(!text.contains("data-value=\"0.125\""));
}

#[test]
fn hostile_names_and_messages_stay_text() {
    let root = tempfile::tempdir().unwrap();
    let mut manifest = Manifest::default();
    let mut hostile = record("<script>alert(1)", State::Failed);
    hostile.error = Some("\"><img src=x onerror=alert(1)>".into());
    hostile.files = vec!["<script>alert(1)/a \"b\"/report.html".into()];
    manifest.insert(hostile);
    let mut outside = record("..", State::Built);
    outside.files = vec!["../secret/atlas.json".into()];
    manifest.insert(outside);
    write(root.path(), &manifest).unwrap();
    let text = fs::read_to_string(root.path().join(FILE_NAME)).unwrap();
    assert!(!text.contains("<script>alert") && !text.contains("<img"));
    assert!(text.contains("href=\"./%3Cscript%3Ealert%281%29/a%20%22b%22/report.html\""));
    assert!(!text.contains("http://") && !text.contains("https://"));
}

#[test]
fn lines_that_are_no_history_are_not_there() {
    let root = tempfile::tempdir().unwrap();
    fs::write(root.path().join(HISTORY_NAME), "garbage\n{\"id\":3}\n\u{0}").unwrap();
    let (_, text) = night(root.path(), &[("spot", State::Built, 0.1)]);
    assert!(text.contains("There was none."));
    let history = fs::read_to_string(root.path().join(HISTORY_NAME)).unwrap();
    assert_eq!(history.lines().count(), 1);
}
