//! Patch-based initialisation: the output divided into cells, each filled by one piece of the exemplar.
//!
//! The lattice is divided into cells of about `cell` points a side, with centres shifted by noise and each point given
//! to the nearest centre, so that no seam is straight. A cell's piece is chosen to fit its neighbours: cells of even
//! and odd parity take turns, each trying many places. The cost of a place counts how the shell just outside the cell
//! would continue, against what lies there. Plain squared differences would favour bland pieces, which are near
//! everything on average, so they are divided by the contrast of both.
//!
//! Everything is a function of the world's coordinates, within two cells for each of the `rounds`.

mod cells;
mod choose;

use crate::engine::appearance::{Appearance, KEEP, distance};
use crate::engine::guide::Guide;
use crate::foundation::fixed::{Frames, Place, add, apply};
use crate::foundation::grid::Region;
use crate::foundation::hash::Noise;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

use cells::Cells;
use choose::Chooser;

/// Points that a thread takes at once.
const CHUNK: usize = 4096;

/// Points of a cell along an axis, rounds, and candidates of a round, at most: places of cells fit into 32 bits, and draws
/// are told apart by 16.
const MOST: usize = 1 << 16;

/// What [`blocks`] is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Side of a cell, in points.
    pub cell: usize,
    /// Half-rounds of choosing; the even and the odd cells take turns, and the first places the even ones anywhere.
    pub rounds: usize,
    /// Places a cell tries in a round.
    pub candidates: usize,
    /// How far misfits are divided by the contrast of the pieces, 0 to 1.
    pub contrast: f64,
    /// Cost of going on exactly where a neighbour ends, in misfits of unrelated pieces: otherwise the exemplar is copied
    /// whole.
    pub continuation: f64,
    /// Cost of showing what one of the cells around shows, in the same units.
    pub repetition: f64,
    /// Chooses the texture.
    pub seed: u64,
    /// Points along borders that are there only for the others to look at: no cell is chosen that these do not hang on.
    pub margin: usize,
}

/// Hard constraints, points that keep their places: none, or one flag and one place a point.
#[derive(Debug, Clone, Copy)]
pub struct Constraints<'a, const D: usize> {
    /// Which.
    pub points: &'a [bool],
    /// Where they look; those of other points do not count.
    pub places: &'a [Place<D>],
}

impl<const D: usize> Constraints<'_, D> {
    /// No constraints.
    pub const NONE: Self = Self {
        points: &[],
        places: &[],
    };

    #[inline(always)]
    fn hold(&self, point: usize) -> bool {
        self.points.get(point).is_some_and(|&h| h)
    }
}

/// Returns a place in the exemplar for every point of `region`.
pub fn blocks<const D: usize>(
    appearance: &Appearance<D>,
    region: &Region<D>,
    frames: Frames<'_, D>,
    guide: Option<&Guide<'_>>,
    constraints: Constraints<'_, D>,
    options: &Options,
    monitor: &Monitor,
) -> Result<Vec<Place<D>>> {
    let counts = [options.candidates, options.rounds];
    if !(2..=MOST).contains(&options.cell) || counts.iter().any(|n| !(1..MOST).contains(n)) {
        return Err(Error::value(
            "cell",
            format!(
                "needs at least 2 points a cell, 1 candidate and 1 round, and at most {MOST}, got {options:?}"
            ),
        ));
    }
    let costs = [options.contrast, options.continuation, options.repetition];
    if !costs.iter().all(|x| x.is_finite()) || options.margin > u32::MAX as usize {
        return Err(Error::value(
            "options",
            format!("finite costs and a margin within the region are allowed, got {options:?}"),
        ));
    }
    frames.check(region.grid.len())?;
    for n in [constraints.points.len(), constraints.places.len()] {
        if n != constraints.points.len() || !(n == 0 || n == region.grid.len()) {
            return Err(Error::Shape {
                argument: "held",
                expected: region.grid.shape().to_vec(),
                got: vec![n],
            });
        }
    }
    // Lists grow by doubling; small cells have as many points around them as in them.
    let listed = 4 * D + 24 + 16 * D * (D + 1) / options.cell;
    memory::room("the cells of a region", region.grid.len(), listed)?;
    let mut places = memory::filled("the places of a region", [0; D], region.grid.len())?;
    let cells = Cells::new(region, options)?;
    let noise = Noise::new(options.seed).part(1);
    let owners = cells.owners()?;
    let list = cells.list(&owners, frames)?;
    let mut origins: Vec<Place<D>> = par::map(list.len(), |c| {
        Chooser::new(appearance, &cells, &list, c).place(&noise, 0, 0)
    });
    let contrasts = par::map(appearance.grid().len(), |at| {
        distance(appearance.feature(at), &[0; KEEP])
    });
    monitor.expect((options.rounds * list.len()) as u64);
    for round in 0..=options.rounds {
        if round > 0 {
            let even = round % 2 == 0;
            origins = par::map(list.len(), |c| {
                let idle = list[c].even != even
                    || list[c].points.iter().all(|&p| constraints.hold(p as usize));
                if idle || !cells.counts(c, options, round) || monitor.advance(1).is_err() {
                    return origins[c];
                }
                let chooser = Chooser::new(appearance, &cells, &list, c);
                let around = chooser.around(&places, &contrasts);
                let asked = chooser.asked(&cells, guide, constraints);
                let near: Vec<_> = cells.near(c).map(|n| origins[n]).collect();
                let round = round as u32;
                chooser.choose(&around, origins[c], &near, &asked, &noise, round, options)
            });
            monitor.check()?;
        }
        // Each point shows what its cell's piece has for it.
        par::chunks_mut(&mut places, CHUNK, |chunk, places| {
            for (i, place) in places.iter_mut().enumerate() {
                let p = chunk * CHUNK + i;
                *place = appearance.bring_inside(if constraints.hold(p) {
                    constraints.places[p]
                } else {
                    let c = owners[p] as usize;
                    let step = cells.step_from_centre(c, region.world(region.grid.point(p)));
                    add(origins[c], apply(&list[c].frame, step))
                });
            }
        });
    }
    Ok(places)
}

#[cfg(test)]
mod tests;
