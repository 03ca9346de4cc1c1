//! What a seam costs, as far as its user says.

use crate::{Error, Result};

/// What a seam costs.
#[derive(Debug, Clone, Copy)]
pub struct Weights {
    /// Squared differences of the colours on both sides.
    pub colour: f32,
    /// Two elements in contact, of whatever colours.
    pub contact: f32,
    /// A jump of the depth: an element that is cut off.
    pub jump: f32,
    /// A seam inside of an element, by its depth on both sides.
    pub depth: f32,
    /// An element beside another one's border: joints stay as wide as two samples.
    pub joint: f32,
    /// A point that shows none: cuts around elements are shorter, and would leave fewer of them than there are.
    pub presence: f32,
    /// Classes that are seldom side by side.
    pub surprise: f32,
    /// A point whose patch is bent against the field.
    pub distortion: f32,
    /// A point that does not show what is asked.
    pub guide: f32,
}

impl Weights {
    /// Nothing costs anything.
    pub const NONE: Self = Self {
        colour: 0.0,
        contact: 0.0,
        jump: 0.0,
        depth: 0.0,
        joint: 0.0,
        presence: 0.0,
        surprise: 0.0,
        distortion: 0.0,
        guide: 0.0,
    };

    pub(super) fn check(&self) -> Result<()> {
        let all = [
            self.colour,
            self.contact,
            self.jump,
            self.depth,
            self.joint,
            self.presence,
            self.surprise,
            self.distortion,
            self.guide,
        ];
        if all.iter().all(|x| (0.0..=100.0).contains(x)) {
            return Ok(());
        }
        Err(Error::value(
            "weights",
            format!("0 to 100 are allowed, got {self:?}"),
        ))
    }
}
