//! Times warps of a dense mesh and of scattered points along a wave.

use criterion::{BenchmarkId, Criterion, Throughput};
use texrs::par::{self, Monitor};
use texrs::warp::{Mesh, Point, mesh, scattered};

fn bent(p: Point) -> Point {
    p.map(|x| x + 3.0 * (x / 9.0).sin())
}

pub(crate) fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("warp");
    let side = 512usize;
    let target: Vec<Point> = (0..side * side)
        .map(|i| bent([(i / side) as f64, (i % side) as f64]))
        .collect();
    let weight: Vec<u8> = (0..side * side)
        .map(|i| u8::from(i * 7919 % 5 < 2))
        .collect();
    let source = Mesh {
        shape: [side; 2],
        target: &target,
        weight: &weight,
    };
    group.throughput(Throughput::Elements((side * side) as u64));
    for threads in [1, 2] {
        group.bench_function(BenchmarkId::new("mesh 512^2", threads), |b| {
            par::install(threads, || {
                b.iter(|| mesh(&source, [side; 2], &Monitor::default()).unwrap());
            })
            .unwrap();
        });
    }
    // A coarse lattice of 20 x 20 points.
    let points: Vec<Point> = (0..400)
        .map(|i| [(i / 20 * 27) as f64, (i % 20 * 27) as f64])
        .collect();
    let moved: Vec<Point> = points.iter().map(|&p| bent(p)).collect();
    group.bench_function("points 400, 512^2", |b| {
        par::install(2, || {
            b.iter(|| scattered(&points, &moved, [side; 2], &Monitor::default()).unwrap());
        })
        .unwrap();
    });
    group.finish();
}
