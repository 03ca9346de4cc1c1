//! Fuzzes seams between two images. Pixels that are tied to an image must show it. A reused
//! workspace must find the same cut, and a strip must cost as much as the general cut.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::grid::Grid;
use texrs::seam::cost::Cost;
use texrs::seam::stitch::{OldSeams, Overlap, Stitched, Stitcher, cut};
use texrs::seam::strip::{self, Pasted};
use texrs_fuzz::{Draw, agreed, near};

fn cost(draw: &mut Draw<'_>) -> Cost {
    if draw.flag() {
        Cost::Gradient
    } else {
        Cost::Difference
    }
}

fn count_edges<const D: usize>(grid: &Grid<D>, both: impl Fn(usize) -> bool, b: &[bool]) -> usize {
    let links = |(p, point): (usize, [usize; D])| {
        let next = (0..D).filter_map(move |axis| grid.next(point, axis));
        next.map(move |q| (p, grid.index(q)))
    };
    let parted = |&(p, q): &(usize, usize)| both(p) && both(q) && b[p] != b[q];
    grid.points()
        .enumerate()
        .flat_map(links)
        .filter(parted)
        .count()
}

fn stitched<const D: usize>(draw: &mut Draw<'_>, longest: usize) {
    let grid = Grid::new(draw.shape::<D>(1..=longest), draw.flags()).unwrap();
    let (n, channels) = (grid.len(), draw.within(0..=4));
    let (a, b) = (draw.reals(n * channels), draw.reals(n * channels));
    let (mask_a, mask_b) = (draw.mask(n), draw.mask(n));
    let [core_a, core_b] = [&mask_a, &mask_b].map(|mask| {
        let loose = draw.seldom(16);
        let core = draw.mask(n);
        let of = |(c, m): (&bool, &bool)| *c && (*m || loose);
        draw.flag()
            .then(|| core.iter().zip(mask).map(of).collect::<Vec<bool>>())
    });
    // Pixels that are tied to both images are an error, so give both cores only rarely.
    let core_a = if draw.seldom(8) {
        core_a
    } else {
        core_a.filter(|_| core_b.is_none())
    };
    let penalty = draw.flag().then(|| draw.reals(n));
    let old: [[Vec<f32>; D]; 3] = std::array::from_fn(|_| std::array::from_fn(|_| draw.reals(n)));
    let view = |k: usize| -> [&[f32]; D] { std::array::from_fn(|axis| &old[k][axis][..]) };
    let overlap = Overlap {
        core_a: core_a.as_deref(),
        core_b: core_b.as_deref(),
        penalty: penalty.as_deref(),
        old: draw.flag().then(|| OldSeams {
            kept: view(0),
            ab: view(1),
            ba: view(2),
        }),
        cost: cost(draw),
        ..Overlap::new(grid, channels, &a, &b, &mask_a, &mask_b)
    };
    let Some(found) = agreed(|monitor| cut(&overlap, monitor)) else {
        return;
    };
    assert!(found.value.is_finite() && found.value >= 0.0);
    for p in 0..n {
        let must = mask_b[p] && (!mask_a[p] || core_b.as_ref().is_some_and(|core| core[p]));
        let may = mask_b[p] && !core_a.as_ref().is_some_and(|core| core[p]);
        assert!(found.b[p] <= may && found.b[p] >= must, "pixel {p}");
    }
    assert_eq!(
        found.edges,
        count_edges(&grid, |p| mask_a[p] && mask_b[p], &found.b)
    );
    // A reused workspace must give the same cut.
    let mut stitcher = Stitcher::default();
    let swapped = Overlap {
        old: None,
        core_a: None,
        core_b: None,
        ..Overlap::new(grid, channels, &b, &a, &mask_b, &mask_a)
    };
    let _ = stitcher.cut(&swapped, &Default::default());
    assert_eq!(stitcher.cut(&overlap, &Default::default()).unwrap(), found);
}

/// Fuzzes strips. A strip must cost as much as the general cut if the first line is tied to A and
/// the last line to B.
fn pasted(draw: &mut Draw<'_>) {
    let shape = draw.shape::<2>(1..=12);
    let (n, channels, axis) = (shape[0] * shape[1], draw.within(1..=3), draw.within(0..=1));
    let (a, b) = (draw.reals(n * channels), draw.reals(n * channels));
    let penalty = draw.flag().then(|| draw.reals(n));
    let cyclic = draw.flag();
    let pasted = Pasted {
        shape,
        channels,
        a: &a,
        b: &b,
        axis,
        cyclic,
        penalty: penalty.as_deref(),
        cost: cost(draw),
    };
    let Some(Stitched { b: far, value, .. }) = agreed(|monitor| strip::cut(&pasted, monitor))
    else {
        return;
    };
    let mut wrap = [cyclic; 2];
    wrap[axis] = false;
    let grid = Grid::new(shape, wrap).unwrap();
    let along = |p: usize| grid.point(p)[axis];
    let ends =
        [0, shape[axis] - 1].map(|end| (0..n).map(|p| along(p) == end).collect::<Vec<bool>>());
    assert!((0..n).all(|p| !(ends[0][p] && far[p]) && !(ends[1][p] && !far[p])));
    let whole = vec![true; n];
    let overlap = Overlap {
        core_a: Some(&ends[0]),
        core_b: Some(&ends[1]),
        penalty: penalty.as_deref(),
        cost: pasted.cost,
        ..Overlap::new(grid, channels, &a, &b, &whole, &whole)
    };
    let flow = cut(&overlap, &Default::default()).unwrap();
    // If a straight seam costs more than 2^13, costs are rounded so coarsely that any seam may
    // result.
    let given = a.iter().chain(&b).chain(penalty.iter().flatten());
    if !given.copied().all(|x| x.abs() <= 1.0) {
        return;
    }
    // The cost of each edge is rounded to steps of at least 2^-16.
    let step = n as f64 * 2.0 / 65536.0;
    assert!(
        (flow.value - value).abs() <= step || near(flow.value, value, 1e-3),
        "{} {value}",
        flow.value
    );
}

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    match draw.within(0..=2) {
        0 => stitched::<2>(&mut draw, 12),
        1 => stitched::<3>(&mut draw, 5),
        _ => pasted(&mut draw),
    }
});
