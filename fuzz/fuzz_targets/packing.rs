//! Fuzzes the choice of disjoint sets. No set that is left may fit between the chosen sets, and no exchange of one set
//! for all sets that it overlaps may raise the total worth.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::hierarchy::Sets;
use texrs::packing::choose;
use texrs_fuzz::{Draw, agreed};

/// More rounds than these small inputs need.
const ENOUGH: usize = 1000;

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    let regions = draw.within(0..=12);
    let count = draw.within(0..=10);
    let mut sets = Sets::default();
    for _ in 0..count {
        let flags = draw.mask(regions);
        let shift = if draw.seldom(32) { 1 << 20 } else { 0 };
        let members: Vec<u32> = (0..regions as u32)
            .filter(|&i| flags[i as usize])
            .map(|i| i + shift)
            .collect();
        sets.push(&members).unwrap();
    }
    let more = usize::from(draw.seldom(32));
    let worth: Vec<f64> = draw
        .reals(count + more)
        .into_iter()
        .map(f64::from)
        .collect();
    let worth: Vec<f64> = worth.iter().map(|w| w * 1.5 - 0.25).collect();
    let quality: Vec<f64> = draw.reals(count).into_iter().map(f64::from).collect();
    let Some(found) = agreed(|monitor| choose(&sets, &worth, &quality, ENOUGH, monitor)) else {
        assert!(more > 0);
        return;
    };
    let overlap = |i: usize, j: usize| sets.get(i).iter().any(|p| sets.get(j).contains(p));
    let total =
        |chosen: &[bool]| -> f64 { (0..count).filter(|&i| chosen[i]).map(|i| worth[i]).sum() };
    assert_eq!(found.len(), count);
    for i in 0..count {
        let rivals: Vec<usize> = (0..count)
            .filter(|&j| j != i && found[j] && overlap(i, j))
            .collect();
        if found[i] {
            assert!(worth[i] > 0.0 && rivals.is_empty());
        } else if worth[i] > 0.0 && !sets.get(i).is_empty() {
            let rival: f64 = rivals.iter().map(|&j| worth[j]).sum();
            assert!(!rivals.is_empty() && worth[i] <= rival * (1.0 + 1e-12) + 2e-9);
        }
    }
    // Rounds never lower the total worth. The first choice is made without rounds.
    let first = choose(&sets, &worth, &quality, 0, &Default::default()).unwrap();
    let (before, after) = (total(&first), total(&found));
    assert!(after >= before * (1.0 - 1e-12), "{before} {after}");
});
