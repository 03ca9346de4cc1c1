use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use super::run;
use crate::Error;
use crate::kernels::image_io::{self, Format, Sample};

const FORMATS: [(&str, Format); 3] = [
    ("png", Format::Png),
    ("tiff", Format::Tiff),
    ("hdr", Format::Hdr),
];

/// NumPy names of the sample types.
const SAMPLES: [(&str, Sample); 3] = [
    ("uint8", Sample::U8),
    ("uint16", Sample::U16),
    ("float32", Sample::F32),
];

fn named<T: Copy>(argument: &'static str, name: &str, all: &[(&str, T)]) -> Result<T, Error> {
    let found = all.iter().find(|(known, _)| *known == name);
    found.map(|&(_, value)| value).ok_or_else(|| {
        let names: Vec<_> = all.iter().map(|(known, _)| *known).collect();
        Error::value(
            argument,
            format!("must be one of {}; got {name}", names.join(", ")),
        )
    })
}

type Parts<'py> = (Bound<'py, PyArray1<u8>>, &'static str, [usize; 3], u8);

/// Decodes an image file. Returns the samples as bytes, their dtype, the shape (rows, columns,
/// channels), and the Exif orientation that the caller must still apply.
#[pyfunction]
pub(super) fn decode_image<'py>(
    py: Python<'py>,
    name: &str,
    file: &[u8],
    limit: u64,
) -> PyResult<Parts<'py>> {
    let image = run(py, None, |_| image_io::decode(name, file, limit))?;
    let sample = SAMPLES.iter().find(|(_, sample)| *sample == image.sample);
    let sample = sample.map_or("uint8", |&(name, _)| name);
    let bytes = PyArray1::from_vec(py, image.bytes);
    Ok((bytes, sample, image.shape, image.orientation))
}

#[pyfunction]
pub(super) fn encode_image<'py>(
    py: Python<'py>,
    name: &str,
    format: &str,
    sample: &str,
    shape: [usize; 3],
    pixels: PyReadonlyArray1<'py, u8>,
) -> PyResult<Bound<'py, PyArray1<u8>>> {
    let format = named("format", format, &FORMATS)?;
    let sample = named("image", sample, &SAMPLES)?;
    let pixels = pixels.as_slice()?;
    let file = run(py, None, |_| {
        image_io::encode(name, format, sample, shape, pixels)
    })?;
    Ok(PyArray1::from_vec(py, file))
}

#[pyfunction]
pub(super) fn exif_orientation(exif: &[u8]) -> u8 {
    image_io::exif_orientation(exif)
}
