//! Limits of the control groups that this process is in: what containers and engines such as Slurm and Kubernetes give it of a machine.
//!
//! *Enters:* `/proc/self/cgroup`, which names the groups, and `/proc/self/mountinfo`, which says where they are to be seen. *Leaves:* the memory
//! that is left below the tightest limit of a group and all groups above it, version 1 and version 2.
//!
//! Inside a container only a part of the groups may be mounted, and the names may be those outside: where a group lies outside of what is mounted, what is mounted
//! counts. Files that the system keeps in memory only as long as nobody needs it count as free, as they do for the whole machine.
//!
//! Cores need no such thing: [`std::thread::available_parallelism`] respects affinity and the quotas of both versions.

use std::fs;
use std::path::{Path, PathBuf};

/// Memory that is left, bytes; none where no group has a limit or the system does not tell.
pub(super) fn memory_left() -> Option<u64> {
    let read = |path: &Path| fs::read_to_string(path).ok();
    let own = read(Path::new("/proc/self/cgroup"))?;
    let mounts = read(Path::new("/proc/self/mountinfo"))?;
    left(&own, &mounts, &read)
}

/// Names of files and values of a version.
struct Version {
    limit: &'static str,
    used: &'static str,
    /// Of what is used, files that can be let go of: keys of `memory.stat`.
    files: [&'static str; 2],
}

const FIRST: Version = Version {
    limit: "memory.limit_in_bytes",
    used: "memory.usage_in_bytes",
    files: ["total_inactive_file", "total_active_file"],
};
const SECOND: Version = Version {
    limit: "memory.max",
    used: "memory.current",
    files: ["inactive_file", "active_file"],
};

fn left(own: &str, mounts: &str, read: &dyn Fn(&Path) -> Option<String>) -> Option<u64> {
    let mut least = None;
    for (version, folder, top) in groups(own, mounts) {
        for group in folder
            .ancestors()
            .take_while(|group| group.starts_with(&top))
        {
            least = least
                .into_iter()
                .chain(left_in(group, &version, read))
                .min();
        }
    }
    least
}

/// The folders of this process's groups that may limit memory, and the topmost folder of each.
fn groups(own: &str, mounts: &str) -> Vec<(Version, PathBuf, PathBuf)> {
    let mut found = Vec::new();
    for line in own.lines() {
        // 4:memory:/a/b in version 1, 0::/a/b in version 2.
        let mut parts = line.splitn(3, ':');
        let (Some(_), Some(controllers), Some(name)) = (parts.next(), parts.next(), parts.next())
        else {
            continue;
        };
        let (version, kind) = match controllers {
            "" => (SECOND, "cgroup2"),
            _ if controllers.split(',').any(|one| one == "memory") => (FIRST, "cgroup"),
            _ => continue,
        };
        let Some((root, top)) = mount(mounts, kind) else {
            continue;
        };
        let below = Path::new(name).strip_prefix(&root);
        let folder = match below {
            Ok(below) if !name.contains("/..") => top.join(below),
            _ => top.clone(),
        };
        found.push((version, folder, top));
    }
    found
}

/// Where groups are mounted, and the group that is the topmost there.
fn mount(mounts: &str, kind: &str) -> Option<(PathBuf, PathBuf)> {
    mounts.lines().find_map(|line| {
        // 35 31 0:32 ROOT TOP options … - KIND device options
        let (before, after) = line.split_once(" - ")?;
        let mut after = after.split(' ');
        let fits = after.next() == Some(kind)
            && (kind == "cgroup2" || after.nth(1)?.split(',').any(|one| one == "memory"));
        let mut before = before.split(' ').skip(3);
        let (root, top) = (before.next()?, before.next()?);
        fits.then(|| (unescaped(root), unescaped(top)))
    })
}

/// Blanks and the like stand as three octal digits.
fn unescaped(path: &str) -> PathBuf {
    let mut out = path.to_owned();
    for (escape, sign) in [
        ("\\040", " "),
        ("\\011", "\t"),
        ("\\012", "\n"),
        ("\\134", "\\"),
    ] {
        out = out.replace(escape, sign);
    }
    out.into()
}

fn left_in(group: &Path, version: &Version, read: &dyn Fn(&Path) -> Option<String>) -> Option<u64> {
    let number = |name: &str| read(&group.join(name))?.trim().parse::<u64>().ok();
    // `max` in version 2; in version 1 a number that no machine has.
    let limit = number(version.limit).filter(|&limit| limit < 1 << 60)?;
    let stat = read(&group.join("memory.stat")).unwrap_or_default();
    let of = |key: &str| {
        let line = stat
            .lines()
            .find_map(|line| line.strip_prefix(key)?.strip_prefix(' '));
        line.and_then(|value| value.trim().parse::<u64>().ok())
            .unwrap_or(0)
    };
    let files = version
        .files
        .map(of)
        .into_iter()
        .fold(0, u64::saturating_add);
    let used = number(version.used).unwrap_or(0).saturating_sub(files);
    Some(limit.saturating_sub(used))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    const V1: &str = "35 31 0:32 / /sys/fs/cgroup/memory rw,relatime - cgroup cgroup rw,memory\n";
    const V2: &str = "41 31 0:38 / /sys/fs/cgroup rw - cgroup2 cgroup2 rw,nsdelegate\n";

    fn left_with(own: &str, mounts: &str, files: &[(&str, &str)]) -> Option<u64> {
        let files: BTreeMap<PathBuf, &str> = files
            .iter()
            .map(|&(path, text)| (path.into(), text))
            .collect();
        left(own, mounts, &|path| {
            files.get(path).map(|&text| text.to_owned())
        })
    }

    #[test]
    fn the_tightest_group_counts_in_version_2() {
        let own = "0::/system.slice/slurmstepd.scope/job_7/step_0\n";
        let job = "/sys/fs/cgroup/system.slice/slurmstepd.scope/job_7";
        let max = format!("{job}/memory.max");
        let current = format!("{job}/memory.current");
        let stat = format!("{job}/memory.stat");
        let step = format!("{job}/step_0/memory.max");
        let files = [
            (step.as_str(), "max\n"),
            (&max, "1000\n"),
            (&current, "700\n"),
            (
                &stat,
                "anon 5\ninactive_file 300\nactive_file 100\nactive_file_x 9\n",
            ),
            ("/sys/fs/cgroup/system.slice/memory.max", "5000\n"),
        ];
        assert_eq!(left_with(own, V2, &files), Some(700));
        let narrower = [&files[..], &[(&*step, "10")]].concat();
        assert_eq!(left_with(own, V2, &narrower), Some(10));
        assert_eq!(left_with(own, V2, &files[..1]), None);
        // A container that sees its own group at the top.
        let own = "0::/\n";
        let files = [("/sys/fs/cgroup/memory.max", "64")];
        assert_eq!(left_with(own, V2, &files), Some(64));
    }

    #[test]
    fn version_1_and_groups_that_are_not_mounted() {
        let folder = "/sys/fs/cgroup/memory/docker/a b";
        let limit = format!("{folder}/memory.limit_in_bytes");
        let used = format!("{folder}/memory.usage_in_bytes");
        let own = "5:cpu,cpuacct:/docker/a b\n4:memory:/docker/a b\n0::/\n";
        let files = [
            (limit.as_str(), "1000"),
            (&used, "400"),
            (
                "/sys/fs/cgroup/memory/memory.limit_in_bytes",
                "9223372036854771712",
            ),
        ];
        assert_eq!(left_with(own, V1, &files), Some(600));
        // The container's own group is at the top, under the name that it has outside.
        let inside = V1.replace(" / /sys", " /docker/a\\040b /sys");
        let files = [("/sys/fs/cgroup/memory/memory.limit_in_bytes", "50")];
        assert_eq!(left_with(own, &inside, &files), Some(50));
        let elsewhere = V1.replace(" / /sys", " /docker/other /sys");
        assert_eq!(left_with(own, &elsewhere, &files), Some(50));
        assert_eq!(
            left_with("0::/../x\n", V2, &[("/sys/fs/cgroup/memory.max", "7")]),
            Some(7)
        );
        assert_eq!(left_with("", V1, &files), None);
        assert_eq!(
            left_with("garbage\n::\n", "garbage - cgroup\n", &files),
            None
        );
    }
}
