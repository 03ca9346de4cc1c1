//! Two images on one canvas: each pixel takes one of them, so that the seam between them is least
//! visible.
//!
//! Kwatra et al., *Graphcut textures*, SIGGRAPH 2003. Pixels that only one image covers take this
//! image. In the overlap:
//!
//! 1. pixels of a core are tied to its image;
//! 2. other pixels next to a pixel that only one image covers are tied to this image, and to A if they have neighbours
//!    of both kinds;
//! 3. the remaining pixels minimise the sum of the costs of the cut edges ([`super::cost`]); among
//!    equal sums, as few pixels as possible take B.
//!
//! If B has a single core on a plane and A surrounds it, the seam is a shortest closed path
//! ([`super::planar::ring`]). Otherwise it is computed by maximum flow ([`super::maxflow`]).
//!
//! Departures from the paper:
//!
//! - The existing image A has priority at pixels with neighbours of both kinds.
//! - A `penalty` keeps seams away from chosen pixels.
//! - An old seam is a pairwise term with one cost for each labelling. It follows Kolmogorov and
//!   Zabih, *What energy functions can be minimized via graph cuts?*, PAMI 2004. Kwatra's extra
//!   node gives the same cuts with more nodes.

use super::cost::{FARTHEST, Pair, capacity, scale};
use super::links;
use super::maxflow::{Graph, Solver};
use super::overlap::Window;
pub use super::overlap::{OldSeams, Overlap};
use super::planar::ring::{Ring, Side, least_ring};
use crate::foundation::grid::Grid;
use crate::foundation::memory;
use crate::foundation::par::Monitor;
use crate::{Error, Result};

/// The image that each pixel takes.
#[derive(Debug, Clone, PartialEq)]
pub struct Stitched {
    /// Flags of the pixels that take B. The others take A if A covers them, and are empty
    /// otherwise.
    pub b: Vec<bool>,
    /// Sum of the costs of the seam's edges inside the overlap, including old seams that stay.
    pub value: f64,
    /// Number of edges in the overlap whose ends take different images.
    pub edges: usize,
}

/// Returns the least visible seam of one overlap. For many overlaps, reuse a [`Stitcher`].
pub fn cut<const D: usize>(overlap: &Overlap<'_, D>, monitor: &Monitor) -> Result<Stitched> {
    Stitcher::default().cut(overlap, monitor)
}

/// Costs of a pair of neighbours. `kept` applies if both keep A, and `ab` if the first keeps A and the second takes B.
/// `ba` applies if the first takes B and the second keeps A. If both take B, the cost is 0.
#[derive(Debug, Clone, Copy, Default)]
struct Costs {
    kept: f32,
    ab: f32,
    ba: f32,
}

/// Windows with fewer pixels than this go to the general solver, which is as fast for them and reuses its workspace.
const SMALL: usize = 64 * 64;

/// A workspace for stitching. After the first cut of a size, further cuts allocate only their
/// result.
#[derive(Debug)]
pub struct Stitcher<const D: usize> {
    solver: Solver<D>,
    /// Canvas index of each point of the window.
    canvas: Vec<u32>,
    differences: Vec<f32>,
    sides: Vec<Side>,
    costs: [Vec<Costs>; D],
    terminal: Vec<i32>,
    forward: [Vec<i32>; D],
    backward: [Vec<i32>; D],
}

impl<const D: usize> Default for Stitcher<D> {
    fn default() -> Self {
        Self {
            solver: Solver::default(),
            canvas: Vec::new(),
            differences: Vec::new(),
            sides: Vec::new(),
            costs: std::array::from_fn(|_| Vec::new()),
            terminal: Vec::new(),
            forward: std::array::from_fn(|_| Vec::new()),
            backward: std::array::from_fn(|_| Vec::new()),
        }
    }
}

impl<const D: usize> Stitcher<D> {
    /// Returns the least visible seam of an overlap.
    ///
    /// # Errors
    /// The sizes of the arrays do not match the grid, or values in the overlap are not finite. A penalty or a cost of
    /// old seams is negative or not finite. A core is outside its image or overlaps the other core.
    pub fn cut(&mut self, overlap: &Overlap<'_, D>, monitor: &Monitor) -> Result<Stitched> {
        let cut = self.cut_within(overlap, f64::INFINITY, monitor)?;
        Ok(cut.unwrap_or_else(|| unreachable!("no seam costs more")))
    }

    /// Returns the least visible seam of an overlap. Without old seams, the result may be `None` if
    /// the seam costs more than `bound`.
    pub(crate) fn cut_within(
        &mut self,
        overlap: &Overlap<'_, D>,
        bound: f64,
        monitor: &Monitor,
    ) -> Result<Option<Stitched>> {
        overlap.check()?;
        memory::room("the graph of the seam", overlap.grid.len(), 80 * D)?;
        // Pixels that only B covers take B.
        let mut b: Vec<bool> = overlap
            .mask_b
            .iter()
            .zip(overlap.mask_a)
            .map(|(&b, &a)| b && !a)
            .collect();
        let Some(window) = overlap.window()? else {
            return Ok(Some(Stitched {
                b,
                value: 0.0,
                edges: 0,
            }));
        };
        let largest = match overlap.channels {
            1 => self.weigh::<1>(overlap, &window),
            3 => self.weigh::<3>(overlap, &window),
            _ => self.weigh::<0>(overlap, &window),
        }?;
        let scale = scale(largest);
        self.capacities(overlap, &window, scale);
        // Rounding may add half a step to each cut edge, and a point has D edges.
        let rounded = (D * window.grid.len()) as f64;
        let most = match overlap.old {
            None => (bound * scale + rounded) as i64,
            Some(_) => i64::MAX,
        };
        let sink = match self.ring(overlap, &window.grid, monitor)? {
            Some(inside) => inside,
            None => {
                let graph = Graph {
                    grid: window.grid,
                    terminal: &self.terminal,
                    forward: std::array::from_fn(|axis| &self.forward[axis][..]),
                    backward: std::array::from_fn(|axis| &self.backward[axis][..]),
                };
                let Some(cut) = self.solver.min_cut_within(&graph, most, monitor)? else {
                    return Ok(None);
                };
                cut.sink
            }
        };
        // Copy the labels of the overlap, and sum the costs of the seam.
        let inside: Vec<bool> = self.differences.iter().map(|d| !d.is_nan()).collect();
        for ((&at, &inside), &sink) in self.canvas.iter().zip(&inside).zip(&sink) {
            if inside {
                b[at as usize] = sink;
            }
        }
        let (mut value, mut edges) = (0.0, 0);
        for axis in 0..D {
            links(&window.grid, axis, |i, j| {
                if inside[i] && inside[j] {
                    let costs = self.costs[axis][i];
                    value += f64::from(match (sink[i], sink[j]) {
                        (false, false) => costs.kept,
                        (false, true) => costs.ab,
                        (true, false) => costs.ba,
                        (true, true) => 0.0,
                    });
                    edges += usize::from(sink[i] != sink[j]);
                }
            });
        }
        Ok(Some(Stitched { b, value, edges }))
    }

    /// Returns the pixels that take B if the seam is a closed path around a core. This requires a
    /// plane without old seams, because their costs depend on the direction.
    fn ring(
        &self,
        overlap: &Overlap<'_, D>,
        grid: &Grid<D>,
        monitor: &Monitor,
    ) -> Result<Option<Vec<bool>>> {
        let (&[rows, columns], [along, across]) = (&grid.shape()[..], &self.forward[..]) else {
            return Ok(None);
        };
        if grid.len() < SMALL || grid.wrap().contains(&true) || overlap.old.is_some() {
            return Ok(None);
        }
        let ring = Ring {
            rows,
            columns,
            sides: &self.sides,
            across,
            along,
        };
        least_ring(&ring, monitor)
    }

    /// Computes the costs of all edges of the overlap in the window. Returns the largest cost.
    fn weigh<const C: usize>(
        &mut self,
        overlap: &Overlap<'_, D>,
        window: &Window<D>,
    ) -> Result<f64> {
        let pair = Pair::<C> {
            a: overlap.a,
            b: overlap.b,
            channels: overlap.channels,
        };
        let n = window.grid.len();
        self.canvas.clear();
        self.canvas
            .extend((0..n).map(|i| window.canvas(i, &overlap.grid)));
        self.differences.clear();
        self.differences.resize(n, f32::NAN);
        for (difference, &at) in self.differences.iter_mut().zip(&self.canvas) {
            let at = at as usize;
            if overlap.mask_a[at] && overlap.mask_b[at] {
                *difference = pair.difference(at);
                if !(0.0..=FARTHEST).contains(difference) {
                    return Err(Error::value(
                        "a, b",
                        format!(
                            "must be finite and not too far apart in the overlap, which fails at {:?}",
                            overlap.grid.point(at)
                        ),
                    ));
                }
            }
        }
        // Compute the cost of each edge inside the overlap.
        let (mut largest, mut finite) = (0.0f32, true);
        for axis in 0..D {
            self.costs[axis].clear();
            self.costs[axis].resize(n, Costs::default());
            links(&window.grid, axis, |i, j| {
                let sum = self.differences[i] + self.differences[j];
                if sum.is_nan() {
                    return;
                }
                let (s, t) = (self.canvas[i] as usize, self.canvas[j] as usize);
                let weight = overlap
                    .penalty
                    .map_or(1.0, |penalty| 1.0 + 0.5 * (penalty[s] + penalty[t]));
                let costs = match overlap.old {
                    Some(old) if old.kept[axis][s] > 0.0 => {
                        let (ab, ba) = (old.ab[axis][s] * weight, old.ba[axis][s] * weight);
                        Costs {
                            // An old seam that costs more than both its replacements together
                            // cannot be a graph edge. Differences of three sources obey the
                            // triangle inequality, but gradient costs may not.
                            kept: (old.kept[axis][s] * weight).min(ab + ba),
                            ab,
                            ba,
                        }
                    }
                    _ => {
                        let cost = pair.edge(overlap.cost, s, t, sum) * weight;
                        Costs {
                            kept: 0.0,
                            ab: cost,
                            ba: cost,
                        }
                    }
                };
                largest = largest.max(costs.ab).max(costs.ba);
                finite &= costs.kept.is_finite();
                self.costs[axis][i] = costs;
            });
        }
        if !(finite && largest.is_finite()) {
            return Err(Error::value(
                "old, penalty",
                "must be smaller, because the cost of an edge is infinite",
            ));
        }
        Ok(f64::from(largest))
    }

    fn capacities(&mut self, overlap: &Overlap<'_, D>, window: &Window<D>, scale: f64) {
        let n = window.grid.len();
        self.terminal.clear();
        self.terminal.resize(n, 0);
        // Sum of the costs of all edges of a point. A tie with a higher cost is never cut.
        let mut around = vec![0i32; n];
        for axis in 0..D {
            for list in [&mut self.forward[axis], &mut self.backward[axis]] {
                list.clear();
                list.resize(n, 0);
            }
            links(&window.grid, axis, |i, j| {
                let costs = self.costs[axis][i];
                let [ab, ba] = [costs.ab, costs.ba].map(|c| capacity(f64::from(c), scale));
                let kept = capacity(f64::from(costs.kept), scale).min(ab + ba);
                if kept == 0 {
                    (self.forward[axis][i], self.backward[axis][i]) = (ab, ba);
                } else {
                    // Let x be 1 for pixels of B. The cost of the edge is kept + (ba - kept) x_i - ba x_j + (ab + ba -
                    // kept) (1 - x_i) x_j.
                    self.forward[axis][i] = ab + ba - kept;
                    self.terminal[i] += ba - kept;
                    self.terminal[j] -= ba;
                }
                around[i] += ab + ba;
                around[j] += ab + ba;
            });
        }
        self.sides.clear();
        for ((terminal, &at), &around) in self.terminal.iter_mut().zip(&self.canvas).zip(&around) {
            let side = overlap.tie(at as usize);
            self.sides.push(side);
            match side {
                Side::Free => {}
                Side::Outside => *terminal += around + 1,
                Side::Inside => *terminal -= around + 1,
            }
        }
    }
}

#[cfg(test)]
#[path = "stitch_tests.rs"]
mod tests;
