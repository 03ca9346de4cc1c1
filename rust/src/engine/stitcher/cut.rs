//! The insertion of one patch into the canvas along a minimum cut. The cut assigns points to the patch so that the
//! resulting pairs of neighbours have the lowest total cost.
//!
//! Kwatra et al. (SIGGRAPH 2003) compare the two images on both sides of a seam. This cut judges the two points that
//! become neighbours: the kept point `p` and the taken point `q`. It can thus distinguish a joint between two elements
//! from the inside of an element. The cost of an existing seam is paid if both points are kept. The energy therefore
//! stays submodular, and the cut is exact.

use std::sync::{Mutex, MutexGuard, PoisonError};

use super::canvas::{Canvas, FREE, Window};
use super::chart::Chart;
use super::energy::Energy;
use super::pair::{Capacities, Judge, capacity, go_on};
use super::runs::{Run, judged, runs, widen};
use super::source::Source;
use super::view::{Looks, Tie, View};
use super::weights::Weights;
use crate::Result;
use crate::engine::guide::{Guide, UNRELATED};
use crate::foundation::fixed::Place;
use crate::foundation::grid::Grid;
use crate::foundation::par::Monitor;
use crate::kernels::seam::maxflow::Solver;

/// Pairs of a number of points and a side of blocks. If a cut is applied, windows with more points are first cut
/// between blocks of this side.
pub(super) const LARGE: &[(usize, usize)] = &[(4096, 2)];
/// The same limits for cuts that are only compared. For images that follow a field, larger blocks would reduce the
/// quality too much for the time that they save.
const JUDGED: &[(usize, usize)] = &[(1 << 15, 4), (4096, 2)];

/// A patch that is proposed for a window, at given exemplar coordinates.
pub(super) struct Proposal<'a, const D: usize> {
    pub window: &'a Window<D>,
    pub mask: &'a [bool],
    /// Exemplar coordinates of all points of the window.
    pub places: Vec<Place<D>>,
    /// Cost of each point if it takes the patch, without its pairs. Empty if these costs are zero.
    pub points: Vec<f32>,
}

/// Result of a cut.
pub(super) struct Cutting<const D: usize> {
    /// Cost of all seams and points of the window.
    pub value: f64,
    /// Whether each point takes the patch.
    pub take: Vec<bool>,
    /// New costs of seams: the first of two points, the axis, and the cost.
    pub seams: Vec<(u32, u8, f32)>,
    /// Side of the blocks between which the cut was computed.
    block: usize,
}

/// Buffers of one cut.
struct Workspace<const D: usize> {
    solver: Solver<D>,
    energy: Energy<D>,
    patch: Patch,
    costs: Costs,
}

/// Appearance of the window's points if they take the patch.
#[derive(Default)]
struct Patch {
    looks: Looks,
    /// Squared difference of colours between the patch and the current content.
    apart: Vec<f32>,
    /// 1 for points where the patch shows the current sample, else 0.
    same: Vec<f32>,
    /// Whether the patch shows the current sample at any point.
    meets: bool,
}

/// Costs of the pairs of a row.
#[derive(Default)]
struct Costs {
    old_new: Vec<f32>,
    new_old: Vec<f32>,
    capacities: Capacities,
}

/// Weights, guide and buffers of cuts.
pub(super) struct Cutter<'a, const D: usize> {
    judge: Judge<'a, D>,
    pub guide: Option<&'a Guide<'a>>,
    /// Pairs of a number of points and a side of blocks, as in [`LARGE`]. Larger numbers come first.
    pub blocks: &'static [(usize, usize)],
    /// Buffers of the cuts that run at the same time.
    workspaces: Mutex<Vec<Workspace<D>>>,
}

impl<'a, const D: usize> Cutter<'a, D> {
    pub(super) fn new(
        source: &'a Source<D>,
        weights: Weights,
        guide: Option<&'a Guide<'a>>,
        blocks: &'static [(usize, usize)],
    ) -> Self {
        Self {
            judge: Judge { source, weights },
            guide,
            blocks,
            workspaces: Mutex::default(),
        }
    }

    pub(super) fn source(&self) -> &'a Source<D> {
        self.judge.source
    }

    fn workspaces(&self) -> MutexGuard<'_, Vec<Workspace<D>>> {
        // A workspace is reset before each use, so it is usable even if another task panicked.
        self.workspaces
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the content of a window before a patch with a mask is inserted. Points of the core must take the patch.
    /// `core` may be empty.
    pub(super) fn view(
        &self,
        canvas: &Canvas<D>,
        window: &Window<D>,
        mask: &[bool],
        core: &[bool],
    ) -> View<D> {
        let mut view = View::new(canvas, window, mask, core, self.source());
        let counts = |i: usize| mask[i] && view.patches[i] != FREE;
        view.points = self.weigh(window, &view.places, &view.distortion, counts);
        view
    }

    /// Returns a patch: a chart with its centre at given exemplar coordinates.
    pub(super) fn propose<'c>(&self, chart: &'c Chart<D>, place: Place<D>) -> Proposal<'c, D> {
        let add = |s: &Place<D>| std::array::from_fn(|a| s[a].wrapping_add(place[a]));
        let places: Vec<Place<D>> = chart.steps.iter().map(add).collect();
        Proposal {
            window: &chart.window,
            mask: &chart.mask,
            points: self.weigh(&chart.window, &places, &chart.distortion, |i| chart.mask[i]),
            places,
        }
    }

    /// Returns the costs of single points at given exemplar coordinates, without pairs. Empty if these costs are zero.
    fn weigh(
        &self,
        window: &Window<D>,
        places: &[Place<D>],
        distortion: &[f32],
        counts: impl Fn(usize) -> bool,
    ) -> Vec<f32> {
        let (weights, source) = (&self.judge.weights, self.source());
        let presence = if source.has_elements() {
            weights.presence
        } else {
            0.0
        };
        // Return at once if single points have no costs.
        if presence <= 0.0 && self.guide.is_none() && distortion.is_empty() {
            return Vec::new();
        }
        let cost = |(i, &place): (usize, &Place<D>)| {
            if !counts(i) {
                return 0.0;
            }
            let mut cost = weights.distortion * distortion.get(i).copied().unwrap_or(0.0);
            let sample = source.sample(place);
            if let Some(guide) = self.guide {
                let asked = guide.cost(window.points[i] as usize, sample) as f32;
                cost += weights.guide * asked / UNRELATED;
            }
            if presence > 0.0 {
                cost += presence * f32::from(u8::from(source.is_bare(sample)));
            }
            cost
        };
        places.iter().enumerate().map(cost).collect()
    }

    /// Returns the cut that inserts a patch into the canvas.
    pub(super) fn cut(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        let block = block(patch.window, self.blocks);
        let coarse = self.cut_between(view, patch, block, monitor)?;
        self.refine(view, patch, coarse, monitor)
    }

    /// Returns the cut of a patch between blocks of points, which is precise enough to compare patches.
    pub(super) fn judge(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        let block = block(patch.window, self.blocks).max(block(patch.window, JUDGED));
        self.cut_between(view, patch, block, monitor)
    }

    /// Refines the cut of a patch that was compared with others.
    pub(super) fn cut_judged(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        judged: Cutting<D>,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        if judged.block > block(patch.window, self.blocks) {
            return self.cut(view, patch, monitor);
        }
        self.refine(view, patch, judged, monitor)
    }

    /// Returns the cut of a patch between blocks of a given side.
    pub(super) fn cut_between(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        block: usize,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        self.solve(view, patch, &view.ties, block, monitor)
    }

    /// Refines a coarse cut by halving the side of the blocks until it is 1. Only points near the cut are free.
    pub(super) fn refine(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        coarse: Cutting<D>,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        self.refine_within(view, patch, coarse, 0, monitor)
    }

    /// Refines a coarse cut. Points are free within `reach` steps of the cut, or within the side of a block if this is
    /// larger.
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
            let mut ties = view.ties.clone();
            // Mark both sides of the cut, and widen this band.
            let mut band = vec![false; grid.len()];
            runs(grid, |Run { p, q, n, .. }| {
                for (p, q) in (p..p + n).zip(q..) {
                    if ties[p] != Tie::Out && ties[q] != Tie::Out && best.take[p] != best.take[q] {
                        band[p] = true;
                        band[q] = true;
                    }
                }
            });
            for _ in 0..best.block.max(reach) {
                band = widen(grid, &band);
            }
            for i in 0..grid.len() {
                // Points outside the band keep their side of the coarse cut.
                if ties[i] == Tie::Either && !band[i] {
                    ties[i] = if best.take[i] { Tie::New } else { Tie::Old };
                }
            }
            best = self.solve(view, patch, &ties, best.block / 2, monitor)?;
        }
        Ok(best)
    }

    /// Returns the minimum cut between blocks of a given side.
    fn solve(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        ties: &[Tie],
        block: usize,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        let grid = patch.window.grid;
        // Reuse a workspace if one is free.
        let spare = self.workspaces().pop();
        let mut work = match spare {
            Some(spare) => spare,
            None => Workspace {
                solver: Solver::default(),
                energy: Energy::new(grid, block)?,
                patch: Patch::default(),
                costs: Costs::default(),
            },
        };
        self.look(view, patch, ties, &mut work.patch);
        work.energy.clear(grid, block)?;
        // Add the costs of single points, then those of pairs.
        for (i, take) in patch.points.iter().enumerate() {
            if ties[i] == Tie::Either {
                work.energy.add_point(i, capacity(take - view.cost(i)));
            }
        }
        self.add_pairs(
            &grid,
            view,
            &work.patch,
            ties,
            &mut work.energy,
            &mut work.costs,
        );
        let take = work.energy.minimise(ties, &mut work.solver, monitor)?;
        let cutting = self.settle(view, patch, take, block, &work.patch, &mut work.costs);
        self.workspaces().push(work);
        Ok(cutting)
    }

    /// Computes the appearance of the points that take the patch, as far as pairs need it.
    fn look(&self, view: &View<D>, patch: &Proposal<'_, D>, ties: &[Tie], out: &mut Patch) {
        let n = ties.len();
        let judged = judged(&patch.window.grid, ties);
        out.looks.fit(n);
        out.apart.resize(n, 0.0);
        out.same.resize(n, 0.0);
        out.meets = false;
        for i in (0..n).filter(|&i| judged[i]) {
            let covered = view.patches[i] != FREE;
            let same = covered && view.places[i] == patch.places[i];
            out.meets |= same;
            out.same[i] = f32::from(u8::from(same));
            out.apart[i] = 0.0;
            if patch.mask[i] {
                let look = self.source().look(patch.places[i]);
                out.looks.set(i, &look);
                if covered {
                    let apart = view.looks.distance(i, &look);
                    out.apart[i] = apart * apart;
                }
            } else {
                out.looks.copy(i, &view.looks);
            }
        }
    }

    /// Computes the costs of `n` pairs in a row for both directions: only the second point takes the patch, or only the
    /// first.
    fn judge_pairs(&self, view: &View<D>, patch: &Patch, run: &Run, costs: &mut Costs) {
        let (p, q, n) = (run.p, run.q, run.n);
        costs.old_new.resize(n, 0.0);
        costs.new_old.resize(n, 0.0);
        let apart = [&patch.apart[p..p + n], &patch.apart[q..q + n]];
        let (old, new) = (&view.looks, &patch.looks);
        self.judge
            .pairs(old.row(p, n), new.row(q, n), apart, &mut costs.old_new);
        self.judge
            .pairs(new.row(p, n), old.row(q, n), apart, &mut costs.new_old);
        if patch.meets {
            let kept = &view.seams[run.axis][p..p + n];
            let (l, r) = (&patch.same[p..p + n], &patch.same[q..q + n]);
            go_on(l, r, kept, &mut costs.old_new);
            go_on(r, l, kept, &mut costs.new_old);
        }
    }

    /// Adds the costs of pairs whose points have a choice.
    fn add_pairs(
        &self,
        grid: &Grid<D>,
        view: &View<D>,
        patch: &Patch,
        ties: &[Tie],
        energy: &mut Energy<D>,
        costs: &mut Costs,
    ) {
        runs(grid, |run| {
            if energy.side() > 1 {
                energy.add_seams(ties, &run, &view.seams[run.axis][run.p..run.p + run.n]);
            }
            let Some(run) = energy.open(ties, &run) else {
                return;
            };
            self.judge_pairs(view, patch, &run, costs);
            let kept = &view.seams[run.axis][run.p..run.p + run.n];
            let capacities = &mut costs.capacities;
            capacities.set(&costs.old_new, &costs.new_old, kept);
            energy.add_pairs(ties, &run, capacities);
        });
    }

    /// Returns the cut that assigns the patch to the points in `take`.
    fn settle(
        &self,
        view: &View<D>,
        proposal: &Proposal<'_, D>,
        take: Vec<bool>,
        block: usize,
        patch: &Patch,
        costs: &mut Costs,
    ) -> Cutting<D> {
        let mut value = value_of(view, proposal, |i| take[i]);
        let mut seams = Vec::new();
        runs(&proposal.window.grid, |run| {
            let kept = &view.seams[run.axis];
            for k in 0..run.n {
                let (p, q) = (run.p + k, run.q + k);
                // A seam exists only where one of two points takes the patch. Compute its cost again, because the
                // energy contains rounded costs.
                let cost = match (take[p], take[q]) {
                    (false, false) => continue,
                    (true, true) => 0.0,
                    _ if view.ties[p] == Tie::Out || view.ties[q] == Tie::Out => continue,
                    (first, _) => {
                        let one = Run { p, q, n: 1, ..run };
                        self.judge_pairs(view, patch, &one, costs);
                        if first {
                            costs.new_old[0]
                        } else {
                            costs.old_new[0]
                        }
                    }
                };
                if cost != kept[p] {
                    value += f64::from(cost) - f64::from(kept[p]);
                    seams.push((p as u32, run.axis as u8, cost));
                }
            }
        });
        Cutting {
            value,
            take,
            seams,
            block,
        }
    }

    /// Returns the cost of the window without the patch.
    pub(super) fn value(&self, view: &View<D>, patch: &Proposal<'_, D>) -> f64 {
        value_of(view, patch, |_| false)
    }
}

/// Returns the cost of the points after some take the patch, and of the current seams.
fn value_of<const D: usize>(
    view: &View<D>,
    patch: &Proposal<'_, D>,
    take: impl Fn(usize) -> bool,
) -> f64 {
    let mut value = view.total;
    for (i, &new) in patch.points.iter().enumerate() {
        if view.ties[i] == Tie::New || view.ties[i] == Tie::Either {
            value += f64::from(if take(i) { new } else { view.cost(i) });
        }
    }
    value
}

/// Returns the side of the blocks between which a window is cut.
fn block<const D: usize>(window: &Window<D>, sides: &[(usize, usize)]) -> usize {
    let n = window.grid.len();
    let side = sides.iter().find(|(most, _)| n > *most);
    side.map_or(1, |&(_, side)| side)
}
