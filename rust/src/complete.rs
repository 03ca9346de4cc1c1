//! Filling holes by example: in scan order, the best matching patch, cut into what is known.
//!
//! After Criminisi, Perez and Toyama (*Region filling and object removal by exemplar-based inpainting*, IEEE TIP 2004) with the
//! graph-cut paste of Kwatra et al. (*Graphcut textures*, SIGGRAPH 2003), as Shen et al. 2006, section 3.4, combine them:
//!
//! 1. take the first hole in scan order, and the window over it whose known share is nearest to 0.6;
//! 2. find the best matches of what is known in it, near pixels of the hole counting most;
//! 3. cut each of them into the known part, and take the one whose cut is the cheapest;
//! 4. paste it, and go on until no hole is left.
//!
//! The literal method centres the window and takes the best match at once; offering several windows and judging matches by the
//! cut that they really get leaves fewer visible seams.

use crate::grid::Grid;
use crate::hash::Noise;
use crate::par::{self, Monitor};
use crate::patch_search::{Index, Match, Pick, Query};
use crate::seam::cost::Cost;
use crate::seam::stitch::{self, Overlap};
use crate::{Error, Result};

/// Where the hole may sit in the window, as a share of its side.
const ANCHORS: [f64; 3] = [0.25, 0.4, 0.5];
/// The share of a window that is best known already.
const KNOWN_SHARE: f64 = 0.6;
/// Weight of a known pixel far from the hole; next to it the weight is one more.
const FAR_WEIGHT: f32 = 0.05;
/// Half of what cuts add to the gradients by which they divide.
const FLAT: f32 = 0.025;

/// How holes are filled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Rows and columns of a patch.
    pub patch: [usize; 2],
    /// Which matches are tried.
    pub pick: Pick,
    /// Seed of the patches that have nothing to match.
    pub seed: u64,
    /// As Shen et al. (2006) print it: windows centred on the hole, all known pixels of one weight, plain differences as
    /// the cost of a cut.
    pub paper: bool,
}

/// One pasted patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patch {
    /// The exemplar it was copied from.
    pub exemplar: usize,
    /// Its top-left corner there.
    pub from: [usize; 2],
    /// Its top-left corner on the canvas.
    pub to: [usize; 2],
}

/// What was pasted where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Completion {
    /// The patch that each pixel of the canvas comes from; -1 where nothing was pasted.
    pub label: Vec<i32>,
    /// The patches, in the order in which they were pasted.
    pub patches: Vec<Patch>,
}

/// A picture with holes.
pub struct Canvas<'a> {
    /// Shape, and which axes are cyclic.
    pub grid: Grid<2>,
    /// Samples (rows, columns, channels); anything where unknown.
    pub colours: &'a mut [f32],
    /// What is known (rows, columns).
    pub known: &'a mut [bool],
    /// Known pixels that nothing may be pasted over; none if absent.
    pub keep: Option<&'a [bool]>,
    /// Samples a pixel.
    pub channels: usize,
}

/// Fills every hole of the canvas with patches of the exemplars.
pub fn complete(
    canvas: &mut Canvas<'_>,
    index: &Index,
    options: &Options,
    monitor: &Monitor,
) -> Result<Completion> {
    let [rows, columns] = canvas.grid.shape();
    let Options { patch, paper, .. } = *options;
    let anchors = if paper { &ANCHORS[2..] } else { &ANCHORS[..] };
    if canvas.channels != index.channels() {
        let message = format!(
            "has {} channels, the exemplars have {}",
            canvas.channels,
            index.channels()
        );
        return Err(Error::value("colours", message));
    }
    if canvas.known.len() != canvas.grid.len()
        || canvas.colours.len() != canvas.grid.len() * canvas.channels
    {
        let (expected, got) = (
            vec![rows, columns, canvas.channels],
            vec![canvas.known.len(), canvas.colours.len()],
        );
        return Err(Error::Shape {
            argument: "colours",
            expected,
            got,
        });
    }
    if canvas
        .keep
        .is_some_and(|keep| keep.len() != canvas.grid.len())
    {
        return Err(Error::Shape {
            argument: "keep",
            expected: vec![rows, columns],
            got: vec![canvas.keep.map_or(0, <[bool]>::len)],
        });
    }
    if (0..2).any(|axis| patch[axis] == 0 || patch[axis] > canvas.grid.shape()[axis]) {
        let message = format!(
            "each side needs 1 to the canvas's {:?}, got {patch:?}",
            canvas.grid.shape()
        );
        return Err(Error::value("patch", message));
    }
    let mut result = Completion {
        label: vec![-1; canvas.grid.len()],
        patches: Vec::new(),
    };
    let mut window = Window::new(patch, canvas.channels);
    let holes = canvas.known.iter().filter(|known| !**known).count();
    monitor.expect(holes as u64);
    let mut cursor = 0;
    while let Some(hole) = canvas.known[cursor..].iter().position(|known| !known) {
        cursor += hole;
        let to = anchor(canvas, canvas.grid.point(cursor), patch, anchors);
        window.read(canvas, to);
        if paper {
            window.level();
        }
        let matches = candidates(index, &window, options, result.patches.len())?;
        let mut cuts = par::map(matches.len(), |i| {
            window.cut(canvas, index, &matches[i], to, paper)
        });
        let mut best = 0;
        for i in 0..cuts.len() {
            if let Ok((value, _)) = &cuts[i]
                && cuts[best].as_ref().is_ok_and(|(least, _)| value < least)
            {
                best = i;
            }
        }
        let (_, taken) = cuts.swap_remove(best)?;
        let filled = window.paste(canvas, index, &matches[best], &taken, to, &mut result);
        debug_assert!(canvas.known[cursor] && filled > 0);
        monitor.advance(filled)?;
    }
    Ok(result)
}

/// The corner of the window over a hole whose known share is nearest to the best one.
fn anchor(canvas: &Canvas<'_>, hole: [usize; 2], patch: [usize; 2], anchors: &[f64]) -> [usize; 2] {
    let corner = |axis: usize, share: f64| {
        let back = (share * (patch[axis] - 1) as f64).round() as isize;
        let last = canvas.grid.shape()[axis] as isize - patch[axis] as isize;
        let start = hole[axis] as isize - back;
        if canvas.grid.wrap()[axis] {
            canvas.grid.resolve(axis, start)
        } else {
            start.clamp(0, last) as usize
        }
    };
    let mut best = (f64::INFINITY, [0, 0]);
    for &down in anchors {
        for &across in anchors {
            let to = [corner(0, down), corner(1, across)];
            let mut known = 0usize;
            for_each(&canvas.grid, to, patch, |_, at| {
                known += usize::from(canvas.known[at])
            });
            let off = (known as f64 / (patch[0] * patch[1]) as f64 - KNOWN_SHARE).abs();
            if off < best.0 {
                best = (off, to);
            }
        }
    }
    best.1
}

/// Calls `f(i, position)` for each pixel of a window, around the edges where the grid wraps.
fn for_each(grid: &Grid<2>, to: [usize; 2], patch: [usize; 2], mut f: impl FnMut(usize, usize)) {
    let columns = grid.shape()[1];
    for r in 0..patch[0] {
        let row = grid.resolve(0, (to[0] + r) as isize) * columns;
        for c in 0..patch[1] {
            f(
                r * patch[1] + c,
                row + grid.resolve(1, (to[1] + c) as isize),
            );
        }
    }
}

fn candidates(
    index: &Index,
    window: &Window,
    options: &Options,
    step: usize,
) -> Result<Vec<Match>> {
    if window.known.iter().any(|&k| k) {
        let query = Query {
            patch: &window.colours,
            weight: &window.weight,
            shape: window.shape,
        };
        let found = index.best(&query, &options.pick, &Monitor::default())?;
        if !found.is_empty() {
            return Ok(found);
        }
    }
    // Nothing to match: any allowed place will do.
    let places = || {
        index
            .exemplars()
            .iter()
            .enumerate()
            .flat_map(|(exemplar, e)| {
                let fits = |axis: usize| (e.shape[axis] + 1).saturating_sub(window.shape[axis]);
                let (rows, columns) = (fits(0), fits(1));
                (0..rows * columns)
                    .map(move |i| (i / columns, i % columns))
                    .filter_map(move |(row, column)| {
                        let allowed = e
                            .allowed
                            .as_ref()
                            .is_none_or(|a| a[row * e.shape[1] + column]);
                        allowed.then_some(Match {
                            cost: 0.0,
                            exemplar,
                            row,
                            column,
                        })
                    })
            })
    };
    let total = places().count() as u64;
    if total == 0 {
        let message = format!(
            "of {:?}: no exemplar has an allowed place for it",
            window.shape
        );
        return Err(Error::value("patch", message));
    }
    let drawn = Noise::new(options.seed).below(total, [step as u32, 0, 0, 1]);
    Ok(places().nth(drawn as usize).into_iter().collect())
}

/// The samples of a match.
fn copy(index: &Index, found: &Match, shape: [usize; 2]) -> Vec<f32> {
    let exemplar = &index.exemplars()[found.exemplar];
    let n = index.channels();
    let mut out = Vec::with_capacity(shape[0] * shape[1] * n);
    for row in found.row..found.row + shape[0] {
        let start = (row * exemplar.shape[1] + found.column) * n;
        out.extend_from_slice(&exemplar.data[start..][..shape[1] * n]);
    }
    out
}

/// The part of the canvas that is being filled.
struct Window {
    shape: [usize; 2],
    channels: usize,
    colours: Vec<f32>,
    known: Vec<bool>,
    keep: Vec<bool>,
    weight: Vec<f32>,
}

impl Window {
    fn new(shape: [usize; 2], channels: usize) -> Self {
        let n = shape[0] * shape[1];
        Self {
            shape,
            channels,
            colours: vec![0.0; n * channels],
            known: vec![false; n],
            keep: vec![false; n],
            weight: vec![0.0; n],
        }
    }

    fn read(&mut self, canvas: &Canvas<'_>, to: [usize; 2]) {
        let n = self.channels;
        for_each(&canvas.grid, to, self.shape, |i, at| {
            self.known[i] = canvas.known[at];
            self.keep[i] = canvas.known[at] && canvas.keep.is_some_and(|keep| keep[at]);
            self.colours[i * n..][..n].copy_from_slice(&canvas.colours[at * n..][..n]);
        });
        let distance = chamfer(&self.known, self.shape);
        let reach = self.shape[0].min(self.shape[1]) as f32 / 4.0;
        for (i, weight) in self.weight.iter_mut().enumerate() {
            let d = distance[i] / reach;
            *weight = if self.known[i] {
                (-d * d).exp() + FAR_WEIGHT
            } else {
                0.0
            };
        }
    }

    /// Gives all known pixels the same weight.
    fn level(&mut self) {
        for (weight, &known) in self.weight.iter_mut().zip(&self.known) {
            *weight = f32::from(u8::from(known));
        }
    }

    /// The cost of cutting a match in, and the pixels that it would take.
    fn cut(
        &self,
        canvas: &Canvas<'_>,
        index: &Index,
        found: &Match,
        to: [usize; 2],
        paper: bool,
    ) -> Result<(f64, Vec<bool>)> {
        let [rows, columns] = self.shape;
        if self.known.iter().all(|k| !k) {
            return Ok((0.0, vec![true; rows * columns]));
        }
        let [height, width] = canvas.grid.shape();
        let wrap = canvas.grid.wrap();
        // The rim is tied to what is there, except at the edges of the canvas and beside the hole.
        let rim = |r: usize, c: usize| {
            (r == 0 && (wrap[0] || to[0] > 0))
                || (r == rows - 1 && (wrap[0] || to[0] + rows < height))
                || (c == 0 && (wrap[1] || to[1] > 0))
                || (c == columns - 1 && (wrap[1] || to[1] + columns < width))
        };
        let hole_beside = |r: usize, c: usize| {
            (r > 0 && !self.known[(r - 1) * columns + c])
                || (r + 1 < rows && !self.known[(r + 1) * columns + c])
                || (c > 0 && !self.known[r * columns + c - 1])
                || (c + 1 < columns && !self.known[r * columns + c + 1])
        };
        let core: Vec<bool> = (0..rows * columns)
            .map(|i| {
                let (r, c) = (i / columns, i % columns);
                self.keep[i] || (self.known[i] && rim(r, c) && !hole_beside(r, c))
            })
            .collect();
        let new = copy(index, found, self.shape);
        let everywhere = vec![true; rows * columns];
        let grid = Grid::new(self.shape, [false; 2])?;
        let mut overlap = Overlap::new(
            grid,
            self.channels,
            &self.colours,
            &new,
            &self.known,
            &everywhere,
        );
        overlap.core_a = Some(&core);
        if paper {
            overlap.cost = Cost::Difference;
        }
        let cut = stitch::cut(&overlap, &Monitor::default())?;
        Ok((cut.value + self.border(&new), cut.b))
    }

    /// What the seam between pixels to keep and the hole costs, which is in no overlap: beyond it nothing is known, so the
    /// difference is taken to be the same on both of its sides, and the new patch to show the gradient.
    fn border(&self, new: &[f32]) -> f64 {
        let [rows, columns] = self.shape;
        let n = self.channels;
        let apart = |a: &[f32], i: usize, b: &[f32], j: usize| -> f32 {
            (0..n).map(|k| (a[i * n + k] - b[j * n + k]).abs()).sum()
        };
        let pair = |i: usize, j: usize| -> f64 {
            let (kept, hole) = if self.keep[i] { (i, j) } else { (j, i) };
            if !self.keep[kept] || self.known[hole] {
                return 0.0;
            }
            let difference = apart(&self.colours, kept, new, kept);
            f64::from(difference / (apart(new, kept, new, hole) + FLAT))
        };
        let mut sum = 0.0;
        for r in 0..rows {
            for c in 0..columns {
                let i = r * columns + c;
                if c + 1 < columns {
                    sum += pair(i, i + 1);
                }
                if r + 1 < rows {
                    sum += pair(i, i + columns);
                }
            }
        }
        sum
    }

    /// Pastes the pixels taken; returns how many were holes.
    fn paste(
        &self,
        canvas: &mut Canvas<'_>,
        index: &Index,
        found: &Match,
        taken: &[bool],
        to: [usize; 2],
        result: &mut Completion,
    ) -> u64 {
        let n = self.channels;
        let new = copy(index, found, self.shape);
        let label = result.patches.len() as i32;
        let mut filled = 0;
        let grid = canvas.grid;
        for_each(&grid, to, self.shape, |i, at| {
            if taken[i] {
                canvas.colours[at * n..][..n].copy_from_slice(&new[i * n..][..n]);
                filled += u64::from(!canvas.known[at]);
                canvas.known[at] = true;
                result.label[at] = label;
            }
        });
        result.patches.push(Patch {
            exemplar: found.exemplar,
            from: [found.row, found.column],
            to,
        });
        filled
    }
}

/// Distance of each pixel to the nearest unknown one of the window, by the 3-4 chamfer; large where there is none.
fn chamfer(known: &[bool], [rows, columns]: [usize; 2]) -> Vec<f32> {
    const SIDE: u32 = 3;
    const CORNER: u32 = 4;
    let mut d: Vec<u32> = known
        .iter()
        .map(|&k| if k { u32::MAX / 2 } else { 0 })
        .collect();
    let at = |r: usize, c: usize| r * columns + c;
    for r in 0..rows {
        for c in 0..columns {
            let mut least = d[at(r, c)];
            if c > 0 {
                least = least.min(d[at(r, c - 1)] + SIDE);
            }
            if r > 0 {
                least = least.min(d[at(r - 1, c)] + SIDE);
                if c > 0 {
                    least = least.min(d[at(r - 1, c - 1)] + CORNER);
                }
                if c + 1 < columns {
                    least = least.min(d[at(r - 1, c + 1)] + CORNER);
                }
            }
            d[at(r, c)] = least;
        }
    }
    for r in (0..rows).rev() {
        for c in (0..columns).rev() {
            let mut least = d[at(r, c)];
            if c + 1 < columns {
                least = least.min(d[at(r, c + 1)] + SIDE);
            }
            if r + 1 < rows {
                least = least.min(d[at(r + 1, c)] + SIDE);
                if c > 0 {
                    least = least.min(d[at(r + 1, c - 1)] + CORNER);
                }
                if c + 1 < columns {
                    least = least.min(d[at(r + 1, c + 1)] + CORNER);
                }
            }
            d[at(r, c)] = least;
        }
    }
    d.iter().map(|&x| x as f32 / SIDE as f32).collect()
}
