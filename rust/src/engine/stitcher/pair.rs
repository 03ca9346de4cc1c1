//! Costs of pairs of neighbouring points, for rows of pairs at once.
//!
//! All seam costs are defined here. The costs of a row are computed term by term. Each term is one vectorised pass
//! over buffers that stay in the first-level cache.

use super::source::{CHANNELS, Source};
use super::view::Row;
use super::weights::Weights;
use crate::foundation::simd::wide_fn;

/// Cost that is added to every pair, so that the shorter of two equal seams is chosen.
const SHORTEST: f32 = 2e-3;
/// Maximum cost of one pair, so that sums stay within 32 bits.
pub(super) const MOST: f32 = 1000.0;
/// Maximum depth that counts, in samples.
const DEEP: f32 = 6.0;

/// Source and weights with which pairs are judged.
pub(super) struct Judge<'a, const D: usize> {
    pub source: &'a Source<D>,
    pub weights: Weights,
}

impl<const D: usize> Judge<'_, D> {
    /// Computes the costs of pairs from the appearance of their points and from the squared differences of colours at
    /// both points.
    #[inline]
    pub(super) fn pairs(&self, l: Row<'_>, r: Row<'_>, apart: [&[f32]; 2], out: &mut [f32]) {
        let w = &self.weights;
        add_colours(w.colour, apart[0], apart[1], out);
        if w.surprise > 0.0 {
            for ((out, &a), &b) in out.iter_mut().zip(l.class).zip(r.class) {
                *out += w.surprise * self.source.surprise(a, b);
            }
        }
        if self.source.has_elements() {
            let weights = [w.contact, w.joint, w.depth, w.jump];
            add_elements(weights, l.depth, r.depth, l.beside, r.beside, out);
        }
        out.iter_mut().for_each(|cost| *cost = cost.min(MOST));
    }
}

/// Computes the differences of the colours of two rows.
pub(super) fn distances(l: Row<'_>, r: Row<'_>, out: &mut [f32]) {
    out.fill(0.0);
    for c in 0..CHANNELS {
        add_distances(l.colour[c], r.colour[c], out);
    }
}

wide_fn! {
    fn add_distances(l: &[f32], r: &[f32], out: &mut [f32]) {
        for ((out, l), r) in out.iter_mut().zip(l).zip(r) {
            *out += (l - r).abs();
        }
    }
}

wide_fn! {
    fn add_colours(weight: f32, l: &[f32], r: &[f32], out: &mut [f32]) {
        for ((out, l), r) in out.iter_mut().zip(l).zip(r) {
            *out = SHORTEST + weight * (l + r) / 8.0;
        }
    }
}

wide_fn! {
    fn add_elements(
        weights: [f32; 4],
        l_depth: &[f32],
        r_depth: &[f32],
        l_beside: &[f32],
        r_beside: &[f32],
        out: &mut [f32],
    ) {
        let [contact, joint, depth, jump] = weights;
        let n = out.len();
        let (l_depth, r_depth) = (&l_depth[..n], &r_depth[..n]);
        let (l_beside, r_beside) = (&l_beside[..n], &r_beside[..n]);
        for k in 0..n {
            let (dl, dr) = (l_depth[k], r_depth[k]);
            let inside = (if dl > 0.0 { 1.0f32 } else { 0.0 }, if dr > 0.0 { 1.0f32 } else { 0.0 });
            let mut cost = out[k];
            // The colours are not compared here: two touching elements of one colour merge into a shape that the
            // exemplar does not contain.
            cost += contact * (inside.0 * inside.1);
            cost += joint * (l_beside[k] * inside.1).max(inside.0 * r_beside[k]);
            cost += depth * (dl.min(DEEP) + dr.min(DEEP)) / DEEP;
            cost += jump * ((dl - dr).abs() - 1.0).clamp(0.0, 4.0) / 2.0;
            out[k] = cost;
        }
    }
}

/// Costs of pairs as capacities: only the second point takes the patch, only the first point takes it, or both are
/// kept.
#[derive(Debug, Default)]
pub(super) struct Capacities {
    pub old_new: Vec<i32>,
    pub new_old: Vec<i32>,
    pub kept: Vec<i32>,
}

impl Capacities {
    /// Computes capacities from costs.
    pub(super) fn set(&mut self, old_new: &[f32], new_old: &[f32], kept: &[f32]) {
        for plane in [&mut self.old_new, &mut self.new_old, &mut self.kept] {
            plane.resize(kept.len(), 0);
        }
        capacities(old_new, &mut self.old_new);
        capacities(new_old, &mut self.new_old);
        capacities(kept, &mut self.kept);
    }
}

wide_fn! {
    /// Replaces the costs of pairs where the patch shows the current sample. Such a point does not get a new seam,
    /// and the old seam next to it stays.
    pub(super) fn go_on(same: &[f32], next_same: &[f32], kept: &[f32], out: &mut [f32]) {
        let n = out.len();
        let (same, next_same, kept) = (&same[..n], &next_same[..n], &kept[..n]);
        for k in 0..n {
            let cost = if next_same[k] > 0.0 { kept[k] } else { out[k] };
            out[k] = if same[k] > 0.0 { 0.0 } else { cost };
        }
    }
}

wide_fn! {
    fn capacities(costs: &[f32], out: &mut [i32]) {
        for (out, &cost) in out.iter_mut().zip(costs) {
            *out = capacity(cost);
        }
    }
}

/// Factor from costs to capacities.
const SCALE: f32 = 16384.0;

/// Returns a cost as a capacity, rounded to the nearest integer.
#[inline(always)]
pub(super) fn capacity(cost: f32) -> i32 {
    let scaled = cost.clamp(-MOST, MOST) * SCALE;
    (scaled + 0.5f32.copysign(scaled)) as i32
}
