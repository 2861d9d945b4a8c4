//! The exact text of what is wrong with a scene, as a person reads it.
#![allow(missing_docs, reason = "a test program")]

use alhazen::accel::AccelKind;
use alhazen::io::{LoadOptions, load_scene};
use alhazen::scene::Scene;

/// All messages for a scene file of this text, a line each, with the folder's name taken off.
fn mistakes(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("f.toml");
    std::fs::write(&path, text).unwrap();
    std::fs::write(folder.path().join("eight.raw"), [0; 8]).unwrap();
    let message = match load_scene(&path, &LoadOptions::default()) {
        Err(error) => error.to_string(),
        Ok(loaded) => match Scene::build_quietly(loaded.scene, AccelKind::Brute) {
            Ok(_) => "no mistake".to_owned(),
            Err(errors) => errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"),
        },
    };
    message.replace(&format!("{}/", folder.path().display()), "")
}

#[track_caller]
fn check(text: &str, expected: &str) {
    assert_eq!(mistakes(text), expected.trim_matches('\n'), "for:\n{text}");
}

#[test]
fn all_mistakes_are_told_in_one_run() {
    check(
        r#"
[image]
size = [0, 10]
[camera]
eye = [0, 0]
fov = 181
[render]
samples = -1
filter = "boxx"
epsilon = "small"
[[objects]]
shape = "sphere"
raduis = 1.0
[[objects]]
shape = "spere"
radius = 1.0
[[lights]]
type = "point"
position = [0, 1, 0]
"#,
        r"
f.toml:3:8: `size` must be [width, height] in pixels, whole numbers from 1 to 65535, not [0, 10]
f.toml:5:7: `eye` must be a list of 3 finite numbers, not [0, 0]
f.toml:6:7: `fov` must be an angle between 0 and 180 degrees, not the number 181
f.toml:8:11: `samples` must be a whole number from 1 to 16777216, not the number -1
f.toml:9:10: unknown filter `boxx` (did you mean `box`?); accepted: box, triangle, gaussian, mitchell, blackman-harris
f.toml:10:11: `epsilon` must be &quot;auto&quot; or a distance from 0 on, not the text &quot;small&quot;
f.toml:11:1: a sphere lacks the field `radius`
f.toml:13:1: unknown field `raduis` in a sphere (did you mean `radius`?); accepted: shape, center, radius, material, name, transform, texture_transform
f.toml:15:9: unknown shape `spere` (did you mean `sphere`?); accepted: sphere, box, cylinder, cone, torus, disk, plane, quadric, implicit, isosurface, polygon, triangle, mesh, patches, nurbs, subdivision
f.toml:17:1: [[lights]] lacks the field `intensity`
"
        .replace("&quot;", "\"")
        .as_str(),
    );
}

#[test]
fn syntax_is_told_with_its_place() {
    check("[camera\nfov = 3\n", "f.toml:1:8: unclosed table, expected `]`");
    assert!(mistakes("a = 1\na = 2\n").starts_with("f.toml:2:1: duplicate key"));
}

#[test]
fn unknown_tables_and_names() {
    check(
        "[imege]\nsize = [1, 1]\n[[objects]]\nshape = 3\n",
        "
f.toml:1:2: unknown field `imege` in the scene (did you mean `image`?); accepted: image, render, ambient, medium, camera, cameras, materials, lights, volumes, prototypes, objects
f.toml:4:9: `shape` must be text, not the number 3",
    );
    check(
        "[materials.gold]\ntype = \"diffuse\"\n[materials.grey]\ntype = \"diffuse\"\n[[objects]]\nshape = \"sphere\"\nradius = 1\nmaterial = \"golt\"\n[[objects]]\ninstance = \"tree\"\n",
        "
f.toml:8:12: unknown material `golt` (did you mean `gold`?); accepted: gold, grey
f.toml:10:12: unknown prototype `tree`; accepted: none is defined",
    );
}

#[test]
fn objects_are_one_thing() {
    check(
        "[[objects]]\nshape = \"sphere\"\nmesh = \"a.ply\"\n[[objects]]\nmaterial = \"x\"\n",
        "
f.toml:1:1: an object has one of the fields `shape`, `mesh`, `instance`
f.toml:4:1: an object has one of the fields `shape`, `mesh`, `instance`",
    );
}

#[test]
fn numbers_are_checked() {
    check(
        "[[objects]]\nshape = \"sphere\"\nradius = 0\n[[objects]]\nshape = \"sphere\"\nradius = nan\n[materials.m]\ntype = \"diffuse\"\nreflectance = 1.5\n[ambient]\nradiance = -1\n",
        "
f.toml:3:10: `radius` must be above 0, not 0
f.toml:6:10: `radius` must be a finite number (within 1e30), not the number NaN
f.toml:9:15: `reflectance` must lie in [0, 1]: a surface cannot reflect more light than it gets
f.toml:11:12: `radiance` must not be negative",
    );
}

#[test]
fn transforms_are_checked() {
    check(
        "[[objects]]\nshape = \"sphere\"\nradius = 1\ntransform = [{ rotate = { axis = [0, 0, 0], degrees = 3 } }]\n[[objects]]\nshape = \"sphere\"\nradius = 1\ntransform = [{ shear = 2 }]\n[[objects]]\nshape = \"sphere\"\nradius = 1\ntransform = 3\n",
        "
f.toml:4:34: the `axis` of a rotation must not be zero
f.toml:8:16: unknown field `shear` in a step of a transform; accepted: scale, rotate, translate, matrix
f.toml:12:13: `transform` must be a list of steps: { scale = … }, { rotate = … }, { translate = … }, { matrix = … }, not the number 3",
    );
    check(
        "[[objects]]\nshape = \"sphere\"\nradius = 1\ntransform = [{ scale = [1, 0, 1] }]\n",
        "f.toml:1:1: the transform of this object is singular: it flattens the object to a plane, a line or a point",
    );
}

#[test]
fn copies_are_checked() {
    check(
        "[prototypes.a]\nobjects = [{ shape = \"sphere\", radius = 1 }]\n[[objects]]\ninstance = \"a\"\ntransforms = [[1,0,0,0, 0,1,0,0, 0,0,1,0], [1,0,0,0, 0,0,0,0, 0,0,1,0]]\n",
        "f.toml:3:1: transform 1 (counted from 0) of this object is singular or not finite",
    );
    check(
        "[prototypes.a]\nobjects = [{ instance = \"b\" }]\n[prototypes.b]\nobjects = [{ instance = \"a\" }]\n[[objects]]\ninstance = \"a\"\n",
        "f.toml:4:25: prototype `a` contains itself",
    );
}

#[test]
fn cameras_need_a_direction() {
    check(
        "[camera]\neye = [1, 2, 3]\ntarget = [1, 2, 3]\n",
        "f.toml:1:1: the camera has no direction: `eye` and `target` must differ, and `up` must not be parallel to the view; a `transform` must not be singular or sheared",
    );
    check(
        "[camera]\nprojection = \"orthographic\"\neye = [1, 2, 3]\n",
        "f.toml:1:1: an orthographic camera that is placed needs a `height`",
    );
}

#[test]
fn inline_meshes_are_checked() {
    check(
        "[[objects]]\nshape = \"mesh\"\npositions = [[0,0,0], [1,0,0], [0,1,0]]\ntriangles = [[0, 1, 3]]\n[[objects]]\nshape = \"triangle\"\npoints = [[0,0,0], [1,0,0]]\n",
        "
f.toml:4:14: triangle 0 names vertex 3, but there are 3 (the first is 0)
f.toml:7:10: `points` must be three points, not a list of 2",
    );
}

#[test]
fn files_that_a_scene_names_are_told_with_their_own_place() {
    let text = mistakes("[[objects]]\nmesh = \"none.ply\"\n[[objects]]\nmesh = \"tree.fbx\"\n");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 2, "{text}");
    assert!(lines[0].starts_with("f.toml:2:8: none.ply: cannot open: "), "{text}");
    assert!(
        lines[1].starts_with("f.toml:4:8: tree.fbx: unknown mesh file extension `.fbx`"),
        "{text}"
    );
}

#[test]
fn an_empty_scene_is_no_mistake() {
    check("", "no mistake");
}

/// Each mistake of a shape, by itself.
#[test]
fn mistakes_of_shapes_are_told() {
    for (fields, expected) in [
        ("\"sphere\"\nradius = 0", "f.toml:3:10: `radius` must be above 0, not 0"),
        (
            "\"sphere\"\nradius = nan",
            "f.toml:3:10: `radius` must be a finite number (within 1e30), not the number NaN",
        ),
        (
            "\"box\"\nmin = [0, 0, 0]\nmax = [1, -1, 1]",
            "f.toml:4:7: `max` must be greater than `min` along every axis; it is from [0, 0, 0] to [1, -1, 1]",
        ),
        (
            "\"cylinder\"\nfrom = [1, 2, 3]\nto = [1, 2, 3]\nradius = 1",
            "f.toml:4:6: `to` must differ from `from`",
        ),
        (
            "\"cone\"\nfrom = [0, 0, 0]\nto = [0, 1, 0]\nradii = [0, 0]",
            "f.toml:5:9: `radii` must not be below 0, nor both be 0",
        ),
        (
            "\"cone\"\nfrom = [0, 0, 0]\nto = [0, 1, 0]\nradii = [0, 1]\nradius = 1",
            "f.toml:6:10: a cone has either `radius` or `radii`",
        ),
        (
            "\"torus\"\naxis = [0, 0, 0]\nmajor_radius = 1\nminor_radius = 0.5",
            "f.toml:3:8: `axis` must not be zero",
        ),
        (
            "\"torus\"\nmajor_radius = -1\nminor_radius = 0.5",
            "f.toml:3:16: `major_radius` must not be below 0, as -1 is",
        ),
        (
            "\"disk\"\nradius = 1\ninner_radius = 2",
            "f.toml:4:16: `inner_radius` must be less than `radius`, 1",
        ),
        ("\"plane\"\nnormal = [0, 0, 0]", "f.toml:3:10: `normal` must not be zero"),
        (
            "\"quadric\"\ncoefficients = [0, 0, 0, 0, 0, 0, 0, 0, 0, 1]\nbounds = [[0, 0, 0], [1, 1, 1]]",
            "f.toml:3:16: `coefficients` are those of x², y², z², xy, xz, yz, x, y, z and 1, of which the first nine must not all be 0",
        ),
        (
            "\"quadric\"\ncoefficients = [1, 0, 0, 0, 0, 0, 0, 0, 0, 1]\nbounds = [[0, 0, 0], [1, 0, 1]]",
            "f.toml:4:10: the second corner of `bounds` must be greater than the first along every axis; it is from [0, 0, 0] to [1, 0, 1]",
        ),
        (
            "\"polygon\"\npoints = [[0, 0, 0], [1, 0, 0]]",
            "f.toml:3:10: a polygon has three corners or more, not 2",
        ),
        (
            "\"polygon\"\npoints = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]",
            "f.toml:3:10: the `points` of a polygon span no area",
        ),
        (
            "\"polygon\"\npoints = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]\nholes = [[[0.2, 0.2, 0], [0.4, 0.2, 0.1], [0.2, 0.4, 0]]]",
            "f.toml:4:10: point 1 (counted from 0) is 1.000e-1 off the plane of the polygon; accepted: up to 1.000e-5",
        ),
    ] {
        check(&format!("[[objects]]\nshape = {fields}\n"), expected);
    }
}

/// What has no texture coordinates or cannot be sampled says so.
#[test]
fn what_a_shape_cannot_be_is_told() {
    let quadric = "shape = \"quadric\"\ncoefficients = [1, 1, 1, 0, 0, 0, 0, 0, 0, -1]\nbounds = [[-1, -1, -1], [1, 1, 1]]";
    check(
        &format!(
            "[materials.m]\ntype = \"diffuse\"\nreflectance = {{ checker = [0, 1], space = \"uv\" }}\n[[objects]]\n{quadric}\nmaterial = \"m\"\n"
        ),
        "f.toml:4:1: the texture of material `m` needs texture coordinates, which this object does not have; accepted: one with them, or a texture by position (for images `mapping` = \"planar\", \"spherical\" or \"cylindrical\")",
    );
    for shape in [quadric, "shape = \"plane\""] {
        check(
            &format!(
                "[materials.m]\ntype = \"diffuse\"\nreflectance = 0\nemission = 1\n[[objects]]\n{shape}\nmaterial = \"m\"\n"
            ),
            "f.toml:5:1: this object cannot give off light; accepted with `emission`: meshes, and all shapes but `plane`, `quadric`, `implicit` and `isosurface`",
        );
    }
}

/// Copies that are strewn.
#[test]
fn mistakes_of_scatter_are_told() {
    for (scatter, expected) in [
        ("count = 5", "`scatter` has one of the fields `mesh` and `bounds`"),
        ("bounds = [[0, 0, 0], [1, 1, 1]]", "scatter lacks the field `count`"),
        (
            "count = -1, bounds = [[0, 0, 0], [1, 1, 1]]",
            "`count` must be a whole number from 0 to 200000000, not the number -1",
        ),
        (
            "count = 5, bounds = [[0, 0, 0], [1, -1, 1]]",
            "`bounds` must be [[least x, y, z], [greatest x, y, z]]",
        ),
        (
            "count = 5, bounds = [[0, 0, 0], [1, 1, 1]], scale = [2, 1]",
            "`scale` must be [least, greatest], both above 0",
        ),
        (
            "count = 5, bounds = [[0, 0, 0], [1, 1, 1]], turn = \"upp\"",
            "unknown turn `upp` (did you mean `up`?); accepted: none, up, any",
        ),
        (
            "count = 5, bounds = [[0, 0, 0], [1, 1, 1]], follow_surface = true",
            "unknown field `follow_surface` in scatter; accepted: count, seed, turn, scale, mesh, bounds",
        ),
    ] {
        let text = format!(
            "[[prototypes.b.objects]]\nshape = \"sphere\"\nradius = 1\n[[objects]]\ninstance = \"b\"\nscatter = {{ {scatter} }}\n"
        );
        let found = mistakes(&text);
        assert!(found.ends_with(expected), "{found}");
        assert_eq!(found.lines().count(), 1, "{found}");
    }
}

#[test]
fn expressions_are_told_at_the_character() {
    let object = "[[objects]]\nshape = \"implicit\"\nbounds = [[-1, -1, -1], [1, 1, 1]]\n";
    let told = "expected an operator (+ - * / ^) or the end, not `y`";
    for (line, place) in [
        ("expression = \"x + 2y\"", "4:20"),
        ("expression = 'x + 2y'", "4:20"),
        ("expression = \"\"\"x + \n  2y\"\"\"", "5:4"),
        ("expression = '''\nx +\n  2y'''", "6:4"),
        // With an escape, columns are not counted.
        ("expression = \"x +\\n2y\"", "4:14"),
    ] {
        check(&format!("{object}{line}\n"), &format!("f.toml:{place}: in `expression`: {told}"));
    }
    check(
        "[[objects]]\nshape = \"implicit\"\nexpression = \"x - rr\"\nbounds = [[1, 0, 0], [0, 1, 1]]\n",
        "
f.toml:3:19: in `expression`: unknown name `rr`; accepted: x, y, z, pi and the functions sqrt, cbrt, abs, exp, log, ln, sin, cos, tan, atan, min, max, pow
f.toml:4:10: the second corner of `bounds` must be greater than the first along every axis; it is from [1, 0, 0] to [0, 1, 1]",
    );
}

/// Grids: what is in the file, and what is said of it.
#[test]
fn each_mistake_of_a_grid_is_told() {
    let bounds = "bounds = [[0, 0, 0], [1, 1, 1]]";
    let volume = |rest: &str| format!("[[volumes]]\n{bounds}\n{rest}\n");
    let raw = "grid = \"eight.raw\"\nsize = [2, 2, 2]\nformat = \"u8\"\n";
    for (rest, expected) in [
        (
            "grid = \"a.vdb\"\ntransfer = []",
            "f.toml:3:8: `grid` must be the name of a .npy or .raw file\nf.toml:4:12: a transfer function needs at least one node",
        ),
        (
            "grid = \"eight.raw\"\nsize = [2, 1, 4]\nformat = \"f16\"",
            "f.toml:1:1: [[volumes]] lacks the field `transfer`\nf.toml:4:8: `size` must be three whole numbers from 2 on: samples along x, y and z\nf.toml:5:10: unknown format `f16` (did you mean `u16`?); accepted: u8, i8, u16, i16, u32, i32, f32, f64",
        ),
        (
            "grid = \"eight.raw\"\nsize = [2, 2, 3]\nformat = \"u8\"\ntransfer = [{ value = 0, extinction = 1 }]",
            "f.toml:3:8: eight.raw: 2 x 2 x 3 samples of 1 bytes are 12 bytes, but the file holds 8",
        ),
        (
            &format!(
                "{raw}transfer = [{{ value = 1, extinction = 1 }}, {{ value = 0, extinction = 1 }}]"
            ),
            "f.toml:6:12: the values of a transfer function must ascend: 0 follows 1",
        ),
        (
            &format!("{raw}transfer = [{{ value = 1, extinction = -1 }}]\ntolerance = 0"),
            "f.toml:6:39: `extinction` must not be below 0, as -1 is\nf.toml:7:13: `tolerance` must be above 0, not 0",
        ),
        (
            &format!(
                "{raw}transfer = [{{ value = 1, extinction = 1 }}]\ntransform = [{{ scale = [1, 0, 1] }}]"
            ),
            "f.toml:1:1: the transform of this object is singular: it flattens the object to a plane, a line or a point",
        ),
    ] {
        check(&volume(rest), expected);
    }
    check(
        "[[objects]]\nshape = \"isosurface\"\ngrid = \"f.toml.npy\"\nbounds = [[0, 0, 0], [1, 0, 1]]\nlevel = \"high\"",
        "f.toml:3:8: f.toml.npy: cannot open: No such file or directory (os error 2)\nf.toml:4:10: the second corner of `bounds` must be greater than the first along every axis; it is from [0, 0, 0] to [1, 0, 1]\nf.toml:5:9: `level` must be a finite number (within 1e30), not the text \"high\"",
    );
}
