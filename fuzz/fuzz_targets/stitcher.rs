//! Fuzzes the stitcher with arbitrary sources, frames and options. Every point that is not held
//! must show a patch, and held points that are not loose must not change.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::fixed::{Frame, Frames, Place, identity};
use texrs::grid::Grid;
use texrs::stitcher::{
    Adjacency, Elements, Given, Options, Pasting, Samples, Source, Weights, stitch,
};
use texrs_fuzz::{Draw, agreed, speaks};

fn weights(draw: &mut Draw<'_>) -> Weights {
    Weights {
        colour: draw.real(),
        contact: draw.real(),
        jump: draw.real(),
        depth: draw.real(),
        joint: draw.real(),
        presence: draw.real(),
        surprise: draw.real(),
        distortion: draw.real(),
        guide: draw.real(),
    }
}

fn frame<const D: usize>(draw: &mut Draw<'_>) -> Frame<D> {
    if draw.seldom(8) {
        return std::array::from_fn(|_| std::array::from_fn(|_| draw.any()));
    }
    let bent = draw.flag();
    identity::<D>()
        .map(|row| row.map(|x| x + (draw.within(0..=2000) as i16 - 1000) * i16::from(bent)))
}

fn filled<const D: usize>(draw: &mut Draw<'_>, longest: usize) {
    let exemplar = Grid::new(draw.shape::<D>(1..=longest), draw.flags()).unwrap();
    let (samples, channels) = (exemplar.len(), draw.within(0..=4));
    let colours = draw.reals(samples * channels);
    let known = draw.flag();
    let most = draw.within(1..=6) as u32;
    let labels: Vec<u32> = draw
        .numbers(if known { samples } else { 0 }, most)
        .collect();
    let depth: Vec<f32> = if known {
        draw.reals(samples).iter().map(|d| d * 8.0).collect()
    } else {
        vec![]
    };
    let judged = draw.flag();
    let classes: Vec<u8> = draw
        .numbers(if judged { samples } else { 0 }, 3)
        .map(|c| c as u8)
        .collect();
    let costs = draw.reals(if judged { 9 } else { 0 });
    let elements = Elements {
        labels: &labels,
        depth: &depth,
    };
    let source = match Source::new(
        &colours,
        exemplar,
        channels,
        elements,
        Adjacency {
            classes: &classes,
            costs: &costs,
        },
    ) {
        Ok(source) => source,
        Err(error) => return speaks(&error),
    };
    let region = match draw.region::<D>(longest) {
        Ok(region) => region,
        Err(error) => return speaks(&error),
    };
    let n = region.grid.len();
    // Use at most three different frames: this is realistic, and needs only few bytes of the input.
    let kinds: Vec<Frame<D>> = (0..draw.within(1..=3)).map(|_| frame(draw)).collect();
    let own: Vec<Frame<D>> = draw
        .numbers(n, kinds.len() as u32)
        .map(|k| kinds[k as usize])
        .collect();
    let frames = if draw.flag() {
        Frames::Constant(kinds[0])
    } else {
        Frames::Dense(&own)
    };
    let held = if draw.flag() { draw.mask(n) } else { vec![] };
    let loose = if draw.flag() && !held.is_empty() {
        draw.mask(n)
    } else {
        vec![]
    };
    let bits = draw.within(0..=15);
    let words: Vec<u32> = draw.words(held.len() * D).collect();
    let places: Vec<Place<D>> = words
        .as_chunks::<D>()
        .0
        .iter()
        .map(|w| w.map(|x| (x << 8) as i32 >> bits))
        .collect();
    let given = Given {
        points: &held,
        places: &places,
        loose: &loose,
    };
    // Stitch, and check each point.
    let options = Options {
        patch: 3.0 + draw.within(0..=12) as f32,
        overlap: draw.real() * 0.85,
        candidates: draw.within(0..=3),
        bend: draw.flag(),
        weights: weights(draw),
        repetition: draw.real(),
        continuation: draw.real() * 8.0,
        balance: draw.real() * 4.0,
        recover: draw.real(),
        heal: draw.flag(),
        lattice: (D == 2 && draw.flag())
            .then(|| [(); 2].map(|()| [(); 2].map(|()| f64::from(draw.real()) * 20.0))),
        seed: draw.any(),
    };
    let Some(found) =
        agreed(|monitor| stitch(&source, &region, frames, None, given, &options, monitor))
    else {
        return;
    };
    assert_eq!([found.places.len(), found.patches.len()], [n; 2]);
    assert!(found.seams.is_finite() && found.seams >= 0.0);
    for p in 0..n {
        let stays = held.get(p) == Some(&true) && loose.get(p) != Some(&true);
        let of_patch = (found.patches[p] as usize) < found.frames.len();
        assert!(
            of_patch || held.get(p) == Some(&true),
            "point {p} shows nothing"
        );
        assert!(!(stays && of_patch), "held point {p} changed");
    }
}

/// Fuzzes `Samples`: unwarped patches are judged, and inserted into a window along minimum cuts.
fn pasted(draw: &mut Draw<'_>) {
    let (count, channels) = (draw.within(0..=40), draw.within(0..=4));
    let colours = draw.reals(count * channels);
    let depth: Vec<f32> = draw.reals(count).iter().map(|d| d * 8.0).collect();
    let samples = match Samples::new(&colours, channels, &depth, weights(draw)) {
        Ok(samples) => samples,
        Err(error) => return speaks(&error),
    };
    let shape = draw.shape::<2>(0..=12);
    let n = shape[0] * shape[1];
    let most = count as u32 + u32::from(draw.seldom(16));
    let some = draw.mask(n);
    let sample = |draw: &mut Draw<'_>| -> Vec<u32> { draw.numbers(n, most).collect() };
    // Points with the number `u32::MAX` do not show a sample yet.
    let shown: Vec<u32> = sample(draw)
        .iter()
        .zip(&some)
        .map(|(&s, &b)| if b { s } else { u32::MAX })
        .collect();
    let seams: Vec<[f32; 2]> = draw.reals(2 * n).as_chunks().0.to_vec();
    let mask = draw.mask(n);
    let core: Vec<bool> = draw
        .mask(n)
        .iter()
        .zip(&mask)
        .map(|(c, m)| *c && *m)
        .collect();
    let pasting = Pasting {
        shape,
        shown: &shown,
        seams: &seams,
        mask: &mask,
        core: &core,
    };
    let patches: Vec<Vec<u32>> = (0..draw.within(1..=2)).map(|_| sample(draw)).collect();
    let views: Vec<&[u32]> = patches.iter().map(|p| &p[..]).collect();
    // Judged values must not be NaN. A cut must take the whole core, and nothing outside the mask.
    if let Some(values) = agreed(|monitor| samples.judge(&pasting, &views, monitor)) {
        assert!(values.iter().all(|v| !v.is_nan()));
    }
    if let Some(found) = agreed(|monitor| samples.cut(&pasting, &patches[0], monitor)) {
        for p in 0..n {
            assert!(
                found.take[p] <= mask[p] && found.take[p] >= core[p],
                "point {p}"
            );
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    match draw.within(0..=3) {
        0 => filled::<3>(&mut draw, 8),
        1 => pasted(&mut draw),
        _ => filled::<2>(&mut draw, 24),
    }
});
