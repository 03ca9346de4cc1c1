//! Kernels of texrs: new textures from one example.
//!
//! The rooms, from the ground up. Each knows only those above it in this list.
//!
//! | room | noun |
//! |---|---|
//! | [`error`] | the one error type |
//! | [`grid`] | shape, strides, wrap or clamp per axis; two and three dimensions from one source |
//! | [`par`] | the process-local thread pool, fixed chunks, progress and cancellation |
//! | [`hash`] | counter-based noise: randomness belongs to the position, never to a stream |
//! | [`fixed`] | coordinates and frames in fixed point |
//! | [`pca`] | principal components |
//! | [`sparse`] | symmetric positive definite systems: factored once, solved many times |
//! | [`appearance`] | what the surroundings of each sample of an exemplar look like |
//! | [`guide`] | what an output is asked to show beside looking like the exemplar |
//! | [`blocks`] | a coherent start: cells filled by pieces that fit |
//! | [`pyramid`] | from one resolution to the next |
//! | [`optimize`] | coordinates corrected until every window is like one of the exemplar |
//! | [`coherence`] | samples that look alike, and points that choose among those their neighbours know |
//! | [`gather`] | an exemplar of any type looked up through coordinates |
//! | [`seam`] | minimum cuts on grids: max-flow, planar strips, binary labels |
//! | [`mean_shift`] | joint spatial and range filtering |
//! | [`ncc`] | how alike a template and each window of an image are |
//! | [`nearest`] | the nearest of many vectors |
//! | [`patch_search`] | exact best matches of a masked patch |
//! | [`poisson`] | images from their differences, near given values |
//! | [`complete`] | filling holes by example |
//! | [`warp`] | where each pixel comes from, of pictures warped by moved points |
//! | [`image_io`] | 8/16-bit and float image files, with limits |
//!
//! `py` is the door to Python; nothing here imports it.
//!
//! Every kernel gives the same bytes for any number of threads.

pub mod error;
pub mod fixed;
pub mod grid;
pub mod hash;
pub mod image_io;
pub mod par;
pub mod pca;
pub mod sparse;

pub mod appearance;
pub mod blocks;
pub mod coherence;
pub mod complete;
pub mod gather;
pub mod guide;
pub mod mean_shift;
pub mod ncc;
pub mod nearest;
pub mod optimize;
pub mod patch_search;
pub mod poisson;
pub mod pyramid;
pub mod seam;
pub mod warp;

#[cfg(feature = "python")]
mod py;

pub use error::{Error, Result};
