//! A whole night: many assets, one of twenty broken, in one command; then a second night, and a third with three changes.

use crate::folders::{atlases, unfinished};
use crate::generate::batch::{Asset, corpus, write};
use libtest_mimic::Failed;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

type Found = Result<Option<String>, Failed>;

/// A folder with a corpus and its configuration.
pub struct Night {
    folder: tempfile::TempDir,
    /// The corpus.
    pub assets: Vec<Asset>,
}

/// What a run was like.
struct Ran {
    code: Option<i32>,
    seconds: f64,
    /// Most memory of the batch itself, bytes.
    memory: u64,
    said: String,
}

impl Night {
    /// Writes `meshes` and `config.toml`.
    pub fn new(assets: Vec<Asset>) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        write(&assets, folder.path()).expect("written");
        Self { folder, assets }
    }

    /// The folder itself.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// A file of the folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The program in this folder.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_affine-atlas"));
        command
            .args(arguments)
            .current_dir(self.folder.path())
            .env("NO_COLOR", "1")
            .env_remove("RUST_BACKTRACE");
        command
    }

    fn run(&self, out: &str, arguments: &[&str]) -> Ran {
        let start = Instant::now();
        let errors = self.path("errors.txt");
        let mut child = self
            .command(&["build", "config.toml", "--quiet", "--out", out])
            .args(arguments)
            .stdout(Stdio::null())
            .stderr(fs::File::create(&errors).expect("made"))
            .spawn()
            .expect("the program starts");
        let mut memory = 0;
        let status = loop {
            memory = peak(child.id()).unwrap_or(memory).max(memory);
            if let Some(status) = child.try_wait().expect("waits") {
                break status;
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        Ran {
            code: status.code(),
            seconds: start.elapsed().as_secs_f64(),
            memory,
            said: fs::read_to_string(errors).expect("text"),
        }
    }

    /// The records of a manifest by id.
    pub fn manifest(&self, out: &str) -> BTreeMap<String, Value> {
        let text = fs::read_to_string(self.path(out).join("manifest.jsonl")).expect("a manifest");
        let records = text
            .lines()
            .map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
        records
            .map(|r| (r["id"].as_str().expect("an id").to_owned(), r))
            .collect()
    }

    /// Ids whose record has this state.
    pub fn in_state(&self, out: &str, state: &str) -> BTreeSet<String> {
        let manifest = self.manifest(out).into_iter();
        manifest
            .filter(|(_, record)| record["state"] == state)
            .map(|(id, _)| id)
            .collect()
    }

    /// Every broken asset failed with its kind, and no other one.
    fn check_failures(&self, out: &str, said: &str) {
        let manifest = self.manifest(out);
        assert_eq!(manifest.len(), self.assets.len(), "{said}");
        for asset in &self.assets {
            let record = &manifest[&asset.id];
            let kind = record["kind"].as_str();
            assert_eq!(kind, asset.kind, "{record}");
            assert_eq!(
                record["state"] == "failed",
                asset.kind.is_some(),
                "{record}"
            );
        }
    }
}

/// Most memory that a process has held so far, bytes.
fn peak(process: u32) -> Option<u64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim()
        .strip_suffix("kB")?
        .trim()
        .parse::<u64>()
        .ok()
        .map(|kib| kib << 10)
}

fn mebibytes(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

/// `ratio`: how many times faster the second night must be.
pub fn night(count: usize, ratio: Option<f64>) -> Found {
    let night = Night::new(corpus(count));
    let broken: BTreeSet<String> = night
        .assets
        .iter()
        .filter(|a| a.kind.is_some())
        .map(|a| a.id.clone())
        .collect();
    assert_eq!(broken.len(), count / 20);
    let first = night.run("out", &[]);
    assert_eq!(first.code, Some(1), "{}", first.said);
    night.check_failures("out", &first.said);
    let after_first = atlases(&night.path("out"));
    assert_eq!(after_first.len(), count - broken.len());
    assert_eq!(unfinished(&night.path("out")), [""; 0]);
    check_junit(&night.path("out/junit.xml"), count, broken.len())?;

    let second = night.run("out", &[]);
    assert_eq!(second.code, Some(1), "{}", second.said);
    night.check_failures("out", &second.said);
    assert_eq!(night.in_state("out", "cached").len(), count - broken.len());
    assert!(
        atlases(&night.path("out")) == after_first,
        "the second night changed bytes"
    );
    let faster = first.seconds / second.seconds;
    if let Some(ratio) = ratio {
        assert!(
            faster >= ratio,
            "the second night took {:.1} s, the first {:.1} s",
            second.seconds,
            first.seconds
        );
    }

    // One input, one buffer of a glTF file, one table.
    let good = |suffix: &str| {
        let good = night.assets.iter().filter(|a| a.kind.is_none());
        good.filter(|a| a.files[a.files.len() - 1].0.ends_with(suffix))
            .nth(1)
    };
    let input = good(".obj").ok_or("an OBJ file")?;
    let buffer = good(".bin").ok_or("a glTF file with a buffer")?;
    let table = good(".ply").ok_or("a PLY file")?;
    let path = night.path("meshes").join(&input.files[0].0);
    let text = [fs::read(&path)?.as_slice(), b"# touched\n"].concat();
    fs::write(path, text)?;
    let path = night.path("meshes").join(&buffer.files[1].0);
    let mut bytes = fs::read(&path)?;
    bytes[4] ^= 1; // The last bit of a coordinate.
    fs::write(path, bytes)?;
    let path = night.path("config.toml");
    let more = format!(
        "[[asset]]\npath = \"meshes/{}\"\npatches.padding = 3\n",
        table.files[0].0
    );
    fs::write(&path, fs::read_to_string(&path)? + &more)?;
    let third = night.run("out", &[]);
    assert_eq!(third.code, Some(1), "{}", third.said);
    night.check_failures("out", &third.said);
    let expected: BTreeSet<String> = [input, buffer, table].map(|a| a.id.clone()).into();
    assert_eq!(night.in_state("out", "built"), expected);
    let after_third = atlases(&night.path("out"));
    let changed = after_third
        .iter()
        .filter(|(id, files)| after_first[*id] != **files);
    let changed: BTreeSet<String> = changed.map(|(id, _)| id.clone()).collect();
    assert_eq!(changed, expected);

    if ratio.is_none() {
        // Bytes do not depend on how many run at a time, nor on threads.
        let other = night.run("other", &["--jobs", "1", "--threads", "2"]);
        assert_eq!(other.code, Some(1), "{}", other.said);
        assert!(
            atlases(&night.path("other")) == after_third,
            "bytes depend on jobs"
        );
    }
    Ok(Some(format!(
        "{count} assets: first night {:.1} s, second {:.2} s ({faster:.0} times faster), third with 3 changes {:.2} s; \
         memory of the batch {:.1} MiB, {:.1} MiB, {:.1} MiB",
        first.seconds,
        second.seconds,
        third.seconds,
        mebibytes(first.memory),
        mebibytes(second.memory),
        mebibytes(third.memory)
    )))
}

fn check_junit(path: &Path, tests: usize, failed: usize) -> Result<(), Failed> {
    let text = fs::read_to_string(path)?;
    let document = roxmltree::Document::parse(&text)?;
    let suite = document
        .descendants()
        .find(|n| n.has_tag_name("testsuite"))
        .ok_or("a suite")?;
    let number = |name: &str| suite.attribute(name).and_then(|n| n.parse::<usize>().ok());
    assert_eq!(
        (number("tests"), number("failures"), number("errors")),
        (Some(tests), Some(failed), Some(0))
    );
    let cases = suite.children().filter(|n| n.has_tag_name("testcase"));
    assert_eq!(cases.count(), tests);
    Ok(())
}

/// How well cores are kept busy by equal assets, and what the batch itself takes for each.
pub fn efficiency() -> Found {
    const COUNT: usize = 200;
    let equal = corpus(1).remove(0);
    let (name, bytes) = &equal.files[0];
    let extension = name.rsplit('.').next().unwrap_or_default();
    let assets = (0..COUNT).map(|i| Asset {
        files: vec![(format!("e{i:03}.{extension}"), bytes.clone())],
        id: format!("e{i:03}"),
        kind: None,
        settings: None,
    });
    let night = Night::new(assets.collect());
    let jobs = std::thread::available_parallelism().map_or(1, usize::from);
    let one = night.run("one", &["--jobs", "1", "--threads", "1"]);
    let all = night.run("all", &["--threads", "1"]);
    assert_eq!(
        (one.code, all.code),
        (Some(0), Some(0)),
        "{}{}",
        one.said,
        all.said
    );
    let work: f64 = night
        .manifest("one")
        .values()
        .filter_map(|r| r["seconds"].as_f64())
        .sum();
    let overhead = 1e3 * (one.seconds - work) / COUNT as f64;
    let efficiency = one.seconds / all.seconds / jobs as f64;
    Ok(Some(format!(
        "{COUNT} equal assets: {:.1} s one after the other ({:.0} ms each, {overhead:.1} ms of it not in the job), {:.1} s with {jobs} at a time: \
         parallel efficiency {efficiency:.2}",
        one.seconds,
        1e3 * one.seconds / COUNT as f64,
        all.seconds
    )))
}
