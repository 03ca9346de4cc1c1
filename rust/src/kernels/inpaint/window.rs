//! The window of the canvas that is being filled: its known pixels, and the minimum cut between them and a match.

use super::{Canvas, FAR_WEIGHT, FLAT, Inpainting, KEPT_WEIGHT, Patch};
use crate::Result;
use crate::foundation::grid::Grid;
use crate::foundation::libm::exp;
use crate::foundation::par::Monitor;
use crate::kernels::patch_search::{Index, Match, Query};
use crate::kernels::seam::cost::Cost;
use crate::kernels::seam::stitch::{Overlap, Stitcher};

/// Calls `f(i, position)` for each pixel of a window. Positions wrap around if the grid does.
pub(super) fn for_each(
    grid: &Grid<2>,
    to: [usize; 2],
    patch: [usize; 2],
    mut f: impl FnMut(usize, usize),
) {
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

/// Returns the samples of a match.
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

/// The window of the canvas that is being filled.
pub(super) struct Window {
    pub(super) shape: [usize; 2],
    channels: usize,
    colours: Vec<f32>,
    known: Vec<bool>,
    keep: Vec<bool>,
    weight: Vec<f32>,
    /// Pixels that a cut must not change.
    core: Vec<bool>,
    /// Pairs of neighbours: a pixel that must stay, and an unknown pixel.
    ends: Vec<[usize; 2]>,
}

impl Window {
    pub(super) fn new(shape: [usize; 2], channels: usize) -> Self {
        let n = shape[0] * shape[1];
        Self {
            shape,
            channels,
            colours: vec![0.0; n * channels],
            known: vec![false; n],
            keep: vec![false; n],
            weight: vec![0.0; n],
            core: vec![false; n],
            ends: Vec::new(),
        }
    }

    pub(super) fn read(&mut self, canvas: &Canvas<'_>, to: [usize; 2]) {
        let n = self.channels;
        for_each(&canvas.grid, to, self.shape, |i, at| {
            self.known[i] = canvas.known[at];
            self.keep[i] = canvas.known[at] && canvas.keep.is_some_and(|keep| keep[at]);
            self.colours[i * n..][..n].copy_from_slice(&canvas.colours[at * n..][..n]);
        });
        self.tie(canvas, to);
        // Pixels near the hole weigh most. Known pixels far away keep a small weight.
        let distance = chamfer(&self.known, self.shape);
        let reach = self.shape[0].min(self.shape[1]) as f32 / 4.0;
        for (i, weight) in self.weight.iter_mut().enumerate() {
            let d = distance[i] / reach;
            let near = |steep: f32| exp(f64::from(-steep * d * d)) as f32;
            *weight = match (self.known[i], self.keep[i]) {
                (false, _) => 0.0,
                (true, false) => near(1.0) + FAR_WEIGHT,
                (true, true) => KEPT_WEIGHT * near(4.0) + FAR_WEIGHT,
            };
        }
    }

    /// Returns the query for the search, or `None` if no pixel is known.
    pub(super) fn query(&self) -> Option<Query<'_>> {
        self.known.contains(&true).then_some(Query {
            patch: &self.colours,
            weight: &self.weight,
            shape: self.shape,
        })
    }

    /// Gives all known pixels the same weight.
    pub(super) fn level(&mut self) {
        for (weight, &known) in self.weight.iter_mut().zip(&self.known) {
            *weight = f32::from(u8::from(known));
        }
    }

    /// Returns the cost of the minimum cut between the known pixels and a match, and a flag for each pixel: whether it
    /// takes the match. The result is `None` if the cost exceeds `bound`.
    pub(super) fn cut(
        &self,
        index: &Index,
        found: &Match,
        paper: bool,
        bound: f64,
        stitcher: &mut Stitcher<2>,
        monitor: &Monitor,
    ) -> Result<Option<(f64, Vec<bool>)>> {
        // Without known pixels, the match is pasted without a seam.
        if self.known.iter().all(|k| !k) {
            return Ok(Some((0.0, vec![true; self.known.len()])));
        }
        let new = copy(index, found, self.shape);
        let border = self.border(&new);
        if border > bound {
            return Ok(None);
        }
        // If all known pixels must stay, the only seam is along the border of the hole.
        if self.core.iter().zip(&self.known).all(|(c, k)| c == k) {
            return Ok(Some((border, self.known.iter().map(|k| !k).collect())));
        }
        let everywhere = vec![true; self.known.len()];
        let grid = Grid::new(self.shape, [false; 2])?;
        let mut overlap = Overlap::new(
            grid,
            self.channels,
            &self.colours,
            &new,
            &self.known,
            &everywhere,
        );
        overlap.core_a = Some(&self.core);
        if paper {
            overlap.cost = Cost::Difference;
        }
        // Round the remaining bound up, so that rounding never excludes a cut.
        let left = (bound - border).next_up();
        let cut = stitcher.cut_within(&overlap, left, monitor)?;
        Ok(cut.map(|cut| (cut.value + border, cut.b)))
    }

    /// Marks the pixels that a cut must not change: pixels to keep, and known pixels along the window's border. The
    /// border then still fits the canvas outside the window. Pixels at an edge of the canvas or next to an unknown
    /// pixel do not count as border.
    fn tie(&mut self, canvas: &Canvas<'_>, to: [usize; 2]) {
        let [rows, columns] = self.shape;
        let [height, width] = canvas.grid.shape();
        let wrap = canvas.grid.wrap();
        let rim = |r: usize, c: usize| {
            (r == 0 && (wrap[0] || to[0] > 0))
                || (r == rows - 1 && (wrap[0] || to[0] + rows < height))
                || (c == 0 && (wrap[1] || to[1] > 0))
                || (c == columns - 1 && (wrap[1] || to[1] + columns < width))
        };
        let known = &self.known;
        let hole_beside = |r: usize, c: usize| {
            (r > 0 && !known[(r - 1) * columns + c])
                || (r + 1 < rows && !known[(r + 1) * columns + c])
                || (c > 0 && !known[r * columns + c - 1])
                || (c + 1 < columns && !known[r * columns + c + 1])
        };
        // The core consists of the pixels to keep and of the known border.
        for (i, core) in self.core.iter_mut().enumerate() {
            let (r, c) = (i / columns, i % columns);
            *core = self.keep[i] || (known[i] && rim(r, c) && !hole_beside(r, c));
        }
        // List the pairs of a pixel to keep and an unknown pixel, because no overlap contains both.
        self.ends.clear();
        for i in 0..rows * columns {
            let beside = [
                (i % columns + 1 < columns, i + 1),
                (i + columns < rows * columns, i + columns),
            ];
            for (_, j) in beside.into_iter().filter(|(inside, _)| *inside) {
                if self.keep[i] && !known[j] {
                    self.ends.push([i, j]);
                } else if self.keep[j] && !known[i] {
                    self.ends.push([j, i]);
                }
            }
        }
    }

    /// Returns the cost of the seam between pixels to keep and unknown pixels, which no overlap contains. The old
    /// colours beyond the seam are unknown. The difference is therefore assumed to be equal on both sides, and the
    /// gradient is that of the new patch.
    fn border(&self, new: &[f32]) -> f64 {
        let n = self.channels;
        let apart = |a: &[f32], i: usize, b: &[f32], j: usize| -> f32 {
            (0..n).map(|k| (a[i * n + k] - b[j * n + k]).abs()).sum()
        };
        let cost = |&[kept, hole]: &[usize; 2]| {
            let difference = apart(&self.colours, kept, new, kept);
            f64::from(difference / (apart(new, kept, new, hole) + FLAT))
        };
        self.ends.iter().fold(0.0, |sum, pair| sum + cost(pair))
    }

    /// Pastes the taken pixels, and returns the pixels that were unknown before.
    pub(super) fn paste(
        &self,
        canvas: &mut Canvas<'_>,
        index: &Index,
        found: &Match,
        taken: &[bool],
        to: [usize; 2],
        result: &mut Inpainting,
    ) -> Vec<usize> {
        let n = self.channels;
        let new = copy(index, found, self.shape);
        let label = result.patches.len() as i32;
        let mut filled = Vec::new();
        let grid = canvas.grid;
        for_each(&grid, to, self.shape, |i, at| {
            if taken[i] {
                canvas.colours[at * n..][..n].copy_from_slice(&new[i * n..][..n]);
                if !canvas.known[at] {
                    filled.push(at);
                    canvas.known[at] = true;
                }
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

/// Returns the distance of each pixel to the nearest unknown pixel of the window, by the 3-4
/// chamfer. It is large if no pixel is unknown.
fn chamfer(known: &[bool], [rows, columns]: [usize; 2]) -> Vec<f32> {
    const SIDE: u32 = 3;
    const CORNER: u32 = 4;
    let mut d: Vec<u32> = known
        .iter()
        .map(|&k| if k { u32::MAX / 2 } else { 0 })
        .collect();
    let at = |r: usize, c: usize| r * columns + c;
    // Propagate distances from the top left, then from the bottom right.
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
