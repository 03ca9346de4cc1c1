use criterion::{BenchmarkId, Criterion, Throughput};
use texrs::grid::Grid;
use texrs::hash::Noise;
use texrs::par::Monitor;
use texrs::seam::cost::Cost;
use texrs::seam::labels::{Energy, least_energy};
use texrs::seam::stitch::{Overlap, Stitcher};
use texrs::seam::strip::{self, Pasted};

/// Returns RGB noise with several octaves, which is as rough as a texture and needs no file.
fn image(side: usize, layer: u32) -> Vec<f32> {
    let noise = Noise::new(1);
    (0..side * side * 3)
        .map(|i| {
            let (y, x, channel) = (i / 3 / side, i / 3 % side, (i % 3) as u32);
            let octave =
                |k: u32| noise.uniform([(y >> k) as u32, (x >> k) as u32, k, layer * 3 + channel]);
            ((octave(0) + octave(1) + octave(2)) / 3.0) as f32
        })
        .collect()
}

pub(crate) fn bench(c: &mut Criterion) {
    let monitor = Monitor::default();
    let mut group = c.benchmark_group("seam");
    group.sample_size(10);
    for side in [64, 256, 512] {
        group.throughput(Throughput::Elements((side * side) as u64));
        let (a, b) = (image(side, 0), image(side, 1));
        for (name, cyclic) in [("strip", false), ("strip_cyclic", true)] {
            group.bench_function(BenchmarkId::new(name, side), |bencher| {
                let pasted = Pasted {
                    shape: [side, side],
                    channels: 3,
                    a: &a,
                    b: &b,
                    axis: 1,
                    cyclic,
                    penalty: None,
                    cost: Cost::Gradient,
                };
                bencher.iter(|| strip::cut(&pasted, &monitor).unwrap());
            });
        }
        // The second image is a patch. Its core must be kept, and the seam runs through the ring
        // around the core.
        let grid = Grid::new([side, side], [false; 2]).unwrap();
        let inset = |margin: usize| -> Vec<bool> {
            (0..side * side)
                .map(|p| {
                    let nearest = |x: usize| x.min(side - 1 - x);
                    nearest(p / side).min(nearest(p % side)) >= margin
                })
                .collect()
        };
        let (all, patch, core) = (inset(0), inset(1), inset(side / 3));
        group.bench_function(BenchmarkId::new("ring", side), |bencher| {
            let overlap = Overlap {
                core_b: Some(&core),
                ..Overlap::new(grid, 3, &a, &b, &all, &patch)
            };
            let mut stitcher = Stitcher::default();
            bencher.iter(|| stitcher.cut(&overlap, &monitor).unwrap());
        });
        let unary: Vec<[f32; 2]> = a
            .chunks_exact(3)
            .map(|rgb| [rgb[0], 1.0 - rgb[0]])
            .collect();
        let smooth = vec![0.2; side * side];
        group.bench_function(BenchmarkId::new("labels", side), |bencher| {
            let energy = Energy {
                grid,
                unary: &unary,
                forward: [&smooth, &smooth],
                backward: [&smooth, &smooth],
            };
            bencher.iter(|| least_energy(&energy, &monitor).unwrap());
        });
    }
    group.finish();
}
