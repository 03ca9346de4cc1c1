//! Source coordinates of each output pixel, for images that are warped by moved points and for shapes that are moved
//! as a whole.
//!
//! [`mesh`] warps a dense mesh with one vertex for each source pixel. [`scattered()`] triangulates
//! scattered points. Both move triangles to the targets of their corners and rasterise them there.
//! The source of a pixel is the barycentric interpolation of the source corners.
//!
//! If several triangles cover a pixel, the one with the largest weight is visible. Ties go to a triangle that is not
//! flipped, then to the first. A [`Motion`] instead moves a single shape by an affine map, so that it can be inserted
//! between other shapes.

mod placed;
mod raster;
mod scattered;

pub use placed::{Motion, Placed, Shape, Window};
pub use raster::{Mesh, mesh};
pub use scattered::scattered;

/// A point as (row, column).
pub type Point = [f64; 2];

/// Source coordinates of the pixels of an output.
#[derive(Debug, Clone)]
pub struct Warped {
    /// Source coordinates of each pixel. They are NaN if no triangle covers the pixel.
    pub places: Vec<[f32; 2]>,
    /// Number of the visible triangle of each pixel, counted from 1, or 0 if no triangle covers it.
    pub triangle: Vec<u32>,
    /// Number of drawn triangles.
    pub drawn: usize,
    /// Number of drawn triangles that the warp flips or flattens.
    pub flipped: usize,
    /// Number of flipped triangles whose three corners have weight 1.
    pub flipped_heavy: usize,
}

#[cfg(test)]
mod tests;
