use numpy::{PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::run;
use crate::kernels::mean_shift::{Options, filter};

/// Filters an image (rows, columns, channels).
#[pyfunction]
#[allow(clippy::too_many_arguments)] // the arguments of the Python function
pub(super) fn mean_shift<'py>(
    py: Python<'py>,
    image: PyReadonlyArray3<'py, f32>,
    radius: usize,
    range: f32,
    max_iterations: usize,
    tolerance: f32,
    wrap: [bool; 2],
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let shape = [image.shape()[0], image.shape()[1], image.shape()[2]];
    let options = Options {
        radius,
        range,
        max_iterations,
        tolerance,
        wrap,
    };
    let samples = image.as_slice()?;
    let out = run(py, progress, |monitor| {
        filter(samples, shape, &options, monitor)
    })?;
    PyArray1::from_vec(py, out).reshape(shape)
}
