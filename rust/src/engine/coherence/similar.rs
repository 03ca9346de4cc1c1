//! Similarity sets: the samples of an exemplar that look most like each one, far from it and from each other.

use super::tree::{Place, Tree};
use super::{FEW, LARGEST, first};
use crate::engine::appearance::{Appearance, KEEP};
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// What a sample of the exemplar may be replaced by.
#[derive(Debug, Clone, PartialEq)]
pub struct Similarity {
    /// Samples of a set, the sample itself among them.
    pub k: usize,
    /// `k` row-major positions for each sample, the sample's own first; all its own where its window does not lie inside.
    pub sets: Vec<u32>,
}

/// The similarity set of each sample: C_1 is the sample, and each further C_j the nearest in the first `numbers` of the
/// appearance vectors ([`FEW`] or all) of those more than (n - 1) / 2 away, along some axis, from every earlier one.
///
/// The whole exemplar is searched; of equally near samples the first one is taken.
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
            format!("1 to {LARGEST} samples an odd n apart are allowed, got k = {k} and n = {n}"),
        ));
    }
    if appearance.grid().len() > u32::MAX as usize / 2 {
        return Err(Error::value(
            "exemplar",
            format!("{:?} has too many samples", appearance.grid().shape()),
        ));
    }
    memory::room("the similarity sets", appearance.grid().len(), 128 + 8 * k)?;
    let sets = match numbers {
        FEW => search::<D, FEW>(appearance, k, n, monitor)?,
        KEEP => search::<D, KEEP>(appearance, k, n, monitor)?,
        _ => {
            return Err(Error::value(
                "numbers",
                format!("{FEW} or {KEEP} are allowed, got {numbers}"),
            ));
        }
    };
    Ok(Similarity { k, sets })
}

fn search<const D: usize, const N: usize>(
    appearance: &Appearance<D>,
    k: usize,
    n: usize,
    monitor: &Monitor,
) -> Result<Vec<u32>> {
    let grid = appearance.grid();
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
    // Leaf by leaf: what was looked at for one vector is at hand for the next.
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
    let mut sets: Vec<u32> = (0..grid.len() as u32)
        .flat_map(|number| std::iter::repeat_n(number, k))
        .collect();
    for leaf in found {
        let Some(leaf) = leaf? else {
            return Err(Error::value(
                "n",
                format!(
                    "an exemplar of {:?} has no {k} samples {n} apart for windows of radius {}: fewer, nearer ones, or a larger exemplar are needed",
                    grid.shape(),
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

/// Whether two samples are more than `reach` apart along some axis.
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
