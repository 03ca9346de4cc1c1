use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use super::{grouped, run, run_small};
use crate::foundation::grid::Grid;
use crate::kernels::gather::CHUNK;
use crate::kernels::warp::{self, Mesh, Motion, Shape, Warped};

/// Source coordinates (pixels, 2), the triangle of each pixel, and three counts: drawn triangles,
/// flipped triangles, and flipped triangles whose corners all have a weight.
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

/// Draws a dense mesh at its target positions. The mesh has one point for each pixel of an image of
/// the shape `source`.
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

/// Warps by scattered points (points, 2). Also returns the corners of their triangles.
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

/// The first pixel and the shape of the window. Then flat arrays: source coordinates (pixels, 2),
/// distance, inside, deep. Then the number of pixels inside and the linear part of the inverse
/// motion.
type PlacedOut<'py> = (
    [usize; 2],
    [usize; 2],
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<bool>>,
    usize,
    [[f64; 2]; 2],
);

/// Moves a shape about its centre over a canvas. The shape is an array (rows, columns) of distances
/// to its outline.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // the arguments of the Python wrapper
pub(super) fn place<'py>(
    py: Python<'py>,
    distance: PyReadonlyArray2<'py, f32>,
    origin: [f64; 2],
    centre: [f64; 2],
    matrix: [[f64; 2]; 2],
    shift: [f64; 2],
    canvas: [usize; 2],
    depth: f32,
) -> PyResult<Option<PlacedOut<'py>>> {
    let grid = Grid::new([distance.shape()[0], distance.shape()[1]], [false; 2])?;
    let shape = Shape {
        distance: distance.as_slice()?,
        grid,
        origin,
    };
    // Return nothing if the moved shape is outside the canvas.
    let motion = Motion::new(centre, shift, matrix)?;
    let Some(window) = motion.window(&shape, canvas) else {
        return Ok(None);
    };
    let small = window.shape[0] * window.shape[1] <= CHUNK;
    let placed = run_small(py, small, |monitor| {
        motion.place(&shape, &window, canvas, depth, monitor)
    })?;
    Ok(Some((
        window.low,
        window.shape,
        PyArray1::from_vec(py, placed.places.into_flattened()),
        PyArray1::from_vec(py, placed.distance),
        PyArray1::from_vec(py, placed.inside),
        PyArray1::from_vec(py, placed.deep),
        placed.count,
        motion.inverse(),
    )))
}
