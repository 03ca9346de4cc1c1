//! Counter-based noise: Philox4x32-10.
//!
//! The method is by Salmon, Moraes, Dror and Shaw, *Parallel random numbers: as easy as 1, 2, 3*,
//! SC 2011. A value depends only on the seed and on its position. The order of visits to positions
//! therefore does not matter.

const ROUNDS: usize = 10;
const MULTIPLIERS: [u32; 2] = [0xD251_1F53, 0xCD9E_8D57];
const WEYL: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];

/// Computes the Philox4x32-10 block function.
pub fn philox(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    let (mut c, mut k) = (counter, key);
    for round in 0..ROUNDS {
        if round > 0 {
            k = [k[0].wrapping_add(WEYL[0]), k[1].wrapping_add(WEYL[1])];
        }
        let p0 = u64::from(MULTIPLIERS[0]) * u64::from(c[0]);
        let p1 = u64::from(MULTIPLIERS[1]) * u64::from(c[2]);
        c = [
            (p1 >> 32) as u32 ^ c[1] ^ k[0],
            p1 as u32,
            (p0 >> 32) as u32 ^ c[3] ^ k[1],
            p0 as u32,
        ];
    }
    c
}

/// The noise of one seed, addressed by position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Noise {
    key: [u32; 2],
}

impl Noise {
    /// Returns the noise of a seed.
    pub fn new(seed: u64) -> Self {
        Self {
            key: [seed as u32, (seed >> 32) as u32],
        }
    }

    /// Returns noise for one of several uses. The noise of each use is independent of the others.
    pub fn part(&self, use_: u32) -> Self {
        let [a, b, ..] = self.words([use_, 0x7061_7274, 0, 0]);
        Self { key: [a, b] }
    }

    /// Returns four random words for a point of a world of two or three axes. `count` selects one
    /// of several draws.
    pub fn at<const D: usize>(&self, world: [i32; D], count: u32) -> [u32; 4] {
        let mut position = [0, 0, 0, count];
        for axis in 0..D.min(3) {
            position[axis] = world[axis] as u32;
        }
        self.words(position)
    }

    /// Returns four independent random words for a position of up to four coordinates.
    pub fn words(&self, position: [u32; 4]) -> [u32; 4] {
        philox(position, self.key)
    }

    /// Returns a number in [0, 1) with 53 random bits.
    pub fn uniform(&self, position: [u32; 4]) -> f64 {
        let [a, b, ..] = self.words(position);
        let bits = (u64::from(a) << 32 | u64::from(b)) >> 11;
        bits as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Returns a number in `0..n` with a bias below n / 2^64.
    pub fn below(&self, n: u64, position: [u32; 4]) -> u64 {
        let [a, b, ..] = self.words(position);
        let bits = u64::from(a) << 32 | u64::from(b);
        ((u128::from(bits) * u128::from(n)) >> 64) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known answers published with Random123 (`kat_vectors`).
    #[test]
    fn gives_the_published_answers() {
        assert_eq!(
            philox([0; 4], [0; 2]),
            [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]
        );
        assert_eq!(
            philox([u32::MAX; 4], [u32::MAX; 2]),
            [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]
        );
        assert_eq!(
            philox(
                [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
                [0xa409_3822, 0x299f_31d0]
            ),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }

    #[test]
    fn uniform_numbers_fill_the_unit_interval_evenly() {
        let noise = Noise::new(7);
        let mut deciles = [0usize; 10];
        for i in 0..10_000 {
            deciles[(noise.uniform([i, 0, 0, 0]) * 10.0) as usize] += 1;
        }
        assert!(
            deciles.iter().all(|&n| (850..1150).contains(&n)),
            "{deciles:?}"
        );
        assert!((0..1000).all(|i| noise.below(7, [i, 1, 0, 0]) < 7));
    }
}
