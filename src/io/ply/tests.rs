//! Small files written by hand, with known contents.

use std::path::PathBuf;

use super::*;
use crate::io::mesh::read_mesh;

/// A file that is gone when this is dropped.
struct TempFile(PathBuf);

impl TempFile {
    fn new(name: &str, bytes: &[u8]) -> Self {
        let path = std::env::temp_dir().join(format!("alhazen-{}-{name}.ply", std::process::id()));
        std::fs::write(&path, bytes).unwrap();
        Self(path)
    }
}

impl Drop for TempFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

fn try_parse(name: &str, bytes: &[u8]) -> Result<MeshFile, String> {
    let file = TempFile::new(name, bytes);
    let path = file.0.display().to_string();
    read_mesh(&file.0).map_err(|e| e.to_string().replace(&path, "f.ply"))
}

#[track_caller]
fn parse(name: &str, bytes: &[u8]) -> MeshFile {
    try_parse(name, bytes).unwrap()
}

#[track_caller]
fn assert_error(name: &str, bytes: &[u8], expected: &str) {
    assert_eq!(try_parse(name, bytes).unwrap_err(), expected);
}

#[test]
fn ascii_with_everything_to_skip() {
    let file = parse(
        "skip",
        b"ply\r\nformat ascii 1.0\r\ncomment x\r\nobj_info y z\r\n\
          element camera 1\r\nproperty float fov\r\nproperty list uchar int ids\r\n\
          element vertex 4\r\nproperty uchar red\r\nproperty double x\r\nproperty float y\r\n\
          property list char short extra\r\nproperty int16 z\r\nproperty float nx\r\n\
          property float ny\r\nproperty float nz\r\nproperty float texture_u\r\n\
          property float texture_v\r\n\
          element nothing 7\r\n\
          element face 2\r\nproperty short flag\r\nproperty list uint8 uint32 vertex_index\r\n\
          property list uchar float texcoord\r\nelement tail 9\r\nproperty int a\r\nend_header\r\n\
          30.5 2 8 9\r\n\
          1 0 0 0 0 0 0 1 0 0\r\n2 1 0 2 7 7 0 0 0 1 1 0\r\n3 1 1 1 -5 0 0 0 1 1 1\r\n\
          4 .0 1e0 0 0 0 0 1 0 1\r\n\
          -1 4 0 1 2 3 2 0.5 0.5\r\n0 3 0.0 1 2 0\r\n",
    );
    assert_eq!(file.warnings, [""; 0]);
    assert_eq!(*file.mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    assert_eq!(
        file.mesh.positions.as_flat(),
        [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]
    );
    assert_eq!(*file.mesh.normals.unwrap(), [[0.0, 0.0, 1.0]; 4]);
    assert_eq!(*file.mesh.uvs.unwrap(), [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
}

/// The bytes of numbers, in one order or the other.
struct Bytes {
    bytes: Vec<u8>,
    big: bool,
}

impl Bytes {
    fn new(header: &str, big: bool) -> Self {
        let order = if big { "big" } else { "little" };
        let start = format!("ply\nformat binary_{order}_endian 1.0\n{header}end_header\n");
        Self { bytes: start.into_bytes(), big }
    }
    fn put<const N: usize>(&mut self, little: [u8; N]) -> &mut Self {
        let mut b = little;
        if self.big {
            b.reverse();
        }
        self.bytes.extend(b);
        self
    }
}

#[test]
fn binary_of_all_types_in_both_orders() {
    for big in [false, true] {
        let mut b = Bytes::new(
            "element vertex 3\nproperty int8 a\nproperty double x\nproperty short y\n\
             property ushort q\nproperty uint z\nproperty float s\nproperty uchar t\n\
             element face 2\nproperty char flag\nproperty list ushort short vertex_indices\n\
             property double weight\n",
            big,
        );
        for (x, y, z) in [(0.5_f64, -2_i16, 3_u32), (-1.25, 300, 70_000), (1e-3, 0, 0)] {
            b.put([9]).put(x.to_le_bytes()).put(y.to_le_bytes()).put(7_u16.to_le_bytes());
            b.put(z.to_le_bytes()).put(0.25_f32.to_le_bytes()).put([200]);
        }
        for face in [[0_i16, 1, 2], [2, 1, 0]] {
            b.put([1]).put(3_u16.to_le_bytes());
            let _ = face.map(|i| b.put(i.to_le_bytes()).bytes.len());
            b.put(0.1_f64.to_le_bytes());
        }
        let file = parse("types", &b.bytes);
        assert_eq!(
            file.mesh.positions.as_flat(),
            [0.5, -2.0, 3.0, -1.25, 300.0, 70_000.0, 1e-3, 0.0, 0.0]
        );
        assert_eq!(*file.mesh.triangles, [[0, 1, 2], [2, 1, 0]]);
        assert_eq!(*file.mesh.uvs.unwrap(), [[0.25, 200.0]; 3]);
        assert_eq!((file.mesh.normals, file.warnings), (None, vec![]));
    }
}

/// Lists before, in and after the vertices, faces before them, and polygons among the triangles:
/// none of which the parallel reader takes.
#[test]
fn binary_one_by_one() {
    for big in [false, true] {
        let mut b = Bytes::new(
            "element junk 2\nproperty list int double d\n\
             element face 4\nproperty list uchar int vertex_indices\n\
             element vertex 5\nproperty list uchar uchar l\nproperty float x\nproperty float y\n\
             property float z\nproperty float nx\nproperty float ny\nproperty float nz\n",
            big,
        );
        b.put(0_i32.to_le_bytes()).put(1_i32.to_le_bytes()).put(2.5_f64.to_le_bytes());
        for face in [&[0_i32, 1, 2][..], &[0, 1, 2, 3, 4], &[1, 2], &[2, 3, 4]] {
            b.put([face.len() as u8]);
            face.iter().for_each(|i| _ = b.put(i.to_le_bytes()));
        }
        // A pentagon with its dent at vertex 3.
        for (i, (x, y)) in [(0, 0), (4, 0), (4, 4), (2, 1), (0, 4)].into_iter().enumerate() {
            b.put([i as u8]).bytes.extend(vec![0xee; i]);
            for v in [x, y, 0, 0, 0, 1] {
                b.put((v as f32).to_le_bytes());
            }
        }
        let file = parse("walk", &b.bytes);
        assert_eq!(
            file.warnings,
            ["1 face with fewer than 3 corners was skipped; the first is face 2"]
        );
        assert_eq!(file.mesh.triangles.len(), 5);
        assert_eq!(file.mesh.triangles[0], [0, 1, 2]);
        assert_eq!(file.mesh.triangles[4], [2, 3, 4]);
        let area: f32 = file.mesh.triangles[1..4]
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| file.mesh.positions.get(v as usize));
                0.5 * (b - a).cross(c - a).z
            })
            .inspect(|&area| assert!(area > 0.0))
            .sum();
        assert_eq!(area, 10.0);
        assert_eq!(*file.mesh.normals.unwrap(), [[0.0, 0.0, 1.0]; 5]);
    }
}

/// Many more faces than one chunk holds, the odd one out at the end: the parallel reader gives up.
#[test]
fn a_polygon_in_a_late_chunk() {
    const N: usize = 800_000;
    let header = format!(
        "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         element face {N}\nproperty list uchar uint vertex_indices\n"
    );
    let mut b = Bytes::new(&header, false);
    for v in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0] {
        b.put(v.to_le_bytes());
    }
    for i in 0..N {
        let n = if i == N - 1 { 4 } else { 3 };
        b.put([n]);
        (0..u32::from(n)).for_each(|k| _ = b.put(k.to_le_bytes()));
    }
    let mesh = parse("late", &b.bytes).mesh;
    assert_eq!(mesh.triangles.len(), N + 1);
    assert_eq!(mesh.triangles[N - 2..], [[0, 1, 2], [0, 1, 2], [0, 2, 3]]);

    // And a wrong index in the last chunk, with all triangles.
    let mut bytes = b.bytes;
    let n = bytes.len();
    bytes[n - 17] = 3;
    bytes[n - 16] = 77;
    let at = n - 17;
    assert_error(
        "late-index",
        &bytes[..n - 4],
        &format!(
            "f.ply: at byte {at}: face 799999 names vertex 77, but the number of vertices is 4 (the first is 0)"
        ),
    );
}

/// Far doubles keep their digits, whether read in parallel, one by one, or from text.
#[test]
fn far_doubles() {
    let points = [[5e5, 5.8e6, 10.0], [5e5 + 0.001, 5.8e6, 10.0], [5e5, 5.8e6 + 0.001, 10.5]];
    let xyz = "property double x\nproperty double y\nproperty double z\n";
    let face = "element face 1\nproperty list uchar int vertex_indices\n";
    let mut fixed = Bytes::new(&format!("element vertex 3\n{xyz}{face}"), true);
    let mut lists =
        Bytes::new(&format!("element vertex 3\n{xyz}property list uchar int l\n{face}"), false);
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex 3\n{xyz}{face}end_header\n");
    for p in points {
        let _ = p.map(|c: f64| fixed.put(c.to_le_bytes()).bytes.len());
        let _ = p.map(|c: f64| lists.put(c.to_le_bytes()).bytes.len());
        lists.put([0]);
        text += &format!("{} {} {}\n", p[0], p[1], p[2]);
    }
    for b in [&mut fixed, &mut lists] {
        b.put([3]).put(0_i32.to_le_bytes()).put(1_i32.to_le_bytes()).put(2_i32.to_le_bytes());
    }
    text += "3 0 1 2\n";
    let mut found = Vec::new();
    for (name, bytes) in [("a", &fixed.bytes), ("b", &lists.bytes), ("c", &text.into_bytes())] {
        let mesh = parse(name, bytes).mesh;
        for (i, p) in points.iter().enumerate() {
            let read = mesh.origin + mesh.positions.get(i).as_dvec3();
            assert!(read.distance(DVec3::from(*p)) < 1e-8, "{read} is not {p:?}");
        }
        found.push((mesh.origin, mesh.positions.as_flat().to_vec()));
    }
    assert_ne!(found[0].0, DVec3::ZERO);
    assert!(found.iter().all(|f| *f == found[0]));
}

#[test]
fn strips() {
    let file = parse(
        "strips",
        b"ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n\
          property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n\
          0 0 0 1 0 0 0 1 0 1 1 0 0 2 0\n\
          12 0 1 2 3 4 -1 2 1 3 3 1 -1\n",
    );
    let triangles = [[0, 1, 2], [2, 1, 3], [2, 3, 4], [2, 1, 3]];
    assert_eq!(*file.mesh.triangles, triangles);
}

#[test]
fn the_byte_after_the_header_is_data() {
    // Each vertex begins with 0x0a, which is also a line feed.
    let x = f32::from_le_bytes([0x0a, 0, 0, 0x3f]);
    for end in ["\n", "\r", "\r\n"] {
        let header = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n\
                      property float y\nproperty float z\nend_header\n";
        let mut bytes = header.replace('\n', end).into_bytes();
        for v in [x, 1.0, 2.0] {
            bytes.extend(v.to_le_bytes());
        }
        let file = parse("feed", &bytes);
        assert_eq!(file.mesh.positions.as_flat(), [x, 1.0, 2.0]);
        assert_eq!(file.warnings, ["no triangles (1 point)"]);
    }
}

#[test]
fn errors_name_the_place() {
    let head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                property float z\nelement face 1\nproperty list uchar int vertex_indices\n";
    let text = |body: &str| format!("{head}end_header\n{body}").into_bytes();
    let vertices = "0 0 0\n1 0 0\n0 1 0\n";
    for (name, bytes, expected) in [
        ("e0", b"".to_vec(), "f.ply: the file is empty"),
        ("e1", b"solid x".to_vec(), "f.ply: not a ply file: it does not begin with `ply`"),
        ("e2", b"ply\nformat ascii 1.0\n".to_vec(), "f.ply: the header has no line `end_header`"),
        (
            "e3",
            b"ply\nformat text 1.0\nend_header\n".to_vec(),
            "f.ply:2: unknown ply format `text`; accepted: ascii, binary_little_endian, \
             binary_big_endian",
        ),
        ("e4", b"ply\nend_header\n".to_vec(), "f.ply:2: the header has no `format`"),
        ("e5", b"ply\nelement vertex -3\n".to_vec(), "f.ply:2: `-3` is not a number of records"),
        (
            "e6",
            b"ply\nelement vertex 3\nproperty list float int x\n".to_vec(),
            "f.ply:3: a list's length cannot be of type `float`",
        ),
        (
            "e7",
            text(&format!("{vertices}3 0 1 3")),
            "f.ply:13: face 0 names vertex 3, but the number of vertices is 3 (the first is 0)",
        ),
        ("e8", text("0 0 0\n1 zero 0\n0 1 0\n3 0 1 2\n"), "f.ply:11: `zero` is not a number"),
        ("e9", text(&format!("{vertices}3 0 1")), "f.ply:13: the file ends too early"),
        ("e10", text(&format!("{vertices}-3 0 1 2")), "f.ply:13: a list of -3 items"),
        ("e11", text(&format!("{vertices}4000000000 0 1")), "f.ply:13: the file ends too early"),
        (
            "e12",
            b"ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nend_header\n1".to_vec(),
            "f.ply: element `vertex` lacks one of the properties x, y, z",
        ),
        (
            "e13",
            head.replace(" 3\n", " 18446744073709551615\n").into_bytes(),
            "f.ply: the header has no line `end_header`",
        ),
        (
            "e14",
            [head.replace("vertex 3\n", "vertex 4294967295\n").as_bytes(), b"end_header\n"]
                .concat(),
            "f.ply: 4294967295 vertices; at most 4294967294 are possible",
        ),
        (
            "e15",
            [head.replace("vertex 3\n", "vertex 4294967294\n").as_bytes(), b"end_header\n1"]
                .concat(),
            "f.ply:10: the file ends too early: 4294967294 records of element `vertex` do not fit into 1 bytes",
        ),
        (
            "e16",
            b"ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\n\
              end_header\n3 0 1 2\n"
                .to_vec(),
            "f.ply: the header has faces but no element `vertex`",
        ),
        (
            "e17",
            b"ply\nformat ascii 1.0\nelement vertex 18446744073709551615\nelement face 1\n\
              property list uchar float vertex_indices\nend_header\n3 0 1 2\n"
                .to_vec(),
            "f.ply: 18446744073709551615 vertices; at most 4294967294 are possible",
        ),
    ] {
        assert_error(name, &bytes, expected);
    }
}

/// Every way of cutting a binary file short is an error, and none a panic.
#[test]
fn cut_short_anywhere() {
    let mut b = Bytes::new(
        "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         element face 2\nproperty list uchar int vertex_indices\nproperty uchar tag\n",
        false,
    );
    (0..9_u8).for_each(|i| _ = b.put(f32::from(i).to_le_bytes()));
    for n in [3_u8, 4] {
        b.put([n]);
        (0..n).for_each(|i| _ = b.put(u32::from(i % 3).to_le_bytes()));
        b.put([7]);
    }
    assert_eq!(parse("whole", &b.bytes).mesh.triangles.len(), 3);
    for n in 0..b.bytes.len() {
        assert!(try_parse("cut", &b.bytes[..n]).is_err(), "{n} bytes");
    }
}

/// Random damage gives an error or a mesh that keeps its promises.
#[test]
fn damaged_anywhere() {
    let text = b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty double y\n\
        property float z\nproperty list uchar int q\nelement face 2\n\
        property list uchar int vertex_indices\nend_header\n0 0 0 0 1 0 0 1 5 1 1 0 0 0 1 0 0\n\
        4 0 1 2 3 3 2 1 0\n";
    let mut binary = Bytes::new(
        "element vertex 3\nproperty double x\nproperty float y\nproperty float z\n\
         element face 2\nproperty list uchar int vertex_indices\n",
        true,
    );
    (0..3_u8).for_each(|i| {
        binary.put(f64::from(i).to_le_bytes()).put([i; 4]).put([0, 0, i, 0]);
    });
    for _ in 0..2 {
        binary.put([3]).put(0_u32.to_le_bytes()).put(1_u32.to_le_bytes()).put(2_u32.to_le_bytes());
    }
    let mut state = 7_u64;
    let mut random = |n: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    for whole in [&text[..], &binary.bytes] {
        for _ in 0..3000 {
            let mut bytes = whole.to_vec();
            for _ in 0..=random(3) {
                let at = random(bytes.len());
                bytes[at] = match random(3) {
                    0 => random(256) as u8,
                    1 => b"0123456789 -\n"[random(13)],
                    _ => bytes[random(whole.len())],
                };
            }
            if let Ok(MeshFile { mesh, .. }) = try_parse("damaged", &bytes) {
                let n = mesh.positions.len();
                assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < n));
                assert!(mesh.positions.as_flat().iter().all(|c| c.is_finite()));
                assert!(mesh.normals.is_none_or(|v| v.len() == n));
            }
        }
    }
}
