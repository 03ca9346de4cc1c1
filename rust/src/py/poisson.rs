use numpy::{
    PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use super::run;
use crate::Error;
use crate::poisson::{Edge, Problem};

/// Image and differences (rows, columns, channels); the edges of both axes: fixed, wrap or free.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // the arguments of the Python function
pub(super) fn poisson<'py>(
    py: Python<'py>,
    image: PyReadonlyArray3<'py, f32>,
    gradient_rows: PyReadonlyArray3<'py, f32>,
    gradient_columns: PyReadonlyArray3<'py, f32>,
    screening: f64,
    edges: [String; 2],
    mask: Option<PyReadonlyArray2<'py, bool>>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let shape = [image.shape()[0], image.shape()[1], image.shape()[2]];
    let [rows, columns] = edges;
    let problem = Problem {
        image: image.as_slice()?,
        gradient_rows: gradient_rows.as_slice()?,
        gradient_columns: gradient_columns.as_slice()?,
        shape,
        edges: [edge(&rows)?, edge(&columns)?],
        screening,
        mask: mask.as_ref().map(|m| m.as_slice()).transpose()?,
    };
    let out = run(py, None, |monitor| crate::poisson::solve(&problem, monitor))?;
    PyArray1::from_vec(py, out).reshape(shape)
}

fn edge(name: &str) -> PyResult<Edge> {
    match name {
        "dirichlet" => Ok(Edge::Fixed),
        "periodic" => Ok(Edge::Wrap),
        "free" => Ok(Edge::Free),
        other => {
            let message = format!("one of dirichlet, periodic, free; got {other:?}");
            Err(Error::value("boundary", message).into())
        }
    }
}
