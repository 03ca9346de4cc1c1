//! The stitcher: maps patches of an exemplar into the output, and cuts them along the least visible seams.
//!
//! 1. *chart*: a patch is a box of the exemplar, mapped from the output by the frames around its centre.
//! 2. *search*: the difference between the patch and the known points is computed for all exemplar coordinates at
//!    once.
//! 3. *cut*: minimum cuts insert the best few candidates. They judge the pairs that result, and the cheapest result is
//!    kept.
//! 4. *recover*: other patches are tried over the worst seams.
//! 5. *heal*: torn elements are completed or removed.
//!
//! The method is by Kwatra, Schödl, Essa, Turk, Bobick, *Graphcut textures*, SIGGRAPH 2003. There are three
//! departures. Patches follow a field. A cut judges the pair that results instead of the difference of two images.
//! Cuts and healing use the elements.
//!
//! [`Samples`] offers only the third step, for unwarped patches that another search has found.

mod balance;
mod canvas;
mod chart;
mod cover;
mod cut;
mod energy;
mod fill;
mod flat;
mod heal;
mod mesh;
mod pair;
mod recover;
mod runs;
mod search;
mod source;
mod view;
mod weights;

use std::collections::HashMap;

use crate::engine::guide::Guide;
use crate::foundation::fixed::{Frame, Frames, ONE, Place, apply};
use crate::foundation::grid::{Grid, Region};
use crate::foundation::hash::Noise;
use crate::foundation::libm::root;
use crate::foundation::memory;
use crate::foundation::par::Monitor;
use crate::{Error, Result};

use balance::Balance;
use canvas::{Canvas, HELD, LOOSE};
use chart::Chart;
pub use cover::{Prepared, Shown, cover, judge};
use cut::{Cutter, LARGE};
pub use flat::{Pasted, Pasting, Samples};
use search::{Charges, Index, Steps};
pub use source::{Adjacency, Elements, Source};
pub use weights::Weights;

/// Options of the stitcher.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Side of a patch, in samples of the exemplar.
    pub patch: f32,
    /// Overlap of neighbouring patches, as a fraction of their side.
    pub overlap: f32,
    /// Number of candidates that are tried for each patch. The candidate with the cheapest cut is kept.
    pub candidates: usize,
    /// If true, patches are bent along the field. Otherwise they are rotated and scaled as a whole.
    pub bend: bool,
    /// Weights of the seam costs.
    pub weights: Weights,
    /// Cost of samples that were shown more often than others.
    pub repetition: f32,
    /// Cost of a patch that continues a neighbour exactly.
    pub continuation: f32,
    /// Cost of points whose classes are more frequent than in the exemplar. It is the cost of n such points, where n
    /// is the side of a patch.
    pub balance: f32,
    /// Number of the worst seams that are covered again, relative to the number of patches.
    pub recover: f32,
    /// If true, torn elements are healed.
    pub heal: bool,
    /// Seed of the random numbers. Each seed gives another texture.
    pub seed: u64,
    /// Lattice that patches are kept in step with, for two axes and one frame. Each column is a shift of the exemplar.
    /// The second is 0 if the exemplar repeats along the first one only.
    pub lattice: Option<[[f64; 2]; 2]>,
}

/// Points that are given. There are none, or the arrays have one flag and one place for each point.
#[derive(Debug, Clone, Copy)]
pub struct Given<'a, const D: usize> {
    /// True for each given point.
    pub points: &'a [bool],
    /// Exemplar coordinates of the given points.
    pub places: &'a [Place<D>],
    /// True for each given point that patches may take to reduce the costs of seams. Empty if all given points must
    /// stay.
    pub loose: &'a [bool],
}

impl<const D: usize> Given<'_, D> {
    /// No point is given.
    pub const NOTHING: Self = Self {
        points: &[],
        places: &[],
        loose: &[],
    };
}

/// Result of the stitcher.
#[derive(Debug, Clone)]
pub struct Stitched<const D: usize> {
    /// Exemplar coordinates of each point.
    pub places: Vec<Place<D>>,
    /// The patch that each point shows.
    pub patches: Vec<u32>,
    /// The Jacobian at the centre of each patch.
    pub frames: Vec<Frame<D>>,
    /// Mean cost of the seams per point.
    pub seams: f64,
    /// Number of moves that healed elements.
    pub healed: usize,
}

/// A patch that has been inserted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch<const D: usize> {
    /// Centre on the canvas.
    pub centre: [i32; D],
    /// Exemplar coordinates of the centre.
    pub place: Place<D>,
    /// Jacobian at the centre.
    pub frame: Frame<D>,
    /// Whether the map of the patch is affine with that Jacobian. Otherwise it bends with the field.
    pub rigid: bool,
    /// Side, in samples of the exemplar.
    pub side: f32,
}

impl<const D: usize> Patch<D> {
    /// Returns the number of output points per sample of the exemplar.
    fn scale(&self) -> f64 {
        1.0 / determinant(&self.frame).abs().max(1e-6)
    }
}

/// The state of a stitching run.
struct Stitching<'a, const D: usize> {
    cutter: Cutter<'a, D>,
    frames: Frames<'a, D>,
    options: Options,
    canvas: Canvas<D>,
    index: Index<D>,
    patches: Vec<Patch<D>>,
    /// Patches by the exemplar coordinates that they would show at the origin, if there is one frame. Patches that
    /// continue each other exactly are one patch.
    offsets: HashMap<Place<D>, u32>,
    balance: Balance,
    noise: Noise,
    /// Number of searches for a patch so far.
    laid: u32,
    monitor: &'a Monitor,
}

/// Fills a region with patches of a source.
///
/// # Errors
/// Returns an error if options are out of their range, sizes of arrays do not match the region, or the monitor was
/// cancelled.
#[allow(clippy::too_many_arguments)] // one argument for each input, as in `blocks`
pub fn stitch<const D: usize>(
    source: &Source<D>,
    region: &Region<D>,
    frames: Frames<'_, D>,
    guide: Option<&Guide<'_>>,
    given: Given<'_, D>,
    options: &Options,
    monitor: &Monitor,
) -> Result<Stitched<D>> {
    check(region, frames, given, options)?;
    // The search needs spectra of the exemplar and of templates of its size.
    let spectra = source.grid().len().saturating_mul(source.channels() + 4);
    memory::room("the patch search", spectra, 24)?;
    memory::room("the stitched region", region.grid.len(), 24 * D)?;
    let mut canvas = Canvas::new(region.grid, matches!(frames, Frames::Dense(_)))?;
    // Place the given points on the canvas.
    for (p, _) in given.points.iter().enumerate().filter(|(_, held)| **held) {
        let stays = !given.loose.get(p).is_some_and(|&loose| loose);
        canvas.patches[p] = if stays { HELD } else { LOOSE };
        canvas.places[p] = given.places[p];
        canvas.free -= 1;
    }
    let mut this = Stitching {
        cutter: Cutter::new(source, options.weights, guide, LARGE),
        frames,
        options: *options,
        index: Index::new(
            source,
            guide,
            Charges {
                repetition: options.repetition,
                continuation: options.continuation,
            },
        )
        .in_step(Steps::new(options.lattice, frames)),
        balance: Balance::new(source, &canvas),
        canvas,
        patches: Vec::new(),
        offsets: HashMap::new(),
        noise: Noise::new(options.seed).part(2),
        laid: 0,
        monitor,
    };
    // Fill, cover the worst seams again, and heal torn elements.
    this.fill()?;
    this.recover(this.patches.len(), options.patch)?;
    let healed = if options.heal { this.heal()? } else { 0 };
    let mut canvas = this.canvas;
    // Patches may extend beyond the ends of periodic axes of the exemplar, so wrap the coordinates.
    for place in &mut canvas.places {
        *place = bring_around(source.grid(), *place);
    }
    let total: f64 = canvas.seams.iter().flatten().map(|&s| f64::from(s)).sum();
    Ok(Stitched {
        seams: total / canvas.grid.len() as f64,
        places: canvas.places,
        patches: canvas.patches,
        frames: this.patches.iter().map(|p| p.frame).collect(),
        healed,
    })
}

/// Returns an error if options are out of their range, or if the sizes of arrays do not match.
fn check<const D: usize>(
    region: &Region<D>,
    frames: Frames<'_, D>,
    given: Given<'_, D>,
    options: &Options,
) -> Result<()> {
    let n = region.grid.len();
    frames.check(n)?;
    // Points and places are both empty, or have one entry for each point. Only `loose` may be empty by itself.
    let held = given.points.len();
    for (got, right) in [
        (held, held == 0 || held == n),
        (given.places.len(), given.places.len() == held),
        (given.loose.len(), [0, held].contains(&given.loose.len())),
    ] {
        if !right {
            return Err(Error::Shape {
                argument: "held",
                expected: region.grid.shape().to_vec(),
                got: vec![got],
            });
        }
    }
    if !(4.0..=4096.0).contains(&options.patch)
        || !(0.0..=0.8).contains(&options.overlap)
        || !(1..=64).contains(&options.candidates)
        || !(0.0..=4.0).contains(&options.recover)
    {
        return Err(Error::value(
            "patch",
            format!(
                "must be from 4 to 4096 samples, overlap from 0 to 0.8, candidates from 1 to 64, and recover from 0 to 4; got {options:?}"
            ),
        ));
    }
    if options.lattice.is_some() && Steps::new(options.lattice, frames).is_none() {
        return Err(Error::value("lattice", "needs two axes and one frame"));
    }
    options.weights.check()?;
    let charges = [options.repetition, options.continuation, options.balance];
    if !charges.iter().all(|x| (0.0..=100.0).contains(x)) {
        return Err(Error::value(
            "weights",
            format!("repetition, continuation and balance must be from 0 to 100, got {options:?}"),
        ));
    }
    Ok(())
}

impl<const D: usize> Stitching<'_, D> {
    /// Returns the number of a patch. If there is one frame, patches that continue each other exactly have the same
    /// number.
    fn number(&mut self, chart: &Chart<D>, centre: [i32; D], place: Place<D>, side: f32) -> u32 {
        let next = self.patches.len() as u32;
        let patch = Patch {
            centre,
            place,
            frame: chart.frame,
            side,
            rigid: chart.rigid,
        };
        if matches!(self.frames, Frames::Constant(_)) {
            let number = *self.offsets.entry(self.origin(&patch)).or_insert(next);
            if number != next {
                return number;
            }
        }
        self.patches.push(patch);
        next
    }

    /// Returns the exemplar coordinates that a patch would show at the origin.
    fn origin(&self, patch: &Patch<D>) -> Place<D> {
        let grid = self.cutter.source().grid();
        let ahead = apply(&patch.frame, patch.centre);
        std::array::from_fn(|a| {
            let offset = patch.place[a].wrapping_sub(ahead[a]);
            if grid.wrap()[a] {
                offset.rem_euclid(grid.shape()[a] as i32 * ONE)
            } else {
                offset
            }
        })
    }

    /// Returns the enlargement of features at a point.
    fn scale(&self, at: [i32; D]) -> f32 {
        let grid = &self.canvas.grid;
        let point = std::array::from_fn(|a| grid.resolve(a, at[a] as isize));
        enlargement(&self.frames.at(grid.index(point)))
    }
}

/// Wraps exemplar coordinates along periodic axes, so that the nearest sample is inside the exemplar.
fn bring_around<const D: usize>(grid: &Grid<D>, place: Place<D>) -> Place<D> {
    std::array::from_fn(|a| {
        let (n, half) = (grid.shape()[a] as i32 * ONE, ONE / 2);
        if grid.wrap()[a] {
            (place[a].wrapping_add(half)).rem_euclid(n) - half
        } else {
            place[a]
        }
    })
}

/// Returns whether exemplar coordinates are inside the exemplar along the axes that do not wrap.
fn inside<const D: usize>(grid: &Grid<D>, place: Place<D>) -> bool {
    (0..D).all(|a| grid.wrap()[a] || (0..=(grid.shape()[a] as i32 - 1) * ONE).contains(&place[a]))
}

/// Returns the enlargement of lengths by a frame.
fn enlargement<const D: usize>(frame: &Frame<D>) -> f32 {
    (1.0 / root::<D>(determinant(frame).abs().max(1e-6))) as f32
}

/// Returns the determinant of a Jacobian.
fn determinant<const D: usize>(frame: &Frame<D>) -> f64 {
    let m = frame.map(|row| row.map(|x| f64::from(x) / f64::from(ONE)));
    match D {
        2 => m[0][0] * m[1][1] - m[0][1] * m[1][0],
        _ => {
            let minor = |a: usize, b: usize| m[1][a] * m[2][b] - m[1][b] * m[2][a];
            m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
        }
    }
}

#[cfg(test)]
mod tests;
