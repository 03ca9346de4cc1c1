//! The state of an output that is being stitched, and its windows.

use super::chart::Chart;
use super::cut::Cutting;
use crate::Result;
use crate::foundation::fixed::Place;
use crate::foundation::grid::Grid;
use crate::foundation::memory;

/// Patch number of a point that does not show a patch yet.
pub(super) const FREE: u32 = u32::MAX;
/// Patch number of a given point that no patch may take.
pub(super) const HELD: u32 = u32::MAX - 1;
/// Patch number of a given point that a patch may take.
pub(super) const LOOSE: u32 = u32::MAX - 2;

/// Returns whether a patch number refers to a patch, and is not [`FREE`], [`HELD`] or [`LOOSE`].
#[inline(always)]
pub(super) fn is_patch(patch: u32) -> bool {
    patch < LOOSE
}

/// An output whose points may show patches.
pub(super) struct Canvas<const D: usize> {
    pub grid: Grid<D>,
    /// Exemplar coordinates of each point.
    pub places: Vec<Place<D>>,
    /// The patch that each point shows, or [`FREE`], [`HELD`] or [`LOOSE`].
    pub patches: Vec<u32>,
    /// Cost of the seam from each point to the next one along each axis.
    pub seams: Vec<[f32; D]>,
    /// Difference between the patch and the frame field at each point. Empty if there is one frame for all points.
    pub distortion: Vec<f32>,
    /// Number of points without a patch.
    pub free: usize,
    /// Whether the canvas is a part of a larger output. Points at its ends then keep their patches.
    pub part: bool,
}

/// A box of a canvas. Along periodic axes it may extend beyond the end.
#[derive(Debug, Clone)]
pub(super) struct Window<const D: usize> {
    /// First point. Negative coordinates are before the start of a periodic axis.
    pub low: [i32; D],
    /// Grid of the window's points.
    pub grid: Grid<D>,
    /// Positions on the canvas of the window's points.
    pub points: Vec<u32>,
}

impl<const D: usize> Canvas<D> {
    /// Returns an empty canvas.
    pub(super) fn new(grid: Grid<D>, bent: bool) -> Result<Self> {
        let n = grid.len();
        Ok(Self {
            grid,
            places: memory::filled("the places of a region", [0; D], n)?,
            patches: memory::filled("the patches of a region", FREE, n)?,
            seams: memory::filled("the seams of a region", [0.0; D], n)?,
            distortion: memory::filled(
                "the distortion of a region",
                0.0,
                if bent { n } else { 0 },
            )?,
            free: n,
            part: false,
        })
    }

    /// Gives a patch the points that a cut assigned to it.
    pub(super) fn take(
        &mut self,
        chart: &Chart<D>,
        places: &[Place<D>],
        cutting: &Cutting<D>,
        patch: u32,
    ) {
        let points = &chart.window.points;
        for &(i, axis, cost) in &cutting.seams {
            self.seams[points[i as usize] as usize][usize::from(axis)] = cost;
        }
        for (i, &p) in points.iter().enumerate().filter(|(i, _)| cutting.take[*i]) {
            let p = p as usize;
            self.free -= usize::from(self.patches[p] == FREE);
            self.patches[p] = patch;
            self.places[p] = places[i];
            if let Some(d) = self.distortion.get_mut(p) {
                *d = chart.distortion.get(i).copied().unwrap_or(0.0);
            }
        }
    }

    /// Returns whether a point shows a patch or a given sample.
    #[inline(always)]
    pub(super) fn covered(&self, point: u32) -> bool {
        self.patches[point as usize] != FREE
    }

    /// Returns the window from `low` to `high` (exclusive), clipped where an axis ends.
    pub(super) fn window(&self, low: [i32; D], high: [i32; D]) -> Option<Window<D>> {
        let (mut first, mut shape) = ([0; D], [0; D]);
        for axis in 0..D {
            let n = self.grid.shape()[axis] as i32;
            let (from, to) = if self.grid.wrap()[axis] {
                (low[axis], high[axis].min(low[axis] + n))
            } else {
                (low[axis].max(0), high[axis].min(n))
            };
            if to <= from {
                return None;
            }
            first[axis] = from;
            shape[axis] = (to - from) as usize;
        }
        let grid = Grid::new(shape, [false; D]).ok()?;
        let mut window = Window {
            low: first,
            grid,
            points: Vec::with_capacity(grid.len()),
        };
        for point in grid.points() {
            let at = window.at(point);
            let point: [usize; D] =
                std::array::from_fn(|axis| self.grid.resolve(axis, at[axis] as isize));
            window.points.push(self.grid.index(point) as u32);
        }
        Some(window)
    }
}

impl<const D: usize> Window<D> {
    /// Returns a window that covers a whole canvas of the given shape.
    pub(super) fn alone(shape: [usize; D]) -> Result<Self> {
        let grid = Grid::new(shape, [false; D])?;
        Ok(Self {
            low: [0; D],
            grid,
            points: (0..grid.len() as u32).collect(),
        })
    }

    /// Returns the canvas coordinates of a point of the window, which may be beyond the end of a periodic axis.
    #[inline(always)]
    pub(super) fn at(&self, point: [usize; D]) -> [i32; D] {
        std::array::from_fn(|axis| self.low[axis] + point[axis] as i32)
    }

    /// Returns whether a point of the canvas is in the window.
    pub(super) fn holds(&self, at: [i32; D]) -> bool {
        (0..D).all(|a| (self.low[a]..self.low[a] + self.grid.shape()[a] as i32).contains(&at[a]))
    }
}
