use super::*;
use proptest::prelude::*;

/// Returns all costs, computed one by one in `f64`.
fn naive(exemplars: &[Exemplar], channels: usize, query: &Query<'_>) -> Vec<Match> {
    let [p, q] = query.shape;
    let mut all = Vec::new();
    for (exemplar, e) in exemplars.iter().enumerate() {
        for row in 0..(e.shape[0] + 1).saturating_sub(p) {
            for column in 0..(e.shape[1] + 1).saturating_sub(q) {
                if let Some(allowed) = &e.allowed
                    && !allowed[row * e.shape[1] + column]
                {
                    continue;
                }
                // Samples of weight 0 may be NaN, so they are skipped.
                let mut cost = 0.0;
                for i in 0..p {
                    for j in 0..q {
                        for c in 0..channels {
                            let s = e.data[((row + i) * e.shape[1] + column + j) * channels + c];
                            let d =
                                f64::from(query.patch[(i * q + j) * channels + c]) - f64::from(s);
                            let w = f64::from(query.weight[i * q + j]);
                            cost += if w > 0.0 { w * d * d } else { 0.0 };
                        }
                    }
                }
                all.push(Match {
                    cost,
                    exemplar,
                    row,
                    column,
                });
            }
        }
    }
    all.sort_by(order);
    all
}

fn noise(n: usize, seed: u64, levels: u64) -> Vec<f32> {
    let noise = crate::foundation::hash::Noise::new(seed);
    (0..n)
        .map(|i| noise.below(levels, [i as u32, 0, 0, 0]) as f32)
        .collect()
}

fn exemplar(shape: [usize; 2], channels: usize, seed: u64, levels: u64) -> Exemplar {
    Exemplar {
        data: noise(shape[0] * shape[1] * channels, seed, levels).into(),
        shape,
        allowed: None,
    }
}

fn best(index: &Index, query: &Query<'_>, pick: &Pick) -> Vec<Match> {
    let monitor = Monitor::default();
    par::install(2, || index.best(query, pick, &monitor))
        .unwrap()
        .unwrap()
}

#[test]
fn a_copied_patch_is_found_where_it_was_taken() {
    let all = vec![
        exemplar([70, 90], 3, 1, 256),
        exemplar([100, 64], 3, 2, 256),
    ];
    let mut patch = Vec::new();
    for r in 0..20 {
        patch.extend_from_slice(&all[1].data[((30 + r) * 64 + 17) * 3..][..24 * 3]);
    }
    let index = Index::new(all, 3, [32, 32]).unwrap();
    let query = Query {
        patch: &patch,
        weight: &[0.25; 20 * 24],
        shape: [20, 24],
    };
    let found = best(&index, &query, &Pick::default());
    let there = Match {
        cost: 0.0,
        exemplar: 1,
        row: 30,
        column: 17,
    };
    assert_eq!(found, [there]);
    assert_eq!(index.at(&query, 1, 30, 17), Ok(0.0));
}

#[test]
fn half_the_resolution_finds_what_is_there() {
    let wave = |r: usize, c: usize| (r as f32 / 5.0).sin() * 90.0 + (c as f32 / 7.0).cos() * 60.0;
    let mut e = exemplar([90, 81], 1, 5, 40);
    for (i, x) in Arc::make_mut(&mut e.data).iter_mut().enumerate() {
        *x += wave(i / 81, i % 81);
    }
    let index = Index::new(vec![exemplar([40, 33], 1, 2, 256), e.clone()], 1, [33, 33]).unwrap();
    let monitor = Monitor::default();
    for (row, column, side) in [
        (20, 31, 32),
        (33, 8, 17),
        (0, 0, 33),
        (58, 49, 16),
        (7, 7, 9),
    ] {
        // Cut a patch out of the exemplar, and search for it.
        let patch: Vec<f32> = (0..side * side)
            .map(|i| e.data[(row + i / side) * 81 + column + i % side])
            .collect();
        let weight: Vec<f32> = (0..side * side).map(|i| (i % 3) as f32).collect();
        let query = Query {
            patch: &patch,
            weight: &weight,
            shape: [side; 2],
        };
        let pick = Pick {
            count: 5,
            separation: 4,
            ratio: f64::INFINITY,
        };
        let by_pool: Vec<_> = [1, 2, 7]
            .map(|n| {
                par::install(n, || index.good(&query, &pick, &monitor))
                    .unwrap()
                    .unwrap()
            })
            .into();
        // The result is the same for any number of threads, and its best match is the patch itself.
        assert!(by_pool.iter().all(|found| *found == by_pool[0]));
        let best = by_pool[0][0];
        assert_eq!(
            (best.exemplar, best.row, best.column, best.cost),
            (1, row, column, 0.0)
        );
        assert!(by_pool[0].is_sorted_by(|a, b| order(a, b).is_lt()));
        for m in &by_pool[0] {
            assert_eq!(
                m.cost,
                index.at(&query, m.exemplar, m.row, m.column).unwrap()
            );
        }
    }
}

#[test]
fn half_the_resolution_keeps_to_what_is_allowed() {
    let mut e = exemplar([64, 64], 2, 5, 256);
    let mut allowed = vec![false; 64 * 64];
    for at in [3 * 64 + 5, 21 * 64 + 40, 48 * 64 + 48] {
        allowed[at] = true;
    }
    e.allowed = Some(allowed.clone());
    let index = Index::new(vec![e], 2, [16, 16]).unwrap();
    let (patch, weight) = (noise(16 * 16 * 2, 9, 256), vec![1.0; 16 * 16]);
    let mut query = Query {
        patch: &patch,
        weight: &weight,
        shape: [16, 16],
    };
    let pick = Pick {
        count: 9,
        ..Pick::default()
    };
    let found = index.good(&query, &pick, &Monitor::default()).unwrap();
    assert_eq!(found.len(), 3);
    assert!(found.iter().all(|m| allowed[m.row * 64 + m.column]));
    query.shape = [16, 15];
    assert!(index.good(&query, &pick, &Monitor::default()).is_err());
    query.shape = [usize::MAX, 16];
    assert!(index.good(&query, &pick, &Monitor::default()).is_err());
}

#[test]
fn few_allowed_positions_are_scored_one_by_one() {
    // The larger exemplars have several blocks.
    let mut all = vec![
        exemplar([30, 200], 2, 1, 9),
        exemplar([190, 170], 2, 2, 9),
        exemplar([20, 20], 2, 3, 9),
    ];
    for (e, part) in all.iter_mut().zip([40, 9, 2]) {
        let noise = noise(e.shape[0] * e.shape[1], 7, part);
        e.allowed = Some(noise.iter().map(|&x| x == 0.0).collect());
    }
    let (patch, weight) = (noise(9 * 7 * 2, 4, 9), noise(9 * 7, 5, 3));
    let query = Query {
        patch: &patch,
        weight: &weight,
        shape: [9, 7],
    };
    let wanted = naive(&all, 2, &query);
    let index = Index::new(all, 2, [12, 12]).unwrap();
    assert!(index.open[0].is_some() && index.open[1].is_some() && index.open[2].is_none());
    let pick = Pick {
        count: 40,
        ..Pick::default()
    };
    assert_eq!(best(&index, &query, &pick), wanted[..40]);
}

#[test]
fn an_index_made_again_finds_what_a_new_one_finds() {
    let mut all = vec![exemplar([70, 90], 3, 1, 256), exemplar([64, 50], 3, 2, 256)];
    let first = Index::new(all.clone(), 3, [40, 40]).unwrap();
    let samples = noise(24 * 20 * 3, 3, 256);
    let query = Query {
        patch: &samples,
        weight: &[1.0; 24 * 20],
        shape: [24, 20],
    };
    let pick = Pick {
        count: 9,
        separation: 4,
        ratio: 3.0,
    };
    let good = |index: &Index| {
        let monitor = Monitor::default();
        par::install(2, || index.good(&query, &pick, &monitor))
            .unwrap()
            .unwrap()
    };
    good(&first);
    all[0].allowed = Some((0..70 * 90).map(|i| i % 3 > 0).collect());
    let masks = all.iter().map(|e| e.allowed.clone()).collect();
    let again = first.again(masks, [24, 24]).unwrap();
    let new = Index::new(all, 3, [24, 24]).unwrap();
    assert_eq!(good(&again), good(&new));
    assert_eq!(best(&again, &query, &pick), best(&new, &query, &pick));
    assert!(first.again(vec![None], [24, 24]).is_err());
    assert!(first.again(vec![None, Some(vec![true])], [24, 24]).is_err());
}

#[test]
fn flat_exemplars_and_unknown_patches_give_the_first_positions() {
    let flat = Exemplar {
        data: vec![3.0; 40 * 50].into(),
        shape: [40, 50],
        allowed: None,
    };
    let index = Index::new(vec![flat], 1, [16, 16]).unwrap();
    let pick = Pick {
        count: 2,
        separation: 4,
        ratio: 2.0,
    };
    for (value, weight) in [(3.0, 1.0), (5.0, 1.0), (f32::NAN, 0.0)] {
        let query = Query {
            patch: &[value; 256],
            weight: &[weight; 256],
            shape: [16, 16],
        };
        let found = best(&index, &query, &pick);
        assert_eq!((found[0].row, found[0].column), (0, 0));
        assert_eq!((found[1].row, found[1].column), (0, 5));
    }
}

#[test]
fn the_extremes_of_f32_neither_panic_nor_lose_the_minimum() {
    for (high, low) in [(1e38f32, 1.0f32), (1e-38, 1e-40), (1.0, 1e30), (1.0, 1e-30)] {
        let mut e = exemplar([60, 60], 1, 3, 100);
        Arc::make_mut(&mut e.data)
            .iter_mut()
            .for_each(|x| *x *= high / 100.0);
        let patch: Vec<f32> = noise(144, 5, 50).iter().map(|x| x * low).collect();
        let query = Query {
            patch: &patch,
            weight: &[1e-3; 144],
            shape: [12, 12],
        };
        let expected = naive(std::slice::from_ref(&e), 1, &query)[0];
        let index = Index::new(vec![e], 1, [12, 12]).unwrap();
        let found = best(&index, &query, &Pick::default())[0];
        assert!((found.cost - expected.cost).abs() <= 1e-12 * expected.cost);
    }
}

#[test]
fn refuses_what_cannot_be_searched() {
    let index = Index::new(vec![exemplar([20, 30], 1, 1, 9)], 1, [8, 8]).unwrap();
    let monitor = Monitor::default();
    let ask = |patch: &[f32], weight: &[f32], shape| {
        let query = Query {
            patch,
            weight,
            shape,
        };
        index.best(&query, &Pick::default(), &monitor)
    };
    assert!(ask(&[0.0; 9 * 8], &[1.0; 9 * 8], [9, 8]).is_err());
    assert!(ask(&[0.0; 40], &[1.0; 40], [40, 1]).is_err());
    assert!(ask(&[0.0; 4], &[1.0; 3], [2, 2]).is_err());
    assert!(ask(&[0.0; 4], &[-1.0; 4], [2, 2]).is_err());
    assert!(ask(&[f32::NAN; 4], &[1.0; 4], [2, 2]).is_err());
    assert!(ask(&[], &[], [0, 2]).is_err());
    assert!(Index::new(vec![], 1, [8, 8]).is_err());
    monitor.cancel();
    assert!(matches!(
        ask(&[0.0; 64], &[1.0; 64], [8, 8]),
        Err(Error::Cancelled(_))
    ));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn agrees_with_the_naive_search(
        shapes in prop::collection::vec([4usize..48, 4usize..48], 1..4),
        patch in [1usize..13, 1usize..13],
        channels in 1usize..5,
        levels in prop::sample::select(vec![2u64, 5, 256]),
        count in 1usize..6,
        separation in 0usize..6,
        ratio in prop::sample::select(vec![1.0, 1.5, 3.0, f64::INFINITY]),
        seed: u64,
        masked: bool,
    ) {
        let mut all: Vec<_> = shapes.iter().enumerate()
            .map(|(i, &s)| exemplar(s, channels, seed ^ i as u64, levels)).collect();
        if masked {
            let allowed = noise(all[0].shape[0] * all[0].shape[1], seed ^ 99, 2);
            all[0].allowed = Some(allowed.iter().map(|&x| x > 0.0).collect());
        }
        let [p, q] = patch;
        let samples = noise(p * q * channels, seed ^ 77, levels);
        let weight = noise(p * q, seed ^ 78, 3);
        let query = Query { patch: &samples, weight: &weight, shape: patch };
        let pick = Pick { count, separation, ratio };
        let fits = shapes.iter().any(|s| s[0] >= p && s[1] >= q);
        let reference = naive(&all, channels, &query);
        let index = Index::new(all, channels, [12, 12]).unwrap();
        let monitor = Monitor::default();
        let by_pool: Vec<_> = [1, 2, 7].iter()
            .map(|&n| par::install(n, || index.best(&query, &pick, &monitor)).unwrap()).collect();
        prop_assert!(by_pool.iter().all(|f| *f == by_pool[0]));
        prop_assert_eq!(by_pool[0].is_ok(), fits);
        if let Ok(found) = &by_pool[0] {
            let mut expected: Vec<Match> = Vec::new();
            for m in reference {
                if expected.len() == count || expected.first().is_some_and(|f| too_dear(f, &m, &pick)) { break; }
                if expected.iter().all(|f| f.exemplar != m.exemplar
                    || f.row.abs_diff(m.row).max(f.column.abs_diff(m.column)) > separation) {
                    expected.push(m);
                }
            }
            // The samples are integers, so both sums are exact.
            prop_assert_eq!(found, &expected);
        }
    }

    #[test]
    fn the_filter_keeps_its_bound(
        shape in [20usize..200, 20usize..150], patch in [4usize..20, 4usize..20], seed: u64, scale in 1e-3f32..1e3, mean in -1e3f32..1e3,
    ) {
        let mut e = exemplar(shape, 2, seed, 256);
        Arc::make_mut(&mut e.data).iter_mut().for_each(|x| *x = *x * scale + mean);
        let samples: Vec<f32> = noise(patch[0] * patch[1] * 2, seed ^ 1, 256).iter().map(|x| x * scale + mean).collect();
        let weight = noise(patch[0] * patch[1], seed ^ 2, 5);
        let query = Query { patch: &samples, weight: &weight, shape: patch };
        let index = Index::new(vec![e.clone()], 2, patch).unwrap();
        let (map, bound) = par::install(2, || index.cost_map(&query, 0, &Monitor::default())).unwrap().unwrap();
        let width = shape[1] - patch[1] + 1;
        for m in naive(&[e], 2, &query) {
            let filtered = f64::from(map[m.row * width + m.column]);
            prop_assert!((filtered - m.cost).abs() <= bound + 1e-6 * m.cost, "{} {} {}", filtered, m.cost, bound);
        }
    }
}
