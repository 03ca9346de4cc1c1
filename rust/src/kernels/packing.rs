//! Packing: the choice of disjoint sets with the largest total worth, among many sets that overlap.
//!
//! The problem is NP-hard. Sets are first chosen greedily in order of quality. Then a set replaces all chosen sets
//! that it overlaps, if it is worth more than these together. Sets that overlap no chosen set are added. These
//! exchanges are repeated until nothing changes or the number of rounds is reached.

use crate::foundation::memory;
use crate::foundation::par::Monitor;
use crate::kernels::hierarchy::Sets;
use crate::{Error, Result};

/// Value for a region that no chosen set contains. It is 0, because zeros take up memory only when they are replaced.
/// Therefore a region may have a large number.
const NONE: u32 = 0;

/// Returns a flag for each set: whether it is chosen. Sets with a worth of 0 or less, or NaN, are never chosen. At
/// most `rounds` rounds of exchanges are made.
///
/// # Errors
/// The number of values differs from the number of sets.
pub fn choose(
    sets: &Sets,
    worth: &[f64],
    quality: &[f64],
    rounds: usize,
    monitor: &Monitor,
) -> Result<Vec<bool>> {
    for (argument, values) in [("worth", worth), ("quality", quality)] {
        if values.len() != sets.len() {
            let message = format!("must have {} values, got {}", sets.len(), values.len());
            return Err(Error::value(argument, message));
        }
    }
    monitor.check()?;
    memory::room("the choice of sets", sets.len(), 32)?;
    let sorted = |key: &[f64]| {
        let mut order: Vec<u32> = (0..sets.len() as u32)
            .filter(|&i| worth[i as usize] > 0.0)
            .collect();
        order.sort_by(|&a, &b| key[b as usize].total_cmp(&key[a as usize]));
        order
    };
    // The number of the chosen set that contains each region, from 1.
    let mut owner = memory::filled("the regions", NONE, sets.bound())?;
    let mut chosen = vec![false; sets.len()];
    let mut is_rival = vec![false; sets.len()];
    let take = |i: u32, owner: &mut [u32], chosen: &mut [bool]| {
        chosen[i as usize] = true;
        for &leaf in sets.get(i as usize) {
            owner[leaf as usize] = i + 1;
        }
    };
    let free = |i: u32, owner: &[u32]| {
        sets.get(i as usize)
            .iter()
            .all(|&leaf| owner[leaf as usize] == NONE)
    };
    for i in sorted(quality) {
        if free(i, &owner) {
            take(i, &mut owner, &mut chosen);
        }
    }
    let order = sorted(worth);
    let mut rivals: Vec<u32> = Vec::new();
    for _ in 0..rounds {
        monitor.check()?;
        let mut changed = false;
        for &i in &order {
            if chosen[i as usize] {
                continue;
            }
            // Chosen sets are worth more than 0, so stop as soon as some of them are worth as much as this set.
            for r in rivals.drain(..) {
                is_rival[r as usize] = false;
            }
            let mut rival = 0.0;
            let better = sets.get(i as usize).iter().all(|&leaf| {
                let other = owner[leaf as usize];
                if other != NONE && !is_rival[other as usize - 1] {
                    is_rival[other as usize - 1] = true;
                    rivals.push(other - 1);
                    rival += worth[other as usize - 1];
                }
                worth[i as usize] > rival + 1e-9
            });
            if better {
                for &r in &rivals {
                    chosen[r as usize] = false;
                    for &leaf in sets.get(r as usize) {
                        owner[leaf as usize] = NONE;
                    }
                }
                take(i, &mut owner, &mut chosen);
                changed = true;
            }
        }
        for &i in &order {
            if !chosen[i as usize] && free(i, &owner) {
                take(i, &mut owner, &mut chosen);
                changed = true;
            }
        }
        if !changed {
            break;
        }
    }
    Ok(chosen)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sets(lists: &[&[u32]]) -> Sets {
        let mut sets = Sets::default();
        for list in lists {
            sets.push(list).unwrap();
        }
        sets
    }

    #[test]
    fn two_small_sets_beat_one_that_is_worth_less() {
        let sets = sets(&[&[0, 1, 2], &[0], &[2], &[1, 2]]);
        let monitor = Monitor::default();
        let worth = [3.0, 2.0, 2.0, -1.0];
        let found = choose(&sets, &worth, &worth, 4, &monitor).unwrap();
        assert_eq!(found, [true, false, false, false]);
        let found = choose(&sets, &worth, &[0.1, 0.9, 0.8, 1.0], 4, &monitor).unwrap();
        assert_eq!(found, [false, true, true, false]);
    }

    #[test]
    fn a_set_replaces_those_that_it_is_worth_more_than() {
        let sets = sets(&[&[0, 1], &[1], &[3]]);
        let found = choose(
            &sets,
            &[5.0, 1.0, f64::NAN],
            &[0.1, 0.9, 1.0],
            4,
            &Monitor::default(),
        )
        .unwrap();
        assert_eq!(found, [true, false, false]);
        assert!(choose(&sets, &[1.0], &[1.0], 1, &Monitor::default()).is_err());
    }

    #[test]
    fn numbers_of_regions_may_be_large() {
        let sets = sets(&[&[7, 1 << 24], &[1 << 24], &[]]);
        let worth = [1.0, 2.0, f64::INFINITY];
        let found = choose(&sets, &worth, &worth, usize::MAX, &Monitor::default()).unwrap();
        assert_eq!(found, [false, true, true]);
    }
}
