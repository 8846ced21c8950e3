//! What every act needs: 60 assets, last night's outputs, tonight's, and the program under watch.

use crate::folders::{atlases, half_written, unfinished, visible};
use crate::generate::batch::{CONFIG, corpus};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Assets of an act.
pub const ASSETS: usize = 60;
/// What has changed since last night.
const TONIGHT: &[&str] = &["--set", "patches.padding=3"];

/// Bytes of all atlases of a root, by id and file.
pub type Atlases = BTreeMap<String, BTreeMap<String, String>>;

/// Inputs, and what undisturbed runs make of them last night and tonight.
struct Reference {
    folder: tempfile::TempDir,
    last_night: Atlases,
    tonight: Atlases,
}

static REFERENCE: LazyLock<Reference> = LazyLock::new(|| {
    BEGUN.store(true, Ordering::Relaxed);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let meshes = folder.path().join("meshes");
    // Only good ones: what goes wrong comes from outside.
    let good = corpus(2 * ASSETS)
        .into_iter()
        .filter(|asset| asset.kind.is_none());
    for asset in good.take(ASSETS) {
        for (name, bytes) in asset.files {
            let path = meshes.join(name);
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, bytes).expect("written");
        }
    }
    fs::write(
        folder.path().join("config.toml"),
        format!("{CONFIG}[input]\npaths = [\"meshes\"]\n"),
    )
    .expect("written");
    let build = |settings: &[&str], name: &str| {
        let out = folder.path().join(name);
        let output = program(folder.path())
            .args(settings)
            .arg("--out")
            .arg(&out)
            .output();
        let output = output.expect("the program starts");
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        atlases(&out)
    };
    let last_night = build(&[], "last-night");
    let tonight = build(TONIGHT, "tonight");
    assert_eq!((last_night.len(), tonight.len()), (ASSETS, ASSETS));
    assert!(last_night.iter().all(|(id, files)| tonight[id] != *files));
    Reference {
        folder,
        last_night,
        tonight,
    }
});

fn program(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_affine-atlas"));
    command
        .args(["build", "config.toml"])
        .current_dir(folder)
        .env("NO_COLOR", "1")
        .env_remove("RUST_BACKTRACE");
    command
}

/// Removes what all acts share, which nobody owns.
pub fn clear_up() {
    if BEGUN.load(Ordering::Relaxed) {
        let _ = fs::remove_dir_all(REFERENCE.folder.path());
    }
}

static BEGUN: AtomicBool = AtomicBool::new(false);

/// One act: an output root with last night's atlases, and tonight's settings.
pub struct Stage {
    folder: tempfile::TempDir,
    /// The output root.
    pub out: PathBuf,
    settings: Vec<String>,
    watcher: Option<Watcher>,
}

impl Stage {
    /// In a temporary folder.
    pub fn new() -> Self {
        Self::at(None)
    }

    /// In an output root of its own, which is empty.
    pub fn at(out: Option<PathBuf>) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        copy(
            &REFERENCE.folder.path().join("meshes"),
            &folder.path().join("meshes"),
        );
        let config = REFERENCE.folder.path().join("config.toml");
        fs::copy(config, folder.path().join("config.toml")).expect("copied");
        let out = out.unwrap_or_else(|| {
            let out = folder.path().join("out");
            copy(&REFERENCE.folder.path().join("last-night"), &out);
            out
        });
        let watcher = Watcher::start(&out);
        Self {
            folder,
            out,
            settings: TONIGHT.iter().map(|&s| s.to_owned()).collect(),
            watcher: Some(watcher),
        }
    }

    /// The folder of `config.toml` and `meshes`.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The command of tonight.
    pub fn command(&self) -> Command {
        let mut command = program(self.folder.path());
        command.args(&self.settings).arg("--out").arg(&self.out);
        command
    }

    /// Adds text to the configuration.
    pub fn configure(&self, text: &str) {
        let path = self.folder().join("config.toml");
        let config = fs::read_to_string(&path).expect("there");
        fs::write(path, format!("{config}{text}")).expect("written");
    }

    /// The manifest's records by id. It must be whole at any time.
    pub fn manifest(&self) -> BTreeMap<String, Value> {
        let text = fs::read_to_string(self.out.join("manifest.jsonl")).unwrap_or_default();
        let records = text
            .lines()
            .map(|line| serde_json::from_str::<Value>(line).expect("whole lines"));
        records
            .map(|r| (r["id"].as_str().expect("an id").to_owned(), r))
            .collect()
    }

    /// Ids whose record has this state.
    pub fn in_state(&self, state: &str) -> Vec<String> {
        let manifest = self.manifest();
        let mine = manifest
            .iter()
            .filter(|(_, record)| record["state"] == state);
        mine.map(|(id, _)| id.clone()).collect()
    }

    /// Every folder is last night's or tonight's, to the byte.
    pub fn nothing_is_lost(&self) {
        for (id, files) in atlases(&self.out) {
            let good = files == REFERENCE.last_night[&id] || files == REFERENCE.tonight[&id];
            assert!(good, "{id} is neither last night's nor tonight's");
        }
    }

    /// How many of the folders are tonight's.
    pub fn done(&self) -> usize {
        let atlases = atlases(&self.out);
        atlases
            .iter()
            .filter(|(id, files)| **files == REFERENCE.tonight[*id])
            .count()
    }

    /// The same command again must complete, with exactly tonight's bytes and nothing left over.
    pub fn completes(&mut self) -> Output {
        let output = self.command().output().expect("the program starts");
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{said}");
        self.ends_well();
        output
    }

    /// See [`Stage::completes`].
    pub fn ends_well(&mut self) {
        assert_eq!(atlases(&self.out), REFERENCE.tonight);
        assert_eq!(unfinished(&self.out), [""; 0]);
        let manifest = self.manifest();
        assert_eq!(manifest.len(), ASSETS);
        for (id, record) in manifest {
            assert!(
                record["state"] == "built" || record["state"] == "cached",
                "{id}: {record}"
            );
        }
        self.look_away();
    }

    /// Nothing half written was seen so far; from here on nobody looks.
    pub fn look_away(&mut self) {
        if let Some(watcher) = self.watcher.take() {
            watcher.stop();
        }
    }
}

/// Copies a folder.
pub fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("made");
    for entry in fs::read_dir(from).expect("readable").flatten() {
        let (source, target) = (entry.path(), to.join(entry.file_name()));
        if source.is_dir() {
            copy(&source, &target);
        } else {
            fs::copy(source, target).expect("copied");
        }
    }
}

/// Looks all the time whether a folder is half written.
struct Watcher {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<(usize, Vec<String>)>,
}

impl Watcher {
    fn start(out: &Path) -> Self {
        let (stop, out) = (Arc::new(AtomicBool::new(false)), out.to_owned());
        let seen = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            let (mut looks, mut wrong) = (0, Vec::new());
            while !seen.load(Ordering::Relaxed) {
                for name in visible(&out) {
                    wrong.extend(half_written(&out.join(name)));
                    looks += 1;
                }
                std::thread::sleep(Duration::from_millis(5));
            }
            (looks, wrong)
        });
        Self { stop, thread }
    }

    fn stop(self) {
        self.stop.store(true, Ordering::Relaxed);
        let (looks, wrong) = self.thread.join().expect("the watcher ends");
        assert!(looks > 0, "nobody looked");
        assert_eq!(wrong, [""; 0]);
    }
}

/// A run under way.
pub struct Run {
    child: Child,
    lines: Arc<Mutex<Vec<String>>>,
    reader: JoinHandle<()>,
}

impl Run {
    /// Starts a command.
    pub fn start(mut command: Command) -> Self {
        let mut child = command
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let lines = Arc::new(Mutex::new(Vec::new()));
        let (to, from) = (Arc::clone(&lines), child.stderr.take().expect("piped"));
        let reader = std::thread::spawn(move || {
            for line in BufReader::new(from).lines().map_while(Result::ok) {
                to.lock().expect("no panic").push(line);
            }
        });
        Self {
            child,
            lines,
            reader,
        }
    }

    /// Its process number.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Waits until so many assets are built.
    pub fn wait_for(&self, built: usize) {
        let since = Instant::now();
        loop {
            let lines = self.lines.lock().expect("no panic").clone();
            if lines
                .iter()
                .filter(|line| line.contains(": built after"))
                .count()
                >= built
            {
                return;
            }
            assert!(since.elapsed() < Duration::from_secs(300), "{lines:#?}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Waits for its end: exit code and what it said.
    pub fn end(mut self) -> (Option<i32>, String) {
        let status = self.child.wait().expect("ends");
        self.reader.join().expect("ends");
        let lines = self.lines.lock().expect("no panic").join("\n");
        (status.code(), lines)
    }
}

/// The workers of a batch, by `/proc`.
pub fn workers(batch: u32) -> Vec<u32> {
    let entries = fs::read_dir("/proc").into_iter().flatten().flatten();
    let numbers = entries.filter_map(|e| e.file_name().to_str()?.parse::<u32>().ok());
    numbers.filter(|&n| parent(n) == Some(batch)).collect()
}

fn stat(process: u32) -> Option<String> {
    let text = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    Some(text.rsplit_once(") ")?.1.to_owned())
}

fn parent(process: u32) -> Option<u32> {
    stat(process)?.split(' ').nth(1)?.parse().ok()
}

/// Whether a process still does something.
pub fn lives(process: u32) -> bool {
    stat(process).is_some_and(|stat| !stat.starts_with(['Z', 'X']))
}

/// Sends a signal. The shell's own `kill`: a bare machine may have no other.
pub fn kill(signal: &str, process: u32) -> bool {
    let line = format!("kill -{signal} {process} 2>/dev/null");
    Command::new("sh")
        .args(["-c", &line])
        .status()
        .is_ok_and(|s| s.success())
}
