//! Memory layout of the points of a grid.

use super::ENDS;
use crate::foundation::grid::Grid;
use crate::{Error, Result};

/// Memory layout of the points. Along an axis that does not wrap, one empty node follows the
/// points, so that every neighbour exists.
pub(super) struct Layout<const D: usize> {
    pub(super) shape: [usize; D],
    pub(super) cyclic: [bool; D],
    pub(super) strides: [usize; D],
    pub(super) first: usize,
    pub(super) len: usize,
}

impl<const D: usize> Layout<D> {
    pub(super) fn new(grid: Grid<D>) -> Result<Self> {
        let (shape, cyclic) = (grid.shape(), grid.wrap());
        let mut strides = [1usize; D];
        let mut len = 1usize;
        let mut first = 0;
        for axis in (0..D).rev() {
            strides[axis] = len;
            if !cyclic[axis] {
                first = first.max(len);
            }
            len = len.saturating_mul(shape[axis] + usize::from(!cyclic[axis]));
        }
        let len = len.saturating_add(first);
        if len > i32::MAX as usize {
            return Err(Error::Limit {
                what: format!("a cut on a grid of shape {shape:?}"),
                needed: format!("{len} nodes"),
                limit: format!("{} nodes", i32::MAX),
            });
        }
        Ok(Self {
            shape,
            cyclic,
            strides,
            first,
            len,
        })
    }

    /// Calls `f(index of the row's first point, its node, length)` for each row along the last
    /// axis.
    pub(super) fn rows(&self, mut f: impl FnMut(usize, usize, usize)) {
        let n = self.shape[D - 1];
        let rows: usize = self.shape[..D - 1].iter().product();
        for row in 0..rows {
            let mut rest = row;
            let mut node = self.first;
            for axis in (0..D - 1).rev() {
                node += rest % self.shape[axis] * self.strides[axis];
                rest /= self.shape[axis];
            }
            f(row * n, node, n);
        }
    }

    /// Returns flags of a point. Bit `2 * axis` means that it is at the start of a wrapped axis, and bit `2 * axis +
    /// 1` that it is at the end.
    pub(super) fn ends(&self, mut point: [usize; D], i: usize) -> u8 {
        point[D - 1] = i;
        let mut bits = 0;
        for (axis, &p) in point.iter().enumerate() {
            if self.cyclic[axis] {
                bits |= u8::from(p == 0) << (2 * axis);
                bits |= u8::from(p + 1 == self.shape[axis]) << (2 * axis + 1);
            }
        }
        bits
    }

    /// Returns a table that is indexed by [`Self::ends`]: the offsets of the next and the previous point along each
    /// axis.
    pub(super) fn offsets(&self) -> [[[i32; 2]; D]; ENDS] {
        std::array::from_fn(|bits| {
            std::array::from_fn(|axis| {
                let step = self.strides[axis] as i32;
                let around = step * (self.shape[axis] as i32 - 1);
                [
                    if bits >> (2 * axis + 1) & 1 == 1 {
                        -around
                    } else {
                        step
                    },
                    if bits >> (2 * axis) & 1 == 1 {
                        around
                    } else {
                        -step
                    },
                ]
            })
        })
    }
}
