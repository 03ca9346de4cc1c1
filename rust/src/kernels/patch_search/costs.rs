//! The filtered costs of one block, and their minimum.

use std::ops::Range;

/// The filtered costs of one block. Forbidden positions have infinite cost.
#[derive(Default)]
pub(super) struct Map {
    pub(super) costs: Vec<f32>,
    /// Rows and columns.
    pub(super) valid: [usize; 2],
    /// Minimum of each row, and of all rows.
    lows: Vec<f32>,
    pub(super) least: f32,
    /// Bound of the error of the filtered costs, in the unit of the filter, except for the rounding
    /// of each cost.
    pub(super) absolute: f64,
}

impl Map {
    pub(super) fn rows(&self) -> impl Iterator<Item = &[f32]> {
        self.costs.chunks_exact(self.valid[1].max(1))
    }

    /// Returns the bound of the error of a filtered cost.
    pub(super) fn error(&self, cost: f32) -> f64 {
        self.absolute + f64::from(f32::EPSILON) * f64::from(cost).abs()
    }

    /// Calls `f` for each position that costs at most `limit`. Rows and chunks whose minimum exceeds the limit are
    /// skipped, because few positions qualify.
    pub(super) fn within(&self, limit: f32, mut f: impl FnMut(usize, usize)) {
        for (r, row) in self
            .rows()
            .enumerate()
            .filter(|&(r, _)| self.lows[r] <= limit)
        {
            for (i, chunk) in row.chunks(16).enumerate() {
                if lowest(chunk) <= limit {
                    for (k, _) in chunk.iter().enumerate().filter(|&(_, &cost)| cost <= limit) {
                        f(r, 16 * i + k);
                    }
                }
            }
        }
    }

    /// Computes the minima of all rows.
    pub(super) fn update(&mut self) {
        self.lows.clear();
        self.lows.resize(self.valid[0], f32::INFINITY);
        self.update_rows(0..self.valid[0]);
    }

    /// Computes the minima of rows that have changed.
    pub(super) fn update_rows(&mut self, rows: Range<usize>) {
        let width = self.valid[1];
        for r in rows {
            self.lows[r] = lowest(&self.costs[r * width..][..width]);
        }
        self.least = lowest(&self.lows);
    }
}

/// Returns the minimum of costs that are not NaN.
fn lowest(costs: &[f32]) -> f32 {
    let mut lanes = [f32::INFINITY; 16];
    let (chunks, rest) = costs.as_chunks::<16>();
    let less = |a: f32, b: f32| if b < a { b } else { a };
    for chunk in chunks {
        for (lane, &cost) in lanes.iter_mut().zip(chunk) {
            *lane = less(*lane, cost);
        }
    }
    rest.iter().chain(&lanes).copied().fold(f32::INFINITY, less)
}
