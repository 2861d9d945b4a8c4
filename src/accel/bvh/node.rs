//! How the tree lies in memory.

use super::simd::{place, prefetch};
use crate::geometry::Sphere;

/// Children of a node, triangles or spheres of a leaf.
pub(super) const WIDTH: usize = 8;

/// The boxes of eight children side by side, and what is in them.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// By axis, the lower and the upper planes. Empty places have +∞ and −∞: no ray meets them.
    pub(super) planes: [[[f32; WIDTH]; 2]; 3],
    pub(super) children: [Child; WIDTH],
}

/// What is in a box: a node, a block of triangles or of spheres, or an item that is solved by itself (another
/// shape, or a copy). The index of one of these, under two bits that tell which.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(transparent)]
pub(super) struct Child(pub(super) u32);

/// A child, told apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Content {
    Node(usize),
    Triangles(usize),
    Spheres(usize),
    Item(u32),
}

impl Child {
    /// Indices are below this.
    pub(super) const LIMIT: usize = 1 << 30;
    const TRIANGLES: u32 = 1 << 31;
    const ITEM: u32 = 1 << 30;
    const SPHERES: u32 = Self::TRIANGLES | Self::ITEM;
    const INDEX: u32 = Self::ITEM - 1;

    pub(super) const fn node(index: usize) -> Self {
        debug_assert!(index < Self::LIMIT);
        Self(index as u32)
    }

    pub(super) const fn triangles(block: usize) -> Self {
        debug_assert!(block < Self::LIMIT);
        Self(block as u32 | Self::TRIANGLES)
    }

    pub(super) const fn spheres(block: usize) -> Self {
        debug_assert!(block < Self::LIMIT);
        Self(block as u32 | Self::SPHERES)
    }

    pub(super) const fn item(index: u32) -> Self {
        debug_assert!((index as usize) < Self::LIMIT);
        Self(index | Self::ITEM)
    }

    #[inline(always)]
    pub(super) const fn content(self) -> Content {
        let index = self.0 & Self::INDEX;
        match self.0 & Self::SPHERES {
            0 => Content::Node(index as usize),
            Self::TRIANGLES => Content::Triangles(index as usize),
            Self::SPHERES => Content::Spheres(index as usize),
            _ => Content::Item(index),
        }
    }
}

impl Node {
    pub(super) const EMPTY: Self = Self {
        planes: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3],
        children: [Child(0); WIDTH],
    };

    pub(super) fn set(&mut self, lane: usize, lower: [f32; 3], upper: [f32; 3], child: Child) {
        for axis in 0..3 {
            self.planes[axis][0][lane] = lower[axis];
            self.planes[axis][1][lane] = upper[axis];
        }
        self.children[lane] = child;
    }

    /// Whether a child is there.
    pub(super) fn is_set(&self, lane: usize) -> bool {
        self.planes[0][0][lane] <= self.planes[0][1][lane]
    }
}

/// Up to eight triangles side by side.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct TriangleBlock {
    /// By axis, then by corner. Places without a triangle repeat one that is there.
    pub(super) corners: [[[f32; WIDTH]; 3]; 3],
    /// Numbers of the primitives in their tree.
    pub(super) ids: [u32; WIDTH],
}

/// Up to eight spheres side by side.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct SphereBlock {
    /// Centres by axis, rounded, and radii that cover for that. Places without a sphere are far off.
    pub(super) rounded: [[f32; WIDTH]; 4],
    /// They repeat one that is there.
    pub(super) spheres: [Sphere; WIDTH],
    /// Numbers of the primitives in their tree.
    pub(super) ids: [u32; WIDTH],
}

/// A hierarchy over the primitives of one group.
#[derive(Debug, Default)]
pub(super) struct Tree {
    /// The first is the root; none where there is nothing in it.
    pub(super) nodes: Vec<Node>,
    pub(super) blocks: Vec<TriangleBlock>,
    pub(super) spheres: Vec<SphereBlock>,
    /// Items without end, which every ray is tested against.
    pub(super) endless: Vec<u32>,
    /// Whether all leaves are blocks of triangles.
    pub(super) is_of_triangles: bool,
    /// Whether it is more than caches hold.
    is_large: bool,
}

impl Tree {
    /// Bytes from which on it takes a while to bring a node.
    const LARGE: u64 = 1 << 20;

    /// With `has_items`, there are leaves of them.
    pub(super) fn new(
        nodes: Vec<Node>,
        blocks: Vec<TriangleBlock>,
        spheres: Vec<SphereBlock>,
        endless: Vec<u32>,
        has_items: bool,
    ) -> Self {
        let is_of_triangles = spheres.is_empty() && !has_items;
        let tree = Self { nodes, blocks, spheres, endless, is_of_triangles, is_large: false };
        Self { is_large: tree.bytes() >= Self::LARGE, ..tree }
    }

    /// Whether it is more than caches hold, and likely what is behind it too.
    #[inline(always)]
    pub(super) const fn is_large(&self) -> bool {
        self.is_large
    }

    /// Has the processor bring a child that will be visited, unless the tree is so small that all of it is at
    /// hand.
    #[inline(always)]
    pub(super) fn prefetch(&self, child: Child) {
        if !self.is_large {
            return;
        }
        // Without branches: what is asked for next is told apart when it is visited. For the few children that are
        // neither node nor triangles some node is brought, or none; with a node, the beginning of the one after it.
        let index = (child.0 & Child::INDEX) as usize;
        let of_nodes = place(&self.nodes, index);
        let of_blocks = place(&self.blocks, index);
        let is_block = child.0 & Child::SPHERES == Child::TRIANGLES;
        const LONGER: usize = size_of::<TriangleBlock>();
        prefetch::<LONGER>(std::hint::select_unpredictable(is_block, of_blocks, of_nodes));
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> u64 {
        let bytes = self.nodes.len() * size_of::<Node>()
            + self.blocks.len() * size_of::<TriangleBlock>()
            + self.spheres.len() * size_of::<SphereBlock>()
            + self.endless.len() * size_of::<u32>();
        bytes as u64
    }
}
