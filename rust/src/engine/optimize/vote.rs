//! The vote: one place for each point, chosen from the proposals of the windows around it.

use super::Level;
use crate::engine::appearance::{CHANNELS, Colour, UNIT};
use crate::foundation::fixed::{Place, add, apply, nearest};
use crate::foundation::libm::exp;

/// Standard deviation, in points, of the Gaussian that weights a proposal by the distance of its window.
const SIGMA: f64 = 2.0;
/// Largest extra cost of a proposal from a distant window, in units of the variance of colours.
const DISTANCE: f64 = 0.03;

/// A window that proposes a place: the step to its centre, the weight of its colour in units of 1/256, and its extra
/// cost.
struct Voter<const D: usize> {
    step: [i32; D],
    weight: i32,
    handicap: i64,
}

impl<const D: usize> Level<'_, D> {
    /// Assigns a proposal to each point that a pass corrects. The colour of this proposal is the nearest to the
    /// weighted mean of all proposals. The result is a copy, never an average.
    pub(super) fn vote(
        &self,
        places: &[Place<D>],
        matches: &[Place<D>],
        to: &mut [Place<D>],
        number: u32,
    ) {
        let voters = self.voters(self.options.vote as i32);
        // Factor from the units of appearance vectors to the units of colours.
        let unit = (256.0 * self.appearance.colour_variance() / f64::from(UNIT)) as i64;
        let all = 0..places.len();
        self.pass(places, all, to, number, Vec::new, |proposals, p| {
            self.elect(matches, &voters, unit, p, proposals)
        });
    }

    /// Returns the windows that vote for a point, with their weights.
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
    /// Returns the proposal that wins the vote for a point.
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
            // Carry the match of the window back to the point by the point's frame.
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
        // Choose the proposal with the colour nearest to the weighted mean.
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
