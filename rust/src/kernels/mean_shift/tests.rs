use super::*;
use crate::foundation::hash::Noise;
use proptest::prelude::*;

/// Filters pixel by pixel, with integer offsets.
fn naive(image: &[f32], shape: [usize; 3], options: &Options) -> Vec<f32> {
    let [rows, columns, channels] = shape;
    let grid = Grid::new([rows, columns], options.wrap).unwrap();
    let reach = options.radius as isize;
    let mut out = image.to_vec();
    for (i, colour) in out.chunks_exact_mut(channels).enumerate() {
        let mut at = [(i / columns) as isize, (i % columns) as isize];
        for _ in 0..options.max_iterations {
            let (mut count, mut sum, mut moved) = (0.0f32, vec![0.0f32; channels], [0.0f32; 2]);
            // Sum the samples of the window that are near the current colour.
            for dy in -reach..=reach {
                for dx in -reach..=reach {
                    let (Some(y), Some(x)) =
                        (grid.inside(0, at[0] + dy), grid.inside(1, at[1] + dx))
                    else {
                        continue;
                    };
                    let sample = &image[(y * columns + x) * channels..][..channels];
                    let mut distance = 0.0f32;
                    for (s, c) in sample.iter().zip(colour.iter()) {
                        distance += (s - c) * (s - c);
                    }
                    if distance <= options.range * options.range {
                        count += 1.0;
                        moved[0] += dy as f32;
                        moved[1] += dx as f32;
                        sum.iter_mut().zip(sample).for_each(|(a, b)| *a += b);
                    }
                }
            }
            if count == 0.0 {
                break;
            }
            // Move to the mean position and colour of these samples.
            let (mut stayed, mut distance) = (true, 0.0f32);
            for (axis, n) in [rows, columns].into_iter().enumerate() {
                let by = (f64::from(moved[axis]) / f64::from(count)).round_ties_even() as isize;
                stayed &= by == 0;
                at[axis] = (at[axis] + by).rem_euclid(n as isize);
            }
            for (c, s) in colour.iter_mut().zip(&sum) {
                let mean = s / count;
                distance += (mean - *c) * (mean - *c);
                *c = mean;
            }
            if stayed && distance <= options.tolerance * options.tolerance {
                break;
            }
        }
    }
    out
}

pub(super) fn noise(n: usize, seed: u64) -> Vec<f32> {
    let noise = Noise::new(seed);
    (0..n)
        .map(|i| noise.below(256, [i as u32, 0, 0, 0]) as f32)
        .collect()
}

fn run(image: &[f32], shape: [usize; 3], options: &Options, threads: usize) -> Vec<f32> {
    par::install(threads, || {
        filter(image, shape, options, &Monitor::default())
    })
    .unwrap()
    .unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn agrees_with_the_naive_filter(
        rows in 1usize..20, columns in 1usize..30, channels in 1usize..7, radius in 0usize..13,
        range in 0f32..300.0, max_iterations in 0usize..7, wrap: [bool; 2], seed: u64,
    ) {
        let shape = [rows, columns, channels];
        let image = noise(rows * columns * channels, seed);
        let options = Options { radius, range, max_iterations, tolerance: 1.0, wrap };
        let expected = naive(&image, shape, &options);
        let results: Vec<_> = [1, 2, 7].iter().map(|&n| run(&image, shape, &options, n)).collect();
        prop_assert!(results.iter().all(|r| *r == results[0]));
        prop_assert_eq!(&results[0], &expected);
    }
}

#[test]
fn flat_regions_lose_their_noise_and_keep_their_edge() {
    let noise = noise(32 * 32, 3);
    let image: Vec<f32> = (0..32 * 32)
        .map(|i| noise[i] / 32.0 + if i % 32 < 16 { 50.0 } else { 150.0 })
        .collect();
    let options = Options {
        radius: 5,
        range: 20.0,
        max_iterations: 20,
        tolerance: 0.1,
        wrap: [false; 2],
    };
    let out = run(&image, [32, 32, 1], &options, 2);
    for (i, &v) in out.iter().enumerate() {
        let middle = if i % 32 < 16 { 54.0 } else { 154.0 };
        assert!((v - middle).abs() < 1.5, "{v} at {i}");
    }
}

#[test]
fn refuses_what_it_cannot_filter() {
    let options = Options {
        radius: 2,
        range: 1.0,
        max_iterations: 5,
        tolerance: 0.1,
        wrap: [false; 2],
    };
    let monitor = Monitor::default();
    // Invalid images, invalid options and a cancelled monitor are errors.
    assert!(filter(&[0.0; 4], [2, 2, 2], &options, &monitor).is_err());
    assert!(filter(&[], [0, 2, 1], &options, &monitor).is_err());
    assert!(filter(&[f32::NAN; 4], [2, 2, 1], &options, &monitor).is_err());
    assert!(filter(&[1e16; 4], [2, 2, 1], &options, &monitor).is_err());
    for wrong in [
        Options {
            radius: MAX_RADIUS + 1,
            ..options
        },
        Options {
            range: f32::NAN,
            ..options
        },
        Options {
            range: -1.0,
            ..options
        },
        Options {
            tolerance: f32::NAN,
            ..options
        },
    ] {
        assert!(filter(&[0.0; 4], [2, 2, 1], &wrong, &monitor).is_err());
    }
    monitor.cancel();
    assert!(matches!(
        filter(&[0.0; 4], [2, 2, 1], &options, &monitor),
        Err(Error::Cancelled(_))
    ));
}
