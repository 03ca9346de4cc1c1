//! Tests of the stitcher against slow reference implementations, and of properties of its results.

use proptest::prelude::*;

use super::canvas::{Canvas, FREE};
use super::chart::Chart;
use super::energy::Energy;
use super::pair::Capacities;
use super::runs::runs;
use super::search::{Charges, Index};
use super::source::CHANNELS;
use super::view::Tie;
use super::*;
use crate::foundation::fixed::identity;
use crate::kernels::seam::maxflow::Solver;

const NO_ELEMENTS: Elements<'static> = Elements {
    labels: &[],
    depth: &[],
};
const NO_CLASSES: Adjacency<'static> = Adjacency {
    classes: &[],
    costs: &[],
};
const OPTIONS: Options = Options {
    patch: 8.0,
    overlap: 0.4,
    candidates: 3,
    bend: false,
    weights: Weights {
        colour: 0.1,
        contact: 1.0,
        jump: 1.0,
        depth: 0.15,
        joint: 0.5,
        presence: 0.0,
        surprise: 0.0,
        distortion: 0.03,
        guide: 0.5,
    },
    repetition: 0.1,
    continuation: 4.0,
    balance: 1.0,
    recover: 0.5,
    heal: true,
    seed: 1,
    lattice: None,
};

fn noise(seed: u64, n: usize) -> Vec<f32> {
    let noise = Noise::new(seed);
    (0..n)
        .map(|i| noise.uniform([i as u32, 0, 0, 0]) as f32)
        .collect()
}

fn source(shape: [usize; 2], wrap: [bool; 2]) -> Source<2> {
    let grid = Grid::new(shape, wrap).unwrap();
    let colours = noise(7, grid.len() * 2);
    Source::new(&colours, grid, 2, NO_ELEMENTS, NO_CLASSES).unwrap()
}

fn region(shape: [usize; 2], wrap: [bool; 2]) -> Region<2> {
    Region::new(Grid::new(shape, wrap).unwrap(), [0; 2]).unwrap()
}

#[test]
fn the_best_place_is_that_of_a_slow_search() {
    for wrap in [[false, false], [true, false], [true, true]] {
        let source = source([13, 17], wrap);
        let grid = Grid::new([20, 20], [false; 2]).unwrap();
        let mut canvas = Canvas::<2>::new(grid, false).unwrap();
        for p in 0..grid.len() {
            let [row, column] = grid.point(p);
            if (8..11).contains(&row) && (7..14).contains(&column) {
                canvas.patches[p] = 0;
                canvas.places[p] = [(row as i32 * 5 % 13) * ONE, (column as i32 * 3 % 17) * ONE];
            }
        }
        let turned = [[0, ONE as i16], [-(ONE as i16), 0]];
        for frame in [identity(), turned] {
            let frames = Frames::Constant(frame);
            let chart = Chart::new(&canvas, frames, [10, 10], 7.0, false).unwrap();
            let free = Charges {
                repetition: 0.0,
                continuation: 0.0,
            };
            let index = Index::new(&source, None, free);
            let covered = |&p: &u32| canvas.covered(p);
            let known: Vec<bool> = chart.window.points.iter().map(covered).collect();
            let found = index.best(
                &source,
                &canvas,
                &chart,
                &known,
                [0; 2],
                None,
                1,
                &Noise::new(0),
            );
            let cost = |place: Place<2>| -> Option<f32> {
                let mut sum = 0.0;
                for (i, &p) in chart.window.points.iter().enumerate() {
                    let there = std::array::from_fn(|a| chart.steps[i][a] + place[a]);
                    if chart.mask[i] && !inside(source.grid(), there) {
                        return None;
                    }
                    if chart.mask[i] && canvas.covered(p) {
                        let (a, b) = (
                            source.look(canvas.places[p as usize]).colour,
                            source.look(there).colour,
                        );
                        sum += (0..CHANNELS).map(|c| (a[c] - b[c]).powi(2)).sum::<f32>();
                    }
                }
                Some(sum)
            };
            let best = source
                .grid()
                .points()
                .filter_map(|p| cost(p.map(|x| x as i32 * ONE)))
                .fold(f32::INFINITY, f32::min);
            let reached = cost(found[0]).unwrap();
            assert!(
                (reached - best).abs() <= 1e-3 * (1.0 + best),
                "{reached} {best}"
            );
        }
    }
}

#[test]
fn a_large_exemplar_is_searched_as_exactly() {
    for wrap in [[false, false], [false, true], [true, true]] {
        let grid = Grid::new([1024, 640], wrap).unwrap();
        // The noise is smooth over some samples, as images are.
        let [rows, columns] = grid.shape().map(|n| n / 4);
        let coarse = noise(3, rows * columns);
        let colours: Vec<f32> = (grid.points())
            .map(|[row, column]| {
                let at = |r: usize, c: usize| coarse[r % rows * columns + c % columns];
                let (r, y) = (row / 4, (row % 4) as f32 / 4.0);
                let (c, x) = (column / 4, (column % 4) as f32 / 4.0);
                let line = |r: usize| at(r, c) * (1.0 - x) + at(r, c + 1) * x;
                line(r) * (1.0 - y) + line(r + 1) * y
            })
            .collect();
        let source = Source::new(&colours, grid, 1, NO_ELEMENTS, NO_CLASSES).unwrap();
        let mut canvas = Canvas::<2>::new(Grid::new([40; 2], [false; 2]).unwrap(), false).unwrap();
        for p in 0..canvas.grid.len() {
            let [row, column] = canvas.grid.point(p);
            if row < 20 {
                canvas.patches[p] = 0;
                canvas.places[p] = [(701 + row as i32) * ONE, (333 + column as i32) * ONE];
            }
        }
        let free = Charges {
            repetition: 0.0,
            continuation: 0.0,
        };
        let index = Index::new(&source, None, free);
        let frames = Frames::Constant(identity());
        let chart = Chart::new(&canvas, frames, [20, 20], 31.0, false).unwrap();
        let covered = |&p: &u32| canvas.covered(p);
        let known: Vec<bool> = chart.window.points.iter().map(covered).collect();
        let found = index.best(
            &source,
            &canvas,
            &chart,
            &known,
            [0; 2],
            None,
            3,
            &Noise::new(0),
        );
        assert_eq!(found[0], [721 * ONE, 353 * ONE]);
        assert_eq!(found.len(), 3);
    }
}

proptest! {
    #[test]
    fn the_least_cut_is_that_of_all_labellings(seed in 0u64..500) {
        let grid = Grid::new([3, 3], [false; 2]).unwrap();
        let ties: Vec<Tie> = noise(seed, 9)
            .iter()
            .map(|x| match (x * 6.0) as u32 {
                0 => Tie::Old,
                1 => Tie::New,
                _ => Tie::Either,
            })
            .collect();
        let costs = noise(seed + 1000, 18 * 2);
        let mut pairs = [Vec::new(), Vec::new()];
        for (axis, pairs) in pairs.iter_mut().enumerate() {
            for (p, point) in grid.points().enumerate() {
                let at = (axis * 9 + p) * 2;
                let there = point[axis] < 2;
                let kept = if seed % 2 == 0 { 0.0 } else { costs[at].min(costs[at + 1]) };
                // The two indices state whether the first and the second point take the patch.
                pairs.push(if there { [[kept, costs[at]], [costs[at + 1], 0.0]] } else { [[0.0; 2]; 2] });
            }
        }
        let value = |take: &[bool]| -> f32 {
            let mut sum = 0.0;
            for (axis, pairs) in pairs.iter().enumerate() {
                crate::kernels::seam::links(&grid, axis, |p, q| {
                    sum += pairs[p][usize::from(take[p])][usize::from(take[q])];
                });
            }
            sum
        };
        let fits = |take: &[bool]| {
            ties.iter().zip(take).all(|(tie, &t)| match tie {
                Tie::Old => !t,
                Tie::New => t,
                _ => true,
            })
        };
        let best = (0..512u32)
            .map(|code| (0..9).map(|i| code >> i & 1 == 1).collect::<Vec<bool>>())
            .filter(|take| fits(take))
            .map(|take| value(&take))
            .fold(f32::INFINITY, f32::min);
        let solve = |side| {
            let mut energy = Energy::new(grid, side).unwrap();
            runs(&grid, |run| {
                let plane = |a: usize, b: usize| -> Vec<f32> {
                    (run.p..run.p + run.n).map(|p| pairs[run.axis][p][a][b]).collect()
                };
                energy.add_seams(&ties, &run, &plane(0, 0));
                let mut costs = Capacities::default();
                costs.set(&plane(0, 1), &plane(1, 0), &plane(0, 0));
                energy.add_pairs(&ties, &run, &costs);
            });
            let take = energy.minimise(&ties, &mut Solver::default(), &Monitor::default()).unwrap();
            value(&take)
        };
        prop_assert!((solve(1) - best).abs() < 1e-3);
        prop_assert!(solve(2) >= best - 1e-3);
    }

    #[test]
    fn every_point_shows_a_sample(
        rows in 1usize..40,
        columns in 1usize..40,
        wrap in any::<[bool; 2]>(),
        closed in any::<[bool; 2]>(),
        turn in 0.0f64..6.0,
        seed in 0u64..1000,
    ) {
        let source = source([16, 20], closed);
        let region = region([rows, columns], wrap);
        let [c, s] = [turn.cos(), turn.sin()].map(|x| (x * f64::from(ONE)).round() as i16);
        let dense: Vec<Frame<2>> = (0..region.grid.len())
            .map(|p| if p % 2 == 0 { [[c, -s], [s, c]] } else { identity() })
            .collect();
        for (frames, bend) in [
            (Frames::Constant([[c, -s], [s, c]]), false),
            (Frames::Dense(&dense), false),
            (Frames::Dense(&dense), true),
        ] {
            let options = Options { bend, seed, ..OPTIONS };
            let made = stitch(&source, &region, frames, None, Given::NOTHING, &options, &Monitor::default()).unwrap();
            prop_assert_eq!(made.places.len(), region.grid.len());
            prop_assert!(made.patches.iter().all(|&p| (p as usize) < made.frames.len()));
            let shape = source.grid().shape();
            for &place in &made.places {
                let near = crate::foundation::fixed::nearest(place);
                prop_assert!((0..2).all(|a| (0..shape[a] as i32).contains(&near[a])));
            }
        }
    }
}

#[test]
fn what_no_chart_holds_is_a_patch_of_its_own() {
    let region = region([1, 1], [false, true]);
    let options = Options {
        patch: 5.0,
        bend: true,
        ..OPTIONS
    };
    let made = stitch(
        &source([24, 6], [true; 2]),
        &region,
        Frames::Dense(&[identity()]),
        None,
        Given::NOTHING,
        &options,
        &Monitor::default(),
    )
    .unwrap();
    assert_eq!((made.patches, made.frames.len()), (vec![0], 1));
}

#[test]
fn a_bent_chart_of_one_frame_is_the_rigid_one() {
    let grid = Grid::new([40, 40], [false; 2]).unwrap();
    let canvas = Canvas::<2>::new(grid, true).unwrap();
    let frame = [[3000, -1200], [1200, 3000]];
    let dense = vec![frame; grid.len()];
    let bent = Chart::new(&canvas, Frames::Dense(&dense), [20, 20], 12.0, true).unwrap();
    assert!(!bent.rigid);
    for (i, point) in bent.window.grid.points().enumerate() {
        let at = bent.window.at(point);
        let step = apply(&frame, [at[0] - 20, at[1] - 20]);
        assert!((0..2).all(|a| (bent.steps[i][a] - step[a]).abs() <= 8));
        assert!(bent.distortion[i] < 0.01);
    }
}

#[test]
fn what_is_given_stays_unless_it_is_loose() {
    let source = source([16, 16], [false; 2]);
    let region = region([24, 24], [false, true]);
    let points: Vec<bool> = (0..24 * 24).map(|p| p % 7 == 0).collect();
    let places = vec![[3 * ONE, 5 * ONE]; 24 * 24];
    let loose: Vec<bool> = (0..24 * 24).map(|p| p % 3 == 0).collect();
    let given = Given {
        points: &points,
        places: &places,
        loose: &loose,
    };
    let frames = Frames::Constant(identity());
    let made = stitch(
        &source,
        &region,
        frames,
        None,
        given,
        &OPTIONS,
        &Monitor::default(),
    )
    .unwrap();
    for p in 0..points.len() {
        let (shown, held) = (made.patches[p], points[p] && !loose[p]);
        assert_eq!(held, shown == canvas::HELD);
        assert!(!(held || shown == canvas::LOOSE) || made.places[p] == [3 * ONE, 5 * ONE]);
        assert!(shown != canvas::LOOSE || (points[p] && loose[p]));
        assert_ne!(shown, FREE);
    }
    // Patches take many loose points, because their samples do not fit the samples around them.
    let kept = made.patches.iter().filter(|&&p| p == canvas::LOOSE).count();
    assert!(kept < (0..24 * 24).filter(|p| p % 21 == 0).count());
}

#[test]
fn bad_arrays_and_options_are_refused() {
    let grid = Grid::new([8, 8], [false; 2]).unwrap();
    let colours = noise(1, 64);
    let new = |colours: &[f32],
               channels,
               labels: &[u32],
               depth: &[f32],
               classes: &[u8],
               costs: &[f32]| {
        let elements = Elements { labels, depth };
        Source::new(
            colours,
            grid,
            channels,
            elements,
            Adjacency { classes, costs },
        )
    };
    assert!(new(&colours, 1, &[], &[], &[], &[]).is_ok());
    assert!(new(&colours, 0, &[], &[], &[], &[]).is_err());
    assert!(new(&colours, 5, &[], &[], &[], &[]).is_err());
    assert!(new(&colours[1..], 1, &[], &[], &[], &[]).is_err());
    assert!(new(&[f32::NAN; 64], 1, &[], &[], &[], &[]).is_err());
    assert!(new(&colours, 1, &[0; 3], &[], &[], &[]).is_err());
    assert!(new(&colours, 1, &[u32::MAX; 64], &[], &[], &[]).is_err());
    assert!(new(&colours, 1, &[], &[f32::INFINITY; 64], &[], &[]).is_err());
    assert!(new(&colours, 1, &[], &[], &[2; 64], &[0.0; 4]).is_err());
    assert!(new(&colours, 1, &[], &[], &[1; 64], &[0.0; 3]).is_err());
    assert!(new(&colours, 1, &[], &[], &[1; 64], &[0.0, 1.0, -1.0, 0.0]).is_err());
    let source = source([16, 16], [false; 2]);
    let region = region([9, 9], [false; 2]);
    let frames = Frames::Constant(identity());
    for options in [
        Options {
            patch: f32::NAN,
            ..OPTIONS
        },
        Options {
            patch: 2.0,
            ..OPTIONS
        },
        Options {
            overlap: 0.9,
            ..OPTIONS
        },
        Options {
            candidates: 0,
            ..OPTIONS
        },
        Options {
            repetition: -1.0,
            ..OPTIONS
        },
        Options {
            balance: f32::INFINITY,
            ..OPTIONS
        },
    ] {
        assert!(
            stitch(
                &source,
                &region,
                frames,
                None,
                Given::NOTHING,
                &options,
                &Monitor::default()
            )
            .is_err()
        );
    }
    let every = vec![true; region.grid.len()];
    for (points, places) in [(&[true][..], &[[0; 2]][..]), (&every, &[])] {
        let given = Given {
            points,
            places,
            loose: &[],
        };
        assert!(
            stitch(
                &source,
                &region,
                frames,
                None,
                given,
                &OPTIONS,
                &Monitor::default()
            )
            .is_err()
        );
    }
    let stopped = Monitor::default();
    stopped.cancel();
    assert!(
        stitch(
            &source,
            &region,
            frames,
            None,
            Given::NOTHING,
            &OPTIONS,
            &stopped
        )
        .is_err()
    );
}

/// Returns the cost of a seam, pair by pair.
fn slow_pair(w: &Weights, source: &Source<2>, l: usize, r: usize, apart: f32) -> f32 {
    let look = |i: usize| source.look(source.grid().point(i).map(|x| x as i32 * ONE));
    let (l, r) = (look(l), look(r));
    let mut cost = 2e-3 + w.colour * apart / 8.0;
    cost += w.surprise * source.surprise(l.class, r.class);
    let inside = (l.depth > 0.0, r.depth > 0.0);
    if inside.0 && inside.1 {
        cost += w.contact;
    }
    if l.beside && inside.1 || inside.0 && r.beside {
        cost += w.joint;
    }
    cost += w.depth * (l.depth.min(6.0) + r.depth.min(6.0)) / 6.0;
    cost + w.jump * ((l.depth - r.depth).abs() - 1.0).clamp(0.0, 4.0) / 2.0
}

#[test]
fn seams_are_those_of_a_slow_judge() {
    let grid = Grid::new([9, 21], [false; 2]).unwrap();
    let colours = noise(3, grid.len());
    let depth: Vec<f32> = noise(4, grid.len())
        .iter()
        .map(|x| (x * 12.0 - 4.0).max(0.0))
        .collect();
    let labels: Vec<u32> = depth.iter().map(|&d| u32::from(d > 0.0)).collect();
    let classes: Vec<u8> = noise(5, grid.len())
        .iter()
        .map(|x| (x * 3.0) as u8)
        .collect();
    let elements = Elements {
        labels: &labels,
        depth: &depth,
    };
    let adjacency = Adjacency {
        classes: &classes,
        costs: &noise(6, 9),
    };
    let source = Source::new(&colours, grid, 1, elements, adjacency).unwrap();
    let weights = Weights {
        surprise: 0.7,
        ..OPTIONS.weights
    };
    let order: Vec<usize> = (0..grid.len()).map(|p| p * 5 % grid.len()).collect();
    let places: Vec<Place<2>> = order
        .iter()
        .map(|&i| grid.point(i).map(|x| x as i32 * ONE))
        .collect();
    let patches: Vec<u32> = (0..grid.len() as u32).map(|p| p % 3).collect();
    let seams = judge(&source, &grid, &places, &patches, weights).unwrap();
    for axis in 0..2 {
        crate::kernels::seam::links(&grid, axis, |p, q| {
            let colour = |i: usize| source.look(places[i]).colour[0];
            let apart = (colour(p) - colour(q)).powi(2);
            let slow = if patches[p] == patches[q] {
                0.0
            } else {
                slow_pair(&weights, &source, order[p], order[q], 2.0 * apart)
            };
            assert!(
                (seams[p][axis] - slow).abs() < 1e-4,
                "{} {slow}",
                seams[p][axis]
            );
        });
    }
    assert!(judge(&source, &grid, &places[1..], &patches, weights).is_err());
}

#[test]
fn a_part_that_is_covered_stays_as_it_is_at_its_ends() {
    let source = source([24, 24], [false; 2]);
    let prepared = Prepared::new(&source);
    let region = region([14, 17], [false; 2]);
    let n = region.grid.len();
    let first = Patch {
        centre: [0, 0],
        place: [2 * ONE, 3 * ONE],
        frame: identity(),
        rigid: true,
        side: 24.0,
    };
    let shown = Shown {
        places: region
            .grid
            .points()
            .map(|p| [(p[0] as i32 + 2) * ONE, (p[1] as i32 + 3) * ONE])
            .collect(),
        patches: vec![0; n],
        seams: vec![[0.0; 2]; n],
        distortion: Vec::new(),
        table: vec![first],
    };
    let cover_with = |shown: Shown<2>| {
        let frames = Frames::Constant(identity());
        cover(
            &source,
            &prepared,
            &region,
            frames,
            shown,
            &OPTIONS,
            &Monitor::default(),
        )
    };
    let made = cover_with(shown.clone()).unwrap();
    for (p, point) in region.grid.points().enumerate() {
        if point[0] == 0 || point[1] == 0 || point[0] == 13 || point[1] == 16 {
            assert_eq!(made.places[p], shown.places[p]);
        }
        let patch = &made.table[made.patches[p] as usize];
        let looks =
            std::array::from_fn(|a| patch.place[a] + (point[a] as i32 - patch.centre[a]) * ONE);
        assert_eq!(made.places[p], looks);
    }
    assert_eq!(cover_with(shown.clone()).unwrap().places, made.places);
    let short = Shown {
        patches: vec![0; n - 1],
        ..shown.clone()
    };
    assert!(cover_with(short).is_err());
    assert!(
        cover_with(Shown {
            patches: vec![1; n],
            ..shown
        })
        .is_err()
    );
}
