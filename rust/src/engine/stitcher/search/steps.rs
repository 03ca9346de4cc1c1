//! Places of patches that are in step with the lattice of an exemplar.

use crate::foundation::fixed::{Frames, ONE};
use crate::foundation::lattice::away;

/// The lattice of an exemplar, and how it continues in the output.
#[derive(Debug, Clone, Copy)]
pub(in crate::engine::stitcher) struct Steps {
    lattice: [[f64; 2]; 2],
    /// The frame of all patches.
    frame: [[f64; 2]; 2],
}

impl Steps {
    /// Returns the steps of a lattice, for two axes and one frame.
    pub(in crate::engine::stitcher) fn new<const D: usize>(
        lattice: Option<[[f64; 2]; 2]>,
        frames: Frames<'_, D>,
    ) -> Option<Self> {
        let (Some(lattice), Frames::Constant(frame), 2) = (lattice, frames, D) else {
            return None;
        };
        let entry = |row: usize, column: usize| f64::from(frame[row][column]) / f64::from(ONE);
        let frame = [0, 1].map(|row| [entry(row, 0), entry(row, 1)]);
        Some(Self { lattice, frame })
    }

    /// Returns the distance of an exemplar sample from the nearest one that is in step with an output point.
    pub(super) fn away<const D: usize>(&self, sample: [i32; D], point: [i32; D]) -> f64 {
        let moved = [0, 1].map(|a| {
            let [down, across] = self.frame[a];
            f64::from(sample[a]) - down * f64::from(point[0]) - across * f64::from(point[1])
        });
        away(&self.lattice, moved)
    }
}
