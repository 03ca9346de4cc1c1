//! What the decoders leave unchecked or unread in headers.

use image::codecs::hdr;

use super::fail;
use crate::Result;

/// The Exif block of a PNG file, which may also stand behind the pixels, where the decoder has no eye for it.
pub(super) fn png_exif(file: &[u8]) -> Option<&[u8]> {
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

/// Refuses a WebP file that is cut off, or whose chunks announce more bytes than there are: its decoder would ask
/// for them first and look afterwards.
pub(super) fn whole_chunks(name: &str, file: &[u8]) -> Result<()> {
    let length_at = |at: usize| -> Option<usize> {
        let bytes = file.get(at..at + 4)?;
        usize::try_from(u32::from_le_bytes(bytes.try_into().ok()?)).ok()
    };
    let cut = || fail(name, "the file is cut off or corrupt");
    let end = length_at(4)
        .and_then(|length| length.checked_add(8))
        .filter(|&end| end <= file.len())
        .ok_or_else(cut)?;
    let mut at = 12;
    while at + 8 <= end {
        let length = length_at(at + 4).ok_or_else(cut)?;
        // A last odd chunk may lack its padding byte.
        at = (at + 8).checked_add(length).ok_or_else(cut)?;
        if at > file.len() {
            return Err(cut());
        }
        at += length % 2;
    }
    Ok(())
}

/// Radiance files may hold XYZ instead of RGB.
pub(super) fn rgbe(name: &str, metadata: &hdr::HdrMetadata) -> Result<()> {
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
