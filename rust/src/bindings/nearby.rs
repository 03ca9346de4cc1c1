use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::{grouped, run};
use crate::kernels::nearby;

/// Returns the weighted sum of the values of all points in a separable window around each point.
#[pyfunction]
pub(super) fn sum_nearby<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, i64>,
    values: PyReadonlyArray1<'py, f32>,
    shape: [usize; 2],
    cyclic: bool,
    window: Vec<f64>,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let (points, values) = (grouped("points", points.as_slice()?)?, values.as_slice()?);
    let sums = run(py, None, |monitor| {
        nearby::sums(points, values, shape, cyclic, &window, monitor)
    })?;
    Ok(PyArray1::from_vec(py, sums))
}
