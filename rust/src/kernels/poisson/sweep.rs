//! Tridiagonal systems across the rows, solved for a panel of coefficients at a time.

use std::ops::{Add, Div, Mul, Sub};

use super::Edge;

/// Number of coefficients of a panel.
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

/// Scratch memory of a sweep.
#[derive(Default)]
pub(super) struct Scratch {
    single: Lines<f32>,
    double: Lines<f64>,
}

#[derive(Default)]
struct Lines<T> {
    /// Reciprocal pivots.
    pivots: Vec<[T; PANEL]>,
    /// Solution for the corner entries of a cyclic system.
    corner: Vec<[T; PANEL]>,
    values: Vec<[T; PANEL]>,
}

/// The systems `(2 + shift) x[r] - x[r-1] - x[r+1]` across the rows, one for each coefficient.
pub(super) struct Systems {
    pub(super) edge: Edge,
    pub(super) shifts: Vec<f64>,
    /// Additional diagonal entries of the first and the last row, if any.
    pub(super) ends: [Option<Vec<f64>>; 2],
    /// Number of times that the systems have been squared.
    pub(super) times: usize,
    /// Shift below which a system is too ill-conditioned for `f32`.
    stiff: f64,
}

impl Systems {
    pub(super) fn new(edge: Edge, shifts: Vec<f64>) -> Self {
        // Each missing neighbour reduces the diagonal by 1.
        let end = (edge == Edge::Free).then(|| vec![-1.0; shifts.len()]);
        Self {
            edge,
            shifts,
            ends: [end.clone(), end],
            times: 0,
            stiff: STIFF,
        }
    }

    /// Returns whether the systems of every second row determine the solution. A system whose solution is unique only
    /// up to a constant is excluded, because the mean of all rows selects the constant. Shifts beyond the range of
    /// `f32` are excluded too.
    pub(super) fn can_be_squared(&self) -> bool {
        let fixed = self.edge == Edge::Fixed;
        let unique = |&shift: &f64| fixed || shift > f64::EPSILON;
        self.shifts.iter().all(|s| unique(s) && *s < 1e9)
    }

    /// Returns the systems of every second row. `kept` states whether the first and the last row
    /// are among them. With a = 2 + shift, the diagonal is a^2 - 2, and a b - 1 for an end with its
    /// own diagonal b.
    pub(super) fn squared(&self, kept: [bool; 2]) -> Self {
        let end = |k: usize| {
            let own = |i: usize| self.ends[k].as_ref().map_or(0.0, |own| own[i]);
            let more = |(i, shift): (usize, &f64)| 1.0 + (2.0 + shift) * own(i);
            let of_all = || self.shifts.iter().enumerate().map(more).collect();
            (kept[k] && self.edge != Edge::Wrap).then(of_all)
        };
        let square = |shift: f64| shift * (shift + 4.0);
        Self {
            edge: self.edge,
            shifts: self.shifts.iter().copied().map(square).collect(),
            ends: [end(0), end(1)],
            times: self.times + 1,
            stiff: square(self.stiff),
        }
    }

    /// Returns the shifts and ends of the coefficients from `first`. Missing coefficients have
    /// arbitrary values.
    pub(super) fn panel(&self, first: usize) -> Panel {
        let own = &self.shifts[first..];
        let of = |all: &[f64], lacking: f64| {
            std::array::from_fn(|l| all.get(first + l).copied().unwrap_or(lacking))
        };
        Panel {
            edge: self.edge,
            stiff: own.iter().take(PANEL).any(|&s| s < self.stiff),
            shifts: of(&self.shifts, 1.0),
            ends: self
                .ends
                .each_ref()
                .map(|end| end.as_ref().map_or([0.0; PANEL], |end| of(end, 0.0))),
        }
    }
}

/// Systems of one panel.
pub(super) struct Panel {
    edge: Edge,
    stiff: bool,
    shifts: [f64; PANEL],
    ends: [[f64; PANEL]; 2],
}

/// Shift below which a system needs `f64`, before it is squared.
const STIFF: f64 = 4e-3;

/// Solves the systems in place for each channel of a panel.
///
/// `panel` contains the rows of [`PANEL`] coefficients for each channel. For a singular system
/// (free or cyclic, without shift) the solution with mean zero is returned.
#[inline(always)]
pub(super) fn solve(
    systems: &Panel,
    rows: usize,
    panel: &mut [[f32; PANEL]],
    scratch: &mut Scratch,
) {
    if systems.stiff {
        sweep(systems, rows, panel, &mut scratch.double);
    } else {
        sweep(systems, rows, panel, &mut scratch.single);
    }
}

#[inline(always)]
fn sweep<T: Real>(systems: &Panel, rows: usize, panel: &mut [[f32; PANEL]], lines: &mut Lines<T>) {
    let &Panel {
        edge, shifts, ends, ..
    } = systems;
    let one = [T::of(1.0); PANEL];
    let zero = [T::default(); PANEL];
    let singular: [bool; PANEL] =
        std::array::from_fn(|l| edge != Edge::Fixed && shifts[l] <= f64::EPSILON);
    let cyclic = edge == Edge::Wrap && rows > 1;
    let diagonal = |row: usize| -> [T; PANEL] {
        let neighbours = match edge {
            Edge::Wrap if rows == 1 => 0.0,
            _ => 2.0,
        };
        let mut out = [T::default(); PANEL];
        for l in 0..PANEL {
            let mut own = neighbours;
            if row == 0 {
                own += ends[0][l];
            }
            if row + 1 == rows {
                own += ends[1][l];
            }
            own += shifts[l];
            // Apply the Sherman-Morrison formula: the corner entries of a cyclic system are the product of two
            // vectors.
            out[l] = T::of(match (cyclic, row == 0, row + 1 == rows) {
                (true, true, _) => 2.0 * own,
                (true, _, true) => own + 1.0 / own,
                _ => own,
            });
        }
        out
    };
    // Step 1: compute the pivots, which are the same for all channels. A singular system is pinned by setting its last
    // value to 0.
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
                last[l] = T::of(0.5); // Pinning cuts the cycle, so the diagonal is 2 without a corner term.
            }
        }
        lines.pivots[row] = last;
    }
    // Step 2: solve for the corner entries.
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
    // Step 3: solve each channel.
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

/// Performs forward elimination and back substitution with neighbours of weight -1.
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
