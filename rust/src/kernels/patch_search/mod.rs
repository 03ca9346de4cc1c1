//! Exact best matches of a masked, weighted patch over all positions of one or several exemplars.
//!
//! The cost of a position is the weighted sum of squared differences, `sum w (T - S)^2`. As in
//! Kwatra et al., *Graphcut textures*, SIGGRAPH 2003, section 3.1, all positions are evaluated at
//! once by Fourier correlation: `sum w T^2 - 2 sum (w T) S + sum w S^2`.
//!
//! The correlation in `f32` is only a filter. Every position whose filtered cost is within twice
//! the error bound of the minimum is scored again, in `f64` and in a fixed order. The result is
//! therefore the exact minimum. It does not depend on the number of threads, the block size or the
//! CPU. Ties go to the lowest (exemplar, row, column).
//!
//! Means are removed before the transforms, which makes the bound tight. On photographs, only a handful of positions
//! remain.

mod checks;
mod costs;
mod filter;
mod half;
mod known;
mod maps;
mod score;
mod spectra;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};
use checks::{check_exemplar, check_pick, check_side};
use filter::{Plan, Scratch};
use known::Known;
use maps::Workspace;
use score::Prepared;
use spectra::Spectra;

/// The searched image: samples in row-major order, channels last.
#[derive(Debug, Clone, Default)]
pub struct Exemplar {
    /// `rows * columns * channels` finite samples. Several indices may share them.
    pub data: Arc<Vec<f32>>,
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Flags of the allowed positions (top-left corners), `rows * columns`. All positions are
    /// allowed if absent.
    pub allowed: Option<Vec<bool>>,
}

/// The patch to search for.
#[derive(Debug, Clone, Copy)]
pub struct Query<'a> {
    /// `rows * columns * channels` samples. Samples of weight 0 may have any value, including NaN.
    pub patch: &'a [f32],
    /// `rows * columns` non-negative weights. The weight is 0 where the patch is unknown. If all
    /// weights are 0, every position has cost 0.
    pub weight: &'a [f32],
    /// Rows and columns.
    pub shape: [usize; 2],
}

/// Selection of the matches that a search returns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pick {
    /// Maximum number of matches.
    pub count: usize,
    /// Matches in the same exemplar are more than this number of pixels apart, along rows or along
    /// columns.
    pub separation: usize,
    /// Maximum cost of a match, as a multiple of the lowest cost.
    pub ratio: f64,
}

impl Default for Pick {
    /// Selects only the best match.
    fn default() -> Self {
        Self {
            count: 1,
            separation: 0,
            ratio: f64::INFINITY,
        }
    }
}

/// A position and its cost.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Match {
    /// Weighted sum of squared differences.
    pub cost: f64,
    /// Index of the exemplar.
    pub exemplar: usize,
    /// Row of the top-left corner of the patch.
    pub row: usize,
    /// Column of the top-left corner of the patch.
    pub column: usize,
}

/// Exemplars prepared for many searches.
pub struct Index {
    exemplars: Vec<Exemplar>,
    channels: usize,
    max_patch: [usize; 2],
    plan: Plan,
    blocks: Vec<Block>,
    /// Spectra of the blocks, computed by the first search that needs them.
    spectra: OnceLock<Spectra>,
    /// The same exemplars at half the resolution, if patches are large enough.
    half: OnceLock<Option<Box<Index>>>,
    /// List of the allowed positions, in order, of each exemplar that has few of them.
    open: Vec<Option<Vec<u32>>>,
    /// Data that depend only on the samples.
    known: Arc<Known>,
    workspaces: Pool<Workspace>,
    scratch: Pool<Scratch>,
}

#[derive(Clone, Copy)]
struct Block {
    exemplar: usize,
    corner: [usize; 2],
}

/// Buffers that are kept for reuse. The pool never waits for its lock. If another thread holds the lock, or held it
/// when the process was forked, the caller gets a new buffer.
struct Pool<T>(Mutex<Vec<T>>);

impl<T: Default> Pool<T> {
    fn take(&self) -> T {
        self.0
            .try_lock()
            .ok()
            .and_then(|mut all| all.pop())
            .unwrap_or_default()
    }

    fn give(&self, one: T) {
        if let Ok(mut all) = self.0.try_lock() {
            all.push(one);
        }
    }
}

/// Returns the value of a cell, and computes it if the cell is empty.
///
/// The value is computed before the cell is locked. Otherwise a pool thread could wait for a value whose computation
/// needs this thread. If two threads arrive at the same time, both compute the value, and the first result is kept.
fn once<T>(cell: &OnceLock<T>, make: impl FnOnce() -> T) -> &T {
    if let Some(made) = cell.get() {
        return made;
    }
    let made = make();
    cell.get_or_init(|| made)
}

impl Index {
    /// Prepares exemplars to be searched for patches of up to `max_patch` rows and columns.
    pub fn new(exemplars: Vec<Exemplar>, channels: usize, max_patch: [usize; 2]) -> Result<Self> {
        if exemplars.is_empty() || channels == 0 {
            let message = format!(
                "must contain at least one exemplar with at least one channel, got {} of {channels} channels",
                exemplars.len()
            );
            return Err(Error::value("exemplars", message));
        }
        check_side(max_patch)?;
        for exemplar in &exemplars {
            check_exemplar(exemplar, channels)?;
        }
        let data: Vec<_> = exemplars.iter().map(|e| &e.data[..]).collect();
        let known = Arc::new(Known::of(&data, channels));
        Self::with(exemplars, channels, max_patch, known)
    }

    /// Prepares exemplars whose sample data `known` are already computed.
    fn with(
        exemplars: Vec<Exemplar>,
        channels: usize,
        max_patch: [usize; 2],
        known: Arc<Known>,
    ) -> Result<Self> {
        // Check the memory, then plan blocks for the largest patch that fits.
        let samples = exemplars.iter().map(|e| e.data.len()).sum();
        memory::room("the patch search", samples, 24)?;
        let longest = |axis: usize| exemplars.iter().map(|e| e.shape[axis]).max().unwrap_or(1);
        let max_patch = [max_patch[0].min(longest(0)), max_patch[1].min(longest(1))];
        let shapes: Vec<_> = exemplars.iter().map(|e| e.shape).collect();
        let plan = Plan::new(&shapes, max_patch, channels + 1);

        let blocks: Vec<Block> = shapes
            .iter()
            .enumerate()
            .flat_map(|(exemplar, &shape)| {
                plan.corners(shape)
                    .into_iter()
                    .map(move |corner| Block { exemplar, corner })
            })
            .collect();
        let open = exemplars.iter().map(list_open).collect();
        Ok(Self {
            spectra: OnceLock::new(),
            half: OnceLock::new(),
            exemplars,
            channels,
            max_patch,
            plan,
            blocks,
            open,
            known,
            workspaces: Pool(Mutex::default()),
            scratch: Pool(Mutex::default()),
        })
    }

    /// Number of channels of the exemplars.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Rows and columns of the exemplars.
    pub fn shapes(&self) -> Vec<[usize; 2]> {
        self.exemplars.iter().map(|e| e.shape).collect()
    }

    /// The exemplars, in their given order.
    pub fn exemplars(&self) -> &[Exemplar] {
        &self.exemplars
    }

    /// Largest patch that can be searched for.
    pub fn max_patch(&self) -> [usize; 2] {
        self.max_patch
    }

    /// Returns the best matches by rising (cost, exemplar, row, column).
    ///
    /// The choice is greedy: first the best of all positions, then the best position that is far enough from the
    /// chosen ones, and so on. Fewer than `count` matches are returned if separation, ratio and allowed positions
    /// exclude all others.
    pub fn best(&self, query: &Query<'_>, pick: &Pick, monitor: &Monitor) -> Result<Vec<Match>> {
        check_pick(pick)?;
        let mut workspace = self.workspaces.take();
        let found = self.search(query, pick, monitor, &mut workspace);
        self.workspaces.give(workspace);
        found
    }

    /// Returns the cost of one position.
    pub fn at(&self, query: &Query<'_>, exemplar: usize, row: usize, column: usize) -> Result<f64> {
        let found = self.best_among(query, &[[exemplar, row, column]], &Pick::default())?;
        Ok(found[0].cost)
    }

    /// Returns the best of the given positions (exemplar, row, column), as [`Self::best`] does. The `allowed` flags of
    /// the exemplars are ignored.
    pub fn best_among(
        &self,
        query: &Query<'_>,
        candidates: &[[usize; 3]],
        pick: &Pick,
    ) -> Result<Vec<Match>> {
        check_pick(pick)?;
        // Check that the patch fits at all candidates.
        let mut prepared = Prepared::default();
        prepared.fill(query, self.channels)?;
        for &[exemplar, row, column] in candidates {
            let shape = self.exemplars.get(exemplar).map(|e| e.shape);
            let fits = |s: [usize; 2]| {
                row.checked_add(query.shape[0]).is_some_and(|r| r <= s[0])
                    && column
                        .checked_add(query.shape[1])
                        .is_some_and(|c| c <= s[1])
            };
            if !shape.is_some_and(fits) {
                let message = format!(
                    "must leave room for a patch of {:?}, got (exemplar, row, column) = \
                     ({exemplar}, {row}, {column}) in {} exemplars of {:?}",
                    query.shape,
                    self.exemplars.len(),
                    shape.unwrap_or_default()
                );
                return Err(Error::value("candidates", message));
            }
        }
        // A candidate that is too costly compared with any other is not a match, so its exact cost
        // is not needed. The minimum is kept as bits, because the bits of non-negative floats have
        // the same order as the floats.
        let least = AtomicU64::new(f64::INFINITY.to_bits());
        let mut all = par::map(candidates.len(), |i| {
            let [exemplar, row, column] = candidates[i];
            let e = &self.exemplars[exemplar];
            let bound = if pick.ratio.is_finite() {
                pick.ratio * f64::from_bits(least.load(Ordering::Relaxed))
            } else {
                f64::INFINITY
            };
            let cost = prepared.cost_within(&e.data, e.shape, [row, column], bound);
            least.fetch_min(cost.to_bits(), Ordering::Relaxed);
            Match {
                cost,
                exemplar,
                row,
                column,
            }
        });
        // Choose greedily from the sorted candidates.
        all.sort_by(order);
        let mut found: Vec<Match> = Vec::new();
        for m in all {
            let far = |f: &Match| {
                f.exemplar != m.exemplar
                    || f.row.abs_diff(m.row).max(f.column.abs_diff(m.column)) > pick.separation
            };
            if found.len() == pick.count || found.first().is_some_and(|f| too_dear(f, &m, pick)) {
                break;
            }
            if found.iter().all(far) {
                found.push(m);
            }
        }
        Ok(found)
    }

    /// Returns the filtered costs of all positions of one exemplar, and the bound of their error. There are (rows - p
    /// + 1) x (columns - q + 1) positions. Forbidden positions have infinite cost.
    pub fn cost_map(
        &self,
        query: &Query<'_>,
        exemplar: usize,
        monitor: &Monitor,
    ) -> Result<(Vec<f32>, f64)> {
        let Some(e) = self.exemplars.get(exemplar) else {
            let message = format!("must be below {}, got {exemplar}", self.exemplars.len());
            return Err(Error::value("exemplar", message));
        };
        let shape = e.shape;
        if query.shape[0] > shape[0] || query.shape[1] > shape[1] {
            let message = format!(
                "must fit into the exemplar of shape {shape:?}, got {:?}",
                query.shape
            );
            return Err(Error::value("patch", message));
        }
        // Filter only the blocks of this exemplar, and convert their costs to the unit of exact costs.
        let mut workspace = self.workspaces.take();
        let first = self.blocks.partition_point(|b| b.exemplar < exemplar);
        let last = self.blocks.partition_point(|b| b.exemplar <= exemplar);
        let unit = self.filter(query, first..last, monitor, &mut workspace);
        let result = unit.map(|(unit, offset)| {
            let width = shape[1] - query.shape[1] + 1;
            let mut out = vec![0.0f32; (shape[0] - query.shape[0] + 1) * width];
            for (block, map) in self.blocks[first..last].iter().zip(workspace.maps()) {
                for (r, row) in map.rows().enumerate() {
                    let start = (block.corner[0] + r) * width + block.corner[1];
                    for (out, &cost) in out[start..][..row.len()].iter_mut().zip(row) {
                        *out = (f64::from(cost) * unit + offset).max(0.0) as f32;
                    }
                }
            }
            let error = workspace.maps().iter().map(|m| m.error(0.0));
            (out, error.fold(0.0, f64::max) * unit)
        });
        self.workspaces.give(workspace);
        result
    }
}

fn too_dear(first: &Match, next: &Match, pick: &Pick) -> bool {
    // Avoid the product for an infinite ratio, because it would be NaN for a perfect match.
    pick.ratio.is_finite() && next.cost > pick.ratio * first.cost
}

fn order(a: &Match, b: &Match) -> std::cmp::Ordering {
    a.cost
        .total_cmp(&b.cost)
        .then_with(|| (a.exemplar, a.row, a.column).cmp(&(b.exemplar, b.row, b.column)))
}

/// Allowed positions are listed if at most one position in this number is allowed.
const FEW: usize = 4;

/// Returns the allowed positions of an exemplar, if there are few.
fn list_open(exemplar: &Exemplar) -> Option<Vec<u32>> {
    let allowed = exemplar.allowed.as_ref()?;
    let count = allowed.iter().filter(|&&open| open).count();
    let open = || allowed.iter().enumerate().filter(|(_, open)| **open);
    (count <= allowed.len() / FEW).then(|| open().map(|(at, _)| at as u32).collect())
}

#[cfg(test)]
mod tests;
