//! What a seam costs: the match of two images at the two ends of an edge, and its scaling to integer capacities.
//!
//! Kwatra, Schödl, Essa, Turk, Bobick, *Graphcut textures: image and video synthesis using graph cuts*, SIGGRAPH 2003.

use crate::foundation::functions::power_below;
use crate::{Error, Result};

/// How visible a seam between two neighbours is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cost {
    /// `|A(s) - B(s)| + |A(t) - B(t)|`, summed over channels (Kwatra et al., eq. 1).
    Difference,
    /// The same divided by `|A(s) - A(t)| + |B(s) - B(t)| + 0.05` (Kwatra et al., eq. 2): seams hide along edges of the
    /// images. The constant is for values of about unit range; it keeps flat regions from costing infinitely much.
    Gradient,
}

/// Added to every edge, so that ties go to the shorter seam.
pub const SHORTEST: f32 = 1e-4;
/// Keeps the gradient cost finite where both images are flat.
const FLAT: f32 = 0.05;

/// How far two pixels may be apart: both ends of an edge together stay finite, and so does a gradient cost. Infinitely much by
/// infinitely steep is no number, and no comparison tells that it is none.
pub(super) const FARTHEST: f32 = f32::MAX / 2.0;

/// Values whose sums and quotients pass what a float can be, among ordinary ones.
#[cfg(test)]
pub(super) const EXTREMES: [f32; 8] = [0.0, 0.5, 1.0, 1e30, 1.6e38, -1.6e38, f32::MAX, -f32::MAX];

/// Capacities are costs times a power of two, at most this one.
const FINEST: f64 = 65536.0;
/// No single cost becomes a larger capacity: the sums that a solver makes of a node's edges stay within `i32`.
const LARGEST: f64 = (1u32 << 26) as f64;

/// L1 distance of two pixels.
#[inline(always)]
pub(super) fn distance(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).fold(0.0, |sum, (x, y)| sum + (x - y).abs())
}

/// Two images on one canvas. `C` is the number of channels where that is known, so that loops over them unroll, or 0.
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

    /// How far the images are apart at a pixel.
    #[inline(always)]
    pub(super) fn difference(&self, p: usize) -> f32 {
        let (at, n) = (p * self.channels(), self.channels());
        distance(&self.a[at..][..n], &self.b[at..][..n])
    }

    /// The cost of a seam between neighbours `s` and `t`, given the differences there.
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

    /// [`Self::difference`] of all pixels.
    pub(super) fn differences(&self) -> Vec<f32> {
        let n = self.channels();
        let pairs = self.a.chunks_exact(n).zip(self.b.chunks_exact(n));
        pairs.map(|(a, b)| distance(a, b)).collect()
    }

    /// [`Self::edge`] of the pixels from `s` on and those from `t` on, in plain loops that become wide instructions.
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

/// The power of two by which costs are multiplied: 2^16, or less where the largest cost would pass 2^26.
pub(super) fn scale(largest: f64) -> f64 {
    let mut scale = FINEST;
    while largest * scale > LARGEST {
        scale *= 0.5;
    }
    scale
}

/// The power of two by which the largest cost becomes more than 2^25 and at most 2^26.
pub(super) fn finest(largest: f64) -> f64 {
    if largest <= 0.0 {
        return 1.0;
    }
    // 1e-300 is far below any `f32`; powers of two stay finite.
    let mut scale = power_below(LARGEST / largest.max(1e-300));
    while largest * scale > LARGEST {
        scale *= 0.5;
    }
    scale
}

/// A cost as a capacity, rounded to the nearest.
#[inline(always)]
pub(super) fn capacity(cost: f64, scale: f64) -> i32 {
    (cost * scale + 0.5) as i32
}

/// Costs looked at side by side.
const LANES: usize = 16;

/// The largest entry, 0 of none; refuses negative and non-finite ones.
pub(super) fn check_costs(argument: &'static str, costs: &[f32]) -> Result<f32> {
    // One comparison that NaN fails too; several entries at a time, within which nothing has to be decided.
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
            format!(
                "{} at {at}; finite values of at least 0 are allowed",
                costs[at]
            ),
        ));
    }
    Ok(rest.iter().chain(&largest).copied().fold(0.0, f32::max))
}
