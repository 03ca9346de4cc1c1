//! Fuzzes binary labels of minimum energy, and minimum-cost seams found as shortest paths. No
//! change of a single label may lower the energy, and seams must cost as much as minimum cuts.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::grid::Grid;
use texrs::seam::labels::{Energy, least_energy};
use texrs::seam::maxflow::{Graph, min_cut};
use texrs::seam::planar::ring::{Ring, Side, least_ring};
use texrs::seam::planar::{Strip, least_seam};
use texrs_fuzz::{Draw, agreed, near};

/// Returns the sum of `cost` over all pairs of neighbours with different labels. The cost of a pair
/// depends on the label of its first point.
fn parted<const D: usize, T>(
    grid: &Grid<D>,
    labels: &[bool],
    cost: impl Fn(usize, usize, bool) -> T,
) -> T
where
    T: std::iter::Sum,
{
    let cost = &cost;
    let links = |(p, point): (usize, [usize; D])| {
        let next = move |axis| grid.next(point, axis).map(|q| (axis, grid.index(q)));
        let apart = move |&(_, q): &(usize, usize)| labels[p] != labels[q];
        (0..D)
            .filter_map(next)
            .filter(apart)
            .map(move |(axis, _)| cost(axis, p, labels[p]))
    };
    grid.points().enumerate().flat_map(links).sum()
}

fn energy<const D: usize>(draw: &mut Draw<'_>, longest: usize) {
    let grid = Grid::new(draw.shape::<D>(1..=longest), draw.flags()).unwrap();
    let n = grid.len();
    let mut unary: Vec<[f32; 2]> = draw.values(2 * n).as_chunks().0.to_vec();
    for _ in 0..draw.within(0..=2) {
        unary[draw.within(0..=n - 1)][draw.within(0..=1)] = draw.real();
    }
    let pairs: [[Vec<f32>; D]; 2] = std::array::from_fn(|_| std::array::from_fn(|_| draw.reals(n)));
    let view = |k: usize| -> [&[f32]; D] { std::array::from_fn(|axis| &pairs[k][axis][..]) };
    let energy = Energy {
        grid,
        unary: &unary,
        forward: view(0),
        backward: view(1),
    };
    let Some(found) = agreed(|monitor| least_energy(&energy, monitor)) else {
        return;
    };
    let of = |labels: &[bool]| -> f64 {
        let own = unary
            .iter()
            .zip(labels)
            .map(|(u, &l)| f64::from(u[usize::from(l)]))
            .sum::<f64>();
        own + parted(&grid, labels, |axis, p, from| {
            f64::from(pairs[usize::from(from)][axis][p])
        })
    };
    assert!(near(of(&found.labels), found.energy, 1e-9));
    // Costs are rounded to steps of 2^-25 of the largest pairwise cost or, without pairwise costs,
    // of the largest unary cost.
    let costs = pairs.iter().flatten().flatten().copied();
    let own = unary
        .as_flattened()
        .iter()
        .copied()
        .filter(|c| c.is_finite());
    let most = f64::from(costs.chain(own).fold(0.0f32, |m, c| m.max(c.abs())));
    for changed in 0..n {
        let mut labels = found.labels.clone();
        labels[changed] ^= true;
        assert!(
            of(&labels) >= found.energy - most * 1e-5,
            "{changed}: {} {}",
            of(&labels),
            found.energy
        );
    }
}

fn strip(draw: &mut Draw<'_>) {
    let (rows, columns, cyclic) = (draw.within(1..=10), draw.within(1..=10), draw.flag());
    let n = rows * columns;
    let unit = [1, 100, 1 << 18, 1 << 22][draw.within(0..=3)];
    let most = draw.within(1..=200) as u32;
    let [across, along] = [0; 2].map(|_| {
        draw.numbers(n, most)
            .map(|x| x * unit)
            .collect::<Vec<u32>>()
    });
    let strip = Strip {
        rows,
        columns,
        cyclic,
        across: &across,
        along: &along,
    };
    let Some(found) = agreed(|monitor| least_seam(&strip, monitor)) else {
        return;
    };
    // The value must equal the cost of the labels and the maximum flow.
    let grid = Grid::new([rows, columns], [cyclic, false]).unwrap();
    let costs = [&along, &across];
    let sum = parted(&grid, &found.far, |axis, p, _| u64::from(costs[axis][p]));
    assert_eq!(u64::from(found.value), sum);
    let ends = |p: usize| match p % columns {
        0 => 1 << 30,
        c if c + 1 == columns => -(1 << 30),
        _ => 0,
    };
    let terminal: Vec<i32> = (0..n).map(ends).collect();
    let [across, along] =
        [&across, &along].map(|c| c.iter().map(|&x| x as i32).collect::<Vec<i32>>());
    let pairs: [&[i32]; 2] = [&along, &across];
    let graph = Graph {
        grid,
        terminal: &terminal,
        forward: pairs,
        backward: pairs,
    };
    assert_eq!(
        i64::from(found.value),
        min_cut(&graph, &Default::default()).unwrap().value
    );
}

fn ring(draw: &mut Draw<'_>) {
    let (rows, columns) = (draw.within(1..=12), draw.within(1..=12));
    let n = rows * columns;
    // Start from a core in the middle and a rim along the border, then change a few random pixels.
    let middle = [rows / 2, columns / 2];
    let reach = draw.within(0..=3);
    let mut sides: Vec<Side> = (0..n)
        .map(|p| {
            let at = [p / columns, p % columns];
            let rim = at[0] == 0 || at[1] == 0 || at[0] + 1 == rows || at[1] + 1 == columns;
            let far = at[0].abs_diff(middle[0]).max(at[1].abs_diff(middle[1]));
            if rim {
                Side::Outside
            } else if far <= reach {
                Side::Inside
            } else {
                Side::Free
            }
        })
        .collect();
    for _ in 0..draw.within(0..=8) {
        sides[draw.within(0..=n - 1)] =
            [Side::Free, Side::Outside, Side::Inside][draw.within(0..=2)];
    }
    let most = draw.within(1..=200) as u32;
    let [across, along] = [0; 2].map(|_| {
        draw.numbers(n, most)
            .map(|x| x as i32)
            .collect::<Vec<i32>>()
    });
    let ring = Ring {
        rows,
        columns,
        sides: &sides,
        across: &across,
        along: &along,
    };
    let Some(Some(inside)) = agreed(|monitor| least_ring(&ring, monitor)) else {
        return;
    };
    let tie = |side: &Side| match side {
        Side::Free => 0,
        Side::Outside => 1 << 28,
        Side::Inside => -(1 << 28),
    };
    assert!(
        sides
            .iter()
            .zip(&inside)
            .all(|(s, &i)| *s == Side::Free || (*s == Side::Inside) == i)
    );
    let grid = Grid::new([rows, columns], [false; 2]).unwrap();
    let terminal: Vec<i32> = sides.iter().map(tie).collect();
    let pairs: [&[i32]; 2] = [&along, &across];
    let graph = Graph {
        grid,
        terminal: &terminal,
        forward: pairs,
        backward: pairs,
    };
    let sum = parted(&grid, &inside, |axis, p, _| i64::from(pairs[axis][p]));
    let flow = min_cut(&graph, &Default::default()).unwrap();
    assert_eq!(sum, flow.value);
    // If several cuts are minimal, both solvers must return the innermost one.
    assert_eq!(inside, flow.sink);
}

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    match draw.within(0..=3) {
        0 => energy::<2>(&mut draw, 8),
        1 => energy::<3>(&mut draw, 4),
        2 => strip(&mut draw),
        _ => ring(&mut draw),
    }
});
