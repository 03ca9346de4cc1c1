//! Healing: torn elements are completed, or replaced by their surroundings.
//!
//! An instance is the visible part of one element of the exemplar in one patch. Its cost is proportional to the number
//! of its missing points or of its visible points, whichever is smaller. A complete element and an absent element cost
//! nothing. Moves are cuts in small windows. A move is kept if the sum of the costs of seams and instances decreases.

use std::collections::{HashMap, HashSet, VecDeque};

use super::canvas::{Window, is_patch};
use super::chart::{Chart, flood};
use super::cut::Cutting;
use super::runs::widen;
use super::{Patch, Stitching};
use crate::Result;
use crate::foundation::fixed::{Frames, Place};
use crate::foundation::libm::root;
use crate::foundation::par;

/// Cost of a missing point of an instance.
const LACK: f64 = 0.3;
/// Number of rounds over all instances.
const ROUNDS: usize = 2;
/// Minimum fraction of the points of an element that makes an instance complete.
const WHOLE: f64 = 0.97;
/// Minimum fraction of points for an attempt to complete an instance.
const GROW: f64 = 0.35;
/// Fraction of points below which the removal of an instance is tried. From `GROW` to `DROP`, both are tried.
const DROP: f64 = 0.7;
/// Number of instances that are examined at the same time.
const BATCH: usize = 4;
/// Maximum number of neighbouring patches that are tried to replace an instance.
const NEIGHBOURS: usize = 4;

/// A patch and an element of the exemplar.
type Key = (u32, u32);

/// The points that show one element in one patch.
struct Instance<const D: usize> {
    key: Key,
    /// One point of the instance, and the ends of its box relative to that point.
    anchor: [usize; D],
    low: [i32; D],
    high: [i32; D],
}

/// A change of the canvas that reduces the costs.
struct Move<const D: usize> {
    gain: f64,
    patch: u32,
    chart: Chart<D>,
    cutting: Cutting<D>,
    proposal: Vec<Place<D>>,
    counts: Vec<(Key, i64)>,
}

impl<const D: usize> Move<D> {
    /// Returns whether two moves share points.
    fn meets(&self, other: &Self) -> bool {
        let mine: HashSet<u32> = self.chart.window.points.iter().copied().collect();
        other.chart.window.points.iter().any(|p| mine.contains(p))
    }
}

impl<const D: usize> Stitching<'_, D> {
    /// Heals torn elements, and returns the number of moves.
    pub(super) fn heal(&mut self) -> Result<usize> {
        let mut moves = 0;
        if !self.cutter.source().has_elements() {
            return Ok(0);
        }
        for _ in 0..ROUNDS {
            let (instances, mut counts) = self.instances();
            let mut torn: Vec<(f64, usize)> = (0..instances.len())
                .filter(|&k| {
                    !self.at_an_end(&instances[k]) && self.share(instances[k].key, &counts) < WHOLE
                })
                .map(|k| (self.lack(instances[k].key, counts[&instances[k].key]), k))
                .collect();
            torn.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            let mut torn: VecDeque<usize> = torn.into_iter().map(|(_, k)| k).collect();
            while !torn.is_empty() {
                self.monitor.check()?;
                let batch: Vec<usize> = torn.drain(..BATCH.min(torn.len())).collect();
                let found = par::map(batch.len(), |i| {
                    self.best_move(&instances[batch[i]], &counts)
                });
                let (mut done, mut again): (Vec<Move<D>>, Vec<usize>) = (Vec::new(), Vec::new());
                for (&k, found) in batch.iter().zip(found) {
                    let Some(best) = found? else { continue };
                    // Examine instances again if another move of the batch has changed their surroundings.
                    if done.iter().any(|other| other.meets(&best)) {
                        again.push(k);
                        continue;
                    }
                    self.apply(&best);
                    for (key, change) in &best.counts {
                        *counts.entry(*key).or_insert(0) += change;
                    }
                    moves += 1;
                    done.push(best);
                }
                again.into_iter().rev().for_each(|k| torn.push_front(k));
            }
        }
        Ok(moves)
    }

    /// Returns the instance that a point shows, if any.
    #[inline(always)]
    fn instance(&self, patch: u32, place: Place<D>) -> Option<Key> {
        if !is_patch(patch) {
            return None;
        }
        let element = self.cutter.source().element(place);
        (element > 0).then_some((patch, element))
    }

    /// Returns all instances, and the number of points of each.
    fn instances(&self) -> (Vec<Instance<D>>, HashMap<Key, i64>) {
        let canvas = &self.canvas;
        let mut all: Vec<Instance<D>> = Vec::new();
        let mut numbers: HashMap<Key, usize> = HashMap::new();
        let mut counts: HashMap<Key, i64> = HashMap::new();
        for (p, point) in canvas.grid.points().enumerate() {
            let Some(key) = self.instance(canvas.patches[p], canvas.places[p]) else {
                continue;
            };
            *counts.entry(key).or_insert(0) += 1;
            let number = *numbers.entry(key).or_insert_with(|| {
                all.push(Instance {
                    key,
                    anchor: point,
                    low: [0; D],
                    high: [0; D],
                });
                all.len() - 1
            });
            let instance = &mut all[number];
            for a in 0..D {
                let n = canvas.grid.shape()[a] as i32;
                // Measure from the anchor the short way round, because an instance may cross the end of a periodic
                // axis.
                let mut step = point[a] as i32 - instance.anchor[a] as i32;
                if canvas.grid.wrap()[a] {
                    step = (step + n / 2).rem_euclid(n) - n / 2;
                }
                instance.low[a] = instance.low[a].min(step);
                instance.high[a] = instance.high[a].max(step);
            }
        }
        (all, counts)
    }

    /// Returns whether an instance touches an end of the canvas, so that it cannot be completed.
    fn at_an_end(&self, instance: &Instance<D>) -> bool {
        let grid = &self.canvas.grid;
        (0..D).any(|a| {
            let at = instance.anchor[a] as i32;
            !grid.wrap()[a]
                && (at + instance.low[a] <= 0
                    || at + instance.high[a] >= grid.shape()[a] as i32 - 1)
        })
    }

    /// Returns the number of points of the complete instance.
    fn size(&self, (patch, element): Key) -> f64 {
        f64::from(self.cutter.source().size(element)) * self.patches[patch as usize].scale()
    }

    fn share(&self, key: Key, counts: &HashMap<Key, i64>) -> f64 {
        counts.get(&key).copied().unwrap_or(0) as f64 / self.size(key).max(1.0)
    }

    /// Returns the cost of an instance that shows `count` points.
    fn lack(&self, key: Key, count: i64) -> f64 {
        LACK * (count as f64).min((self.size(key) - count as f64).max(0.0))
    }

    /// Returns the best move that completes or removes an instance, or nothing if all moves increase the costs.
    fn best_move(
        &self,
        instance: &Instance<D>,
        counts: &HashMap<Key, i64>,
    ) -> Result<Option<Move<D>>> {
        let share = self.share(instance.key, counts);
        if share <= 0.0 || share >= WHOLE {
            return Ok(None);
        }
        // A nearly complete instance may be completed, and a small instance may be replaced by a neighbouring patch.
        let mut options = Vec::new();
        if share >= GROW {
            options.push((instance.key.0, true));
        }
        if share < DROP {
            for patch in self.neighbours(instance) {
                options.push((patch, false));
            }
        }
        let made = par::map(options.len(), |k| {
            let (patch, grow) = options[k];
            self.attempt(instance, patch, grow, counts)
        });
        let mut best: Option<Move<D>> = None;
        for attempt in made {
            if let Some(found) = attempt?
                && best.as_ref().is_none_or(|b| found.gain > b.gain)
            {
                best = Some(found);
            }
        }
        Ok(best)
    }

    /// Returns the patches around an instance, ordered by their number of points.
    fn neighbours(&self, instance: &Instance<D>) -> Vec<u32> {
        let Some(window) = self.bounds(instance, 5) else {
            return Vec::new();
        };
        let mut found: Vec<(u32, usize)> = Vec::new();
        for &p in &window.points {
            let patch = self.canvas.patches[p as usize];
            if !is_patch(patch) || patch == instance.key.0 {
                continue;
            }
            match found.iter_mut().find(|f| f.0 == patch) {
                Some(f) => f.1 += 1,
                None => found.push((patch, 1)),
            }
        }
        found.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
        found.iter().take(NEIGHBOURS).map(|f| f.0).collect()
    }

    fn bounds(&self, instance: &Instance<D>, margin: i32) -> Option<Window<D>> {
        let at = |a: usize| instance.anchor[a] as i32;
        self.canvas.window(
            std::array::from_fn(|a| at(a) + instance.low[a] - margin),
            std::array::from_fn(|a| at(a) + instance.high[a] + margin + 1),
        )
    }

    /// Returns a move if it reduces the costs.
    fn attempt(
        &self,
        instance: &Instance<D>,
        patch: u32,
        grow: bool,
        counts: &HashMap<Key, i64>,
    ) -> Result<Option<Move<D>>> {
        let margin = if grow {
            // The window is wide enough to contain the rest of the element.
            let reach = root::<D>(self.size(instance.key)) * 1.4;
            let longest = (0..D)
                .map(|a| instance.high[a] - instance.low[a])
                .max()
                .unwrap_or(0);
            (reach as i32 - longest).max(4)
        } else {
            5
        };
        let Some(window) = self.bounds(instance, margin) else {
            return Ok(None);
        };
        let to: &Patch<D> = &self.patches[patch as usize];
        let Some(chart) = self.chart_of(to, window) else {
            return Ok(None);
        };
        let proposal = self.cutter.propose(&chart, to.place);
        let (canvas, n) = (&self.canvas, chart.window.grid.len());
        let own: Vec<bool> = (0..n)
            .map(|i| {
                let p = chart.window.points[i] as usize;
                self.instance(canvas.patches[p], canvas.places[p]) == Some(instance.key)
            })
            .collect();
        // The patch must show at least the rest of the element, or cover all that is visible of it.
        let core = if grow {
            // Find the points of the complete element, and extend them by one point to keep its outline.
            let whole: Vec<bool> = (0..n)
                .map(|i| {
                    chart.mask[i]
                        && self.cutter.source().element(proposal.places[i]) == instance.key.1
                })
                .collect();
            let from: Vec<usize> = (0..n).filter(|&i| own[i]).collect();
            let mut core = widen(
                &chart.window.grid,
                &flood(&chart.window.grid, &whole, &from),
            );
            core.iter_mut().zip(&chart.mask).for_each(|(c, m)| *c &= m);
            core
        } else {
            if (0..n).any(|i| own[i] && !chart.mask[i]) {
                return Ok(None);
            }
            own
        };
        if !core.contains(&true) {
            return Ok(None);
        }
        // Insert the patch on trial, and count the points that each instance gains or loses.
        let view = (self.cutter).view(canvas, &chart.window, &chart.mask, &core);
        let cutting = self.cutter.cut(&view, &proposal, self.monitor)?;
        let mut changes: Vec<(Key, i64)> = Vec::new();
        let mut change = |key: Option<Key>, by: i64| {
            if let Some(key) = key {
                match changes.iter_mut().find(|c| c.0 == key) {
                    Some(c) => c.1 += by,
                    None => changes.push((key, by)),
                }
            }
        };
        for i in 0..n {
            if cutting.take[i] {
                let p = chart.window.points[i] as usize;
                change(self.instance(canvas.patches[p], canvas.places[p]), -1);
                change(self.instance(patch, proposal.places[i]), 1);
            }
        }
        // The move is worth it if the seams, the balance and the instances together cost less.
        let source = self.cutter.source();
        let balance = self.balance.after(
            source,
            canvas,
            &chart.window.points,
            &proposal.places,
            &cutting.take,
        );
        let worth = f64::from(self.options.balance / self.options.patch);
        let mut gain = self.cutter.value(&view, &proposal) - cutting.value;
        gain += worth * (self.balance.excess(source) - balance.excess(source));
        for &(key, by) in &changes {
            let now = counts.get(&key).copied().unwrap_or(0);
            gain += self.lack(key, now) - self.lack(key, now + by);
        }
        let places = proposal.places;
        Ok((gain > 1e-3).then_some(Move {
            gain,
            patch,
            chart,
            cutting,
            proposal: places,
            counts: changes,
        }))
    }

    /// Returns the chart of a patch in a window.
    fn chart_of(&self, patch: &Patch<D>, window: Window<D>) -> Option<Chart<D>> {
        let frames: Frames<'_, D> = self.frames;
        let mut chart = if patch.rigid {
            Chart::affine(
                window,
                &self.canvas,
                frames,
                patch.frame,
                patch.centre,
                None,
            )
        } else if self.canvas.part {
            // A bent patch depends on the field around its centre, which may be outside this part.
            return None;
        } else {
            let mut chart = Chart::new(&self.canvas, frames, patch.centre, patch.side, true)?;
            for i in 0..chart.mask.len() {
                chart.mask[i] &= window.holds(chart.window.at(chart.window.grid.point(i)));
            }
            chart
        };
        let grid = self.cutter.source().grid();
        for (mask, step) in chart.mask.iter_mut().zip(&chart.steps) {
            let place: Place<D> = std::array::from_fn(|a| step[a].wrapping_add(patch.place[a]));
            *mask &= super::inside(grid, place);
        }
        Some(chart)
    }

    fn apply(&mut self, best: &Move<D>) {
        self.balance = self.balance.after(
            self.cutter.source(),
            &self.canvas,
            &best.chart.window.points,
            &best.proposal,
            &best.cutting.take,
        );
        let chart = &best.chart;
        self.canvas
            .take(chart, &best.proposal, &best.cutting, best.patch);
    }
}
