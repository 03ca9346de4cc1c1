//! What every kernel stands on: knows nothing of textures.

pub mod error;
pub mod fixed;
pub mod grid;
pub mod hash;
pub mod par;
pub mod pca;
