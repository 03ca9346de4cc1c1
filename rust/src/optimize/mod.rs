//! Texture optimisation: coordinates corrected until every window of the output is like one of the exemplar.
//!
//! Kwatra et al., *Texture optimization for example-based synthesis*, SIGGRAPH 2005, on coordinates instead of colours:
//! the last word of every step is a copy. One iteration is
//!
//! 1. gather: the window around each point, in the exemplar's axes, through the coordinates as they are;
//! 2. sweep: each point looks for a better match among those of its neighbours (Barnes et al., *PatchMatch*, SIGGRAPH
//!    2009; all points at once, so that their order does not matter) and a few drawn around the best;
//! 3. vote: each point takes one of the coordinates that the windows around it propose.
//!
//! Departures: a drawn match must be better by some of the exemplar's own spacing (hysteresis), so that what is good
//! enough stays and sparse features are not washed out. Coordinates are displaced by the frame's Jacobian
//! wherever a window or a match is carried from one point to another (Lefebvre and Hoppe, 2006).

mod gather;
mod sweep;
mod vote;

use crate::appearance::{Appearance, KEEP, UNIT};
use crate::fixed::{Frames, Place};
use crate::grid::Region;
use crate::guide::Guide;
use crate::hash::Noise;
use crate::par::{self, Monitor};
use crate::{Error, Result};

/// Points that a task takes at a time.
const CHUNK: usize = 2048;
/// Distance of windows below which they are the same.
const FINEST: i32 = UNIT / 256;
/// Points whose windows are kept at a time.
const SLAB: usize = 1 << 17;

/// What [`correct`] is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Iterations, at most.
    pub iterations: usize,
    /// Number of the first, for work that is done in parts.
    pub first: u32,
    /// Compare each window with all of the exemplar's before the sweeps: for small ones.
    pub exhaustive: bool,
    /// Sweeps an iteration, 1 or 2; the second looks twice as far.
    pub sweeps: usize,
    /// How much better a drawn match must be, in units of the exemplar's spacing.
    pub hysteresis: f64,
    /// What each neighbour costs whose piece of the exemplar is another, in units of the exemplar's spacing.
    pub unity: f64,
    /// Radius of the vote; 0: each point takes the match of its own window.
    pub vote: usize,
    /// Stop when less than this share of the points changes; 0: never, for results that must not hang on distant ones.
    pub settled: f64,
    /// Chooses the texture; another for each resolution.
    pub seed: u64,
}

/// All that stays the same while a level is corrected.
struct Level<'a, const D: usize> {
    appearance: &'a Appearance<D>,
    region: &'a Region<D>,
    frames: Frames<'a, D>,
    guide: Option<Guide<'a>>,
    still: bool,
}

/// Corrects `places`, one a point of `region`, and returns the number of iterations and the share of the points that the
/// last one changed. Points that are `held` keep their places.
#[allow(clippy::too_many_arguments)] // the exemplar, the region, and what is known of it
pub fn correct<const D: usize>(
    appearance: &Appearance<D>,
    region: &Region<D>,
    frames: Frames<'_, D>,
    guide: Option<Guide<'_>>,
    held: &[bool],
    places: &mut Vec<Place<D>>,
    options: &Options,
    monitor: &Monitor,
) -> Result<(usize, f64)> {
    let points = region.grid.len();
    if places.len() != points || !(held.is_empty() || held.len() == points) {
        return Err(Error::Shape {
            argument: "places",
            expected: region.grid.shape().to_vec(),
            got: vec![places.len()],
        });
    }
    if !(1..=2).contains(&options.sweeps) || options.vote > appearance.radius() {
        return Err(Error::value(
            "options",
            format!("1 or 2 sweeps and a vote within the windows are allowed, got {options:?}"),
        ));
    }
    par::chunks_mut(places, CHUNK, |_, places| {
        for place in places {
            *place = appearance.bring_inside(*place);
        }
    });
    let level = Level {
        appearance,
        region,
        frames,
        guide,
        still: frames.is_identity(),
    };
    let noise = Noise::new(options.seed).part(3);
    // An exemplar that repeats has no spacing, but rounding of colours still leaves some.
    let spacing = f64::from(appearance.spacing().max(FINEST));
    let limit = (options.hysteresis * spacing) as i64;
    let slabs = level.slabs();
    monitor.expect((options.iterations * slabs.len()) as u64);
    let mut once = places.clone();
    let mut twice = Vec::new();
    if options.sweeps == 2 || options.vote > 0 {
        twice.resize(points, [0; D]);
    }
    let mut changed = 0.0;
    for iteration in 0..options.iterations {
        let draws = sweep::Draws {
            noise,
            iteration: options.first + iteration as u32,
            limit,
            unity: (options.unity * spacing) as i64,
            exhaustive: options.exhaustive,
        };
        level.matches(
            places,
            &mut once,
            &mut twice,
            options.sweeps,
            &draws,
            monitor,
        )?;
        let (matches, spare) = if options.sweeps == 2 {
            (&mut twice, &mut once)
        } else {
            (&mut once, &mut twice)
        };
        let newest = if options.vote > 0 {
            level.vote(matches, spare, options.vote);
            spare
        } else {
            matches
        };
        let moved: usize = par::map(points.div_ceil(CHUNK), |c| {
            let range = c * CHUNK..points.min((c + 1) * CHUNK);
            range
                .filter(|&p| newest[p] != places[p] && !held.get(p).is_some_and(|&h| h))
                .count()
        })
        .iter()
        .sum();
        if !held.is_empty() {
            par::chunks_mut(newest, CHUNK, |c, newest| {
                for (i, place) in newest.iter_mut().enumerate() {
                    if held[c * CHUNK + i] {
                        *place = places[c * CHUNK + i];
                    }
                }
            });
        }
        std::mem::swap(places, newest);
        changed = moved as f64 / points as f64;
        if changed < options.settled {
            return Ok((iteration + 1, changed));
        }
    }
    Ok((options.iterations, changed))
}

impl<const D: usize> Level<'_, D> {
    /// What the guide says of showing a sample at a point.
    #[inline(always)]
    fn asked(&self, point: usize, sample: usize) -> i64 {
        self.guide.as_ref().map_or(0, |g| g.cost(point, sample))
    }

    /// Points of a plane: all axes but the first.
    fn plane(&self) -> usize {
        self.region.grid.len() / self.region.grid.shape()[0]
    }

    /// Planes that are worked on together: as many as fit, for their windows are kept meanwhile.
    fn slabs(&self) -> Vec<std::ops::Range<usize>> {
        let planes = self.region.grid.shape()[0];
        let thick = (SLAB / self.plane()).clamp(4, planes.max(4));
        (0..planes.div_ceil(thick))
            .map(|k| k * thick..planes.min((k + 1) * thick))
            .collect()
    }

    /// The match of every point after one sweep, and after two where that is asked for.
    ///
    /// Slab by slab, so that the windows of a whole volume need not be kept. The second sweep looks two planes
    /// ahead, so it follows two planes behind the first.
    fn matches(
        &self,
        places: &[Place<D>],
        once: &mut [Place<D>],
        twice: &mut [Place<D>],
        sweeps: usize,
        draws: &sweep::Draws,
        monitor: &Monitor,
    ) -> Result<()> {
        const LAG: usize = 2;
        let (planes, plane) = (self.region.grid.shape()[0], self.plane());
        let seen = gather::Seen::new(self, places);
        let slabs = self.slabs();
        let thick = slabs[0].len();
        // The windows of a slab, and before them those of the planes that the second sweep has not reached yet.
        let mut features = vec![[0; KEEP]; (thick + LAG) * plane];
        if sweeps == 2 && self.region.grid.wrap()[0] {
            let last = planes.saturating_sub(LAG)..planes;
            let features = &mut features[..last.len() * plane];
            self.windows(places, &seen, &last, features);
            self.sweep(places, features, &last, once, 1, draws);
        }
        let mut done = 0;
        for slab in &slabs {
            let fresh = &mut features[LAG * plane..][..slab.len() * plane];
            self.windows(places, &seen, slab, fresh);
            self.sweep(places, fresh, slab, once, 1, draws);
            if sweeps == 2 {
                let end = if slab.end == planes {
                    planes
                } else {
                    slab.end - LAG
                };
                let behind = done..end;
                let start = LAG + done - slab.start;
                self.sweep(once, &features[start * plane..], &behind, twice, 2, draws);
                done = end;
                features.copy_within((slab.len()) * plane..(slab.len() + LAG) * plane, 0);
            }
            monitor.advance(1)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
