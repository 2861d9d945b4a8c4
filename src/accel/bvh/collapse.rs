//! Makes a tree of halves one of eight children a node, with the nodes that rays visit least.
//!
//! By the surface area heuristic a node costs its area, and leaves are what they are: so the best that a part can
//! become follows from the best that its halves can. Source: Ylitie, Karras, Laine, *Efficient incoherent ray
//! traversal on GPUs through compressed wide BVHs*, HPG 2017. Nodes that are filled from above, with
//! the halves of what is largest, leave half of their places empty at the bottom of the tree, where most of them
//! are.

use super::node::WIDTH;

/// What a node costs beside its area, of which the largest is 3 at most: where parts have none, as points and lines
/// along an axis, fewer nodes are better too.
const NODE: f32 = 1e-6;

/// A part, and how it is best put into nodes.
struct Half<T> {
    of: T,
    /// Where its second half is, unless it is a leaf; the first one follows at once.
    second: Option<usize>,
    /// What it costs as no more than so many children of a node, from one on.
    cost: [f32; WIDTH - 1],
    /// How many of so many children, from two on, are to be of its first half; none where fewer children cost
    /// no more. In the first place: as one child it is a node, and so many of that one's are of the first half.
    first: [u8; WIDTH - 1],
}

/// A tree of halves, each of which is followed by what is below it.
pub(super) struct Halves<T>(Vec<Half<T>>);

impl<T> Halves<T> {
    pub(super) const fn new() -> Self {
        Self(Vec::new())
    }

    /// How many parts there are: the place of the next.
    pub(super) const fn len(&self) -> usize {
        self.0.len()
    }

    /// Adds a part, a leaf so far; its place.
    pub(super) fn add(&mut self, of: T) -> usize {
        self.0.push(Half { of, second: None, cost: [0.0; WIDTH - 1], first: [0; WIDTH - 1] });
        self.len() - 1
    }

    /// Says that the part at `place` has halves, the second at `second`, which are all there now; with half the area
    /// of its box, by a scale that makes no side longer than one.
    pub(super) fn join(&mut self, place: usize, second: usize, area: f32) {
        let (a, b) = (&self.0[place + 1].cost, &self.0[second].cost);
        // Of so many children, what is below costs least with how many of the first half.
        let best = |children: usize| {
            let of = |k: usize| (a[k - 1] + b[children - k - 1], k as u8);
            (2..children)
                .map(of)
                .fold(of(1), |best, other| if other.0 < best.0 { other } else { best })
        };
        let (mut cost, mut first) = ([0.0; WIDTH - 1], [0; WIDTH - 1]);
        (cost[0], first[0]) = best(WIDTH);
        cost[0] += area + NODE;
        for children in 2..WIDTH {
            let (apart, k) = best(children);
            (cost[children - 1], first[children - 1]) = match cost[children - 2] {
                fewer if apart < fewer => (apart, k),
                fewer => (fewer, 0),
            };
        }
        let half = &mut self.0[place];
        (half.second, half.cost, half.first) = (Some(second), cost, first);
    }

    /// What was added at a place.
    pub(super) fn get(&self, place: usize) -> &T {
        &self.0[place].of
    }

    /// The places of the children of the node that the part at `place` is best made; of a leaf, its own.
    pub(super) fn children(&self, place: usize) -> Vec<usize> {
        let mut children = Vec::with_capacity(WIDTH);
        let half = &self.0[place];
        match half.second {
            Some(second) => {
                let first = usize::from(half.first[0]);
                self.gather(place + 1, first, &mut children);
                self.gather(second, WIDTH - first, &mut children);
            }
            None => children.push(place),
        }
        children
    }

    /// Adds what the part at `place` becomes as no more than so many children.
    fn gather(&self, place: usize, most: usize, children: &mut Vec<usize>) {
        let half = &self.0[place];
        let number = (2..=most).rev().find(|n| half.first[n - 1] != 0);
        match (half.second, number) {
            (Some(second), Some(number)) => {
                let first = usize::from(half.first[number - 1]);
                self.gather(place + 1, first, children);
                self.gather(second, number - first, children);
            }
            _ => children.push(place),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tree by numbers from a generator; what is below `place` costs, and how many leaves there are.
    fn grow(halves: &mut Halves<f32>, area: f32, depth: usize, next: &mut impl FnMut() -> f32) {
        let place = halves.add(area);
        if depth == 0 || next() < 0.15 {
            return;
        }
        let (a, b) = (area * (0.3 + 0.5 * next()), area * (0.3 + 0.5 * next()));
        grow(halves, a, depth - 1, next);
        let second = halves.len();
        grow(halves, b, depth - 1, next);
        halves.join(place, second, area);
    }

    /// The areas of all nodes of the tree that is made, and its leaves in order.
    fn cost(halves: &Halves<f32>, place: usize, leaves: &mut Vec<usize>) -> f64 {
        if halves.0[place].second.is_none() {
            leaves.push(place);
            return 0.0;
        }
        let children = halves.children(place);
        assert!((2..=WIDTH).contains(&children.len()));
        let below: f64 = children.iter().map(|child| cost(halves, *child, leaves)).sum();
        f64::from(*halves.get(place)) + f64::from(NODE) + below
    }

    /// The least cost of any tree, by trying each way to take apart what is below a node.
    fn least(halves: &Halves<f32>, place: usize) -> f64 {
        fn forests(halves: &Halves<f32>, place: usize, most: usize) -> Vec<Vec<usize>> {
            let mut all = vec![vec![place]];
            if let Some(second) = halves.0[place].second {
                for first in 1..most {
                    for a in forests(halves, place + 1, first) {
                        for b in forests(halves, second, most - first) {
                            all.push(a.iter().chain(&b).copied().collect());
                        }
                    }
                }
            }
            all.sort();
            all.dedup();
            all
        }
        if halves.0[place].second.is_none() {
            return 0.0;
        }
        let ways = forests(halves, place, WIDTH).into_iter().filter(|way| way.len() > 1);
        let best = ways
            .map(|way| way.iter().map(|child| least(halves, *child)).sum::<f64>())
            .fold(f64::INFINITY, f64::min);
        f64::from(halves.0[place].of) + f64::from(NODE) + best
    }

    #[test]
    fn no_other_nodes_cost_less_and_no_leaf_is_lost() {
        let mut state = 7u32;
        let mut next = || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let mut nodes = 0;
        for _ in 0..60 {
            let mut halves = Halves::new();
            grow(&mut halves, 3.0, 4, &mut next);
            let mut leaves = Vec::new();
            let made = cost(&halves, 0, &mut leaves);
            let all = (0..halves.len()).filter(|place| halves.0[*place].second.is_none());
            assert_eq!(leaves, all.collect::<Vec<_>>());
            let least = least(&halves, 0);
            assert!((made - least).abs() <= 1e-5 * least, "{made} and {least}");
            nodes += usize::from(made > 3.1);
        }
        assert!(nodes > 20, "{nodes} have more than one node");
    }

    /// Where nothing has an area, nodes are full.
    #[test]
    fn nodes_of_what_is_flat_are_full() {
        fn even(halves: &mut Halves<()>, depth: usize) {
            let place = halves.add(());
            if depth > 0 {
                even(halves, depth - 1);
                let second = halves.len();
                even(halves, depth - 1);
                halves.join(place, second, 0.0);
            }
        }
        let mut halves = Halves::new();
        even(&mut halves, 6);
        let children = halves.children(0);
        assert_eq!(children.len(), 8);
        assert!(children.iter().all(|child| halves.children(*child).len() == 8));
    }
}
