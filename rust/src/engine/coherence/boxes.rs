//! Squared distances of one vector to eight vectors or eight boxes. They are integers, so they are exact on every
//! processor.

use super::FEW;

/// Number of vectors or boxes that are compared at a time.
pub(super) const WIDTH: usize = 8;
/// Number of pairs of components in a shortened vector.
const PAIRS: usize = FEW / 2;

/// The first [`FEW`] components of [`WIDTH`] vectors. Each row has one pair of components of each vector, because the
/// SIMD instruction multiplies and adds pairs.
pub(super) type Block = [[i16; 2 * WIDTH]; PAIRS];
/// The first [`FEW`] components of a vector, as pairs.
pub(super) type Query = [[i16; 2]; PAIRS];
/// A bit for each of eight distances, set if the distance is at most a limit, and the eight distances.
pub(super) type Found = (u32, [i32; WIDTH]);
/// The minimum and the maximum of each of the first [`FEW`] components.
pub(super) type Extent = [(i16, i16); FEW];

/// Bounding boxes of up to eight sets of vectors, and the lowest vector number in each set.
pub(super) struct Boxes {
    low: Block,
    high: Block,
    pub(super) least: [u32; WIDTH],
    /// A bit for each box that exists.
    there: u32,
}

impl Boxes {
    /// Collects up to eight boxes, each with its lowest vector number.
    pub(super) fn of(things: impl Iterator<Item = (Extent, u32)>) -> Self {
        let mut boxes = Self {
            low: [[0; 2 * WIDTH]; PAIRS],
            high: [[0; 2 * WIDTH]; PAIRS],
            least: [u32::MAX; WIDTH],
            there: 0,
        };
        for (lane, (extent, least)) in things.take(WIDTH).enumerate() {
            for k in 0..FEW {
                boxes.low[k / 2][2 * lane + k % 2] = extent[k].0;
                boxes.high[k / 2][2 * lane + k % 2] = extent[k].1;
            }
            boxes.least[lane] = least;
            boxes.there |= 1 << lane;
        }
        boxes
    }

    /// Returns the box around all boxes, and the lowest vector number.
    pub(super) fn whole(&self) -> (Extent, u32) {
        let lanes = 0..self.there.count_ones() as usize;
        let at = |side: &Block, k: usize, lane: usize| side[k / 2][2 * lane + k % 2];
        let extent = std::array::from_fn(|k| {
            lanes.clone().fold((i16::MAX, i16::MIN), |(low, high), l| {
                (low.min(at(&self.low, k, l)), high.max(at(&self.high, k, l)))
            })
        });
        (extent, self.least.into_iter().min().unwrap_or(u32::MAX))
    }
}

/// Returns the block of eight vectors.
pub(super) fn block(vector: impl Fn(usize) -> [i16; FEW]) -> Block {
    let mut block = [[0; 2 * WIDTH]; PAIRS];
    for lane in 0..WIDTH {
        for (k, x) in vector(lane).into_iter().enumerate() {
            block[k / 2][2 * lane + k % 2] = x;
        }
    }
    block
}

/// Returns a vector as pairs.
pub(super) fn pairs(vector: &[i16; FEW]) -> Query {
    std::array::from_fn(|k| [vector[2 * k], vector[2 * k + 1]])
}

/// Returns the bounding box of vectors.
pub(super) fn extent(vectors: impl Iterator<Item = [i16; FEW]>) -> Extent {
    let mut bounds = [(i16::MAX, i16::MIN); FEW];
    for vector in vectors {
        for (bound, x) in bounds.iter_mut().zip(vector) {
            *bound = (bound.0.min(x), bound.1.max(x));
        }
    }
    bounds
}

/// Returns the squared distances of a vector to the vectors of a block.
pub(super) fn distances(block: &Block, query: &Query, limit: i32) -> Found {
    found(limit, |k, lane| {
        let apart = block[k / 2][2 * lane + k % 2].wrapping_sub(query[k / 2][k % 2]);
        i32::from(apart)
    })
}

/// Returns the squared distance of a vector to each box, which is a lower bound for the vectors in the box.
pub(super) fn bounds(boxes: &Boxes, query: &Query, limit: i32) -> Found {
    let (near, found) = found(limit, |k, lane| {
        let (side, x) = (2 * lane + k % 2, query[k / 2][k % 2]);
        let below = boxes.low[k / 2][side].wrapping_sub(x);
        let above = x.wrapping_sub(boxes.high[k / 2][side]);
        i32::from(below.max(above).max(0))
    });
    (near & boxes.there, found)
}

#[inline(always)]
fn found(limit: i32, apart: impl Fn(usize, usize) -> i32) -> Found {
    let mut sums = [0; WIDTH];
    for k in 0..FEW {
        for (lane, sum) in sums.iter_mut().enumerate() {
            let apart = apart(k, lane);
            *sum += apart * apart;
        }
    }
    let near = (0..WIDTH).fold(0, |near, l| near | u32::from(sums[l] <= limit) << l);
    (near, sums)
}

/// The same functions with AVX2, which nearly every x86-64 processor has.
#[cfg(all(target_arch = "x86_64", not(feature = "portable")))]
pub(super) mod v3 {
    use std::arch::x86_64::__m256i;

    use super::{Block, Boxes, Found, PAIRS, Query, WIDTH};
    use crate::foundation::simd::{V3, cast};

    // Vectorise these functions themselves, because the compiler does not inline all of a search into its vectorised
    // caller.
    #[inline(always)]
    pub(in super::super) fn distances(simd: V3, block: &Block, query: &Query, limit: i32) -> Found {
        simd.vectorize(
            #[inline(always)]
            || {
                let mut sums = simd.avx._mm256_setzero_si256();
                for k in 0..PAIRS {
                    let apart = simd
                        .avx2
                        ._mm256_sub_epi16(cast(block[k]), same(simd, query[k]));
                    sums = add(simd, sums, apart);
                }
                found(simd, sums, limit)
            },
        )
    }

    #[inline(always)]
    pub(in super::super) fn bounds(simd: V3, boxes: &Boxes, query: &Query, limit: i32) -> Found {
        simd.vectorize(
            #[inline(always)]
            || {
                let zero = simd.avx._mm256_setzero_si256();
                let mut sums = zero;
                for k in 0..PAIRS {
                    let x = same(simd, query[k]);
                    let below = simd.avx2._mm256_sub_epi16(cast(boxes.low[k]), x);
                    let above = simd.avx2._mm256_sub_epi16(x, cast(boxes.high[k]));
                    let outside = simd.avx2._mm256_max_epi16(below, above);
                    sums = add(simd, sums, simd.avx2._mm256_max_epi16(outside, zero));
                }
                let (near, found) = found(simd, sums, limit);
                (near & boxes.there, found)
            },
        )
    }

    /// Adds the squares of the differences, pair by pair.
    #[inline(always)]
    fn add(simd: V3, sums: __m256i, apart: __m256i) -> __m256i {
        let squares = simd.avx2._mm256_madd_epi16(apart, apart);
        simd.avx2._mm256_add_epi32(sums, squares)
    }

    /// Repeats one pair for all vectors.
    #[inline(always)]
    fn same(simd: V3, [first, second]: [i16; 2]) -> __m256i {
        simd.avx
            ._mm256_set1_epi32(i32::from(second) << 16 | i32::from(first as u16))
    }

    #[inline(always)]
    fn found(simd: V3, sums: __m256i, limit: i32) -> Found {
        let limits = simd.avx._mm256_set1_epi32(limit);
        let far = simd.avx2._mm256_cmpgt_epi32(sums, limits);
        let far = simd.avx._mm256_movemask_ps(cast(far));
        (!far as u32 & 255, cast::<_, [i32; WIDTH]>(sums))
    }
}
