//! Sums of squared differences of a template and an exemplar at every shift, by Fourier transforms.

use super::lattice::Lattice;
use crate::engine::guide::Guide;
use crate::engine::stitcher::source::{CHANNELS, Source};
use crate::foundation::fft::{Complex, Volumes};
use crate::foundation::grid::Grid;

/// Maximum difference of adjacent levels of the wanted value. Costs between levels are interpolated.
const LEVEL: f32 = 160.0;

type Spectrum = Vec<Complex<f32>>;

/// Spectra of an exemplar.
pub(super) struct Spectra<const D: usize> {
    pub lattice: Lattice<D>,
    plan: Volumes,
    colours: Squares,
    guide: Option<Asked>,
}

/// Spectra of values, and of the sum of their squares.
struct Squares {
    values: Vec<Spectrum>,
    squares: Spectrum,
}

/// Data with which a constraint is compared.
enum Asked {
    /// Spectra for squared differences.
    Squares(Squares),
    /// Spectra for asymmetric costs. For each level of the wanted first value, the cost of each sample.
    Levels {
        /// The first level.
        low: f32,
        /// Difference between adjacent levels.
        step: f32,
        costs: Vec<Spectrum>,
    },
}

/// Values with weights, in the coordinates of the exemplar.
pub(super) struct Template {
    weight: Vec<f32>,
    values: Vec<Vec<f32>>,
}

impl<const D: usize> Spectra<D> {
    /// Transforms a source, and the values of a guide.
    pub(super) fn new(source: &Source<D>, guide: Option<&Guide<'_>>) -> Self {
        let lattice = Lattice::new(source.grid());
        let size = lattice.size;
        let plan = Volumes::new(if D == 2 {
            [size[0], 1, size[1]]
        } else {
            [size[0], size[1], size[D - 1]]
        });
        let colours: Vec<_> = source.colours().collect();
        let planes =
            (0..source.channels()).map(|c| lattice.means(source.grid(), |i| colours[i][c]));
        let colours = Squares::new(&plan, lattice.points(), planes);
        let guide = guide.map(|guide| Asked::new(guide, source.grid(), &lattice, &plan));
        Self {
            lattice,
            plan,
            colours,
            guide,
        }
    }

    /// Returns an empty template of colours.
    pub(super) fn template(&self) -> Template {
        Template::new(self.lattice.points(), self.colours.values.len())
    }

    /// Returns an empty template of the constraint, if there is one.
    pub(super) fn template_asked(&self) -> Option<Template> {
        let channels = match self.guide.as_ref()? {
            Asked::Squares(squares) => squares.values.len(),
            Asked::Levels { costs, .. } => costs.len(),
        };
        Some(Template::new(self.lattice.points(), channels))
    }

    /// Adds a constraint to a template.
    #[inline]
    pub(super) fn ask(
        &self,
        template: &mut Template,
        at: usize,
        weight: f32,
        value: &[f32; CHANNELS],
    ) {
        match &self.guide {
            Some(Asked::Squares(_)) => template.add(at, weight, value),
            Some(Asked::Levels { low, step, costs }) => {
                let level = (value[0] - low) / step;
                let (k, part) = (level as usize, level.fract());
                template.values[k][at] += weight * (1.0 - part);
                template.values[(k + 1).min(costs.len() - 1)][at] += weight * part;
            }
            None => {}
        }
    }

    /// Returns the cost of each shift without its constant part. The costs of colours and of constraints are each
    /// multiplied by a scale.
    pub(super) fn scores(
        &self,
        colours: Option<(&Template, f32)>,
        asked: Option<(&Template, f32)>,
    ) -> Vec<f32> {
        let mut out = vec![Complex::default(); self.colours.squares.len()];
        if let Some((template, scale)) = colours {
            self.correlate(&self.colours, template, scale, &mut out);
        }
        match (&self.guide, asked) {
            (Some(Asked::Squares(squares)), Some((template, scale))) => {
                self.correlate(squares, template, scale, &mut out);
            }
            (Some(Asked::Levels { costs, .. }), Some((template, scale))) => {
                for (cost, weight) in costs.iter().zip(&template.values) {
                    self.correlate_cost(cost, weight, scale, &mut out);
                }
            }
            _ => {}
        }
        self.plan.inverse(out)
    }

    /// Adds the spectrum of the sums of squared differences, without their constant part.
    fn correlate(
        &self,
        squares: &Squares,
        template: &Template,
        scale: f32,
        out: &mut [Complex<f32>],
    ) {
        let scale = scale / self.lattice.points() as f32;
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

    /// Adds the spectrum of the sums of sample costs with the weights of a template.
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
        let scale = scale / self.lattice.points() as f32;
        let weight = self.plan.forward(weight);
        for ((out, c), w) in out.iter_mut().zip(cost).zip(&weight) {
            *out += *c * w.conj() * scale;
        }
    }
}

impl Squares {
    fn new(plan: &Volumes, points: usize, planes: impl Iterator<Item = Vec<f32>>) -> Self {
        let mut sum = vec![0.0; points];
        let mut values = Vec::new();
        for plane in planes {
            sum.iter_mut().zip(&plane).for_each(|(s, x)| *s += x * x);
            values.push(plan.forward(&plane));
        }
        Self {
            squares: plan.forward(&sum),
            values,
        }
    }
}

impl Asked {
    fn new<const D: usize>(
        guide: &Guide<'_>,
        samples: &Grid<D>,
        lattice: &Lattice<D>,
        plan: &Volumes,
    ) -> Self {
        if guide.is_lopsided() {
            let (low, high) = guide.span();
            let count = (f32::from(high - low) / LEVEL).ceil() as usize + 1;
            let step = f32::from(high - low) / (count - 1).max(1) as f32;
            let cost = |k: usize| {
                let wanted = [low + (k as f32 * step).round() as i16, 0, 0, 0];
                plan.forward(&lattice.means(samples, |i| guide.difference(i, &wanted) as f32))
            };
            return Self::Levels {
                low: f32::from(low),
                step: step.max(1.0),
                costs: (0..count).map(cost).collect(),
            };
        }
        let used = |c: &usize| (0..samples.len()).any(|i| guide.value(i)[*c] != 0);
        let count = (0..CHANNELS).rev().find(used).map_or(0, |last| last + 1);
        let planes = (0..count).map(|c| lattice.means(samples, |i| f32::from(guide.value(i)[c])));
        Self::Squares(Squares::new(plan, lattice.points(), planes))
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
    pub(super) fn add(&mut self, at: usize, weight: f32, value: &[f32]) {
        self.weight[at] += weight;
        for (plane, x) in self.values.iter_mut().zip(value) {
            plane[at] += weight * x;
        }
    }
}
