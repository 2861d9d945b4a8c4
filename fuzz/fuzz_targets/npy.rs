#![no_main]

use alhazen_fuzz::as_file;

libfuzzer_sys::fuzz_target!(|data: &[u8]| as_file("input.npy", data, |path| {
    let _ = alhazen::io::read_npy(path);
}));
