//! Python bindings. Only this folder uses pyo3 and numpy. A function here checks only types,
//! releases the interpreter lock, and calls a kernel.

mod appearance;
mod coherence;
mod distance;
mod gather;
mod hash;
mod hierarchy;
mod image_io;
mod inpaint;
mod mean_shift;
mod ncc;
mod nearby;
mod patch_search;
mod poisson;
mod quilt;
mod reconstruction;
mod regions;
mod seam;
mod smooth;
mod sparse;
mod stitcher;
mod warp;

use std::cell::Cell;
use std::time::Duration;

use pyo3::prelude::*;

use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// A waiting caller checks for Ctrl-C and reports progress at this interval.
const POLL: Duration = Duration::from_millis(50);

thread_local! {
    static THREADS: Cell<usize> = const { Cell::new(0) };
}

impl From<Error> for PyErr {
    /// Returns an exception of the class in `texrs.errors` that corresponds to the variant.
    fn from(error: Error) -> Self {
        let class = match &error {
            Error::Value { .. } | Error::Shape { .. } => "InvalidInput",
            Error::Limit { .. } => "LimitExceeded",
            Error::File { .. } => "FileError",
            Error::Cancelled(_) => "Cancelled",
        };
        Python::attach(|py| {
            match py
                .import("texrs.errors")
                .and_then(|m| m.getattr(class)?.call1((error.to_string(),)))
            {
                Ok(instance) => PyErr::from_value(instance),
                Err(error) => error,
            }
        })
    }
}

/// Runs a kernel without the interpreter lock, in the thread pool that the calling thread has
/// selected.
///
/// Ctrl-C stops the kernel. If `progress` is given, it is called with the fraction that is done,
/// and stops the kernel by raising. Otherwise the observers of the outer Python call are asked
/// whether to stop.
fn run<R: Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&Monitor) -> Result<R> + Send,
) -> PyResult<R> {
    let threads = THREADS.get();
    py.detach(|| {
        par::watch(threads, POLL, work, |monitor| {
            Python::attach(|py| {
                py.check_signals()?;
                match &progress {
                    Some(progress) => progress.call1(py, (monitor.fraction(),))?,
                    None => py
                        .import("texrs._progress")?
                        .getattr("ask")?
                        .call0()?
                        .unbind(),
                };
                Ok(())
            })
        })
    })
}

/// Runs a kernel like [`run`], but on the calling thread if `small` is true, because waking another
/// thread would take longer. A small kernel must not use other threads.
fn run_small<R: Send>(
    py: Python<'_>,
    small: bool,
    work: impl FnOnce(&Monitor) -> Result<R> + Send,
) -> PyResult<R> {
    if small {
        return Ok(py.detach(|| work(&Monitor::default()))?);
    }
    run(py, None, work)
}

/// Returns values in groups of `N`, or an error if some are left over.
fn grouped<'a, T, const N: usize>(argument: &'static str, values: &'a [T]) -> Result<&'a [[T; N]]> {
    match values.as_chunks() {
        (groups, []) => Ok(groups),
        (groups, _) => Err(Error::Shape {
            argument,
            expected: vec![groups.len(), N],
            got: vec![values.len()],
        }),
    }
}

/// Sets the number of threads of the kernels that this thread calls, and returns the previous
/// number. Zero means `RAYON_NUM_THREADS`, or all cores.
#[pyfunction]
fn set_threads(threads: usize) -> usize {
    THREADS.replace(threads)
}

/// Kernels of texrs. This module is private: use `texrs.kernels`.
#[pymodule(gil_used = false)]
mod _rust {
    #[pymodule_export]
    use super::appearance::{Appearance, upsample};
    #[pymodule_export]
    use super::coherence::{cohere, jitter, similar};
    #[pymodule_export]
    use super::distance::outlines;
    #[pymodule_export]
    use super::gather::gather;
    #[pymodule_export]
    use super::hash::{philox, uniform};
    #[pymodule_export]
    use super::hierarchy::{
        choose_disjoint, contour_strength, measure_regions, region_adjacency, region_candidates,
        sum_regions, watershed_regions,
    };
    #[pymodule_export]
    use super::image_io::{decode_image, encode_image, exif_orientation};
    #[pymodule_export]
    use super::inpaint::inpaint;
    #[pymodule_export]
    use super::mean_shift::mean_shift;
    #[pymodule_export]
    use super::ncc::Correlation;
    #[pymodule_export]
    use super::nearby::sum_nearby;
    #[pymodule_export]
    use super::patch_search::PatchIndex;
    #[pymodule_export]
    use super::poisson::{poisson, poisson_spread};
    #[pymodule_export]
    use super::quilt::quilt;
    #[pymodule_export]
    use super::reconstruction::reconstruct;
    #[pymodule_export]
    use super::regions::merge_regions;
    #[pymodule_export]
    use super::seam::{refine_outlines, seam_cut, seam_labels, seam_strips};
    #[pymodule_export]
    use super::set_threads;
    #[pymodule_export]
    use super::smooth::smooth;
    #[pymodule_export]
    use super::sparse::Cholesky;
    #[pymodule_export]
    use super::stitcher::{PatchSamples, Stitcher};
    #[pymodule_export]
    use super::warp::{place, warp_mesh, warp_points};

    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}
