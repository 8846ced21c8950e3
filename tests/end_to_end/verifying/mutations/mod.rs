//! Every check can fail: a right atlas is damaged in one place, and exactly the checks that must notice do.

macro_rules! mutation {
    ($make:ident, $what:literal, |$atlas:ident| $damage:expr, [$($fails:literal),* $(,)?]) => {
        Mutation {
            what: $what,
            make: $make,
            damage: |$atlas: &mut Atlas| { $damage; },
            fails: &[$($fails),*],
        }
    };
}

mod charts;
mod images;
mod metric;

use crate::verifying::fixture::{Atlas, Picture, cone, pillow, torus, tube};
use affine_atlas::verify::{VerifyOptions, verify};
use serde_json::json;
use std::collections::BTreeSet;

struct Mutation {
    what: &'static str,
    make: fn() -> Atlas,
    damage: fn(&mut Atlas),
    /// All that fail.
    fails: &'static [&'static str],
}

fn failures(atlas: &Atlas, options: &VerifyOptions) -> BTreeSet<String> {
    let folder = tempfile::tempdir().expect("a folder");
    atlas.write(folder.path());
    let verdicts = verify(folder.path(), options).expect("an atlas");
    let failed = verdicts.checks.into_iter().filter(|check| !check.passed);
    failed.map(|check| check.name).collect()
}

/// A texel that the mask marks, and one that it does not.
fn texels(picture: &Picture) -> (usize, usize) {
    let alpha = &picture.floats["A"];
    let last = |value: f32| {
        // In the middle of a run of five equal ones, so that no border is near.
        (0..alpha.len() - 5)
            .filter(|i| alpha[*i..*i + 5].iter().all(|a| *a == value))
            .nth(20)
            .expect("such a texel")
            + 2
    };
    (last(1.0), last(0.0))
}

fn channel<'a>(atlas: &'a mut Atlas, name: &str) -> &'a mut Vec<f32> {
    atlas.pictures[0].floats.get_mut(name).expect("a channel")
}

/// Removes a chart with its entries and transitions.
fn drop_chart(atlas: &mut Atlas, chart: usize) {
    let arrays = &mut atlas.arrays;
    let (start, end) = (
        arrays.chart_offset[chart] as usize,
        arrays.chart_offset[chart + 1] as usize,
    );
    arrays.chart_face.drain(start..end);
    arrays.chart_sector.drain(start..end);
    arrays.chart_uv.drain(start..end);
    arrays.chart_offset.remove(chart);
    for offset in &mut arrays.chart_offset[chart..] {
        *offset -= (end - start) as u32;
    }
    let charts = atlas.json["charts"].as_array_mut().expect("a list");
    charts.remove(chart);
    for (id, record) in charts.iter_mut().enumerate() {
        record["id"] = json!(id);
    }
    let transitions = atlas.json["transitions"].as_array_mut().expect("a list");
    transitions.retain(|t| t["to"] != chart);
    for t in transitions {
        let to = t["to"].as_u64().expect("an id") as usize;
        t["to"] = json!(to - usize::from(to > chart));
    }
}

/// Adds a record to a list of `atlas.json`.
fn append(atlas: &mut Atlas, list: &str, record: serde_json::Value) {
    let list = atlas.json[list].as_array_mut();
    list.expect("a list").push(record);
}

/// The chart of a kind.
fn chart_of(atlas: &Atlas, kind: &str) -> usize {
    let charts = atlas.json["charts"].as_array().expect("a list");
    charts.iter().position(|c| c["kind"] == kind).expect("one")
}

fn mutations() -> Vec<Mutation> {
    let mut all = metric::mutations();
    all.extend(charts::mutations());
    all.extend(images::mutations());
    all
}

#[test]
fn exactly_the_checks_that_must_notice_a_damage_fail() {
    let mut wrong = Vec::new();
    for mutation in mutations() {
        let mut atlas = (mutation.make)();
        (mutation.damage)(&mut atlas);
        let failed = failures(&atlas, &VerifyOptions::default());
        let expected = BTreeSet::from_iter(mutation.fails.iter().map(|name| (*name).to_owned()));
        if failed != expected {
            let lacking: Vec<_> = expected.difference(&failed).collect();
            let surplus: Vec<_> = failed.difference(&expected).collect();
            wrong.push(format!(
                "{}: did not fail {lacking:?}, failed too {surplus:?}",
                mutation.what
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_check_of_an_atlas_is_failed_by_some_damage() {
    let damaged: BTreeSet<&str> = mutations().iter().flat_map(|m| m.fails).copied().collect();
    // Failed in tests of their own: by files that are damaged as such, or by options.
    let elsewhere = [
        "arrays have their types and shapes",
        "atlas.npz has every array",
        "log scale range inside a patch is bounded",
    ];
    for make in [torus, pillow, tube, cone] {
        let folder = tempfile::tempdir().expect("a folder");
        make().write(folder.path());
        let verdicts = verify(folder.path(), &VerifyOptions::default()).expect("an atlas");
        for check in verdicts.checks {
            let name = check.name.as_str();
            assert!(
                damaged.contains(name) || elsewhere.contains(&name),
                "nothing fails: {name}"
            );
        }
    }
}

#[test]
fn options_bound_cones_and_log_scale() {
    let options = |cones, log_scale_range| VerifyOptions {
        cones,
        log_scale_range,
        ..VerifyOptions::default()
    };
    assert!(failures(&pillow(), &options(Some(4), Some(2.0))).is_empty());
    let failed = failures(&pillow(), &options(Some(3), None));
    assert_eq!(failed, ["no more cones than prescribed".to_owned()].into());
    let failed = failures(&torus(), &options(None, Some(0.01)));
    let expected = "log scale range inside a patch is bounded".to_owned();
    assert_eq!(failed, [expected].into());
}
