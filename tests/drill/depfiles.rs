//! The depfile, read by the programs that it is for.

use crate::generate::batch::{CONFIG, corpus};
use libtest_mimic::Failed;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, SystemTime};

type Found = Result<Option<String>, Failed>;

/// Where a program is: in the `PATH`, or beside the Python that tests may use.
fn find(name: &str) -> Option<PathBuf> {
    let python = std::env::var_os("AFFINE_ATLAS_PYTHON").map(PathBuf::from);
    let beside = python.as_deref().and_then(Path::parent).map(Path::to_owned);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::env::split_paths(&path).chain(beside);
    let mut files = folders.map(|folder| folder.join(name));
    files.find(|file| file.is_file())
}

/// Why an act cannot be tried on this machine.
pub fn impossible(name: &str) -> Option<&'static str> {
    match name {
        "ninja_reads_the_depfile" => find("ninja").is_none().then_some("there is no ninja"),
        "make_reads_the_depfile" => find("make").is_none().then_some("there is no make"),
        _ => None,
    }
}

/// Two meshes, one with a buffer, in a folder whose name holds everything that wants escaping.
struct Project {
    folder: tempfile::TempDir,
    files: Vec<PathBuf>,
}

impl Project {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut files = Vec::new();
        for asset in corpus(7)
            .into_iter()
            .filter(|a| a.id.ends_with('0') || a.id.ends_with('6'))
        {
            for (name, bytes) in asset.files {
                let path = folder.path().join("odd $na#me, two  blanks").join(name);
                fs::create_dir_all(path.parent().expect("a folder")).expect("made");
                fs::write(&path, bytes).expect("written");
                files.push(path);
            }
        }
        assert_eq!(files.len(), 3);
        let config = format!("{CONFIG}[input]\npaths = [\".\"]\n");
        fs::write(folder.path().join("night.toml"), config).expect("written");
        files.push(folder.path().join("night.toml"));
        Self { folder, files }
    }

    /// Runs a program in the folder and gives what it said.
    fn run(&self, program: &Path, arguments: &[&str]) -> String {
        let output = Command::new(program)
            .args(arguments)
            .current_dir(self.folder.path())
            .output();
        let output = output.expect("starts");
        let said = format!(
            "{}{}",
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr)
        );
        assert!(output.status.success(), "{said}");
        said
    }

    /// Builds, finds nothing to do, and builds again after each file was touched.
    fn is_followed(&self, program: &Path, arguments: &[&str]) {
        let ran = |said: &str| said.contains("ATLASES");
        assert!(ran(&self.run(program, arguments)));
        assert!(self.folder.path().join("out/manifest.jsonl").is_file());
        for file in &self.files {
            let said = self.run(program, arguments);
            assert!(!ran(&said), "{said}");
            let later = SystemTime::now() + Duration::from_millis(20);
            std::thread::sleep(Duration::from_millis(40));
            let touched = fs::File::options()
                .append(true)
                .open(file)
                .and_then(|f| f.set_modified(later));
            touched.expect("touched");
            let said = self.run(program, arguments);
            assert!(ran(&said), "{} was not noticed: {said}", file.display());
        }
        // A file that is gone is no error either.
        fs::remove_file(&self.files[0]).expect("removed");
        assert!(ran(&self.run(program, arguments)));
    }
}

const PROGRAM: &str = env!("CARGO_BIN_EXE_affine-atlas");

/// Ninja.
pub fn ninja() -> Found {
    let project = Project::new();
    let text = format!(
        "rule atlases\n  command = echo ATLASES && {PROGRAM} build night.toml --quiet --out out --depfile out.d\n  depfile = out.d\nbuild out/manifest.jsonl: atlases\n"
    );
    fs::write(project.folder.path().join("build.ninja"), text)?;
    project.is_followed(&find("ninja").ok_or("no ninja")?, &["-v"]);
    Ok(None)
}

/// Make.
pub fn make() -> Found {
    let project = Project::new();
    let text = format!(
        "out/manifest.jsonl:\n\techo ATLASES && {PROGRAM} build night.toml --quiet --out out --depfile out.d\n-include out.d\n"
    );
    fs::write(project.folder.path().join("Makefile"), text)?;
    project.is_followed(&find("make").ok_or("no make")?, &["--silent"]);
    Ok(None)
}
