//! Conversion of an analysis to plain arrays, which can be stored, and back.

use super::{
    Appearance, CHANNELS, Colour, Feature, KEEP, LANES, Line, Padding, Projection, check_sides,
    numbers, window,
};
use crate::foundation::grid::Grid;
use crate::{Error, Result};

/// The arrays of an [`Appearance`].
#[derive(Debug, Clone, PartialEq)]
pub struct Parts<const D: usize> {
    /// Number of samples along each axis, and flags of the periodic axes.
    pub grid: Grid<D>,
    /// Radius of the windows, in samples.
    pub radius: usize,
    /// Number of channels in use.
    pub channels: usize,
    /// The colour of each sample.
    pub colours: Vec<Colour>,
    /// The appearance vector of each sample.
    pub features: Vec<Feature>,
    /// Rows of the projection, each padded to whole registers.
    pub basis: Vec<i16>,
    /// The projection of the mean window.
    pub bias: [i64; KEEP],
    /// Factor that turns products with the basis into components of a vector, in units of 2^-32.
    pub gain: i64,
    /// Median distance from a window to the nearest other window.
    pub spacing: i32,
}

impl<const D: usize> Appearance<D> {
    /// Returns the arrays of the analysis.
    pub fn parts(&self) -> Parts<D> {
        Parts {
            grid: self.grid,
            radius: self.radius,
            channels: self.channels,
            colours: self.colours.clone(),
            features: self.features.iter().map(|line| line.0).collect(),
            basis: self.projection.basis.clone(),
            bias: self.projection.bias,
            gain: self.projection.gain,
            spacing: self.spacing,
        }
    }

    /// Restores an analysis from its arrays. Returns an error if they do not match.
    pub fn from_parts(parts: Parts<D>) -> Result<Self> {
        let points = parts.grid.len();
        let known = (1..=8).contains(&parts.radius) && (1..=CHANNELS).contains(&parts.channels);
        let length = if known {
            check_sides(&parts.grid, parts.radius)?;
            numbers::<D>(parts.radius, parts.channels)
        } else {
            0
        };
        let padded = length.next_multiple_of(LANES);
        // Check all conditions of the unchecked integer arithmetic, because stored arrays may be damaged.
        let sums_fit = parts
            .basis
            .chunks(padded.max(1))
            .all(|row| row.iter().map(|&x| i64::from(x).abs()).sum::<i64>() * 2048 <= 1 << 31);
        let within = |x: &i16| (-2047..=2047).contains(x);
        if !known
            || parts.colours.len() != points
            || parts.features.len() != points
            || parts.basis.len() != padded * KEEP
            || !sums_fit
            || parts.bias.iter().any(|b| b.unsigned_abs() > 1 << 31)
            || !(0..=1 << 32).contains(&parts.gain)
            || parts.spacing < 0
            || !parts.colours.iter().flatten().all(within)
            || !parts.features.iter().flatten().all(within)
        {
            return Err(Error::value(
                "analysis",
                "must contain undamaged arrays that match each other, as `parts` returns them",
            ));
        }
        Ok(Self {
            grid: parts.grid,
            radius: parts.radius,
            channels: parts.channels,
            padding: Padding::new(&parts.colours, &parts.grid, parts.radius + 1),
            colours: parts.colours,
            offsets: window(parts.radius),
            projection: Projection {
                length,
                padded,
                basis: parts.basis,
                bias: parts.bias,
                gain: parts.gain,
            },
            features: parts.features.into_iter().map(Line).collect(),
            spacing: parts.spacing,
        })
    }
}
