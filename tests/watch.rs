//! Watching a render: tev, previews, and what `--stats` says of the error.
#![allow(missing_docs, reason = "a test program")]

use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use alhazen::io::{read_exr, read_png};

mod common;
use common::{alhazen, stderr};

const SCENE: &str = r#"
[image]
size = [200, 150]
[camera]
eye = [0, 2, 6]
target = [0, 0.5, 0]
[[objects]]
shape = "sphere"
center = [0, 0.8, 0]
radius = 0.8
[[objects]]
shape = "plane"
point = [0, 0, 0]
normal = [0, 1, 0]
[[lights]]
type = "disk"
center = [2, 5, 2]
normal = [-0.3, -1, -0.3]
radius = 1.5
radiance = 6
"#;

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    folder
}

/// Reads the fields of a packet.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (head, tail) = self.0.split_first_chunk().expect("a longer packet");
        self.0 = tail;
        *head
    }

    fn number(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn text(&mut self) -> String {
        let end = self.0.iter().position(|b| *b == 0).expect("an end of the text");
        let text = String::from_utf8(self.0[..end].to_vec()).unwrap();
        self.0 = &self.0[end + 1..];
        text
    }
}

/// A viewer as tev is: what it shows at the end, and how many updates came.
fn receive(mut stream: TcpStream) -> (String, [u32; 2], Vec<f32>, usize) {
    let (mut name, mut size, mut shown, mut updates) = (String::new(), [0; 2], Vec::new(), 0);
    let mut length = [0; 4];
    while stream.read_exact(&mut length).is_ok() {
        let mut packet = vec![0; u32::from_le_bytes(length) as usize - 4];
        stream.read_exact(&mut packet).unwrap();
        let mut fields = Fields(&packet);
        let [kind, _focus] = fields.take();
        let of = fields.text();
        match kind {
            4 => {
                name = of;
                size = [fields.number(), fields.number()];
                shown = vec![0.0; 3 * (size[0] * size[1]) as usize];
                assert_eq!(fields.number(), 3);
                assert_eq!([fields.text(), fields.text(), fields.text()], ["R", "G", "B"]);
            }
            6 => {
                updates += 1;
                assert_eq!(of, name);
                assert_eq!(fields.number(), 3);
                assert_eq!([fields.text(), fields.text(), fields.text()], ["R", "G", "B"]);
                let [x, y, w, h] = std::array::from_fn(|_| fields.number());
                let [offsets, strides]: [[u64; 3]; 2] = std::array::from_fn(|_| {
                    std::array::from_fn(|_| u64::from_le_bytes(fields.take()))
                });
                let values: Vec<f32> = fields
                    .0
                    .chunks_exact(4)
                    .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
                    .collect();
                for (i, (row, column)) in
                    (0..h).flat_map(|row| (0..w).map(move |column| (row, column))).enumerate()
                {
                    for c in 0..3 {
                        let to = 3 * ((y + row) * size[0] + x + column) as usize + c;
                        shown[to] = values[offsets[c] as usize + i * strides[c] as usize];
                    }
                }
                continue;
            }
            other => panic!("packet of kind {other}"),
        }
        assert!(fields.0.is_empty());
    }
    (name, size, shown, updates)
}

#[test]
fn tev_shows_the_picture_that_is_written() {
    let folder = folder();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let viewer = std::thread::spawn(move || receive(listener.accept().unwrap().0));
    // Long enough for some updates on the way.
    let arguments = ["--time", "2600ms", "-o", "out.exr", "--exr-type", "float", "--tev", &address];
    let all: Vec<&str> = ["render", "scene.toml", "-q"].into_iter().chain(arguments).collect();
    let output = alhazen(folder.path(), &all);
    assert!(output.status.success(), "{}", stderr(&output));
    let (name, size, shown, updates) = viewer.join().unwrap();
    assert_eq!((name.as_str(), size), ("out.exr", [200, 150]));
    // Four tiles; as they come to be, and at the end.
    assert!(updates >= 8, "{updates}");
    let picture = read_exr(&folder.path().join("out.exr")).unwrap();
    let expected: Vec<f32> = picture.pixels.iter().flat_map(|c| c.to_array()).collect();
    assert_eq!(shown, expected);
}

#[test]
fn a_viewer_that_goes_away_does_not_end_the_render() {
    let folder = folder();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let viewer = std::thread::spawn(move || drop(listener.accept().unwrap()));
    let all = ["render", "scene.toml", "--time", "2500ms", "-o", "out.exr", "--tev", &address];
    let output = alhazen(folder.path(), &all);
    viewer.join().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stderr(&output).contains("warning: tev: "), "{}", stderr(&output));
    assert!(folder.path().join("out.exr").exists());
    // Nobody there from the start is a mistake, told before any work.
    let output = alhazen(folder.path(), &all);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("accepted: HOST:PORT of a running tev"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn a_preview_comes_while_it_renders() {
    let folder = folder();
    let folder = folder.path();
    let arguments = "render scene.toml -q --samples 2000 -o out.exr -o out.png --preview p.png \
                     --preview-every 50ms";
    let mut child = Command::new(env!("CARGO_BIN_EXE_alhazen"))
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .stderr(Stdio::inherit())
        .spawn()
        .unwrap();
    let (start, preview) = (Instant::now(), folder.join("p.png"));
    while !preview.exists() && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(2));
    }
    // Whole whenever it is looked at.
    assert_eq!(read_png(&preview).unwrap().size, [200, 150]);
    assert!(child.wait().unwrap().success());
    assert_eq!(read_png(&preview).unwrap(), read_png(&folder.join("out.png")).unwrap());
    // Looking did not change the picture.
    let output = alhazen(folder, &["render", "scene.toml", "-q", "--samples", "2000"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let read = |name: &str| std::fs::read(folder.join(name)).unwrap();
    assert!(read("out.exr") == read("scene.exr"));
}

#[test]
fn statistics_tell_the_error_by_samples() {
    let folder = folder();
    let stats = |arguments: &str| -> serde_json::Value {
        let all = "render scene.toml -q --size 60x40 --stats s.json";
        let all: Vec<&str> = all.split(' ').chain(arguments.split(' ')).collect();
        let output = alhazen(folder.path(), &all);
        assert!(output.status.success(), "{}", stderr(&output));
        let text = std::fs::read_to_string(Path::new(folder.path()).join("s.json")).unwrap();
        serde_json::from_str(&text).unwrap()
    };
    for arguments in ["--error 1%", "--error 1% --adaptive"] {
        let found = stats(arguments);
        let list = found["error_by_samples"].as_array().unwrap();
        assert!(list.len() > 3, "{found}");
        let samples: Vec<u64> = list.iter().map(|at| at["samples"].as_u64().unwrap()).collect();
        assert!(samples.windows(2).all(|pair| pair[0] < pair[1]), "{samples:?}");
        let last = &list[list.len() - 1];
        assert_eq!((&last["error"], &last["samples"]), (&found["error"], &found["samples"]));
        let bounds = found["error_interval"].as_array().unwrap();
        let error = found["error"].as_f64().unwrap();
        assert!(bounds[0].as_f64().unwrap() < error && error < bounds[1].as_f64().unwrap());
        assert!(error <= 0.01);
    }
    let found = stats("--samples 16");
    assert_eq!(found["error_by_samples"].as_array().unwrap().len(), 1);
    assert!(stats("--samples 1")["error_by_samples"].as_array().unwrap().is_empty());
}
