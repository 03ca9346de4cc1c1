//! Symmetric positive definite systems: factored once, solved many times.
//!
//! A sparse Cholesky factorisation in double precision: deformation energies weigh some equations 10^9 times as much as
//! others, which leaves nothing for iterations or for single precision. It is multifrontal, over a tree of blocks that nested
//! dissection makes: `order` says which unknowns are eliminated when (`cut` parts them, by what `grid` knows of them), `plan`
//! which rows each block has; `factor` works out the numbers, and `solve` solves with them; what is dense is in `dense`. Every
//! number is made by one thread, by sums in one order that nothing fuses: the same bytes for any number of threads, and for any
//! registers.

mod cut;
mod dense;
mod factor;
mod grid;
mod order;
mod plan;
mod solve;

use factor::Part;
use plan::Plan;

use crate::foundation::memory;
use crate::foundation::par::Monitor;
use crate::{Error, Result};

/// No unknown, and no block.
const NONE: u32 = u32::MAX;

/// A symmetric matrix, column by column, of which the lower triangle is read.
#[derive(Debug, Clone, Copy)]
pub struct Lower<'a> {
    /// Where each column begins in `rows` and `values`, and where the last one ends.
    pub starts: &'a [u32],
    /// Rows of the entries, rising in each column; each has one on the diagonal. Those above it may be left out.
    pub rows: &'a [u32],
    /// The entries.
    pub values: &'a [f64],
}

/// A matrix that was checked.
struct Checked<'a> {
    matrix: Lower<'a>,
    /// Where the diagonal's entries are.
    diagonal: Vec<u32>,
}

impl<'a> Checked<'a> {
    fn new(matrix: Lower<'a>) -> Result<Self> {
        let bad = |message: &str| Err(Error::value("matrix", message));
        let Lower {
            starts,
            rows,
            values,
        } = matrix;
        let size = starts.len().saturating_sub(1);
        if size == 0 || size > i32::MAX as usize / 2 {
            return bad("needs at least one column, and fewer than 2^30");
        }
        if rows.len() != values.len() || starts[0] != 0 || starts[size] as usize != rows.len() {
            return bad(
                "its columns must begin at 0 and end with the last of as many rows as values",
            );
        }
        let mut diagonal = memory::filled("the order of the matrix", 0, size)?;
        for column in 0..size {
            let (from, to) = (starts[column] as usize, starts[column + 1] as usize);
            if from >= to || to > rows.len() {
                return bad("each column of the lower triangle must have its diagonal entry");
            }
            let own = &rows[from..to];
            let above = own
                .iter()
                .rposition(|&row| row < column as u32)
                .map_or(0, |last| last + 1);
            let below = &own[above..];
            if below.first() != Some(&(column as u32)) {
                return bad("each column of the lower triangle must have its diagonal entry");
            }
            if below.windows(2).any(|pair| pair[0] >= pair[1])
                || below[below.len() - 1] as usize >= size
            {
                return bad("rows must rise within a column and lie inside the matrix");
            }
            if !values[from + above..to].iter().all(|v| v.is_finite()) {
                return bad("all entries must be finite");
            }
            diagonal[column] = (from + above) as u32;
        }
        Ok(Self { matrix, diagonal })
    }

    /// Rows and columns.
    fn size(&self) -> usize {
        self.diagonal.len()
    }

    fn span(&self, column: usize) -> std::ops::Range<usize> {
        self.diagonal[column] as usize..self.matrix.starts[column + 1] as usize
    }

    /// Rows of a column's entries, from the diagonal on.
    fn rows(&self, column: usize) -> &[u32] {
        &self.matrix.rows[self.span(column)]
    }

    /// Those entries.
    fn values(&self, column: usize) -> &[f64] {
        &self.matrix.values[self.span(column)]
    }

    /// Rows of a column's entries below the diagonal.
    fn below(&self, column: usize) -> &[u32] {
        &self.rows(column)[1..]
    }
}

/// The factor of a matrix.
#[derive(Debug)]
pub struct Cholesky {
    plan: Plan,
    /// One by the diagonal, of unknowns that have to do with no other.
    alone: Vec<f64>,
    /// The numbers of all blocks.
    parts: Vec<Part>,
}

impl Cholesky {
    /// Factors a positive definite matrix whose factor, with the work on it, takes at most `limit` bytes.
    pub fn new(matrix: &Lower<'_>, limit: usize, monitor: &Monitor) -> Result<Self> {
        // Of the pattern of the factor, beside its numbers.
        memory::room("the order of the matrix", matrix.rows.len(), 64)?;
        let matrix = Checked::new(*matrix)?;
        let order = order::dissect(&matrix, monitor)?;
        let (plan, entries) = Plan::new(&matrix, order, monitor)?;
        let needed = (plan.alone + plan.len + plan.room).saturating_mul(size_of::<f64>());
        if needed > limit {
            return Err(Error::Limit {
                what: "the factor of the matrix".into(),
                needed: format!("{:.2} GB", needed as f64 / 1e9),
                limit: format!("{:.2} GB", limit as f64 / 1e9),
            });
        }
        memory::room("the factor of the matrix", needed, 1)?;
        let mut alone = memory::filled("the factor of the matrix", 0.0, plan.alone)?;
        for (place, inverse) in alone.iter_mut().enumerate() {
            let pivot: f64 = entries.values[entries.of(place..place + 1)].iter().sum();
            if !dense::is_pivot(pivot) {
                return Err(not_definite());
            }
            *inverse = 1.0 / pivot;
        }
        let parts = factor::factor(&plan, &entries, monitor)?;
        Ok(Self { plan, alone, parts })
    }

    /// Rows of the matrix.
    pub fn size(&self) -> usize {
        self.plan.unknown.len()
    }

    /// Entries of the factor, with the zeros that its dense blocks hold.
    pub fn entries(&self) -> usize {
        self.plan.alone + self.plan.len
    }

    /// Replaces right sides, one after the other, by the solutions.
    pub fn solve(&self, sides: &mut [f64]) -> Result<()> {
        let size = self.size();
        if sides.is_empty() || !sides.len().is_multiple_of(size) {
            return Err(Error::Shape {
                argument: "sides",
                expected: vec![size],
                got: vec![sides.len()],
            });
        }
        let mut pairs = sides.chunks_exact_mut(2 * size);
        for pair in &mut pairs {
            let (one, other) = pair.split_at_mut(size);
            solve::solve(self, [one, other])?;
        }
        match pairs.into_remainder() {
            [] => Ok(()),
            last => solve::solve(self, [last]),
        }
    }
}

fn not_definite() -> Error {
    Error::value("matrix", "is not positive definite")
}

#[cfg(test)]
mod tests;
