use std::sync::OnceLock;

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::appearance::{GuideIn, Where, fixed, frames, guide, region, slices};
use super::{grouped, run};
use crate::Result;
use crate::engine::stitcher::{
    self, Adjacency, Elements, Given, Options, Pasted, Pasting, Patch, Prepared, Samples, Shown,
    Source, Weights,
};
use crate::foundation::fixed::{Frame, ONE};
use crate::foundation::grid::Grid;
use crate::foundation::memory;

/// An exemplar that patches are cut from.
#[pyclass(frozen)]
pub(super) struct Stitcher(Either);

enum Either {
    Two(Known<2>),
    Three(Known<3>),
}

/// A source and the data for its search, which are prepared at the first use.
struct Known<const D: usize> {
    source: Source<D>,
    prepared: OnceLock<Prepared<D>>,
}

impl<const D: usize> Known<D> {
    fn new(source: Source<D>) -> Self {
        Self {
            source,
            prepared: OnceLock::new(),
        }
    }

    fn prepared(&self) -> &Prepared<D> {
        self.prepared.get_or_init(|| Prepared::new(&self.source))
    }
}

/// Coordinates, patch numbers, the frame of each patch, the mean cost of the seams, and the number
/// of healing moves.
type StitchedOut<'py> = (
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<i16>>,
    f64,
    usize,
);

#[pymethods]
impl Stitcher {
    #[new]
    #[allow(clippy::too_many_arguments)] // one argument for each array of an exemplar
    fn new(
        py: Python<'_>,
        colours: PyReadonlyArray2<'_, f32>,
        shape: Vec<usize>,
        wrap: Vec<bool>,
        labels: PyReadonlyArray1<'_, u32>,
        depth: PyReadonlyArray1<'_, f32>,
        classes: PyReadonlyArray1<'_, u8>,
        costs: PyReadonlyArray1<'_, f32>,
    ) -> PyResult<Self> {
        let channels = colours.shape()[1];
        let colours = colours.as_slice()?;
        let elements = Elements {
            labels: labels.as_slice()?,
            depth: depth.as_slice()?,
        };
        let adjacency = Adjacency {
            classes: classes.as_slice()?,
            costs: costs.as_slice()?,
        };
        // The number of axes selects the type of the source.
        run(py, None, |_| match shape.len() {
            2 => {
                let grid = Grid::new(fixed("shape", &shape)?, fixed("wrap", &wrap)?)?;
                Source::new(colours, grid, channels, elements, adjacency)
                    .map(|source| Either::Two(Known::new(source)))
            }
            _ => {
                let grid = Grid::new(fixed("shape", &shape)?, fixed("wrap", &wrap)?)?;
                Source::new(colours, grid, channels, elements, adjacency)
                    .map(|source| Either::Three(Known::new(source)))
            }
        })
        .map(Self)
    }

    /// Stitches a region. The weights are colour, contact, jump, depth, joint, presence, surprise,
    /// distortion and guide.
    #[allow(clippy::too_many_arguments)] // the arguments of the Python method
    fn stitch<'py>(
        &self,
        py: Python<'py>,
        place: Where,
        jacobians: PyReadonlyArray3In<'py>,
        patch: PatchIn,
        weights: [f32; 9],
        charges: [f32; 3],
        seed: u64,
        held: PyReadonlyArray1<'py, bool>,
        given: PyReadonlyArray1<'py, i32>,
        loose: PyReadonlyArray1<'py, bool>,
        demand: Option<GuideIn<'py>>,
        lattice: Option<[[f64; 2]; 2]>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<StitchedOut<'py>> {
        let options = Options {
            lattice,
            ..options(patch, weights, charges, seed)
        };
        let (jacobians, held, given) = (jacobians.as_slice()?, held.as_slice()?, given.as_slice()?);
        let loose = loose.as_slice()?;
        let demand = slices(&demand)?;
        // Use a macro, because the types of the results differ for two and three axes.
        macro_rules! stitched {
            ($source:expr) => {
                run(py, progress, |monitor| -> Result<_> {
                    let region = region(&place)?;
                    let guide = guide(demand, $source.grid().len(), region.grid.len())?;
                    let given = Given {
                        points: held,
                        places: grouped("given", given)?,
                        loose,
                    };
                    let frames = frames(jacobians)?;
                    let made = stitcher::stitch(
                        $source,
                        &region,
                        frames,
                        guide.as_ref(),
                        given,
                        &options,
                        monitor,
                    )?;
                    let frames = made.frames.as_flattened().as_flattened().to_vec();
                    Ok((
                        made.places.into_flattened(),
                        made.patches,
                        frames,
                        made.seams,
                        made.healed,
                    ))
                })
            };
        }
        let (places, patches, frames, seams, healed) = match &self.0 {
            Either::Two(known) => stitched!(&known.source),
            Either::Three(known) => stitched!(&known.source),
        }?;
        let out = |x| PyArray1::from_vec(py, x);
        Ok((
            out(places),
            PyArray1::from_vec(py, patches),
            PyArray1::from_vec(py, frames),
            seams,
            healed,
        ))
    }

    /// Returns the cost of the seams between the points of a region that show different patches.
    fn judge<'py>(
        &self,
        py: Python<'py>,
        place: Where,
        places: PyReadonlyArray1<'py, i32>,
        patches: PyReadonlyArray1<'py, u32>,
        weights: [f32; 9],
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let (places, patches) = (places.as_slice()?, patches.as_slice()?);
        macro_rules! judged {
            ($known:expr) => {
                run(py, None, |_| {
                    let region = region(&place)?;
                    let places = grouped("places", places)?;
                    stitcher::judge(&$known.source, &region.grid, places, patches, seam(weights))
                        .map(Vec::into_flattened)
                })
            };
        }
        let seams = match &self.0 {
            Either::Two(known) => judged!(known),
            Either::Three(known) => judged!(known),
        }?;
        Ok(PyArray1::from_vec(py, seams))
    }

    /// Inserts patches into a region that is already covered. The points at the ends of the region
    /// do not change.
    #[allow(clippy::too_many_arguments)] // the arguments of the Python method
    fn cover<'py>(
        &self,
        py: Python<'py>,
        place: Where,
        jacobians: PyReadonlyArray3In<'py>,
        shown: ShownIn<'py>,
        patch: PatchIn,
        weights: [f32; 9],
        charges: [f32; 3],
        progress: Option<Py<PyAny>>,
    ) -> PyResult<ShownOut<'py>> {
        let options = options(patch, weights, charges, 0);
        let (places, patches, seams, distortion, table) = &shown;
        let (places, patches, seams) = (places.as_slice()?, patches.as_slice()?, seams.as_slice()?);
        let (distortion, table) = (distortion.as_slice()?, table.as_slice()?);
        let jacobians = jacobians.as_slice()?;
        // The table of patches has 10 columns for two axes and 17 for three.
        macro_rules! covered {
            ($known:expr, $columns:literal) => {
                run(py, progress, |monitor| -> Result<_> {
                    let rows: &[[i32; $columns]] = grouped("table", table)?;
                    let shown = Shown {
                        places: memory::copied("places", grouped("places", places)?)?,
                        patches: memory::copied("patches", patches)?,
                        seams: memory::copied("seams", grouped("seams", seams)?)?,
                        distortion: memory::copied("distortion", distortion)?,
                        table: rows.iter().map(|row| read(row)).collect(),
                    };
                    let made = stitcher::cover(
                        &$known.source,
                        $known.prepared(),
                        &region(&place)?,
                        frames(jacobians)?,
                        shown,
                        &options,
                        monitor,
                    )?;
                    let table: Vec<i32> = made.table.iter().flat_map(write).collect();
                    Ok((
                        made.places.into_flattened(),
                        made.patches,
                        made.seams.into_flattened(),
                        made.distortion,
                        table,
                    ))
                })
            };
        }
        let (places, patches, seams, distortion, table) = match &self.0 {
            Either::Two(known) => covered!(known, 10),
            Either::Three(known) => covered!(known, 17),
        }?;
        Ok((
            PyArray1::from_vec(py, places),
            PyArray1::from_vec(py, patches),
            PyArray1::from_vec(py, seams),
            PyArray1::from_vec(py, distortion),
            PyArray1::from_vec(py, table),
        ))
    }
}

/// Side, overlap, number of candidates, fraction of patches that cover the worst seams, and whether
/// patches bend and elements are healed.
type PatchIn = (f32, f32, usize, f32, bool, bool);

/// Coordinates, patch numbers, seams, distortion and the table of patches.
type ShownIn<'py> = (
    PyReadonlyArray1<'py, i32>,
    PyReadonlyArray1<'py, u32>,
    PyReadonlyArray1<'py, f32>,
    PyReadonlyArray1<'py, f32>,
    PyReadonlyArray1<'py, i32>,
);
type ShownOut<'py> = (
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<i32>>,
);

/// Reads a patch from its row: centre, place, frame, side in units of 1/4096, and whether it is
/// rigid.
fn read<const D: usize>(row: &[i32]) -> Patch<D> {
    let frame: Frame<D> =
        std::array::from_fn(|i| std::array::from_fn(|j| row[2 * D + i * D + j] as i16));
    Patch {
        centre: std::array::from_fn(|a| row[a]),
        place: std::array::from_fn(|a| row[D + a]),
        frame,
        side: row[2 * D + D * D] as f32 / ONE as f32,
        rigid: row[2 * D + D * D + 1] != 0,
    }
}

/// Returns the row of a patch, as [`read`] expects it.
fn write<const D: usize>(patch: &Patch<D>) -> Vec<i32> {
    let frame = patch.frame.as_flattened().iter().map(|&x| i32::from(x));
    let mut row: Vec<i32> = patch
        .centre
        .into_iter()
        .chain(patch.place)
        .chain(frame)
        .collect();
    row.push((patch.side * ONE as f32) as i32);
    row.push(i32::from(patch.rigid));
    row
}

fn seam(weights: [f32; 9]) -> Weights {
    let [
        colour,
        contact,
        jump,
        depth,
        joint,
        presence,
        surprise,
        distortion,
        guide,
    ] = weights;
    Weights {
        colour,
        contact,
        jump,
        depth,
        joint,
        presence,
        surprise,
        distortion,
        guide,
    }
}

fn options(patch: PatchIn, weights: [f32; 9], charges: [f32; 3], seed: u64) -> Options {
    let (side, overlap, candidates, recover, bend, heal) = patch;
    Options {
        patch: side,
        overlap,
        candidates,
        bend,
        recover,
        heal,
        weights: seam(weights),
        repetition: charges[0],
        continuation: charges[1],
        balance: charges[2],
        seed,
        lattice: None,
    }
}

type PyReadonlyArray3In<'py> = numpy::PyReadonlyArray3<'py, i16>;

/// A flat list of samples that patches are cut from.
#[pyclass(frozen)]
pub(super) struct PatchSamples(pub(super) Samples);

/// The shape of a window, the sample that each point shows, and the seams. Then masks of the points
/// that a patch covers, and of the points that must take it.
type PastingIn<'py> = (
    [usize; 2],
    PyReadonlyArray1<'py, u32>,
    PyReadonlyArray1<'py, f32>,
    PyReadonlyArray1<'py, bool>,
    PyReadonlyArray1<'py, bool>,
);

/// The points that take a patch, and the seams of the window after the cut.
type PastedOut<'py> = (Bound<'py, PyArray1<bool>>, Bound<'py, PyArray1<f32>>);

fn pasting<'a>(window: &'a PastingIn<'_>) -> PyResult<Pasting<'a>> {
    let (shape, shown, seams, mask, core) = window;
    Ok(Pasting {
        shape: *shape,
        shown: shown.as_slice()?,
        seams: grouped("seams", seams.as_slice()?)?,
        mask: mask.as_slice()?,
        core: core.as_slice()?,
    })
}

#[pymethods]
impl PatchSamples {
    #[new]
    fn new(
        py: Python<'_>,
        colours: PyReadonlyArray2<'_, f32>,
        depth: PyReadonlyArray1<'_, f32>,
        weights: (f32, f32),
    ) -> PyResult<Self> {
        let channels = colours.shape()[1];
        let (colours, depth) = (colours.as_slice()?, depth.as_slice()?);
        let weights = Weights {
            colour: weights.0,
            depth: weights.1,
            ..Weights::NONE
        };
        run(py, None, |_| {
            Samples::new(colours, channels, depth, weights)
        })
        .map(Self)
    }

    fn judge(
        &self,
        py: Python<'_>,
        window: PastingIn<'_>,
        patches: PyReadonlyArray2<'_, u32>,
    ) -> PyResult<Vec<f64>> {
        let points = patches.shape()[1].max(1);
        let patches: Vec<&[u32]> = patches.as_slice()?.chunks(points).collect();
        let pasting = pasting(&window)?;
        run(py, None, |monitor| {
            self.0.judge(&pasting, &patches, monitor)
        })
    }

    fn cut<'py>(
        &self,
        py: Python<'py>,
        window: PastingIn<'py>,
        patch: PyReadonlyArray1<'py, u32>,
    ) -> PyResult<PastedOut<'py>> {
        let (pasting, patch) = (pasting(&window)?, patch.as_slice()?);
        let Pasted { take, seams } = run(py, None, |monitor| self.0.cut(&pasting, patch, monitor))?;
        Ok((
            PyArray1::from_vec(py, take),
            PyArray1::from_vec(py, seams.into_flattened()),
        ))
    }
}
