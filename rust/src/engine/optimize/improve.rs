//! The search for a better match of a point, among the matches of its neighbours and random ones.

use super::gather::{Eye, Seen};
use super::{FINEST, Level};
use crate::Result;
use crate::engine::appearance::distance;
use crate::foundation::fixed::{ONE, Place, add, apply, nearest};
use crate::foundation::hash::Noise;
use crate::foundation::par::Monitor;

/// Number of random matches around the best match. The first is drawn from the whole exemplar, the next from half of
/// it, then a quarter, and so on.
const DRAWS: usize = 6;

/// Values that are constant in a pass.
struct Search {
    noise: Noise,
    number: u32,
    /// The minimum improvement of a random match.
    limit: i64,
    /// The cost of each neighbour that shows another patch of the exemplar.
    coherence: i64,
}

impl<const D: usize> Level<'_, D> {
    /// Finds the match of every point that a pass corrects.
    pub(super) fn matches(
        &self,
        places: &[Place<D>],
        to: &mut [Place<D>],
        number: u32,
        monitor: &Monitor,
    ) -> Result<()> {
        // The spacing of a periodic exemplar is 0, but rounded colours still differ a little.
        let spacing = f64::from(self.appearance.spacing().max(FINEST));
        let search = Search {
            noise: Noise::new(self.options.seed).part(3),
            number,
            limit: (self.options.acceptance * spacing) as i64,
            coherence: (self.options.coherence * spacing) as i64,
        };
        // Work in slabs, so that the colours that `Seen` copies need little memory.
        let mut seen = Seen::default();
        let slab = self.slab();
        for start in (0..places.len()).step_by(slab) {
            let range = start..places.len().min(start + slab);
            seen.look(self, places, range.clone());
            self.pass(
                places,
                range,
                to,
                number,
                || Eye::new(self, &seen),
                |eye, p| self.improve(places, eye, p, &search),
            );
            monitor.advance(1)?;
        }
        Ok(())
    }

    #[inline(always)]
    /// Returns the best match for a point.
    fn improve(
        &self,
        places: &[Place<D>],
        eye: &mut Eye<'_, D>,
        p: usize,
        search: &Search,
    ) -> Place<D> {
        let (appearance, region) = (self.appearance, self.region);
        let feature = &eye.window(places, p);
        let point = region.grid.point(p);
        let frame = self.frames.at(p);
        // Start from the present place, so that equal matches change nothing.
        let mut best = places[p];
        let mut at = appearance.clamped(nearest(best));
        let cost_of = |at| i64::from(distance(feature, appearance.feature(at))) + self.asked(p, at);
        let mut least = cost_of(at);
        if self.options.exhaustive {
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
        // Collect the proposals of the neighbours. The adjacent ones come first.
        let mut proposals = [(best, at); 12];
        let (mut count, mut beside) = (0, 0);
        for far in 1..=self.options.reach {
            for axis in 0..D {
                for side in [-far, far] {
                    let mut step = [0; D];
                    step[axis] = side;
                    let Some(q) = region.step(point, step) else {
                        continue;
                    };
                    step[axis] = -side;
                    let place = add(places[q], apply(&frame, step));
                    if let Some(there) = appearance.inside(nearest(place)) {
                        proposals[count] = (place, there);
                        count += 1;
                    }
                }
            }
            if far == 1 {
                beside = count;
            }
        }
        // The coherence cost of a place depends on the number of adjacent proposals that belong to another patch.
        let apart = |place: Place<D>| -> i64 {
            if search.coherence == 0 {
                return 0;
            }
            let others = proposals[..beside]
                .iter()
                .filter(|&&(other, _)| !appearance.same(other, place));
            others.count() as i64 * search.coherence
        };
        least += apart(best);
        for &(place, there) in &proposals[..count] {
            if there != at {
                let cost = cost_of(there) + apart(place);
                if cost < least {
                    (best, at, least) = (place, there, cost);
                }
            }
        }
        // Stop here if a random match is unlikely to be better by the limit. Windows of the exemplar are rarely nearer
        // to each other than its spacing.
        if least <= search.limit + search.limit / 2 {
            return best;
        }
        let world = region.world(point);
        // Draw all candidates around one place, so that their costs are close in memory.
        let drawn: [Place<D>; DRAWS] = std::array::from_fn(|draw| {
            let words = search.noise.at(world, search.number << 8 | draw as u32);
            // The first draw is a sample near the value that the guide wants.
            if draw == 0
                && let Some(near) = self.guide.and_then(|g| g.near(p, words[0]))
            {
                return appearance.grid().point(near).map(|x| x as i32 * ONE);
            }
            std::array::from_fn(|axis| {
                let radius = (appearance.grid().shape()[axis] >> draw) as u64;
                let span = 2 * radius + 1;
                let shift = ((u64::from(words[axis]) * span) >> 32) as i32 - radius as i32;
                best[axis].wrapping_add(shift * ONE)
            })
        });
        let costs = drawn.map(|place| match appearance.inside(nearest(place)) {
            Some(there) => cost_of(there),
            None => i64::MAX / 2,
        });
        // Compute the coherence cost only if the match is the best without it.
        for (place, cost) in drawn.into_iter().zip(costs) {
            let cost = cost + search.limit;
            if cost < least {
                let cost = cost + apart(place);
                if cost < least {
                    (best, least) = (place, cost);
                }
            }
        }
        best
    }
}
