//! Boxes of vectors in `f32`: what a query need not look at.

use super::apart;

/// Vectors, and boxes, that are compared at a time.
const WIDTH: usize = 8;
/// Numbers that are compared at a time, and that boxes bound.
const FEW: usize = 8;
/// Vectors that a leaf holds, at most.
const LEAF: usize = 40;
/// Marks a child that is a leaf.
const IS_LEAF: u32 = 1 << 31;
/// Marks a child that is not there.
const NONE: u32 = u32::MAX;
/// Farther than any vector.
const FAR: f32 = 1e15;

/// [`FEW`] numbers of [`WIDTH`] vectors: those of all vectors for one number, then for the next.
type Block = [[f32; WIDTH]; FEW];

pub(super) struct Tree {
    numbers: usize,
    /// Which number comes first: those that spread most.
    order: Vec<usize>,
    /// What lies in the middle of each number, and one over the widest reach from there: vectors are within 1.
    middle: Vec<f64>,
    scale: f64,
    nodes: Vec<Node>,
    /// The first group of [`WIDTH`] vectors of each leaf, and the end.
    leaves: Vec<u32>,
    /// All numbers of a group, then of the next.
    blocks: Vec<Block>,
    /// Which vectors; [`u32::MAX`] where a leaf ends.
    index: Vec<u32>,
}

/// The boxes of up to eight children.
struct Node {
    low: Block,
    high: Block,
    child: [u32; WIDTH],
}

impl Tree {
    pub(super) fn new(vectors: &[f64], numbers: usize) -> Self {
        let count = vectors.len() / numbers;
        let mut middle = vec![0.0; numbers];
        let mut spread = vec![0.0; numbers];
        let mut widest = 0.0f64;
        for k in 0..numbers {
            let all = || vectors[k..].iter().step_by(numbers);
            let low = all().copied().fold(f64::INFINITY, f64::min);
            let high = all().copied().fold(f64::NEG_INFINITY, f64::max);
            middle[k] = low / 2.0 + high / 2.0;
            widest = widest.max((high - low) / 2.0);
            let mean = all().sum::<f64>() / count as f64;
            spread[k] = all().map(|x| (x - mean) * (x - mean)).sum();
        }
        let mut order: Vec<usize> = (0..numbers).collect();
        order.sort_by(|&a, &b| spread[b].total_cmp(&spread[a]).then(a.cmp(&b)));
        let mut tree = Self {
            numbers,
            order,
            middle,
            scale: if widest > 0.0 { 1.0 / widest } else { 1.0 },
            nodes: Vec::with_capacity(count / (LEAF * 2) + 1),
            leaves: Vec::with_capacity(count * 2 / LEAF + 1),
            blocks: Vec::with_capacity((count / WIDTH + 1) * numbers.div_ceil(FEW)),
            index: Vec::with_capacity(count + WIDTH),
        };
        let mut small = vec![0.0; tree.width()];
        let leading: Vec<[f32; FEW]> = (0..count)
            .map(|i| {
                tree.shrink(&vectors[i * numbers..][..numbers], &mut small);
                std::array::from_fn(|k| small[k])
            })
            .collect();
        let mut items: Vec<u32> = (0..count as u32).collect();
        tree.split(vectors, &leading, &mut items);
        tree.leaves.push((tree.index.len() / WIDTH) as u32);
        tree
    }

    /// Numbers of a vector in whole blocks.
    fn width(&self) -> usize {
        self.numbers.next_multiple_of(FEW)
    }

    /// A vector as blocks hold it; what is left of the last block stays zero.
    fn shrink(&self, vector: &[f64], to: &mut [f32]) {
        for (to, &k) in to.iter_mut().zip(&self.order) {
            *to = ((vector[k] - self.middle[k]) * self.scale) as f32;
        }
    }

    /// Makes a node, or a leaf, of items and gives its name.
    fn split(&mut self, vectors: &[f64], leading: &[[f32; FEW]], items: &mut [u32]) -> u32 {
        if items.len() <= LEAF && !self.nodes.is_empty() {
            self.leaves.push((self.index.len() / WIDTH) as u32);
            let mut small = vec![0.0; self.width()];
            for part in items.chunks(WIDTH) {
                let from = self.blocks.len();
                self.blocks
                    .resize(from + self.width() / FEW, [[FAR; WIDTH]; FEW]);
                for (lane, &item) in part.iter().enumerate() {
                    self.shrink(
                        &vectors[item as usize * self.numbers..][..self.numbers],
                        &mut small,
                    );
                    for (k, &x) in small.iter().enumerate() {
                        self.blocks[from + k / FEW][k % FEW][lane] = x;
                    }
                }
                self.index
                    .extend((0..WIDTH).map(|lane| part.get(lane).copied().unwrap_or(u32::MAX)));
            }
            return (self.leaves.len() - 1) as u32 | IS_LEAF;
        }
        let me = self.nodes.len();
        self.nodes.push(Node {
            low: [[FAR; WIDTH]; FEW],
            high: [[FAR; WIDTH]; FEW],
            child: [NONE; WIDTH],
        });
        let mut parts = vec![items];
        // Three times in halves; what is small enough for a leaf stays whole.
        for _ in 0..WIDTH.ilog2() {
            parts = parts.into_iter().flat_map(|p| halve(leading, p)).collect();
        }
        for (lane, part) in parts.into_iter().filter(|p| !p.is_empty()).enumerate() {
            let bounds = extent(leading, part);
            let node = &mut self.nodes[me];
            for k in 0..FEW {
                (node.low[k][lane], node.high[k][lane]) = bounds[k];
            }
            let child = self.split(vectors, leading, part);
            self.nodes[me].child[lane] = child;
        }
        me as u32
    }
}

fn extent(leading: &[[f32; FEW]], items: &[u32]) -> [(f32, f32); FEW] {
    let mut bounds = [(f32::INFINITY, f32::NEG_INFINITY); FEW];
    for &item in items {
        for (bound, &x) in bounds.iter_mut().zip(&leading[item as usize]) {
            *bound = (bound.0.min(x), bound.1.max(x));
        }
    }
    bounds
}

/// The lower and the upper half along the widest side.
fn halve<'a>(leading: &[[f32; FEW]], items: &'a mut [u32]) -> [&'a mut [u32]; 2] {
    if items.len() <= LEAF {
        return [items, &mut []];
    }
    let bounds = extent(leading, items);
    let side = |k: usize| bounds[k].1 - bounds[k].0;
    let widest = (1..FEW).fold(0, |w, k| if side(k) > side(w) { k } else { w });
    let middle = (items.len() / 2).next_multiple_of(WIDTH);
    items.select_nth_unstable_by(middle, |&a, &b| {
        let [x, y] = [a, b].map(|i| leading[i as usize][widest]);
        x.total_cmp(&y).then(a.cmp(&b))
    });
    items.split_at_mut(middle).into()
}

/// One search after the other, in the same room.
pub(super) struct Query<'a> {
    tree: &'a Tree,
    vector: Vec<f32>,
    stack: Vec<(f32, u32)>,
    /// By how much distances in `f32` may be off, beside what grows with them.
    error: f64,
    /// What is no farther may be nearest.
    reach: f32,
    best: (f64, u32),
    #[cfg(target_arch = "x86_64")]
    wide: bool,
}

impl<'a> Query<'a> {
    pub(super) fn new(tree: &'a Tree) -> Self {
        Self {
            tree,
            vector: vec![0.0; tree.width()],
            stack: Vec::with_capacity(128),
            error: 0.0,
            reach: 0.0,
            best: (f64::INFINITY, u32::MAX),
            #[cfg(target_arch = "x86_64")]
            wide: is_x86_feature_detected!("avx2"),
        }
    }

    /// The squared distance and the number of the vector nearest to a query, but for its `own`; `best` is one of them.
    #[inline(always)]
    fn find(
        &mut self,
        vectors: &[f64],
        query: &[f64],
        own: Option<u32>,
        best: (f64, u32),
    ) -> (f64, u32) {
        self.tree.shrink(query, &mut self.vector);
        let largest = self.vector.iter().fold(1.0f32, |m, x| m.max(x.abs()));
        // A difference is off by the rounding of its two numbers and its own.
        self.error = f64::from(largest) * (query.len() as f64).sqrt() * 2f64.powi(-21);
        self.take(best);
        self.stack.clear();
        self.stack.push((0.0, 0));
        while let Some((bound, at)) = self.stack.pop() {
            if bound > self.reach {
                continue;
            }
            if at & IS_LEAF != 0 {
                self.scan(at & !IS_LEAF, vectors, query, own);
                continue;
            }
            let node = &self.tree.nodes[at as usize];
            let bounds = node.bounds(self.vector.as_chunks().0);
            let floor = self.stack.len();
            for lane in 0..WIDTH {
                if bounds[lane] > self.reach || node.child[lane] == NONE {
                    continue;
                }
                // The nearest last, so that it comes next.
                let mut to = self.stack.len();
                self.stack.push((bounds[lane], node.child[lane]));
                while to > floor && self.stack[to - 1].0 < bounds[lane] {
                    self.stack.swap(to, to - 1);
                    to -= 1;
                }
            }
        }
        self.best
    }

    /// See [`Query::find`].
    pub(super) fn nearest(
        &mut self,
        vectors: &[f64],
        query: &[f64],
        own: Option<u32>,
        best: (f64, u32),
    ) -> (f64, u32) {
        #[cfg(target_arch = "x86_64")]
        if self.wide {
            // SAFETY: the processor has been asked.
            #[allow(unsafe_code)] // measured: a fifth to a third faster
            return unsafe { self.find_wide(vectors, query, own, best) };
        }
        self.find(vectors, query, own, best)
    }

    /// The same, with the instructions that take eight numbers at a time.
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn find_wide(
        &mut self,
        vectors: &[f64],
        query: &[f64],
        own: Option<u32>,
        best: (f64, u32),
    ) -> (f64, u32) {
        self.find(vectors, query, own, best)
    }

    #[inline(always)]
    fn take(&mut self, best: (f64, u32)) {
        self.best = best;
        let off = 1.0 + (self.vector.len() + FEW) as f64 * 2f64.powi(-22);
        let apart = best.0.sqrt() * self.tree.scale + self.error;
        self.reach = (apart * apart * off) as f32;
    }

    /// Compares a query with the vectors of a leaf.
    #[inline(always)]
    fn scan(&mut self, leaf: u32, vectors: &[f64], query: &[f64], own: Option<u32>) {
        let numbers = self.tree.numbers;
        let depth = self.vector.len() / FEW;
        let leaf = leaf as usize;
        for group in self.tree.leaves[leaf] as usize..self.tree.leaves[leaf + 1] as usize {
            let blocks = &self.tree.blocks[group * depth..][..depth];
            let mut sums = [0.0; WIDTH];
            let mut far = false;
            for (block, few) in blocks.iter().zip(self.vector.as_chunks::<FEW>().0) {
                add(block, few, &mut sums);
                far = sums.iter().all(|&sum| sum > self.reach);
                if far {
                    break;
                }
            }
            if far {
                continue;
            }
            for lane in 0..WIDTH {
                let other = self.tree.index[group * WIDTH + lane];
                if sums[lane] > self.reach || other == u32::MAX || Some(other) == own {
                    continue;
                }
                let vector = &vectors[other as usize * numbers..][..numbers];
                let found = (apart(query, vector), other);
                if found < self.best {
                    self.take(found);
                }
            }
        }
    }
}

/// Adds squared differences.
#[inline(always)]
fn add(block: &Block, few: &[f32; FEW], sums: &mut [f32; WIDTH]) {
    for (values, &x) in block.iter().zip(few) {
        for (sum, &value) in sums.iter_mut().zip(values) {
            *sum += (value - x) * (value - x);
        }
    }
}

impl Node {
    /// What any vector of each child is at least away by.
    #[inline(always)]
    fn bounds(&self, vector: &[[f32; FEW]]) -> [f32; WIDTH] {
        let mut sums = [0.0; WIDTH];
        for ((low, high), &x) in self.low.iter().zip(&self.high).zip(&vector[0]) {
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
