//! Balance of classes: classes that the canvas shows too often cost more, and rare classes cost less.
//!
//! A cut is cheapest in a uniform area. Without this counterweight the rare features of an exemplar become rarer.

use super::canvas::Canvas;
use super::source::Source;
use crate::foundation::fixed::Place;

/// Number of points of each class that a canvas shows.
#[derive(Clone)]
pub(super) struct Balance {
    counts: Vec<i64>,
    covered: i64,
}

impl Balance {
    pub(super) fn new<const D: usize>(source: &Source<D>, canvas: &Canvas<D>) -> Self {
        let mut this = Self {
            counts: vec![0; source.shares().len()],
            covered: 0,
        };
        for p in 0..canvas.grid.len() {
            if canvas.covered(p as u32) {
                this.add(source.class(canvas.places[p]), 1);
                this.covered += 1;
            }
        }
        this
    }

    #[inline(always)]
    fn add(&mut self, class: usize, by: i64) {
        if let Some(count) = self.counts.get_mut(class) {
            *count += by;
        }
    }

    /// Returns the balance after points have taken a patch.
    pub(super) fn after<const D: usize>(
        &self,
        source: &Source<D>,
        canvas: &Canvas<D>,
        points: &[u32],
        places: &[Place<D>],
        take: &[bool],
    ) -> Self {
        let mut next = Self {
            counts: self.counts.clone(),
            covered: self.covered,
        };
        if next.counts.is_empty() {
            return next;
        }
        for (i, &p) in points.iter().enumerate() {
            if take[i] {
                if canvas.covered(p) {
                    next.add(source.class(canvas.places[p as usize]), -1);
                } else {
                    next.covered += 1;
                }
                next.add(source.class(places[i]), 1);
            }
        }
        next
    }

    /// Returns the number of points that must change their class, so that all classes have the same shares as in the
    /// exemplar.
    pub(super) fn excess<const D: usize>(&self, source: &Source<D>) -> f64 {
        let wrong =
            |(&count, &share): (&i64, &f64)| (count as f64 - share * self.covered as f64).abs();
        self.counts
            .iter()
            .zip(source.shares())
            .map(wrong)
            .sum::<f64>()
            / 2.0
    }
}
