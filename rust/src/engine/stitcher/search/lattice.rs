//! The lattice of templates: samples of an exemplar, or means of blocks of samples if the exemplar is large.

use crate::foundation::fft::Volumes;
use crate::foundation::fixed::{Place, nearest};
use crate::foundation::grid::Grid;

/// Exemplars with more samples are searched in blocks of samples.
const LARGE: usize = 1 << 18;

/// Blocks of samples, in arrays whose sides are suitable for Fourier transforms.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lattice<const D: usize> {
    /// Grid of the blocks.
    pub grid: Grid<D>,
    /// Shape of the arrays, at least the shape of the grid.
    pub size: [usize; D],
    /// The side of a block is two to this power.
    pub level: u32,
}

impl<const D: usize> Lattice<D> {
    /// Chooses the smallest blocks that are allowed.
    pub(super) fn new(samples: &Grid<D>) -> Self {
        let mut this = Self::of(*samples, 0);
        while this.grid.len() > LARGE {
            let (shape, wrap) = (this.grid.shape(), this.grid.wrap());
            if (0..D).any(|a| wrap[a] && shape[a] % 2 != 0) {
                // Blocks must divide the period of the exemplar.
                break;
            }
            let Ok(half) = Grid::new(shape.map(|n| n.div_ceil(2)), wrap) else {
                break;
            };
            this = Self::of(half, this.level + 1);
        }
        this
    }

    fn of(grid: Grid<D>, level: u32) -> Self {
        let size = std::array::from_fn(|a| {
            let n = grid.shape()[a];
            if grid.wrap()[a] { n } else { Volumes::fast(n) }
        });
        Self { grid, size, level }
    }

    /// Returns the number of entries of an array.
    pub(super) fn points(&self) -> usize {
        self.size.iter().product()
    }

    /// Returns the row-major position of a block in an array.
    #[inline(always)]
    pub(super) fn position(&self, block: [usize; D]) -> usize {
        (0..D).fold(0, |at, a| at * self.size[a] + block[a])
    }

    /// Returns the means of values over the samples of each block, in an array.
    pub(super) fn means(&self, samples: &Grid<D>, value: impl Fn(usize) -> f32) -> Vec<f32> {
        let mut out = vec![0.0; self.points()];
        for (i, point) in samples.points().enumerate() {
            out[self.position(point.map(|x| x >> self.level))] += value(i);
        }
        if self.level > 0 {
            let (shape, side) = (samples.shape(), 1 << self.level);
            for block in self.grid.points() {
                let count: usize = (0..D)
                    .map(|a| side.min(shape[a] - (block[a] << self.level)))
                    .product();
                out[self.position(block)] /= count as f32;
            }
        }
        out
    }

    /// Returns the position of a step in a template whose first block is `first`.
    #[inline(always)]
    pub(super) fn splat(&self, step: Place<D>, first: [i32; D]) -> Option<usize> {
        let near = nearest(step);
        let mut at = 0;
        for a in 0..D {
            let n = self.size[a] as i32;
            let i = (near[a] >> self.level) - first[a];
            let i = if self.grid.wrap()[a] {
                i.rem_euclid(n)
            } else {
                i
            };
            if !(0..n).contains(&i) {
                return None;
            }
            at = at * n as usize + i as usize;
        }
        Some(at)
    }

    /// Returns the sample at the centre of a template, from its block.
    pub(super) fn centre(&self, block: [usize; D], first: [i32; D]) -> [i32; D] {
        std::array::from_fn(|a| (block[a] as i32 - first[a]) << self.level)
    }
}
