//! Symmetric positive definite systems: factored once, solved many times.
//!
//! A sparse Cholesky factorisation in double precision: deformation energies weigh some equations 10^9 times as much as
//! others, which leaves nothing for iterations or for single precision. Columns are ordered by approximate minimum
//! degree; the numbers are computed by one thread, so that they are the same for any number of threads. Two
//! factorisations may run beside each other.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

use crate::foundation::memory;
use crate::foundation::par::Monitor;
use crate::{Error, Result};

/// The lower triangle of a symmetric matrix, column by column.
#[derive(Debug, Clone, Copy)]
pub struct Lower<'a> {
    /// Where each column begins in `rows` and `values`, and where the last one ends.
    pub starts: &'a [u32],
    /// Rows of the entries, rising in each column, the diagonal first.
    pub rows: &'a [u32],
    /// The entries.
    pub values: &'a [f64],
}

impl Lower<'_> {
    fn check(&self) -> Result<usize> {
        let bad = |message: &str| Err(Error::value("matrix", message));
        let size = self.starts.len().saturating_sub(1);
        if size == 0 || size > i32::MAX as usize / 2 {
            return bad("needs at least one column, and fewer than 2^30");
        }
        if self.rows.len() != self.values.len()
            || self.starts[0] != 0
            || self.starts[size] as usize != self.rows.len()
        {
            return bad(
                "its columns must begin at 0 and end with the last of as many rows as values",
            );
        }
        for column in 0..size {
            let (from, to) = (
                self.starts[column] as usize,
                self.starts[column + 1] as usize,
            );
            if from >= to || to > self.rows.len() || self.rows[from] as usize != column {
                return bad("each column of the lower triangle must begin with its diagonal entry");
            }
            let rows = &self.rows[from..to];
            if rows.windows(2).any(|pair| pair[0] >= pair[1])
                || rows[rows.len() - 1] as usize >= size
            {
                return bad("rows must rise within a column and lie inside the matrix");
            }
        }
        if !self.values.iter().all(|v| v.is_finite()) {
            return bad("all entries must be finite");
        }
        Ok(size)
    }
}

/// The factor of a matrix.
#[derive(Debug)]
pub struct Cholesky {
    symbolic: SymbolicCholesky<u32>,
    values: Vec<f64>,
}

impl Cholesky {
    /// Factors a positive definite matrix whose factor takes at most `limit` bytes.
    pub fn new(matrix: &Lower<'_>, limit: usize, monitor: &Monitor) -> Result<Self> {
        let size = matrix.check()?;
        // Of the pattern of the factor, beside its numbers.
        memory::room("the order of the matrix", matrix.rows.len(), 64)?;
        let pattern =
            SymbolicSparseColMatRef::new_checked(size, size, matrix.starts, None, matrix.rows);
        let symbolic = factorize_symbolic_cholesky(
            pattern,
            Side::Lower,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams::default(),
        )
        .map_err(|_| too_large("more than can be counted", limit))?;
        monitor.check()?;
        let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let needed = (symbolic.len_val() * size_of::<f64>()).saturating_add(scratch.size_bytes());
        if needed > limit {
            return Err(too_large(&format!("{:.2} GB", needed as f64 / 1e9), limit));
        }
        let mut values = memory::filled("the factor of the matrix", 0.0, symbolic.len_val())?;
        let mut memory =
            MemBuffer::try_new(scratch).map_err(|_| too_large("more than there is", limit))?;
        symbolic
            .factorize_numeric_llt::<f64>(
                &mut values,
                SparseColMatRef::new(pattern, matrix.values),
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(|_| Error::value("matrix", "is not positive definite"))?;
        monitor.check()?;
        Ok(Self { symbolic, values })
    }

    /// Rows of the matrix.
    pub fn size(&self) -> usize {
        self.symbolic.nrows()
    }

    /// Entries of the factor, with the zeros that its dense blocks hold.
    pub fn entries(&self) -> usize {
        self.values.len()
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
        let columns = sides.len() / size;
        let scratch = self
            .symbolic
            .solve_in_place_scratch::<f64>(columns, Par::Seq);
        let mut memory =
            MemBuffer::try_new(scratch).map_err(|_| too_large("more than there is", 0))?;
        LltRef::new(&self.symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(sides, size, columns),
            Par::Seq,
            MemStack::new(&mut memory),
        );
        Ok(())
    }
}

fn too_large(needed: &str, limit: usize) -> Error {
    Error::Limit {
        what: "the factor of the matrix".into(),
        needed: needed.into(),
        limit: format!("{:.2} GB", limit as f64 / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The Laplacian of a grid, screened: lower triangle.
    fn laplacian(rows: usize, columns: usize, screening: f64) -> (Vec<u32>, Vec<u32>, Vec<f64>) {
        let (mut starts, mut at, mut values) = (vec![0], vec![], vec![]);
        for i in 0..rows * columns {
            let (y, x) = (i / columns, i % columns);
            let mut degree = 0.0;
            for (there, inside) in [
                (1, y > 0),
                (1, y + 1 < rows),
                (1, x > 0),
                (1, x + 1 < columns),
            ] {
                degree += f64::from(u8::from(inside)) * f64::from(there);
            }
            at.push(i as u32);
            values.push(degree + screening);
            if x + 1 < columns {
                at.push(i as u32 + 1);
                values.push(-1.0);
            }
            if y + 1 < rows {
                at.push((i + columns) as u32);
                values.push(-1.0);
            }
            starts.push(at.len() as u32);
        }
        (starts, at, values)
    }

    fn times(lower: &Lower<'_>, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for column in 0..x.len() {
            for k in lower.starts[column] as usize..lower.starts[column + 1] as usize {
                let row = lower.rows[k] as usize;
                y[row] += lower.values[k] * x[column];
                if row != column {
                    y[column] += lower.values[k] * x[row];
                }
            }
        }
        y
    }

    proptest! {
        #[test]
        fn solutions_solve(rows in 1usize..24, columns in 1usize..24, seed in 0u64..1000) {
            let (starts, at, values) = laplacian(rows, columns, 1e-3);
            let matrix = Lower { starts: &starts, rows: &at, values: &values };
            let factor = Cholesky::new(&matrix, 1 << 30, &Monitor::default()).unwrap();
            let n = rows * columns;
            let wanted: Vec<f64> = (0..2 * n).map(|i| ((i as u64 * 7919 + seed) % 101) as f64 - 50.0).collect();
            let mut x: Vec<f64> = [times(&matrix, &wanted[..n]), times(&matrix, &wanted[n..])].concat();
            factor.solve(&mut x).unwrap();
            for (a, b) in x.iter().zip(&wanted) {
                prop_assert!((a - b).abs() < 1e-7, "{a} {b}");
            }
        }
    }

    #[test]
    fn bad_matrices_are_refused() {
        let refused = |starts: &[u32], rows: &[u32], values: &[f64], limit: usize| {
            let matrix = Lower {
                starts,
                rows,
                values,
            };
            Cholesky::new(&matrix, limit, &Monitor::default())
                .unwrap_err()
                .to_string()
        };
        assert!(refused(&[0], &[], &[], 1 << 20).contains("one column"));
        assert!(refused(&[0, 1, 2], &[0, 0], &[1.0, 1.0], 1 << 20).contains("diagonal"));
        assert!(refused(&[0, 2], &[0, 5], &[1.0, 1.0], 1 << 20).contains("inside"));
        assert!(refused(&[0, 1], &[0], &[f64::NAN], 1 << 20).contains("finite"));
        assert!(refused(&[0, 1], &[0], &[-1.0], 1 << 20).contains("positive definite"));
        assert!(refused(&[0, 1], &[0], &[1.0], 1).contains("limit"));
    }
}
