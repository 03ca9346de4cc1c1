use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::appearance::{GuideIn, Where, fixed, frames, guide, region, slices};
use super::{grouped, run};
use crate::Result;
use crate::engine::stitcher::{self, Adjacency, Elements, Given, Options, Source, Weights};
use crate::foundation::grid::Grid;

/// An exemplar that patches are cut from.
#[pyclass(frozen)]
pub(super) struct Stitcher(Either);

enum Either {
    Two(Source<2>),
    Three(Source<3>),
}

/// Places, patches, the frame of each patch, the mean cost of seams, and moves that healed.
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
    #[allow(clippy::too_many_arguments)] // the arrays of an exemplar
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
        run(py, None, |_| match shape.len() {
            2 => {
                let grid = Grid::new(fixed("shape", &shape)?, fixed("wrap", &wrap)?)?;
                Source::new(colours, grid, channels, elements, adjacency).map(Either::Two)
            }
            _ => {
                let grid = Grid::new(fixed("shape", &shape)?, fixed("wrap", &wrap)?)?;
                Source::new(colours, grid, channels, elements, adjacency).map(Either::Three)
            }
        })
        .map(Self)
    }

    /// Weights: colour, contact, jump, depth, joint, surprise, distortion, guide.
    #[allow(clippy::too_many_arguments)] // the arguments of the Python method
    fn stitch<'py>(
        &self,
        py: Python<'py>,
        place: Where,
        jacobians: PyReadonlyArray3In<'py>,
        patch: (f32, f32, usize, bool, bool),
        weights: [f32; 8],
        charges: [f32; 3],
        seed: u64,
        held: PyReadonlyArray1<'py, bool>,
        given: PyReadonlyArray1<'py, i32>,
        demand: Option<GuideIn<'py>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<StitchedOut<'py>> {
        let (side, overlap, candidates, bend, heal) = patch;
        let [
            colour,
            contact,
            jump,
            depth,
            joint,
            surprise,
            distortion,
            asked,
        ] = weights;
        let options = Options {
            patch: side,
            overlap,
            candidates,
            bend,
            heal,
            weights: Weights {
                colour,
                contact,
                jump,
                depth,
                joint,
                surprise,
                distortion,
                guide: asked,
            },
            repetition: charges[0],
            continuation: charges[1],
            balance: charges[2],
            seed,
        };
        let (jacobians, held, given) = (jacobians.as_slice()?, held.as_slice()?, given.as_slice()?);
        let demand = slices(&demand)?;
        macro_rules! stitched {
            ($source:expr) => {
                run(py, progress, |monitor| -> Result<_> {
                    let region = region(&place)?;
                    let guide = guide(demand, $source.grid().len(), region.grid.len())?;
                    let given = Given {
                        points: held,
                        places: grouped("given", given)?,
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
            Either::Two(source) => stitched!(source),
            Either::Three(source) => stitched!(source),
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
}

type PyReadonlyArray3In<'py> = numpy::PyReadonlyArray3<'py, i16>;
