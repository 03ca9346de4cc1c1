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
use crate::engine::guide::Guide;
use crate::foundation::fixed::Place;
use crate::foundation::par::Monitor;
use crate::kernels::seam::links;
use crate::Result;

/// Added to every pair, so that ties go to the shorter seam.
const SHORTEST: f32 = 2e-3;
/// Costs of one pair are at most this, so that sums stay within 32 bits.
pub(super) const MOST: f32 = 1000.0;
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
    const NONE: Self = Self { old_new: -1.0, new_old: -1.0, kept: 0.0 };
}

impl<'a, const D: usize> Proposal<'a, D> {
    /// A chart with its centre at a place.
    pub fn new(chart: &'a Chart<D>, place: Place<D>) -> Self {
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

/// What cuts are made with.
pub(super) struct Cutter<'a, const D: usize> {
    pub source: &'a Source<D>,
    pub weights: Weights,
    pub guide: Option<&'a Guide<'a>>,
}

impl<const D: usize> Cutter<'_, D> {
    /// Cuts a patch into the canvas: coarsely, where that tells enough to compare it with others (see [`Energy`]).
    pub fn cut(
        &self,
        canvas: &Canvas<D>,
        patch: &Proposal<'_, D>,
        coarse: bool,
        monitor: &Monitor,
    ) -> Result<Cutting<D>> {
        let (window, n) = (patch.window, patch.window.grid.len());
        let ties: Vec<Tie> = (0..n).map(|i| tie(canvas, patch, i)).collect();
        let mut energy = Energy::new(window.grid);
        let mut unary = vec![[0.0f32; 2]; n];
        for i in 0..n {
            if ties[i] == Tie::Out || !patch.mask[i] {
                continue;
            }
            unary[i] = self.points(canvas, patch, i);
            if ties[i] == Tie::Either {
                energy.terminal[i] = capacity(unary[i][1] - unary[i][0]);
            }
        }
        let pairs = self.pairs(canvas, patch, &ties);
        for axis in 0..D {
            energy.add_pairs(axis, &ties, &pairs[axis]);
        }
        let sink = energy.minimise(coarse, monitor)?;
        let take: Vec<bool> = (0..n).map(|i| ties[i] == Tie::New || ties[i] == Tie::Either && sink[i]).collect();
        let mut value: f64 = (0..n).map(|i| f64::from(unary[i][usize::from(take[i])])).sum();
        let mut seams: Vec<[f32; D]> = window.points.iter().map(|&p| canvas.seams[p as usize]).collect();
        for axis in 0..D {
            links(&window.grid, axis, |p, q| {
                let Pair { old_new, new_old, kept } = pairs[axis][p];
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
        Ok(Cutting { value, take, seams })
    }

    /// What each point shows that keeps what it has, and that takes the patch: the same where it has no choice.
    fn looks(&self, canvas: &Canvas<D>, patch: &Proposal<'_, D>, ties: &[Tie]) -> [Vec<Look>; 2] {
        let n = ties.len();
        let (mut old, mut new) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for i in 0..n {
            let p = patch.window.points[i];
            let kept = canvas.covered(p).then(|| self.source.look(canvas.places[p as usize]));
            let taken = (patch.mask[i] || kept.is_none()).then(|| self.source.look(patch.places[i]));
            // A point out of the patch that shows nothing is in no pair.
            let any = kept.or(taken).unwrap_or(Look::EMPTY);
            old.push(kept.unwrap_or(any));
            new.push(taken.unwrap_or(any));
        }
        [old, new]
    }

    /// The costs of all pairs along each axis.
    fn pairs(&self, canvas: &Canvas<D>, patch: &Proposal<'_, D>, ties: &[Tie]) -> [Vec<Pair>; D] {
        let points = &patch.window.points;
        let [old, new] = self.looks(canvas, patch, ties);
        // Where the patch shows what is there already there is no seam.
        let same: Vec<bool> = (0..ties.len())
            .map(|i| canvas.places[points[i] as usize] == patch.places[i] && canvas.covered(points[i]))
            .collect();
        let mut pairs: [Vec<Pair>; D] = std::array::from_fn(|_| vec![Pair::NONE; ties.len()]);
        for (axis, pairs) in pairs.iter_mut().enumerate() {
            links(&patch.window.grid, axis, |p, q| {
                if ties[p] == Tie::Out || ties[q] == Tie::Out || !(patch.mask[p] || patch.mask[q]) {
                    return;
                }
                let kept = canvas.seams[points[p] as usize][axis];
                let crossing = |same_left: bool, same_right: bool, left: &[Look], right: &[Look]| {
                    if same_left {
                        0.0
                    } else if same_right {
                        kept
                    } else {
                        self.pair(left, right, p, q)
                    }
                };
                pairs[p] = Pair {
                    old_new: crossing(same[p], same[q], &old, &new),
                    new_old: crossing(same[q], same[p], &new, &old),
                    kept,
                };
            });
        }
        pairs
    }

    /// What the window of a patch costs as it is.
    pub fn value(&self, canvas: &Canvas<D>, patch: &Proposal<'_, D>) -> f64 {
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
                *cost += self.weights.guide * guide.cost(p as usize, self.source.sample(place)) as f32 / UNRELATED;
            }
        }
        if canvas.covered(p) { costs } else { [0.0, costs[1]] }
    }

    /// What is seen where `p` keeps what is on the left, and `q` what is on the right.
    #[inline(always)]
    fn pair(&self, left: &[Look], right: &[Look], p: usize, q: usize) -> f32 {
        let w = &self.weights;
        let (l, r) = (&left[p], &right[q]);
        let mut cost = SHORTEST;
        if w.colour > 0.0 {
            let (a, b) = (distance(l, &right[p]), distance(&left[q], r));
            cost += w.colour * (a * a + b * b) / 8.0;
        }
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

fn tie<const D: usize>(canvas: &Canvas<D>, patch: &Proposal<'_, D>, i: usize) -> Tie {
    match (canvas.patches[patch.window.points[i] as usize], patch.mask[i]) {
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
