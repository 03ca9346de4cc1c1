//! The inner loops of coarse-to-fine synthesis. Each works on one resolution of an exemplar and an output, in fixed
//! point.

pub mod appearance;
pub mod blocks;
pub mod coherence;
pub mod guide;
pub mod optimize;
pub mod pyramid;
pub mod quilt;
pub mod stitcher;

#[cfg(test)]
mod hostile_tests;
