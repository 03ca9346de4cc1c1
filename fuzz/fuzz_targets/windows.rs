//! Fuzzes correlations, mean shifts and regions. Correlations must equal direct computations, mean
//! shifts must stay within the range of the image, and regions must be connected.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::grid::Grid;
use texrs::mean_shift::{Options, filter};
use texrs::ncc::Correlation;
use texrs::regions;
use texrs_fuzz::{Draw, agreed, speaks};

/// Returns the correlation of two lists of numbers, or `None` if one of them is constant.
fn correlate(a: &[f64], b: &[f64]) -> Option<f64> {
    let centred = |x: &[f64]| {
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        x.iter().map(|v| v - mean).collect::<Vec<f64>>()
    };
    let (a, b) = (centred(a), centred(b));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let size = dot(&a, &a) * dot(&b, &b);
    (size > 1e-6).then(|| dot(&a, &b) / size.sqrt())
}

fn correlated(draw: &mut Draw<'_>) {
    let (shape, channels) = (draw.shape::<2>(0..=14), draw.within(0..=2));
    let image = draw.reals(shape[0] * shape[1] * channels);
    let made = match Correlation::new(&image, shape) {
        Ok(made) => made,
        Err(error) => return speaks(&error),
    };
    let size = draw.shape::<2>(0..=14);
    let template = draw.reals(size[0] * size[1] * channels);
    let Some(maps) = agreed(|monitor| made.maps(&template, size, monitor)) else {
        return;
    };
    let positions = [shape[0] - size[0] + 1, shape[1] - size[1] + 1];
    assert_eq!(maps.len(), positions[0] * positions[1] * channels);
    assert!(maps.iter().all(|x| (-1.0..=1.0).contains(x)));
    if !image
        .iter()
        .chain(&template)
        .all(|x| (0.0..=1.0).contains(x))
    {
        return;
    }
    // Compare each value with the correlation of its window.
    for (i, found) in maps.iter().enumerate() {
        let (c, at) = (
            i / (positions[0] * positions[1]),
            i % (positions[0] * positions[1]),
        );
        let [row, column] = [at / positions[1], at % positions[1]];
        let cells = || (0..size[0]).flat_map(|r| (0..size[1]).map(move |k| (r, k)));
        let window: Vec<f64> = cells()
            .map(|(r, k)| f64::from(image[(c * shape[0] + row + r) * shape[1] + column + k]))
            .collect();
        let wanted: Vec<f64> = template[c * size[0] * size[1]..][..size[0] * size[1]]
            .iter()
            .map(|&x| f64::from(x))
            .collect();
        if let Some(expected) = correlate(&window, &wanted) {
            assert!(
                (f64::from(*found) - expected).abs() < 1e-5,
                "{found} for {expected}"
            );
        }
    }
}

fn shifted(draw: &mut Draw<'_>) {
    let shape = [draw.within(0..=10), draw.within(0..=10), draw.within(0..=5)];
    let image = draw.reals(shape.iter().product());
    let options = Options {
        radius: draw.within(0..=12),
        range: draw.real(),
        max_iterations: draw.within(0..=8),
        tolerance: draw.real() * 0.1,
        wrap: draw.flags(),
    };
    let Some(found) = agreed(|monitor| filter(&image, shape, &options, monitor)) else {
        return;
    };
    for c in 0..shape[2] {
        let of = |x: &[f32]| -> Vec<f32> { x.iter().skip(c).step_by(shape[2]).copied().collect() };
        let (before, after) = (of(&image), of(&found));
        let least = before.iter().copied().fold(f32::INFINITY, f32::min);
        let most = before.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let slack = 1e-5 * least.abs().max(most.abs());
        assert!(
            after
                .iter()
                .all(|x| (least - slack..=most + slack).contains(x))
        );
    }
}

/// Checks that regions are numbered in the order of their first pixels, are connected, and have the
/// minimum area unless there is only one.
fn merged(draw: &mut Draw<'_>) {
    let shape = [draw.within(0..=12), draw.within(0..=12), draw.within(0..=4)];
    let image = draw.reals(shape.iter().product());
    let options = regions::Options {
        scale: f64::from(draw.real()),
        blur: f64::from(draw.real()) * 2.0,
        least: draw.within(0..=20),
        wrap: draw.flags(),
    };
    let Some(found) = agreed(|monitor| regions::felzenszwalb(&image, shape, &options, monitor))
    else {
        return;
    };
    let grid = Grid::new([shape[0], shape[1]], options.wrap).unwrap();
    assert_eq!(found.len(), grid.len());
    let mut areas: Vec<usize> = Vec::new();
    for &label in &found {
        let label = usize::try_from(label).unwrap();
        assert!(label <= areas.len());
        areas.resize(areas.len().max(label + 1), 0);
        areas[label] += 1;
    }
    assert!(areas.len() == 1 || areas.iter().all(|&n| n >= options.least));
    // Fill each region from its first pixel, to check that it is connected.
    let mut seen = vec![false; found.len()];
    for (first, &label) in found.iter().enumerate() {
        if seen[first] || found[..first].contains(&label) {
            assert!(seen[first], "a region in two pieces");
            continue;
        }
        let mut stack = vec![first];
        seen[first] = true;
        while let Some(i) = stack.pop() {
            let point = grid.point(i);
            for (down, right) in (-1..=1).flat_map(|d| (-1..=1).map(move |r| (d, r))) {
                let row = grid.inside(0, point[0] as isize + down);
                let column = grid.inside(1, point[1] as isize + right);
                let (Some(row), Some(column)) = (row, column) else {
                    continue;
                };
                let j = grid.index([row, column]);
                if found[j] == label && !seen[j] {
                    seen[j] = true;
                    stack.push(j);
                }
            }
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    match draw.within(0..=2) {
        0 => correlated(&mut draw),
        1 => shifted(&mut draw),
        _ => merged(&mut draw),
    }
});
