use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray3};
use pyo3::prelude::*;

use super::appearance::{Analysis, Appearance, PlacesOut, Where, either, frames, region};
use super::{grouped, run};
use crate::Result;
use crate::engine::coherence::{self, Kinds, Options, Similarity};
use crate::foundation::fixed::Place;
use crate::foundation::memory;

/// Returns similarity sets: `k` similar samples for each sample of the exemplar.
#[pyfunction]
pub(super) fn similar<'py>(
    py: Python<'py>,
    appearance: &Appearance,
    k: usize,
    n: usize,
    numbers: usize,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyArray1<u32>>> {
    let found = run(py, progress, |monitor| {
        either!(
            &appearance.0,
            a,
            coherence::similar(a, k, n, numbers, monitor)
        )
    })?;
    Ok(PyArray1::from_vec(py, found.sets))
}

/// Corrects coordinates by k-coherence.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // one argument for each option of the kernel
pub(super) fn cohere<'py>(
    py: Python<'py>,
    appearance: &Appearance,
    sets: PyReadonlyArray1<'py, u32>,
    k: usize,
    places: PyReadonlyArray1<'py, i32>,
    place: Where,
    frames: PyReadonlyArray3<'py, i16>,
    held: PyReadonlyArray1<'py, bool>,
    kinds: (PyReadonlyArray1<'py, u8>, PyReadonlyArray1<'py, u8>),
    passes: usize,
    numbers: usize,
    compensated: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<PlacesOut<'py>> {
    let similarity = Similarity {
        k,
        sets: memory::copied("similarity", sets.as_slice()?)?,
    };
    let options = Options {
        passes,
        numbers,
        compensated,
    };
    let (values, held, places) = (frames.as_slice()?, held.as_slice()?, places.as_slice()?);
    let kinds = Kinds {
        samples: kinds.0.as_slice()?,
        points: kinds.1.as_slice()?,
    };
    // The kernel corrects a copy, because the caller's array is read-only.
    let places = run(py, progress, |monitor| {
        either!(&appearance.0, a, {
            let region = region::<D>(&place)?;
            let frames = self::frames(values)?;
            let mut places: Vec<Place<D>> = memory::copied("places", grouped("places", places)?)?;
            coherence::correct(
                a,
                &similarity,
                &region,
                frames,
                held,
                kinds,
                &mut places,
                &options,
                monitor,
            )?;
            Ok(places.into_flattened())
        })
    })?;
    Ok(PyArray1::from_vec(py, places))
}

/// Displaces coordinates by noise that depends on the world coordinates of their points.
#[pyfunction]
pub(super) fn jitter<'py>(
    py: Python<'py>,
    places: PyReadonlyArray1<'py, i32>,
    place: Where,
    held: PyReadonlyArray1<'py, bool>,
    reach: u32,
    seed: u64,
    level: u32,
) -> PyResult<PlacesOut<'py>> {
    fn work<const D: usize>(
        places: &[i32],
        place: &Where,
        held: &[bool],
        reach: u32,
        seed: u64,
        level: u32,
    ) -> Result<Vec<i32>> {
        let mut places: Vec<Place<D>> = memory::copied("places", grouped("places", places)?)?;
        coherence::jitter(&mut places, &region::<D>(place)?, held, reach, seed, level)?;
        Ok(places.into_flattened())
    }
    let (places, held) = (places.as_slice()?, held.as_slice()?);
    let places = run(py, None, |_| match place.0.len() {
        2 => work::<2>(places, &place, held, reach, seed, level),
        _ => work::<3>(places, &place, held, reach, seed, level),
    })?;
    Ok(PyArray1::from_vec(py, places))
}
