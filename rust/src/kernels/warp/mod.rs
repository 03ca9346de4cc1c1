//! Pictures warped by moved points, and shapes moved as a whole: where each pixel of the output comes from.
//!
//! [`mesh`] carries a dense mesh, a vertex a pixel of the source; [`scattered`] triangulates scattered points. Both move
//! triangles to where their corners go and rasterise them there: a pixel comes from the barycentric mix of the source
//! corners. Of several triangles over a pixel the one whose corners weigh most is seen, one that is not turned over before
//! one that is, then the first. A [`Motion`] moves one shape by an affine map, to be cut in among others.

mod placed;
mod raster;
mod scattered;

pub use placed::{Motion, Placed, Shape, Window};
pub use raster::{Mesh, mesh};
pub use scattered::scattered;

/// A place, (row, column).
pub type Point = [f64; 2];

/// Where the pixels of an output come from.
#[derive(Debug, Clone)]
pub struct Warped {
    /// Source of each pixel; NaN where no triangle covers it.
    pub places: Vec<[f32; 2]>,
    /// Triangle over each pixel, counted from 1; 0 where there is none.
    pub triangle: Vec<u32>,
    /// Triangles that were drawn.
    pub drawn: usize,
    /// Those of them that the warp turned over.
    pub flipped: usize,
    /// Those turned over whose corners all weigh something.
    pub flipped_heavy: usize,
}

#[cfg(test)]
mod tests;
