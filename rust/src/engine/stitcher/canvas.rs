//! What has been stitched so far, and windows of it.

use super::chart::Chart;
use super::cut::Cutting;
use crate::Result;
use crate::foundation::fixed::Place;
use crate::foundation::grid::Grid;
use crate::foundation::memory;

/// No patch yet.
pub(super) const FREE: u32 = u32::MAX;
/// A point that is given, and stays.
pub(super) const HELD: u32 = u32::MAX - 1;
/// A point that is given, until a patch takes it.
pub(super) const LOOSE: u32 = u32::MAX - 2;

/// Whether what a point shows is a patch's.
#[inline(always)]
pub(super) fn is_patch(patch: u32) -> bool {
    patch < LOOSE
}

/// An output, some points of which show patches.
pub(super) struct Canvas<const D: usize> {
    pub grid: Grid<D>,
    /// Where each point looks.
    pub places: Vec<Place<D>>,
    /// The patch that each point shows, or [`FREE`], [`HELD`] or [`LOOSE`].
    pub patches: Vec<u32>,
    /// Cost of the seam from each point to the next one along each axis.
    pub seams: Vec<[f32; D]>,
    /// How far the patch is from the field at each point; empty where nothing is bent.
    pub distortion: Vec<f32>,
    /// Points without a patch.
    pub free: usize,
    /// Whether it is a part of something larger: points at its ends then stay as they are.
    pub part: bool,
}

/// A box of a canvas; along cyclic axes it may reach over the end.
#[derive(Debug, Clone)]
pub(super) struct Window<const D: usize> {
    /// Its first point; negative ones lie before a cyclic end.
    pub low: [i32; D],
    /// Its points.
    pub grid: Grid<D>,
    /// The canvas's points, in the window's order.
    pub points: Vec<u32>,
}

impl<const D: usize> Canvas<D> {
    /// An empty canvas.
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

    /// Shows what a cut gave to a patch.
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

    /// Whether a point shows something.
    #[inline(always)]
    pub(super) fn covered(&self, point: u32) -> bool {
        self.patches[point as usize] != FREE
    }

    /// The window from `low` to `high`, which is not in it; cut off where an axis ends.
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
    /// A window of a shape, which is all that there is.
    pub(super) fn alone(shape: [usize; D]) -> Result<Self> {
        let grid = Grid::new(shape, [false; D])?;
        Ok(Self {
            low: [0; D],
            grid,
            points: (0..grid.len() as u32).collect(),
        })
    }

    /// Where a point of the window lies on the canvas, not brought around.
    #[inline(always)]
    pub(super) fn at(&self, point: [usize; D]) -> [i32; D] {
        std::array::from_fn(|axis| self.low[axis] + point[axis] as i32)
    }

    /// Whether a point of the canvas lies in the window.
    pub(super) fn holds(&self, at: [i32; D]) -> bool {
        (0..D).all(|a| (self.low[a]..self.low[a] + self.grid.shape()[a] as i32).contains(&at[a]))
    }
}
