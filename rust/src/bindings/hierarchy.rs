use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use super::{grouped, run};
use crate::foundation::memory;
use crate::kernels::hierarchy::candidates::candidates;
use crate::kernels::hierarchy::measure::{self, Values};
use crate::kernels::hierarchy::merge::Cost;
use crate::kernels::hierarchy::{Graph, Sets};
use crate::kernels::watershed::{self, DIRECTIONS};
use crate::kernels::{contours, packing};
use crate::{Error, Result};

/// Returns how fast the local histogram of labels (rows, columns) changes at each pixel. Labels are below `count`.
#[pyfunction]
pub(super) fn contour_strength<'py>(
    py: Python<'py>,
    labels: PyReadonlyArray2<'py, u8>,
    count: usize,
    sigma: f64,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let shape = [labels.shape()[0], labels.shape()[1]];
    let labels = labels.as_slice()?;
    let found = run(py, None, |monitor| {
        contours::strength(labels, shape, count, sigma, monitor)
    })?;
    PyArray1::from_vec(py, found).reshape(shape)
}

/// Returns the watershed region of each pixel of an image (rows, columns), and the number of regions.
#[pyfunction]
pub(super) fn watershed_regions<'py>(
    py: Python<'py>,
    height: PyReadonlyArray2<'py, f32>,
    reach: usize,
) -> PyResult<(Bound<'py, PyArray2<u32>>, usize)> {
    let shape = [height.shape()[0], height.shape()[1]];
    let height = height.as_slice()?;
    let (labels, count) = run(py, None, |monitor| {
        watershed::flood(height, shape, reach, monitor)
    })?;
    Ok((PyArray1::from_vec(py, labels).reshape(shape)?, count))
}

/// Pairs of adjacent regions, measures of the border of each pair, and the extreme pixels of each region.
type Adjacency<'py> = (
    Bound<'py, PyArray2<u32>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray3<f32>>,
);

/// Returns the adjacency of regions: pairs (P, 2), their borders (P, 3) and extreme pixels (`count`, 32, 2). `labels` and
/// `strength` have the shape (rows, columns), and labels are below `count`.
#[pyfunction]
pub(super) fn region_adjacency<'py>(
    py: Python<'py>,
    labels: PyReadonlyArray2<'py, u32>,
    strength: PyReadonlyArray2<'py, f32>,
    count: usize,
    weak: f32,
) -> PyResult<Adjacency<'py>> {
    let shape = [labels.shape()[0], labels.shape()[1]];
    let (labels, strength) = (labels.as_slice()?, strength.as_slice()?);
    let found = run(py, None, |monitor| {
        watershed::adjacency(labels, strength, shape, count, weak, monitor)
    })?;
    let pairs = found.pairs.len();
    Ok((
        PyArray1::from_vec(py, found.pairs.into_flattened()).reshape([pairs, 2])?,
        PyArray1::from_vec(py, found.arcs.into_flattened()).reshape([pairs, 3])?,
        PyArray1::from_vec(py, found.extremes.into_flattened().into_flattened())
            .reshape([count, DIRECTIONS, 2])?,
    ))
}

/// Starts and members of the sets, and the strength of the border between the two parts of each set.
type Candidates<'py> = (
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<f64>>,
);

/// Returns the nodes of several merge trees of regions. Each row (arcs, means, small) of `costs` gives one tree. N
/// regions have `area` (N,), `mean` (N, 3) and `open` (N,). P borders have `pairs` (P, 2) and `arcs` (P, 2).
#[pyfunction]
#[allow(clippy::too_many_arguments)] // one argument for each option of the kernel
pub(super) fn region_candidates<'py>(
    py: Python<'py>,
    area: PyReadonlyArray1<'py, f64>,
    mean: PyReadonlyArray2<'py, f64>,
    pairs: PyReadonlyArray2<'py, u32>,
    arcs: PyReadonlyArray2<'py, f64>,
    open: PyReadonlyArray1<'py, bool>,
    costs: Vec<[f64; 3]>,
    least: f64,
    most: f64,
) -> PyResult<Candidates<'py>> {
    let graph = Graph {
        area: area.as_slice()?,
        mean: grouped("mean", mean.as_slice()?)?,
        pairs: grouped("pairs", pairs.as_slice()?)?,
        arcs: grouped("arcs", arcs.as_slice()?)?,
    };
    let open = open.as_slice()?;
    let costs: Vec<Cost> = costs
        .iter()
        .map(|&[arcs, means, small]| Cost { arcs, means, small })
        .collect();
    let found = run(py, None, |monitor| {
        candidates(&graph, &costs, open, [least, most], monitor)
    })?;
    let (starts, members) = found.sets.into_parts();
    let starts = starts.into_iter().map(|s| s as i64).collect();
    Ok((
        PyArray1::from_vec(py, starts),
        PyArray1::from_vec(py, members),
        PyArray1::from_vec(py, found.seam),
    ))
}

fn sets(starts: &[i64], members: &[u32]) -> Result<Sets> {
    if starts.iter().any(|&s| s < 0) {
        return Err(Error::value("starts", "must be at least 0"));
    }
    memory::room("sets of regions", 2 * starts.len() + members.len(), 4)?;
    let starts = starts.iter().map(|&s| s as usize).collect();
    Sets::new(starts, members.to_vec())
}

/// Returns the measures of sets of regions, one row per set. Three sums along the outer border and three sums of
/// borders inside come first. Then follow the areas of the convex hull and of the smallest rectangle, the extent and
/// the contrast. The last one is the fraction of the border whose two sides look similar. N regions have `histograms`
/// (N, bins) and `extremes` (N, 32, 2). P borders have `pairs` (P, 2) and `arcs` (P, 3).
#[pyfunction]
pub(super) fn measure_regions<'py>(
    py: Python<'py>,
    starts: PyReadonlyArray1<'py, i64>,
    members: PyReadonlyArray1<'py, u32>,
    pairs: PyReadonlyArray2<'py, u32>,
    arcs: PyReadonlyArray2<'py, f64>,
    histograms: PyReadonlyArray2<'py, f32>,
    extremes: PyReadonlyArray3<'py, f32>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let sets = sets(starts.as_slice()?, members.as_slice()?)?;
    let bins = histograms.shape()[1];
    let points = grouped("extremes", extremes.as_slice()?)?;
    let values = Values::<3> {
        pairs: grouped("pairs", pairs.as_slice()?)?,
        arcs: grouped("arcs", arcs.as_slice()?)?,
        histograms: histograms.as_slice()?,
        bins,
        extremes: match points.as_chunks() {
            (rows, []) => rows,
            _ => {
                return Err(Error::value(
                    "extremes",
                    format!("must have {DIRECTIONS} points for each region"),
                )
                .into());
            }
        },
    };
    let found = run(py, None, |monitor| {
        measure::measure(&sets, &values, monitor)
    })?;
    let mut rows = Vec::with_capacity(11 * found.len());
    for m in &found {
        rows.extend(m.outer.iter().chain(&m.inner));
        rows.extend([m.hull, m.rectangle, m.extent, m.contrast, m.alike]);
    }
    PyArray1::from_vec(py, rows).reshape([found.len(), 11])
}

/// Returns the sums of values (regions, columns) over the regions of each set.
#[pyfunction]
pub(super) fn sum_regions<'py>(
    py: Python<'py>,
    starts: PyReadonlyArray1<'py, i64>,
    members: PyReadonlyArray1<'py, u32>,
    values: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let sets = sets(starts.as_slice()?, members.as_slice()?)?;
    let columns = values.shape()[1];
    let values = values.as_slice()?;
    let found = run(py, None, |monitor| {
        measure::sums(&sets, values, columns, monitor)
    })?;
    PyArray1::from_vec(py, found).reshape([sets.len(), columns])
}

/// Returns whether each set is chosen. The chosen sets are disjoint, and their total worth is large.
#[pyfunction]
pub(super) fn choose_disjoint<'py>(
    py: Python<'py>,
    starts: PyReadonlyArray1<'py, i64>,
    members: PyReadonlyArray1<'py, u32>,
    worth: PyReadonlyArray1<'py, f64>,
    quality: PyReadonlyArray1<'py, f64>,
    rounds: usize,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let sets = sets(starts.as_slice()?, members.as_slice()?)?;
    let (worth, quality) = (worth.as_slice()?, quality.as_slice()?);
    let found = run(py, None, |monitor| {
        packing::choose(&sets, worth, quality, rounds, monitor)
    })?;
    Ok(PyArray1::from_vec(py, found))
}
