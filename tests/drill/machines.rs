//! A plan that several machines carry out: what they made is what one machine makes, to the byte, whatever happened to them.

use crate::folders::{atlases, tree, unfinished};
use crate::generate::batch::{Asset, corpus};
use crate::night::Night;
use crate::stage::{Run, kill, workers};
use libtest_mimic::Failed;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

type Found = Result<Option<String>, Failed>;

/// Shards of the plan.
const SHARDS: usize = 4;
/// Assets, of which so many are broken.
const ASSETS: usize = 60;
const BROKEN: usize = 10;

/// One asset broken in each way, and good ones.
fn assets() -> Vec<Asset> {
    let (broken, good): (Vec<Asset>, Vec<Asset>) = corpus(200)
        .into_iter()
        .partition(|asset| asset.kind.is_some());
    assert_eq!(broken.len(), BROKEN);
    let good = good.into_iter().take(ASSETS - BROKEN);
    broken.into_iter().chain(good).collect()
}

/// What a command said and its exit code.
struct Said {
    code: Option<i32>,
    text: String,
}

fn say(mut command: Command) -> Said {
    let output = command.output().expect("the program starts");
    let mut text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.push_str(&String::from_utf8_lossy(&output.stderr));
    // Messages are broken into lines as wide as the terminal.
    let words: Vec<&str> = text.split_whitespace().filter(|&w| w != "|").collect();
    Said {
        code: output.status.code(),
        text: words.join(" "),
    }
}

fn plan(night: &Night, more: &[&str]) -> String {
    let mut command = night.command(&["plan", "config.toml", "--plan", "plan.jsonl"]);
    command.args(["--out", "many"]).args(more);
    let said = say(command);
    assert_eq!(said.code, Some(0), "{}", said.text);
    said.text
}

fn shard(night: &Night, number: usize) -> Command {
    let shard = format!("{number}/{SHARDS}");
    night.command(&["run", "--plan", "plan.jsonl", "--shard", &shard])
}

fn merge(night: &Night, more: &[&str]) -> Said {
    let mut command = night.command(&["merge", "--plan", "plan.jsonl"]);
    command.args(more);
    say(command)
}

fn build(night: &Night, out: &str, more: &[&str]) -> Said {
    let mut command = night.command(&["build", "config.toml", "--out", out]);
    command.args(more);
    say(command)
}

/// The manifest without what depends on who did it and when.
fn records(night: &Night, out: &str) -> BTreeMap<String, Value> {
    let mut manifest = night.manifest(out);
    for record in manifest.values_mut() {
        let record = record.as_object_mut().expect("an object");
        for key in ["seconds", "peak_memory", "host", "checked"] {
            assert!(record.remove(key).is_some(), "no {key}");
        }
    }
    manifest
}

/// A JUnit file without times.
fn cases(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("readable");
    let mut parts = text.split(" time=\"");
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        out.push_str(part.split_once('"').expect("closed").1);
    }
    out
}

/// The output roots `one` and `many` are the same.
fn alike(night: &Night) {
    assert!(
        atlases(&night.path("one")) == atlases(&night.path("many")),
        "atlases differ"
    );
    let (one, many) = (records(night, "one"), records(night, "many"));
    for (id, record) in &one {
        assert_eq!(Some(record), many.get(id));
    }
    assert_eq!(one.len(), many.len());
    let junit = |out: &str| cases(&night.path(out).join("junit.xml"));
    assert_eq!(junit("one"), junit("many"));
    assert_eq!(unfinished(&night.path("many")), [""; 0]);
}

/// Everything that a merge writes.
fn written(night: &Night) -> BTreeMap<String, String> {
    let names = ["manifest.jsonl", "junit.xml", "index.html", "history.jsonl"];
    let text = |name: &str| fs::read_to_string(night.path("many").join(name)).unwrap_or_default();
    names
        .iter()
        .map(|&name| (name.to_owned(), text(name)))
        .collect()
}

/// One shard is killed, one stopped, one run twice; the merge refuses until all is done, and is the same twice.
pub fn a_plan_is_carried_out() -> Found {
    let night = Night::new(assets());
    let said = build(&night, "one", &["--depfile", "one.d"]);
    assert_eq!(said.code, Some(1), "{}", said.text);
    let said = plan(&night, &["--shards", "4"]);
    assert!(said.contains("60 of 60 to build"), "{said}");
    assert!(said.contains("4 shards of "), "{said}");

    let nothing = merge(&night, &[]);
    assert_eq!(nothing.code, Some(1), "{}", nothing.text);
    let expected = "60 of 60 meshes are not done";
    assert!(nothing.text.contains(expected), "{}", nothing.text);
    assert!(
        nothing.text.contains("no shard has been begun"),
        "{}",
        nothing.text
    );

    // The first one, twice.
    let first = say(shard(&night, 1));
    let before = atlases(&night.path("many"));
    let again = say(shard(&night, 1));
    assert_eq!(first.code, again.code, "{}", again.text);
    assert!(again.text.contains("whole already"), "{}", again.text);
    assert!(!again.text.contains("cached"), "{}", again.text);
    assert_eq!(atlases(&night.path("many")), before);

    // The second dies with its machine.
    let run = Run::start(shard(&night, 2));
    run.wait_for(4);
    assert!(kill("KILL", run.id()));
    assert_eq!(run.end().0, None);

    // The third is stopped, as an engine does it: everybody gets the signal.
    let run = Run::start(shard(&night, 3));
    run.wait_for(4);
    for worker in workers(run.id()) {
        kill("TERM", worker);
    }
    assert!(kill("TERM", run.id()));
    let (code, text) = run.end();
    assert_eq!(code, Some(130), "{text}");
    assert!(!text.contains("ended from outside"), "{text}");

    let refused = merge(&night, &[]);
    assert_eq!(refused.code, Some(1), "{}", refused.text);
    let expected = "shard 4/4 never began; 2 shards did not come to the end (2/4, 3/4)";
    assert!(refused.text.contains(expected), "{}", refused.text);
    let expected = "affine-atlas run --plan plan.jsonl --shard 2/4";
    assert!(refused.text.contains(expected), "{}", refused.text);
    assert_eq!(
        written(&night)["manifest.jsonl"],
        "",
        "something was written"
    );

    let incomplete = merge(&night, &["--incomplete"]);
    assert_eq!(incomplete.code, Some(130), "{}", incomplete.text);
    assert_eq!(night.manifest("many").len(), ASSETS);
    let cancelled = night.in_state("many", "cancelled").len();
    assert!((15..50).contains(&cancelled), "{cancelled} cancelled");
    let built = night.in_state("many", "built").len();

    for number in [2, 3, 4] {
        let said = say(shard(&night, number));
        assert!(matches!(said.code, Some(0 | 1)), "{}", said.text);
    }
    let merged = merge(&night, &["--depfile", "many.d"]);
    assert_eq!(merged.code, Some(1), "{}", merged.text);
    assert!(
        merged.text.contains("60 meshes: 50 built, 10 failed"),
        "{}",
        merged.text
    );
    assert!(built < night.in_state("many", "built").len());
    alike(&night);
    let depfile = |name: &str| fs::read_to_string(night.path(name)).expect("written");
    assert_eq!(
        depfile("one.d"),
        depfile("many.d").replace("many/manifest", "one/manifest")
    );
    let once = written(&night);
    let merged = merge(&night, &[]);
    assert_eq!(merged.code, Some(1), "{}", merged.text);
    assert_eq!(written(&night), once, "merging twice is not the same");

    // The second night: what is good is cached on both sides.
    assert_eq!(build(&night, "one", &[]).code, Some(1));
    let said = plan(&night, &[]);
    assert!(said.contains("10 of 60 to build"), "{said}");
    for number in 1..=SHARDS {
        say(shard(&night, number));
    }
    let merged = merge(&night, &[]);
    assert!(
        merged.text.contains("50 cached, 10 failed"),
        "{}",
        merged.text
    );
    alike(&night);
    let page = &written(&night)["index.html"];
    assert!(
        !page.contains("new failure"),
        "compared with the wrong night"
    );
    Ok(None)
}

/// What a plan has built with `--force` is not built again by the same plan, and still reported as built.
pub fn forced_plans_go_on() -> Found {
    let assets = assets().into_iter().filter(|a| a.kind.is_none()).take(12);
    let night = Night::new(assets.collect());
    let said = build(&night, "many", &[]);
    assert_eq!(said.code, Some(0), "{}", said.text);
    let before = tree(&night.path("many/.affine-atlas/cache"));
    let said = plan(&night, &["--force"]);
    assert!(said.contains("12 of 12 to build"), "{said}");
    let all = || say(night.command(&["run", "--plan", "plan.jsonl"]));
    let first = all();
    assert_eq!(first.code, Some(0), "{}", first.text);
    assert!(first.text.contains("12 built"), "{}", first.text);
    let entries = tree(&night.path("many/.affine-atlas/cache"));
    assert!(
        entries.iter().all(|(id, hash)| before[id] != *hash),
        "nothing was built"
    );
    let again = all();
    assert_eq!(again.code, Some(0), "{}", again.text);
    assert!(again.text.contains("12 built"), "{}", again.text);
    assert_eq!(
        tree(&night.path("many/.affine-atlas/cache")),
        entries,
        "built again"
    );
    assert_eq!(merge(&night, &[]).code, Some(0));
    assert_eq!(night.in_state("many", "built").len(), 12);
    Ok(None)
}

/// Inputs that change after the plan was made are built as they are, and the merge says which.
pub fn inputs_change_after_the_plan() -> Found {
    let assets = assets().into_iter().filter(|a| a.kind.is_none()).take(12);
    let night = Night::new(assets.collect());
    plan(&night, &[]);
    let found = night.assets.iter().find(|a| a.files[0].0.ends_with(".obj"));
    let changed = found.ok_or("an OBJ file")?;
    let mesh = night.path("meshes").join(&changed.files[0].0);
    let text = [fs::read(&mesh)?.as_slice(), b"# touched\n"].concat();
    fs::write(mesh, text)?;
    let gone = night.assets.iter().find(|a| a.files[0].0.ends_with(".ply"));
    let gone = gone.ok_or("a PLY file")?;
    fs::remove_file(night.path("meshes").join(&gone.files[0].0))?;
    let mut warned = 0;
    for number in 1..=SHARDS {
        let said = say(shard(&night, number));
        warned += said
            .text
            .matches("is not what it was when the plan was made")
            .count();
    }
    assert_eq!(warned, 2);
    let merged = merge(&night, &[]);
    assert_eq!(merged.code, Some(1), "{}", merged.text);
    let expected = "changed after the plan was made, and built as they were then: 2 meshes (";
    assert!(merged.text.contains(expected), "{}", merged.text);
    assert_eq!(night.manifest("many")[&changed.id]["state"], "built");
    assert_eq!(night.manifest("many")[&gone.id]["kind"], "input");
    Ok(None)
}

/// The plan holds for the folder in which it was made, whatever that is called, and for no other.
pub fn a_plan_moves_with_its_folder() -> Found {
    let assets = assets().into_iter().filter(|a| a.kind.is_none()).take(4);
    let night = Night::new(assets.collect());
    plan(&night, &[]);
    let other = tempfile::tempdir()?;
    let plan_file = night.path("plan.jsonl");
    let run_in = |folder: &Path| {
        let mut command = night.command(&["run", "--plan"]);
        command.arg(&plan_file).current_dir(folder);
        say(command)
    };
    let refused = run_in(other.path());
    assert_eq!(refused.code, Some(2), "{}", refused.text);
    assert!(
        refused.text.contains("the plan was made in"),
        "{}",
        refused.text
    );
    assert_eq!(
        fs::read_dir(other.path())?.count(),
        0,
        "something was written"
    );
    // The same place under another name, as where it is mounted elsewhere.
    let moved = other.path().join("mounted here");
    fs::rename(night.folder(), &moved)?;
    let mut command = Command::new(env!("CARGO_BIN_EXE_affine-atlas"));
    command
        .args(["run", "--plan", "plan.jsonl"])
        .current_dir(&moved);
    let said = say(command);
    assert_eq!(said.code, Some(0), "{}", said.text);
    let mut command = Command::new(env!("CARGO_BIN_EXE_affine-atlas"));
    command
        .args(["merge", "--plan", "plan.jsonl"])
        .current_dir(&moved);
    let said = say(command);
    assert_eq!(said.code, Some(0), "{}", said.text);
    assert!(said.text.contains("4 meshes: 4 built"), "{}", said.text);
    Ok(None)
}
