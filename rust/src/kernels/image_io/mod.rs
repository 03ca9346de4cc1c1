//! Image files in memory: PNG, TIFF and Radiance HDR with 8-bit, 16-bit and float samples.
//!
//! Python's libraries read and write the other formats. They do not support HDR, or PNG and LZW-compressed TIFF with
//! 16 bits and several channels. Only this module uses the image crate. Samples are bytes in native order, so one path
//! handles every sample type without conversions. Three measures make hostile files harmless:
//!
//! 1. The numbers of pixels and bytes that follow from the header are compared with the limit before anything is
//!    decoded.
//! 2. Memory for the output is reserved by an allocation that can return an error, instead of one that ends the
//!    process.
//! 3. A panic of a decoder is caught and becomes an error. Its message is not printed.

use std::cell::Cell;
use std::io::Cursor;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

use image::codecs::{hdr, png, tiff};
use image::{ColorType, ExtendedColorType, ImageDecoder, ImageEncoder, ImageError, ImageResult};

use crate::{Error, Result};

/// Maximum number of bytes of a decoded image for each pixel of the limit: four floats.
pub const BYTES_PER_PIXEL: u64 = 16;

/// Memory in bytes that a PNG decoder may use in addition to its rows, for colour profiles and text.
const PNG_EXTRAS: u64 = 32 << 20;

/// The file formats of this module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Portable Network Graphics: 8 and 16 bits, one to four channels.
    Png,
    /// TIFF, the first page: 8 bits, 16 bits and float.
    Tiff,
    /// Radiance RGBE: three channels of float with a shared exponent.
    Hdr,
}

impl Format {
    /// Returns the format of a file by its signature.
    pub fn of_content(file: &[u8]) -> Option<Self> {
        match file {
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Some(Self::Png),
            [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => Some(Self::Tiff),
            _ if file.starts_with(b"#?RADIANCE") || file.starts_with(b"#?RGBE") => Some(Self::Hdr),
            _ => None,
        }
    }
}

/// The type of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sample {
    /// Unsigned integer of 8 bits.
    U8,
    /// Unsigned integer of 16 bits.
    U16,
    /// IEEE float of 32 bits.
    F32,
}

impl Sample {
    /// Returns the size of a sample in bytes.
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
    /// The type of the samples.
    pub sample: Sample,
    /// Rows, columns, channels.
    pub shape: [usize; 3],
    /// The Exif orientation that the caller must apply, from 1 (upright) to 8.
    pub orientation: u8,
}

/// Decodes a file of at most `limit` pixels and [`BYTES_PER_PIXEL`] bytes for each of them. `name` is used in
/// messages.
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
            // The lenient reader treats the signature as a comment, so it accepts #?RGBE as well as #?RADIANCE.
            let decoder = hdr::HdrDecoder::new_nonstrict(Cursor::new(file));
            if let Ok(decoder) = &decoder {
                rgbe(name, &decoder.metadata())?;
            }
            budget.read(decoder)
        }
    })
}

/// Encodes `pixels` (native byte order, `shape` = rows, columns, channels) without loss. The exception is HDR, which
/// keeps eight bits of each pixel's largest channel. Samples are never converted. A combination that the format does
/// not support is an error.
pub fn encode(
    name: &str,
    format: Format,
    sample: Sample,
    shape: [usize; 3],
    pixels: &[u8],
) -> Result<Vec<u8>> {
    let [rows, cols, channels] = shape;
    // Check the shape first: the image crate panics if the number of bytes is wrong.
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
            format!("must have sides below 2^32, got {rows} x {cols}"),
        ));
    };
    let unheld = || {
        Error::value(
            "pixels",
            format!("must be storable as {format:?}, got {channels} channels of {sample:?}"),
        )
    };
    let color = color(format, sample, channels).ok_or_else(unheld)?;
    caught(name, || {
        let mut out = Cursor::new(Vec::new());
        match format {
            Format::Png => {
                // Level 2 is 4x to 8x faster than the default level on photographs, and files are 3 to 12 % larger.
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

/// Returns the orientation, 1 (upright) to 8, from an Exif block without its "Exif" preamble.
pub fn exif_orientation(exif: &[u8]) -> u8 {
    image::metadata::Orientation::from_exif_chunk(exif).map_or(1, |o| o.to_exif())
}

/// Returns the Exif block of a PNG file. It may be after the pixels, where the decoder does not look.
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

/// Returns an error if a Radiance file contains XYZ instead of RGB.
fn rgbe(name: &str, metadata: &hdr::HdrMetadata) -> Result<()> {
    let format = metadata
        .custom_attributes
        .iter()
        .find(|(key, _)| key == "FORMAT");
    match format {
        Some((_, format)) if format.trim() != "32-bit_rle_rgbe" => Err(fail(
            name,
            format!("must have Radiance samples of format 32-bit_rle_rgbe, got {format:?}"),
        )),
        _ => Ok(()),
    }
}

/// Returns the image crate's colour type for a sample type and number of channels, or `None` if the format does not
/// support this combination.
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

/// The limit for one file.
struct Budget<'a> {
    name: &'a str,
    limit: u64,
}

impl Budget<'_> {
    /// Returns an error if an image is empty, or has more pixels or bytes than the limit.
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

    /// Returns an empty vector with memory for `bytes`. Call it before a decoder allocates memory: if memory is short,
    /// this function returns an error, but the decoder would end the process. The vector can be dropped at once.
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

    /// Returns zeros for an image that has passed [`Budget::check`].
    fn zeros(&self, bytes: u64) -> Result<Vec<u8>> {
        let mut buffer = self.memory(bytes)?;
        buffer.resize(bytes as usize, 0);
        Ok(buffer)
    }

    /// Checks the width and height in the header of a PNG file, before its decoder is created.
    fn png(&self, file: &[u8]) -> Result<()> {
        match file.get(12..24) {
            Some([b'I', b'H', b'D', b'R', size @ ..]) => {
                let side = |i| u64::from(u32::from_be_bytes(std::array::from_fn(|k| size[i + k])));
                self.check(side(4), side(0), 1)
            }
            _ => Err(fail(self.name, "the PNG header is missing or cut off")),
        }
    }

    /// Returns limits that allow memory for a few rows and metadata. They stop an embedded profile that expands to
    /// gigabytes.
    fn png_limits(&self, file: &[u8]) -> image::Limits {
        let width = file
            .get(16..20)
            .map_or(0, |b| u32::from_be_bytes(std::array::from_fn(|k| b[k])));
        let mut limits = image::Limits::no_limits();
        limits.max_alloc = Some(PNG_EXTRAS + 64 * u64::from(width));
        limits
    }

    /// Decodes an image with a decoder of the image crate.
    fn read(&self, decoder: ImageResult<impl ImageDecoder>) -> Result<Decoded> {
        let mut decoder = decoder.map_err(|error| speak(self.name, &error))?;
        let (cols, rows) = decoder.dimensions();
        let color = decoder.color_type();
        self.check(rows.into(), cols.into(), color.bytes_per_pixel().into())?;
        let bytes = decoder.total_bytes();
        let mut limits = image::Limits::no_limits();
        // Decoders may hold a second copy of the image.
        limits.max_alloc = Some(bytes.saturating_mul(2).saturating_add(PNG_EXTRAS));
        decoder
            .set_limits(limits)
            .map_err(|error| speak(self.name, &error))?;
        let sample = match color {
            ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => Sample::U8,
            ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => Sample::U16,
            ColorType::Rgb32F | ColorType::Rgba32F => Sample::F32,
            other => {
                let message = format!("must have samples of 8 or 16 bit, or floats, got {other:?}");
                return Err(fail(self.name, message));
            }
        };
        // Ignore unreadable metadata, because the image itself may be fine.
        let orientation = decoder
            .orientation()
            .map_or(1, |orientation| orientation.to_exif());
        // Test whether memory for the decoder's copies and the result is free.
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

/// Returns an error for a file.
fn fail(name: &str, message: impl Into<String>) -> Error {
    Error::File {
        path: name.to_owned(),
        message: message.into(),
    }
}

/// Converts an error of the image crate to one line.
fn speak(name: &str, error: &ImageError) -> Error {
    match error {
        ImageError::IoError(error) if error.kind() == std::io::ErrorKind::UnexpectedEof => {
            fail(name, "the file is cut off")
        }
        ImageError::Limits(error) => Error::Limit {
            what: name.to_owned(),
            needed: format!("more memory than its pixels explain ({error})"),
            limit: "a few rows and 32 MiB in addition to the pixels".to_owned(),
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

/// Runs a decoder or an encoder. Its panic becomes an error and is not printed.
fn caught<R>(name: &str, work: impl FnOnce() -> Result<R>) -> Result<R> {
    static HOOK: Once = Once::new();
    // Install the hook once for the process. It prints the panics of all threads that are not inside this function.
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
    outcome.unwrap_or_else(|_| Err(fail(name, "the file is corrupt: its decoder failed")))
}

#[cfg(test)]
mod tests;
