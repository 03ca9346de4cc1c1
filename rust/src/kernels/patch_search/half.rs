//! Good matches by a search at half the resolution. Each halving leaves a quarter of the positions, and a quarter of
//! the samples of a patch.
//!
//! The search at half the resolution proposes positions, and the positions around them are scored exactly. The best
//! match at full resolution is nearly always among them. A good match is enough if the patch is also chosen by other
//! criteria.

use std::ops::RangeInclusive;

use super::checks::check_pick;
use super::{Exemplar, Index, Match, Pick, Query, once};
use crate::Result;
use crate::foundation::par::{self, Monitor};

/// Minimum side of a patch at half the resolution. Smaller patches are not distinctive enough.
const LEAST: usize = 8;
/// Number of proposals for each requested match.
const PROPOSALS: usize = 2;

impl Index {
    /// Returns good matches by rising (cost, exemplar, row, column), with exact costs. This is much
    /// faster than [`Self::best`], but the result need not contain the best match.
    pub fn good(&self, query: &Query<'_>, pick: &Pick, monitor: &Monitor) -> Result<Vec<Match>> {
        check_pick(pick)?;
        let fits = |e: &Exemplar| (0..2).all(|axis| query.shape[axis] <= e.shape[axis]);
        // An invalid query is passed to the full search, which reports the error. The order of the tests matters,
        // because the product is computed only for sides that fit.
        let sound = query.shape.iter().all(|&n| n >= 2 * LEAST)
            && self.exemplars.iter().any(fits)
            && query.weight.len() == query.shape[0] * query.shape[1]
            && query.patch.len() == query.weight.len() * self.channels;
        let Some(half) = sound.then(|| self.half()).flatten() else {
            return self.best(query, pick, monitor);
        };
        let (patch, weight) = halve_query(query, self.channels);
        let smaller = Query {
            patch: &patch,
            weight: &weight,
            shape: query.shape.map(|n| n / 2),
        };
        let proposals = Pick {
            count: pick.count.saturating_mul(PROPOSALS),
            separation: (pick.separation / 2).max(1),
            ratio: f64::INFINITY,
        };
        // Proposals are more than a pixel apart, so no position occurs twice. The most promising
        // positions come first, because their costs bound the others.
        let mut places = Vec::new();
        for m in half.good(&smaller, &proposals, monitor)? {
            let of = &self.exemplars[m.exemplar];
            let allows = |row: usize, column: usize| {
                row + query.shape[0] <= of.shape[0]
                    && column + query.shape[1] <= of.shape[1]
                    && (of.allowed.as_ref()).is_none_or(|a| a[row * of.shape[1] + column])
            };
            for row in stands_for(of, 0, m.row) {
                for column in stands_for(of, 1, m.column) {
                    if allows(row, column) {
                        places.push([m.exemplar, row, column]);
                    }
                }
            }
        }
        if places.is_empty() {
            return self.best(query, pick, monitor);
        }
        self.best_among(query, &places, pick)
    }

    fn half(&self) -> Option<&Index> {
        once(&self.half, || {
            let enough = |n: &usize| *n >= 2 * LEAST;
            let large = |e: &Exemplar| e.shape.iter().all(enough);
            if !self.max_patch.iter().all(enough) || !self.exemplars.iter().all(large) {
                return None;
            }
            let halves = self.known.halves(&self.exemplars, self.channels);
            let exemplars = par::map(self.exemplars.len(), |i| Exemplar {
                data: halves.data[i].clone(),
                shape: self.exemplars[i].shape.map(|n| n / 2),
                allowed: halve_allowed(&self.exemplars[i]),
            });
            let known = halves.known.clone();
            let max_patch = self.max_patch.map(|n| n / 2);
            let smaller = Self::with(exemplars, self.channels, max_patch, known);
            smaller.ok().map(Box::new)
        })
        .as_deref()
    }
}

/// Returns the positions along an axis that correspond to a position at half the resolution.
fn stands_for(whole: &Exemplar, axis: usize, at: usize) -> RangeInclusive<usize> {
    (2 * at).saturating_sub(1)..=(2 * at + 1).min(whole.shape[axis] - 1)
}

/// Returns the samples of an exemplar at half the resolution.
pub(super) fn halve(whole: &Exemplar, channels: usize) -> Vec<f32> {
    let [rows, columns] = whole.shape.map(|n| n / 2);
    let width = whole.shape[1] * channels;
    let mut data = vec![0.0; rows * columns * channels];
    let lines = data.chunks_exact_mut(columns * channels);
    for (out, two) in lines.zip(whole.data.chunks_exact(2 * width)) {
        let (up, down) = two.split_at(width);
        match channels {
            1 => halve_line::<1>(up, down, 1, out),
            3 => halve_line::<3>(up, down, 3, out),
            _ => halve_line::<0>(up, down, channels, out),
        }
    }
    data
}

/// Returns a flag for each position at half the resolution: whether it corresponds to at least one allowed position.
fn halve_allowed(whole: &Exemplar) -> Option<Vec<bool>> {
    let [rows, columns] = whole.shape.map(|n| n / 2);
    whole.allowed.as_ref().map(|allowed| {
        let mut any = Vec::with_capacity(rows * columns);
        let mut line = vec![false; whole.shape[1]];
        for r in 0..rows {
            line.fill(false);
            for row in stands_for(whole, 0, r) {
                let of = &allowed[row * whole.shape[1]..];
                line.iter_mut().zip(of).for_each(|(any, &one)| *any |= one);
            }
            let mut before = false;
            any.extend(line.chunks_exact(2).map(|two| {
                let last = std::mem::replace(&mut before, two[1]);
                last | two[0] | two[1]
            }));
        }
        any
    })
}

/// Computes the means of 2 x 2 samples of two lines. `C` is the number of channels if this is 1 or 3, so that the loop
/// unrolls. For other numbers `C` is 0.
fn halve_line<const C: usize>(up: &[f32], down: &[f32], channels: usize, out: &mut [f32]) {
    let n = if C == 0 { channels } else { C };
    let places = up.chunks_exact(2 * n).zip(down.chunks_exact(2 * n));
    for (out, (up, down)) in out.chunks_exact_mut(n).zip(places) {
        for k in 0..n {
            // Multiply each sample first, because the sum of four finite numbers may overflow.
            out[k] = 0.25 * up[k] + 0.25 * up[k + n] + (0.25 * down[k] + 0.25 * down[k + n]);
        }
    }
}

/// Returns a query at half the resolution. Its samples are the weighted means of the known samples.
fn halve_query(query: &Query<'_>, channels: usize) -> (Vec<f32>, Vec<f32>) {
    let [rows, columns] = query.shape.map(|n| n / 2);
    let mut patch = vec![0.0f32; rows * columns * channels];
    let mut weight = vec![0.0f32; rows * columns];
    for (i, out) in weight.iter_mut().enumerate() {
        let (r, c) = (2 * (i / columns), 2 * (i % columns));
        let places =
            [(r, c), (r, c + 1), (r + 1, c), (r + 1, c + 1)].map(|(r, c)| r * query.shape[1] + c);
        let total: f64 = places.iter().map(|&p| f64::from(query.weight[p])).sum();
        *out = (0.25 * total) as f32;
        for k in 0..channels {
            let mut sum = 0.0f64;
            for p in places {
                if query.weight[p] > 0.0 {
                    sum += f64::from(query.weight[p]) * f64::from(query.patch[p * channels + k]);
                }
            }
            patch[i * channels + k] = if total > 0.0 {
                (sum / total) as f32
            } else {
                0.0
            };
        }
    }
    (patch, weight)
}
