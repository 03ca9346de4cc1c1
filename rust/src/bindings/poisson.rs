use numpy::{
    PyArray1, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyReadwriteArray3,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use super::run;
use crate::Error;
use crate::kernels::poisson::{Domain, Edge, Problem};

/// Reconstructs an image (rows, columns, channels) from differences. The boundary of each axis is
/// "dirichlet", "periodic" or "free".
#[pyfunction]
#[allow(clippy::too_many_arguments)] // the arguments of the Python function
pub(super) fn poisson<'py>(
    py: Python<'py>,
    image: PyReadonlyArray3<'py, f32>,
    gradients: Option<[PyReadonlyArray3<'py, f32>; 2]>,
    screening: f64,
    edges: [String; 2],
    mask: Option<PyReadonlyArray2<'py, bool>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let &[rows, columns, channels] = image.shape() else {
        unreachable!("three axes by type")
    };
    let shape = [rows, columns, channels];
    let gradients = match &gradients {
        Some([rows, columns]) => Some([rows.as_slice()?, columns.as_slice()?]),
        None => None,
    };
    let problem = Problem {
        image: image.as_slice()?,
        gradients,
        domain: domain(shape, &edges, screening, &mask)?,
    };
    let out = run(py, progress, |monitor| {
        crate::kernels::poisson::solve(&problem, monitor)
    })?;
    PyArray1::from_vec(py, out).reshape(shape)
}

/// Replaces the flow into each pixel (rows, columns, channels) by the solution of the Poisson
/// equation.
#[pyfunction]
pub(super) fn poisson_spread(
    py: Python<'_>,
    mut flow: PyReadwriteArray3<'_, f32>,
    screening: f64,
    edges: [String; 2],
    mask: Option<PyReadonlyArray2<'_, bool>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<()> {
    let &[rows, columns, channels] = flow.shape() else {
        unreachable!("three axes by type")
    };
    let domain = domain([rows, columns, channels], &edges, screening, &mask)?;
    let flow = flow.as_slice_mut()?;
    run(py, progress, |monitor| {
        crate::kernels::poisson::spread(&domain, flow, monitor)
    })
}

fn domain<'a>(
    shape: [usize; 3],
    [rows, columns]: &[String; 2],
    screening: f64,
    mask: &'a Option<PyReadonlyArray2<'_, bool>>,
) -> PyResult<Domain<'a>> {
    Ok(Domain {
        shape,
        edges: [edge(rows)?, edge(columns)?],
        screening,
        mask: mask.as_ref().map(|m| m.as_slice()).transpose()?,
    })
}

fn edge(name: &str) -> PyResult<Edge> {
    match name {
        "dirichlet" => Ok(Edge::Fixed),
        "periodic" => Ok(Edge::Wrap),
        "free" => Ok(Edge::Free),
        other => {
            let message = format!("must be one of dirichlet, periodic, free; got {other:?}");
            Err(Error::value("boundary", message).into())
        }
    }
}
