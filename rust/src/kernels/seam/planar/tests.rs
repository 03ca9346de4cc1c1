use super::*;
use crate::foundation::grid::Grid;
use crate::kernels::seam::maxflow::{Graph, min_cut};
use proptest::prelude::*;

/// Returns the same cut by maximum flow, with the first column tied to the source and the last one
/// to the sink.
fn by_flow(strip: &Strip<'_>) -> i64 {
    let n = strip.rows * strip.columns;
    let signed = |costs: &[u32]| -> Vec<i32> { costs.iter().map(|&c| c as i32).collect() };
    let (across, along) = (signed(strip.across), signed(strip.along));
    let terminal: Vec<i32> = (0..n)
        .map(|p| match p % strip.columns {
            0 => 1 << 30,
            c if c + 1 == strip.columns => -(1 << 30),
            _ => 0,
        })
        .collect();
    let graph = Graph {
        grid: Grid::new([strip.rows, strip.columns], [strip.cyclic, false]).unwrap(),
        terminal: &terminal,
        forward: [&along, &across],
        backward: [&along, &across],
    };
    min_cut(&graph, &Monitor::default()).unwrap().value
}

/// Returns the cost of a labelling, by definition.
fn value(strip: &Strip<'_>, far: &[bool]) -> u32 {
    let grid = Grid::new([strip.rows, strip.columns], [strip.cyclic, false]).unwrap();
    let mut sum = 0;
    for p in 0..grid.len() {
        for (axis, costs) in [strip.along, strip.across].into_iter().enumerate() {
            if let Some(q) = grid.next(grid.point(p), axis)
                && far[p] != far[grid.index(q)]
            {
                sum += costs[p];
            }
        }
    }
    sum
}

fn costs(n: usize, most: u32) -> impl Strategy<Value = Vec<u32>> {
    // Costs are mostly small with a few walls, so that shortest paths turn back.
    let cost = prop_oneof![3 => 0..=most, 1 => Just(most * 20)];
    prop::collection::vec(cost, n)
}

fn strips(longest: usize) -> impl Strategy<Value = (usize, usize, Vec<u32>, Vec<u32>)> {
    (1..=longest, 2..=longest, 0u32..60).prop_flat_map(|(rows, columns, most)| {
        (
            Just(rows),
            Just(columns),
            costs(rows * columns, most),
            costs(rows * columns, most),
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn equals_the_maximum_flow((rows, columns, across, along) in strips(14), cyclic in any::<bool>()) {
        let strip = Strip { rows, columns, cyclic, across: &across, along: &along };
        let seam = least_seam(&strip, &Monitor::default()).unwrap();
        prop_assert_eq!(i64::from(seam.value), by_flow(&strip));
        prop_assert_eq!(value(&strip, &seam.far), seam.value);
        for row in seam.far.chunks_exact(columns) {
            prop_assert!(!row[0] && row[columns - 1]);
        }
    }
}

/// A closed seam must cross diagonal stripes, which makes every lower bound misleading.
#[test]
fn a_cyclic_seam_crosses_diagonal_stripes() {
    let (rows, columns) = (40, 57);
    let cost = |r: usize, c: usize| {
        if (r + c) % 10 < 2 {
            1
        } else {
            30 + (r * 7 + c * 13) as u32 % 11
        }
    };
    let across: Vec<u32> = (0..rows * columns)
        .map(|p| cost(p / columns, p % columns))
        .collect();
    let along: Vec<u32> = (0..rows * columns)
        .map(|p| cost(p / columns, p % columns + 1))
        .collect();
    let strip = Strip {
        rows,
        columns,
        cyclic: true,
        across: &across,
        along: &along,
    };
    let seam = least_seam(&strip, &Monitor::default()).unwrap();
    assert_eq!(i64::from(seam.value), by_flow(&strip));
    assert_eq!(value(&strip, &seam.far), seam.value);
}

#[test]
fn refuses_strips_that_cannot_be_cut() {
    let cut = |rows, columns, cost: u32| {
        let costs = vec![cost; 4];
        let strip = Strip {
            rows,
            columns,
            cyclic: false,
            across: &costs,
            along: &costs,
        };
        least_seam(&strip, &Monitor::default())
    };
    assert!(cut(4, 1, 1).is_err());
    assert!(cut(0, 4, 1).is_err());
    assert!(cut(2, 3, 1).is_err());
    assert!(cut(2, 2, 1 << 29).is_err());
    assert_eq!(cut(2, 2, 1).unwrap().far, [false, true, false, true]);
}
