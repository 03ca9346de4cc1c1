//! Grids of two or three axes: shape, row-major strides, and the points beyond an edge.

use crate::{Error, Result};

/// A box of `shape` points in row-major order. Each axis either ends or wraps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Grid<const D: usize> {
    shape: [usize; D],
    wrap: [bool; D],
}

impl<const D: usize> Grid<D> {
    /// Returns a grid.
    ///
    /// # Errors
    /// An axis is empty, or the number of points overflows.
    pub fn new(shape: [usize; D], wrap: [bool; D]) -> Result<Self> {
        let mut points = 1usize;
        for &n in &shape {
            if n == 0 {
                return Err(Error::value(
                    "shape",
                    format!("must be at least 1 along each axis, got {shape:?}"),
                ));
            }
            points = points.checked_mul(n).ok_or_else(|| {
                Error::value(
                    "shape",
                    format!("must have a number of points that fits into 64 bits, got {shape:?}"),
                )
            })?;
        }
        Ok(Self { shape, wrap })
    }

    /// Number of points along each axis.
    pub fn shape(&self) -> [usize; D] {
        self.shape
    }

    /// Flags of the axes along which the grid wraps.
    pub fn wrap(&self) -> [bool; D] {
        self.wrap
    }

    /// Number of points.
    #[allow(clippy::len_without_is_empty)] // a grid is never empty
    pub fn len(&self) -> usize {
        self.shape.iter().product()
    }

    /// Distance in memory between neighbours along each axis, in points.
    pub fn strides(&self) -> [usize; D] {
        let mut strides = [1; D];
        for axis in (0..D.saturating_sub(1)).rev() {
            strides[axis] = strides[axis + 1] * self.shape[axis + 1];
        }
        strides
    }

    /// Row-major position of a point.
    #[inline(always)]
    pub fn index(&self, point: [usize; D]) -> usize {
        point
            .iter()
            .zip(&self.shape)
            .fold(0, |at, (&p, &n)| at * n + p)
    }

    /// Returns the point at a row-major position.
    #[inline(always)]
    pub fn point(&self, mut index: usize) -> [usize; D] {
        let mut point = [0; D];
        for axis in (0..D).rev() {
            point[axis] = index % self.shape[axis];
            index /= self.shape[axis];
        }
        point
    }

    /// Returns all points in row-major order. This is cheaper than calling [`Self::point`] for each
    /// position.
    pub fn points(&self) -> impl Iterator<Item = [usize; D]> + use<D> {
        let shape = self.shape;
        let mut next = [0; D];
        (0..self.len()).map(move |_| {
            let point = next;
            for axis in (0..D).rev() {
                next[axis] += 1;
                if next[axis] < shape[axis] {
                    break;
                }
                next[axis] = 0;
            }
            point
        })
    }

    /// Maps coordinate `i` onto the axis: modulo the length if the axis wraps, else to the nearest
    /// end.
    #[inline(always)]
    pub fn resolve(&self, axis: usize, i: isize) -> usize {
        let n = self.shape[axis] as isize;
        if (0..n).contains(&i) {
            // The coordinate is nearly always inside, so the costly remainder is avoided here.
            i as usize
        } else if self.wrap[axis] {
            i.rem_euclid(n) as usize
        } else {
            i.clamp(0, n - 1) as usize
        }
    }

    /// Returns coordinate `i` if it is on the axis, modulo the length if the axis wraps, else
    /// `None`.
    pub fn inside(&self, axis: usize, i: isize) -> Option<usize> {
        let n = self.shape[axis] as isize;
        if self.wrap[axis] {
            Some(i.rem_euclid(n) as usize)
        } else {
            (0..n).contains(&i).then_some(i as usize)
        }
    }

    /// Returns the next point along `axis`. At the end this is the first point if the axis wraps
    /// and has more than one point, else `None`.
    pub fn next(&self, point: [usize; D], axis: usize) -> Option<[usize; D]> {
        let mut next = point;
        next[axis] += 1;
        if next[axis] == self.shape[axis] {
            if !self.wrap[axis] || self.shape[axis] == 1 {
                return None;
            }
            next[axis] = 0;
        }
        Some(next)
    }
}

/// A box of an unbounded lattice: its grid, and the world coordinates of its first point.
///
/// Noise is hashed from world coordinates, so every region that contains a point gives it the same
/// noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub struct Region<const D: usize> {
    /// The points of the region. Wrapped axes are those along which the output repeats.
    pub grid: Grid<D>,
    /// World coordinates of the first point.
    pub origin: [i32; D],
}

impl<const D: usize> Region<D> {
    /// Limit of the absolute world coordinates. Steps between any two points then fit into 32 bits.
    pub const FAR: i32 = 1 << 30;

    /// Returns a region.
    ///
    /// # Errors
    /// The grid has more than 2^32 - 1 points, which do not fit 32-bit indices, or a point beyond
    /// [`Self::FAR`].
    pub fn new(grid: Grid<D>, origin: [i32; D]) -> Result<Self> {
        if grid.len() > u32::MAX as usize {
            return Err(Error::Limit {
                what: format!("a region of {:?}", grid.shape()),
                needed: format!("{} points", grid.len()),
                limit: format!("{} points", u32::MAX),
            });
        }
        for (&first, n) in origin.iter().zip(grid.shape()) {
            let last = i64::from(first) + n as i64 - 1;
            if i64::from(first) <= -i64::from(Self::FAR) || last >= i64::from(Self::FAR) {
                return Err(Error::value(
                    "origin",
                    format!(
                        "must keep all points within 2^30 of zero, got {origin:?} with shape {:?}",
                        grid.shape()
                    ),
                ));
            }
        }
        Ok(Self { grid, origin })
    }

    /// World coordinates of a point.
    #[inline(always)]
    pub fn world(&self, point: [usize; D]) -> [i32; D] {
        let mut world = self.origin;
        for axis in 0..D {
            world[axis] = world[axis].wrapping_add(point[axis] as i32);
        }
        world
    }

    /// Returns the row-major position of the point one `step` away, modulo the length along wrapped
    /// axes, or `None` beyond an end.
    #[inline(always)]
    pub fn step(&self, point: [usize; D], step: [i32; D]) -> Option<usize> {
        let (shape, wrap) = (self.grid.shape(), self.grid.wrap());
        let mut at = 0;
        for axis in 0..D {
            let n = shape[axis] as i32;
            let mut i = point[axis] as i32 + step[axis];
            if !(0..n).contains(&i) {
                if !wrap[axis] {
                    return None;
                }
                i = i.rem_euclid(n);
            }
            at = at * n as usize + i as usize;
        }
        Some(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn refuses_empty_and_uncountable_shapes() {
        assert!(Grid::new([3, 0], [false; 2]).is_err());
        assert!(Grid::new([usize::MAX, 2], [false; 2]).is_err());
    }

    #[test]
    fn regions_stay_within_32_bits() {
        let region = |shape, origin| Region::new(Grid::new(shape, [false; 2]).unwrap(), origin);
        let far = Region::<2>::FAR;
        assert!(region([1, 1], [1 - far, far - 1]).is_ok());
        assert!(region([10, 10], [0, far - 10]).is_ok());
        assert!(region([10, 10], [0, far - 9]).is_err());
        assert!(region([10, 10], [-far, 0]).is_err());
        assert!(region([10, 10], [i32::MIN, i32::MAX]).is_err());
        assert!(region([1 << 31, 1], [-far + 1, 0]).is_err());
        let many = region([1 << 20, 1 << 20], [0; 2]);
        assert!(matches!(many, Err(Error::Limit { .. })));
    }

    #[test]
    fn ends_clamp_and_cyclic_axes_wrap() {
        let grid = Grid::new([4, 5], [true, false]).unwrap();
        assert_eq!(grid.resolve(0, -1), 3);
        assert_eq!(grid.resolve(1, -1), 0);
        assert_eq!(grid.inside(0, 4), Some(0));
        assert_eq!(grid.inside(1, 5), None);
        assert_eq!(grid.next([3, 4], 0), Some([0, 4]));
        assert_eq!(grid.next([3, 4], 1), None);
    }

    proptest! {
        #[test]
        fn index_and_point_are_inverse(shape in prop::array::uniform3(1usize..7), seed in 0usize..1000) {
            let grid = Grid::new(shape, [false; 3]).unwrap();
            let index = seed % grid.len();
            prop_assert_eq!(grid.index(grid.point(index)), index);
            let dot: usize = grid.point(index).iter().zip(grid.strides()).map(|(p, s)| p * s).sum();
            prop_assert_eq!(dot, index);
            prop_assert_eq!(grid.points().nth(index), Some(grid.point(index)));
        }
    }
}
