//! The energy of a cut, and its minimum: exact, or among the cuts between blocks of points.
//!
//! The method is by Lombaert, Sun, Grady and Xu, *A multilevel banded graph cuts method for fast image segmentation*,
//! ICCV 2005. Large windows are first cut between blocks, and then only points along that cut are free. Otherwise
//! these windows would take most of the time.

use super::pair::{Capacities, capacity};
use super::runs::Run;
use super::view::Tie;
use crate::Result;
use crate::foundation::grid::Grid;
use crate::foundation::par::Monitor;
use crate::kernels::seam::maxflow::{Graph, Solver};

/// Integer costs of the labels of blocks: source if the points are kept, sink if they take the patch.
pub(super) struct Energy<const D: usize> {
    grid: Grid<D>,
    blocks: Grid<D>,
    side: usize,
    /// The block of each point along the last axis.
    columns: Vec<u32>,
    /// Cost of taking a block minus the cost of keeping it.
    terminal: Vec<i32>,
    /// Cost if a block is kept and the next block along the axis is taken.
    forward: [Vec<i32>; D],
    /// Cost if a block is taken and the next block is kept. It could be included in the terminals, but would then have
    /// to flow from block to block. The cut would be the same and take twice the time.
    backward: [Vec<i32>; D],
}

impl<const D: usize> Energy<D> {
    /// Returns an energy without costs. All free points of a block get the same label.
    pub(super) fn new(grid: Grid<D>, side: usize) -> Result<Self> {
        let mut this = Self {
            grid,
            blocks: grid,
            side,
            columns: Vec::new(),
            terminal: Vec::new(),
            forward: std::array::from_fn(|_| Vec::new()),
            backward: std::array::from_fn(|_| Vec::new()),
        };
        this.clear(grid, side)?;
        Ok(this)
    }

    /// Resets the energy for another grid and keeps its buffers.
    pub(super) fn clear(&mut self, grid: Grid<D>, side: usize) -> Result<()> {
        self.grid = grid;
        self.side = side;
        self.blocks = Grid::new(grid.shape().map(|n| n.div_ceil(side)), [false; D])?;
        self.columns.clear();
        self.columns
            .extend((0..grid.shape()[D - 1]).map(|x| (x / side) as u32));
        let n = self.blocks.len();
        let pairs = self.forward.iter_mut().chain(&mut self.backward);
        for plane in pairs.chain([&mut self.terminal]) {
            plane.clear();
            plane.resize(n, 0);
        }
        Ok(())
    }

    /// Returns the side of a block.
    pub(super) fn side(&self) -> usize {
        self.side
    }

    /// Returns the first block of a point's row, and the column of the point.
    #[inline(always)]
    fn row(&self, p: usize) -> (usize, usize) {
        let mut point = self.grid.point(p);
        let column = std::mem::take(&mut point[D - 1]);
        (self.blocks.index(point.map(|x| x / self.side)), column)
    }

    /// Adds the difference between the costs of taking and keeping a point.
    pub(super) fn add_point(&mut self, p: usize, cost: i32) {
        let (row, column) = self.row(p);
        add(
            &mut self.terminal[row + self.columns[column] as usize],
            cost,
        );
    }

    /// Returns the part of a run from its first to its last open pair: a pair of points that can get different labels.
    pub(super) fn open(&self, ties: &[Tie], run: &Run) -> Option<Run> {
        // Along the last axis, blocks change within a run.
        let apart = run.axis + 1 == D || self.row(run.p).0 != self.row(run.q).0;
        let (l, r) = (&ties[run.p..][..run.n], &ties[run.q..][..run.n]);
        let open = |(&a, &b): (&Tie, &Tie)| match (a, b) {
            (Tie::Either, Tie::Either) => apart,
            (Tie::Out, _) | (_, Tie::Out) => false,
            _ => a != b,
        };
        let first = l.iter().zip(r).position(open)?;
        let last = l.iter().zip(r).rposition(open)?;
        Some(Run {
            p: run.p + first,
            q: run.q + first,
            n: last + 1 - first,
            ..*run
        })
    }

    /// Adds the costs of a run of pairs. If one point has no choice, the costs belong to the other point.
    pub(super) fn add_pairs(&mut self, ties: &[Tie], run: &Run, costs: &Capacities) {
        let ((p_row, p_column), (q_row, q_column)) = (self.row(run.p), self.row(run.q));
        let terminal = &mut self.terminal[..];
        let (forward, backward) = (&mut self.forward[run.axis], &mut self.backward[run.axis]);
        for k in 0..run.n {
            let p = p_row + self.columns[p_column + k] as usize;
            let q = q_row + self.columns[q_column + k] as usize;
            let (old_new, new_old) = (costs.old_new[k], costs.new_old[k]);
            // If the old seam costs more than both new seams together, it is replaced anyway. Its cost is limited to
            // keep the energy submodular.
            let kept = costs.kept[k].min(old_new + new_old);
            match (ties[run.p + k], ties[run.q + k]) {
                // A seam inside a block is replaced with the block; see `add_seams`.
                (Tie::Either, Tie::Either) if p != q => {
                    // Subtract half of the cost of the old seam from each direction, or less from a direction that
                    // costs less than this.
                    let both = old_new + new_old - kept;
                    let ahead = (old_new - kept / 2).clamp(0, both);
                    let back = both - ahead;
                    add(&mut terminal[p], new_old - kept - back);
                    add(&mut terminal[q], old_new - kept - ahead);
                    add(&mut forward[p], ahead);
                    add(&mut backward[p], back);
                }
                (Tie::Old, Tie::Either) => add(&mut terminal[q], old_new - kept),
                (Tie::New, Tie::Either) => add(&mut terminal[q], -new_old),
                (Tie::Either, Tie::Old) => add(&mut terminal[p], new_old - kept),
                (Tie::Either, Tie::New) => add(&mut terminal[p], -old_new),
                _ => {}
            }
        }
    }

    /// Adds the seams of a run that are inside blocks. They disappear if the block takes the patch.
    pub(super) fn add_seams(&mut self, ties: &[Tie], run: &Run, seams: &[f32]) {
        let ((p_row, p_column), (q_row, q_column)) = (self.row(run.p), self.row(run.q));
        for (k, &seam) in seams.iter().enumerate().filter(|(_, s)| **s > 0.0) {
            let p = p_row + self.columns[p_column + k] as usize;
            let q = q_row + self.columns[q_column + k] as usize;
            let both = (ties[run.p + k], ties[run.q + k]) == (Tie::Either, Tie::Either);
            if both && p == q {
                add(&mut self.terminal[p], -capacity(seam));
            }
        }
    }

    /// Returns which points take the patch at minimum cost.
    pub(super) fn minimise(
        &self,
        ties: &[Tie],
        solver: &mut Solver<D>,
        monitor: &Monitor,
    ) -> Result<Vec<bool>> {
        let graph = Graph {
            grid: self.blocks,
            terminal: &self.terminal,
            forward: std::array::from_fn(|axis| &self.forward[axis][..]),
            backward: std::array::from_fn(|axis| &self.backward[axis][..]),
        };
        let sink = solver.min_cut(&graph, monitor)?.sink;
        let mut take = Vec::with_capacity(ties.len());
        for p in (0..ties.len()).step_by(self.columns.len()) {
            let row = self.row(p).0;
            take.extend(
                ties[p..].iter().zip(&self.columns).map(|(&tie, &x)| {
                    tie == Tie::New || tie == Tie::Either && sink[row + x as usize]
                }),
            );
        }
        Ok(take)
    }
}

/// Adds costs and saturates at 32 bits.
#[inline(always)]
fn add(sum: &mut i32, cost: i32) {
    *sum = sum.saturating_add(cost);
}
