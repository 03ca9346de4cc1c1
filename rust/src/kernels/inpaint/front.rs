//! The order of filling holes: from the rim inwards, so that patches from all sides meet in the
//! middle.
//!
//! In scan order, the last patches of a hole would have to fit pixels that may not change. In the order from the rim
//! inwards, patches meet other patches, and a cut may still replace parts of the earlier patches.

use crate::foundation::grid::Grid;

/// Side of a block of the canvas, in pixels.
const BLOCK: usize = 32;
/// Entry of a block without unknown pixels.
const NONE: (u32, usize) = (u32::MAX, usize::MAX);

/// Number of unknown pixels in each window of the canvas, and the unknown pixels with the most known pixels around
/// them.
pub(super) struct Front {
    grid: Grid<2>,
    patch: [usize; 2],
    /// Number of unknown pixels in the window whose top-left corner is at each pixel.
    unknown: Vec<u32>,
    /// First row, or column, of the window that is centred on each row, or column.
    centred: [Vec<usize>; 2],
    /// Best unknown pixel of each block of the canvas, as (number of unknown pixels in the window centred on it,
    /// index). The best pixel has the smallest number. Ties go to the first pixel in scan order. A step changes only a
    /// few blocks, which are then searched again.
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
        // Count only windows around the bounding box of the holes.
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

    /// Returns the unknown pixel with the most known pixels around it.
    pub(super) fn next(&self) -> Option<usize> {
        let best = self.best.iter().min()?;
        (*best != NONE).then_some(best.1)
    }

    /// Number of unknown pixels in the window with this top-left corner.
    pub(super) fn unknown(&self, to: [usize; 2]) -> usize {
        self.unknown[self.grid.index(to)] as usize
    }

    /// Updates the counts after pixels of the window at `to` have become known.
    pub(super) fn filled(&mut self, to: [usize; 2], known: &[bool]) {
        let last = std::array::from_fn(|axis| to[axis] + self.patch[axis] - 1);
        self.recount(to, last, known);
        // The best pixels can change up to one window away, because windows centred there overlap this window.
        let grid = self.grid;
        let before: [usize; 2] = std::array::from_fn(|axis| self.patch[axis]);
        let after = std::array::from_fn(|axis| to[axis] + 2 * self.patch[axis] - 1);
        let (start, extent) = around(&grid, to, after, before);
        self.look(start, extent, known);
    }

    /// Returns the corner of a window that contains the pixel `hole` at the fraction `share` of its sides, clamped to
    /// the canvas.
    pub(super) fn corner(&self, hole: [usize; 2], share: [f64; 2]) -> [usize; 2] {
        corner(&self.grid, self.patch, hole, share)
    }

    /// Updates the best unknown pixels of the blocks in a rectangle.
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

    /// Counts the unknown pixels again, in all windows that contain a pixel of the rectangle from
    /// `low` to `high`.
    fn recount(&mut self, low: [usize; 2], high: [usize; 2], known: &[bool]) {
        let grid = self.grid;
        let [rows, columns] = self.patch;
        let (start, extent) = around(&grid, low, high, [rows - 1, columns - 1]);
        // Positions of the pixels in these windows, or `None` beyond the edges.
        let [lines, places]: [Vec<Option<usize>>; 2] = std::array::from_fn(|axis| {
            let end = start[axis] + extent[axis] + self.patch[axis] - 1;
            (start[axis]..end)
                .map(|i| grid.inside(axis, i as isize))
                .collect()
        });
        let width = grid.shape()[1];
        // Number of unknown pixels in each column, within the rows of the current window.
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
        // Slide the window: add the row that enters, sum along the row, and subtract the row that
        // leaves.
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

/// Returns the first position and the extent of a rectangle from `low` to `high`, extended
/// backwards by `before` and clipped to the grid.
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

/// Returns the corner of a window that contains a point at the fraction `share` of its sides,
/// clamped to the canvas.
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
