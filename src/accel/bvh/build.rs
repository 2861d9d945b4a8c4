//! Builds a tree: the surface area heuristic over bins, top down, in parallel, and the same tree
//! whatever the number of threads.
//!
//! A large node takes the box of largest area among its children and splits it in two, until it has eight of
//! them. What is below is split in two down to leaves, and then made nodes of eight (see [`super::collapse`]).
//! Sources: Wald, *On fast construction of SAH-based bounding volume hierarchies*, RT 2007 (bins); Wald, Benthin,
//! Boulos, *Getting rid of packets*, RT 2008 (wide nodes).

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::super::AccelError;
use super::collapse::Halves;
use super::node::{Child, Node, SphereBlock, Tree, TriangleBlock, WIDTH};
use super::watch::Watch;
use crate::geometry::Sphere;
use crate::pages::prefer_large;

/// Below so many levels, large boxes are split in halves of equal number: coordinates that grow geometrically would
/// make a tree as deep as they are many.
const SAH_DEPTH: usize = 24;

/// Levels of large boxes below that: each has an eighth of the primitives of the one above it, rounded up, or there
/// is one level more where a node was filled unevenly; 2³² of them are 2¹² after seven.
const LARGE_EVEN_DEPTH: usize = 8;

/// The same of boxes that one thread builds, of fewer than [`TASK`]: each has half the primitives, rounded up.
const SMALL_EVEN_DEPTH: usize = 13;

/// Below so many levels these are split in halves of equal number.
const SMALL_SAH_DEPTH: usize = MAX_DEPTH - SMALL_EVEN_DEPTH;

/// No tree is deeper than this.
pub(super) const MAX_DEPTH: usize = 48;

const _: () = assert!(
    SAH_DEPTH + LARGE_EVEN_DEPTH <= SMALL_SAH_DEPTH && TASK < 1 << SMALL_EVEN_DEPTH,
    "no tree is deeper than that"
);

/// Bins an axis, at most, and of small parts.
const BINS: usize = 32;
const FEW_BINS: usize = 8;

/// Primitives that decide where a box is split: of more than these, a sample. That tells where to split as
/// well, and saves reading them all once more for each of the upper levels of the tree.
const SAMPLE: usize = 1 << 13;

/// 2³² times the golden ratio: its multiples are spread evenly.
const GOLDEN: u32 = 2_654_435_769;

/// Primitives from which on a box is split by several threads, and those of a piece of that work.
const PARALLEL: usize = 1 << 15;
const CHUNK: usize = 1 << 13;

/// Primitives from which on children are built by several threads.
const TASK: usize = 1 << 12;

/// The box of a primitive. In the fourth places: its number, and its [`Kind`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Reference {
    lower: Vec4,
    upper: Vec4,
}

/// What a box is around.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Triangle,
    Sphere,
    /// What is solved by itself.
    Item,
}

/// Where triangles and spheres are, by number.
pub(super) trait Primitives: Sync {
    fn corners(&self, id: u32) -> [Vec3; 3];
    fn sphere(&self, id: u32) -> Sphere;
}

impl Reference {
    pub(super) fn triangle(id: u32, [a, b, c]: [Vec3; 3]) -> Self {
        Self::new(Kind::Triangle, id, a.min(b).min(c), a.max(b).max(c))
    }

    /// By the number of a primitive, or of an item.
    pub(super) fn new(kind: Kind, id: u32, lower: Vec3, upper: Vec3) -> Self {
        Self { lower: lower.extend(f32::from_bits(id)), upper: upper.extend(kind as u8 as f32) }
    }

    /// Whether all its numbers are.
    pub(super) fn is_finite(&self) -> bool {
        self.lower.truncate().is_finite() && self.upper.truncate().is_finite()
    }

    #[inline]
    pub(super) fn id(&self) -> u32 {
        self.lower.w.to_bits()
    }

    #[inline]
    fn kind(&self) -> Kind {
        match self.upper.w {
            0.0 => Kind::Triangle,
            1.0 => Kind::Sphere,
            _ => Kind::Item,
        }
    }

    /// Twice its centre.
    #[inline(always)]
    fn center(&self) -> Vec4 {
        self.lower + self.upper
    }
}

/// A box; the fourth places mean nothing.
#[derive(Debug, Clone, Copy)]
struct Box4 {
    lower: Vec4,
    upper: Vec4,
}

impl Box4 {
    const EMPTY: Self = Self { lower: Vec4::INFINITY, upper: Vec4::NEG_INFINITY };

    #[inline(always)]
    fn union(self, other: Self) -> Self {
        Self { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
    }

    #[inline(always)]
    fn add(&mut self, lower: Vec4, upper: Vec4) {
        self.lower = self.lower.min(lower);
        self.upper = self.upper.max(upper);
    }

    /// The same in the corner of space, on a scale that makes no side longer than one.
    fn scaled(&self, scale: f32) -> Self {
        // One where a side is longer than numbers are.
        Self { lower: Vec4::ZERO, upper: ((self.upper - self.lower) * scale).min(Vec4::ONE) }
    }

    /// Half its area.
    #[inline(always)]
    fn area(&self) -> f32 {
        let d = self.upper - self.lower;
        d.x * (d.y + d.z) + d.y * d.z
    }
}

/// Primitives that will become one child.
struct Part<'a> {
    refs: &'a mut [Reference],
    /// Place of the first among all.
    start: usize,
    bounds: Box4,
    /// Of twice the centres.
    centers: Box4,
}

/// A part of a tree, with indices of its own.
#[derive(Default)]
struct Subtree {
    nodes: Vec<Node>,
    /// Of triangles.
    leaves: Vec<Leaf>,
    /// Of spheres.
    balls: Vec<Leaf>,
    /// Whether there are leaves of items.
    has_items: bool,
}

/// Where the primitives of a leaf are among all.
#[derive(Clone, Copy)]
struct Leaf {
    start: u32,
    len: u32,
}

/// Builds the tree over `refs`. `bins` bounds the effort.
pub(super) fn build(
    mut refs: Vec<Reference>,
    endless: Vec<u32>,
    bins: usize,
    primitives: &impl Primitives,
    watch: &Watch,
) -> Result<Tree, AccelError> {
    if refs.is_empty() {
        return Ok(Tree::new(Vec::new(), Vec::new(), Vec::new(), endless, false));
    }
    let refs_bytes = size_of_val(&refs[..]) as u64;
    let whole = Part::new(&mut refs, 0);
    let builder = Builder { bins: bins.clamp(4, BINS), watch };
    let Subtree { nodes, leaves, balls, has_items } = builder.subtree(whole, 0);
    watch.check()?;
    let bytes = size_of_val(&nodes[..])
        + size_of_val(&leaves[..])
        + size_of_val(&balls[..])
        + leaves.len() * size_of::<TriangleBlock>()
        + balls.len() * size_of::<SphereBlock>();
    // Nodes move once more, when the references are gone.
    let beside = refs_bytes.max(size_of_val(&nodes[..]) as u64);
    watch.reserve(beside + bytes as u64)?;
    // Places that are left over repeat the last.
    let ids = |leaf: &Leaf| -> [u32; WIDTH] {
        let refs = &refs[leaf.start as usize..][..leaf.len as usize];
        std::array::from_fn(|lane| refs[lane.min(refs.len() - 1)].id())
    };
    let triangles = |leaf: &Leaf| {
        let ids = ids(leaf);
        let mut block = TriangleBlock { corners: [[[0.0; WIDTH]; 3]; 3], ids };
        for (lane, id) in ids.into_iter().enumerate() {
            for (corner, p) in primitives.corners(id).into_iter().enumerate() {
                for axis in 0..3 {
                    block.corners[axis][corner][lane] = p[axis];
                }
            }
        }
        block
    };
    let spheres = |leaf: &Leaf| {
        let ids = ids(leaf);
        SphereBlock::new(leaf.len as usize, ids.map(|id| primitives.sphere(id)), ids)
    };
    let mut blocks = Vec::with_capacity(leaves.len());
    prefer_large(&mut blocks);
    blocks.par_extend(leaves.par_iter().with_min_len(512).map(triangles));
    let spheres = balls.par_iter().with_min_len(512).map(spheres).collect();
    // To where the pages are large; they have come here bit by bit.
    drop(refs);
    let mut moved = Vec::with_capacity(nodes.len());
    prefer_large(&mut moved);
    moved.par_extend(nodes);
    Ok(Tree::new(moved, blocks, spheres, endless, has_items))
}

impl<'a> Part<'a> {
    fn new(refs: &'a mut [Reference], start: usize) -> Self {
        let add = |(mut bounds, mut centers): (Box4, Box4), r: &Reference| {
            bounds.add(r.lower, r.upper);
            centers.add(r.center(), r.center());
            (bounds, centers)
        };
        let empty = (Box4::EMPTY, Box4::EMPTY);
        let (bounds, centers) = refs
            .par_chunks(CHUNK)
            .map(|chunk| chunk.iter().fold(empty, add))
            .reduce(|| empty, |a, b| (a.0.union(b.0), a.1.union(b.1)));
        Self { refs, start, bounds, centers }
    }

    /// Whether one leaf can hold it.
    fn is_leaf(&self) -> bool {
        let (first, rest) = self.refs.split_first().expect("no part is empty");
        let kind = first.kind();
        rest.is_empty()
            || (self.refs.len() <= WIDTH
                && kind != Kind::Item
                && rest.iter().all(|r| r.kind() == kind))
    }
}

struct Builder<'a> {
    bins: usize,
    watch: &'a Watch<'a>,
}

impl Builder<'_> {
    /// The tree over `part`, its root first.
    fn subtree(&self, part: Part, depth: usize) -> Subtree {
        let mut tree = Subtree::default();
        self.append(&mut tree, part, depth);
        tree
    }

    /// Appends the node over `part`, and all that is below it.
    fn append(&self, tree: &mut Subtree, part: Part, depth: usize) {
        if part.refs.len() < TASK {
            let len = part.refs.len() as u64;
            self.append_small(tree, part, depth);
            if depth == 0 {
                self.watch.add(len);
            }
            return;
        }
        if self.watch.is_stopped() {
            return;
        }
        let mut node = Node::EMPTY;
        let index = tree.nodes.len();
        tree.nodes.push(node);
        let build = |part: Part| {
            let (bounds, len) = (part.bounds, part.refs.len());
            let mut subtree = Subtree::default();
            let child = self.child(&mut subtree, part, depth);
            if len < TASK {
                self.watch.add(len as u64);
            }
            (bounds, child, subtree)
        };
        let subtrees: Vec<_> = self.children(part, depth).into_par_iter().map(build).collect();
        for (lane, (bounds, child, subtree)) in subtrees.into_iter().enumerate() {
            set(&mut node, lane, &bounds, tree.moved(child));
            tree.merge(subtree);
        }
        tree.nodes[index] = node;
    }

    /// The same for a part that one thread builds.
    fn append_small(&self, tree: &mut Subtree, part: Part, depth: usize) {
        let extent = (part.bounds.upper - part.bounds.lower).truncate().max_element();
        let scale = extent.max(f32::MIN_POSITIVE).recip();
        let mut halves = Halves::new();
        self.add_halves(&mut halves, part, depth, scale);
        tree.append(&halves, 0);
    }

    /// Adds a part to `halves`, split down to leaves. `scale` is one by the longest side of the whole.
    fn add_halves(&self, halves: &mut Halves<Piece>, part: Part, depth: usize, scale: f32) {
        let bounds = part.bounds;
        if part.is_leaf() {
            halves.add((bounds, Some(LeafOf::new(&part))));
            return;
        }
        let place = halves.add((bounds, None));
        let [first, second] = self.cut(part, depth < SMALL_SAH_DEPTH);
        self.add_halves(halves, first, depth + 1, scale);
        let start = halves.len();
        self.add_halves(halves, second, depth + 1, scale);
        halves.join(place, start, bounds.scaled(scale).area());
    }

    /// Appends what is in a child of a node at `depth`.
    fn child(&self, tree: &mut Subtree, part: Part, depth: usize) -> Child {
        if !part.is_leaf() {
            let index = tree.nodes.len();
            self.append(tree, part, depth + 1);
            return Child::node(index);
        }
        tree.leaf(&LeafOf::new(&part))
    }

    /// Cuts a part into those of the children of one node.
    fn children<'p>(&self, part: Part<'p>, depth: usize) -> Vec<Part<'p>> {
        let mut parts = Vec::with_capacity(WIDTH);
        parts.push(part);
        while parts.len() < WIDTH {
            // Where halves are made, of the largest number.
            let size = |part: &Part| match depth {
                ..SAH_DEPTH => part.bounds.area(),
                _ => part.refs.len() as f32,
            };
            let candidates = parts.iter().enumerate().filter(|(_, part)| !part.is_leaf());
            let Some((largest, _)) =
                candidates.map(|(i, part)| (i, size(part))).max_by(|a, b| a.1.total_cmp(&b.1))
            else {
                break;
            };
            let part = parts.swap_remove(largest);
            parts.extend(self.cut(part, depth < SAH_DEPTH));
        }
        parts
    }

    /// Cuts a part in two: where it is best, or else, and where that cannot be told, in the middle.
    fn cut<'p>(&self, part: Part<'p>, is_best: bool) -> [Part<'p>; 2] {
        match is_best.then(|| self.best_split(&part)).flatten() {
            Some(split) => split.apply(part),
            None => halve_evenly(part),
        }
    }

    /// The best split between bins, if the centres differ at all.
    fn best_split(&self, part: &Part) -> Option<Split> {
        // As Embree has it: fewer bins for fewer primitives. Most parts are small, and clearing bins that
        // they do not use would take longer than all else.
        match self.bins.min(4 + part.refs.len() / 16) {
            bins @ ..=FEW_BINS => best_of::<FEW_BINS>(part, bins),
            bins => best_of::<BINS>(part, bins),
        }
    }
}

/// The best split between so many bins, of `N` that there are.
#[expect(clippy::needless_range_loop, reason = "several arrays run along together")]
fn best_of<const N: usize>(part: &Part, bins: usize) -> Option<Split> {
    let n = part.refs.len();
    let extent = part.centers.upper - part.centers.lower;
    let scale = |d: f32| if d > 0.0 { (bins - 1) as f32 / d } else { 0.0 };
    let map = BinMap {
        lower: part.centers.lower,
        scale: Vec4::new(scale(extent.x), scale(extent.y), scale(extent.z), 0.0),
    };
    let mut counted = Bins::<N>::EMPTY;
    if n <= SAMPLE {
        part.refs.iter().for_each(|r| counted.add(&map, r));
    } else {
        // From each of so many stretches of them one, and not always the same: meshes may be regular.
        for i in 0..SAMPLE {
            let [from, to] = [i, i + 1].map(|i| i * n / SAMPLE);
            let turn = u64::from((i as u32).wrapping_mul(GOLDEN));
            let within = ((turn * (to - from) as u64) >> 32) as usize;
            counted.add(&map, &part.refs[from + within]);
        }
    }
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in 0..3 {
        // Areas and numbers to the right of each boundary, then those to the left.
        let mut right = [0.0; N];
        let (mut bounds, mut count) = (Box4::EMPTY, 0);
        for i in (1..bins).rev() {
            bounds = bounds.union(counted.bounds[axis][i]);
            count += counted.counts[axis][i];
            right[i] = if count == 0 { f32::INFINITY } else { bounds.area() * blocks(count) };
        }
        let (mut bounds, mut count) = (Box4::EMPTY, 0);
        for i in 1..bins {
            bounds = bounds.union(counted.bounds[axis][i - 1]);
            count += counted.counts[axis][i - 1];
            if count == 0 {
                continue;
            }
            let cost = bounds.area() * blocks(count) + right[i];
            if cost < best.map_or(f32::INFINITY, |b| b.0) {
                best = Some((cost, axis, i));
            }
        }
    }
    best.map(|(_, axis, bin)| Split { map, axis, bin: bin as u32 })
}

/// The cost of a number of primitives: it goes by blocks.
#[inline(always)]
fn blocks(count: u32) -> f32 {
    count.div_ceil(WIDTH as u32) as f32
}

fn set(node: &mut Node, lane: usize, bounds: &Box4, child: Child) {
    let corner = |p: Vec4| p.truncate().to_array();
    node.set(lane, corner(bounds.lower), corner(bounds.upper), child);
}

/// What will be a leaf.
struct LeafOf {
    kind: Kind,
    /// The number of the first primitive.
    id: u32,
    at: Leaf,
}

impl LeafOf {
    fn new(part: &Part) -> Self {
        let first = part.refs[0];
        let at = Leaf { start: part.start as u32, len: part.refs.len() as u32 };
        Self { kind: first.kind(), id: first.id(), at }
    }
}

/// A part of a tree of halves: its box, and what leaf it is, if it is one.
type Piece = (Box4, Option<LeafOf>);

impl Subtree {
    /// Appends the node that the part at `place` is made, and all that is below it.
    fn append(&mut self, halves: &Halves<Piece>, place: usize) -> Child {
        let mut node = Node::EMPTY;
        let index = self.nodes.len();
        self.nodes.push(node);
        for (lane, child) in halves.children(place).into_iter().enumerate() {
            let (bounds, leaf) = halves.get(child);
            let below = match leaf {
                Some(leaf) => self.leaf(leaf),
                None => self.append(halves, child),
            };
            set(&mut node, lane, bounds, below);
        }
        self.nodes[index] = node;
        Child::node(index)
    }

    /// Appends a leaf.
    fn leaf(&mut self, leaf: &LeafOf) -> Child {
        match leaf.kind {
            Kind::Item => {
                self.has_items = true;
                Child::item(leaf.id)
            }
            Kind::Triangle => {
                self.leaves.push(leaf.at);
                Child::triangles(self.leaves.len() - 1)
            }
            Kind::Sphere => {
                self.balls.push(leaf.at);
                Child::spheres(self.balls.len() - 1)
            }
        }
    }

    /// A child of a subtree that is about to be merged.
    fn moved(&self, child: Child) -> Child {
        use super::node::Content;
        match child.content() {
            Content::Node(i) => Child::node(i + self.nodes.len()),
            Content::Triangles(i) => Child::triangles(i + self.leaves.len()),
            Content::Spheres(i) => Child::spheres(i + self.balls.len()),
            Content::Item(_) => child,
        }
    }

    fn merge(&mut self, mut other: Self) {
        for node in &mut other.nodes {
            for lane in 0..WIDTH {
                if node.is_set(lane) {
                    node.children[lane] = self.moved(node.children[lane]);
                }
            }
        }
        self.nodes.append(&mut other.nodes);
        self.leaves.append(&mut other.leaves);
        self.balls.append(&mut other.balls);
        self.has_items |= other.has_items;
    }
}

/// From centres to bins.
#[derive(Clone, Copy)]
struct BinMap {
    lower: Vec4,
    scale: Vec4,
}

impl BinMap {
    #[inline(always)]
    fn bins(&self, r: &Reference) -> [u32; 3] {
        // The last bits of 2²³ + x are x, rounded.
        let x = (r.center() - self.lower) * self.scale + Vec4::splat(8_388_608.0);
        [x.x, x.y, x.z].map(|x| x.to_bits() & (BINS as u32 - 1))
    }
}

struct Bins<const N: usize> {
    bounds: [[Box4; N]; 3],
    counts: [[u32; N]; 3],
}

impl<const N: usize> Bins<N> {
    const EMPTY: Self = Self { bounds: [[Box4::EMPTY; N]; 3], counts: [[0; N]; 3] };

    #[inline(always)]
    fn add(&mut self, map: &BinMap, r: &Reference) {
        for (axis, bin) in map.bins(r).into_iter().enumerate() {
            let bin = bin as usize % N;
            self.bounds[axis][bin].add(r.lower, r.upper);
            self.counts[axis][bin] += 1;
        }
    }
}

/// Between two bins.
struct Split {
    map: BinMap,
    axis: usize,
    bin: u32,
}

/// What one side of a split holds.
#[derive(Clone, Copy)]
struct Side {
    bounds: Box4,
    centers: Box4,
}

impl Side {
    const EMPTY: Self = Self { bounds: Box4::EMPTY, centers: Box4::EMPTY };

    #[inline(always)]
    fn add(&mut self, r: &Reference) {
        self.bounds.add(r.lower, r.upper);
        self.centers.add(r.center(), r.center());
    }

    fn union(self, other: Self) -> Self {
        Self { bounds: self.bounds.union(other.bounds), centers: self.centers.union(other.centers) }
    }
}

impl Split {
    #[inline(always)]
    fn is_left(&self, r: &Reference) -> bool {
        self.map.bins(r)[self.axis] < self.bin
    }

    /// Moves what is left to the front.
    fn partition(&self, refs: &mut [Reference]) -> (usize, [Side; 2]) {
        let mut sides = [Side::EMPTY; 2];
        let (mut i, mut j) = (0, refs.len());
        loop {
            while i < j && self.is_left(&refs[i]) {
                sides[0].add(&refs[i]);
                i += 1;
            }
            while i < j && !self.is_left(&refs[j - 1]) {
                sides[1].add(&refs[j - 1]);
                j -= 1;
            }
            if i >= j {
                return (i, sides);
            }
            refs.swap(i, j - 1);
        }
    }

    /// The same by several threads: every piece by itself, and then what is on the wrong side is swapped.
    fn partition_in_parallel(&self, refs: &mut [Reference]) -> (usize, [Side; 2]) {
        let pieces: Vec<(usize, [Side; 2])> =
            refs.par_chunks_mut(CHUNK).map(|chunk| self.partition(chunk)).collect();
        let middle = pieces.iter().map(|(left, _)| left).sum();
        let sides =
            pieces.iter().fold([Side::EMPTY; 2], |[a, b], (_, [c, d])| [a.union(*c), b.union(*d)]);
        let n = refs.len();
        let piece = |i: usize| (i * CHUNK, i * CHUNK + pieces[i].0, n.min((i + 1) * CHUNK));
        // Stretches of the right side in front of the middle, and of the left one behind it.
        let in_front = (0..pieces.len())
            .map(|i| (piece(i).1, piece(i).2.min(middle)))
            .filter(|(from, to)| from < to);
        let mut behind = (0..pieces.len())
            .map(|i| (piece(i).0.max(middle), piece(i).1))
            .filter(|(from, to)| from < to);
        let (front, back) = refs.split_at_mut(middle);
        let (mut from, mut to) = (0, 0);
        for (mut a, end) in in_front {
            while a < end {
                if from == to {
                    (from, to) = behind.next().expect("as many are wrong on either side");
                }
                let len = (end - a).min(to - from);
                front[a..a + len].swap_with_slice(&mut back[from - middle..from - middle + len]);
                (a, from) = (a + len, from + len);
            }
        }
        (middle, sides)
    }

    fn apply<'p>(&self, part: Part<'p>) -> [Part<'p>; 2] {
        let (middle, sides) = if part.refs.len() < PARALLEL {
            self.partition(part.refs)
        } else {
            self.partition_in_parallel(part.refs)
        };
        let start = part.start;
        let (left, right) = part.refs.split_at_mut(middle);
        let part = |refs, start, Side { bounds, centers }| Part { refs, start, bounds, centers };
        let [a, b] = sides;
        [part(left, start, a), part(right, start + middle, b)]
    }
}

/// Splits a part in the middle of what order it is in.
fn halve_evenly(part: Part) -> [Part; 2] {
    let middle = part.refs.len() / 2;
    let (left, right) = part.refs.split_at_mut(middle);
    [Part::new(left, part.start), Part::new(right, part.start + middle)]
}
