#![no_main]

use alhazen_fuzz::{as_file, check_mesh};

libfuzzer_sys::fuzz_target!(|data: &[u8]| as_file("input.stl", data, check_mesh));
