//! Texture optimisation: coordinates corrected until every window of the output is like one of the exemplar.
//!
//! Kwatra et al., *Texture optimization for example-based synthesis*, SIGGRAPH 2005, on coordinates instead of colours:
//! the last word of every step is a copy. A pass corrects every other point, as on a chess board: where two pieces of the
//! exemplar meet, neighbours that look at each other at once would only swap. For each of its points it
//!
//! 1. gathers the window around it, in the exemplar's axes, through the coordinates as they are;
//! 2. looks for a better match among those of its neighbours (Barnes et al., *PatchMatch*, SIGGRAPH 2009) and a few drawn
//!    around the best;
//! 3. votes: takes one of the coordinates that the windows around it propose.
//!
//! Departures: a drawn match must be better by some of the exemplar's own spacing (an acceptance threshold), so that what is good
//! enough stays and sparse features are not washed out. Points whose neighbours all go on with the same piece of the
//! exemplar are left: only where pieces meet is there anything to correct. So are those around which nothing changed since
//! they were corrected last. Coordinates are displaced by the frame's
//! Jacobian wherever a window or a match is carried from one point to another (Lefebvre and Hoppe, 2006).

mod gather;
mod improve;
mod recent;
mod vote;

use crate::engine::appearance::{Appearance, UNIT};
use crate::engine::guide::Guide;
use crate::foundation::error::check_shape;
use crate::foundation::fixed::{Frames, Place, add, apply};
use crate::foundation::grid::Region;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

use self::recent::Recent;

/// Points that a task takes at a time.
const CHUNK: usize = 2048;
/// Distance of windows below which they are the same.
const FINEST: i32 = UNIT / 256;
/// How far a change makes points look again.
const NEAR: usize = 1;
/// What the acceptance and the coherence may be, at most.
const DEAREST: f64 = 1e6;
/// Points between two looks at whether to stop, at least.
const SLAB: usize = 1 << 18;

/// What [`correct`] is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Passes, at most; each corrects every other point.
    pub passes: usize,
    /// Number of the first, for work that is done in parts.
    pub first: u32,
    /// Compare each window with all of the exemplar's as well: for small ones.
    pub exhaustive: bool,
    /// How far the neighbours are whose matches are tried, 1 or 2.
    pub reach: i32,
    /// Acceptance threshold: how much better a drawn match must be, in units of the exemplar's spacing.
    pub acceptance: f64,
    /// Coherence penalty: what each neighbour costs whose piece of the exemplar is another, in units of the exemplar's spacing.
    pub coherence: f64,
    /// Radius of the vote; 0: each point takes the match of its own window.
    pub vote: usize,
    /// Stop when two passes change less than this share of the points; 0: never, for results that must not hang on
    /// distant ones.
    pub settled: f64,
    /// Chooses the texture; another for each resolution.
    pub seed: u64,
}

/// All that stays the same while a level is corrected.
struct Level<'a, const D: usize> {
    appearance: &'a Appearance<D>,
    region: &'a Region<D>,
    frames: Frames<'a, D>,
    guide: Option<&'a Guide<'a>>,
    held: &'a [bool],
    options: &'a Options,
    /// Steps to all neighbours, corners included.
    around: Vec<[i32; D]>,
    recent: Recent,
}

/// Corrects `places`, one a point of `region`, and returns the number of passes and the share of the points that the
/// last two changed. Points that are `held` are hard constraints: they keep their places.
#[allow(clippy::too_many_arguments)] // the exemplar, the region, and what is known of it
pub fn correct<const D: usize>(
    appearance: &Appearance<D>,
    region: &Region<D>,
    frames: Frames<'_, D>,
    guide: Option<&Guide<'_>>,
    held: &[bool],
    places: &mut [Place<D>],
    options: &Options,
    monitor: &Monitor,
) -> Result<(usize, f64)> {
    let points = region.grid.len();
    check_shape("places", &region.grid.shape(), places.len())?;
    if !held.is_empty() {
        check_shape("held", &region.grid.shape(), held.len())?;
    }
    if !(1..=2).contains(&options.reach) || options.vote > appearance.radius() {
        return Err(Error::value(
            "options",
            format!(
                "neighbours 1 or 2 away and a vote within the windows are allowed, got {options:?}"
            ),
        ));
    }
    let costs = [options.acceptance, options.coherence];
    if !costs.iter().all(|x| (0.0..=DEAREST).contains(x)) || options.settled.is_nan() {
        return Err(Error::value(
            "options",
            format!("acceptance and coherence from 0 to {DEAREST:e} are allowed, got {options:?}"),
        ));
    }
    frames.check(points)?;
    let copies = if options.vote > 0 { 2 * points } else { points };
    memory::room("the matches of a region", copies, 4 * D + 4)?;
    par::chunks_mut(places, CHUNK, |_, places| {
        for place in places {
            *place = appearance.bring_inside(*place);
        }
    });
    let mut level = Level {
        appearance,
        region,
        frames,
        guide,
        held,
        options,
        around: around(),
        recent: Recent::new(points, NEAR),
    };
    monitor.expect(options.passes.saturating_mul(points.div_ceil(level.slab())) as u64);
    let mut matches = places.to_vec();
    let mut elected = vec![[0; D]; if options.vote > 0 { points } else { 0 }];
    // What is before a pass and what is after it take turns.
    let (mut before, mut matches, mut elected) = (places, &mut matches[..], &mut elected[..]);
    let (mut moved, mut done) = ([0, 0], 0);
    while done < options.passes {
        let number = options.first.wrapping_add(done as u32);
        level.matches(before, matches, number, monitor)?;
        let newest = if options.vote > 0 {
            level.vote(before, matches, elected, number);
            &mut elected
        } else {
            &mut matches
        };
        moved = [moved[1], level.recent.note(before, newest)];
        std::mem::swap(&mut before, newest);
        done += 1;
        if done > 1 && ((moved[0] + moved[1]) as f64) < options.settled * points as f64 {
            break;
        }
        if done > 1 && done < options.passes {
            level.recent.spread(&region.grid);
        }
    }
    if done % 2 == 1 {
        let places = if options.vote > 0 { elected } else { matches };
        places.copy_from_slice(before);
    }
    Ok((done, (moved[0] + moved[1]) as f64 / points as f64))
}

impl<const D: usize> Level<'_, D> {
    /// Points that are corrected between two looks at whether to stop: many more than windows reach beyond them.
    fn slab(&self) -> usize {
        SLAB.max(8 * self.margin())
    }

    /// What the guide says of showing a sample at a point.
    #[inline(always)]
    fn asked(&self, point: usize, sample: usize) -> i64 {
        self.guide.as_ref().map_or(0, |g| g.cost(point, sample))
    }

    /// Whether a pass corrects a point: one of its colour of the chess board that sees something new, where pieces of
    /// the exemplar meet.
    #[inline(always)]
    fn corrects(&self, places: &[Place<D>], p: usize, pass: u32) -> bool {
        let point = self.region.grid.point(p);
        let world = self.region.world(point);
        let parity = world.iter().fold(pass, |sum, &x| sum ^ x as u32) & 1;
        parity == 0
            && self.recent.near(p)
            && !self.held.get(p).is_some_and(|&h| h)
            && (self.options.exhaustive || self.guide.is_some() || self.meet(places, p, point))
    }

    /// Whether a neighbour of a point does not go on with the point's own piece of the exemplar.
    #[inline(always)]
    fn meet(&self, places: &[Place<D>], p: usize, point: [usize; D]) -> bool {
        let frame = self.frames.at(p);
        self.around.iter().any(|&step| {
            self.region.step(point, step).is_some_and(|q| {
                let mine = add(places[p], apply(&frame, step));
                !self.appearance.same(mine, places[q])
            })
        })
    }

    /// Runs `each`, with scratch memory of its own, on the points that a pass corrects; the others keep their places.
    fn pass<S>(
        &self,
        places: &[Place<D>],
        range: std::ops::Range<usize>,
        to: &mut [Place<D>],
        number: u32,
        scratch: impl Fn() -> S + Sync,
        each: impl Fn(&mut S, usize) -> Place<D> + Sync,
    ) {
        par::chunks_mut(&mut to[range.clone()], CHUNK, |chunk, to| {
            let first = range.start + chunk * CHUNK;
            let mut scratch = scratch();
            for (p, place) in (first..).zip(to) {
                *place = if self.corrects(places, p, number) {
                    self.appearance.bring_inside(each(&mut scratch, p))
                } else {
                    places[p]
                };
            }
        });
    }
}

/// Steps to all neighbours, corners included.
fn around<const D: usize>() -> Vec<[i32; D]> {
    (0..3usize.pow(D as u32))
        .map(|mut k| {
            std::array::from_fn(|_| {
                let x = (k % 3) as i32 - 1;
                k /= 3;
                x
            })
        })
        .filter(|&step| step != [0; D])
        .collect()
}

#[cfg(test)]
mod tests;
