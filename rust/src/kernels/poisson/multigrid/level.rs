//! One resolution of the grid: its operator, and the transfer to the next resolution.

use super::CHUNK;
use crate::foundation::par;
use crate::foundation::simd::wide_fn;

/// Values beyond one side of a grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// Fixed pixels, which are zero.
    Fixed,
    /// A copy of the outermost pixels, so that no difference crosses the side.
    Mirror,
    /// The pixels of the opposite side.
    Wrap,
}

/// One resolution. Arrays have a margin of one on each side, and memory for an even number of rows
/// and columns.
///
/// The operator is `diagonal * x` minus the four neighbours. Pixels that are not free are 0, so
/// links need no weights.
pub(super) struct Level {
    pub(super) rows: usize,
    pub(super) columns: usize,
    /// Low and high side of the axis of rows and of the axis of columns.
    sides: [[Side; 2]; 2],
    /// Diagonal of the operator. It is 0 at pixels that are not free, and so is `reciprocal`.
    diagonal: Vec<f32>,
    reciprocal: Vec<f32>,
    /// Flags of the free pixels, if all of them have the same diagonal, as at the finest
    /// resolution. Each pass then reads one byte for each pixel instead of eight.
    open: Option<Vec<u8>>,
    /// Part of the diagonal that links a pixel to fixed pixels.
    tied: Vec<f32>,
    screening: f32,
}

/// Vectors of one level.
pub(super) struct Vectors {
    pub(super) x: Vec<f32>,
    pub(super) other: Vec<f32>,
    pub(super) b: Vec<f32>,
}

/// Factor from the sum of the children's links to fixed pixels to the link of their parent.
///
/// Two parallel links are replaced by half of their sum. But the centre of a parent is nearer to
/// fixed pixels than to its neighbours, so the factor is larger than 0.5. Measured on a disc of 0.8
/// megapixels: 7 cycles with 0.7 and 0.8, 8 cycles with 0.6 and 1.
const TIE: f32 = 0.75;
/// Weights of the transfer between levels. Four samples in a row are combined into one sample of the coarser level,
/// and two coarser samples into one finer sample.
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
            open: None,
            tied: Vec::new(),
            screening,
        };
        let [diagonal, reciprocal, tied] = std::array::from_fn(|_| level.zeros());
        (level.diagonal, level.reciprocal, level.tied) = (diagonal, reciprocal, tied);
        level
    }

    /// Returns the finest level. `free` marks the pixels to solve.
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
        // Each free pixel has four links, to free or to fixed pixels, so all diagonals are equal.
        level.open = Some(open.iter().map(|&o| u8::from(o > 0.0)).collect());
        level
    }

    /// Returns the level of half the resolution. A parent is free if any of its children is free.
    pub(super) fn coarser(&self) -> Self {
        let shape = [self.rows.div_ceil(2), self.columns.div_ceil(2)];
        let mut coarse = Self::empty(shape, self.sides, 4.0 * self.screening);
        let mut open = coarse.zeros();
        // The four children of a parent. Children beyond the grid are 0.
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

    /// Computes the diagonal: the links to free pixels, the links to fixed pixels, and the screening.
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

    /// Number of rows of a chunk.
    pub(super) fn chunk(&self) -> usize {
        (CHUNK / self.stride()).max(1)
    }

    /// Calls `f(row, samples)` for each row of `data` without its margins, then fills the margins.
    pub(super) fn each_row(&self, data: &mut [f32], f: impl Fn(usize, &mut [f32]) + Sync + Send) {
        self.each_chunk(data, |first, out| {
            for (r, row) in out.chunks_exact_mut(self.stride()).enumerate() {
                f(first + r, &mut row[1..=self.columns]);
            }
        });
    }

    /// Calls `f(first row, rows with their margins)` for each chunk of `data`, then fills the
    /// margins.
    fn each_chunk(&self, data: &mut [f32], f: impl Fn(usize, &mut [f32]) + Sync + Send) {
        let (stride, rows) = (self.stride(), self.chunk());
        let inner = &mut data[stride..][..self.rows * stride];
        par::chunks_mut(inner, rows * stride, |chunk, out| {
            f(chunk * rows, out);
            for row in out.chunks_exact_mut(stride) {
                self.ends(row);
            }
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

    /// Computes `A x`.
    pub(super) fn apply(&self, x: &[f32], out: &mut [f32]) {
        self.each_row(out, |r, out| self.row::<PRODUCT>(r, x, x, 0.0, out));
    }

    /// Performs one relaxation.
    pub(super) fn relax(&self, v: &mut Vectors, step: f32) {
        let Vectors { x, other, b } = v;
        self.each_row(other, |r, out| self.row::<RELAX>(r, x, b, step, out));
        std::mem::swap(x, other);
    }

    /// Performs two relaxations that start at zero.
    pub(super) fn begin(&self, v: &mut Vectors, steps: [f32; 2]) {
        let Vectors { x, b, .. } = v;
        if self.open.is_some() {
            // The result of the first relaxation is a multiple of the right-hand side, so it is not
            // stored.
            let first = steps[0] * self.same()[1];
            return self.each_row(x, |r, out| self.second(r, b, first, steps[1], out));
        }
        self.each_row(x, |r, x| {
            let at = self.at(r, 0);
            let terms = b[at..].iter().zip(&self.reciprocal[at..]);
            for (x, (b, d)) in x.iter_mut().zip(terms) {
                *x = steps[0] * d * b;
            }
        });
        self.relax(v, steps[1]);
    }

    /// Computes the right-hand side of the coarser level from the residual of `x`.
    pub(super) fn restrict(&self, v: &Vectors, next: &Level, coarse: &mut [f32]) {
        let (n, stride) = (self.columns, self.stride());
        let odd = [self.rows % 2 == 1, n % 2 == 1];
        // Computes row `i - 1` of the residual, with its margins. An odd number of rows is
        // completed by a row of zeros.
        let lack = |i: usize, line: &mut [f32]| {
            let last = self.rows;
            let row = match (i, self.sides[0]) {
                (0, [Side::Fixed, _]) => None,
                (0, [Side::Mirror, _]) => Some(0),
                (0, [Side::Wrap, _]) => Some(last - 1),
                (i, _) if i <= last => Some(i - 1),
                _ if odd[0] => None,
                (_, [Side::Wrap, _]) => Some(0),
                (_, [_, Side::Mirror]) => Some(last - 1),
                _ => None,
            };
            let Some(row) = row else {
                return line.fill(0.0);
            };
            self.row::<LACK>(row, &v.x, &v.b, 0.0, &mut line[1..=n]);
            self.ends(line);
            if odd[1] {
                line[n + 1..].fill(0.0);
            }
        };
        next.each_chunk(coarse, |first, out| {
            // Each fine row is used twice but computed once.
            let mut lines: [Vec<f32>; 4] = std::array::from_fn(|_| vec![0.0; stride]);
            let mut joined = vec![0.0f32; stride];
            for (r, out) in out.chunks_exact_mut(next.stride()).enumerate() {
                let made = if r == 0 { 0 } else { 2 };
                if r > 0 {
                    lines.rotate_left(2);
                }
                for (k, line) in lines.iter_mut().enumerate().skip(made) {
                    lack(2 * (first + r) + k, line);
                }
                let [a, b, c, d] = &lines;
                join([a, b, c, d], &mut joined, &mut out[1..=next.columns]);
            }
        });
    }

    /// Adds the solution of the coarser level.
    pub(super) fn prolong(&self, next: &Level, coarse: &[f32], x: &mut [f32]) {
        let stride = next.stride();
        self.each_chunk(x, |first, out| {
            let mut line = vec![0.0; stride];
            for (r, out) in (first..).zip(out.chunks_exact_mut(self.stride())) {
                let row = |r: usize| &coarse[r * stride..][..stride];
                let (near, far) = (row(r / 2 + 1), row(r / 2 + 2 * (r % 2)));
                let free = &self.diagonal[self.at(r, 0)..][..self.columns];
                refine(near, far, &mut line, free, &mut out[1..=self.columns]);
            }
        });
    }

    /// Returns the diagonal of the finest resolution and its reciprocal, which are the same at all
    /// free pixels.
    fn same(&self) -> [f32; 2] {
        let diagonal = 4.0 + self.screening;
        [diagonal, 1.0 / diagonal]
    }

    /// Computes the result that `WHAT` selects for one row.
    fn row<const WHAT: u8>(&self, r: usize, x: &[f32], b: &[f32], step: f32, out: &mut [f32]) {
        let (n, start) = (out.len(), self.at(r, 0));
        let (x, b) = (self.lines(r, x), &b[start..][..n]);
        if let Some(open) = &self.open {
            return operate_same::<WHAT>(x, b, self.same(), &open[start..][..n], step, out);
        }
        let coefficients = [&self.diagonal, &self.reciprocal].map(|data| &data[start..][..n]);
        operate::<WHAT>(x, b, coefficients, step, out);
    }

    /// Relaxes one row of the finest resolution. The start value is `first` times the right-hand
    /// side.
    fn second(&self, r: usize, b: &[f32], first: f32, step: f32, out: &mut [f32]) {
        if let Some(open) = &self.open {
            let open = &open[self.at(r, 0)..][..out.len()];
            relax_multiple(self.lines(r, b), first, self.same()[1], open, step, out);
        }
    }

    /// Returns a row, and the same row shifted up, down, left and right.
    fn lines<'a>(&self, r: usize, data: &'a [f32]) -> [&'a [f32]; 5] {
        let (start, stride) = (self.at(r, 0), self.stride());
        [start, start - stride, start + stride, start - 1, start + 1]
            .map(|from| &data[from..][..self.columns])
    }
}

wide_fn! {
    /// Applies the operator if all free pixels have the same diagonal.
    fn operate_same<const WHAT: u8>(
        x: [&[f32]; 5], b: &[f32], same: [f32; 2], open: &[u8], step: f32, out: &mut [f32],
    ) {
        let [diagonal, reciprocal] = same;
        let n = out.len();
        let ([here, above, below, before, after], b, open) = (x.map(|x| &x[..n]), &b[..n], &open[..n]);
        for i in 0..n {
            let around = (below[i] + above[i]) + (after[i] + before[i]);
            let value = one::<WHAT>(here[i], around, b[i], diagonal, reciprocal, step);
            out[i] = if open[i] > 0 { value } else { 0.0 };
        }
    }
}

wide_fn! {
    /// Applies the operator with an array of diagonals and their reciprocals.
    fn operate<const WHAT: u8>(x: [&[f32]; 5], b: &[f32], coefficients: [&[f32]; 2], step: f32, out: &mut [f32]) {
        let n = out.len();
        let ([here, above, below, before, after], b) = (x.map(|x| &x[..n]), &b[..n]);
        let [diagonal, reciprocal] = coefficients.map(|c| &c[..n]);
        for i in 0..n {
            let around = (below[i] + above[i]) + (after[i] + before[i]);
            let value = one::<WHAT>(here[i], around, b[i], diagonal[i], reciprocal[i], step);
            out[i] = if WHAT == RELAX || diagonal[i] > 0.0 { value } else { 0.0 };
        }
    }
}

/// Applies the operator at one pixel.
#[inline(always)]
fn one<const WHAT: u8>(
    here: f32,
    around: f32,
    b: f32,
    diagonal: f32,
    reciprocal: f32,
    step: f32,
) -> f32 {
    let own = diagonal * here;
    match WHAT {
        PRODUCT => own - around,
        LACK => b + around - own,
        _ => here + step * (reciprocal * (b + around) - here),
    }
}

wide_fn! {
    /// Relaxes once, starting at `first` times the right-hand side.
    fn relax_multiple(b: [&[f32]; 5], first: f32, reciprocal: f32, open: &[u8], step: f32, out: &mut [f32]) {
        let n = out.len();
        let ([here, above, below, before, after], open) = (b.map(|b| &b[..n]), &open[..n]);
        for i in 0..n {
            let x = |b: f32| first * b;
            let around = (x(below[i]) + x(above[i])) + (x(after[i]) + x(before[i]));
            let value = x(here[i]) + step * (reciprocal * (here[i] + around) - x(here[i]));
            out[i] = if open[i] > 0 { value } else { 0.0 };
        }
    }
}

wide_fn! {
    /// Combines four rows of the residual into one row of the coarser level.
    fn join(lines: [&[f32]; 4], joined: &mut [f32], out: &mut [f32]) {
        let n = joined.len();
        let [a, b, c, d] = lines.map(|line| &line[..n]);
        for i in 0..n {
            joined[i] = TAPS[0] * (a[i] + d[i]) + TAPS[1] * (b[i] + c[i]);
        }
        let (pairs, _) = joined.as_chunks::<2>();
        for (out, pair) in out.iter_mut().zip(pairs.windows(2)) {
            let [[a, b], [c, d]] = [pair[0], pair[1]];
            *out = TAPS[0] * (a + d) + TAPS[1] * (b + c);
        }
    }
}

wide_fn! {
    /// Interpolates between two rows of the coarser level and adds the result.
    fn refine(near: &[f32], far: &[f32], line: &mut [f32], free: &[f32], out: &mut [f32]) {
        for (line, (n, f)) in line.iter_mut().zip(near.iter().zip(far)) {
            *line = TAPS[1] * n + TAPS[0] * f;
        }
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
    }
}

/// Results of [`Level::row`]: `A x`, `b - A x`, or a relaxed x.
const PRODUCT: u8 = 0;
const LACK: u8 = 1;
const RELAX: u8 = 2;
