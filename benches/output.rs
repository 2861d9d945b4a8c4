//! What files cost: size and seconds by compression, type and layout; and what layers cost a render. The
//! tables of docs/output.md are from here.
//!
//!     cargo bench --bench output

#![allow(missing_docs, clippy::print_stdout, reason = "a program that prints a table")]

mod common;

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use alhazen::accel::AccelKind;
use alhazen::film::{Aov, Film};
use alhazen::io::{
    ExrCompression, ExrLayout, ExrOptions, LoadOptions, PixelType, load_scene, write_exr,
};
use alhazen::render::{RenderJob, render};
use alhazen::scene::Scene;
use common::{ROUNDS, interleaved, median, ratio};

fn scene(size: [u32; 2], samples: u32) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/showcase.toml");
    let mut loaded = load_scene(&path, &LoadOptions::default()).expect("it is sound");
    loaded.scene.image.size = size;
    loaded.scene.settings.samples = samples;
    Scene::build_quietly(loaded.scene, AccelKind::default()).expect("it builds")
}

/// Size in MB and seconds of writing.
fn measure(film: &Film, options: &ExrOptions, folder: &Path) -> (f64, f64) {
    let path = folder.join("out.exr");
    let seconds = (0..3).map(|_| {
        let clock = Instant::now();
        write_exr(&path, film, &[], options).expect("it can be written");
        clock.elapsed().as_secs_f64()
    });
    let seconds = median(seconds.collect());
    (std::fs::metadata(&path).expect("it is there").len() as f64 / 1e6, seconds)
}

fn main() {
    let folder = tempfile::tempdir().expect("a folder");
    println!("EXR of R, G, B: MB and seconds, {} threads", rayon::current_num_threads());
    let pictures = [([1920, 1080], 1), ([1920, 1080], 64), ([3840, 2160], 1), ([3840, 2160], 16)];
    for (size, samples) in pictures {
        let film = render(&scene(size, samples), &RenderJob::default(), &()).film;
        println!("\n{} x {}, {samples} samples", size[0], size[1]);
        println!(
            "| compression | half MB | half s | half MB/s | float MB | float s | float MB/s |"
        );
        println!("|---|---|---|---|---|---|---|");
        for compression in ExrCompression::ALL {
            let cell = |pixel_type, bytes: f64| {
                let options = ExrOptions { pixel_type, compression, ..ExrOptions::default() };
                let (mb, seconds) = measure(&film, &options, folder.path());
                let raw = 3.0 * bytes * f64::from(size[0] * size[1]) / 1e6;
                format!("{mb:.1} | {seconds:.3} | {:.0}", raw / seconds)
            };
            let (half, float) = (cell(PixelType::Half, 2.0), cell(PixelType::Float, 4.0));
            println!("| `{}` | {half} | {float} |", compression.name());
        }
        let options = ExrOptions { layout: ExrLayout::Tiles, ..ExrOptions::default() };
        let (mb, seconds) = measure(&film, &options, folder.path());
        println!("| `zip`, tiles | {mb:.1} | {seconds:.3} | | | | |");
    }

    println!(
        "\nLayers: seconds of the render by those of the colours alone, 1920 x 1080, 4 samples"
    );
    let scene = scene([1920, 1080], 4);
    let time = |layers: &[Aov]| {
        let job = RenderJob { layers: layers.to_vec(), ..RenderJob::default() };
        black_box(render(&scene, &job, &()));
    };
    let mut sets: Vec<(&str, Vec<Aov>)> = vec![("none", Vec::new())];
    sets.extend(Aov::ALL.iter().map(|aov| (aov.name(), vec![*aov])));
    sets.push(("all", Aov::ALL.to_vec()));
    println!("| layer | ratio | interval |\n|---|---|---|");
    for (name, layers) in sets {
        let rounds = interleaved(&|| time(&layers), &|| time(&[]), ROUNDS);
        let (x, [low, high]) = ratio(&rounds);
        println!("| `{name}` | {x:.2} | {low:.2} to {high:.2} |");
    }
}
