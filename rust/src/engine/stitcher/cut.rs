//! The cut of one patch into the canvas: which points take it, at the least cost of the pairs that result.
//!
//! Kwatra et al. (SIGGRAPH 2003) ask how far two pictures differ on both sides of a seam. What shows is the pair that
//! results: what is kept at `p` beside what is taken at `q`. Judged so, a cut tells a joint of two elements from the
//! inside of one. The cost of a pair that is cut already belongs to the state in which both are kept, so the energy
//! stays submodular, and the cut exact.

use std::sync::{Mutex, MutexGuard, PoisonError};

use super::canvas::{FREE, HELD, View, Window};
use super::chart::Chart;
use super::energy::{Energy, capacity};
use super::source::{CHANNELS, Look, Source};
use super::weights::Weights;
use crate::Result;
use crate::engine::guide::{Guide, UNRELATED};
use crate::foundation::fixed::Place;
use crate::foundation::grid::Grid;
use crate::foundation::par::Monitor;
use crate::kernels::seam::maxflow::Solver;
use crate::kernels::seam::{links, steps};

/// Added to every pair, so that ties go to the shorter seam.
const SHORTEST: f32 = 2e-3;
/// Costs of one pair are at most this, so that sums stay within 32 bits.
pub(super) const MOST: f32 = 1000.0;
/// Windows of more points are cut between blocks of such a side first.
pub(super) const LARGE: &[(usize, usize)] = &[(4096, 2)];
/// Beyond this, colours of two elements are as different as can be.
const UNLIKE: f32 = 1.5;

/// A patch at a place.
pub(super) struct Proposal<'a, const D: usize> {
    pub window: &'a Window<D>,
    pub mask: &'a [bool],
    /// Of all points of the window.
    pub places: Vec<Place<D>>,
    pub distortion: &'a [f32],
    /// Points that must take it; empty for none.
    pub core: Vec<bool>,
}

/// What a cut comes to.
pub(super) struct Cutting<const D: usize> {
    /// Cost of all seams of the window, and of its points.
    pub value: f64,
    /// The points that take the patch.
    pub take: Vec<bool>,
    /// Seams of the window, as in the canvas.
    pub seams: Vec<[f32; D]>,
    /// Side of the blocks of points that it runs between.
    block: usize,
}

/// What a point of a window must do.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Tie {
    /// It shows nothing, and will not.
    Out,
    Old,
    New,
    Either,
}

/// What a pair of neighbours costs by what they show; negative where it is none.
#[derive(Clone, Copy)]
pub(super) struct Pair {
    /// The first one keeps what it has, and the next one takes the patch.
    pub old_new: f32,
    /// The other way round.
    pub new_old: f32,
    /// Both keep what they have.
    pub kept: f32,
}

impl Pair {
    const NONE: Self = Self {
        old_new: -1.0,
        new_old: -1.0,
        kept: 0.0,
    };
}

impl<'a, const D: usize> Proposal<'a, D> {
    /// A chart with its centre at a place.
    pub(super) fn new(chart: &'a Chart<D>, place: Place<D>) -> Self {
        let add = |s: &Place<D>| std::array::from_fn(|a| s[a].wrapping_add(place[a]));
        Self {
            window: &chart.window,
            mask: &chart.mask,
            places: chart.steps.iter().map(add).collect(),
            distortion: &chart.distortion,
            core: Vec::new(),
        }
    }
}

/// What a point of a window shows, how far that is apart, and whether it is the same place.
#[derive(Clone, Copy)]
struct Looks {
    old: Look,
    new: Look,
    apart: f32,
    same: bool,
}

impl Looks {
    const NONE: Self = Self {
        old: Look::EMPTY,
        new: Look::EMPTY,
        apart: 0.0,
        same: false,
    };
}

/// What a cut costs, by what its points take.
struct Costs<const D: usize> {
    /// Of each point that keeps what it has, and that takes the patch.
    points: Vec<[f32; 2]>,
    pairs: [Vec<Pair>; D],
}

impl<const D: usize> Costs<D> {
    /// The cut that gives some points the patch.
    fn settle(
        &self,
        view: &View<D>,
        window: &Window<D>,
        ties: &[Tie],
        sink: &[bool],
        block: usize,
    ) -> Cutting<D> {
        let take: Vec<bool> = ties
            .iter()
            .zip(sink)
            .map(|(&t, &s)| t == Tie::New || t == Tie::Either && s)
            .collect();
        let mut value: f64 = self
            .points
            .iter()
            .zip(&take)
            .map(|(c, &t)| f64::from(c[usize::from(t)]))
            .sum();
        let mut seams = view.seams.clone();
        for axis in 0..D {
            links(&window.grid, axis, |p, q| {
                let Pair {
                    old_new,
                    new_old,
                    kept,
                } = self.pairs[axis][p];
                if old_new >= 0.0 {
                    seams[p][axis] = match (take[p], take[q]) {
                        (true, true) => 0.0,
                        (true, false) => new_old,
                        (false, true) => old_new,
                        (false, false) => kept,
                    };
                }
                value += f64::from(seams[p][axis]);
            });
        }
        Cutting {
            value,
            take,
            seams,
            block,
        }
    }
}

/// What cuts are made with.
pub(super) struct Cutter<'a, const D: usize> {
    pub source: &'a Source<D>,
    pub weights: Weights,
    pub guide: Option<&'a Guide<'a>>,
    /// Windows of more points are cut between blocks of such a side first, the largest ones before the others.
    pub blocks: &'static [(usize, usize)],
    /// Workspaces of cuts, as many as are made at once.
    pub solvers: Mutex<Vec<Solver<D>>>,
}

impl<const D: usize> Cutter<'_, D> {
    fn solvers(&self) -> MutexGuard<'_, Vec<Solver<D>>> {
        // A workspace is of use whatever became of the work of another.
        self.solvers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Cuts a patch into the canvas.
    pub(super) fn cut(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        let coarse = self.cut_coarsely(view, patch, monitor)?;
        self.refine(view, patch, coarse, monitor)
    }

    /// Cuts a patch in between blocks of points, if it is large: enough to compare it with others.
    pub(super) fn cut_coarsely(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        let n = patch.window.grid.len();
        let block = self
            .blocks
            .iter()
            .find(|(least, _)| n > *least)
            .map_or(1, |&(_, side)| side);
        self.cut_between(view, patch, block, monitor)
    }

    /// Cuts a patch in between blocks of points of a side.
    pub(super) fn cut_between(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        block: usize,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        let n = patch.window.grid.len();
        let ties: Vec<Tie> = (0..n).map(|i| tie(view, patch, i)).collect();
        self.solve(view, patch, &ties, block, monitor)
    }

    /// Cuts a patch in that was cut coarsely: by blocks half as large, then half of that; points away from the cut are
    /// settled.
    pub(super) fn refine(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        coarse: Cutting<D>,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        self.refine_within(view, patch, coarse, 0, monitor)
    }

    /// The same, with all points free that lie within some steps of the cut, but at least as many as a block has.
    pub(super) fn refine_within(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        coarse: Cutting<D>,
        reach: usize,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        let grid = &patch.window.grid;
        let mut best = coarse;
        while best.block > 1 {
            let mut ties: Vec<Tie> = (0..grid.len()).map(|i| tie(view, patch, i)).collect();
            let mut band = vec![false; grid.len()];
            for axis in 0..D {
                links(grid, axis, |p, q| {
                    if ties[p] != Tie::Out && ties[q] != Tie::Out && best.take[p] != best.take[q] {
                        band[p] = true;
                        band[q] = true;
                    }
                });
            }
            for _ in 0..best.block.max(reach) {
                band = widen(grid, &band);
            }
            for i in 0..grid.len() {
                if ties[i] == Tie::Either && !band[i] {
                    ties[i] = if best.take[i] { Tie::New } else { Tie::Old };
                }
            }
            best = self.solve(view, patch, &ties, best.block / 2, monitor)?;
        }
        Ok(best)
    }

    /// The least cut between blocks of a side.
    fn solve(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        ties: &[Tie],
        block: usize,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        let (energy, costs) = self.energy(view, patch, ties, block);
        let mut solver = self.solvers().pop().unwrap_or_default();
        let sink = energy.minimise(block, &mut solver, monitor)?;
        self.solvers().push(solver);
        Ok(costs.settle(view, patch.window, ties, &sink, block))
    }

    /// The energy of a cut, and the costs that it is made of.
    fn energy(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        ties: &[Tie],
        block: usize,
    ) -> (Energy<D>, Costs<D>) {
        let mut energy = Energy::new(patch.window.grid);
        let mut points = vec![[0.0f32; 2]; ties.len()];
        let free = self.guide.is_none() && patch.distortion.is_empty();
        for i in 0..if free { 0 } else { ties.len() } {
            if ties[i] == Tie::Out || !patch.mask[i] {
                continue;
            }
            points[i] = self.points(view, patch, i);
            if ties[i] == Tie::Either {
                energy.terminal[i] = capacity(points[i][1] - points[i][0]);
            }
        }
        let pairs = self.pairs(view, patch, ties, block);
        for axis in 0..D {
            energy.add_pairs(axis, ties, &pairs[axis]);
        }
        (energy, Costs { points, pairs })
    }

    /// The costs of all pairs along each axis; of those within a block only what is kept.
    fn pairs(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        ties: &[Tie],
        block: usize,
    ) -> [Vec<Pair>; D] {
        let (grid, n) = (&patch.window.grid, ties.len());
        let none = |p: usize, q: usize| {
            ties[p] == Tie::Out || ties[q] == Tie::Out || !(patch.mask[p] || patch.mask[q])
        };
        // Pairs that show the same whatever is cut need not be judged, nor what they show.
        let judge = |at: usize, p: usize, q: usize| {
            ties[p] != ties[q] || ties[p] == Tie::Either && at % block + 1 == block
        };
        let mut judged = vec![false; n];
        for axis in 0..D {
            steps(grid, axis, |at, p, q| {
                if !none(p, q) && judge(at, p, q) {
                    judged[p] = true;
                    judged[q] = true;
                }
            });
        }
        let looks = self.looks(view, patch, &judged);
        std::array::from_fn(|axis| {
            let mut pairs = vec![Pair::NONE; n];
            steps(grid, axis, |at, p, q| {
                if none(p, q) {
                    return;
                }
                let kept = view.seams[p][axis];
                let (mut old_new, mut new_old) = (kept, kept);
                if judge(at, p, q) {
                    let (l, r) = (&looks[p], &looks[q]);
                    let apart = l.apart * l.apart + r.apart * r.apart;
                    // Where the patch shows what is there already there is no seam.
                    old_new = match (l.same, r.same) {
                        (true, _) => 0.0,
                        (_, true) => kept,
                        _ => self.pair(&l.old, &r.new, apart),
                    };
                    new_old = match (r.same, l.same) {
                        (true, _) => 0.0,
                        (_, true) => kept,
                        _ => self.pair(&l.new, &r.old, apart),
                    };
                }
                pairs[p] = Pair {
                    old_new,
                    new_old,
                    kept,
                };
            });
            pairs
        })
    }

    /// What each point shows that keeps what it has, and that takes the patch; the same where it has no choice.
    fn looks(&self, view: &View<D>, patch: &Proposal<'_, D>, judged: &[bool]) -> Vec<Looks> {
        let mut looks = vec![Looks::NONE; judged.len()];
        for (i, here) in looks.iter_mut().enumerate() {
            if !judged[i] {
                continue;
            }
            let covered = view.patches[i] != FREE;
            here.old = view.looks[i];
            here.new = if patch.mask[i] || !covered {
                self.source.look(patch.places[i])
            } else {
                here.old
            };
            if !covered {
                here.old = here.new;
            }
            here.same = covered && view.places[i] == patch.places[i];
            here.apart = distance(&here.old, &here.new);
        }
        looks
    }

    /// What the window of a patch costs as it is.
    pub(super) fn value(&self, view: &View<D>, patch: &Proposal<'_, D>) -> f64 {
        let mut value = 0.0;
        for i in 0..patch.window.grid.len() {
            if patch.mask[i] {
                value += f64::from(self.points(view, patch, i)[0]);
            }
        }
        for axis in 0..D {
            links(&patch.window.grid, axis, |p, _| {
                value += f64::from(view.seams[p][axis]);
            });
        }
        value
    }

    /// What a point costs that keeps what it shows, or takes the patch.
    fn points(&self, view: &View<D>, patch: &Proposal<'_, D>, i: usize) -> [f32; 2] {
        let own = |all: &[f32]| self.weights.distortion * all.get(i).copied().unwrap_or(0.0);
        let mut costs = [own(&view.distortion), own(patch.distortion)];
        if let Some(guide) = self.guide {
            let p = patch.window.points[i] as usize;
            for (cost, place) in costs.iter_mut().zip([view.places[i], patch.places[i]]) {
                let asked = guide.cost(p, self.source.sample(place)) as f32;
                *cost += self.weights.guide * asked / UNRELATED;
            }
        }
        if view.patches[i] == FREE {
            [0.0, costs[1]]
        } else {
            costs
        }
    }

    /// What is seen where one look is beside another, and how far the pictures are apart there.
    #[inline(always)]
    pub(super) fn pair(&self, l: &Look, r: &Look, apart: f32) -> f32 {
        let w = &self.weights;
        let mut cost = SHORTEST + w.colour * apart / 8.0;
        if w.surprise > 0.0 {
            cost += w.surprise * self.source.surprise(l.class, r.class);
        }
        if self.source.has_elements() {
            let (inside, beside) = ((l.depth > 0.0, r.depth > 0.0), (l.beside, r.beside));
            if inside.0 && inside.1 {
                cost += w.contact * distance(l, r).min(UNLIKE);
            }
            if beside.0 && inside.1 || inside.0 && beside.1 {
                cost += w.joint;
            }
            cost += w.depth * (l.depth.min(6.0) + r.depth.min(6.0)) / 6.0;
            cost += w.jump * ((l.depth - r.depth).abs() - 1.0).clamp(0.0, 4.0) / 2.0;
        }
        cost.min(MOST)
    }
}

/// A mask, and all beside it.
pub(super) fn widen<const D: usize>(grid: &Grid<D>, mask: &[bool]) -> Vec<bool> {
    let mut wide = mask.to_vec();
    for axis in 0..D {
        links(grid, axis, |p, q| {
            wide[p] |= mask[q];
            wide[q] |= mask[p];
        });
    }
    wide
}

fn tie<const D: usize>(view: &View<D>, patch: &Proposal<'_, D>, i: usize) -> Tie {
    match (view.patches[i], patch.mask[i]) {
        (FREE, false) => Tie::Out,
        (FREE, true) => Tie::New,
        (HELD, _) | (_, false) => Tie::Old,
        _ if patch.core.get(i).is_some_and(|&c| c) => Tie::New,
        _ => Tie::Either,
    }
}

#[inline(always)]
pub(super) fn distance(a: &Look, b: &Look) -> f32 {
    let mut sum = 0.0;
    for c in 0..CHANNELS {
        sum += (a.colour[c] - b.colour[c]).abs();
    }
    sum
}
