use super::super::cost::{Cost, EXTREMES};
use super::*;
use proptest::prelude::*;

/// Returns the sum of the costs of a labelling, by definition.
fn value(o: &Overlap<'_, 2>, b: &[bool]) -> f64 {
    let pixel = |image: &[f32], p: usize| image[p * o.channels..][..o.channels].to_vec();
    let l1 = |x: &[f32], y: &[f32]| -> f64 {
        x.iter().zip(y).map(|(x, y)| f64::from(*x - *y).abs()).sum()
    };
    let both = |p: usize| o.mask_a[p] && o.mask_b[p];
    let mut sum = 0.0;
    for s in 0..o.grid.len() {
        for axis in 0..2 {
            let Some(t) = o.grid.next(o.grid.point(s), axis).map(|t| o.grid.index(t)) else {
                continue;
            };
            // Only edges inside the overlap have a cost.
            if !both(s) || !both(t) {
                continue;
            }
            let weight = o
                .penalty
                .map_or(1.0, |p| 1.0 + f64::from(p[s] + p[t]) / 2.0);
            let mut w = l1(&pixel(o.a, s), &pixel(o.b, s)) + l1(&pixel(o.a, t), &pixel(o.b, t));
            if o.cost == Cost::Gradient {
                w /= l1(&pixel(o.a, s), &pixel(o.a, t)) + l1(&pixel(o.b, s), &pixel(o.b, t)) + 0.05;
            }
            w += 1e-4;
            // An old seam replaces the cost of its edge.
            let (mut kept, mut ab, mut ba) = (0.0, w, w);
            if let Some(old) = o.old
                && old.kept[axis][s] > 0.0
            {
                (ab, ba) = (f64::from(old.ab[axis][s]), f64::from(old.ba[axis][s]));
                kept = f64::from(old.kept[axis][s]).min(ab + ba);
            }
            sum += weight
                * match (b[s], b[t]) {
                    (false, false) => kept,
                    (false, true) => ab,
                    (true, false) => ba,
                    (true, true) => 0.0,
                };
        }
    }
    sum
}

fn floats(n: usize) -> impl Strategy<Value = Vec<f32>> {
    prop::collection::vec(0.0f32..1.0, n)
}

fn bools(n: usize) -> impl Strategy<Value = Vec<bool>> {
    prop::collection::vec(prop::bool::weighted(0.8), n)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// A 3 x 3 canvas has few enough labellings to try them all, including ties.
    #[test]
    fn no_allowed_labelling_is_cheaper(
        wrap in any::<[bool; 2]>(),
        (a, b) in (floats(18), floats(18)),
        (mask_a, mask_b) in (bools(9), bools(9)),
        cores in prop::collection::vec(0u8..6, 9),
        penalty in floats(9),
        old in prop::collection::vec((0.0f32..1.0).prop_map(|x| (x - 0.5).max(0.0) * 8.0), 18),
        joins in prop::collection::vec(0.0f32..4.0, 36),
        gradient in any::<bool>(),
    ) {
        let grid = Grid::new([3, 3], wrap).unwrap();
        let core_a: Vec<bool> = cores.iter().zip(&mask_a).map(|(&c, &m)| c == 1 && m).collect();
        let core_b: Vec<bool> = cores.iter().zip(&mask_b).map(|(&c, &m)| c == 2 && m).collect();
        let overlap = Overlap {
            core_a: Some(&core_a),
            core_b: Some(&core_b),
            penalty: Some(&penalty),
            old: Some(OldSeams {
                kept: [&old[..9], &old[9..]],
                ab: [&joins[..9], &joins[9..18]],
                ba: [&joins[18..27], &joins[27..]],
            }),
            cost: if gradient { Cost::Gradient } else { Cost::Difference },
            ..Overlap::new(grid, 2, &a, &b, &mask_a, &mask_b)
        };
        let cut = cut(&overlap, &Monitor::default()).unwrap();
        let allowed = |labels: &[bool]| (0..9).all(|p| match (mask_a[p], mask_b[p]) {
            (true, true) => match overlap.tie(p) {
                Side::Free => true,
                Side::Outside => !labels[p],
                Side::Inside => labels[p],
            },
            (_, b) => labels[p] == b,
        });
        prop_assert!(allowed(&cut.b));
        prop_assert!((value(&overlap, &cut.b) - cut.value).abs() < 1e-3);
        let least = (0..512u32)
            .map(|bits| (0..9).map(|i| bits >> i & 1 == 1).collect::<Vec<_>>())
            .filter(|labels| allowed(labels))
            .map(|labels| value(&overlap, &labels))
            .fold(f64::INFINITY, f64::min);
        // Eighteen edges are rounded to 2^-16 each.
        prop_assert!(cut.value <= least + 1e-3, "{} against {least}", cut.value);
    }

    #[test]
    fn only_what_costs_more_than_a_bound_is_not_cut(
        (a, b) in (floats(400), floats(400)), (mask_a, mask_b) in (bools(400), bools(400)), share in 0.0f64..1.5,
    ) {
        let grid = Grid::new([20, 20], [false; 2]).unwrap();
        let overlap = Overlap::new(grid, 1, &a, &b, &mask_a, &mask_b);
        let monitor = Monitor::default();
        let whole = cut(&overlap, &monitor).unwrap();
        let within = |bound| Stitcher::default().cut_within(&overlap, bound, &monitor).unwrap();
        let exact = within(whole.value);
        prop_assert_eq!(exact.as_ref(), Some(&whole));
        match within(share * whole.value) {
            Some(found) => prop_assert_eq!(found, whole),
            None => prop_assert!(share < 1.0),
        }
    }
}

#[test]
fn the_seam_runs_where_the_images_agree() {
    // A covers the first four columns of two rows, B the last four. They agree only in columns 2
    // and 3.
    let grid = Grid::new([2, 6], [false; 2]).unwrap();
    let a = [[0.1, 0.2, 0.3, 0.4, 0.0, 0.0]; 2].concat();
    let b = [[0.0, 0.9, 0.3, 0.4, 0.5, 0.6]; 2].concat();
    let mask_a = [[true, true, true, true, true, false]; 2].concat();
    let mask_b = [[false, true, true, true, true, true]; 2].concat();
    let overlap = Overlap::new(grid, 1, &a, &b, &mask_a, &mask_b);
    let cut = cut(&overlap, &Monitor::default()).unwrap();
    assert_eq!(cut.b, [[false, false, false, true, true, true]; 2].concat());
    assert_eq!(cut.edges, 2);
    assert!((cut.value - 2e-4).abs() < 1e-6);
}

proptest! {
    #[test]
    fn extremes_are_refused_or_cost_something(
        images in prop::collection::vec(prop::sample::select(EXTREMES.to_vec()), 8),
        others in prop::collection::vec(prop::sample::select(EXTREMES.to_vec()), 28),
        gradient in any::<bool>(),
        penalised in any::<bool>(),
        seams in any::<bool>(),
    ) {
        let others: Vec<f32> = others.iter().map(|x| x.abs()).collect();
        let old = |k: usize| std::array::from_fn(|axis| &others[4 + 8 * k + 4 * axis..][..4]);
        let all = [true; 4];
        let overlap = Overlap {
            penalty: penalised.then_some(&others[..4]),
            old: seams.then(|| OldSeams { kept: old(0), ab: old(1), ba: old(2) }),
            cost: if gradient { Cost::Gradient } else { Cost::Difference },
            core_a: Some(&[true, false, false, false]),
            core_b: Some(&[false, false, false, true]),
            ..Overlap::new(Grid::new([2, 2], [false; 2]).unwrap(), 1, &images[..4], &images[4..], &all, &all)
        };
        if let Ok(found) = cut(&overlap, &Monitor::default()) {
            prop_assert!(found.value.is_finite() && found.value >= 0.0);
        }
    }
}

#[test]
fn nothing_in_common_is_no_seam() {
    let grid = Grid::new([1, 2], [false; 2]).unwrap();
    let overlap = Overlap::new(
        grid,
        1,
        &[0.0; 2],
        &[f32::NAN; 2],
        &[true, false],
        &[false, true],
    );
    let cut = cut(&overlap, &Monitor::default()).unwrap();
    assert_eq!((cut.b, cut.value, cut.edges), (vec![false, true], 0.0, 0));
}

#[test]
fn refuses_contradictions() {
    let grid = Grid::new([1, 2], [false; 2]).unwrap();
    let (all, some) = ([true; 2], [true, false]);
    let plain = Overlap::new(grid, 1, &[0.0; 2], &[0.0; 2], &all, &all);
    let refused = |o: Overlap<'_, 2>| cut(&o, &Monitor::default()).unwrap_err().to_string();
    let both = Overlap {
        core_a: Some(&some),
        core_b: Some(&some),
        ..plain
    };
    assert!(refused(both).contains("core_a, core_b"));
    let outside = Overlap {
        core_a: Some(&all),
        mask_a: &some,
        ..plain
    };
    assert!(refused(outside).contains("core_a"));
    let negative = Overlap {
        penalty: Some(&[0.0, -1.0]),
        ..plain
    };
    assert!(refused(negative).contains("penalty"));
    let unknown = Overlap {
        a: &[f32::NAN, 0.0],
        ..plain
    };
    assert!(refused(unknown).contains("must be finite"));
    // Each replacement is finite, but their sum overflows.
    let (kept, others) = ([[3e38; 2]; 2], [[1.2e38; 2]; 2]);
    let endless = Overlap {
        penalty: Some(&[0.5; 2]),
        old: Some(OldSeams {
            kept: kept.each_ref().map(|c| &c[..]),
            ab: others.each_ref().map(|c| &c[..]),
            ba: others.each_ref().map(|c| &c[..]),
        }),
        ..plain
    };
    assert!(refused(endless).contains("old, penalty"));
    let short = Overlap { a: &[0.0], ..plain };
    assert!(refused(short).contains("must have shape"));
}

#[test]
fn a_core_ringed_by_b_pulls_its_surroundings_along() {
    let grid = Grid::new([9, 9], [true; 2]).unwrap();
    let noise = crate::foundation::hash::Noise::new(3);
    let image = |layer: u32| -> Vec<f32> {
        (0..81)
            .map(|i| noise.uniform([i, layer, 0, 0]) as f32)
            .collect()
    };
    let (a, b) = (image(0), image(1));
    let all = [true; 81];
    let core: Vec<bool> = (0..81).map(|i| i == 40).collect();
    let ring: Vec<bool> = (0..81)
        .map(|i: i32| (i / 9 - 4).abs().max((i % 9 - 4).abs()) <= 2)
        .collect();
    let overlap = Overlap {
        core_b: Some(&core),
        ..Overlap::new(grid, 1, &a, &b, &all, &ring)
    };
    let cut = cut(&overlap, &Monitor::default()).unwrap();
    assert!(cut.b[40] && cut.b.iter().zip(&ring).all(|(&b, &r)| r || !b));
    assert!((value(&overlap, &cut.b) - cut.value).abs() < 1e-3);
    assert!(cut.edges >= 4);
}
