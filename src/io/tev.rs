//! Showing a picture in tev while it is rendered.
//!
//! Source of the protocol: Müller, *tev*, `Ipc.h` and `tev.py` (packets CreateImage and UpdateImage,
//! version 3), <https://github.com/Tom94/tev>.

use std::io::{self, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use xxhash_rust::xxh3::xxh3_64;

use crate::film::{Film, PixelRect};

const UPDATE_IMAGE: u8 = 6;
const CREATE_IMAGE: u8 = 4;

/// Pixels of the side of what is sent in one packet.
const TILE: u32 = 128;

/// How long a viewer may take to answer.
const TIMEOUT: Duration = Duration::from_secs(5);

/// A picture that a viewer shows.
#[derive(Debug)]
pub struct TevImage {
    stream: TcpStream,
    name: String,
    /// Hashes of what was last sent, tile by tile.
    sent: Vec<u64>,
}

impl TevImage {
    /// Connects to the viewer at `address` ("localhost:14158") and has it make a black picture.
    ///
    /// # Errors
    /// Where nobody answers there, or the answer takes longer than five seconds.
    pub fn create(address: &str, name: &str, size: [u32; 2]) -> io::Result<Self> {
        let mut last = io::Error::new(io::ErrorKind::NotFound, "it stands for no address");
        for address in address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&address, TIMEOUT) {
                Ok(stream) => {
                    stream.set_write_timeout(Some(TIMEOUT))?;
                    let mut image = Self { stream, name: name.to_owned(), sent: Vec::new() };
                    image.begin(size)?;
                    return Ok(image);
                }
                Err(error) => last = error,
            }
        }
        Err(last)
    }

    fn begin(&mut self, size: [u32; 2]) -> io::Result<()> {
        let mut packet = Packet::new(CREATE_IMAGE);
        packet.bytes.push(1);
        packet.text(&self.name);
        size.into_iter().for_each(|side| packet.number(side));
        packet.names();
        packet.send(&mut self.stream)
    }

    /// Sends what has changed since the last time.
    ///
    /// # Errors
    /// Where the viewer is gone.
    pub fn update(&mut self, film: &Film) -> io::Result<()> {
        let window = film.window;
        let (rows, columns) = (window.height().div_ceil(TILE), window.width().div_ceil(TILE));
        self.sent.resize((rows * columns) as usize, 0);
        for number in 0..rows * columns {
            let (x0, y0) =
                (window.x0 + number % columns * TILE, window.y0 + number / columns * TILE);
            let tile = PixelRect { x0, y0, x1: x0 + TILE, y1: y0 + TILE }.intersection(&window);
            let pixels = (tile.y0..tile.y1).flat_map(|y| (tile.x0..tile.x1).map(move |x| [x, y]));
            let colors = pixels.filter_map(|[x, y]| film.pixel(x, y));
            let data: Vec<u8> =
                colors.flat_map(|c| c.to_array()).flat_map(f32::to_le_bytes).collect();
            let hash = xxh3_64(&data);
            if self.sent[number as usize] == hash {
                continue;
            }
            let mut packet = Packet::new(UPDATE_IMAGE);
            packet.bytes.push(0);
            packet.text(&self.name);
            packet.names();
            [tile.x0, tile.y0, tile.width(), tile.height()]
                .into_iter()
                .for_each(|n| packet.number(n));
            // Where each channel begins, and how far apart its values are.
            for n in [0u64, 1, 2, 3, 3, 3] {
                packet.bytes.extend_from_slice(&n.to_le_bytes());
            }
            packet.bytes.extend_from_slice(&data);
            packet.send(&mut self.stream)?;
            self.sent[number as usize] = hash;
        }
        Ok(())
    }
}

/// A packet: its length, its kind, and what it holds, little-endian.
struct Packet {
    bytes: Vec<u8>,
}

impl Packet {
    fn new(kind: u8) -> Self {
        let mut bytes = vec![0; 4];
        bytes.push(kind);
        Self { bytes }
    }

    fn text(&mut self, text: &str) {
        self.bytes.extend(text.bytes().filter(|b| *b != 0));
        self.bytes.push(0);
    }

    fn number(&mut self, n: u32) {
        self.bytes.extend_from_slice(&n.to_le_bytes());
    }

    /// The channels R, G and B.
    fn names(&mut self) {
        self.number(3);
        ["R", "G", "B"].into_iter().for_each(|name| self.text(name));
    }

    fn send(mut self, stream: &mut TcpStream) -> io::Result<()> {
        let length = u32::try_from(self.bytes.len()).unwrap_or(u32::MAX);
        self.bytes[..4].copy_from_slice(&length.to_le_bytes());
        stream.write_all(&self.bytes)
    }
}
