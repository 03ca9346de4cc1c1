//! Times the Poisson solver on rectangles with every boundary condition, and on a disc given by a
//! mask.

use criterion::{BenchmarkId, Criterion};
use texrs::par::{self, Monitor};
use texrs::poisson::{Domain, Edge, Problem, solve};

pub(crate) fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("poisson");
    group.sample_size(10);
    for side in [256usize, 1024] {
        let samples = |step: usize| -> Vec<f32> {
            (0..side * side * 3)
                .map(|i| ((i * step) % 251) as f32)
                .collect()
        };
        let data = [samples(7), samples(13), samples(29)];
        let centre = side as f32 / 2.0;
        let disc: Vec<bool> = (0..side * side)
            .map(|i| ((i / side) as f32 - centre).hypot((i % side) as f32 - centre) < 0.8 * centre)
            .collect();
        // The first three problems are solved directly, and the disc by multigrid.
        for (name, edge, mask) in [
            ("fixed", Edge::Fixed, None),
            ("wrap", Edge::Wrap, None),
            ("free", Edge::Free, None),
            ("disc", Edge::Free, Some(&disc[..])),
        ] {
            let problem = Problem {
                image: &data[0],
                gradients: Some([&data[1], &data[2]]),
                domain: Domain {
                    shape: [side, side, 3],
                    edges: [edge; 2],
                    screening: 0.01,
                    mask,
                },
            };
            for threads in [1, 2] {
                let id = BenchmarkId::new(format!("{name} {side}"), threads);
                group.bench_function(id, |b| {
                    par::install(threads, || {
                        b.iter(|| solve(&problem, &Monitor::default()).unwrap());
                    })
                    .unwrap();
                });
            }
        }
    }
    group.finish();
}
