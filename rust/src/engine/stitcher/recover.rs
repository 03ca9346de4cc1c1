//! Recovery: other patches are tried over the worst seams. These patches need not fit the content next to the seam.
//!
//! The method is by Kwatra et al., section 3.1. The costs of old seams count, so a patch is kept only if it reduces
//! the total.

use super::Stitching;
use super::chart::Chart;
use crate::Result;
use crate::foundation::grid::Grid;

/// Radius of the area around a seam where a patch need not fit, as a fraction of a patch's side.
const HOLE: f32 = 0.15;
/// Side of a patch that covers a seam, as a fraction of the side of other patches.
const SIDE: f32 = 0.6;

impl<const D: usize> Stitching<'_, D> {
    /// Covers the worst seams again. Their number is `patches` times the option `recover`, and `patch` is the side of
    /// the other patches.
    pub(super) fn recover(&mut self, patches: usize, patch: f32) -> Result<()> {
        let count = (self.options.recover * patches as f32).round() as usize;
        if count == 0 {
            return Ok(());
        }
        let side = (patch * SIDE).max(4.0);
        for centre in self.worst(count, patch)? {
            let Some(chart) =
                Chart::new(&self.canvas, self.frames, centre, side, self.options.bend)
            else {
                continue;
            };
            let hole = HOLE * patch * self.scale(centre);
            let known: Vec<bool> = (chart.window.grid.points().zip(&chart.mask))
                .map(|(point, &mask)| {
                    let at = chart.window.at(point);
                    let square = |a: usize| ((at[a] - centre[a]) as f32).powi(2);
                    mask && (0..D).map(square).sum::<f32>() > hole * hole
                })
                .collect();
            let found = self.find(chart, &known, centre, side, self.laid)?;
            self.laid += 1;
            if let Some(found) = found.filter(|f| f.gain > 1e-3) {
                self.lay(found)?;
            }
        }
        Ok(())
    }

    /// Returns the centres of the worst seams in descending order of their costs. Costs are summed over the cells of a
    /// lattice.
    fn worst(&self, count: usize, patch: f32) -> Result<Vec<[i32; D]>> {
        let grid = &self.canvas.grid;
        let side = ((2.0 * HOLE * patch) as usize).max(2);
        let cells = Grid::new(grid.shape().map(|n| n.div_ceil(side)), [false; D])?;
        let mut sums = vec![(0.0f64, [0.0f64; D]); cells.len()];
        for (point, seams) in grid.points().zip(&self.canvas.seams) {
            let cost: f64 = seams.iter().map(|&s| f64::from(s)).sum();
            if cost > 0.0 {
                let (sum, middle) = &mut sums[cells.index(point.map(|x| x / side))];
                *sum += cost;
                (0..D).for_each(|a| middle[a] += cost * point[a] as f64);
            }
        }
        let mut order: Vec<usize> = (0..sums.len()).filter(|&k| sums[k].0 > 0.0).collect();
        order.sort_by(|&a, &b| sums[b].0.total_cmp(&sums[a].0).then(a.cmp(&b)));
        let middle = |k: &usize| sums[*k].1.map(|x| (x / sums[*k].0).round() as i32);
        Ok(order.iter().take(count).map(middle).collect())
    }
}
