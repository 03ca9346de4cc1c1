//! Patch-based initialisation: the output is divided into cells, and each cell is filled with a patch of the exemplar.
//!
//! Cells have about `cell` points on each side. Their centres are shifted by noise, and each point belongs to the
//! nearest centre, so that seams are not straight. The patch of a cell is chosen to fit its neighbours. Cells of even
//! and odd parity take turns, and each tries many places. The cost of a place compares its continuation outside the
//! cell with the samples that are shown there. Plain squared differences would favour low-contrast patches, which are
//! near every other patch on average. The differences are therefore divided by the contrast of both patches.
//!
//! The result at a point depends only on world coordinates, and in each round only on cells up to two steps away.

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

/// Number of points in a task.
const CHUNK: usize = 4096;

/// Limit of the side of a cell, of the number of rounds, and of the number of candidates in a round. Places of cells
/// must fit into 32 bits, and the noise has 16 bits for the number of a draw.
const MOST: usize = 1 << 16;

/// Options of [`blocks`].
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Side of a cell, in points.
    pub cell: usize,
    /// Number of rounds after the random start. Odd cells choose in odd rounds, even cells in even rounds.
    pub rounds: usize,
    /// Number of places that a cell tries in a round.
    pub candidates: usize,
    /// Weight of the contrast of the patches in the divisor of misfits, 0 to 1. At 0 the divisor is constant.
    pub contrast: f64,
    /// Cost of continuing a neighbour exactly, in units of the misfit of unrelated patches. Without it the exemplar
    /// would be copied whole.
    pub continuation: f64,
    /// Cost of repeating the patch of a nearby cell, in the same units.
    pub repetition: f64,
    /// Seed of the random numbers. Each seed gives another texture.
    pub seed: u64,
    /// Width in points of a margin that only supports the inner points. Cells that cannot affect the inner points do
    /// not choose patches.
    pub margin: usize,
}

/// Hard constraints: points that keep their places. Both slices are empty, or have one entry for each point.
#[derive(Debug, Clone, Copy)]
pub struct Constraints<'a, const D: usize> {
    /// True for each point that keeps its place.
    pub points: &'a [bool],
    /// The places of the constrained points. Entries of other points are ignored.
    pub places: &'a [Place<D>],
}

impl<const D: usize> Constraints<'_, D> {
    /// No constraints.
    pub const NONE: Self = Self {
        points: &[],
        places: &[],
    };

    #[inline(always)]
    /// Returns whether a point keeps its place.
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
                "must be from 2 to {MOST} points, and candidates and rounds from 1 to below {MOST}; got {options:?}"
            ),
        ));
    }
    let costs = [options.contrast, options.continuation, options.repetition];
    if !costs.iter().all(|x| x.is_finite()) || options.margin > u32::MAX as usize {
        return Err(Error::value(
            "options",
            format!("must have finite costs and a margin below 2^32, got {options:?}"),
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
    // Estimate the bytes for each point, including the spare memory of growing lists. The shell of a small cell has as
    // many points as the cell.
    let listed = 4 * D + 24 + 16 * D * (D + 1) / options.cell;
    memory::room("the cells of a region", region.grid.len(), listed)?;
    let mut places = memory::filled("the places of a region", [0; D], region.grid.len())?;
    let cells = Cells::new(region, options)?;
    let noise = Noise::new(options.seed).part(1);
    let owners = cells.owners()?;
    let list = cells.list(&owners, frames)?;
    // Start from a random place for each cell.
    let mut origins: Vec<Place<D>> = par::map(list.len(), |c| {
        Chooser::new(appearance, &cells, &list, c).place(&noise, 0, 0)
    });
    // The squared length of a vector is the contrast of its window.
    let contrasts = par::map(appearance.grid().len(), |at| {
        distance(appearance.feature(at), &[0; KEEP])
    });
    monitor.expect((options.rounds * list.len()) as u64);
    for round in 0..=options.rounds {
        if round > 0 {
            // All cells of a round choose at once, from the places before the round.
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
        // Fill each cell with its patch.
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
