//! The cost of a patch at single exemplar coordinates, sample by sample.

use crate::engine::guide::{Guide, UNRELATED};
use crate::engine::stitcher::canvas::Canvas;
use crate::engine::stitcher::chart::Chart;
use crate::engine::stitcher::source::{Colour, Source};
use crate::foundation::fixed::nearest;

/// Maximum number of known points, and of points with a constraint, that are compared.
const POINTS: usize = 1024;

/// Known points and constraints of a patch.
pub(super) struct Fit<'a, const D: usize> {
    source: &'a Source<D>,
    /// Steps of points from the centre, and their colours.
    known: Vec<([i32; D], Colour)>,
    /// Steps of points from the centre, and their positions in the output.
    asked: Vec<([i32; D], usize)>,
    guide: Option<&'a Guide<'a>>,
}

impl<'a, const D: usize> Fit<'a, D> {
    /// Gathers the known points and the constraints of a chart.
    pub(super) fn new(
        source: &'a Source<D>,
        canvas: &Canvas<D>,
        chart: &Chart<D>,
        known: &[bool],
        guide: Option<&'a Guide<'a>>,
    ) -> Self {
        let points = &chart.window.points;
        let colour = |i: usize| source.look(canvas.places[points[i] as usize]).colour;
        let known = thin((0..points.len()).filter(|&i| known[i]).collect());
        let asks =
            |i: usize| chart.mask[i] && guide.is_some_and(|guide| guide.asks(points[i] as usize));
        let asked = thin((0..points.len()).filter(|&i| asks(i)).collect());
        let near = |i: usize| nearest(chart.steps[i]);
        Self {
            source,
            known: known.into_iter().map(|i| (near(i), colour(i))).collect(),
            asked: asked
                .into_iter()
                .map(|i| (near(i), points[i] as usize))
                .collect(),
            guide,
        }
    }

    /// Returns the best coordinates near `near`, and their cost. The search starts with steps of half a block of
    /// `level`, and halves the steps.
    pub(super) fn settle(
        &self,
        near: [i32; D],
        level: u32,
        bring: impl Fn([i32; D]) -> [i32; D],
    ) -> ([i32; D], f32) {
        let near = bring(near);
        let mut best = (near, self.cost(near));
        for level in (0..level).rev() {
            let middle = best.0;
            for k in 0..3usize.pow(D as u32) {
                let mut rest = k;
                let at = bring(middle.map(|x| {
                    let step = (rest % 3) as i32 - 1;
                    rest /= 3;
                    x + (step << level)
                }));
                if at != middle {
                    let cost = self.cost(at);
                    if cost < best.1 {
                        best = (at, cost);
                    }
                }
            }
        }
        best
    }

    /// Returns the cost of a patch with its centre at a sample, in the units of [`super::Index`].
    fn cost(&self, centre: [i32; D]) -> f32 {
        let mut cost = 0.0;
        if !self.known.is_empty() {
            let apart = |(step, colour): &([i32; D], Colour)| {
                let there = self.source.colour_at(self.sample(*step, centre));
                (there.iter().zip(colour).map(|(a, b)| (a - b) * (a - b))).sum::<f32>()
            };
            let sum: f32 = self.known.iter().map(apart).sum();
            cost += sum / (self.known.len() * self.source.channels()) as f32;
        }
        if let Some(guide) = self.guide.filter(|_| !self.asked.is_empty()) {
            let asked = |(step, p): &([i32; D], usize)| guide.cost(*p, self.sample(*step, centre));
            let sum: i64 = self.asked.iter().map(asked).sum();
            cost += 2.0 * sum as f32 / (self.asked.len() as f32 * UNRELATED);
        }
        cost
    }

    #[inline(always)]
    fn sample(&self, step: [i32; D], centre: [i32; D]) -> usize {
        let grid = self.source.grid();
        (0..D).fold(0, |at, a| {
            at * grid.shape()[a] + grid.resolve(a, (step[a] + centre[a]) as isize)
        })
    }
}

/// Returns evenly spaced values. The step is odd, so that it does not select the same columns in every row.
fn thin(all: Vec<usize>) -> Vec<usize> {
    let every = all.len().div_ceil(POINTS) | 1;
    all.into_iter().step_by(every).collect()
}
