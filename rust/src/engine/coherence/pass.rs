//! What a correction is asked for, and whether it can be done.

use super::level::Level;
use super::{CHUNK, FEW, LARGEST, Similarity};
use crate::engine::appearance::{Appearance, KEEP};
use crate::foundation::error::check_shape;
use crate::foundation::fixed::{Frames, Place};
use crate::foundation::grid::Region;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// Passes, at most: turns are counted by 32 bits.
const MOST: usize = 1 << 24;

/// What [`correct`] is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Passes over the region.
    pub passes: usize,
    /// Numbers of the appearance vectors that are compared: [`FEW`] or all.
    pub numbers: usize,
    /// Read neighbours where the diagonal itself leads, not only where the lattice makes it end: x(q) + D - J q.
    pub compensated: bool,
}

/// What may lie where: points take candidates of the kind they want. Empty: anything anywhere.
#[derive(Debug, Clone, Copy, Default)]
pub struct Kinds<'a> {
    /// Kind of each of the exemplar's samples.
    pub samples: &'a [u8],
    /// Kind that each point wants; [`Kinds::ANY`] takes any.
    pub points: &'a [u8],
}

impl Kinds<'_> {
    /// What a point wants that does not care.
    pub const ANY: u8 = 255;
}

/// Corrects `places`, one a point of `region`; points that are `held` keep theirs, and so do those that are offered
/// nothing of the kind they want.
///
/// A pass goes over 2^D classes of points, those of the same parity along each axis, in fixed order. Points of a class
/// are corrected all at once, from the places as the class found them.
#[allow(clippy::too_many_arguments)] // the exemplar, the region, and what is known of both
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
        let message = format!("needs sets of 1 to {LARGEST}, got {}", similarity.k);
        return Err(Error::value("similarity", message));
    }
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
    // Each sample once, for divisions cost more than all else here.
    let inside: Vec<bool> = (0..samples)
        .map(|s| {
            let sample = appearance.grid().point(s).map(|x| x as i32);
            appearance.inside(sample).is_some()
        })
        .collect();
    let sets = similarity.sets.chunks_exact(similarity.k);
    let sound = sets.enumerate().all(|(i, set)| {
        let allowed = |&s: &u32| s as usize == i || inside.get(s as usize).is_some_and(|&b| b);
        set.iter().all(allowed)
    });
    if !sound {
        return Err(Error::value(
            "similarity",
            format!(
                "needs sets of 1 to {LARGEST} of the exemplar's {samples} samples whose windows lie inside"
            ),
        ));
    }
    par::chunks_mut(places, CHUNK, |_, places| {
        for place in places {
            *place = appearance.bring_inside(*place);
        }
    });
    if options.passes > MOST {
        let message = format!("up to {MOST} are allowed, got {}", options.passes);
        return Err(Error::value("passes", message));
    }
    match options.numbers {
        FEW => Level::<D, FEW>::new(appearance, similarity, region, frames, held, kinds, options)
            .run(places, monitor),
        KEEP => Level::<D, KEEP>::new(appearance, similarity, region, frames, held, kinds, options)
            .run(places, monitor),
        other => Err(Error::value(
            "numbers",
            format!("{FEW} or {KEEP} are allowed, got {other}"),
        )),
    }
}
