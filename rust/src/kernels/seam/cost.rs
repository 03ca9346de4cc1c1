//! Cost of a seam: the difference of two images at the two ends of an edge, and its scaling to
//! integer capacities.
//!
//! Kwatra, Schödl, Essa, Turk, Bobick, *Graphcut textures: image and video synthesis using graph
//! cuts*, SIGGRAPH 2003.

use crate::foundation::libm::power_below;
use crate::{Error, Result};

/// Visibility of a seam between two neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cost {
    /// `|A(s) - B(s)| + |A(t) - B(t)|`, summed over channels (Kwatra et al., eq. 1).
    Difference,
    /// The same divided by `|A(s) - A(t)| + |B(s) - B(t)| + 0.05` (Kwatra et al., eq. 2), so that
    /// seams follow edges of the images. The constant suits values from 0 to 1 and keeps the cost
    /// finite in flat regions.
    Gradient,
}

/// Cost added to every edge, so that ties go to the shorter seam.
pub const SHORTEST: f32 = 1e-4;
/// Constant that keeps the gradient cost finite where both images are flat.
const FLAT: f32 = 0.05;

/// Maximum distance of two pixels. The sum of both ends of an edge and the gradient cost then stay
/// finite. An infinite distance divided by an infinite slope would be NaN, which comparisons do not
/// detect.
pub(super) const FARTHEST: f32 = f32::MAX / 2.0;

/// Test values: ordinary values, and values whose sums and quotients overflow.
#[cfg(test)]
pub(super) const EXTREMES: [f32; 8] = [0.0, 0.5, 1.0, 1e30, 1.6e38, -1.6e38, f32::MAX, -f32::MAX];

/// Maximum scale. Capacities are costs times a power of two.
const FINEST: f64 = 65536.0;
/// Maximum capacity of a single cost, so that sums over the edges of a node fit `i32`.
const LARGEST: f64 = (1u32 << 26) as f64;

/// Returns the L1 distance of two pixels.
#[inline(always)]
pub(super) fn distance(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).fold(0.0, |sum, (x, y)| sum + (x - y).abs())
}

/// Two images on one canvas. `C` is the number of channels if this is 1 or 3, so that loops unroll. For other numbers
/// `C` is 0.
#[derive(Clone, Copy)]
pub(super) struct Pair<'a, const C: usize> {
    pub a: &'a [f32],
    pub b: &'a [f32],
    pub channels: usize,
}

impl<'a, const C: usize> Pair<'a, C> {
    #[inline(always)]
    fn channels(&self) -> usize {
        if C == 0 { self.channels } else { C }
    }

    /// Returns the distance of the two images at a pixel.
    #[inline(always)]
    pub(super) fn difference(&self, p: usize) -> f32 {
        let (at, n) = (p * self.channels(), self.channels());
        distance(&self.a[at..][..n], &self.b[at..][..n])
    }

    /// Returns the cost of a seam between neighbours `s` and `t`. `differences` is the sum of the distances at both
    /// pixels.
    #[inline(always)]
    pub(super) fn edge(&self, cost: Cost, s: usize, t: usize, differences: f32) -> f32 {
        let plain = match cost {
            Cost::Difference => differences,
            Cost::Gradient => {
                let n = self.channels();
                let (i, j) = (s * n, t * n);
                let slope = distance(&self.a[i..][..n], &self.a[j..][..n])
                    + distance(&self.b[i..][..n], &self.b[j..][..n]);
                differences / (slope + FLAT)
            }
        };
        plain + SHORTEST
    }

    /// Returns [`Self::difference`] of all pixels.
    pub(super) fn differences(&self) -> Vec<f32> {
        let n = self.channels();
        let pairs = self.a.chunks_exact(n).zip(self.b.chunks_exact(n));
        pairs.map(|(a, b)| distance(a, b)).collect()
    }

    /// Computes [`Self::edge`] for runs of pixels that start at `s` and at `t`, in simple loops
    /// that vectorise.
    pub(super) fn edges(
        &self,
        cost: Cost,
        s: usize,
        t: usize,
        differences: &[f32],
        out: &mut [f32],
    ) {
        let (n, len) = (self.channels(), out.len());
        let both = differences[s..][..len].iter().zip(&differences[t..][..len]);
        for (out, (s, t)) in out.iter_mut().zip(both) {
            *out = s + t;
        }
        if cost == Cost::Gradient {
            let pixels = |x: &'a [f32], p: usize| x[p * n..][..len * n].chunks_exact(n.max(1));
            let a = pixels(self.a, s).zip(pixels(self.a, t));
            let b = pixels(self.b, s).zip(pixels(self.b, t));
            for (out, ((a_s, a_t), (b_s, b_t))) in out.iter_mut().zip(a.zip(b)) {
                *out /= distance(a_s, a_t) + distance(b_s, b_t) + FLAT;
            }
        }
        for out in out {
            *out += SHORTEST;
        }
    }
}

/// Returns the power of two that costs are multiplied by: 2^16, or less if the largest cost would
/// exceed 2^26.
pub(super) fn scale(largest: f64) -> f64 {
    let mut scale = FINEST;
    while largest * scale > LARGEST {
        scale *= 0.5;
    }
    scale
}

/// Returns the power of two that scales the largest cost to more than 2^25 and at most 2^26.
pub(super) fn finest(largest: f64) -> f64 {
    if largest <= 0.0 {
        return 1.0;
    }
    // The bound 1e-300 is far below any `f32` and keeps powers of two finite.
    let mut scale = power_below(LARGEST / largest.max(1e-300));
    while largest * scale > LARGEST {
        scale *= 0.5;
    }
    scale
}

/// Returns a cost as a capacity, rounded to the nearest integer.
#[inline(always)]
pub(super) fn capacity(cost: f64, scale: f64) -> i32 {
    (cost * scale + 0.5) as i32
}

/// Number of costs that are checked together.
const LANES: usize = 16;

/// Returns the largest cost, or 0 for an empty array.
///
/// # Errors
/// A cost is negative or not finite.
pub(super) fn check_costs(argument: &'static str, costs: &[f32]) -> Result<f32> {
    // NaN fails this comparison too. Entries are checked in blocks without branches, so that the loop vectorises.
    let sound = |c: f32| (0.0..f32::INFINITY).contains(&c);
    let (mut largest, mut bad) = ([0.0f32; LANES], [0u32; LANES]);
    let (blocks, rest) = costs.as_chunks::<LANES>();
    for block in blocks {
        for l in 0..LANES {
            bad[l] |= u32::from(!sound(block[l]));
            largest[l] = if block[l] > largest[l] {
                block[l]
            } else {
                largest[l]
            };
        }
    }
    if bad.contains(&1) || !rest.iter().all(|&c| sound(c)) {
        let at = costs.iter().position(|&c| !sound(c)).unwrap_or(0);
        return Err(Error::value(
            argument,
            format!("must be finite and at least 0, got {} at {at}", costs[at]),
        ));
    }
    Ok(rest.iter().chain(&largest).copied().fold(0.0, f32::max))
}
