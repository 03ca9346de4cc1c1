//! Dense operations: the columns of a front are factored, and their contribution is subtracted from the rest.
//!
//! Arrays are stored column by column. Every value is a sum over the previous columns in their order, and no operation
//! is fused. The result is therefore the same for any width of SIMD registers.

use super::plan::TILE;
use crate::Result;
use crate::foundation::par::Monitor;
use crate::foundation::simd::{wide_fn, widest_fn};

/// Maximum number of rows that are processed together.
const TALL: usize = 16;

/// Returns the products of `N` rows with four further rows, summed over all columns. Each column has `height` values.
#[inline(always)]
fn multiply<const N: usize>(
    columns: &[f64],
    height: usize,
    row: usize,
    four: usize,
) -> [[f64; N]; TILE] {
    let mut sums = [[0.0; N]; TILE];
    for column in columns.chunks_exact(height) {
        let (Some(a), Some(b)) = (
            column[row..].first_chunk::<N>(),
            column[four..].first_chunk::<TILE>(),
        ) else {
            return sums;
        };
        for j in 0..TILE {
            for i in 0..N {
                sums[j][i] += a[i] * b[j];
            }
        }
    }
    sums
}

/// Returns whether the number can be a diagonal entry of a positive definite matrix.
#[inline(always)]
pub(super) fn is_pivot(number: f64) -> bool {
    number > 0.0 && number < f64::INFINITY
}

/// Factors a 4 x 4 tile, and stores the reciprocals of the factor's diagonal. Returns false if the
/// tile is not positive definite.
#[inline(always)]
fn factor_tile(tile: &mut [[f64; TILE]; TILE]) -> bool {
    for j in 0..TILE {
        for before in 0..j {
            let by = tile[before][j];
            for i in j..TILE {
                tile[j][i] -= tile[before][i] * by;
            }
        }
        let pivot = tile[j][j];
        if !is_pivot(pivot) {
            return false;
        }
        tile[j][j] = 1.0 / pivot.sqrt();
        for i in j + 1..TILE {
            tile[j][i] *= tile[j][j];
        }
    }
    true
}

/// Computes rows of four columns of the factor: subtracts the contribution of previous columns, and
/// divides by the factored tile.
#[inline(always)]
fn divide<const N: usize>(
    done: &[f64],
    four: &mut [f64],
    height: usize,
    row: usize,
    at: usize,
    tile: &[[f64; TILE]; TILE],
) {
    let mut x = multiply::<N>(done, height, row, at);
    for j in 0..TILE {
        let Some(own) = four[j * height + row..].first_chunk_mut::<N>() else {
            return;
        };
        for i in 0..N {
            x[j][i] = own[i] - x[j][i];
        }
        for before in 0..j {
            for i in 0..N {
                x[j][i] -= x[before][i] * tile[before][j];
            }
        }
        for i in 0..N {
            x[j][i] *= tile[j][j];
        }
        *own = x[j];
    }
}

widest_fn! {
    /// Factors the columns of a front of `height` rows. Their number is a multiple of four. The
    /// diagonal becomes the reciprocal of the factor's diagonal. Returns false if the matrix is not
    /// positive definite.
    pub(super) fn factor<const ROWS: usize>(front: &mut [f64], height: usize, monitor: &Monitor) -> Result<bool> {
        let columns = front.len() / height;
        for at in (0..columns).step_by(TILE) {
            monitor.check()?;
            let (done, rest) = front.split_at_mut(at * height);
            let four = &mut rest[..TILE * height];
            // Factor the tile on the diagonal.
            let mut tile = multiply::<TILE>(done, height, at, at);
            for j in 0..TILE {
                for i in 0..TILE {
                    tile[j][i] = four[j * height + at + i] - tile[j][i];
                }
            }
            if !factor_tile(&mut tile) {
                return Ok(false);
            }
            for j in 0..TILE {
                for i in j..TILE {
                    four[j * height + at + i] = tile[j][i];
                }
            }
            // Divide the rows below the tile.
            let mut row = at + TILE;
            while row + ROWS <= height {
                divide::<ROWS>(done, four, height, row, at, &tile);
                row += ROWS;
            }
            if row + 8 <= height {
                divide::<8>(done, four, height, row, at, &tile);
                row += 8;
            }
            if row < height {
                divide::<TILE>(done, four, height, row, at, &tile);
            }
        }
        Ok(true)
    }
}

/// Subtracts the contribution of a front from rows of four columns of the rest.
#[inline(always)]
fn take_off_tile<const N: usize>(
    rest: &mut [f64],
    size: usize,
    [row, column]: [usize; 2],
    front: &[f64],
    height: usize,
) {
    let columns = height - size;
    let sums = multiply::<N>(front, height, columns + row, columns + column);
    for j in 0..TILE {
        let Some(own) = rest[(column + j) * size + row..].first_chunk_mut::<N>() else {
            return;
        };
        for i in 0..N {
            own[i] -= sums[j][i];
        }
    }
}

widest_fn! {
    /// Subtracts the contribution of the factored columns of a front from `rest`, a square of
    /// `size` whose lower triangle is used.
    pub(super) fn take_off<const ROWS: usize>(
        rest: &mut [f64],
        size: usize,
        front: &[f64],
        height: usize,
        monitor: &Monitor,
    ) -> Result<()> {
        let mut row = 0;
        while row + ROWS <= size {
            monitor.check()?;
            for column in (0..row + ROWS).step_by(TILE) {
                take_off_tile::<ROWS>(rest, size, [row, column], front, height);
            }
            row += ROWS;
        }
        if row + 8 <= size {
            for column in (0..row + 8).step_by(TILE) {
                take_off_tile::<8>(rest, size, [row, column], front, height);
            }
            row += 8;
        }
        if row < size {
            for column in (0..size).step_by(TILE) {
                take_off_tile::<TILE>(rest, size, [row, column], front, height);
            }
        }
        Ok(())
    }
}

/// Sets the used part of a square of `size` to zero: its lower triangle, extended to whole tiles.
pub(super) fn clear(rest: &mut [f64], size: usize) {
    for (j, column) in rest.chunks_exact_mut(size.max(1)).enumerate() {
        column[j - j % TALL..].fill(0.0);
    }
}

/// Rows that are consecutive both in a child's contribution and in its parent's front.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    /// First row in the child.
    first: usize,
    /// Number of rows.
    len: usize,
    /// First row in the front.
    there: usize,
}

/// Lists runs of rows. `into` contains the row of the parent's front for each row of the child. A run does not
/// continue from the own columns into the rest.
pub(super) fn list_runs(into: &[u32], columns: usize, runs: &mut Vec<Run>) {
    runs.clear();
    for (first, &there) in into.iter().enumerate() {
        let there = there as usize;
        match runs.last_mut() {
            Some(run) if there == run.there + run.len && there != columns => run.len += 1,
            _ => runs.push(Run {
                first,
                len: 1,
                there,
            }),
        }
    }
}

wide_fn! {
    /// Adds a child's contribution, a square of `size`, to its parent's front and to the rest of
    /// the parent. `sides` are the numbers of rows and columns of the front.
    pub(super) fn hand_on(
        left: &[f64],
        size: usize,
        runs: &[Run],
        front: &mut [f64],
        rest: &mut [f64],
        sides: [usize; 2],
    ) {
        let [height, columns] = sides;
        for (k, across) in runs.iter().enumerate() {
            // Rows of the rest are counted from its own first row.
            let (target, side, less) = if across.there < columns {
                (&mut *front, height, 0)
            } else {
                (&mut *rest, height - columns, columns)
            };
            for (down, run) in runs[k..].iter().enumerate() {
                for j in 0..across.len {
                    // Add only the lower triangle of a square on the diagonal.
                    let skip = if down == 0 { j } else { 0 };
                    let to = (across.there + j - less) * side + run.there + skip - less;
                    let from = (across.first + j) * size + run.first + skip;
                    let many = run.len - skip;
                    for (sum, number) in target[to..][..many].iter_mut().zip(&left[from..][..many]) {
                        *sum += number;
                    }
                }
            }
        }
    }
}
