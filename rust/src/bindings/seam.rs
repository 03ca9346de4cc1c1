use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyReadonlyArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use super::{grouped, run, run_small};
use crate::foundation::grid::Grid;
use crate::foundation::par;
use crate::kernels::seam::cost::Cost;
use crate::kernels::seam::{labels, outlines, stitch, strip};
use crate::{Error, Result};

/// Maximum number of points of a cut that runs on the calling thread.
const SMALL: usize = 4096;

/// The flattened mask of the pixels of the second image, the cost of the cut, and the number of
/// edges that it crosses.
type Cut<'py> = (Bound<'py, PyArray1<bool>>, f64, usize);

fn cost(name: &str) -> Result<Cost> {
    match name {
        "paper" => Ok(Cost::Difference),
        "gradient" => Ok(Cost::Gradient),
        other => Err(Error::value(
            "cost",
            format!("must be one of paper, gradient; got {other:?}"),
        )),
    }
}

fn slice<'a, T: numpy::Element>(
    array: &'a Option<PyReadonlyArrayDyn<'_, T>>,
) -> PyResult<Option<&'a [T]>> {
    Ok(array.as_ref().map(|a| a.as_slice()).transpose()?)
}

fn slices<'a, const D: usize>(
    arrays: &'a [PyReadonlyArrayDyn<'_, f32>],
) -> PyResult<[&'a [f32]; D]> {
    let all = arrays
        .iter()
        .map(|a| a.as_slice())
        .collect::<std::result::Result<Vec<_>, _>>()?;
    all.try_into().map_err(|all: Vec<_>| {
        Error::value(
            "axes",
            format!(
                "must have one array for each of {D} axes, got {}",
                all.len()
            ),
        )
        .into()
    })
}

/// Cuts between the images `a` and `b` (..., channels) with masks (...). Old seams are three lists
/// with one array for each axis: `kept`, `ab` and `ba`.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // the arguments of the Python wrapper
pub(super) fn seam_cut<'py>(
    py: Python<'py>,
    a: PyReadonlyArrayDyn<'py, f32>,
    b: PyReadonlyArrayDyn<'py, f32>,
    mask_a: PyReadonlyArrayDyn<'py, bool>,
    mask_b: PyReadonlyArrayDyn<'py, bool>,
    core_a: Option<PyReadonlyArrayDyn<'py, bool>>,
    core_b: Option<PyReadonlyArrayDyn<'py, bool>>,
    penalty: Option<PyReadonlyArrayDyn<'py, f32>>,
    old: Option<[Vec<PyReadonlyArrayDyn<'py, f32>>; 3]>,
    cost: &str,
    wrap: Vec<bool>,
) -> PyResult<Cut<'py>> {
    let call = Call {
        a,
        b,
        mask_a,
        mask_b,
        core_a,
        core_b,
        penalty,
        old,
        cost: self::cost(cost)?,
    };
    match wrap.len() {
        2 => call.run::<2>(py, &wrap),
        3 => call.run::<3>(py, &wrap),
        n => Err(Error::value(
            "wrap",
            format!("must have one flag for each of 2 or 3 axes, got {n}"),
        )
        .into()),
    }
}

struct Call<'py> {
    a: PyReadonlyArrayDyn<'py, f32>,
    b: PyReadonlyArrayDyn<'py, f32>,
    mask_a: PyReadonlyArrayDyn<'py, bool>,
    mask_b: PyReadonlyArrayDyn<'py, bool>,
    core_a: Option<PyReadonlyArrayDyn<'py, bool>>,
    core_b: Option<PyReadonlyArrayDyn<'py, bool>>,
    penalty: Option<PyReadonlyArrayDyn<'py, f32>>,
    old: Option<[Vec<PyReadonlyArrayDyn<'py, f32>>; 3]>,
    cost: Cost,
}

impl<'py> Call<'py> {
    fn run<const D: usize>(&self, py: Python<'py>, wrap: &[bool]) -> PyResult<Cut<'py>> {
        let grid = grid::<D>(self.mask_a.shape(), wrap)?;
        let channels = self.a.shape().last().copied().unwrap_or(0);
        let old = match &self.old {
            None => None,
            Some([kept, ab, ba]) => Some(stitch::OldSeams {
                kept: slices::<D>(kept)?,
                ab: slices::<D>(ab)?,
                ba: slices::<D>(ba)?,
            }),
        };
        let (mask_a, mask_b) = (self.mask_a.as_slice()?, self.mask_b.as_slice()?);
        let overlap = stitch::Overlap {
            core_a: slice(&self.core_a)?,
            core_b: slice(&self.core_b)?,
            penalty: slice(&self.penalty)?,
            old,
            cost: self.cost,
            ..stitch::Overlap::new(
                grid,
                channels,
                self.a.as_slice()?,
                self.b.as_slice()?,
                mask_a,
                mask_b,
            )
        };
        let small = mask_a.len() <= SMALL;
        let cut = run_small(py, small, |monitor| stitch::cut(&overlap, monitor))?;
        Ok((PyArray1::from_vec(py, cut.b), cut.value, cut.edges))
    }
}

fn grid<const D: usize>(shape: &[usize], wrap: &[bool]) -> Result<Grid<D>> {
    let axes = |n: usize| Error::value("shape", format!("must have {D} axes, got {n}"));
    Grid::new(
        shape.try_into().map_err(|_| axes(shape.len()))?,
        wrap.try_into().map_err(|_| axes(wrap.len()))?,
    )
}

/// The arrays of each strip: two images (rows, columns, channels), the axis that the seam crosses,
/// and a penalty (rows, columns).
type StripArrays<'py> = (
    PyReadonlyArray3<'py, f32>,
    PyReadonlyArray3<'py, f32>,
    usize,
    Option<PyReadonlyArrayDyn<'py, f32>>,
);

#[pyfunction]
pub(super) fn seam_strips<'py>(
    py: Python<'py>,
    strips: Vec<StripArrays<'py>>,
    cyclic: bool,
    cost: &str,
) -> PyResult<Vec<Cut<'py>>> {
    let cost = self::cost(cost)?;
    let pasted = strips
        .iter()
        .map(|(a, b, axis, penalty)| {
            Ok(strip::Pasted {
                shape: [a.shape()[0], a.shape()[1]],
                channels: a.shape()[2],
                a: a.as_slice()?,
                b: b.as_slice()?,
                axis: *axis,
                cyclic,
                penalty: slice(penalty)?,
                cost,
            })
        })
        .collect::<PyResult<Vec<_>>>()?;
    // Each strip is one task, because a strip is too small to be divided.
    let cuts = run(py, None, |monitor| {
        par::map(pasted.len(), |i| strip::cut(&pasted[i], monitor))
            .into_iter()
            .collect::<Result<Vec<_>>>()
    })?;
    Ok(cuts
        .into_iter()
        .map(|cut| (PyArray1::from_vec(py, cut.b), cut.value, cut.edges))
        .collect())
}

/// Returns binary labels from unary costs (..., 2) and pairwise costs, one array for each axis.
#[pyfunction]
pub(super) fn seam_labels<'py>(
    py: Python<'py>,
    unary: PyReadonlyArrayDyn<'py, f32>,
    forward: Vec<PyReadonlyArrayDyn<'py, f32>>,
    backward: Vec<PyReadonlyArrayDyn<'py, f32>>,
    wrap: Vec<bool>,
) -> PyResult<(Bound<'py, PyArray1<bool>>, f64)> {
    match wrap.len() {
        2 => axes::<2>(py, &unary, &forward, &backward, &wrap),
        3 => axes::<3>(py, &unary, &forward, &backward, &wrap),
        n => Err(Error::value(
            "wrap",
            format!("must have one flag for each of 2 or 3 axes, got {n}"),
        )
        .into()),
    }
}

fn axes<'py, const D: usize>(
    py: Python<'py>,
    unary: &PyReadonlyArrayDyn<'py, f32>,
    forward: &[PyReadonlyArrayDyn<'py, f32>],
    backward: &[PyReadonlyArrayDyn<'py, f32>],
    wrap: &[bool],
) -> PyResult<(Bound<'py, PyArray1<bool>>, f64)> {
    let shape = unary.shape();
    let energy = labels::Energy {
        grid: grid::<D>(&shape[..shape.len().saturating_sub(1)], wrap)?,
        unary: grouped("unary", unary.as_slice()?)?,
        forward: slices(forward)?,
        backward: slices(backward)?,
    };
    let found = run(py, None, |monitor| labels::least_energy(&energy, monitor))?;
    Ok((PyArray1::from_vec(py, found.labels), found.energy))
}

/// Returns labels (rows, columns) whose outlines are minimum cuts in bands around the given outlines. `inside` and `price`
/// have the same shape, and `reach` has one value for each label.
#[pyfunction]
pub(super) fn refine_outlines<'py>(
    py: Python<'py>,
    labels: PyReadonlyArray2<'py, i32>,
    inside: PyReadonlyArray2<'py, f32>,
    price: PyReadonlyArray2<'py, f32>,
    pull: f32,
    reach: Vec<u8>,
) -> PyResult<Bound<'py, PyArray2<i32>>> {
    let shape = [labels.shape()[0], labels.shape()[1]];
    let (labels, inside, price) = (labels.as_slice()?, inside.as_slice()?, price.as_slice()?);
    let evidence = outlines::Evidence {
        inside,
        price,
        pull,
    };
    let found = run(py, None, |monitor| {
        outlines::refine(labels, shape, &evidence, &reach, monitor)
    })?;
    PyArray1::from_vec(py, found).reshape(shape)
}
