//! Functions that the fuzz targets share: small inputs drawn from bytes, and comparison of runs
//! with one and two threads.

use std::fmt::Debug;
use std::ops::RangeInclusive;

use arbitrary::{Arbitrary, Unstructured};
use texrs::grid::{Grid, Region};
use texrs::hash::Noise;
use texrs::par::{self, Monitor};
use texrs::{Error, Result};

/// Values that kernels must reject or can barely handle.
const ODD: [f32; 10] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::MAX,
    f32::MIN,
    f32::MIN_POSITIVE,
    1e-40,
    -0.0,
    -1.0,
    1e15,
];

/// Draws values from the bytes of an input. After the last byte, each value is the smallest of its
/// range.
pub struct Draw<'a>(Unstructured<'a>);

impl<'a> Draw<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self(Unstructured::new(bytes))
    }

    pub fn any<T: Arbitrary<'a> + Default>(&mut self) -> T {
        self.0.arbitrary().unwrap_or_default()
    }

    pub fn flag(&mut self) -> bool {
        self.any()
    }

    /// Returns true about once in `n` draws.
    pub fn seldom(&mut self, n: u8) -> bool {
        self.any::<u8>() % n == n - 1
    }

    pub fn within(&mut self, range: RangeInclusive<usize>) -> usize {
        let low = *range.start();
        self.0.int_in_range(range).unwrap_or(low)
    }

    pub fn shape<const D: usize>(&mut self, range: RangeInclusive<usize>) -> [usize; D] {
        std::array::from_fn(|_| self.within(range.clone()))
    }

    pub fn flags<const D: usize>(&mut self) -> [bool; D] {
        std::array::from_fn(|_| self.flag())
    }

    /// Returns a small region near the origin, or rarely anywhere.
    ///
    /// # Errors
    /// The region is too far from the origin.
    pub fn region<const D: usize>(&mut self, longest: usize) -> Result<Region<D>> {
        let grid = Grid::new(self.shape(1..=longest), self.flags())?;
        let origin = std::array::from_fn(|_| {
            if self.seldom(16) {
                self.any()
            } else {
                self.within(0..=40) as i32 - 20
            }
        });
        Region::new(grid, origin)
    }

    /// Returns a value from 0 to 1, or rarely one of `ODD`.
    pub fn real(&mut self) -> f32 {
        if self.seldom(32) {
            ODD[self.within(0..=ODD.len() - 1)]
        } else {
            f32::from(self.any::<u8>()) / 255.0
        }
    }

    /// Returns `n` values from 0 to 1. The values have few levels, so that ties are frequent.
    pub fn values(&mut self, n: usize) -> Vec<f32> {
        let levels = [1u32, 2, 5, 255][self.within(0..=3)];
        let level = |x: u32| (x % (levels + 1)) as f32 / levels as f32;
        self.words(n).map(level).collect()
    }

    /// Returns values like [`Self::values`]. Rarely, a few of them are replaced by values from
    /// `ODD`.
    pub fn reals(&mut self, n: usize) -> Vec<f32> {
        let mut values = self.values(n);
        if n > 0 && self.seldom(16) {
            for _ in 0..self.within(1..=3) {
                values[self.within(0..=n - 1)] = ODD[self.within(0..=ODD.len() - 1)];
            }
        }
        values
    }

    /// Returns `n` flags. The fraction of set flags is 1/2, 1/8, 7/8 or 1.
    pub fn mask(&mut self, n: usize) -> Vec<bool> {
        let set = [128, 32, 224, 256][self.within(0..=3)];
        self.words(n).map(|x| x % 256 < set).collect()
    }

    /// Returns `n` numbers below `most`.
    pub fn numbers(&mut self, n: usize, most: u32) -> impl Iterator<Item = u32> + use<'a> {
        self.words(n).map(move |x| x % most.max(1))
    }

    /// Returns `n` words, either from the bytes of the input or from the noise of a seed. With a
    /// seed, few bytes give many words.
    pub fn words(&mut self, n: usize) -> impl Iterator<Item = u32> + use<'a> {
        let words: Vec<u32> = if self.flag() {
            (0..n).map(|_| u32::from(self.any::<u8>())).collect()
        } else {
            let noise = Noise::new(u64::from(self.any::<u16>()));
            (0..n)
                .map(|i| noise.words([i as u32, 0, 0, 0])[0] >> 8)
                .collect()
        };
        words.into_iter()
    }

    /// Returns the remaining bytes.
    pub fn rest(self) -> &'a [u8] {
        self.0.take_rest()
    }
}

/// Returns the result of `work`, which must be bit-identical for one and two threads, or `None` if
/// both return a meaningful error.
pub fn agreed<T: Debug + Send>(work: impl Fn(&Monitor) -> Result<T> + Sync) -> Option<T> {
    let [one, two] =
        [1, 2].map(|threads| par::install(threads, || work(&Monitor::default())).unwrap());
    match (one, two) {
        (Ok(one), Ok(two)) => {
            // Floats are printed exactly, and all NaN values compare equal.
            assert_eq!(
                format!("{one:?}"),
                format!("{two:?}"),
                "one thread and two threads differ"
            );
            Some(one)
        }
        (Err(one), Err(two)) => {
            speaks(&one);
            speaks(&two);
            None
        }
        (one, two) => panic!("one thread: {one:?}; two: {two:?}"),
    }
}

/// Checks that an error has a message of several words, and that it is not a cancellation.
pub fn speaks(error: &Error) {
    assert!(!matches!(error, Error::Cancelled(_)), "{error}");
    assert!(error.to_string().contains(' '), "{error:?}");
}

/// Returns whether two values are equal, except for rounding errors of up to a fraction `share` of
/// their magnitudes.
pub fn near(a: f64, b: f64, share: f64) -> bool {
    a == b || (a - b).abs() <= share * (a.abs() + b.abs() + 1.0)
}
