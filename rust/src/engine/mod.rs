//! The inner loops of coarse-to-fine synthesis. Each works in fixed-point arithmetic on one resolution of an exemplar
//! and of an output.

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
