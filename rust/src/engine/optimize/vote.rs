//! One coordinate for each point, out of those that the windows around it propose.

use super::Level;
use crate::engine::appearance::{CHANNELS, Colour, UNIT};
use crate::foundation::fixed::{Place, add, apply, nearest};
use crate::foundation::libm::exp;

/// Standard deviation of a proposal's weight over the distance of its window, in points.
const SIGMA: f64 = 2.0;
/// How much a proposal from far away must be nearer to the mean, as a share of the variance of colours.
const DISTANCE: f64 = 0.03;

/// A window that proposes: the step to its centre, and the weight of what it says in 1/256.
struct Voter<const D: usize> {
    step: [i32; D],
    weight: i32,
    handicap: i64,
}

impl<const D: usize> Level<'_, D> {
    /// Takes, for each point that a pass corrects, the proposal nearest in colour to the weighted mean of all of them: a
    /// copy, never an average.
    pub(super) fn vote(
        &self,
        places: &[Place<D>],
        matches: &[Place<D>],
        to: &mut [Place<D>],
        number: u32,
    ) {
        let voters = self.voters(self.options.vote as i32);
        // From the units of vectors to those of colours.
        let unit = (256.0 * self.appearance.colour_variance() / f64::from(UNIT)) as i64;
        let all = 0..places.len();
        self.pass(places, all, to, number, Vec::new, |proposals, p| {
            self.elect(matches, &voters, unit, p, proposals)
        });
    }

    fn voters(&self, radius: i32) -> Vec<Voter<D>> {
        let variance = self.appearance.colour_variance();
        self.appearance
            .offsets()
            .iter()
            .filter(|o| o.iter().all(|x| x.abs() <= radius))
            .map(|&step| {
                let square: i32 = step.iter().map(|x| x * x).sum();
                let weight = exp(-f64::from(square) / (2.0 * SIGMA * SIGMA));
                Voter {
                    step,
                    weight: (256.0 * weight).round() as i32,
                    handicap: (DISTANCE * (1.0 - weight) * variance) as i64,
                }
            })
            .collect()
    }

    #[inline(always)]
    fn elect(
        &self,
        matches: &[Place<D>],
        voters: &[Voter<D>],
        unit: i64,
        p: usize,
        proposals: &mut Vec<(Place<D>, Colour, i64)>,
    ) -> Place<D> {
        let appearance = self.appearance;
        let point = self.region.grid.point(p);
        let frame = self.frames.at(p);
        proposals.clear();
        let mut sum = [0i32; CHANNELS];
        let mut total = 0;
        for voter in voters {
            let Some(q) = self.region.step(point, voter.step) else {
                continue;
            };
            let place = add(matches[q], apply(&frame, voter.step.map(|x| -x)));
            if let Some(at) = appearance.inside(nearest(place)) {
                let colour = appearance.colour(at);
                for c in 0..CHANNELS {
                    sum[c] += voter.weight * i32::from(colour[c]);
                }
                total += voter.weight;
                let asked = (self.asked(p, at) * unit) >> 8;
                proposals.push((place, colour, voter.handicap + asked));
            }
        }
        let mut best = (i64::MAX, matches[p]);
        for &(place, colour, handicap) in proposals.iter() {
            let mut cost = handicap;
            for c in 0..CHANNELS {
                let d = i64::from(colour[c]) - i64::from(sum[c] / total.max(1));
                cost += d * d;
            }
            if cost < best.0 {
                best = (cost, place);
            }
        }
        best.1
    }
}
