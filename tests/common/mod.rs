//! What several test programs share.
#![allow(
    missing_docs,
    dead_code,
    clippy::print_stderr,
    reason = "not every program uses everything"
)]

pub mod optics;

use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use alhazen::geometry::TriangleMesh;
use glam::DVec3;

/// The folder of assets made by other people, if this machine has it: `ALHAZEN_ASSETS`, or
/// `../shared/data`. Where it is missing, one line says that the test did not run.
pub fn assets() -> Option<PathBuf> {
    let folder = std::env::var_os("ALHAZEN_ASSETS").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data"),
        PathBuf::from,
    );
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("not run: no assets in {}", folder.display());
    None
}

/// All files below a folder with one of the extensions, in order.
pub fn files(folder: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten() {
            let path = entry.expect("readable").path();
            let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            if path.is_dir() {
                folders.push(path);
            } else if extensions.contains(&extension.as_str()) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// Runs the built program in `folder`.
pub fn alhazen(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_alhazen"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .expect("the program starts")
}

/// What a program wrote to its standard error.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// What a program wrote to its standard output.
pub fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Whether the long form of a test was asked for (`make verify`).
pub fn verify() -> bool {
    std::env::var_os("ALHAZEN_VERIFY").is_some()
}

/// Random numbers for tests: SplitMix64, so that a seed printed by a failure can be replayed.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ x >> 31
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = self.in_cube();
            if v.length() > 0.01 && v.length() < 1.0 {
                return v.normalize();
            }
        }
    }

    /// Of unit length, on the side of `normal`: uniform over the hemisphere, one in four nearly grazing.
    pub fn outward(&mut self, normal: DVec3) -> DVec3 {
        let mut d = self.direction();
        if self.unit() < 0.25 {
            d -= normal * d.dot(normal) * self.between(0.999, 1.0);
        }
        if d.dot(normal) < 0.0 { -d } else { d }.normalize()
    }

    pub fn in_cube(&mut self) -> DVec3 {
        DVec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }
}

/// A closed ball of triangles, convex where it has no `bumps`.
pub fn ball(rings: u32, center: DVec3, radius: f64, bumps: f64) -> TriangleMesh {
    let sectors = 2 * rings;
    let mut xyz = Vec::new();
    for i in 0..=rings {
        for j in 0..sectors {
            let theta = PI * f64::from(i) / f64::from(rings);
            let phi = TAU * f64::from(j) / f64::from(sectors);
            let d = DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            // One point at each pole.
            let wave =
                if i == 0 || i == rings { 0.0 } else { (5.0 * theta).sin() * (4.0 * phi).sin() };
            let p = center + d * radius * (1.0 + bumps * wave);
            xyz.extend(p.as_vec3().to_array());
        }
    }
    let at = |i: u32, j: u32| match i {
        0 => 0,
        i if i == rings => rings * sectors,
        i => i * sectors + j % sectors,
    };
    let quads = (0..rings).flat_map(|i| (0..sectors).map(move |j| (i, j)));
    let triangles = quads.flat_map(|(i, j)| {
        let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
        [[a, b, c], [a, c, d]]
    });
    let triangles = triangles.filter(|[a, b, c]| a != b && b != c && a != c).collect();
    TriangleMesh::new(xyz, triangles)
}
