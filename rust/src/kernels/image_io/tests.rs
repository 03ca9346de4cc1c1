use super::*;
use proptest::prelude::*;

const LIMIT: u64 = 1 << 20;

/// Returns bytes that are not NaN in any sample type, and not constant.
fn pixels(shape: [usize; 3], sample: Sample) -> Vec<u8> {
    let values = (0..shape.iter().product()).map(|i: usize| (i * 37 + 5) % 251);
    values
        .flat_map(|v| match sample {
            Sample::U8 => vec![v as u8],
            Sample::U16 => (v as u16 * 257 + 3).to_ne_bytes().to_vec(),
            Sample::F32 => (v as f32 * 1.37 - 40.0).to_ne_bytes().to_vec(),
        })
        .collect()
}

fn written(format: Format, sample: Sample, shape: [usize; 3]) -> Vec<u8> {
    encode("a file", format, sample, shape, &pixels(shape, sample)).unwrap()
}

#[test]
fn lossless_formats_give_back_what_came() {
    let cases = [
        (Format::Png, vec![Sample::U8, Sample::U16], 1..5),
        (
            Format::Tiff,
            vec![Sample::U8, Sample::U16, Sample::F32],
            3..5,
        ),
    ];
    for (format, samples, channels) in cases {
        for sample in samples {
            for channels in channels.clone() {
                for (rows, cols) in [(1, 1), (3, 7), (40, 33)] {
                    let shape = [rows, cols, channels];
                    let file = written(format, sample, shape);
                    assert_eq!(Format::of_content(&file), Some(format));
                    let back = decode("a file", &file, LIMIT).unwrap();
                    assert_eq!((back.shape, back.sample), (shape, sample), "{format:?}");
                    assert_eq!(back.bytes, pixels(shape, sample), "{format:?} {shape:?}");
                    assert_eq!(back.orientation, 1);
                }
            }
        }
    }
}

#[test]
fn radiance_keeps_eight_bits_of_the_largest_channel() {
    let shape = [5, 9, 3];
    let values: Vec<f32> = (0..135).map(|i| 1.0e-3 * 1.2f32.powi(i / 2)).collect();
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_ne_bytes()).collect();
    let file = encode("a file", Format::Hdr, Sample::F32, shape, &bytes).unwrap();
    let signed = [b"#?RGBE".as_slice(), &file["#?RADIANCE".len()..]].concat();
    for file in [file, signed] {
        let back = decode("a file", &file, LIMIT).unwrap();
        let (back, _) = back.bytes.as_chunks::<4>();
        for (pixel, back) in values.chunks(3).zip(back.chunks(3)) {
            let most = pixel.iter().copied().fold(0.0, f32::max);
            for (v, b) in pixel.iter().zip(back) {
                assert!((v - f32::from_ne_bytes(*b)).abs() <= most / 128.0);
            }
        }
    }
}

#[test]
fn an_exif_block_is_found_wherever_it_stands() {
    let file = written(Format::Png, Sample::U8, [2, 3, 3]);
    let exif = b"\0\0\0\x1aeXIfII*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0";
    let crc = 0x0000_0000u32.to_be_bytes();
    for at in [33, file.len() - 12] {
        let turned = [&file[..at], exif, &crc, &file[at..]].concat();
        assert_eq!(png_exif(&turned).map(exif_orientation), Some(6));
    }
    assert_eq!(png_exif(&file), None);
    assert_eq!(png_exif(&file[..20]), None);
}

#[test]
fn what_a_format_cannot_hold_is_refused() {
    let refused = [
        (Format::Png, Sample::F32, 3),
        (Format::Png, Sample::U8, 5),
        (Format::Hdr, Sample::F32, 4),
        (Format::Tiff, Sample::U8, 2),
    ];
    for (format, sample, channels) in refused {
        let shape = [2, 2, channels];
        let outcome = encode("a file", format, sample, shape, &pixels(shape, sample));
        assert!(matches!(outcome, Err(Error::Value { .. })), "{format:?}");
    }
    let outcome = encode("a file", Format::Png, Sample::U8, [2, 2, 3], &[0; 11]);
    assert!(matches!(outcome, Err(Error::Shape { .. })));
}

#[test]
fn limits_are_kept_before_decoding() {
    for (format, sample) in [
        (Format::Png, Sample::U8),
        (Format::Tiff, Sample::U8),
        (Format::Hdr, Sample::F32),
    ] {
        let file = written(format, sample, [9, 9, 3]);
        assert!(decode("a file", &file, 81).is_ok());
        let outcome = decode("a file", &file, 80);
        assert!(matches!(outcome, Err(Error::Limit { .. })), "{format:?}");
    }
    // Write only the header of a PNG that would need 2.5 gigapixels.
    let mut bomb = written(Format::Png, Sample::U8, [1, 1, 1]);
    bomb[16..24].copy_from_slice(&[0, 0, 0xc3, 0x50, 0, 0, 0xc3, 0x50]);
    let outcome = decode("a file", &bomb, 1 << 28);
    assert!(matches!(outcome, Err(Error::Limit { .. })));
}

#[test]
fn a_file_that_is_cut_off_is_refused() {
    for (format, sample) in [
        (Format::Png, Sample::U8),
        (Format::Tiff, Sample::U8),
        (Format::Hdr, Sample::F32),
    ] {
        let file = written(format, sample, [16, 16, 3]);
        for share in [0, 1, 10, 40, 70, 90] {
            let outcome = decode("a file", &file[..file.len() * share / 100], LIMIT);
            assert!(
                matches!(outcome, Err(Error::File { .. })),
                "{format:?} {share}"
            );
        }
    }
}

#[test]
fn a_panic_becomes_an_error() {
    let outcome: Result<()> = caught("a file", || panic!("inside a decoder"));
    assert!(matches!(outcome, Err(Error::File { .. })));
    assert!(!QUIET.get());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn corrupt_files_give_an_image_or_an_error(
        which in 0usize..3, places in prop::collection::vec((0f64..1.0, any::<u8>()), 1..6),
    ) {
        let (format, sample) = [
            (Format::Png, Sample::U16), (Format::Tiff, Sample::U8), (Format::Hdr, Sample::F32),
        ][which];
        let mut file = written(format, sample, [12, 10, 3]);
        let length = file.len() as f64;
        for (at, byte) in places {
            file[(at * length) as usize] = byte;
        }
        if let Ok(image) = decode("a file", &file, LIMIT) {
            let size = image.shape.iter().product::<usize>() * image.sample.size();
            prop_assert_eq!(image.bytes.len(), size);
        }
    }
}
