//! A prepared query, and the exact score of one position.

#[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
use std::arch::x86_64::{__m128, __m256d};

use super::Query;
use crate::foundation::error::check_shape;
#[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
use crate::foundation::simd::{V3, cast};
use crate::{Error, Result};

/// Number of partial sums of a score. It is fixed, so that every CPU adds in the same order.
const LANES: usize = 8;
/// Number of rows between comparisons with the bound.
const LOOK: usize = 4;

/// A query, converted for direct scores and for the kernels of the filter.
#[derive(Default)]
pub(super) struct Prepared {
    shape: [usize; 2],
    channels: usize,
    patch: Vec<f32>,
    /// One weight for each sample of the patch.
    weight: Vec<f32>,
    /// Range of samples in each row that contains all non-zero weights, rounded to whole lanes.
    weighed: Vec<[usize; 2]>,
    /// Differences of the patch from the mean of the exemplars, divided by the largest difference. Samples of weight 0
    /// have 0.
    centred: Vec<f32>,
    largest_weight: f64,
    largest: f64,
    scale: f64,
    kernels: Vec<Kernel>,
    row: Vec<f32>,
    offset: f64,
}

/// Sum and 2-norm of a kernel.
#[derive(Clone, Copy, Default)]
pub(super) struct Kernel {
    pub(super) sum: f64,
    pub(super) norm: f64,
}

impl Prepared {
    /// Checks a query and copies it.
    pub(super) fn fill(&mut self, query: &Query<'_>, channels: usize) -> Result<()> {
        let [rows, columns] = query.shape;
        check_shape("patch", &[rows, columns, channels], query.patch.len())?;
        check_shape("weight", &query.shape, query.weight.len())?;
        if query.weight.is_empty() {
            return Err(Error::value("patch", "must have at least 1 pixel, got 0"));
        }
        if let Some(bad) = query.weight.iter().find(|w| !w.is_finite() || **w < 0.0) {
            let message = format!("must be finite and not negative, got {bad}");
            return Err(Error::value("weight", message));
        }
        // Replace samples of weight 0, which may be NaN, by 0.
        self.shape = query.shape;
        self.channels = channels;
        self.patch.clear();
        self.weight.clear();
        for (pixel, &w) in query.patch.chunks_exact(channels).zip(query.weight) {
            for &x in pixel {
                if w > 0.0 && !x.is_finite() {
                    let message = format!("must be finite where the weight is not 0, got {x}");
                    return Err(Error::value("patch", message));
                }
                self.patch.push(if w > 0.0 { x } else { 0.0 });
                self.weight.push(w);
            }
        }
        // Find the range of non-zero weights of each row.
        let lines = query.weight.chunks_exact(columns);
        self.weighed.clear();
        self.weighed.extend(lines.map(|line| {
            let first = line.iter().position(|&w| w > 0.0).unwrap_or(columns);
            let last = line.iter().rposition(|&w| w > 0.0).map_or(first, |c| c + 1);
            let end = (last * channels).next_multiple_of(LANES);
            [
                first * channels / LANES * LANES,
                end.min(columns * channels),
            ]
        }));
        Ok(())
    }

    /// Computes the kernels of the filter, for exemplars of this mean and scale.
    pub(super) fn normalise(&mut self, mean: &[f64], scale: f64) {
        let distance = |i: usize, x: f32| f64::from(x) - mean[i % self.channels];
        let positive = |x: f64| if x > 0.0 { x } else { 1.0 };
        self.scale = scale;
        self.largest_weight = positive(self.weight.iter().copied().fold(0.0, f32::max).into());
        let weighed = || self.patch.iter().zip(&self.weight).enumerate();
        self.largest = positive(
            weighed()
                .filter(|(_, (_, w))| **w > 0.0)
                .map(|(i, (&x, _))| distance(i, x).abs())
                .fold(0.0, f64::max),
        );
        // Centre the patch and normalise it by its largest difference.
        self.centred.clear();
        self.offset = 0.0;
        for (i, (&x, &w)) in self.patch.iter().zip(&self.weight).enumerate() {
            let d = distance(i, x);
            self.offset += f64::from(w) * d * d;
            self.centred.push(if w > 0.0 {
                (d / self.largest) as f32
            } else {
                0.0
            });
        }
        // Compute the sum and the norm of the kernel of each layer.
        self.row.resize(self.shape[1], 0.0);
        let mut row = std::mem::take(&mut self.row);
        self.kernels.clear();
        for layer in 0..=self.channels {
            let (mut sum, mut squares) = (0.0, 0.0);
            for r in 0..self.shape[0] {
                self.kernel_row(layer, r, &mut row);
                sum += row.iter().map(|&x| f64::from(x)).sum::<f64>();
                squares += row.iter().map(|&x| f64::from(x).powi(2)).sum::<f64>();
            }
            let norm = squares.sqrt();
            self.kernels.push(Kernel { sum, norm });
        }
        self.row = row;
    }

    /// Returns the factors (patch, weights) that scale the patch and the weights in the filter, so
    /// that neither overflows.
    fn factors(&self) -> (f64, f64) {
        let ratio = self.largest / self.scale;
        let most = ratio.max(1.0);
        (ratio / most, 1.0 / most)
    }

    /// Writes row `r` of the kernel that is correlated with a layer: `-2 w T` for a channel, and
    /// the weights for the last layer.
    pub(super) fn kernel_row(&self, layer: usize, r: usize, out: &mut [f32]) {
        let (patch, weights) = self.factors();
        let width = self.shape[1] * self.channels;
        let samples = self.centred[r * width..][..width].chunks_exact(self.channels);
        let weight = self.weight[r * width..][..width].chunks_exact(self.channels);
        for (out, (x, w)) in out.iter_mut().zip(samples.zip(weight)) {
            let w = f64::from(w[0]) / self.largest_weight;
            *out = if layer < self.channels {
                -2.0 * patch * w * f64::from(x[layer])
            } else {
                weights * w
            } as f32;
        }
    }

    /// Returns the sum and the norm of the kernel of a layer.
    pub(super) fn kernel(&self, layer: usize) -> Kernel {
        self.kernels[layer]
    }

    /// Returns the sum of the weights.
    pub(super) fn total_weight(&self) -> f64 {
        self.weight
            .iter()
            .step_by(self.channels)
            .map(|&w| f64::from(w))
            .sum()
    }

    /// Returns the cost that corresponds to one unit of the filter, and the constant cost `sum w T^2` that the filter
    /// omits.
    pub(super) fn unit(&self) -> (f64, f64) {
        let most = (self.largest / self.scale).max(1.0);
        (
            self.largest_weight * self.scale * self.scale * most,
            self.offset,
        )
    }

    /// Returns an upper bound of the cost of all positions.
    pub(super) fn largest_cost(&self, scale: f64) -> f64 {
        let total = self.total_weight() * self.channels as f64;
        (total * (scale + self.largest).powi(2)).max(f64::MIN_POSITIVE)
    }

    /// Returns the cost of a position.
    pub(super) fn cost(&self, data: &[f32], shape: [usize; 2], at: [usize; 2]) -> f64 {
        self.cost_within(data, shape, at, f64::INFINITY)
    }

    /// Returns the cost of a position, or infinity as soon as it is known to exceed `bound`.
    ///
    /// All implementations must sum in the same lanes and order, without fused operations, so that
    /// their results are equal.
    pub(super) fn cost_within(
        &self,
        data: &[f32],
        shape: [usize; 2],
        at: [usize; 2],
        bound: f64,
    ) -> f64 {
        #[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
        if let Some(simd) = V3::try_new() {
            // Score all rows in one SIMD call, because rows of a sparsely known patch are too short
            // for a call each.
            return simd.vectorize(
                #[inline(always)]
                || {
                    self.cost_by(
                        data,
                        shape,
                        at,
                        bound,
                        #[inline(always)]
                        |lanes, patch, weight, samples| add_v3(simd, lanes, patch, weight, samples),
                    )
                },
            );
        }
        self.cost_by(data, shape, at, bound, add)
    }

    #[inline(always)]
    fn cost_by(
        &self,
        data: &[f32],
        shape: [usize; 2],
        at: [usize; 2],
        bound: f64,
        add: impl Fn(&mut [f64; LANES], &[f32], &[f32], &[f32]),
    ) -> f64 {
        let width = self.shape[1] * self.channels;
        let mut lanes = [0.0f64; LANES];
        let rows = self.patch.chunks_exact(width);
        let rows = rows.zip(self.weight.chunks_exact(width)).enumerate();
        for (r, (patch, weight)) in rows {
            // Samples outside this range have weight 0.
            let [first, end] = self.weighed[r];
            if first >= end {
                continue;
            }
            let start = ((at[0] + r) * shape[1] + at[1]) * self.channels;
            let samples = &data[start..][first..end];
            let (patch, weight) = (&patch[first..end], &weight[first..end]);
            add(&mut lanes, patch, weight, samples);
            // Sums only rise, even with rounding, so a partial sum above the bound is final.
            if r % LOOK == LOOK - 1 && total(&lanes) > bound {
                return f64::INFINITY;
            }
        }
        let cost = total(&lanes);
        if cost > bound { f64::INFINITY } else { cost }
    }
}

/// Adds the weighted squared differences of a row to the lanes.
#[inline(always)]
fn add(lanes: &mut [f64; LANES], patch: &[f32], weight: &[f32], samples: &[f32]) {
    let (p, p_rest) = patch.as_chunks::<LANES>();
    let (w, w_rest) = weight.as_chunks::<LANES>();
    let (s, s_rest) = samples.as_chunks::<LANES>();
    for ((p, w), s) in p.iter().zip(w).zip(s) {
        for l in 0..LANES {
            let d = f64::from(p[l]) - f64::from(s[l]);
            lanes[l] += f64::from(w[l]) * (d * d);
        }
    }
    for (l, ((&p, &w), &s)) in p_rest.iter().zip(w_rest).zip(s_rest).enumerate() {
        let d = f64::from(p) - f64::from(s);
        lanes[l] += f64::from(w) * (d * d);
    }
}

/// [`add`] in SIMD registers, with the same operations in the same order. It is 2x as fast as compiled plain code
/// (measured).
#[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
#[inline(always)]
fn add_v3(simd: V3, lanes: &mut [f64; LANES], patch: &[f32], weight: &[f32], samples: &[f32]) {
    let V3 { avx, .. } = simd;
    let (p, p_rest) = patch.as_chunks::<LANES>();
    let (w, w_rest) = weight.as_chunks::<LANES>();
    let (s, s_rest) = samples.as_chunks::<LANES>();
    let mut sums: [__m256d; 2] = cast(*lanes);
    // Avoid closures, because a closure that is not inlined would turn single instructions into calls.
    for ((p, w), s) in p.iter().zip(w).zip(s) {
        let p: [__m128; 2] = cast(*p);
        let w: [__m128; 2] = cast(*w);
        let s: [__m128; 2] = cast(*s);
        for h in 0..2 {
            let d = avx._mm256_sub_pd(avx._mm256_cvtps_pd(p[h]), avx._mm256_cvtps_pd(s[h]));
            let weighted = avx._mm256_mul_pd(avx._mm256_cvtps_pd(w[h]), avx._mm256_mul_pd(d, d));
            sums[h] = avx._mm256_add_pd(sums[h], weighted);
        }
    }
    *lanes = cast(sums);
    add(lanes, p_rest, w_rest, s_rest);
}

/// Returns the sum of the lanes, in a fixed order.
#[inline(always)]
fn total(lanes: &[f64; LANES]) -> f64 {
    let half: [f64; 4] = std::array::from_fn(|l| lanes[l] + lanes[l + 4]);
    (half[0] + half[2]) + (half[1] + half[3])
}
