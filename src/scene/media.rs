//! Surfaces between media: which medium is on either side.

use glam::{DVec3, Vec3};

use super::build::Scene;
use crate::accel::{RayQuery, with_accel};
use crate::material::{Dielectric, Ior, Material};
use crate::math::Ray;
use crate::medium::Interior;

/// A passage through the surface of a glass.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    /// The medium that the ray comes from, as the index of its material; none in air.
    before: Option<u16>,
    /// The medium that it would go on in.
    after: Option<u16>,
    /// What it is inside of beyond the surface.
    pub beyond: Interior,
}

impl Scene {
    /// The passage of a ray that is inside of `interior` through the surface of material `index`.
    #[inline]
    pub fn crossing(&self, interior: Interior, index: u32, is_front: bool) -> Crossing {
        let index = index as u16;
        let priority = |i| self.dielectric(i).map_or(0, |glass| glass.priority);
        if is_front {
            let beyond = interior.entered(index);
            let (before, after) = (interior.current(priority), beyond.current(priority));
            return Crossing { before, after, beyond };
        }
        let beyond = interior.left(index);
        // Seen from behind, it is there, even if the ray was not known to be inside: it began there,
        // or came through an open mesh.
        let inside = if beyond == interior { interior.entered(index) } else { interior };
        Crossing { before: inside.current(priority), after: beyond.current(priority), beyond }
    }

    /// The medium that fills the place of a ray; none in air.
    #[inline]
    pub fn medium(&self, interior: Interior) -> Option<&Dielectric> {
        let priority = |i| self.dielectric(i).map_or(0, |glass| glass.priority);
        interior.current(priority).and_then(|index| self.dielectric(index))
    }

    /// The media that the point `p` lies in: those whose surface a ray from there leaves without having
    /// entered.
    pub(super) fn interior_at(&self, p: DVec3) -> Interior {
        with_accel!(&self.accel, query => self.interior_by(query, p))
    }

    fn interior_by<Q: RayQuery>(&self, query: &Q, p: DVec3) -> Interior {
        /// Surfaces looked at.
        const MAX_SURFACES: usize = 1 << 12;
        let b = &self.bounds;
        let is_within = p.cmpge(b.min).all() && p.cmple(b.max).all();
        if !is_within && !self.world.is_endless() {
            return Interior::OUTSIDE;
        }
        // No direction that scenes are likely to be aligned with.
        let direction = Vec3::new(0.412_7, 0.763_1, 0.496_8).normalize();
        let mut ray = Ray::new(p.as_vec3(), direction);
        let mut entered = Interior::OUTSIDE;
        let mut left = Vec::new();
        for _ in 0..MAX_SURFACES {
            let Some(hit) = query.intersect(&ray) else { break };
            let point = self.surface(&ray, &hit);
            if let Material::Dielectric(_) = point.material {
                let index = point.material_index as u16;
                if point.is_front {
                    entered = entered.entered(index);
                } else if entered.left(index) != entered {
                    entered = entered.left(index);
                } else {
                    left.push(index);
                }
            }
            ray = self.spawn(&point, direction, f32::INFINITY);
        }
        // What is left first was entered last.
        left.into_iter().rev().fold(Interior::OUTSIDE, Interior::entered)
    }

    #[inline]
    fn dielectric(&self, index: u16) -> Option<&Dielectric> {
        match &self.materials[usize::from(index)] {
            Material::Dielectric(glass) => Some(glass),
            _ => None,
        }
    }

    #[inline]
    fn ior(&self, index: Option<u16>) -> Option<&Ior> {
        index.and_then(|index| self.dielectric(index)).map(|glass| &glass.ior)
    }
}

impl Crossing {
    /// Whether both sides are the same medium: nothing happens there.
    #[inline]
    pub fn is_same(&self) -> bool {
        self.before == self.after
    }

    /// The indices of refraction before and beyond, at a wavelength in nm; where that is 0, of light of
    /// all wavelengths.
    #[inline]
    pub fn indices(&self, scene: &Scene, wavelength: f32) -> [f32; 2] {
        let of = |side| match scene.ior(side) {
            None => 1.0,
            Some(Ior::Constant(n)) => *n as f32,
            Some(ior) if wavelength == 0.0 => ior.n_d() as f32,
            Some(ior) => ior.at(f64::from(wavelength)) as f32,
        };
        [of(self.before), of(self.after)]
    }

    /// Whether they depend on the wavelength.
    #[inline]
    pub fn is_dispersive(&self, scene: &Scene) -> bool {
        [self.before, self.after]
            .iter()
            .any(|side| scene.ior(*side).is_some_and(Ior::is_dispersive))
    }
}
