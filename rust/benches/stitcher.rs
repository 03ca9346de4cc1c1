//! Times the stitcher on images and volumes, with and without a frame field.

use criterion::{BenchmarkId, Criterion, Throughput};
use texrs::fixed::{Frame, Frames, ONE, identity};
use texrs::grid::{Grid, Region};
use texrs::par::{self, Monitor};
use texrs::stitcher::{Adjacency, Elements, Given, Options, Source, Weights, stitch};

const OPTIONS: Options = Options {
    patch: 32.0,
    overlap: 0.4,
    candidates: 4,
    bend: false,
    weights: Weights {
        colour: 0.05,
        contact: 1.0,
        jump: 1.0,
        depth: 0.15,
        joint: 0.5,
        ..Weights::NONE
    },
    repetition: 0.15,
    continuation: 4.0,
    balance: 4.0,
    recover: 0.5,
    heal: true,
    lattice: None,
    seed: 1,
};

/// Returns a source that shows balls on a lattice, each with its own shade.
fn balls<const D: usize>(side: usize) -> Source<D> {
    let grid = Grid::new([side; D], [false; D]).unwrap();
    let (mut colours, mut labels, mut depth) = (Vec::new(), Vec::new(), Vec::new());
    for point in grid.points() {
        let cell = point
            .iter()
            .fold(0, |at, x| at * side.div_ceil(12) + x / 12);
        let far: f32 = point.iter().map(|&x| ((x % 12) as f32 - 5.5).powi(2)).sum();
        let deep = (5.0 - far.sqrt()).max(0.0);
        labels.push(if deep > 0.0 { cell as u32 + 1 } else { 0 });
        colours.push(if deep > 0.0 {
            0.3 + (cell % 7) as f32 * 0.1
        } else {
            0.0
        });
        depth.push(deep);
    }
    let elements = Elements {
        labels: &labels,
        depth: &depth,
    };
    let no_classes = Adjacency {
        classes: &[],
        costs: &[],
    };
    Source::new(&colours, grid, 1, elements, no_classes).unwrap()
}

fn sides<const D: usize>(c: &mut Criterion, side: usize) {
    let mut group = c.benchmark_group("stitcher");
    group.sample_size(10);
    let source = balls::<D>(64);
    let region = Region::new(Grid::new([side; D], [false; D]).unwrap(), [0; D]).unwrap();
    // The field rotates the texture by an angle that grows along the first axis.
    let turned: Vec<Frame<D>> = (0..region.grid.len())
        .map(|p| {
            let angle = region.grid.point(p)[0] as f64 / side as f64;
            let [c, s] = [angle.cos(), angle.sin()].map(|x| (x * f64::from(ONE)) as i16);
            let mut frame = identity::<D>();
            (frame[0][0], frame[0][1], frame[1][0], frame[1][1]) = (c, -s, s, c);
            frame
        })
        .collect();
    group.throughput(Throughput::Elements(region.grid.len() as u64));
    for (name, frames) in [
        ("flat", Frames::Constant(identity())),
        ("field", Frames::Dense(&turned)),
    ] {
        for threads in [1, 2] {
            let id = BenchmarkId::new(format!("{name}, {side}^{D}"), threads);
            group.bench_function(id, |b| {
                b.iter(|| {
                    par::install(threads, || {
                        let nothing = Given::NOTHING;
                        let monitor = Monitor::default();
                        stitch(&source, &region, frames, None, nothing, &OPTIONS, &monitor).unwrap()
                    })
                });
            });
        }
    }
    group.finish();
}

pub(crate) fn bench(c: &mut Criterion) {
    sides::<2>(c, 256);
    sides::<3>(c, 64);
}
