//! One light of many, drawn about in proportion to what it contributes.
//!
//! A binary tree over the lights. Each node bounds where its lights are, where they shine to and how
//! strong they are; on the way down each step goes to a child in proportion to an estimate of what
//! arrives from it. Source: Conty Estevez, Kulla, *Importance Sampling of Many Lights with Adaptive
//! Tree Splitting*, PACMCGIT 1(2) 2018; pbrt 4ed §12.6.3.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use self::node::Node;
use super::Light;

mod build;
mod node;

/// A tree over lights, to draw one at a point.
///
/// It does not hold the lights: indices are those of the slice that it was made of.
#[derive(Debug, Clone, Default)]
pub struct LightTree {
    /// Depth first: a node's left child follows it. Empty where no light is in the tree.
    nodes: Vec<Node>,
    /// Parent of each node; unused for the root.
    parents: Vec<u32>,
    /// Leaf of each light, or one of the two below.
    leaves: Vec<u32>,
    always: Vec<u32>,
}

/// In place of a leaf: the light is one to be evaluated always.
const ALWAYS: u32 = u32::MAX;

/// In place of a leaf: the light emits nothing.
const DARK: u32 = u32::MAX - 1;

/// The light that was drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PickedLight {
    /// Index of the light.
    pub index: u32,
    /// With which probability it is drawn; > 0.
    pub probability: f32,
    /// What is left of the number that it was drawn by: uniform in [0, 1) again, with the bits that the
    /// choice did not need.
    pub u: f32,
}

impl LightTree {
    /// The tree over `lights`. The same lights give the same tree.
    ///
    /// # Panics
    /// If there are 2³⁰ lights or more.
    pub fn new(lights: &[Light]) -> Self {
        assert!(lights.len() < 1 << 30, "more lights than indices");
        let bounds: Vec<_> = lights.par_iter().with_min_len(1 << 10).map(Light::bounds).collect();
        let mut tree = Self { leaves: vec![DARK; lights.len()], ..Self::default() };
        for (index, _) in (0..).zip(&bounds).filter(|(_, bounds)| bounds.is_none()) {
            tree.leaves[index as usize] = ALWAYS;
            tree.always.push(index);
        }
        (tree.nodes, tree.parents) = build::build(&bounds);
        for (index, node) in (0..).zip(&tree.nodes) {
            if let Some(light) = node.light() {
                tree.leaves[light as usize] = index;
            }
        }
        tree
    }

    /// Lights that are not in the tree and are to be evaluated at every point, as what arrives from
    /// them hardly depends on the place: directional ones, and points without falloff.
    pub fn always(&self) -> &[u32] {
        &self.always
    }

    /// Number of lights in the tree.
    pub fn len(&self) -> usize {
        self.nodes.len().div_ceil(2)
    }

    /// Whether no light is in the tree.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Draws a light of the tree for the point `p` by `u`, uniform in [0, 1).
    ///
    /// - `n`: unit normal of a surface that only light from its side reaches; none for what is lit from
    ///   all around.
    ///
    /// Every light that sends something to `p` (from the side of `n`) has a probability above zero. None
    /// where no light of the group that `u` led to can; that counts as a sample of zero.
    pub fn sample(&self, p: Vec3, n: Option<Vec3>, u: f32) -> Option<PickedLight> {
        let (p, n) = (p.as_dvec3(), n.map(Vec3::as_dvec3));
        let mut at = 0;
        if !(self.nodes.first()?.importance(p, n) > 0.0) {
            return None;
        }
        let (mut u, mut probability) = (f64::from(u), 1.0);
        loop {
            let node = &self.nodes[at as usize];
            if let Some(index) = node.light() {
                let u = (u as f32).min(1f32.next_down());
                return Some(PickedLight { index, probability: rounded(probability), u });
            }
            let children = [at + 1, node.right()];
            let left = self.left_share(children, p, n)?;
            if u < left {
                at = children[0];
                probability *= left;
                u /= left;
            } else {
                at = children[1];
                probability *= 1.0 - left;
                u = (u - left) / (1.0 - left);
            }
        }
    }

    /// The probability with which [`Self::sample`] draws light `index`: 1 for one that is always
    /// evaluated, 0 for one that emits nothing.
    ///
    /// # Panics
    /// If there is no such light.
    pub fn probability(&self, p: Vec3, n: Option<Vec3>, index: u32) -> f32 {
        let (p, n) = (p.as_dvec3(), n.map(Vec3::as_dvec3));
        let mut at = match self.leaves[index as usize] {
            ALWAYS => return 1.0,
            DARK => return 0.0,
            leaf => leaf,
        };
        if !(self.nodes[0].importance(p, n) > 0.0) {
            return 0.0;
        }
        let mut probability = 1.0;
        while at != 0 {
            let parent = self.parents[at as usize];
            let children = [parent + 1, self.nodes[parent as usize].right()];
            let Some(left) = self.left_share(children, p, n) else { return 0.0 };
            let share = if at == children[0] { left } else { 1.0 - left };
            if share == 0.0 {
                return 0.0;
            }
            probability *= share;
            at = parent;
        }
        rounded(probability)
    }

    /// The probability of the left one of two siblings; none where nothing arrives from both.
    #[inline]
    fn left_share(&self, children: [u32; 2], p: DVec3, n: Option<DVec3>) -> Option<f64> {
        /// The least share of a child from which anything may arrive.
        const LEAST: f64 = 1e-9;
        let [left, right] = children.map(|i| self.nodes[i as usize].importance(p, n));
        match (left > 0.0, right > 0.0) {
            (false, false) => None,
            (true, false) => Some(1.0),
            (false, true) => Some(0.0),
            // Both remain possible, in f32 too.
            (true, true) => Some((left / (left + right)).clamp(LEAST, 1.0 - LEAST)),
        }
    }
}

/// A probability above zero, as f32 the same.
fn rounded(probability: f64) -> f32 {
    (probability as f32).max(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests;
