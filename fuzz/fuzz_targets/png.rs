#![no_main]

use alhazen_fuzz::{allow_caught_panics, as_file};

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    allow_caught_panics();
    as_file("input.png", data, |path| {
        let _ = alhazen::io::read_image(path, None);
    });
});
