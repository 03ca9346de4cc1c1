//! Fuzzes distances to outlines and windowed sums. Both are compared with direct computations.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::distance::{Piece, outlines};
use texrs::nearby::sums;
use texrs_fuzz::{Draw, agreed, near};

fn distances(draw: &mut Draw<'_>) {
    let shape = draw.shape::<2>(0..=12);
    let labels: Vec<i32> = draw
        .numbers(shape[0] * shape[1], 3)
        .map(|x| x as i32 - 1)
        .collect();
    let far = |draw: &mut Draw<'_>| {
        if draw.seldom(8) {
            draw.any()
        } else {
            draw.within(0..=24) as i64 - 8
        }
    };
    let pieces: Vec<Piece> = (0..draw.within(0..=3))
        .map(|_| Piece {
            label: draw.within(0..=3) as i32 - 1,
            low: [far(draw), far(draw)],
            shape: draw.shape(0..=10),
        })
        .collect();
    // Compare each distance with the minimum over all pixels on the other side of the outline.
    let Some(found) = agreed(|monitor| outlines(&labels, shape, &pieces, monitor)) else {
        return;
    };
    for (piece, found) in pieces.iter().zip(&found) {
        let columns = piece.shape[1];
        let n = piece.shape[0] * columns;
        let mine = |i: usize| {
            let at = |a: usize, k: usize| {
                piece.low[a]
                    .saturating_add(k as i64)
                    .clamp(0, shape[a] as i64 - 1) as usize
            };
            labels[at(0, i / columns) * shape[1] + at(1, i % columns)] == piece.label
        };
        let Some(found) = found else {
            assert!((0..n).all(|i| mine(i) == mine(0)));
            continue;
        };
        for i in 0..n {
            let square = |j: usize| {
                (i / columns).abs_diff(j / columns).pow(2)
                    + (i % columns).abs_diff(j % columns).pow(2)
            };
            let least = (0..n)
                .filter(|&j| mine(j) != mine(i))
                .map(square)
                .min()
                .unwrap();
            let expected = (least as f64).sqrt() as f32;
            assert_eq!(found[i], if mine(i) { expected } else { -expected });
        }
    }
}

fn summed(draw: &mut Draw<'_>) {
    let shape = draw.shape::<2>(0..=9);
    let n = draw.within(0..=20);
    let one = |draw: &mut Draw<'_>, a: usize| {
        if draw.seldom(64) {
            draw.any()
        } else {
            draw.within(0..=shape[a].max(1) - 1) as i64
        }
    };
    let points: Vec<[i64; 2]> = (0..n).map(|_| [one(draw, 0), one(draw, 1)]).collect();
    let values = draw.reals(n);
    let cyclic = draw.flag();
    let length = draw.within(0..=12);
    let window: Vec<f64> = draw.values(length).into_iter().map(f64::from).collect();
    let Some(found) = agreed(|monitor| sums(&points, &values, shape, cyclic, &window, monitor))
    else {
        return;
    };
    assert_eq!(found.len(), n);
    if !values.iter().all(|x| x.abs() <= 1.0) {
        return;
    }
    // Compare each sum with a direct computation over all points.
    let weight = |a: i64, b: i64, size: usize| -> f64 {
        let turns = if cyclic { -14..=14 } else { 0..=0 };
        let far = turns.map(|turn| (a - b + turn * size as i64).unsigned_abs() as usize);
        far.filter_map(|far| window.get(far)).sum()
    };
    for (p, sum) in points.iter().zip(&found) {
        let of = |(q, v): (&[i64; 2], &f32)| {
            weight(p[0], q[0], shape[0]) * weight(p[1], q[1], shape[1]) * f64::from(*v)
        };
        let expected: f64 = points.iter().zip(&values).map(of).sum();
        assert!(
            near(f64::from(*sum), expected, 1e-5),
            "{sum} for {expected}"
        );
    }
}

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    if draw.flag() {
        distances(&mut draw);
    } else {
        summed(&mut draw);
    }
});
