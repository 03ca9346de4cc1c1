//! Grey-scale reconstruction: repeated dilation of an image, limited by another image after each
//! step.
//!
//! L. Vincent, *Morphological grayscale reconstruction in image analysis: applications and
//! efficient algorithms*, IEEE Transactions on Image Processing 2(2), 1993, section III.D (the
//! hybrid algorithm). Each pixel has eight neighbours.
//!
//! 1. One sweep in each direction over all rows propagates most values to their final places.
//! 2. Pixels that can still raise a neighbour enter a queue, and so does each raised pixel, until
//!    the queue is empty.
//!
//! Values are only compared and copied, so the result does not depend on the order.

use std::collections::VecDeque;

use crate::foundation::error::check_shape;
use crate::foundation::grid::Grid;
use crate::foundation::memory;
use crate::foundation::par::Monitor;
use crate::foundation::simd::wide_fn;
use crate::{Error, Result};

/// Number of processed pixels between checks for cancellation.
const BREATH: usize = 1 << 16;

/// Returns the image that results from repeated dilation of `seed`, limited by `mask` after each step. The seed is
/// first clamped to the mask.
pub fn reconstruct(
    seed: &[f32],
    mask: &[f32],
    grid: &Grid<2>,
    monitor: &Monitor,
) -> Result<Vec<f32>> {
    for (argument, values) in [("seed", seed), ("mask", mask)] {
        check_shape(argument, &grid.shape(), values.len())?;
        if values.iter().any(|x| x.is_nan()) {
            return Err(Error::value(argument, "must not contain NaN"));
        }
    }
    if grid.len() > u32::MAX as usize {
        return Err(Error::Limit {
            what: "a reconstruction".into(),
            needed: format!("{} pixels", grid.len()),
            limit: format!("{} pixels", u32::MAX),
        });
    }
    memory::room("a reconstruction", grid.len(), 24)?;
    monitor.check()?;
    let mut out: Vec<f32> = seed.iter().zip(mask).map(|(&s, &m)| least(s, m)).collect();
    // Propagate values down and then up.
    let [rows, columns] = grid.shape();
    for row in 0..rows {
        let (above, here) = out[..(row + 1) * columns].split_at_mut(row * columns);
        let before = row.checked_sub(1).map(|r| &above[r * columns..]);
        carry(before, here, &mask[row * columns..][..columns]);
    }
    monitor.check()?;
    for row in (0..rows).rev() {
        let (here, below) = out[row * columns..].split_at_mut(columns);
        let before = (row + 1 < rows).then(|| &below[..columns]);
        carry(before, here, &mask[row * columns..][..columns]);
    }
    // Queue the pixels that can still raise a neighbour, then propagate from the queue.
    let around = Around::new(grid);
    let mut queue: VecDeque<u32> = VecDeque::new();
    for p in 0..out.len() {
        let mut raises = false;
        around.of(p, |q| raises |= out[q] < out[p] && out[q] < mask[q]);
        if raises {
            queue.push_back(p as u32);
        }
    }
    let mut raised = 0usize;
    while let Some(p) = queue.pop_front() {
        if raised.is_multiple_of(BREATH) {
            monitor.check()?;
        }
        raised += 1;
        let value = out[p as usize];
        around.of(p as usize, |q| {
            if out[q] < value && out[q] < mask[q] {
                out[q] = least(value, mask[q]);
                queue.push_back(q as u32);
            }
        });
    }
    Ok(out)
}

/// Returns the lesser of two numbers that are not NaN. The comparison is cheaper than `min`.
#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

/// Propagates the values of a row into the adjacent row `here`, and then along `here` in both directions.
fn carry(before: Option<&[f32]>, here: &mut [f32], mask: &[f32]) {
    if let Some(before) = before {
        lower(before, here, mask);
    }
    let mut last = f32::NEG_INFINITY;
    for (x, &m) in here.iter_mut().zip(mask) {
        last = least(most(*x, last), m);
        *x = last;
    }
    last = f32::NEG_INFINITY;
    for (x, &m) in here.iter_mut().zip(mask).rev() {
        last = least(most(*x, last), m);
        *x = last;
    }
}

wide_fn! {
    /// Propagates values from a row to the three nearest pixels of another row.
    fn lower(before: &[f32], here: &mut [f32], mask: &[f32]) {
        let n = here.len();
        for (x, &b) in here.iter_mut().zip(before) {
            *x = most(*x, b);
        }
        for (x, &b) in here[1..].iter_mut().zip(before) {
            *x = most(*x, b);
        }
        for (x, &b) in here.iter_mut().zip(&before[1..]) {
            *x = most(*x, b);
        }
        for (x, &m) in here.iter_mut().zip(&mask[..n]) {
            *x = least(*x, m);
        }
    }
}

/// The eight neighbours of each pixel.
struct Around<'a> {
    grid: &'a Grid<2>,
    steps: [isize; 8],
}

impl<'a> Around<'a> {
    fn new(grid: &'a Grid<2>) -> Self {
        let n = grid.shape()[1] as isize;
        Self {
            grid,
            steps: [-n - 1, -n, 1 - n, -1, 1, n - 1, n, n + 1],
        }
    }

    /// Calls `f` with each neighbour of a pixel. Near an edge, the pixel itself is included.
    #[inline(always)]
    fn of(&self, p: usize, mut f: impl FnMut(usize)) {
        let ([rows, columns], [row, column]) = (self.grid.shape(), self.grid.point(p));
        if row > 0 && row + 1 < rows && column > 0 && column + 1 < columns {
            for step in self.steps {
                f(p.wrapping_add_signed(step));
            }
            return;
        }
        for down in -1..=1 {
            for right in -1..=1 {
                let r = self.grid.inside(0, row as isize + down);
                let c = self.grid.inside(1, column as isize + right);
                if let (Some(r), Some(c)) = (r, c) {
                    f(self.grid.index([r, c]));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::foundation::hash::Noise;
    use proptest::prelude::*;

    /// Dilates until nothing changes.
    fn naive(seed: &[f32], mask: &[f32], grid: &Grid<2>) -> Vec<f32> {
        let mut out: Vec<f32> = seed.iter().zip(mask).map(|(&s, &m)| s.min(m)).collect();
        loop {
            let mut next = out.clone();
            for (p, [row, column]) in grid.points().enumerate() {
                for down in -1..=1 {
                    for right in -1..=1 {
                        let r = grid.inside(0, row as isize + down);
                        let c = grid.inside(1, column as isize + right);
                        if let (Some(r), Some(c)) = (r, c) {
                            next[p] = next[p].max(out[grid.index([r, c])].min(mask[p]));
                        }
                    }
                }
            }
            if next == out {
                return out;
            }
            out = next;
        }
    }

    proptest! {
        #[test]
        fn agrees_with_dilations(
            rows in 1usize..14, columns in 1usize..14, wrap: [bool; 2], seed: u64, levels in 2u64..40, holes in 0u64..9,
        ) {
            let grid = Grid::new([rows, columns], wrap).unwrap();
            let noise = Noise::new(seed);
            let draw = |layer: u32| -> Vec<f32> {
                (0..grid.len() as u32).map(|i| noise.below(levels, [i, layer, 0, 0]) as f32).collect()
            };
            let mask = draw(0);
            let few = |(i, s): (usize, f32)| if noise.below(10, [i as u32, 2, 0, 0]) < holes { s } else { -1.0 };
            let start: Vec<f32> = draw(1).into_iter().enumerate().map(few).collect();
            let found = reconstruct(&start, &mask, &grid, &Monitor::default()).unwrap();
            prop_assert_eq!(found, naive(&start, &mask, &grid));
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let grid = Grid::new([2, 2], [false; 2]).unwrap();
        let monitor = Monitor::default();
        assert!(reconstruct(&[0.0; 3], &[0.0; 4], &grid, &monitor).is_err());
        assert!(reconstruct(&[0.0; 4], &[0.0; 5], &grid, &monitor).is_err());
        assert!(reconstruct(&[f32::NAN; 4], &[0.0; 4], &grid, &monitor).is_err());
        monitor.cancel();
        assert!(reconstruct(&[0.0; 4], &[0.0; 4], &grid, &monitor).is_err());
    }
}
