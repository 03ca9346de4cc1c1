use super::*;
use crate::foundation::par::{self, Monitor};
use proptest::prelude::*;

fn grid(rows: usize, columns: usize) -> Vec<Point> {
    (0..rows * columns)
        .map(|i| [(i / columns) as f64, (i % columns) as f64])
        .collect()
}

fn warp(shape: [usize; 2], target: &[Point], weight: &[u8], out: [usize; 2]) -> Warped {
    let source = Mesh {
        shape,
        target,
        weight,
    };
    mesh(&source, out, &Monitor::default()).unwrap()
}

#[test]
fn a_mesh_at_rest_is_the_identity() {
    let target = grid(9, 11);
    let found = warp([9, 11], &target, &[0; 99], [9, 11]);
    for (place, wanted) in found.places.iter().zip(&target) {
        assert_eq!(place.map(f64::from), *wanted);
    }
    assert_eq!((found.drawn, found.flipped), (2 * 8 * 10, 0));
}

#[test]
fn whole_steps_are_exact_and_the_rest_is_open() {
    let target: Vec<Point> = grid(6, 6)
        .iter()
        .map(|p| [p[0] + 2.0, p[1] - 1.0])
        .collect();
    let found = warp([6, 6], &target, &[0; 36], [8, 8]);
    for (i, place) in found.places.iter().enumerate() {
        let (y, x) = (i / 8, i % 8);
        if y >= 2 && x <= 4 {
            assert_eq!(*place, [y as f32 - 2.0, x as f32 + 1.0]);
        } else {
            assert!(place[0].is_nan() && found.triangle[i] == 0);
        }
    }
}

#[test]
fn the_heavier_layer_is_seen_and_void_is_not_drawn() {
    // Columns 4 to 7 move over columns 0 to 3.
    let target: Vec<Point> = grid(4, 8)
        .iter()
        .map(|p| if p[1] < 4.0 { *p } else { [p[0], p[1] - 4.0] })
        .collect();
    let mut weight = vec![0; 32];
    for y in 0..4 {
        weight[y * 8 + 4..y * 8 + 8].fill(1);
    }
    let found = warp([4, 8], &target, &weight, [4, 4]);
    assert!(found.places.iter().all(|p| p[1] >= 4.0));
    weight.fill(Mesh::VOID);
    assert!(
        warp([4, 8], &target, &weight, [4, 4])
            .triangle
            .iter()
            .all(|&t| t == 0)
    );
}

#[test]
fn what_is_turned_over_is_counted() {
    let target: Vec<Point> = grid(4, 4).iter().map(|p| [p[0], 3.0 - p[1]]).collect();
    let found = warp([4, 4], &target, &[1; 16], [4, 4]);
    assert_eq!(
        (found.drawn, found.flipped, found.flipped_heavy),
        (18, 18, 18)
    );
}

proptest! {
    /// The result must not depend on the number of threads.
    #[test]
    fn bands_and_threads_do_not_matter(
        moves in prop::collection::vec((-3.0f64..3.0, -3.0f64..3.0, 0u8..3), 72),
    ) {
        let target: Vec<Point> = grid(9, 8)
            .iter()
            .zip(&moves)
            .map(|(p, m)| [p[0] * 8.0 + m.0, p[1] + m.1])
            .collect();
        let weight: Vec<u8> = moves.iter().map(|m| if m.2 == 2 { Mesh::VOID } else { m.2 }).collect();
        let run = |threads| par::install(threads, || warp([9, 8], &target, &weight, [70, 8])).unwrap();
        let one = run(1);
        for threads in [2, 7] {
            let other = run(threads);
            prop_assert_eq!(&one.triangle, &other.triangle);
            let bits = |w: &Warped| w.places.iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>();
            prop_assert_eq!(bits(&one), bits(&other));
        }
    }

    #[test]
    fn scattered_points_agree_with_the_mesh(moves in prop::collection::vec((-0.3f64..0.3, -0.3f64..0.3), 4)) {
        // With an affine map, every triangulation gives the same result.
        let m = [[1.0 + moves[0].0, moves[0].1], [moves[1].0, 1.0 + moves[1].1]];
        let source = grid(7, 7);
        let target: Vec<Point> = source
            .iter()
            .map(|p| [m[0][0] * p[0] + m[0][1] * p[1], m[1][0] * p[0] + m[1][1] * p[1]])
            .collect();
        let dense = warp([7, 7], &target, &[0; 49], [7, 7]);
        let (loose, corners) = scattered(&source, &target, [7, 7], &Monitor::default()).unwrap();
        prop_assert_eq!(corners.len(), 72);
        for i in 0..49 {
            if dense.triangle[i] > 0 && loose.triangle[i] > 0 {
                for axis in 0..2 {
                    prop_assert!((dense.places[i][axis] - loose.places[i][axis]).abs() < 1e-4);
                }
            }
        }
    }
}

#[test]
fn bad_points_are_refused() {
    let refused = |source: &[Point], target: &[Point]| {
        scattered(source, target, [4, 4], &Monitor::default())
            .unwrap_err()
            .to_string()
    };
    let three = [[0.0, 0.0], [0.0, 3.0], [3.0, 0.0]];
    assert!(refused(&three[..2], &three[..2]).contains("three points"));
    assert!(refused(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]], &three).contains("line"));
    assert!(refused(&[three[0], three[0], three[1]], &three).contains("same place"));
    assert!(refused(&three, &[[f64::NAN, 0.0], three[1], three[2]]).contains("finite"));
}

#[test]
fn triangles_whose_products_overflow_are_not_drawn() {
    let (far, wide) = (-1e300, -1e10);
    let target = [[far, wide], [far, wide + 1.0], [5.0, 5.0], [5.0, 6.0]];
    let found = warp([2, 2], &target, &[0; 4], [9, 9]);
    for (place, triangle) in found.places.iter().zip(&found.triangle) {
        assert_eq!(*triangle == 0, place[0].is_nan() || place[1].is_nan());
    }
}
