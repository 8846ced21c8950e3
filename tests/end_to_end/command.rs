//! The program as a child process, and what it leaves.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The program, as if its output went to a file. It runs in the package's folder, so that messages hold no
/// absolute path.
pub fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_affine-atlas"));
    command
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env_remove("RUST_BACKTRACE")
        .env_remove("COLUMNS")
        .env("NO_COLOR", "1");
    command
}

/// A finished build in a temporary folder.
pub struct Built {
    /// Folder of all assets.
    pub folder: tempfile::TempDir,
    /// What the program said.
    pub output: Output,
}

/// Builds without pictures, which most tests do not look at and which take most of the time.
pub fn build(mesh: &Path, settings: &[&str]) -> Built {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = build_into(folder.path(), mesh, settings);
    Built { folder, output }
}

/// The same with small images and without a page, for tests of what comes before these.
pub fn build_small(mesh: &Path, settings: &[&str]) -> Built {
    let small = ["patches.texel_budget=4096", "report.enabled=false"];
    build(mesh, &[&small, settings].concat())
}

/// As `build`, into a given folder.
pub fn build_into(folder: &Path, mesh: &Path, settings: &[&str]) -> Output {
    let mut command = program();
    command.arg("build").arg("--quiet").arg(mesh);
    command.arg("--out").arg(folder);
    for setting in ["pictures.enabled=false"].iter().chain(settings) {
        command.arg("--set").arg(setting);
    }
    command.output().expect("the program starts")
}

impl Built {
    /// The exit code; a signal, such as that of a crash, has none.
    pub fn code(&self) -> Option<i32> {
        self.output.status.code()
    }

    /// What stands on standard error.
    pub fn message(&self) -> String {
        String::from_utf8(self.output.stderr.clone()).expect("UTF-8")
    }

    /// Folders that hold an `atlas.json`, by name.
    pub fn atlases(&self) -> Vec<PathBuf> {
        let mut found = Vec::new();
        let mut open = vec![self.folder.path().to_path_buf()];
        while let Some(folder) = open.pop() {
            if folder.join("atlas.json").is_file() {
                found.push(folder.clone());
            }
            let entries = std::fs::read_dir(&folder).expect("readable").flatten();
            open.extend(entries.map(|e| e.path()).filter(|p| p.is_dir()));
        }
        found.sort();
        found
    }

    /// The only atlas of a build that must have succeeded.
    pub fn atlas(&self) -> PathBuf {
        assert_eq!(self.code(), Some(0), "{}", self.message());
        let [only] = &self.atlases()[..] else {
            panic!("{:?}", self.atlases());
        };
        only.clone()
    }
}

/// `atlas.json`.
pub fn document(atlas: &Path) -> serde_json::Value {
    let text = std::fs::read(atlas.join("atlas.json")).expect("atlas.json");
    serde_json::from_slice(&text).expect("JSON")
}

/// Has the program read an atlas back; every check must pass.
pub fn verify(atlas: &Path) {
    let output = program().arg("verify").arg(atlas).output();
    let output = output.expect("the program starts");
    let said = String::from_utf8_lossy(&output.stdout);
    let failed: Vec<&str> = said.lines().filter(|l| l.starts_with("FAIL")).collect();
    assert!(output.status.success(), "{atlas:?}: {failed:#?}");
}
