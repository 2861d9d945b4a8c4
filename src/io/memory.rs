//! How much memory there is: asked before much of it is taken, so that a machine never swaps.

use std::path::{Path, PathBuf};

use super::error::ReadError;

/// Bytes that this process may still take: the least of what the machine has available and what the
/// limits of its control groups (version 2) leave. None where the system does not say.
pub fn available_memory() -> Option<u64> {
    let machine = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| field(&text));
    let groups = std::fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let group = groups.lines().find_map(|line| line.strip_prefix("0::/"));
    let limit = group.and_then(|group| left_in_group(Path::new("/sys/fs/cgroup"), group));
    [machine, limit].into_iter().flatten().min()
}

/// `MemAvailable` of /proc/meminfo, in bytes.
fn field(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    Some(line.trim().trim_end_matches("kB").trim().parse::<u64>().ok()? * 1024)
}

/// What the limits of a group, and of those that it lies in, leave; none where none has a limit.
fn left_in_group(root: &Path, group: &str) -> Option<u64> {
    let folder = root.join(group);
    let folders = folder.ancestors().take_while(|f| f.starts_with(root)).map(PathBuf::from);
    folders
        .filter_map(|folder| {
            let read = |name| std::fs::read_to_string(folder.join(name)).ok();
            // "max" is no number.
            let limit: u64 = read("memory.max")?.trim().parse().ok()?;
            let used: u64 = read("memory.current")?.trim().parse().ok()?;
            // Cached files count as used, but give way.
            let stat = read("memory.stat").unwrap_or_default();
            let cached = |name: &str| {
                let line = stat.lines().find_map(|line| line.strip_prefix(name))?;
                line.trim().parse::<u64>().ok()
            };
            let gives_way =
                ["inactive_file ", "active_file "].map(|name| cached(name).unwrap_or(0));
            let used = used.saturating_sub(gives_way.iter().sum());
            Some(limit.saturating_sub(used))
        })
        .min()
}

/// Refuses to read what takes `needed` bytes, where fewer are available.
pub(super) fn check_memory(path: &Path, needed: u64) -> Result<(), ReadError> {
    /// What is smaller is not worth asking the system.
    const SMALL: u64 = 64 << 20;
    match (needed >= SMALL).then(available_memory).flatten() {
        Some(free) if needed > free => Err(ReadError::file(path, too_much(needed, free))),
        _ => Ok(()),
    }
}

fn too_much(needed: u64, free: u64) -> String {
    let gigabytes = |bytes: u64| bytes as f64 / 1e9;
    format!(
        "reading it takes {:.1} GB of memory, and {:.1} GB are free",
        gigabytes(needed),
        gigabytes(free)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_machine_says() {
        assert_eq!(field("MemTotal: 9 kB\nMemAvailable:   12 kB\n"), Some(12 << 10));
        assert_eq!(field("MemTotal: 9 kB\n"), None);
        assert!(available_memory().is_none_or(|bytes| bytes > 1 << 20));
    }

    #[test]
    fn the_tightest_group_counts() {
        let root = tempfile::tempdir().unwrap();
        let inner = root.path().join("a/b");
        std::fs::create_dir_all(&inner).unwrap();
        assert_eq!(left_in_group(root.path(), "a/b"), None);
        let write = |file: &str, text: &str| std::fs::write(root.path().join(file), text).unwrap();
        write("a/b/memory.max", "max\n");
        write("a/b/memory.current", "100\n");
        write("a/memory.max", "1000\n");
        write("a/memory.current", "700\n");
        assert_eq!(left_in_group(root.path(), "a/b"), Some(300));
        write("a/memory.stat", "anon 5\ninactive_file 150\nactive_file 50\n");
        assert_eq!(left_in_group(root.path(), "a/b"), Some(500));
        write("a/b/memory.max", "400\n");
        assert_eq!(left_in_group(root.path(), "a/b"), Some(300));
        write("a/memory.current", "5000\n");
        assert_eq!(left_in_group(root.path(), "a/b"), Some(0));
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let path = Path::new("a.ply");
        assert!(check_memory(path, 1).is_ok());
        if available_memory().is_some() {
            let text = check_memory(path, 1 << 60).unwrap_err().to_string();
            assert!(
                text.starts_with("a.ply: reading it takes 1152921504.6 GB of memory, and"),
                "{text}"
            );
        }
    }
}
