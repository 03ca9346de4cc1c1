//! The best places for a patch: those where what is known of it fits best, for all places at once.
//!
//! Whatever the chart does to a patch, another place is another shift of the exemplar. So the points that are known
//! already are written where the chart takes them, into a template of the exemplar's size, and the sum of squared
//! differences of every shift is a correlation: SSD(s) = corr(E^2, W) - 2 corr(E, W T) + const.

use std::sync::Arc;

use super::canvas::{Canvas, FREE};
use super::chart::Chart;
use super::source::{CHANNELS, Source};
use crate::engine::guide::{Guide, UNRELATED};
use crate::foundation::fft::{Complex, Volumes};
use crate::foundation::fixed::{BITS, ONE, Place, nearest};
use crate::foundation::grid::Grid;
use crate::foundation::hash::Noise;

/// Places that are tried lie at least so many samples apart.
const APART: usize = 3;
/// A neighbour goes on within so many samples of the place where it ends.
const NEAR: i32 = 6;
/// Points of a neighbour that count as going on.
const FEW: u32 = 12;
/// What places may fall short of the best by where nothing is there to fit; windows that have nothing to do with each other
/// differ by 2.
const CHANCE: f32 = 0.1;
/// How often a place may have been shown beyond the mean, at most, as it counts.
const OFTEN: f32 = 6.0;

/// Distance of levels of what is asked, at most: between them costs are interpolated.
const LEVEL: f32 = 160.0;

type Spectrum = Vec<Complex<f32>>;

/// What it costs to choose places that others have chosen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Charges {
    /// For places that have been shown more often than others.
    pub repetition: f32,
    /// For going on exactly where a neighbour ends.
    pub continuation: f32,
}

/// An exemplar, transformed.
pub(super) struct Index<const D: usize> {
    grid: Grid<D>,
    /// Of the transforms, at least the exemplar's.
    size: [usize; D],
    plan: Arc<Volumes>,
    colours: Arc<Squares>,
    guide: Option<Asked>,
    charges: Charges,
    /// How often what lies around each sample has been shown.
    shown: Vec<f32>,
    total: f64,
}

/// Spectra of values, and of the sum of their squares.
#[derive(Default)]
struct Squares {
    values: Vec<Spectrum>,
    squares: Spectrum,
}

/// What is asked, as it is compared.
enum Asked {
    /// By squared differences.
    Squares(Squares),
    /// By any cost: what samples cost where the first value of a level is wanted.
    Levels {
        /// The first level.
        low: f32,
        /// From one to the next.
        step: f32,
        costs: Vec<Spectrum>,
    },
}

/// A template: values with weights, in the exemplar's frame.
struct Template {
    weight: Vec<f32>,
    values: Vec<Vec<f32>>,
}

impl<const D: usize> Index<D> {
    /// Transforms a source, and the values of a guide.
    pub(super) fn new(source: &Source<D>, guide: Option<&Guide<'_>>, charges: Charges) -> Self {
        let grid = *source.grid();
        let size: [usize; D] = std::array::from_fn(|a| {
            if grid.wrap()[a] {
                grid.shape()[a]
            } else {
                Volumes::fast(grid.shape()[a])
            }
        });
        let plan = Arc::new(Volumes::new(if D == 2 {
            [size[0], 1, size[1]]
        } else {
            [size[0], size[1], size[D - 1]]
        }));
        let mut this = Self {
            grid,
            size,
            plan,
            colours: Arc::default(),
            guide: None,
            charges,
            shown: vec![0.0; grid.len()],
            total: 0.0,
        };
        let channels = source.channels();
        let colours: Vec<Vec<f32>> = (0..channels)
            .map(|c| source.colours().map(|x| x[c]).collect())
            .collect();
        this.colours = Arc::new(this.squares(&colours));
        this.guide = guide.map(|guide| {
            if guide.is_lopsided() {
                return this.levels(guide);
            }
            let values: Vec<Vec<f32>> = (0..CHANNELS)
                .map(|c| {
                    (0..grid.len())
                        .map(|k| f32::from(guide.value(k)[c]))
                        .collect::<Vec<f32>>()
                })
                .filter(|plane| plane.iter().any(|&x| x != 0.0))
                .collect();
            Asked::Squares(this.squares(&values))
        });
        this
    }

    /// What samples cost, by what is wanted.
    fn levels(&self, guide: &Guide<'_>) -> Asked {
        let (low, high) = guide.span();
        let count = (f32::from(high - low) / LEVEL).ceil() as usize + 1;
        let step = f32::from(high - low) / (count - 1).max(1) as f32;
        let spectra = (0..count).map(|k| {
            let wanted = [low + (k as f32 * step).round() as i16, 0, 0, 0];
            let mut padded = vec![0.0; self.points()];
            for i in 0..self.grid.len() {
                padded[self.position(self.grid.point(i))] = guide.difference(i, &wanted) as f32;
            }
            self.plan.forward(&padded)
        });
        Asked::Levels {
            low: f32::from(low),
            step: step.max(1.0),
            costs: spectra.collect(),
        }
    }

    /// The same source, of which nothing has been shown, with other charges and no guide.
    pub(super) fn afresh(&self, charges: Charges) -> Self {
        Self {
            plan: Arc::clone(&self.plan),
            colours: Arc::clone(&self.colours),
            guide: None,
            charges,
            shown: vec![0.0; self.grid.len()],
            total: 0.0,
            ..*self
        }
    }

    fn points(&self) -> usize {
        self.size.iter().product()
    }

    fn squares(&self, planes: &[Vec<f32>]) -> Squares {
        let mut sum = vec![0.0; self.points()];
        let mut values = Vec::new();
        for plane in planes {
            let mut padded = vec![0.0; self.points()];
            for (i, &x) in plane.iter().enumerate() {
                let at = self.position(self.grid.point(i));
                padded[at] = x;
                sum[at] += x * x;
            }
            values.push(self.plan.forward(&padded));
        }
        let squares = self.plan.forward(&sum);
        Squares { values, squares }
    }

    /// Row-major position in an array of the transforms' size.
    #[inline(always)]
    fn position(&self, point: [usize; D]) -> usize {
        (0..D).fold(0, |at, a| at * self.size[a] + point[a])
    }

    /// Notes that a patch of a side has been shown around a sample.
    pub(super) fn note(&mut self, place: Place<D>, side: f32) {
        let (centre, reach) = (nearest(place), side.ceil() as i32);
        let mut axes: Vec<Vec<(usize, f32)>> = Vec::with_capacity(D);
        for a in 0..D {
            let reach = reach.min(if self.grid.wrap()[a] {
                (self.grid.shape()[a] as i32 - 1) / 2
            } else {
                reach
            });
            let near = (-reach..=reach).filter_map(|d| {
                let at = self.grid.inside(a, (centre[a] + d) as isize)?;
                Some((at, (1.0 - d.abs() as f32 / side).max(0.0)))
            });
            axes.push(near.collect());
        }
        let shape = self.grid.shape();
        let count: usize = axes.iter().map(Vec::len).product();
        for k in 0..count {
            let (mut rest, mut at, mut weight, mut step) = (k, 0, 1.0, 1);
            for a in (0..D).rev() {
                let (i, w) = axes[a][rest % axes[a].len()];
                rest /= axes[a].len();
                at += i * step;
                step *= shape[a];
                weight *= w;
            }
            self.shown[at] += weight;
            self.total += f64::from(weight);
        }
    }

    /// The places of the centre of a chart that fit known points of it best, the best one first; at most `count`.
    #[allow(clippy::too_many_arguments)] // what is searched for, and where
    pub(super) fn best(
        &self,
        source: &Source<D>,
        canvas: &Canvas<D>,
        chart: &Chart<D>,
        known: &[bool],
        guide: Option<&Guide<'_>>,
        count: usize,
        noise: &Noise,
    ) -> Vec<Place<D>> {
        let Some((low, high)) = extent(chart) else {
            return Vec::new();
        };
        // Position i of the template is the place i - first of the centre.
        let first: [i32; D] = std::array::from_fn(|a| low[a] >> BITS);
        let last: [usize; D] = std::array::from_fn(|a| {
            let n = self.grid.shape()[a] as i32;
            if self.grid.wrap()[a] {
                n as usize - 1
            } else {
                let far = (n - 1) * ONE - high[a];
                ((far >> BITS) + first[a]).max(0) as usize
            }
        });
        let (known, points) = self.splat_known(source, canvas, chart, known, first);
        let asked = guide.and_then(|guide| self.splat_asked(guide, chart, first));
        if points == 0 && asked.is_none() {
            let sides = last.map(|n| n as u64 + 1);
            let draw = noise.below(sides.iter().product(), [0x70, 0, 0, 0]);
            let mut rest = draw;
            let mut at = [0; D];
            for a in (0..D).rev() {
                at[a] = ((rest % sides[a]) as i32 - first[a]) * ONE;
                rest /= sides[a];
            }
            return vec![at];
        }
        let mut spectrum = vec![Complex::default(); self.colours.squares.len()];
        if points > 0 {
            self.correlate(
                &self.colours,
                &known,
                1.0 / (points as f32 * source.channels() as f32),
                &mut spectrum,
            );
        }
        if let Some((template, points)) = &asked {
            let scale = 2.0 / (*points as f32 * UNRELATED);
            match &self.guide {
                Some(Asked::Squares(squares)) => {
                    self.correlate(squares, template, scale, &mut spectrum)
                }
                Some(Asked::Levels { costs, .. }) => {
                    for (cost, weight) in costs.iter().zip(&template.values) {
                        self.correlate_cost(cost, weight, scale, &mut spectrum);
                    }
                }
                None => {}
            }
        }
        let mut scores = self.plan.inverse(spectrum);
        if points == 0 {
            // Nothing is there to fit, and many places show what is asked about as well.
            for (k, score) in scores.iter_mut().enumerate() {
                *score += CHANCE * noise.uniform([0x71, k as u32, 0, 0]) as f32;
            }
        }
        self.pick(
            &scores,
            first,
            last,
            &self.continuations(canvas, chart),
            count,
        )
    }

    /// The points of a chart that are known.
    fn splat_known(
        &self,
        source: &Source<D>,
        canvas: &Canvas<D>,
        chart: &Chart<D>,
        known: &[bool],
        first: [i32; D],
    ) -> (Template, usize) {
        let mut template = Template::new(self.points(), source.channels());
        let mut points = 0;
        for (i, &p) in chart.window.points.iter().enumerate() {
            if !known[i] {
                continue;
            }
            if let Some(at) = self.splat(chart.steps[i], first) {
                let colour = source.look(canvas.places[p as usize]).colour;
                template.add(at, 1.0, &colour);
                points += 1;
            }
        }
        (template, points)
    }

    /// What is asked of the points of a chart; none where nothing is.
    fn splat_asked(
        &self,
        guide: &Guide<'_>,
        chart: &Chart<D>,
        first: [i32; D],
    ) -> Option<(Template, usize)> {
        let asked = self.guide.as_ref()?;
        let channels = match asked {
            Asked::Squares(squares) => squares.values.len(),
            Asked::Levels { costs, .. } => costs.len(),
        };
        let mut template = Template::new(self.points(), channels);
        let mut points = 0;
        for (i, &p) in chart.window.points.iter().enumerate() {
            let p = p as usize;
            if !chart.mask[i] || !guide.asks(p) {
                continue;
            }
            if let Some(at) = self.splat(chart.steps[i], first) {
                let (value, weight) = (
                    guide.wanted(p).map(f32::from),
                    f32::from(guide.weight(p)) / 256.0,
                );
                match asked {
                    Asked::Squares(_) => template.add(at, weight, &value),
                    Asked::Levels { low, step, costs } => {
                        let level = (value[0] - low) / step;
                        let (k, part) = (level as usize, level.fract());
                        template.values[k][at] += weight * (1.0 - part);
                        template.values[(k + 1).min(costs.len() - 1)][at] += weight * part;
                    }
                }
                points += 1;
            }
        }
        (points > 0).then_some((template, points))
    }

    /// Where a step falls in a template.
    #[inline(always)]
    fn splat(&self, step: Place<D>, first: [i32; D]) -> Option<usize> {
        let near = nearest(step);
        let mut at = 0;
        for a in 0..D {
            let n = self.size[a] as i32;
            let i = near[a] - first[a];
            let i = if self.grid.wrap()[a] {
                i.rem_euclid(n)
            } else {
                i
            };
            if !(0..n).contains(&i) {
                return None;
            }
            at = at * n as usize + i as usize;
        }
        Some(at)
    }

    /// Adds the spectrum of the sums of squared differences to a template, less what is the same for all.
    fn correlate(
        &self,
        squares: &Squares,
        template: &Template,
        scale: f32,
        out: &mut [Complex<f32>],
    ) {
        let scale = scale / self.points() as f32;
        let weight = self.plan.forward(&template.weight);
        for ((out, e), w) in out.iter_mut().zip(&squares.squares).zip(&weight) {
            *out += *e * w.conj() * scale;
        }
        for (values, plane) in squares.values.iter().zip(&template.values) {
            let wanted = self.plan.forward(plane);
            for ((out, e), t) in out.iter_mut().zip(values).zip(&wanted) {
                *out -= *e * t.conj() * (2.0 * scale);
            }
        }
    }

    /// Adds the spectrum of the sums of costs of samples, by the weights of a template.
    fn correlate_cost(
        &self,
        cost: &Spectrum,
        weight: &[f32],
        scale: f32,
        out: &mut [Complex<f32>],
    ) {
        if weight.iter().all(|&w| w == 0.0) {
            return;
        }
        let scale = scale / self.points() as f32;
        let weight = self.plan.forward(weight);
        for ((out, c), w) in out.iter_mut().zip(cost).zip(&weight) {
            *out += *c * w.conj() * scale;
        }
    }

    /// The places at which the patches around a chart would go on.
    fn continuations(&self, canvas: &Canvas<D>, chart: &Chart<D>) -> Vec<[i32; D]> {
        let mut seen: Vec<(u32, u32, [i32; D])> = Vec::new();
        for (i, &p) in chart.window.points.iter().enumerate() {
            let patch = canvas.patches[p as usize];
            if patch == FREE {
                continue;
            }
            let slot = match seen.iter().rposition(|s| s.0 == patch) {
                Some(slot) => slot,
                None => {
                    let (place, step) = (canvas.places[p as usize], chart.steps[i]);
                    let centre = nearest(std::array::from_fn(|a| place[a].wrapping_sub(step[a])));
                    seen.push((patch, 0, centre));
                    seen.len() - 1
                }
            };
            seen[slot].1 += 1;
        }
        seen.iter().filter(|s| s.1 >= FEW).map(|s| s.2).collect()
    }

    /// The least scores with their charges, apart from each other.
    fn pick(
        &self,
        scores: &[f32],
        first: [i32; D],
        last: [usize; D],
        continued: &[[i32; D]],
        count: usize,
    ) -> Vec<Place<D>> {
        let mean = (self.total / self.grid.len() as f64) as f32;
        let sides = Grid::new(last.map(|n| n + 1), [false; D]);
        let Ok(sides) = sides else { return Vec::new() };
        let mut values: Vec<f32> = sides
            .points()
            .map(|point| {
                let score = scores[self.position(point)];
                if self.charges.repetition > 0.0 && mean > 0.0 {
                    let at: [usize; D] = std::array::from_fn(|a| {
                        self.grid.resolve(a, point[a] as isize - first[a] as isize)
                    });
                    score
                        + self.charges.repetition
                            * (self.shown[self.grid.index(at)] / mean).min(OFTEN)
                } else {
                    score
                }
            })
            .collect();
        if self.charges.continuation > 0.0 {
            for centre in continued {
                let at = std::array::from_fn(|a| centre[a] + first[a]);
                self.around(&sides, at, NEAR, |k| values[k] += self.charges.continuation);
            }
        }
        let mut found = Vec::with_capacity(count);
        while found.len() < count {
            let mut best = (f32::INFINITY, 0);
            for (k, &v) in values.iter().enumerate() {
                if v < best.0 {
                    best = (v, k);
                }
            }
            if best.0 == f32::INFINITY {
                break;
            }
            let point = sides.point(best.1);
            found.push(std::array::from_fn(|a| (point[a] as i32 - first[a]) * ONE));
            self.around(&sides, point.map(|x| x as i32), APART as i32, |k| {
                values[k] = f32::INFINITY
            });
        }
        found
    }

    /// Calls `f` with each position of a box around one, around the exemplar's cyclic axes.
    fn around(&self, sides: &Grid<D>, at: [i32; D], reach: i32, mut f: impl FnMut(usize)) {
        let width = 2 * reach + 1;
        for k in 0..(width as usize).pow(D as u32) {
            let (mut rest, mut point) = (k as i32, [0; D]);
            let mut inside = true;
            for a in 0..D {
                let mut i = at[a] + rest % width - reach;
                rest /= width;
                if self.grid.wrap()[a] {
                    i = i.rem_euclid(self.grid.shape()[a] as i32);
                }
                inside &= i >= 0 && (i as usize) < sides.shape()[a];
                point[a] = i.max(0) as usize;
            }
            if inside {
                f(sides.index(point));
            }
        }
    }
}

impl Template {
    fn new(points: usize, channels: usize) -> Self {
        Self {
            weight: vec![0.0; points],
            values: vec![vec![0.0; points]; channels],
        }
    }

    #[inline(always)]
    fn add(&mut self, at: usize, weight: f32, value: &[f32]) {
        self.weight[at] += weight;
        for (plane, x) in self.values.iter_mut().zip(value) {
            plane[at] += weight * x;
        }
    }
}

/// The least and the largest step of a chart along each axis.
fn extent<const D: usize>(chart: &Chart<D>) -> Option<(Place<D>, Place<D>)> {
    let mut ends: Option<(Place<D>, Place<D>)> = None;
    for (step, _) in chart.steps.iter().zip(&chart.mask).filter(|(_, m)| **m) {
        let (low, high) = ends.get_or_insert((*step, *step));
        for a in 0..D {
            low[a] = low[a].min(step[a]);
            high[a] = high[a].max(step[a]);
        }
    }
    ends
}
