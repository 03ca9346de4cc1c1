//! What is seen where two points meet, for rows of pairs at once.
//!
//! The only place that says what a seam costs. Rows are judged term by term: each term is one pass over buffers that stay in
//! the first cache, in wide registers.

use super::source::{CHANNELS, Source};
use super::view::Row;
use super::weights::Weights;
use crate::foundation::wide::wide_fn;

/// Added to every pair, so that ties go to the shorter seam.
const SHORTEST: f32 = 2e-3;
/// Costs of one pair are at most this, so that sums stay within 32 bits.
pub(super) const MOST: f32 = 1000.0;
/// As deep as counts.
const DEEP: f32 = 6.0;

/// What pairs are judged with.
pub(super) struct Judge<'a, const D: usize> {
    pub source: &'a Source<D>,
    pub weights: Weights,
}

impl<const D: usize> Judge<'_, D> {
    /// Costs of pairs: what each point of a row is beside, and how far the pictures are apart at both, squared.
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

/// How far the colours of rows are apart.
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
            // Whatever their colours: two of one colour that meet are one thing of a shape that the exemplar has not.
            cost += contact * (inside.0 * inside.1);
            cost += joint * (l_beside[k] * inside.1).max(inside.0 * r_beside[k]);
            cost += depth * (dl.min(DEEP) + dr.min(DEEP)) / DEEP;
            cost += jump * ((dl - dr).abs() - 1.0).clamp(0.0, 4.0) / 2.0;
            out[k] = cost;
        }
    }
}

/// What a pair costs by what it shows, as capacities: the first keeps what it has and the next one takes the patch, the
/// other way round, and both keep.
#[derive(Debug, Default)]
pub(super) struct Capacities {
    pub old_new: Vec<i32>,
    pub new_old: Vec<i32>,
    pub kept: Vec<i32>,
}

impl Capacities {
    /// From costs.
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
    /// Where the patch shows what is there already there is no seam: what is beside it goes on, or stays as it was.
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

/// Capacities are costs times this.
const SCALE: f32 = 16384.0;

/// A cost as a capacity, rounded to the nearest.
#[inline(always)]
pub(super) fn capacity(cost: f32) -> i32 {
    let scaled = cost.clamp(-MOST, MOST) * SCALE;
    (scaled + 0.5f32.copysign(scaled)) as i32
}
