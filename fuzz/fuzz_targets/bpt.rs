#![no_main]

const SCENE: &str = "[[objects]]\nshape = \"patches\"\nfile = \"input.bpt\"\n";

libfuzzer_sys::fuzz_target!(|data: &[u8]| alhazen_fuzz::load_beside(SCENE, "input.bpt", data));
