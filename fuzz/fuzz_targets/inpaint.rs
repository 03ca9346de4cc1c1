//! Fuzzes the filling of holes. Afterwards all pixels must be known, kept pixels must be unchanged,
//! and each filled pixel must be a copy of a pixel of an exemplar.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::grid::Grid;
use texrs::inpaint::{Canvas, Options, inpaint};
use texrs::patch_search::{Exemplar, Index, Pick};
use texrs_fuzz::{Draw, agreed, speaks};

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    let grid = Grid::new(draw.shape::<2>(1..=14), draw.flags()).unwrap();
    let (n, channels) = (grid.len(), draw.within(1..=3));
    let colours = draw.reals(n * channels);
    let known = draw.mask(n);
    let patch = draw.shape(0..=8);
    let shown = draw.flag();
    let exemplars: Vec<Exemplar> = (0..draw.within(1..=2))
        .map(|k| {
            let own = shown && k == 0;
            let shape = if own {
                grid.shape()
            } else {
                draw.shape(1..=14)
            };
            let n: usize = shape.iter().product();
            Exemplar {
                data: draw.values(n * channels).into(),
                shape,
                allowed: draw.flag().then(|| draw.mask(n)),
            }
        })
        .collect();
    let data: Vec<_> = exemplars
        .iter()
        .map(|e| (e.data.clone(), e.shape))
        .collect();
    let index = match Index::new(exemplars, channels, patch) {
        Ok(index) => index,
        Err(error) => return speaks(&error),
    };
    let keep = draw.flag().then(|| draw.mask(n));
    let options = Options {
        patch,
        pick: Pick {
            count: draw.within(0..=5),
            separation: draw.within(0..=4),
            ratio: 1.0 + f64::from(draw.real()) * 3.0,
        },
        seed: draw.any(),
        paper: draw.flag(),
        shown: shown.then_some(0),
    };
    // One and two threads must agree.
    let found = agreed(|monitor| {
        let (mut colours, mut known) = (colours.clone(), known.clone());
        let mut canvas = Canvas {
            grid,
            colours: &mut colours,
            known: &mut known,
            keep: keep.as_deref(),
            channels,
        };
        let done = inpaint(&mut canvas, &index, &options, monitor)?;
        Ok((colours, known, done))
    });
    let Some((filled, all, done)) = found else {
        return;
    };
    // Compare each filled pixel with the exemplar pixel in the patch that its label refers to.
    assert!(all.iter().all(|k| *k));
    for p in 0..n {
        let pixel = p * channels..(p + 1) * channels;
        let stays = known[p] && keep.as_ref().is_some_and(|keep| keep[p]);
        let label = done.label[p];
        assert!(
            !(stays && label >= 0) && (label >= 0 || known[p]),
            "pixel {p}"
        );
        let expected = if label < 0 {
            &colours[pixel.clone()]
        } else {
            let from = done.patches[label as usize];
            let point = grid.point(p);
            let away: [usize; 2] = std::array::from_fn(|a| {
                let size = grid.shape()[a];
                (point[a] + size - from.to[a] % size) % size
            });
            let (samples, shape) = &data[from.exemplar];
            let at = (from.from[0] + away[0]) * shape[1] + from.from[1] + away[1];
            &samples[at * channels..][..channels]
        };
        assert!(
            filled[pixel]
                .iter()
                .zip(expected)
                .all(|(a, b)| a.to_bits() == b.to_bits()),
            "pixel {p}"
        );
    }
});
