//! The energy of a cut, and its least: exactly, or among the cuts between blocks of a few points a side.
//!
//! Lombaert, Sun, Grady and Xu, *A multilevel banded graph cuts method for fast image segmentation*, ICCV 2005: large windows
//! are cut between blocks first, and then only points along that cut are free. They would take most of the time otherwise.

use super::cut::{MOST, Pair, Tie};
use crate::Result;
use crate::foundation::grid::Grid;
use crate::foundation::par::Monitor;
use crate::kernels::seam::links;
use crate::kernels::seam::maxflow::{Graph, Solver};

/// Capacities are costs times this.
const SCALE: f32 = 16384.0;

/// Costs of labels, source for what is kept and sink for what is taken, in whole numbers.
pub(super) struct Energy<const D: usize> {
    grid: Grid<D>,
    /// What it costs more to take than to keep.
    pub terminal: Vec<i32>,
    /// What it costs that a point keeps and the next one along the axis takes. All else is in the terminals.
    forward: [Vec<i32>; D],
}

impl<const D: usize> Energy<D> {
    pub(super) fn new(grid: Grid<D>) -> Self {
        let n = grid.len();
        Self {
            grid,
            terminal: vec![0; n],
            forward: std::array::from_fn(|_| vec![0; n]),
        }
    }

    /// Adds the costs of the pairs along an axis; those of points without a choice go to their neighbours.
    pub(super) fn add_pairs(&mut self, axis: usize, ties: &[Tie], pairs: &[Pair]) {
        let (terminal, forward) = (&mut self.terminal, &mut self.forward[axis]);
        links(&self.grid, axis, |p, q| {
            if pairs[p].old_new < 0.0 {
                return;
            }
            let (old_new, new_old) = (capacity(pairs[p].old_new), capacity(pairs[p].new_old));
            // A seam that was worse than this one on both sides will go; it counts as much as keeps the energy submodular.
            let kept = capacity(pairs[p].kept).min(old_new + new_old);
            match (ties[p], ties[q]) {
                (Tie::Either, Tie::Either) => {
                    terminal[p] += new_old - kept;
                    terminal[q] -= new_old;
                    forward[p] = old_new + new_old - kept;
                }
                (Tie::Old, Tie::Either) => terminal[q] += old_new - kept,
                (Tie::New, Tie::Either) => terminal[q] -= new_old,
                (Tie::Either, Tie::Old) => terminal[p] += new_old - kept,
                (Tie::Either, Tie::New) => terminal[p] -= old_new,
                _ => {}
            }
        });
    }

    /// Which points take the patch at the least cost, where all points of a block of a side take it or none.
    pub(super) fn minimise(
        &self,
        side: usize,
        solver: &mut Solver<D>,
        monitor: &Monitor,
    ) -> Result<Vec<bool>> {
        if side < 2 {
            return self.solve(solver, monitor);
        }
        let blocks = Grid::new(self.grid.shape().map(|n| n.div_ceil(side)), [false; D])?;
        let block: Vec<u32> = self
            .grid
            .points()
            .map(|point| blocks.index(point.map(|x| x / side)) as u32)
            .collect();
        let mut small = Self::new(blocks);
        for (&b, &t) in block.iter().zip(&self.terminal) {
            small.terminal[b as usize] += t;
        }
        for axis in 0..D {
            links(&self.grid, axis, |p, q| {
                if block[p] != block[q] {
                    small.forward[axis][block[p] as usize] += self.forward[axis][p];
                }
            });
        }
        let labels = small.solve(solver, monitor)?;
        Ok(block.iter().map(|b| labels[*b as usize]).collect())
    }

    fn solve(&self, solver: &mut Solver<D>, monitor: &Monitor) -> Result<Vec<bool>> {
        let backward = vec![0; self.grid.len()];
        let graph = Graph {
            grid: self.grid,
            terminal: &self.terminal,
            forward: std::array::from_fn(|axis| &self.forward[axis][..]),
            backward: [&backward[..]; D],
        };
        Ok(solver.min_cut(&graph, monitor)?.sink)
    }
}

/// A cost as a capacity, rounded to the nearest.
#[inline(always)]
pub(super) fn capacity(cost: f32) -> i32 {
    let scaled = cost.clamp(-MOST, MOST) * SCALE;
    (if scaled < 0.0 {
        scaled - 0.5
    } else {
        scaled + 0.5
    }) as i32
}
