use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use super::patch_search::PatchIndex;
use super::run;
use crate::foundation::grid::Grid;
use crate::foundation::memory;
use crate::kernels::inpaint::{Canvas, Options, inpaint as fill};
use crate::kernels::patch_search::Pick;

/// Filled colours, the patch number of each pixel, and five numbers for each patch: exemplar,
/// source row and column, target row and column.
type Filled<'py> = (
    Bound<'py, PyArray3<f32>>,
    Bound<'py, PyArray2<i32>>,
    Bound<'py, PyArray2<i64>>,
);

#[pyfunction(name = "complete")]
#[allow(clippy::too_many_arguments)] // the arguments of the Python wrapper
pub(super) fn inpaint<'py>(
    py: Python<'py>,
    colours: PyReadonlyArray3<'py, f32>,
    known: PyReadonlyArray2<'py, bool>,
    keep: Option<PyReadonlyArray2<'py, bool>>,
    index: &PatchIndex,
    wrap: [bool; 2],
    patch: [usize; 2],
    pick: (usize, usize, f64),
    seed: u64,
    paper: bool,
    shown: Option<usize>,
    lattice: Option<[[f64; 2]; 2]>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Filled<'py>> {
    let &[rows, columns, channels] = colours.shape() else {
        unreachable!("three axes by type")
    };
    let grid = Grid::new([rows, columns], wrap)?;
    // The kernel writes into copies, because the caller's arrays are read-only.
    let mut colours = memory::copied("colours", colours.as_slice()?)?;
    let mut known = memory::copied("known", known.as_slice()?)?;
    let keep = match &keep {
        Some(keep) => Some(memory::copied("keep", keep.as_slice()?)?),
        None => None,
    };
    let options = Options {
        patch,
        pick: Pick {
            count: pick.0,
            separation: pick.1,
            ratio: pick.2,
        },
        seed,
        paper,
        shown,
        lattice,
    };
    let index = &index.0;
    let filled = run(py, progress, |monitor| {
        let mut canvas = Canvas {
            grid,
            colours: &mut colours,
            known: &mut known,
            keep: keep.as_deref(),
            channels,
        };
        fill(&mut canvas, index, &options, monitor)
    })?;
    // Return each patch as a row of five numbers.
    let patches: Vec<i64> = filled
        .patches
        .iter()
        .flat_map(|p| [p.exemplar, p.from[0], p.from[1], p.to[0], p.to[1]])
        .map(|i| i as i64)
        .collect();
    let count = filled.patches.len();
    Ok((
        PyArray1::from_vec(py, colours).reshape([rows, columns, channels])?,
        PyArray1::from_vec(py, filled.label).reshape([rows, columns])?,
        PyArray1::from_vec(py, patches).reshape([count, 5])?,
    ))
}
