//! Minimum cuts on grids: where two images meet least visibly, and binary labels of least energy.
//!
//! | part | noun |
//! |---|---|
//! | [`maxflow`] | exact minimum cuts of directed, possibly cyclic grids |
//! | [`cost`] | how visible a seam between two images is, and capacities made of costs |
//! | [`planar`] | the same between opposite borders, open or cyclic, or around a core, as a shortest path on the dual |
//! | [`labels`] | binary labels of least energy |
//! | [`stitch`] | which of two images each pixel of a canvas takes, for overlaps of any shape |
//! | [`strip`] | the same for two images that overlap altogether, seam from border to border |

pub mod cost;
pub mod labels;
pub mod maxflow;
mod overlap;
pub mod planar;
mod queue;
pub mod stitch;
pub mod strip;

use crate::foundation::grid::Grid;

/// Calls `f(p, q)` for each point `p` that has a next point `q` along an axis, in row-major order.
#[inline(always)]
pub(crate) fn links<const D: usize>(grid: &Grid<D>, axis: usize, mut f: impl FnMut(usize, usize)) {
    steps(grid, axis, |_, p, q| f(p, q));
}

/// The same with the coordinate of `p` along the axis: `f(i, p, q)`.
#[inline(always)]
pub(crate) fn steps<const D: usize>(
    grid: &Grid<D>,
    axis: usize,
    mut f: impl FnMut(usize, usize, usize),
) {
    let (stride, length) = (grid.strides()[axis], grid.shape()[axis]);
    for block in (0..grid.len()).step_by(stride * length) {
        for i in 0..length {
            let from = block + i * stride;
            let to = if i + 1 < length {
                from + stride
            } else if grid.wrap()[axis] && length > 1 {
                block
            } else {
                continue;
            };
            for k in 0..stride {
                f(i, from + k, to + k);
            }
        }
    }
}
