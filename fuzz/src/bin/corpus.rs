//! Writes the initial corpus of the fuzz targets. `corpus FOLDER TARGET...` writes one folder of
//! inputs for each target.

use std::fs;
use std::io;
use std::path::Path;

use texrs::hash::Noise;
use texrs::image_io::{Format, Sample, encode};

/// Lengths in bytes of the inputs of a target that draws its arguments from bytes.
const LENGTHS: [usize; 6] = [16, 48, 128, 400, 1200, 4000];

fn bytes(seed: u64, n: usize) -> Vec<u8> {
    let noise = Noise::new(seed);
    (0..n)
        .map(|i| noise.words([i as u32, 0, 0, 0])[0] as u8)
        .collect()
}

/// Writes small files in all supported formats, the first half of each file, and the headers of two
/// more formats.
fn images(folder: &Path) -> io::Result<()> {
    for format in [Format::Png, Format::Tiff, Format::Hdr] {
        for sample in [Sample::U8, Sample::U16, Sample::F32] {
            for channels in 1..=4 {
                for side in [1, 3, 17] {
                    let pixels = bytes(side as u64, side * side * channels * sample.size());
                    let shape = [side, side, channels];
                    // Skip types of samples and numbers of channels that the format does not
                    // support.
                    let Ok(file) = encode("corpus", format, sample, shape, &pixels) else {
                        continue;
                    };
                    let name = format!("{format:?}-{sample:?}-{channels}-{side}");
                    fs::write(folder.join(&name), &file)?;
                    fs::write(folder.join(name + "-half"), &file[..file.len() / 2])?;
                }
            }
        }
    }
    for (name, header) in [
        ("big-tiff", &b"II\x2b\0\x08\0\0\0\x10"[..]),
        ("rgbe", b"#?RGBE\n\n-Y 1 +X 1\n"),
    ] {
        fs::write(folder.join(name), header)?;
    }
    Ok(())
}

fn main() -> io::Result<()> {
    let mut given = std::env::args().skip(1);
    let root = given.next().expect("corpus FOLDER TARGET...");
    for target in given {
        let folder = Path::new(&root).join(&target);
        fs::create_dir_all(&folder)?;
        if target == "image_io" {
            images(&folder)?;
        }
        for (k, length) in (0..8).flat_map(|k| LENGTHS.map(|length| (k, length))) {
            fs::write(folder.join(format!("noise-{k}-{length}")), bytes(k, length))?;
        }
    }
    Ok(())
}
