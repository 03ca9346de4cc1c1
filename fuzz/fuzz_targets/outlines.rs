//! Fuzzes outlines of labelled regions. No label may appear that was not there, move too far, or move without a reach.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::seam::outlines::{Evidence, refine};
use texrs_fuzz::{Draw, agreed};

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    let shape = draw.shape::<2>(0..=14);
    let (n, columns) = (shape[0] * shape[1], shape[1]);
    let count = draw.within(1..=6);
    // Draw single pixels, or blocks that are regions of a usual form.
    let labels: Vec<i32> = if draw.flag() {
        draw.numbers(n, count as u32).map(|x| x as i32).collect()
    } else {
        let side = draw.within(1..=6);
        let blocks: Vec<u32> = draw.numbers(15 * 15, count as u32).collect();
        (0..n)
            .map(|p| blocks[p / columns / side * 15 + p % columns / side] as i32)
            .collect()
    };
    let most = if draw.seldom(16) { 255 } else { 7 };
    let mut reach: Vec<u8> = draw.numbers(count, most).map(|x| x as u8).collect();
    if draw.flag() {
        reach.fill(draw.within(0..=4) as u8);
    }
    if draw.seldom(16) {
        reach.truncate(draw.within(0..=count));
    }
    let inside: Vec<f32> = draw.reals(n).into_iter().map(|v| 2.0 * v - 1.0).collect();
    let price = draw.reals(n);
    let evidence = Evidence {
        inside: &inside,
        price: &price,
        pull: draw.real(),
    };
    let Some(found) = agreed(|monitor| refine(&labels, shape, &evidence, &reach, monitor)) else {
        return;
    };
    assert_eq!(found.len(), n);
    for (p, &label) in found.iter().enumerate().filter(|&(_, &label)| label != 0) {
        let far = usize::from(reach[label as usize]);
        let own = |p: &usize| labels[*p] == label;
        let inside = |at: fn(usize, usize) -> usize| {
            let places = (0..n).filter(own).map(|p| at(p, columns));
            let (least, most) = (places.clone().min(), places.max());
            let at = at(p, columns);
            least.unwrap() <= at + far && at <= most.unwrap() + far
        };
        assert!(inside(|p, columns| p / columns) && inside(|p, columns| p % columns));
    }
    // A label without reach keeps its pixels if it is connected.
    for label in (1..count as i32).filter(|&l| reach.get(l as usize) == Some(&0)) {
        let mut flags: Vec<u8> = labels.iter().map(|&l| u8::from(l == label)).collect();
        let Some(first) = flags.iter().position(|&f| f == 1) else {
            continue;
        };
        flags[first] = 2;
        let mut stack = vec![first];
        while let Some(p) = stack.pop() {
            for q in [
                p.wrapping_sub(columns),
                p.wrapping_sub(1),
                p + 1,
                p + columns,
            ] {
                let beside = q < n && (p / columns == q / columns || p % columns == q % columns);
                if beside && flags[q] == 1 {
                    flags[q] = 2;
                    stack.push(q);
                }
            }
        }
        if !flags.contains(&1) {
            assert!((0..n).all(|p| labels[p] != label || found[p] == label));
        }
    }
});
