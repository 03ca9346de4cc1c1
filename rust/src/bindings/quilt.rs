use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use super::stitcher::PatchSamples;
use super::{grouped, run};
use crate::engine::quilt::{Options, Picture, Pixels, Quilt, Span, Window};
use crate::foundation::memory;

/// Colours, the lattice if there is one, and the phase.
type PictureIn<'py> = (PyReadonlyArray3<'py, f32>, Option<[[f64; 2]; 2]>, [f64; 2]);
/// Exemplar, coordinates, mirror flag and cell of each pixel.
type PixelsIn<'py> = (
    PyReadonlyArray1<'py, u16>,
    PyReadonlyArray2<'py, f32>,
    PyReadonlyArray1<'py, bool>,
    PyReadonlyArray1<'py, u32>,
);
/// Size, wrapped axes, patch size, whether the images are regular, and the fixed axis.
type OptionsIn = ([usize; 2], [bool; 2], [usize; 2], bool, Option<usize>);
/// Start, extent, overlap before and overlap after, along rows and columns.
type WindowIn = [[usize; 4]; 2];
/// The number of the pixel that each output pixel shows, and the number of its patch.
type QuiltOut<'py> = (Bound<'py, PyArray2<u32>>, Bound<'py, PyArray2<u32>>);

/// Stitches patches of images into a texture. `first` contains the first window, and the image and
/// position (row, column) of its patch.
#[pyfunction]
#[allow(clippy::too_many_arguments)] // the arguments of the Python function
pub(super) fn quilt<'py>(
    py: Python<'py>,
    pictures: Vec<PictureIn<'py>>,
    pixels: PixelsIn<'py>,
    samples: PyRef<'py, PatchSamples>,
    options: OptionsIn,
    first: (WindowIn, usize, [usize; 2]),
    waves: Vec<Vec<WindowIn>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<QuiltOut<'py>> {
    // Copy the arrays, because the kernel runs without the interpreter lock.
    let mut all = Vec::with_capacity(pictures.len());
    for (colours, lattice, phase) in &pictures {
        all.push(Picture {
            colours: memory::copied("pictures", colours.as_slice()?)?,
            shape: [colours.shape()[0], colours.shape()[1]],
            lattice: *lattice,
            phase: *phase,
        });
    }
    let (exemplar, coordinates, hands, cells) = &pixels;
    let pixels = Pixels {
        exemplar: memory::copied("pixels", exemplar.as_slice()?)?,
        coordinates: memory::copied("pixels", grouped("pixels", coordinates.as_slice()?)?)?,
        hands: memory::copied("pixels", hands.as_slice()?)?,
        cells: memory::copied("pixels", cells.as_slice()?)?,
    };
    let (size, wrap, patch, regular, fixed) = options;
    let options = Options {
        size,
        wrap,
        patch,
        regular,
        fixed,
    };
    // Convert the windows, then run the kernel wave by wave.
    let span = |[start, extent, before, after]: [usize; 4]| Span {
        start,
        extent,
        before,
        after,
    };
    let window = |window: WindowIn| Window(window.map(span));
    let waves: Vec<Vec<Window>> = waves
        .into_iter()
        .map(|wave| wave.into_iter().map(window).collect())
        .collect();
    let samples = &samples.0;
    let (place, label) = run(py, progress, |monitor| {
        let mut quilt = Quilt::new(all, pixels, samples, options)?;
        quilt.lay_first(&window(first.0), first.1, first.2)?;
        quilt.paste(&waves, monitor)?;
        Ok(quilt.into_map())
    })?;
    Ok((
        PyArray1::from_vec(py, place).reshape(size)?,
        PyArray1::from_vec(py, label).reshape(size)?,
    ))
}
