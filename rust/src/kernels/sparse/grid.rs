//! Couplings of unknowns: on a grid by their distance, otherwise by a list.

use super::Checked;
use crate::Result;
use crate::foundation::memory;

/// Maximum distance between coupled unknowns of a grid along an axis.
const FAR: u32 = 8;
/// Maximum number of different distances between row and column over all entries. With more, the
/// unknowns are not treated as a grid.
const MOST: usize = 64;

/// Number of axes of separators on a grid: along its rows, its columns and both diagonals.
pub(super) const AXES: usize = 4;

/// An unknown as its place on a grid along all axes, row and column first. Without a grid, the
/// second entry is the number of the unknown.
pub(super) type Item = [u32; AXES];

/// A grid that contains the unknowns of a matrix, row by row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    pub(super) columns: u32,
    /// Maximum distance of coupled unknowns along each axis.
    pub(super) reach: [u32; AXES],
}

impl Grid {
    /// Returns the place of an unknown along all axes.
    pub(super) fn place(&self, unknown: u32) -> Item {
        let (row, column) = (unknown / self.columns, unknown % self.columns);
        [row, column, row + column, row + (self.columns - column)]
    }

    /// Returns the grid that follows from the distances between rows and columns of the entries, or `None` if the
    /// unknowns do not form a grid.
    pub(super) fn recognise(matrix: &Checked<'_>) -> Result<Option<Self>> {
        let size = matrix.size();
        // Collect the different distances.
        let mut seen: Vec<bool> = memory::filled("the order of the matrix", false, size)?;
        let mut apart: Vec<u32> = Vec::new();
        for column in 0..size {
            for &row in matrix.below(column) {
                let distance = row - column as u32;
                if !seen[distance as usize] {
                    seen[distance as usize] = true;
                    apart.push(distance);
                    if apart.len() > MOST {
                        return Ok(None);
                    }
                }
            }
        }
        apart.sort_unstable();
        // Distances within a row are 1, 2, ... Distances to the next row are around the number of
        // columns.
        let beside = (1..).zip(&apart).take_while(|&(i, &d)| i == d).count();
        let next = &apart[beside..];
        let near = next.windows(2).take_while(|two| two[1] - two[0] <= 2);
        let columns = match next.first() {
            Some(first) => (first + next[near.count()]) / 2,
            None => size as u32,
        };
        // Measure the reach along each axis, and reject couplings that are too far for a grid.
        let mut reach = [0u32; AXES];
        let (mut line, mut x) = (0, 0);
        for column in 0..size {
            // First unknown of the grid line that contains the entry's row. Rows are in increasing
            // order.
            let (mut first, mut down) = (line, 0);
            for &row in matrix.below(column) {
                while row - first >= columns && down <= FAR {
                    first += columns;
                    down += 1;
                }
                let right = (row - first).abs_diff(x);
                let (u, v) = (
                    (down + row - first).abs_diff(x),
                    (down + x).abs_diff(row - first),
                );
                reach = [
                    reach[0].max(down),
                    reach[1].max(right),
                    reach[2].max(u),
                    reach[3].max(v),
                ];
            }
            if reach[0] > FAR || reach[1] > FAR {
                return Ok(None);
            }
            x += 1;
            if x == columns {
                (line, x) = (line + columns, 0);
            }
        }
        Ok(Some(Self { columns, reach }))
    }
}

/// The couplings of each unknown, in both directions.
#[derive(Debug, Default)]
pub(super) struct Links {
    starts: Vec<u32>,
    others: Vec<u32>,
}

impl Links {
    pub(super) fn new(matrix: &Checked<'_>) -> Result<Self> {
        let size = matrix.size();
        let what = "the order of the matrix";
        let mut starts: Vec<u32> = memory::filled(what, 0, size + 2)?;
        for column in 0..size {
            for &row in matrix.below(column) {
                starts[row as usize + 2] += 1;
                starts[column + 2] += 1;
            }
        }
        for i in 2..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut others: Vec<u32> = memory::filled(what, 0, starts[size + 1] as usize)?;
        for column in 0..size {
            for &row in matrix.below(column) {
                for (from, to) in [(row as usize, column as u32), (column, row)] {
                    others[starts[from + 1] as usize] = to;
                    starts[from + 1] += 1;
                }
            }
        }
        starts.pop();
        Ok(Self { starts, others })
    }

    pub(super) fn of(&self, unknown: u32) -> &[u32] {
        let i = unknown as usize;
        &self.others[self.starts[i] as usize..self.starts[i + 1] as usize]
    }
}
