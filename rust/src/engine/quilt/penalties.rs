//! What matches are charged for beside what they do not fit.

use super::{CELL, Quilt, Window};
use crate::kernels::patch_search::Match;

/// Charge for showing what all other patches show, in units of a match that is better than all but this share: where few
/// places fit, as between things on plain ground, others would tear what they are put on. And on a lattice, where all places are
/// much alike and must meet exactly, in units of a typical match.
const REPETITION: f64 = 10.0;
const GOOD: f64 = 0.1;
const ON_LATTICE: f64 = 2.5;
/// Charge for going on with the piece of the exemplar that lies there already, in units of a typical match.
const CONTINUATION: f64 = 2.0;
/// How far a patch of what repeats on a lattice may be out of step, in shifts of the lattice, and by what factor a match that is
/// in step may be worse: where a lattice is only about regular, what fits is more than what is in step.
const IN_STEP: f64 = 0.15;
const AS_WELL: f64 = 1.3;
/// Share of its overlap on which a patch may show the mirror image of what lies there, within so many pixels: a cell, or the axis
/// of a mirror could lie between two lines that are compared.
const MIRRORED: f64 = 0.02;
const NEAR: f32 = 8.0;

/// The penalties of a pool of matches, and which of them may be taken.
pub(super) struct Penalties {
    costs: Vec<f64>,
    /// A typical match.
    usual: f64,
    penalties: Vec<f64>,
    free: Vec<usize>,
    regular: bool,
}

impl Penalties {
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
        let unit = if regular {
            ON_LATTICE
        } else {
            REPETITION * (if good == 0.0 { usual } else { good }) / usual
        };
        // The samples that are looked at: which of them are known, and what they show.
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

    /// The most promising matches, the best first.
    pub(super) fn promising(&self, count: usize) -> Vec<usize> {
        let merit = |k: usize| self.costs[k] / self.usual + self.penalties[k];
        let mut best = self.free.clone();
        best.sort_by(|&a, &b| merit(a).total_cmp(&merit(b)));
        best.truncate(count);
        best
    }

    /// From here on what a match does not fit is charged too, where a seam through plain ground would not tell a place that is
    /// out of step.
    pub(super) fn finish(&mut self) {
        if self.regular {
            for (charge, cost) in self.penalties.iter_mut().zip(&self.costs) {
                *charge += cost / self.usual;
            }
        }
    }

    /// Which of some matches shows and repeats the least, whose seams cost so much.
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
    /// Whether two places show nearly the same place of an exemplar.
    fn is_near(&self, here: u32, there: u32) -> bool {
        let last = self.pixels.cells.len() - 1;
        let [a, b] = [here, there].map(|place| (place as usize).min(last));
        let pixels = &self.pixels;
        let [p, q] = [a, b].map(|i| pixels.coordinates[i]);
        pixels.exemplar[a] == pixels.exemplar[b]
            && (p[0] - q[0]).abs() <= NEAR
            && (p[1] - q[1]).abs() <= NEAR
    }

    fn is_of_one_hand(&self, here: u32, there: u32) -> bool {
        let hands = &self.pixels.hands;
        hands[here as usize] == hands[(there as usize).min(hands.len() - 1)]
    }
}

/// Those of some matches that are in step with what their pictures show elsewhere, if these match as well.
fn keep_in_step(
    quilt: &Quilt<'_>,
    pool: &[Match],
    free: Vec<usize>,
    corner: [usize; 2],
) -> Vec<usize> {
    let away = |m: &Match| {
        let picture = &quilt.pictures[m.exemplar];
        let (Some(lattice), Some(step)) = (&picture.lattice, picture.step) else {
            return 0.0;
        };
        let at = [m.row, m.column];
        let moved = [0, 1].map(|a| corner[a] as f64 - at[a] as f64 - step[a]);
        out_of_step(lattice, moved)
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

/// How far a step is from the next shift of a lattice, in units of its shorter shift.
fn out_of_step(lattice: &[[f64; 2]; 2], moved: [f64; 2]) -> f64 {
    let [[a, b], [c, d]] = *lattice;
    let whole = a * d - b * c;
    let times = [
        (d * moved[0] - b * moved[1]) / whole,
        (a * moved[1] - c * moved[0]) / whole,
    ];
    // The nearest shift is one of the four around.
    let mut rest = f64::INFINITY;
    for [i, j] in [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]] {
        let shift = [times[0].floor() + i, times[1].floor() + j];
        let left = [
            moved[0] - (a * shift[0] + b * shift[1]),
            moved[1] - (c * shift[0] + d * shift[1]),
        ];
        rest = rest.min(norm(left));
    }
    rest / norm([a, c]).min(norm([b, d]))
}

fn norm([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}

/// The value below which a share of others lies that are sorted, as NumPy has it.
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
