//! Both renders of a twin, and how far apart they are.

#[path = "program.rs"]
mod program;

use std::path::Path;

use alhazen::accel::AccelKind;
use alhazen::color::Rgb;
use alhazen::film::{Film, Picture, PixelRect};
use alhazen::io::write_png;
use alhazen::measure::{CompareOptions, compare};
use alhazen::render::{RenderJob, render};
use alhazen::scene::Scene;

use crate::twin::Twin;
use program::pictures;

pub use program::povray;

pub fn ours(twin: &Twin) -> Picture {
    let scene = Scene::build_quietly(twin.ours(), AccelKind::default());
    let scene = scene.unwrap_or_else(|e| panic!("{e:?}"));
    let rendered = render(&scene, &RenderJob::default(), &());
    assert_eq!(rendered.non_finite.count, 0);
    rendered.film.into()
}

/// POV-Ray's picture without its antialiasing, which is adaptive: larger, and averaged down.
pub fn theirs(twin: &Twin) -> Picture {
    let size = twin.size.map(|side| side * twin.pixels);
    averaged(&pictures(&twin.theirs(), size, 1)[0], twin)
}

fn averaged(pixels: &[Rgb], twin: &Twin) -> Picture {
    let ([w, h], k) = (twin.size, twin.pixels);
    let mean = |x: u32, y: u32| {
        let inner = (0..k * k).map(|i| (x * k + i % k, y * k + i / k));
        let sum = inner.map(|(x, y)| pixels[(y * w * k + x) as usize]);
        sum.fold(Rgb::BLACK, |a, b| a + b) * (1.0 / (k * k) as f32)
    };
    let pixels = (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| mean(x, y));
    Picture::whole(twin.size, pixels.collect())
}

/// The most that two pictures may differ by.
#[derive(Clone, Copy)]
pub struct Bound {
    /// Mean of the absolute differences.
    pub mae: f64,
    /// Relative mean squared error.
    pub rel_mse: f64,
    /// Share of pixels that differ by more than 5 % (and 0.005): what is wrong over an area shows
    /// here, however faint, and edges of a pixel's width hardly.
    pub share: f64,
}

/// Compares ours with theirs.
pub fn check(name: &str, ours: &Picture, theirs: &Picture, bound: Bound) {
    let found = compare(ours, theirs, &CompareOptions::default()).unwrap();
    let pairs = ours.pixels.iter().zip(&theirs.pixels);
    let differs = |a: &Rgb, b: &Rgb| {
        let channels = a.to_array().into_iter().zip(b.to_array());
        channels.into_iter().any(|(a, b)| (a - b).abs() > 0.005 + 0.05 * b)
    };
    let share = pairs.clone().filter(|(a, b)| differs(a, b)).count() as f64 / pairs.len() as f64;
    eprintln!("{name}: MAE {:.6}, relMSE {:.2e}, share {share:.5}", found.mae, found.rel_mse);
    keep(name, ours, theirs);
    assert_eq!(found.non_finite, 0, "{name}");
    // Larger pictures have fewer of their pixels at edges.
    let tighter = if crate::common::verify() { 0.5 } else { 1.0 };
    let [mae, rel_mse, share_bound] = [bound.mae, bound.rel_mse, bound.share].map(|x| tighter * x);
    let near = found.mae <= mae && found.rel_mse <= rel_mse && share <= share_bound;
    assert!(
        near,
        "{name}: MAE {}, relMSE {}, share {share}; accepted: {}, {}, {}",
        found.mae, found.rel_mse, mae, rel_mse, share_bound
    );
}

/// With `ALHAZEN_PICTURES` set to a folder, leaves both pictures and five times their difference there.
pub fn keep(name: &str, ours: &Picture, theirs: &Picture) {
    let Some(folder) = std::env::var_os("ALHAZEN_PICTURES") else { return };
    let width = ours.extent[0] as usize;
    let rows = ours.pixels.chunks(width).zip(theirs.pixels.chunks(width));
    let side_by_side = rows.flat_map(|(a, b)| {
        let far = |(a, b): (&Rgb, &Rgb)| a.zip(*b, |a, b| ((a - b) * 5.0 + 0.5).max(0.0));
        [a.to_vec(), b.to_vec(), a.iter().zip(b).map(far).collect()].concat()
    });
    let size = [3 * ours.extent[0], ours.extent[1]];
    let mut film = Film::new(size, PixelRect::whole(size), false);
    film.mean = side_by_side.collect();
    write_png(
        &Path::new(&folder).join(format!("{name}.png")),
        &film,
        0.0,
        alhazen::io::ToneMap::Srgb,
    )
    .unwrap();
}
