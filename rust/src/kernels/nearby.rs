//! Weighted sums of the values around points of an image, under a separable window. Only a few points have values, so
//! the image is not convolved as a whole.
//!
//! Each point first adds its weighted value to the pixels above and below it, and then sums the pixels to its left and
//! right. Sums run in `f64`: first the value at distance 0, then the values from the farthest to the nearest.

use crate::foundation::error::check_shape;
use crate::foundation::grid::Grid;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// Number of points in each parallel task.
const CHUNK: usize = 4096;

/// Returns the weighted sum of the values of all points around each point (row, column). The weight of a value is
/// `window[a] * window[b]`, with its distances a in rows and b in columns. Distances of `window.len()` or more have
/// weight 0.
///
/// # Errors
/// `points` and `values` differ in number, a point is outside the image, the number of pixels
/// overflows, or the monitor was cancelled.
pub fn sums(
    points: &[[i64; 2]],
    values: &[f32],
    shape: [usize; 2],
    cyclic: bool,
    window: &[f64],
    monitor: &Monitor,
) -> Result<Vec<f32>> {
    check_shape("values", &[points.len()], values.len())?;
    let image = Grid::new(shape, [cyclic; 2])?;
    let inside = |point: &&[i64; 2]| (0..2).all(|a| (0..shape[a] as i64).contains(&point[a]));
    if points.iter().filter(inside).count() != points.len() {
        return Err(Error::value(
            "points",
            format!("must all be inside an image of shape {shape:?}"),
        ));
    }
    // Pixels beyond an edge are on the other side if the image wraps. Otherwise they are in an empty margin.
    let reach = window.len().saturating_sub(1);
    let margin = if cyclic { 0 } else { reach };
    let [height, width] = image.shape().map(|n| n + 2 * margin);
    let size = memory::product("shape", &[height, width])?;
    let around =
        |at: i64, step: i64, n: usize| (at + margin as i64 + step).rem_euclid(n as i64) as usize;

    if window.is_empty() {
        return memory::filled("sums", 0.0, points.len());
    }

    // Add the values along columns.
    let mut added = memory::filled("sums", 0.0f64, size)?;
    for (far, step) in steps(reach) {
        monitor.check()?;
        for (&[row, column], &value) in points.iter().zip(values) {
            let at = around(row, step, height) * width + around(column, 0, width);
            added[at] += window[far] * f64::from(value);
        }
    }
    // Sum along rows, in parallel over the points.
    let mut found = memory::filled("sums", 0.0f32, points.len())?;
    par::chunks_mut(&mut found, CHUNK, |chunk, sums| {
        for (sum, &[row, column]) in sums.iter_mut().zip(&points[chunk * CHUNK..]) {
            let line = around(row, 0, height) * width;
            // Round to single precision between the axes, as `kernels::smooth` does.
            let look = |step| f64::from(added[line + around(column, step, width)] as f32);
            let beside = |far: usize| (look(-(far as i64)) + look(far as i64)) * window[far];
            *sum = (1..=reach)
                .rev()
                .fold(window[0] * look(0), |all, far| all + beside(far)) as f32;
        }
    });
    Ok(found)
}

/// Returns each distance with its signed step: zero first, then both directions, from the farthest distance to the
/// nearest.
fn steps(reach: usize) -> impl Iterator<Item = (usize, i64)> {
    let both = |far: usize| [(far, -(far as i64)), (far, far as i64)];
    std::iter::once((0, 0)).chain((1..=reach).rev().flat_map(both))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn sums_are_those_of_all_points_near_by(
            rows in 1usize..9, columns in 1usize..9, cyclic: bool, marks in prop::collection::vec(0u8..3, 64),
        ) {
            let window = [1.0, 0.5, 0.25];
            let at = |i: usize| [(i / columns) as i64, (i % columns) as i64];
            let points: Vec<_> = (0..rows * columns).filter(|&i| marks[i] > 0).map(at).collect();
            let values: Vec<f32> = (0..points.len()).map(|k| k as f32 - 3.0).collect();
            let got = sums(&points, &values, [rows, columns], cyclic, &window, &Monitor::default()).unwrap();
            // If the image is smaller than the window, a point counts several times because the window wraps around.
            let weight = |a: i64, b: i64, n: usize| -> f64 {
                let turns = if cyclic { -3..=3 } else { 0..=0 };
                let far = turns.map(|turn| (a - b + turn * n as i64).unsigned_abs() as usize);
                far.filter_map(|far| window.get(far)).sum()
            };
            for (p, &sum) in points.iter().zip(&got) {
                let of = |(q, &v): (&[i64; 2], &f32)| {
                    weight(p[0], q[0], rows) * weight(p[1], q[1], columns) * f64::from(v)
                };
                let expected: f64 = points.iter().zip(&values).map(of).sum();
                prop_assert!((f64::from(sum) - expected).abs() < 1e-4, "{sum} for {expected}");
            }
        }
    }

    #[test]
    fn under_no_window_nothing_is_summed() {
        let found = sums(&[[1, 2]], &[3.0], [2, 3], true, &[], &Monitor::default());
        assert_eq!(found.unwrap(), [0.0]);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let monitor = Monitor::default();
        let run = |points: &[[i64; 2]], values: &[f32]| {
            sums(points, values, [2, 3], false, &[1.0, 0.5], &monitor)
        };
        assert_eq!(run(&[], &[]).unwrap(), [0.0; 0]);
        assert!(matches!(run(&[[0, 0]], &[]), Err(Error::Shape { .. })));
        for point in [[2, 0], [0, 3], [-1, 0], [i64::MIN, i64::MAX]] {
            assert!(matches!(run(&[point], &[1.0]), Err(Error::Value { .. })));
        }
    }
}
