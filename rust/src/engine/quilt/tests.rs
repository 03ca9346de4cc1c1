use proptest::prelude::*;

use super::*;
use crate::engine::stitcher::Weights;
use crate::foundation::hash::Noise;

const SIDE: usize = 40;

/// Returns a smooth noise image of one exemplar.
fn picture(seed: u64) -> (Picture, Pixels, Samples) {
    let noise = Noise::new(seed);
    let colours: Vec<f32> = (0..SIDE * SIDE)
        .map(|i| {
            let (r, c) = ((i / SIDE) as f32, (i % SIDE) as f32);
            let spot = noise.uniform([i as u32, 0, 0, 0]) as f32;
            (r / 5.0).sin() + (c / 4.0).cos() + 0.3 * spot
        })
        .collect();
    let n = colours.len();
    let weights = Weights {
        colour: 1.0,
        depth: 1.0,
        ..Weights::NONE
    };
    let samples = Samples::new(&colours, 1, &vec![0.0; n], weights).unwrap();
    let at = |i: usize| [(i / SIDE) as f32, (i % SIDE) as f32];
    let pixels = Pixels {
        exemplar: vec![0; n],
        coordinates: (0..n).map(at).collect(),
        hands: vec![true; n],
        cells: (0..n)
            .map(|i| (i / SIDE / CELL * SIDE + i % SIDE / CELL) as u32)
            .collect(),
    };
    let picture = Picture {
        colours,
        shape: [SIDE; 2],
        lattice: None,
        phase: [0.0; 2],
    };
    (picture, pixels, samples)
}

fn options(fixed: Option<usize>) -> Options {
    Options {
        size: [34, 34],
        wrap: [false; 2],
        patch: [16, 16],
        regular: false,
        fixed,
    }
}

/// Returns the windows of a texture of two by two patches.
fn windows() -> [Window; 4] {
    let span = |second: bool| Span {
        start: if second { 12 } else { 0 },
        extent: 16,
        before: if second { 4 } else { 0 },
        after: 0,
    };
    [[false, false], [false, true], [true, false], [true, true]].map(|w| Window(w.map(span)))
}

fn made(seed: u64, fixed: Option<usize>, threads: usize) -> (Vec<u32>, Vec<u32>) {
    let (picture, pixels, samples) = picture(seed);
    let [first, rest @ ..] = windows();
    let work = || {
        let mut quilt = Quilt::new(vec![picture], pixels, &samples, options(fixed)).unwrap();
        quilt.lay_first(&first, 0, [0, 3]).unwrap();
        let waves: Vec<Vec<Window>> = rest.iter().map(|&w| vec![w]).collect();
        quilt.paste(&waves, &Monitor::default()).unwrap();
        quilt.into_map()
    };
    par::install(threads, work).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn what_windows_cover_shows_a_sample_and_threads_change_nothing(
        seed: u64, fixed in prop_oneof![Just(None), Just(Some(1usize))],
    ) {
        let (place, label) = made(seed, fixed, 1);
        for (i, (&place, &label)) in place.iter().zip(&label).enumerate() {
            let covered = i / 34 < 28 && i % 34 < 28;
            prop_assert_eq!(covered, place != FREE);
            prop_assert!(label < 4 && (!covered || (place as usize) < SIDE * SIDE));
        }
        prop_assert!((0..4).all(|k| label.contains(&k)));
        prop_assert_eq!(made(seed, fixed, 7), (place, label));
    }
}

#[test]
fn a_window_knows_what_lies_beside_it() {
    let span = Span {
        start: 28,
        extent: 8,
        before: 3,
        after: 2,
    };
    let window = Window([span, Span { start: 0, ..span }]);
    let known = window.known();
    assert_eq!(known.iter().filter(|k| !**k).count(), 9);
    assert!(!known[3 * 8 + 3] && known[2 * 8 + 3] && known[3 * 8 + 6]);
    let around = window.around([32, 20], [true, false]);
    assert_eq!(around.bounds.shape(), [10, 9]);
    assert_eq!(around.inner, [1, 0]);
    let points: Vec<usize> = around.bounds.points([32, 20]).collect();
    assert_eq!(points[..2], [27 * 20, 27 * 20 + 1]);
    assert_eq!(points[9 * 9 + 8], 4 * 20 + 8);
}

#[test]
fn what_does_not_fit_is_refused() {
    let (one, pixels, samples) = picture(1);
    let make = |pictures: Vec<Picture>, pixels: Pixels, options: Options| {
        Quilt::new(pictures, pixels, &samples, options).is_err()
    };
    assert!(make(Vec::new(), pixels.clone(), options(None)));
    assert!(make(vec![one.clone()], pixels.clone(), options(Some(2))));
    let large = Options {
        patch: [SIDE + 1, 4],
        ..options(None)
    };
    assert!(make(vec![one.clone()], pixels.clone(), large));
    let mut few = pixels.clone();
    few.hands.pop();
    assert!(make(vec![one.clone()], few, options(None)));
    let mut quilt = Quilt::new(vec![one], pixels, &samples, options(None)).unwrap();
    let [first, second, ..] = windows();
    assert!(quilt.lay_first(&first, 0, [25, 0]).is_err());
    assert!(quilt.lay_first(&first, 1, [0, 0]).is_err());
    quilt.lay_first(&first, 0, [0, 0]).unwrap();
    let monitor = Monitor::default();
    let mut wrong = second;
    wrong.0[1].extent = 17;
    assert!(quilt.paste(&[vec![wrong]], &monitor).is_err());
    wrong = second;
    wrong.0[0].before = 16;
    assert!(quilt.paste(&[vec![wrong]], &monitor).is_err());
    monitor.cancel();
    assert!(quilt.paste(&[vec![second]], &monitor).is_err());
}
