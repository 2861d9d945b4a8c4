//! Writes the grids of the scenes that show volumetric data, as `.npy` files of 40³ floats: the density of
//! an electron in the 3d state of hydrogen with magnetic quantum number 0, and a puff of smoke.
//!
//! ```text
//! cargo run --example grids -- scenes/grids/orbital.npy scenes/grids/smoke.npy
//! ```

use std::error::Error;
use std::io::Write;

use glam::DVec3;

/// Samples along each axis.
const N: usize = 40;

/// |ψ|² of the state (3, 2, 0), relative to its greatest value, over a box of 40 Bohr radii; its axis is
/// +Y: ψ ∝ r²·exp(−r/3)·(3 cos²θ − 1).
fn orbital(p: DVec3) -> f64 {
    let p = 20.0 * p;
    let r = p.length();
    let psi = (-r / 3.0).exp() * (3.0 * p.y * p.y - r * r);
    // On the axis r is 6 where it is greatest.
    let greatest = (-2.0f64).exp() * 72.0;
    (psi / greatest).powi(2)
}

/// Smooth noise of unit cells, from 0 to 1.
fn noise(p: DVec3) -> f64 {
    let (cell, f) = (p.floor(), p - p.floor());
    let f = f * f * (3.0 - 2.0 * f);
    let mut sum = 0.0;
    for corner in 0..8u32 {
        let step = DVec3::new((corner & 1).into(), (corner >> 1 & 1).into(), (corner >> 2).into());
        let [i, j, k] = (cell + step).to_array().map(|x| x as i64 as u32);
        let mut h =
            i.wrapping_mul(0x9e37_79b9) ^ j.wrapping_mul(0x85eb_ca6b) ^ k.wrapping_mul(0xc2b2_ae35);
        h = (h ^ h >> 15).wrapping_mul(0x2c1b_3c6d);
        h = (h ^ h >> 12).wrapping_mul(0x297a_2d39);
        let weight = (1.0 - step - f).abs();
        sum += weight.x * weight.y * weight.z * f64::from(h ^ h >> 15) / f64::from(u32::MAX);
    }
    sum
}

/// A ball that four octaves of noise fray; 0 at the faces of the box.
fn smoke(p: DVec3) -> f64 {
    let octave = |i: i32| noise(2.5 * 2f64.powi(i) * (p + 7.3)) * 0.5f64.powi(i);
    let turbulence: f64 = (0..4).map(octave).sum::<f64>() / 1.875;
    let body = 1.0 - p.length();
    (3.0 * (body + 2.2 * (turbulence - 0.5)) * (4.0 * body).clamp(0.0, 1.0)).clamp(0.0, 1.0)
}

/// A `.npy` file of version 1: the array's axes are x, y and z, in C order.
fn npy(value: impl Fn(DVec3) -> f64) -> Vec<u8> {
    let header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({N}, {N}, {N}), }}");
    // Such that the samples begin at a multiple of 64 bytes.
    let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{header:<width$}\n", width = length - 1).bytes());
    let at = |i: usize| 2.0 * i as f64 / (N - 1) as f64 - 1.0;
    for i in 0..N {
        for j in 0..N {
            for k in 0..N {
                bytes.extend((value(DVec3::new(at(i), at(j), at(k))) as f32).to_le_bytes());
            }
        }
    }
    bytes
}

fn main() -> Result<(), Box<dyn Error>> {
    let paths: Vec<_> = std::env::args_os().skip(1).collect();
    let [orbital_path, smoke_path] = paths.as_slice() else {
        return Err("usage: grids ORBITAL.npy SMOKE.npy".into());
    };
    for (path, bytes) in [(orbital_path, npy(orbital)), (smoke_path, npy(smoke))] {
        if let Some(folder) = std::path::Path::new(path).parent() {
            std::fs::create_dir_all(folder)?;
        }
        std::fs::File::create(path)?.write_all(&bytes)?;
    }
    Ok(())
}
