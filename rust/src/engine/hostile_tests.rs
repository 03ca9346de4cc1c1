//! Tests with extreme arguments. For any numbers, the engine must return places or an error, without a panic or an
//! overflow.

use proptest::prelude::*;

use crate::engine::appearance::{Appearance, Parts};
use crate::engine::blocks::{self, Constraints};
use crate::engine::coherence::{self, Kinds, Similarity};
use crate::engine::optimize;
use crate::engine::pyramid;
use crate::foundation::fixed::{Frames, Place, identity};
use crate::foundation::grid::{Grid, Region};
use crate::foundation::hash::Noise;
use crate::foundation::par::Monitor;
use crate::{Error, Result};

const HUGE: [usize; 8] = [
    0,
    1 << 16,
    1 << 20,
    i32::MAX as usize,
    u32::MAX as usize,
    1 << 40,
    1 << 63,
    usize::MAX,
];
const ODD: [f64; 7] = [
    -1.0,
    0.0,
    1e300,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MIN_POSITIVE,
];

fn exemplar<const D: usize>(wrap: bool) -> Appearance<D> {
    let grid = Grid::new([7; D], [wrap; D]).unwrap();
    let noise = Noise::new(5);
    let colours: Vec<f32> = (0..grid.len())
        .map(|i| noise.uniform([i as u32, 0, 0, 0]) as f32)
        .collect();
    Appearance::new(&colours, grid, 1, 1).unwrap()
}

/// Draws mostly usual numbers, and sometimes a huge one.
fn count(usual: std::ops::Range<usize>) -> impl Strategy<Value = usize> {
    prop_oneof![6 => usual, 1 => prop::sample::select(HUGE.to_vec())]
}

/// Draws mostly usual costs, and sometimes an extreme one.
fn real() -> impl Strategy<Value = f64> {
    prop_oneof![6 => 0.0..2.0, 1 => prop::sample::select(ODD.to_vec())]
}

/// Draws origins, some of them near the ends of the allowed range.
fn origin() -> impl Strategy<Value = i32> {
    prop_oneof![
        4 => -20..20,
        1 => any::<i32>(),
        1 => (0..90i32).prop_map(|x| Region::<2>::FAR - x),
        1 => (0..90i32).prop_map(|x| x - Region::<2>::FAR),
        1 => (0..90i32).prop_map(|x| i32::MAX - x),
    ]
}

type Numbers = ([usize; 3], [i32; 3], [bool; 3]);

fn numbers() -> impl Strategy<Value = Numbers> {
    let side = prop_oneof![20 => 1..6usize, 1 => prop::sample::select(HUGE.to_vec())];
    (
        prop::array::uniform3(side),
        prop::array::uniform3(origin()),
        prop::array::uniform3(any::<bool>()),
    )
}

/// Creates a region from drawn numbers.
fn region<const D: usize>(numbers: &Numbers) -> Result<Region<D>> {
    let (shape, origin, wrap) = numbers;
    let grid = Grid::new(
        std::array::from_fn(|a| shape[a]),
        std::array::from_fn(|a| wrap[a]),
    )?;
    let region = Region::new(grid, std::array::from_fn(|a| origin[a]))?;
    // Skip large regions, which are valid but would take long.
    if region.grid.len() > 4096 {
        return Err(Error::value("shape", "not tried"));
    }
    Ok(region)
}

/// Draws places and frames with arbitrary numbers. There is one frame, or one for each point.
fn draw<const D: usize>(region: &Region<D>, seed: u64) -> (Vec<Place<D>>, Vec<[[i16; D]; D]>) {
    let (points, noise) = (region.grid.len().min(1000), Noise::new(seed));
    let word = |i: usize, k: usize| noise.words([i as u32, k as u32, 0, 0])[0];
    let places = (0..points)
        .map(|i| std::array::from_fn(|a| (word(i, a) as i32) >> (word(i, 3) % 20)))
        .collect();
    let frames = (0..if seed.is_multiple_of(2) { 1 } else { points })
        .map(|i| std::array::from_fn(|a| std::array::from_fn(|b| word(i, 4 + D * a + b) as i16)))
        .collect();
    (places, frames)
}

fn framed<const D: usize>(frames: &[[[i16; D]; D]], plain: bool) -> Frames<'_, D> {
    match frames {
        _ if plain => Frames::Constant(identity()),
        [one] => Frames::Constant(*one),
        all => Frames::Dense(all),
    }
}

fn start<const D: usize>(
    numbers: &Numbers,
    options: &blocks::Options,
    wrap: bool,
    plain: bool,
) -> Result<()> {
    let region = region::<D>(numbers)?;
    let (_, frames) = draw(&region, options.seed);
    let frames = framed(&frames, plain);
    let found = blocks::blocks(
        &exemplar::<D>(wrap),
        &region,
        frames,
        None,
        Constraints::NONE,
        options,
        &Monitor::default(),
    )?;
    assert_eq!(found.len(), region.grid.len());
    Ok(())
}

fn corrected<const D: usize>(
    numbers: &Numbers,
    options: &optimize::Options,
    wrap: bool,
    plain: bool,
) -> Result<()> {
    let region = region::<D>(numbers)?;
    let (mut places, frames) = draw(&region, options.seed);
    let (appearance, monitor) = (exemplar::<D>(wrap), Monitor::default());
    let frames = framed(&frames, plain);
    optimize::correct(
        &appearance,
        &region,
        frames,
        None,
        &[],
        &mut places,
        options,
        &monitor,
    )?;
    let inside = |&p: &Place<D>| appearance.bring_inside(p) == p;
    assert!(places.iter().all(inside));
    Ok(())
}

fn cohered<const D: usize>(
    numbers: &Numbers,
    options: &coherence::Options,
    k: usize,
    wrap: bool,
    seed: u64,
) -> Result<()> {
    let region = region::<D>(numbers)?;
    let (mut places, frames) = draw(&region, seed);
    let (appearance, monitor) = (exemplar::<D>(wrap), Monitor::default());
    let mut similarity = coherence::similar(&appearance, 2, 3, coherence::FEW, &monitor)?;
    if k != 2 {
        similarity = Similarity { k, ..similarity };
    }
    let most = i32::MAX as u32;
    assert!(coherence::jitter(&mut places, &region, &[], most + 1, seed, 0).is_err());
    coherence::jitter(&mut places, &region, &[], most, seed, u32::MAX)?;
    coherence::correct(
        &appearance,
        &similarity,
        &region,
        framed(&frames, false),
        &[],
        Kinds::default(),
        &mut places,
        options,
        &monitor,
    )
}

fn upsampled<const D: usize>(from: &Numbers, to: &Numbers, seed: u64) -> Result<()> {
    let (from, to) = (region::<D>(from)?, region::<D>(to)?);
    let (parents, _) = draw(&from, seed);
    let (_, frames) = draw(&to, seed);
    let found = pyramid::upsample(&parents, &from, &to, framed(&frames, false))?;
    assert_eq!(found.len(), to.grid.len());
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn blocks_for_any_numbers(
        place in numbers(),
        cell in count(2..9),
        rounds in count(1..3),
        candidates in count(1..4),
        costs in prop::array::uniform3(real()),
        margin in count(0..4),
        seed: u64,
        wrap: bool,
        plain: bool,
    ) {
        let [contrast, continuation, repetition] = costs;
        let options = blocks::Options {
            cell, rounds: rounds.min(1 << 20), candidates, contrast, continuation, repetition, seed, margin,
        };
        // Skip valid options that would take long. Still try larger numbers, which must give an error at once.
        if rounds.saturating_mul(candidates) < 100 || rounds > 1 << 15 || candidates > 1 << 15 {
            let _ = start::<2>(&place, &options, wrap, plain);
            let _ = start::<3>(&place, &options, wrap, plain);
        }
    }

    #[test]
    fn corrections_for_any_numbers(
        place in numbers(),
        passes in 0usize..4,
        first: u32,
        exhaustive: bool,
        reach in prop_oneof![6 => 1..3i32, 1 => any::<i32>()],
        costs in prop::array::uniform3(real()),
        vote in count(0..2),
        seed: u64,
        wrap: bool,
        plain: bool,
    ) {
        let [acceptance, coherence, settled] = costs;
        let options = optimize::Options {
            passes, first, exhaustive, reach, acceptance, coherence, vote, settled, seed,
        };
        let _ = corrected::<2>(&place, &options, wrap, plain);
        let _ = corrected::<3>(&place, &options, wrap, plain);
    }

    #[test]
    fn coherence_for_any_numbers(
        place in numbers(),
        passes in 0usize..3,
        numbers in prop::sample::select(vec![0usize, 8, 24, usize::MAX]),
        compensated: bool,
        k in prop_oneof![4 => Just(2usize), 1 => prop::sample::select(HUGE.to_vec())],
        seed: u64,
        wrap: bool,
    ) {
        let options = coherence::Options { passes, numbers, compensated };
        let _ = cohered::<2>(&place, &options, k, wrap, seed);
        let _ = cohered::<3>(&place, &options, k, wrap, seed);
    }

    #[test]
    fn similarity_for_any_numbers(k in count(1..5), n in count(1..9), wrap: bool) {
        let _ = coherence::similar(&exemplar::<2>(wrap), k, n, coherence::FEW, &Monitor::default());
    }

    #[test]
    fn upsampling_for_any_numbers(from in numbers(), to in numbers(), related: bool, seed: u64) {
        let (shape, origin, _) = to;
        let from = if related {
            let half = |a: usize| shape[a].min(1 << 40) / 2 + 1;
            ([half(0), half(1), half(2)], origin.map(|x| x.div_euclid(2)), from.2)
        } else {
            from
        };
        let _ = upsampled::<2>(&from, &to, seed);
        let _ = upsampled::<3>(&from, &to, seed);
    }
}

#[test]
fn regions_that_no_memory_holds_are_refused() {
    let options = blocks::Options {
        cell: 8,
        rounds: 1,
        candidates: 1,
        contrast: 0.5,
        continuation: 0.5,
        repetition: 0.0,
        seed: 0,
        margin: 0,
    };
    for side in [1 << 20, 1 << 31, 1 << 40] {
        let place = ([side, side, 1], [0; 3], [false; 3]);
        assert!(start::<2>(&place, &options, false, true).is_err());
    }
    let place = ([8, 8, 1], [i32::MAX - 3, 0, 0], [false; 3]);
    assert!(start::<2>(&place, &options, false, true).is_err());
}

#[test]
fn exemplars_that_places_cannot_address_are_refused() {
    let long = |n: usize, wrap| {
        let grid = Grid::new([4, n], [wrap; 2]).unwrap();
        Appearance::new(&vec![0.0; grid.len()], grid, 1, 1)
    };
    for wrap in [false, true] {
        assert!(matches!(
            long((1 << 18) + 1, wrap),
            Err(Error::Limit { .. })
        ));
    }
    for radius in [0, 1 << 31, 1 << 62, usize::MAX] {
        let grid = Grid::new([9; 2], [false; 2]).unwrap();
        assert!(Appearance::new(&[0.5; 81], grid, 1, radius).is_err());
    }
    // The number of samples times channels overflows to zero.
    let grid = Grid::new([1 << 31, 1 << 31], [true; 2]).unwrap();
    assert!(Appearance::new(&[], grid, 4, 1).is_err());
}

#[test]
fn analyses_with_extreme_numbers_are_refused_or_used() {
    let good = exemplar::<2>(false).parts();
    let changed = |change: &dyn Fn(&mut Parts<2>)| {
        let mut parts = good.clone();
        change(&mut parts);
        Appearance::from_parts(parts)
    };
    assert!(changed(&|p| p.bias[0] = i64::MIN).is_err());
    assert!(changed(&|p| p.gain = i64::MAX).is_err());
    assert!(changed(&|p| p.radius = usize::MAX).is_err());
    assert!(changed(&|p| p.channels = usize::MAX).is_err());
    assert!(changed(&|p| p.spacing = i32::MIN).is_err());
    let extreme = changed(&|p| {
        p.bias.fill(1 << 31);
        p.gain = 1 << 32;
        p.spacing = i32::MAX;
    })
    .unwrap();
    let mut window = extreme.scratch();
    window.fill(-2047);
    extreme.project(&mut window);
}
