use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::run;
use crate::foundation::memory;
use crate::kernels::smooth::{Axis, Edge, smooth as smooth_along};

/// Numbers of either precision.
#[derive(FromPyObject)]
pub(super) enum Numbers<'py> {
    Single(PyReadonlyArray1<'py, f32>),
    Double(PyReadonlyArray1<'py, f64>),
}

/// An array smoothed along its axes: of each the weights, from the middle on, and what lies beyond its ends.
#[pyfunction]
pub(super) fn smooth<'py>(
    py: Python<'py>,
    values: Numbers<'py>,
    shape: Vec<usize>,
    axes: Vec<(Vec<f64>, String)>,
) -> PyResult<Bound<'py, PyAny>> {
    let axes = axes
        .into_iter()
        .map(|(weights, edge)| {
            let edge = match edge.as_str() {
                "reflect" => Edge::Reflect,
                "nearest" => Edge::Nearest,
                "wrap" => Edge::Wrap,
                "constant" => Edge::Zero,
                _ => return Err(PyValueError::new_err(format!("no edge is {edge:?}"))),
            };
            Ok(Axis { weights, edge })
        })
        .collect::<PyResult<Vec<_>>>()?;
    match values {
        Numbers::Single(values) => {
            let mut made = memory::copied("values", values.as_slice()?)?;
            run(py, None, |monitor| {
                smooth_along(&mut made, &shape, &axes, monitor)
            })?;
            Ok(PyArray1::from_vec(py, made).into_any())
        }
        Numbers::Double(values) => {
            let mut made = memory::copied("values", values.as_slice()?)?;
            run(py, None, |monitor| {
                smooth_along(&mut made, &shape, &axes, monitor)
            })?;
            Ok(PyArray1::from_vec(py, made).into_any())
        }
    }
}
