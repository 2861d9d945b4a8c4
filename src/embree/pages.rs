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

    /// Whether large pages were asked for where `address` lies, as the system tells it.
    #[cfg(target_os = "linux")]
    fn is_asked_for(address: usize) -> Option<bool> {
        let text = std::fs::read_to_string("/proc/self/smaps").ok()?;
        let mut is_within = false;
        for line in text.lines() {
            let range = line.split(' ').next()?.split_once('-');
            let ends = range.map(|(a, b)| [a, b].map(|s| usize::from_str_radix(s, 16)));
            if let Some([Ok(from), Ok(to)]) = ends {
                is_within = (from..to).contains(&address);
            } else if is_within && let Some(flags) = line.strip_prefix("VmFlags:") {
                return Some(flags.split_whitespace().any(|flag| flag == "hg"));
            }
        }
        None
    }

    #[cfg(target_os = "linux")]
    #[test]
    #[expect(clippy::print_stderr, reason = "a test that says why it does not run")]
    fn large_arrays_ask_for_large_pages() {
        if !std::path::Path::new("/sys/kernel/mm/transparent_hugepage/enabled").exists() {
            eprintln!("not tried: this system has no large pages on request");
            return;
        }
        let mut array: Vec<u64> = Vec::with_capacity(1 << 22);
        // Its ends share pages with others, and keep small ones.
        let middle = array.as_ptr() as usize + (1 << 24);
        let before = is_asked_for(middle);
        prefer_large(&mut array);
        assert_eq!((before, is_asked_for(middle)), (Some(false), Some(true)));
        array.extend(0..1 << 22);
        assert!(array.iter().zip(0..).all(|(&a, b)| a == b));
    }

    #[test]
    fn small_arrays_and_none_are_left_alone() {
        prefer_large(&mut Vec::<f32>::new());
        let mut few = vec![1u8; 100];
        prefer_large(&mut few);
        assert_eq!(few, vec![1; 100]);
    }
}
