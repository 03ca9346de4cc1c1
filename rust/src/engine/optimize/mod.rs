//! Texture optimisation: coordinates are corrected until every window of the output resembles a window of the
//! exemplar.
//!
//! The method is by Kwatra et al., *Texture optimization for example-based synthesis*, SIGGRAPH 2005. It is applied to
//! coordinates instead of colours, so that each point copies a sample. A pass corrects every other point, as on a
//! chessboard. Otherwise neighbours at the border of two patches would read each other's old places at once and only
//! swap them. A pass does the following for each point that it corrects:
//!
//! 1. It gathers the window around the point, aligned with the exemplar's axes, through the present coordinates.
//! 2. It looks for a better match among the neighbours' matches (Barnes et al., *PatchMatch*, SIGGRAPH 2009) and a few
//!    random matches around the best one.
//! 3. It votes: it takes one of the coordinates that the windows around the point propose.
//!
//! There are three departures from the papers. First, a random match must be better by a multiple of the exemplar's
//! own spacing (an acceptance threshold). Good matches therefore stay, and sparse features are not washed out. Second,
//! a point is skipped if all its neighbours show the same patch of the exemplar, because only borders of patches need
//! corrections. A point is also skipped if nothing around it has changed since its last correction. Third, the frame's
//! Jacobian displaces the positions of a window, and matches that are carried to another point (Lefebvre and Hoppe,
//! 2006).

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

/// Number of points in a task.
const CHUNK: usize = 2048;
/// Minimum spacing of an exemplar that costs are scaled by. Windows at a smaller distance count as equal.
const FINEST: i32 = UNIT / 256;
/// Distance from a change, in points, up to which points are corrected again.
const NEAR: usize = 1;
/// Maximum of the options `acceptance` and `coherence`.
const DEAREST: f64 = 1e6;
/// Minimum number of points between two checks for cancellation.
const SLAB: usize = 1 << 18;

/// Options of [`correct`].
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Maximum number of passes. Each corrects every other point.
    pub passes: usize,
    /// Number of the first pass. It is above 0 if earlier calls have made the first passes.
    pub first: u32,
    /// If true, also compare each window with all windows of the exemplar. This is slow for large exemplars.
    pub exhaustive: bool,
    /// Distance of the neighbours whose matches are tried, 1 or 2 points.
    pub reach: i32,
    /// Acceptance threshold: the minimum improvement of a random match, in units of the exemplar's spacing.
    pub acceptance: f64,
    /// Coherence penalty: the cost of each neighbour that shows another patch of the exemplar, in units of the
    /// exemplar's spacing.
    pub coherence: f64,
    /// Radius of the vote, in points. At 0 each point takes the match of its own window.
    pub vote: usize,
    /// Stop if two passes change less than this fraction of the points. At 0, passes never stop early, so that results
    /// do not depend on distant points.
    pub settled: f64,
    /// Seed of the random numbers. It should differ for each resolution.
    pub seed: u64,
}

/// Values that are constant while a level is corrected.
struct Level<'a, const D: usize> {
    appearance: &'a Appearance<D>,
    region: &'a Region<D>,
    frames: Frames<'a, D>,
    guide: Option<&'a Guide<'a>>,
    held: &'a [bool],
    options: &'a Options,
    /// Steps to all neighbours, including diagonal ones.
    around: Vec<[i32; D]>,
    recent: Recent,
}

/// Corrects `places`, one for each point of `region`. Points that are `held` are hard constraints, which keep their
/// places. Returns the number of passes, and the fraction of the points that the last two passes changed.
#[allow(clippy::too_many_arguments)] // the exemplar, the region, and their properties
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
                "must have reach 1 or 2 and vote at most the radius of windows, got {options:?}"
            ),
        ));
    }
    let costs = [options.acceptance, options.coherence];
    if !costs.iter().all(|x| (0.0..=DEAREST).contains(x)) || options.settled.is_nan() {
        return Err(Error::value(
            "options",
            format!(
                "must have acceptance and coherence from 0 to {DEAREST:e}, and settled must be a number; got {options:?}"
            ),
        ));
    }
    frames.check(points)?;
    // A vote needs a second copy of the places.
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
    // Swap the buffers after each pass.
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
        // Two passes correct all points once, so the changes of both count.
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
    // After an odd number of passes, the result is in a buffer of this function. Copy it to the caller's array.
    if done % 2 == 1 {
        let places = if options.vote > 0 { elected } else { matches };
        places.copy_from_slice(before);
    }
    Ok((done, (moved[0] + moved[1]) as f64 / points as f64))
}

impl<const D: usize> Level<'_, D> {
    /// Returns the number of points between two checks for cancellation. It is much larger than the reach of windows,
    /// because the points within reach of two slabs are read for both.
    fn slab(&self) -> usize {
        SLAB.max(8 * self.margin())
    }

    /// Returns the cost, according to the guide, of showing a sample at a point.
    #[inline(always)]
    fn asked(&self, point: usize, sample: usize) -> i64 {
        self.guide.as_ref().map_or(0, |g| g.cost(point, sample))
    }

    /// Returns whether a pass corrects a point. The point must have the colour of the pass on the chessboard, a recent
    /// change nearby, and a neighbour that shows another patch. With a guide or an exhaustive search, the last
    /// condition is not required.
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

    /// Returns whether a neighbour of a point shows a different patch.
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

    /// Runs `each`, with its own scratch memory, on the points that a pass corrects. The other points keep their
    /// places.
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

/// Returns the steps to all neighbours, including diagonal ones.
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
