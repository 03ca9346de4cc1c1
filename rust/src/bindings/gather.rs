use numpy::{
    PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use super::{grouped, run_small};
use crate::foundation::grid::Grid;
use crate::foundation::memory;
use crate::kernels::gather::{CHUNK, Element, Exemplar, Interpolation};
use crate::{Error, Result};

/// Interpolates exemplars of one dtype at coordinates (pixels, axes). Exemplars have the shape
/// (rows, columns, channels) or (planes, rows, columns, channels).
#[pyfunction]
pub(super) fn gather<'py>(
    py: Python<'py>,
    exemplars: Vec<Bound<'py, PyAny>>,
    wrap: Vec<bool>,
    which: PyReadonlyArray1<'py, u16>,
    coordinates: PyReadonlyArray2<'py, f32>,
    interpolation: &str,
) -> PyResult<Bound<'py, PyAny>> {
    macro_rules! try_types {
        ($($t:ty),*) => {$(
            if let Ok(arrays) =
                exemplars.iter().map(|e| e.extract::<PyReadonlyArrayDyn<'py, $t>>()).collect::<std::result::Result<Vec<_>, _>>()
            {
                return typed::<$t>(py, &arrays, &wrap, &which, &coordinates, interpolation);
            }
        )*};
    }
    try_types!(u8, u16, f32, f64, i8, i16, i32, u32);
    Err(PyTypeError::new_err(
        "exemplars: must all have the same dtype, one of uint8, uint16, float32, float64, int8, int16, int32, uint32",
    ))
}

fn typed<'py, T: Element + numpy::Element>(
    py: Python<'py>,
    arrays: &[PyReadonlyArrayDyn<'py, T>],
    wrap: &[bool],
    which: &PyReadonlyArray1<'py, u16>,
    coordinates: &PyReadonlyArray2<'py, f32>,
    interpolation: &str,
) -> PyResult<Bound<'py, PyAny>> {
    match wrap.len() {
        2 => axes::<T, 2>(py, arrays, wrap, which, coordinates, interpolation),
        3 => axes::<T, 3>(py, arrays, wrap, which, coordinates, interpolation),
        n => Err(Error::value(
            "wrap",
            format!("must have one flag for each of 2 or 3 axes, got {n}"),
        )
        .into()),
    }
}

fn axes<'py, T: Element + numpy::Element, const D: usize>(
    py: Python<'py>,
    arrays: &[PyReadonlyArrayDyn<'py, T>],
    wrap: &[bool],
    which: &PyReadonlyArray1<'py, u16>,
    coordinates: &PyReadonlyArray2<'py, f32>,
    interpolation: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let interpolation = match interpolation {
        "nearest" => Interpolation::Nearest,
        "linear" => Interpolation::Linear,
        "cubic" => Interpolation::Cubic,
        other => {
            let message = format!("must be one of nearest, linear, cubic; got {other:?}");
            return Err(Error::value("interpolation", message).into());
        }
    };
    let wrap: [bool; D] = std::array::from_fn(|axis| wrap[axis]);
    let exemplars = arrays
        .iter()
        .map(|a| exemplar(a, wrap))
        .collect::<Result<Vec<_>>>()?;
    // The kernel checks that all exemplars have the same number of channels.
    let channels = arrays
        .first()
        .and_then(|a| a.shape().last().copied())
        .unwrap_or(0);
    let (which, flat) = (which.as_slice()?, coordinates.as_slice()?);
    let points = grouped::<_, D>("coordinates", flat)?;
    let samples = memory::product("coordinates", &[points.len(), channels])?;
    let mut out = memory::filled("the output", T::default(), samples)?;
    run_small(py, points.len() <= CHUNK, |monitor| {
        crate::kernels::gather::gather(&exemplars, which, points, interpolation, &mut out, monitor)
    })?;
    Ok(PyArray1::from_vec(py, out)
        .reshape([points.len(), channels])?
        .into_any())
}

fn exemplar<'a, T: Element + numpy::Element, const D: usize>(
    array: &'a PyReadonlyArrayDyn<'_, T>,
    wrap: [bool; D],
) -> Result<Exemplar<'a, T, D>> {
    let shape = array.shape();
    let data = array
        .as_slice()
        .map_err(|_| Error::value("exemplars", "must be contiguous in memory"))?;
    if shape.len() != D + 1 {
        return Err(Error::value(
            "exemplars",
            format!(
                "must have {} spatial axes and a channel axis, got shape {shape:?}",
                D
            ),
        ));
    }
    Exemplar::new(
        data,
        Grid::new(std::array::from_fn(|axis| shape[axis]), wrap)?,
        shape[D],
    )
}
