//! From a hit to the next rays of the tree: mirrored and refracted directions, their weights, and the
//! rules by which a branch ends.

use glam::Vec3;

use super::{Block, Features, Hits, Node, Walk};
use crate::accel::{HitBlock, LANES, RayBlock, RayQuery};
use crate::color::{Rgb, Wavelength};
use crate::material::fresnel::{self, Refraction};
use crate::material::{Dielectric, FresnelModel, Material};
use crate::math::Ray;
use crate::medium::Interior;
use crate::sampler::{Dimensions, Sampler};
use crate::scene::{Cone, FarSide, Scene, SurfacePoint};

/// Surfaces between equal media that a ray passes at most.
const MAX_PASSED: u16 = 1 << 12;

/// Fewer rays than this are traced one by one.
pub(super) const MIN_PACKET: usize = 6;

/// Directions run close together where the cosine between them is above this.
const COHERENT_COSINE: f32 = 0.99;

/// Rays of a block that may be taken as one: by how they left it, and whether it is known what they come to.
const GROUPS: [(Way, bool); 4] = [
    (Way::Refracted, false),
    (Way::Mirrored, false),
    (Way::Refracted, true),
    (Way::Mirrored, true),
];

/// The first of the two branches of a node's sampler that its children take; its lights take others.
const BRANCHES: u32 = 1 << 30;

/// Which of a hit's two rays one is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    Mirrored,
    Refracted,
}

/// A hit from which rays go on.
struct Fork<'a> {
    /// The ray that hit.
    node: &'a Node,
    point: &'a SurfacePoint<'a>,
    /// Unit normal on the ray's side.
    n: Vec3,
    /// What light that leaves the surface towards the ray counts for in the pixel.
    throughput: Rgb,
    /// How wide the ray is there.
    cone: Cone,
}

/// A ray that is to go on from a hit, but for where it runs.
pub(super) struct Branch {
    pub(super) throughput: Rgb,
    pub(super) interior: Interior,
    pub(super) way: Way,
    pub(super) cone: Cone,
    pub(super) wavelength: f32,
}

/// The normal by which light from `d` is mirrored, of the shading and the geometric one on its side: a shading
/// normal that faces away from the ray says nothing of its mirror image. Without branches, as the next.
#[inline(always)]
pub(super) fn mirror_normal(d: Vec3, shading: Vec3, geometric: Vec3) -> Vec3 {
    if shading.dot(d) < 0.0 { shading } else { geometric }
}

/// The mirrored direction by the normal `n`, but for where an interpolated or mapped one sends it into the
/// surface.
#[inline(always)]
pub(super) fn mirrored_direction(d: Vec3, n: Vec3, geometric: Vec3) -> Vec3 {
    let (by_n, by_geometric) = (fresnel::reflect(d, n), fresnel::reflect(d, geometric));
    if by_n.dot(geometric) > 0.0 { by_n } else { by_geometric }
}

/// The refracted direction, but for where an interpolated or mapped normal sends it out of the surface: as with
/// mirrors, the surface itself decides.
#[inline]
fn refracted_direction(d: Vec3, bent: &Refraction, geometric: Vec3) -> Vec3 {
    if bent.direction.dot(geometric) < 0.0 {
        return bent.direction;
    }
    fresnel::refract(d, geometric, bent.eta).map_or(d, |bent| bent.direction)
}

impl<Q: RayQuery, F: Features> Walk<'_, Q, F> {
    /// Sends the rays of all specular hits on: they wait on the stack, but for those of a block that
    /// run close together, which are traced as one.
    #[inline]
    pub(super) fn scatter<const N: usize>(&mut self, hits: &Hits<'_, N>, nodes: &[Node; N]) {
        let before = self.stack.len();
        for (lane, node) in nodes.iter().enumerate() {
            let Some((point, material)) = hits.get(lane) else { continue };
            if !material.is_specular() {
                self.counts.ends.diffuse += 1;
                continue;
            }
            self.children(node, point, material, hits.weights[lane], hits.textured[lane].0);
        }
        if N == LANES && self.stack.len() - before >= MIN_PACKET {
            self.gather(before);
        }
    }

    /// Takes the nodes of the stack from `start` on as blocks where they run close together, or where it is known
    /// what they come to.
    pub(super) fn gather(&mut self, start: usize) {
        let mut nodes = std::mem::take(&mut self.gathered);
        nodes.clear();
        nodes.extend(self.stack.drain(start..));
        for (way, is_known) in GROUPS {
            let is_in = |n: &&Node| n.way == way && n.known.is_some() == is_known;
            let group = || nodes.iter().filter(is_in);
            let Some(first) = group().next() else { continue };
            let is_close = |n: &Node| n.ray.direction.dot(first.ray.direction) > COHERENT_COSINE;
            if group().count() < MIN_PACKET || !(is_known || group().all(is_close)) {
                self.stack.extend(group());
                continue;
            }
            let mut rays = RayBlock::empty();
            let mut by_lane = [*first; LANES];
            for node in group() {
                rays.set(node.lane as usize, &node.ray);
                by_lane[node.lane as usize] = *node;
            }
            let hits = if is_known {
                HitBlock::from_fn(rays.active(), |lane| {
                    by_lane[lane].known.map(|side| side.hit(&by_lane[lane].ray))
                })
            } else {
                self.query.intersect_block(&rays)
            };
            self.blocks.push(Block { nodes: by_lane, rays, hits });
        }
        self.gathered = nodes;
    }

    /// The rays that go on from a hit of a specular material. `throughput` is what light that leaves the surface
    /// towards the ray counts for in the pixel.
    #[inline]
    pub(super) fn children(
        &mut self,
        node: &Node,
        point: &SurfacePoint<'_>,
        material: &Material,
        throughput: Rgb,
        cone: Cone,
    ) {
        let d = node.ray.direction;
        let n = mirror_normal(d, point.normal, point.geometric_normal);
        let fork = Fork { node, point, n, throughput, cone };
        if let Material::Dielectric(glass) = material {
            self.through_surface(&fork, glass);
            return;
        }
        self.mirrored(&fork, throughput * material.mirrored(-d.dot(n)), node.wavelength);
    }

    /// The ray that a surface mirrors.
    #[inline(always)]
    fn mirrored(&mut self, fork: &Fork<'_>, throughput: Rgb, wavelength: f32) {
        let d = fork.node.ray.direction;
        let direction = mirrored_direction(d, fork.n, fork.point.geometric_normal);
        let (interior, way) = (fork.node.interior, Way::Mirrored);
        let cone = fork.cone.turned(2.0);
        let branch = Branch { throughput, interior, way, cone, wavelength };
        self.child(fork.node, branch, |scene| scene.spawn_on(fork.point, direction));
    }

    /// The two rays of a surface between two media: of glass and air, of two glasses, or of one
    /// that another of higher priority fills, where the ray passes straight.
    #[inline]
    fn through_surface(&mut self, fork: &Fork<'_>, glass: &Dielectric) {
        let scene = self.scene;
        let &Fork { node, point, n, .. } = fork;
        let d = node.ray.direction;
        let crossing = scene.crossing(node.interior, point.material_index, point.is_front);
        if crossing.is_same() {
            self.passing(fork, crossing.beyond);
            return;
        }
        // Where media disperse, a ray carries one wavelength from here on.
        let splits = F::EVERYTHING && node.wavelength == 0.0 && crossing.is_dispersive(scene);
        let (wavelength, color) =
            if splits { self.wavelength(node) } else { (node.wavelength, Rgb::splat(1.0)) };
        let [n_i, n_t] = crossing.indices(scene, wavelength);
        if n_i == n_t && !splits && !matches!(glass.fresnel, FresnelModel::Power(_)) {
            // Other media, perhaps with other absorption, but light takes no notice of the surface.
            self.passing(fork, crossing.beyond);
            return;
        }
        let bent = fresnel::refract(d, n, n_t / n_i);
        let of_one = fork.throughput * color;

        // But where it enters the denser medium nothing is reflected totally: the mirrored ray goes on
        // with all wavelengths, by the share of the mean index, and the other has the rest.
        let mean = if splits { crossing.indices(scene, 0.0) } else { [n_i, n_t] };
        let keeps_all = splits && n_i < n_t && mean[0] < mean[1];
        let [f_i, f_t] = if keeps_all { mean } else { [n_i, n_t] };
        let by_mean = if keeps_all { fresnel::refract(d, n, f_t / f_i) } else { bent };
        let reflected = match &by_mean {
            None => 1.0,
            Some(bent) => glass.fresnel.dielectric(bent.cos_i, bent.cos_t, f_i, f_t),
        };
        if keeps_all {
            self.mirrored(fork, fork.throughput * reflected, node.wavelength);
        } else {
            self.mirrored(fork, of_one * reflected, wavelength);
        }
        let Some(bent) = bent else { return };

        let direction = refracted_direction(d, &bent, point.geometric_normal);
        let throughput = of_one * (1.0 - reflected);
        let (interior, way) = (crossing.beyond, Way::Refracted);
        let cone = fork.cone.turned((1.0 - n_i / n_t).abs());
        let branch = Branch { throughput, interior, way, cone, wavelength };
        self.child(fork.node, branch, |scene| scene.spawn_on(fork.point, direction));
    }

    /// The ray that goes straight on, through a surface that is none.
    fn passing(&mut self, fork: &Fork<'_>, beyond: Interior) {
        let &Fork { node, point, throughput, .. } = fork;
        if node.passed == MAX_PASSED {
            self.counts.ends.depth += 1;
            return;
        }
        self.counts.refraction += 1;
        let (ray, known) = self.scene.spawn_on(point, node.ray.direction);
        let (passed, way) = (node.passed + 1, Way::Refracted);
        let cone = fork.cone.turned(0.0);
        let before = node.before + (point.position - node.ray.origin).length();
        let interior = beyond;
        self.stack.push(Node {
            ray,
            throughput,
            interior,
            passed,
            way,
            cone,
            before,
            known,
            ..*node
        });
    }

    /// The one wavelength of a sample, in nm, and the colour that it counts for.
    fn wavelength(&self, node: &Node) -> (f32, Rgb) {
        if let Some(wavelength) = self.scene.settings.wavelength {
            return (wavelength as f32, Rgb::splat(1.0));
        }
        // One for the whole tree: its branches meet in the same pixel.
        let [u, ..] = self.camera.samplers[node.lane as usize].four(Dimensions::Spectrum);
        let wavelength = Wavelength::sample(u);
        (wavelength.nanometres(), wavelength.rgb_weight())
    }

    /// Whether a branch of little weight goes on: with the probability `survival`, in proportion to its
    /// weight, as it then stands for those that ended.
    #[cold]
    fn survives(&mut self, sampler: &Sampler, survival: f32) -> bool {
        let [u, ..] = sampler.four(Dimensions::Roulette);
        let goes_on = u < survival;
        self.counts.ends.roulette += u64::from(!goes_on);
        goes_on
    }

    /// Puts the next ray of a branch on the stack, if none of the rules ends it; only then is it asked for.
    #[inline(always)]
    pub(super) fn child(
        &mut self,
        node: &Node,
        branch: Branch,
        ray: impl FnOnce(&Scene) -> (Ray, Option<FarSide>),
    ) {
        let Branch { throughput, interior, way, cone, wavelength } = branch;
        let Some((throughput, sampler)) = self.judged(node, throughput, way) else { return };
        let (ray, known) = ray(self.scene);
        self.stack.push(Node {
            ray,
            throughput,
            interior,
            sampler,
            cone,
            wavelength,
            depth: node.depth + 1,
            way,
            known,
            before: 0.0,
            ..*node
        });
    }

    /// What the next ray after `node` counts for, if none of the rules ends it, and its sampler.
    #[inline(always)]
    fn judged(&mut self, node: &Node, mut throughput: Rgb, way: Way) -> Option<(Rgb, Sampler)> {
        let settings = &self.scene.settings;
        let weight = throughput.max_component();
        // What does not count at all was no branch. Also refuses NaN.
        if !(weight > 0.0) {
            return None;
        }
        if node.depth >= self.max_depth.unwrap_or(0) {
            self.counts.ends.depth += 1;
            return None;
        }
        // Elsewhere nothing is drawn at random beyond the camera.
        let sampler = if F::EVERYTHING || settings.roulette {
            node.sampler.branch(BRANCHES + way as u32)
        } else {
            node.sampler
        };
        if weight < settings.prune {
            if !settings.roulette {
                self.counts.ends.prune += 1;
                return None;
            }
            let survival = weight / settings.prune;
            if !self.survives(&sampler, survival) {
                return None;
            }
            throughput *= 1.0 / survival;
        }
        match way {
            Way::Mirrored => self.counts.reflection += 1,
            Way::Refracted => self.counts.refraction += 1,
        }
        Some((throughput, sampler))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit() -> impl Strategy<Value = Vec3> {
        let turn = 0.0f32..std::f32::consts::TAU;
        (-1.0f32..1.0, turn).prop_map(|(z, phi)| {
            let (sin, cos) = phi.sin_cos();
            let r = (1.0 - z * z).sqrt();
            Vec3::new(r * cos, r * sin, z)
        })
    }

    proptest! {
        /// What a mirror does with each of two normals is as written: d − 2(d·n)n by the shading normal where
        /// that faces the ray and the light leaves the surface, else by the surface itself; and it leaves.
        #[test]
        fn mirrored_light_leaves_the_surface(d in unit(), shading in unit(), geometric in unit()) {
            let geometric = if geometric.dot(d) > 0.0 { -geometric } else { geometric };
            prop_assume!(geometric.dot(d) < -1e-4);
            let by = |n: Vec3| {
                let (d, n) = (d.as_dvec3(), n.as_dvec3());
                d - 2.0 * d.dot(n) * n
            };
            let n = mirror_normal(d, shading, geometric);
            let mirrored = mirrored_direction(d, n, geometric);
            let leaves = by(shading).dot(geometric.as_dvec3());
            prop_assume!(leaves.abs() > 1e-4 && shading.dot(d).abs() > 1e-4);
            let is_by_shading = shading.dot(d) < 0.0 && leaves > 0.0;
            let expected = by(if is_by_shading { shading } else { geometric });
            prop_assert!(mirrored.as_dvec3().abs_diff_eq(expected, 1e-6), "{mirrored} {expected}");
            prop_assert!(mirrored.dot(geometric) > 0.0);
            prop_assert!(n.dot(d) < 0.0, "the angle of incidence");
        }

        /// Refracted light enters the surface, by the shading normal where that sends it there.
        #[test]
        fn refracted_light_enters_the_surface(
            d in unit(),
            n in unit(),
            geometric in unit(),
            eta in 0.4f32..2.5,
        ) {
            let [n, geometric] = [n, geometric].map(|n| if n.dot(d) > 0.0 { -n } else { n });
            prop_assume!(geometric.dot(d) < -1e-3);
            let Some(bent) = fresnel::refract(d, n, eta) else { return Ok(()) };
            let entered = refracted_direction(d, &bent, geometric);
            prop_assert!(entered.dot(geometric) < 0.0, "{entered}");
            let is_by_shading = bent.direction.dot(geometric) < 0.0;
            prop_assert!(!is_by_shading || entered == bent.direction);
            // Snell's law by the surface itself: what lies along it shrinks as the index grows.
            let along = |v: Vec3| v.cross(geometric).length();
            if !is_by_shading && along(d) < 0.99 * eta {
                prop_assert!((along(entered) * eta - along(d)).abs() < 1e-5, "{entered}");
            }
        }
    }
}
