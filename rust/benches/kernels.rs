//! Root of the criterion benchmarks. Each kernel has a benchmark group, whose ids contain the sizes
//! and the number of threads.

mod coherence;
mod inpaint;
mod mean_shift;
mod ncc;
mod patch_search;
mod poisson;
mod regions;
mod seam;
mod sparse;
mod stitcher;
mod warp;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use texrs::gather::{Exemplar, Interpolation, gather};
use texrs::grid::Grid;
use texrs::hash::Noise;
use texrs::par::{self, Monitor};

fn bench_gather(c: &mut Criterion) {
    let mut group = c.benchmark_group("gather");
    let side = 512usize;
    let noise = Noise::new(1);
    let data: Vec<u8> = (0..side * side * 3)
        .map(|i| noise.words([i as u32, 0, 0, 0])[0] as u8)
        .collect();
    // The coordinates are between samples, so that they are interpolated.
    let coordinates: Vec<[f32; 2]> = (0..side * side)
        .map(|i| [(i / side) as f32 * 0.9, (i % side) as f32 * 0.9])
        .collect();
    group.throughput(Throughput::Elements((side * side) as u64));
    for (name, how) in [
        ("nearest", Interpolation::Nearest),
        ("linear", Interpolation::Linear),
        ("cubic", Interpolation::Cubic),
    ] {
        for threads in [1, 2] {
            group.bench_function(BenchmarkId::new(name, threads), |b| {
                let exemplar =
                    Exemplar::new(&data, Grid::new([side, side], [true; 2]).unwrap(), 3).unwrap();
                let mut out = vec![0u8; side * side * 3];
                b.iter(|| {
                    par::install(threads, || {
                        gather(
                            &[exemplar],
                            &[],
                            &coordinates,
                            how,
                            &mut out,
                            &Monitor::default(),
                        )
                        .unwrap()
                    })
                });
            });
        }
    }
    group.finish();
}

criterion_group!(
    benches,
    bench_gather,
    coherence::bench,
    inpaint::bench,
    mean_shift::bench,
    ncc::bench,
    patch_search::bench,
    poisson::bench,
    regions::bench,
    seam::bench,
    sparse::bench,
    stitcher::bench,
    warp::bench
);
criterion_main!(benches);
