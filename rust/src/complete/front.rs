//! Which hole is filled next: from the rim inwards, so that what was pasted on all sides meets in the middle.
//!
//! In scan order the last patches of a hole would have to fit pixels that may not change; from the rim inwards they meet
//! other patches, which a cut may still take away from.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::window::for_each;
use crate::grid::Grid;

/// How much is unknown in each window of the canvas, and its holes in order.
pub(super) struct Front {
    grid: Grid<2>,
    patch: [usize; 2],
    /// Unknown pixels of the window at each corner.
    unknown: Vec<u32>,
    /// Unknown pixels of the window over each hole when it was last queued.
    queued: Vec<u32>,
    /// Holes with few unknown pixels around them first, then in scan order.
    queue: BinaryHeap<Reverse<(u32, usize)>>,
}

impl Front {
    pub(super) fn new(grid: Grid<2>, patch: [usize; 2], known: &[bool]) -> Self {
        let mut front = Self {
            grid,
            patch,
            unknown: vec![0; grid.len()],
            queued: vec![u32::MAX; grid.len()],
            queue: BinaryHeap::new(),
        };
        let holes = || (0..known.len()).filter(|&at| !known[at]);
        for at in holes() {
            front.count(at, 1);
        }
        for at in holes() {
            front.enqueue(at);
        }
        front
    }

    /// The hole that has most around it.
    pub(super) fn next(&mut self, known: &[bool]) -> Option<usize> {
        while let Some(Reverse((unknown, at))) = self.queue.pop() {
            if !known[at] && self.queued[at] == unknown {
                // Should the window not reach it, it has to be asked for again.
                self.queued[at] = u32::MAX;
                return Some(at);
            }
        }
        None
    }

    /// Unknown pixels of the window at a corner.
    pub(super) fn unknown(&self, to: [usize; 2]) -> usize {
        self.unknown[self.grid.index(to)] as usize
    }

    /// Takes note of pixels of the window at `to` that are no longer unknown.
    pub(super) fn filled(&mut self, to: [usize; 2], pixels: &[usize], known: &[bool]) {
        for &at in pixels {
            self.count(at, -1);
        }
        // Windows that reach into this one belong to holes at most a window away.
        let grid = self.grid;
        let shape = grid.shape();
        let mut start = [0; 2];
        let mut extent = [0; 2];
        for axis in 0..2 {
            let (low, high) = (
                to[axis] as isize - self.patch[axis] as isize,
                (to[axis] + 2 * self.patch[axis]) as isize,
            );
            (start[axis], extent[axis]) = if !grid.wrap()[axis] {
                let low = low.max(0) as usize;
                (low, (high as usize).min(shape[axis]) - low)
            } else {
                (
                    grid.resolve(axis, low),
                    (3 * self.patch[axis]).min(shape[axis]),
                )
            };
        }
        for_each(&grid, start, extent, |_, at| {
            if !known[at] {
                self.enqueue(at);
            }
        });
    }

    /// The corner of a window that shows a hole at `share` of its sides, as far as the canvas allows.
    pub(super) fn corner(&self, hole: [usize; 2], share: [f64; 2]) -> [usize; 2] {
        corner(&self.grid, self.patch, hole, share)
    }

    fn enqueue(&mut self, at: usize) {
        let unknown = self.unknown(self.corner(self.grid.point(at), [0.5; 2])) as u32;
        if self.queued[at] != unknown {
            self.queued[at] = unknown;
            self.queue.push(Reverse((unknown, at)));
        }
    }

    /// Adds to the counts of all windows that show a pixel.
    fn count(&mut self, at: usize, add: i32) {
        let [row, column] = self.grid.point(at);
        let [rows, columns] = self.patch;
        let width = self.grid.shape()[1];
        let first = (column + 1) as isize - columns as isize;
        for r in 0..rows {
            let Some(r) = self.grid.inside(0, row as isize - r as isize) else {
                break;
            };
            let line = &mut self.unknown[r * width..][..width];
            let mut bump = |range: std::ops::Range<usize>| {
                for n in &mut line[range] {
                    *n = n.wrapping_add_signed(add);
                }
            };
            bump(first.max(0) as usize..column + 1);
            if first < 0 && self.grid.wrap()[1] {
                bump((width as isize + first) as usize..width);
            }
        }
    }
}

/// The corner of a window that shows a point at `share` of its sides, as far as the canvas allows.
pub(super) fn corner(
    grid: &Grid<2>,
    patch: [usize; 2],
    point: [usize; 2],
    share: [f64; 2],
) -> [usize; 2] {
    std::array::from_fn(|axis| {
        let back = (share[axis] * (patch[axis] - 1) as f64).round() as isize;
        let start = point[axis] as isize - back;
        if grid.wrap()[axis] {
            grid.resolve(axis, start)
        } else {
            start.clamp(0, (grid.shape()[axis] - patch[axis]) as isize) as usize
        }
    })
}
