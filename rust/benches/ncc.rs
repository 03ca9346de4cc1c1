//! Times the correlation of a template with an image of eight channels, whose spectra are already
//! computed.

use criterion::{BenchmarkId, Criterion, Throughput};
use texrs::hash::Noise;
use texrs::ncc::Correlation;
use texrs::par::{self, Monitor};

pub(crate) fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("ncc");
    group.sample_size(10);
    for side in [128, 256, 512] {
        let noise = Noise::new(1);
        let points = side * side;
        let image: Vec<f32> = (0..8 * points)
            .map(|i| noise.uniform([i as u32, 0, 0, 0]) as f32)
            .collect();
        let template: Vec<f32> = image[..8 * 41 * 41].to_vec();
        let correlation = Correlation::new(&image, [side, side]).unwrap();
        group.throughput(Throughput::Elements(points as u64));
        for threads in [1, 2] {
            let id = BenchmarkId::new(format!("8 channels, {side}^2, 41^2"), threads);
            group.bench_function(id, |b| {
                b.iter(|| {
                    par::install(threads, || {
                        correlation
                            .maps(&template, [41, 41], &Monitor::default())
                            .unwrap()
                    })
                });
            });
        }
    }
    group.finish();
}
