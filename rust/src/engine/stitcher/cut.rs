//! The cut of one patch into the canvas: which points take it, at the least cost of the pairs that result.
//!
//! Kwatra et al. (SIGGRAPH 2003) ask how far two pictures differ on both sides of a seam. What shows is the pair that
//! results: what is kept at `p` beside what is taken at `q`. Judged so, a cut tells a joint of two elements from the
//! inside of one. The cost of a pair that is cut already belongs to the state in which both are kept, so the energy
//! stays submodular, and the cut exact.

use super::canvas::{Canvas, FREE, HELD, Window};
use super::chart::Chart;
use super::energy::{Energy, capacity};
use super::source::{CHANNELS, Look, Source};
use crate::Result;
use crate::engine::guide::Guide;
use crate::foundation::fixed::Place;
use crate::foundation::grid::Grid;
use crate::foundation::par::Monitor;
use crate::kernels::seam::{links, steps};

/// Added to every pair, so that ties go to the shorter seam.
const SHORTEST: f32 = 2e-3;
/// Costs of one pair are at most this, so that sums stay within 32 bits.
pub(super) const MOST: f32 = 1000.0;
/// Windows of more points are cut between blocks of such a side first.
const LARGE: [(usize, usize); 1] = [(4096, 2)];
/// Beyond this, colours of two elements are as different as can be.
const UNLIKE: f32 = 1.5;
/// What a guide's cost of unrelated windows is.
const UNRELATED: f32 = 2.0 * 512.0 * 512.0;

/// What a seam costs.
#[derive(Debug, Clone, Copy)]
pub struct Weights {
    /// Squared differences of the colours on both sides.
    pub colour: f32,
    /// Two elements in contact.
    pub contact: f32,
    /// A jump of the depth: an element that is cut off.
    pub jump: f32,
    /// A seam inside of an element, by its depth on both sides.
    pub depth: f32,
    /// An element beside another one's border: joints stay as wide as two samples.
    pub joint: f32,
    /// Classes that are seldom side by side.
    pub surprise: f32,
    /// A point whose patch is bent against the field.
    pub distortion: f32,
    /// A point that does not show what is asked.
    pub guide: f32,
}

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
    /// Instead of a cost: that is still to be found.
    const JUDGED: f32 = -2.0;
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

/// What a point of a window shows, and how far that is apart.
#[derive(Clone, Copy)]
struct Looks {
    old: Look,
    new: Look,
    apart: f32,
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
        canvas: &Canvas<D>,
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
        let mut seams: Vec<[f32; D]> = window
            .points
            .iter()
            .map(|&p| canvas.seams[p as usize])
            .collect();
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
}

impl<const D: usize> Cutter<'_, D> {
    /// Cuts a patch into the canvas.
    pub(super) fn cut(
        &self,
        canvas: &Canvas<D>,
        patch: &Proposal<'_, D>,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        let coarse = self.cut_coarsely(canvas, patch, monitor)?;
        self.refine(canvas, patch, coarse, monitor)
    }

    /// Cuts a patch in between blocks of points, if it is large: enough to compare it with others.
    pub(super) fn cut_coarsely(
        &self,
        canvas: &Canvas<D>,
        patch: &Proposal<'_, D>,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        let n = patch.window.grid.len();
        let block = LARGE
            .iter()
            .find(|(least, _)| n > *least)
            .map_or(1, |&(_, side)| side);
        let ties: Vec<Tie> = (0..n).map(|i| tie(canvas, patch, i)).collect();
        self.solve(canvas, patch, &ties, block, monitor)
    }

    /// Cuts a patch in that was cut coarsely: by blocks half as large, then half of that; points away from the cut are
    /// settled.
    pub(super) fn refine(
        &self,
        canvas: &Canvas<D>,
        patch: &Proposal<'_, D>,
        coarse: Cutting<D>,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        let grid = &patch.window.grid;
        let mut best = coarse;
        while best.block > 1 {
            let mut ties: Vec<Tie> = (0..grid.len()).map(|i| tie(canvas, patch, i)).collect();
            let mut band = vec![false; grid.len()];
            for axis in 0..D {
                links(grid, axis, |p, q| {
                    if ties[p] != Tie::Out && ties[q] != Tie::Out && best.take[p] != best.take[q] {
                        band[p] = true;
                        band[q] = true;
                    }
                });
            }
            for _ in 0..best.block {
                band = widen(grid, &band);
            }
            for i in 0..grid.len() {
                if ties[i] == Tie::Either && !band[i] {
                    ties[i] = if best.take[i] { Tie::New } else { Tie::Old };
                }
            }
            best = self.solve(canvas, patch, &ties, best.block / 2, monitor)?;
        }
        Ok(best)
    }

    /// The least cut between blocks of a side.
    fn solve(
        &self,
        canvas: &Canvas<D>,
        patch: &Proposal<'_, D>,
        ties: &[Tie],
        block: usize,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        let (energy, costs) = self.energy(canvas, patch, ties, block);
        let sink = energy.minimise(block, monitor)?;
        Ok(costs.settle(canvas, patch.window, ties, &sink, block))
    }

    /// The energy of a cut, and the costs that it is made of.
    fn energy(
        &self,
        canvas: &Canvas<D>,
        patch: &Proposal<'_, D>,
        ties: &[Tie],
        block: usize,
    ) -> (Energy<D>, Costs<D>) {
        let mut energy = Energy::new(patch.window.grid);
        let mut points = vec![[0.0f32; 2]; ties.len()];
        for i in 0..ties.len() {
            if ties[i] == Tie::Out || !patch.mask[i] {
                continue;
            }
            points[i] = self.points(canvas, patch, i);
            if ties[i] == Tie::Either {
                energy.terminal[i] = capacity(points[i][1] - points[i][0]);
            }
        }
        let pairs = self.pairs(canvas, patch, ties, block);
        for axis in 0..D {
            energy.add_pairs(axis, ties, &pairs[axis]);
        }
        (energy, Costs { points, pairs })
    }

    /// The costs of all pairs along each axis; of those within a block only what is kept.
    fn pairs(
        &self,
        canvas: &Canvas<D>,
        patch: &Proposal<'_, D>,
        ties: &[Tie],
        block: usize,
    ) -> [Vec<Pair>; D] {
        let (points, grid, n) = (&patch.window.points, &patch.window.grid, ties.len());
        // Pairs that show the same whatever is cut need not be judged, nor what they show.
        let mut judged = vec![false; n];
        let mut pairs: [Vec<Pair>; D] = std::array::from_fn(|_| vec![Pair::NONE; n]);
        for (axis, pairs) in pairs.iter_mut().enumerate() {
            steps(grid, axis, |at, p, q| {
                if ties[p] == Tie::Out || ties[q] == Tie::Out || !(patch.mask[p] || patch.mask[q]) {
                    return;
                }
                let kept = canvas.seams[points[p] as usize][axis];
                let within = at % block + 1 < block;
                pairs[p] = Pair {
                    old_new: kept,
                    new_old: kept,
                    kept,
                };
                if ties[p] != ties[q] || ties[p] == Tie::Either && !within {
                    pairs[p].old_new = Pair::JUDGED;
                    judged[p] = true;
                    judged[q] = true;
                }
            });
        }
        let looks = self.looks(canvas, patch, &judged);
        // Where the patch shows what is there already there is no seam.
        let same = |i: usize| {
            canvas.covered(points[i]) && canvas.places[points[i] as usize] == patch.places[i]
        };
        for (axis, pairs) in pairs.iter_mut().enumerate() {
            links(grid, axis, |p, q| {
                if pairs[p].old_new != Pair::JUDGED {
                    return;
                }
                let (l, r, kept) = (&looks[p], &looks[q], pairs[p].kept);
                let apart = l.apart * l.apart + r.apart * r.apart;
                let (p_same, q_same) = (same(p), same(q));
                let cross = |left_same: bool, right_same: bool, left: &Look, right: &Look| match (
                    left_same, right_same,
                ) {
                    (true, _) => 0.0,
                    (_, true) => kept,
                    _ => self.pair(left, right, apart),
                };
                pairs[p].old_new = cross(p_same, q_same, &l.old, &r.new);
                pairs[p].new_old = cross(q_same, p_same, &l.new, &r.old);
            });
        }
        pairs
    }

    /// What each point shows that keeps what it has, and that takes the patch; the same where it has no choice.
    fn looks(&self, canvas: &Canvas<D>, patch: &Proposal<'_, D>, judged: &[bool]) -> Vec<Looks> {
        let mut looks = vec![
            Looks {
                old: Look::EMPTY,
                new: Look::EMPTY,
                apart: 0.0
            };
            judged.len()
        ];
        for (i, here) in looks.iter_mut().enumerate() {
            if !judged[i] {
                continue;
            }
            let p = patch.window.points[i];
            let kept = canvas
                .covered(p)
                .then(|| self.source.look(canvas.places[p as usize]));
            let taken =
                (patch.mask[i] || kept.is_none()).then(|| self.source.look(patch.places[i]));
            // A point out of the patch that shows nothing is in no pair.
            let any = kept.or(taken).unwrap_or(Look::EMPTY);
            here.old = kept.unwrap_or(any);
            here.new = taken.unwrap_or(any);
            here.apart = distance(&here.old, &here.new);
        }
        looks
    }

    /// What the window of a patch costs as it is.
    pub(super) fn value(&self, canvas: &Canvas<D>, patch: &Proposal<'_, D>) -> f64 {
        let mut value = 0.0;
        for i in 0..patch.window.grid.len() {
            if patch.mask[i] {
                value += f64::from(self.points(canvas, patch, i)[0]);
            }
        }
        for axis in 0..D {
            links(&patch.window.grid, axis, |p, _| {
                value += f64::from(canvas.seams[patch.window.points[p] as usize][axis]);
            });
        }
        value
    }

    /// What a point costs that keeps what it shows, or takes the patch.
    fn points(&self, canvas: &Canvas<D>, patch: &Proposal<'_, D>, i: usize) -> [f32; 2] {
        let p = patch.window.points[i];
        let mut costs = [
            self.weights.distortion * canvas.distortion(p),
            self.weights.distortion * patch.distortion.get(i).copied().unwrap_or(0.0),
        ];
        if let Some(guide) = self.guide {
            let places = [canvas.places[p as usize], patch.places[i]];
            for (cost, place) in costs.iter_mut().zip(places) {
                *cost += self.weights.guide
                    * guide.cost(p as usize, self.source.sample(place)) as f32
                    / UNRELATED;
            }
        }
        if canvas.covered(p) {
            costs
        } else {
            [0.0, costs[1]]
        }
    }

    /// What is seen where one look is beside another, and how far the pictures are apart there.
    #[inline(always)]
    fn pair(&self, l: &Look, r: &Look, apart: f32) -> f32 {
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

fn tie<const D: usize>(canvas: &Canvas<D>, patch: &Proposal<'_, D>, i: usize) -> Tie {
    match (
        canvas.patches[patch.window.points[i] as usize],
        patch.mask[i],
    ) {
        (FREE, false) => Tie::Out,
        (FREE, true) => Tie::New,
        (HELD, _) | (_, false) => Tie::Old,
        _ if patch.core.get(i).is_some_and(|&c| c) => Tie::New,
        _ => Tie::Either,
    }
}

#[inline(always)]
fn distance(a: &Look, b: &Look) -> f32 {
    let mut sum = 0.0;
    for c in 0..CHANNELS {
        sum += (a.colour[c] - b.colour[c]).abs();
    }
    sum
}
