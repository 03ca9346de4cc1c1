use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::run;
use crate::kernels::distance::{self, Piece};

/// A label, the first pixel of its window, and the shape of the window.
type Window = (i32, [i64; 2], [usize; 2]);

/// Returns the signed distances to the outline of each piece in its window, or `None` if the window
/// contains only one side of the outline.
#[pyfunction]
pub(super) fn outlines<'py>(
    py: Python<'py>,
    labels: PyReadonlyArray2<'py, i32>,
    windows: Vec<Window>,
) -> PyResult<Vec<Option<Bound<'py, PyArray2<f32>>>>> {
    let shape = [labels.shape()[0], labels.shape()[1]];
    let labels = labels.as_slice()?;
    let piece = |(label, low, shape): Window| Piece { label, low, shape };
    let pieces: Vec<Piece> = windows.into_iter().map(piece).collect();
    let found = run(py, None, |monitor| {
        distance::outlines(labels, shape, &pieces, monitor)
    })?;
    let array = |(found, piece): (Option<Vec<f32>>, &Piece)| {
        found
            .map(|values| PyArray1::from_vec(py, values).reshape(piece.shape))
            .transpose()
    };
    found.into_iter().zip(&pieces).map(array).collect()
}
