//! One point chooses among what its diagonal neighbours' samples are like.

use super::{CHUNK, FEW, LARGEST, Similarity, Table};
use crate::engine::appearance::{Appearance, KEEP};
use crate::foundation::fixed::{Frame, Frames, ONE, Place, add, apply, inverse, nearest, sub};
use crate::foundation::grid::Region;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// Diagonal neighbours, at most.
const CORNERS: usize = 8;
/// Points of a class that a task takes at a time: small pictures have few, and no thread is to wait long for another.
const SHARE: usize = 256;
/// Sums that a cost is added up in, each of pairs of numbers.
const LANES: usize = 4;

/// Passes, at most: turns are counted by 32 bits.
const MOST: usize = 1 << 24;

/// What [`correct`] is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Passes over the region.
    pub passes: usize,
    /// Numbers of the appearance vectors that are compared: [`FEW`] or all.
    pub numbers: usize,
    /// Read neighbours where the diagonal itself leads, not only where the lattice makes it end: x(q) + D - J q.
    pub compensated: bool,
}

/// What may lie where: points take candidates of the kind they want. Empty: anything anywhere.
#[derive(Debug, Clone, Copy, Default)]
pub struct Kinds<'a> {
    /// Kind of each of the exemplar's samples.
    pub samples: &'a [u8],
    /// Kind that each point wants; [`Kinds::ANY`] takes any.
    pub points: &'a [u8],
}

impl Kinds<'_> {
    /// What a point wants that does not care.
    pub const ANY: u8 = 255;
}

/// Corrects `places`, one a point of `region`; points that are `held` keep theirs, and so do those that are offered
/// nothing of the kind they want.
///
/// A pass goes over 2^D classes of points, those of the same parity along each axis, in fixed order. Points of a class
/// are corrected all at once, from the places as the class found them.
#[allow(clippy::too_many_arguments)] // the exemplar, the region, and what is known of both
pub fn correct<const D: usize>(
    appearance: &Appearance<D>,
    similarity: &Similarity,
    region: &Region<D>,
    frames: Frames<'_, D>,
    held: &[bool],
    kinds: Kinds<'_>,
    places: &mut [Place<D>],
    options: &Options,
    monitor: &Monitor,
) -> Result<()> {
    let points = region.grid.len();
    let samples = appearance.grid().len();
    frames.check(points)?;
    memory::room("the corrected coordinates", points, 32 * D)?;
    if !(1..=LARGEST).contains(&similarity.k) {
        let message = format!("needs sets of 1 to {LARGEST}, got {}", similarity.k);
        return Err(Error::value("similarity", message));
    }
    for (argument, length, wanted) in [
        ("places", places.len(), points),
        ("held", held.len(), if held.is_empty() { 0 } else { points }),
        ("similarity", similarity.sets.len(), samples * similarity.k),
        (
            "kinds",
            kinds.samples.len(),
            if kinds.points.is_empty() { 0 } else { samples },
        ),
        (
            "wanted",
            kinds.points.len(),
            if kinds.samples.is_empty() { 0 } else { points },
        ),
    ] {
        if length != wanted {
            return Err(Error::Shape {
                argument,
                expected: vec![wanted],
                got: vec![length],
            });
        }
    }
    // Each sample once, for divisions cost more than all else here.
    let inside: Vec<bool> = (0..samples)
        .map(|s| {
            let sample = appearance.grid().point(s).map(|x| x as i32);
            appearance.inside(sample).is_some()
        })
        .collect();
    let sets = similarity.sets.chunks_exact(similarity.k);
    let sound = sets.enumerate().all(|(i, set)| {
        let allowed = |&s: &u32| s as usize == i || inside.get(s as usize).is_some_and(|&b| b);
        set.iter().all(allowed)
    });
    if !sound {
        return Err(Error::value(
            "similarity",
            format!(
                "needs sets of 1 to {LARGEST} of the exemplar's {samples} samples whose windows lie inside"
            ),
        ));
    }
    par::chunks_mut(places, CHUNK, |_, places| {
        for place in places {
            *place = appearance.bring_inside(*place);
        }
    });
    if options.passes > MOST {
        let message = format!("up to {MOST} are allowed, got {}", options.passes);
        return Err(Error::value("passes", message));
    }
    match options.numbers {
        FEW => Level::<D, FEW>::new(appearance, similarity, region, frames, held, kinds, options)
            .run(places, monitor),
        KEEP => Level::<D, KEEP>::new(appearance, similarity, region, frames, held, kinds, options)
            .run(places, monitor),
        other => Err(Error::value(
            "numbers",
            format!("{FEW} or {KEEP} are allowed, got {other}"),
        )),
    }
}

/// A diagonal neighbour, warped: where it lies on the output's lattice, what that is in the exemplar, and what a place
/// there lacks of the diagonal.
#[derive(Clone, Copy)]
struct Corner<const D: usize> {
    step: [i32; D],
    moved: Place<D>,
    lacking: Place<D>,
}

struct Level<'a, const D: usize, const N: usize> {
    appearance: &'a Appearance<D>,
    similarity: &'a Similarity,
    region: &'a Region<D>,
    frames: Frames<'a, D>,
    held: &'a [bool],
    kinds: Kinds<'a>,
    options: &'a Options,
    table: Table<D, N>,
    /// The diagonals, and how far they lead in the table.
    diagonals: Vec<[i32; D]>,
    beside: Vec<i32>,
}

impl<'a, const D: usize, const N: usize> Level<'a, D, N> {
    fn new(
        appearance: &'a Appearance<D>,
        similarity: &'a Similarity,
        region: &'a Region<D>,
        frames: Frames<'a, D>,
        held: &'a [bool],
        kinds: Kinds<'a>,
        options: &'a Options,
    ) -> Self {
        let table = Table::new(appearance);
        let diagonals: Vec<[i32; D]> = (0..1 << D)
            .map(|corner| std::array::from_fn(|axis| 2 * bit::<D>(corner, axis) - 1))
            .collect();
        let beside = diagonals.iter().map(|&d| table.step(d)).collect();
        Self {
            appearance,
            similarity,
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

    fn run(&self, places: &mut [Place<D>], monitor: &Monitor) -> Result<()> {
        let constant = match self.frames {
            Frames::Constant(frame) => Some(self.corners(&frame)),
            Frames::Dense(_) => None,
        };
        let classes = self.classes();
        // The turn, counted from 1, in which each point last changed.
        let mut changed = vec![0u32; places.len()];
        let turns = self.options.passes << D;
        monitor.expect(turns as u64);
        for turn in 0..turns {
            let class = &classes[turn % (1 << D)];
            let now = turn as u32 + 1;
            let before = now.saturating_sub(1 << D);
            let mut found = vec![[0; D]; class.len()];
            par::chunks_mut(&mut found, SHARE, |chunk, found| {
                // Neighbours mostly share their frame.
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
                    // What a point chooses hangs on its neighbours alone: where none of them has changed since it last
                    // chose, it would choose the same.
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

    /// The points that may change, by their parities along the axes.
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

    /// The neighbours phi / |phi|, phi = F d, on the lattice, for a frame J = F^-1.
    fn corners(&self, frame: &Frame<D>) -> [Corner<D>; CORNERS] {
        let turned = inverse(frame);
        let mut corners = [Corner {
            step: [0; D],
            moved: [0; D],
            lacking: [0; D],
        }; CORNERS];
        for (corner, &diagonal) in corners.iter_mut().zip(&self.diagonals) {
            let phi: [i64; D] = std::array::from_fn(|i| {
                (0..D)
                    .map(|j| i64::from(turned[i][j]) * i64::from(diagonal[j]))
                    .sum()
            });
            let square: i64 = phi.iter().map(|x| x * x).sum();
            // The nearest whole number of x / |phi|, at most 1: 1 from a half on.
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
    fn choose(
        &self,
        places: &[Place<D>],
        p: usize,
        point: [usize; D],
        corners: &[Corner<D>; CORNERS],
    ) -> Place<D> {
        // Eq. 3: what is seen around the point, by its diagonal neighbours that the region has.
        let mut seen = [([0i16; N], 0i32); CORNERS];
        let mut from = [([0; D], [0; D]); CORNERS];
        let mut count = 0;
        for (k, corner) in corners[..1 << D].iter().enumerate() {
            let Some(q) = self.region.step(point, corner.step) else {
                continue;
            };
            let place = self.appearance.bring_inside(add(places[q], corner.lacking));
            let at = self.table.at(self.settle(nearest(place)));
            seen[count] = (self.table.vectors[at as usize], self.beside[k]);
            from[count] = (places[q], corner.moved);
            count += 1;
        }
        let seen = &seen[..count];
        let wanted = match self.kinds.points.get(p) {
            Some(&Kinds::ANY) | None => None,
            Some(&kind) => Some(kind),
        };
        let (mut best, mut least) = (places[p], i64::MAX);
        for &(place, moved) in &from[..count] {
            // Nothing is better than what fits exactly.
            if least == 0 {
                break;
            }
            let sample = nearest(place);
            let at = self.appearance.clamped(sample);
            let fraction = sub(place, sample.map(|x| x * ONE));
            let rest = sub(fraction, moved);
            for &similar in &self.similarity.sets[at * self.similarity.k..][..self.similarity.k] {
                let candidate = add(self.sample(similar).map(|x| x * ONE), rest);
                let there = nearest(candidate);
                let Some(number) = self.appearance.inside(there) else {
                    continue;
                };
                if wanted.is_some_and(|kind| self.kinds.samples[number] != kind) {
                    continue;
                }
                let centre = self.table.at(self.settle(there));
                // To add all up costs less than to ask after each whether it is too much already.
                let cost = seen.iter().fold([0; LANES], |sums, (vector, beside)| {
                    added(
                        sums,
                        vector,
                        &self.table.vectors[(centre + beside) as usize],
                    )
                });
                let cost = cost.into_iter().map(i64::from).sum();
                if cost < least {
                    (best, least) = (candidate, cost);
                }
            }
        }
        self.appearance.bring_inside(best)
    }

    /// A sample that `inside` allows, brought around cyclic axes.
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

    /// The sample at a row-major position.
    #[inline(always)]
    fn sample(&self, mut at: u32) -> [i32; D] {
        let shape = self.appearance.grid().shape();
        let mut sample = [0; D];
        for axis in (1..D).rev() {
            let n = shape[axis] as u32;
            sample[axis] = (at % n) as i32;
            at /= n;
        }
        sample[0] = at as i32;
        sample
    }
}

/// Adds squared differences, pair by pair: twelve bits each, so the sums of eight vectors fit.
#[inline(always)]
fn added<const N: usize>(mut sums: [u32; LANES], a: &[i16; N], b: &[i16; N]) -> [u32; LANES] {
    for part in 0..N / (2 * LANES) {
        for (lane, sum) in sums.iter_mut().enumerate() {
            let at = 2 * (part * LANES + lane);
            let [first, second] = [at, at + 1].map(|k| i32::from(a[k].wrapping_sub(b[k])));
            *sum += (first * first + second * second) as u32;
        }
    }
    sums
}

/// Which side of an axis the `corner`-th of 2^D corners lies on: the last axis alternates fastest.
#[inline(always)]
fn bit<const D: usize>(corner: usize, axis: usize) -> i32 {
    (corner >> (D - 1 - axis) & 1) as i32
}
