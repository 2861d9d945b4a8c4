//! Writes the mesh of `scenes/showcase.toml`: a torus knot with shading normals, as binary PLY.
//!
//! ```text
//! cargo run --example knot -- scenes/meshes/knot.ply
//! ```

use std::error::Error;
use std::f64::consts::TAU;
use std::io::Write;

use glam::DVec3;

/// Quads along the tube and around it.
const ALONG: u32 = 400;
const AROUND: u32 = 32;

/// The (2, 3) torus knot, on a torus of radii 1 and 0.42, standing upright.
fn centre_line(t: f64) -> DVec3 {
    let (sin3, cos3) = (3.0 * t).sin_cos();
    let r = 1.0 + 0.42 * cos3;
    DVec3::new(r * (2.0 * t).cos(), r * (2.0 * t).sin(), 0.42 * sin3)
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args_os().nth(1).ok_or("expected the name of the file to write")?;
    let mut ply = Vec::new();
    write!(
        ply,
        "ply\nformat binary_little_endian 1.0\ncomment torus knot, examples/knot.rs\n\
         element vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        ALONG * AROUND,
        2 * ALONG * AROUND
    )?;
    for i in 0..ALONG {
        let t = TAU * f64::from(i) / f64::from(ALONG);
        let centre = centre_line(t);
        let tangent = (centre_line(t + 1e-5) - centre_line(t - 1e-5)).normalize();
        // A frame that turns with the torus, hence closes without a twist.
        let out = centre - DVec3::new((2.0 * t).cos(), (2.0 * t).sin(), 0.0);
        let normal = (out - tangent * out.dot(tangent)).normalize();
        let binormal = tangent.cross(normal);
        for j in 0..AROUND {
            let (sin, cos) = (TAU * f64::from(j) / f64::from(AROUND)).sin_cos();
            let n = normal * cos + binormal * sin;
            let p = centre + n * (0.17 + 0.02 * (24.0 * t).sin());
            for x in p.to_array().into_iter().chain(n.to_array()) {
                ply.extend((x as f32).to_le_bytes());
            }
        }
    }
    for i in 0..ALONG {
        for j in 0..AROUND {
            let at = |i: u32, j: u32| (i % ALONG) * AROUND + j % AROUND;
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            for triangle in [[a, b, c], [a, c, d]] {
                ply.push(3);
                triangle.iter().for_each(|v| ply.extend(v.to_le_bytes()));
            }
        }
    }
    std::fs::write(path, ply)?;
    Ok(())
}
