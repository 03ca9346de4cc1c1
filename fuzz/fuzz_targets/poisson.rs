//! Fuzzes the Poisson solver. Kept values must not change, and the minimised sum must not grow.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::poisson::{Domain, Edge, Problem, solve};
use texrs_fuzz::{Draw, agreed};

/// Returns the sum of squares that the solver minimises.
fn cost(problem: &Problem<'_>, values: &[f32]) -> f64 {
    let Domain {
        shape: [rows, columns, channels],
        edges,
        screening,
        ..
    } = problem.domain;
    let mut sum = 0.0;
    for y in 0..rows {
        for x in 0..columns {
            for c in 0..channels {
                let at = |y: usize, x: usize| (y * columns + x) * channels + c;
                let p = at(y, x);
                let value = |i: usize| f64::from(values[i]);
                let wanted = |axis: usize| problem.gradients.map_or(0.0, |g| f64::from(g[axis][p]));
                if y + 1 < rows || edges[0] == Edge::Wrap {
                    sum += (value(at((y + 1) % rows, x)) - value(p) - wanted(0)).powi(2);
                }
                if x + 1 < columns || edges[1] == Edge::Wrap {
                    sum += (value(at(y, (x + 1) % columns)) - value(p) - wanted(1)).powi(2);
                }
                sum += screening * (value(p) - f64::from(problem.image[p])).powi(2);
            }
        }
    }
    sum
}

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    let shape = [draw.within(0..=20), draw.within(0..=20), draw.within(0..=3)];
    let (n, pixels) = (shape.iter().product(), shape[0] * shape[1]);
    let scale = [1.0, 255.0, 1e6][draw.within(0..=2)];
    let image: Vec<f32> = draw.reals(n).iter().map(|x| x * scale).collect();
    let gradients = [draw.reals(n), draw.reals(n)];
    let mask = draw.mask(pixels);
    let problem = Problem {
        image: &image,
        gradients: draw.flag().then(|| [&gradients[0][..], &gradients[1][..]]),
        domain: Domain {
            shape,
            edges: [0; 2].map(|_| [Edge::Fixed, Edge::Wrap, Edge::Free][draw.within(0..=2)]),
            screening: [0.0, 1e-9, 0.01, 1.0, 1e6, f64::from(draw.real())][draw.within(0..=5)],
            mask: draw.flag().then_some(&mask[..]),
        },
    };
    let Some(found) = agreed(|monitor| solve(&problem, monitor)) else {
        return;
    };
    let given = image.iter().chain(&gradients[0]).chain(&gradients[1]);
    if !given.clone().all(|x| x.abs() <= 1e6) {
        return;
    }
    assert!(found.iter().all(|x| x.is_finite()));
    if let Some(mask) = problem.domain.mask {
        for (p, _) in mask.iter().enumerate().filter(|(_, m)| !**m) {
            assert!((0..shape[2]).all(|c| found[p * shape[2] + c] == image[p * shape[2] + c]));
        }
    }
    // The rounding error of single precision grows with the square of the values.
    let most = given.fold(1.0f64, |m, x| m.max(f64::from(x.abs())));
    let rounding = n as f64 * (1.0 + problem.domain.screening) * (most * 1e-5).powi(2);
    let [before, after] = [&image, &found].map(|values| cost(&problem, values));
    assert!(
        after <= before * (1.0 + 1e-4) + rounding,
        "{after} after {before}"
    );
});
