//! Cameras: a position on the film in, a world-space ray out, in f64 until it is handed over.
//!
//! A camera far from the scene would lose its rays to rounding: an f32 origin at 10⁶ units is off by
//! 0.03, and the direction's rounding grows with the distance. So rays start at the scene's box where
//! the camera is far from it, moved there in f64.

use glam::{DMat4, DVec2, DVec3, Vec3};

use crate::math::{Bounds, Ray, Vec3Lanes, concentric_disk};

/// How points are projected.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// All rays start at the eye.
    Perspective {
        /// Vertical field of view, in radians.
        fov: f64,
    },
    /// All rays are parallel.
    Orthographic {
        /// Height of the picture in world units.
        height: f64,
    },
}

/// A thin lens: what is not in its plane of focus is blurred.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    /// Radius of the aperture, > 0.
    pub radius: f64,
    /// Distance of the plane in focus, along the view, > 0.
    pub focus_distance: f64,
}

/// A camera's place: orthonormal axes and the eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Where it stands.
    pub eye: DVec3,
    /// To the right of the picture.
    pub right: DVec3,
    /// To its top.
    pub up: DVec3,
    /// Along the view.
    pub forward: DVec3,
}

impl Pose {
    /// Looks from `eye` to `target`. None where these coincide or `up` is parallel to the view.
    pub fn look_at(eye: DVec3, target: DVec3, up: DVec3) -> Option<Self> {
        let forward = (target - eye).try_normalize()?;
        let right = forward.cross(up.try_normalize()?);
        // Nearly parallel: the axes would be noise.
        if right.length() < 1e-9 {
            return None;
        }
        let right = right.normalize();
        Some(Self { eye, right, up: right.cross(forward), forward })
    }

    /// From a camera-to-world matrix that looks along −Z with +Y up; its scale is ignored, a mirror
    /// mirrors the picture. None where the axes are not at right angles.
    pub fn from_matrix(m: &DMat4) -> Option<Self> {
        let right = m.x_axis.truncate().try_normalize()?;
        let forward = (-m.z_axis.truncate()).try_normalize()?;
        let up = m.y_axis.truncate().try_normalize()?;
        // A shear would make the picture oblique.
        let square = |a: DVec3, b: DVec3| a.dot(b).abs() < 1e-6;
        if !(square(right, up) && square(up, forward) && square(forward, right)) {
            return None;
        }
        Some(Self { eye: m.w_axis.truncate(), right, up, forward })
    }

    /// The pose seen from another origin.
    pub fn translated(self, by: DVec3) -> Self {
        Self { eye: self.eye + by, ..self }
    }
}

/// A camera for a picture of a given size.
#[derive(Debug, Clone)]
pub struct Camera {
    pose: Pose,
    projection: Projection,
    /// A pinhole where there is none.
    lens: Option<Lens>,
    /// Pixels.
    size: DVec2,
    /// World units of a pixel: on the plane at distance 1, or of the parallel picture.
    pixel: f64,
    /// Where rays start when the camera is far; none where they start at the camera.
    start: Option<Bounds>,
    /// Whether rays that pass that box by are rays all the same.
    keeps_all: bool,
}

/// The camera counts as far from here on, in diagonals of the scene's box. Nearer than this the
/// rounding of an f32 origin is within a few of that of the scene's own coordinates.
const FAR: f64 = 4.0;

impl Camera {
    /// A camera in a scene with the given box.
    pub fn new(
        pose: Pose,
        projection: Projection,
        lens: Option<Lens>,
        [width, height]: [u32; 2],
        scene: Bounds,
    ) -> Self {
        let size = DVec2::new(f64::from(width), f64::from(height));
        let pixel = match projection {
            Projection::Perspective { fov } => 2.0 * (0.5 * fov).tan() / size.y,
            Projection::Orthographic { height } => height / size.y,
        };
        let diagonal = scene.size().length();
        let far = !scene.is_empty() && (pose.eye - scene.center()).length() > FAR * diagonal;
        // A little larger, so that what lies in its faces is not before the start.
        let pad = DVec3::splat(1e-3 * diagonal);
        let start = far.then(|| Bounds { min: scene.min - pad, max: scene.max + pad });
        Self { pose, projection, lens, size, pixel, start, keeps_all: false }
    }

    /// Where the camera stands, and its axes.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Origin and unit direction, in f64, of the ray through `film`: pixels from the picture's upper
    /// left corner, x right and y down, pixel centres at ½.
    pub fn ray_f64(&self, film: DVec2) -> (DVec3, DVec3) {
        let pose = &self.pose;
        match self.projection {
            Projection::Perspective { .. } => (pose.eye, self.pinhole_direction(film)),
            Projection::Orthographic { .. } => {
                let p = self.on_plane(film);
                (pose.eye + pose.right * p.x - pose.up * p.y, pose.forward)
            }
        }
    }

    /// A point of the film on the plane at distance 1, or of the parallel picture, from its centre.
    #[inline(always)]
    fn on_plane(&self, film: DVec2) -> DVec2 {
        (film - 0.5 * self.size) * self.pixel
    }

    /// Unit direction from the eye through a point of the film.
    #[inline(always)]
    fn pinhole_direction(&self, film: DVec2) -> DVec3 {
        let (pose, p) = (&self.pose, self.on_plane(film));
        (pose.forward + pose.right * p.x - pose.up * p.y).normalize()
    }

    /// The ray from a point of the lens, `on_lens` in the unit disk, to where the ray of the pinhole
    /// meets the plane of focus: all of them meet there.
    fn through_lens(
        &self,
        lens: &Lens,
        (origin, direction): (DVec3, DVec3),
        on_lens: DVec2,
    ) -> (DVec3, DVec3) {
        let pose = &self.pose;
        let offset = (pose.right * on_lens.x + pose.up * on_lens.y) * lens.radius;
        let focus = direction * (lens.focus_distance / direction.dot(pose.forward));
        (origin + offset, (focus - offset).normalize())
    }

    /// From now on rays that pass a far scene by are rays too, of no length: what is between the scene
    /// and the camera is seen on them.
    pub fn keep_all_rays(&mut self) {
        self.keeps_all = true;
    }

    /// Whether rays start at the scene's box instead of the camera.
    pub fn is_far(&self) -> bool {
        self.start.is_some()
    }

    /// How wide the rays of a pixel are: at their start, in world units, and how much wider for each
    /// unit of distance.
    pub fn pixel_cone(&self) -> (f32, f32) {
        match self.projection {
            Projection::Perspective { .. } => (0.0, self.pixel as f32),
            Projection::Orthographic { .. } => (self.pixel as f32, 0.0),
        }
    }

    /// The ray through `film` (see [`Camera::ray_f64`]), ready to be traced; `on_lens` in the unit
    /// square chooses the point of the lens, if there is one. None where it passes the scene's box by,
    /// which is tested only where the camera is far.
    #[inline]
    pub fn ray(&self, film: DVec2, on_lens: [f32; 2]) -> Option<Ray> {
        let (mut origin, mut direction) = self.ray_f64(film);
        if let Some(lens) = &self.lens {
            let on_lens = concentric_disk(on_lens.map(f64::from));
            (origin, direction) = self.through_lens(lens, (origin, direction), on_lens);
        }
        if let Some(bounds) = &self.start {
            let Some((enter, _)) = bounds.clip(origin, direction) else {
                let ray = Ray::new(origin.as_vec3(), direction.as_vec3());
                return self.keeps_all.then_some(Ray { t_max: 0.0, ..ray });
            };
            origin += direction * enter.max(0.0);
        }
        Some(Ray::new(origin.as_vec3(), direction.as_vec3()))
    }

    /// Whether rays depend on a point of a lens.
    pub fn has_lens(&self) -> bool {
        self.lens.is_some()
    }

    /// What [`Camera::ray`] gives for `N` points of the film, given by axis: the origin of all rays, and
    /// their directions. None where they do not all start at the eye.
    #[inline(always)]
    pub fn pinhole_rays<const N: usize>(
        &self,
        x: &[f64; N],
        y: &[f64; N],
    ) -> Option<(Vec3, Vec3Lanes<N>)> {
        let is_pinhole = self.lens.is_none()
            && self.start.is_none()
            && matches!(self.projection, Projection::Perspective { .. });
        if !is_pinhole {
            return None;
        }
        // A loop over lanes, for the compiler to turn into vector instructions.
        let mut directions = Vec3Lanes::ZERO;
        for i in 0..N {
            directions.set(i, self.pinhole_direction(DVec2::new(x[i], y[i])).as_vec3());
        }
        Some((self.pose.eye.as_vec3(), directions))
    }

    /// A pose that shows all of a scene in a picture of `aspect` (width / height), seen along
    /// `forward`, in the middle and as large as fits with a margin of 5 %; and the height that a
    /// parallel picture of it needs.
    ///
    /// `support` tells how far the scene reaches in each of four directions: the largest dot product
    /// of a point of the scene with it; −∞ for an empty scene.
    pub fn frame(
        support: impl Fn([DVec3; 4]) -> [f64; 4],
        forward: DVec3,
        projection: Projection,
        aspect: f64,
    ) -> (Pose, f64) {
        const MARGIN: f64 = 1.05;
        let up = if forward.cross(DVec3::Y).length() < 1e-3 { DVec3::NEG_Z } else { DVec3::Y };
        let pose = Pose::look_at(DVec3::ZERO, forward, up)
            .unwrap_or_else(|| unreachable!("`up` was chosen to differ from `forward`"));
        let (slope_x, slope_y) = match projection {
            Projection::Perspective { fov } => {
                let slope = (0.5 * fov).tan() / MARGIN;
                (slope * aspect, slope)
            }
            Projection::Orthographic { .. } => (0.0, 0.0),
        };
        // A point at (x, y, z) in the camera's axes is inside the right plane of a frustum whose apex
        // is at (ex, ey, −back) where x − sx·z ≤ ex + sx·back; and so for the other three planes. The
        // two of a pair fix ex or ey and the least distance.
        let ahead_x = pose.forward * slope_x;
        let ahead_y = pose.forward * slope_y;
        let [right, left, top, bottom] = support([
            pose.right - ahead_x,
            -pose.right - ahead_x,
            pose.up - ahead_y,
            -pose.up - ahead_y,
        ]);
        if !(right + left).is_finite() || !(top + bottom).is_finite() {
            return (Pose { eye: -pose.forward, ..pose }, 1.0);
        }
        let across = pose.right * (0.5 * (right - left)) + pose.up * (0.5 * (top - bottom));
        match projection {
            Projection::Perspective { .. } => {
                let back = (0.5 * (right + left) / slope_x).max(0.5 * (top + bottom) / slope_y);
                // A single point: any distance shows it.
                let [nearest, ..] = support([-pose.forward; 4]);
                let is_point = back - nearest <= 1e-9 * back.abs().max(nearest.abs());
                let back = if is_point { nearest + 1.0 } else { back };
                (Pose { eye: across - pose.forward * back, ..pose }, 1.0)
            }
            Projection::Orthographic { .. } => {
                let height = MARGIN * (top + bottom).max((right + left) / aspect);
                let [nearest, ..] = support([-pose.forward; 4]);
                let [farthest, ..] = support([pose.forward; 4]);
                let size = (nearest + farthest).max(height);
                let back = nearest + if size > 0.0 { size } else { 1.0 };
                let height = if height > 0.0 { height } else { 1.0 };
                (Pose { eye: across - pose.forward * back, ..pose }, height)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose() -> Pose {
        Pose::look_at(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y).unwrap()
    }

    const UNIT: Bounds = Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE };

    #[test]
    fn corners_of_the_picture_are_where_the_field_of_view_says() {
        let projection = Projection::Perspective { fov: 90f64.to_radians() };
        let camera = Camera::new(pose(), projection, None, [200, 100], UNIT);
        let (origin, d) = camera.ray_f64(DVec2::new(200.0, 0.0));
        assert_eq!(origin, DVec3::new(0.0, 0.0, 5.0));
        // Upper right: 45° up, twice that to the right.
        assert!((d / -d.z - DVec3::new(2.0, 1.0, -1.0)).length() < 1e-12);
    }

    #[test]
    fn parallel_rays_are_parallel() {
        let projection = Projection::Orthographic { height: 4.0 };
        let camera = Camera::new(pose(), projection, None, [200, 100], UNIT);
        let (a, d) = camera.ray_f64(DVec2::new(0.0, 100.0));
        let (b, e) = camera.ray_f64(DVec2::new(200.0, 0.0));
        assert_eq!((d, e), (DVec3::NEG_Z, DVec3::NEG_Z));
        assert_eq!((a, b), (DVec3::new(-4.0, -2.0, 5.0), DVec3::new(4.0, 2.0, 5.0)));
    }

    #[test]
    fn rays_through_a_lens_meet_in_the_plane_of_focus() {
        for projection in
            [Projection::Perspective { fov: 1.0 }, Projection::Orthographic { height: 3.0 }]
        {
            let lens = Lens { radius: 0.3, focus_distance: 4.0 };
            let film = DVec2::new(150.0, 20.0);
            let camera = |lens| Camera::new(pose(), projection, lens, [200, 100], UNIT);
            let (o, d) = camera(None).ray_f64(film);
            let focus = o + d * (4.0 / -d.z);
            let camera = camera(Some(lens));
            for on_lens in [[0.5, 0.5], [0.0, 0.3], [0.9, 0.99]] {
                let ray = camera.ray(film, on_lens).unwrap();
                let across = (ray.origin.as_dvec3() - o).length();
                let off = (focus - ray.origin.as_dvec3()).cross(ray.direction.as_dvec3()).length();
                assert!(across <= 0.3 + 1e-6 && (ray.origin.z - 5.0).abs() < 1e-6 && off < 1e-6);
            }
        }
    }

    #[test]
    fn a_far_camera_starts_its_rays_at_the_box() {
        let eye = DVec3::new(1e7, 2e7, -3e7);
        let pose = Pose::look_at(eye, DVec3::ZERO, DVec3::Y).unwrap();
        let fov = 2.5 / eye.length();
        let camera = Camera::new(pose, Projection::Perspective { fov }, None, [1000, 1000], UNIT);
        for i in 1..10 {
            let film = DVec2::new(400.0 + 20.0 * f64::from(i), 450.0);
            let ray = camera.ray(film, [0.5; 2]).unwrap();
            let (o, d) = camera.ray_f64(film);
            // Distance of the f32 ray's origin from the f64 line.
            let off = (ray.origin.as_dvec3() - o).cross(d).length();
            assert!(ray.origin.length() < 4.0 && off < 3e-7, "{off}");
        }
        assert!(camera.ray(DVec2::new(-5000.0, 0.0), [0.5; 2]).is_none());
    }

    #[test]
    fn framing_shows_everything_in_the_middle() {
        let points: Vec<DVec3> = (0..40)
            .map(|i| f64::from(i) * 0.7)
            .map(|t| DVec3::new(50.0 + 9.0 * t.sin(), 3.0 * (2.3 * t).cos(), t - 9.0))
            .collect();
        let support = |d: [DVec3; 4]| {
            d.map(|d| points.iter().map(|p| p.dot(d)).fold(f64::NEG_INFINITY, f64::max))
        };
        let forward = DVec3::new(-1.0, -0.7, -2.0);
        for (fov, aspect) in [(40f64, 1.5), (70.0, 0.3), (10.0, 3.0)] {
            let perspective = Projection::Perspective { fov: fov.to_radians() };
            let (pose, _) = Camera::frame(support, forward, perspective, aspect);
            let (_, height) =
                Camera::frame(support, forward, Projection::Orthographic { height: 1.0 }, aspect);
            let top = (0.5 * fov.to_radians()).tan();
            let mut reach = [f64::NEG_INFINITY; 4];
            for p in &points {
                let c = *p - pose.eye;
                let (x, y, z) = (c.dot(pose.right), c.dot(pose.up), c.dot(pose.forward));
                assert!(z > 0.0);
                let (x, y) = (x / z / top / aspect, y / z / top);
                for (r, v) in reach.iter_mut().zip([x, -x, y, -y]) {
                    *r = r.max(v);
                }
            }
            let widest = reach.iter().copied().fold(0.0, f64::max);
            assert!((widest - 1.0 / 1.05).abs() < 1e-9, "{reach:?}");
            assert!(height > 1.0 && height < 100.0);
        }
        let nothing = |d: [DVec3; 4]| d.map(|_| f64::NEG_INFINITY);
        let point = |d: [DVec3; 4]| d.map(|d| d.dot(DVec3::new(1.0, 2.0, 3.0)));
        let projection = Projection::Perspective { fov: 1.0 };
        assert!(Camera::frame(nothing, forward, projection, 1.0).0.eye.is_finite());
        let (pose, _) = Camera::frame(point, forward, projection, 1.0);
        assert!((DVec3::new(1.0, 2.0, 3.0) - pose.eye).dot(pose.forward) > 0.5);
    }
}
