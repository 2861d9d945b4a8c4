//! Cubes of two colours.

use glam::DVec3;

use super::place::{Placement, Region};
use super::{BumpGradient, TexturePoint};
use crate::color::Rgb;

/// How far cells are moved along each axis, in cells.
const SHIFT: f64 = 1.0 / 1024.0;

/// Cubes of two colours by turns (with [`super::Space::Uv`], squares).
///
/// Cell (i, j, k) begins at `scale`·(i, j, k) − `scale`/1024 and has the first colour where
/// i + j + k is even. The small shift keeps surfaces that lie between two layers of cells (a floor
/// at y = 0, a wall at x = 3) in one of them: without it their colour would be chosen by how y = 0
/// was rounded, point by point. It is larger than the rounding of f32 positions for cells down to
/// about 1/5000 of a scene, and too small to see.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checker {
    /// Of even and of odd cells.
    pub colors: [Rgb; 2],
    /// A cell's edge in the texture's own space; where it is 0 all is one cell.
    pub scale: f64,
    /// How the cells lie in the object.
    pub placement: Placement,
}

impl Checker {
    /// The colour, averaged over the footprint's extent in closed form.
    pub fn color(&self, point: &TexturePoint) -> Rgb {
        let sign = self.sign(&self.placement.region(point));
        let [even, odd] = self.colors;
        even * ((1.0 + sign) / 2.0) as f32 + odd * ((1.0 - sign) / 2.0) as f32
    }

    /// See [`super::Texture::value_gradient`]; zero inside the cells.
    pub fn value_gradient(&self, point: &TexturePoint) -> BumpGradient {
        let region = self.placement.region(point);
        let [even, odd] = self.colors.map(|c| f64::from(c.luminance()));
        let value = |region: &Region| (even - odd) / 2.0 * self.sign(region);
        self.placement.gradient(&region, self.scale, value)
    }

    /// 1 in even cells, −1 in odd ones, averaged over a box. The sign of a cell is the product of
    /// those of its three indices, so its average is the product of theirs.
    fn sign(&self, region: &Region) -> f64 {
        let scale = self.scale.abs();
        if !(scale > 0.0) {
            return 1.0;
        }
        let mean = |x: f64, width: f64| square_wave(x / scale + SHIFT, width / scale);
        let DVec3 { x, y, z } = region.center;
        mean(x, region.extent.x) * mean(y, region.extent.y) * mean(z, region.extent.z)
    }
}

/// The wave that is 1 on [0, 1), −1 on [1, 2) and so on, averaged over `width` about `x`.
fn square_wave(x: f64, width: f64) -> f64 {
    if !(x.is_finite() && width.is_finite()) {
        return 1.0;
    }
    let x = x.rem_euclid(2.0);
    if width < 1e-6 {
        return if x < 1.0 { 1.0 } else { -1.0 };
    }
    // The integral of the wave goes up and down between 0 and 1.
    let integral = |x: f64| 1.0 - (x.rem_euclid(2.0) - 1.0).abs();
    (integral(x + width / 2.0) - integral(x - width / 2.0)) / width
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::{Footprint, Space};
    use glam::{Vec2, Vec3};

    const RED: Rgb = Rgb::new(0.8, 0.1, 0.1);
    const WHITE: Rgb = Rgb::new(0.9, 0.9, 0.7);

    fn checker(scale: f64) -> Checker {
        Checker { colors: [RED, WHITE], scale, placement: Placement::default() }
    }

    fn at(x: f64, y: f64, z: f64) -> TexturePoint {
        TexturePoint { position: DVec3::new(x, y, z), ..TexturePoint::default() }
    }

    #[test]
    fn cells_alternate_along_each_axis() {
        let checker = checker(2.0);
        assert_eq!(checker.color(&at(1.0, 1.0, 1.0)), RED);
        for p in [at(3.0, 1.0, 1.0), at(1.0, -1.0, 1.0), at(1.0, 1.0, 3.0), at(3.0, 3.0, 3.0)] {
            assert_eq!(checker.color(&p), WHITE, "{p:?}");
        }
        assert_eq!(checker.color(&at(3.0, 3.0, 1.0)), RED);
    }

    #[test]
    fn a_plane_between_layers_has_one_colour_a_cell() {
        for scale in [0.1, 1.0, 3.0] {
            for layer in [-7, 0, 1, 12] {
                let y = f64::from(layer) * scale;
                for ulps in -3..=3 {
                    let y = y + f64::from(ulps) * 1e-5 * scale;
                    let expected = if layer % 2 == 0 { RED } else { WHITE };
                    assert_eq!(checker(scale).color(&at(0.5 * scale, y, 0.5 * scale)), expected);
                }
            }
        }
        assert_eq!(checker(1.0).color(&at(0.5, -0.0, 0.5)), RED);
    }

    #[test]
    fn a_floor_between_layers_keeps_its_contrast_under_wide_footprints() {
        let footprint = Footprint { width: 0.5, uv_width: 0.0, normal: Vec3::Y };
        let color = |x| checker(1.0).color(&TexturePoint { footprint, ..at(x, 0.0, 0.5) });
        assert!((color(0.5).g - RED.g).abs() < 1e-6);
        assert!((color(1.5).g - WHITE.g).abs() < 1e-6);
    }

    #[test]
    fn averages_are_those_of_many_points() {
        for (x, width) in [(0.1, 0.5), (0.0, 1.0), (0.3, 3.3), (1.7, 0.01), (-4.2, 7.0)] {
            let n = 100_000;
            let point = |i| x + width * ((f64::from(i) + 0.5) / f64::from(n) - 0.5);
            let sum: f64 = (0..n).map(|i| square_wave(point(i), 0.0)).sum();
            let mean = square_wave(x, width);
            assert!((mean - sum / f64::from(n)).abs() < 1e-4, "{x} {width}: {mean}");
        }
    }

    #[test]
    fn a_wide_footprint_sees_the_mean() {
        let footprint = Footprint { width: 1e4, ..Footprint::default() };
        let color = checker(1.0).color(&TexturePoint { footprint, ..at(0.3, 0.4, 0.5) });
        assert!((color.g - 0.5).abs() < 1e-3);
    }

    #[test]
    fn squares_by_texture_coordinates() {
        let placement = Placement { space: Space::Uv, ..Placement::default() };
        let checker = Checker { placement, ..checker(0.125) };
        let color =
            |u, v| checker.color(&TexturePoint { uv: Vec2::new(u, v), ..TexturePoint::default() });
        assert_eq!([color(0.05, 0.05), color(0.2, 0.05), color(0.2, 0.2)], [RED, WHITE, RED]);
    }

    #[test]
    fn no_scale_is_one_cell() {
        for scale in [0.0, f64::NAN, f64::INFINITY, 1e-300] {
            assert!(checker(scale).color(&at(5.0, 2.0, 1.0)).is_finite());
        }
    }
}
