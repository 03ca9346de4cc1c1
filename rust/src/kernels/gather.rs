//! Lookup of exemplars through coordinates: the last step of every synthesis.
//!
//! Exemplars have any scalar type, any number of channels, and two or three axes. A coordinate on a
//! sample returns this sample bit for bit, with any interpolation. Between samples the sum runs in
//! `f64` in a fixed order.
//!
//! The cubic kernel (Catmull-Rom: Keys, *Cubic convolution interpolation*, IEEE ASSP 1981, a =
//! -1/2) is clipped to the range of its taps. It therefore neither rings nor leaves the range of
//! the data, including high dynamic range.

use crate::foundation::error::check_shape;
use crate::foundation::grid::Grid;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// Number of output pixels in each parallel task. A call with at most this many pixels does not need the thread pool.
pub const CHUNK: usize = 4096;

/// Interpolation between samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// The nearest sample. Ties round up.
    Nearest,
    /// Multilinear interpolation.
    Linear,
    /// Catmull-Rom interpolation, clipped to the range of its taps.
    Cubic,
}

mod sealed {
    pub trait Sealed {}
}

/// A scalar type of images.
pub trait Element: Copy + Send + Sync + Default + sealed::Sealed {
    /// Returns the value as `f64`.
    fn to_f64(self) -> f64;
    /// Returns the nearest representable value.
    fn from_f64(value: f64) -> Self;
}

macro_rules! integer_elements {
    ($($t:ty),*) => {$(
        impl sealed::Sealed for $t {}
        impl Element for $t {
            fn to_f64(self) -> f64 { f64::from(self) }
            fn from_f64(value: f64) -> Self {
                // A cast rounds towards zero, so correct it for negative values. `f64::floor` would be a function call
                // unless the compiler's target is known to have a rounding instruction.
                let above = value + 0.5;
                let cast = above as $t;
                if f64::from(cast) > above { cast.saturating_sub(1) } else { cast }
            }
        }
    )*};
}
integer_elements!(u8, i8, u16, i16, u32, i32);

macro_rules! float_elements {
    ($($t:ty),*) => {$(
        impl sealed::Sealed for $t {}
        impl Element for $t {
            fn to_f64(self) -> f64 { f64::from(self) }
            fn from_f64(value: f64) -> Self { value as $t }
        }
    )*};
}
float_elements!(f32, f64);

/// An exemplar: samples in row-major order, channels last.
#[derive(Debug, Clone, Copy)]
pub struct Exemplar<'a, T, const D: usize> {
    data: &'a [T],
    grid: Grid<D>,
    channels: usize,
}

impl<'a, T, const D: usize> Exemplar<'a, T, D> {
    /// Returns a view of `grid.len() * channels` samples.
    pub fn new(data: &'a [T], grid: Grid<D>, channels: usize) -> Result<Self> {
        check_shape("exemplar", &[grid.len(), channels], data.len())?;
        Ok(Self {
            data,
            grid,
            channels,
        })
    }

    fn pixel(&self, index: usize) -> &'a [T] {
        &self.data[index * self.channels..][..self.channels]
    }
}

/// Fills `out` (pixels x channels) with `exemplars[which[p]]` at `coordinates[p]`.
///
/// `which` may be empty if there is only one exemplar. Coordinates are in samples, in axis order,
/// with sample centres at integers. Beyond an edge the exemplar wraps or repeats its edge,
/// depending on its grid.
pub fn gather<T: Element, const D: usize>(
    exemplars: &[Exemplar<'_, T, D>],
    which: &[u16],
    coordinates: &[[f32; D]],
    interpolation: Interpolation,
    out: &mut [T],
    monitor: &Monitor,
) -> Result<()> {
    // Check the arguments.
    let channels = exemplars
        .first()
        .ok_or_else(|| Error::value("exemplars", "must contain at least one, got none"))?
        .channels;
    if exemplars.iter().any(|e| e.channels != channels) {
        let all: Vec<_> = exemplars.iter().map(|e| e.channels).collect();
        return Err(Error::value(
            "exemplars",
            format!("must have the same number of channels, got {all:?}"),
        ));
    }
    if !which.is_empty() {
        check_shape("which", &[coordinates.len()], which.len())?;
    }
    check_shape("out", &[coordinates.len(), channels], out.len())?;
    if let Some(&bad) = which.iter().find(|&&e| usize::from(e) >= exemplars.len()) {
        let allowed = exemplars.len();
        return Err(Error::value(
            "exemplar",
            format!("must be below {allowed}, got {bad}"),
        ));
    }
    if let Some(at) = coordinates
        .iter()
        .position(|c| c.iter().any(|x| !x.is_finite()))
    {
        return Err(Error::value(
            "coordinates",
            format!("must be finite, got {:?} at pixel {at}", coordinates[at]),
        ));
    }
    if channels == 0 {
        return Ok(());
    }
    // Look up chunks of pixels in parallel.
    monitor.expect(coordinates.len() as u64);
    par::chunks_mut(out, CHUNK * channels, |chunk, out| {
        let first = chunk * CHUNK;
        let mut taps = Taps::default();
        if monitor.check().is_err() {
            return;
        }
        for (i, pixel) in out.chunks_exact_mut(channels).enumerate() {
            let exemplar = &exemplars[which.get(first + i).map_or(0, |&e| usize::from(e))];
            look_up(
                exemplar,
                coordinates[first + i],
                interpolation,
                &mut taps,
                pixel,
            );
        }
        let _ = monitor.advance((out.len() / channels) as u64);
    });
    monitor.check()
}

/// Maximum number of samples around a coordinate: four along each of three axes.
const MOST: usize = 64;

/// Positions and weights of the samples around a coordinate.
struct Taps {
    at: [(usize, f64); MOST],
}

impl Default for Taps {
    fn default() -> Self {
        Self {
            at: [(0, 0.0); MOST],
        }
    }
}

impl Taps {
    /// Sets `W` taps along each axis, starting at offset `first` from the rounded-down coordinate,
    /// and returns the number of taps. `W` is a constant so that loops can be unrolled.
    #[inline(always)]
    fn lay<const D: usize, const W: usize>(
        &mut self,
        grid: &Grid<D>,
        at: [f32; D],
        first: isize,
        weigh: impl Fn(f64) -> [f64; W],
    ) -> usize {
        let strides = grid.strides();
        let mut count = 1;
        self.at[0] = (0, 1.0);
        for axis in 0..D {
            let base = floor(f64::from(at[axis]));
            // For coordinates beyond the range of `isize` the base is saturated, so clamp the
            // fraction.
            let weights = weigh((f64::from(at[axis]) - base as f64).clamp(0.0, 1.0));
            let places: [usize; W] = std::array::from_fn(|k| {
                grid.resolve(axis, base.saturating_add(first + k as isize)) * strides[axis]
            });
            // Iterate backwards, so that each tap is read before it is overwritten.
            for k in (0..W).rev() {
                for tap in 0..count {
                    let (index, so_far) = self.at[tap];
                    self.at[k * count + tap] = (index + places[k], so_far * weights[k]);
                }
            }
            count *= W;
        }
        count
    }
}

/// Every `f32` of at least this size is an integer.
const WHOLE: f32 = (1 << 23) as f32;

/// Returns the largest integer that is not above a number. This is cheaper than a call of `f64::floor`.
#[inline(always)]
fn floor(x: f64) -> isize {
    let cast = x as isize;
    cast.saturating_sub(isize::from(x < cast as f64))
}

#[inline(always)]
fn look_up<T: Element, const D: usize>(
    exemplar: &Exemplar<'_, T, D>,
    at: [f32; D],
    interpolation: Interpolation,
    taps: &mut Taps,
    out: &mut [T],
) {
    let grid = &exemplar.grid;
    let whole = |x: &f32| (*x as i32) as f32 == *x || x.abs() >= WHOLE;
    // A coordinate on a sample copies this sample.
    if interpolation == Interpolation::Nearest || at.iter().all(whole) {
        let mut point = [0; D];
        for axis in 0..D {
            point[axis] = grid.resolve(axis, floor(f64::from(at[axis]) + 0.5));
        }
        out.copy_from_slice(exemplar.pixel(grid.index(point)));
        return;
    }
    let clip = interpolation == Interpolation::Cubic;
    let count = if clip {
        taps.lay(grid, at, -1, catmull_rom)
    } else {
        taps.lay(grid, at, 0, |t| [1.0 - t, t])
    };
    // Common channel counts are compiled separately, so that their loops unroll.
    let (taps, n) = (&taps.at[..count], exemplar.channels);
    match n {
        3 => weighted::<T, 3>(exemplar.data, n, taps, clip, out),
        4 => weighted::<T, 4>(exemplar.data, n, taps, clip, out),
        _ => {
            for (channel, value) in out.chunks_exact_mut(1).enumerate() {
                weighted::<T, 1>(&exemplar.data[channel..], n, taps, clip, value);
            }
        }
    }
}

/// Computes weighted sums of `C` channels of pixels that are `stride` samples apart.
#[inline(always)]
fn weighted<T: Element, const C: usize>(
    data: &[T],
    stride: usize,
    taps: &[(usize, f64)],
    clip: bool,
    out: &mut [T],
) {
    let (mut sum, mut low, mut high) = ([0.0; C], [f64::INFINITY; C], [f64::NEG_INFINITY; C]);
    // Skip taps with weight 0, because 0 times infinity would be NaN.
    for &(index, weight) in taps.iter().filter(|tap| tap.1 != 0.0) {
        for (c, sample) in data[index * stride..][..C].iter().enumerate() {
            let sample = sample.to_f64();
            sum[c] += sample * weight;
            low[c] = if sample < low[c] { sample } else { low[c] };
            high[c] = if sample > high[c] { sample } else { high[c] };
        }
    }
    for (c, value) in out.iter_mut().enumerate() {
        // Use comparisons instead of `clamp`, so that NaN stays NaN.
        *value = T::from_f64(if clip && sum[c] < low[c] {
            low[c]
        } else if clip && sum[c] > high[c] {
            high[c]
        } else {
            sum[c]
        });
    }
}

fn catmull_rom(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t3 + 2.0 * t2 - t),
        0.5 * (3.0 * t3 - 5.0 * t2 + 2.0),
        0.5 * (-3.0 * t3 + 4.0 * t2 + t),
        0.5 * (t3 - t2),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at<T: Element>(
        data: &[T],
        shape: [usize; 2],
        wrap: bool,
        at: [f32; 2],
        how: Interpolation,
    ) -> T {
        let exemplar = Exemplar::new(data, Grid::new(shape, [wrap; 2]).unwrap(), 1).unwrap();
        let mut out = [T::default()];
        gather(&[exemplar], &[], &[at], how, &mut out, &Monitor::default()).unwrap();
        out[0]
    }

    #[test]
    fn samples_that_are_no_numbers_stay_so() {
        let data = [f32::NAN; 36];
        for how in [Interpolation::Linear, Interpolation::Cubic] {
            assert!(at(&data, [6, 6], false, [2.5, 2.25], how).is_nan());
        }
    }

    #[test]
    fn whole_coordinates_copy_whatever_the_interpolation() {
        let data = [1.5f32, f32::INFINITY, -3.0, 1e30];
        for how in [
            Interpolation::Nearest,
            Interpolation::Linear,
            Interpolation::Cubic,
        ] {
            for (i, &value) in data.iter().enumerate() {
                assert_eq!(
                    at(&data, [2, 2], false, [(i / 2) as f32, (i % 2) as f32], how),
                    value
                );
            }
        }
    }

    #[test]
    fn far_beyond_what_is_counted_lies_a_sample_too() {
        let data = [1.0f32, 2.0, 4.0, 8.0];
        for how in [Interpolation::Linear, Interpolation::Cubic] {
            for (far, row) in [(3e38, [4.0, 8.0]), (-3e38, [1.0, 2.0]), (1e19, [4.0, 8.0])] {
                // One coordinate is between samples. The other is so large that `f32` cannot distinguish adjacent
                // rows.
                let found = at(&data, [2, 2], false, [far, 0.5], how);
                assert!((row[0]..=row[1]).contains(&found), "{found} at {far}");
            }
        }
    }

    #[test]
    fn linear_is_exact_on_a_ramp_and_rounds_integers() {
        let ramp: Vec<u16> = (0..16).map(|i| 10 * (i % 4) as u16).collect();
        assert_eq!(
            at(&ramp, [4, 4], false, [1.3, 1.25], Interpolation::Linear),
            13
        );
        assert_eq!(
            at(&ramp, [4, 4], true, [0.0, 3.5], Interpolation::Linear),
            15
        );
        assert_eq!(
            at(&ramp, [4, 4], false, [0.0, 3.5], Interpolation::Linear),
            30
        );
        assert_eq!(
            at(&ramp, [4, 4], true, [-1.0, -1.0], Interpolation::Nearest),
            30
        );
    }

    #[test]
    fn refuses_what_it_cannot_look_up() {
        let data = [0u8; 4];
        let exemplar = Exemplar::new(&data, Grid::new([2, 2], [false; 2]).unwrap(), 1).unwrap();
        let monitor = Monitor::default();
        let mut out = [0u8];
        let linear = Interpolation::Linear;
        assert!(gather(&[exemplar], &[1], &[[0.0, 0.0]], linear, &mut out, &monitor).is_err());
        assert!(
            gather(
                &[exemplar],
                &[],
                &[[f32::NAN, 0.0]],
                linear,
                &mut out,
                &monitor
            )
            .is_err()
        );
        assert!(gather::<u8, 2>(&[], &[], &[[0.0, 0.0]], linear, &mut out, &monitor).is_err());
        assert_eq!(at(&data, [2, 2], true, [3e30, -3e30], linear), 0);
    }

    proptest! {
        #[test]
        fn cubic_stays_within_the_range_of_the_data(
            data in prop::collection::vec(-1e6f32..1e6, 25), y in -2f32..7.0, x in -2f32..7.0, wrap: bool,
        ) {
            let value = at(&data, [5, 5], wrap, [y, x], Interpolation::Cubic);
            let low = data.iter().copied().fold(f32::INFINITY, f32::min);
            let high = data.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            prop_assert!((low..=high).contains(&value));
        }

        #[test]
        fn three_axes_agree_with_two_on_a_single_plane(
            data in prop::collection::vec(0u8..255, 20), y in 0f32..3.0, x in 0f32..4.0,
        ) {
            let exemplar = Exemplar::new(&data, Grid::new([1, 4, 5], [false; 3]).unwrap(), 1).unwrap();
            let mut out = [0u8];
            gather(&[exemplar], &[], &[[0.0, y, x]], Interpolation::Linear, &mut out, &Monitor::default()).unwrap();
            prop_assert_eq!(out[0], at(&data, [4, 5], false, [y, x], Interpolation::Linear));
        }
    }
}
