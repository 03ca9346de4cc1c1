//! Times the factorisation of the screened Laplacian of a grid, and its solution for two right-hand
//! sides.

use criterion::{BenchmarkId, Criterion};
use texrs::par::Monitor;
use texrs::sparse::{Cholesky, Lower};

pub(crate) fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("sparse");
    group.sample_size(10);
    for side in [128u32, 256] {
        let (mut starts, mut rows, mut values) = (vec![0u32], vec![], vec![]);
        for i in 0..side * side {
            rows.push(i);
            values.push(4.001);
            for (j, inside) in [
                (i + 1, i % side + 1 < side),
                (i + side, i / side + 1 < side),
            ] {
                if inside {
                    rows.push(j);
                    values.push(-1.0);
                }
            }
            starts.push(rows.len() as u32);
        }
        let matrix = Lower {
            starts: &starts,
            rows: &rows,
            values: &values,
        };
        // Measure the factorisation and the solution separately.
        let factor = || Cholesky::new(&matrix, 1 << 32, &Monitor::default()).unwrap();
        group.bench_function(BenchmarkId::new("factor", side), |b| b.iter(factor));
        let made = factor();
        group.bench_function(BenchmarkId::new("two solves", side), |b| {
            b.iter(|| {
                let mut sides = vec![1.0; 2 * (side * side) as usize];
                made.solve(&mut sides).unwrap();
                sides
            });
        });
    }
    group.finish();
}
