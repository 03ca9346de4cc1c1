//! The energy of a cut, and its least: exactly, or coarse first and then in a band along the coarse cut.
//!
//! Lombaert, Sun, Grady and Xu, *A multilevel banded graph cuts method for fast image segmentation*, ICCV 2005: blocks of
//! two points a side take one label each, which is the same energy under fewer labellings; then only points in blocks
//! along the border of the labels are free. Large windows would take most of the time otherwise.

use super::cut::{MOST, Pair, Tie};
use crate::Result;
use crate::foundation::grid::Grid;
use crate::foundation::par::Monitor;
use crate::kernels::seam::links;
use crate::kernels::seam::maxflow::{Graph, Solver};

/// Capacities are costs times this.
const SCALE: f32 = 16384.0;
/// Windows of more points are cut coarsely first.
const LARGE: usize = 4096;

/// Costs of labels, source for what is kept and sink for what is taken, in whole numbers.
pub(super) struct Energy<const D: usize> {
    grid: Grid<D>,
    /// What it costs more to take than to keep.
    pub terminal: Vec<i32>,
    /// What it costs that a point keeps and the next one along the axis takes. All else is in the terminals.
    forward: [Vec<i32>; D],
}

impl<const D: usize> Energy<D> {
    pub fn new(grid: Grid<D>) -> Self {
        let n = grid.len();
        Self { grid, terminal: vec![0; n], forward: std::array::from_fn(|_| vec![0; n]) }
    }

    /// Adds the costs of the pairs along an axis; those of points without a choice go to their neighbours.
    pub fn add_pairs(&mut self, axis: usize, ties: &[Tie], pairs: &[Pair]) {
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

    /// Which points take the patch at the least cost; a coarse answer is that of blocks alone.
    pub fn minimise(mut self, coarse: bool, monitor: &Monitor) -> Result<Vec<bool>> {
        if self.grid.len() <= LARGE {
            return self.solve(monitor);
        }
        let blocks = self.grid.shape().map(|n| n.div_ceil(2));
        let blocks = Grid::new(blocks, [false; D])?;
        let block: Vec<u32> =
            (0..self.grid.len()).map(|i| blocks.index(self.grid.point(i).map(|x| x / 2)) as u32).collect();
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
        let labels = small.solve(monitor)?;
        let spread = |b: &u32| labels[*b as usize];
        if coarse {
            return Ok(block.iter().map(spread).collect());
        }
        let band = border(&blocks, &labels);
        self.fix(&block, &labels, &band);
        let fine = self.solve(monitor)?;
        let chosen = |(b, &f): (&u32, &bool)| if band[*b as usize] { f } else { spread(b) };
        Ok(block.iter().zip(&fine).map(chosen).collect())
    }

    /// Gives points out of a band the labels of their blocks.
    fn fix(&mut self, block: &[u32], labels: &[bool], band: &[bool]) {
        let free = |p: usize| band[block[p] as usize];
        for axis in 0..D {
            let (terminal, forward) = (&mut self.terminal, &mut self.forward[axis]);
            links(&self.grid, axis, |p, q| {
                let cost = std::mem::take(&mut forward[p]);
                match (free(p), free(q)) {
                    (true, true) => forward[p] = cost,
                    (true, false) if labels[block[q] as usize] => terminal[p] -= cost,
                    (false, true) if !labels[block[p] as usize] => terminal[q] += cost,
                    _ => {}
                }
            });
        }
        for (p, terminal) in self.terminal.iter_mut().enumerate() {
            if !free(p) {
                *terminal = 0;
            }
        }
    }

    fn solve(&self, monitor: &Monitor) -> Result<Vec<bool>> {
        let backward = vec![0; self.grid.len()];
        let graph = Graph {
            grid: self.grid,
            terminal: &self.terminal,
            forward: std::array::from_fn(|axis| &self.forward[axis][..]),
            backward: [&backward[..]; D],
        };
        Ok(Solver::default().min_cut(&graph, monitor)?.sink)
    }
}

/// The blocks whose neighbours have another label.
fn border<const D: usize>(blocks: &Grid<D>, labels: &[bool]) -> Vec<bool> {
    let mut band = vec![false; labels.len()];
    for axis in 0..D {
        links(blocks, axis, |p, q| {
            if labels[p] != labels[q] {
                band[p] = true;
                band[q] = true;
            }
        });
    }
    band
}

/// A cost as a capacity, rounded to the nearest.
#[inline(always)]
pub(super) fn capacity(cost: f32) -> i32 {
    let scaled = cost.clamp(-MOST, MOST) * SCALE;
    (if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 }) as i32
}
