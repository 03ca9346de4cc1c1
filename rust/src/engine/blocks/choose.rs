//! The choice of the exemplar patch that fits the surroundings of a cell best.

use super::cells::{Cell, Cells};
use super::{Constraints, Options};
use crate::engine::appearance::{Appearance, UNIT, distance};
use crate::engine::guide::Guide;
use crate::foundation::fixed::{ONE, Place, add, apply, nearest, sub};
use crate::foundation::hash::Noise;

/// Cost of a shell point whose continuation is outside the exemplar.
const OUTSIDE: i64 = 4 * UNIT as i64;

/// The points of a cell that the guide constrains, with their steps from the cell's centre.
pub(super) struct Asked<'a, const D: usize> {
    guide: Option<&'a Guide<'a>>,
    /// The constrained point nearest to the cell's centre.
    middle: usize,
    points: Vec<(usize, [i32; D])>,
}

/// The surroundings of a cell, which candidates are compared with.
pub(super) struct Around<'a, const D: usize> {
    shell: Vec<Beyond<D>>,
    /// Contrast of each sample of the exemplar: the squared length of its vector.
    contrasts: &'a [i32],
}

/// A point of the shell.
struct Beyond<const D: usize> {
    /// Step in the exemplar from the place of the cell's centre to the sample that would continue the patch at this
    /// point.
    step: [i32; D],
    /// The sample that the output shows at this point.
    there: usize,
}

/// The places that a cell may take, and their costs.
pub(super) struct Chooser<'a, const D: usize> {
    appearance: &'a Appearance<D>,
    cell: &'a Cell<D>,
    index: usize,
    /// World index of the cell.
    world: [i32; D],
    /// Places of the centre, in whole samples, for which all points of the cell are inside the exemplar.
    range: [[i32; 2]; D],
}

impl<'a, const D: usize> Chooser<'a, D> {
    /// Prepares the choice for the cell `c`.
    pub(super) fn new(
        appearance: &'a Appearance<D>,
        cells: &Cells<D>,
        list: &'a [Cell<D>],
        c: usize,
    ) -> Self {
        let cell = &list[c];
        let index = cells.grid.point(c);
        // Measure how far the cell extends in the exemplar, to keep all its points inside.
        let (mut low, mut high) = ([0; D], [0; D]);
        for &p in &cell.points {
            let world = cells.region.world(cells.region.grid.point(p as usize));
            let moved = apply(&cell.frame, cells.step_from_centre(c, world));
            for axis in 0..D {
                low[axis] = low[axis].min(moved[axis]);
                high[axis] = high[axis].max(moved[axis]);
            }
        }
        let range = std::array::from_fn(|axis| {
            let [first, last] = appearance.range(axis);
            if appearance.grid().wrap()[axis] {
                return [first, last];
            }
            let [least, most] = [
                first - low[axis].div_euclid(ONE),
                last - (high[axis] + ONE - 1).div_euclid(ONE),
            ];
            // A cell that is larger than the exemplar has one place, in the middle.
            if least <= most {
                [least, most]
            } else {
                [(least + most).div_euclid(2); 2]
            }
        });
        Self {
            appearance,
            cell,
            index: c,
            world: std::array::from_fn(|axis| cells.first[axis] + index[axis] as i32),
            range,
        }
    }

    /// Draws a random place for the cell's centre.
    pub(super) fn place(&self, noise: &Noise, round: u32, draw: u32) -> Place<D> {
        let words = noise.at(self.world, round << 16 | draw);
        std::array::from_fn(|axis| {
            let [low, high] = self.range[axis];
            let n = (high - low + 1) as u64;
            (low + ((u64::from(words[axis]) * n) >> 32) as i32) * ONE
        })
    }

    /// Draws a place whose value is near the wanted value at the point `asked.middle`. Returns `None` if draws ignore
    /// the guide.
    fn near(&self, asked: &Asked<'_, D>, noise: &Noise, round: u32, draw: u32) -> Option<Place<D>> {
        let word = noise.at(self.world, round << 16 | draw)[D];
        let sample = asked.guide?.near(asked.middle, word)?;
        let point = self.appearance.grid().point(sample);
        Some(std::array::from_fn(|axis| {
            let [low, high] = self.range[axis];
            (point[axis] as i32).clamp(low, high) * ONE
        }))
    }

    /// Returns the surroundings of the cell.
    pub(super) fn around<'c>(&self, places: &[Place<D>], contrasts: &'c [i32]) -> Around<'c, D> {
        let shell = self.cell.shell.iter().map(|&(q, step)| Beyond {
            // Round the step separately from the place. Patches are placed on whole samples, so the rounded step is
            // the same for all candidates.
            step: nearest(apply(&self.cell.frame, step)),
            there: self.appearance.clamped(nearest(places[q as usize])),
        });
        Around {
            shell: shell.collect(),
            contrasts,
        }
    }

    /// Returns the best of the present place and the drawn places. If costs are equal, the first place wins.
    #[allow(clippy::too_many_arguments)] // the surroundings, the guide, and how to choose
    pub(super) fn choose(
        &self,
        around: &Around<'_, D>,
        present: Place<D>,
        near: &[Place<D>],
        asked: &Asked<'_, D>,
        noise: &Noise,
        round: u32,
        options: &Options,
    ) -> Place<D> {
        let mut best = present;
        let usual = 2.0 * f64::from(UNIT) * self.cell.shell.len().max(1) as f64;
        let cost = |origin| {
            self.misfit(around, origin, options)
                + options.repetition * self.repeated(origin, near, options.cell)
                + self.obey(origin, asked) as f64 / usual
        };
        let mut least = cost(present);
        for draw in 0..options.candidates as u32 {
            let origin = self.place(noise, round, draw);
            let origin = self.near(asked, noise, round, draw).unwrap_or(origin);
            let sum = cost(origin);
            if sum < least {
                (best, least) = (origin, sum);
            }
        }
        best
    }

    /// Returns the points of the cell that the guide constrains.
    pub(super) fn asked<'g>(
        &self,
        cells: &Cells<D>,
        guide: Option<&'g Guide<'g>>,
        constraints: Constraints<'_, D>,
    ) -> Asked<'g, D> {
        let mut points = Vec::new();
        let mut middle = (i64::MAX, 0);
        if let Some(guide) = guide {
            let asks = |&&p: &&u32| guide.asks(p as usize) && !constraints.hold(p as usize);
            for &p in self.cell.points.iter().filter(asks) {
                let world = cells.region.world(cells.region.grid.point(p as usize));
                let step = cells.step_from_centre(self.index, world);
                middle = middle.min((step.iter().map(|&x| i64::from(x).pow(2)).sum(), p as usize));
                points.push((p as usize, step));
            }
        }
        Asked {
            guide,
            middle: middle.1,
            points,
        }
    }

    /// Returns the cost of a place according to the guide.
    #[inline(always)]
    fn obey(&self, origin: Place<D>, asked: &Asked<'_, D>) -> i64 {
        let Some(guide) = asked.guide else {
            return 0;
        };
        let mut sum = 0;
        for &(p, step) in &asked.points {
            let sample = nearest(add(origin, apply(&self.cell.frame, step)));
            sum += guide.cost(p, self.appearance.clamped(sample));
        }
        sum
    }

    /// Returns how badly the patch continues the surroundings: 0 for a perfect fit, about 1 for unrelated patches. The
    /// squared difference is divided by the contrast of both sides. Otherwise low-contrast patches would win, because
    /// they are near every other patch on average.
    #[inline(always)]
    fn misfit(&self, around: &Around<'_, D>, origin: Place<D>, options: &Options) -> f64 {
        let centre = nearest(origin);
        let (mut difference, mut contrast, mut same) = (0i64, 0i64, 0usize);
        for &Beyond { step, there } in &around.shell {
            let Some(at) = self.appearance.inside(add(centre, step)) else {
                difference += OUTSIDE;
                continue;
            };
            let [mine, theirs] = [at, there].map(|i| self.appearance.feature(i));
            difference += i64::from(distance(mine, theirs));
            contrast += i64::from(around.contrasts[at] + around.contrasts[there]);
            same += usize::from(at == there);
        }
        let shell = self.cell.shell.len().max(1) as f64;
        // Two unrelated windows differ by twice the variance of windows on average.
        let usual = 2.0 * shell * f64::from(UNIT);
        let scale = options.contrast * contrast as f64 + (1.0 - options.contrast) * usual;
        difference as f64 / scale.max(0.05 * usual) + options.continuation * same as f64 / shell
    }

    /// Returns the fraction of the patch that neighbouring cells already show, summed over these cells.
    #[inline(always)]
    fn repeated(&self, origin: Place<D>, near: &[Place<D>], cell: usize) -> f64 {
        let reach = (cell as u32 * ONE as u32 / 2).max(ONE as u32);
        let shared = |other: &Place<D>| {
            let far = sub(*other, origin)
                .iter()
                .map(|d| d.unsigned_abs())
                .max()
                .unwrap_or(0);
            f64::from(reach.saturating_sub(far)) / f64::from(reach)
        };
        near.iter().map(shared).sum()
    }
}
