//! Soft constraints: what an output is asked to show at its points, beside looking like the exemplar (values, a trend, a
//! scale).

use crate::engine::appearance::{CHANNELS, Colour};
use crate::foundation::error::check_shape;
use crate::{Error, Result};

/// Samples that are drawn from, at least, as a part of all: those whose first values are nearest to the wanted one.
const SHARE: usize = 25;
/// First values that are as good as the wanted one.
const ALIKE: i32 = 48;
/// Cost of windows that have nothing to do with each other: what is asked counts in these units.
pub(crate) const UNRELATED: f32 = 2.0 * 512.0 * 512.0;
/// Weight of samples whose first value is more than what is asked where that counts as much as less.
const EVEN: i64 = 256;
/// Values that 12 bits hold.
const VALUES: i32 = 4096;

/// Values of the exemplar's samples and those wanted at the points of the output, both within 12 bits.
#[derive(Debug, Clone)]
pub struct Guide<'a> {
    exemplar: &'a [Colour],
    output: Wanted<'a>,
    /// Cost of a squared difference of one, in 1 / 256; 0 where nothing is asked. One, or one a point.
    weight: &'a [u16],
    /// Samples by their first value, the least first; empty where samples are drawn from anywhere.
    order: &'a [u32],
    /// For each first value, how many of the order have a lesser one.
    before: Vec<u32>,
    /// What it counts that a sample's first value is more than what is asked, in 1 / 256 of what it counts that it is less.
    excess: i64,
}

/// Values at the points of the output. Outputs are large, and a scale is one number.
#[derive(Debug, Clone, Copy)]
enum Wanted<'a> {
    All(&'a [Colour]),
    /// The first ones; the others are zero.
    First(&'a [i16]),
}

impl<'a> Guide<'a> {
    /// A guide for an exemplar of `samples` and an output of `points`: for each its four values or the first, and a
    /// weight for each or one for all.
    pub fn new(
        exemplar: &'a [Colour],
        output: &'a [i16],
        weight: &'a [u16],
        samples: usize,
        points: usize,
    ) -> Result<Self> {
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
            return Err(Error::value("guide", "values of 12 bits are allowed"));
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

    /// Draws from samples near what is asked: `order` holds those that may be drawn, by their first value.
    pub fn ordered(mut self, order: &'a [u32]) -> Result<Self> {
        let value = |k: &u32| self.exemplar.get(*k as usize).map(|v| i32::from(v[0]));
        if !order.iter().all(|k| value(k).is_some()) || !order.is_sorted_by_key(value) {
            return Err(Error::value(
                "order of the guide",
                "needs samples of the exemplar, by their first value",
            ));
        }
        if !order.is_empty() {
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

    /// Lets samples whose first value is more than what is asked count so many 256th of those where it is less.
    pub fn lopsided(mut self, excess: u16) -> Self {
        self.excess = i64::from(excess);
        self
    }

    /// A sample drawn near what is asked at a point, by a random word; none where samples are drawn from anywhere.
    #[inline(always)]
    pub(crate) fn near(&self, point: usize, word: u32) -> Option<usize> {
        if self.order.is_empty() {
            return None;
        }
        let wanted = i32::from(self.wanted(point)[0]) + VALUES / 2;
        let before = |v: i32| self.before[v.clamp(0, VALUES) as usize] as usize;
        let (middle, half) = (before(wanted), (self.order.len() / SHARE).max(12) / 2);
        let low = before(wanted - ALIKE).min(middle.saturating_sub(half));
        let high = before(wanted + ALIKE + 1)
            .max(middle + half)
            .min(self.order.len());
        let low = low.min(high.saturating_sub(half));
        let pick = low + ((u64::from(word) * (high - low) as u64) >> 32) as usize;
        Some(self.order[pick] as usize)
    }

    /// Whether anything is asked at a point.
    pub(crate) fn asks(&self, point: usize) -> bool {
        self.weight(point) > 0
    }

    /// The values of a sample.
    pub(crate) fn value(&self, sample: usize) -> Colour {
        self.exemplar[sample]
    }

    /// What a squared difference of one costs at a point, in 1 / 256.
    #[inline(always)]
    pub(crate) fn weight(&self, point: usize) -> u16 {
        self.weight[point.min(self.weight.len() - 1)]
    }

    /// The values that are wanted at a point.
    #[inline(always)]
    pub(crate) fn wanted(&self, point: usize) -> Colour {
        match self.output {
            Wanted::All(values) => values[point],
            Wanted::First(values) => [values[point], 0, 0, 0],
        }
    }

    /// What it costs to show a sample at a point.
    #[inline(always)]
    pub(crate) fn cost(&self, point: usize, sample: usize) -> i64 {
        let weight = self.weight(point);
        if weight == 0 {
            return 0;
        }
        (self.difference(sample, &self.wanted(point)) * i64::from(weight)) >> 8
    }

    /// Squared difference of the values of a sample and of wanted ones.
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

    /// Whether more than what is asked counts otherwise than less.
    pub(crate) fn is_lopsided(&self) -> bool {
        self.excess != EVEN
    }

    /// The least and the largest first value that is wanted.
    pub(crate) fn span(&self) -> (i16, i16) {
        let firsts: &mut dyn Iterator<Item = i16> = match self.output {
            Wanted::All(values) => &mut values.iter().map(|v| v[0]),
            Wanted::First(values) => &mut values.iter().copied(),
        };
        let first = firsts.next().unwrap_or(0);
        firsts.fold((first, first), |(low, high), x| (low.min(x), high.max(x)))
    }
}
