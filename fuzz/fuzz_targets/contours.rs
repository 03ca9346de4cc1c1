//! Fuzzes the strength of contours, which is compared with a direct computation from whole windows.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::contours::strength;
use texrs_fuzz::{Draw, agreed};

/// Returns the share of each label in the Gaussian window around a pixel. The image is mirrored beyond its border.
fn histogram(
    labels: &[u8],
    shape: [usize; 2],
    at: [usize; 2],
    count: usize,
    sigma: f64,
) -> Vec<f64> {
    let reach = (3.0 * sigma).ceil() as i64;
    let weight = |i: i64| (-0.5 * (i as f64 / sigma) * (i as f64 / sigma)).exp();
    let total: f64 = (-reach..=reach).map(weight).sum();
    let mirrored = |at: usize, step: i64, size: usize| {
        let place = (at as i64 + step).rem_euclid(2 * size as i64) as usize;
        place.min(2 * size - 1 - place)
    };
    let mut sums = vec![0.0; count];
    for i in -reach..=reach {
        for j in -reach..=reach {
            let p = mirrored(at[0], i, shape[0]) * shape[1] + mirrored(at[1], j, shape[1]);
            sums[usize::from(labels[p])] += weight(i) * weight(j) / (total * total);
        }
    }
    sums
}

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    let shape = if draw.seldom(8) {
        [draw.within(30..=70), draw.within(1..=3)]
    } else {
        draw.shape::<2>(0..=9)
    };
    let n = shape[0] * shape[1];
    let count = if draw.seldom(8) {
        draw.any::<u8>() as usize
    } else {
        draw.within(1..=12)
    };
    let most = if draw.seldom(16) { 255 } else { count.min(64) };
    let labels: Vec<u8> = draw.numbers(n, most as u32).map(|x| x as u8).collect();
    let sigma = if draw.seldom(16) {
        f64::from(draw.real()) * 40.0
    } else {
        [0.3, 0.7, 1.0, 1.5][draw.within(0..=3)]
    };
    let Some(found) = agreed(|monitor| strength(&labels, shape, count, sigma, monitor)) else {
        return;
    };
    assert_eq!(found.len(), n);
    assert!(found.iter().all(|v| v.is_finite() && *v >= 0.0));
    if sigma > 1.5 {
        return;
    }
    let windows: Vec<Vec<f64>> = (0..n)
        .map(|p| histogram(&labels, shape, [p / shape[1], p % shape[1]], count, sigma))
        .collect();
    for (p, value) in found.iter().enumerate() {
        let (y, x) = (p / shape[1], p % shape[1]);
        let of = |y: usize, x: usize| &windows[y * shape[1] + x];
        let (up, down) = (of(y.saturating_sub(1), x), of((y + 1).min(shape[0] - 1), x));
        let (left, right) = (of(y, x.saturating_sub(1)), of(y, (x + 1).min(shape[1] - 1)));
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for k in 0..count {
            let (dx, dy) = ((right[k] - left[k]) / 2.0, (down[k] - up[k]) / 2.0);
            let weight = 1.0 / (of(y, x)[k] + 0.02);
            xx += dx * dx * weight;
            xy += dx * dy * weight;
            yy += dy * dy * weight;
        }
        let half: f64 = (xx - yy) / 2.0;
        let expected = ((xx + yy) / 2.0 + half.hypot(xy)).sqrt() * sigma;
        assert!(
            (f64::from(*value) - expected).abs() < 1e-4,
            "{value} for {expected}"
        );
    }
});
