use super::*;
use proptest::prelude::*;

/// Returns smooth noise with three channels.
fn exemplar<const D: usize>(shape: [usize; D], wrap: bool) -> (Vec<f32>, Grid<D>) {
    let grid = Grid::new(shape, [wrap; D]).unwrap();
    let noise = Noise::new(5);
    let colours = (0..grid.len())
        .flat_map(|i| {
            let p = grid.point(i);
            (0..3u32).map(move |c| {
                let waves: f64 = p
                    .iter()
                    .map(|&x| (x as f64 * 0.7 + f64::from(c)).sin())
                    .sum();
                (waves + 0.3 * noise.uniform([i as u32, c, 0, 0])) as f32
            })
        })
        .collect();
    (colours, grid)
}

#[test]
fn distances_of_vectors_are_near_those_of_windows() {
    let (colours, grid) = exemplar([24, 24], false);
    let found = Appearance::new(&colours, grid, 3, 2).unwrap();
    let weight = |o: &[i32; 2]| (-f64::from(o[0] * o[0] + o[1] * o[1]) / 8.0).exp();
    let pairs: Vec<(f64, f64)> = (0..60)
        .map(|k| {
            let (a, b) = ([2 + k % 19, 4 + k / 5], [21 - k % 17, 3 + k / 4]);
            let at = |p: [i32; 2], o: &[i32; 2]| {
                grid.index([(p[0] + o[0]) as usize, (p[1] + o[1]) as usize])
            };
            let exact: f64 = found
                .offsets()
                .iter()
                .map(|o| {
                    let (x, y) = (at(a, o) * 3, at(b, o) * 3);
                    let w = weight(o);
                    (0..3)
                        .map(|c| (f64::from(colours[x + c] - colours[y + c]) * w).powi(2))
                        .sum::<f64>()
                })
                .sum();
            let near = distance(
                found.feature(grid.index(a.map(|x| x as usize))),
                found.feature(grid.index(b.map(|x| x as usize))),
            );
            (exact, f64::from(near))
        })
        .collect();
    let scale = pairs.iter().map(|p| p.1).sum::<f64>() / pairs.iter().map(|p| p.0).sum::<f64>();
    for (exact, near) in pairs {
        assert!(
            (near - exact * scale).abs() < 0.2 * exact * scale + 0.02 * f64::from(UNIT),
            "{near} {}",
            exact * scale
        );
    }
}

#[test]
fn the_exemplar_describes_its_own_windows_exactly() {
    let (colours, grid) = exemplar([12, 13, 14], false);
    let found = Appearance::new(&colours, grid, 3, 2).unwrap();
    let mut window = found.scratch();
    let centre = [5, 6, 7];
    for (k, o) in found.offsets().to_vec().iter().enumerate() {
        let at = found.clamped(std::array::from_fn(|axis| centre[axis] + o[axis]));
        found.put(&mut window, k, found.colour(at));
    }
    let feature = found.project(&mut window);
    assert_eq!(&feature, found.feature(grid.index([5, 6, 7])));
    assert_eq!(found.inside([1, 6, 7]), None);
    assert_eq!(found.inside([5, 6, 7]), Some(grid.index([5, 6, 7])));
}

#[test]
fn the_spacing_of_a_repeating_exemplar_is_nought() {
    let grid = Grid::new([32, 32], [true; 2]).unwrap();
    let colours: Vec<f32> = (0..1024)
        .map(|i| ((i / 32 % 8) * 3 + i % 8) as f32)
        .collect();
    assert_eq!(Appearance::new(&colours, grid, 1, 2).unwrap().spacing(), 0);
    let (colours, grid) = exemplar([32, 32], true);
    assert!(Appearance::new(&colours, grid, 3, 2).unwrap().spacing() > 0);
}

#[test]
fn refuses_what_has_no_windows_and_bears_what_shows_nothing() {
    let grid = Grid::new([5, 32], [false; 2]).unwrap();
    assert!(Appearance::new(&[0.0; 160], grid, 1, 2).is_err());
    let grid = Grid::new([16, 16], [false; 2]).unwrap();
    assert!(Appearance::new(&[f32::NAN; 256], grid, 1, 2).is_err());
    assert!(Appearance::new(&[0.0; 256], grid, 5, 2).is_err());
    let flat = Appearance::new(&[0.5; 256], grid, 1, 2).unwrap();
    assert_eq!(flat.spacing(), 0);
}

#[test]
fn an_analysis_survives_being_taken_apart_and_a_damaged_one_is_refused() {
    let (colours, grid) = exemplar([12, 13], true);
    let parts = Appearance::new(&colours, grid, 3, 2).unwrap().parts();
    assert_eq!(
        Appearance::from_parts(parts.clone()).unwrap().parts(),
        parts
    );
    let mut short = parts.clone();
    short.features.pop();
    assert!(Appearance::from_parts(short).is_err());
    let mut wild = parts;
    wild.basis.fill(i16::MAX);
    assert!(Appearance::from_parts(wild).is_err());
}

proptest! {
    #[test]
    fn brightness_and_contrast_change_nothing(gain in 0.01f32..100.0, lift in -50f32..50.0) {
        let (colours, grid) = exemplar([10, 10], false);
        let other: Vec<f32> = colours.iter().map(|x| x * gain + lift).collect();
        let [a, b] = [colours, other].map(|c| Appearance::new(&c, grid, 3, 2).unwrap());
        for i in 0..grid.len() {
            // Rounded colours may differ by one step.
            prop_assert!(distance(a.feature(i), b.feature(i)) < UNIT / 100);
        }
    }
}
