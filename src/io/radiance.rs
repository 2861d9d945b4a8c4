//! Radiance HDR: three digits of 8 bits and a common exponent of each pixel, in runs.
//!
//! Source: Ward, *Real Pixels*, Graphics Gems II, 1991; *Radiance Picture Format*, filefmts.pdf of Radiance.

use std::io::Write;
use std::path::Path;

use super::error::WriteError;
use super::output::write_whole;
use crate::color::Rgb;
use crate::film::Film;

/// Writes the pixels that the film holds. Negative values become 0, and what is larger than the format
/// holds, about 1.7e38, the largest; returned is how many pixels that was.
///
/// # Errors
/// [`WriteError`] where the file cannot be written, the old one is then untouched; and for pictures wider
/// than 32767 pixels, which lines in runs cannot be.
pub fn write_hdr(path: &Path, film: &Film) -> Result<u64, WriteError> {
    let (width, height) = (film.window.width(), film.window.height());
    if width > 0x7fff {
        let message = "an HDR file is at most 32767 pixels wide; accepted: .exr";
        return Err(WriteError::format(path, message));
    }
    let mut clipped = 0;
    write_whole(path, |writer| {
        let failed = |e| WriteError::io(path, "write", e);
        let head = format!(
            "#?RADIANCE\nSOFTWARE=alhazen {}\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n",
            env!("CARGO_PKG_VERSION")
        );
        writer.write_all(head.as_bytes()).map_err(failed)?;
        let mut line = Vec::new();
        for row in film.mean.chunks_exact(width as usize) {
            let pixels: Vec<[u8; 4]> = row.iter().map(|c| rgbe(*c)).collect();
            clipped += row.iter().filter(|c| !is_held(**c)).count() as u64;
            line.clear();
            // Shorter lines than 8 pixels cannot be in runs.
            if width < 8 {
                line.extend_from_slice(pixels.as_flattened());
            } else {
                line.extend_from_slice(&[2, 2, (width >> 8) as u8, width as u8]);
                for channel in 0..4 {
                    let bytes: Vec<u8> = pixels.iter().map(|p| p[channel]).collect();
                    append_runs(&bytes, &mut line);
                }
            }
            writer.write_all(&line).map_err(failed)?;
        }
        Ok(())
    })?;
    Ok(clipped)
}

/// The largest value that fits: 255/256 of 2¹²⁷.
const LARGEST: f32 = 255.0 / 256.0 * 1.701_411_8e38;

fn is_held(color: Rgb) -> bool {
    color.to_array().iter().all(|x| (0.0..=LARGEST).contains(x))
}

/// Mantissas and a common exponent, rounded down as readers add half a step.
fn rgbe(color: Rgb) -> [u8; 4] {
    let rgb = color.to_array().map(|x| if x > 0.0 { x.min(LARGEST) } else { 0.0 });
    let most = rgb.into_iter().fold(0.0, f32::max);
    // Below that exponents end.
    if most < 1e-38 {
        return [0; 4];
    }
    // most = m · 2^e with m in [½, 1).
    let exponent = (most.to_bits() >> 23) as i32 - 126;
    let scale = f64::from(256.0f32) * 2f64.powi(-exponent);
    let [r, g, b] = rgb.map(|x| (f64::from(x) * scale) as u8);
    [r, g, b, (exponent + 128) as u8]
}

/// Appends bytes as runs of equal ones (128 + n, value) and stretches of others (n, values).
fn append_runs(bytes: &[u8], out: &mut Vec<u8>) {
    // Shorter runs are not worth their two bytes.
    const LEAST: usize = 4;
    let run_at = |at: usize| bytes[at..].iter().take(127).take_while(|b| **b == bytes[at]).count();
    let mut at = 0;
    while at < bytes.len() {
        let run = run_at(at);
        if run >= LEAST {
            out.extend_from_slice(&[128 + run as u8, bytes[at]]);
            at += run;
            continue;
        }
        let from = at;
        while at < bytes.len() && at - from < 128 && run_at(at) < LEAST {
            at += 1;
        }
        out.push((at - from) as u8);
        out.extend_from_slice(&bytes[from..at]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mantissas_are_within_a_step() {
        for x in [1e-30f32, 0.003, 0.5, 0.999_999_9, 1.0, 17.3, 65_504.0, 3e37] {
            let [r, g, b, e] = rgbe(Rgb::new(x, x / 2.0, 0.0));
            let step = 2f64.powi(i32::from(e) - 136);
            let read = |m: u8| (f64::from(m) + 0.5) * step;
            assert!((read(r) - f64::from(x)).abs() <= 0.5 * step * 1.001, "{x}");
            assert!((read(g) - f64::from(x / 2.0)).abs() <= 0.5 * step * 1.001, "{x}");
            assert!(r >= 128 && b == 0, "{x}: all digits are used");
        }
        assert_eq!(rgbe(Rgb::new(-1.0, f32::NAN, 0.0)), [0; 4]);
        assert_eq!(rgbe(Rgb::splat(f32::INFINITY)), [255, 255, 255, 255]);
        assert!(!is_held(Rgb::new(1.0, -0.1, 0.0)) && is_held(Rgb::new(1.0, 0.0, 2.0)));
    }

    #[test]
    fn runs_are_read_back() {
        let mut bytes = vec![7; 300];
        bytes.extend((0..200).map(|i| (i * 37 % 251) as u8));
        bytes.extend([1, 1, 1, 2, 2, 2, 2, 3]);
        let mut packed = Vec::new();
        append_runs(&bytes, &mut packed);
        assert!(packed.len() < 240, "{}", packed.len());
        let (mut read, mut rest) = (Vec::new(), packed.as_slice());
        while let [count, tail @ ..] = rest {
            if *count > 128 {
                read.extend(std::iter::repeat_n(tail[0], usize::from(*count - 128)));
                rest = &tail[1..];
            } else {
                read.extend_from_slice(&tail[..usize::from(*count)]);
                rest = &tail[usize::from(*count)..];
            }
        }
        assert_eq!(read, bytes);
    }
}
