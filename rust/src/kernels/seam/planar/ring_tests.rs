use super::*;
use crate::foundation::grid::Grid;
use crate::kernels::seam::maxflow::{Graph, min_cut};
use proptest::prelude::*;

/// Returns the pixels that can reach the inside, by maximum flow.
fn by_flow(ring: &Ring<'_>) -> Vec<bool> {
    let terminal: Vec<i32> = ring
        .sides
        .iter()
        .map(|side| match side {
            Side::Free => 0,
            Side::Outside => 1 << 30,
            Side::Inside => -(1 << 30),
        })
        .collect();
    let graph = Graph {
        grid: Grid::new([ring.rows, ring.columns], [false; 2]).unwrap(),
        terminal: &terminal,
        forward: [ring.along, ring.across],
        backward: [ring.along, ring.across],
    };
    min_cut(&graph, &Monitor::default()).unwrap().sink
}

/// Pixels of a random walk over the grid, which are connected.
fn blob(rows: usize, columns: usize, start: [usize; 2], steps: &[u8]) -> Vec<usize> {
    let [mut r, mut c] = [start[0] % rows, start[1] % columns];
    let mut pixels = vec![r * columns + c];
    for step in steps {
        match step % 4 {
            0 if c + 1 < columns => c += 1,
            1 if r + 1 < rows => r += 1,
            2 if c > 0 => c -= 1,
            3 if r > 0 => r -= 1,
            _ => {}
        }
        pixels.push(r * columns + c);
    }
    pixels
}

#[derive(Debug, Clone)]
struct Case {
    rows: usize,
    columns: usize,
    sides: Vec<Side>,
    across: Vec<i32>,
    along: Vec<i32>,
}

impl Case {
    fn ring(&self) -> Ring<'_> {
        Ring {
            rows: self.rows,
            columns: self.columns,
            sides: &self.sides,
            across: &self.across,
            along: &self.along,
        }
    }
}

/// Generates costs with many ties, including zeros and high walls.
fn costs(n: usize) -> impl Strategy<Value = Vec<i32>> {
    (0i32..40).prop_flat_map(move |most| {
        let cost = prop_oneof![6 => 0..=most, 1 => Just(0), 1 => Just(most * 20)];
        prop::collection::vec(cost, n)
    })
}

/// Generates cases whose inside pixels are drawn by a random walk. Outside pixels are random or along the border.
fn cases(longest: usize) -> impl Strategy<Value = Case> {
    (1..=longest, 1..=longest).prop_flat_map(|(rows, columns)| {
        let n = rows * columns;
        let start = [0..rows, 0..columns];
        let walk = prop::collection::vec(any::<u8>(), 0..20);
        let rim = any::<bool>();
        let outside = prop::collection::vec(prop::bool::weighted(0.04), n);
        (start, walk, rim, outside, costs(n), costs(n)).prop_map(
            move |(start, walk, rim, outside, across, along)| {
                let mut sides = vec![Side::Free; n];
                for (p, side) in sides.iter_mut().enumerate() {
                    let (r, c) = (p / columns, p % columns);
                    let border = r == 0 || c == 0 || r + 1 == rows || c + 1 == columns;
                    if (rim && border) || (!rim && outside[p]) {
                        *side = Side::Outside;
                    }
                }
                for p in blob(rows, columns, start, &walk) {
                    sides[p] = Side::Inside;
                }
                Case {
                    rows,
                    columns,
                    sides,
                    across,
                    along,
                }
            },
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    /// The result must equal the sink side of the maximum flow, including ties.
    #[test]
    fn equals_the_maximum_flow(case in cases(12)) {
        if let Some(inside) = least_ring(&case.ring(), &Monitor::default()).unwrap() {
            prop_assert_eq!(inside, by_flow(&case.ring()));
        }
    }
}

/// Solves a problem with costs 1 whose sides are drawn: `o` is outside, `x` is inside.
fn drawn(picture: &[&str]) -> Option<Vec<bool>> {
    let (rows, columns) = (picture.len(), picture[0].len());
    let sides: Vec<Side> = picture
        .concat()
        .bytes()
        .map(|b| match b {
            b'o' => Side::Outside,
            b'x' => Side::Inside,
            _ => Side::Free,
        })
        .collect();
    let ones = vec![1; rows * columns];
    let ring = Ring {
        rows,
        columns,
        sides: &sides,
        across: &ones,
        along: &ones,
    };
    let found = least_ring(&ring, &Monitor::default()).unwrap();
    if let Some(inside) = &found {
        assert_eq!(*inside, by_flow(&ring));
    }
    found
}

#[test]
fn knows_what_it_cannot_do() {
    assert!(drawn(&["ooooo", "o...o", "o.x.o", "o...o", "ooooo"]).is_some());
    // Two cores, no core, or an outside in the middle cannot be solved.
    assert!(drawn(&["oooooo", "ox..xo", "oooooo"]).is_none());
    assert!(drawn(&["ooo", "o.o", "ooo"]).is_none());
    assert!(drawn(&["xxxxx", "x...x", "x.o.x", "x...x", "xxxxx"]).is_none());
    // A core at the border and a rim in two parts can still be solved.
    assert!(drawn(&["x...o", "....o", "o...o"]).is_some());
}

#[test]
fn of_equal_seams_the_innermost() {
    let inside = drawn(&["ooooooo", "o.....o", "o..x..o", "o.....o", "ooooooo"]).unwrap();
    assert_eq!(inside.iter().filter(|&&i| i).count(), 1);
}

/// Costs whose sums would overflow are left to another solver.
#[test]
fn refuses_what_would_overflow() {
    let sides = [
        [Side::Outside; 3],
        [Side::Outside, Side::Inside, Side::Outside],
        [Side::Outside; 3],
    ]
    .concat();
    let ring = |cost: i32| {
        let costs = [cost; 9];
        let ring = Ring {
            rows: 3,
            columns: 3,
            sides: &sides,
            across: &costs,
            along: &costs,
        };
        least_ring(&ring, &Monitor::default()).unwrap()
    };
    assert!(ring(1 << 26).is_none());
    assert!(ring(1 << 25).is_some());
}
