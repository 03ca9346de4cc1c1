//! Two images on one canvas: which of them each pixel takes, so that the seam between them is least visible.
//!
//! Kwatra et al., *Graphcut textures*, SIGGRAPH 2003. Pixels that only one image covers take that one. In the overlap:
//!
//! 1. pixels of a core are tied to its image;
//! 2. else pixels beside one that only A covers are tied to A, then those beside one that only B covers to B;
//! 3. the others take what makes the sum of the costs of the edges that are cut least ([`super::cost`]); where that
//!    leaves a choice, as few as possible take B.
//!
//! Where what must take B is one core on a plane, and what must keep A lies around it, that is a shortest closed path
//! ([`super::planar::ring`]); else a maximum flow ([`super::maxflow`]).
//!
//! Departures: A, which is there already, wins pixels that touch both; a `penalty` keeps seams off chosen pixels; an old
//! seam is a pairwise term with one cost a labelling (Kolmogorov and Zabih, *What energy functions can be minimized via
//! graph cuts?*, PAMI 2004) in place of Kwatra's extra node, which gives the same cuts with fewer nodes.

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

/// Which image each pixel takes.
#[derive(Debug, Clone, PartialEq)]
pub struct Stitched {
    /// Pixels that take B. The others take A where A covers them, and nothing elsewhere.
    pub b: Vec<bool>,
    /// Sum of the costs of the edges of the seam inside the overlap, old seams that stay included.
    pub value: f64,
    /// Number of edges between a pixel of A and one of B in the overlap.
    pub edges: usize,
}

/// The least visible seam of one overlap. Keep a [`Stitcher`] for many.
pub fn cut<const D: usize>(overlap: &Overlap<'_, D>, monitor: &Monitor) -> Result<Stitched> {
    Stitcher::default().cut(overlap, monitor)
}

/// Costs of the pair of a point and the next one, by who takes A (0) and who B (1). Taking B together is free.
#[derive(Debug, Clone, Copy, Default)]
struct Costs {
    kept: f32,
    ab: f32,
    ba: f32,
}

/// Boxes of fewer pixels go to the general solver: for them it is as fast, and it keeps its workspace.
const SMALL: usize = 64 * 64;

/// A workspace for stitching; cuts after the first one of a size allocate only their result.
#[derive(Debug)]
pub struct Stitcher<const D: usize> {
    solver: Solver<D>,
    /// Canvas index of each point of the box.
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
    /// The least visible seam of an overlap.
    ///
    /// # Errors
    /// Arrays that do not fit the grid, a penalty or costs of old seams that are negative or not finite, cores that lie
    /// outside the overlap's images or contradict each other, values that are not finite in the overlap.
    pub fn cut(&mut self, overlap: &Overlap<'_, D>, monitor: &Monitor) -> Result<Stitched> {
        let cut = self.cut_within(overlap, f64::INFINITY, monitor)?;
        Ok(cut.unwrap_or_else(|| unreachable!("no seam costs more")))
    }

    /// The least visible seam of an overlap; it may be none where that costs more than `bound`, and no old seam is there.
    pub(crate) fn cut_within(
        &mut self,
        overlap: &Overlap<'_, D>,
        bound: f64,
        monitor: &Monitor,
    ) -> Result<Option<Stitched>> {
        overlap.check()?;
        memory::room("the graph of the seam", overlap.grid.len(), 80 * D)?;
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
        // Each edge of a cut may be rounded up by a half, and a point has D edges.
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

    /// What takes B, where that is what a least seam is around: on a plane and without old seams, which cost one way more
    /// than the other.
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

    /// Costs of all edges of the overlap in the window; the largest one.
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
                            "not finite, or too far apart, at {:?} of the overlap",
                            overlap.grid.point(at)
                        ),
                    ));
                }
            }
        }
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
                            // A seam that costs more than both its replacements together cannot be a graph; the
                            // differences of three sources obey the triangle inequality, gradient costs may not.
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
                "too large: an edge costs infinitely much",
            ));
        }
        Ok(f64::from(largest))
    }

    fn capacities(&mut self, overlap: &Overlap<'_, D>, window: &Window<D>, scale: f64) {
        let n = window.grid.len();
        self.terminal.clear();
        self.terminal.resize(n, 0);
        // What the edges of a point can cost altogether: a tie that costs more is never cut.
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
                    // With x = 1 for B: kept + (ba - kept) x_i - ba x_j + (ab + ba - kept) (1 - x_i) x_j.
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
