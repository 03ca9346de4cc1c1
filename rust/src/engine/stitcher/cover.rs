//! Patches that are inserted into a part of an unbounded output that earlier layers have covered.
//!
//! Boxes of one layer tile the world, and patches are inserted into each box of the result of the layer before. Points
//! at the ends of a box do not change, so that neighbouring boxes fit. The result depends only on the content of the
//! box before the cuts and on the field inside the box.

use std::collections::HashMap;

use super::canvas::{Canvas, Window};
use super::chart::{Chart, difference, mean};
use super::cut::Cutter;
use super::pair::{Judge, distances};
use super::runs::{Run, runs};
use super::search::{Charges, Index};
use super::source::Source;
use super::view::Looks;
use super::{Balance, Given, Options, Patch, Stitching, Weights, enlargement};
use crate::foundation::error::check_shape;
use crate::foundation::fixed::{Frames, Place};
use crate::foundation::grid::{Grid, Region};
use crate::foundation::hash::Noise;
use crate::foundation::par::Monitor;
use crate::{Error, Result};

/// Minimum fraction of a box that one patch must fill. Other boxes are divided.
const FILLED: f64 = 0.5;
/// Maximum mean difference between a patch and the field. A box with a larger difference is divided along the axes of
/// the largest changes of the field. It then becomes a few slabs instead of many cubes. An axis along which the box
/// shows half of a patch or less is not divided.
const STRAY: f32 = 0.2;
/// Side of the patches that determine how many seams are covered again, relative to the longest side of the part.
/// [`STEP`] is the distance between these patches, relative to their side.
const OF_PART: f32 = 0.8;
const STEP: f32 = 0.6;
/// Pairs of a number of points and a side of blocks. Windows with more points are first cut between blocks of this
/// side. In these windows more points have a choice than in other cuts, so the largest windows start with larger
/// blocks.
const COVERED: &[(usize, usize)] = &[(1 << 15, 4), (4096, 2)];
/// Minimum side of a box that is divided.
const SMALL: usize = 12;

/// Data for the search in a source. They are computed once for many parts.
pub struct Prepared<const D: usize>(Index<D>);

impl<const D: usize> Prepared<D> {
    /// Prepares a source.
    pub fn new(source: &Source<D>) -> Self {
        let charges = Charges {
            repetition: 0.0,
            continuation: 0.0,
        };
        Self(Index::new(source, None, charges))
    }
}

/// Content of a part of an unbounded output.
#[derive(Debug, Clone)]
pub struct Shown<const D: usize> {
    /// Exemplar coordinates of each point.
    pub places: Vec<Place<D>>,
    /// Number of the patch that each point shows.
    pub patches: Vec<u32>,
    /// Cost of the seam from each point to the next one along each axis (see [`judge`]).
    pub seams: Vec<[f32; D]>,
    /// Difference between the patch and the field at each point. Empty if there is one frame for all points, or if all
    /// patches are rigid and the difference was not stored.
    pub distortion: Vec<f32>,
    /// Patches of the part, with their centres relative to the first point of the part.
    pub table: Vec<Patch<D>>,
}

/// Returns the costs of the seams between points that show different patches.
///
/// # Errors
/// Returns an error if sizes of arrays do not match the region.
pub fn judge<const D: usize>(
    source: &Source<D>,
    grid: &Grid<D>,
    places: &[Place<D>],
    patches: &[u32],
    weights: Weights,
) -> Result<Vec<[f32; D]>> {
    for got in [places.len(), patches.len()] {
        check_shape("places", &grid.shape(), got)?;
    }
    let mut looks = Looks::default();
    looks.fit(grid.len());
    for (i, &place) in places.iter().enumerate() {
        looks.set(i, &source.look(place));
    }
    let judge = Judge { source, weights };
    let mut seams = vec![[0.0; D]; grid.len()];
    let (mut apart, mut costs) = (Vec::new(), Vec::new());
    runs(grid, |Run { axis, p, q, n }| {
        let (l, r) = (looks.row(p, n), looks.row(q, n));
        apart.resize(n, 0.0);
        costs.resize(n, 0.0);
        distances(l, r, &mut apart);
        apart.iter_mut().for_each(|d| *d *= *d);
        judge.pairs(l, r, [&apart, &apart], &mut costs);
        for k in 0..n {
            // Points of the same patch have no seam between them.
            if patches[p + k] != patches[q + k] {
                seams[p + k][axis] = costs[k];
            }
        }
    });
    Ok(seams)
}

/// Inserts patches into a part, except at its ends, which do not change. One patch is inserted if the exemplar is
/// large enough to fill the part, otherwise several.
///
/// # Errors
/// Returns an error if options are out of their range, sizes of arrays do not match the region, or the monitor was
/// cancelled.
pub fn cover<const D: usize>(
    source: &Source<D>,
    prepared: &Prepared<D>,
    region: &Region<D>,
    frames: Frames<'_, D>,
    shown: Shown<D>,
    options: &Options,
    monitor: &Monitor,
) -> Result<Shown<D>> {
    super::check(region, frames, Given::NOTHING, options)?;
    // Paint the present content, so that patches are judged against it.
    let canvas = paint(
        region,
        frames,
        shown.places,
        shown.patches,
        shown.seams,
        shown.distortion,
        &shown.table,
    )?;
    let mut this = Stitching {
        cutter: Cutter::new(source, options.weights, None, COVERED),
        frames,
        options: *options,
        index: prepared.0.afresh(Charges {
            repetition: options.repetition,
            continuation: options.continuation,
        }),
        balance: Balance::new(source, &canvas),
        canvas,
        patches: shown.table,
        offsets: HashMap::new(),
        noise: Noise::new(options.seed),
        laid: 0,
        monitor,
    };
    this.know_patches();
    this.cover(region.grid.shape().map(|_| 0), region.grid.shape())?;
    this.recover_part()?;
    if options.heal {
        this.heal()?;
    }
    Ok(this.show())
}

impl<const D: usize> Stitching<'_, D> {
    /// Registers the patches of the part, and the samples that they have shown.
    fn know_patches(&mut self) {
        for (k, patch) in self.patches.iter().enumerate() {
            self.index.note(patch.place, patch.side);
            if matches!(self.frames, Frames::Constant(_)) {
                self.offsets.entry(self.origin(patch)).or_insert(k as u32);
            }
        }
    }

    /// Inserts a patch into a box. If one patch would leave too much of the box unchanged, patches are inserted into
    /// smaller boxes that overlap by half.
    fn cover(&mut self, low: [usize; D], high: [usize; D]) -> Result<()> {
        let Some(window) = self.window(low, high) else {
            return Ok(());
        };
        let o = &self.options;
        let bend = o.bend && matches!(self.frames, Frames::Dense(_));
        let chart = Chart::over(window, &self.canvas, self.frames, o.patch, bend);
        let sides = chart.window.grid.shape();
        let longest = sides.into_iter().max().unwrap_or(1) as f32;
        let side = (longest / enlargement(&chart.frame)).min(o.patch);
        let filled = chart.mask.iter().filter(|m| **m).count() as f64;
        let fills = filled >= FILLED * chart.mask.len() as f64;
        let varies = if fills && mean(&chart.distortion, &chart.mask) > STRAY {
            self.varies(&chart.window)
        } else {
            [!fills; D]
        };
        let long = |a: usize| sides[a] as f32 / enlargement(&chart.frame) > 0.5 * o.patch;
        let divide: [bool; D] =
            std::array::from_fn(|a| high[a] - low[a] >= SMALL && varies[a] && (!fills || long(a)));
        if !divide.contains(&true) {
            let centre = std::array::from_fn(|a| chart.window.low[a] + sides[a] as i32 / 2);
            return self.cover_chart(chart, centre, side);
        }
        for corner in 0..1usize << D {
            let (mut first, mut last) = (low, high);
            for a in 0..D {
                let part = if divide[a] {
                    (high[a] - low[a]) * 2 / 3
                } else {
                    high[a] - low[a]
                };
                if corner >> (D - 1 - a) & 1 == 0 {
                    last[a] = low[a] + part;
                } else if divide[a] {
                    first[a] = high[a] - part;
                } else {
                    // The box is not divided along this axis, so its first part is the whole.
                    last[a] = first[a];
                }
            }
            self.cover(first, last)?;
        }
        Ok(())
    }

    /// Returns the axes along which the field changes at least half as much as along the axis of the largest change.
    fn varies(&self, window: &Window<D>) -> [bool; D] {
        let (grid, middle) = (&window.grid, window.grid.shape().map(|n| n / 2));
        let mut sums = [0.0f64; D];
        for (point, &p) in grid.points().zip(&window.points) {
            let frame = self.frames.at(p as usize);
            for (a, sum) in sums.iter_mut().enumerate() {
                let mut across = point;
                across[a] = middle[a];
                let there = window.points[grid.index(across)] as usize;
                *sum += f64::from(difference(&frame, &self.frames.at(there)));
            }
        }
        let most = sums.iter().fold(0.0, |a: f64, &b| a.max(b));
        sums.map(|sum| sum >= 0.5 * most)
    }

    /// Covers the worst seams again. Their number is a fraction of the number of patches that would fill the part.
    fn recover_part(&mut self) -> Result<()> {
        let shape = self.canvas.grid.shape();
        let scale = self.scale(shape.map(|n| n as i32 / 2));
        let longest = shape.into_iter().max().unwrap_or(1) as f32;
        let patch = (OF_PART * longest / scale).min(self.options.patch);
        let step = STEP * patch * scale;
        let patches = self.canvas.grid.len() as f32 / step.powi(D as i32);
        self.recover(patches.round() as usize, patch)
    }

    fn window(&self, low: [usize; D], high: [usize; D]) -> Option<Window<D>> {
        self.canvas
            .window(low.map(|x| x as i32), high.map(|x| x as i32))
    }

    /// Returns the content of the part, with the patches that are still visible.
    fn show(self) -> Shown<D> {
        let mut numbers = vec![u32::MAX; self.patches.len()];
        self.canvas
            .patches
            .iter()
            .for_each(|&p| numbers[p as usize] = 0);
        let mut table = Vec::new();
        for (number, patch) in numbers
            .iter_mut()
            .zip(self.patches)
            .filter(|(n, _)| **n == 0)
        {
            *number = table.len() as u32;
            table.push(patch);
        }
        let canvas = self.canvas;
        Shown {
            places: canvas.places,
            patches: canvas
                .patches
                .iter()
                .map(|&p| numbers[p as usize])
                .collect(),
            seams: canvas.seams,
            distortion: canvas.distortion,
            table,
        }
    }
}

/// Returns a canvas with the content of a part.
fn paint<const D: usize>(
    region: &Region<D>,
    frames: Frames<'_, D>,
    places: Vec<Place<D>>,
    patches: Vec<u32>,
    seams: Vec<[f32; D]>,
    distortion: Vec<f32>,
    table: &[Patch<D>],
) -> Result<Canvas<D>> {
    let grid = region.grid;
    for got in [places.len(), patches.len(), seams.len()] {
        check_shape("places", &grid.shape(), got)?;
    }
    if patches.iter().any(|&p| p as usize >= table.len()) {
        return Err(Error::value(
            "patches",
            "must be below the number of patches in the table",
        ));
    }
    // If the distortion was not stored, all patches are rigid, so it follows from their frames.
    let distortion = match frames {
        Frames::Constant(_) => Vec::new(),
        Frames::Dense(all) if distortion.is_empty() => all
            .iter()
            .zip(&patches)
            .map(|(frame, &p)| difference(&table[p as usize].frame, frame))
            .collect(),
        Frames::Dense(_) => {
            check_shape("distortion", &grid.shape(), distortion.len())?;
            distortion
        }
    };
    Ok(Canvas {
        grid,
        places,
        patches,
        seams,
        distortion,
        free: 0,
        part: true,
    })
}
