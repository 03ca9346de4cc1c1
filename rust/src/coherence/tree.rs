//! An exact search for the nearest vector that is allowed: a tree of boxes of whole numbers, eight to a node.

use super::{FEW, apart};

/// Vectors that a leaf holds, at most.
const LEAF: usize = 40;
/// Vectors, and boxes, that are compared at a time.
pub(super) const WIDTH: usize = 8;
/// Marks a child that is a leaf.
const IS_LEAF: u32 = 1 << 31;

/// The first [`FEW`] numbers of [`WIDTH`] vectors: for each pair of numbers those of one vector after the other, as the
/// instruction that multiplies pairs and adds them wants them.
type Block = [[f32; WIDTH]; FEW];

/// Vectors in the order of the leaves, with the sample that each belongs to.
///
/// The bounds of a box are those of the first [`FEW`] numbers, the leading components, which tell vectors apart best; they
/// bound the distance of longer vectors as well. A leaf is filled up to whole blocks with places that hold nothing.
pub(super) struct Tree<const D: usize, const N: usize> {
    nodes: Vec<Node>,
    /// The first block of each leaf, and the end.
    leaves: Vec<u32>,
    blocks: Vec<Block>,
    places: Vec<Option<Place<D, N>>>,
}

/// A vector, the number that tells it apart, and its sample.
#[derive(Clone, Copy)]
pub(super) struct Place<const D: usize, const N: usize> {
    pub(super) vector: [i16; N],
    pub(super) number: u32,
    pub(super) sample: [i32; D],
}

/// The boxes of up to eight children; those that are not there are as far away as can be.
struct Node {
    low: Block,
    high: Block,
    child: [u32; WIDTH],
    /// The least number within each.
    least: [u32; WIDTH],
}

/// The nearest so far: a distance and a number; of equal distances the lowest number wins.
pub(super) type Nearest = (i32, u32);

impl<const D: usize, const N: usize> Tree<D, N> {
    pub(super) fn new(mut items: Vec<Place<D, N>>) -> Self {
        let mut tree = Self {
            nodes: Vec::with_capacity(items.len() / (LEAF * 2) + 1),
            leaves: Vec::with_capacity(items.len() * 2 / LEAF + 1),
            blocks: Vec::with_capacity(items.len() / WIDTH + 1),
            places: Vec::with_capacity(items.len() + WIDTH),
        };
        tree.split(&mut items);
        tree.leaves.push(tree.blocks.len() as u32);
        tree
    }

    /// Number of leaves.
    pub(super) fn leaves(&self) -> usize {
        self.leaves.len() - 1
    }

    /// What lies in a leaf.
    pub(super) fn places(&self, leaf: usize) -> &[Option<Place<D, N>>] {
        let [first, last] = [leaf, leaf + 1].map(|l| self.leaves[l] as usize * WIDTH);
        &self.places[first..last]
    }

    /// The nearest to a vector of the leaf `own`, of those that are `allowed`; (i32::MAX, u32::MAX) if there is none.
    #[inline]
    pub(super) fn nearest(
        &self,
        vector: &[i16; N],
        own: usize,
        allowed: impl Fn([i32; D]) -> bool,
    ) -> Nearest {
        let mut best = (i32::MAX, u32::MAX);
        let query: [f32; FEW] = std::array::from_fn(|k| f32::from(vector[k]));
        let own = own as u32 | IS_LEAF;
        // Those of its own leaf are near already.
        self.scan(own, vector, &query, &allowed, &mut best);
        let mut reach = reach(best);
        let mut stack = [(0.0, 0, 0); 128];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (bound, least, at) = stack[height];
            if bound > reach || best.0 == 0 && least > best.1 {
                continue;
            }
            if at & IS_LEAF != 0 {
                self.scan(at, vector, &query, &allowed, &mut best);
                reach = self::reach(best);
                continue;
            }
            let node = &self.nodes[at as usize];
            let bounds = node.bounds(&query);
            let floor = height;
            for lane in 0..WIDTH {
                let (bound, least, child) = (bounds[lane], node.least[lane], node.child[lane]);
                // Of what is the same everywhere the first is found, without looking at all the rest.
                if bound > reach || child == own || best.0 == 0 && least > best.1 {
                    continue;
                }
                // The nearest last, so that it comes next.
                let mut to = height;
                while to > floor && (stack[to - 1].0, stack[to - 1].1) < (bound, least) {
                    stack[to] = stack[to - 1];
                    to -= 1;
                }
                stack[to] = (bound, least, child);
                height += 1;
            }
        }
        best
    }

    /// Compares a vector with those of a leaf.
    #[inline(always)]
    fn scan(
        &self,
        leaf: u32,
        vector: &[i16; N],
        query: &[f32; FEW],
        allowed: &impl Fn([i32; D]) -> bool,
        best: &mut Nearest,
    ) {
        let leaf = (leaf & !IS_LEAF) as usize;
        for block in self.leaves[leaf] as usize..self.leaves[leaf + 1] as usize {
            let found = distances(&self.blocks[block], query);
            let near = reach(*best);
            if found.iter().all(|&d| d > near) {
                continue;
            }
            for (lane, &few) in found.iter().enumerate() {
                if few > near {
                    continue;
                }
                if let Some(other) = &self.places[block * WIDTH + lane] {
                    let found = (apart(vector, &other.vector), other.number);
                    if found < *best && allowed(other.sample) {
                        *best = found;
                    }
                }
            }
        }
    }

    /// Makes a node, or a leaf, of items and gives its name.
    fn split(&mut self, items: &mut [Place<D, N>]) -> u32 {
        if items.len() <= LEAF && !self.nodes.is_empty() {
            // In order, so that of equal ones the lowest comes first.
            items.sort_unstable_by_key(|item| item.number);
            self.leaves.push(self.blocks.len() as u32);
            for part in items.chunks(WIDTH) {
                let mut block = [[FAR; WIDTH]; FEW];
                for (lane, item) in part.iter().enumerate() {
                    put(&mut block, lane, |k| item.vector[k]);
                }
                self.blocks.push(block);
                self.places
                    .extend((0..WIDTH).map(|lane| part.get(lane).copied()));
            }
            return (self.leaves.len() - 1) as u32 | IS_LEAF;
        }
        let me = self.nodes.len();
        self.nodes.push(Node {
            low: [[FAR; WIDTH]; FEW],
            high: [[FAR; WIDTH]; FEW],
            child: [0; WIDTH],
            least: [u32::MAX; WIDTH],
        });
        let mut parts = vec![items];
        // Three times in halves; what is small enough for a leaf stays whole.
        for _ in 0..WIDTH.ilog2() {
            parts = parts.into_iter().flat_map(halve).collect();
        }
        for (lane, part) in parts.into_iter().filter(|p| !p.is_empty()).enumerate() {
            let bounds = extent(part);
            let node = &mut self.nodes[me];
            put(&mut node.low, lane, |k| bounds[k].0);
            put(&mut node.high, lane, |k| bounds[k].1);
            node.least[lane] = part
                .iter()
                .map(|item| item.number)
                .min()
                .unwrap_or(u32::MAX);
            let child = self.split(part);
            self.nodes[me].child[lane] = child;
        }
        me as u32
    }
}

/// What is no farther than this may be as near as the nearest so far: sums of eight squares err by less.
fn reach(best: Nearest) -> f32 {
    best.0 as f32 * (1.0 + 1e-5)
}

/// Farther than any vector of 12 bits, by a distance whose square still fits.
const FAR: f32 = 1e6;

fn put(block: &mut Block, lane: usize, number: impl Fn(usize) -> i16) {
    for k in 0..FEW {
        block[k][lane] = f32::from(number(k));
    }
}

fn extent<const D: usize, const N: usize>(items: &[Place<D, N>]) -> [(i16, i16); FEW] {
    let mut bounds = [(i16::MAX, i16::MIN); FEW];
    for item in items {
        for (bound, &x) in bounds.iter_mut().zip(&item.vector) {
            *bound = (bound.0.min(x), bound.1.max(x));
        }
    }
    bounds
}

/// The lower and the upper half along the widest side.
fn halve<const D: usize, const N: usize>(items: &mut [Place<D, N>]) -> [&mut [Place<D, N>]; 2] {
    if items.len() <= LEAF {
        return [items, &mut []];
    }
    let bounds = extent(items);
    let widest = (0..FEW)
        .max_by_key(|&k| i32::from(bounds[k].1) - i32::from(bounds[k].0))
        .unwrap_or(0);
    let middle = (items.len() / 2).next_multiple_of(WIDTH);
    // Where all are the same, halves of their numbers: then the lowest of them is still found at once.
    items.select_nth_unstable_by_key(middle, |item| (item.vector[widest], item.number));
    items.split_at_mut(middle).into()
}

/// Squared distances of a vector to those of a block, in the first [`FEW`] numbers.
#[inline(always)]
fn distances(block: &Block, query: &[f32; FEW]) -> [f32; WIDTH] {
    let mut sums = [0.0; WIDTH];
    for (values, &x) in block.iter().zip(query) {
        for (sum, &value) in sums.iter_mut().zip(values) {
            *sum += (value - x) * (value - x);
        }
    }
    sums
}

impl Node {
    /// What any vector of each child is at least away by.
    #[inline(always)]
    fn bounds(&self, query: &[f32; FEW]) -> [f32; WIDTH] {
        let mut sums = [0.0; WIDTH];
        for ((low, high), &x) in self.low.iter().zip(&self.high).zip(query) {
            for lane in 0..WIDTH {
                let (below, above) = (low[lane] - x, x - high[lane]);
                let apart = if below > above { below } else { above };
                let apart = if apart > 0.0 { apart } else { 0.0 };
                sums[lane] += apart * apart;
            }
        }
        sums
    }
}
