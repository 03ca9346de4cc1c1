//! Choice of the matches that are tried for a window. Matches that would repeat or mirror their neighbourhood cost
//! more.
//!
//! A greedy choice tends to repeat recent patches or to mirror its neighbourhood, because both fit well. Both are easy
//! to see. The cost of a match therefore grows with the share of it that the neighbourhood already contains, at
//! another offset or mirrored. A perfect match keeps its cost of 0, because a regular texture may repeat.

use super::window::Window;
use super::{Options, Patch};
use crate::foundation::grid::Grid;
use crate::foundation::hash::Noise;
use crate::foundation::lattice::away;
use crate::foundation::par::Monitor;
use crate::kernels::patch_search::{Index, Match, Pick};
use crate::{Error, Result};

/// Distance, in patch sides, up to which a repetition increases the cost of a match.
const REACH: usize = 2;
/// Maximum difference, in pixels, between the positions of a match and of the continuation of an earlier patch. A
/// match with a larger difference is a repetition.
const STRETCH: isize = 2;
/// Relative increase of the cost of a match whose whole area is repeated.
const REPEATED: f64 = 1.0;
/// Relative increase of the cost of a match whose whole area is mirrored.
const MIRRORED: f64 = 3.0;
/// Number of matches that are searched for each requested match.
const SPARE: usize = 2;
/// Maximum number of matches whose cuts are computed. A cut takes longer than a search, and a worse match seldom gives
/// a better cut.
const TRIED: usize = 3;
/// Maximum distance of a place from the nearest one in step with the lattice, in pixels.
const SLACK: f64 = 3.0;

/// Chooses among the positions of the exemplars.
pub(super) struct Chooser<'a> {
    index: &'a Index,
    options: &'a Options,
    grid: Grid<2>,
    /// For each exemplar, the first exemplar that it mirrors (itself if there is none), and the
    /// mirrored axes.
    turned: &'a [(usize, [bool; 2])],
}

impl<'a> Chooser<'a> {
    pub(super) fn new(index: &'a Index, options: &'a Options, grid: Grid<2>) -> Self {
        Self {
            index,
            options,
            grid,
            turned: index.turned(),
        }
    }

    /// Returns the matches whose cuts are compared for a window, at least one.
    pub(super) fn matches(
        &self,
        window: &Window,
        to: [usize; 2],
        pasted: &[Patch],
        monitor: &Monitor,
    ) -> Result<Vec<Match>> {
        let pick = self.options.pick;
        let found = match window.query() {
            None => Vec::new(),
            Some(query) if self.options.paper => self.index.best(&query, &pick, monitor)?,
            Some(query) => {
                let wider = Pick {
                    count: pick.count.saturating_mul(SPARE),
                    ..pick
                };
                let places = self.in_step(window.shape, to);
                let found = if places.is_empty() {
                    self.index.good(&query, &wider, monitor)?
                } else {
                    self.index.best_among(&query, &places, &wider)?
                };
                let price = |m: &Match| m.cost * (1.0 + self.charge(m, to, pasted));
                let mut priced: Vec<_> = found.into_iter().map(|m| (price(&m), m)).collect();
                // The sort is stable, so ties stay in the order of the search.
                priced.sort_by(|a, b| a.0.total_cmp(&b.0));
                priced.truncate(pick.count.min(TRIED));
                priced.into_iter().map(|(_, m)| m).collect()
            }
        };
        if found.is_empty() {
            return anywhere(self.index, window.shape, self.options.seed, pasted.len());
        }
        Ok(found)
    }

    /// Returns the allowed places for a patch that are in step with the lattice, or nothing without a lattice.
    fn in_step(&self, shape: [usize; 2], to: [usize; 2]) -> Vec<[usize; 3]> {
        let (Some(lattice), Some(exemplar)) = (&self.options.lattice, self.options.shown) else {
            return Vec::new();
        };
        let of = &self.index.exemplars()[exemplar];
        let [rows, columns] = [0, 1].map(|axis| (of.shape[axis] + 1).saturating_sub(shape[axis]));
        let places = (0..rows).flat_map(|row| (0..columns).map(move |column| [row, column]));
        let fits = |&[row, column]: &[usize; 2]| {
            let moved = [row as f64 - to[0] as f64, column as f64 - to[1] as f64];
            away(lattice, moved) <= SLACK
                && (of.allowed.as_ref()).is_none_or(|a| a[row * of.shape[1] + column])
        };
        places
            .filter(fits)
            .map(|[row, column]| [exemplar, row, column])
            .collect()
    }

    /// Returns the relative increase of the cost of a match. It grows with the share of the match that its
    /// neighbourhood already contains, at another offset or mirrored.
    fn charge(&self, found: &Match, to: [usize; 2], pasted: &[Patch]) -> f64 {
        let patch = self.options.patch;
        let (of, flip) = self.turned[found.exemplar];
        let from = [found.row, found.column];
        let here = self.unturned(found.exemplar, from);
        // The canvas around the hole counts as a copy of the exemplar at the same position.
        let shown = self.options.shown.map(|exemplar| Patch {
            exemplar,
            from: to,
            to,
        });
        let mut charge = 0.0f64;
        for old in pasted.iter().chain(&shown) {
            // Only patches nearby that come from the same exemplar, or from its mirror image, are
            // compared.
            let apart = [0, 1].map(|axis| self.apart(axis, to[axis], old.to[axis]));
            let near = |axis: usize| apart[axis].unsigned_abs() <= REACH * patch[axis];
            if !(near(0) && near(1)) || self.turned[old.exemplar].0 != of {
                continue;
            }
            let share = overlap(here, self.unturned(old.exemplar, old.from), patch);
            let off = |axis: usize| from[axis] as isize - old.from[axis] as isize - apart[axis];
            if self.turned[old.exemplar].1 != flip {
                charge = charge.max(MIRRORED * share);
            } else if off(0).abs().max(off(1).abs()) > STRETCH {
                charge = charge.max(REPEATED * share);
            }
        }
        charge
    }

    /// Returns the corner of a patch in the original exemplar. `at` is its corner in `exemplar`, which may be a mirror
    /// image.
    fn unturned(&self, exemplar: usize, at: [usize; 2]) -> [isize; 2] {
        let shape = self.index.exemplars()[exemplar].shape;
        let flip = self.turned[exemplar].1;
        std::array::from_fn(|axis| {
            let at = at[axis] as isize;
            if flip[axis] {
                shape[axis] as isize - self.options.patch[axis] as isize - at
            } else {
                at
            }
        })
    }

    /// Returns `a - b` along an axis, by the shorter way if the axis wraps.
    fn apart(&self, axis: usize, a: usize, b: usize) -> isize {
        let (n, d) = (self.grid.shape()[axis] as isize, a as isize - b as isize);
        if self.grid.wrap()[axis] {
            (d + n / 2).rem_euclid(n) - n / 2
        } else {
            d
        }
    }
}

/// Returns the share of a patch that another patch of the same size covers. Both are given by their
/// corners.
fn overlap(a: [isize; 2], b: [isize; 2], patch: [usize; 2]) -> f64 {
    let along = |axis: usize| {
        let left = patch[axis].saturating_sub(a[axis].abs_diff(b[axis]));
        left as f64 / patch[axis] as f64
    };
    along(0) * along(1)
}

/// Draws any allowed position, because no pixel of the window is known.
fn anywhere(index: &Index, shape: [usize; 2], seed: u64, step: usize) -> Result<Vec<Match>> {
    let places = || {
        index
            .exemplars()
            .iter()
            .enumerate()
            .flat_map(|(exemplar, e)| {
                let fits = |axis: usize| (e.shape[axis] + 1).saturating_sub(shape[axis]);
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
    // Count the allowed positions first, because a list of them could be large.
    let total = places().count() as u64;
    if total == 0 {
        let message =
            format!("must fit at an allowed position of an exemplar, got shape {shape:?}");
        return Err(Error::value("patch", message));
    }
    let drawn = Noise::new(seed).below(total, [step as u32, 0, 0, 1]);
    Ok(places().nth(drawn as usize).into_iter().collect())
}
