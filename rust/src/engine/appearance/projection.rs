//! The projection from the colours of a window to an appearance vector, in integers.

use super::{FLAT, Feature, KEEP, LANES, SCALE, TOP};
use crate::foundation::pca::Principal;
use crate::foundation::simd::wide_fn;

/// Maps the colours of a window to its appearance vector.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Projection {
    /// Number of values in a window, where the channels of a point are adjacent. `padded` is the length of a row of
    /// the basis, rounded up to whole registers.
    pub(super) length: usize,
    pub(super) padded: usize,
    pub(super) basis: Vec<i16>,
    pub(super) bias: [i64; KEEP],
    /// Factor that turns products with the basis into components of a vector, in units of 2^-32.
    pub(super) gain: i64,
}

impl Projection {
    pub(super) fn empty() -> Self {
        Self {
            length: 0,
            padded: 0,
            basis: Vec::new(),
            bias: [0; KEEP],
            gain: 0,
        }
    }

    pub(super) fn new(components: &Principal, weights: &[f32], channels: usize) -> Self {
        let length = weights.len() * channels;
        let padded = length.next_multiple_of(LANES);
        // Multiply the weights of a window into the basis, so that a projection needs no extra products.
        let weighted: Vec<Vec<f64>> = components
            .axes
            .iter()
            .map(|axis| {
                axis.iter()
                    .enumerate()
                    .map(|(i, &x)| f64::from(x) * f64::from(weights[i / channels]))
                    .collect()
            })
            .collect();
        let sums = weighted.iter().map(|w| w.iter().map(|x| x.abs()).sum());
        let longest: f64 = sums.fold(0.0, f64::max);
        let largest = weighted
            .iter()
            .flatten()
            .fold(0.0f64, |m, x| m.max(x.abs()));
        // The vectors of a uniform exemplar are zero.
        if longest == 0.0 || components.variance <= FLAT {
            return Self {
                length,
                padded,
                basis: vec![0; padded * KEEP],
                ..Self::empty()
            };
        }
        // Use the largest scale that keeps values within 16 bits and sums of products within 31 bits.
        let fine = (f64::from(1 << 30) / (f64::from(TOP) * longest)).min(32767.0 / largest);
        let mut basis = vec![0; padded * KEEP];
        let mut bias = [0; KEEP];
        for (k, row) in weighted.iter().enumerate() {
            for (to, x) in basis[k * padded..].iter_mut().zip(row) {
                *to = (x * fine).round() as i16;
            }
            // Subtract the projected mean, so that vectors are centred.
            let along: f64 = components.axes[k]
                .iter()
                .zip(&components.mean)
                .map(|(&a, &m)| f64::from(a) * f64::from(m))
                .sum();
            bias[k] = (along * fine).round() as i64;
        }
        let gain = f64::from(SCALE) / (components.variance.sqrt() * fine);
        Self {
            length,
            padded,
            basis,
            bias,
            gain: (gain * (1i64 << 32) as f64).round() as i64,
        }
    }

    /// Returns the appearance vector of a window that is padded to whole registers.
    #[inline]
    pub(super) fn apply(&self, window: &[i16]) -> Feature {
        multiply(self, window)
    }
}

wide_fn! {
    /// Multiplies a window by the basis. Integer sums do not depend on the order, so the compiler may vectorise them.
    /// AVX2 is 2x faster here than the baseline instructions (measured).
    fn multiply(projection: &Projection, window: &[i16]) -> Feature {
        let mut feature = [0; KEEP];
        for (k, row) in projection.basis.chunks_exact(projection.padded).enumerate() {
            let mut sum = 0i32;
            for (&w, &x) in row.iter().zip(window) {
                sum += i32::from(w) * i32::from(x);
            }
            // The product cannot overflow if the analysis was computed here. With restored arrays, it may wrap.
            let product = (i64::from(sum) - projection.bias[k]).wrapping_mul(projection.gain);
            let scaled = product.wrapping_add(1 << 31) >> 32;
            feature[k] = scaled.clamp(-2047, 2047) as i16;
        }
        feature
    }
}
