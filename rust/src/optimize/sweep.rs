//! Better matches, from the neighbours and drawn.

use std::ops::Range;

use super::{CHUNK, Level};
use crate::appearance::{Feature, distance};
use crate::fixed::{ONE, Place, add, apply, nearest, sub};
use crate::hash::Noise;
use crate::par;

/// Matches drawn around the best: within the exemplar, then a half of it, a quarter and so on.
const DRAWS: u32 = 6;

/// Proposals that differ by less are of one piece of the exemplar: rounding moves them by half a sample.
const SAME: i32 = ONE * 3 / 4;

/// The noise of one iteration.
pub(super) struct Draws {
    pub(super) noise: Noise,
    pub(super) iteration: u32,
    /// What a drawn match must be better by.
    pub(super) limit: i64,
    /// What each neighbour costs whose piece of the exemplar is another.
    pub(super) unity: i64,
    pub(super) exhaustive: bool,
}

impl<const D: usize> Level<'_, D> {
    /// Writes the matches of the points of some planes into `to`, from those in `from` and the points' own `features`.
    pub(super) fn sweep(
        &self,
        from: &[Place<D>],
        features: &[Feature],
        planes: &Range<usize>,
        to: &mut [Place<D>],
        reach: i32,
        draws: &Draws,
    ) {
        let plane = self.plane();
        let first = planes.start * plane;
        let to = &mut to[first..planes.end * plane];
        par::chunks_mut(to, CHUNK, |chunk, to| {
            for (i, place) in to.iter_mut().enumerate() {
                let k = chunk * CHUNK + i;
                *place = self.improve(from, &features[k], first + k, reach, draws);
            }
        });
    }

    #[inline(always)]
    fn improve(
        &self,
        from: &[Place<D>],
        feature: &Feature,
        p: usize,
        reach: i32,
        draws: &Draws,
    ) -> Place<D> {
        let appearance = self.appearance;
        let point = self.region.grid.point(p);
        let frame = self.frames.at(p);
        let mut best = from[p];
        let mut at = appearance.clamped(nearest(best));
        let cost_of = |at| i64::from(distance(feature, appearance.feature(at))) + self.asked(p, at);
        let mut least = cost_of(at);
        if draws.exhaustive && reach == 1 {
            let centres = appearance.valid_centres();
            for k in 0..centres.len() {
                let centre = centres.get(k);
                let there = appearance.clamped(centre);
                let cost = cost_of(there);
                if cost < least {
                    (best, at, least) = (centre.map(|x| x * ONE), there, cost);
                }
            }
        }
        let mut proposals = [(best, at); 6];
        let mut count = 0;
        for axis in 0..D {
            for side in [-reach, reach] {
                let mut step = [0; D];
                step[axis] = side;
                let Some(q) = self.region.step(point, step) else {
                    continue;
                };
                step[axis] = -side;
                let place = add(from[q], apply(&frame, step));
                if let Some(there) = appearance.inside(nearest(place)) {
                    proposals[count] = (place, there);
                    count += 1;
                }
            }
        }
        let proposals = &proposals[..count];
        let apart = |place: Place<D>| -> i64 {
            if draws.unity == 0 {
                return 0;
            }
            let others = proposals
                .iter()
                .filter(|(other, _)| sub(*other, place).iter().any(|d| d.abs() > SAME));
            others.count() as i64 * draws.unity
        };
        least += apart(best);
        for &(place, there) in proposals {
            if there != at {
                let cost = cost_of(there) + apart(place);
                if cost < least {
                    (best, at, least) = (place, there, cost);
                }
            }
        }
        // None that is drawn can be better by enough.
        if least <= draws.limit {
            return best;
        }
        let world = self.region.world(point);
        for draw in 0..DRAWS {
            let count = draws.iteration << 8 | (reach as u32) << 4 | draw;
            let words = draws.noise.at(world, count);
            let mut place = best;
            for axis in 0..D {
                let radius = (appearance.grid().shape()[axis] >> draw) as u64;
                let span = 2 * radius + 1;
                let shift = ((u64::from(words[axis]) * span) >> 32) as i32 - radius as i32;
                place[axis] += shift * ONE;
            }
            if let Some(there) = appearance.inside(nearest(place)) {
                let cost = cost_of(there) + apart(place) + draws.limit;
                if cost < least {
                    (best, least) = (place, cost);
                }
            }
        }
        best
    }
}
