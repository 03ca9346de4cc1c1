//! Normalised cross-correlation: similarity of a template and each window of an image, independent
//! of brightness and contrast.
//!
//! Lewis, *Fast normalized cross-correlation*, Vision Interface 1995:
//!
//! 1. the numerator is a product of spectra;
//! 2. mean and variance of each window come from running sums.
//!
//! Departures from the paper:
//!
//! - The template is centred, so the numerator does not need the mean of the window.
//! - A window or template without variance has correlation 0 instead of dividing by zero.
//! - All arithmetic is f64, and results are rounded to 20 bits. A threshold on them then does not
//!   depend on the last bits of a transform.

use crate::foundation::fft::{Complex, Images, Scratch};
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// Variance of a window, relative to that of its channel, below which the window counts as flat.
const FLAT: f64 = 1e-9;
/// Number of steps per unit of correlation. Results are rounded to these steps.
const STEPS: f64 = (1 << 20) as f64;

/// The channels of an image, prepared for correlation with many templates.
pub struct Correlation {
    shape: [usize; 2],
    plan: Images<f64>,
    channels: Vec<Channel>,
}

struct Channel {
    spectrum: Vec<Complex<f64>>,
    /// Sums of the values, and of their squares, above and to the left of each pixel corner.
    sums: Vec<[f64; 2]>,
    variance: f64,
}

impl Correlation {
    /// Prepares a planar `image`: channels of `shape`, one after the other.
    pub fn new(image: &[f32], shape: [usize; 2]) -> Result<Self> {
        let points = shape[0] * shape[1];
        if points == 0 || image.is_empty() || !image.len().is_multiple_of(points) {
            return Err(Error::Shape {
                argument: "image",
                expected: vec![1, shape[0].max(1), shape[1].max(1)],
                got: vec![image.len()],
            });
        }
        finite(image, "image")?;
        memory::room("the correlation", image.len(), 48)?;
        // A transform of the image's own size is enough, because windows inside the image do not
        // reach wrapped samples.
        let plan = Images::new(shape.map(quick));
        let channels = par::map(image.len() / points, |c| {
            let values = &image[c * points..][..points];
            let mean = mean(values);
            // Subtract the exact value from a constant channel, so that rounding of the mean cannot
            // look like a signal.
            let same = values.iter().all(|&x| x == values[0]);
            let centre = if same { f64::from(values[0]) } else { mean };
            let centred: Vec<f64> = values.iter().map(|&x| f64::from(x) - centre).collect();
            Channel {
                spectrum: spectrum(&plan, &centred, shape[1], &mut Scratch::default()),
                sums: running(&centred, shape),
                variance: centred.iter().map(|x| x * x).sum::<f64>() / points as f64,
            }
        });
        Ok(Self {
            shape,
            plan,
            channels,
        })
    }

    /// Number of channels.
    pub fn channels(&self) -> usize {
        self.channels.len()
    }

    /// Returns the correlation of the windows of each channel with the same channel of a planar
    /// `template` of `shape`.
    ///
    /// The result is planar: for each channel, one value from -1 to 1 for each position of the
    /// template inside the image.
    pub fn maps(&self, template: &[f32], shape: [usize; 2], monitor: &Monitor) -> Result<Vec<f32>> {
        let points = shape[0] * shape[1];
        if points == 0 || template.len() != points * self.channels.len() {
            return Err(Error::Shape {
                argument: "template",
                expected: vec![self.channels.len(), shape[0].max(1), shape[1].max(1)],
                got: vec![template.len()],
            });
        }
        if shape[0] > self.shape[0] || shape[1] > self.shape[1] {
            return Err(Error::value(
                "template",
                format!(
                    "must not be larger than the image of shape {:?}, got {shape:?}",
                    self.shape
                ),
            ));
        }
        finite(template, "template")?;
        let image = self.shape[0] * self.shape[1] * self.channels.len();
        memory::room("the correlation", image, 40)?;
        // Correlate the channels in parallel.
        monitor.expect(self.channels.len() as u64);
        let maps = par::map(self.channels.len(), |c| {
            monitor.check()?;
            let values = &template[c * points..][..points];
            let mean = mean(values);
            let centred: Vec<f64> = values.iter().map(|&x| f64::from(x) - mean).collect();
            let map = self.map(&self.channels[c], &centred, shape);
            monitor.advance(1)?;
            Ok(map)
        });
        let mut all = Vec::with_capacity(maps.len() * points);
        for map in maps {
            all.extend(map?);
        }
        Ok(all)
    }

    fn map(&self, channel: &Channel, template: &[f64], shape: [usize; 2]) -> Vec<f32> {
        let (points, width) = ((shape[0] * shape[1]) as f64, self.shape[1] + 1);
        let valid = [self.shape[0] - shape[0] + 1, self.shape[1] - shape[1] + 1];
        let energy: f64 = template.iter().map(|x| x * x).sum();
        let flat = FLAT * channel.variance;
        if energy <= flat * points {
            return vec![0.0; valid[0] * valid[1]];
        }
        // The product of the spectra gives the numerators of all windows.
        let mut scratch = Scratch::default();
        let mut product = spectrum(&self.plan, template, shape[1], &mut scratch);
        for (t, s) in product.iter_mut().zip(&channel.spectrum) {
            *t = t.conj() * s;
        }
        let [height, columns] = self.plan.size();
        let scale = 1.0 / (height * columns) as f64;
        let mut map = Vec::with_capacity(valid[0] * valid[1]);
        let take = |row: usize, line: &[f64]| {
            let [above, below] = [row, row + shape[0]].map(|r| &channel.sums[r * width..][..width]);
            for (column, &numerator) in line[..valid[1]].iter().enumerate() {
                // Running sums give the variance of each window.
                let end = column + shape[1];
                let [sum, squares] = [0, 1]
                    .map(|k| below[end][k] - below[column][k] - above[end][k] + above[column][k]);
                let variance = squares - sum * sum / points;
                let found = if variance > flat * points {
                    (numerator * scale / (variance * energy).sqrt()).clamp(-1.0, 1.0)
                } else {
                    0.0
                };
                map.push(((found * STEPS).round() / STEPS) as f32);
            }
        };
        self.plan
            .inverse(&mut product, valid[0], take, &mut scratch);
        map
    }
}

fn finite(values: &[f32], argument: &'static str) -> Result<()> {
    match values.iter().find(|x| !x.is_finite()) {
        Some(bad) => Err(Error::value(argument, format!("must be finite, got {bad}"))),
        None => Ok(()),
    }
}

fn mean(values: &[f32]) -> f64 {
    values.iter().map(|&x| f64::from(x)).sum::<f64>() / values.len() as f64
}

/// Returns the sums of values and of squares above and to the left of each pixel corner. The result has one row and
/// one column more than the values.
fn running(values: &[f64], shape: [usize; 2]) -> Vec<[f64; 2]> {
    let width = shape[1] + 1;
    let mut sums = vec![[0.0; 2]; (shape[0] + 1) * width];
    for (row, line) in values.chunks_exact(shape[1]).enumerate() {
        let (before, here) = sums[row * width..].split_at_mut(width);
        let mut run = [0.0; 2];
        for (column, &x) in line.iter().enumerate() {
            run = [run[0] + x, run[1] + x * x];
            here[column + 1] = [
                before[column + 1][0] + run[0],
                before[column + 1][1] + run[1],
            ];
        }
    }
    sums
}

fn spectrum(
    plan: &Images<f64>,
    values: &[f64],
    width: usize,
    scratch: &mut Scratch<f64>,
) -> Vec<Complex<f64>> {
    let mut spectrum = Vec::new();
    let row =
        |r: usize, out: &mut [f64]| out[..width].copy_from_slice(&values[r * width..][..width]);
    plan.forward(values.len() / width, row, &mut spectrum, scratch);
    spectrum
}

/// Returns the smallest even length of at least `n` that has no prime factors other than 2, 3 and 5.
fn quick(n: usize) -> usize {
    let mut length = n.next_multiple_of(2);
    loop {
        let mut rest = length;
        for factor in [2, 3, 5] {
            while rest.is_multiple_of(factor) {
                rest /= factor;
            }
        }
        if rest == 1 {
            return length;
        }
        length += 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::foundation::hash::Noise;

    fn noise(n: usize, seed: u64) -> Vec<f32> {
        let noise = Noise::new(seed);
        (0..n)
            .map(|i| noise.uniform([i as u32, 0, 0, 0]) as f32 + 5.0)
            .collect()
    }

    /// Correlation coefficient of a window and the template, by definition.
    fn direct(
        image: &[f32],
        width: usize,
        template: &[f32],
        shape: [usize; 2],
        at: [usize; 2],
    ) -> f64 {
        let pairs: Vec<(f64, f64)> = (0..shape[0] * shape[1])
            .map(|k| {
                let (r, c) = (k / shape[1], k % shape[1]);
                let x = image[(at[0] + r) * width + at[1] + c];
                (f64::from(x), f64::from(template[k]))
            })
            .collect();
        let n = pairs.len() as f64;
        let mean = |f: fn(&(f64, f64)) -> f64| pairs.iter().map(f).sum::<f64>() / n;
        let (mx, mt) = (mean(|p| p.0), mean(|p| p.1));
        let product: f64 = pairs.iter().map(|p| (p.0 - mx) * (p.1 - mt)).sum();
        let squares = |m: f64, f: fn(&(f64, f64)) -> f64| -> f64 {
            pairs.iter().map(|p| (f(p) - m).powi(2)).sum()
        };
        product / (squares(mx, |p| p.0) * squares(mt, |p| p.1)).sqrt()
    }

    #[test]
    fn maps_are_those_of_the_definition() {
        for (shape, window) in [([13, 17], [5, 3]), ([7, 8], [7, 8]), ([9, 1], [3, 1])] {
            let points = shape[0] * shape[1];
            let (image, template) = (noise(2 * points, 1), noise(2 * window[0] * window[1], 2));
            let found = Correlation::new(&image, shape)
                .unwrap()
                .maps(&template, window, &Monitor::default())
                .unwrap();
            let valid = [shape[0] - window[0] + 1, shape[1] - window[1] + 1];
            assert_eq!(found.len(), 2 * valid[0] * valid[1]);
            for (i, &x) in found.iter().enumerate() {
                let (c, at) = (i / (valid[0] * valid[1]), i % (valid[0] * valid[1]));
                let at = [at / valid[1], at % valid[1]];
                let template = &template[c * window[0] * window[1]..][..window[0] * window[1]];
                let wanted = direct(
                    &image[c * points..][..points],
                    shape[1],
                    template,
                    window,
                    at,
                );
                assert!((f64::from(x) - wanted).abs() < 1e-6, "{x} {wanted}");
            }
        }
    }

    #[test]
    fn what_is_flat_correlates_with_nothing() {
        let mut image = noise(100, 3);
        image[..50].fill(5.25);
        let correlation = Correlation::new(&image, [10, 10]).unwrap();
        let found = correlation.maps(&image[50..59], [3, 3], &Monitor::default());
        assert!(found.unwrap()[..24].iter().all(|&x| x == 0.0));
        let flat = correlation.maps(&[1.0; 9], [3, 3], &Monitor::default());
        assert!(flat.unwrap().iter().all(|&x| x == 0.0));
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        assert!(Correlation::new(&[], [0, 3]).is_err());
        assert!(Correlation::new(&[f32::NAN; 4], [2, 2]).is_err());
        let correlation = Correlation::new(&noise(16, 1), [4, 4]).unwrap();
        let monitor = Monitor::default();
        assert!(correlation.maps(&noise(25, 1), [5, 5], &monitor).is_err());
        assert!(correlation.maps(&noise(4, 1), [3, 3], &monitor).is_err());
    }
}
