//! Writes the meshes of the glass scenes, as binary PLY with shading normals: a wine glass of height 1, and
//! the wine in it, whose side lies within the wall of the glass.
//!
//! ```text
//! cargo run --example goblet -- scenes/meshes/goblet.ply scenes/meshes/wine.ply
//! ```

use std::error::Error;
use std::f64::consts::TAU;
use std::io::Write;

use glam::DVec2;

/// Quads around the axis, and between two points of a profile.
const AROUND: u32 = 64;
const BETWEEN: u32 = 4;

/// Profiles as (radius, height), from the axis at the bottom to the axis at the top: outside up, over the
/// rim, inside down.
const GLASS: [[f64; 2]; 22] = [
    [0.0, 0.004],
    [0.20, 0.003],
    [0.335, 0.0],
    [0.345, 0.008],
    [0.32, 0.018],
    [0.15, 0.035],
    [0.045, 0.09],
    [0.030, 0.20],
    [0.030, 0.34],
    [0.060, 0.42],
    [0.19, 0.50],
    [0.275, 0.62],
    [0.290, 0.74],
    [0.265, 0.88],
    [0.245, 0.985],
    [0.238, 0.993],
    [0.231, 0.985],
    [0.249, 0.88],
    [0.273, 0.74],
    [0.258, 0.625],
    [0.165, 0.515],
    [0.0, 0.455],
];
const WINE: [[f64; 2]; 5] =
    [[0.0, 0.446], [0.172, 0.509], [0.266, 0.622], [0.2815, 0.735], [0.2800, 0.760]];

/// A point of a profile, and the way it goes on there.
type Station = (DVec2, DVec2);

/// The curve of Catmull and Rom through the points, which begins and ends along a radius.
fn spline(points: &[[f64; 2]], ends_on_axis: bool) -> Vec<Station> {
    let mirrored = |p: DVec2| DVec2::new(-p.x, p.y);
    let inner: Vec<DVec2> = points.iter().map(|&p| DVec2::from(p)).collect();
    let last = inner[inner.len() - 1];
    let before = inner[inner.len() - 2];
    let mut all = vec![mirrored(inner[1])];
    all.extend(&inner);
    all.push(if ends_on_axis { mirrored(before) } else { 2.0 * last - before });
    let mut stations = Vec::new();
    for i in 1..all.len() - 2 {
        let [p0, p1, p2, p3] = [all[i - 1], all[i], all[i + 1], all[i + 2]];
        let (a, b) = (0.5 * (p2 - p0), 0.5 * (p3 - p1));
        let steps = if i == all.len() - 3 { BETWEEN + 1 } else { BETWEEN };
        for k in 0..steps {
            let t = f64::from(k) / f64::from(BETWEEN);
            let (t2, t3) = (t * t, t * t * t);
            let at = p1 * (2.0 * t3 - 3.0 * t2 + 1.0)
                + a * (t3 - 2.0 * t2 + t)
                + p2 * (3.0 * t2 - 2.0 * t3)
                + b * (t3 - t2);
            let along = (p1 - p2) * (6.0 * t2 - 6.0 * t)
                + a * (3.0 * t2 - 4.0 * t + 1.0)
                + b * (3.0 * t2 - 2.0 * t);
            stations.push((DVec2::new(at.x.max(0.0), at.y), along));
        }
    }
    stations
}

/// Turns profiles about +Y; between one and the next the surface has an edge.
fn lathe(profiles: &[Vec<Station>]) -> Vec<u8> {
    let (mut vertices, mut triangles) = (Vec::<[f32; 6]>::new(), Vec::<[u32; 3]>::new());
    for profile in profiles {
        let base = vertices.len() as u32;
        for (at, along) in profile {
            let n = DVec2::new(along.y, -along.x).normalize();
            for j in 0..AROUND {
                let (sin, cos) = (TAU * f64::from(j) / f64::from(AROUND)).sin_cos();
                let vertex = [at.x * sin, at.y, at.x * cos, n.x * sin, n.y, n.x * cos];
                vertices.push(vertex.map(|x| x as f32));
            }
        }
        for i in 0..profile.len() - 1 {
            for j in 0..AROUND {
                let vertex = |i: usize, j: u32| base + i as u32 * AROUND + j % AROUND;
                let (a, b) = (vertex(i, j), vertex(i, j + 1));
                let (c, d) = (vertex(i + 1, j + 1), vertex(i + 1, j));
                // On the axis one of the two has no area.
                if profile[i].0.x > 0.0 {
                    triangles.push([a, b, c]);
                }
                if profile[i + 1].0.x > 0.0 {
                    triangles.push([a, c, d]);
                }
            }
        }
    }
    let mut ply = format!(
        "ply\nformat binary_little_endian 1.0\ncomment examples/goblet.rs\n\
         element vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        vertices.len(),
        triangles.len()
    )
    .into_bytes();
    vertices.iter().flatten().for_each(|x| ply.extend(x.to_le_bytes()));
    for triangle in &triangles {
        ply.push(3);
        triangle.iter().for_each(|v| ply.extend(v.to_le_bytes()));
    }
    ply
}

fn write(path: Option<std::ffi::OsString>, ply: &[u8]) -> Result<(), Box<dyn Error>> {
    let path = path.ok_or("expected the names of two files to write")?;
    std::fs::File::create(path)?.write_all(ply)?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut paths = std::env::args_os().skip(1);
    write(paths.next(), &lathe(&[spline(&GLASS, true)]))?;
    let [r, y] = WINE[WINE.len() - 1];
    let inwards = DVec2::new(-r, 0.0);
    let top = vec![(DVec2::new(r, y), inwards), (DVec2::new(0.0, y), inwards)];
    write(paths.next(), &lathe(&[spline(&WINE, false), top]))
}
