use numpy::{PyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::run;
use crate::kernels::nearest;

/// Vectors, made ready to be searched.
#[pyclass(frozen)]
pub(super) struct Nearest(nearest::Nearest);

/// Which vectors, and how far they are.
type FoundOut<'py> = (Bound<'py, PyArray1<u32>>, Bound<'py, PyArray1<f64>>);

#[pymethods]
impl Nearest {
    #[new]
    fn new(py: Python<'_>, vectors: PyReadonlyArray2<'_, f64>) -> PyResult<Self> {
        let numbers = vectors.shape()[1];
        let vectors = vectors.as_slice()?;
        run(py, None, |_| {
            nearest::Nearest::new(vectors.to_vec(), numbers)
        })
        .map(Self)
    }

    fn query<'py>(
        &self,
        py: Python<'py>,
        queries: PyReadonlyArray2<'py, f64>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<FoundOut<'py>> {
        let queries = queries.as_slice()?;
        let found = run(py, progress, |monitor| self.0.query(queries, monitor))?;
        Ok(given(py, found))
    }

    fn others<'py>(&self, py: Python<'py>, progress: Option<Py<PyAny>>) -> PyResult<FoundOut<'py>> {
        let found = run(py, progress, |monitor| self.0.others(monitor))?;
        Ok(given(py, found))
    }
}

fn given(py: Python<'_>, found: nearest::Found) -> FoundOut<'_> {
    (
        PyArray1::from_vec(py, found.index),
        PyArray1::from_vec(py, found.distance),
    )
}
