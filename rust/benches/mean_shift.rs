//! Times mean-shift filtering of a noisy wave, with the radii that segmentation uses.

use criterion::{BenchmarkId, Criterion};
use texrs::hash::Noise;
use texrs::mean_shift::{Options, filter};
use texrs::par::{self, Monitor};

pub(crate) fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("mean_shift");
    group.sample_size(10);
    for (side, radius, range) in [(256usize, 6, 14.0), (512, 10, 20.0)] {
        let noise = Noise::new(1);
        let sample = |i: usize| {
            let (y, x) = (i / 3 / side, i / 3 % side);
            let wave = 60.0 * ((y as f32 / 40.0).sin() + (x as f32 / 31.0).cos());
            (wave + 128.0 + 20.0 * noise.uniform([i as u32, 0, 0, 0]) as f32).round()
        };
        let image: Vec<f32> = (0..side * side * 3).map(sample).collect();
        let options = Options {
            radius,
            range,
            max_iterations: 5,
            tolerance: f32::INFINITY,
            wrap: [false; 2],
        };
        for threads in [1, 2] {
            let id = BenchmarkId::new(format!("{side}, radius {radius}"), threads);
            group.bench_function(id, |b| {
                par::install(threads, || {
                    b.iter(|| filter(&image, [side, side, 3], &options, &Monitor::default()));
                })
                .unwrap();
            });
        }
    }
    group.finish();
}
