//! Similarity sets: for each sample of an exemplar, the most similar samples that are far from it and from each other.

use super::tree::{Place, Tree};
use super::{FEW, LARGEST, first};
use crate::engine::appearance::{Appearance, KEEP};
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// The similarity set of each sample of an exemplar.
#[derive(Debug, Clone, PartialEq)]
pub struct Similarity {
    /// Number of samples in a set, including the sample itself.
    pub k: usize,
    /// `k` row-major positions for each sample, starting with its own. All are its own if its window is not inside the
    /// exemplar.
    pub sets: Vec<u32>,
}

/// Finds the similarity set of each sample. C_1 is the sample itself. Each further C_j is the sample with the nearest
/// appearance vector, by its first `numbers` components ([`FEW`] or all). It must be more than (n - 1) / 2 away, along
/// some axis, from every earlier one.
///
/// The whole exemplar is searched. If distances are equal, the first sample is taken.
pub fn similar<const D: usize>(
    appearance: &Appearance<D>,
    k: usize,
    n: usize,
    numbers: usize,
    monitor: &Monitor,
) -> Result<Similarity> {
    if !(1..=LARGEST).contains(&k) || n.is_multiple_of(2) || n > i32::MAX as usize {
        return Err(Error::value(
            "k",
            format!("must be from 1 to {LARGEST}, and n must be odd; got k = {k} and n = {n}"),
        ));
    }
    if appearance.grid().len() > u32::MAX as usize / 2 {
        return Err(Error::value(
            "exemplar",
            format!(
                "must have at most 2^31 - 1 samples, got shape {:?}",
                appearance.grid().shape()
            ),
        ));
    }
    memory::room("the similarity sets", appearance.grid().len(), 128 + 8 * k)?;
    // The length of the vectors is a constant of the inner loops.
    let sets = match numbers {
        FEW => search::<D, FEW>(appearance, k, n, monitor)?,
        KEEP => search::<D, KEEP>(appearance, k, n, monitor)?,
        _ => {
            return Err(Error::value(
                "numbers",
                format!("must be {FEW} or {KEEP}, got {numbers}"),
            ));
        }
    };
    Ok(Similarity { k, sets })
}

/// Finds the sets by the first `N` numbers of the vectors.
fn search<const D: usize, const N: usize>(
    appearance: &Appearance<D>,
    k: usize,
    n: usize,
    monitor: &Monitor,
) -> Result<Vec<u32>> {
    let grid = appearance.grid();
    // Only samples whose windows are inside the exemplar have vectors.
    let samples = (0..grid.len()).filter_map(|number| {
        let sample = grid.point(number).map(|x| x as i32);
        appearance.inside(sample)?;
        Some(Place {
            vector: first(appearance.feature(number)),
            number: number as u32,
            sample,
        })
    });
    let tree = Tree::<D, N>::new(samples.collect());
    let far = |a: [i32; D], b: [i32; D]| far(appearance, a, b, (n / 2) as i32);

    monitor.expect(tree.leaves() as u64);
    // Search leaf by leaf, because the vectors of a leaf visit the same boxes, which are still in the cache.
    let found = par::map(tree.leaves(), |leaf| {
        monitor.check()?;
        let mut sets = Vec::with_capacity(tree.places(leaf).len() * k);
        let mut chosen: Vec<[i32; D]> = Vec::with_capacity(k);
        for place in tree.places(leaf) {
            sets.push(place.number);
            chosen.clear();
            chosen.push(place.sample);
            for _ in 1..k {
                let allowed = |other| chosen.iter().all(|&one| far(one, other));
                let (_, number) = tree.nearest(&place.vector, leaf, allowed);
                if number == u32::MAX {
                    return Ok(None);
                }
                sets.push(number);
                chosen.push(grid.point(number as usize).map(|x| x as i32));
            }
        }
        monitor.advance(1)?;
        Ok(Some(sets))
    });
    // Samples without a vector have only themselves in their sets.
    let mut sets: Vec<u32> = (0..grid.len() as u32)
        .flat_map(|number| std::iter::repeat_n(number, k))
        .collect();
    for leaf in found {
        let Some(leaf) = leaf? else {
            return Err(Error::value(
                "n",
                format!(
                    "must be smaller, because an exemplar of shape {:?} does not have {k} samples that are more than {} apart, for windows of radius {}; lower k or n, or use a larger exemplar",
                    grid.shape(),
                    n / 2,
                    appearance.radius()
                ),
            ));
        };
        for set in leaf.chunks_exact(k) {
            sets[set[0] as usize * k..][..k].copy_from_slice(set);
        }
    }
    Ok(sets)
}

/// Returns whether two samples are more than `reach` apart along some axis.
#[inline(always)]
fn far<const D: usize>(appearance: &Appearance<D>, a: [i32; D], b: [i32; D], reach: i32) -> bool {
    let (shape, wrap) = (appearance.grid().shape(), appearance.grid().wrap());
    (0..D).any(|axis| {
        let gap = (a[axis] - b[axis]).abs();
        let gap = if wrap[axis] {
            gap.min(shape[axis] as i32 - gap)
        } else {
            gap
        };
        gap > reach
    })
}
