//! Fuzzes the readers of image files with arbitrary bytes, and with valid files that are damaged at
//! a few positions.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::image_io::{BYTES_PER_PIXEL, Decoded, Format, Sample, decode, encode};
use texrs_fuzz::{Draw, speaks};

const FORMATS: [Format; 3] = [Format::Png, Format::Tiff, Format::Hdr];
const SAMPLES: [Sample; 3] = [Sample::U8, Sample::U16, Sample::F32];

/// Reads a file, and checks that the result is complete and within the limits.
fn read(file: &[u8], limit: u64) -> Option<Decoded> {
    let found = decode("file", file, limit).inspect_err(speaks).ok()?;
    let [rows, columns, channels] = found.shape;
    assert!((rows * columns) as u64 <= limit && rows * columns * channels > 0);
    assert_eq!(
        found.bytes.len(),
        rows * columns * channels * found.sample.size()
    );
    assert!(found.bytes.len() as u64 <= limit * BYTES_PER_PIXEL);
    assert!((1..=8).contains(&found.orientation));
    Some(found)
}

fuzz_target!(|bytes: &[u8]| {
    // Most inputs of the corpus are image files, which are recognised by their first bytes. All
    // other inputs are bytes that arguments are drawn from.
    if Format::of_content(bytes).is_some() {
        read(bytes, 1 << 12);
        read(bytes, 16);
        return;
    }
    let mut draw = Draw::new(bytes);
    let format = FORMATS[draw.within(0..=2)];
    let sample = SAMPLES[draw.within(0..=2)];
    let shape = [draw.within(1..=9), draw.within(1..=9), draw.within(1..=4)];
    let size = shape.iter().product::<usize>() * sample.size();
    let pixels: Vec<u8> = draw.words(size).map(|x| x as u8).collect();
    let mut file = match encode("file", format, sample, shape, &pixels) {
        Ok(file) => file,
        Err(error) => return speaks(&error),
    };
    let whole = read(&file, 81).expect("what was written can be read");
    assert_eq!(whole.shape, shape);
    if format != Format::Hdr {
        assert_eq!((whole.sample, &whole.bytes), (sample, &pixels));
    }
    for _ in 0..draw.within(0..=6) {
        let at = draw.within(0..=file.len() - 1);
        match draw.within(0..=3) {
            0 => file[at] = draw.any(),
            1 => file[at] ^= 1 << draw.within(0..=7),
            2 => file.truncate(at.max(1)),
            _ => file.insert(at, draw.any()),
        }
    }
    read(&file, 1 << 12);
});
