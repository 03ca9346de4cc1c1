//! The cut of one patch into the canvas: which points take it, at the least cost of the pairs that result.
//!
//! Kwatra et al. (SIGGRAPH 2003) ask how far two pictures differ on both sides of a seam. What shows is the pair that
//! results: what is kept at `p` beside what is taken at `q`. Judged so, a cut tells a joint of two elements from the
//! inside of one. The cost of a pair that is cut already belongs to the state in which both are kept, so the energy
//! stays submodular, and the cut exact.

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

/// Windows of more points are cut between blocks of such a side first, to be laid.
pub(super) const LARGE: &[(usize, usize)] = &[(4096, 2)];
/// To be compared with others. Pictures under a field lose more by larger blocks than those take less time.
const JUDGED: &[(usize, usize)] = &[(1 << 15, 4), (4096, 2)];

/// A patch at a place.
pub(super) struct Proposal<'a, const D: usize> {
    pub window: &'a Window<D>,
    pub mask: &'a [bool],
    /// Of all points of the window.
    pub places: Vec<Place<D>>,
    /// What each costs that takes the patch, by itself; empty where that is nothing.
    pub points: Vec<f32>,
}

/// What a cut comes to.
pub(super) struct Cutting<const D: usize> {
    /// Cost of all seams of the window, and of its points.
    pub value: f64,
    /// The points that take the patch.
    pub take: Vec<bool>,
    /// Seams that it makes: the first of two points, the axis, and the cost.
    pub seams: Vec<(u32, u8, f32)>,
    /// Side of the blocks of points that it runs between.
    block: usize,
}

/// What cuts are made in, one at a time.
struct Workspace<const D: usize> {
    solver: Solver<D>,
    energy: Energy<D>,
    patch: Patch,
    costs: Costs,
}

/// What the points of a window show that take the patch.
#[derive(Default)]
struct Patch {
    looks: Looks,
    /// How far that is from what is there, squared.
    apart: Vec<f32>,
    /// 1 where it is the same place, else 0.
    same: Vec<f32>,
    /// Whether there is such a point.
    meets: bool,
}

/// What the pairs of a row cost.
#[derive(Default)]
struct Costs {
    old_new: Vec<f32>,
    new_old: Vec<f32>,
    capacities: Capacities,
}

/// What cuts are made with.
pub(super) struct Cutter<'a, const D: usize> {
    judge: Judge<'a, D>,
    pub guide: Option<&'a Guide<'a>>,
    /// Windows of more points are cut between blocks of such a side first, the largest ones before the others.
    pub blocks: &'static [(usize, usize)],
    /// Workspaces of cuts, as many as are made at once.
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
        // A workspace is of use whatever became of the work of another.
        self.workspaces
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// What a window shows where a patch comes that covers a mask. Points of its core must take it; empty for none.
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

    /// A chart with its centre at a place.
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

    /// What each point of a window that counts costs by itself that shows a place; empty where that is nothing.
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

    /// Cuts a patch into the canvas.
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

    /// Cuts a patch in between blocks of points that may be larger: enough to compare it with others.
    pub(super) fn judge(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        let block = block(patch.window, self.blocks).max(block(patch.window, JUDGED));
        self.cut_between(view, patch, block, monitor)
    }

    /// Cuts a patch in that was judged.
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

    /// Cuts a patch in between blocks of points of a side.
    pub(super) fn cut_between(
        &self,
        view: &View<D>,
        patch: &Proposal<'_, D>,
        block: usize,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        self.solve(view, patch, &view.ties, block, monitor)
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
            let mut ties = view.ties.clone();
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
        let grid = patch.window.grid;
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

    /// What the points show that take the patch, as far as that is asked.
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

    /// Costs of `n` pairs in a row, by which of the two takes the patch.
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

    /// Adds what pairs cost whose points have a choice.
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

    /// The cut that gives some points the patch.
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

    /// What the window of a patch costs as it is.
    pub(super) fn value(&self, view: &View<D>, patch: &Proposal<'_, D>) -> f64 {
        value_of(view, patch, |_| false)
    }
}

/// What the points cost of which some take the patch, and all seams as they are.
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

/// The side of the blocks that a window is cut between.
fn block<const D: usize>(window: &Window<D>, sides: &[(usize, usize)]) -> usize {
    let n = window.grid.len();
    let side = sides.iter().find(|(most, _)| n > *most);
    side.map_or(1, |&(_, side)| side)
}
