//! Minimum cuts on grids: seams where two images differ least, and binary labels of minimum energy.
//!
//! | part | content |
//! |---|---|
//! | [`maxflow`] | exact minimum cuts of directed grids, whose axes may wrap |
//! | [`cost`] | visibility of a seam between two images, and its scaling to capacities |
//! | [`planar`] | minimum cuts between opposite borders, open or closed, or around a core, as shortest paths on the dual |
//! | [`labels`] | binary labels of minimum energy |
//! | [`outlines`] | outlines of labelled regions as minimum cuts in bands around them |
//! | [`stitch`] | choice of one of two images for each pixel of a canvas, for overlaps of any shape |
//! | [`strip`] | the same for two images of the same shape, with a seam from border to border |

pub mod cost;
pub mod labels;
pub mod maxflow;
pub mod outlines;
mod overlap;
pub mod planar;
mod queue;
pub mod stitch;
pub mod strip;

use crate::foundation::grid::Grid;

/// Calls `f(p, q)` for each point `p` with a next point `q` along an axis, in row-major order.
#[inline(always)]
pub(crate) fn links<const D: usize>(grid: &Grid<D>, axis: usize, mut f: impl FnMut(usize, usize)) {
    steps(grid, axis, |_, p, q| f(p, q));
}

/// Calls `f(i, p, q)` like [`links`], where `i` is the coordinate of `p` along the axis.
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
