//! The fast filter: cost maps by blocked Fourier correlation, with a bound on their error.
//!
//! An exemplar is cut into overlapping blocks whose spectra are kept (overlap-save: Oppenheim and Schafer,
//! *Discrete-Time Signal Processing*, 8.7.3). Blocks stay in the second-level cache and are the grain of parallelism.
//! Spectra are stored transposed, frequency of the columns first, so that both passes run over contiguous memory.

use std::sync::Arc;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

/// Values multiplied at a time.
const LANES: usize = 16;

/// Transforms of one block size.
pub(super) struct Plan {
    /// Rows and columns of a block.
    pub(super) size: [usize; 2],
    /// Distance between the corners of neighbouring blocks.
    step: [usize; 2],
    /// Arithmetic of a search, in rough units of one multiplication and addition.
    pub(super) work: f64,
    rows_forward: Arc<dyn RealToComplex<f32>>,
    rows_inverse: Arc<dyn ComplexToReal<f32>>,
    columns_forward: Arc<dyn Fft<f32>>,
    columns_inverse: Arc<dyn Fft<f32>>,
}

/// What one task needs besides its input and output.
#[derive(Default)]
pub(super) struct Scratch {
    transposed: Vec<Complex<f32>>,
    rows: Vec<Complex<f32>>,
    real: Vec<f32>,
    work: Vec<Complex<f32>>,
}

/// A spectrum that multiplies others: real parts doubled up, imaginary parts with alternating sign, so that
/// `(s * a + swap(s) * b)` is a complex product over interleaved numbers.
#[derive(Default)]
pub(super) struct Multiplier {
    a: Vec<f32>,
    b: Vec<f32>,
}

impl Plan {
    /// The cheapest block size for exemplars of `shapes` searched for patches up to `patch`.
    pub(super) fn new(shapes: &[[usize; 2]], patch: [usize; 2], layers: usize) -> Self {
        let longest = |axis: usize| shapes.iter().map(|s| s[axis]).max().unwrap_or(1);
        let lengths = |axis: usize| {
            let (least, most) = (patch[axis], longest(axis).max(patch[axis]));
            let mut all: Vec<usize> = (2..40)
                .flat_map(|a| [1usize << a, 3 << (a - 1)])
                .filter(|&n| n >= least && n % 2 == 0)
                .collect();
            all.sort_unstable();
            let enough = all.iter().position(|&n| n >= most).unwrap_or(0);
            all.truncate(enough + 1);
            all
        };
        let (mut best, mut size) = (f64::INFINITY, [2, 2]);
        for &rows in &lengths(0) {
            for &columns in &lengths(1) {
                let points = (rows * columns) as f64;
                let log = points.log2();
                let blocks: usize = shapes
                    .iter()
                    .map(|s| {
                        starts(s[0], rows, patch[0]).len() * starts(s[1], columns, patch[1]).len()
                    })
                    .sum();
                let work = points
                    * (blocks as f64 * (1.25 * log + 4.0 * layers as f64)
                        + layers as f64 * (0.75 * log + 4.0));
                if work < best {
                    (best, size) = (work, [rows, columns]);
                }
            }
        }
        let (mut real, mut complex) = (RealFftPlanner::new(), FftPlanner::new());
        Self {
            size,
            step: [size[0] - patch[0] + 1, size[1] - patch[1] + 1],
            work: best,
            rows_forward: real.plan_fft_forward(size[1]),
            rows_inverse: real.plan_fft_inverse(size[1]),
            columns_forward: complex.plan_fft_forward(size[0]),
            columns_inverse: complex.plan_fft_inverse(size[0]),
        }
    }

    /// Corners of the blocks that cover an exemplar. The last of an axis reaches its end.
    pub(super) fn corners(&self, shape: [usize; 2]) -> Vec<[usize; 2]> {
        let patch = [
            self.size[0] + 1 - self.step[0],
            self.size[1] + 1 - self.step[1],
        ];
        let columns = starts(shape[1], self.size[1], patch[1]);
        starts(shape[0], self.size[0], patch[0])
            .into_iter()
            .flat_map(|r| columns.iter().map(move |&c| [r, c]))
            .collect()
    }

    /// How many positions of a patch of `patch` the block at `corner` answers for, per axis.
    pub(super) fn valid(
        &self,
        shape: [usize; 2],
        corner: [usize; 2],
        patch: [usize; 2],
    ) -> [usize; 2] {
        std::array::from_fn(|axis| {
            let left = (shape[axis] + 1).saturating_sub(corner[axis] + patch[axis]);
            if corner[axis] + self.size[axis] >= shape[axis] {
                left
            } else {
                left.min(self.step[axis])
            }
        })
    }

    /// Complex numbers in a spectrum.
    pub(super) fn len(&self) -> usize {
        (self.size[1] / 2 + 1) * self.size[0]
    }

    /// Bound of the error of a correlation, relative to the norms that [`Self::correlate`] and its caller give.
    ///
    /// Higham, *Accuracy and Stability of Numerical Algorithms*, theorem 24.2: a transform of 2^t points errs by at
    /// most t (1 + 4 sqrt 2) u in the 2-norm; 8 u is used for 6.7 u. The rest is for products and rounded inputs.
    pub(super) fn epsilon(&self, layers: usize) -> f64 {
        let log = ((self.size[0] * self.size[1]) as f64).log2();
        f64::from(f32::EPSILON) * 0.5 * (8.0 * log.ceil() + 16.0 + layers as f64)
    }

    /// The transposed spectrum of `rows` rows, which `row(r, out)` writes into zeros; left in `scratch`.
    fn forward(&self, rows: usize, mut row: impl FnMut(usize, &mut [f32]), scratch: &mut Scratch) {
        let [height, width] = self.size;
        let half = width / 2 + 1;
        fit(&mut scratch.real, width);
        fit(&mut scratch.rows, half);
        fit(
            &mut scratch.work,
            self.rows_forward
                .get_scratch_len()
                .max(self.columns_forward.get_inplace_scratch_len()),
        );
        scratch.transposed.clear();
        scratch.transposed.resize(half * height, Complex::default());
        for r in 0..rows.min(height) {
            scratch.real.fill(0.0);
            row(r, &mut scratch.real);
            // The lengths are those of the plan, so the transform cannot refuse them.
            let _ = self.rows_forward.process_with_scratch(
                &mut scratch.real,
                &mut scratch.rows,
                &mut scratch.work[..self.rows_forward.get_scratch_len()],
            );
            for (k, &value) in scratch.rows.iter().enumerate() {
                scratch.transposed[k * height + r] = value;
            }
        }
        self.columns_forward.process_with_scratch(
            &mut scratch.transposed,
            &mut scratch.work[..self.columns_forward.get_inplace_scratch_len()],
        );
    }

    /// The spectrum of a block, interleaved into `out`.
    pub(super) fn spectrum(
        &self,
        rows: usize,
        row: impl FnMut(usize, &mut [f32]),
        out: &mut [f32],
        scratch: &mut Scratch,
    ) {
        self.forward(rows, row, scratch);
        for (pair, z) in out.chunks_exact_mut(2).zip(&scratch.transposed) {
            pair[0] = z.re;
            pair[1] = z.im;
        }
    }

    /// The multiplier that correlates with a kernel of `rows` rows.
    pub(super) fn multiplier(
        &self,
        rows: usize,
        row: impl FnMut(usize, &mut [f32]),
        out: &mut Multiplier,
        scratch: &mut Scratch,
    ) {
        self.forward(rows, row, scratch);
        let norm = 1.0 / (self.size[0] * self.size[1]) as f32;
        fit(&mut out.a, 2 * self.len());
        fit(&mut out.b, 2 * self.len());
        for ((a, b), z) in out
            .a
            .chunks_exact_mut(2)
            .zip(out.b.chunks_exact_mut(2))
            .zip(&scratch.transposed)
        {
            a.fill(z.re * norm);
            b.copy_from_slice(&[z.im * norm, -z.im * norm]);
        }
    }

    /// The first `valid` rows and columns of the sum of correlations; returns a bound of the 2-norm of the whole block.
    ///
    /// `spectra` holds the block's layers one after the other.
    pub(super) fn correlate(
        &self,
        spectra: &[f32],
        multipliers: &[Multiplier],
        valid: [usize; 2],
        out: &mut [f32],
        scratch: &mut Scratch,
    ) -> f64 {
        let [height, width] = self.size;
        let half = width / 2 + 1;
        fit(&mut scratch.transposed, half * height);
        fit(&mut scratch.real, width);
        fit(&mut scratch.rows, half * GROUP);
        fit(
            &mut scratch.work,
            self.rows_inverse
                .get_scratch_len()
                .max(self.columns_inverse.get_inplace_scratch_len()),
        );
        let squares = simd::multiply(spectra, multipliers, &mut scratch.transposed);
        self.columns_inverse.process_with_scratch(
            &mut scratch.transposed,
            &mut scratch.work[..self.columns_inverse.get_inplace_scratch_len()],
        );
        for first in (0..valid[0]).step_by(GROUP) {
            let group = GROUP.min(valid[0] - first);
            for k in 0..half {
                let column = &scratch.transposed[k * height + first..][..group];
                for (r, &z) in column.iter().enumerate() {
                    scratch.rows[r * half + k] = z;
                }
            }
            for r in 0..group {
                let row = &mut scratch.rows[r * half..][..half];
                row[0].im = 0.0;
                row[half - 1].im = 0.0;
                let _ = self.rows_inverse.process_with_scratch(
                    row,
                    &mut scratch.real,
                    &mut scratch.work[..self.rows_inverse.get_scratch_len()],
                );
                out[(first + r) * valid[1]..][..valid[1]]
                    .copy_from_slice(&scratch.real[..valid[1]]);
            }
        }
        // Parseval; the half spectrum counts twice. The multiplier carries 1 / points.
        (2.02 * squares * (height * width) as f64).sqrt()
    }
}

/// Rows transposed at a time.
const GROUP: usize = 8;

/// First positions of the blocks of an axis: blocks of `size` share `patch - 1` samples.
fn starts(length: usize, size: usize, patch: usize) -> Vec<usize> {
    let step = size - patch + 1;
    let blocks = 1 + length.saturating_sub(size).div_ceil(step);
    (0..blocks).map(|b| b * step).collect()
}

fn fit<T: Clone + Default>(buffer: &mut Vec<T>, len: usize) {
    if buffer.len() != len {
        buffer.clear();
        buffer.resize(len, T::default());
    }
}

/// Products of spectra. They only filter (every match is scored again, exactly), so each CPU may round its own way.
mod simd {
    use super::{Complex, LANES, Multiplier};

    /// Sum over layers of spectrum times multiplier; returns the sum of the squares of the result.
    #[allow(unsafe_code)] // measured: the block search is a third faster than with the baseline instructions
    pub(super) fn multiply(
        spectra: &[f32],
        multipliers: &[Multiplier],
        out: &mut [Complex<f32>],
    ) -> f64 {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the CPU has the feature that the function is compiled for.
                return unsafe { multiply_avx2(spectra, multipliers, out) };
            }
        }
        multiply_any(spectra, multipliers, out)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn multiply_avx2(spectra: &[f32], multipliers: &[Multiplier], out: &mut [Complex<f32>]) -> f64 {
        multiply_any(spectra, multipliers, out)
    }

    #[inline(always)]
    fn multiply_any(spectra: &[f32], multipliers: &[Multiplier], out: &mut [Complex<f32>]) -> f64 {
        let values = 2 * out.len();
        let mut squares = [0.0f64; 4];
        let mut chunks = out.chunks_exact_mut(LANES / 2);
        let mut at = 0;
        for chunk in &mut chunks {
            let mut sum = [0.0f32; LANES];
            for (layer, m) in multipliers.iter().enumerate() {
                let s = &spectra[layer * values + at..][..LANES];
                let (a, b) = (&m.a[at..][..LANES], &m.b[at..][..LANES]);
                for j in 0..LANES {
                    sum[j] += s[j] * a[j] + s[j ^ 1] * b[j];
                }
            }
            let mut square = [0.0f32; 4];
            for j in 0..LANES {
                square[j % 4] += sum[j] * sum[j];
            }
            for (j, z) in chunk.iter_mut().enumerate() {
                *z = Complex::new(sum[2 * j], sum[2 * j + 1]);
            }
            for j in 0..4 {
                squares[j] += f64::from(square[j]);
            }
            at += LANES;
        }
        for z in chunks.into_remainder() {
            let mut sum = [0.0f32; 2];
            for (layer, m) in multipliers.iter().enumerate() {
                let s = &spectra[layer * values + at..][..2];
                let (a, b) = (&m.a[at..][..2], &m.b[at..][..2]);
                for j in 0..2 {
                    sum[j] += s[j] * a[j] + s[j ^ 1] * b[j];
                }
            }
            *z = Complex::new(sum[0], sum[1]);
            squares[0] += f64::from(sum[0]).powi(2) + f64::from(sum[1]).powi(2);
            at += 2;
        }
        squares.iter().sum()
    }
}
