//! Soft constraints: values, such as a trend or a scale, that the output should show at its points.

use crate::engine::appearance::{CHANNELS, Colour};
use crate::foundation::error::check_shape;
use crate::{Error, Result};

/// A draw chooses among at least 1 / SHARE of the samples, those whose first values are nearest to the wanted value.
const SHARE: usize = 25;
/// Maximum difference between the first value of a sample and the wanted value for which samples count as equally
/// good.
const ALIKE: i32 = 48;
/// Cost of two unrelated windows, in the units of appearance vectors. The stitcher divides the costs of a guide by it.
pub(crate) const UNRELATED: f32 = 2.0 * 512.0 * 512.0;
/// Weight of an excess, a first value above the wanted one, that equals the weight of a deficit.
const EVEN: i64 = 256;
/// Number of different values of a 12-bit integer.
const VALUES: i32 = 4096;

/// Values of the exemplar's samples, and wanted values at the points of the output. Both have 12 bits.
#[derive(Debug, Clone)]
pub struct Guide<'a> {
    exemplar: &'a [Colour],
    output: Wanted<'a>,
    /// Cost of a squared difference of 1, in units of 1 / 256, and 0 at points without a constraint. There is one
    /// weight for all points, or one for each point.
    weight: &'a [u16],
    /// Samples that may be drawn, in ascending order of their first value. Empty if draws ignore the guide.
    order: &'a [u32],
    /// For each possible first value, the number of samples in `order` that have a lower one.
    before: Vec<u32>,
    /// Weight of an excess, in units of 1 / 256 of the weight of a deficit.
    excess: i64,
}

/// Wanted values at the points of the output. Outputs are large, and a scale needs only one value at each point.
#[derive(Debug, Clone, Copy)]
enum Wanted<'a> {
    All(&'a [Colour]),
    /// Only the first of the four values. The others are zero.
    First(&'a [i16]),
}

impl<'a> Guide<'a> {
    /// Creates a guide for an exemplar with `samples` samples and an output with `points` points. The exemplar has
    /// four values for each sample. The output has four values or one for each point. There is one weight for all
    /// points, or one for each.
    pub fn new(
        exemplar: &'a [Colour],
        output: &'a [i16],
        weight: &'a [u16],
        samples: usize,
        points: usize,
    ) -> Result<Self> {
        // The lengths of the arrays determine their layout.
        let first = output.len() == points;
        let values = if first { 1 } else { CHANNELS };
        let weights = if weight.len() == 1 { 1 } else { points };
        for (argument, expected, got) in [
            ("guide of the exemplar", samples, exemplar.len()),
            ("guide of the output", points * values, output.len()),
            ("weight of the guide", weights, weight.len()),
        ] {
            check_shape(argument, &[expected], got)?;
        }
        let within = |x: &i16| (-2048..2048).contains(x);
        if !exemplar.as_flattened().iter().chain(output).all(within) {
            return Err(Error::value("guide", "must have values from -2048 to 2047"));
        }
        Ok(Self {
            exemplar,
            output: if first {
                Wanted::First(output)
            } else {
                Wanted::All(output.as_chunks().0)
            },
            weight,
            order: &[],
            before: Vec::new(),
            excess: EVEN,
        })
    }

    /// Makes `near` prefer samples near the wanted value. `order` contains the samples that may be drawn, sorted by
    /// their first value.
    pub fn ordered(mut self, order: &'a [u32]) -> Result<Self> {
        let value = |k: &u32| self.exemplar.get(*k as usize).map(|v| i32::from(v[0]));
        if !order.iter().all(|k| value(k).is_some()) || !order.is_sorted_by_key(value) {
            return Err(Error::value(
                "order of the guide",
                "must contain samples of the exemplar, sorted by their first value",
            ));
        }
        if !order.is_empty() {
            // Count the samples by value, then accumulate the counts.
            self.before = vec![0; VALUES as usize + 1];
            for k in order {
                let v = i32::from(self.exemplar[*k as usize][0]) + VALUES / 2;
                self.before[v as usize + 1] += 1;
            }
            for v in 0..VALUES as usize {
                self.before[v + 1] += self.before[v];
            }
        }
        self.order = order;
        Ok(self)
    }

    /// Sets the weight of an excess, in units of 1 / 256 of the weight of a deficit.
    pub fn lopsided(mut self, excess: u16) -> Self {
        self.excess = i64::from(excess);
        self
    }

    /// Draws a sample whose first value is near the value wanted at a point. `word` is a random number. Returns `None`
    /// if draws ignore the guide.
    #[inline(always)]
    pub(crate) fn near(&self, point: usize, word: u32) -> Option<usize> {
        if self.order.is_empty() {
            return None;
        }
        let wanted = i32::from(self.wanted(point)[0]) + VALUES / 2;
        let before = |v: i32| self.before[v.clamp(0, VALUES) as usize] as usize;
        let (middle, half) = (before(wanted), (self.order.len() / SHARE).max(12) / 2);
        // Draw from all samples that are good enough. If these are few, draw from the nearest ones.
        let low = before(wanted - ALIKE).min(middle.saturating_sub(half));
        let high = before(wanted + ALIKE + 1)
            .max(middle + half)
            .min(self.order.len());
        let low = low.min(high.saturating_sub(half));
        let pick = low + ((u64::from(word) * (high - low) as u64) >> 32) as usize;
        Some(self.order[pick] as usize)
    }

    /// Returns whether a point is constrained.
    pub(crate) fn asks(&self, point: usize) -> bool {
        self.weight(point) > 0
    }

    /// Returns the values of a sample.
    pub(crate) fn value(&self, sample: usize) -> Colour {
        self.exemplar[sample]
    }

    /// Returns the cost of a squared difference of 1 at a point, in units of 1 / 256.
    #[inline(always)]
    pub(crate) fn weight(&self, point: usize) -> u16 {
        self.weight[point.min(self.weight.len() - 1)]
    }

    /// Returns the wanted values at a point.
    #[inline(always)]
    pub(crate) fn wanted(&self, point: usize) -> Colour {
        match self.output {
            Wanted::All(values) => values[point],
            Wanted::First(values) => [values[point], 0, 0, 0],
        }
    }

    /// Returns the cost of showing a sample at a point.
    #[inline(always)]
    pub(crate) fn cost(&self, point: usize, sample: usize) -> i64 {
        let weight = self.weight(point);
        if weight == 0 {
            return 0;
        }
        (self.difference(sample, &self.wanted(point)) * i64::from(weight)) >> 8
    }

    /// Returns the squared difference between the values of a sample and wanted values.
    #[inline(always)]
    pub(crate) fn difference(&self, sample: usize, wanted: &Colour) -> i64 {
        let mut sum = 0;
        for (c, (&a, &b)) in self.exemplar[sample].iter().zip(wanted).enumerate() {
            let d = i64::from(a) - i64::from(b);
            let lopsided = c == 0 && d > 0;
            sum += if lopsided {
                (d * d * self.excess) >> 8
            } else {
                d * d
            };
        }
        sum
    }

    /// Returns whether an excess has a different weight from a deficit.
    pub(crate) fn is_lopsided(&self) -> bool {
        self.excess != EVEN
    }

    /// Returns the lowest and the highest wanted first value.
    pub(crate) fn span(&self) -> (i16, i16) {
        let firsts: &mut dyn Iterator<Item = i16> = match self.output {
            Wanted::All(values) => &mut values.iter().map(|v| v[0]),
            Wanted::First(values) => &mut values.iter().copied(),
        };
        let first = firsts.next().unwrap_or(0);
        firsts.fold((first, first), |(low, high), x| (low.min(x), high.max(x)))
    }
}
