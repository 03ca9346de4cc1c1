//! Fuzzes the analysis of exemplars, and the initialisation, correction and upsampling of
//! coordinates. Initialised and corrected coordinates must be inside the exemplar, and held points
//! must keep their coordinates.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::appearance::Appearance;
use texrs::blocks::{self, Constraints};
use texrs::coherence::{self, Kinds, jitter, similar};
use texrs::fixed::{Frame, Frames, ONE, Place, identity};
use texrs::grid::{Grid, Region};
use texrs::optimize;
use texrs::pyramid::upsample;
use texrs_fuzz::{Draw, agreed, speaks};

fn frame<const D: usize>(draw: &mut Draw<'_>) -> Frame<D> {
    match draw.within(0..=3) {
        0 => std::array::from_fn(|_| std::array::from_fn(|_| draw.any())),
        _ => identity::<D>().map(|row| {
            row.map(|x| x + (draw.within(0..=2000) as i16 - 1000) * i16::from(draw.flag()))
        }),
    }
}

fn check<const D: usize>(draw: &mut Draw<'_>, longest: usize) {
    let (wrap, channels) = (draw.flags(), draw.within(0..=4));
    // The time of the analysis grows with the square of the number of values in a window. Windows
    // with up to 343 values for each channel are therefore rare.
    let widest = if draw.seldom(32) { 3 } else { 4 - D };
    let radius = draw.within(0..=if channels > 1 { widest.min(2) } else { widest });
    let exemplar = Grid::new(draw.shape::<D>(1..=longest), wrap).unwrap();
    let colours = draw.reals(exemplar.len() * channels);
    let made = agreed(|_| Ok(Appearance::new(&colours, exemplar, channels, radius)?.parts()));
    let Some(mut parts) = made else {
        return;
    };
    // Damage some stored parts, as in a corrupt file.
    for _ in 0..if draw.seldom(8) {
        draw.within(1..=4)
    } else {
        0
    } {
        match draw.within(0..=7) {
            0 => parts.radius = draw.within(0..=5),
            1 => parts.channels = draw.within(0..=5),
            2 => parts.spacing = draw.any(),
            3 => parts.gain = draw.any(),
            4 => parts.bias[0] = draw.any(),
            5 => drop(parts.features.pop()),
            6 => drop(parts.basis.pop()),
            _ => parts.grid = Grid::new(draw.shape(1..=longest), draw.flags()).unwrap(),
        }
    }
    let appearance = match Appearance::from_parts(parts) {
        Ok(appearance) => appearance,
        Err(error) => return speaks(&error),
    };

    let region = match draw.region::<D>(longest) {
        Ok(region) => region,
        Err(error) => return speaks(&error),
    };
    let n = region.grid.len();
    let own: Vec<Frame<D>> = if draw.flag() {
        (0..n).map(|_| frame(draw)).collect()
    } else {
        vec![]
    };
    let frames = if own.is_empty() {
        Frames::Constant(frame(draw))
    } else {
        Frames::Dense(&own)
    };
    let held = if draw.flag() { draw.mask(n) } else { vec![] };
    let bits = draw.within(0..=19);
    let words: Vec<u32> = draw.words(n * D).collect();
    let start: Vec<Place<D>> = words
        .as_chunks::<D>()
        .0
        .iter()
        .map(|w| w.map(|x| (x << 8) as i32 >> bits))
        .collect();
    let inside = |places: &[Place<D>]| places.iter().all(|&p| appearance.bring_inside(p) == p);
    let kept = |before: &[Place<D>], after: &[Place<D>]| {
        let mut all = held.iter().zip(before.iter().zip(after));
        all.all(|(&h, (&b, &a))| !h || appearance.bring_inside(b) == a)
    };

    // Run one of the four kernels on the analysis.
    match draw.within(0..=3) {
        0 => {
            let options = blocks::Options {
                cell: draw.within(1..=9),
                rounds: draw.within(0..=2),
                candidates: draw.within(0..=4),
                contrast: f64::from(draw.real()),
                continuation: f64::from(draw.real()),
                repetition: f64::from(draw.real()),
                seed: draw.any(),
                margin: draw.within(0..=4),
            };
            let constraints = Constraints {
                points: &held,
                places: if held.is_empty() { &[] } else { &start },
            };
            let none = None;
            let found = agreed(|m| {
                blocks::blocks(&appearance, &region, frames, none, constraints, &options, m)
            });
            assert!(found.is_none_or(|places| inside(&places) && places.len() == n));
        }
        1 => {
            let options = optimize::Options {
                passes: draw.within(0..=3),
                first: draw.any(),
                exhaustive: draw.flag(),
                reach: draw.within(0..=3) as i32,
                acceptance: f64::from(draw.real()),
                coherence: f64::from(draw.real()),
                vote: draw.within(0..=2),
                settled: f64::from(draw.real()),
                seed: draw.any(),
            };
            let found = agreed(|m| {
                let mut places = start.clone();
                let done = optimize::correct(
                    &appearance,
                    &region,
                    frames,
                    None,
                    &held,
                    &mut places,
                    &options,
                    m,
                )?;
                Ok((places, done))
            });
            assert!(found.is_none_or(|(places, _)| inside(&places) && kept(&start, &places)));
        }
        2 => {
            let (k, apart) = (draw.within(0..=6), draw.within(0..=9));
            let numbers = [coherence::FEW, 24, 9][draw.within(0..=2)];
            let Some(mut sets) = agreed(|m| similar(&appearance, k, apart, numbers, m)) else {
                return;
            };
            let samples = appearance.grid().len();
            assert!(
                sets.sets.len() == samples * k && sets.sets.iter().all(|&s| (s as usize) < samples)
            );
            if draw.seldom(8) {
                let at = draw.within(0..=sets.sets.len() - 1);
                sets.sets[at] = draw.any();
            }
            let of = |draw: &mut Draw<'_>, n: usize| -> Vec<u8> {
                draw.numbers(n, 3).map(|x| x as u8).collect()
            };
            let some = draw.flag();
            let (ours, theirs) = (of(draw, samples), of(draw, n));
            let kinds = if some {
                Kinds {
                    samples: &ours,
                    points: &theirs,
                }
            } else {
                Kinds::default()
            };
            let options = coherence::Options {
                passes: draw.within(0..=2),
                numbers,
                compensated: draw.flag(),
            };
            let reach = draw.within(0..=20 * ONE as usize) as u32;
            let (seed, level) = (draw.any(), draw.any());
            let found = agreed(|m| {
                let mut places = start.clone();
                jitter(&mut places, &region, &held, reach, seed, level)?;
                coherence::correct(
                    &appearance,
                    &sets,
                    &region,
                    frames,
                    &held,
                    kinds,
                    &mut places,
                    &options,
                    m,
                )?;
                Ok(places)
            });
            assert!(found.is_none_or(|places| inside(&places) && kept(&start, &places)));
        }
        _ => {
            let finer = Grid::new(
                region
                    .grid
                    .shape()
                    .map(|s| 2 * s - usize::from(draw.flag())),
                region.grid.wrap(),
            )
            .unwrap();
            let origin = region.origin.map(|x| x.saturating_mul(2));
            let finer = match Region::new(finer, origin) {
                Ok(finer) => finer,
                Err(error) => return speaks(&error),
            };
            let frames = if own.is_empty() {
                frames
            } else {
                Frames::Constant(own[0])
            };
            let found = agreed(|_| upsample(&start, &region, &finer, frames));
            assert!(found.is_none_or(|places| places.len() == finer.grid.len()));
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    if draw.flag() {
        check::<2>(&mut draw, 12);
    } else {
        check::<3>(&mut draw, 6);
    }
});
