#![no_main]

const SCENE: [&str; 2] = [
    "[[objects]]\ninstance = \"a\"\ntransforms = \"input.csv\"\n\
     [prototypes.a]\nobjects = [{ shape = \"sphere\", radius = 1 }]\n",
    "[[objects]]\ninstance = \"a\"\ntransforms = \"input.npy\"\n\
     [prototypes.a]\nobjects = [{ shape = \"sphere\", radius = 1 }]\n",
];

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    // The magic of .npy decides, so that one corpus serves both readers.
    let (scene, name) = if data.starts_with(b"\x93NUMPY") {
        (SCENE[1], "input.npy")
    } else {
        (SCENE[0], "input.csv")
    };
    alhazen_fuzz::load_beside(scene, name, data);
});
