//! Which hole is filled next: from the rim inwards, so that what was pasted on all sides meets in the middle.
//!
//! In scan order the last patches of a hole would have to fit pixels that may not change; from the rim inwards they meet
//! other patches, which a cut may still take away from.

use crate::foundation::grid::Grid;

/// Pixels along a side of a block.
const BLOCK: usize = 32;
/// No hole.
const NONE: (u32, usize) = (u32::MAX, usize::MAX);

/// How much is unknown in each window of the canvas, and the holes that have most around them.
pub(super) struct Front {
    grid: Grid<2>,
    patch: [usize; 2],
    /// Unknown pixels of the window at each corner.
    unknown: Vec<u32>,
    /// Where the window centred on each row, and on each column, begins.
    centred: [Vec<usize>; 2],
    /// The hole of each block of the canvas that has the fewest unknown pixels in the window over it, the first of equals in
    /// scan order: (unknown pixels, hole). A step changes a few blocks, which are looked through anew.
    best: Vec<(u32, usize)>,
}

impl Front {
    pub(super) fn new(grid: Grid<2>, patch: [usize; 2], known: &[bool]) -> Self {
        let blocks = grid.shape().map(|n| n.div_ceil(BLOCK));
        let mut front = Self {
            grid,
            patch,
            unknown: vec![0; grid.len()],
            centred: std::array::from_fn(|axis| {
                let corner = |i| corner(&grid, patch, [i; 2], [0.5; 2])[axis];
                (0..grid.shape()[axis]).map(corner).collect()
            }),
            best: vec![NONE; blocks[0] * blocks[1]],
        };
        let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
        for at in (0..known.len()).filter(|&at| !known[at]) {
            let point = grid.point(at);
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        if low[0] <= high[0] {
            front.recount(low, high, known);
            let extent = std::array::from_fn(|axis| high[axis] + 1 - low[axis]);
            front.look(low, extent, known);
        }
        front
    }

    /// The hole that has most around it.
    pub(super) fn next(&self) -> Option<usize> {
        let best = self.best.iter().min()?;
        (*best != NONE).then_some(best.1)
    }

    /// Unknown pixels of the window at a corner.
    pub(super) fn unknown(&self, to: [usize; 2]) -> usize {
        self.unknown[self.grid.index(to)] as usize
    }

    /// Takes note that pixels of the window at `to` are no longer unknown.
    pub(super) fn filled(&mut self, to: [usize; 2], known: &[bool]) {
        let last = std::array::from_fn(|axis| to[axis] + self.patch[axis] - 1);
        self.recount(to, last, known);
        // Windows that reach into this one belong to holes at most a window away.
        let grid = self.grid;
        let before: [usize; 2] = std::array::from_fn(|axis| self.patch[axis]);
        let after = std::array::from_fn(|axis| to[axis] + 2 * self.patch[axis] - 1);
        let (start, extent) = around(&grid, to, after, before);
        self.look(start, extent, known);
    }

    /// The corner of a window that shows a hole at `share` of its sides, as far as the canvas allows.
    pub(super) fn corner(&self, hole: [usize; 2], share: [f64; 2]) -> [usize; 2] {
        corner(&self.grid, self.patch, hole, share)
    }

    /// Finds the best holes of the blocks of a rectangle anew.
    fn look(&mut self, start: [usize; 2], extent: [usize; 2], known: &[bool]) {
        let [height, width] = self.grid.shape();
        let across = width.div_ceil(BLOCK);
        let [rows, columns]: [Vec<usize>; 2] = std::array::from_fn(|axis| {
            let places = start[axis]..start[axis] + extent[axis];
            let mut blocks: Vec<usize> = places
                .map(|i| self.grid.resolve(axis, i as isize) / BLOCK)
                .collect();
            blocks.dedup();
            blocks
        });
        for &row in &rows {
            for &column in &columns {
                let mut best = NONE;
                let places = column * BLOCK..((column + 1) * BLOCK).min(width);
                for r in row * BLOCK..((row + 1) * BLOCK).min(height) {
                    let windows = &self.unknown[self.centred[0][r] * width..][..width];
                    for c in places.clone() {
                        let at = r * width + c;
                        if !known[at] {
                            best = best.min((windows[self.centred[1][c]], at));
                        }
                    }
                }
                self.best[row * across + column] = best;
            }
        }
    }

    /// Counts anew what is unknown in all windows that show a pixel of the rectangle from `low` to `high`.
    fn recount(&mut self, low: [usize; 2], high: [usize; 2], known: &[bool]) {
        let grid = self.grid;
        let [rows, columns] = self.patch;
        let (start, extent) = around(&grid, low, high, [rows - 1, columns - 1]);
        // Positions of the pixels that these windows show; none beyond the edges.
        let [lines, places]: [Vec<Option<usize>>; 2] = std::array::from_fn(|axis| {
            let end = start[axis] + extent[axis] + self.patch[axis] - 1;
            (start[axis]..end)
                .map(|i| grid.inside(axis, i as isize))
                .collect()
        });
        let width = grid.shape()[1];
        // Unknown pixels of each column within the windows of a row.
        let mut sums = vec![0u32; places.len()];
        let add = |sums: &mut [u32], line: Option<usize>, one: u32| {
            let Some(line) = line else { return };
            let known = &known[line * width..][..width];
            for (sum, place) in sums.iter_mut().zip(&places) {
                let unknown = place.is_some_and(|c| !known[c]);
                *sum = sum.wrapping_add(one * u32::from(unknown));
            }
        };
        for &line in &lines[..rows - 1] {
            add(&mut sums, line, 1);
        }
        for r in 0..extent[0] {
            add(&mut sums, lines[r + rows - 1], 1);
            let row = lines[r].map_or(0, |line| line * width);
            let mut window: u32 = sums[..columns - 1].iter().sum();
            for c in 0..extent[1] {
                window += sums[c + columns - 1];
                self.unknown[row + places[c].unwrap_or(0)] = window;
                window -= sums[c];
            }
            add(&mut sums, lines[r], u32::MAX);
        }
    }
}

/// The first position and the extent of what is in the rectangle from `low` to `high` or up to `before` before it, as far
/// as the grid has it.
fn around(
    grid: &Grid<2>,
    low: [usize; 2],
    high: [usize; 2],
    before: [usize; 2],
) -> ([usize; 2], [usize; 2]) {
    let (mut start, mut extent) = ([0; 2], [0; 2]);
    for axis in 0..2 {
        let n = grid.shape()[axis];
        if grid.wrap()[axis] {
            start[axis] = grid.resolve(axis, low[axis] as isize - before[axis] as isize);
            extent[axis] = (high[axis] + 1 - low[axis] + before[axis]).min(n);
        } else {
            start[axis] = low[axis].saturating_sub(before[axis]);
            extent[axis] = (high[axis] + 1).min(n) - start[axis];
        }
    }
    (start, extent)
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
