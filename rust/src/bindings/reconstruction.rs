use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::run;
use crate::foundation::grid::Grid;
use crate::kernels::reconstruction;

/// Dilates a seed repeatedly, limited by a mask after each step, until nothing changes.
#[pyfunction]
pub(super) fn reconstruct<'py>(
    py: Python<'py>,
    seed: PyReadonlyArray2<'py, f32>,
    mask: PyReadonlyArray2<'py, f32>,
    wrap: [bool; 2],
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let shape = [mask.shape()[0], mask.shape()[1]];
    let grid = Grid::new(shape, wrap)?;
    let (seed, mask) = (seed.as_slice()?, mask.as_slice()?);
    let found = run(py, None, |monitor| {
        reconstruction::reconstruct(seed, mask, &grid, monitor)
    })?;
    PyArray1::from_vec(py, found).reshape(shape)
}
