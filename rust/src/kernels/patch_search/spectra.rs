//! Spectra of the blocks of the exemplars, with the means removed.

use super::{Block, Exemplar, Index, once};
use crate::foundation::libm::power_below;
use crate::foundation::par;

/// Spectra of the exemplars, which the filter correlates with patches.
pub(super) struct Spectra {
    /// Interleaved spectra. Each block has one layer for each channel, then a layer of squares.
    pub(super) values: Vec<f32>,
    /// Mean of each layer of each block, removed before the transform, and the 2-norm of the rest.
    pub(super) levels: Vec<Level>,
}

#[derive(Clone, Copy, Default)]
pub(super) struct Level {
    pub(super) mean: f64,
    pub(super) norm: f64,
}

impl Index {
    pub(super) fn spectra(&self) -> &Spectra {
        once(&self.spectra, || {
            let layers = self.channels + 1;
            let levels = par::map(self.blocks.len() * layers, |i| {
                self.level(self.blocks[i / layers], i % layers)
            });
            let layer = 2 * self.plan.len();
            let mut values = vec![0.0; layer * levels.len()];
            par::chunks_mut(&mut values, layer, |i, out| {
                let mut scratch = self.scratch.take();
                let (block, l) = (self.blocks[i / layers], i % layers);
                let rows = self.exemplars[block.exemplar].shape[0] - block.corner[0];
                let row = |r: usize, out: &mut [f32]| {
                    let samples = self.layer_row(block, l, r);
                    for (out, x) in out.iter_mut().zip(samples) {
                        *out = (x - levels[i].mean) as f32;
                    }
                };
                self.plan.spectrum(rows, row, out, &mut scratch);
                self.scratch.give(scratch);
            });
            Spectra { values, levels }
        })
    }

    /// Returns row `r` of a layer of a block, in units of the scale. A layer is a channel minus its
    /// mean, or the sum of the squares of all channels.
    fn layer_row(&self, block: Block, layer: usize, r: usize) -> impl Iterator<Item = f64> {
        let Exemplar { data, shape, .. } = &self.exemplars[block.exemplar];
        let [first, left] = block.corner;
        let width = self.plan.size[1].min(shape[1] - left);
        let start = ((first + r) * shape[1] + left) * self.channels;
        let pixels = data[start..][..width * self.channels].chunks_exact(self.channels);
        pixels.map(move |pixel| {
            let distance = |c: usize| (f64::from(pixel[c]) - self.known.mean[c]) / self.known.scale;
            if layer < self.channels {
                distance(layer)
            } else {
                (0..self.channels).map(|c| distance(c).powi(2)).sum()
            }
        })
    }

    fn level(&self, block: Block, layer: usize) -> Level {
        let shape = self.exemplars[block.exemplar].shape;
        let rows = self.plan.size[0].min(shape[0] - block.corner[0]);
        let mut samples = Vec::new();
        for r in 0..rows {
            samples.extend(self.layer_row(block, layer, r));
        }
        let mean = sum(&samples, |x| x) / samples.len() as f64;
        let squares = sum(&samples, |x| (x - mean) * (x - mean));
        Level {
            mean,
            norm: 1.01 * squares.sqrt(),
        }
    }
}

/// Sums `of(x)` over all values, in eight partial sums so that the loop vectorises.
fn sum(values: &[f64], of: impl Fn(f64) -> f64) -> f64 {
    let (chunks, rest) = values.as_chunks::<8>();
    let mut lanes = [0.0; 8];
    for chunk in chunks {
        for (lane, &x) in lanes.iter_mut().zip(chunk) {
            *lane += of(x);
        }
    }
    lanes.iter().sum::<f64>() + rest.iter().map(|&x| of(x)).sum::<f64>()
}

/// Returns the mean of each channel, and a power of two that is at least the largest distance from
/// it.
pub(super) fn moments(all: &[&[f32]], channels: usize) -> (Vec<f64>, f64) {
    let mut mean = vec![0.0; channels];
    let mut range = vec![[f32::INFINITY, f32::NEG_INFINITY]; channels];
    let mut count = 0;
    for data in all {
        match channels {
            1 => tally::<8>(data, channels, &mut mean, &mut range),
            3 => tally::<24>(data, channels, &mut mean, &mut range),
            _ => tally::<0>(data, channels, &mut mean, &mut range),
        }
        count += data.len() / channels;
    }
    mean.iter_mut().for_each(|m| *m /= count as f64);
    let far = mean
        .iter()
        .zip(range)
        .flat_map(|(m, r)| r.map(|x| (f64::from(x) - m).abs()));
    let far = far.fold(0.0, f64::max);
    let scale = if far > 0.0 {
        // Round up to the next power of two.
        let below = power_below(far);
        if below < far { 2.0 * below } else { below }
    } else {
        1.0
    };
    (mean, scale)
}

/// Adds samples to the sum of each channel, and extends its range.
///
/// It processes `LANES` samples together, which are whole pixels, or one pixel at a time if `LANES`
/// is 0. With a single sum, each addition would wait for the previous one.
fn tally<const LANES: usize>(
    data: &[f32],
    channels: usize,
    sum: &mut [f64],
    range: &mut [[f32; 2]],
) {
    // Samples are never NaN, so comparisons replace the costlier `min` and `max`.
    let least = |a: f32, b: f32| if b < a { b } else { a };
    let most = |a: f32, b: f32| if b > a { b } else { a };
    let mut sums = [0.0f64; LANES];
    let mut ranges = [[f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]];
    let mut chunks = data.chunks_exact(if LANES == 0 { channels } else { LANES });
    if LANES > 0 {
        for chunk in &mut chunks {
            for l in 0..LANES {
                sums[l] += f64::from(chunk[l]);
                ranges[0][l] = least(ranges[0][l], chunk[l]);
                ranges[1][l] = most(ranges[1][l], chunk[l]);
            }
        }
    }
    // Combine the lanes, then add the remaining pixels.
    for l in 0..LANES {
        let k = l % channels;
        sum[k] += sums[l];
        range[k] = [
            least(range[k][0], ranges[0][l]),
            most(range[k][1], ranges[1][l]),
        ];
    }
    let rest = if LANES > 0 { chunks.remainder() } else { data };
    for pixel in rest.chunks_exact(channels) {
        for (k, &x) in pixel.iter().enumerate() {
            sum[k] += f64::from(x);
            range[k] = [least(range[k][0], x), most(range[k][1], x)];
        }
    }
}
