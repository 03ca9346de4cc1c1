//! Tridiagonal systems across the rows, a panel of coefficients at a time.

use std::ops::{Add, Div, Mul, Sub};

use super::Edge;

/// Coefficients side by side in a panel.
pub(super) const PANEL: usize = 32;

trait Real:
    Copy
    + Default
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + PartialOrd
{
    fn of(x: f64) -> Self;
    fn from_f32(x: f32) -> Self;
    fn to_f32(self) -> f32;
}

macro_rules! reals {
    ($($t:ty),*) => {$(
        impl Real for $t {
            #[inline(always)]
            fn of(x: f64) -> Self { x as $t }
            #[inline(always)]
            fn from_f32(x: f32) -> Self { <$t>::from(x) }
            #[inline(always)]
            fn to_f32(self) -> f32 { self as f32 }
        }
    )*};
}
reals!(f32, f64);

/// Working memory of a sweep.
#[derive(Default)]
pub(super) struct Scratch {
    single: Lines<f32>,
    double: Lines<f64>,
}

#[derive(Default)]
struct Lines<T> {
    /// Reciprocal pivots.
    pivots: Vec<[T; PANEL]>,
    /// The answer to the corners of a cyclic system.
    corner: Vec<[T; PANEL]>,
    values: Vec<[T; PANEL]>,
}

/// Below this sum of eigenvalue and screening the condition of a system is beyond what `f32` carries.
const STIFF: f64 = 4e-3;

/// Solves `(D + shift) x = r` in place for each channel of a panel, D the second difference along the rows.
///
/// `panel` holds for each channel its rows of [`PANEL`] coefficients. A singular system (free or cyclic, no shift) gets
/// the solution whose mean is zero.
#[inline(always)]
pub(super) fn solve(
    edge: Edge,
    shifts: &[f64; PANEL],
    rows: usize,
    panel: &mut [[f32; PANEL]],
    scratch: &mut Scratch,
) {
    if shifts.iter().copied().fold(f64::INFINITY, f64::min) < STIFF {
        sweep(edge, shifts, rows, panel, &mut scratch.double);
    } else {
        sweep(edge, shifts, rows, panel, &mut scratch.single);
    }
}

#[inline(always)]
fn sweep<T: Real>(
    edge: Edge,
    shifts: &[f64; PANEL],
    rows: usize,
    panel: &mut [[f32; PANEL]],
    lines: &mut Lines<T>,
) {
    let one = [T::of(1.0); PANEL];
    let zero = [T::default(); PANEL];
    let singular: [bool; PANEL] =
        std::array::from_fn(|l| edge != Edge::Fixed && shifts[l] <= f64::EPSILON);
    let cyclic = edge == Edge::Wrap && rows > 1;
    let diagonal = |row: usize| -> [T; PANEL] {
        let ends = usize::from(row == 0) + usize::from(row + 1 == rows);
        let neighbours = match edge {
            Edge::Free => 2 - ends,
            Edge::Wrap if rows == 1 => 0,
            _ => 2,
        };
        let mut out = [T::default(); PANEL];
        for l in 0..PANEL {
            let own = neighbours as f64 + shifts[l];
            // Sherman and Morrison: the corners of a cyclic system are a product of two vectors.
            out[l] = T::of(match (cyclic, row == 0, row + 1 == rows) {
                (true, true, _) => 2.0 * own,
                (true, _, true) => own + 1.0 / own,
                _ => own,
            });
        }
        out
    };
    // 1. Pivots, the same for all channels. A singular system is pinned: its last value is 0.
    lines.pivots.resize(rows, zero);
    let middle = diagonal(1.min(rows.saturating_sub(2)));
    let mut last = zero;
    for row in 0..rows {
        let end = row == 0 || row + 1 == rows;
        let d = if end { diagonal(row) } else { middle };
        for l in 0..PANEL {
            last[l] = one[l] / (d[l] - last[l]);
        }
        for l in (0..PANEL).filter(|&l| end && singular[l]) {
            if row + 1 == rows {
                last[l] = T::default();
            } else if cyclic {
                last[l] = T::of(0.5); // no corner where the chain is cut
            }
        }
        lines.pivots[row] = last;
    }
    // 2. The corner's own solution.
    let first = diagonal(0);
    let gamma: [T; PANEL] = std::array::from_fn(|l| zero[l] - first[l] * T::of(0.5));
    if cyclic {
        lines.corner.clear();
        lines.corner.resize(rows, zero);
        lines.corner[0] = gamma;
        let end = &mut lines.corner[rows - 1];
        *end = std::array::from_fn(|l| end[l] - one[l]);
        substitute(&lines.pivots, &mut lines.corner);
    }
    // 3. Each channel.
    for channel in panel.chunks_exact_mut(rows) {
        lines.values.resize(rows, zero);
        for (to, from) in lines.values.iter_mut().zip(channel.iter()) {
            for l in 0..PANEL {
                to[l] = T::from_f32(from[l]);
            }
        }
        substitute(&lines.pivots, &mut lines.values);
        let values = &mut lines.values;
        if cyclic {
            let (x, z) = (
                (values[0], values[rows - 1]),
                (lines.corner[0], lines.corner[rows - 1]),
            );
            let factor: [T; PANEL] = std::array::from_fn(|l| {
                if singular[l] {
                    T::default()
                } else {
                    (x.0[l] - x.1[l] / gamma[l]) / (one[l] + z.0[l] - z.1[l] / gamma[l])
                }
            });
            for (row, z) in values.iter_mut().zip(&lines.corner) {
                for l in 0..PANEL {
                    row[l] = row[l] - factor[l] * z[l];
                }
            }
        }
        for l in (0..PANEL).filter(|&l| singular[l]) {
            let sum = values.iter().fold(T::default(), |sum, row| sum + row[l]);
            let mean = sum / T::of(rows as f64);
            values.iter_mut().for_each(|row| row[l] = row[l] - mean);
        }
        for (out, row) in channel.iter_mut().zip(values.iter()) {
            for l in 0..PANEL {
                out[l] = row[l].to_f32();
            }
        }
    }
}

/// Forward elimination and back substitution with neighbours of weight -1.
#[inline(always)]
fn substitute<T: Real>(pivots: &[[T; PANEL]], values: &mut [[T; PANEL]]) {
    let mut last = [T::default(); PANEL];
    for (row, p) in values.iter_mut().zip(pivots) {
        for l in 0..PANEL {
            row[l] = (row[l] + last[l]) * p[l];
        }
        last = *row;
    }
    last = [T::default(); PANEL];
    for (row, p) in values.iter_mut().zip(pivots).rev() {
        for l in 0..PANEL {
            row[l] = row[l] + p[l] * last[l];
        }
        last = *row;
    }
}
