use super::*;
use crate::batch::cache::Reason;
use crate::config::assets::Asset;
use crate::config::{Limit, RunParams};

/// A folder with three meshes and a plan of them, in two configurations.
struct Made {
    folder: tempfile::TempDir,
    plan: Plan,
}

fn asset(folder: &Path, id: &str) -> Asset {
    let path = folder.join(format!("{id}.obj"));
    Asset {
        id: id.into(),
        given: format!("{id}.obj").into(),
        path,
    }
}

fn purpose(folder: &Path) -> Purpose {
    Purpose {
        folder: folder.to_owned(),
        output: folder.join("out"),
        force: true,
        files: vec!["night.toml".into()],
        run: RunParams {
            jobs: 3,
            total_memory: 7,
            ..RunParams::default()
        },
    }
}

fn made() -> Made {
    let folder = tempfile::tempdir().unwrap();
    let plain = Arc::new(Settings::new(Config::default()));
    let mut config = Config::default();
    config.cones.quantum = "1/2".parse().unwrap();
    config.cones.count = Some(6);
    config.cones.file_lines = vec![3, 4];
    config.patches.max_count = Some(3);
    config.flow.curvature_tolerance = 0.1 + 0.2;
    config.run.timeout = Limit::At(60);
    let other = Arc::new(Settings::new(config));
    // Equal to the first, but not the same value.
    let again = Arc::new(Settings::new(Config::default()));
    let mut tasks = Vec::new();
    for (id, settings) in [("b", plain), ("ä c", other), ("a", again)] {
        let asset = asset(folder.path(), id);
        if id != "a" {
            fs::write(&asset.path, "v 0 0 0").unwrap();
        }
        tasks.push(Task::new(&asset, &settings));
    }
    let done = crate::outcome::AssetOutcome::whole("b", crate::outcome::AssetState::Cached, 0.0);
    let verdicts = [
        Verdict::Cached(Box::new(done)),
        Verdict::Build(Reason::New),
        Verdict::Build(Reason::InputUnreadable),
    ];
    let plan = Plan::new(purpose(folder.path()), tasks, &verdicts).unwrap();
    Made { folder, plan }
}

impl Made {
    fn file(&self) -> PathBuf {
        self.folder.path().join("plan.jsonl")
    }

    fn read(&self, text: impl AsRef<[u8]>) -> Result<Plan, PlanError> {
        fs::write(self.file(), text).unwrap();
        Plan::read(&self.file())
    }

    /// What is said of a text, without the name of its file.
    fn said(&self, text: impl AsRef<[u8]>) -> String {
        let said = self.read(text).unwrap_err().to_string();
        said.replace(&*self.file().to_string_lossy(), "P")
    }
}

/// The lines of a plan, changed, with the hash that they have then.
fn changed(plan: &Plan, change: impl Fn(&mut Vec<String>)) -> String {
    let mut lines: Vec<String> = plan.to_text().lines().map(str::to_owned).collect();
    lines.pop();
    change(&mut lines);
    let mut text = lines.join("\n") + "\n";
    let blake3 = blake3::hash(text.as_bytes()).to_hex().to_string();
    text.push_str(&line_of(&Line::End(End { blake3 })));
    text.push('\n');
    text
}

#[test]
fn a_plan_reads_back_as_it_was() {
    let made = made();
    let back = made.read(made.plan.to_text()).unwrap();
    assert_eq!(back, made.plan);
    let tasks: Vec<&Task> = back.assets.iter().map(|asset| &asset.task).collect();
    // `Task` compares settings, and with them what no hash holds.
    assert_eq!(tasks[1].settings.config.cones.file_lines, [3, 4]);
    assert_eq!(tasks[1].settings.config.run.timeout, Limit::At(60));
    assert_eq!(
        tasks[1].settings.flat,
        made.plan.assets[1].task.settings.flat
    );
    assert_eq!(tasks[2].input_hash, None);
    assert_eq!((back.header.jobs, back.header.total_memory), (3, 7));
    assert_eq!((back.header.configurations, back.header.assets), (2, 3));
    assert_eq!(back.to_text(), made.plan.to_text());
    let cached = &back.assets[0];
    assert_eq!((cached.decision, &cached.reason), (Decision::Cached, &None));
    assert_eq!(back.assets[1].reason.as_deref(), Some("new"));
    assert!(cached.estimate < back.assets[1].estimate);
}

#[test]
fn the_same_work_planned_twice_is_two_plans() {
    let made = made();
    let tasks = || made.plan.assets.iter().map(|asset| asset.task.clone());
    let verdicts: Vec<Verdict> = tasks().map(|_| Verdict::Build(Reason::Forced)).collect();
    let plan = || Plan::new(purpose(made.folder.path()), tasks().collect(), &verdicts).unwrap();
    assert_ne!(plan().header.id, plan().header.id);
}

#[test]
fn no_damage_goes_unnoticed() {
    let made = made();
    let whole = made.plan.to_text().into_bytes();
    for at in (0..whole.len()).step_by(3) {
        let mut damaged = whole.clone();
        damaged[at] ^= 1;
        assert!(made.read(&damaged).is_err(), "byte {at}");
        assert!(made.read(&whole[..at]).is_err(), "cut at {at}");
    }
    for from in 0..7 {
        let mut lines: Vec<&[u8]> = whole.split_inclusive(|&b| b == b'\n').collect();
        lines.remove(from);
        assert!(made.read(lines.concat()).is_err(), "without line {from}");
        let mut lines: Vec<&[u8]> = whole.split_inclusive(|&b| b == b'\n').collect();
        lines.insert(from, lines[from]);
        assert!(made.read(lines.concat()).is_err(), "line {from} twice");
    }
}

#[test]
fn every_refusal_says_what_is_wrong() {
    let made = made();
    let text = made.plan.to_text();
    let line = |number: usize| text.lines().nth(number - 1).unwrap();
    assert_eq!(
        Plan::read(Path::new("none.jsonl")).unwrap_err().to_string(),
        "the plan none.jsonl cannot be read: there is no such file"
    );
    let no_plan = "P is no plan: its first line is not one that `affine-atlas plan` writes";
    assert_eq!(made.said(""), no_plan);
    assert_eq!(made.said(b"glTF\x02\0\n\xff"), no_plan);
    assert_eq!(made.said("{\"id\":\"a\",\"state\":\"built\"}\n"), no_plan);
    assert_eq!(made.said(text.replace("atlas-plan", "atlas-plum")), no_plan);
    assert_eq!(
        made.said(text.replace("\"version\":1", "\"version\":2")),
        "the plan P has version 2 of its format, and this program reads version 1"
    );
    let version = format!("\"program_version\":\"{VERSION}\"");
    assert_eq!(
        made.said(text.replace(&version, "\"program_version\":\"0.0.9\"")),
        format!("the plan P was made by version 0.0.9 of affine-atlas, and this is {VERSION}")
    );
    let cut = &text[..text.find(line(5)).unwrap() + 9];
    assert_eq!(
        made.said(cut),
        "the plan P ends after line 4, and its last line is missing"
    );
    let damaged = made.said(text.replace("\"cost\":7", "\"cost\":\"7\""));
    assert!(
        damaged.starts_with("line 4 of the plan P is damaged: invalid type: string"),
        "{damaged}"
    );
    let other = text.replace("b.obj", "c.obj");
    let said = made.said(&other);
    assert!(
        said.starts_with("the plan P was changed: its lines have the hash "),
        "{said}"
    );
    assert_eq!(
        made.said(text.clone() + "\n"),
        "line 8 of the plan P is damaged: it follows the last one"
    );
    // What only a mistaken program could write.
    let padding = changed(&made.plan, |lines| {
        lines[1] = lines[1].replace("\"padding\":2", "\"padding\":3");
    });
    let said = made.said(&padding);
    let stated = &made.plan.assets[0].task.config_hash;
    assert!(
        said.starts_with("line 2 of the plan P: the configuration has the hash ")
            && said.ends_with(&format!(" here and {stated} where the plan was made")),
        "{said}"
    );
    let swapped = changed(&made.plan, |lines| {
        lines[3] = lines[3].replace("\"configuration\":0", "\"configuration\":1");
    });
    let said = made.said(&swapped);
    assert!(
        said.starts_with("line 4 of the plan P is damaged: its configuration has the hash "),
        "{said}"
    );
    for (from, to, said) in [
        (
            "\"configuration\":0",
            "\"configuration\":7",
            "it names configuration 7 of 2",
        ),
        (
            "\"id\":\"b\"",
            "\"id\":\"../b\"",
            "\"../b\" is no name of an asset",
        ),
        (
            "\"id\":\"b\"",
            "\"id\":\"logs\"",
            "\"logs\" is no name of an asset",
        ),
    ] {
        let text = changed(&made.plan, |lines| lines[3] = lines[3].replace(from, to));
        let expected = format!("line 4 of the plan P is damaged: {said}");
        assert_eq!(made.said(text), expected);
    }
    let twice = changed(&made.plan, |lines| lines.insert(4, lines[3].clone()));
    assert_eq!(
        made.said(twice),
        "line 5 of the plan P is damaged: b is there twice"
    );
    let fewer = changed(&made.plan, |lines| drop(lines.pop()));
    assert_eq!(
        made.said(fewer),
        "line 1 of the plan P is damaged: it states 2 configurations and 3 assets, and 2 and 2 follow"
    );
    let late = changed(&made.plan, |lines| lines.swap(2, 3));
    assert_eq!(
        made.said(late),
        "line 4 of the plan P is damaged: it is not where it belongs"
    );
    let id = changed(&made.plan, |lines| {
        lines[0] = lines[0].replace(&made.plan.header.id, "../../etc");
    });
    assert_eq!(
        made.said(id),
        "line 1 of the plan P is damaged: \"../../etc\" is no id of a plan"
    );
}

#[cfg(unix)]
#[test]
fn paths_that_are_no_text_are_refused() {
    use std::os::unix::ffi::OsStrExt;
    let folder = tempfile::tempdir().unwrap();
    let mut asset = asset(folder.path(), "a");
    let settings = Arc::new(Settings::new(Config::default()));
    asset.path = folder.path().join(std::ffi::OsStr::from_bytes(b"\xff.obj"));
    let task = Task::new(&asset, &settings);
    let verdicts = [Verdict::Build(Reason::New)];
    let error = Plan::new(purpose(folder.path()), vec![task], &verdicts).unwrap_err();
    assert!(matches!(error, PlanError::NotUnicode { .. }), "{error}");
}

#[test]
fn a_plan_knows_its_place() {
    let Made { folder, mut plan } = made();
    let here = folder.path();
    let elsewhere = tempfile::tempdir().unwrap();
    plan.check_place(here).unwrap();
    let hidden = |from: &str, to: &str| fs::rename(here.join(from), here.join(to)).unwrap();
    hidden("b.obj", "x");
    plan.check_place(here).unwrap();
    hidden("ä c.obj", "y");
    let error = plan.check_place(here).unwrap_err();
    assert!(matches!(error, PlanError::NothingHere { .. }), "{error}");
    plan.mark_place().unwrap();
    plan.check_place(here).unwrap();
    fs::remove_dir_all(&plan.header.output).unwrap();
    hidden("x", "b.obj");
    hidden("y", "ä c.obj");
    // Nothing says that this is the same folder under another name.
    let error = plan.check_place(elsewhere.path()).unwrap_err();
    assert!(error.to_string().contains(&plan.header.id), "{error}");
    plan.mark_place().unwrap();
    plan.check_place(elsewhere.path()).unwrap();
    // The output root is found, relative inputs are not.
    for planned in &mut plan.assets {
        planned.task.path = planned.task.given.clone();
    }
    let error = plan.check_place(elsewhere.path()).unwrap_err();
    assert!(
        error
            .to_string()
            .ends_with("from where b.obj is not to be seen"),
        "{error}"
    );
    plan.assets[1].task.path = here.join(&plan.assets[1].task.path);
    let error = plan.check_place(elsewhere.path()).unwrap_err();
    assert!(matches!(error, PlanError::Elsewhere { .. }), "{error}");
    // One that could not be read before is no evidence.
    plan.assets.remove(0);
    plan.check_place(elsewhere.path()).unwrap();
}
