//! Algorithms of the literature. Each can be used on its own and does not depend on the methods
//! that use it.

pub mod contours;
pub mod distance;
pub mod gather;
pub mod hierarchy;
pub mod image_io;
pub mod inpaint;
pub mod mean_shift;
pub mod ncc;
pub mod nearby;
pub mod packing;
pub mod patch_search;
pub mod poisson;
pub mod reconstruction;
pub mod regions;
pub mod seam;
pub mod smooth;
pub mod sparse;
pub mod warp;
pub mod watershed;
