//! Mean-shift filtering: every pixel moves to the mode of its joint density in space and colour.
//!
//! Comaniciu and Meer, *Mean shift: a robust approach toward feature space analysis*, IEEE PAMI
//! 2002, section 4.1. Kernels are flat: the square window of `radius` and the ball of `range`
//! colour units. Departure from the paper: positions are rounded to whole pixels after each step,
//! as in OpenCV, so that a window is a block of samples.
//!
//! Sums run in eight fixed lanes without fused operations, so that the result is the same on all CPUs. Otherwise a
//! rounding difference could select other samples in the next step.

mod window;

use crate::foundation::error::check_shape;
use crate::foundation::grid::Grid;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
#[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
use crate::foundation::simd::{V3, wide_fn};
use crate::{Error, Result};
use window::{Planes, Sums, window, window_any};

/// Maximum radius in pixels. Its windows contain four million samples.
pub const MAX_RADIUS: usize = 1024;

/// Maximum absolute sample value and maximum range. The placeholder beyond the edges is then outside the range of
/// every colour.
pub const MAX_VALUE: f32 = 1e15;

/// Parameters of the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Half the side of the window in pixels, without the central pixel.
    pub radius: usize,
    /// Radius of the ball of colours, in colour units.
    pub range: f32,
    /// Maximum number of steps of a pixel.
    pub max_iterations: usize,
    /// A pixel has converged if its position stays and its colour changes by at most this distance.
    pub tolerance: f32,
    /// Flags of the axes that wrap.
    pub wrap: [bool; 2],
}

/// Current position and colour of a pixel.
struct State<'a> {
    at: [usize; 2],
    colour: &'a mut [f32],
}

/// Returns the colour of each pixel's mode, in the shape of the image (rows, columns, channels).
pub fn filter(
    image: &[f32],
    shape: [usize; 3],
    options: &Options,
    monitor: &Monitor,
) -> Result<Vec<f32>> {
    // Check the arguments.
    let [rows, columns, channels] = shape;
    let grid = Grid::new([rows, columns], options.wrap)?;
    check_shape("image", &shape, image.len())?;
    if channels == 0 {
        return Err(Error::value("image", "must have at least 1 channel, got 0"));
    }
    memory::room("the image and its filtered copy", image.len(), 16)?;
    if options.radius > MAX_RADIUS {
        let message = format!(
            "must be at most {MAX_RADIUS} pixels, got {}",
            options.radius
        );
        return Err(Error::value("radius", message));
    }
    if !(options.range >= 0.0 && options.range <= MAX_VALUE) {
        let message = format!("must be from 0 to {MAX_VALUE:e}, got {}", options.range);
        return Err(Error::value("range", message));
    }
    if options.tolerance.is_nan() || options.tolerance < 0.0 {
        let message = format!("must not be negative, got {}", options.tolerance);
        return Err(Error::value("tolerance", message));
    }
    if let Some(bad) = image.iter().find(|x| x.is_nan() || x.abs() > MAX_VALUE) {
        let message = format!("values must be within {MAX_VALUE:e} of zero, got {bad}");
        return Err(Error::value("image", message));
    }
    // Filter the rows in parallel.
    let planes = Planes::new(image, &grid, channels, options.radius)?;
    let mut out = image.to_vec();
    monitor.expect(rows as u64);
    par::chunks_mut(&mut out, columns * channels, |row, out| {
        if monitor.check().is_err() {
            return;
        }
        filter_row(&planes, options, channels, row, out);
        let _ = monitor.advance(1);
    });
    monitor.check()?;
    Ok(out)
}

/// Moves a pixel by one step, and returns whether it has converged.
#[inline(always)]
fn step(
    planes: &Planes,
    options: &Options,
    state: &mut State<'_>,
    before: &mut [f32],
    window: &impl Fn(&Planes, [usize; 2], &mut [f32], f32) -> Sums,
) -> bool {
    before.copy_from_slice(state.colour);
    let limit = options.range * options.range;
    let sums = window(planes, state.at, state.colour, limit);
    if sums.count == 0.0 {
        // The mean colour can be farther than the range from all samples of the window. Keep it in this case.
        state.colour.copy_from_slice(before);
        return true;
    }
    let mut stayed = true;
    for axis in 0..2 {
        let n = planes.shape[axis] as isize;
        // Measure offsets from the central pixel, so that rounding does not depend on the position.
        let count = f64::from(sums.count);
        let offset = f64::from(sums.offset[axis]) - count * planes.margin[axis] as f64;
        let moved = (offset / count).round_ties_even() as isize;
        stayed &= moved == 0;
        state.at[axis] = (state.at[axis] as isize + moved).rem_euclid(n) as usize;
    }
    let mut distance = 0.0f32;
    for (colour, before) in state.colour.iter_mut().zip(before.iter()) {
        *colour /= sums.count;
        distance += (*colour - before) * (*colour - before);
    }
    stayed && distance <= options.tolerance * options.tolerance
}

/// Filters the pixels of a row with the fastest window sum for this CPU.
fn filter_row(planes: &Planes, options: &Options, channels: usize, row: usize, out: &mut [f32]) {
    #[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
    if let Some(simd) = V3::try_new() {
        match channels {
            1 => return climb_wide::<1>(simd, planes, options, row, out),
            3 => return climb_wide::<3>(simd, planes, options, row, out),
            4 => return climb_wide::<4>(simd, planes, options, row, out),
            _ => {}
        }
    }
    match channels {
        1 => climb(planes, options, 1, row, out, window::<1>),
        3 => climb(planes, options, 3, row, out, window::<3>),
        4 => climb(planes, options, 4, row, out, window::<4>),
        _ => climb(planes, options, channels, row, out, window_any),
    }
}

#[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
wide_fn! {
    /// [`climb`] with windows that are summed in SIMD registers.
    fn climb_wide<const C: usize>(simd: V3, planes: &Planes, options: &Options, row: usize, out: &mut [f32]) {
        climb(planes, options, C, row, out, #[inline(always)] |planes, at, colour, limit| {
            window::v3::window::<C>(simd, planes, at, colour, limit)
        });
    }
}

/// Moves the pixels of a row to their modes. Around a position, `window` selects the samples whose squared colour
/// difference from the given colour is within the limit. It replaces the colour by their sum.
#[inline(always)]
fn climb(
    planes: &Planes,
    options: &Options,
    channels: usize,
    row: usize,
    out: &mut [f32],
    window: impl Fn(&Planes, [usize; 2], &mut [f32], f32) -> Sums,
) {
    let mut before = vec![0.0; channels];
    for (x, colour) in out.chunks_exact_mut(channels).enumerate() {
        let mut state = State {
            at: [row, x],
            colour,
        };
        for _ in 0..options.max_iterations {
            if step(planes, options, &mut state, &mut before, &window) {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests;
