//! Times the filling of a hole whose sides are a quarter of the image's, with one and with two
//! threads.

use criterion::{BenchmarkId, Criterion};
use texrs::grid::Grid;
use texrs::hash::Noise;
use texrs::inpaint::{Canvas, Options, inpaint};
use texrs::par::{self, Monitor};
use texrs::patch_search::{Exemplar, Index, Pick};

pub(crate) fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("inpaint");
    group.sample_size(10);
    for (side, patch) in [(128usize, 21usize), (256, 32), (512, 32)] {
        let noise = Noise::new(1);
        let sample = |i: usize| {
            let (y, x) = (i / 3 / side, i / 3 % side);
            let wave = (y as f32 / 9.0).sin() + (x as f32 / 7.0).cos();
            0.5 + 0.2 * wave + 0.1 * noise.uniform([i as u32, 0, 0, 0]) as f32
        };
        let data: Vec<f32> = (0..side * side * 3).map(sample).collect();
        let inside = |x: usize| (side * 3 / 8..side * 5 / 8).contains(&x);
        let known: Vec<bool> = (0..side * side)
            .map(|i| !(inside(i / side) && inside(i % side)))
            .collect();
        // Only patches that do not touch the hole are allowed.
        let reach = |r: usize, c: usize| {
            let free = |x: usize| x + patch <= side * 3 / 8 || x >= side * 5 / 8;
            free(r) || free(c)
        };
        let allowed = (0..side * side)
            .map(|i| reach(i / side, i % side))
            .collect();
        let exemplar = Exemplar {
            data: data.clone().into(),
            shape: [side; 2],
            allowed: Some(allowed),
        };
        let index = Index::new(vec![exemplar], 3, [patch; 2]).unwrap();
        let pick = Pick {
            count: 5,
            separation: 4,
            ratio: 3.0,
        };
        // Compare the default method with the method of the paper.
        for (name, paper) in [("inwards", false), ("paper", true)] {
            let options = Options {
                patch: [patch; 2],
                pick: if paper { Pick::default() } else { pick },
                seed: 0,
                paper,
                shown: None,
                lattice: None,
            };
            for threads in [1, 2] {
                let id = BenchmarkId::new(format!("{name} {side}"), threads);
                group.bench_function(id, |b| {
                    b.iter(|| {
                        let (mut colours, mut known) = (data.clone(), known.clone());
                        let mut canvas = Canvas {
                            grid: Grid::new([side; 2], [false; 2]).unwrap(),
                            colours: &mut colours,
                            known: &mut known,
                            keep: None,
                            channels: 3,
                        };
                        let monitor = Monitor::default();
                        par::install(threads, || {
                            inpaint(&mut canvas, &index, &options, &monitor).unwrap()
                        })
                        .unwrap()
                    });
                });
            }
        }
    }
    group.finish();
}
