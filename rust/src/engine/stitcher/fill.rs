//! Filling: patches around a lattice of centres, and then around all points that are still empty.
//!
//! Patches whose windows do not overlap are searched at the same time. Their choice depends only on the field, so the
//! result does not depend on the number of threads.

use std::collections::VecDeque;

use super::chart::Chart;
use super::cut::{Cutting, Proposal};
use super::{Patch, Stitching, enlargement};
use crate::Result;
use crate::foundation::fixed::{Frames, Place};
use crate::foundation::grid::Grid;
use crate::foundation::par;

/// A patch is skipped if all points within this fraction of the step around its centre are covered.
const CORE: f32 = 0.45;
/// Number of points where the enlargement of a field is measured.
const PROBES: usize = 4096;
/// Maximum number of patches that are searched at the same time.
const BATCH: usize = 4;
/// Maximum number of centres that are examined to find these patches.
const AHEAD: usize = 256;
/// Minimum side in output points, in two and three dimensions, of a patch that the field shrinks. Without this
/// minimum, there would be one patch for every few points near a horizon.
const SEEN: [f32; 2] = [24.0, 12.0];
/// Maximum side of a patch that was enlarged to reach [`SEEN`], relative to the exemplar's shortest side.
const LARGEST: f32 = 0.4;

/// A patch whose cut has been computed, but not applied yet.
pub(super) struct Found<const D: usize> {
    chart: Chart<D>,
    centre: [i32; D],
    side: f32,
    /// Exemplar coordinates of the centre, and of all points.
    place: Place<D>,
    places: Vec<Place<D>>,
    cutting: Cutting<D>,
    /// Difference between the cost of the window without and with the patch.
    pub gain: f64,
}

/// A box of the canvas: its first point, and the point after its last. It may extend beyond the end of a periodic axis.
type Reach<const D: usize> = ([i32; D], [i32; D]);

impl<const D: usize> Stitching<'_, D> {
    /// Fills the canvas.
    pub(super) fn fill(&mut self) -> Result<()> {
        self.monitor.expect(self.canvas.free as u64);
        let mut ahead = self.centres();
        while !ahead.is_empty() {
            let batch = self.batch(&mut ahead);
            let first = self.laid;
            let found = par::map(batch.len(), |k| {
                let (centre, side) = (batch[k], self.side(batch[k]));
                match self.chart(centre, side) {
                    Some(chart) => {
                        let known = self.covered(&chart);
                        self.find(chart, &known, centre, side, first + k as u32)
                    }
                    None => Ok(None),
                }
            });
            self.laid += batch.len() as u32;
            for found in found {
                if let Some(found) = found? {
                    self.lay(found)?;
                }
            }
        }
        self.fill_gaps()
    }

    /// Returns the lattice of centres, in row-major order.
    fn centres(&self) -> VecDeque<[i32; D]> {
        let grid = &self.canvas.grid;
        let least = self.least_scale();
        let step = (self.side_seen(least) * (1.0 - self.options.overlap) * least).max(2.0);
        let axes: [Vec<i32>; D] =
            std::array::from_fn(|a| along(grid.shape()[a], grid.wrap()[a], step));
        let Ok(lattice) = Grid::new(std::array::from_fn(|a| axes[a].len()), [false; D]) else {
            return VecDeque::new();
        };
        lattice
            .points()
            .map(|point| std::array::from_fn(|a| axes[a][point[a]]))
            .collect()
    }

    /// Takes the next centres whose patches do not overlap the patches of earlier centres. There is at least one,
    /// unless all are covered.
    fn batch(&self, ahead: &mut VecDeque<[i32; D]>) -> Vec<[i32; D]> {
        let o = &self.options;
        let (mut batch, mut waiting) = (Vec::new(), VecDeque::new());
        let mut claimed: Vec<Reach<D>> = Vec::new();
        while let Some(centre) = ahead.pop_front() {
            let side = self.side(centre);
            let reach = Chart::reach(&self.canvas, self.frames, centre, side, o.bend);
            let free = !claimed.iter().any(|other| self.meet(&reach, other));
            let core = (CORE * side * (1.0 - o.overlap) * self.scale(centre)) as i32;
            if free && self.all_covered(centre, core.max(1)) {
                continue;
            }
            claimed.push(reach);
            if free {
                batch.push(centre);
            } else {
                waiting.push_back(centre);
            }
            if batch.len() == BATCH || claimed.len() == AHEAD {
                break;
            }
        }
        // Centres that must wait stay before the centres that were not examined.
        waiting.append(ahead);
        *ahead = waiting;
        batch
    }

    /// Returns whether two boxes share points of the canvas.
    fn meet(&self, a: &Reach<D>, b: &Reach<D>) -> bool {
        let grid = &self.canvas.grid;
        (0..D).all(|axis| {
            let ((a0, a1), (b0, b1)) = ((a.0[axis], a.1[axis]), (b.0[axis], b.1[axis]));
            if grid.wrap()[axis] {
                let n = grid.shape()[axis] as i32;
                (b0 - a0).rem_euclid(n) < a1 - a0 || (a0 - b0).rem_euclid(n) < b1 - b0
            } else {
                a0 < b1 && b0 < a1
            }
        })
    }

    /// Inserts patches around points that are still empty.
    fn fill_gaps(&mut self) -> Result<()> {
        let grid = self.canvas.grid;
        let mut next = 0;
        while let Some(p) = (next..grid.len()).find(|&p| !self.canvas.covered(p as u32)) {
            next = p;
            let at = grid.point(p).map(|x| x as i32);
            let (before, side) = (self.canvas.free, self.side(at));
            self.cover_around(self.middle(at), side)?;
            for share in [1.0, 0.5, 0.25] {
                if !self.canvas.covered(p as u32) {
                    self.cover_around(at, (side * share).max(4.0))?;
                }
            }
            if self.canvas.free == before || !self.canvas.covered(p as u32) {
                // No chart around this point contains the point, so it shows an arbitrary sample, as a patch of one
                // point.
                self.canvas.patches[p] = self.patches.len() as u32;
                self.canvas.free -= 1;
                self.patches.push(Patch {
                    centre: at,
                    place: self.canvas.places[p],
                    frame: self.frames.at(p),
                    rigid: true,
                    side,
                });
            }
        }
        Ok(())
    }

    /// Inserts the best patch around a point.
    fn cover_around(&mut self, centre: [i32; D], side: f32) -> Result<()> {
        match self.chart(centre, side) {
            Some(chart) => self.cover_chart(chart, centre, side),
            None => Ok(()),
        }
    }

    /// Inserts the best patch of a chart.
    pub(super) fn cover_chart(
        &mut self,
        chart: Chart<D>,
        centre: [i32; D],
        side: f32,
    ) -> Result<()> {
        let known = self.covered(&chart);
        let found = self.find(chart, &known, centre, side, self.laid)?;
        self.laid += 1;
        match found {
            Some(found) => self.lay(found),
            None => Ok(()),
        }
    }

    /// Returns the chart of a patch around a point if it contains empty points.
    fn chart(&self, centre: [i32; D], side: f32) -> Option<Chart<D>> {
        let chart = Chart::new(&self.canvas, self.frames, centre, side, self.options.bend)?;
        let useful = |(&p, &m): (&u32, &bool)| m && !self.canvas.covered(p);
        let any = chart.window.points.iter().zip(&chart.mask).any(useful);
        any.then_some(chart)
    }

    /// Returns the points of a chart that are covered.
    fn covered(&self, chart: &Chart<D>) -> Vec<bool> {
        let points = chart.window.points.iter().zip(&chart.mask);
        points.map(|(&p, &m)| m && self.canvas.covered(p)).collect()
    }

    /// Finds the best patch of a chart. Candidates fit the known points, and the candidate with the cheapest cut is
    /// returned.
    pub(super) fn find(
        &self,
        chart: Chart<D>,
        known: &[bool],
        centre: [i32; D],
        side: f32,
        number: u32,
    ) -> Result<Option<Found<D>>> {
        let (o, source) = (&self.options, self.cutter.source());
        let places = self.index.best(
            source,
            &self.canvas,
            &chart,
            known,
            centre,
            self.cutter.guide,
            o.candidates,
            &self.noise.part(number),
        );
        let view = (self.cutter).view(&self.canvas, &chart.window, &chart.mask, &[]);
        let worth = f64::from(o.balance / side);
        // The balance of classes after the cut is a part of the cost.
        let excess = |patch: &Proposal<'_, D>, take: &[bool]| {
            let points = &chart.window.points;
            let after = self
                .balance
                .after(source, &self.canvas, points, &patch.places, take);
            worth * after.excess(source)
        };
        // Compare the candidates by coarse cuts, and refine only the cheapest.
        let cuts = par::map(places.len(), |k| {
            let patch = self.cutter.propose(&chart, places[k]);
            let cut = self.cutter.judge(&view, &patch, self.monitor)?;
            Ok((cut.value + excess(&patch, &cut.take), cut))
        });
        let mut best: Option<(f64, usize, Cutting<D>)> = None;
        for (k, cut) in cuts.into_iter().enumerate() {
            let (value, cut) = cut?;
            if best.as_ref().is_none_or(|b| value < b.0) {
                best = Some((value, k, cut));
            }
        }
        let Some((_, k, judged)) = best else {
            return Ok(None);
        };
        let patch = self.cutter.propose(&chart, places[k]);
        let cutting = self
            .cutter
            .cut_judged(&view, &patch, judged, self.monitor)?;
        let before = self.cutter.value(&view, &patch) + worth * self.balance.excess(source);
        let after = cutting.value + excess(&patch, &cutting.take);
        Ok(Some(Found {
            centre,
            side,
            place: places[k],
            places: patch.places,
            gain: before - after,
            cutting,
            chart,
        }))
    }

    /// Applies a patch.
    pub(super) fn lay(&mut self, found: Found<D>) -> Result<()> {
        let Found {
            chart,
            centre,
            side,
            place,
            places,
            cutting,
            ..
        } = found;
        self.balance = self.balance.after(
            self.cutter.source(),
            &self.canvas,
            &chart.window.points,
            &places,
            &cutting.take,
        );
        let number = self.number(&chart, centre, place, side);
        let before = self.canvas.free;
        self.canvas.take(&chart, &places, &cutting, number);
        self.index.note(place, side);
        self.monitor.advance((before - self.canvas.free) as u64)
    }

    /// Returns the mean position of the empty points near a point.
    fn middle(&self, at: [i32; D]) -> [i32; D] {
        let reach = (self.side(at) * 0.5 * self.scale(at)) as i32;
        let window = self
            .canvas
            .window(at.map(|x| x - reach), at.map(|x| x + reach + 1));
        let Some(window) = window else { return at };
        let (mut sum, mut count) = ([0i64; D], 0i64);
        for (i, &p) in window.points.iter().enumerate() {
            if !self.canvas.covered(p) {
                let q = window.at(window.grid.point(i));
                (0..D).for_each(|a| sum[a] += i64::from(q[a]));
                count += 1;
            }
        }
        if count == 0 {
            at
        } else {
            sum.map(|s| s.div_euclid(count) as i32)
        }
    }

    fn all_covered(&self, centre: [i32; D], reach: i32) -> bool {
        let window = self
            .canvas
            .window(centre.map(|x| x - reach), centre.map(|x| x + reach + 1));
        window.is_none_or(|w| w.points.iter().all(|&p| self.canvas.covered(p)))
    }

    /// Returns the side of a patch around a point, in samples of the exemplar.
    fn side(&self, centre: [i32; D]) -> f32 {
        self.side_seen(self.scale(centre))
    }

    /// Returns the side of a patch for a given enlargement, in samples of the exemplar.
    fn side_seen(&self, scale: f32) -> f32 {
        let patch = self.options.patch;
        let shape = self.cutter.source().grid().shape();
        let shortest = shape.into_iter().min().unwrap_or(0) as f32;
        patch.max((SEEN[D - 2].min(patch) / scale).min(LARGEST * shortest))
    }

    /// Returns the 2 % quantile of the enlargement.
    fn least_scale(&self) -> f32 {
        let n = self.canvas.grid.len();
        let every = if matches!(self.frames, Frames::Constant(_)) {
            n
        } else {
            (n / PROBES).max(1)
        };
        let mut scales: Vec<f32> = (0..n)
            .step_by(every)
            .map(|p| enlargement(&self.frames.at(p)))
            .collect();
        scales.sort_by(f32::total_cmp);
        scales[scales.len() / 50]
    }
}

/// Returns the centres of patches along an axis.
fn along(n: usize, wrap: bool, step: f32) -> Vec<i32> {
    if wrap {
        let count = (n as f32 / step).ceil().max(1.0) as usize;
        return (0..count).map(|i| (i * n / count) as i32).collect();
    }
    let last = n as i32 - 1;
    let count = (last as f32 / step).ceil() as usize;
    (0..=count)
        .map(|i| ((i as f32 * step) as i32).min(last))
        .collect()
}
