use super::*;
use crate::foundation::fixed::{ONE, identity, nearest, sub};
use crate::foundation::grid::Grid;
use crate::foundation::hash::Noise;

fn exemplar<const D: usize>(side: usize) -> Appearance<D> {
    let grid = Grid::new([side; D], [false; D]).unwrap();
    let noise = Noise::new(4);
    let colours: Vec<f32> = (0..grid.len())
        .map(|i| {
            let wave: f64 = grid.point(i).iter().map(|&x| (x as f64 * 0.6).sin()).sum();
            (wave + 0.2 * noise.uniform([i as u32, 0, 0, 0])) as f32
        })
        .collect();
    Appearance::new(&colours, grid, 1, 2).unwrap()
}

const OPTIONS: Options = Options {
    passes: 6,
    first: 0,
    exhaustive: false,
    reach: 2,
    acceptance: 2.0,
    coherence: 0.2,
    vote: 1,
    settled: 0.0,
    seed: 1,
};

fn start<const D: usize>(region: &Region<D>, side: usize) -> Vec<Place<D>> {
    let noise = Noise::new(9);
    (0..region.grid.len())
        .map(|p| {
            let words = noise.at(region.world(region.grid.point(p)), 0);
            std::array::from_fn(|axis| (words[axis] as i32).rem_euclid(side as i32) * ONE)
        })
        .collect()
}

fn region<const D: usize>(side: usize, wrap: bool, origin: i32) -> Region<D> {
    Region::new(Grid::new([side; D], [wrap; D]).unwrap(), [origin; D]).unwrap()
}

fn mean_cost<const D: usize>(
    exemplar: &Appearance<D>,
    region: &Region<D>,
    places: &[Place<D>],
) -> f64 {
    let level = Level {
        appearance: exemplar,
        region,
        frames: Frames::Constant(identity()),
        guide: None,
        held: &[],
        options: &OPTIONS,
        around: around(),
        recent: Recent::new(places.len(), 0),
    };
    let mut seen = gather::Seen::default();
    seen.look(&level, places, 0..places.len());
    let mut eye = gather::Eye::new(&level, &seen);
    let sum: f64 = (0..places.len())
        .map(|p| {
            let own = exemplar.feature(exemplar.clamped(nearest(places[p])));
            f64::from(crate::engine::appearance::distance(
                &eye.window(places, p),
                own,
            ))
        })
        .sum();
    sum / places.len() as f64
}

#[test]
fn an_exact_copy_stays() {
    let (exemplar, region) = (exemplar::<2>(32), region(20, false, 0));
    let copy: Vec<Place<2>> = (0..400)
        .map(|i| [(i / 20 + 6) * ONE, (i % 20 + 5) * ONE])
        .collect();
    let mut places = copy.clone();
    let frames = Frames::Constant(identity());
    let (_, changed) = correct(
        &exemplar,
        &region,
        frames,
        None,
        &[],
        &mut places,
        &OPTIONS,
        &Monitor::default(),
    )
    .unwrap();
    assert_eq!(changed, 0.0);
    assert_eq!(places, copy);
}

#[test]
fn correction_lowers_the_cost_in_both_dimensions() {
    fn check<const D: usize>(side: usize, out: usize) {
        let (exemplar, region) = (exemplar::<D>(side), region::<D>(out, false, 0));
        let mut places = start(&region, side);
        for place in &mut places {
            *place = exemplar.bring_inside(*place);
        }
        let before = mean_cost(&exemplar, &region, &places);
        let frames = Frames::Constant(identity());
        let options = Options {
            passes: 12,
            acceptance: 0.5,
            ..OPTIONS
        };
        correct(
            &exemplar,
            &region,
            frames,
            None,
            &[],
            &mut places,
            &options,
            &Monitor::default(),
        )
        .unwrap();
        let after = mean_cost(&exemplar, &region, &places);
        assert!(after * 3.0 < before, "{D}: {before} {after}");
        assert!(
            places
                .iter()
                .all(|&p| exemplar.inside(nearest(p)).is_some())
        );
    }
    check::<2>(32, 40);
    check::<3>(16, 18);
}

#[test]
fn dense_and_constant_frames_agree() {
    let (exemplar, region) = (exemplar::<2>(32), region(24, false, 0));
    let turn = [[3547, -2048], [2048, 3547]];
    for frame in [identity(), turn] {
        let dense = vec![frame; region.grid.len()];
        let [a, b] = [Frames::Constant(frame), Frames::Dense(&dense)].map(|frames| {
            let mut places = start(&region, 32);
            correct(
                &exemplar,
                &region,
                frames,
                None,
                &[],
                &mut places,
                &OPTIONS,
                &Monitor::default(),
            )
            .unwrap();
            places
        });
        assert_eq!(a, b);
    }
}

#[test]
fn a_window_is_the_same_wherever_it_is_seen_from() {
    // In a pass, a point depends on points up to three away: two for a window or a neighbour's match, and one for the
    // vote.
    let pad = 3 * OPTIONS.passes as i32;
    let exemplar = exemplar::<2>(32);
    let [a, b] = [0, 9].map(|extra| {
        let region: Region<2> = region((16 + 2 * (pad + extra)) as usize, false, -pad - extra);
        let mut places = start(&region, 32);
        let frames = Frames::Constant(identity());
        correct(
            &exemplar,
            &region,
            frames,
            None,
            &[],
            &mut places,
            &OPTIONS,
            &Monitor::default(),
        )
        .unwrap();
        let inner = |i: i32| {
            [
                (i / 16 + pad + extra) as usize,
                (i % 16 + pad + extra) as usize,
            ]
        };
        (0..256)
            .map(|i| places[region.grid.index(inner(i))])
            .collect::<Vec<_>>()
    });
    assert_eq!(a, b);
}

#[test]
fn rings_and_threads_change_nothing() {
    let exemplar = exemplar::<3>(16);
    let region: Region<3> = region(20, true, 0);
    let results = [1, 2, 7].map(|threads| {
        par::install(threads, || {
            let mut places = start(&region, 16);
            let frames = Frames::Constant(identity());
            correct(
                &exemplar,
                &region,
                frames,
                None,
                &[],
                &mut places,
                &OPTIONS,
                &Monitor::default(),
            )
            .unwrap();
            places
        })
        .unwrap()
    });
    assert_eq!(results[0], results[1]);
    assert_eq!(results[0], results[2]);
}

#[test]
fn held_points_keep_their_places() {
    let (exemplar, region) = (exemplar::<2>(32), region(24, false, 0));
    let mut places = start(&region, 32);
    for place in &mut places {
        *place = exemplar.bring_inside(*place);
    }
    let (before, held): (Vec<_>, Vec<_>) = (places.clone(), (0..576).map(|i| i % 7 == 0).collect());
    let frames = Frames::Constant(identity());
    correct(
        &exemplar,
        &region,
        frames,
        None,
        &held,
        &mut places,
        &OPTIONS,
        &Monitor::default(),
    )
    .unwrap();
    for p in 0..576 {
        assert!(!held[p] || places[p] == before[p]);
    }
    assert!(
        places
            .iter()
            .zip(&before)
            .any(|(a, b)| sub(*a, *b) != [0; 2])
    );
}
