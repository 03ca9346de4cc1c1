use numpy::{
    PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyReadwriteArray1, ToPyArray,
};
use pyo3::prelude::*;

use super::{grouped, run};
use crate::engine::appearance::{CHANNELS, KEEP, Parts};
use crate::engine::guide::Guide;
use crate::engine::{appearance, blocks, optimize, pyramid};
use crate::foundation::fixed::{Frame, Frames};
use crate::foundation::grid::{Grid, Region};
use crate::foundation::memory;
use crate::{Error, Result};

/// The analysis of an exemplar at one resolution.
#[pyclass(frozen)]
pub(super) struct Appearance(pub(super) Analysis);

pub(super) enum Analysis {
    Two(appearance::Appearance<2>),
    Three(appearance::Appearance<3>),
}

/// Runs `$body` with `$a` bound to the analysis, and `D` to its number of axes.
macro_rules! either {
    ($analysis:expr, $a:ident, $body:expr) => {
        match $analysis {
            Analysis::Two($a) => {
                #[allow(dead_code)]
                const D: usize = 2;
                $body
            }
            Analysis::Three($a) => {
                #[allow(dead_code)]
                const D: usize = 3;
                $body
            }
        }
    };
}
pub(super) use either;

/// Shape, origin and wrapped axes of a region.
pub(super) type Where = (Vec<usize>, Vec<i32>, Vec<bool>);
pub(super) type PlacesOut<'py> = Bound<'py, PyArray1<i32>>;
/// Colours, feature vectors, basis, bias, gain and spacing.
type PartsOut<'py> = (
    Bound<'py, PyArray1<i16>>,
    Bound<'py, PyArray1<i16>>,
    Bound<'py, PyArray1<i16>>,
    Bound<'py, PyArray1<i64>>,
    i64,
    i32,
);

pub(super) fn fixed<T: Copy, const D: usize>(
    argument: &'static str,
    values: &[T],
) -> Result<[T; D]> {
    values.try_into().map_err(|_| Error::Shape {
        argument,
        expected: vec![D],
        got: vec![values.len()],
    })
}

pub(super) fn region<const D: usize>((shape, origin, wrap): &Where) -> Result<Region<D>> {
    let grid = Grid::new(fixed("shape", shape)?, fixed("wrap", wrap)?)?;
    Region::new(grid, fixed("origin", origin)?)
}

/// Returns one frame for all points, or one for each point.
pub(super) fn frames<const D: usize>(values: &[i16]) -> Result<Frames<'_, D>> {
    let rows: &[[i16; D]] = grouped("frames", values)?;
    let frames: &[Frame<D>] = grouped("frames", rows)?;
    Ok(match frames {
        [one] => Frames::Constant(*one),
        all => Frames::Dense(all),
    })
}

/// Arrays of a guide: values of the exemplar samples and of the output points, weights, and samples
/// sorted by value. The last number is the weight of an excess in units of 1/256.
pub(super) type GuideIn<'py> = (
    PyReadonlyArray1<'py, i16>,
    PyReadonlyArray1<'py, i16>,
    PyReadonlyArray1<'py, u16>,
    PyReadonlyArray1<'py, u32>,
    u16,
);
pub(super) type GuideSlices<'a> = Option<(&'a [i16], &'a [i16], &'a [u16], &'a [u32], u16)>;

pub(super) fn slices<'a>(guide: &'a Option<GuideIn<'_>>) -> PyResult<GuideSlices<'a>> {
    Ok(match guide {
        Some((a, b, c, d, excess)) => Some((
            a.as_slice()?,
            b.as_slice()?,
            c.as_slice()?,
            d.as_slice()?,
            *excess,
        )),
        None => None,
    })
}

pub(super) fn guide<'a>(
    arrays: GuideSlices<'a>,
    samples: usize,
    points: usize,
) -> Result<Option<Guide<'a>>> {
    arrays
        .map(|(a, b, c, d, excess)| {
            let guide = Guide::new(grouped("guide", a)?, b, c, samples, points)?;
            Ok(guide.ordered(d)?.lopsided(excess))
        })
        .transpose()
}

#[pymethods]
impl Appearance {
    #[new]
    fn new(
        py: Python<'_>,
        colours: PyReadonlyArray2<'_, f32>,
        shape: Vec<usize>,
        wrap: Vec<bool>,
        radius: usize,
    ) -> PyResult<Self> {
        use numpy::PyUntypedArrayMethods;
        let channels = colours.shape()[1];
        let colours = colours.as_slice()?;
        run(py, None, |monitor| match shape.len() {
            2 => {
                let grid = Grid::new(fixed("shape", &shape)?, fixed("wrap", &wrap)?)?;
                appearance::Appearance::watched(colours, grid, channels, radius, monitor)
                    .map(Analysis::Two)
            }
            _ => {
                let grid = Grid::new(fixed("shape", &shape)?, fixed("wrap", &wrap)?)?;
                appearance::Appearance::watched(colours, grid, channels, radius, monitor)
                    .map(Analysis::Three)
            }
        })
        .map(Self)
    }

    #[getter]
    fn shape(&self) -> Vec<usize> {
        either!(&self.0, a, a.grid().shape().to_vec())
    }

    #[getter]
    fn wrap(&self) -> Vec<bool> {
        either!(&self.0, a, a.grid().wrap().to_vec())
    }

    #[getter]
    fn radius(&self) -> usize {
        either!(&self.0, a, a.radius())
    }

    #[getter]
    fn channels(&self) -> usize {
        either!(&self.0, a, a.channels())
    }

    /// Median distance from a window to its nearest other window, in units of the variance of all
    /// windows.
    #[getter]
    fn spacing(&self) -> f64 {
        either!(
            &self.0,
            a,
            f64::from(a.spacing()) / f64::from(appearance::UNIT)
        )
    }

    fn parts<'py>(&self, py: Python<'py>) -> PartsOut<'py> {
        either!(&self.0, a, {
            let parts = a.parts();
            (
                PyArray1::from_vec(py, parts.colours.into_flattened()),
                PyArray1::from_vec(py, parts.features.into_flattened()),
                PyArray1::from_vec(py, parts.basis),
                parts.bias.to_pyarray(py),
                parts.gain,
                parts.spacing,
            )
        })
    }

    #[staticmethod]
    #[allow(clippy::too_many_arguments)] // one argument for each array of an analysis
    fn from_parts(
        shape: Vec<usize>,
        wrap: Vec<bool>,
        radius: usize,
        channels: usize,
        colours: PyReadonlyArray1<'_, i16>,
        features: PyReadonlyArray1<'_, i16>,
        basis: PyReadonlyArray1<'_, i16>,
        bias: PyReadonlyArray1<'_, i64>,
        gain: i64,
        spacing: i32,
    ) -> PyResult<Self> {
        // Use a macro, because the types of the parts differ although both read the same arrays.
        macro_rules! parts {
            () => {
                Parts {
                    grid: Grid::new(fixed("shape", &shape)?, fixed("wrap", &wrap)?)?,
                    radius,
                    channels,
                    colours: memory::copied(
                        "colours",
                        grouped::<_, CHANNELS>("colours", colours.as_slice()?)?,
                    )?,
                    features: memory::copied(
                        "features",
                        grouped::<_, KEEP>("features", features.as_slice()?)?,
                    )?,
                    basis: basis.as_slice()?.to_vec(),
                    bias: fixed("bias", bias.as_slice()?)?,
                    gain,
                    spacing,
                }
            };
        }
        Ok(Self(match shape.len() {
            2 => Analysis::Two(appearance::Appearance::from_parts(parts!())?),
            _ => Analysis::Three(appearance::Appearance::from_parts(parts!())?),
        }))
    }

    /// Initialises the coordinates of a region by filling each cell with a matching patch of the exemplar.
    #[allow(clippy::too_many_arguments)] // one argument for each option of the kernel
    fn blocks<'py>(
        &self,
        py: Python<'py>,
        place: Where,
        frames: PyReadonlyArray3<'py, i16>,
        cell: usize,
        rounds: usize,
        candidates: usize,
        contrast: f64,
        continuation: f64,
        repetition: f64,
        seed: u64,
        margin: usize,
        held: PyReadonlyArray1<'py, bool>,
        given: PyReadonlyArray1<'py, i32>,
        guide: Option<GuideIn<'py>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<PlacesOut<'py>> {
        let guide = slices(&guide)?;
        let (held, given) = (held.as_slice()?, given.as_slice()?);
        let options = blocks::Options {
            cell,
            rounds,
            candidates,
            contrast,
            continuation,
            repetition,
            seed,
            margin,
        };
        let values = frames.as_slice()?;
        // `D` is the number of axes of the exemplar.
        let places = run(py, progress, |monitor| {
            either!(&self.0, a, {
                let region = region::<D>(&place)?;
                let frames = self::frames(values)?;
                let guide = self::guide(guide, a.grid().len(), region.grid.len())?;
                let held = blocks::Constraints {
                    points: held,
                    places: grouped("given", given)?,
                };
                blocks::blocks(a, &region, frames, guide.as_ref(), held, &options, monitor)
                    .map(Vec::into_flattened)
            })
        })?;
        Ok(PyArray1::from_vec(py, places))
    }

    /// Corrects coordinates in place. Returns the number of passes, and the fraction of points that
    /// the last two passes changed.
    #[allow(clippy::too_many_arguments)] // one argument for each option of the kernel
    fn correct<'py>(
        &self,
        py: Python<'py>,
        mut places: PyReadwriteArray1<'py, i32>,
        place: Where,
        frames: PyReadonlyArray3<'py, i16>,
        held: PyReadonlyArray1<'py, bool>,
        passes: usize,
        first: u32,
        exhaustive: bool,
        reach: i32,
        acceptance: f64,
        coherence: f64,
        vote: usize,
        settled: f64,
        seed: u64,
        guide: Option<GuideIn<'py>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<(usize, f64)> {
        let guide = slices(&guide)?;
        let options = optimize::Options {
            passes,
            first,
            exhaustive,
            reach,
            acceptance,
            coherence,
            vote,
            settled,
            seed,
        };
        // The kernel corrects the caller's array in place.
        let (values, held, places) = (frames.as_slice()?, held.as_slice()?, places.as_slice_mut()?);
        run(py, progress, |monitor| {
            either!(&self.0, a, {
                let region = region::<D>(&place)?;
                let frames = self::frames(values)?;
                let guide = self::guide(guide, a.grid().len(), region.grid.len())?;
                grouped::<_, D>("places", places)?;
                optimize::correct(
                    a,
                    &region,
                    frames,
                    guide.as_ref(),
                    held,
                    places.as_chunks_mut().0,
                    &options,
                    monitor,
                )
            })
        })
    }
}

/// Returns the coordinates of a region, computed from those of the same region at half the
/// resolution.
#[pyfunction]
pub(super) fn upsample<'py>(
    py: Python<'py>,
    parents: PyReadonlyArray1<'py, i32>,
    from_: Where,
    to: Where,
    frames: PyReadonlyArray3<'py, i16>,
) -> PyResult<PlacesOut<'py>> {
    fn work<const D: usize>(
        parents: &[i32],
        from: &Where,
        to: &Where,
        values: &[i16],
    ) -> Result<Vec<i32>> {
        let (from, to) = (region::<D>(from)?, region::<D>(to)?);
        let frames = self::frames(values)?;
        pyramid::upsample(grouped("parents", parents)?, &from, &to, frames).map(Vec::into_flattened)
    }
    let (parents, values) = (parents.as_slice()?, frames.as_slice()?);
    let places = run(py, None, |_| match to.0.len() {
        2 => work::<2>(parents, &from_, &to, values),
        _ => work::<3>(parents, &from_, &to, values),
    })?;
    Ok(PyArray1::from_vec(py, places))
}
