//! OpenEXR, any of half and float, with the channel names that images use.
//!
//! The image crate reads and writes float RGB and RGBA alone; height and roughness maps are one channel, often half.

use std::io::Cursor;

use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, ReadChannels,
    ReadLayers, Vec2, WritableImage, f16, read,
};

use super::{Budget, Decoded, Sample, fail};
use crate::Result;

/// The names that the channels of an image bear, in its order.
const NAMES: [&[&str]; 4] = [&["Y"], &["Y", "A"], &["R", "G", "B"], &["R", "G", "B", "A"]];

pub(super) fn decode(budget: &Budget<'_>, file: &[u8]) -> Result<Decoded> {
    let wrong = |error: exr::error::Error| {
        fail(
            budget.name,
            format!("cannot be decoded: {error}").replace('\n', " "),
        )
    };
    let reader = exr::block::read(Cursor::new(file), false).map_err(wrong)?;
    for header in reader.headers() {
        let Vec2(cols, rows) = header.layer_size;
        let bytes = header
            .channels
            .list
            .iter()
            .map(|c| c.sample_type.bytes_per_sample())
            .sum::<usize>();
        // A file may hold channels beside those of the image; all of them are decoded.
        budget.check(rows as u64, cols as u64, bytes as u64)?;
        drop(budget.memory(rows as u64 * cols as u64 * bytes as u64)?);
        let Vec2(cols, rows) = header.shared_attributes.display_window.size;
        budget.check(rows as u64, cols as u64, 1)?;
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_chunks(reader)
        .map_err(wrong)?;
    let (window, layer) = (image.attributes.display_window, image.layer_data);
    let channels = pick(budget.name, &layer.channel_data.list)?;
    let sample = if channels
        .iter()
        .all(|c| matches!(c.sample_data, FlatSamples::F16(_)))
    {
        Sample::F16
    } else {
        Sample::F32
    };
    // The picture is the display window; data outside it is dropped, and zero where it has no data.
    let shape = [window.size.height(), window.size.width(), channels.len()];
    let offset = layer.attributes.layer_position - window.position;
    let stride = channels.len() * sample.size();
    let mut bytes = budget.zeros((shape[0] * shape[1]) as u64 * stride as u64)?;
    for (k, channel) in channels.iter().enumerate() {
        for row in 0..layer.size.height() {
            let Some(y) = inside(row, offset.y(), shape[0]) else {
                continue;
            };
            for col in 0..layer.size.width() {
                let Some(x) = inside(col, offset.x(), shape[1]) else {
                    continue;
                };
                let (from, to) = (
                    row * layer.size.width() + col,
                    (y * shape[1] + x) * stride + k * sample.size(),
                );
                match (&channel.sample_data, sample) {
                    (FlatSamples::F16(data), Sample::F16) => {
                        bytes[to..to + 2].copy_from_slice(&data[from].to_ne_bytes());
                    }
                    (FlatSamples::F16(data), _) => {
                        bytes[to..to + 4].copy_from_slice(&data[from].to_f32().to_ne_bytes());
                    }
                    (FlatSamples::F32(data), _) => {
                        bytes[to..to + 4].copy_from_slice(&data[from].to_ne_bytes());
                    }
                    (FlatSamples::U32(_), _) => {
                        return Err(fail(
                            budget.name,
                            "channels of 32-bit integers are not read",
                        ));
                    }
                }
            }
        }
    }
    Ok(Decoded {
        bytes,
        sample,
        shape,
        orientation: 1,
    })
}

/// `at + offset` where that is a side's index.
fn inside(at: usize, offset: i32, side: usize) -> Option<usize> {
    let moved = i64::try_from(at).ok()? + i64::from(offset);
    usize::try_from(moved).ok().filter(|&i| i < side)
}

/// The channels of the image: colour, else grey, else the only one there is.
fn pick<'a>(
    name: &str,
    list: &'a [AnyChannel<FlatSamples>],
) -> Result<Vec<&'a AnyChannel<FlatSamples>>> {
    let found = NAMES.iter().rev().find_map(|names| {
        names
            .iter()
            .map(|&n| list.iter().find(|c| c.name.eq(n)))
            .collect::<Option<Vec<_>>>()
    });
    let chroma = list.iter().any(|c| c.name.eq("RY") || c.name.eq("BY"));
    let channels = match found {
        Some(channels) if !chroma => channels,
        None if list.len() == 1 => vec![&list[0]],
        _ => {
            let names: Vec<_> = list.iter().map(|c| c.name.to_string()).collect();
            return Err(fail(
                name,
                format!(
                    "has the channels {}; R G B, R G B A, Y, Y A or a single one are read",
                    names.join(" ")
                ),
            ));
        }
    };
    if channels.iter().any(|c| c.sampling != Vec2(1, 1)) {
        return Err(fail(name, "subsampled channels are not read"));
    }
    Ok(channels)
}

pub(super) fn encode(
    name: &str,
    sample: Sample,
    [rows, cols, channels]: [usize; 3],
    pixels: &[u8],
) -> Result<Vec<u8>> {
    let names = NAMES
        .iter()
        .find(|names| names.len() == channels)
        .ok_or_else(|| fail(name, format!("{channels} channels are not written to EXR")))?;
    let size = sample.size();
    let samples = |k: usize| {
        pixels
            .chunks_exact(channels * size)
            .map(move |pixel| &pixel[k * size..][..size])
    };
    let list = names
        .iter()
        .enumerate()
        .map(|(k, &channel)| {
            let data = match sample {
                Sample::F16 => FlatSamples::F16(
                    samples(k)
                        .map(|b| f16::from_ne_bytes([b[0], b[1]]))
                        .collect(),
                ),
                Sample::F32 => FlatSamples::F32(
                    samples(k)
                        .map(|b| f32::from_ne_bytes([b[0], b[1], b[2], b[3]]))
                        .collect(),
                ),
                other => return Err(fail(name, format!("EXR cannot hold {other:?}"))),
            };
            Ok(AnyChannel::new(channel, data))
        })
        .collect::<Result<_>>()?;
    let layer = Layer::new(
        (cols, rows),
        LayerAttributes::default(),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(list),
    );
    let mut out = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut out)
        .map_err(|error| fail(name, format!("cannot be encoded: {error}")))?;
    Ok(out.into_inner())
}
