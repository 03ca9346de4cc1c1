use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use super::run;
use crate::foundation::memory;
use crate::foundation::par;
use crate::kernels::sparse::{self, Lower};

/// Column starts, rows and values of a lower triangle.
type Entries<'py> = (
    PyReadonlyArray1<'py, u32>,
    PyReadonlyArray1<'py, u32>,
    PyReadonlyArray1<'py, f64>,
);

/// The factor of a symmetric positive definite matrix.
#[pyclass(frozen, module = "texrs._rust")]
pub(super) struct Cholesky(sparse::Cholesky);

#[pymethods]
impl Cholesky {
    #[new]
    fn new(
        py: Python<'_>,
        starts: PyReadonlyArray1<'_, u32>,
        rows: PyReadonlyArray1<'_, u32>,
        values: PyReadonlyArray1<'_, f64>,
        limit: usize,
    ) -> PyResult<Self> {
        let matrix = Lower {
            starts: starts.as_slice()?,
            rows: rows.as_slice()?,
            values: values.as_slice()?,
        };
        run(py, None, |monitor| {
            sparse::Cholesky::new(&matrix, limit, monitor)
        })
        .map(Self)
    }

    /// Factors several matrices in parallel. Each factor equals the factor of a separate call.
    #[staticmethod]
    fn several(py: Python<'_>, matrices: Vec<Entries<'_>>, limit: usize) -> PyResult<Vec<Self>> {
        let lower = matrices
            .iter()
            .map(|(starts, rows, values)| {
                Ok(Lower {
                    starts: starts.as_slice()?,
                    rows: rows.as_slice()?,
                    values: values.as_slice()?,
                })
            })
            .collect::<PyResult<Vec<_>>>()?;
        run(py, None, |monitor| {
            par::map(lower.len(), |i| {
                sparse::Cholesky::new(&lower[i], limit, monitor).map(Self)
            })
            .into_iter()
            .collect()
        })
    }

    #[getter]
    fn size(&self) -> usize {
        self.0.size()
    }

    #[getter]
    fn entries(&self) -> usize {
        self.0.entries()
    }

    /// Solves for several right-hand sides, stored one after the other.
    fn solve<'py>(
        &self,
        py: Python<'py>,
        sides: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut found = memory::copied("sides", sides.as_slice()?)?;
        run(py, None, |_| self.0.solve(&mut found))?;
        Ok(PyArray1::from_vec(py, found))
    }
}
