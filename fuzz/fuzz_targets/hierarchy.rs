//! Fuzzes candidates of merge trees, and the sums and measures of sets of regions. Candidates must be connected,
//! different and within the limits of area. Sums are compared with direct computations.

#![no_main]

use std::collections::BTreeSet;

use libfuzzer_sys::fuzz_target;
use texrs::hierarchy::candidates::candidates;
use texrs::hierarchy::measure::{Values, measure, sums};
use texrs::hierarchy::merge::Cost;
use texrs::hierarchy::{Graph, Sets};
use texrs::watershed::adjacency;
use texrs_fuzz::{Draw, agreed, near};

/// Returns whether the members of a set are connected by pairs.
fn connected(set: &[u32], pairs: &[[u32; 2]]) -> bool {
    let mut found = BTreeSet::from([set[0]]);
    for _ in set {
        for pair in pairs {
            if pair.iter().all(|p| set.contains(p)) && pair.iter().any(|p| found.contains(p)) {
                found.extend(pair);
            }
        }
    }
    found.len() == set.len()
}

fn merged(draw: &mut Draw<'_>) {
    let n = draw.within(0..=14);
    // Areas are whole numbers, so their sums are exact.
    let mut area: Vec<f64> = draw.numbers(n, 20).map(|x| f64::from(x + 1)).collect();
    let mean: Vec<f64> = draw.reals(3 * n).into_iter().map(f64::from).collect();
    let share = [40, 100, 255][draw.within(0..=2)];
    let mut pairs: Vec<[u32; 2]> = Vec::new();
    for q in 0..n as u32 {
        for p in 0..q {
            if u32::from(draw.any::<u8>()) < share {
                pairs.push([p, q]);
            }
        }
    }
    let mut arcs: Vec<[f64; 2]> = Vec::new();
    for _ in &pairs {
        arcs.push([draw.within(1..=9) as f64, f64::from(draw.real())]);
    }
    if n > 0 && draw.seldom(16) {
        area[draw.within(0..=n - 1)] = f64::from(draw.real());
    }
    if draw.seldom(16) {
        pairs.push([draw.any::<u8>().into(), draw.within(0..=n) as u32]);
        arcs.push([1.0, 1.0]);
    }
    let open = draw.mask(n);
    let costs: Vec<Cost> = (0..draw.within(0..=3))
        .map(|_| Cost {
            arcs: f64::from(draw.real()),
            means: f64::from(draw.real()),
            small: [0.0, 5.0, 60.0][draw.within(0..=2)],
        })
        .collect();
    let bounds = [
        draw.within(0..=20) as f64,
        [1.0, 30.0, 100.0, f64::INFINITY][draw.within(0..=3)],
    ];
    let graph = Graph {
        area: &area,
        mean: mean.as_chunks().0,
        pairs: &pairs,
        arcs: &arcs,
    };
    let Some(found) = agreed(|monitor| candidates(&graph, &costs, &open, bounds, monitor)) else {
        return;
    };
    assert_eq!(found.seam.len(), found.sets.len());
    let total = |set: &[u32]| set.iter().map(|&i| area[i as usize]).sum::<f64>();
    let allowed = |area: f64| bounds[0] <= area && area <= bounds[1];
    // Only areas that are whole numbers have exact sums.
    let exact = area.iter().all(|a| a.fract() == 0.0 && *a < 1e6);
    let mut seen = BTreeSet::new();
    for i in 0..found.sets.len() {
        let set = found.sets.get(i);
        assert!(set.windows(2).all(|two| two[0] < two[1]), "{set:?}");
        assert!(seen.insert(set.to_vec()), "{set:?} is there twice");
        assert!(connected(set, &pairs), "{set:?}");
        assert!(!exact || allowed(total(set)), "{set:?}");
    }
    for (i, &area) in area.iter().enumerate() {
        assert_eq!(seen.contains(&vec![i as u32]), allowed(area));
    }
}

/// Draws sets of regions below `most`. A region is in a set at most once.
fn draw_sets(draw: &mut Draw<'_>, most: usize) -> (Vec<usize>, Vec<u32>) {
    let (mut starts, mut members) = (vec![0], Vec::new());
    for _ in 0..draw.within(0..=8) {
        let flags = draw.mask(most);
        members.extend((0..most as u32).filter(|&i| flags[i as usize]));
        starts.push(members.len());
    }
    if draw.seldom(16) {
        starts.push(draw.within(0..=members.len() + 1));
    }
    (starts, members)
}

fn summed(draw: &mut Draw<'_>) {
    let (rows, columns) = (draw.within(0..=9), draw.within(0..=4));
    let more = usize::from(draw.seldom(16));
    let (starts, members) = draw_sets(draw, rows + more);
    let values: Vec<f64> = draw
        .values(rows * columns)
        .into_iter()
        .map(f64::from)
        .collect();
    let Some((sets, found)) = agreed(|monitor| {
        let sets = Sets::new(starts.clone(), members.clone())?;
        let found = sums(&sets, &values, columns, monitor)?;
        Ok((sets, found))
    }) else {
        return;
    };
    for (i, row) in found.chunks_exact(columns).enumerate() {
        for (k, sum) in row.iter().enumerate() {
            let own = sets
                .get(i)
                .iter()
                .map(|&p| values[p as usize * columns + k]);
            assert!(near(*sum, own.sum(), 1e-12));
        }
    }
    assert_eq!(found.len(), sets.len() * columns);
}

fn measured(draw: &mut Draw<'_>) {
    let shape = draw.shape::<2>(1..=9);
    let (n, count) = (shape[0] * shape[1], draw.within(1..=8));
    let label: Vec<u32> = draw.numbers(n, count as u32).collect();
    let strength = draw.values(n);
    let near_by = adjacency(&label, &strength, shape, count, 0.5, &Default::default()).unwrap();
    let (starts, members) = draw_sets(draw, count);
    let bins = draw.within(0..=4);
    let mut histograms: Vec<f32> = draw.values(count * bins);
    if draw.seldom(16) {
        histograms.push(draw.real());
    }
    let values = Values {
        pairs: &near_by.pairs,
        arcs: &near_by.arcs,
        histograms: &histograms,
        bins,
        extremes: &near_by.extremes,
    };
    let Some((sets, found)) = agreed(|monitor| {
        let sets = Sets::new(starts.clone(), members.clone())?;
        let found = measure(&sets, &values, monitor)?;
        Ok((sets, found))
    }) else {
        return;
    };
    for (i, found) in found.iter().enumerate() {
        let set = sets.get(i);
        let (mut outer, mut inner) = ([0.0; 3], [0.0; 3]);
        for (pair, arc) in near_by.pairs.iter().zip(&near_by.arcs) {
            let sums = match pair.map(|p| set.contains(&p)) {
                [true, true] => &mut inner,
                [false, false] => continue,
                _ => &mut outer,
            };
            (0..3).for_each(|k| sums[k] += arc[k]);
        }
        for k in 0..3 {
            assert!(near(found.outer[k], outer[k], 1e-9) && near(found.inner[k], inner[k], 1e-9));
        }
        assert!(
            (-1e-6..=1.0 + 1e-6).contains(&found.contrast),
            "{}",
            found.contrast
        );
        assert!((0.0..=1.0 + 1e-9).contains(&found.alike), "{}", found.alike);
        let own: Vec<usize> = (0..n).filter(|&p| set.contains(&label[p])).collect();
        let lacks = set.iter().any(|l| !label.contains(l));
        if own.is_empty() || lacks {
            continue;
        }
        // The shape encloses all pixels of the set.
        let area = own.len() as f64;
        let side = |of: fn(usize, usize) -> usize| {
            let places = own.iter().map(|&p| of(p, shape[1]));
            (places.clone().max().unwrap() - places.min().unwrap() + 1) as f64
        };
        let (high, wide) = (
            side(|p, columns| p / columns),
            side(|p, columns| p % columns),
        );
        assert!(near(found.extent, high + wide, 1e-9));
        assert!(found.hull >= area - 1e-6, "{} for {area}", found.hull);
        assert!(found.rectangle <= high * wide + 1e-6);
    }
}

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    match draw.within(0..=2) {
        0 => merged(&mut draw),
        1 => summed(&mut draw),
        _ => measured(&mut draw),
    }
});
