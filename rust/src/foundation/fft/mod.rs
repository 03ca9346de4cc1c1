//! Fourier transforms: of lines of complex numbers, and of images and volumes of real ones. The only folder that names the
//! FFT crates.
//!
//! None is normalised: there and back multiplies by the number of points.

mod volumes;

use std::sync::Arc;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
pub(crate) use rustfft::num_complex::Complex;
use rustfft::{Fft, FftNum, FftPlanner};
pub(crate) use volumes::Volumes;

/// Rows of an image that are transposed at a time.
const GROUP: usize = 8;

/// Transforms of lines of one length, in place.
pub(crate) struct Lines<T> {
    forward: Arc<dyn Fft<T>>,
    inverse: Arc<dyn Fft<T>>,
}

impl<T: FftNum + Default> Lines<T> {
    /// Plans the transforms of `len` points.
    pub(crate) fn new(len: usize) -> Self {
        let mut planner = FftPlanner::new();
        Self {
            forward: planner.plan_fft_forward(len),
            inverse: planner.plan_fft_inverse(len),
        }
    }

    /// Transforms one or several lines; `work` is memory to be kept for the next call.
    pub(crate) fn forward(&self, lines: &mut [Complex<T>], work: &mut Vec<Complex<T>>) {
        let work = grow(work, self.forward.get_inplace_scratch_len());
        self.forward.process_with_scratch(lines, work);
    }

    /// Transforms one or several lines back.
    pub(crate) fn inverse(&self, lines: &mut [Complex<T>], work: &mut Vec<Complex<T>>) {
        let work = grow(work, self.inverse.get_inplace_scratch_len());
        self.inverse.process_with_scratch(lines, work);
    }
}

/// Transforms of real images of one size. A spectrum is the half that tells the rest, transposed, frequency of the
/// columns first, so that both passes run over contiguous memory.
pub(crate) struct Images<T> {
    size: [usize; 2],
    rows_forward: Arc<dyn RealToComplex<T>>,
    rows_inverse: Arc<dyn ComplexToReal<T>>,
    columns: Lines<T>,
}

/// What a transform of an image needs besides its input and output.
#[derive(Default)]
pub(crate) struct Scratch<T> {
    real: Vec<T>,
    rows: Vec<Complex<T>>,
    work: Vec<Complex<T>>,
}

impl<T: FftNum + Default> Images<T> {
    /// Plans the transforms of images of `size` rows and columns; these must be even.
    pub(crate) fn new(size: [usize; 2]) -> Self {
        let mut planner = RealFftPlanner::new();
        Self {
            size,
            rows_forward: planner.plan_fft_forward(size[1]),
            rows_inverse: planner.plan_fft_inverse(size[1]),
            columns: Lines::new(size[0]),
        }
    }

    /// Rows and columns.
    pub(crate) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Complex numbers of a spectrum.
    pub(crate) fn len(&self) -> usize {
        (self.size[1] / 2 + 1) * self.size[0]
    }

    /// Writes the spectrum of `rows` rows, which `row(r, out)` writes into zeros; those that lack are zero.
    pub(crate) fn forward(
        &self,
        rows: usize,
        mut row: impl FnMut(usize, &mut [T]),
        spectrum: &mut Vec<Complex<T>>,
        scratch: &mut Scratch<T>,
    ) {
        let [height, width] = self.size;
        let real = grow(&mut scratch.real, width);
        let out = grow(&mut scratch.rows, width / 2 + 1);
        let work = grow(&mut scratch.work, self.rows_forward.get_scratch_len());
        spectrum.clear();
        spectrum.resize(self.len(), Complex::default());
        for r in 0..rows.min(height) {
            real.fill(T::default());
            row(r, real);
            // The lengths are those of the plan, so the transform cannot refuse them.
            let _ = self.rows_forward.process_with_scratch(real, out, work);
            for (k, &value) in out.iter().enumerate() {
                spectrum[k * height + r] = value;
            }
        }
        self.columns.forward(spectrum, &mut scratch.work);
    }

    /// Passes the first `rows` rows of the inverse of `spectrum`, which is used up, to `take(r, row)`.
    pub(crate) fn inverse(
        &self,
        spectrum: &mut [Complex<T>],
        rows: usize,
        mut take: impl FnMut(usize, &[T]),
        scratch: &mut Scratch<T>,
    ) {
        let [height, width] = self.size;
        let half = width / 2 + 1;
        self.columns.inverse(spectrum, &mut scratch.work);
        let real = grow(&mut scratch.real, width);
        let lines = grow(&mut scratch.rows, half * GROUP);
        let work = grow(&mut scratch.work, self.rows_inverse.get_scratch_len());
        for first in (0..rows).step_by(GROUP) {
            let group = GROUP.min(rows - first);
            for k in 0..half {
                let column = &spectrum[k * height + first..][..group];
                for (r, &z) in column.iter().enumerate() {
                    lines[r * half + k] = z;
                }
            }
            for (r, line) in lines.chunks_exact_mut(half).take(group).enumerate() {
                // Of a real row these are real; rounding left a trace that the transform would refuse.
                line[0].im = T::default();
                line[half - 1].im = T::default();
                let _ = self.rows_inverse.process_with_scratch(line, real, work);
                take(first + r, real);
            }
        }
    }
}

/// The first `len` numbers of a buffer that is made longer where it must be.
fn grow<T: Clone + Default>(buffer: &mut Vec<T>, len: usize) -> &mut [T] {
    if buffer.len() < len {
        buffer.resize(len, T::default());
    }
    &mut buffer[..len]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::foundation::hash::Noise;

    #[test]
    fn there_and_back_multiplies_by_the_points() {
        let noise = Noise::new(2);
        for size in [[1, 2], [7, 6], [12, 40], [20, 10]] {
            let plan = Images::<f64>::new(size);
            let image = |r: usize, c: usize| noise.uniform([r as u32, c as u32, 0, 0]) - 0.5;
            let (mut spectrum, mut scratch) = (Vec::new(), Scratch::default());
            let rows = size[0].div_ceil(2);
            let write = |r: usize, out: &mut [f64]| {
                out.iter_mut()
                    .enumerate()
                    .for_each(|(c, x)| *x = image(r, c))
            };
            plan.forward(rows, write, &mut spectrum, &mut scratch);
            assert_eq!(spectrum.len(), plan.len());
            let total: f64 = (0..rows)
                .flat_map(|r| (0..size[1]).map(move |c| image(r, c)))
                .sum();
            assert!((spectrum[0].re - total).abs() < 1e-12);
            let points = (size[0] * size[1]) as f64;
            let mut seen = 0;
            let check = |r: usize, row: &[f64]| {
                for (c, x) in row.iter().enumerate() {
                    let wanted = if r < rows { image(r, c) } else { 0.0 };
                    assert!((x / points - wanted).abs() < 1e-12);
                }
                seen += 1;
            };
            plan.inverse(&mut spectrum, size[0], check, &mut scratch);
            assert_eq!(seen, size[0]);
        }
    }
}
