//! Image files in memory: PNG, TIFF and Radiance HDR, 8 and 16 bit and float, with limits.
//!
//! Python's libraries read and write the other formats. They do not read PNG and LZW-compressed TIFF of 16 bits and several
//! channels, or HDR. Only this file names the image crate. Samples are bytes in native order, so that one path serves every
//! sample type and converts nothing. Three measures make hostile files harmless:
//!
//! 1. The header's pixels and bytes are compared with the limit before anything is decoded.
//! 2. The output is reserved with an allocation that may fail, instead of one that ends the process.
//! 3. A panic of a decoder is caught. Its message is not printed, because the error contains it.

use std::cell::Cell;
use std::io::Cursor;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

use image::codecs::{hdr, png, tiff};
use image::{ColorType, ExtendedColorType, ImageDecoder, ImageEncoder, ImageError, ImageResult};

use crate::{Error, Result};

/// Bytes that a decoded image may have for each pixel of the limit: four floats.
pub const BYTES_PER_PIXEL: u64 = 16;

/// What a PNG decoder may hold besides its rows: colour profiles and text.
const PNG_EXTRAS: u64 = 32 << 20;

/// The file formats of this module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Portable Network Graphics: 8 and 16 bit, one to four channels.
    Png,
    /// TIFF, the first page: 8 and 16 bit and float.
    Tiff,
    /// Radiance RGBE: three channels of float with a shared exponent.
    Hdr,
}

impl Format {
    /// The format whose signature a file bears.
    pub fn of_content(file: &[u8]) -> Option<Self> {
        match file {
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Some(Self::Png),
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => Some(Self::Tiff),
            _ if file.starts_with(b"#?RADIANCE") || file.starts_with(b"#?RGBE") => Some(Self::Hdr),
            _ => None,
        }
    }
}

/// What one sample is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sample {
    /// Unsigned, 8 bit.
    U8,
    /// Unsigned, 16 bit.
    U16,
    /// IEEE single.
    F32,
}

impl Sample {
    /// Its size in bytes.
    pub const fn size(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 => 2,
            Self::F32 => 4,
        }
    }
}

/// A decoded image: samples in native byte order, row-major, channels last.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Decoded {
    /// The samples.
    pub bytes: Vec<u8>,
    /// What one sample is.
    pub sample: Sample,
    /// Rows, columns, channels.
    pub shape: [usize; 3],
    /// The Exif orientation that is still to be applied, 1 (upright) to 8.
    pub orientation: u8,
}

/// Decodes a file, at most `limit` pixels and [`BYTES_PER_PIXEL`] bytes for each of them. `name` is for messages.
pub fn decode(name: &str, file: &[u8], limit: u64) -> Result<Decoded> {
    let format =
        Format::of_content(file).ok_or_else(|| fail(name, "not a PNG, TIFF or HDR file"))?;
    let budget = Budget { name, limit };
    caught(name, || match format {
        Format::Png => {
            budget.png(file)?;
            let limits = budget.png_limits(file);
            let decoder = png::PngDecoder::with_limits(Cursor::new(file), limits);
            let orientation = png_exif(file).map_or(1, exif_orientation);
            Ok(Decoded {
                orientation,
                ..budget.read(decoder)?
            })
        }
        Format::Tiff => budget.read(tiff::TiffDecoder::new(Cursor::new(file))),
        Format::Hdr => {
            // The lenient reader takes the signature for a comment, and so knows #?RGBE as well as #?RADIANCE.
            let decoder = hdr::HdrDecoder::new_nonstrict(Cursor::new(file));
            if let Ok(decoder) = &decoder {
                rgbe(name, &decoder.metadata())?;
            }
            budget.read(decoder)
        }
    })
}

/// Encodes `pixels` (native byte order, `shape` = rows, columns, channels) without loss, but for HDR, which keeps eight
/// bits of each pixel's largest channel. A combination that the format cannot hold is refused, never converted.
pub fn encode(
    name: &str,
    format: Format,
    sample: Sample,
    shape: [usize; 3],
    pixels: &[u8],
) -> Result<Vec<u8>> {
    let [rows, cols, channels] = shape;
    let bytes = [rows, cols, channels, sample.size()]
        .iter()
        .try_fold(1usize, |product, &side| product.checked_mul(side));
    if bytes != Some(pixels.len()) || pixels.is_empty() {
        return Err(Error::Shape {
            argument: "pixels",
            expected: shape.to_vec(),
            got: vec![pixels.len() / sample.size()],
        });
    }
    let (Ok(height), Ok(width)) = (u32::try_from(rows), u32::try_from(cols)) else {
        return Err(Error::value(
            "pixels",
            format!("{rows} x {cols} is too large for an image file"),
        ));
    };
    let unheld = || {
        Error::value(
            "pixels",
            format!("{format:?} cannot hold {channels} channels of {sample:?}"),
        )
    };
    let color = color(format, sample, channels).ok_or_else(unheld)?;
    caught(name, || {
        let mut out = Cursor::new(Vec::new());
        match format {
            Format::Png => {
                // On photographs, 4 to 8 times as fast as the default level, for 3 to 12 % more bytes.
                let encoder = png::PngEncoder::new_with_quality(
                    &mut out,
                    png::CompressionType::Level(2),
                    png::FilterType::Adaptive,
                );
                encoder.write_image(pixels, width, height, color)
            }
            Format::Tiff => {
                tiff::TiffEncoder::new(&mut out).write_image(pixels, width, height, color)
            }
            Format::Hdr => hdr::HdrEncoder::new(&mut out).write_image(pixels, width, height, color),
        }
        .map_err(|error| speak(name, &error))?;
        Ok(out.into_inner())
    })
}

/// The orientation, 1 (upright) to 8, that an Exif block (without its "Exif" preamble) asks for.
pub fn exif_orientation(exif: &[u8]) -> u8 {
    image::metadata::Orientation::from_exif_chunk(exif).map_or(1, |o| o.to_exif())
}

/// The Exif block of a PNG file, which may also stand behind the pixels, where the decoder has no eye for it.
fn png_exif(file: &[u8]) -> Option<&[u8]> {
    let mut at = 8;
    loop {
        let length = u32::from_be_bytes(file.get(at..at + 4)?.try_into().ok()?) as usize;
        let end = at.checked_add(12)?.checked_add(length)?;
        match file.get(at + 4..at + 8)? {
            b"eXIf" => return file.get(at + 8..at + 8 + length),
            b"IEND" => return None,
            _ => at = end,
        }
    }
}

/// Radiance files may hold XYZ instead of RGB.
fn rgbe(name: &str, metadata: &hdr::HdrMetadata) -> Result<()> {
    let format = metadata
        .custom_attributes
        .iter()
        .find(|(key, _)| key == "FORMAT");
    match format {
        Some((_, format)) if format.trim() != "32-bit_rle_rgbe" => Err(fail(
            name,
            format!("Radiance samples of format {format:?} are not read, only 32-bit_rle_rgbe"),
        )),
        _ => Ok(()),
    }
}

/// The image crate's name for samples that the format gives back as they came.
fn color(format: Format, sample: Sample, channels: usize) -> Option<ExtendedColorType> {
    use ExtendedColorType as C;
    match (format, sample, channels) {
        (Format::Png | Format::Tiff, Sample::U8, 1) => Some(C::L8),
        (Format::Png, Sample::U8, 2) => Some(C::La8),
        (Format::Png | Format::Tiff, Sample::U8, 3) => Some(C::Rgb8),
        (Format::Png | Format::Tiff, Sample::U8, 4) => Some(C::Rgba8),
        (Format::Png | Format::Tiff, Sample::U16, 1) => Some(C::L16),
        (Format::Png, Sample::U16, 2) => Some(C::La16),
        (Format::Png | Format::Tiff, Sample::U16, 3) => Some(C::Rgb16),
        (Format::Png | Format::Tiff, Sample::U16, 4) => Some(C::Rgba16),
        (Format::Tiff | Format::Hdr, Sample::F32, 3) => Some(C::Rgb32F),
        (Format::Tiff, Sample::F32, 4) => Some(C::Rgba32F),
        _ => None,
    }
}

/// The limit in force for one file.
struct Budget<'a> {
    name: &'a str,
    limit: u64,
}

impl Budget<'_> {
    /// Refuses an image that is empty, or larger than the limit in pixels or bytes.
    fn check(&self, rows: u64, cols: u64, bytes_per_pixel: u64) -> Result<()> {
        if rows == 0 || cols == 0 {
            let message = format!("the image has {rows} rows and {cols} columns");
            return Err(fail(self.name, message));
        }
        let pixels = u128::from(rows) * u128::from(cols);
        let (bytes, limit) = (pixels * u128::from(bytes_per_pixel), u128::from(self.limit));
        let most = limit * u128::from(BYTES_PER_PIXEL);
        for (needed, limit, unit) in [(pixels, limit, "pixels"), (bytes, most, "bytes")] {
            if needed > limit {
                return Err(Error::Limit {
                    what: format!("{} ({rows} x {cols})", self.name),
                    needed: format!("{needed} {unit}"),
                    limit: format!("{limit} {unit}"),
                });
            }
        }
        Ok(())
    }

    /// An empty vector with memory for `bytes`. Decoders reserve memory of their own in a way that ends the process when
    /// there is none, so what they will need is asked for here first, and let go of.
    fn memory(&self, bytes: u64) -> Result<Vec<u8>> {
        let short = || Error::Limit {
            what: self.name.to_owned(),
            needed: format!("{bytes} bytes"),
            limit: "this machine's free memory".to_owned(),
        };
        let length = usize::try_from(bytes).map_err(|_| short())?;
        let mut buffer = Vec::new();
        buffer.try_reserve_exact(length).map_err(|_| short())?;
        Ok(buffer)
    }

    /// Zeros for an image that has passed [`Budget::check`].
    fn zeros(&self, bytes: u64) -> Result<Vec<u8>> {
        let mut buffer = self.memory(bytes)?;
        buffer.resize(bytes as usize, 0);
        Ok(buffer)
    }

    /// Width and height that a PNG file announces, checked before its decoder is made.
    fn png(&self, file: &[u8]) -> Result<()> {
        match file.get(12..24) {
            Some([b'I', b'H', b'D', b'R', size @ ..]) => {
                let side = |i| u64::from(u32::from_be_bytes(std::array::from_fn(|k| size[i + k])));
                self.check(side(4), side(0), 1)
            }
            _ => Err(fail(self.name, "the PNG header is missing or cut off")),
        }
    }

    /// Memory for a few rows and for what is not pixels: an embedded profile must not unfold to gigabytes.
    fn png_limits(&self, file: &[u8]) -> image::Limits {
        let width = file
            .get(16..20)
            .map_or(0, |b| u32::from_be_bytes(std::array::from_fn(|k| b[k])));
        let mut limits = image::Limits::no_limits();
        limits.max_alloc = Some(PNG_EXTRAS + 64 * u64::from(width));
        limits
    }

    /// Decodes what a decoder of the image crate has announced.
    fn read(&self, decoder: ImageResult<impl ImageDecoder>) -> Result<Decoded> {
        let mut decoder = decoder.map_err(|error| speak(self.name, &error))?;
        let (cols, rows) = decoder.dimensions();
        let color = decoder.color_type();
        self.check(rows.into(), cols.into(), color.bytes_per_pixel().into())?;
        let bytes = decoder.total_bytes();
        let mut limits = image::Limits::no_limits();
        limits.max_alloc = Some(bytes.saturating_mul(2).saturating_add(PNG_EXTRAS));
        decoder
            .set_limits(limits)
            .map_err(|error| speak(self.name, &error))?;
        let sample = match color {
            ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => Sample::U8,
            ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => Sample::U16,
            ColorType::Rgb32F | ColorType::Rgba32F => Sample::F32,
            other => {
                let message = format!("samples of type {other:?} are not read");
                return Err(fail(self.name, message));
            }
        };
        // Metadata that cannot be read is no reason to refuse the picture.
        let orientation = decoder
            .orientation()
            .map_or(1, |orientation| orientation.to_exif());
        drop(self.memory(bytes.saturating_mul(3))?);
        let mut pixels = self.zeros(bytes)?;
        decoder
            .read_image(&mut pixels)
            .map_err(|error| speak(self.name, &error))?;
        Ok(Decoded {
            bytes: pixels,
            sample,
            shape: [rows as usize, cols as usize, color.channel_count().into()],
            orientation,
        })
    }
}

fn fail(name: &str, message: impl Into<String>) -> Error {
    Error::File {
        path: name.to_owned(),
        message: message.into(),
    }
}

/// What the image crate says, in one line.
fn speak(name: &str, error: &ImageError) -> Error {
    match error {
        ImageError::IoError(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            fail(name, "the file is cut off")
        }
        ImageError::Limits(error) => Error::Limit {
            what: name.to_owned(),
            needed: format!("more memory than its size explains ({error})"),
            limit: "a few rows and 32 MiB beside the pixels".to_owned(),
        },
        error => fail(
            name,
            format!("cannot be decoded: {error}").replace('\n', " "),
        ),
    }
}

thread_local! {
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Runs a decoder or an encoder; its panic becomes an error and is not printed.
fn caught<R>(name: &str, work: impl FnOnce() -> Result<R>) -> Result<R> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let loud = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !QUIET.try_with(Cell::get).unwrap_or(false) {
                loud(info);
            }
        }));
    });
    let before = QUIET.replace(true);
    let outcome = panic::catch_unwind(AssertUnwindSafe(work));
    QUIET.set(before);
    outcome.unwrap_or_else(|_| Err(fail(name, "the file is corrupt: its decoder gave up")))
}

#[cfg(test)]
mod tests;
