use super::*;
use crate::foundation::hash::Noise;
use proptest::prelude::*;
use std::f64::consts::PI;

struct Owned {
    image: Vec<f32>,
    gradients: [Vec<f32>; 2],
    shape: [usize; 3],
    edges: [Edge; 2],
    screening: f64,
    mask: Option<Vec<bool>>,
}

impl Owned {
    fn new(shape: [usize; 3], edges: [Edge; 2], screening: f64, masked: bool, seed: u64) -> Self {
        let noise = Noise::new(seed);
        let values = |which: u32, scale: f64| -> Vec<f32> {
            let n = shape.iter().product::<usize>() as u32;
            let value = |i: u32| noise.uniform([i, which, 0, 0]) - 0.5;
            (0..n).map(|i| (scale * value(i)) as f32).collect()
        };
        let pixels = (shape[0] * shape[1]) as u32;
        let mask = |i: u32| noise.uniform([i, 9, 0, 0]) < 0.8;
        Self {
            image: values(0, 255.0),
            gradients: [values(1, 60.0), values(2, 60.0)],
            shape,
            edges,
            screening,
            mask: masked.then(|| (0..pixels).map(mask).collect()),
        }
    }

    fn problem(&self) -> Problem<'_> {
        Problem {
            image: &self.image,
            gradients: Some([&self.gradients[0], &self.gradients[1]]),
            domain: Domain {
                shape: self.shape,
                edges: self.edges,
                screening: self.screening,
                mask: self.mask.as_deref(),
            },
        }
    }

    /// Returns the largest gradient of the minimised energy over the unknowns. It is zero at the
    /// solution.
    fn slope(&self, v: &[f32]) -> f64 {
        let [rows, columns, channels] = self.shape;
        let mut slope = vec![0.0f64; v.len()];
        for y in 0..rows {
            for x in 0..columns {
                for c in 0..channels {
                    let at = |y: usize, x: usize| (y * columns + x) * channels + c;
                    // Add the gradient of each difference and of the screening.
                    let mut edge = |to: usize, wanted: f32| {
                        let lack = f64::from(v[to]) - f64::from(v[at(y, x)]) - f64::from(wanted);
                        slope[to] += lack;
                        slope[at(y, x)] -= lack;
                    };
                    if y + 1 < rows || self.edges[0] == Edge::Wrap {
                        edge(at((y + 1) % rows, x), self.gradients[0][at(y, x)]);
                    }
                    if x + 1 < columns || self.edges[1] == Edge::Wrap {
                        edge(at(y, (x + 1) % columns), self.gradients[1][at(y, x)]);
                    }
                    let i = at(y, x);
                    slope[i] += self.screening * (f64::from(v[i]) - f64::from(self.image[i]));
                }
            }
        }
        // Only free pixels have a gradient of zero. Fixed pixels must not change.
        let mut worst = 0.0f64;
        for y in 0..rows {
            for x in 0..columns {
                let ring = (self.edges[0] == Edge::Fixed && (y == 0 || y + 1 == rows))
                    || (self.edges[1] == Edge::Fixed && (x == 0 || x + 1 == columns));
                let free = !ring && self.mask.as_ref().is_none_or(|m| m[y * columns + x]);
                for c in 0..channels {
                    let i = (y * columns + x) * channels + c;
                    if free {
                        worst = worst.max(slope[i].abs());
                    } else {
                        assert_eq!(v[i], self.image[i], "a fixed pixel has moved");
                    }
                }
            }
        }
        worst
    }
}

fn edge() -> impl Strategy<Value = Edge> {
    prop::sample::select(vec![Edge::Fixed, Edge::Wrap, Edge::Free])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn nothing_is_left_to_gain(
        rows in 1usize..40, columns in 1usize..70, channels in 1usize..4, edges in [edge(), edge()],
        screening in prop::sample::select(vec![0.0, 1e-6, 0.01, 10.0]), masked: bool, seed: u64,
    ) {
        let owned = Owned::new([rows, columns, channels], edges, screening, masked, seed);
        let solutions: Vec<_> = [1, 2, 7].iter()
            .map(|&n| par::install(n, || solve(&owned.problem(), &Monitor::default())).unwrap().unwrap())
            .collect();
        prop_assert!(solutions.iter().all(|s| *s == solutions[0]));
        let slope = owned.slope(&solutions[0]);
        // Values range from 0 to 255. The solver stops at a fraction of the first residual, so
        // large images keep a larger gradient.
        prop_assert!(slope < 0.1, "{}", slope);
        if screening == 0.0 && !masked && !edges.contains(&Edge::Fixed) {
            let mean = |v: &[f32]| v.iter().map(|&x| f64::from(x)).sum::<f64>() / v.len() as f64;
            prop_assert!((mean(&solutions[0]) - mean(&owned.image)).abs() < 0.01);
        }
    }
}

/// Returns the unit eigenvectors of the second difference along an axis with their eigenvalues, and the first pixel
/// that is not fixed.
fn modes(edge: Edge, pixels: usize) -> (Vec<(f64, Vec<f64>)>, usize) {
    let ring = usize::from(edge == Edge::Fixed);
    let n = pixels.saturating_sub(2 * ring);
    let modes = (0..n).map(|k| {
        let (turn, shift) = match edge {
            Edge::Fixed => (PI * (k + 1) as f64 / (n + 1) as f64, 1.0),
            Edge::Free => (PI * k as f64 / n as f64, 0.5),
            Edge::Wrap => (2.0 * PI * k.div_ceil(2) as f64 / n as f64, 0.0),
        };
        let wave = |i: usize| {
            let (sin, cos) = (turn * (i as f64 + shift)).sin_cos();
            let odd = match edge {
                Edge::Fixed => true,
                Edge::Free => false,
                Edge::Wrap => k % 2 == 0 && k > 0,
            };
            if odd { sin } else { cos }
        };
        let length = (0..n).map(|i| wave(i).powi(2)).sum::<f64>().sqrt();
        (
            2.0 - 2.0 * turn.cos(),
            (0..n).map(|i| wave(i) / length).collect(),
        )
    });
    (modes.collect(), ring)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn a_rectangle_is_that_of_its_modes_in_double_precision(
        rows in 1usize..70, columns in 1usize..70, edges in [edge(), edge()],
        screening in prop::sample::select(vec![0.0, 1e-6, 0.01, 10.0, 1e12, 1e30, 1e300]), seed: u64,
    ) {
        let noise = Noise::new(seed);
        let mut flow: Vec<f32> = (0..(rows * columns) as u32)
            .map(|i| noise.uniform([i, 0, 0, 0]) as f32 - 0.5)
            .collect();
        if screening == 0.0 && !edges.contains(&Edge::Fixed) {
            // Without fixed pixels, the total flow must be zero.
            let mean = flow.iter().sum::<f32>() / flow.len() as f32;
            flow.iter_mut().for_each(|x| *x -= mean);
        }
        let ((down, top), (across, left)) = (modes(edges[0], rows), modes(edges[1], columns));
        let [height, width] = [down.len(), across.len()];
        let at = |y: usize, x: usize| (top + y) * columns + left + x;
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        // Compute coefficients along the rows, then across them, divide by the eigenvalues, and
        // transform back in the opposite order.
        let along: Vec<Vec<f64>> = across.iter().map(|(_, mode)| {
            (0..height).map(|y| (0..width).map(|x| mode[x] * f64::from(flow[at(y, x)])).sum()).collect()
        }).collect();
        let solved: Vec<Vec<f64>> = along.iter().zip(&across).map(|(column, (other, _))| {
            let mut out = vec![0.0; height];
            for (value, mode) in &down {
                let sum = value + other + screening;
                let part = if sum < 1e-9 { 0.0 } else { dot(column, mode) / sum };
                out.iter_mut().zip(mode).for_each(|(o, m)| *o += part * m);
            }
            out
        }).collect();
        let mut expected = vec![0.0; rows * columns];
        for y in 0..height {
            for x in 0..width {
                let parts = solved.iter().zip(&across);
                expected[at(y, x)] = parts.map(|(column, (_, mode))| column[y] * mode[x]).sum::<f64>();
            }
        }
        let most = expected.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let domain = Domain { shape: [rows, columns, 1], edges, screening, mask: None };
        spread(&domain, &mut flow, &Monitor::default()).unwrap();
        for (x, wanted) in flow.iter().zip(&expected) {
            prop_assert!((f64::from(*x) - wanted).abs() <= 1e-5 * most + 1e-6, "{} {} {}", x, wanted, most);
        }
    }
}

#[test]
fn pixels_that_end_left_of_where_they_begin_are_no_rectangle() {
    let mask: Vec<bool> = (0..25).map(|p| [8, 16].contains(&p)).collect();
    assert_eq!(inner_rectangle(&mask, [5, 5]), None);
    let mask: Vec<bool> = (0..25).map(|p| [7, 8, 12, 13].contains(&p)).collect();
    assert_eq!(inner_rectangle(&mask, [5, 5]), Some([(1, 2), (2, 2)]));
}

#[test]
fn the_differences_of_an_image_give_it_back() {
    let mut owned = Owned::new([50, 64, 2], [Edge::Free, Edge::Fixed], 0.0, false, 1);
    let target = Owned::new([50, 64, 2], [Edge::Free, Edge::Fixed], 0.0, false, 2).image;
    for y in 0..50 {
        for i in 0..128 {
            let at = y * 128 + i;
            owned.gradients[0][at] = if y < 49 {
                target[at + 128] - target[at]
            } else {
                0.0
            };
            owned.gradients[1][at] = if i < 126 {
                target[at + 2] - target[at]
            } else {
                0.0
            };
        }
        for i in [0, 1, 126, 127] {
            owned.image[y * 128 + i] = target[y * 128 + i];
        }
    }
    let solution = solve(&owned.problem(), &Monitor::default()).unwrap();
    for (a, b) in solution.iter().zip(&target) {
        assert!((a - b).abs() < 2e-3, "{a} {b}");
    }
}

#[test]
fn refuses_what_does_not_fit() {
    let owned = Owned::new([5, 6, 1], [Edge::Free; 2], 0.1, true, 1);
    let monitor = Monitor::default();
    let right = owned.problem();
    let elsewhere = |domain| Problem { domain, ..right };
    // A wrong shape, an overflowing shape, and an invalid screening, mask or gradient are errors.
    let wrong = [
        elsewhere(Domain {
            shape: [5, 5, 1],
            ..right.domain
        }),
        elsewhere(Domain {
            shape: [usize::MAX, 2, 1],
            ..right.domain
        }),
        elsewhere(Domain {
            screening: -1.0,
            ..right.domain
        }),
        elsewhere(Domain {
            mask: Some(&[true]),
            ..right.domain
        }),
        Problem {
            gradients: Some([&[], &owned.gradients[1]]),
            ..right
        },
    ];
    for problem in wrong {
        assert!(solve(&problem, &monitor).is_err());
    }
    monitor.cancel();
    assert!(matches!(
        solve(&owned.problem(), &monitor),
        Err(Error::Cancelled(_))
    ));
}
