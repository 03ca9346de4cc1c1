//! Kernels of texrs: new textures from one example.
//!
//! Four layers, the lowest first; a module uses those below its own layer, and of its own layer only what the table
//! names behind an arrow. Every kernel returns the same bytes for any number of threads.
//!
//! | foundation | |
//! |---|---|
//! | [`error`] | the one error type |
//! | [`grid`] | shape, strides, wrap or clamp per axis; two and three dimensions from one source |
//! | `memory` | allocations that may fail |
//! | [`par`] | the process-local thread pool, fixed chunks, progress and cancellation |
//! | [`hash`] | counter-based noise: randomness belongs to the position, never to a stream |
//! | [`fixed`] | coordinates and frames in fixed point |
//! | `functions` | exponentials, sines and roots, the same on every machine |
//! | `fft` | Fourier transforms of lines and of images |
//! | [`pca`] | principal components |
//! | `wide` | wide registers, chosen at run time |
//!
//! | kernels | |
//! |---|---|
//! | [`seam`] | minimum cuts on grids: max-flow, planar strips, binary labels |
//! | [`patch_search`] | exact best matches of a masked patch |
//! | [`complete`] | filling holes by example -> `seam`, `patch_search` |
//! | [`poisson`] | images from their differences, near given values |
//! | [`distance`] | signed distances to the outlines of labelled pieces |
//! | [`warp`] | where each pixel comes from, of pictures warped by moved points, and of moved shapes -> `gather` |
//! | [`gather`] | an exemplar of any type looked up through coordinates |
//! | [`ncc`] | normalised cross-correlation of a template with each window of an image |
//! | [`nearby`] | sums over what lies near by, of values at few points of an image |
//! | [`smooth`] | arrays smoothed along their axes, as by a Gaussian |
//! | [`mean_shift`] | joint spatial and range filtering |
//! | [`reconstruction`] | grey-scale reconstruction: what is left of an image without its small domes |
//! | [`regions`] | regions of one colour: the graph-based merge |
//! | [`sparse`] | symmetric positive definite systems: factored once, solved many times |
//! | [`image_io`] | 8/16-bit and float image files, with limits |
//!
//! | engine | |
//! |---|---|
//! | [`appearance`] | appearance vectors: what the neighbourhood of each sample of an exemplar looks like |
//! | [`guide`] | soft constraints on an output -> `appearance` |
//! | [`blocks`] | patch-based initialisation: cells filled by pieces that fit -> `appearance`, `guide` |
//! | [`pyramid`] | from one resolution to the next |
//! | [`optimize`] | coordinates corrected until every window is like one of the exemplar -> `appearance`, `guide` |
//! | [`stitcher`] | patches pulled through frames, cut where it shows least, healed -> `guide` |
//! | [`quilt`] | patches of pictures, chosen one by one and cut in -> `stitcher` |
//! | [`coherence`] | k-coherence: similarity sets, and correction among their candidates -> `appearance` |
//!
//! The topmost layer, `bindings`, is the Python module `texrs._rust` (feature `python`).

#[cfg(feature = "python")]
mod bindings;
mod engine;
mod foundation;
mod kernels;

pub use engine::{appearance, blocks, coherence, guide, optimize, pyramid, quilt, stitcher};
pub use foundation::error::{Error, Result};
pub use foundation::{error, fixed, grid, hash, par, pca};
pub use kernels::{
    complete, distance, gather, image_io, mean_shift, ncc, nearby, patch_search, poisson,
    reconstruction, regions, seam, smooth, sparse, warp,
};
