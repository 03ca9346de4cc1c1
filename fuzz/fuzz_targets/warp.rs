//! Fuzzes warps by meshes and by scattered points, and the motion of shapes, with arbitrary points.

#![no_main]

use libfuzzer_sys::fuzz_target;
use texrs::grid::Grid;
use texrs::warp::{Mesh, Motion, Point, Shape, Warped, mesh, scattered};
use texrs_fuzz::{Draw, agreed};

/// Returns a coordinate. Most are multiples of 0.5 near the canvas, so that points often coincide,
/// and a few are arbitrary.
fn coordinate(draw: &mut Draw<'_>) -> f64 {
    match draw.within(0..=31) {
        0 => f64::from(draw.real()) * 1e9,
        1 => f64::from_bits(draw.any()),
        2..=8 => f64::from(draw.real()) * 12.0,
        _ => draw.within(0..=32) as f64 / 2.0 - 4.0,
    }
}

fn point(draw: &mut Draw<'_>) -> Point {
    [coordinate(draw), coordinate(draw)]
}

fn whole(warped: &Warped, shape: [usize; 2]) {
    assert_eq!(warped.places.len(), shape[0] * shape[1]);
    assert_eq!(warped.triangle.len(), shape[0] * shape[1]);
    assert!(warped.flipped_heavy <= warped.flipped && warped.flipped <= warped.drawn);
}

fn meshed(draw: &mut Draw<'_>) {
    let shape = draw.shape::<2>(1..=6);
    let out = draw.shape::<2>(0..=14);
    let n = shape[0] * shape[1];
    let target: Vec<Point> = (0..n).map(|_| point(draw)).collect();
    let weight: Vec<u8> = draw
        .numbers(n, 4)
        .map(|w| if w == 3 { Mesh::VOID } else { w.min(1) as u8 })
        .collect();
    let source = Mesh {
        shape,
        target: &target,
        weight: &weight,
    };
    let Some(found) = agreed(|monitor| mesh(&source, out, monitor)) else {
        return;
    };
    whole(&found, out);
    for (place, _) in found
        .places
        .iter()
        .zip(&found.triangle)
        .filter(|(_, t)| **t > 0)
    {
        let inside = |axis: usize| (-1e-3..=shape[axis] as f32 - 1.0 + 1e-3).contains(&place[axis]);
        assert!(inside(0) && inside(1), "{place:?} in a mesh of {shape:?}");
    }
}

fn triangulated(draw: &mut Draw<'_>) {
    let n = draw.within(0..=12);
    let source: Vec<Point> = (0..n).map(|_| point(draw)).collect();
    let target: Vec<Point> = if draw.seldom(4) {
        source.clone()
    } else {
        (0..n).map(|_| point(draw)).collect()
    };
    let out = draw.shape::<2>(0..=14);
    let Some((found, corners)) = agreed(|monitor| scattered(&source, &target, out, monitor)) else {
        return;
    };
    whole(&found, out);
    assert!(corners.iter().flatten().all(|&k| (k as usize) < n));
    assert!(found.triangle.iter().all(|&t| t as usize <= corners.len()));
}

fn moved(draw: &mut Draw<'_>) {
    let grid = Grid::new(draw.shape(1..=9), [false; 2]).unwrap();
    let distance: Vec<f32> = draw
        .reals(grid.len())
        .iter()
        .map(|x| 8.0 * x - 4.0)
        .collect();
    let shape = Shape {
        distance: &distance,
        grid,
        origin: point(draw),
    };
    let matrix = [0; 2].map(|_| [0; 2].map(|_| coordinate(draw) / 4.0));
    let motion = match Motion::new(point(draw), point(draw), matrix) {
        Ok(motion) => motion,
        Err(error) => return texrs_fuzz::speaks(&error),
    };
    // The window must be inside the canvas, and the counts must match the flags.
    let canvas = draw.shape(1..=20);
    let Some(window) = motion.window(&shape, canvas) else {
        return;
    };
    assert!((0..2).all(|a| window.shape[a] > 0 && window.low[a] + window.shape[a] <= canvas[a]));
    let depth = draw.real();
    if let Some(placed) = agreed(|monitor| motion.place(&shape, &window, canvas, depth, monitor)) {
        let n = window.shape[0] * window.shape[1];
        let lengths = [
            placed.places.len(),
            placed.distance.len(),
            placed.inside.len(),
            placed.deep.len(),
        ];
        assert_eq!(lengths, [n; 4]);
        assert!(placed.count <= placed.inside.iter().filter(|i| **i).count());
        assert!(
            placed
                .deep
                .iter()
                .zip(&placed.inside)
                .all(|(deep, inside)| deep <= inside)
        );
    }
}

fuzz_target!(|bytes: &[u8]| {
    let mut draw = Draw::new(bytes);
    match draw.within(0..=2) {
        0 => meshed(&mut draw),
        1 => triangulated(&mut draw),
        _ => moved(&mut draw),
    }
});
