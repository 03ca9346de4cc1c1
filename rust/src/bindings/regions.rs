use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::run;
use crate::kernels::regions::{Options, felzenszwalb};

/// Returns the labels (rows, columns) of the regions of an image (rows, columns, channels).
#[pyfunction]
pub(super) fn merge_regions<'py>(
    py: Python<'py>,
    image: PyReadonlyArray3<'py, f32>,
    scale: f64,
    blur: f64,
    least: usize,
    wrap: [bool; 2],
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyArray2<i32>>> {
    let shape = [image.shape()[0], image.shape()[1], image.shape()[2]];
    let options = Options {
        scale,
        blur,
        least,
        wrap,
    };
    let samples = image.as_slice()?;
    let labels = run(py, progress, |monitor| {
        felzenszwalb(samples, shape, &options, monitor)
    })?;
    PyArray1::from_vec(py, labels).reshape([shape[0], shape[1]])
}
