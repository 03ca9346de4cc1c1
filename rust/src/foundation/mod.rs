//! The layer below all kernels: arithmetic, memory and threads, without any code about textures.

pub mod error;
pub(crate) mod fft;
pub mod fixed;
pub mod grid;
pub mod hash;
pub(crate) mod lattice;
pub(crate) mod libm;
pub(crate) mod memory;
pub mod par;
pub mod pca;
pub(crate) mod simd;
