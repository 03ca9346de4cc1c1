//! One resolution of the grid and its operator.

use super::CHUNK;
use crate::par;

/// One resolution. Arrays have a margin of one on each side: zero, or what lies across a cyclic axis.
pub(super) struct Level {
    pub(super) rows: usize,
    pub(super) columns: usize,
    pub(super) wrap: [bool; 2],
    /// Weight of the link to the next row, to the next column, and the sum of all at a pixel.
    pub(super) down: Vec<f32>,
    pub(super) right: Vec<f32>,
    pub(super) diagonal: Vec<f32>,
    pub(super) reciprocal: Vec<f32>,
    /// Parts of the diagonal that tie a pixel to a fixed one, and to the image.
    pub(super) tied: Vec<f32>,
    pub(super) screened: Vec<f32>,
}

/// Vectors of one level.
pub(super) struct Vectors {
    pub(super) x: Vec<f32>,
    pub(super) other: Vec<f32>,
    pub(super) b: Vec<f32>,
}

impl Level {
    pub(super) fn empty(rows: usize, columns: usize, wrap: [bool; 2]) -> Self {
        let zeros = || vec![0.0; (rows + 2) * (columns + 2)];
        Self {
            rows,
            columns,
            wrap,
            down: zeros(),
            right: zeros(),
            diagonal: zeros(),
            reciprocal: zeros(),
            tied: zeros(),
            screened: zeros(),
        }
    }

    pub(super) fn vectors(&self) -> Vectors {
        let zeros = || vec![0.0; self.len()];
        Vectors {
            x: zeros(),
            other: zeros(),
            b: zeros(),
        }
    }

    pub(super) fn len(&self) -> usize {
        (self.rows + 2) * self.stride()
    }

    pub(super) fn stride(&self) -> usize {
        self.columns + 2
    }

    pub(super) fn at(&self, row: usize, column: usize) -> usize {
        (row + 1) * self.stride() + column + 1
    }

    pub(super) fn coarser(&self) -> Self {
        let mut coarse = Self::empty(self.rows.div_ceil(2), self.columns.div_ceil(2), self.wrap);
        for r in 0..self.rows {
            for c in 0..self.columns {
                let (i, to) = (self.at(r, c), coarse.at(r / 2, c / 2));
                if (r + 1) % self.rows / 2 != r / 2 {
                    coarse.down[to] += 0.5 * self.down[i];
                }
                if (c + 1) % self.columns / 2 != c / 2 {
                    coarse.right[to] += 0.5 * self.right[i];
                }
                coarse.tied[to] += 0.5 * self.tied[i];
                coarse.screened[to] += self.screened[i];
            }
        }
        coarse.finish();
        coarse
    }

    /// Copies what lies across cyclic axes into the margins, and sums up the diagonal.
    pub(super) fn finish(&mut self) {
        for links in [&mut self.down, &mut self.right] {
            margins(links, self.rows, self.columns, self.wrap);
        }
        let stride = self.stride();
        for r in 0..self.rows {
            for c in 0..self.columns {
                let i = self.at(r, c);
                let sum = self.down[i]
                    + self.down[i - stride]
                    + self.right[i]
                    + self.right[i - 1]
                    + self.tied[i]
                    + self.screened[i];
                self.diagonal[i] = sum;
                self.reciprocal[i] = if sum > 0.0 { 1.0 / sum } else { 0.0 };
            }
        }
    }

    /// Rows of a chunk.
    pub(super) fn chunk(&self) -> usize {
        (CHUNK / self.stride()).max(1)
    }

    /// Calls `f(row, samples)` for each row of `data`, margins left out, then fills the margins.
    pub(super) fn each_row(&self, data: &mut [f32], f: impl Fn(usize, &mut [f32]) + Sync + Send) {
        let (stride, rows) = (self.stride(), self.chunk());
        par::chunks_mut(data, rows * stride, |chunk, out| {
            for (r, row) in out.chunks_exact_mut(stride).enumerate() {
                let r = chunk * rows + r;
                if (1..=self.rows).contains(&r) {
                    f(r - 1, &mut row[1..=self.columns]);
                }
            }
        });
        margins(data, self.rows, self.columns, self.wrap);
    }

    /// `A x`.
    pub(super) fn apply(&self, x: &[f32], out: &mut [f32]) {
        self.each_row(out, |r, out| simd::row::<PRODUCT>(self, r, x, x, 0.0, out));
    }

    /// `b - A x`.
    pub(super) fn lack(&self, x: &[f32], b: &[f32], out: &mut [f32]) {
        self.each_row(out, |r, out| simd::row::<LACK>(self, r, x, b, 0.0, out));
    }

    pub(super) fn relax(&self, v: &mut Vectors, step: f32) {
        let Vectors { x, other, b } = v;
        self.each_row(other, |r, out| simd::row::<RELAX>(self, r, x, b, step, out));
        std::mem::swap(x, other);
    }

    /// The first relaxation of nothing.
    pub(super) fn begin(&self, v: &mut Vectors, step: f32) {
        let Vectors { x, b, .. } = v;
        par::chunks_mut(x, CHUNK, |i, x| {
            let (b, d) = (&b[i * CHUNK..], &self.reciprocal[i * CHUNK..]);
            for ((x, b), d) in x.iter_mut().zip(b).zip(d) {
                *x = step * d * b;
            }
        });
        margins(x, self.rows, self.columns, self.wrap);
    }
}

const PRODUCT: u8 = 0;
const LACK: u8 = 1;
const RELAX: u8 = 2;

/// One row of the operator. The answer is within the tolerance whatever the registers.
mod simd {
    use super::{LACK, Level, PRODUCT};

    #[allow(unsafe_code)] // measured: half as much time again with the baseline instructions
    pub(super) fn row<const WHAT: u8>(
        level: &Level,
        r: usize,
        x: &[f32],
        b: &[f32],
        step: f32,
        out: &mut [f32],
    ) {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the CPU has the feature that the function is compiled for.
                return unsafe { row_avx2::<WHAT>(level, r, x, b, step, out) };
            }
        }
        row_any::<WHAT>(level, r, x, b, step, out);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn row_avx2<const WHAT: u8>(
        level: &Level,
        r: usize,
        x: &[f32],
        b: &[f32],
        step: f32,
        out: &mut [f32],
    ) {
        row_any::<WHAT>(level, r, x, b, step, out);
    }

    #[inline(always)]
    fn row_any<const WHAT: u8>(
        level: &Level,
        r: usize,
        x: &[f32],
        b: &[f32],
        step: f32,
        out: &mut [f32],
    ) {
        let (n, stride) = (out.len(), level.stride());
        let start = level.at(r, 0);
        let here = &x[start..][..n];
        let (before, after) = (&x[start - 1..][..n], &x[start + 1..][..n]);
        let (above, below) = (&x[start - stride..][..n], &x[start + stride..][..n]);
        let (down, up) = (
            &level.down[start..][..n],
            &level.down[start - stride..][..n],
        );
        let (right, left) = (&level.right[start..][..n], &level.right[start - 1..][..n]);
        let (diagonal, reciprocal) = (
            &level.diagonal[start..][..n],
            &level.reciprocal[start..][..n],
        );
        let b = &b[start..][..n];
        for i in 0..n {
            let around = (down[i] * below[i] + up[i] * above[i])
                + (right[i] * after[i] + left[i] * before[i]);
            let product = diagonal[i] * here[i] - around;
            out[i] = match WHAT {
                PRODUCT => product,
                LACK => b[i] - product,
                _ => here[i] + step * reciprocal[i] * (b[i] - product),
            };
        }
    }
}

pub(super) fn margins(data: &mut [f32], rows: usize, columns: usize, wrap: [bool; 2]) {
    let stride = columns + 2;
    if wrap[1] {
        for row in data.chunks_exact_mut(stride) {
            row[0] = row[columns];
            row[columns + 1] = row[1];
        }
    }
    if wrap[0] {
        data.copy_within(rows * stride..(rows + 1) * stride, 0);
        data.copy_within(stride..2 * stride, (rows + 1) * stride);
    }
}
