//! Acts in which nothing can be written.

use crate::folders::unfinished;
use crate::stage::{ASSETS, Run, Stage};
use libtest_mimic::Failed;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

type Found = Result<Option<String>, Failed>;

/// Why an act cannot be tried on this machine.
pub fn impossible(name: &str) -> Option<&'static str> {
    match name {
        "the_disk_is_full" => {
            let Some(_mounted) = Mount::new(1) else {
                return Some("a file system cannot be mounted");
            };
            None
        }
        _ => None,
    }
}

/// A small disk in memory.
struct Mount(tempfile::TempDir);

impl Mount {
    fn new(mebibytes: usize) -> Option<Self> {
        let folder = tempfile::tempdir().ok()?;
        mount(&format!("size={mebibytes}m"), folder.path()).then_some(Self(folder))
    }

    fn grow(&self, mebibytes: usize) {
        assert!(mount(&format!("remount,size={mebibytes}m"), self.0.path()));
    }
}

fn mount(options: &str, at: &Path) -> bool {
    let mut command = Command::new("mount");
    command
        .args(["-t", "tmpfs", "-o", options, "tmpfs"])
        .arg(at);
    command.output().is_ok_and(|output| output.status.success())
}

impl Drop for Mount {
    fn drop(&mut self) {
        // What stays mounted is in memory only, and gone with the machine.
        let _ = Command::new("umount").arg(self.0.path()).output();
    }
}

/// What fits is built, the rest fails with its kind, and once there is room the rest is built.
pub fn the_disk_is_full() -> Found {
    let disk = Mount::new(4).ok_or("mounted a moment ago")?;
    let mut stage = Stage::at(Some(disk.0.path().join("out")));
    let (code, said) = Run::start(stage.command()).end();
    assert_eq!(code, Some(1), "{said}");
    let done = stage.done();
    assert!((1..ASSETS).contains(&done), "{done} done: {said}");
    assert!(
        said.contains("(output)") && said.contains("free some space"),
        "{said}"
    );
    assert!(!said.contains("internal"), "{said}");
    stage.nothing_is_lost();
    assert_eq!(unfinished(&stage.out), [""; 0]);
    disk.grow(100);
    stage.completes();
    Ok(None)
}

/// The same where no file may be longer than so much, which needs no rights: older outputs stay.
pub fn files_may_not_grow() -> Found {
    let mut stage = Stage::new();
    let mut command = Command::new("sh");
    let limited = stage.command();
    command
        .current_dir(stage.folder())
        .env("NO_COLOR", "1")
        // Blocks of 512 bytes; without the trap the system would end the program instead of refusing to write.
        .args(["-c", "trap '' XFSZ; ulimit -f 60; exec \"$0\" \"$@\""])
        .arg(limited.get_program())
        .args(limited.get_args());
    let (code, said) = Run::start(command).end();
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("(output)"), "{said}");
    stage.nothing_is_lost();
    assert_eq!(unfinished(&stage.out), [""; 0]);
    assert!(stage.done() < ASSETS);
    stage.completes();
    Ok(None)
}

/// A file stands where the output root, or a folder above it, should be: also root cannot write there.
pub fn the_root_cannot_be_written() -> Found {
    let mut stage = Stage::new();
    let (good, blocked) = (stage.out.clone(), stage.folder().join("blocked"));
    fs::write(&blocked, "mine")?;
    for out in [blocked.clone(), blocked.join("below")] {
        stage.out = out;
        let (code, said) = Run::start(stage.command()).end();
        assert_eq!(code, Some(1), "{said}");
        assert!(said.contains("blocked"), "{said}");
        assert!(!said.contains("internal"), "{said}");
    }
    assert_eq!(fs::read(&blocked)?, b"mine");
    stage.out = good;
    stage.nothing_is_lost();
    stage.completes();
    Ok(None)
}

/// Something of the user stands where one asset's folder should be: it stays, and only that asset fails.
pub fn an_asset_s_place_is_taken() -> Found {
    let mut stage = Stage::new();
    let places: [PathBuf; 2] = ["set-0-a0005", "set-0-a0006"].map(|id| stage.out.join(id));
    for (i, place) in places.iter().enumerate() {
        // In one step: the watcher must not see it half removed.
        fs::rename(place, stage.folder().join(format!("aside-{i}")))?;
    }
    fs::write(&places[0], "mine")?;
    let (code, said) = Run::start(stage.command()).end();
    assert_eq!(code, Some(1), "{said}");
    assert_eq!(stage.in_state("failed"), ["set-0-a0005"], "{said}");
    assert_eq!(stage.manifest()["set-0-a0005"]["kind"], "output");
    assert_eq!(fs::read(&places[0])?, b"mine");
    fs::remove_file(&places[0])?;
    stage.completes();
    assert_eq!(stage.in_state("built"), ["set-0-a0005"]);
    Ok(None)
}
