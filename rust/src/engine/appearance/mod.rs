//! Appearance vectors: short descriptions of the neighbourhood of each sample of an exemplar.
//!
//! The method is by Lefebvre and Hoppe, *Appearance-space texture synthesis*, SIGGRAPH 2006. A window of (2 r + 1)^D
//! colours, weighted by a Gaussian, is projected onto its leading principal components. Colours, components and
//! vectors are 12-bit integers. A vector therefore does not depend on how its window was assembled, and distances are
//! exact in any order of the sums.
//!
//! Distances are divided by the variance of all windows, so they have the same scale for every exemplar. [`UNIT`] is
//! half the distance of two unrelated windows.

mod padding;
mod projection;
mod table;
mod window;

use crate::foundation::error::check_shape;
use crate::foundation::fixed::{BITS, ONE, Place};
use crate::foundation::grid::Grid;
use crate::foundation::hash::Noise;
use crate::foundation::libm::exp;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::foundation::pca::principal;
use crate::{Error, Result};

pub use padding::Padding;
use projection::Projection;
pub use table::Parts;
pub(crate) use window::Centres;
use window::{check_sides, numbers, window};

/// Number of components of an appearance vector.
pub const KEEP: usize = 24;
/// Maximum number of channels of a colour. Missing channels are zero.
pub const CHANNELS: usize = 4;
/// Squared distance that equals the variance of all windows.
pub const UNIT: i32 = SCALE * SCALE;

/// An appearance vector, in units of 1/512 of the standard deviation of the windows.
pub type Feature = [i16; KEEP];
/// A vector aligned to a cache line, so that a random read costs one access.
#[repr(align(64))]
#[derive(Debug, Clone, Copy)]
struct Line(Feature);
/// A colour, scaled so that the colours of the exemplar fill 12 bits.
pub type Colour = [i16; CHANNELS];

/// Standard deviation of the windows, in units of an appearance vector.
const SCALE: i32 = 512;
/// Largest signed 12-bit integer.
const TOP: f32 = 2047.0;
/// Standard deviation of the Gaussian over a window, in samples.
const SIGMA: f64 = 2.0;
/// Maximum number of windows that the components are computed from.
const SAMPLES: usize = 6000;
/// Maximum variance of the windows of an exemplar that counts as uniform, in squared colour steps.
const FLAT: f64 = 1e-3;
/// Maximum number of values in a window, because the components are computed from a square matrix of this side.
const LONGEST: usize = 2048;
/// Number of 16-bit values in a SIMD register.
const LANES: usize = 16;
/// Maximum difference along an axis between two places that count as parts of the same patch of the exemplar. Rounding
/// moves each place by up to half a sample.
const SAME: i32 = ONE * 3 / 4;
/// Number of points in a task.
const CHUNK: usize = 1024;

/// An exemplar at one resolution, with an appearance vector for each of its samples.
#[derive(Debug, Clone)]
pub struct Appearance<const D: usize> {
    grid: Grid<D>,
    radius: usize,
    channels: usize,
    colours: Vec<Colour>,
    padding: Padding<D>,
    offsets: Vec<[i32; D]>,
    projection: Projection,
    features: Vec<Line>,
    /// Median distance from a window to the nearest other window. Windows closer than this count as equal.
    spacing: i32,
}

impl<const D: usize> Appearance<D> {
    /// Analyses `colours`, an array of the points of `grid` by `channels`. The exemplar must be tileable along
    /// periodic axes of the grid.
    pub fn new(colours: &[f32], grid: Grid<D>, channels: usize, radius: usize) -> Result<Self> {
        Self::watched(colours, grid, channels, radius, &Monitor::default())
    }

    /// Does the same as [`Appearance::new`], but stops if the monitor asks for it.
    pub fn watched(
        colours: &[f32],
        grid: Grid<D>,
        channels: usize,
        radius: usize,
        monitor: &Monitor,
    ) -> Result<Self> {
        if !(1..=CHANNELS).contains(&channels) {
            let message = format!("must be from 1 to {CHANNELS}, got {channels}");
            return Err(Error::value("channels", message));
        }
        check_shape("colours", &[grid.len(), channels], colours.len())?;
        memory::room("the appearance of the exemplar", grid.len(), 96)?;
        if let Some(bad) = colours.iter().find(|x| !x.is_finite()) {
            return Err(Error::value(
                "colours",
                format!("must be finite, got {bad}"),
            ));
        }
        let numbers = numbers::<D>(radius, channels);
        if radius == 0 || numbers > LONGEST {
            return Err(Error::value(
                "radius",
                format!(
                    "must be at least 1, and windows must have at most {LONGEST} values; got {radius}, {numbers} values with {channels} channels"
                ),
            ));
        }
        check_sides(&grid, radius)?;
        let colours = quantise(colours, channels);
        let mut this = Self {
            grid,
            radius,
            channels,
            padding: Padding::new(&colours, &grid, radius + 1),
            colours,
            offsets: window(radius),
            projection: Projection::empty(),
            features: Vec::new(),
            spacing: 0,
        };
        // Learn the projection first, because the vectors are computed with it, and the spacing is computed from the
        // vectors.
        this.projection = this.learn();
        monitor.check()?;
        this.features = this.describe_all(monitor);
        monitor.check()?;
        this.spacing = this.measure_spacing(monitor);
        monitor.check()?;
        Ok(this)
    }

    /// Returns the grid of the exemplar. The exemplar is tileable along its periodic axes.
    pub fn grid(&self) -> &Grid<D> {
        &self.grid
    }

    /// Returns the radius of the windows.
    pub fn radius(&self) -> usize {
        self.radius
    }

    /// Returns the number of channels in use.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Returns the offsets of a window, in row-major order.
    pub fn offsets(&self) -> &[[i32; D]] {
        &self.offsets
    }

    /// Returns the median distance from a window to the nearest other window.
    pub fn spacing(&self) -> i32 {
        self.spacing
    }

    /// Returns the variance of the colours over all samples, summed over channels.
    pub fn colour_variance(&self) -> f64 {
        let count = self.colours.len() as f64;
        let (mut sum, mut squares) = ([0i64; CHANNELS], 0i64);
        for colour in &self.colours {
            for c in 0..CHANNELS {
                sum[c] += i64::from(colour[c]);
                squares += i64::from(colour[c]) * i64::from(colour[c]);
            }
        }
        let means: f64 = sum.iter().map(|&s| (s as f64 / count).powi(2)).sum();
        squares as f64 / count - means
    }

    /// Returns the first and the last sample along an axis whose window is inside the exemplar.
    #[inline(always)]
    pub fn range(&self, axis: usize) -> [i32; 2] {
        let last = self.grid.shape()[axis] as i32 - 1;
        if self.grid.wrap()[axis] {
            [0, last]
        } else {
            [self.radius as i32, last - self.radius as i32]
        }
    }

    /// Returns the row-major position of a sample if its window is inside the exemplar. Periodic axes wrap.
    #[inline(always)]
    pub fn inside(&self, sample: [i32; D]) -> Option<usize> {
        let (shape, wrap) = (self.grid.shape(), self.grid.wrap());
        let mut at = 0;
        for axis in 0..D {
            let n = shape[axis] as i32;
            let mut i = sample[axis];
            if wrap[axis] {
                if !(0..n).contains(&i) {
                    i = i.rem_euclid(n);
                }
            } else {
                let r = self.radius as i32;
                if i < r || i >= n - r {
                    return None;
                }
            }
            at = at * n as usize + i as usize;
        }
        Some(at)
    }

    /// Returns the row-major position of the sample of the exemplar that is nearest to `sample`. Periodic axes wrap.
    #[inline(always)]
    pub fn clamped(&self, sample: [i32; D]) -> usize {
        let (shape, wrap) = (self.grid.shape(), self.grid.wrap());
        let mut at = 0;
        for axis in 0..D {
            let n = shape[axis] as i32;
            let mut i = sample[axis];
            if !(0..n).contains(&i) {
                i = if wrap[axis] {
                    i.rem_euclid(n)
                } else {
                    i.clamp(0, n - 1)
                };
            }
            at = at * n as usize + i as usize;
        }
        at
    }

    /// Moves a place so that its window is inside the exemplar. Periodic axes wrap, and places are clamped along the
    /// others.
    #[inline(always)]
    pub fn bring_inside(&self, mut place: Place<D>) -> Place<D> {
        for axis in 0..D {
            let [low, high] = self.range(axis);
            if self.grid.wrap()[axis] {
                place[axis] = place[axis].rem_euclid((high + 1) * ONE);
            } else {
                // Clamp only if the nearest sample is outside, so that fractions are kept.
                let sample = (place[axis] + ONE / 2) >> BITS;
                if !(low..=high).contains(&sample) {
                    place[axis] = sample.clamp(low, high) * ONE;
                }
            }
        }
        place
    }

    /// Returns whether two places for one point are in the same patch of the exemplar.
    #[inline(always)]
    pub fn same(&self, a: Place<D>, b: Place<D>) -> bool {
        (0..D).all(|axis| {
            let d = a[axis].wrapping_sub(b[axis]).wrapping_abs();
            d <= SAME
                || self.grid.wrap()[axis] && {
                    let n = self.grid.shape()[axis] as i32 * ONE;
                    let d = d % n;
                    d.min(n - d) <= SAME
                }
        })
    }

    /// Returns the colours with a margin of one sample more than the radius of windows.
    #[inline(always)]
    pub fn padding(&self) -> &Padding<D> {
        &self.padding
    }

    /// Returns the colour at a row-major position.
    #[inline(always)]
    pub fn colour(&self, at: usize) -> Colour {
        self.colours[at]
    }

    /// Returns the appearance vector at a row-major position. It is zero if the window is not inside the exemplar.
    #[inline(always)]
    pub fn feature(&self, at: usize) -> &Feature {
        &self.features[at].0
    }

    /// Allocates memory for the values of one window.
    pub fn scratch(&self) -> Vec<i16> {
        // `put` writes all four channels of a colour, so reserve memory for a whole colour at the last offset.
        vec![0; (self.offsets.len() * self.channels).next_multiple_of(LANES) + CHANNELS]
    }

    /// Writes the colour of the `k`-th offset into a window.
    #[inline(always)]
    pub fn put(&self, window: &mut [i16], k: usize, colour: Colour) {
        window[k * self.channels..][..CHANNELS].copy_from_slice(&colour);
    }

    /// Returns the appearance vector of a window whose colours were written by [`put`](Self::put), in order.
    #[inline(always)]
    pub fn project(&self, window: &mut [i16]) -> Feature {
        let p = &self.projection;
        window[p.length..p.padded].fill(0);
        p.apply(&window[..p.padded])
    }

    /// Computes the projection from the principal components of many windows.
    fn learn(&self) -> Projection {
        let centres = self.valid_centres();
        let n = self.offsets.len() * self.channels;
        let weights: Vec<f32> = self
            .offsets
            .iter()
            .map(|o| {
                let square: i32 = o.iter().map(|x| x * x).sum();
                exp(-f64::from(square) / (2.0 * SIGMA * SIGMA)) as f32
            })
            .collect();
        // A large exemplar has too many windows, so draw some of them.
        let noise = Noise::new(0x5EED);
        let count = centres.len().min(SAMPLES);
        let mut samples = vec![0.0f32; count * n];
        par::chunks_mut(&mut samples, CHUNK * n, |chunk, samples| {
            let mut window = self.scratch();
            for (i, sample) in samples.chunks_exact_mut(n).enumerate() {
                let k = chunk * CHUNK + i;
                let pick = if count == centres.len() {
                    k
                } else {
                    noise.below(centres.len() as u64, [k as u32, 0, 0, 0]) as usize
                };
                // Weight the colours in the same way as the projection.
                self.cut(centres.get(pick), &mut window);
                for (k, x) in sample.iter_mut().enumerate() {
                    *x = f32::from(window[k]) * weights[k / self.channels];
                }
            }
        });
        Projection::new(&principal(&samples, n, KEEP), &weights, self.channels)
    }

    /// Writes the colours around a sample of the exemplar into a window.
    fn cut(&self, centre: [i32; D], window: &mut [i16]) {
        for (k, o) in self.offsets.iter().enumerate() {
            let mut sample = centre;
            for axis in 0..D {
                sample[axis] += o[axis];
            }
            self.put(window, k, self.colours[self.clamped(sample)]);
        }
    }

    /// Computes the appearance vectors of all samples.
    fn describe_all(&self, monitor: &Monitor) -> Vec<Line> {
        let mut features = vec![Line([0; KEEP]); self.grid.len()];
        par::chunks_mut(&mut features, CHUNK, |chunk, features| {
            if monitor.check().is_err() {
                return;
            }
            let mut window = self.scratch();
            for (i, feature) in features.iter_mut().enumerate() {
                let centre = self.grid.point(chunk * CHUNK + i).map(|x| x as i32);
                if self.inside(centre).is_some() {
                    self.cut(centre, &mut window);
                    feature.0 = self.project(&mut window);
                }
            }
        });
        features
    }

    /// Returns the samples whose windows are inside the exemplar, addressed by number.
    pub(crate) fn valid_centres(&self) -> Centres<D> {
        let ranges = std::array::from_fn(|axis| self.range(axis));
        Centres { ranges }
    }

    /// Returns the median distance from a window to the nearest window that overlaps it little.
    fn measure_spacing(&self, monitor: &Monitor) -> i32 {
        let centres = self.valid_centres();
        let count = (60_000_000 / self.grid.len())
            .clamp(60, 400)
            .min(centres.len());
        let noise = Noise::new(0xD157);
        let apart = 2 * self.radius as i32 - 1;
        let mut nearest = par::map(count, |k| {
            if monitor.check().is_err() {
                return 0;
            }
            let me = centres.get(noise.below(centres.len() as u64, [k as u32, 0, 0, 0]) as usize);
            self.nearest_other(me, apart)
        });
        nearest.sort_unstable();
        nearest[count / 2]
    }

    /// Returns the distance from the window at `me` to the nearest window that is more than `apart` away along some
    /// axis.
    #[inline(always)]
    fn nearest_other(&self, me: [i32; D], apart: i32) -> i32 {
        let (shape, wrap) = (self.grid.shape(), self.grid.wrap());
        let mine = self.features[self.clamped(me)].0;
        // Search line by line, because then only the last axis needs a check for each sample.
        let columns = self.range(D - 1);
        let lines = self.grid.len() / shape[D - 1];
        let mut best = i32::MAX;
        for line in 0..lines {
            let point = self.grid.point(line * shape[D - 1]);
            let mut near = true;
            let mut valid = true;
            for axis in 0..D - 1 {
                let x = point[axis] as i32;
                let range = self.range(axis);
                valid &= (range[0]..=range[1]).contains(&x);
                near &= gap(x, me[axis], shape[axis] as i32, wrap[axis]) <= apart;
            }
            if !valid {
                continue;
            }
            for x in columns[0]..=columns[1] {
                if near && gap(x, me[D - 1], shape[D - 1] as i32, wrap[D - 1]) <= apart {
                    continue;
                }
                let other = &self.features[line * shape[D - 1] + x as usize].0;
                best = best.min(distance(&mine, other));
            }
        }
        // A small exemplar may not have a window that is far enough away. Then return a moderate spacing.
        if best == i32::MAX { UNIT / 4 } else { best }
    }
}

/// Returns the squared distance of two appearance vectors.
// This function is not inlined. If it were inlined next to bounds checks, the compiler would unroll it into scalar
// code. As a separate function, it becomes a few SIMD instructions.
#[inline(never)]
pub fn distance(a: &Feature, b: &Feature) -> i32 {
    let mut sum = 0;
    for k in 0..KEEP {
        // Components have 12 bits, so their difference fits into 16 bits. Products of 16-bit integers are the fastest
        // in SIMD.
        let d = a[k].wrapping_sub(b[k]);
        sum += i32::from(d) * i32::from(d);
    }
    sum
}

/// Returns the distance of two coordinates along an axis, the short way round if it is periodic.
fn gap(a: i32, b: i32, n: i32, wrap: bool) -> i32 {
    let d = (a - b).abs();
    if wrap { d.min(n - d) } else { d }
}

/// Subtracts the mean from colours and scales them so that the largest difference fills 12 bits.
fn quantise(colours: &[f32], channels: usize) -> Vec<Colour> {
    let count = (colours.len() / channels) as f64;
    let mut mean = [0.0f64; CHANNELS];
    for pixel in colours.chunks_exact(channels) {
        for (m, &x) in mean.iter_mut().zip(pixel) {
            *m += f64::from(x) / count;
        }
    }
    let mean = mean.map(|m| m as f32);
    let mut largest = 0.0f32;
    for pixel in colours.chunks_exact(channels) {
        for (m, &x) in mean.iter().zip(pixel) {
            largest = largest.max((x - m).abs());
        }
    }
    // A uniform exemplar becomes zero instead of amplified noise.
    let scale = if largest > 1e-6 { TOP / largest } else { 0.0 };
    colours
        .chunks_exact(channels)
        .map(|pixel| {
            let mut colour = [0; CHANNELS];
            for ((c, &x), m) in colour.iter_mut().zip(pixel).zip(mean) {
                *c = ((x - m) * scale).round() as i16;
            }
            colour
        })
        .collect()
}

#[cfg(test)]
mod tests;
