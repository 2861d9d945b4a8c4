//! Large pages for large arrays.
//!
//! A page of memory is 4 KiB unless a program asks otherwise, as Embree does for its own. Rays jump about in
//! arrays of hundreds of megabytes, and each jump to a page that was not there lately takes a walk through the
//! system's tables; with pages of 2 MiB most are there. Fewer are asked for as well when arrays are first filled.
//!
//! It calls C, and so lies in this folder; it is here without Embree too.
#![expect(unsafe_code, reason = "calls C")]

/// Arrays below this gain nothing: not one page may lie in them as a whole.
const MIN_BYTES: usize = 1 << 22;

/// Asks the system for large pages for all that `array` has room for, where they are to be had on request (Linux
/// with transparent huge pages). What was touched before keeps the pages that it has.
pub fn prefer_large<T>(array: &mut Vec<T>) {
    let bytes = array.capacity() * size_of::<T>();
    if bytes >= MIN_BYTES {
        advise(array.as_mut_ptr().cast(), bytes);
    }
}

#[cfg(target_os = "linux")]
fn advise(start: *mut u8, bytes: usize) {
    const PAGE: usize = 1 << 12;
    let skipped = start.align_offset(PAGE);
    let whole = bytes.saturating_sub(skipped) / PAGE * PAGE;
    // SAFETY: the range lies within one allocation of ours, and the advice changes neither what is in memory
    // nor who may touch it. Where it is refused nothing has happened.
    unsafe { libc::madvise(start.wrapping_add(skipped).cast(), whole, libc::MADV_HUGEPAGE) };
}

#[cfg(not(target_os = "linux"))]
fn advise(_: *mut u8, _: usize) {}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes of large pages behind the range that holds `address`, as the system tells it.
    #[cfg(target_os = "linux")]
    fn large(address: usize) -> Option<u64> {
        let text = std::fs::read_to_string("/proc/self/smaps").ok()?;
        let mut is_within = false;
        for line in text.lines() {
            let range = line.split(' ').next()?.split_once('-');
            let ends = range.map(|(a, b)| [a, b].map(|s| usize::from_str_radix(s, 16)));
            if let Some([Ok(from), Ok(to)]) = ends {
                is_within = (from..to).contains(&address);
            } else if is_within && let Some(rest) = line.strip_prefix("AnonHugePages:") {
                return Some(rest.trim().strip_suffix(" kB")?.parse::<u64>().ok()? << 10);
            }
        }
        None
    }

    #[cfg(target_os = "linux")]
    #[test]
    #[expect(clippy::print_stderr, reason = "a test that says why it does not run")]
    fn large_arrays_lie_on_large_pages() {
        let setting = std::fs::read_to_string("/sys/kernel/mm/transparent_hugepage/enabled");
        let mut array: Vec<u64> = Vec::with_capacity(1 << 22);
        prefer_large(&mut array);
        array.extend(0..1 << 22);
        assert!(array.iter().zip(0..).all(|(&a, b)| a == b));
        // Its ends share pages with others, and keep small ones.
        let behind = large(array[array.len() / 2..].as_ptr() as usize);
        if !setting.is_ok_and(|s| s.contains("[madvise]")) {
            eprintln!("not tried: large pages are not given on request here");
            return;
        }
        // Of 32 MiB: most, where memory is not in pieces.
        assert!(behind.is_some_and(|bytes| bytes >= 1 << 24), "{behind:?}");
    }

    #[test]
    fn small_arrays_and_none_are_left_alone() {
        prefer_large(&mut Vec::<f32>::new());
        let mut few = vec![1u8; 100];
        prefer_large(&mut few);
        assert_eq!(few, vec![1; 100]);
    }
}
