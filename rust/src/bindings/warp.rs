use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::{grouped, run};
use crate::kernels::warp::{self, Mesh, Warped};

/// Places (pixels, 2), triangle of each pixel, and how many were drawn, turned over, and heavy and turned over.
type WarpedOut<'py> = (
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<u32>>,
    [usize; 3],
);

fn out<'py>(py: Python<'py>, warped: Warped) -> PyResult<WarpedOut<'py>> {
    let pixels = warped.triangle.len();
    Ok((
        PyArray1::from_vec(py, warped.places.into_flattened()).reshape([pixels, 2])?,
        PyArray1::from_vec(py, warped.triangle),
        [warped.drawn, warped.flipped, warped.flipped_heavy],
    ))
}

/// A dense mesh of `source` pixels, drawn where they go.
#[pyfunction]
pub(super) fn warp_mesh<'py>(
    py: Python<'py>,
    source: [usize; 2],
    target: PyReadonlyArray2<'py, f64>,
    weight: PyReadonlyArray1<'py, u8>,
    shape: [usize; 2],
    progress: Option<Py<PyAny>>,
) -> PyResult<WarpedOut<'py>> {
    let mesh = Mesh {
        shape: source,
        target: grouped("target", target.as_slice()?)?,
        weight: weight.as_slice()?,
    };
    let warped = run(py, progress, |monitor| warp::mesh(&mesh, shape, monitor))?;
    out(py, warped)
}

/// Scattered points (points, 2), and the corners of their triangles.
#[pyfunction]
pub(super) fn warp_points<'py>(
    py: Python<'py>,
    source: PyReadonlyArray2<'py, f64>,
    target: PyReadonlyArray2<'py, f64>,
    shape: [usize; 2],
) -> PyResult<(WarpedOut<'py>, Bound<'py, PyArray2<u32>>)> {
    let (from, to) = (
        grouped("source", source.as_slice()?)?,
        grouped("target", target.as_slice()?)?,
    );
    let (warped, corners) = run(py, None, |monitor| {
        warp::scattered(from, to, shape, monitor)
    })?;
    let count = corners.len();
    let corners = PyArray1::from_vec(py, corners.into_flattened()).reshape([count, 3])?;
    Ok((out(py, warped)?, corners))
}
