use super::*;
use crate::engine::appearance::distance;
use crate::foundation::fixed::identity;
use crate::foundation::fixed::{ONE, nearest, sub};
use crate::foundation::grid::Grid;

fn exemplar(wrap: bool) -> Appearance<2> {
    let grid = Grid::new([32, 32], [wrap; 2]).unwrap();
    let noise = Noise::new(4);
    let colours: Vec<f32> = (0..grid.len())
        .map(|i| {
            let [y, x] = grid.point(i);
            let wave = (y as f64 * 0.6).sin() + (x as f64 * 0.45).cos();
            (wave + 0.2 * noise.uniform([i as u32, 0, 0, 0])) as f32
        })
        .collect();
    Appearance::new(&colours, grid, 1, 2).unwrap()
}

const OPTIONS: Options = Options {
    cell: 6,
    rounds: 4,
    candidates: 64,
    contrast: 1.0,
    continuation: 0.15,
    repetition: 0.3,
    seed: 3,
    margin: 0,
};

fn run(
    exemplar: &Appearance<2>,
    origin: [i32; 2],
    side: usize,
    options: &Options,
) -> Vec<Place<2>> {
    let region = Region::new(Grid::new([side; 2], [false; 2]).unwrap(), origin).unwrap();
    let frames = Frames::Constant(identity());
    blocks(
        exemplar,
        &region,
        frames,
        None,
        Constraints::NONE,
        options,
        &Monitor::default(),
    )
    .unwrap()
}

#[test]
fn pieces_are_coherent_and_inside() {
    let exemplar = exemplar(false);
    let places = run(&exemplar, [0; 2], 40, &OPTIONS);
    let mut together = 0;
    for y in 0..40 {
        for x in 0..39 {
            let [a, b] = [places[y * 40 + x], places[y * 40 + x + 1]];
            together += usize::from(sub(b, a) == [0, ONE]);
            assert!(exemplar.inside(nearest(a)).is_some());
        }
    }
    assert!(together > 40 * 39 * 7 / 10, "{together}");
}

#[test]
fn a_window_is_the_same_wherever_it_is_seen_from() {
    let exemplar = exemplar(true);
    // In each round, a result depends on cells up to two steps away.
    let pad = (OPTIONS.rounds + 2) * OPTIONS.cell * 2;
    let [a, b] = [0, 11].map(|extra| {
        let start = -(pad as i32) - extra;
        let side = 16 + 2 * pad + 2 * extra as usize;
        let places = run(&exemplar, [start; 2], side, &OPTIONS);
        let at = |y: usize, x: usize| (y + pad + extra as usize) * side + x + pad + extra as usize;
        (0..256)
            .map(|i| places[at(i / 16, i % 16)])
            .collect::<Vec<_>>()
    });
    assert_eq!(a, b);
}

#[test]
fn cells_that_do_not_count_are_not_missed() {
    let exemplar = exemplar(false);
    let pad = 2 * 5 + OPTIONS.rounds * (2 * 5 + 1);
    let side = 20 + 2 * pad;
    let margin = Options {
        margin: pad,
        ..OPTIONS
    };
    let [all, needed] = [OPTIONS, margin].map(|options| run(&exemplar, [-7; 2], side, &options));
    let same = |y: usize, x: usize| all[y * side + x] == needed[y * side + x];
    assert!((pad..pad + 20).all(|y| (pad..pad + 20).all(|x| same(y, x))));
    assert!(!(0..side).all(|x| same(0, x)));
}

#[test]
fn a_guide_is_followed() {
    let exemplar = exemplar(false);
    // The guide is the row of the exemplar: the left half of the output wants the first row, the right half the last.
    let rows: Vec<[i16; 4]> = (0..1024).map(|i| [(i / 32 * 60) as i16, 0, 0, 0]).collect();
    let wanted: Vec<[i16; 4]> = (0..1600)
        .map(|i| [if i % 40 < 20 { 0 } else { 1860 }, 0, 0, 0])
        .collect();
    let weight = vec![256; 1600];
    let guide = Guide::new(&rows, wanted.as_flattened(), &weight, 1024, 1600).unwrap();
    let region = Region::new(Grid::new([40; 2], [false; 2]).unwrap(), [0; 2]).unwrap();
    let frames = Frames::Constant(identity());
    let places = blocks(
        &exemplar,
        &region,
        frames,
        Some(&guide),
        Constraints::NONE,
        &OPTIONS,
        &Monitor::default(),
    )
    .unwrap();
    let mean = |side: usize| -> i32 {
        let all = (0..1600)
            .filter(|i| (i % 40 < 20) == (side == 0))
            .map(|i| places[i][0] / ONE);
        all.sum::<i32>() / 800
    };
    assert!(mean(0) < 12 && mean(1) > 20, "{} {}", mean(0), mean(1));
}

#[test]
fn choosing_makes_the_pieces_fit() {
    let exemplar = exemplar(false);
    let seam = |options: &Options| {
        let places = run(&exemplar, [0; 2], 60, options);
        let mut sum = 0i64;
        for y in 0..60 {
            for x in 0..59 {
                let next = add(places[y * 60 + x], [0, ONE]);
                let [a, b] = [next, places[y * 60 + x + 1]].map(|p| exemplar.clamped(nearest(p)));
                sum += i64::from(distance(exemplar.feature(a), exemplar.feature(b)));
            }
        }
        sum
    };
    let placed_anywhere = Options {
        candidates: 1,
        rounds: 1,
        ..OPTIONS
    };
    assert!(seam(&OPTIONS) * 3 < seam(&placed_anywhere) * 2);
}

#[test]
fn what_is_drawn_near_the_guide_is_found_with_few_candidates() {
    let exemplar = exemplar(false);
    let rows: Vec<[i16; 4]> = (0..1024).map(|i| [(i / 32 * 60) as i16, 0, 0, 0]).collect();
    // All points have the same weight, and want only a first value.
    let (wanted, weight) = (vec![900; 1600], [256]);
    let order: Vec<u32> = (0..1024).collect();
    let region = Region::new(Grid::new([40; 2], [false; 2]).unwrap(), [0; 2]).unwrap();
    let options = Options {
        candidates: 4,
        ..OPTIONS
    };
    let far = |order: &[u32]| -> i32 {
        let guide = Guide::new(&rows, &wanted, &weight, 1024, 1600).unwrap();
        let guide = guide.ordered(order).unwrap();
        let frames = Frames::Constant(identity());
        let places = blocks(
            &exemplar,
            &region,
            frames,
            Some(&guide),
            Constraints::NONE,
            &options,
            &Monitor::default(),
        )
        .unwrap();
        places.iter().map(|p| (p[0] / ONE - 15).abs()).sum::<i32>()
    };
    assert!(far(&order) * 3 < far(&[]) * 2);
}

#[test]
fn what_is_held_stays_and_is_gone_on_from() {
    let exemplar = exemplar(false);
    let region = Region::new(Grid::new([24; 2], [false; 2]).unwrap(), [0; 2]).unwrap();
    // All points except a square in the middle show a copy of the exemplar.
    let given: Vec<Place<2>> = (0..576)
        .map(|i| [(i / 24 + 4) * ONE, (i % 24 + 4) * ONE])
        .collect();
    let held: Vec<bool> = (0..576)
        .map(|i| !((8..16).contains(&(i / 24)) && (8..16).contains(&(i % 24))))
        .collect();
    let options = Options {
        continuation: 0.0,
        candidates: 512,
        ..OPTIONS
    };
    let places = blocks(
        &exemplar,
        &region,
        Frames::Constant(identity()),
        None,
        Constraints {
            points: &held,
            places: &given,
        },
        &options,
        &Monitor::default(),
    )
    .unwrap();
    assert!((0..576).all(|p| !held[p] || places[p] == given[p]));
    let unlike = |p: usize| {
        let [a, b] = [places[p], given[p]].map(|p| exemplar.clamped(nearest(p)));
        distance(exemplar.feature(a), exemplar.feature(b)) > crate::engine::appearance::UNIT
    };
    assert!((0..576).filter(|&p| unlike(p)).count() < 32);
}
