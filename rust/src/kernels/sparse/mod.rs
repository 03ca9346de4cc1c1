//! Symmetric positive definite systems: factored once, solved many times.
//!
//! This is a sparse Cholesky factorisation in double precision. Deformation energies weight some
//! equations 10^9 times as much as others, which is too much for iterative solvers and for single
//! precision. The method is multifrontal, over a tree of blocks from nested dissection:
//!
//! - `order` chooses the order of elimination. `cut` divides the unknowns, and `grid` describes
//!   their couplings.
//! - `plan` computes the rows of each block.
//! - `factor` computes the values of the factor, with the dense operations in `dense`.
//! - `solve` solves systems with the factor.
//!
//! Every value is computed by one thread, by sums in a fixed order without fused operations. The result is therefore
//! the same for any number of threads and any width of SIMD registers.

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

/// Value for a missing unknown or block.
const NONE: u32 = u32::MAX;

/// A symmetric matrix, column by column. Only its lower triangle is read.
#[derive(Debug, Clone, Copy)]
pub struct Lower<'a> {
    /// Start of each column in `rows` and `values`, and the end of the last column.
    pub starts: &'a [u32],
    /// Rows of the entries, in increasing order within each column. Each column needs its diagonal
    /// entry. Entries above the diagonal may be omitted.
    pub rows: &'a [u32],
    /// Values of the entries.
    pub values: &'a [f64],
}

/// A matrix whose structure and entries are valid.
struct Checked<'a> {
    matrix: Lower<'a>,
    /// Positions of the diagonal entries.
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
            return bad("must have at least one column and fewer than 2^30");
        }
        if rows.len() != values.len() || starts[0] != 0 || starts[size] as usize != rows.len() {
            return bad("starts must begin with 0 and end with the number of rows and of values");
        }
        // Find the diagonal of each column, and check the order of its rows.
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
                return bad("rows must increase within a column and be inside the matrix");
            }
            if !values[from + above..to].iter().all(|v| v.is_finite()) {
                return bad("all entries must be finite");
            }
            diagonal[column] = (from + above) as u32;
        }
        Ok(Self { matrix, diagonal })
    }

    /// Number of rows and columns.
    fn size(&self) -> usize {
        self.diagonal.len()
    }

    fn span(&self, column: usize) -> std::ops::Range<usize> {
        self.diagonal[column] as usize..self.matrix.starts[column + 1] as usize
    }

    /// Rows of the entries of a column, starting at the diagonal.
    fn rows(&self, column: usize) -> &[u32] {
        &self.matrix.rows[self.span(column)]
    }

    /// Values of the entries of a column, starting at the diagonal.
    fn values(&self, column: usize) -> &[f64] {
        &self.matrix.values[self.span(column)]
    }

    /// Rows of the entries of a column below the diagonal.
    fn below(&self, column: usize) -> &[u32] {
        &self.rows(column)[1..]
    }
}

/// The factor of a matrix.
#[derive(Debug)]
pub struct Cholesky {
    plan: Plan,
    /// Reciprocal diagonal entries of unknowns that are not coupled to others.
    alone: Vec<f64>,
    /// The values of all blocks of the factor.
    parts: Vec<Part>,
}

impl Cholesky {
    /// Factors a positive definite matrix. The factor and the work on it may take at most `limit`
    /// bytes.
    pub fn new(matrix: &Lower<'_>, limit: usize, monitor: &Monitor) -> Result<Self> {
        // Check the memory for the pattern of the factor, without its values.
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

    /// Number of rows of the matrix.
    pub fn size(&self) -> usize {
        self.plan.unknown.len()
    }

    /// Number of entries of the factor, including the zeros in its dense blocks.
    pub fn entries(&self) -> usize {
        self.plan.alone + self.plan.len
    }

    /// Replaces right-hand sides, stored one after the other, by the solutions.
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
    Error::value("matrix", "must be positive definite")
}

#[cfg(test)]
mod tests;
