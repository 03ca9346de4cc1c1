//! Weights of edges: the colour differences of neighbours after smoothing.

use super::{DIRECTIONS, Frame};
use crate::Result;
use crate::foundation::libm::exp;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::foundation::simd::wide_fn;

/// Number of rows in each parallel task. A task smooths one more row.
const ROWS: usize = 32;

/// Radius of the truncated Gaussian, in standard deviations.
const TRUNCATE: f64 = 4.0;

/// Returns the weights of all edges: one line for each direction and each row of the frame. Missing
/// edges have infinite weights.
pub(super) fn measure(
    image: &[f32],
    channels: usize,
    frame: &Frame,
    blur: f64,
    monitor: &Monitor,
) -> Result<Vec<f32>> {
    let ([rows, columns], stride) = (frame.shape, frame.stride);
    let smoother = Smoother {
        image,
        channels,
        frame,
        taps: make_taps(blur),
    };
    let mut weights = memory::filled(
        "edges between pixels",
        f32::INFINITY,
        DIRECTIONS * frame.len(),
    )?;
    let row_of_lines = DIRECTIONS * stride;
    let inside = &mut weights[row_of_lines..(rows + 1) * row_of_lines];
    par::chunks_mut(inside, ROWS * row_of_lines, |block, lines| {
        if monitor.check().is_err() {
            return;
        }
        let mut scratch = Scratch::new(&smoother);
        let (mut here, mut below) = (vec![0.0; channels * stride], vec![0.0; channels * stride]);
        let first = block * ROWS;
        smoother.smooth(first, &mut scratch, &mut here);
        // Measure the edges along this row, then the edges to the next row.
        for (row, lines) in (first..).zip(lines.chunks_exact_mut(row_of_lines)) {
            let (along, rest) = lines.split_at_mut(stride);
            let sums = &mut scratch.flat[..columns];
            differ(&here, &here, [1, 2], stride, sums, &mut along[1..=columns]);
            if row + 1 < rows || frame.wrap[0] {
                smoother.smooth((row + 1) % rows, &mut scratch, &mut below);
                let shifts = [[1, 1], [1, 2], [2, 1]];
                for (line, shifts) in rest.chunks_exact_mut(stride).zip(shifts) {
                    let sums = &mut scratch.flat[..columns];
                    differ(&here, &below, shifts, stride, sums, &mut line[1..=columns]);
                    if shifts != [1, 1] && !frame.wrap[1] {
                        line[columns] = f32::INFINITY;
                    }
                }
                std::mem::swap(&mut here, &mut below);
            }
            if !frame.wrap[1] {
                along[columns] = f32::INFINITY;
            }
        }
    });
    monitor.check()?;
    frame.wrap_lines(&mut weights, DIRECTIONS);
    Ok(weights)
}

wide_fn! {
    /// Computes the distances between the colours of two rows. `shifts` are the positions of the first compared pixels
    /// in the two rows.
    fn differ(one: &[f64], other: &[f64], shifts: [usize; 2], stride: usize, sums: &mut [f64], out: &mut [f32]) {
        sums.fill(0.0);
        for (one, other) in one.chunks_exact(stride).zip(other.chunks_exact(stride)) {
            let (one, other) = (&one[shifts[0]..], &other[shifts[1]..]);
            for ((sum, a), b) in sums.iter_mut().zip(one).zip(other) {
                *sum += (a - b) * (a - b);
            }
        }
        for (out, sum) in out.iter_mut().zip(sums) {
            *out = sum.sqrt() as f32;
        }
    }
}

/// Returns the values of the Gaussian from the centre outwards, normalised so that the sum over
/// both sides is 1.
fn make_taps(blur: f64) -> Vec<f64> {
    let reach = (TRUNCATE * blur + 0.5) as usize;
    let value = |i: usize| exp(-0.5 / (blur * blur) * (i * i) as f64);
    if reach == 0 {
        return vec![1.0];
    }
    let taps: Vec<f64> = (0..=reach).map(value).collect();
    // Sum both sides, from one end of the Gaussian to the other.
    let sum: f64 = taps.iter().rev().chain(&taps[1..]).sum();
    taps.iter().map(|tap| tap / sum).collect()
}

struct Smoother<'a> {
    image: &'a [f32],
    channels: usize,
    frame: &'a Frame,
    taps: Vec<f64>,
}

/// Buffers of a row: `padded` is smoothed along columns, and `flat` in both directions.
struct Scratch {
    padded: Vec<f64>,
    flat: Vec<f64>,
}

impl Scratch {
    fn new(smoother: &Smoother<'_>) -> Self {
        let row = smoother.frame.shape[1] * smoother.channels;
        let margin = (smoother.taps.len() - 1) * smoother.channels;
        Self {
            padded: vec![0.0; row + 2 * margin],
            flat: vec![0.0; row],
        }
    }
}

impl Smoother<'_> {
    /// Smooths a row in both directions. The output has one line for each channel, with a wrapped margin.
    fn smooth(&self, row: usize, scratch: &mut Scratch, out: &mut [f64]) {
        let ([_, columns], channels) = (self.frame.shape, self.channels);
        let reach = self.taps.len() - 1;
        let length = columns * channels;
        let line = |by: isize| {
            let row = self.resolve(0, row as isize + by);
            &self.image[row * length..][..length]
        };
        let Scratch { padded, flat } = scratch;
        let middle = &mut padded[reach * channels..][..length];
        start(line(0), self.taps[0], middle);
        // Add the pairs of rows from the farthest to the nearest, in the same order as SciPy.
        for by in (1..=reach).rev() {
            add(
                line(-(by as isize)),
                line(by as isize),
                self.taps[by],
                middle,
            );
        }
        // Extend the row, then smooth along it.
        for i in 0..reach {
            let before = self.resolve(1, i as isize - reach as isize);
            let after = self.resolve(1, (columns + i) as isize);
            for (to, from) in [(i, before), (reach + columns + i, after)] {
                let from = (reach + from) * channels;
                padded.copy_within(from..from + channels, to * channels);
            }
        }
        let from = |shift: usize| &padded[shift * channels..][..length];
        start_again(from(reach), self.taps[0], flat);
        for by in (1..=reach).rev() {
            add_again(from(reach - by), from(reach + by), self.taps[by], flat);
        }
        // Split the channels.
        for (channel, line) in out.chunks_exact_mut(self.frame.stride).enumerate() {
            for (out, value) in line[1..].iter_mut().zip(flat.chunks_exact(channels)) {
                *out = value[channel];
            }
            line[0] = line[columns];
            line[columns + 1] = line[1];
        }
    }

    /// Maps a coordinate onto the axis: modulo the length if the axis wraps, else mirrored at the
    /// ends.
    fn resolve(&self, axis: usize, i: isize) -> usize {
        let n = self.frame.shape[axis] as isize;
        if (0..n).contains(&i) {
            return i as usize;
        }
        if self.frame.wrap[axis] {
            return i.rem_euclid(n) as usize;
        }
        let i = i.rem_euclid(2 * n);
        i.min(2 * n - 1 - i) as usize
    }
}

wide_fn! {
    fn start(row: &[f32], tap: f64, out: &mut [f64]) {
        for (out, &x) in out.iter_mut().zip(row) {
            *out = f64::from(x) * tap;
        }
    }
}

wide_fn! {
    fn add(one: &[f32], other: &[f32], tap: f64, out: &mut [f64]) {
        for ((out, &a), &b) in out.iter_mut().zip(one).zip(other) {
            *out += (f64::from(a) + f64::from(b)) * tap;
        }
    }
}

wide_fn! {
    fn start_again(row: &[f64], tap: f64, out: &mut [f64]) {
        for (out, x) in out.iter_mut().zip(row) {
            *out = x * tap;
        }
    }
}

wide_fn! {
    fn add_again(one: &[f64], other: &[f64], tap: f64, out: &mut [f64]) {
        for ((out, a), b) in out.iter_mut().zip(one).zip(other) {
            *out += (a + b) * tap;
        }
    }
}
