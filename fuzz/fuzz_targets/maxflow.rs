//! Fuzzes minimum cuts of grids with two and three axes. The value must equal the cost of the
//! labels, and no other labels may cost less.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::grid::Grid;
use texrs::seam::maxflow::{Graph, Solver, min_cut};
use texrs_fuzz::{Draw, agreed};

/// Returns the cost of the cut whose points on the sink side are those where `sink` is true.
fn cost<const D: usize>(graph: &Graph<'_, D>, sink: impl Fn(usize) -> bool) -> i64 {
    let grid = graph.grid;
    let mut sum = 0;
    for (p, point) in grid.points().enumerate() {
        let terminal = i64::from(graph.terminal[p]);
        sum += if sink(p) {
            terminal.max(0)
        } else {
            (-terminal).max(0)
        };
        for axis in 0..D {
            if let Some(next) = grid.next(point, axis).map(|q| grid.index(q)) {
                sum += match (sink(p), sink(next)) {
                    (false, true) => i64::from(graph.forward[axis][p]),
                    (true, false) => i64::from(graph.backward[axis][p]),
                    _ => 0,
                };
            }
        }
    }
    sum
}

fn check<const D: usize>(draw: &mut Draw<'_>, longest: usize) {
    let grid = Grid::new(draw.shape::<D>(1..=longest), draw.flags()).unwrap();
    let n = grid.len();
    let unit = [1, 1, 1000, 1 << 20, 1 << 26, i32::MAX / 300][draw.within(0..=5)];
    let most = draw.within(1..=300) as u32;
    let mut capacities = |low: i32| -> Vec<i32> {
        // Sometimes include a capacity that is not allowed.
        let low = if draw.seldom(64) { low - 1 } else { low };
        draw.numbers(n, most)
            .map(|x| (x as i32 + low).saturating_mul(unit))
            .collect()
    };
    let middle = -(most as i32) / 2;
    let terminal = capacities(middle);
    let forward: [Vec<i32>; D] = std::array::from_fn(|_| capacities(0));
    let backward: [Vec<i32>; D] = std::array::from_fn(|_| capacities(0));
    let graph = Graph {
        grid,
        terminal: &terminal,
        forward: std::array::from_fn(|a| &forward[a][..]),
        backward: std::array::from_fn(|a| &backward[a][..]),
    };
    let Some(found) = agreed(|monitor| min_cut(&graph, monitor)) else {
        return;
    };
    assert_eq!(found.value, cost(&graph, |p| found.sink[p]));
    if n <= 9 {
        let least = (0..1u32 << n)
            .map(|set| cost(&graph, |p| set >> p & 1 == 1))
            .min();
        assert_eq!(Some(found.value), least);
    } else {
        for changed in 0..n {
            assert!(cost(&graph, |p| found.sink[p] != (p == changed)) >= found.value);
        }
    }
    // A reused workspace must give the same cut as a new one.
    let mut solver = Solver::default();
    let turned: Vec<i32> = terminal.iter().map(|t| t.saturating_neg()).collect();
    let _ = solver.min_cut(
        &Graph {
            terminal: &turned,
            ..graph
        },
        &Default::default(),
    );
    assert_eq!(solver.min_cut(&graph, &Default::default()).unwrap(), found);
}

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    if draw.flag() {
        check::<2>(&mut draw, 9);
    } else {
        check::<3>(&mut draw, 4);
    }
});
