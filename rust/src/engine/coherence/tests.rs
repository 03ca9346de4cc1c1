use super::*;
use crate::foundation::fixed::{Frames, ONE, identity, nearest};
use crate::foundation::grid::Grid;
use crate::foundation::par::Monitor;

fn exemplar<const D: usize>(side: usize, wrap: bool) -> Appearance<D> {
    let grid = Grid::new([side; D], [wrap; D]).unwrap();
    let noise = Noise::new(4);
    let colours: Vec<f32> = (0..grid.len())
        .map(|i| {
            let wave: f64 = grid.point(i).iter().map(|&x| (x as f64 * 0.6).sin()).sum();
            (wave + 0.2 * noise.uniform([i as u32, 0, 0, 0])) as f32
        })
        .collect();
    Appearance::new(&colours, grid, 1, 2).unwrap()
}

fn region<const D: usize>(side: usize, wrap: bool) -> Region<D> {
    Region::new(Grid::new([side; D], [wrap; D]).unwrap(), [-3; D]).unwrap()
}

const OPTIONS: Options = Options {
    passes: 2,
    numbers: FEW,
    compensated: false,
};

/// Computes the sets by definition: compares each sample with every other one.
fn brute<const D: usize>(appearance: &Appearance<D>, k: usize, n: i32) -> Vec<u32> {
    let grid = appearance.grid();
    let point = |i: usize| grid.point(i).map(|x| x as i32);
    let mut sets = Vec::new();
    for i in 0..grid.len() {
        let mut set = vec![i; k];
        if appearance.inside(point(i)).is_some() {
            for j in 1..k {
                let far = |a: [i32; D], b: [i32; D]| {
                    (0..D).any(|axis| {
                        let gap = (a[axis] - b[axis]).abs();
                        let around = grid.shape()[axis] as i32 - gap;
                        (if grid.wrap()[axis] {
                            gap.min(around)
                        } else {
                            gap
                        }) > n / 2
                    })
                };
                set[j] = (0..grid.len())
                    .filter(|&o| appearance.inside(point(o)).is_some())
                    .filter(|&o| set[..j].iter().all(|&s| far(point(s), point(o))))
                    .min_by_key(|&o| {
                        let [a, b] = [i, o].map(|x| first::<FEW>(appearance.feature(x)));
                        (apart(&a, &b), o)
                    })
                    .unwrap();
            }
        }
        sets.extend(set.iter().map(|&s| s as u32));
    }
    sets
}

#[test]
fn sets_are_those_of_the_definition() {
    let monitor = Monitor::default();
    for wrap in [false, true] {
        let flat = exemplar::<2>(24, wrap);
        assert_eq!(
            similar(&flat, 3, 7, FEW, &monitor).unwrap().sets,
            brute(&flat, 3, 7)
        );
        let solid = exemplar::<3>(11, wrap);
        assert_eq!(
            similar(&solid, 3, 5, FEW, &monitor).unwrap().sets,
            brute(&solid, 3, 5)
        );
    }
}

#[test]
#[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
fn wide_registers_give_the_same_numbers() {
    use super::boxes::{self, Boxes, block, pairs, v3};
    let Some(simd) = crate::foundation::simd::V3::try_new() else {
        return;
    };
    let noise = Noise::new(9);
    let vector = |i: usize| -> [i16; FEW] {
        std::array::from_fn(|k| (noise.uniform([i as u32, k as u32, 0, 0]) * 8190.0) as i16 - 4095)
    };
    for trial in 0..200 {
        let query = pairs(&vector(100 * trial));
        let limit = (1 << 20) * (trial as i32 % 7 * 40);
        let vectors = block(|lane| vector(100 * trial + 1 + lane));
        let boxes = Boxes::of((0..1 + trial % 8).map(|lane| {
            let ends = [0, 1].map(|end| vector(100 * trial + 20 + 2 * lane + end));
            (boxes::extent(ends.into_iter()), lane as u32)
        }));
        let plain = boxes::distances(&vectors, &query, limit);
        assert_eq!(plain, v3::distances(simd, &vectors, &query, limit));
        let plain = boxes::bounds(&boxes, &query, limit);
        assert_eq!(plain, v3::bounds(simd, &boxes, &query, limit));
    }
}

#[test]
fn equal_samples_are_found_in_order_and_at_once() {
    let grid = Grid::new([300, 300], [false; 2]).unwrap();
    let same = Appearance::new(&vec![0.5; grid.len()], grid, 1, 2).unwrap();
    let sets = similar(&same, 3, 7, FEW, &Monitor::default()).unwrap().sets;
    let last = grid.index([297, 297]);
    assert_eq!(sets[3 * last + 1] as usize, grid.index([2, 2]));
    assert_eq!(sets[3 * last + 2] as usize, grid.index([2, 6]));
}

#[test]
fn refuses_sets_that_do_not_fit() {
    let small = exemplar::<2>(16, false);
    let monitor = Monitor::default();
    assert!(similar(&small, 3, 25, FEW, &monitor).is_err());
    assert!(similar(&small, 0, 7, FEW, &monitor).is_err());
    assert!(similar(&small, 3, 6, FEW, &monitor).is_err());
    assert!(similar(&small, 3, 7, 9, &monitor).is_err());
}

#[test]
fn a_copy_stays_and_threads_change_nothing() {
    fn check<const D: usize>(side: usize, out: usize) {
        let exemplar = exemplar::<D>(side, false);
        let region = region::<D>(out, false);
        let sets = similar(&exemplar, 3, 5, FEW, &Monitor::default()).unwrap();
        let copy: Vec<Place<D>> = (0..region.grid.len())
            .map(|p| region.grid.point(p).map(|x| (x as i32 + 4) * ONE))
            .collect();
        let run = |start: &[Place<D>], threads| {
            let mut places = start.to_vec();
            let frames = Frames::Constant(identity());
            par::install(threads, || {
                correct(
                    &exemplar,
                    &sets,
                    &region,
                    frames,
                    &[],
                    Kinds::default(),
                    &mut places,
                    &OPTIONS,
                    &Monitor::default(),
                )
            })
            .unwrap()
            .unwrap();
            places
        };
        assert_eq!(run(&copy, 2), copy);
        let mut start = copy.clone();
        jitter(&mut start, &region, &[], 2 * ONE as u32, 1, 0).unwrap();
        assert_ne!(start, copy);
        let once = run(&start, 1);
        assert_eq!(once, run(&start, 2));
        assert_eq!(once, run(&start, 7));
    }
    check::<2>(40, 24);
    check::<3>(20, 10);
}

#[test]
fn held_points_and_bad_sets() {
    let exemplar = exemplar::<2>(24, true);
    let region = region::<2>(15, true);
    let mut sets = similar(&exemplar, 3, 7, KEEP, &Monitor::default()).unwrap();
    let mut start = vec![[0; 2]; 225];
    jitter(&mut start, &region, &[], 24 * ONE as u32, 1, 0).unwrap();
    let held: Vec<bool> = (0..225).map(|p| p % 4 == 0).collect();
    let options = Options {
        numbers: KEEP,
        compensated: true,
        ..OPTIONS
    };
    let frame = [[3547, -2048], [2048, 3547]];
    let mut places = start.clone();
    let frames = Frames::Constant(frame);
    let monitor = Monitor::default();
    correct(
        &exemplar,
        &sets,
        &region,
        frames,
        &held,
        Kinds::default(),
        &mut places,
        &options,
        &monitor,
    )
    .unwrap();
    for p in 0..225 {
        assert!(!held[p] || places[p] == exemplar.bring_inside(start[p]));
    }
    let dense = vec![frame; 225];
    let mut again = start.clone();
    let frames = Frames::Dense(&dense);
    correct(
        &exemplar,
        &sets,
        &region,
        frames,
        &held,
        Kinds::default(),
        &mut again,
        &options,
        &monitor,
    )
    .unwrap();
    assert_eq!(places, again);
    sets.sets[7] = 24 * 24;
    assert!(
        correct(
            &exemplar,
            &sets,
            &region,
            frames,
            &held,
            Kinds::default(),
            &mut again,
            &options,
            &monitor
        )
        .is_err()
    );
}

#[test]
fn points_take_only_the_kind_they_want() {
    let exemplar = exemplar::<2>(24, true);
    let region = region::<2>(20, false);
    let sets = similar(&exemplar, 3, 7, FEW, &Monitor::default()).unwrap();
    let kind = |sample: [i32; 2]| u8::from(sample[1].rem_euclid(24) < 12);
    let samples: Vec<u8> = (0..576).map(|i| kind([i / 24, i % 24])).collect();
    // Each half of the output starts from the half of the exemplar that has the kind it wants.
    let points: Vec<u8> = (0..400).map(|p| u8::from(p % 20 < 10)).collect();
    let mut places: Vec<Place<2>> = (0..400)
        .map(|p| {
            [
                p / 20 * ONE,
                (p % 20 + if p % 20 < 10 { 1 } else { 3 }) * ONE,
            ]
        })
        .collect();
    let kinds = Kinds {
        samples: &samples,
        points: &points,
    };
    let frames = Frames::Constant(identity());
    let monitor = Monitor::default();
    let options = Options {
        passes: 4,
        ..OPTIONS
    };
    correct(
        &exemplar,
        &sets,
        &region,
        frames,
        &[],
        kinds,
        &mut places,
        &options,
        &monitor,
    )
    .unwrap();
    for (place, &wanted) in places.iter().zip(&points) {
        assert_eq!(kind(nearest(*place)), wanted);
    }
    let short = Kinds {
        samples: &samples[1..],
        points: &points,
    };
    assert!(
        correct(
            &exemplar,
            &sets,
            &region,
            frames,
            &[],
            short,
            &mut places,
            &options,
            &monitor
        )
        .is_err()
    );
}
