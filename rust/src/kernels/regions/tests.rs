use super::*;
use crate::foundation::hash::Noise;
use crate::foundation::par;
use proptest::prelude::*;

/// The method of the paper: all edges are sorted and visited twice.
fn naive(image: &[f32], shape: [usize; 3], options: &Options) -> Vec<i32> {
    let [rows, columns, channels] = shape;
    let grid = Grid::new([rows, columns], options.wrap).unwrap();
    let smooth = smoothed(image, shape, options);
    let mut edges = Vec::new();
    for (i, [r, c]) in grid.points().enumerate() {
        let place = |dr: isize, dc: isize| {
            let r = grid.inside(0, r as isize + dr)?;
            Some(r * columns + grid.inside(1, c as isize + dc)?)
        };
        let pairs = [
            (Some(i), place(0, 1)),
            (Some(i), place(1, 0)),
            (Some(i), place(1, 1)),
            (place(0, 1), place(1, 0)),
        ];
        for pair in pairs {
            let (Some(a), Some(b)) = pair else { continue };
            let mut sum = 0.0;
            for k in 0..channels {
                let step = smooth[a * channels + k] - smooth[b * channels + k];
                sum += step * step;
            }
            edges.push((sum.sqrt() as f32, a, b));
        }
    }
    // The sort is stable, so ties keep their order.
    edges.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut label: Vec<usize> = (0..rows * columns).collect();
    let mut inner = vec![0.0f32; rows * columns];
    let join = |label: &mut Vec<usize>, [a, b]: [usize; 2]| {
        let (low, high) = (a.min(b), a.max(b));
        label
            .iter_mut()
            .filter(|l| **l == high)
            .for_each(|l| *l = low);
        low
    };
    let area = |label: &[usize], one: usize| label.iter().filter(|l| **l == one).count();
    for &(weight, a, b) in &edges {
        let both = [label[a], label[b]];
        let bears =
            both.map(|l| (f64::from(inner[l]) + options.scale / area(&label, l) as f64) as f32);
        if both[0] != both[1] && weight < bears[0] && weight < bears[1] {
            let low = join(&mut label, both);
            inner[low] = weight;
        }
    }
    for &(_, a, b) in &edges {
        let both = [label[a], label[b]];
        if both[0] != both[1] && both.iter().any(|l| area(&label, *l) < options.least) {
            join(&mut label, both);
        }
    }
    let mut firsts: Vec<usize> = label.clone();
    firsts.sort_unstable();
    firsts.dedup();
    let number = |l: &usize| firsts.binary_search(l).unwrap() as i32;
    label.iter().map(number).collect()
}

fn smoothed(image: &[f32], [rows, columns, channels]: [usize; 3], options: &Options) -> Vec<f64> {
    let reach = (4.0 * options.blur + 0.5) as isize;
    let taps: Vec<f64> = (-reach..=reach)
        .map(|i| {
            if reach == 0 {
                1.0
            } else {
                libm_exp(-0.5 / (options.blur * options.blur) * (i * i) as f64)
            }
        })
        .collect();
    let sum: f64 = taps.iter().sum();
    let taps: Vec<f64> = taps.iter().map(|t| t / sum).collect();
    // Beyond its ends, an axis wraps or is mirrored.
    let resolve = |i: isize, n: usize, wrap: bool| {
        let n = n as isize;
        if wrap {
            return i.rem_euclid(n) as usize;
        }
        let mut i = i;
        while !(0..n).contains(&i) {
            i = if i < 0 { -1 - i } else { 2 * n - 1 - i };
        }
        i as usize
    };
    let mut values: Vec<f64> = image.iter().map(|&x| f64::from(x)).collect();
    // Smooth along columns, then along rows, in the same order of sums as the kernel.
    for axis in 0..2 {
        let before = values.clone();
        for r in 0..rows {
            for c in 0..columns {
                for k in 0..channels {
                    let at = |by: isize| {
                        let (r, c) = if axis == 0 {
                            (resolve(r as isize + by, rows, options.wrap[0]), c)
                        } else {
                            (r, resolve(c as isize + by, columns, options.wrap[1]))
                        };
                        before[(r * columns + c) * channels + k]
                    };
                    let mut value = at(0) * taps[reach as usize];
                    for by in (1..=reach).rev() {
                        value += (at(-by) + at(by)) * taps[(reach + by) as usize];
                    }
                    values[(r * columns + c) * channels + k] = value;
                }
            }
        }
    }
    values
}

fn libm_exp(x: f64) -> f64 {
    crate::foundation::libm::exp(x)
}

fn run(image: &[f32], shape: [usize; 3], options: &Options, threads: usize) -> Vec<i32> {
    par::install(threads, || {
        felzenszwalb(image, shape, options, &Monitor::default())
    })
    .unwrap()
    .unwrap()
}

/// Slow waves with noise. A large `coarse` gives few distinct values, which are often equal.
fn picture([rows, columns, channels]: [usize; 3], coarse: f32, grain: f32, seed: u64) -> Vec<f32> {
    let noise = Noise::new(seed);
    let phase = noise.uniform([7, 7, 7, 7]) as f32 * 6.0;
    let mut values = Vec::new();
    for r in 0..rows {
        for c in 0..columns {
            for k in 0..channels {
                let wave = (r as f32 / 3.0 + phase).sin() + (c as f32 / 4.0 + k as f32).cos();
                let spot = noise.uniform([r as u32, c as u32, k as u32, 0]) as f32;
                values.push(((wave * 20.0 + spot * grain) / coarse).round() * coarse);
            }
        }
    }
    values
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn agrees_with_the_naive_merge(
        rows in 1usize..24, columns in 1usize..24, channels in 1usize..5, wrap: [bool; 2], seed: u64,
        (coarse, grain) in prop_oneof![Just((0.001f32, 30f32)), Just((1.0, 10.0)), Just((10.0, 30.0)), Just((0.01, 3.0))],
        scale in 0f64..300.0, blur in prop_oneof![Just(0.0), Just(0.4), 0f64..3.0], least in 0usize..30,
    ) {
        let shape = [rows, columns, channels];
        let image = picture(shape, coarse, grain, seed);
        let options = Options { scale, blur, least, wrap };
        let expected = naive(&image, shape, &options);
        for threads in [1, 2, 7] {
            prop_assert_eq!(&run(&image, shape, &options, threads), &expected);
        }
    }
}

#[test]
fn regions_of_larger_pictures_are_those_of_all_edges() {
    for (seed, grain, scale) in [(1, 30.0, 20.0), (2, 8.0, 8.0), (3, 60.0, 100.0)] {
        let shape = [70, 61, 3];
        let image = picture(shape, 0.001, grain, seed);
        let options = Options {
            scale,
            blur: 0.4,
            least: 5,
            wrap: [seed == 2, false],
        };
        let found = run(&image, shape, &options, 2);
        assert_eq!(found, naive(&image, shape, &options));
        assert!(found.iter().max().unwrap() > &3);
    }
}

#[test]
fn what_is_flat_is_one_region() {
    let options = Options {
        scale: 1.0,
        blur: 0.4,
        least: 0,
        wrap: [false; 2],
    };
    assert_eq!(run(&[0.3; 35], [5, 7, 1], &options, 1), [0; 35]);
    let halves: Vec<f32> = (0..80).map(|i| if i % 8 < 4 { 0.0 } else { 9.0 }).collect();
    let expected: Vec<i32> = (0..80).map(|i| i32::from(i % 8 > 3)).collect();
    let sharp = Options {
        blur: 0.0,
        ..options
    };
    assert_eq!(run(&halves, [10, 8, 1], &sharp, 1), expected);
    let large = Options { least: 41, ..sharp };
    assert_eq!(run(&halves, [10, 8, 1], &large, 1), [0; 80]);
}

#[test]
fn refuses_what_it_cannot_merge() {
    let options = Options {
        scale: 1.0,
        blur: 0.4,
        least: 2,
        wrap: [false; 2],
    };
    let monitor = Monitor::default();
    assert!(felzenszwalb(&[0.0; 4], [2, 2, 2], &options, &monitor).is_err());
    assert!(felzenszwalb(&[], [0, 2, 1], &options, &monitor).is_err());
    assert!(felzenszwalb(&[], [2, 2, 0], &options, &monitor).is_err());
    assert!(felzenszwalb(&[f32::NAN; 4], [2, 2, 1], &options, &monitor).is_err());
    assert!(felzenszwalb(&[1e20; 4], [2, 2, 1], &options, &monitor).is_err());
    for bad in [-1.0, f64::NAN, 1e30] {
        let scale = Options {
            scale: bad,
            ..options
        };
        let blur = Options {
            blur: bad,
            ..options
        };
        assert!(felzenszwalb(&[0.0; 4], [2, 2, 1], &scale, &monitor).is_err());
        assert!(felzenszwalb(&[0.0; 4], [2, 2, 1], &blur, &monitor).is_err());
    }
    monitor.cancel();
    assert!(felzenszwalb(&[0.0; 4], [2, 2, 1], &options, &monitor).is_err());
}
