//! Fourier transforms of lines of complex numbers and of real images and volumes. Only this folder
//! uses the FFT crate.
//!
//! Transforms are not normalised: a forward transform followed by an inverse transform multiplies
//! the values by the number of points. Two real lines are transformed together as one complex line
//! (Press et al., *Numerical Recipes*, 12.3).

mod lanes;
mod volumes;

use std::sync::Arc;

pub(crate) use lanes::{LANES, Lanes};
pub(crate) use rustfft::num_complex::Complex;
use rustfft::{Fft, FftDirection, FftNum, FftPlanner, FftPlannerScalar};
pub(crate) use volumes::Volumes;

/// Number of image rows that are transposed together.
const GROUP: usize = 8;

/// In-place transforms of lines of one length.
pub(crate) struct Lines<T> {
    forward: Arc<dyn Fft<T>>,
    inverse: Arc<dyn Fft<T>>,
}

impl<T: FftNum + Default> Lines<T> {
    /// Plans the transforms of `len` points. The order of sums is the same on every machine.
    pub(crate) fn new(len: usize) -> Self {
        Self::plan(|way| FftPlannerScalar::new().plan_fft(len, way))
    }

    fn plan(plan: impl Fn(FftDirection) -> Arc<dyn Fft<T>>) -> Self {
        Self {
            forward: plan(FftDirection::Forward),
            inverse: plan(FftDirection::Inverse),
        }
    }

    /// Transforms one or several lines. `work` is scratch memory, which the caller keeps for the
    /// next call.
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

impl Lines<f32> {
    /// Plans the transforms of `len` points with the fastest code for the processor, which takes
    /// half the time.
    ///
    /// The last bits depend on the processor, so no result may depend on them. Only f32 is
    /// supported, because each further type would be compiled for every processor as well.
    fn fastest(len: usize) -> Self {
        Self::plan(|way| FftPlanner::new().plan_fft(len, way))
    }
}

/// Splits a frequency of `a + i b` and the mirrored frequency into the frequencies of the real
/// lines `a` and `b`.
#[inline(always)]
pub(crate) fn split<T: FftNum>(z: Complex<T>, mirror: Complex<T>) -> (Complex<T>, Complex<T>) {
    let half = T::one() / (T::one() + T::one());
    (
        Complex::new(half * (z.re + mirror.re), half * (z.im - mirror.im)),
        Complex::new(half * (z.im + mirror.im), half * (mirror.re - z.re)),
    )
}

/// Writes the spectrum of `a + i b` from the half spectra of the real lines `a` and `b`. The other
/// halves follow by symmetry.
#[inline(always)]
fn join<T: FftNum>(line: &mut [Complex<T>], half: impl Fn(usize) -> (Complex<T>, Complex<T>)) {
    let n = line.len();
    for k in 0..=n / 2 {
        let (a, b) = half(k);
        if k == 0 || 2 * k == n {
            // These frequencies of a real line are real, except for rounding errors.
            line[k] = Complex::new(a.re, b.re);
        } else {
            line[k] = Complex::new(a.re - b.im, a.im + b.re);
            line[n - k] = Complex::new(a.re + b.im, b.re - a.im);
        }
    }
}

/// Transforms of real images of one size.
///
/// A spectrum contains only the half that determines the rest. It is transposed, with frequencies
/// of the columns first, so that both passes run over contiguous memory.
pub(crate) struct Images<T> {
    size: [usize; 2],
    rows: Lines<T>,
    columns: Lines<T>,
}

/// Scratch memory of a transform of an image.
#[derive(Default)]
pub(crate) struct Scratch<T> {
    real: Vec<T>,
    lines: Vec<Complex<T>>,
    work: Vec<Complex<T>>,
}

impl<T: FftNum + Default> Images<T> {
    /// Plans the transforms of images of `size` rows and columns. The order of sums is the same on
    /// every machine.
    pub(crate) fn new(size: [usize; 2]) -> Self {
        let [columns, rows] = size.map(Lines::new);
        Self {
            size,
            rows,
            columns,
        }
    }

    /// Number of rows and columns.
    pub(crate) fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Number of complex values of a spectrum.
    pub(crate) fn len(&self) -> usize {
        (self.size[1] / 2 + 1) * self.size[0]
    }

    /// Computes the spectrum of an image whose first `rows` rows are given. `row(r, out)` writes row `r` into an array
    /// of zeros. The other rows are zero.
    pub(crate) fn forward(
        &self,
        rows: usize,
        mut row: impl FnMut(usize, &mut [T]),
        spectrum: &mut Vec<Complex<T>>,
        scratch: &mut Scratch<T>,
    ) {
        let [height, width] = self.size;
        let rows = rows.min(height);
        let real = grow(&mut scratch.real, 2 * width);
        let line = grow(&mut scratch.lines, width);
        spectrum.clear();
        spectrum.resize(self.len(), Complex::default());
        // Transform two real rows together as one complex line.
        for first in (0..rows).step_by(2) {
            real.fill(T::default());
            let pair = 2.min(rows - first);
            for (r, out) in real.chunks_exact_mut(width).take(pair).enumerate() {
                row(first + r, out);
            }
            let (a, b) = real.split_at(width);
            for ((z, &a), &b) in line.iter_mut().zip(a).zip(b) {
                *z = Complex::new(a, b);
            }
            self.rows.forward(line, &mut scratch.work);
            for k in 0..=width / 2 {
                let (a, b) = split(line[k], line[(width - k) % width]);
                let out = &mut spectrum[k * height + first..][..pair];
                out.copy_from_slice(&[a, b][..pair]);
            }
        }
        self.columns.forward(spectrum, &mut scratch.work);
    }

    /// Computes the inverse of `spectrum` and passes its first `rows` rows to `take(r, row)`. The
    /// contents of `spectrum` are destroyed.
    pub(crate) fn inverse(
        &self,
        spectrum: &mut [Complex<T>],
        rows: usize,
        mut take: impl FnMut(usize, &[T]),
        scratch: &mut Scratch<T>,
    ) {
        let [height, width] = self.size;
        self.columns.inverse(spectrum, &mut scratch.work);
        let real = grow(&mut scratch.real, width);
        let lines = grow(&mut scratch.lines, width * GROUP / 2);
        // Transpose a group of rows, and transform its rows in pairs.
        for first in (0..rows).step_by(GROUP) {
            let group = GROUP.min(rows - first);
            let lines = &mut lines[..width * group.div_ceil(2)];
            for (pair, line) in lines.chunks_exact_mut(width).enumerate() {
                let at = first + 2 * pair;
                join(line, |k| {
                    let column = &spectrum[k * height..][..height];
                    let b = column.get(at + 1).copied().unwrap_or_default();
                    (column[at], b)
                });
            }
            self.rows.inverse(lines, &mut scratch.work);
            for r in 0..group {
                let line = &lines[r / 2 * width..][..width];
                for (x, z) in real.iter_mut().zip(line) {
                    *x = if r % 2 == 0 { z.re } else { z.im };
                }
                take(first + r, real);
            }
        }
    }
}

impl Images<f32> {
    /// Plans the transforms of images of `size` rows and columns, like [`Lines::fastest`].
    pub(crate) fn fastest(size: [usize; 2]) -> Self {
        let [columns, rows] = size.map(Lines::fastest);
        Self {
            size,
            rows,
            columns,
        }
    }
}

/// Returns the first `len` values of a buffer, which grows if necessary.
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

    /// Checks that the first frequency is the sum of the image, and that the inverse transform
    /// restores the image within `most`.
    fn check<T: FftNum + Default + Into<f64>>(plan: &Images<T>, most: f64) {
        let (size, noise) = (plan.size(), Noise::new(2));
        let image = |r: usize, c: usize| noise.uniform([r as u32, c as u32, 0, 0]) - 0.5;
        let (mut spectrum, mut scratch) = (Vec::new(), Scratch::default());
        let rows = size[0].div_ceil(2);
        let write = |r: usize, out: &mut [T]| {
            out.iter_mut()
                .enumerate()
                .for_each(|(c, x)| *x = T::from_f64(image(r, c)).unwrap());
        };
        plan.forward(rows, write, &mut spectrum, &mut scratch);
        assert_eq!(spectrum.len(), plan.len());
        let total: f64 = (0..rows)
            .flat_map(|r| (0..size[1]).map(move |c| image(r, c)))
            .sum();
        assert!((spectrum[0].re.into() - total).abs() < most);
        let points = (size[0] * size[1]) as f64;
        let mut seen = 0;
        let check = |r: usize, row: &[T]| {
            for (c, &x) in row.iter().enumerate() {
                let wanted = if r < rows { image(r, c) } else { 0.0 };
                assert!((x.into() / points - wanted).abs() < most);
            }
            seen += 1;
        };
        plan.inverse(&mut spectrum, size[0], check, &mut scratch);
        assert_eq!(seen, size[0]);
    }

    #[test]
    fn there_and_back_multiplies_by_the_points() {
        for size in [[1, 2], [7, 6], [12, 40], [20, 10], [9, 5], [1, 1]] {
            check(&Images::<f64>::new(size), 1e-12);
            check(&Images::<f32>::new(size), 1e-4);
            check(&Images::fastest(size), 1e-4);
        }
    }
}
