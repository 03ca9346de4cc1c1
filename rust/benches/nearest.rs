//! The nearest other of vectors whose numbers spread less and less, as principal components do.

use criterion::{BenchmarkId, Criterion, Throughput};
use texrs::hash::Noise;
use texrs::nearest::Nearest;
use texrs::par::{self, Monitor};

pub(crate) fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("nearest");
    group.sample_size(10);
    let numbers = 30;
    for count in [4096, 16384] {
        let noise = Noise::new(1);
        // Smooth in the order of the vectors: each number is a sum of waves.
        let vectors: Vec<f64> = (0..count * numbers)
            .map(|i| {
                let (which, k) = ((i / numbers) as f64, (i % numbers) as f64);
                let wave = (which * 0.01 * (1.0 + k)).sin() + (which * 0.0173 * (2.0 + k)).cos();
                (wave + 0.2 * noise.uniform([i as u32, 0, 0, 0])) / (1.0 + k)
            })
            .collect();
        let nearest = Nearest::new(vectors, numbers).unwrap();
        group.throughput(Throughput::Elements(count as u64));
        for threads in [1, 2] {
            group.bench_function(BenchmarkId::new(format!("{count} of 30"), threads), |b| {
                b.iter(|| par::install(threads, || nearest.others(&Monitor::default()).unwrap()));
            });
        }
    }
    group.finish();
}
