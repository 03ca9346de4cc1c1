//! The arguments of a correction, the checks of these arguments, and the start of the correction.

use super::level::Level;
use super::{CHUNK, FEW, LARGEST, Similarity};
use crate::engine::appearance::{Appearance, KEEP};
use crate::foundation::error::check_shape;
use crate::foundation::fixed::{Frames, Place};
use crate::foundation::grid::Region;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// Maximum number of passes. Each pass has 2^D turns, which are counted in 32 bits.
const MOST: usize = 1 << 24;

/// Options of [`correct`].
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Number of passes over the region.
    pub passes: usize,
    /// Number of components of the appearance vectors that are compared: [`FEW`] or all.
    pub numbers: usize,
    /// If true, read the vectors of neighbours at the exact diagonal, x(q) + D - J q, instead of at the nearest
    /// lattice point.
    pub compensated: bool,
}

/// Kinds of samples: a point takes only candidates of the kind that it wants. If both slices are empty, all candidates
/// are allowed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Kinds<'a> {
    /// Kind of each sample of the exemplar.
    pub samples: &'a [u8],
    /// Kind that each point wants; [`Kinds::ANY`] accepts every kind.
    pub points: &'a [u8],
}

impl Kinds<'_> {
    /// The kind of a point that accepts every kind.
    pub const ANY: u8 = 255;
}

/// Corrects `places`, one for each point of `region`. Points that are `held` keep their places. So do points without a
/// candidate of the kind that they want.
///
/// A pass visits 2^D classes of points in a fixed order; the points of a class have the same parity along each axis.
/// All points of a class are corrected at once, from the places before the class.
#[allow(clippy::too_many_arguments)] // the exemplar, the region, and their properties
pub fn correct<const D: usize>(
    appearance: &Appearance<D>,
    similarity: &Similarity,
    region: &Region<D>,
    frames: Frames<'_, D>,
    held: &[bool],
    kinds: Kinds<'_>,
    places: &mut [Place<D>],
    options: &Options,
    monitor: &Monitor,
) -> Result<()> {
    let points = region.grid.len();
    let samples = appearance.grid().len();
    frames.check(points)?;
    memory::room("the corrected coordinates", points, 32 * D)?;
    if !(1..=LARGEST).contains(&similarity.k) {
        let message = format!(
            "must have 1 to {LARGEST} samples in each set, got {}",
            similarity.k
        );
        return Err(Error::value("similarity", message));
    }
    // Empty `held` and `kinds` mean no restriction, so they have no required length.
    for (argument, length, wanted) in [
        ("places", places.len(), points),
        ("held", held.len(), if held.is_empty() { 0 } else { points }),
        ("similarity", similarity.sets.len(), samples * similarity.k),
        (
            "kinds",
            kinds.samples.len(),
            if kinds.points.is_empty() { 0 } else { samples },
        ),
        (
            "wanted",
            kinds.points.len(),
            if kinds.samples.is_empty() { 0 } else { points },
        ),
    ] {
        check_shape(argument, &[wanted], length)?;
    }
    memory::room("the similarity sets", similarity.sets.len(), 8)?;
    // Compute once for each sample whether its window is inside, because this needs divisions, the costliest step
    // here.
    let inside: Vec<bool> = (0..samples)
        .map(|s| {
            let sample = appearance.grid().point(s).map(|x| x as i32);
            appearance.inside(sample).is_some()
        })
        .collect();
    // Candidates are read with a margin, so each must be the sample itself or have its window inside.
    let sets = similarity.sets.chunks_exact(similarity.k);
    let sound = sets.enumerate().all(|(i, set)| {
        let allowed = |&s: &u32| s as usize == i || inside.get(s as usize).is_some_and(|&b| b);
        set.iter().all(allowed)
    });
    if !sound {
        return Err(Error::value(
            "similarity",
            format!(
                "must contain only samples whose windows are inside the exemplar of {samples} samples"
            ),
        ));
    }
    par::chunks_mut(places, CHUNK, |_, places| {
        for place in places {
            *place = appearance.bring_inside(*place);
        }
    });
    if options.passes > MOST {
        let message = format!("must be at most {MOST}, got {}", options.passes);
        return Err(Error::value("passes", message));
    }
    // The length of the vectors is a constant of the inner loops.
    match options.numbers {
        FEW => Level::<D, FEW>::new(appearance, similarity, region, frames, held, kinds, options)
            .run(places, monitor),
        KEEP => Level::<D, KEEP>::new(appearance, similarity, region, frames, held, kinds, options)
            .run(places, monitor),
        other => Err(Error::value(
            "numbers",
            format!("must be {FEW} or {KEEP}, got {other}"),
        )),
    }
}
