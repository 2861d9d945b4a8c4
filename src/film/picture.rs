//! A picture as a file holds it: pixels, and where they lie in the whole.

use super::Film;
use crate::color::Rgb;

/// Linear Rec.709 pixels that were read from a file, or that are to be compared with such.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Size of the whole picture in pixels (EXR's display window).
    pub size: [u32; 2],
    /// The pixels that it holds, across and down (EXR's data window).
    pub extent: [u32; 2],
    /// Where the first of them lies in the whole, in pixels right of and below its upper left corner;
    /// negative where they overhang it. None where the file does not say, as PNG does not.
    pub origin: Option<[i32; 2]>,
    /// Their values, row by row from the top.
    pub pixels: Vec<Rgb>,
}

impl Picture {
    /// A picture that holds its whole size. Missing pixels are black, surplus ones are dropped.
    pub fn whole(size: [u32; 2], mut pixels: Vec<Rgb>) -> Self {
        pixels.resize(size[0] as usize * size[1] as usize, Rgb::BLACK);
        Self { size, extent: size, origin: Some([0, 0]), pixels }
    }
}

impl From<Film> for Picture {
    fn from(film: Film) -> Self {
        let window = film.window;
        Self {
            size: film.size,
            extent: [window.width(), window.height()],
            origin: Some([window.x0, window.y0].map(|x| i32::try_from(x).unwrap_or(i32::MAX))),
            pixels: film.mean,
        }
    }
}
