//! Kernels of texrs, a library that synthesises new textures from one example.
//!
//! The crate has four layers, listed from the lowest to the highest. A module may use all layers
//! below its own. In its own layer it uses only the modules after the arrow in its table row. Every
//! kernel returns the same bytes for any number of threads.
//!
//! | foundation | |
//! |---|---|
//! | [`error`] | the error type of the crate |
//! | [`grid`] | grids of two or three axes: shape, strides, and wrapping or clamping per axis |
//! | `memory` | allocations that return an error if memory is short |
//! | [`par`] | the process-local thread pool, fixed chunks, progress and cancellation |
//! | [`hash`] | counter-based noise: a random value depends on its position, not on a stream |
//! | [`fixed`] | coordinates and frames in fixed point |
//! | `lattice` | the distance of a shift from the shifts of a lattice |
//! | `libm` | exponentials, sines and roots with the same value on every machine |
//! | `fft` | Fourier transforms of lines, images and volumes |
//! | [`pca`] | principal components |
//! | `simd` | SIMD code, chosen at run time |
//!
//! | kernels | |
//! |---|---|
//! | [`seam`] | minimum cuts on grids: max-flow, planar strips, binary labels |
//! | [`patch_search`] | exact best matches of a masked patch |
//! | [`inpaint`] | exemplar-based filling of holes -> `seam`, `patch_search` |
//! | [`poisson`] | images reconstructed from their differences, near given values |
//! | [`distance`] | signed distances to the outlines of labelled pieces |
//! | [`warp`] | source coordinates of the pixels of warped images and moved shapes -> `gather` |
//! | [`gather`] | interpolation of exemplars of any type at given coordinates |
//! | [`ncc`] | normalised cross-correlation of a template with each window of an image |
//! | [`nearby`] | windowed sums of values that are given at a few points of an image |
//! | [`smooth`] | smoothing of arrays along their axes, such as Gaussian blur |
//! | [`mean_shift`] | mean-shift filtering in space and colour |
//! | [`reconstruction`] | grey-scale reconstruction: an image without its small domes |
//! | [`contours`] | strength of contours: how fast the local histogram of labels changes |
//! | [`watershed`] | regions around the local minima of an image, and the borders between them |
//! | [`hierarchy`] | regions merged two by two, and measures of all nodes -> `watershed` |
//! | [`packing`] | the disjoint sets of the largest total worth -> `hierarchy` |
//! | [`regions`] | segmentation into regions of similar colour by graph-based merging |
//! | [`sparse`] | symmetric positive definite systems: factored once, solved many times |
//! | [`image_io`] | 8-bit, 16-bit and float image files, with limits |
//!
//! | engine | |
//! |---|---|
//! | [`appearance`] | appearance vectors: descriptions of the neighbourhood of each exemplar sample |
//! | [`guide`] | soft constraints on an output -> `appearance` |
//! | [`blocks`] | patch-based initialisation: each cell gets a matching patch -> `appearance`, `guide` |
//! | [`pyramid`] | upsampling of coordinates to the next resolution |
//! | [`optimize`] | correction of coordinates until every window resembles a window of the exemplar -> `appearance`, `guide` |
//! | [`stitcher`] | patches transformed by frames, cut along the least visible seams and healed -> `guide` |
//! | [`quilt`] | patches of images, chosen one by one and inserted along minimum cuts -> `stitcher` |
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
    contours, distance, gather, hierarchy, image_io, inpaint, mean_shift, ncc, nearby, packing,
    patch_search, poisson, reconstruction, regions, seam, smooth, sparse, warp, watershed,
};
