//! Exact minimum cuts on grids whose neighbours share edges of any two directed capacities.
//!
//! Boykov and Kolmogorov, *An experimental comparison of min-cut/max-flow algorithms for energy minimization in vision*,
//! PAMI 2004: a tree of residual paths grows from the source, another one to the sink; where they touch, flow is pushed;
//! nodes that lose the arc to their parent look for another one in their tree, or are set free.
//!
//! 1. *sweep*: along every line of the grid, both ways, push what meets a need further along the line;
//! 2. *grow*: active nodes offer their residual arcs to free nodes and look for the other tree;
//! 3. *augment*: push the bottleneck of the path found; its saturated arcs leave orphans;
//! 4. *adopt*: orphans look for the neighbour with the shortest way to the root (marked as in Kolmogorov's thesis, Cornell
//!    2003, so that one augmentation walks each way once).
//!
//! Departures: the sweeps, which move most of the flow of a segmentation in a few passes over memory, for a third of the
//! time. They may strand flow that finds no need, which does no harm: a minimum cut needs no return of it to its source.
//! Children are found by looking at the neighbours, of which a grid has few, in place of lists.
//!
//! The answer is the set of points that can still reach the sink: the *least* set that a minimum cut can give it. It is the
//! same for every maximum flow, so it cannot depend on the order of the search. When nothing is active it is the sink's
//! tree, for a node outside of it with a residual arc into it would have been taken.

use std::collections::VecDeque;

use crate::grid::Grid;
use crate::par::Monitor;
use crate::{Error, Result};

/// A grid with capacities.
///
/// Labelling a point `sink` costs its terminal capacity where that is positive, labelling it `source` costs minus its
/// terminal capacity where that is negative. A neighbouring pair `p`, `p + axis` costs `forward[axis][p]` when `p` is
/// `source` and `p + axis` is `sink`, and `backward[axis][p]` the other way round. Where `p` has no next point the
/// entries are ignored.
#[derive(Debug, Clone, Copy)]
pub struct Graph<'a, const D: usize> {
    /// Shape, and which axes are cyclic.
    pub grid: Grid<D>,
    /// Capacity from the source (positive) or to the sink (negative).
    pub terminal: &'a [i32],
    /// Capacity from each point to the next one along each axis, at least 0.
    pub forward: [&'a [i32]; D],
    /// Capacity from the next point along each axis to each point, at least 0.
    pub backward: [&'a [i32]; D],
}

/// A minimum cut.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cut {
    /// Which points are on the side of the sink: of all minimum cuts, the least such set.
    pub sink: Vec<bool>,
    /// Capacity of the cut, equal to the maximum flow.
    pub value: i64,
}

/// The minimum cut of one graph. Keep a [`Solver`] for many.
pub fn min_cut<const D: usize>(graph: &Graph<'_, D>, monitor: &Monitor) -> Result<Cut> {
    Solver::default().min_cut(graph, monitor)
}

/// Parent of a node whose flow comes straight from (or goes straight to) its terminal.
const ROOT: u8 = 254;
/// Parent of a node that waits for adoption, and of free nodes.
const ORPHAN: u8 = 255;
/// Nodes grown between two looks at the monitor.
const BREATH: usize = 4096;
/// Lines that are swept together: enough to fill cache lines, few enough to stay in cache from one pass to the next.
const LINES: usize = 16;
/// Values of [`Node::ends`].
const ENDS: usize = 64;
/// Trees, as the types that a tree's functions take.
const SOURCE: usize = 0;
const SINK: usize = 1;

/// Which tree a node is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Tree {
    Free,
    Source,
    Sink,
}

impl Tree {
    const OF: [Self; 2] = [Self::Source, Self::Sink];
}

/// One point. Together, because every step needs all of it: 32 bytes in two dimensions, half a cache line.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
struct Node<const D: usize> {
    /// Residual capacity to the next (0) and the previous (1) point along each axis.
    residual: [[i32; 2]; D],
    /// Flow that it has (positive) or needs (negative).
    terminal: i32,
    /// Steps to the root when it was last counted; during a sweep the need further along the line.
    distance: i32,
    /// The augmentation at which they were counted.
    stamp: u32,
    /// `2 * axis + side`, or [`ROOT`], or [`ORPHAN`].
    parent: u8,
    tree: Tree,
    /// Whether it is in the queue.
    active: bool,
    /// At which ends of cyclic axes it lies: selects its row of neighbour offsets.
    ends: u8,
}

impl<const D: usize> Node<D> {
    const EMPTY: Self = Self {
        residual: [[0; 2]; D],
        terminal: 0,
        distance: 0,
        stamp: 0,
        parent: ORPHAN,
        tree: Tree::Free,
        active: false,
        ends: 0,
    };
}

/// A workspace for minimum cuts; cuts after the first one of a size allocate only their result.
#[derive(Debug)]
pub struct Solver<const D: usize> {
    nodes: Vec<Node<D>>,
    /// Offset of each neighbour, for each combination of ends.
    offsets: [[[i32; 2]; D]; ENDS],
    queue: VecDeque<u32>,
    orphans: VecDeque<u32>,
    /// Number of augmentations.
    time: u32,
    value: i64,
}

impl<const D: usize> Default for Solver<D> {
    fn default() -> Self {
        Self {
            nodes: Vec::new(),
            offsets: [[[0; 2]; D]; ENDS],
            queue: VecDeque::new(),
            orphans: VecDeque::new(),
            time: 0,
            value: 0,
        }
    }
}

impl<const D: usize> Solver<D> {
    /// The minimum cut of a graph.
    ///
    /// # Errors
    /// Arrays that do not fit the grid, negative capacities, a pair whose two capacities sum to more than `i32::MAX`, more
    /// than 2^31 points, or a monitor that was cancelled.
    pub fn min_cut(&mut self, graph: &Graph<'_, D>, monitor: &Monitor) -> Result<Cut> {
        monitor.check()?;
        let layout = Layout::new(graph.grid)?;
        self.build(graph, &layout)?;
        self.sweep(&layout);
        self.plant(&layout);
        if layout.cyclic.contains(&true) {
            self.grow::<true>(monitor)?;
        } else {
            self.grow::<false>(monitor)?;
        }
        let mut sink = Vec::with_capacity(graph.grid.len());
        layout.rows(|_, at, n| {
            let row = &self.nodes[at..at + n];
            sink.extend(row.iter().map(|node| node.tree == Tree::Sink));
        });
        Ok(Cut {
            sink,
            value: self.value,
        })
    }

    /// Copies the graph into nodes.
    fn build(&mut self, graph: &Graph<'_, D>, layout: &Layout<D>) -> Result<()> {
        let points = graph.grid.len();
        let arrays = graph.forward.iter().chain(&graph.backward);
        for got in arrays.map(|a| a.len()).chain([graph.terminal.len()]) {
            if got != points {
                return Err(Error::Shape {
                    argument: "capacities",
                    expected: vec![points],
                    got: vec![got],
                });
            }
        }
        self.offsets = layout.offsets();
        self.nodes.clear();
        self.nodes.resize(layout.len, Node::EMPTY);
        self.queue.clear();
        self.orphans.clear();
        self.time = 0;
        self.value = 0;
        let cyclic = layout.cyclic.contains(&true);
        let shape = graph.grid.shape();
        let mut bad = None;
        let nodes = &mut self.nodes[..];
        layout.rows(|from, at, n| {
            let point = graph.grid.point(from);
            for i in 0..n {
                let node = &mut nodes[at + i];
                node.terminal = graph.terminal[from + i];
                if cyclic {
                    node.ends = layout.ends(point, i);
                }
            }
            for (axis, &length) in shape.iter().enumerate() {
                let last = axis == D - 1;
                let steps = if last || graph.grid.next(point, axis).is_some() {
                    n
                } else {
                    0
                };
                for i in 0..steps {
                    let p = at + i;
                    let q = if !last || i + 1 < n {
                        let ends = usize::from(nodes[p].ends);
                        p.wrapping_add_signed(self.offsets[ends][axis][0] as isize)
                    } else if layout.cyclic[axis] && length > 1 {
                        at
                    } else {
                        continue;
                    };
                    let (f, b) = (
                        graph.forward[axis][from + i],
                        graph.backward[axis][from + i],
                    );
                    if f < 0 || b < 0 || f.checked_add(b).is_none() {
                        bad = Some((axis, from + i, f, b));
                        continue;
                    }
                    nodes[p].residual[axis][0] = f;
                    nodes[q].residual[axis][1] = b;
                }
            }
        });
        match bad {
            None => Ok(()),
            Some((axis, at, f, b)) => Err(Error::value(
                "capacities",
                format!(
                    "{f} and {b} along axis {axis} at {:?}; each must be at least 0 and their sum at most {}",
                    graph.grid.point(at),
                    i32::MAX
                ),
            )),
        }
    }

    /// Pushes flow along every line to needs further along it.
    fn sweep(&mut self, layout: &Layout<D>) {
        for axis in (0..D).rev() {
            let (stride, length) = (layout.strides[axis], layout.shape[axis]);
            let block = stride * (length + usize::from(!layout.cyclic[axis]));
            for from in (layout.first..layout.len).step_by(block) {
                for line in (0..stride).step_by(LINES) {
                    let lines = LINES.min(stride - line);
                    self.lines::<0>(from + line, lines, stride, length, axis);
                    self.lines::<1>(from + line, lines, stride, length, axis);
                }
            }
        }
    }

    /// Sweeps neighbouring lines towards their end (`SIDE` 0) or their start. Arcs around a cyclic axis are left out.
    fn lines<const SIDE: usize>(
        &mut self,
        from: usize,
        lines: usize,
        stride: usize,
        length: usize,
        axis: usize,
    ) {
        let nodes = &mut self.nodes[from..from + (length - 1) * stride + lines];
        // Rows of nodes, one of each line, in the order of the sweep.
        let row = |i: usize| (if SIDE == 0 { i } else { length - 1 - i }) * stride;
        for node in &mut nodes[row(length - 1)..][..lines] {
            node.distance = 0;
        }
        for i in (0..length - 1).rev() {
            let (p, q) = (row(i), row(i + 1));
            for k in 0..lines {
                let next = nodes[q + k];
                let need = next.distance.saturating_sub(next.terminal).max(0);
                nodes[p + k].distance = need.min(nodes[p + k].residual[axis][SIDE]);
            }
        }
        for i in 0..length - 1 {
            let (p, q) = (row(i), row(i + 1));
            for k in 0..lines {
                let node = &mut nodes[p + k];
                let flow = node.terminal.min(node.distance);
                if flow > 0 {
                    node.terminal -= flow;
                    node.residual[axis][SIDE] -= flow;
                    let next = &mut nodes[q + k];
                    self.value += i64::from((-next.terminal).clamp(0, flow));
                    next.terminal += flow;
                    next.residual[axis][SIDE ^ 1] += flow;
                }
            }
        }
    }

    /// Makes a root of each node that has or needs flow.
    fn plant(&mut self, layout: &Layout<D>) {
        layout.rows(|_, at, n| {
            for (p, node) in (at..).zip(&mut self.nodes[at..at + n]) {
                if node.terminal != 0 {
                    node.tree = Tree::OF[usize::from(node.terminal < 0)];
                    node.parent = ROOT;
                    node.distance = 1;
                    node.active = true;
                    self.queue.push_back(p as u32);
                }
            }
        });
    }

    #[inline(always)]
    fn node(&self, p: u32) -> &Node<D> {
        &self.nodes[p as usize]
    }

    #[inline(always)]
    fn node_mut(&mut self, p: u32) -> &mut Node<D> {
        &mut self.nodes[p as usize]
    }

    #[inline(always)]
    fn neighbour<const CYCLIC: bool>(&self, p: u32, axis: usize, side: usize) -> u32 {
        let ends = if CYCLIC { self.node(p).ends } else { 0 };
        p.wrapping_add_signed(self.offsets[usize::from(ends) % ENDS][axis][side])
    }

    /// Axis and side of the parent, and the parent, of a node that has one.
    #[inline(always)]
    fn up<const CYCLIC: bool>(&self, p: u32) -> (usize, usize, u32) {
        let parent = usize::from(self.node(p).parent);
        let (axis, side) = (parent >> 1, parent & 1);
        (axis, side, self.neighbour::<CYCLIC>(p, axis, side))
    }

    /// Residual capacity of the arc by which a tree takes `q` from `p`: towards `q` from the source, out of `q` towards the
    /// sink.
    #[inline(always)]
    fn arc<const TREE: usize>(&self, p: u32, q: u32, axis: usize, side: usize) -> i32 {
        if TREE == SOURCE {
            self.node(p).residual[axis][side]
        } else {
            self.node(q).residual[axis][side ^ 1]
        }
    }

    #[inline(always)]
    fn activate(&mut self, p: u32) {
        if !self.node(p).active {
            self.node_mut(p).active = true;
            self.queue.push_back(p);
        }
    }

    /// Lets both trees grow until nothing is active.
    fn grow<const CYCLIC: bool>(&mut self, monitor: &Monitor) -> Result<()> {
        let mut grown = 0usize;
        while let Some(p) = self.queue.pop_front() {
            if grown.is_multiple_of(BREATH) {
                monitor.check()?;
            }
            grown += 1;
            self.node_mut(p).active = false;
            match self.node(p).tree {
                Tree::Source => self.scan::<SOURCE, CYCLIC>(p, monitor)?,
                Tree::Sink => self.scan::<SINK, CYCLIC>(p, monitor)?,
                Tree::Free => {}
            }
        }
        Ok(())
    }

    /// Offers the arcs of an active node.
    #[inline(always)]
    fn scan<const TREE: usize, const CYCLIC: bool>(
        &mut self,
        p: u32,
        monitor: &Monitor,
    ) -> Result<()> {
        let tree = Tree::OF[TREE];
        for axis in 0..D {
            for side in 0..2 {
                let q = self.neighbour::<CYCLIC>(p, axis, side);
                // The same arc again after an augmentation: the neighbour may have been set free, or have stayed.
                while self.arc::<TREE>(p, q, axis, side) > 0 {
                    let (stamp, distance) = (self.node(p).stamp, self.node(p).distance + 1);
                    let node = self.node_mut(q);
                    let free = node.tree == Tree::Free;
                    if free || node.tree == tree {
                        // A node that was counted no later and is farther from the root is better off here.
                        if free || node.stamp <= stamp && node.distance > distance {
                            node.tree = tree;
                            node.parent = (2 * axis + (side ^ 1)) as u8;
                            node.stamp = stamp;
                            node.distance = distance;
                        }
                        if free {
                            self.activate(q);
                        }
                        break;
                    }
                    if TREE == SOURCE {
                        self.augment::<CYCLIC>(p, q, axis, side);
                    } else {
                        self.augment::<CYCLIC>(q, p, axis, side ^ 1);
                    }
                    if self.time.is_multiple_of(BREATH as u32) {
                        monitor.check()?;
                    }
                    if self.node(p).tree != tree {
                        return Ok(());
                    }
                }
            }
        }
        Ok(())
    }

    /// Pushes all that fits along the path that the arc from `p` (in the source's tree) to `q` (in the sink's) closes.
    fn augment<const CYCLIC: bool>(&mut self, p: u32, q: u32, axis: usize, side: usize) {
        let mut flow = self.node(p).residual[axis][side];
        flow = self.bottleneck::<SOURCE, CYCLIC>(p, flow);
        flow = self.bottleneck::<SINK, CYCLIC>(q, flow);
        self.value += i64::from(flow);
        self.node_mut(p).residual[axis][side] -= flow;
        self.node_mut(q).residual[axis][side ^ 1] += flow;
        self.push::<SOURCE, CYCLIC>(p, flow);
        self.push::<SINK, CYCLIC>(q, flow);
        self.time += 1;
        while let Some(orphan) = self.orphans.pop_front() {
            if self.node(orphan).tree == Tree::Source {
                self.adopt::<SOURCE, CYCLIC>(orphan);
            } else {
                self.adopt::<SINK, CYCLIC>(orphan);
            }
        }
    }

    /// The least residual capacity between a node and the root of its tree, and that of the root, if less than `flow`.
    #[inline(always)]
    fn bottleneck<const TREE: usize, const CYCLIC: bool>(&self, mut p: u32, mut flow: i32) -> i32 {
        while self.node(p).parent != ROOT {
            let (axis, side, up) = self.up::<CYCLIC>(p);
            flow = flow.min(self.arc::<TREE>(up, p, axis, side ^ 1));
            p = up;
        }
        flow.min(self.node(p).terminal.abs())
    }

    /// Moves `flow` along the path between a node and the root of its tree. Those that lose their parent become orphans.
    #[inline(always)]
    fn push<const TREE: usize, const CYCLIC: bool>(&mut self, mut p: u32, flow: i32) {
        while self.node(p).parent != ROOT {
            let (axis, side, up) = self.up::<CYCLIC>(p);
            // Flow runs from parent to child in the source's tree, from child to parent in the sink's.
            let (tail, head, side) = if TREE == SOURCE {
                (up, p, side ^ 1)
            } else {
                (p, up, side)
            };
            self.node_mut(head).residual[axis][side ^ 1] += flow;
            let arc = &mut self.node_mut(tail).residual[axis][side];
            *arc -= flow;
            if *arc == 0 {
                self.node_mut(p).parent = ORPHAN;
                self.orphans.push_front(p);
            }
            p = up;
        }
        let root = self.node_mut(p);
        root.terminal -= (1 - 2 * TREE as i32) * flow;
        if root.terminal == 0 {
            root.parent = ORPHAN;
            self.orphans.push_front(p);
        }
    }

    /// Finds an orphan the parent with the shortest way to a root, or sets it free and orphans its children.
    fn adopt<const TREE: usize, const CYCLIC: bool>(&mut self, p: u32) {
        let tree = Tree::OF[TREE];
        let (mut best, mut parent) = (i32::MAX, ORPHAN);
        for axis in 0..D {
            for side in 0..2 {
                let q = self.neighbour::<CYCLIC>(p, axis, side);
                if self.node(q).tree == tree
                    && self.arc::<TREE>(q, p, axis, side ^ 1) > 0
                    && let Some(distance) = self.count::<CYCLIC>(q)
                    && distance < best
                {
                    best = distance;
                    parent = (2 * axis + side) as u8;
                }
            }
        }
        let time = self.time;
        let node = self.node_mut(p);
        node.parent = parent;
        if parent != ORPHAN {
            node.stamp = time;
            node.distance = best + 1;
            return;
        }
        node.tree = Tree::Free;
        node.stamp = 0;
        for axis in 0..D {
            for side in 0..2 {
                let q = self.neighbour::<CYCLIC>(p, axis, side);
                if self.node(q).tree != tree {
                    continue;
                }
                if self.arc::<TREE>(q, p, axis, side ^ 1) > 0 {
                    self.activate(q);
                }
                let node = self.node_mut(q);
                if usize::from(node.parent) == 2 * axis + (side ^ 1) {
                    node.parent = ORPHAN;
                    self.orphans.push_back(q);
                }
            }
        }
    }

    /// Steps from a node to the root of its tree, unless an orphan is in the way. Marks what it counts.
    #[inline(always)]
    fn count<const CYCLIC: bool>(&mut self, q: u32) -> Option<i32> {
        let time = self.time;
        let (mut distance, mut p) = (0, q);
        loop {
            let node = self.node_mut(p);
            if node.stamp == time {
                distance += node.distance;
                break;
            }
            distance += 1;
            if node.parent == ROOT {
                node.stamp = time;
                node.distance = 1;
                break;
            }
            if node.parent == ORPHAN {
                return None;
            }
            p = self.up::<CYCLIC>(p).2;
        }
        let (mut left, mut p) = (distance, q);
        while self.node(p).stamp != time {
            let node = self.node_mut(p);
            node.stamp = time;
            node.distance = left;
            left -= 1;
            p = self.up::<CYCLIC>(p).2;
        }
        Some(distance)
    }
}

/// Where points lie in memory: an axis that does not wrap is followed by one empty place, so that every neighbour exists.
struct Layout<const D: usize> {
    shape: [usize; D],
    cyclic: [bool; D],
    strides: [usize; D],
    first: usize,
    len: usize,
}

impl<const D: usize> Layout<D> {
    fn new(grid: Grid<D>) -> Result<Self> {
        let (shape, cyclic) = (grid.shape(), grid.wrap());
        let mut strides = [1usize; D];
        let mut len = 1usize;
        let mut first = 0;
        for axis in (0..D).rev() {
            strides[axis] = len;
            if !cyclic[axis] {
                first = first.max(len);
            }
            len = len.saturating_mul(shape[axis] + usize::from(!cyclic[axis]));
        }
        let len = len.saturating_add(first);
        if len > i32::MAX as usize {
            return Err(Error::Limit {
                what: format!("a cut on a grid of shape {shape:?}"),
                needed: format!("{len} nodes"),
                limit: format!("{} nodes", i32::MAX),
            });
        }
        Ok(Self {
            shape,
            cyclic,
            strides,
            first,
            len,
        })
    }

    /// Calls `f(index of the row's first point, its node, length)` for each row along the last axis.
    fn rows(&self, mut f: impl FnMut(usize, usize, usize)) {
        let n = self.shape[D - 1];
        let rows: usize = self.shape[..D - 1].iter().product();
        for row in 0..rows {
            let mut rest = row;
            let mut node = self.first;
            for axis in (0..D - 1).rev() {
                node += rest % self.shape[axis] * self.strides[axis];
                rest /= self.shape[axis];
            }
            f(row * n, node, n);
        }
    }

    /// Bits `2 * axis` and `2 * axis + 1`: at the start, at the end of a cyclic axis.
    fn ends(&self, mut point: [usize; D], i: usize) -> u8 {
        point[D - 1] = i;
        let mut bits = 0;
        for (axis, &p) in point.iter().enumerate() {
            if self.cyclic[axis] {
                bits |= u8::from(p == 0) << (2 * axis);
                bits |= u8::from(p + 1 == self.shape[axis]) << (2 * axis + 1);
            }
        }
        bits
    }

    /// Offsets of the next and the previous point along each axis, for each value of [`Self::ends`].
    fn offsets(&self) -> [[[i32; 2]; D]; ENDS] {
        std::array::from_fn(|bits| {
            std::array::from_fn(|axis| {
                let step = self.strides[axis] as i32;
                let around = step * (self.shape[axis] as i32 - 1);
                [
                    if bits >> (2 * axis + 1) & 1 == 1 {
                        -around
                    } else {
                        step
                    },
                    if bits >> (2 * axis) & 1 == 1 {
                        around
                    } else {
                        -step
                    },
                ]
            })
        })
    }
}

#[cfg(test)]
#[path = "maxflow_tests.rs"]
pub(super) mod tests;
