use super::order::dissect;
use super::*;
use crate::foundation::par;
use proptest::prelude::*;

/// The lower triangle of a test matrix.
#[derive(Debug, Clone)]
struct Triangle {
    starts: Vec<u32>,
    rows: Vec<u32>,
    values: Vec<f64>,
}

impl Triangle {
    /// Returns the Laplacian of weighted pairs of unknowns, with `screening` added to its diagonal.
    fn laplacian(size: usize, pairs: &[(usize, usize, f64)], screening: f64) -> Self {
        let mut columns = vec![std::collections::BTreeMap::new(); size];
        for (i, column) in columns.iter_mut().enumerate() {
            column.insert(i, screening);
        }
        for &(i, j, weight) in pairs {
            *columns[i.min(j)].entry(i.max(j)).or_insert(0.0) -= weight;
            *columns[i].entry(i).or_insert(0.0) += weight;
            *columns[j].entry(j).or_insert(0.0) += weight;
        }
        let mut made = Self {
            starts: vec![0],
            rows: vec![],
            values: vec![],
        };
        for column in columns {
            for (row, value) in column {
                made.rows.push(row as u32);
                made.values.push(value);
            }
            made.starts.push(made.rows.len() as u32);
        }
        made
    }

    /// Returns the Laplacian of the open cells of a grid. Each cell is coupled to the cells at the given `steps` from
    /// it.
    fn grid(rows: usize, columns: usize, steps: &[(usize, isize)], open: &[bool]) -> Self {
        let mut pairs = vec![];
        for y in 0..rows {
            for x in 0..columns {
                for &(down, right) in steps {
                    let (v, u) = (y + down, x as isize + right);
                    if v < rows && (0..columns as isize).contains(&u) {
                        let (i, j) = (y * columns + x, v * columns + u as usize);
                        if open[i] && open[j] {
                            pairs.push((i, j, 1.0 + ((i * 7 + j) % 5) as f64));
                        }
                    }
                }
            }
        }
        Self::laplacian(rows * columns, &pairs, 1e-3)
    }

    fn lower(&self) -> Lower<'_> {
        Lower {
            starts: &self.starts,
            rows: &self.rows,
            values: &self.values,
        }
    }

    fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; x.len()];
        for column in 0..x.len() {
            for k in self.starts[column] as usize..self.starts[column + 1] as usize {
                let row = self.rows[k] as usize;
                y[row] += self.values[k] * x[column];
                if row != column {
                    y[column] += self.values[k] * x[row];
                }
            }
        }
        y
    }

    fn factor(&self) -> Result<Cholesky> {
        Cholesky::new(&self.lower(), 1 << 32, &Monitor::default())
    }

    /// Checks that three right-hand sides are solved, and that every unknown occurs once in the order.
    fn check(&self) {
        let size = self.starts.len() - 1;
        let wanted: Vec<f64> = (0..3 * size)
            .map(|i| (i * 7919 % 101) as f64 - 50.0)
            .collect();
        let mut x: Vec<f64> = wanted.chunks(size).flat_map(|x| self.times(x)).collect();
        let factor = self.factor().unwrap();
        factor.solve(&mut x).unwrap();
        for (a, b) in x.iter().zip(&wanted) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
        let checked = Checked::new(self.lower()).unwrap();
        let order = dissect(&checked, &Monitor::default()).unwrap();
        let mut seen = order.unknown.clone();
        seen.sort_unstable();
        assert!(
            seen.iter()
                .enumerate()
                .all(|(i, &unknown)| i == unknown as usize)
        );
        let mut at = order.alone as u32;
        for (number, block) in order.blocks.iter().enumerate() {
            assert!(block.start == at && block.end > at);
            assert!(block.parent == NONE || block.parent as usize > number);
            at = block.end;
        }
        assert_eq!(at as usize, size);
    }
}

/// Steps to the coupled cells in the energy of a splice.
const WIDE: [(usize, isize); 6] = [(0, 1), (0, 2), (1, -1), (1, 0), (1, 1), (2, 0)];
const NEAR: [(usize, isize); 2] = [(0, 1), (1, 0)];

proptest! {
    #[test]
    fn grids_are_solved(rows in 1usize..40, columns in 1usize..40, seed in 0usize..1000, wide: bool) {
        let open: Vec<bool> = (0..rows * columns).map(|i| seed % 3 == 0 || (i * 7919 + seed) % 11 > 2).collect();
        Triangle::grid(rows, columns, if wide { &WIDE } else { &NEAR }, &open).check();
    }

    #[test]
    fn graphs_are_solved(size in 1usize..300, seed in 0usize..1000, each in 0usize..4) {
        let mut pairs = vec![];
        for i in 0..size {
            for k in 0..each {
                let j = (i * 31 + (seed + k) * 7919 + i * i) % size;
                if i != j {
                    pairs.push((i, j, 1.0 + k as f64));
                }
            }
        }
        Triangle::laplacian(size, &pairs, 0.1).check();
    }
}

#[test]
fn what_is_no_grid_is_solved() {
    // Test chains, stars, combs, periodic grids, a volume, and a full matrix.
    let chain: Vec<_> = (1..5000).map(|i| (i - 1, i, 1.0)).collect();
    let star: Vec<_> = (1..3000).map(|i| (0, i, 1.0)).collect();
    let comb: Vec<_> = (1..2000)
        .map(|i| (if i % 2 == 0 { i - 2 } else { i - 1 }, i, 1.0))
        .collect();
    let torus: Vec<_> = (0..900)
        .flat_map(|i| {
            [
                (i, i / 30 * 30 + (i + 1) % 30, 1.0),
                (i, (i + 30) % 900, 1.0),
            ]
        })
        .collect();
    let volume: Vec<_> = (0..1000)
        .flat_map(|i| {
            [
                (i, i + 1, i % 10 < 9),
                (i, i + 10, i / 10 % 10 < 9),
                (i, i + 100, i < 900),
            ]
        })
        .filter(|pair| pair.2)
        .map(|(i, j, _)| (i, j, 1.0))
        .collect();
    let all: Vec<_> = (0..60)
        .flat_map(|i| (0..i).map(move |j| (i, j, 1.0)))
        .collect();
    // Each unknown is coupled to two hubs.
    let hubs: Vec<_> = (2..4000).flat_map(|i| [(0, i, 1.0), (1, i, 1.0)]).collect();
    for (size, pairs) in [
        (4000, hubs),
        (5000, chain),
        (3000, star),
        (2000, comb),
        (900, torus),
        (1000, volume),
        (60, all),
        (7, vec![]),
    ] {
        Triangle::laplacian(size, &pairs, 0.1).check();
    }
}

#[test]
fn separators_are_few() {
    // Diagonal separators need half as many unknowns as axis-aligned ones.
    let made = Triangle::grid(96, 96, &WIDE, &[true; 96 * 96]);
    let entries = made.factor().unwrap().entries();
    assert!(entries < 64 * 96 * 96, "{entries}");
}

#[test]
fn threads_make_no_difference() {
    let made = Triangle::grid(120, 110, &WIDE, &vec![true; 120 * 110]);
    let right: Vec<f64> = (0..2 * 120 * 110).map(|i| (i % 17) as f64).collect();
    let solve = |threads| {
        par::install(threads, || {
            let factor = made.factor().unwrap();
            let mut x = right.clone();
            factor.solve(&mut x).unwrap();
            (
                factor.parts.len(),
                x.iter().map(|x| x.to_bits()).collect::<Vec<_>>(),
            )
        })
        .unwrap()
    };
    let (parts, one) = solve(1);
    assert_eq!(parts, 1);
    for threads in [2, 7] {
        let (parts, other) = solve(threads);
        assert!(parts > 4 && other == one);
    }
}

#[test]
fn right_sides_are_solved_one_by_one_or_together() {
    let made = Triangle::grid(20, 20, &WIDE, &[true; 400]);
    let factor = made.factor().unwrap();
    let mut all: Vec<f64> = (0..1200).map(|i| (i % 13) as f64).collect();
    let mut single = all.clone();
    factor.solve(&mut all).unwrap();
    for one in single.chunks_mut(400) {
        factor.solve(one).unwrap();
    }
    assert_eq!(all, single);
    assert!(factor.solve(&mut [0.0; 399]).is_err() && factor.solve(&mut []).is_err());
}

#[test]
fn entries_above_the_diagonal_are_not_read() {
    let below = Triangle::laplacian(3, &[(0, 1, 1.0), (1, 2, 2.0)], 1.0);
    let whole = Lower {
        starts: &[0, 2, 5, 7],
        rows: &[0, 1, 0, 1, 2, 1, 2],
        values: &[2.0, -1.0, f64::NAN, 4.0, -2.0, f64::NAN, 3.0],
    };
    let solve = |matrix: &Lower<'_>| {
        let mut x = [1.0, 2.0, 3.0];
        let factor = Cholesky::new(matrix, 1 << 20, &Monitor::default()).unwrap();
        factor.solve(&mut x).unwrap();
        x
    };
    assert_eq!(solve(&below.lower()), solve(&whole));
}

#[test]
fn what_is_not_definite_is_refused() {
    let mut made = Triangle::grid(70, 70, &WIDE, &[true; 4900]);
    let (first, last) = (made.starts[3000] as usize, made.values.len() - 1);
    for at in [0, first, last] {
        let kept = std::mem::replace(&mut made.values[at], -1e-9);
        let refused = par::install(2, || made.factor()).unwrap();
        assert!(
            refused
                .unwrap_err()
                .to_string()
                .contains("positive definite")
        );
        made.values[at] = f64::MAX;
        // This entry is larger than all others, but finite.
        assert!(made.factor().is_ok());
        made.values[at] = kept;
    }
    assert!(made.factor().is_ok());
}

#[test]
fn a_caller_may_stop_it() {
    let made = Triangle::grid(30, 30, &WIDE, &[true; 900]);
    let monitor = Monitor::default();
    monitor.cancel();
    let stopped = Cholesky::new(&made.lower(), 1 << 32, &monitor);
    assert!(matches!(stopped, Err(Error::Cancelled(_))));
}

#[test]
fn bad_matrices_are_refused() {
    let refused = |starts: &[u32], rows: &[u32], values: &[f64], limit: usize| {
        let matrix = Lower {
            starts,
            rows,
            values,
        };
        Cholesky::new(&matrix, limit, &Monitor::default())
            .unwrap_err()
            .to_string()
    };
    assert!(refused(&[0], &[], &[], 1 << 20).contains("one column"));
    assert!(refused(&[0, 1, 2], &[0, 0], &[1.0, 1.0], 1 << 20).contains("diagonal"));
    assert!(refused(&[0, 2], &[0, 5], &[1.0, 1.0], 1 << 20).contains("inside"));
    assert!(refused(&[0, 3, 4], &[0, 1, 1, 1], &[1.0; 4], 1 << 20).contains("increase"));
    assert!(refused(&[0, 5, 1], &[0], &[1.0], 1 << 20).contains("diagonal"));
    assert!(refused(&[0, 1], &[0], &[f64::NAN], 1 << 20).contains("finite"));
    assert!(refused(&[0, 1], &[0], &[-1.0], 1 << 20).contains("positive definite"));
    assert!(refused(&[0, 1], &[0], &[1.0], 1).contains("limit"));
    let made = Triangle::grid(30, 30, &WIDE, &[true; 900]);
    let little = Cholesky::new(&made.lower(), 1 << 16, &Monitor::default());
    assert!(matches!(little, Err(Error::Limit { .. })));
}
