#![no_main]

use alhazen::io::{LoadOptions, load_scene};
use alhazen_fuzz::as_file;

libfuzzer_sys::fuzz_target!(|data: &[u8]| as_file("scene.toml", data, |path| {
    let _ = load_scene(path, &LoadOptions::default());
}));
