//! Which matches are worth a cut: those that fit, dearer where they would repeat or mirror what lies near.
//!
//! A greedy choice likes what it has just pasted, and the mirror image of what it continues: both fit well, and both show at
//! once. So a match pays for the share of it that the neighbourhood shows already, elsewhere or mirrored. What fits
//! perfectly costs nothing and pays nothing: a regular pattern may repeat.

use super::window::Window;
use super::{Options, Patch};
use crate::foundation::grid::Grid;
use crate::foundation::hash::Noise;
use crate::foundation::par::Monitor;
use crate::kernels::patch_search::{Index, Match, Pick};
use crate::{Error, Result};

/// How many patches away a repetition counts.
const REACH: usize = 2;
/// Pixels by which a copy may be off before it counts as a repetition: less is a stretch.
const STRETCH: isize = 2;
/// What a match pays, in its own costs, for repeating all that it shows.
const REPEATED: f64 = 1.0;
/// The same for mirroring it.
const MIRRORED: f64 = 3.0;
/// Matches looked at for each one that is asked for.
const SPARE: usize = 2;
/// Matches that are cut: a cut costs more than a search, and those that fit worse are seldom cut better.
const TRIED: usize = 3;

/// Chooses among the places of exemplars.
pub(super) struct Chooser<'a> {
    index: &'a Index,
    options: &'a Options,
    grid: Grid<2>,
    /// For each exemplar the first one that it is a mirror image of (or is itself), and along which axes.
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

    /// The matches to cut into a window; at least one.
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
                let found = self.index.good(&query, &wider, monitor)?;
                let price = |m: &Match| m.cost * (1.0 + self.charge(m, to, pasted));
                let mut priced: Vec<_> = found.into_iter().map(|m| (price(&m), m)).collect();
                // Stable: ties stay in the order of the search.
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

    /// How much of a match its neighbourhood shows already, elsewhere or mirrored, at the price of each.
    fn charge(&self, found: &Match, to: [usize; 2], pasted: &[Patch]) -> f64 {
        let patch = self.options.patch;
        let (of, flip) = self.turned[found.exemplar];
        let from = [found.row, found.column];
        let here = self.unturned(found.exemplar, from);
        // The canvas around a hole is a copy too, in place.
        let shown = self.options.shown.map(|exemplar| Patch {
            exemplar,
            from: to,
            to,
        });
        let mut charge = 0.0f64;
        for old in pasted.iter().chain(&shown) {
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

    /// The corner of a patch of an exemplar, in the one that it is a mirror image of.
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

    /// How far `a` is behind `b`, the shorter way where the axis wraps.
    fn apart(&self, axis: usize, a: usize, b: usize) -> isize {
        let (n, d) = (self.grid.shape()[axis] as isize, a as isize - b as isize);
        if self.grid.wrap()[axis] {
            (d + n / 2).rem_euclid(n) - n / 2
        } else {
            d
        }
    }
}

/// Share of a patch that another one of the same size covers, by their corners.
fn overlap(a: [isize; 2], b: [isize; 2], patch: [usize; 2]) -> f64 {
    let along = |axis: usize| {
        let left = patch[axis].saturating_sub(a[axis].abs_diff(b[axis]));
        left as f64 / patch[axis] as f64
    };
    along(0) * along(1)
}

/// Any allowed place, drawn: nothing is known that could match.
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
    let total = places().count() as u64;
    if total == 0 {
        let message = format!("of {shape:?}: no exemplar has an allowed place for it");
        return Err(Error::value("patch", message));
    }
    let drawn = Noise::new(seed).below(total, [step as u32, 0, 0, 1]);
    Ok(places().nth(drawn as usize).into_iter().collect())
}
