//! An exact search for the nearest vector that is allowed: a k-d tree of whole numbers.

use super::{FEW, apart};

/// Vectors that a leaf holds, at most.
const LEAF: usize = 24;

/// Vectors in the order of the leaves, with the sample that each belongs to.
///
/// The bounds of a node are those of the first [`FEW`] numbers, the leading components, which tell vectors apart best; they
/// bound the distance of longer vectors as well.
pub(super) struct Tree<const D: usize, const N: usize> {
    nodes: Vec<Node>,
    vectors: Vec<[i16; N]>,
    samples: Vec<[i32; D]>,
    numbers: Vec<u32>,
}

#[derive(Clone)]
struct Node {
    low: [i16; FEW],
    high: [i16; FEW],
    first: u32,
    last: u32,
    /// The least number within, for ties.
    least: u32,
    /// The second child; the first one follows its parent. 0 for a leaf.
    second: u32,
}

/// The nearest so far: a distance and a number; of equal distances the lowest number wins.
pub(super) type Nearest = (i32, u32);

impl<const D: usize, const N: usize> Tree<D, N> {
    /// Of vectors with their numbers, which tell apart, and their samples.
    pub(super) fn new(mut items: Vec<([i16; N], u32, [i32; D])>) -> Self {
        let mut nodes = Vec::with_capacity(items.len() * 4 / LEAF + 1);
        let all = items.len();
        split(&mut items, 0, all, &mut nodes);
        Self {
            nodes,
            vectors: items.iter().map(|i| i.0).collect(),
            numbers: items.iter().map(|i| i.1).collect(),
            samples: items.iter().map(|i| i.2).collect(),
        }
    }

    /// The nearest to `vector` of those that are `allowed`, if any is nearer than `best`.
    #[inline]
    pub(super) fn nearest(
        &self,
        vector: &[i16; N],
        allowed: impl Fn([i32; D]) -> bool,
        mut best: Nearest,
    ) -> Nearest {
        let query: [i16; FEW] = std::array::from_fn(|k| vector[k]);
        // Deeper than any tree of half the samples at each turn.
        let mut stack = [(0, 0, 0); 64];
        let root = &self.nodes[0];
        stack[0] = (root.bound(&query), root.least, 0u32);
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (bound, least, at) = stack[height];
            if (bound, least) > best {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.second == 0 {
                for k in node.first as usize..node.last as usize {
                    let found = (apart(vector, &self.vectors[k]), self.numbers[k]);
                    if found < best && allowed(self.samples[k]) {
                        best = found;
                    }
                }
                continue;
            }
            let [one, two] = [at + 1, node.second].map(|child| {
                let node = &self.nodes[child as usize];
                (node.bound(&query), node.least, child)
            });
            let (near, far) = if (one.0, one.1) <= (two.0, two.1) {
                (one, two)
            } else {
                (two, one)
            };
            stack[height] = far;
            stack[height + 1] = near;
            height += 2;
        }
        best
    }
}

impl Node {
    /// What any vector within is at least away by.
    #[inline(always)]
    fn bound(&self, query: &[i16; FEW]) -> i32 {
        let mut sum = 0;
        for k in 0..FEW {
            let below = self.low[k].wrapping_sub(query[k]);
            let above = query[k].wrapping_sub(self.high[k]);
            let d = below.max(above).max(0);
            sum += i32::from(d) * i32::from(d);
        }
        sum
    }
}

fn split<const D: usize, const N: usize>(
    items: &mut [([i16; N], u32, [i32; D])],
    first: usize,
    last: usize,
    nodes: &mut Vec<Node>,
) {
    let mine = &mut items[first..last];
    let mut node = Node {
        low: [i16::MAX; FEW],
        high: [i16::MIN; FEW],
        first: first as u32,
        last: last as u32,
        least: u32::MAX,
        second: 0,
    };
    for (vector, number, _) in mine.iter() {
        for k in 0..FEW {
            node.low[k] = node.low[k].min(vector[k]);
            node.high[k] = node.high[k].max(vector[k]);
        }
        node.least = node.least.min(*number);
    }
    let me = nodes.len();
    nodes.push(node.clone());
    if mine.len() <= LEAF {
        // In order, so that of equal ones the lowest comes first.
        mine.sort_unstable_by_key(|item| item.1);
        return;
    }
    let widest = (0..FEW)
        .max_by_key(|&k| i32::from(node.high[k]) - i32::from(node.low[k]))
        .unwrap_or(0);
    // Where all are the same, halves of their numbers: then the lowest of them is still found at once.
    let middle = mine.len() / 2;
    mine.select_nth_unstable_by_key(middle, |item| (item.0[widest], item.1));
    split(items, first, first + middle, nodes);
    nodes[me].second = nodes.len() as u32;
    split(items, first + middle, last, nodes);
}
