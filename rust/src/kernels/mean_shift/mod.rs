//! Mean-shift filtering: every pixel climbs to the mode of its joint spatial and range density.
//!
//! Comaniciu and Meer, *Mean shift: a robust approach toward feature space analysis*, IEEE PAMI 2002, section 4.1, with flat
//! kernels: the square window of `radius` and the ball of `range` colour units. Departure: positions are rounded to whole
//! pixels after each step, as OpenCV does, so that a window is a block of samples.
//!
//! Sums run in eight fixed lanes without fused operations, since a comparison decides what is summed: the result is the
//! same on all CPUs.

mod window;

use crate::foundation::error::check_shape;
use crate::foundation::grid::Grid;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
#[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
use crate::foundation::wide::{V3, wide_fn};
use crate::{Error, Result};
use window::{Planes, Sums, window, window_any};

/// The largest radius: windows of four million samples.
pub const MAX_RADIUS: usize = 1024;

/// The largest sample and range, so that what lies beyond an edge is always outside.
pub const MAX_VALUE: f32 = 1e15;

/// The filter's parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Half the side of the window, in pixels, without the middle.
    pub radius: usize,
    /// Radius of the ball of colours.
    pub range: f32,
    /// A pixel takes at most this many steps.
    pub max_iterations: usize,
    /// A pixel has arrived when its position stays and its colour moves by at most this.
    pub tolerance: f32,
    /// Which axes are cyclic.
    pub wrap: [bool; 2],
}

/// Where a pixel has come to.
struct State<'a> {
    at: [usize; 2],
    colour: &'a mut [f32],
}

/// The colours at the modes, of the image's shape (rows, columns, channels).
pub fn filter(
    image: &[f32],
    shape: [usize; 3],
    options: &Options,
    monitor: &Monitor,
) -> Result<Vec<f32>> {
    let [rows, columns, channels] = shape;
    let grid = Grid::new([rows, columns], options.wrap)?;
    check_shape("image", &shape, image.len())?;
    if channels == 0 {
        return Err(Error::value("image", "needs a channel"));
    }
    memory::room("the image and its filtered copy", image.len(), 16)?;
    if options.radius > MAX_RADIUS {
        let message = format!("up to {MAX_RADIUS} pixels, got {}", options.radius);
        return Err(Error::value("radius", message));
    }
    if !(options.range >= 0.0 && options.range <= MAX_VALUE) {
        let message = format!("from 0 to {MAX_VALUE:e}, got {}", options.range);
        return Err(Error::value("range", message));
    }
    if options.tolerance.is_nan() || options.tolerance < 0.0 {
        let message = format!("must not be negative, got {}", options.tolerance);
        return Err(Error::value("tolerance", message));
    }
    if let Some(bad) = image.iter().find(|x| x.is_nan() || x.abs() > MAX_VALUE) {
        let message = format!("values up to {MAX_VALUE:e} are allowed, got {bad}");
        return Err(Error::value("image", message));
    }
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

/// One step; whether the pixel has arrived.
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
        // The mean of colours may be near none of them.
        state.colour.copy_from_slice(before);
        return true;
    }
    let mut stayed = true;
    for axis in 0..2 {
        let n = planes.shape[axis] as isize;
        // From the middle, so that the rounding is the same wherever the pixel is.
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

/// The pixels of a row, by the fastest way to sum a window on this CPU.
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
    /// [`climb`] with windows that are summed in wide registers.
    fn climb_wide<const C: usize>(simd: V3, planes: &Planes, options: &Options, row: usize, out: &mut [f32]) {
        climb(planes, options, C, row, out, #[inline(always)] |planes, at, colour, limit| {
            window::v3::window::<C>(simd, planes, at, colour, limit)
        });
    }
}

/// Moves the pixels of a row to their modes. A window is summed around a place; the colour that goes in comes out as the
/// sum of the colours within the limit.
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
