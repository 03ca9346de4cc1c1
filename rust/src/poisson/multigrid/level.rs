//! One resolution of the grid: its operator, and the ways to the next one.

use super::CHUNK;
use crate::par;
use crate::poisson::wide::wide;

/// What lies beyond one side of a grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// Fixed pixels: zero.
    Fixed,
    /// The outermost pixels once more, so that no difference crosses the side.
    Mirror,
    /// The other side.
    Wrap,
}

/// One resolution. Arrays have a margin of one on each side, and room for an even number of rows and columns.
///
/// The operator is `diagonal * x` less the four neighbours: what is not free holds 0, so that links need no weights.
pub(super) struct Level {
    pub(super) rows: usize,
    pub(super) columns: usize,
    /// Low and high side of the rows' and of the columns' axis.
    sides: [[Side; 2]; 2],
    /// 0 at what is not free, as are the reciprocals.
    diagonal: Vec<f32>,
    reciprocal: Vec<f32>,
    /// The part of the diagonal that ties a pixel to fixed ones.
    tied: Vec<f32>,
    screening: f32,
}

/// Vectors of one level.
pub(super) struct Vectors {
    pub(super) x: Vec<f32>,
    pub(super) other: Vec<f32>,
    pub(super) b: Vec<f32>,
}

/// Share of the children's ties to fixed pixels that a parent has. Two links side by side make one, which is half of
/// their sum; but a parent's middle is nearer to fixed pixels than to its neighbours. On a disc of 0.8 megapixels: 7
/// cycles with 0.7 and 0.8, 8 with 0.6 and 1.
const TIE: f32 = 0.75;
/// Weights by which four samples in a row make one of the coarser level, and two of the coarser level one sample.
const TAPS: [f32; 2] = [0.25, 0.75];

impl Level {
    fn empty(shape: [usize; 2], sides: [[Side; 2]; 2], screening: f32) -> Self {
        let [rows, columns] = shape;
        let mut level = Self {
            rows,
            columns,
            sides,
            diagonal: Vec::new(),
            reciprocal: Vec::new(),
            tied: Vec::new(),
            screening,
        };
        let [diagonal, reciprocal, tied] = std::array::from_fn(|_| level.zeros());
        (level.diagonal, level.reciprocal, level.tied) = (diagonal, reciprocal, tied);
        level
    }

    /// The given resolution; `free` says which pixels are solved.
    pub(super) fn finest(
        shape: [usize; 2],
        sides: [[Side; 2]; 2],
        screening: f32,
        free: impl Fn(usize, usize) -> bool + Sync + Send,
    ) -> Self {
        let mut level = Self::empty(shape, sides, screening);
        let mut open = level.zeros();
        level.each_row(&mut open, |r, out| {
            for (c, out) in out.iter_mut().enumerate() {
                *out = f32::from(u8::from(free(r, c)));
            }
        });
        let mut tied = std::mem::take(&mut level.tied);
        level.each_row(&mut tied, |r, out| {
            level.around(&open, r, |c, open, links| out[c] = open * (4.0 - links));
        });
        level.tied = tied;
        level.finish(&open);
        level
    }

    /// Half the resolution. Where a child is free its parent is.
    pub(super) fn coarser(&self) -> Self {
        let shape = [self.rows.div_ceil(2), self.columns.div_ceil(2)];
        let mut coarse = Self::empty(shape, self.sides, 4.0 * self.screening);
        let mut open = coarse.zeros();
        let children = |data: &[f32], r: usize, c: usize| -> [f32; 4] {
            let inside = |r: usize, c: usize| r < self.rows && c < self.columns;
            let at = |r, c| {
                if inside(r, c) {
                    data[self.at(r, c)]
                } else {
                    0.0
                }
            };
            let (r, c) = (2 * r, 2 * c);
            [at(r, c), at(r, c + 1), at(r + 1, c), at(r + 1, c + 1)]
        };
        coarse.each_row(&mut open, |r, out| {
            for (c, out) in out.iter_mut().enumerate() {
                let any = children(&self.diagonal, r, c).iter().any(|&d| d > 0.0);
                *out = f32::from(u8::from(any));
            }
        });
        let mut tied = std::mem::take(&mut coarse.tied);
        coarse.each_row(&mut tied, |r, out| {
            for (c, out) in out.iter_mut().enumerate() {
                *out = TIE * children(&self.tied, r, c).iter().sum::<f32>();
            }
        });
        coarse.tied = tied;
        coarse.finish(&open);
        coarse
    }

    /// The diagonal: links, ties and screening.
    fn finish(&mut self, open: &[f32]) {
        let mut diagonal = std::mem::take(&mut self.diagonal);
        self.each_row(&mut diagonal, |r, out| {
            let tied = &self.tied[self.at(r, 0)..];
            self.around(open, r, |c, open, links| {
                out[c] = open * (links + tied[c] + self.screening);
            });
        });
        let mut reciprocal = std::mem::take(&mut self.reciprocal);
        self.each_row(&mut reciprocal, |r, out| {
            for (out, &d) in out.iter_mut().zip(&diagonal[self.at(r, 0)..]) {
                *out = if d > 0.0 { 1.0 / d } else { 0.0 };
            }
        });
        (self.diagonal, self.reciprocal) = (diagonal, reciprocal);
    }

    /// Calls `f(column, value, sum of the four neighbours)` along a row.
    fn around(&self, data: &[f32], r: usize, mut f: impl FnMut(usize, f32, f32)) {
        let stride = self.stride();
        for c in 0..self.columns {
            let i = self.at(r, c);
            let links = data[i - stride] + data[i + stride] + data[i - 1] + data[i + 1];
            f(c, data[i], links);
        }
    }

    pub(super) fn zeros(&self) -> Vec<f32> {
        vec![0.0; (self.rows.next_multiple_of(2) + 2) * self.stride()]
    }

    pub(super) fn vectors(&self) -> Vectors {
        Vectors {
            x: self.zeros(),
            other: self.zeros(),
            b: self.zeros(),
        }
    }

    pub(super) fn stride(&self) -> usize {
        self.columns.next_multiple_of(2) + 2
    }

    pub(super) fn at(&self, row: usize, column: usize) -> usize {
        (row + 1) * self.stride() + column + 1
    }

    /// Rows of a chunk.
    pub(super) fn chunk(&self) -> usize {
        (CHUNK / self.stride()).max(1)
    }

    /// Calls `f(row, samples)` for each row of `data`, margins left out, then fills the margins.
    pub(super) fn each_row(&self, data: &mut [f32], f: impl Fn(usize, &mut [f32]) + Sync + Send) {
        let (stride, rows) = (self.stride(), self.chunk());
        let inner = &mut data[stride..][..self.rows * stride];
        par::chunks_mut(inner, rows * stride, |chunk, out| {
            wide(|| {
                for (r, row) in out.chunks_exact_mut(stride).enumerate() {
                    f(chunk * rows + r, &mut row[1..=self.columns]);
                    self.ends(row);
                }
            });
        });
        let last = self.rows * stride;
        match self.sides[0] {
            [Side::Wrap, _] => {
                data.copy_within(last..last + stride, 0);
                data.copy_within(stride..2 * stride, last + stride);
            }
            [low, high] => {
                if low == Side::Mirror {
                    data.copy_within(stride..2 * stride, 0);
                }
                if high == Side::Mirror {
                    data.copy_within(last..last + stride, last + stride);
                }
            }
        }
    }

    /// Fills the margins of a row.
    fn ends(&self, row: &mut [f32]) {
        let n = self.columns;
        match self.sides[1] {
            [Side::Wrap, _] => (row[0], row[n + 1]) = (row[n], row[1]),
            [low, high] => {
                if low == Side::Mirror {
                    row[0] = row[1];
                }
                if high == Side::Mirror {
                    row[n + 1] = row[n];
                }
            }
        }
    }

    /// `A x`.
    pub(super) fn apply(&self, x: &[f32], out: &mut [f32]) {
        self.each_row(out, |r, out| self.row::<PRODUCT>(r, x, x, 0.0, out));
    }

    /// One relaxation.
    pub(super) fn relax(&self, v: &mut Vectors, step: f32) {
        let Vectors { x, other, b } = v;
        self.each_row(other, |r, out| self.row::<RELAX>(r, x, b, step, out));
        std::mem::swap(x, other);
    }

    /// The first relaxation of nothing.
    pub(super) fn begin(&self, v: &mut Vectors, step: f32) {
        let Vectors { x, b, .. } = v;
        self.each_row(x, |r, x| {
            let at = self.at(r, 0);
            let terms = b[at..].iter().zip(&self.reciprocal[at..]);
            for (x, (b, d)) in x.iter_mut().zip(terms) {
                *x = step * d * b;
            }
        });
    }

    /// The right-hand side of the coarser level: what `x` leaves over.
    pub(super) fn restrict(&self, v: &mut Vectors, next: &Level, coarse: &mut [f32]) {
        let Vectors { x, other, b } = v;
        self.each_row(other, |r, out| self.row::<LACK>(r, x, b, 0.0, out));
        // What lies beyond the last of an odd number counts as nothing.
        let stride = self.stride();
        if self.rows % 2 == 1 {
            other[(self.rows + 1) * stride..].fill(0.0);
        }
        if self.columns % 2 == 1 {
            for row in other.chunks_exact_mut(stride) {
                row[self.columns + 1..].fill(0.0);
            }
        }
        let other = &*other;
        next.each_row(coarse, |r, out| {
            let row = |k: usize| &other[(2 * r + k) * stride..][..stride];
            let (outer, inner) = (row(0).iter().zip(row(3)), row(1).iter().zip(row(2)));
            let line: Vec<f32> = outer
                .zip(inner)
                .map(|((a, d), (b, c))| TAPS[0] * (a + d) + TAPS[1] * (b + c))
                .collect();
            let (pairs, _) = line.as_chunks::<2>();
            for (out, pair) in out.iter_mut().zip(pairs.windows(2)) {
                let [[a, b], [c, d]] = [pair[0], pair[1]];
                *out = TAPS[0] * (a + d) + TAPS[1] * (b + c);
            }
        });
    }

    /// Adds the coarser level's solution.
    pub(super) fn prolong(&self, next: &Level, coarse: &[f32], x: &mut [f32]) {
        let stride = next.stride();
        self.each_row(x, |r, out| {
            let row = |r: usize| &coarse[r * stride..][..stride];
            let (near, far) = (row(r / 2 + 1), row(r / 2 + 2 * (r % 2)));
            let near = near.iter().zip(far);
            let line: Vec<f32> = near.map(|(n, f)| TAPS[1] * n + TAPS[0] * f).collect();
            let free = &self.diagonal[self.at(r, 0)..][..out.len()];
            let between = |from: &[f32], far: f32, free: f32| {
                let add = TAPS[1] * from[1] + TAPS[0] * far;
                if free > 0.0 { add } else { 0.0 }
            };
            let (pairs, single) = out.as_chunks_mut::<2>();
            let (both, last) = free.as_chunks::<2>();
            for ((out, free), from) in pairs.iter_mut().zip(both).zip(line.windows(3)) {
                out[0] += between(from, from[0], free[0]);
                out[1] += between(from, from[2], free[1]);
            }
            let from = line.windows(3).skip(pairs.len());
            for ((out, free), from) in single.iter_mut().zip(last).zip(from) {
                *out += between(from, from[0], *free);
            }
        });
    }

    /// One row of the operator.
    #[inline(always)]
    fn row<const WHAT: u8>(&self, r: usize, x: &[f32], b: &[f32], step: f32, out: &mut [f32]) {
        let (n, stride) = (out.len(), self.stride());
        let start = self.at(r, 0);
        let here = &x[start..][..n];
        let (before, after) = (&x[start - 1..][..n], &x[start + 1..][..n]);
        let (above, below) = (&x[start - stride..][..n], &x[start + stride..][..n]);
        let diagonal = &self.diagonal[start..][..n];
        let reciprocal = &self.reciprocal[start..][..n];
        let b = &b[start..][..n];
        for i in 0..n {
            let around = (below[i] + above[i]) + (after[i] + before[i]);
            let own = diagonal[i] * here[i];
            let value = match WHAT {
                PRODUCT => own - around,
                LACK => b[i] + around - own,
                _ => here[i] + step * (reciprocal[i] * (b[i] + around) - here[i]),
            };
            out[i] = if WHAT == RELAX || diagonal[i] > 0.0 {
                value
            } else {
                0.0
            };
        }
    }
}

/// What [`Level::row`] makes: `A x`, `b - A x`, or a relaxed x.
const PRODUCT: u8 = 0;
const LACK: u8 = 1;
const RELAX: u8 = 2;
