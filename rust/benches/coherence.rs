//! Times the similarity sets of an image and of a volume, and one correction pass over a region of
//! the same size.

use criterion::{BenchmarkId, Criterion, Throughput};
use texrs::appearance::Appearance;
use texrs::coherence::{FEW, Kinds, Options, correct, jitter, similar};
use texrs::fixed::{Frames, ONE, Place, identity};
use texrs::grid::{Grid, Region};
use texrs::hash::Noise;
use texrs::par::{self, Monitor};

fn sides<const D: usize>(c: &mut Criterion, side: usize) {
    let mut group = c.benchmark_group("coherence");
    group.sample_size(10);
    let grid = Grid::new([side; D], [false; D]).unwrap();
    let noise = Noise::new(1);
    let colours: Vec<f32> = (0..grid.len())
        .map(|i| {
            let wave: f64 = grid.point(i).iter().map(|&x| (x as f64 * 0.6).sin()).sum();
            (wave + noise.uniform([i as u32, 0, 0, 0])) as f32
        })
        .collect();
    let appearance = Appearance::new(&colours, grid, 1, 2).unwrap();
    let region = Region::new(grid, [0; D]).unwrap();
    let sets = similar(&appearance, 3, 7, FEW, &Monitor::default()).unwrap();
    // Start from coordinates with strong noise, so that the pass has work to do.
    let mut start: Vec<Place<D>> = vec![[side as i32 / 2 * ONE; D]; grid.len()];
    jitter(
        &mut start,
        &region,
        &[],
        (side as i32 / 2 * ONE) as u32,
        1,
        0,
    )
    .unwrap();
    let options = Options {
        passes: 1,
        numbers: FEW,
        compensated: false,
    };
    group.throughput(Throughput::Elements(grid.len() as u64));
    // Measure the sets and the pass separately.
    for threads in [1, 2] {
        let id = BenchmarkId::new(format!("similar, {side}^{D}"), threads);
        group.bench_function(id, |b| {
            b.iter(|| {
                par::install(threads, || {
                    similar(&appearance, 3, 7, FEW, &Monitor::default()).unwrap()
                })
            });
        });
        let id = BenchmarkId::new(format!("pass, {side}^{D}"), threads);
        group.bench_function(id, |b| {
            b.iter(|| {
                let mut places = start.clone();
                par::install(threads, || {
                    let frames = Frames::Constant(identity());
                    let monitor = Monitor::default();
                    correct(
                        &appearance,
                        &sets,
                        &region,
                        frames,
                        &[],
                        Kinds::default(),
                        &mut places,
                        &options,
                        &monitor,
                    )
                    .unwrap();
                })
            });
        });
    }
    group.finish();
}

pub(crate) fn bench(c: &mut Criterion) {
    sides::<2>(c, 256);
    sides::<3>(c, 32);
}
