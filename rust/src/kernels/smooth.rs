//! Smoothing of arrays along their axes with symmetric weights, such as those of a Gaussian.
//!
//! Sums run in double precision: first the central value, then the pairs of values from the
//! farthest to the nearest. They are rounded to the array's type after each axis. The results equal
//! those of `scipy.ndimage.correlate1d` byte for byte.

use crate::foundation::error::check_shape;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::foundation::simd::wide_fn;
use crate::{Error, Result};

/// Number of adjacent sums that are computed together.
const LANES: usize = 16;
/// Number of rows in each parallel task.
const ROWS: usize = 64;

/// Values beyond the ends of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// The mirrored array, with the last value repeated.
    Reflect,
    /// The last value.
    Nearest,
    /// The array continues from its other end.
    Wrap,
    /// Zero.
    Zero,
}

impl Edge {
    /// Returns the index of the value at a place that may be beyond the ends, or `None` for zero.
    /// The axis has `count` values.
    fn find(self, place: i64, count: usize) -> Option<usize> {
        let n = count as i64;
        match self {
            Self::Reflect => {
                let at = place.rem_euclid(2 * n);
                Some(at.min(2 * n - 1 - at) as usize)
            }
            Self::Nearest => Some(place.clamp(0, n - 1) as usize),
            Self::Wrap => Some(place.rem_euclid(n) as usize),
            Self::Zero => (0..n).contains(&place).then_some(place as usize),
        }
    }
}

/// Smoothing of one axis.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Weights of the central value and of the values at distance 1, 2, ... on either side. If
    /// empty, the axis is not smoothed.
    pub weights: Vec<f64>,
    /// Values beyond the ends of the axis.
    pub edge: Edge,
}

/// A value of single or double precision.
pub trait Number: Copy + Default + Send + Sync {
    /// Returns the value in double precision.
    fn wide(self) -> f64;
    /// Returns a sum rounded to this type.
    fn round(sum: f64) -> Self;
}

impl Number for f32 {
    #[inline(always)]
    fn wide(self) -> f64 {
        f64::from(self)
    }
    #[inline(always)]
    fn round(sum: f64) -> Self {
        sum as f32
    }
}

impl Number for f64 {
    #[inline(always)]
    fn wide(self) -> f64 {
        self
    }
    #[inline(always)]
    fn round(sum: f64) -> Self {
        sum
    }
}

/// Smooths an array of `shape` in place, one axis after the other.
///
/// # Errors
/// The shape does not match the number of values, the number of `axes` does not match the shape, or
/// the monitor was cancelled.
pub fn smooth<T: Number>(
    values: &mut Vec<T>,
    shape: &[usize],
    axes: &[Axis],
    monitor: &Monitor,
) -> Result<()> {
    check_shape("values", shape, values.len())?;
    if axes.len() != shape.len() {
        let message = format!(
            "must be one for each axis of shape {shape:?}, got {}",
            axes.len()
        );
        return Err(Error::value("axes", message));
    }
    let used = axes.iter().filter(|axis| !axis.weights.is_empty()).count();
    if values.is_empty() || used == 0 {
        return Ok(());
    }
    let mut other = memory::filled("the smoothed array", T::default(), values.len())?;
    for (number, axis) in axes.iter().enumerate() {
        if axis.weights.is_empty() {
            continue;
        }
        let inner = shape[number + 1..].iter().product();
        pass(values, &mut other, shape[number], inner, axis, monitor)?;
        std::mem::swap(values, &mut other);
    }
    Ok(())
}

/// Smooths along one axis of `count` values that are `inner` apart in memory.
fn pass<T: Number>(
    from: &[T],
    to: &mut [T],
    count: usize,
    inner: usize,
    axis: &Axis,
    monitor: &Monitor,
) -> Result<()> {
    let what = "the smoothed array";
    let reach = axis.weights.len() - 1;
    let length = memory::product("weights", &[2, reach])?.saturating_add(count);
    // Check that the buffers of all threads fit into memory.
    memory::room(what, length.saturating_mul(LANES), 8 * par::threads())?;
    // Compute the source index of each position of the extended axis only once.
    let mut source: Vec<u32> = memory::filled(what, u32::MAX, length)?;
    for (i, source) in source.iter_mut().enumerate() {
        if let Some(at) = axis.edge.find(i as i64 - reach as i64, count) {
            *source = at as u32;
        }
    }
    let source = &source[..];
    // Along the last axis, extend each line beyond its ends and sum along it.
    if inner == 1 {
        par::chunks_mut(to, ROWS * count, |chunk, lines| {
            let mut line = vec![0.0; length + LANES];
            for (k, out) in lines.chunks_exact_mut(count).enumerate() {
                if monitor.check().is_err() {
                    return;
                }
                let own = &from[(chunk * ROWS + k) * count..][..count];
                for (value, &at) in line.iter_mut().zip(source) {
                    *value = own.get(at as usize).map_or(0.0, |v| v.wide());
                }
                for (at, out) in out.chunks_mut(LANES).enumerate() {
                    let sums = sum(&line, at * LANES, 1, &axis.weights);
                    for (out, &sum) in out.iter_mut().zip(&sums) {
                        *out = T::round(sum);
                    }
                }
            }
        });
        return monitor.check();
    }
    // Along other axes, sum blocks of adjacent columns.
    for (from, to) in from
        .chunks_exact(count * inner)
        .zip(to.chunks_exact_mut(count * inner))
    {
        par::chunks_mut(to, ROWS * inner, |chunk, rows| {
            let first = chunk * ROWS;
            let many = rows.len() / inner;
            let mut block = vec![0.0; (many + 2 * reach) * LANES];
            for left in (0..inner).step_by(LANES) {
                if monitor.check().is_err() {
                    return;
                }
                let width = LANES.min(inner - left);
                for (lanes, &at) in block
                    .chunks_exact_mut(LANES)
                    .zip(&source[first..first + many + 2 * reach])
                {
                    lanes.fill(0.0);
                    if let Some(own) = from.get((at as usize).saturating_mul(inner) + left..) {
                        for (lane, value) in lanes[..width].iter_mut().zip(own) {
                            *lane = value.wide();
                        }
                    }
                }
                for (at, row) in rows.chunks_exact_mut(inner).enumerate() {
                    let sums = sum(&block, at * LANES, LANES, &axis.weights);
                    for (out, &sum) in row[left..left + width].iter_mut().zip(&sums) {
                        *out = T::round(sum);
                    }
                }
            }
        });
    }
    monitor.check()
}

wide_fn! {
    /// Returns the weighted sums of `LANES` adjacent positions, starting at `first`. Neighbours along the smoothed
    /// axis are `apart` values apart in memory.
    fn sum(values: &[f64], first: usize, apart: usize, weights: &[f64]) -> [f64; LANES] {
        let reach = weights.len() - 1;
        let mut sums = [0.0; LANES];
        let lanes = |at: usize| values[first + at * apart..].first_chunk::<LANES>();
        if let Some(own) = lanes(reach) {
            for lane in 0..LANES {
                sums[lane] = own[lane] * weights[0];
            }
        }
        for (k, &weight) in weights.iter().enumerate().skip(1).rev() {
            let (Some(before), Some(after)) = (lanes(reach - k), lanes(reach + k)) else {
                return sums;
            };
            for lane in 0..LANES {
                sums[lane] += (before[lane] + after[lane]) * weight;
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The same sums by definition, without blocks.
    fn by_definition(values: &[f64], shape: [usize; 3], axes: &[Axis]) -> Vec<f64> {
        let mut now = values.to_vec();
        for (number, axis) in axes.iter().enumerate() {
            let before = now.clone();
            for i in 0..now.len() {
                let at = [
                    i / shape[2] / shape[1],
                    i / shape[2] % shape[1],
                    i % shape[2],
                ];
                let get = |step: i64| {
                    let found = axis.edge.find(at[number] as i64 + step, shape[number]);
                    let mut there = at;
                    found.map_or(0.0, |place| {
                        there[number] = place;
                        before[(there[0] * shape[1] + there[1]) * shape[2] + there[2]]
                    })
                };
                now[i] = get(0) * axis.weights[0];
                for (k, weight) in axis.weights.iter().enumerate().skip(1).rev() {
                    now[i] += (get(-(k as i64)) + get(k as i64)) * weight;
                }
            }
        }
        now
    }

    proptest! {
        #[test]
        fn sums_are_those_of_the_definition(
            shape in (1usize..4, 1usize..90, 1usize..40),
            reach in 0usize..12,
            edge in 0usize..4,
            threads in 1usize..3,
        ) {
            let shape = [shape.0, shape.1, shape.2];
            let edge = [Edge::Reflect, Edge::Nearest, Edge::Wrap, Edge::Zero][edge];
            let weights: Vec<f64> = (0..=reach).map(|k| 1.0 / (3.0 + k as f64)).collect();
            let axes = [0, 1, 2].map(|_| Axis { weights: weights.clone(), edge });
            let values: Vec<f64> = (0..shape.iter().product()).map(|i: usize| ((i * 7919) % 101) as f64 / 7.0).collect();
            let wanted = by_definition(&values, shape, &axes);
            let mut found = values;
            par::install(threads, || smooth(&mut found, &shape, &axes, &Monitor::default())).unwrap().unwrap();
            prop_assert_eq!(found, wanted);
        }
    }

    #[test]
    fn bad_arguments_are_refused() {
        let axis = Axis {
            weights: vec![1.0],
            edge: Edge::Wrap,
        };
        let refused = |shape: &[usize], axes: &[Axis]| {
            let mut values = vec![0.0f32; 6];
            smooth(&mut values, shape, axes, &Monitor::default()).unwrap_err()
        };
        let two = [axis.clone(), axis.clone()];
        assert!(matches!(refused(&[2, 2], &two), Error::Shape { .. }));
        assert!(
            refused(&[2, 3], &two[..1])
                .to_string()
                .contains("must be one")
        );
        let monitor = Monitor::default();
        monitor.cancel();
        let stopped = smooth(&mut vec![0.0f32; 6], &[2, 3], &two, &monitor);
        assert!(matches!(stopped, Err(Error::Cancelled(_))));
    }
}
