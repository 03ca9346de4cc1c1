//! Similarity sets: the samples of an exemplar that look most like each one, far from it and from each other.

use super::tree::{Nearest, Tree};
use super::{CHUNK, FEW, LARGEST, Table};
use crate::appearance::{Appearance, KEEP};
use crate::par::{self, Monitor};
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
/// The whole exemplar is searched; of equally near samples the first one is taken. A neighbour's answer, moved along,
/// is often a sample's own, so it bounds the search.
pub fn similar<const D: usize>(
    appearance: &Appearance<D>,
    k: usize,
    n: usize,
    numbers: usize,
    monitor: &Monitor,
) -> Result<Similarity> {
    if !(1..=LARGEST).contains(&k) || n.is_multiple_of(2) {
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
    let table = Table::<D, N>::new(appearance);
    let vector = |sample| &table.vectors[table.at(sample) as usize];
    let samples = (0..grid.len()).filter_map(|number| {
        let sample = grid.point(number).map(|x| x as i32);
        appearance.inside(sample)?;
        Some((*vector(sample), number as u32, sample))
    });
    let tree = Tree::new(samples.collect());
    let far = |a: [i32; D], b: [i32; D]| far(appearance, a, b, (n / 2) as i32);

    let mut sets = vec![0; grid.len() * k];
    monitor.expect(grid.len().div_ceil(CHUNK) as u64);
    let failed = std::sync::atomic::AtomicBool::new(false);
    par::chunks_mut(&mut sets, CHUNK * k, |chunk, sets| {
        if monitor.check().is_err() {
            return;
        }
        let mut chosen: Vec<[i32; D]> = Vec::with_capacity(k);
        let mut before: Vec<[i32; D]> = Vec::with_capacity(k);
        for (i, set) in sets.chunks_exact_mut(k).enumerate() {
            let number = chunk * CHUNK + i;
            set.fill(number as u32);
            let sample = grid.point(number).map(|x| x as i32);
            if appearance.inside(sample).is_none() {
                before.clear();
                continue;
            }
            chosen.clear();
            chosen.push(sample);
            for j in 1..k {
                let allowed = |other| chosen.iter().all(|&one| far(one, other));
                let mut best: Nearest = (i32::MAX, u32::MAX);
                if let Some(mut moved) = before.get(j).copied() {
                    moved[D - 1] += 1;
                    if let Some(at) = appearance.inside(moved) {
                        let moved = grid.point(at).map(|x| x as i32);
                        if allowed(moved) {
                            best = (super::apart(vector(sample), vector(moved)), at as u32);
                        }
                    }
                }
                best = tree.nearest(vector(sample), allowed, best);
                if best.1 == u32::MAX {
                    failed.store(true, std::sync::atomic::Ordering::Relaxed);
                    return;
                }
                set[j] = best.1;
                chosen.push(grid.point(best.1 as usize).map(|x| x as i32));
            }
            std::mem::swap(&mut chosen, &mut before);
        }
        // Whether to stop is asked at the beginning of each chunk.
        let _ = monitor.advance(1);
    });
    monitor.check()?;
    if failed.into_inner() {
        return Err(Error::value(
            "n",
            format!(
                "an exemplar of {:?} has no {k} samples {n} apart for windows of radius {}: fewer, nearer ones, or a larger exemplar are needed",
                grid.shape(),
                appearance.radius()
            ),
        ));
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
