use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::run;
use crate::foundation::memory;
use crate::kernels::smooth::{Axis, Edge, smooth as smooth_along};

/// Values of single or double precision.
#[derive(FromPyObject)]
pub(super) enum Numbers<'py> {
    Single(PyReadonlyArray1<'py, f32>),
    Double(PyReadonlyArray1<'py, f64>),
}

/// Smooths an array along its axes. Each axis has weights, from the central weight outwards, and an
/// edge rule.
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
                _ => {
                    return Err(PyValueError::new_err(format!(
                        "edge: must be one of reflect, nearest, wrap, constant; got {edge:?}"
                    )));
                }
            };
            Ok(Axis { weights, edge })
        })
        .collect::<PyResult<Vec<_>>>()?;
    // The kernel smooths a copy, because the caller's array is read-only.
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
