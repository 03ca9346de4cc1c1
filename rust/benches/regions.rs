//! Times the segmentation of a noisy wave, with the usual parameters.

use criterion::{BenchmarkId, Criterion};
use texrs::hash::Noise;
use texrs::par::{self, Monitor};
use texrs::regions::{Options, felzenszwalb};

pub(crate) fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("regions");
    group.sample_size(10);
    for side in [256usize, 512] {
        let noise = Noise::new(1);
        let sample = |i: usize| {
            let (y, x) = (i / 3 / side, i / 3 % side);
            let wave = 60.0 * ((y as f32 / 40.0).sin() + (x as f32 / 31.0).cos());
            wave + 128.0 + 20.0 * noise.uniform([i as u32, 0, 0, 0]) as f32
        };
        let image: Vec<f32> = (0..side * side * 3).map(sample).collect();
        let options = Options {
            scale: 60.0,
            blur: 0.4,
            least: 24,
            wrap: [false; 2],
        };
        for threads in [1, 2] {
            group.bench_function(BenchmarkId::new(side.to_string(), threads), |b| {
                par::install(threads, || {
                    b.iter(|| felzenszwalb(&image, [side, side, 3], &options, &Monitor::default()));
                })
                .unwrap();
            });
        }
    }
    group.finish();
}
