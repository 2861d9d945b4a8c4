//! The readers over files made by other people: against other loaders where there is one, and
//! without a crash where the file is broken.

#![expect(clippy::print_stdout, reason = "to be seen with --nocapture")]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use alhazen::io::{MeshFile, read_mesh};
use glam::DVec3;

mod common;

fn assets(folder: &str, extension: &str) -> Vec<PathBuf> {
    common::assets().map_or_else(Vec::new, |root| common::files(&root.join(folder), &[extension]))
}

/// What two loaders must agree on, however they number vertices and cut polygons.
#[derive(Debug)]
struct Summary {
    triangles: usize,
    /// Twice the area.
    area: f64,
    /// Vector sum of the areas: turned-over triangles would show.
    vector_area: DVec3,
    /// Of the corners of all triangles.
    min: DVec3,
    max: DVec3,
}

impl Summary {
    fn new(triangles: impl Iterator<Item = [DVec3; 3]>) -> Self {
        let mut sum = Self {
            triangles: 0,
            area: 0.0,
            vector_area: DVec3::ZERO,
            min: DVec3::INFINITY,
            max: DVec3::NEG_INFINITY,
        };
        for [a, b, c] in triangles {
            let normal = (b - a).cross(c - a);
            sum.triangles += 1;
            sum.area += normal.length();
            sum.vector_area += normal;
            sum.min = sum.min.min(a).min(b).min(c);
            sum.max = sum.max.max(a).max(b).max(c);
        }
        sum
    }

    fn of(file: &MeshFile) -> Self {
        let mesh = &file.mesh;
        Self::new(
            mesh.triangles
                .iter()
                .map(|t| t.map(|v| mesh.origin + mesh.positions.get(v as usize).as_dvec3())),
        )
    }

    fn assert_same(&self, other: &Self, path: &Path) {
        let extent = (self.max - self.min).max_element().max(0.0);
        let text = format!("{}: {self:?} against {other:?}", path.display());
        assert_eq!(self.triangles, other.triangles, "{text}");
        if self.triangles > 0 {
            // Others read f32 without an origin, so the size of coordinates counts.
            let size = self.max.abs().max(self.min.abs()).max_element();
            assert!(self.min.distance(other.min) <= 1e-6 * size, "{text}");
            assert!(self.max.distance(other.max) <= 1e-6 * size, "{text}");
            let tolerance = 1e-5 * self.area + 1e-5 * extent * size;
            assert!((self.area - other.area).abs() <= tolerance, "{text}");
            assert!(self.vector_area.distance(other.vector_area) <= tolerance, "{text}");
        }
    }
}

fn check_promises(file: &MeshFile, path: &Path) {
    let mesh = &file.mesh;
    let n = mesh.positions.len();
    let path = path.display();
    assert!(mesh.triangles.iter().flatten().all(|&i| (i as usize) < n), "{path}");
    assert!(mesh.positions.as_flat().iter().all(|c| c.is_finite()), "{path}");
    assert!(mesh.normals.as_ref().is_none_or(|v| v.len() == n), "{path}");
    assert!(mesh.uvs.as_ref().is_none_or(|v| v.len() == n), "{path}");
}

#[test]
fn obj_as_tobj_reads_it() {
    for path in assets("mesh/obj", "obj") {
        let ours = read_mesh(&path).unwrap_or_else(|e| panic!("{e}"));
        check_promises(&ours, &path);
        let name = path.file_stem().unwrap().to_string_lossy();
        // It does not read these: UTF-16, "3.1+e2", normals that are not there, long lines (`l`).
        let is_odd = [
            "box_UTF16BE",
            "number_formats",
            "smoothing-group-two-squares",
            "testmixed",
            "line-prim",
        ]
        .contains(&&*name);
        println!("{}: {} triangles {:?}", name, ours.mesh.triangles.len(), ours.warnings);
        if is_odd {
            continue;
        }
        let options =
            tobj::LoadOptions { ignore_lines: true, ignore_points: true, ..Default::default() };
        let (models, _) = tobj::load_obj(&path, &options).unwrap();
        // tobj cuts no polygons here. Any cut has the same vector area, so a fan will do.
        let mut polygons = Vec::new();
        for mesh in models.iter().map(|m| &m.mesh) {
            let point = |i: &u32| {
                let p = &mesh.positions[3 * *i as usize..][..3];
                DVec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]))
            };
            let mut at = 0;
            for k in 0..mesh.indices.len() {
                let size = match mesh.face_arities.get(k) {
                    Some(&n) => n as usize,
                    None if mesh.face_arities.is_empty() => 3,
                    None => break,
                };
                if at + size > mesh.indices.len() {
                    break;
                }
                polygons.push(mesh.indices[at..at + size].iter().map(point).collect::<Vec<_>>());
                at += size;
            }
        }
        let fans =
            polygons.iter().flat_map(|p| (1..p.len().max(2) - 1).map(|i| [p[0], p[i], p[i + 1]]));
        let mut theirs = Summary::new(fans);
        let ours = Summary::of(&ours);
        if polygons.iter().any(|p| p.len() > 3) {
            // Not all polygons are plane and convex: another cut has another area.
            theirs.area = ours.area;
        }
        ours.assert_same(&theirs, &path);
    }
}

#[test]
fn a_concave_polygon_is_covered_once() {
    let Some(path) =
        assets("mesh/obj", "obj").into_iter().find(|p| p.ends_with("concave_polygon.obj"))
    else {
        return;
    };
    let file = read_mesh(&path).unwrap();
    let sum = Summary::of(&file);
    assert_eq!(file.mesh.triangles.len(), 64);
    assert_eq!(file.warnings, Vec::<String>::new());
    assert!((sum.area - sum.vector_area.length()).abs() < 1e-9 * sum.area);
}

#[test]
fn stl_as_stl_io_reads_it() {
    for path in assets("mesh/stl", "stl") {
        let ours = read_mesh(&path).unwrap_or_else(|e| panic!("{e}"));
        check_promises(&ours, &path);
        println!("{}: {} triangles {:?}", path.display(), ours.mesh.triangles.len(), ours.warnings);
        let mut file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let theirs = match stl_io::read_stl(&mut file) {
            Ok(theirs) => theirs,
            Err(error) => {
                println!("{}: stl_io says {error}", path.display());
                continue;
            }
        };
        let theirs_sum = Summary::new(theirs.faces.iter().map(|f| {
            f.vertices.map(|v| {
                let p = theirs.vertices[v];
                DVec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]))
            })
        }));
        let sum = Summary::of(&ours);
        // stl_io stops at the first `endsolid`.
        if sum.triangles != theirs_sum.triangles {
            println!("{}: stl_io has {} triangles", path.display(), theirs_sum.triangles);
            assert!(sum.triangles > theirs_sum.triangles);
            continue;
        }
        sum.assert_same(&theirs_sum, &path);
        assert_eq!(ours.mesh.positions.len(), theirs.vertices.len(), "{}", path.display());
    }
}

#[test]
fn ply_as_ply_rs_reads_it() {
    use ply_rs_bw::parser::Parser;
    use ply_rs_bw::ply::{DefaultElement, Property};
    for path in assets("mesh/ply", "ply") {
        let ours = read_mesh(&path).unwrap_or_else(|e| panic!("{e}"));
        check_promises(&ours, &path);
        println!("{}: {} triangles {:?}", path.display(), ours.mesh.triangles.len(), ours.warnings);
        let mut file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let ply = match Parser::<DefaultElement>::new().read_ply(&mut file) {
            Ok(ply) => ply,
            Err(error) => {
                println!("{}: ply-rs says {error}", path.display());
                continue;
            }
        };
        let number = |p: &Property| match *p {
            Property::Float(v) => f64::from(v),
            Property::Double(v) => v,
            ref other => panic!("{other:?}"),
        };
        let points: Vec<DVec3> = ply.payload["vertex"]
            .iter()
            .map(|v| DVec3::new(number(&v["x"]), number(&v["y"]), number(&v["z"])))
            .collect();
        assert_eq!(ours.mesh.positions.len(), points.len());
        for (i, p) in points.iter().enumerate() {
            let q = ours.mesh.origin + ours.mesh.positions.get(i).as_dvec3();
            assert!(p.distance(q) <= 1e-6 * p.length(), "{}: {p} {q}", path.display());
        }
        let faces: Vec<Vec<usize>> = ply
            .payload
            .get("face")
            .into_iter()
            .flatten()
            .map(|f| {
                let key = ["vertex_indices", "vertex_index"].into_iter().find_map(|k| f.get(k));
                match key.unwrap() {
                    Property::ListInt(v) => v.iter().map(|&i| i as usize).collect(),
                    Property::ListUInt(v) => v.iter().map(|&i| i as usize).collect(),
                    other => panic!("{other:?}"),
                }
            })
            .collect();
        let mut theirs = Summary::new(
            faces
                .iter()
                .flat_map(|f| (1..f.len() - 1).map(|i| [f[0], f[i], f[i + 1]].map(|v| points[v]))),
        );
        let sum = Summary::of(&ours);
        let is_triangles = faces.iter().all(|f| f.len() == 3);
        if !is_triangles {
            theirs.area = sum.area;
        }
        sum.assert_same(&theirs, &path);
        if is_triangles {
            let ours = ours.mesh.triangles.iter().map(|t| t.map(|i| i as usize).to_vec());
            assert!(ours.eq(faces.iter().cloned()), "{}", path.display());
        }
    }
}

/// The counts that the assets' README gives, from Trimesh.
#[test]
fn counts_of_the_readme() {
    let expected = [
        ("box_UTF16BE.obj", 12),
        ("box_longline.obj", 944),
        ("number_formats.obj", 1),
        ("smoothing-group-two-squares.obj", 3),
        ("issue-295-trianguation-failure.obj", 28),
        ("line-prim.obj", 0),
        ("points.ply", 0),
        ("Box.ply", 12),
        ("cube_binary_starts_with_nl.ply", 12),
        ("cube_att.ply", 12),
        ("suzanne.ply", 968),
        ("victorian_house_1.5M.ply", 1_571_193),
        ("triangle_with_two_solids.stl", 2),
        ("two_objects_mixed_case_names.stl", 24),
        ("sphere_binary_solid_header.stl", 1360),
        ("featuretype.STL", 3476),
    ];
    let all = ["obj", "ply", "stl"].map(|e| assets(&format!("mesh/{e}"), e)).concat();
    for (name, triangles) in expected {
        let Some(path) = all.iter().find(|p| p.ends_with(name)) else { continue };
        let file = read_mesh(path).unwrap();
        assert_eq!(file.mesh.triangles.len(), triangles, "{name}");
    }
    for (name, vertices) in [("featuretype.STL", 2010), ("unit_cube.STL", 8)] {
        let Some(path) = all.iter().find(|p| p.ends_with(name)) else { continue };
        let file = read_mesh(path).unwrap();
        assert_eq!(file.mesh.positions.len(), vertices, "{name}");
    }
}

#[test]
fn broken_files_are_refused_or_warned_about() {
    // What is odd about these is of no concern to us: colours, materials, areas of zero, no line
    // feed at the end, holes.
    let sound = [
        "trimesh_nancolor.obj",
        "deg_faces.obj",
        "eof_test.obj",
        "missing_material_file.obj",
        "no_material.obj",
        // Not closed.
        "busted.STL",
    ];
    for extension in ["obj", "ply", "stl"] {
        for path in assets(&format!("malformed/{extension}"), extension) {
            let start = Instant::now();
            let result = read_mesh(&path);
            let name = path.file_name().unwrap().to_string_lossy();
            match &result {
                Ok(file) => {
                    check_promises(file, &path);
                    println!(
                        "{name}: {} triangles, {:?}",
                        file.mesh.triangles.len(),
                        file.warnings
                    );
                    assert_eq!(file.warnings.is_empty(), sound.contains(&&*name), "{name}");
                }
                Err(error) => {
                    println!("{name}: {error}");
                    assert!(error.to_string().starts_with(&path.display().to_string()));
                }
            }
            assert!(start.elapsed() < Duration::from_secs(2), "{name}: {:?}", start.elapsed());
        }
    }
}
