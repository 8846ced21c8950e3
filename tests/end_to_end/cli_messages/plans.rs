//! `plan`, `run` and `merge`.

use super::{folder, refusal, run, stderr, stdout};
use std::fs;
use std::path::Path;

const TETRAHEDRON: &str =
    "v 1 1 1\nv 1 -1 -1\nv -1 1 -1\nv -1 -1 1\nf 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n";
const CHEAP: &str = "[patches]\ntexel_budget = 4096\n[pictures]\nenabled = false\n[report]\nenabled = false\n[cones]\ncount = 4\n";

/// A folder with two meshes, one of them broken, and a plan of both.
fn planned() -> tempfile::TempDir {
    let folder = folder();
    fs::write(folder.path().join("a.obj"), TETRAHEDRON).expect("written");
    fs::write(folder.path().join("b.obj"), "").expect("written");
    let config = format!("{CHEAP}[input]\npaths = [\"a.obj\", \"b.obj\"]\n");
    fs::write(folder.path().join("config.toml"), config).expect("written");
    let output = run(folder.path(), &["plan", "-p", "p.jsonl", "-q"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(stdout(&output), "");
    folder
}

/// The refusal of a plan whose text was changed.
fn changed(from: &str, to: &str) -> String {
    let folder = planned();
    let path = folder.path().join("p.jsonl");
    let text = fs::read_to_string(&path).expect("written");
    assert!(text.contains(from), "{text}");
    fs::write(&path, text.replace(from, to)).expect("written");
    let said = refusal(folder.path(), &["run", "-p", "p.jsonl"], 2);
    let merge = refusal(folder.path(), &["merge", "-p", "p.jsonl"], 2);
    assert_eq!(said, merge);
    let left = fs::read_dir(folder.path().join("affine-atlas-out")).expect("made by the plan");
    assert_eq!(left.count(), 1, "something was written");
    said
}

#[test]
fn a_plan_says_how_much_there_is_to_do() {
    let folder = planned();
    let plan = |more: &[&str]| {
        let arguments = [&["plan", "-p", "p.jsonl"], more].concat();
        let output = run(folder.path(), &arguments);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        stdout(&output)
    };
    insta::assert_snapshot!(plan(&["--shards", "3"]), @r"
    2 of 2 to build, less than 1 s of work one after the other
    3 shards of less than 1 s to less than 1 s, the largest 1.50 times an equal part; 1 has nothing to do
    wrote p.jsonl
    ");
    let fine = ["--set", "patches.texel_budget=4194304", "--shards", "2"];
    insta::assert_snapshot!(plan(&fine), @r"
    2 of 2 to build, about 56 s of work one after the other
    2 shards of about 28 s to about 28 s, the largest 1.00 times an equal part
    wrote p.jsonl
    ");
    insta::assert_snapshot!(plan(&[]), @r"
    2 of 2 to build, less than 1 s of work one after the other
    wrote p.jsonl
    ");
}

#[test]
fn plans_that_are_none_are_refused() {
    let folder = planned();
    let said = |plan: &str| refusal(folder.path(), &["run", "-p", plan], 2);
    insta::assert_snapshot!(said("none.jsonl"), @r"
    error: the plan none.jsonl cannot be read: there is no such file
    help: check the name; `affine-atlas plan … --plan FILE` writes one
    ");
    insta::assert_snapshot!(said("a.obj"), @r"
    error: a.obj is no plan: its first line is not one that `affine-atlas plan` writes
    help: name a file that `affine-atlas plan … --plan FILE` wrote
    ");
    insta::assert_snapshot!(changed("\"version\":1", "\"version\":7"), @r"
    error: the plan p.jsonl has version 7 of its format, and this program reads version 1
    help: plan again with this version, or carry the plan out with that one
    ");
    let version = format!("\"program_version\":\"{}\"", env!("CARGO_PKG_VERSION"));
    insta::assert_snapshot!(changed(&version, "\"program_version\":\"0.0.1\""), @r"
    error: the plan p.jsonl was made by version 0.0.1 of affine-atlas, and this is 0.1.0
    help: plan again with this version, or carry the plan out with that one
    ");
    insta::assert_snapshot!(changed("{\"record\":\"end\"", "{\"record\":\"e"), @r"
    error: line 5 of the plan p.jsonl is damaged: unknown variant `e,`, expected one of `plan`,
    | `configuration`, `asset`, `end` at column 14
    help: copy it again, or plan again: what is built is not built again
    ");
    insta::assert_snapshot!(changed("\"cost\":0", "\"cost\":-1"), @r"
    error: line 4 of the plan p.jsonl is damaged: invalid value: integer `-1`, expected u64 at
    | column 314
    help: copy it again, or plan again: what is built is not built again
    ");
    let other = changed("\"given\":\"b.obj\"", "\"given\":\"c.obj\"");
    // Without its two hashes.
    let words = other.split_whitespace();
    let words: Vec<&str> = words
        .filter(|word| word.len() < 64 && *word != "|")
        .collect();
    insta::assert_snapshot!(words.join(" "), @"error: the plan p.jsonl was changed: its lines have the hash and its last line says help: copy it again, or plan again: what is built is not built again");
}

#[test]
fn a_plan_is_for_the_folder_in_which_it_was_made() {
    let folder = planned();
    let other = super::folder();
    let plan = folder.path().join("p.jsonl");
    let plan = plan.to_str().expect("text");
    for command in ["run", "merge"] {
        let output = run(other.path(), &[command, "--plan", plan]);
        assert_eq!(output.status.code(), Some(2));
        let said = stderr(&output);
        let words: Vec<&str> = said.split_whitespace().filter(|&w| w != "|").collect();
        let said = words.join(" ");
        assert!(said.starts_with("error: the plan was made in "), "{said}");
        let remedy = said.split_once("help: ").expect("a remedy").1;
        insta::allow_duplicates! {
            insta::assert_snapshot!(remedy, @"start it in the folder in which the plan was made, wherever that is mounted on this machine, or plan again");
        }
    }
    assert_eq!(fs::read_dir(other.path()).expect("a folder").count(), 0);
}

#[test]
fn shards_and_merging() {
    let folder = planned();
    let said = |arguments: &[&str], code: i32| {
        let output = run(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        stdout(&output)
    };
    insta::assert_snapshot!(refusal(folder.path(), &["merge", "-p", "p.jsonl"], 1), @r"
    error: 2 of 2 meshes are not done (a, b): no shard has been begun
    help: wait, or run what is missing: `affine-atlas run --plan p.jsonl`; or merge what is there
          with `--incomplete`
    ");
    insta::assert_snapshot!(refusal(folder.path(), &["run", "-p", "p.jsonl", "-s", "4/3"], 2), @r"
    error: invalid value '4/3' for '--shard <I/N>': of 3 shards there is none with the number 4: they are counted from 1

    For more information, try '--help'.
    ");
    insta::assert_snapshot!(said(&["run", "-p", "p.jsonl", "-s", "3/3"], 0), @"shard 3/3 has nothing to do: the plan has 2 meshes");
    said(&["run", "-q", "-p", "p.jsonl", "-s", "1/3"], 0);
    insta::assert_snapshot!(refusal(folder.path(), &["merge", "-p", "p.jsonl"], 1), @r"
    error: 1 of 2 meshes is not done (b): shard 2/3 never began
    help: wait, or run what is missing: `affine-atlas run --plan p.jsonl --shard 2/3`; or merge what
          is there with `--incomplete`
    ");
    said(&["run", "-q", "-p", "p.jsonl", "-s", "2/3"], 1);
    fs::write(folder.path().join("a.obj"), "").expect("written");
    // What was built is there; that its input has changed since is for the next plan.
    said(&["merge", "-q", "-p", "p.jsonl"], 1);
    let manifest = folder.path().join("affine-atlas-out/manifest.jsonl");
    let manifest = fs::read_to_string(manifest).expect("written");
    assert_eq!(manifest.lines().count(), 2, "{manifest}");
}

#[test]
fn nothing_to_plan_and_nowhere_to_write() {
    let folder = folder();
    fs::create_dir(folder.path().join("empty")).expect("made");
    insta::assert_snapshot!(refusal(folder.path(), &["plan", "empty", "-p", "p.jsonl"], 3), @r"
    error: no mesh was found: empty holds no mesh file (gltf, glb, obj, ply, stl, off)
    help: check names and folders; quotes keep the shell from replacing `*` by itself
    ");
    fs::write(folder.path().join("a.obj"), TETRAHEDRON).expect("written");
    insta::assert_snapshot!(refusal(folder.path(), &["plan", "a.obj", "-p", "no/p.jsonl"], 2), @r"
    error: no/p.jsonl cannot be written: entity not found
    help: check that its folder exists, may be written and has space left
    ");
    fs::write(folder.path().join("file"), "mine").expect("written");
    let blocked = ["plan", "a.obj", "-p", "p.jsonl", "-o", "file"];
    let output = run(folder.path(), &blocked);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("file"), "{}", stderr(&output));
    assert!(!folder.path().join("p.jsonl").exists());
    let exists = |name: &str| Path::new(folder.path()).join(name).exists();
    assert!(!exists("p.jsonl") && !exists("no"));
}
