use super::*;
use proptest::prelude::*;

fn slow(vectors: &[f64], n: usize, query: &[f64], own: Option<usize>) -> (f64, u32) {
    vectors
        .chunks_exact(n)
        .enumerate()
        .filter(|&(i, _)| Some(i) != own)
        .map(|(i, v)| (apart(query, v), i as u32))
        .fold((f64::INFINITY, u32::MAX), |a, b| if b < a { b } else { a })
}

/// Vectors of numbers that spread less and less, many of them alike; some with a common part that leaves few digits.
fn vectors(n: usize, count: usize, seed: u64, shift: f64) -> Vec<f64> {
    let noise = crate::foundation::hash::Noise::new(seed);
    (0..count * n)
        .map(|i| {
            let (which, k) = (i / n % 97, i % n);
            let fine = 1e-7 * noise.uniform([(i / n) as u32, k as u32, 1, 0]);
            let coarse = noise.uniform([which as u32, k as u32, 0, 0]) / (1.0 + k as f64);
            shift + coarse + if (i / n).is_multiple_of(5) { 0.0 } else { fine }
        })
        .collect()
}

proptest! {
    #[test]
    fn what_is_found_is_what_a_slow_search_finds(
        n in 1usize..34, count in 2usize..400, seed in 0u64..1000, far in prop::sample::select(vec![0.0, 1.0, 1e6, -1e140]),
    ) {
        let all = vectors(n, count, seed, far);
        let asked = vectors(n, 50, seed / 2, far * 1.01);
        let nearest = Nearest::new(all.clone(), n).unwrap();
        let found = nearest.query(&asked, &Monitor::default()).unwrap();
        let others = nearest.others(&Monitor::default()).unwrap();
        for (i, query) in asked.chunks_exact(n).enumerate() {
            let wanted = slow(&all, n, query, None);
            prop_assert_eq!((found.distance[i], found.index[i]), (wanted.0.sqrt(), wanted.1));
        }
        for (i, query) in all.chunks_exact(n).enumerate() {
            let wanted = slow(&all, n, query, Some(i));
            prop_assert_eq!((others.distance[i], others.index[i]), (wanted.0.sqrt(), wanted.1));
        }
    }
}

#[test]
fn of_equal_ones_the_first_is_found() {
    let nearest = Nearest::new(vec![0.5; 300 * 3], 3).unwrap();
    let found = nearest
        .query(&[0.5, 0.5, 0.5, 1e150, 0.0, 0.0], &Monitor::default())
        .unwrap();
    assert_eq!(found.index, [0, 0]);
    assert_eq!(
        nearest.others(&Monitor::default()).unwrap().index[..3],
        [1, 0, 0]
    );
}

#[test]
fn refuses_what_it_cannot_search() {
    assert!(Nearest::new(vec![], 3).is_err());
    assert!(Nearest::new(vec![1.0; 4], 3).is_err());
    assert!(Nearest::new(vec![f64::NAN; 3], 3).is_err());
    let one = Nearest::new(vec![1.0; 3], 3).unwrap();
    assert!(one.others(&Monitor::default()).is_err());
    assert!(one.query(&[f64::INFINITY; 3], &Monitor::default()).is_err());
    assert!(one.query(&[0.0; 4], &Monitor::default()).is_err());
}

#[test]
fn threads_do_not_change_a_bit() {
    let nearest = Nearest::new(vectors(12, 3000, 4, 0.0), 12).unwrap();
    let [one, two, seven] = [1, 2, 7]
        .map(|t| par::install(t, || nearest.others(&Monitor::default()).unwrap()).unwrap());
    assert_eq!(one, two);
    assert_eq!(one, seven);
}
