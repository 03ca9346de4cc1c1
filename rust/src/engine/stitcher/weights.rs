//! Weights of the costs of seams.

use crate::{Error, Result};

/// Weights of the costs of seams.
#[derive(Debug, Clone, Copy)]
pub struct Weights {
    /// Weight of squared differences of the colours on both sides.
    pub colour: f32,
    /// Cost of two elements in contact, whatever their colours.
    pub contact: f32,
    /// Cost of a sudden change of the depth, which cuts off an element.
    pub jump: f32,
    /// Cost of a seam inside an element, which grows with the depth on both sides.
    pub depth: f32,
    /// Cost of an element next to the border of another one, so that joints stay two samples wide.
    pub joint: f32,
    /// Cost of a point outside all elements. Without it, elements become rarer, because cuts around them are shorter.
    pub presence: f32,
    /// Cost of neighbouring classes that are rarely adjacent in the exemplar.
    pub surprise: f32,
    /// Cost of the difference between a bent patch and the field.
    pub distortion: f32,
    /// Cost of a point that does not follow the guide.
    pub guide: f32,
}

impl Weights {
    /// Weights that are all zero.
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
            format!("must be from 0 to 100, got {self:?}"),
        ))
    }
}
