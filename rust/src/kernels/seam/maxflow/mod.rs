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

mod layout;
mod sweep;
mod trees;

use std::collections::VecDeque;

use crate::foundation::error::check_shape;
use crate::foundation::grid::Grid;
use crate::foundation::par::Monitor;
use crate::{Error, Result};
use layout::Layout;

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
#[repr(align(8))]
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
        let cut = self.min_cut_within(graph, i64::MAX, monitor)?;
        Ok(cut.unwrap_or_else(|| unreachable!("no flow is larger")))
    }

    /// The minimum cut of a graph, if its capacity is at most `most`: where it is more, that is seen as soon as so much flows.
    pub(crate) fn min_cut_within(
        &mut self,
        graph: &Graph<'_, D>,
        most: i64,
        monitor: &Monitor,
    ) -> Result<Option<Cut>> {
        monitor.check()?;
        let layout = Layout::new(graph.grid)?;
        self.build(graph, &layout)?;
        self.sweep(&layout);
        self.plant(&layout);
        let within = if layout.cyclic.contains(&true) {
            self.grow::<true>(most, monitor)?
        } else {
            self.grow::<false>(most, monitor)?
        };
        if !within {
            return Ok(None);
        }
        let mut sink = Vec::with_capacity(graph.grid.len());
        layout.rows(|_, at, n| {
            let row = &self.nodes[at..at + n];
            sink.extend(row.iter().map(|node| node.tree == Tree::Sink));
        });
        Ok(Some(Cut {
            sink,
            value: self.value,
        }))
    }

    /// Copies the graph into nodes.
    fn build(&mut self, graph: &Graph<'_, D>, layout: &Layout<D>) -> Result<()> {
        let points = graph.grid.len();
        let arrays = graph.forward.iter().chain(&graph.backward);
        for got in arrays.map(|a| a.len()).chain([graph.terminal.len()]) {
            check_shape("capacities", &[points], got)?;
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
}

#[cfg(test)]
pub(super) mod tests;
