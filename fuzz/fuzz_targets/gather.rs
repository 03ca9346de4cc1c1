//! Fuzzes the interpolation of exemplars. Results must be within the range of the samples, and must
//! equal the samples at integer coordinates.

#![no_main]

use std::fmt::Debug;

use libfuzzer_sys::fuzz_target;
use texrs::gather::{Element, Exemplar, Interpolation, gather};
use texrs::grid::Grid;
use texrs_fuzz::{Draw, agreed};

fn coordinate(draw: &mut Draw<'_>) -> f32 {
    match draw.within(0..=15) {
        0 => f32::from_bits(draw.any()),
        1 => draw.real() * 1e8,
        2..=6 => draw.within(0..=24) as f32 - 8.0,
        _ => draw.real() * 24.0 - 8.0,
    }
}

fn check<T: Element + Debug + PartialOrd, const D: usize>(
    draw: &mut Draw<'_>,
    make: impl Fn(f32) -> T,
) {
    let channels = draw.within(0..=5);
    let several = draw.within(0..=2);
    let grids: Vec<Grid<D>> = (0..several)
        .map(|_| Grid::new(draw.shape(1..=6), draw.flags()).unwrap())
        .collect();
    let data: Vec<Vec<T>> = grids
        .iter()
        .map(|g| {
            draw.values(g.len() * channels)
                .into_iter()
                .map(&make)
                .collect()
        })
        .collect();
    let views: Vec<Exemplar<'_, T, D>> = grids
        .iter()
        .zip(&data)
        .map(|(&g, d)| Exemplar::new(d, g, channels).unwrap())
        .collect();
    let n = draw.within(0..=24);
    let coordinates: Vec<[f32; D]> = (0..n)
        .map(|_| std::array::from_fn(|_| coordinate(draw)))
        .collect();
    let which: Vec<u16> = if draw.flag() {
        draw.numbers(n, several as u32).map(|e| e as u16).collect()
    } else {
        vec![]
    };
    let kinds = [
        Interpolation::Nearest,
        Interpolation::Linear,
        Interpolation::Cubic,
    ];
    let interpolation = kinds[draw.within(0..=2)];
    let found = agreed(|monitor| {
        let mut out = vec![T::default(); n * channels];
        gather(
            &views,
            &which,
            &coordinates,
            interpolation,
            &mut out,
            monitor,
        )?;
        Ok(out)
    });
    let Some(found) = found else {
        return;
    };
    // Compare each value with the range of its exemplar.
    for p in 0..n {
        let e = which.get(p).map_or(0, |&e| usize::from(e));
        for c in 0..channels {
            let value = found[p * channels + c];
            let of = |at: usize| data[e][at * channels + c];
            let least = (0..grids[e].len())
                .map(of)
                .fold(of(0), |m, x| if x < m { x } else { m });
            let most = (0..grids[e].len())
                .map(of)
                .fold(of(0), |m, x| if x > m { x } else { m });
            // Rounding errors may take a weighted mean slightly out of the range of the samples.
            let slack = 1e-6 * most.to_f64().abs().max(least.to_f64().abs());
            assert!(
                value.to_f64() >= least.to_f64() - slack && value.to_f64() <= most.to_f64() + slack
            );
            let whole = coordinates[p]
                .iter()
                .all(|x| x.fract() == 0.0 && x.abs() < 1e6);
            if whole {
                let at: [usize; D] =
                    std::array::from_fn(|a| grids[e].resolve(a, coordinates[p][a] as isize));
                assert!(value == of(grids[e].index(at)));
            }
        }
    }
}

fn each<T: Element + Debug + PartialOrd>(draw: &mut Draw<'_>, make: impl Fn(f32) -> T) {
    if draw.flag() {
        check::<T, 2>(draw, make);
    } else {
        check::<T, 3>(draw, make);
    }
}

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    match draw.within(0..=4) {
        0 => each(&mut draw, |x| (x * 255.0) as u8),
        1 => each(&mut draw, |x| (x * 65535.0) as i32 - 32768),
        2 => each(&mut draw, |x| (x * 4e9) as u32),
        3 => each(&mut draw, |x| x * 1e30),
        _ => each(&mut draw, |x| f64::from(x) - 0.5),
    }
});
