//! Fuzzes watersheds. Each region must be connected and have one minimum, and the borders and the extreme pixels of
//! regions are compared with direct computations.

#![no_main]

use std::collections::BTreeMap;

use libfuzzer_sys::fuzz_target;
use texrs::watershed::{DIRECTIONS, adjacency, directions, flood};
use texrs_fuzz::{Draw, agreed, near};

/// Returns the number of the connected part of each pixel. Adjacent pixels of the same part are `alike`.
fn parts(shape: [usize; 2], alike: impl Fn(usize, usize) -> bool) -> Vec<usize> {
    let mut part: Vec<usize> = (0..shape[0] * shape[1]).collect();
    // Spread the lowest number until nothing changes.
    let mut changed = true;
    while changed {
        changed = false;
        for [p, q] in sides(shape) {
            if part[p] != part[q] && alike(p, q) {
                let least = part[p].min(part[q]);
                (part[p], part[q], changed) = (least, least, true);
            }
        }
    }
    part
}

/// Returns all pairs of adjacent pixels, in the order of the first pixels.
fn sides([rows, columns]: [usize; 2]) -> Vec<[usize; 2]> {
    let next = |p: usize| {
        let right = (p % columns + 1 < columns).then_some([p, p + 1]);
        let down = (p / columns + 1 < rows).then_some([p, p + columns]);
        right.into_iter().chain(down)
    };
    (0..rows * columns).flat_map(next).collect()
}

fn flooded(draw: &mut Draw<'_>) {
    let shape = draw.shape::<2>(0..=12);
    let height = draw.reals(shape[0] * shape[1]);
    let reach = if draw.seldom(16) {
        draw.any()
    } else {
        draw.within(0..=4)
    };
    let Some((label, count)) = agreed(|monitor| flood(&height, shape, reach, monitor)) else {
        return;
    };
    assert_eq!(label.len(), height.len());
    assert!(label.iter().all(|&l| (l as usize) < count));
    let [rows, columns] = shape;
    let lowest = |p: usize| {
        let near = |q: &usize| {
            (p / columns).abs_diff(q / columns) <= reach
                && (p % columns).abs_diff(q % columns) <= reach
        };
        (0..rows * columns)
            .filter(near)
            .all(|q| height[p] <= height[q])
    };
    let minimum: Vec<bool> = (0..height.len()).map(lowest).collect();
    let basin = parts(shape, |p, q| minimum[p] && minimum[q]);
    let whole = parts(shape, |p, q| label[p] == label[q]);
    // Regions are numbered in the order of their first minimum, and each of them has one.
    let mut first: Vec<usize> = (0..height.len())
        .filter(|&p| minimum[p] && basin[p] == p)
        .collect();
    assert_eq!(first.len(), count);
    for (region, &p) in first.iter().enumerate() {
        assert_eq!(label[p] as usize, region);
    }
    for p in 0..height.len() {
        assert!(!minimum[p] || label[p] == label[basin[p]]);
    }
    first = (0..height.len()).filter(|&p| whole[p] == p).collect();
    assert_eq!(first.len(), count, "a region has several parts");
}

fn touching(draw: &mut Draw<'_>) {
    let shape = draw.shape::<2>(0..=10);
    let n = shape[0] * shape[1];
    let most = draw.within(1..=9);
    let label: Vec<u32> = draw.numbers(n, most as u32).collect();
    let strength = draw.reals(n);
    let count = if draw.seldom(16) {
        draw.within(0..=12)
    } else {
        most
    };
    let weak = draw.real();
    let Some(found) = agreed(|monitor| adjacency(&label, &strength, shape, count, weak, monitor))
    else {
        return;
    };
    let mut expected: BTreeMap<[u32; 2], [f64; 3]> = BTreeMap::new();
    for [p, q] in sides(shape)
        .into_iter()
        .filter(|&[p, q]| label[p] != label[q])
    {
        let pair = [label[p].min(label[q]), label[p].max(label[q])];
        let value = strength[p].max(strength[q]);
        let sums = expected.entry(pair).or_default();
        sums[0] += 1.0;
        sums[1] += f64::from(value);
        sums[2] += f64::from(u8::from(value < weak));
    }
    assert!(found.pairs.iter().eq(expected.keys()));
    for (arc, sums) in found.arcs.iter().zip(expected.values()) {
        assert_eq!((arc[0], arc[2]), (sums[0], sums[2]));
        assert!(near(arc[1], sums[1], 1e-9) || sums[1].abs() > 1e30);
    }
    assert_eq!(found.extremes.len(), count);
    let directions = directions();
    for (region, extremes) in found.extremes.iter().enumerate() {
        let own: Vec<usize> = (0..n).filter(|&p| label[p] as usize == region).collect();
        for k in 0..DIRECTIONS {
            let along = |[y, x]: [f64; 2]| y * directions[k][0] + x * directions[k][1];
            let place = |&p: &usize| [(p / shape[1]) as f64, (p % shape[1]) as f64];
            let far = own.iter().map(|p| along(place(p)));
            let point = extremes[k].map(f64::from);
            if own.is_empty() {
                assert_eq!(point, [0.0; 2]);
            } else {
                assert!(own.iter().any(|p| place(p) == point));
                assert_eq!(along(point), far.fold(f64::NEG_INFINITY, f64::max));
            }
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    if draw.flag() {
        flooded(&mut draw);
    } else {
        touching(&mut draw);
    }
});
