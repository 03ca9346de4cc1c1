//! One level of the correction: each point chooses among the samples that are similar to its diagonal neighbours'
//! samples.

use super::pass::{Kinds, Options};
use super::{CHUNK, LARGEST, Similarity, Table};
use crate::Result;
use crate::engine::appearance::Appearance;
use crate::foundation::fixed::{Frame, Frames, ONE, Place, add, apply, inverse, nearest, sub};
use crate::foundation::grid::Region;
use crate::foundation::par::{self, Monitor};
use crate::foundation::simd::square_apart;

/// Maximum number of diagonal neighbours.
const CORNERS: usize = 8;
/// Number of points of a class in a task. It is small because small images have few points, and no thread should wait
/// long for another.
const SHARE: usize = 256;
/// Number of partial sums of a cost; each sums pairs of numbers.
const LANES: usize = 4;

/// Bits of each coordinate of a packed sample. The sides of an exemplar are below 2^21.
const BITS_EACH: u32 = 21;

/// Packs the coordinates of a sample into one number.
fn pack<const D: usize>(sample: [usize; D]) -> u64 {
    sample
        .iter()
        .fold(0, |packed, &x| packed << BITS_EACH | x as u64)
}

#[inline(always)]
/// Returns the coordinates of a packed sample.
fn unpack<const D: usize>(packed: u64) -> [i32; D] {
    std::array::from_fn(|axis| {
        (packed >> (BITS_EACH * (D - 1 - axis) as u32)) as i32 & ((1 << BITS_EACH) - 1)
    })
}

/// A diagonal neighbour of a point, warped by the frame. `step` is its offset on the output's lattice, and `moved` the
/// same offset in the exemplar. `lacking` is the difference of `moved` from the unwarped diagonal.
#[derive(Clone, Copy)]
struct Corner<const D: usize> {
    step: [i32; D],
    moved: Place<D>,
    lacking: Place<D>,
}

/// The vector that a neighbour shows, and the table offset from a candidate to the sample at the same diagonal.
type Seen<const N: usize> = ([i16; N], i32);

/// The inputs and tables of a correction.
pub(super) struct Level<'a, const D: usize, const N: usize> {
    appearance: &'a Appearance<D>,
    /// `k` substitutes for each sample, as packed coordinates. Computing coordinates from positions would need
    /// divisions, the costliest step here.
    sets: Vec<u64>,
    k: usize,
    region: &'a Region<D>,
    frames: Frames<'a, D>,
    held: &'a [bool],
    kinds: Kinds<'a>,
    options: &'a Options,
    table: Table<D, N>,
    /// Steps to the diagonal neighbours. `beside` contains the table offset of each step.
    diagonals: Vec<[i32; D]>,
    beside: Vec<i32>,
}

impl<'a, const D: usize, const N: usize> Level<'a, D, N> {
    /// Prepares the tables that all points read.
    pub(super) fn new(
        appearance: &'a Appearance<D>,
        similarity: &Similarity,
        region: &'a Region<D>,
        frames: Frames<'a, D>,
        held: &'a [bool],
        kinds: Kinds<'a>,
        options: &'a Options,
    ) -> Self {
        let table = Table::new(appearance);
        // Pack the coordinates of the substitutes once, so that points need no divisions.
        let mut sets = vec![0; similarity.sets.len()];
        par::chunks_mut(&mut sets, CHUNK, |chunk, sets| {
            for (set, &s) in sets.iter_mut().zip(&similarity.sets[chunk * CHUNK..]) {
                *set = pack(appearance.grid().point(s as usize));
            }
        });
        let diagonals: Vec<[i32; D]> = (0..1 << D)
            .map(|corner| std::array::from_fn(|axis| 2 * bit::<D>(corner, axis) - 1))
            .collect();
        let beside = diagonals.iter().map(|&d| table.step(d)).collect();
        Self {
            appearance,
            sets,
            k: similarity.k,
            region,
            frames,
            held,
            kinds,
            options,
            table,
            diagonals,
            beside,
        }
    }

    /// Makes all passes over `places`.
    pub(super) fn run(&self, places: &mut [Place<D>], monitor: &Monitor) -> Result<()> {
        let constant = match self.frames {
            Frames::Constant(frame) => Some(self.corners(&frame)),
            Frames::Dense(_) => None,
        };
        let classes = self.classes();
        // For each point, the number of the last turn that changed it, counted from 1, or 0 if no turn did.
        let mut changed = vec![0u32; places.len()];
        let turns = self.options.passes << D;
        monitor.expect(turns as u64);
        for turn in 0..turns {
            let class = &classes[turn % (1 << D)];
            let now = turn as u32 + 1;
            let before = now.saturating_sub(1 << D);
            let mut found = vec![[0; D]; class.len()];
            par::chunks_mut(&mut found, SHARE, |chunk, found| {
                // Reuse the corners of the previous point, because neighbours mostly have the same frame.
                let mut last = constant.map(|corners| (None, corners));
                for (i, place) in found.iter_mut().enumerate() {
                    let p = class[chunk * SHARE + i] as usize;
                    let point = self.region.grid.point(p);
                    let frame = constant.is_none().then(|| self.frames.at(p));
                    let corners = match last {
                        Some((known, corners)) if known == frame => corners,
                        _ => self.corners(&self.frames.at(p)),
                    };
                    last = Some((frame, corners));
                    // Skip a point if its neighbours have not changed since its last choice, because the choice
                    // depends only on them.
                    let stirred = |corner: &Corner<D>| {
                        self.region
                            .step(point, corner.step)
                            .is_some_and(|q| changed[q] >= before)
                    };
                    *place = if before == 0 || corners[..1 << D].iter().any(stirred) {
                        self.choose(places, p, point, &corners)
                    } else {
                        places[p]
                    };
                }
            });
            // Write the choices after the whole class has chosen, because its points must read the places from before.
            for (&p, &place) in class.iter().zip(&found) {
                if places[p as usize] != place {
                    places[p as usize] = place;
                    changed[p as usize] = now;
                }
            }
            monitor.advance(1)?;
        }
        Ok(())
    }

    /// Returns the points that are not held, grouped by the parity of their coordinates.
    fn classes(&self) -> Vec<Vec<u32>> {
        let mut classes = vec![vec![]; 1 << D];
        for p in 0..self.region.grid.len() {
            if self.held.get(p).is_some_and(|&h| h) {
                continue;
            }
            let world = self.region.world(self.region.grid.point(p));
            let class = (0..D).fold(0, |class, axis| 2 * class + (world[axis] & 1) as usize);
            classes[class].push(p as u32);
        }
        classes
    }

    /// Returns the lattice neighbour of each diagonal d: phi / |phi|, rounded, where phi = F d and the frame is J =
    /// F^-1.
    fn corners(&self, frame: &Frame<D>) -> [Corner<D>; CORNERS] {
        let turned = inverse(frame);
        let mut corners = [Corner {
            step: [0; D],
            moved: [0; D],
            lacking: [0; D],
        }; CORNERS];
        for (corner, &diagonal) in corners.iter_mut().zip(&self.diagonals) {
            // Map the diagonal to the output's lattice by the inverse frame.
            let phi: [i64; D] = std::array::from_fn(|i| {
                (0..D)
                    .map(|j| i64::from(turned[i][j]) * i64::from(diagonal[j]))
                    .sum()
            });
            let square: i64 = phi.iter().map(|x| x * x).sum();
            // Round x / |phi|, which is at most 1, to the nearest integer. A magnitude of 0.5 is rounded to 1.
            corner.step = phi.map(|x| {
                if 4 * x * x >= square {
                    x.signum() as i32
                } else {
                    0
                }
            });
            corner.moved = apply(frame, corner.step);
            if self.options.compensated {
                corner.lacking = sub(diagonal.map(|x| x * ONE), corner.moved);
            }
        }
        corners
    }

    #[inline(always)]
    /// Returns the best place for the point `p`, or its present place if no candidate is allowed.
    fn choose(
        &self,
        places: &[Place<D>],
        p: usize,
        point: [usize; D],
        corners: &[Corner<D>; CORNERS],
    ) -> Place<D> {
        // Collect the vectors that the diagonal neighbours inside the region show (Eq. 3 of the paper of
        // `texrs.papers.solid`), and their substitutes. Each step handles all neighbours, so that no read waits for
        // the previous one.
        let mut seen = [([0i16; N], 0i32); CORNERS];
        let mut rests = [[0; D]; CORNERS];
        let mut similar = [0u64; CORNERS * LARGEST];
        let mut count = 0;
        for (k, corner) in corners[..1 << D].iter().enumerate() {
            let Some(q) = self.region.step(point, corner.step) else {
                continue;
            };
            let place = self.appearance.bring_inside(add(places[q], corner.lacking));
            let at = self.table.at(self.settle(nearest(place)));
            seen[count] = (self.table.vectors[at as usize], self.beside[k]);
            let sample = nearest(places[q]);
            rests[count] = sub(sub(places[q], sample.map(|x| x * ONE)), corner.moved);
            let set = &self.sets[self.appearance.clamped(sample) * self.k..][..self.k];
            for (to, &other) in similar[count * self.k..].iter_mut().zip(set) {
                *to = other;
            }
            count += 1;
        }
        // Turn the substitutes into candidates: add the subsample rest and the step back, then drop those that are not
        // allowed.
        let seen = &seen[..count];
        let wanted = match self.kinds.points.get(p) {
            Some(&Kinds::ANY) | None => None,
            Some(&kind) => Some(kind),
        };
        let (mut candidates, mut count) = ([([0; D], 0i32); CORNERS * LARGEST], 0usize);
        let mut before = [i32::MIN; LARGEST];
        let sets = similar.chunks_exact(self.k).take(seen.len());
        for (set, &rest) in sets.zip(&rests) {
            for (&similar, before) in set.iter().zip(&mut before) {
                let candidate = add(unpack(similar).map(|x: i32| x * ONE), rest);
                let there = nearest(candidate);
                let Some(number) = self.appearance.inside(there) else {
                    continue;
                };
                if wanted.is_some_and(|kind| self.kinds.samples[number] != kind) {
                    continue;
                }
                // Skip duplicates. Within a patch of the exemplar, neighbours propose the same candidates in the same
                // order.
                let centre = self.table.at(self.settle(there));
                if std::mem::replace(before, centre) == centre {
                    continue;
                }
                candidates[count] = (candidate, centre);
                count += 1;
            }
        }
        let candidates = &candidates[..count];
        // Pass the usual numbers of neighbours as arrays, so that the compiler keeps their vectors in registers.
        let best = if let Ok(seen) = <&[Seen<N>; 8]>::try_from(seen) {
            self.least(seen, candidates)
        } else if let Ok(seen) = <&[Seen<N>; 4]>::try_from(seen) {
            self.least(seen, candidates)
        } else {
            self.least(seen, candidates)
        };
        self.appearance.bring_inside(best.unwrap_or(places[p]))
    }

    /// Returns the first candidate whose diagonal neighbours differ least from the seen vectors.
    #[inline(always)]
    fn least(&self, seen: &[Seen<N>], candidates: &[(Place<D>, i32)]) -> Option<Place<D>> {
        let (mut best, mut least) = (None, u32::MAX);
        for &(candidate, centre) in candidates {
            // Sum all differences. After each difference, a check whether the sum is already too large would cost
            // more.
            let cost = seen.iter().fold([0; LANES], |sums, (vector, beside)| {
                added(
                    sums,
                    vector,
                    &self.table.vectors[(centre + beside) as usize],
                )
            });
            let cost = cost.into_iter().sum();
            if cost < least {
                (best, least) = (Some(candidate), cost);
            }
        }
        best
    }

    /// Wraps a sample that `inside` accepts around the periodic axes.
    #[inline(always)]
    fn settle(&self, mut sample: [i32; D]) -> [i32; D] {
        let (shape, wrap) = (
            self.appearance.grid().shape(),
            self.appearance.grid().wrap(),
        );
        for axis in 0..D {
            let n = shape[axis] as i32;
            if wrap[axis] && !(0..n).contains(&sample[axis]) {
                sample[axis] = sample[axis].rem_euclid(n);
            }
        }
        sample
    }
}

/// Adds the squared differences of two vectors to `sums`. Components have 12 bits, so the sums of eight vectors fit
/// into 32 bits, and so does the total of all lanes.
#[inline(always)]
fn added<const N: usize>(mut sums: [u32; LANES], a: &[i16; N], b: &[i16; N]) -> [u32; LANES] {
    for (a, b) in a.as_chunks().0.iter().zip(b.as_chunks().0) {
        let pairs = square_apart(a, b);
        for (sum, pair) in sums.iter_mut().zip(pairs) {
            *sum += pair as u32;
        }
    }
    sums
}

/// Returns the side, 0 or 1, of the `corner`-th of 2^D corners along an axis. The last axis alternates fastest.
#[inline(always)]
fn bit<const D: usize>(corner: usize, axis: usize) -> i32 {
    (corner >> (D - 1 - axis) & 1) as i32
}
