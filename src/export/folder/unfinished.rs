//! Names of unfinished folders, putting finished ones in place, and clearing up after dead runs.

use crate::export::names::asset_name;
use std::fs;
use std::io;
use std::path::Path;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// Begins the name of everything that is not finished.
pub(super) const PREFIX: &str = ".affine-atlas-";

/// Puts `new` at `target`. What was at `target` is at `new` afterwards, or gone.
pub(super) fn replace(new: &Path, target: &Path) -> io::Result<()> {
    if !target.exists() {
        return fs::rename(new, target);
    }
    // Some file systems cannot exchange; where the reason is another one, the second way fails with it too.
    exchange(new, target).or_else(|_| set_aside(new, target))
}

#[cfg(any(target_os = "linux", target_os = "android", target_vendor = "apple"))]
pub(super) fn exchange(a: &Path, b: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE)?)
}

#[cfg(not(any(target_os = "linux", target_os = "android", target_vendor = "apple")))]
pub(super) fn exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// Replaces in two steps. A crash between them leaves the older folder set aside under a name from
/// which [`sweep`] puts it back.
pub(super) fn set_aside(new: &Path, target: &Path) -> io::Result<()> {
    let asset = target.file_name().unwrap_or_default().to_string_lossy();
    let aside = target.with_file_name(unfinished_name("aside", &asset));
    fs::rename(target, &aside)?;
    if let Err(error) = fs::rename(new, target) {
        fs::rename(&aside, target)?;
        return Err(error);
    }
    remove_folder(&aside);
    Ok(())
}

/// A hidden name that nothing else has, for what is being written.
pub(super) fn staging_name() -> String {
    unfinished_name("staging", "")
}

/// A hidden name that nothing else has: kind, machine, process and number, and which folder was set aside.
pub(super) fn unfinished_name(kind: &str, asset: &str) -> String {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    let process = std::process::id();
    format!("{PREFIX}{kind}-{}-{process}-{number}-{asset}", *MACHINE)
}

/// Short hash of the machine and its process numbering, so that runs on several machines (or in several
/// containers) that share a disk leave each other's folders alone. It is in temporary names only.
pub(super) static MACHINE: LazyLock<String> = LazyLock::new(|| {
    let host = fs::read("/proc/sys/kernel/hostname").or_else(|_| fs::read("/etc/hostname"));
    let namespace = fs::read_link("/proc/self/ns/pid").unwrap_or_default();
    let mut hasher = blake3::Hasher::new();
    hasher.update(&host.unwrap_or_default());
    hasher.update(namespace.to_string_lossy().as_bytes());
    hasher.finalize().to_hex()[..8].to_owned()
});

/// True where a process of this machine is known to have ended, its parent's waiting aside. Without `/proc` nothing is known.
pub(super) fn process_is_gone(process: u32) -> bool {
    if !Path::new("/proc/self").exists() {
        return false;
    }
    match fs::read_to_string(format!("/proc/{process}/stat")) {
        // The state stands after the program's name, which may hold anything, also brackets.
        Ok(stat) => stat
            .rsplit_once(") ")
            .is_some_and(|(_, rest)| rest.starts_with(['Z', 'X'])),
        Err(error) => error.kind() == io::ErrorKind::NotFound,
    }
}

/// See [`super::sweep_stale`]; `is_gone` tells whether a process has ended.
pub(super) fn sweep(output_root: &Path, is_gone: &dyn Fn(u32) -> bool) -> io::Result<()> {
    for entry in fs::read_dir(output_root)? {
        let entry = entry?;
        let name = entry.file_name();
        let Some(rest) = name.to_str().and_then(|n| n.strip_prefix(PREFIX)) else {
            continue;
        };
        let parts: Vec<&str> = rest.splitn(5, '-').collect();
        let [kind, machine, process, _, asset] = parts[..] else {
            continue;
        };
        if machine != *MACHINE || !process.parse().is_ok_and(is_gone) {
            continue;
        }
        let target = output_root.join(asset);
        let put_back = kind == "aside" && asset_name(asset).is_ok() && !target.exists();
        if put_back {
            fs::rename(entry.path(), target)?;
        } else if entry.file_type()?.is_dir() {
            remove_folder(&entry.path());
        } else {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

/// Removes a folder if it is there. What cannot be removed is hidden and swept by a later run.
pub(super) fn remove_folder(path: &Path) {
    // Another thread may still be adding a file: a second attempt finds it.
    for _ in 0..3 {
        match fs::remove_dir_all(path) {
            Ok(()) => return,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return,
            Err(error) => {
                tracing::warn!(path = %path.display(), %error, "could not remove a temporary folder");
            }
        }
    }
}
