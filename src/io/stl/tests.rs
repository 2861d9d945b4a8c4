//! Small files written by hand, with known contents.

use super::*;
use crate::io::mesh::read_mesh;

fn try_parse(name: &str, bytes: &[u8]) -> Result<MeshFile, String> {
    let path = std::env::temp_dir().join(format!("alhazen-{}-{name}.stl", std::process::id()));
    std::fs::write(&path, bytes).unwrap();
    let result =
        read_mesh(&path).map_err(|e| e.to_string().replace(&path.display().to_string(), "f.stl"));
    std::fs::remove_file(&path).unwrap();
    result
}

type Triangle = [[f32; 3]; 3];

fn binary(header: &[u8], triangles: &[Triangle]) -> Vec<u8> {
    let mut bytes = header.to_vec();
    bytes.resize(80, b' ');
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for t in triangles {
        bytes.extend([0xff; 12]);
        t.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend([1, 2]);
    }
    bytes
}

const SQUARE: [Triangle; 2] = [
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, -0.0]],
    [[-0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]],
];

#[test]
fn binary_is_welded() {
    for header in [&b"solid facet"[..], b"", b"binary"] {
        let file = try_parse("weld", &binary(header, &SQUARE)).unwrap();
        assert_eq!(*file.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        let xyz = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
        assert_eq!(file.mesh.positions.as_flat(), xyz);
        assert_eq!(file.warnings, [""; 0]);
    }
}

/// Over several chunks, in the order of first appearance: a grid strip with known numbering.
#[test]
fn chunks_are_welded_to_each_other() {
    let n = 3 * PER_CHUNK;
    let point = |i: usize| [(i / 2) as f32, (i % 2) as f32, 0.5];
    let strip: Vec<Triangle> = (0..n).map(|i| [i, i + 1, i + 2].map(point)).collect();
    let mesh = try_parse("strip", &binary(b"", &strip)).unwrap().mesh;
    assert_eq!(mesh.positions.len(), n + 2);
    assert_eq!(mesh.triangles.len(), n);
    for (i, t) in mesh.triangles.iter().enumerate() {
        assert_eq!(*t, [i as u32, i as u32 + 1, i as u32 + 2]);
        assert_eq!(mesh.positions.get(i).to_array(), point(i));
    }
}

#[test]
fn sizes_are_checked() {
    let whole = binary(b"solid x", &SQUARE);
    let mut longer = whole.clone();
    longer.extend(b"tail");
    let file = try_parse("longer", &longer).unwrap();
    assert_eq!(file.warnings, ["4 bytes after the last triangle were ignored"]);
    assert_eq!(file.mesh.triangles.len(), 2);
    assert_eq!(
        try_parse("shorter", &whole[..183]).unwrap_err(),
        "f.stl: at byte 80: the file ends too early: 2 triangles need 184 bytes, it has 183"
    );
    for n in 0..whole.len() {
        assert!(try_parse("cut", &whole[..n]).is_err(), "{n} bytes");
    }
    let none = try_parse("none", &binary(b"", &[])).unwrap();
    assert_eq!(none.warnings, ["no triangles (0 points)"]);
}

#[test]
fn not_finite() {
    let mut triangles = SQUARE;
    triangles[0][1][2] = f32::NAN;
    let file = try_parse("nan", &binary(b"", &triangles)).unwrap();
    assert_eq!(
        file.warnings,
        ["1 triangle with a NaN or infinite coordinate was dropped; the first is triangle 0"]
    );
    assert_eq!(file.mesh.triangles.len(), 1);
}

const FACET: &str = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
                     vertex 0 1e0 -0\nendloop\nendfacet\n";

#[test]
fn text_of_many_kinds() {
    let upper = FACET.to_uppercase();
    for (text, triangles, vertices) in [
        (format!("solid a facet b\n{FACET}endsolid a facet b"), 1, 3),
        (format!("\u{feff}\r\n SOLID\r\n{}ENDSOLID\r\n", upper.replace('\n', "\r\n")), 1, 3),
        (format!("solid a\r{}endsolid\r", FACET.replace('\n', "\r")), 1, 3),
        (format!("solid a\n{}endsolid", FACET.replace('\n', " ")), 1, 3),
        (format!("solid\nendsolid\nsolid b\n{FACET}{}endsolid\n", FACET.replace("1e0", "2")), 2, 4),
        (
            format!(
                "solid\n{}endsolid\n",
                FACET.replace("vertex 1 0 0", "vertex 1 0 0\nvertex 1 1 0")
            ),
            2,
            4,
        ),
    ] {
        let file = try_parse("text", text.as_bytes()).unwrap();
        assert_eq!(file.mesh.triangles.len(), triangles, "{text}");
        assert_eq!(file.mesh.positions.len(), vertices, "{text}");
        assert_eq!(file.warnings, [""; 0], "{text}");
    }
}

#[test]
fn text_far_from_zero_keeps_its_digits() {
    let facet =
        FACET.replace("vertex 0", "vertex 500000.001").replace("vertex 1", "vertex 500000.002");
    let mesh = try_parse("far", format!("solid\n{facet}endsolid").as_bytes()).unwrap().mesh;
    assert!((mesh.origin.x + f64::from(mesh.positions.get(1).x) - 500_000.002).abs() < 1e-8);
}

#[test]
fn faults_of_text() {
    let solid = |text: &str| try_parse("fault", format!("solid a\n{text}").as_bytes());
    let file = solid(FACET).unwrap();
    assert_eq!(file.warnings, ["no `endsolid` at the end: the file may be cut short"]);
    let file = solid("endsolid").unwrap();
    assert_eq!(file.warnings, ["no triangles (0 points)"]);
    let file = solid(&format!("{}endsolid", FACET.replace("vertex 1 0 0\n", ""))).unwrap();
    assert_eq!(
        file.warnings,
        [
            "1 face with fewer than 3 corners was skipped; the first is facet 0",
            "no triangles (0 points)"
        ]
    );
    for (text, expected) in [
        (&FACET[..56], "f.stl:5: the file ends inside a facet"),
        (&FACET[..41], "f.stl:4: the file ends inside a facet"),
        (&FACET.replace("1e0", "one"), "f.stl:6: `one` is not a number"),
        (
            &FACET.replace("endloop\n", ""),
            "f.stl:7: `endfacet` out of place; accepted: vertex, endloop",
        ),
        ("facet vertex 1 2 3", "f.stl:2: `vertex` out of place; accepted: outer loop, endfacet"),
    ] {
        assert_eq!(solid(text).unwrap_err(), expected, "{text}");
    }
    assert_eq!(
        try_parse("other", b"hello").unwrap_err(),
        "f.stl: not an stl file: neither text that begins with `solid` and has facets, nor the 84 \
         bytes that a binary file begins with"
    );
}
