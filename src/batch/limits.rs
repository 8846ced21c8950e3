//! What a worker process may take, and what the machine has.
//!
//! The cap is on `RLIMIT_DATA`: memory that the process can write, thread stacks included. `RLIMIT_AS` would also count the program's
//! own file and the address space that allocators reserve without using it, which differ from machine to machine.

mod groups;

use crate::atlas::patches::Domain;
use crate::config::Config;
use std::fs;
use std::path::Path;

/// Caps the memory that this process can write, bytes; 0 leaves it as it is.
///
/// # Errors
/// What the system said, for example that a lower cap is set already.
#[cfg(unix)]
pub fn cap_memory(bytes: u64) -> std::io::Result<()> {
    use rustix::process::{Resource, Rlimit, setrlimit};
    if bytes == 0 {
        return Ok(());
    }
    let limit = Rlimit {
        current: Some(bytes),
        maximum: Some(bytes),
    };
    Ok(setrlimit(Resource::Data, limit)?)
}

/// Without limits of the system there is no cap.
#[cfg(not(unix))]
pub fn cap_memory(_: u64) -> std::io::Result<()> {
    Ok(())
}

/// Has the system end this process when `parent` ends, and says whether that one is still there. Bound to the *thread* of the parent
/// that started this process: it must be one that lives as long as the run.
#[cfg(target_os = "linux")]
pub fn die_with(parent: u32) -> bool {
    use rustix::process::{Signal, getppid, set_parent_process_death_signal};
    // Where the system refuses, the end of standard input still ends this process.
    let _ = set_parent_process_death_signal(Some(Signal::KILL));
    getppid()
        .is_some_and(|now| u32::try_from(now.as_raw_nonzero().get()).is_ok_and(|now| now == parent))
}

/// Elsewhere the end of standard input is all there is.
#[cfg(not(target_os = "linux"))]
pub fn die_with(_: u32) -> bool {
    true
}

/// Most memory that this process has held so far, bytes, where the system tells (Linux).
#[must_use]
pub fn peak_memory() -> Option<u64> {
    kibibytes(&fs::read_to_string("/proc/self/status").ok()?, "VmHWM:")
}

/// Memory that new processes can take without swapping, bytes, where the system tells: of the machine, or less where this process is
/// in a group with a limit.
#[must_use]
pub fn available_memory() -> Option<u64> {
    let machine = kibibytes(&fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:");
    match (machine, groups::memory_left()) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (one, other) => one.or(other),
    }
}

/// Processes that the system has ended for want of memory since it started, where it tells.
#[must_use]
pub fn processes_ended_for_memory() -> Option<u64> {
    let text = fs::read_to_string("/proc/vmstat").ok()?;
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("oom_kill "))?;
    line.trim().parse().ok()
}

/// Cores that this process may use.
#[must_use]
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Name of this machine, where it has one.
#[must_use]
pub fn host() -> Option<String> {
    let read = |path: &str| fs::read_to_string(Path::new(path)).ok();
    let name = read("/proc/sys/kernel/hostname").or_else(|| read("/etc/hostname"))?;
    let name = name.trim();
    (!name.is_empty()).then(|| name.to_owned())
}

fn kibibytes(text: &str, key: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}

/// Memory that a process needs whatever it builds: 8 MiB for a file that is refused, 18 MiB for a small mesh with small images.
const BASE: u64 = 16 << 20;
/// Per byte of input: 60 for 2.4 MB of OBJ; binary formats hold the same in fewer.
const PER_BYTE: u64 = 100;
/// Per texel: 340 for the default budget, of channels, their compressed copy and the mesh that is rebuilt to measure them.
const PER_TEXEL: u64 = 350;

/// Most memory that building an asset is expected to take, bytes: a rule of thumb by which jobs are held back, not a limit.
#[must_use]
pub fn estimate(input_bytes: u64, config: &Config) -> u64 {
    let images = texels(config).saturating_mul(PER_TEXEL);
    BASE.saturating_add(input_bytes.saturating_mul(PER_BYTE))
        .saturating_add(images)
}

/// Texels of a mesh, about.
fn texels(config: &Config) -> u64 {
    match config.domain() {
        Domain::Flat => config.patches.texel_budget as u64,
        Domain::Grid => config.grid.texels() as u64,
    }
}

/// Time that any mesh takes, milliseconds; this and the following measured with one thread on box.stl (684 bytes), spot.obj (0.3 MiB)
/// and nefertiti.obj (3.5 MiB) with 4096, 262,144 and 1,048,576 texels, with and without pictures.
const BASE_TIME: u64 = 100;
/// Per mebibyte of input: 1.5 s to 2 s for these, 7 s for kitten.obj; by more than between linear and n log n they differ in shape. Each
/// component of a file of many costs as much as a mesh, but how many there are is not known before it is read.
const TIME_PER_MEBIBYTE: u64 = 2_500;
/// Per 2²⁰ texels.
const TIME_PER_MEBITEXEL: u64 = 7_000;
/// Per 2²⁰ pixels of a picture; there are always as many pictures.
const TIME_PER_MEBIPIXEL: u64 = 500;
/// Looking whether what is there is whole.
const LOOKING_TIME: u64 = 2;
/// Hashing, per mebibyte of input and as much output.
const HASHING_TIME_PER_MEBIBYTE: u64 = 2;

/// Time that an asset is expected to take with one thread, milliseconds, where it is built or only looked at: a rule of thumb by which shards
/// become alike, not a promise.
#[must_use]
pub fn expected_time(input_bytes: u64, config: &Config, build: bool) -> u64 {
    let part = |amount: u64, time: u64| {
        let product = u128::from(amount) * u128::from(time);
        u64::try_from(product >> 20).unwrap_or(u64::MAX)
    };
    if !build {
        return LOOKING_TIME.saturating_add(part(input_bytes, HASHING_TIME_PER_MEBIBYTE));
    }
    let pixels = match config.pictures.enabled {
        true => (config.pictures.size as u64).saturating_pow(2),
        false => 0,
    };
    BASE_TIME
        .saturating_add(part(input_bytes, TIME_PER_MEBIBYTE))
        .saturating_add(part(texels(config), TIME_PER_MEBITEXEL))
        .saturating_add(part(pixels, TIME_PER_MEBIPIXEL))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_system_tells_where_it_is_linux() {
        if cfg!(target_os = "linux") {
            assert!(peak_memory().unwrap() > 1 << 20);
            assert!(available_memory().unwrap() > 1 << 20);
            assert!(cores() >= 1);
        }
    }

    #[test]
    fn larger_files_and_images_need_more() {
        let config = Config::default();
        let mut fine = Config::default();
        fine.grid.cells *= 4;
        assert!(estimate(1 << 20, &config) > estimate(1 << 10, &config));
        assert!(estimate(1 << 20, &fine) > estimate(1 << 20, &config));
        assert_eq!(estimate(u64::MAX, &config), u64::MAX);
    }

    #[test]
    fn larger_files_and_images_take_longer_and_what_is_there_hardly_any_time() {
        let config = Config::default();
        let mut other = Config::default();
        other.pictures.enabled = false;
        let time = |bytes| expected_time(bytes, &config, true);
        assert!(time(1 << 20) > time(1 << 10));
        assert!(time(1 << 20) > expected_time(1 << 20, &other, true));
        other.grid.cells *= 16;
        assert!(time(1 << 20) < expected_time(1 << 20, &other, true));
        assert!((1..100).contains(&expected_time(1 << 20, &config, false)));
        assert!(time(u64::MAX) > time(1 << 40));
        // spot.obj: 2.5 s.
        assert!((2_000..5_000).contains(&time(330_624)));
    }
}
