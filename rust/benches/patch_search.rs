//! Times the search for patches, with the patch sizes that the filling of holes uses.

use criterion::{BenchmarkId, Criterion};
use texrs::hash::Noise;
use texrs::par::{self, Monitor};
use texrs::patch_search::{Exemplar, Index, Pick, Query};

pub(crate) fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("patch_search");
    for (side, patch) in [(64usize, 8usize), (180, 24), (512, 32)] {
        let noise = Noise::new(1);
        let sample = |i: usize| {
            let (y, x) = (i / 3 / side, i / 3 % side);
            let wave = (y as f32 / 9.0).sin() + (x as f32 / 7.0).cos();
            60.0 * wave + 30.0 * noise.uniform([i as u32, 0, 0, 0]) as f32
        };
        let exemplar = Exemplar {
            data: (0..side * side * 3).map(sample).collect::<Vec<_>>().into(),
            shape: [side; 2],
            allowed: None,
        };
        let samples: Vec<f32> = (0..patch * patch * 3).map(|i| sample(i * 7)).collect();
        let weight: Vec<f32> = (0..patch * patch).map(|i| (i % 3 > 0).into()).collect();
        let index = Index::new(vec![exemplar], 3, [patch; 2]).unwrap();
        let query = Query {
            patch: &samples,
            weight: &weight,
            shape: [patch; 2],
        };
        // Also time five matches, because each further match needs another search of the cost maps.
        for (count, threads) in [(1, 1), (1, 2), (5, 1)] {
            let pick = Pick {
                count,
                separation: 4,
                ratio: 3.0,
            };
            let id = BenchmarkId::new(format!("{patch} in {side}, best {count}"), threads);
            group.bench_function(id, |b| {
                par::install(threads, || {
                    b.iter(|| index.best(&query, &pick, &Monitor::default()).unwrap());
                })
                .unwrap();
            });
        }
    }
    group.finish();
}
