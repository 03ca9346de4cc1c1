//! The penalties of matches, which are added to the costs of their misfit.

use super::{CELL, Quilt, Window};
use crate::foundation::lattice::out_of_step;
use crate::kernels::patch_search::Match;

/// Repetition penalty of a patch whose content all other patches also show, in units of the cost of a good match. Few
/// places fit if elements are on a plain background. A larger penalty would then select patches that cut elements.
const REPETITION: f64 = 10.0;
/// Fraction of the matches that count as good.
const GOOD: f64 = 0.1;
/// Repetition penalty on a lattice, in units of the cost of a typical match. There all places are similar, and patches
/// must meet exactly.
const ON_LATTICE: f64 = 2.5;
/// Penalty of a patch that continues the patch of the exemplar next to it, in units of the cost of a typical match.
const CONTINUATION: f64 = 2.0;
/// Maximum deviation of a patch from the lattice, relative to the lattice's shorter shift.
const IN_STEP: f64 = 0.15;
/// Maximum cost of the matches that agree with the lattice, relative to the best cost. If a lattice is irregular, the
/// fit is more important than the lattice. Of 8 textures, tiles of mixed tones were out of step at 1.3. At 4 all are in
/// step, and coins in uneven rows stay whole.
const AS_WELL: f64 = 4.0;
/// Maximum fraction of the overlap where a patch may show the mirror image of the present content.
const MIRRORED: f64 = 0.02;
/// Maximum distance in pixels between two pixels that count as the same place. It equals the side of a cell, because
/// the axis of a mirror may be between two lines that are compared.
const NEAR: f32 = 8.0;

/// The penalties of a pool of matches, and the matches that are allowed.
pub(super) struct Penalties {
    costs: Vec<f64>,
    /// Cost of a typical match.
    usual: f64,
    penalties: Vec<f64>,
    free: Vec<usize>,
    regular: bool,
}

impl Penalties {
    /// Computes the penalties of a pool.
    pub(super) fn of(
        quilt: &Quilt<'_>,
        window: &Window,
        pool: &[Match],
        old: &[u32],
        known: &[bool],
    ) -> Self {
        let regular = quilt.options.regular;
        let costs: Vec<f64> = pool.iter().map(|m| m.cost).collect();
        let mut sorted = costs.clone();
        sorted.sort_by(f64::total_cmp);
        let [good, usual] = [GOOD, 0.5].map(|share| quantile(&sorted, share));
        let usual = if usual == 0.0 { 1.0 } else { usual };
        // Express the repetition penalty in units of a typical match as well.
        let unit = if regular {
            ON_LATTICE
        } else {
            REPETITION * (if good == 0.0 { usual } else { good }) / usual
        };
        // Sample the window at the spacing of cells, and find the pixels that are shown there.
        let [rows, columns] = window.shape();
        let looked = || {
            let lines = (0..rows).step_by(CELL);
            lines.flat_map(move |r| (0..columns).step_by(CELL).map(move |c| r * columns + c))
        };
        let seen: Vec<Option<u32>> = looked().map(|i| known[i].then_some(old[i])).collect();
        let count = seen.iter().flatten().count().max(1) as f64;
        let mut penalties = Vec::with_capacity(pool.len());
        let mut turned = Vec::with_capacity(pool.len());
        for m in pool {
            let (mut used, mut alike, mut mirrored) = (0u64, 0u32, 0u32);
            // Compare the match with the present content where both are known.
            for (here, &there) in quilt.places(m, CELL).zip(&seen) {
                used += u64::from(quilt.used[quilt.pixels.cells[here as usize] as usize]);
                let Some(there) = there else { continue };
                if quilt.is_near(here, there) {
                    let same = quilt.is_of_one_hand(here, there);
                    alike += u32::from(same);
                    mirrored += u32::from(!same);
                }
            }
            let repetition = used as f64 / seen.len() as f64 / f64::from(quilt.pastes);
            penalties.push(unit * repetition + CONTINUATION * (f64::from(alike) / count));
            turned.push(f64::from(mirrored) / count);
        }
        // Exclude matches that mirror their surroundings, if there are others.
        let mut free: Vec<usize> = (0..pool.len()).filter(|&k| turned[k] <= MIRRORED).collect();
        if free.is_empty() {
            free = (0..pool.len()).collect();
        }
        Self {
            free: keep_in_step(quilt, pool, free, window.corner()),
            costs,
            usual,
            penalties,
            regular,
        }
    }

    /// Returns the most promising matches, the best first.
    pub(super) fn promising(&self, count: usize) -> Vec<usize> {
        let merit = |k: usize| self.costs[k] / self.usual + self.penalties[k];
        let mut best = self.free.clone();
        best.sort_by(|&a, &b| merit(a).total_cmp(&merit(b)));
        best.truncate(count);
        best
    }

    /// Adds the misfit of matches to their penalties if the images repeat on a lattice. There a seam through a plain
    /// background does not reveal a patch that deviates from the lattice.
    pub(super) fn finish(&mut self) {
        if self.regular {
            for (charge, cost) in self.penalties.iter_mut().zip(&self.costs) {
                *charge += cost / self.usual;
            }
        }
    }

    /// Returns the match with the least visible seam and the least repetition, from the costs of seams.
    pub(super) fn cheapest(&self, matches: &[usize], seams: &[f64]) -> usize {
        let mut sorted = seams.to_vec();
        sorted.sort_by(f64::total_cmp);
        let n = sorted.len();
        let median = if n % 2 == 1 {
            sorted[n / 2]
        } else {
            (sorted[n / 2 - 1] + sorted[n / 2]) / 2.0
        };
        let least = if median == 0.0 { 1.0 } else { median };
        let cost = |i: usize| seams[i] / least + self.penalties[matches[i]];
        let mut best = 0;
        for i in 1..n {
            if cost(i) < cost(best) {
                best = i;
            }
        }
        best
    }
}

impl Quilt<'_> {
    /// Returns whether two pixels are from nearly the same place of an exemplar.
    fn is_near(&self, here: u32, there: u32) -> bool {
        let last = self.pixels.cells.len() - 1;
        let [a, b] = [here, there].map(|place| (place as usize).min(last));
        let pixels = &self.pixels;
        let [p, q] = [a, b].map(|i| pixels.coordinates[i]);
        pixels.exemplar[a] == pixels.exemplar[b]
            && (p[0] - q[0]).abs() <= NEAR
            && (p[1] - q[1]).abs() <= NEAR
    }

    /// Returns whether both pixels show an exemplar itself, or both a mirror image.
    fn is_of_one_hand(&self, here: u32, there: u32) -> bool {
        let hands = &self.pixels.hands;
        hands[here as usize] == hands[(there as usize).min(hands.len() - 1)]
    }
}

/// Keeps only the matches that agree with the lattice of their image, if their costs are not much higher.
fn keep_in_step(
    quilt: &Quilt<'_>,
    pool: &[Match],
    free: Vec<usize>,
    corner: [usize; 2],
) -> Vec<usize> {
    let away = |m: &Match| {
        let picture = &quilt.pictures[m.exemplar];
        let (Some(lattice), Some(step)) = (&picture.lattice, quilt.step) else {
            return 0.0;
        };
        let moved = picture.moved(corner, m);
        out_of_step(lattice, [moved[0] - step[0], moved[1] - step[1]])
    };
    let least = |rows: &[usize]| {
        rows.iter()
            .map(|&k| pool[k].cost)
            .fold(f64::INFINITY, f64::min)
    };
    let kept: Vec<usize> = free
        .iter()
        .copied()
        .filter(|&k| away(&pool[k]) <= IN_STEP)
        .collect();
    if least(&kept) <= AS_WELL * least(&free) {
        kept
    } else {
        free
    }
}

/// Returns a quantile of sorted values, with linear interpolation as in NumPy.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let at = (sorted.len() - 1) as f64 * share;
    let low = at.floor() as usize;
    let (a, b) = (sorted[low], sorted[(low + 1).min(sorted.len() - 1)]);
    let part = at - at.floor();
    if part >= 0.5 {
        b - (b - a) * (1.0 - part)
    } else {
        a + (b - a) * part
    }
}
