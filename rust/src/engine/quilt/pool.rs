//! The search for matches of a window: first at half the size, then exactly around the best few.

use super::{Quilt, Window};
use crate::Result;
use crate::foundation::par::Monitor;
use crate::kernels::patch_search::{Match, Pick, Query};

/// Number of matches whose penalties are computed. A lattice needs more, because many matches deviate from it.
const POOL: [usize; 2] = [48, 96];

impl Quilt<'_> {
    /// Finds matches that are some distance apart. Their positions are accurate to one pixel.
    pub(super) fn find_pool(
        &self,
        colours: &[f32],
        known: &[bool],
        window: &Window,
        monitor: &Monitor,
    ) -> Result<Vec<Match>> {
        let count = POOL[usize::from(self.options.regular)];
        let shape = self.options.patch;
        let Some(half) = &self.half else {
            return self.compare_all(colours, known, window, count);
        };
        let smaller = halve(colours, shape, self.channels);
        // A smaller pixel counts only if all four of its pixels are known.
        let weight = halve(&weigh(known), shape, 1);
        let weight: Vec<f32> = weight
            .iter()
            .map(|&w| f32::from(u8::from(w == 1.0)))
            .collect();
        let query = Query {
            patch: &smaller,
            weight: &weight,
            shape: shape.map(|n| n / 2),
        };
        let pick = Pick {
            count,
            separation: (query.shape[0].min(query.shape[1]) / 16).max(1),
            ratio: f64::INFINITY,
        };
        let mut pool = half.best(&query, &pick, monitor)?;
        // Convert the positions to the full size, where they are accurate to one pixel.
        for m in &mut pool {
            let most = self.most(m.exemplar);
            m.row = (2 * m.row).min(most[0]);
            m.column = (2 * m.column).min(most[1]);
        }
        Ok(pool)
    }

    /// Returns the last place of a patch in an image.
    fn most(&self, picture: usize) -> [usize; 2] {
        let shape = self.pictures[picture].shape;
        [0, 1].map(|a| shape[a] - self.options.patch[a])
    }

    /// Returns the best matches of a patch that keeps its coordinate along the fixed axis.
    fn compare_all(
        &self,
        colours: &[f32],
        known: &[bool],
        window: &Window,
        count: usize,
    ) -> Result<Vec<Match>> {
        let axis = self.options.fixed.unwrap_or(0);
        let place = window.corner()[axis];
        let mut every = Vec::new();
        for picture in 0..self.pictures.len() {
            for at in 0..=self.most(picture)[1 - axis] {
                every.push(if axis == 0 {
                    [picture, place, at]
                } else {
                    [picture, at, place]
                });
            }
        }
        let pick = Pick {
            count,
            separation: 1,
            ratio: f64::INFINITY,
        };
        let weight = weigh(known);
        self.whole
            .best_among(&self.query(colours, &weight), &every, &pick)
    }

    /// Returns a query at the full size.
    fn query<'a>(&self, colours: &'a [f32], weight: &'a [f32]) -> Query<'a> {
        Query {
            patch: colours,
            weight,
            shape: self.options.patch,
        }
    }

    /// Returns the best match within one pixel of each given match.
    pub(super) fn refine(
        &self,
        matches: &[Match],
        colours: &[f32],
        known: &[bool],
    ) -> Result<Vec<Match>> {
        if self.half.is_none() {
            return Ok(matches.to_vec());
        }
        let near = |m: &Match| -> Vec<[usize; 3]> {
            let most = self.most(m.exemplar);
            let reach = |at: usize, most: usize| at.saturating_sub(1)..=(at + 1).min(most);
            reach(m.row, most[0])
                .flat_map(|row| {
                    reach(m.column, most[1]).map(move |column| [m.exemplar, row, column])
                })
                .collect()
        };
        let places: Vec<Vec<[usize; 3]>> = matches.iter().map(near).collect();
        // Score each place once, although the neighbourhoods of close matches overlap.
        let mut every = places.concat();
        every.sort_unstable();
        every.dedup();
        let pick = Pick {
            count: every.len(),
            separation: 0,
            ratio: f64::INFINITY,
        };
        let weight = weigh(known);
        let scored = self
            .whole
            .best_among(&self.query(colours, &weight), &every, &pick)?;
        // Scores are sorted by cost, so the first one that is near is the best.
        let best = |near: &Vec<[usize; 3]>| {
            scored
                .iter()
                .copied()
                .find(|m| near.contains(&[m.exemplar, m.row, m.column]))
        };
        Ok(places
            .iter()
            .zip(matches)
            .map(|(near, m)| best(near).unwrap_or(*m))
            .collect())
    }
}

/// Returns the weight 1 for known pixels, and 0 for the others.
fn weigh(known: &[bool]) -> Vec<f32> {
    known.iter().map(|&k| f32::from(u8::from(k))).collect()
}

/// Returns an image at half the size. Each pixel is the mean of four; an odd last line is omitted.
pub(super) fn halve(image: &[f32], shape: [usize; 2], channels: usize) -> Vec<f32> {
    let ([rows, columns], width) = (shape.map(|n| n / 2), shape[1] * channels);
    let mut half = Vec::with_capacity(rows * columns * channels);
    for r in 0..rows {
        let (up, down) = image[2 * r * width..][..2 * width].split_at(width);
        for c in 0..columns {
            for k in 0..channels {
                let (i, j) = (2 * c * channels + k, (2 * c + 1) * channels + k);
                half.push((up[i] + up[j] + down[i] + down[j]) * 0.25);
            }
        }
    }
    half
}
