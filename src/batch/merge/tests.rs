use super::*;
use crate::batch::records::{Recording, ShardRecorder};
use crate::batch::shard::tests::plan;
use crate::export::manifest::Manifest;
use crate::outcome::{Failure, FailureKind};

const HALVES: [Shard; 2] = [
    Shard {
        number: 1,
        count: 2,
    },
    Shard {
        number: 2,
        count: 2,
    },
];

struct Root {
    folder: tempfile::TempDir,
    plan: Plan,
}

impl Root {
    /// Four assets: `a000` and `a003` in shard 1/2, `a001` and `a002` in shard 2/2.
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let plan = plan(folder.path(), &[4, 3, 2, 1]);
        assert_eq!(assign(&plan, 2), [0, 1, 1, 0]);
        Self { folder, plan }
    }

    /// One attempt at a shard, with these outcomes; with an end or without.
    fn attempt(&self, shard: Shard, outcomes: &[AssetOutcome], ends: bool) {
        self.attempt_with(shard, outcomes, ends, None);
    }

    /// The same with another input than planned.
    fn attempt_with(
        &self,
        shard: Shard,
        outcomes: &[AssetOutcome],
        ends: bool,
        input: Option<&str>,
    ) {
        let id = &self.plan.header.id;
        let mut recorder = ShardRecorder::begin(self.folder.path(), id, shard).unwrap();
        for outcome in outcomes {
            let mut assets = self.plan.assets.iter();
            let planned = assets.find(|asset| asset.task.id == outcome.id).unwrap();
            let mut task = planned.task.clone();
            if let Some(input) = input {
                task.input_hash = Some(input.into());
            }
            recorder.record(&task, outcome);
        }
        if ends {
            recorder.finish().unwrap();
        }
    }

    fn merged(&self) -> Merged {
        collect(&self.plan).unwrap()
    }

    fn states(&self) -> Vec<&'static str> {
        let merged = self.merged();
        merged
            .outcomes
            .iter()
            .map(AssetOutcome::state_name)
            .collect()
    }
}

fn outcome(id: &str, state: AssetState) -> AssetOutcome {
    let mut outcome = AssetOutcome::whole(id, state, 1.5);
    outcome.input_hash = Some("of the reader".into());
    outcome.files = vec!["atlas.json".into()];
    outcome
}

fn built(id: &str) -> AssetOutcome {
    outcome(id, AssetState::Built)
}

fn failed(id: &str) -> AssetOutcome {
    let failure = Failure {
        kind: FailureKind::Input,
        message: "wrong".into(),
    };
    outcome(id, AssetState::Failed(failure))
}

#[test]
fn what_all_shards_did_is_the_manifest_in_the_order_of_the_plan() {
    let root = Root::new();
    root.attempt(HALVES[1], &[failed("a002"), built("a001")], true);
    let mut elsewhere = built("a003");
    elsewhere.host = Some("elsewhere".into());
    root.attempt(HALVES[0], &[elsewhere, built("a000")], true);
    let merged = root.merged();
    let ids: Vec<&str> = merged.outcomes.iter().map(|o| o.id.as_str()).collect();
    assert_eq!(ids, ["a000", "a001", "a002", "a003"]);
    assert_eq!(root.states(), ["built", "built", "failed", "built"]);
    assert_eq!(merged.missing, [""; 0]);
    assert_eq!(merged.unfinished, []);
    // Another asset keeps its line.
    let mut before = Manifest::default();
    before.insert(Record::of(&built("z"), "00"));
    before.insert(Record::of(&failed("a000"), "00"));
    before.save(root.folder.path()).unwrap();
    merged.save(&root.plan).unwrap();
    let (manifest, _) = Manifest::load(root.folder.path()).unwrap();
    assert_eq!(manifest.records().len(), 5);
    let mut expected = Record::of(&built("a000"), &root.plan.assets[0].task.config_hash);
    expected.host = crate::batch::limits::host();
    assert_eq!(manifest.get("a000"), Some(&expected));
    // What an earlier attempt built keeps the name of that machine.
    let host = &manifest.get("a003").unwrap().host;
    assert_eq!(host.as_deref(), Some("elsewhere"));
    assert_eq!(expected.files, ["a000/atlas.json"]);
    let text = manifest.to_text();
    root.merged().save(&root.plan).unwrap();
    let (again, _) = Manifest::load(root.folder.path()).unwrap();
    assert_eq!(again.to_text(), text);
}

#[test]
fn good_beats_bad_whichever_came_first() {
    let cached = |id| outcome(id, AssetState::Cached);
    let cancelled = |id| outcome(id, AssetState::Cancelled);
    let all = [
        built("a000"),
        cached("a000"),
        failed("a000"),
        cancelled("a000"),
    ];
    for (i, better) in all.iter().enumerate() {
        for worse in &all[i + 1..] {
            for pair in [[better, worse], [worse, better]] {
                let root = Root::new();
                for one in pair {
                    root.attempt(HALVES[0], std::slice::from_ref(one), false);
                }
                assert_eq!(root.states()[0], better.state_name());
                assert!(!root.merged().missing.contains(&"a000".to_owned()));
            }
        }
    }
}

#[test]
fn what_is_missing_is_named_with_its_shards() {
    let root = Root::new();
    let merged = root.merged();
    assert_eq!(merged.missing.len(), 4);
    assert_eq!(merged.unfinished, [], "no division is known yet");
    root.attempt(HALVES[0], &[built("a003")], false);
    let merged = root.merged();
    assert_eq!(merged.missing, ["a000", "a001", "a002"]);
    let expected = [(HALVES[0], Went::NotEnded), (HALVES[1], Went::NeverBegun)];
    assert_eq!(merged.unfinished, expected);
    // Stopped counts as not done.
    let stopped = outcome("a000", AssetState::Cancelled);
    root.attempt(HALVES[0], &[built("a003"), stopped], true);
    assert_eq!(root.merged().missing, ["a000", "a001", "a002"]);
    assert_eq!(root.merged().unfinished, expected);
    root.attempt(HALVES[1], &[built("a001")], true);
    let merged = root.merged();
    assert_eq!(merged.missing, ["a000", "a002"]);
    assert_eq!(merged.unfinished[1], (HALVES[1], Went::Damaged));
    assert_eq!(root.states(), ["cancelled", "built", "cancelled", "built"]);
    // The rest is done by another division.
    root.attempt(Shard::WHOLE, &[built("a000"), built("a002")], true);
    assert_eq!(root.merged().missing, [""; 0]);
    assert_eq!(root.merged().unfinished, []);
}

#[test]
fn changed_inputs_are_told_and_the_planned_one_is_preferred() {
    let root = Root::new();
    root.attempt_with(HALVES[0], &[built("a000"), built("a003")], true, Some("x"));
    root.attempt(HALVES[1], &[built("a001"), built("a002")], true);
    assert_eq!(root.merged().changed, ["a000", "a003"]);
    root.attempt(HALVES[0], &[built("a000")], false);
    assert_eq!(root.merged().changed, ["a003"]);
    assert_eq!(root.merged().ambiguous, [""; 0], "they made the same");
    let mut other = built("a001");
    other.files.push("images/0000.exr".into());
    root.attempt(HALVES[1], &[other, failed("a002")], false);
    assert_eq!(root.merged().ambiguous, ["a001"]);
    assert_eq!(root.states(), ["built"; 4]);
}

#[test]
fn records_of_another_plan_are_never_taken() {
    let root = Root::new();
    root.attempt(
        Shard::WHOLE,
        &["a000", "a001", "a002", "a003"].map(built),
        true,
    );
    assert_eq!(root.merged().missing, [""; 0]);
    let other = plan(root.folder.path(), &[4, 3, 2, 1]);
    assert_eq!(collect(&other).unwrap().missing.len(), 4);
    // Nor where somebody copied them.
    let folder = |plan: &Plan| plan_folder(root.folder.path(), &plan.header.id);
    fs::rename(folder(&root.plan), folder(&other)).unwrap();
    assert_eq!(collect(&other).unwrap().missing.len(), 4);
}

#[test]
fn plans_that_were_merged_are_cleared_up_by_later_ones() {
    let root = Root::new();
    let all = ["a000", "a001", "a002", "a003"].map(built);
    root.attempt(Shard::WHOLE, &all, true);
    root.merged().clear_up(&root.plan);
    assert_eq!(root.merged().missing, [""; 0], "its own went too");
    let half = plan(root.folder.path(), &[1, 1]);
    let shard = |plan: &Plan, outcomes: &[AssetOutcome]| {
        let id = &plan.header.id;
        let mut recorder = ShardRecorder::begin(root.folder.path(), id, Shard::WHOLE).unwrap();
        for (outcome, asset) in outcomes.iter().zip(&plan.assets) {
            recorder.record(&asset.task, outcome);
        }
        recorder.finish().unwrap();
    };
    shard(&half, &all[..1]);
    assert!(!is_gone(&root.plan));
    collect(&half).unwrap().clear_up(&half);
    assert!(is_gone(&root.plan) && !is_gone(&half));
    // One that is not done stays, whatever is merged after it.
    let last = plan(root.folder.path(), &[1]);
    shard(&last, &all[..1]);
    collect(&last).unwrap().clear_up(&last);
    assert!(!is_gone(&half) && !is_gone(&last));
    assert_eq!(collect(&half).unwrap().missing, ["a001"]);
}

#[test]
fn the_history_of_the_run_before_is_set_aside_once() {
    let root = Root::new();
    let history = root.folder.path().join(HISTORY_NAME);
    let aside = history_before(&root.plan).unwrap();
    assert_eq!(fs::read_to_string(&aside).unwrap(), "", "there was none");
    let other = plan(root.folder.path(), &[1]);
    fs::write(&history, "last night").unwrap();
    let aside = history_before(&other).unwrap();
    fs::write(&history, "tonight").unwrap();
    assert_eq!(history_before(&other).unwrap(), aside);
    assert_eq!(fs::read_to_string(aside).unwrap(), "last night");
}
