//! k-coherence: each sample of an exemplar has a set of the samples that are most similar to it. A point of the output
//! chooses among the sets of its neighbours' samples.
//!
//! The method is by Tong et al., *Synthesis of bidirectional texture functions on arbitrary surfaces*, SIGGRAPH 2002.
//! The correction in sub-passes is by Lefebvre and Hoppe, *Parallel controllable texture synthesis*, SIGGRAPH 2005.
//!
//! 1. [`similar`] finds the similarity set of each sample, once for each exemplar.
//! 2. [`jitter`] displaces coordinates by noise.
//! 3. [`correct`] makes passes over a region. Each point takes the candidate whose diagonal neighbours are most
//!    similar to the point's own.
//!
//! Coordinates and vectors are integers, so costs are exact, and the minimum does not depend on the order of the sums.

mod boxes;
mod level;
mod pass;
mod similar;
mod tree;

pub use pass::{Kinds, Options, correct};
pub use similar::{Similarity, similar};

use crate::Result;
use crate::engine::appearance::{Appearance, KEEP};
use crate::foundation::error::check_shape;
use crate::foundation::fixed::Place;
use crate::foundation::grid::Region;
use crate::foundation::hash::Noise;
use crate::foundation::par;

/// Number of points in a task.
const CHUNK: usize = 1024;
/// Length of shortened vectors, which fill one register. They are used if the caller requests only this
/// many components.
pub const FEW: usize = 8;
/// Maximum number of samples in a similarity set.
pub const LARGEST: usize = 16;

/// Displaces each place that is not `held` by noise that depends on its point in the world and on the `level`. The
/// displacement is at most `reach` along each axis, in the units of places.
pub fn jitter<const D: usize>(
    places: &mut [Place<D>],
    region: &Region<D>,
    held: &[bool],
    reach: u32,
    seed: u64,
    level: u32,
) -> Result<()> {
    if !held.is_empty() {
        check_shape("held", &[places.len()], held.len())?;
    }
    check_shape("places", &region.grid.shape(), places.len())?;
    if reach > i32::MAX as u32 {
        let message = format!("must be at most {}, got {reach}", i32::MAX);
        return Err(crate::Error::value("reach", message));
    }
    // Draw noise by the world's coordinates, so that overlapping regions agree.
    let noise = Noise::new(seed).part(4);
    par::chunks_mut(places, CHUNK, |chunk, places| {
        for (i, place) in places.iter_mut().enumerate() {
            if held.get(chunk * CHUNK + i).is_some_and(|&h| h) {
                continue;
            }
            let world = region.world(region.grid.point(chunk * CHUNK + i));
            let words = noise.at(world, level);
            for axis in 0..D {
                let drawn = (u64::from(words[axis]) * (2 * u64::from(reach) + 1)) >> 32;
                place[axis] = place[axis].wrapping_add((drawn as i32).wrapping_sub(reach as i32));
            }
        }
    });
    Ok(())
}

/// The first `N` components of the vectors of all samples whose windows are inside the exemplar, with a margin of one
/// sample. The margin wraps around periodic axes and repeats the border sample along the others.
struct Table<const D: usize, const N: usize> {
    low: [i32; D],
    strides: [i32; D],
    vectors: Vec<[i16; N]>,
}

impl<const D: usize, const N: usize> Table<D, N> {
    fn new(appearance: &Appearance<D>) -> Self {
        let ranges: [[i32; 2]; D] = std::array::from_fn(|axis| appearance.range(axis));
        let sides = ranges.map(|[low, high]| (high - low + 3) as usize);
        let mut strides = [1; D];
        for axis in (0..D - 1).rev() {
            strides[axis] = strides[axis + 1] * sides[axis + 1] as i32;
        }
        let mut vectors = vec![[0; N]; sides.iter().product()];
        par::chunks_mut(&mut vectors, CHUNK, |chunk, vectors| {
            for (i, vector) in vectors.iter_mut().enumerate() {
                let mut rest = chunk * CHUNK + i;
                let mut sample = [0; D];
                for axis in (0..D).rev() {
                    let [low, high] = ranges[axis];
                    let x = (rest % sides[axis]) as i32 + low - 1;
                    rest /= sides[axis];
                    // Leave the sample as it is on periodic axes: `clamped` wraps it, and all windows are inside
                    // there.
                    sample[axis] = if appearance.grid().wrap()[axis] {
                        x
                    } else {
                        x.clamp(low, high)
                    };
                }
                *vector = first(appearance.feature(appearance.clamped(sample)));
            }
        });
        Self {
            low: ranges.map(|[low, _]| low - 1),
            strides,
            vectors,
        }
    }

    /// Returns the table position of a sample whose window is inside the exemplar.
    #[inline(always)]
    fn at(&self, sample: [i32; D]) -> i32 {
        let mut at = 0;
        for axis in 0..D {
            at += (sample[axis] - self.low[axis]) * self.strides[axis];
        }
        at
    }

    /// Returns the table offset of a step.
    fn step(&self, step: [i32; D]) -> i32 {
        step.iter().zip(&self.strides).map(|(s, n)| s * n).sum()
    }
}

#[inline(always)]
/// Returns the first `N` numbers of a vector.
fn first<const N: usize>(vector: &[i16; KEEP]) -> [i16; N] {
    std::array::from_fn(|k| vector[k])
}

/// Returns the squared distance of two vectors. Components have 12 bits, so their differences fit into 16 bits.
#[inline(always)]
fn apart<const N: usize>(a: &[i16; N], b: &[i16; N]) -> i32 {
    let mut sum = 0;
    for k in 0..N {
        let d = a[k].wrapping_sub(b[k]);
        sum += i32::from(d) * i32::from(d);
    }
    sum
}

#[cfg(test)]
mod tests;
