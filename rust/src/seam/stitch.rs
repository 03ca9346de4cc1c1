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

use super::cost::{Cost, Pair, capacity, check_costs, check_len, scale};
use super::links;
use super::maxflow::{Graph, Solver};
use super::planar::ring::{Ring, Side, least_ring};
use crate::grid::Grid;
use crate::par::Monitor;
use crate::{Error, Result};

/// Seams that A already contains. Entries belong to the pair of a point and the next one along the axis.
#[derive(Debug, Clone, Copy)]
pub struct OldSeams<'a, const D: usize> {
    /// Cost of the seam that is there, paid where both points keep A; 0 where there is none.
    pub kept: [&'a [f32]; D],
    /// Cost where the first point keeps A and the next takes B: the first one's old source against B.
    pub ab: [&'a [f32]; D],
    /// Cost where the first point takes B and the next keeps A.
    pub ba: [&'a [f32]; D],
}

/// What is to be stitched. Arrays are in row-major order over `grid`, images with their channels last.
#[derive(Debug, Clone, Copy)]
pub struct Overlap<'a, const D: usize> {
    /// The canvas, and which of its axes are cyclic.
    pub grid: Grid<D>,
    /// Channels of both images.
    pub channels: usize,
    /// The image that is there. Values where it does not cover the canvas are never read.
    pub a: &'a [f32],
    /// The image that is added.
    pub b: &'a [f32],
    /// Where A covers the canvas.
    pub mask_a: &'a [bool],
    /// Where B covers the canvas.
    pub mask_b: &'a [bool],
    /// Pixels of the overlap that must keep A.
    pub core_a: Option<&'a [bool]>,
    /// Pixels of the overlap that must take B.
    pub core_b: Option<&'a [bool]>,
    /// Costs of edges are multiplied by one plus the mean of this at their ends.
    pub penalty: Option<&'a [f32]>,
    /// Seams that A already contains; they bear the penalty too.
    pub old: Option<OldSeams<'a, D>>,
    /// How visible a seam is.
    pub cost: Cost,
}

impl<'a, const D: usize> Overlap<'a, D> {
    /// An overlap without cores, penalty or old seams, at the gradient cost.
    pub fn new(
        grid: Grid<D>,
        channels: usize,
        a: &'a [f32],
        b: &'a [f32],
        mask_a: &'a [bool],
        mask_b: &'a [bool],
    ) -> Self {
        Self {
            grid,
            channels,
            a,
            b,
            mask_a,
            mask_b,
            core_a: None,
            core_b: None,
            penalty: None,
            old: None,
            cost: Cost::Gradient,
        }
    }
}

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
        check(overlap)?;
        let mut b: Vec<bool> = overlap
            .mask_b
            .iter()
            .zip(overlap.mask_a)
            .map(|(&b, &a)| b && !a)
            .collect();
        let Some(window) = bounds(overlap)? else {
            return Ok(Stitched {
                b,
                value: 0.0,
                edges: 0,
            });
        };
        let largest = match overlap.channels {
            1 => self.weigh::<1>(overlap, &window),
            3 => self.weigh::<3>(overlap, &window),
            _ => self.weigh::<0>(overlap, &window),
        }?;
        self.capacities(overlap, &window, scale(largest));
        let sink = match self.ring(overlap, &window.grid, monitor)? {
            Some(inside) => inside,
            None => {
                let graph = Graph {
                    grid: window.grid,
                    terminal: &self.terminal,
                    forward: std::array::from_fn(|axis| &self.forward[axis][..]),
                    backward: std::array::from_fn(|axis| &self.backward[axis][..]),
                };
                self.solver.min_cut(&graph, monitor)?.sink
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
        Ok(Stitched { b, value, edges })
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
                if !difference.is_finite() {
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
        let mut largest = 0.0f32;
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
                self.costs[axis][i] = costs;
            });
        }
        if !largest.is_finite() {
            return Err(Error::value(
                "penalty",
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
            let side = tie(overlap, at as usize);
            self.sides.push(side);
            match side {
                Side::Free => {}
                Side::Outside => *terminal += around + 1,
                Side::Inside => *terminal -= around + 1,
            }
        }
    }
}

/// Where a pixel must be: outside it keeps A, inside it takes B.
fn tie<const D: usize>(overlap: &Overlap<'_, D>, at: usize) -> Side {
    match (overlap.mask_a[at], overlap.mask_b[at]) {
        (true, true) => {}
        (true, false) => return Side::Outside,
        (false, true) => return Side::Inside,
        (false, false) => return Side::Free,
    }
    if overlap.core_b.is_some_and(|core| core[at]) {
        return Side::Inside;
    }
    if overlap.core_a.is_some_and(|core| core[at]) {
        return Side::Outside;
    }
    let point = overlap.grid.point(at);
    let mut found = Side::Free;
    for axis in 0..D {
        for step in [-1, 1] {
            let mut beside = point;
            let Some(i) = overlap.grid.inside(axis, point[axis] as isize + step) else {
                continue;
            };
            beside[axis] = i;
            let beside = overlap.grid.index(beside);
            match (overlap.mask_a[beside], overlap.mask_b[beside]) {
                (true, false) => return Side::Outside,
                (false, true) => found = Side::Inside,
                _ => {}
            }
        }
    }
    found
}

fn check<const D: usize>(overlap: &Overlap<'_, D>) -> Result<()> {
    let n = overlap.grid.len();
    if n > i32::MAX as usize {
        return Err(Error::Limit {
            what: "a canvas to stitch on".into(),
            needed: format!("{n} pixels"),
            limit: format!("{} pixels", i32::MAX),
        });
    }
    let samples = n.saturating_mul(overlap.channels);
    check_len("a", samples, overlap.a.len())?;
    check_len("b", samples, overlap.b.len())?;
    check_len("mask_a", n, overlap.mask_a.len())?;
    check_len("mask_b", n, overlap.mask_b.len())?;
    for (argument, core, mask) in [
        ("core_a", overlap.core_a, overlap.mask_a),
        ("core_b", overlap.core_b, overlap.mask_b),
    ] {
        if let Some(core) = core {
            check_len(argument, n, core.len())?;
            if let Some(at) = (0..n).find(|&i| core[i] && !mask[i]) {
                return Err(Error::value(
                    argument,
                    format!(
                        "holds {:?}, which its image does not cover",
                        overlap.grid.point(at)
                    ),
                ));
            }
        }
    }
    if let (Some(core_a), Some(core_b)) = (overlap.core_a, overlap.core_b)
        && let Some(at) = (0..n).find(|&i| core_a[i] && core_b[i])
    {
        return Err(Error::value(
            "core_a, core_b",
            format!(
                "both hold {:?}; a pixel can be tied to one image only",
                overlap.grid.point(at)
            ),
        ));
    }
    if let Some(penalty) = overlap.penalty {
        check_len("penalty", n, penalty.len())?;
        check_costs("penalty", penalty)?;
    }
    if let Some(old) = overlap.old {
        for costs in old.kept.iter().chain(&old.ab).chain(&old.ba) {
            check_len("old", n, costs.len())?;
            check_costs("old", costs)?;
        }
    }
    Ok(())
}

/// The part of the canvas that the overlap lies in. A cyclic axis along which it meets both ends is taken whole.
struct Window<const D: usize> {
    grid: Grid<D>,
    from: [usize; D],
}

impl<const D: usize> Window<D> {
    fn canvas(&self, i: usize, grid: &Grid<D>) -> u32 {
        let mut point = self.grid.point(i);
        for (p, from) in point.iter_mut().zip(self.from) {
            *p += from;
        }
        grid.index(point) as u32
    }
}

fn bounds<const D: usize>(overlap: &Overlap<'_, D>) -> Result<Option<Window<D>>> {
    let (shape, wrap) = (overlap.grid.shape(), overlap.grid.wrap());
    let (mut low, mut high) = ([usize::MAX; D], [0; D]);
    let row = shape[D - 1];
    for (r, (a, b)) in overlap
        .mask_a
        .chunks_exact(row)
        .zip(overlap.mask_b.chunks_exact(row))
        .enumerate()
    {
        let both = |i: &usize| a[*i] && b[*i];
        if let Some(first) = (0..row).find(both) {
            let last = (0..row).rfind(both).unwrap_or(first);
            let mut point = overlap.grid.point(r * row);
            for end in [first, last] {
                point[D - 1] = end;
                for axis in 0..D {
                    low[axis] = low[axis].min(point[axis]);
                    high[axis] = high[axis].max(point[axis] + 1);
                }
            }
        }
    }
    if low[0] == usize::MAX {
        return Ok(None);
    }
    let whole: [bool; D] =
        std::array::from_fn(|axis| wrap[axis] && low[axis] == 0 && high[axis] == shape[axis]);
    let grid = Grid::new(std::array::from_fn(|axis| high[axis] - low[axis]), whole)?;
    Ok(Some(Window { grid, from: low }))
}

#[cfg(test)]
#[path = "stitch_tests.rs"]
mod tests;
