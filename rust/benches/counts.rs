//! Runs each of the hottest kernels once on little data. The tool `.ci/counts` counts their
//! instructions.
//!
//! `counts NAME` runs one kernel. Only instructions within [`measured`] are counted, on one thread.

use texrs::appearance::Appearance;
use texrs::coherence::{self, FEW, Kinds};
use texrs::fixed::{Frames, ONE, Place, identity};
use texrs::gather::{self, Interpolation, gather};
use texrs::grid::{Grid, Region};
use texrs::hash::Noise;
use texrs::inpaint::{self, Canvas};
use texrs::mean_shift;
use texrs::par::{self, Monitor};
use texrs::patch_search::{Exemplar, Index, Pick, Query};
use texrs::poisson::{self, Domain, Edge, Problem};
use texrs::regions;
use texrs::seam::stitch::{Overlap, Stitcher};
use texrs::stitcher::{self, Adjacency, Elements, Given, Source, Weights};

/// Returns an image with three channels that shows waves with noise.
fn image(side: usize, layer: u32) -> Vec<f32> {
    let noise = Noise::new(1);
    (0..side * side * 3)
        .map(|i| {
            let (y, x) = ((i / 3 / side) as f32, (i / 3 % side) as f32);
            let wave = (y / 9.0).sin() + (x / 7.0 + layer as f32).cos();
            0.5 + 0.2 * wave + 0.1 * noise.uniform([i as u32, layer, 0, 0]) as f32
        })
        .collect()
}

/// Runs the work whose instructions are counted.
#[inline(never)]
fn measured<R>(work: impl FnOnce() -> R) -> R {
    std::hint::black_box(work())
}

fn gathering() {
    let side = 192;
    let (data, grid) = (image(side, 0), Grid::new([side; 2], [true; 2]).unwrap());
    let exemplar = gather::Exemplar::new(&data, grid, 3).unwrap();
    let at: Vec<[f32; 2]> = (0..side * side)
        .map(|i| [(i / side) as f32 * 0.9, (i % side) as f32 * 0.9])
        .collect();
    let mut out = vec![0.0f32; side * side * 3];
    let how = Interpolation::Cubic;
    measured(|| gather(&[exemplar], &[], &at, how, &mut out, &Monitor::default()).unwrap());
}

fn index(side: usize, patch: usize, allowed: Option<Vec<bool>>) -> Index {
    let exemplar = Exemplar {
        data: image(side, 0).into(),
        shape: [side; 2],
        allowed,
    };
    Index::new(vec![exemplar], 3, [patch; 2]).unwrap()
}

fn patch_search() {
    let (side, patch) = (180, 24);
    let index = index(side, patch, None);
    let samples = &image(side, 1)[..patch * patch * 3];
    let weight: Vec<f32> = (0..patch * patch).map(|i| (i % 3 > 0).into()).collect();
    let query = Query {
        patch: samples,
        weight: &weight,
        shape: [patch; 2],
    };
    measured(|| {
        index
            .best(&query, &Pick::default(), &Monitor::default())
            .unwrap()
    });
}

fn completion() {
    let (side, patch) = (96, 16);
    let inside = |x: usize| (side * 3 / 8..side * 5 / 8).contains(&x);
    let mut known: Vec<bool> = (0..side * side)
        .map(|i| !(inside(i / side) && inside(i % side)))
        .collect();
    let free = |x: usize| x + patch <= side * 3 / 8 || x >= side * 5 / 8;
    let allowed = (0..side * side).map(|i| free(i / side) || free(i % side));
    let (index, mut colours) = (index(side, patch, Some(allowed.collect())), image(side, 0));
    let options = inpaint::Options {
        patch: [patch; 2],
        pick: Pick::default(),
        seed: 0,
        paper: false,
        shown: None,
        lattice: None,
    };
    let mut canvas = Canvas {
        grid: Grid::new([side; 2], [false; 2]).unwrap(),
        colours: &mut colours,
        known: &mut known,
        keep: None,
        channels: 3,
    };
    measured(|| inpaint::inpaint(&mut canvas, &index, &options, &Monitor::default()).unwrap());
}

fn seam() {
    let side = 128;
    let inset = |margin: usize| -> Vec<bool> {
        let nearest = |x: usize| x.min(side - 1 - x);
        (0..side * side)
            .map(|p| nearest(p / side).min(nearest(p % side)) >= margin)
            .collect()
    };
    let (a, b, all, patch, core) = (
        image(side, 0),
        image(side, 1),
        inset(0),
        inset(1),
        inset(side / 3),
    );
    let grid = Grid::new([side; 2], [false; 2]).unwrap();
    let overlap = Overlap {
        core_b: Some(&core),
        ..Overlap::new(grid, 3, &a, &b, &all, &patch)
    };
    let mut stitcher = Stitcher::default();
    measured(|| stitcher.cut(&overlap, &Monitor::default()).unwrap());
}

fn poisson() {
    let side = 192;
    let data = [0, 1, 2].map(|layer| image(side, layer));
    let problem = Problem {
        image: &data[0],
        gradients: Some([&data[1], &data[2]]),
        domain: Domain {
            shape: [side, side, 3],
            edges: [Edge::Fixed; 2],
            screening: 0.01,
            mask: None,
        },
    };
    measured(|| poisson::solve(&problem, &Monitor::default()).unwrap());
}

fn mean_shifting() {
    let side = 64;
    let data = image(side, 0);
    let options = mean_shift::Options {
        radius: 5,
        range: 0.2,
        max_iterations: 10,
        tolerance: 0.01,
        wrap: [false; 2],
    };
    measured(|| mean_shift::filter(&data, [side, side, 3], &options, &Monitor::default()).unwrap());
}

fn merging() {
    let side = 128;
    let data = image(side, 0);
    let options = regions::Options {
        scale: 0.2,
        blur: 0.4,
        least: 24,
        wrap: [false; 2],
    };
    measured(|| {
        regions::felzenszwalb(&data, [side, side, 3], &options, &Monitor::default()).unwrap()
    });
}

fn stitching() {
    let side = 96;
    let grid = Grid::new([side; 2], [false; 2]).unwrap();
    let near = |p: [usize; 2]| p.map(|x| (x % 12) as f32 - 5.5);
    // The elements are discs on a lattice of 12 pixels.
    let depth: Vec<f32> = grid
        .points()
        .map(|p| (5.0 - near(p)[0].hypot(near(p)[1])).max(0.0))
        .collect();
    let labels: Vec<u32> = grid
        .points()
        .zip(&depth)
        .map(|(p, &deep)| u32::from(deep > 0.0) * (p[0] / 12 * 8 + p[1] / 12 + 1) as u32)
        .collect();
    let elements = Elements {
        labels: &labels,
        depth: &depth,
    };
    let classes = Adjacency {
        classes: &[],
        costs: &[],
    };
    let source = Source::new(&image(side, 0), grid, 3, elements, classes).unwrap();
    let region = Region::new(grid, [0; 2]).unwrap();
    // Enable healing, and all costs that depend on elements.
    let options = stitcher::Options {
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
        seed: 1,
    };
    let (frames, given) = (Frames::Constant(identity()), Given::NOTHING);
    let monitor = Monitor::default();
    measured(|| {
        stitcher::stitch(&source, &region, frames, None, given, &options, &monitor).unwrap()
    });
}

fn correction() {
    let side = 64;
    let grid = Grid::new([side; 2], [false; 2]).unwrap();
    let appearance = Appearance::new(&image(side, 0), grid, 3, 2).unwrap();
    let region = Region::new(grid, [0; 2]).unwrap();
    let monitor = Monitor::default();
    let sets = coherence::similar(&appearance, 3, 7, FEW, &monitor).unwrap();
    let mut places: Vec<Place<2>> = vec![[side as i32 / 2 * ONE; 2]; grid.len()];
    // Start from coordinates with strong noise, so that the pass has work to do.
    let far = (side as i32 / 2 * ONE) as u32;
    coherence::jitter(&mut places, &region, &[], far, 1, 0).unwrap();
    let options = coherence::Options {
        passes: 1,
        numbers: FEW,
        compensated: false,
    };
    let (frames, kinds) = (Frames::Constant(identity()), Kinds::default());
    measured(|| {
        let places = &mut places;
        coherence::correct(
            &appearance,
            &sets,
            &region,
            frames,
            &[],
            kinds,
            places,
            &options,
            &monitor,
        )
        .unwrap()
    });
}

fn main() {
    let all: [(&str, fn()); 9] = [
        ("coherence", correction),
        ("inpaint", completion),
        ("gather", gathering),
        ("mean_shift", mean_shifting),
        ("patch_search", patch_search),
        ("poisson", poisson),
        ("regions", merging),
        ("seam", seam),
        ("stitcher", stitching),
    ];
    let wanted = std::env::args().nth(1).unwrap_or_default();
    match all.iter().find(|(name, _)| *name == wanted) {
        Some((_, work)) => par::install(1, work).unwrap(),
        None => all.iter().for_each(|(name, _)| println!("{name}")),
    }
}
