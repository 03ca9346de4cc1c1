//! What an output is asked to show at its points, beside looking like the exemplar: given values, a trend, a scale.

use crate::appearance::{CHANNELS, Colour};
use crate::{Error, Result};

/// Values of the exemplar's samples and those wanted at the points of the output, both within 12 bits.
#[derive(Debug, Clone, Copy)]
pub struct Guide<'a> {
    exemplar: &'a [Colour],
    output: &'a [Colour],
    /// Cost of a squared difference of one, in 1 / 256; 0 where nothing is asked.
    weight: &'a [u16],
}

impl<'a> Guide<'a> {
    /// A guide for an exemplar of `samples` and an output of `points`.
    pub fn new(
        exemplar: &'a [Colour],
        output: &'a [Colour],
        weight: &'a [u16],
        samples: usize,
        points: usize,
    ) -> Result<Self> {
        for (argument, expected, got) in [
            ("guide of the exemplar", samples, exemplar.len()),
            ("guide of the output", points, output.len()),
            ("weight of the guide", points, weight.len()),
        ] {
            if expected != got {
                return Err(Error::Shape {
                    argument,
                    expected: vec![expected],
                    got: vec![got],
                });
            }
        }
        let within = |x: &i16| (-2048..2048).contains(x);
        if !exemplar.iter().chain(output).flatten().all(within) {
            return Err(Error::value("guide", "values of 12 bits are allowed"));
        }
        Ok(Self {
            exemplar,
            output,
            weight,
        })
    }

    /// Whether anything is asked at a point.
    pub(crate) fn asks(&self, point: usize) -> bool {
        self.weight[point] > 0
    }

    /// What it costs to show a sample at a point.
    #[inline(always)]
    pub(crate) fn cost(&self, point: usize, sample: usize) -> i64 {
        let weight = self.weight[point];
        if weight == 0 {
            return 0;
        }
        let (a, b) = (&self.exemplar[sample], &self.output[point]);
        let mut sum = 0;
        for c in 0..CHANNELS {
            let d = i64::from(a[c]) - i64::from(b[c]);
            sum += d * d;
        }
        (sum * i64::from(weight)) >> 8
    }
}
