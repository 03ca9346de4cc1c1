//! Fuzzes the search for best matches. The result must be the same as if every position were
//! scored.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::patch_search::{Exemplar, Index, Pick, Query};
use texrs_fuzz::{Draw, agreed, near, speaks};

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    let channels = draw.within(0..=3);
    let exemplars: Vec<Exemplar> = (0..draw.within(0..=3))
        .map(|_| {
            let shape = draw.shape(1..=24);
            let n: usize = shape.iter().product();
            let scale = [1.0, 255.0, 1e-6, 1e12][draw.within(0..=3)];
            Exemplar {
                data: draw
                    .reals(n * channels)
                    .iter()
                    .map(|x| x * scale)
                    .collect::<Vec<_>>()
                    .into(),
                shape,
                allowed: draw.flag().then(|| draw.mask(n)),
            }
        })
        .collect();
    let max_patch = draw.shape(0..=18);
    let shapes: Vec<_> = exemplars
        .iter()
        .map(|e| (e.shape, e.allowed.clone()))
        .collect();
    let index = match Index::new(exemplars, channels, max_patch) {
        Ok(index) => index,
        Err(error) => return speaks(&error),
    };
    for _ in 0..draw.within(1..=2) {
        let shape = draw.shape(1..=18);
        let n: usize = shape.iter().product();
        let patch = draw.reals(n * channels);
        let weight = if draw.flag() {
            draw.reals(n)
        } else {
            draw.mask(n).iter().map(|&m| f32::from(m)).collect()
        };
        let query = Query {
            patch: &patch,
            weight: &weight,
            shape,
        };
        let pick = Pick {
            count: draw.within(0..=6),
            separation: draw.within(0..=5),
            ratio: if draw.flag() {
                f64::INFINITY
            } else {
                1.0 + f64::from(draw.real())
            },
        };
        let Some(best) = agreed(|monitor| index.best(&query, &pick, monitor)) else {
            continue;
        };
        // List all allowed positions.
        let mut all = Vec::new();
        for (e, ([rows, columns], allowed)) in shapes.iter().enumerate() {
            for row in 0..(rows + 1).saturating_sub(shape[0]) {
                for column in 0..(columns + 1).saturating_sub(shape[1]) {
                    if allowed.as_ref().is_none_or(|a| a[row * columns + column]) {
                        all.push([e, row, column]);
                    }
                }
            }
        }
        let scored = index.best_among(&query, &all, &pick).unwrap();
        assert_eq!(format!("{best:?}"), format!("{scored:?}"));
        let good = agreed(|monitor| index.good(&query, &pick, monitor))
            .expect("good matches if there are best ones");
        assert!(good.len() <= pick.count && good.is_empty() == best.is_empty());
        for m in &good {
            assert!(m.cost >= best[0].cost && all.contains(&[m.exemplar, m.row, m.column]));
            let cost = index.at(&query, m.exemplar, m.row, m.column).unwrap();
            assert!(near(cost, m.cost, 1e-12));
        }
    }
});
