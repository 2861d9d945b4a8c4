//! Small files written by hand, with known contents.

use super::*;

fn try_parse(text: &str) -> Result<MeshFile, String> {
    let path = Path::new("f.obj");
    let bytes = lines::normalize(text.as_bytes().to_vec());
    // In pieces of any size, the result must be the same.
    let mut results = [1, 7, 20, PIECE].map(|size| {
        let parsed = parse(path, &bytes, size).map_err(|e| e.to_string())?;
        assemble::mesh(path, parsed).map_err(|e| e.to_string())
    });
    let texts = results.each_ref().map(|result| format!("{result:?}"));
    assert!(texts.iter().all(|t| *t == texts[0]), "{texts:#?}");
    std::mem::replace(&mut results[0], Err(String::new()))
}

#[track_caller]
fn mesh(text: &str) -> MeshFile {
    try_parse(text).unwrap()
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 nan\nv 0 1 0\n";

#[test]
fn corners_of_every_form() {
    for face in [
        "f 1 2 3 4",
        "f 1/ 2/ 3/ 4/",
        "f 1// 2// 3// 4//",
        "f\t+1  -3 \\\n 3\\\r\n -1 # last",
        "fo -4 -3 -2 -1",
    ] {
        let file = mesh(&format!("\u{feff}{SQUARE}g a b\nusemtl c\\d\ns off\nl 1 2\n{face}"));
        assert_eq!(*file.mesh.triangles, [[0, 1, 2], [0, 2, 3]], "{face}");
        assert_eq!(file.mesh.positions.len(), 4);
        assert_eq!(file.mesh.positions.as_flat()[3..6], [1.0, 0.0, 0.0]);
        assert_eq!(file.warnings, [""; 0]);
        assert!(file.mesh.normals.is_none() && file.mesh.uvs.is_none());
    }
}

#[test]
fn relative_indices_count_from_where_they_stand() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 1\nf -4 -3 -1\n";
    assert_eq!(*mesh(text).mesh.triangles, [[0, 1, 2], [0, 1, 3]]);
}

#[test]
fn faces_may_precede_their_vertices() {
    assert_eq!(*mesh("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0").mesh.triangles, [[0, 1, 2]]);
}

#[test]
fn equal_indices_need_no_new_vertices() {
    let text = format!(
        "{SQUARE}vt 0 0\nvt 1\nvt 1 1\nvt 0 1\nvt 9 9\nvn 0 0 1\nvn 0 0 2\nvn 0 0 3\n\
         f 1/1/1 2/2/2 -2/3/-1\n"
    );
    let file = mesh(&text);
    assert_eq!(*file.mesh.triangles, [[0, 1, 2]]);
    assert_eq!(file.mesh.positions.len(), 4);
    assert_eq!(*file.mesh.uvs.unwrap(), [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
    let normals = [[0.0, 0.0, 1.0], [0.0, 0.0, 2.0], [0.0, 0.0, 3.0], [0.0; 3]];
    assert_eq!(*file.mesh.normals.unwrap(), normals);
    assert_eq!(file.warnings, [""; 0]);
}

#[test]
fn combinations_become_vertices() {
    let text = format!(
        "{SQUARE}vt 0 0\nvt 1 0\nvn 0 0 1\nvn 1 0 0\n\
         f 1/1/1 2/2/1 3/1/1\nf 1/1/1 3/1/1 4/2/2\nf 1/2/1 2/2/1 3/1/2"
    );
    let file = mesh(&text);
    assert_eq!(*file.mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 1, 5]]);
    let expected =
        [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0., 0., 0.], [1., 1., 0.]];
    assert_eq!(file.mesh.positions.as_flat(), expected.as_flattened());
    let uvs = [[0., 0.], [1., 0.], [0., 0.], [1., 0.], [1., 0.], [0., 0.]];
    assert_eq!(*file.mesh.uvs.unwrap(), uvs);
    let z = [0., 0., 1.];
    assert_eq!(*file.mesh.normals.unwrap(), [z, z, z, [1., 0., 0.], z, [1., 0., 0.]]);
}

#[test]
fn incomplete_attributes_are_dropped() {
    let some = mesh(&format!("{SQUARE}vn 0 0 1\nvt 0 0\nf 1 2 3\nf 1/1/1 3/1/1 4/1\nf 2 3 4"));
    assert_eq!(
        some.warnings,
        [
            "the texture coordinates were dropped: 6 of 9 corners of faces have none",
            "the normals were dropped: 7 of 9 corners of faces have none",
        ]
    );
    assert_eq!(some.mesh.positions.len(), 4);
    let wrong = mesh(&format!("{SQUARE}vn 0 0 1\nf 1//1 2//1 3//1\nf 1//1 3//0 4//7"));
    assert_eq!(
        wrong.warnings,
        ["the normals were dropped: indices are out of range, the first in line 7 (0 of 1)"]
    );
    assert_eq!(*wrong.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert!(wrong.mesh.normals.is_none());
}

#[test]
fn small_and_unknown_statements_are_counted() {
    let file = mesh(&format!("{SQUARE}f\nf 1 2\ncurv 0 1 1 2\nf 1 2 3\nsurf 1\nf 4\n"));
    assert_eq!(
        file.warnings,
        [
            "statements that are not understood were ignored; the first is `curv` in line 7",
            "3 faces with fewer than 3 corners were skipped; the first is in line 5",
        ]
    );
    assert_eq!(*file.mesh.triangles, [[0, 1, 2]]);
}

#[test]
fn concave_quads_and_crossing_outlines() {
    let dent = "v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nf 4 1 2 3\n";
    assert_eq!(*mesh(dent).mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    let dent = "v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nf 2 3 4 1\n";
    assert_eq!(*mesh(dent).mesh.triangles, [[2, 3, 0], [2, 0, 1]]);
    let file = mesh(&format!("{SQUARE}v 2 2 0\nf 1 2 3\nf 1 3 2 4 5\n"));
    assert_eq!(file.mesh.triangles.len(), 4);
    assert_eq!(
        file.warnings,
        [
            "1 polygon whose outline crosses itself or is far from plane was cut by guess; the first is in line 7"
        ]
    );
}

#[test]
fn far_coordinates_get_an_origin() {
    let mesh = mesh("v 500000.001 0 1\nv 500000.002 0 1\nv 500000.001 1 1\nf 1 2 3").mesh;
    assert_ne!(mesh.origin.x, 0.0);
    let x = mesh.origin.x + f64::from(mesh.positions.get(1).x);
    assert!((x - 500_000.002).abs() < 1e-8);
}

#[test]
fn errors_name_the_line() {
    for (text, expected) in [
        ("v 0 0\n", "f.obj:1: 2 of at least 3 numbers"),
        ("\nv 0 zero 0\n", "f.obj:2: `zero` is not a number"),
        (
            "v 0 0 0\n\nf 1 1 \\\n 2\n",
            "f.obj:3: the face names vertex 2, but the number of vertices is 1 (the first is 1, the last -1)",
        ),
        (
            "v 0 0 0\nf 1 1 0\n",
            "f.obj:2: the face names vertex 0, but the number of vertices is 1 (the first is 1, the last -1)",
        ),
        (
            "f -1 -2 -3\nv 0 0 0\n",
            "f.obj:1: the face names vertex -1, but the number of vertices is 1 (the first is 1, the last -1)",
        ),
        (
            "v 0 0 0\nf 1 1 99999999999999999999\n",
            "f.obj:2: `99999999999999999999` is not a corner of a face; accepted: v, v/vt, v//vn, \
             v/vt/vn, each a whole number",
        ),
        (
            "v 0 0 0\nf 1/1/1/1 1 1\n",
            "f.obj:2: `1/1/1/1` is not a corner of a face; accepted: v, v/vt, v//vn, v/vt/vn, each \
             a whole number",
        ),
        (
            "v 0 0 0\nf /1 1 1\n",
            "f.obj:2: the face names vertex none, but the number of vertices is 1 (the first is 1, the last -1)",
        ),
        ("\n<html>\n", "f.obj: not an obj file: line 2 begins with `<html>`"),
    ] {
        assert_eq!(try_parse(text).unwrap_err(), expected);
    }
}

#[test]
fn damaged_anywhere() {
    let whole = format!("{SQUARE}vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -1//1 1/1 2\n");
    let mut state = 3_u64;
    let mut random = |n: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % n
    };
    for _ in 0..2000 {
        let mut text = whole.clone().into_bytes();
        for _ in 0..=random(4) {
            let at = random(text.len());
            text[at] = b"0123456789 -/\\\nvtnf."[random(20)];
        }
        if let Ok(MeshFile { mesh, .. }) = try_parse(&String::from_utf8(text).unwrap()) {
            let n = mesh.positions.len();
            assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < n));
            assert!(mesh.normals.is_none_or(|v| v.len() == n));
            assert!(mesh.uvs.is_none_or(|v| v.len() == n));
        }
    }
}
