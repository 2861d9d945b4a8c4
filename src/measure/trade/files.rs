//! Half against float: what rounding a picture does to it, and what writing it as either takes.

use std::path::Path;
use std::time::Instant;

use exr::prelude::f16;
use serde::Serialize;

use super::median;
use crate::color::Rgb;
use crate::film::{Film, Picture};
use crate::io::{ExrOptions, PixelType, WriteError, write_exr};

/// What halves lose of a picture beside what samples do, and what they save.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct HalfLoss {
    /// Relative error by rounding to half alone.
    pub error: f64,
    /// Pixels that half cannot hold: the file is then written as float.
    pub beyond: u64,
    /// The file of halves; null where no file could be written in the system's folder for temporary files.
    pub half: Option<FileCost>,
    /// That of floats; null likewise.
    pub float: Option<FileCost>,
}

/// What a file takes.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct FileCost {
    /// Seconds to write it, median of rounds.
    pub seconds: f64,
    /// Its size.
    pub bytes: u64,
}

/// Rounds `picture`, and writes `film`, which it was made of, as either in `rounds` by turns.
pub(super) fn half_loss(picture: &Picture, film: &Film, rounds: u32) -> HalfLoss {
    let of = |pixels: Vec<Rgb>| {
        let mut film = Film::new(picture.size, crate::film::PixelRect::whole(picture.size), false);
        film.mean = pixels;
        film
    };
    let round = |x: f32| f16::from_f32(x).to_f32();
    let rounded: Vec<Rgb> = picture.pixels.iter().map(|c| c.map(round)).collect();
    let beyond = rounded.iter().filter(|c| !c.is_finite()).count() as u64;
    let error = of(rounded).error_against(&of(picture.pixels.clone()));
    let folder = tempfile::tempdir().ok();
    let costs = folder.and_then(|folder| costs(film, folder.path(), rounds).ok());
    HalfLoss { error, beyond, half: costs.map(|c| c[0]), float: costs.map(|c| c[1]) }
}

/// Of half and of float.
fn costs(film: &Film, folder: &Path, rounds: u32) -> Result<[FileCost; 2], WriteError> {
    const TYPES: [PixelType; 2] = [PixelType::Half, PixelType::Float];
    let mut seconds = [const { Vec::new() }; 2];
    let mut bytes = [0; 2];
    // Once more than needed: the first warms up.
    for round in 0..=rounds {
        for (i, pixel_type) in TYPES.into_iter().enumerate() {
            let path = folder.join(format!("{i}.exr"));
            let options = ExrOptions { pixel_type, ..ExrOptions::default() };
            let start = Instant::now();
            write_exr(&path, film, &[], &options)?;
            if round > 0 {
                seconds[i].push(start.elapsed().as_secs_f64());
            }
            bytes[i] = std::fs::metadata(&path).map_or(0, |data| data.len());
        }
    }
    Ok([0, 1].map(|i| FileCost { seconds: median(&seconds[i]), bytes: bytes[i] }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::PixelRect;

    #[test]
    fn halves_round_to_eleven_bits_and_take_half_the_room() {
        let size = [64, 48];
        let mut film = Film::new(size, PixelRect::whole(size), false);
        // Numbers that no compression makes small.
        let mut state = 1u32;
        for pixel in &mut film.mean {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *pixel = Rgb::splat(1.0 + (state >> 8) as f32 / (1 << 24) as f32);
        }
        let found = half_loss(&Picture::from(film.clone()), &film, 1);
        // Steps of 2^-10 between 1 and 2, each off by half of one at most: 2^-11 / √3 of about 1.5.
        let expected = 2f64.powi(-11) / 3f64.sqrt() / 1.5;
        assert!((0.8..1.25).contains(&(found.error / expected)), "{}", found.error);
        assert_eq!(found.beyond, 0);
        let (half, float) = (found.half.unwrap(), found.float.unwrap());
        assert!(half.seconds > 0.0 && float.seconds > 0.0);
        assert!(half.bytes * 3 < float.bytes * 2, "{half:?} {float:?}");

        film.mean[7] = Rgb::splat(1e6);
        let found = half_loss(&Picture::from(film.clone()), &film, 1);
        assert_eq!(found.beyond, 1);
    }
}
