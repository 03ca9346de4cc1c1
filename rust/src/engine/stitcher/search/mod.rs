//! The search for a patch: differences between its known points and the exemplar at all coordinates.
//!
//! Moving a patch to other exemplar coordinates shifts all its samples equally, whatever its chart. The known points
//! are therefore written into a template of the exemplar's size. The sum of squared differences of every shift is a
//! correlation: SSD(s) = corr(E^2, W) - 2 corr(E, W T) + const.
//!
//! A large exemplar is searched in blocks of samples first. The costs of single samples around the best blocks are then
//! computed exactly.

mod exact;
mod lattice;
mod spectra;
mod steps;

use std::sync::Arc;

use super::canvas::{Canvas, FREE};
use super::chart::Chart;
use super::source::Source;
use crate::engine::guide::{Guide, UNRELATED};
use crate::foundation::fixed::{BITS, ONE, Place, nearest};
use crate::foundation::grid::Grid;
use crate::foundation::hash::Noise;

use exact::Fit;
use spectra::{Spectra, Template};
pub(super) use steps::Steps;

/// Minimum distance of two candidates, in samples.
const APART: i32 = 3;
/// Candidates within this distance of the exact continuation of a neighbour, in samples, count as continuations.
const NEAR: i32 = 6;
/// Minimum number of points of a neighbour that a candidate can continue.
const FEW: u32 = 12;
/// Range of the random scores that are added if no point is known. For comparison, unrelated windows differ by 2.
const CHANCE: f32 = 0.1;
/// Maximum distance from a place in step with the lattice, in samples.
///
/// This and the next value are the first ones tried. On 32 images with a lattice or a period, the
/// mean irregularity falls from 0.167 to 0.056 with them.
const SLACK: f64 = 3.0;
/// Cost of a place that is not in step. It is more than that of the exact continuation of a neighbour.
const OUT_OF_STEP: f32 = 8.0;
/// Number of random places that are tried for a place in step.
const DRAWS: u32 = 256;
/// Maximum ratio of the count of a sample to the mean count.
const OFTEN: f32 = 6.0;
/// Number of blocks whose surroundings are searched for candidates, as a multiple of the number of candidates.
const BLOCKS: usize = 4;
/// Length of runs of values. The minimum of each run is stored, so that the next minimum is found quickly.
const RUN: usize = 512;

/// Costs of candidates that repeat other patches.
#[derive(Debug, Clone, Copy)]
pub(super) struct Charges {
    /// Cost of samples that were shown more often than others.
    pub repetition: f32,
    /// Cost of the exact continuation of a neighbour.
    pub continuation: f32,
}

/// An exemplar, prepared for the search.
pub(super) struct Index<const D: usize> {
    grid: Grid<D>,
    spectra: Arc<Spectra<D>>,
    charges: Charges,
    steps: Option<Steps>,
    /// Number of patches that have shown the surroundings of each sample, weighted by distance.
    shown: Vec<f32>,
    total: f64,
}

/// Exemplar coordinates that the centre of a patch may have: the first sample along each axis, and the last.
struct Range<const D: usize> {
    low: [i32; D],
    high: [i32; D],
}

impl<const D: usize> Index<D> {
    /// Transforms a source, and the values of a guide.
    pub(super) fn new(source: &Source<D>, guide: Option<&Guide<'_>>, charges: Charges) -> Self {
        Self::over(
            *source.grid(),
            Arc::new(Spectra::new(source, guide)),
            charges,
        )
    }

    fn over(grid: Grid<D>, spectra: Arc<Spectra<D>>, charges: Charges) -> Self {
        Self {
            grid,
            spectra,
            charges,
            steps: None,
            shown: vec![0.0; grid.len()],
            total: 0.0,
        }
    }

    /// Returns an index of the same source without counts, and with other charges.
    pub(super) fn afresh(&self, charges: Charges) -> Self {
        Self::over(self.grid, Arc::clone(&self.spectra), charges)
    }

    /// Keeps places in step with a lattice.
    pub(super) fn in_step(self, steps: Option<Steps>) -> Self {
        Self { steps, ..self }
    }

    /// Counts a patch with a given side for the samples around its centre.
    pub(super) fn note(&mut self, place: Place<D>, side: f32) {
        let (centre, reach) = (nearest(place), side.ceil() as i32);
        let mut axes: Vec<Vec<(usize, f32)>> = Vec::with_capacity(D);
        for a in 0..D {
            let reach = reach.min(if self.grid.wrap()[a] {
                (self.grid.shape()[a] as i32 - 1) / 2
            } else {
                reach
            });
            let near = (-reach..=reach).filter_map(|d| {
                let at = self.grid.inside(a, (centre[a] + d) as isize)?;
                Some((at, (1.0 - d.abs() as f32 / side).max(0.0)))
            });
            axes.push(near.collect());
        }
        let (rows, last) = axes.split_at(D - 1);
        let strides = self.grid.strides();
        for k in 0..rows.iter().map(Vec::len).product() {
            let (mut rest, mut at, mut row) = (k, 0, 1.0);
            for a in (0..D - 1).rev() {
                let (i, w) = rows[a][rest % rows[a].len()];
                rest /= rows[a].len();
                at += i * strides[a];
                row *= w;
            }
            for &(i, w) in &last[0] {
                self.shown[at + i] += w * row;
                self.total += f64::from(w * row);
            }
        }
    }

    /// Returns the places of a chart's centre that fit its known points best, the best one first; at most `count`.
    #[allow(clippy::too_many_arguments)] // the query and where to search
    pub(super) fn best(
        &self,
        source: &Source<D>,
        canvas: &Canvas<D>,
        chart: &Chart<D>,
        known: &[bool],
        at: [i32; D],
        guide: Option<&Guide<'_>>,
        count: usize,
        noise: &Noise,
    ) -> Vec<Place<D>> {
        let Some(range) = self.range(chart) else {
            return Vec::new();
        };
        let lattice = &self.spectra.lattice;
        // Block i of the template represents the place i - first of the centre.
        let first = range.low.map(|low| (-low) >> lattice.level);
        let Ok(blocks) = Grid::new(
            std::array::from_fn(|a| ((range.high[a] >> lattice.level) + first[a]) as usize + 1),
            [false; D],
        ) else {
            return Vec::new();
        };
        let (template, points) = self.splat_known(source, canvas, chart, known, first);
        let asked = guide.and_then(|guide| self.splat_asked(guide, chart, first));
        if points == 0 && asked.is_none() {
            let draw = |k| {
                let block = noise.below(blocks.len() as u64, [0x70, k, 0, 0]);
                lattice.centre(blocks.point(block as usize), first)
            };
            let tried = (0..DRAWS).map(draw).find(|c| self.astray(*c, at) == 0.0);
            return vec![tried.unwrap_or_else(|| draw(0)).map(|x| x * ONE)];
        }
        let mut scores = self.spectra.scores(
            (points > 0).then(|| (&template, 1.0 / (points as f32 * source.channels() as f32))),
            (asked.as_ref()).map(|(asked, n)| (asked, 2.0 / (*n as f32 * UNRELATED))),
        );
        if points == 0 {
            // If no point is known, many places satisfy the constraint equally well. Choose among them at random.
            for (k, score) in scores.iter_mut().enumerate() {
                *score += CHANCE * noise.uniform([0x71, k as u32, 0, 0]) as f32;
            }
        }
        let continued = self.continuations(canvas, chart);
        if lattice.level == 0 {
            let found = self.pick(&scores, &blocks, first, &continued, at, count);
            return found.into_iter().map(|c| c.map(|x| x * ONE)).collect();
        }
        let near = self.pick(&scores, &blocks, first, &continued, at, BLOCKS * count);
        let fit = Fit::new(source, canvas, chart, known, guide);
        let mut found: Vec<([i32; D], f32)> = near
            .into_iter()
            .map(|centre| fit.settle(centre, lattice.level, |at| range.bring(at, &self.grid)))
            .map(|(centre, cost)| {
                let charge = self.charge(centre, &continued) + self.astray(centre, at);
                (centre, cost + charge)
            })
            .collect();
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        self.part(found, count)
    }

    /// Returns the exemplar coordinates that the centre of a patch may have.
    fn range(&self, chart: &Chart<D>) -> Option<Range<D>> {
        let (least, most) = extent(chart)?;
        let low = least.map(|x| -(x >> BITS));
        let high = std::array::from_fn(|a| {
            let n = self.grid.shape()[a] as i32;
            if self.grid.wrap()[a] {
                low[a] + n - 1
            } else {
                (((n - 1) * ONE - most[a]) >> BITS).max(low[a])
            }
        });
        Some(Range { low, high })
    }

    /// Writes the known points of a chart into a template.
    fn splat_known(
        &self,
        source: &Source<D>,
        canvas: &Canvas<D>,
        chart: &Chart<D>,
        known: &[bool],
        first: [i32; D],
    ) -> (Template, usize) {
        let mut template = self.spectra.template();
        let mut points = 0;
        for (i, &p) in chart.window.points.iter().enumerate() {
            if !known[i] {
                continue;
            }
            if let Some(at) = self.spectra.lattice.splat(chart.steps[i], first) {
                let colour = source.look(canvas.places[p as usize]).colour;
                template.add(at, 1.0, &colour);
                points += 1;
            }
        }
        (template, points)
    }

    /// Writes the constraints of a chart into a template, if there are any.
    fn splat_asked(
        &self,
        guide: &Guide<'_>,
        chart: &Chart<D>,
        first: [i32; D],
    ) -> Option<(Template, usize)> {
        let mut template = self.spectra.template_asked()?;
        let mut points = 0;
        for (i, &p) in chart.window.points.iter().enumerate() {
            let p = p as usize;
            if !chart.mask[i] || !guide.asks(p) {
                continue;
            }
            if let Some(at) = self.spectra.lattice.splat(chart.steps[i], first) {
                let (value, weight) = (
                    guide.wanted(p).map(f32::from),
                    f32::from(guide.weight(p)) / 256.0,
                );
                self.spectra.ask(&mut template, at, weight, &value);
                points += 1;
            }
        }
        (points > 0).then_some((template, points))
    }

    /// Returns the exemplar coordinates where a chart would continue the patches around it.
    fn continuations(&self, canvas: &Canvas<D>, chart: &Chart<D>) -> Vec<[i32; D]> {
        let mut seen: Vec<(u32, u32, [i32; D])> = Vec::new();
        for (i, &p) in chart.window.points.iter().enumerate() {
            let patch = canvas.patches[p as usize];
            if patch == FREE {
                continue;
            }
            let slot = match seen.iter().rposition(|s| s.0 == patch) {
                Some(slot) => slot,
                None => {
                    let (place, step) = (canvas.places[p as usize], chart.steps[i]);
                    let centre = nearest(std::array::from_fn(|a| place[a].wrapping_sub(step[a])));
                    seen.push((patch, 0, centre));
                    seen.len() - 1
                }
            };
            seen[slot].1 += 1;
        }
        seen.iter().filter(|s| s.1 >= FEW).map(|s| s.2).collect()
    }

    /// Returns the cost of a sample that was shown more often than others.
    fn repetition(&self, centre: [i32; D]) -> f32 {
        let mean = (self.total / self.grid.len() as f64) as f32;
        if self.charges.repetition == 0.0 || mean == 0.0 {
            return 0.0;
        }
        let at = std::array::from_fn(|a| self.grid.resolve(a, centre[a] as isize));
        self.charges.repetition * (self.shown[self.grid.index(at)] / mean).min(OFTEN)
    }

    /// Returns the cost of a sample that is not in step with the lattice, if the centre of its patch is at a point.
    fn astray(&self, centre: [i32; D], at: [i32; D]) -> f32 {
        let slack = SLACK + f64::from(1 << self.spectra.lattice.level) / 2.0;
        match self.steps {
            Some(steps) if steps.away(centre, at) > slack => OUT_OF_STEP,
            _ => 0.0,
        }
    }

    /// Returns the part of a candidate's cost that does not depend on its fit.
    fn charge(&self, centre: [i32; D], continued: &[[i32; D]]) -> f32 {
        let goes_on = continued
            .iter()
            .filter(|c| self.within(centre, **c, NEAR))
            .count();
        self.repetition(centre) + self.charges.continuation * goes_on as f32
    }

    /// Returns whether the distance of two samples is at most `reach` along each axis.
    fn within(&self, a: [i32; D], b: [i32; D], reach: i32) -> bool {
        (0..D).all(|axis| {
            let (n, apart) = (self.grid.shape()[axis] as i32, (a[axis] - b[axis]).abs());
            let apart = if self.grid.wrap()[axis] {
                (apart % n).min(n - apart % n)
            } else {
                apart
            };
            apart <= reach
        })
    }

    /// Returns the centres with the lowest sums of scores and charges, at a minimum distance from each other.
    fn pick(
        &self,
        scores: &[f32],
        blocks: &Grid<D>,
        first: [i32; D],
        continued: &[[i32; D]],
        at: [i32; D],
        count: usize,
    ) -> Vec<[i32; D]> {
        let lattice = &self.spectra.lattice;
        let wide = |reach: i32| (reach >> lattice.level).max(1);
        let mut values: Vec<f32> = blocks
            .points()
            .map(|block| {
                let centre = lattice.centre(block, first);
                scores[lattice.position(block)] + self.repetition(centre) + self.astray(centre, at)
            })
            .collect();
        // Charge candidates that continue a neighbour exactly, and candidates within a few samples of them.
        if self.charges.continuation > 0.0 {
            for centre in continued {
                let near = std::array::from_fn(|a| (centre[a] >> lattice.level) + first[a]);
                self.around(blocks, near, wide(NEAR), |k| {
                    values[k] += self.charges.continuation
                });
            }
        }
        let mut found = Vec::with_capacity(count);
        // Store the minimum of each run. Each pick then updates only the runs near it.
        let mut runs: Vec<(f32, usize)> = values.chunks(RUN).map(least).collect();
        let mut changed = Vec::new();
        while found.len() < count {
            let mut best = (f32::INFINITY, 0);
            for (run, &(v, k)) in runs.iter().enumerate() {
                if v < best.0 {
                    best = (v, run * RUN + k);
                }
            }
            if best.0 == f32::INFINITY {
                break;
            }
            let block = blocks.point(best.1);
            found.push(lattice.centre(block, first));
            // Exclude the surroundings of the pick, so that candidates differ.
            self.around(blocks, block.map(|x| x as i32), wide(APART), |k| {
                values[k] = f32::INFINITY;
                if changed.last() != Some(&(k / RUN)) {
                    changed.push(k / RUN);
                }
            });
            for run in changed.drain(..) {
                let end = values.len().min((run + 1) * RUN);
                runs[run] = least(&values[run * RUN..end]);
            }
        }
        found
    }

    /// Returns the first coordinates that have a minimum distance from each other.
    fn part(&self, sorted: Vec<([i32; D], f32)>, count: usize) -> Vec<Place<D>> {
        let mut found: Vec<[i32; D]> = Vec::with_capacity(count);
        for (centre, _) in sorted {
            if found.len() < count && !found.iter().any(|f| self.within(centre, *f, APART)) {
                found.push(centre);
            }
        }
        found.into_iter().map(|c| c.map(|x| x * ONE)).collect()
    }

    /// Calls `f` with each position of a box around a block, which wraps along the exemplar's periodic axes.
    fn around(&self, blocks: &Grid<D>, at: [i32; D], reach: i32, mut f: impl FnMut(usize)) {
        let (width, all) = (2 * reach + 1, &self.spectra.lattice.grid);
        for k in 0..(width as usize).pow(D as u32) {
            let (mut rest, mut point) = (k as i32, [0; D]);
            let mut inside = true;
            for a in 0..D {
                let mut i = at[a] + rest % width - reach;
                rest /= width;
                if all.wrap()[a] {
                    i = i.rem_euclid(all.shape()[a] as i32);
                }
                inside &= i >= 0 && (i as usize) < blocks.shape()[a];
                point[a] = i.max(0) as usize;
            }
            if inside {
                f(blocks.index(point));
            }
        }
    }
}

impl<const D: usize> Range<D> {
    /// Returns the allowed sample for the centre that is nearest to `at`.
    fn bring(&self, at: [i32; D], grid: &Grid<D>) -> [i32; D] {
        std::array::from_fn(|a| {
            let n = grid.shape()[a] as i32;
            if grid.wrap()[a] {
                self.low[a] + (at[a] - self.low[a]).rem_euclid(n)
            } else {
                at[a].clamp(self.low[a], self.high[a])
            }
        })
    }
}

/// Returns the minimum of some values, and its first position.
fn least(values: &[f32]) -> (f32, usize) {
    let low = values.iter().fold(f32::INFINITY, |a, &b| a.min(b));
    (low, values.iter().position(|&v| v == low).unwrap_or(0))
}

/// Returns the smallest and the largest step of a chart along each axis.
fn extent<const D: usize>(chart: &Chart<D>) -> Option<(Place<D>, Place<D>)> {
    let mut ends: Option<(Place<D>, Place<D>)> = None;
    for (step, _) in chart.steps.iter().zip(&chart.mask).filter(|(_, m)| **m) {
        let (low, high) = ends.get_or_insert((*step, *step));
        for a in 0..D {
            low[a] = low[a].min(step[a]);
            high[a] = high[a].max(step[a]);
        }
    }
    ends
}
