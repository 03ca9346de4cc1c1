//! Exact best matches of a masked, weighted patch over all positions of one or several exemplars.
//!
//! The cost of a position is the weighted sum of squared differences, `sum w (T - S)^2`. As in Kwatra et al.,
//! *Graphcut textures*, SIGGRAPH 2003, section 3.1, all positions are evaluated at once by Fourier correlation:
//! `sum w T^2 - 2 sum (w T) S + sum w S^2`.
//!
//! The correlation, in `f32`, is only a filter. Every position whose filtered cost is within twice the error bound of the
//! least is scored again, in `f64` and in a fixed order, so the answer is the true minimum: the same for any
//! number of threads, any block size and any CPU, with ties to the lowest (exemplar, row, column). Means are removed before
//! the transforms, which is what makes the bound tight: on photographs it lets a handful of positions through.

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

/// What is searched: samples in row-major order, channels last.
#[derive(Debug, Clone, Default)]
pub struct Exemplar {
    /// `rows * columns * channels` finite samples; several indices may look into them.
    pub data: Arc<Vec<f32>>,
    /// Rows and columns.
    pub shape: [usize; 2],
    /// Which positions (top-left corners) may be used, `rows * columns`; all if absent.
    pub allowed: Option<Vec<bool>>,
}

/// What is looked for.
#[derive(Debug, Clone, Copy)]
pub struct Query<'a> {
    /// `rows * columns * channels` samples; where the weight is zero anything, NaN too.
    pub patch: &'a [f32],
    /// `rows * columns` weights, not negative; zero where the patch is unknown. All zero: every position costs nothing.
    pub weight: &'a [f32],
    /// Rows and columns.
    pub shape: [usize; 2],
}

/// How many matches, and which.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pick {
    /// At most this many.
    pub count: usize,
    /// Matches in one exemplar are more than this many pixels apart, along rows or along columns.
    pub separation: usize,
    /// No match costs more than this times the least.
    pub ratio: f64,
}

impl Default for Pick {
    /// The best one.
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
    /// Which exemplar.
    pub exemplar: usize,
    /// Row of the patch's top-left corner.
    pub row: usize,
    /// Column of the patch's top-left corner.
    pub column: usize,
}

/// Exemplars made ready for many searches.
pub struct Index {
    exemplars: Vec<Exemplar>,
    channels: usize,
    max_patch: [usize; 2],
    plan: Plan,
    blocks: Vec<Block>,
    /// Made by the first search that needs them.
    spectra: OnceLock<Spectra>,
    /// The same exemplars at half the resolution, if patches bear it.
    half: OnceLock<Option<Box<Index>>>,
    /// Of exemplars in which few positions are allowed: these, in their order.
    open: Vec<Option<Vec<u32>>>,
    /// What hangs on the samples alone.
    known: Arc<Known>,
    workspaces: Pool<Workspace>,
    scratch: Pool<Scratch>,
}

#[derive(Clone, Copy)]
struct Block {
    exemplar: usize,
    corner: [usize; 2],
}

/// Buffers kept for the next taker. Never waits: a lock held elsewhere (or in the parent of a fork) means a new buffer.
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

/// What a cell holds, made now if it is empty. Made before the cell is locked: a thread of the pool that waited for the lock
/// might be the one that has to make it. Two that come at once make the same, and the first is kept.
fn once<T>(cell: &OnceLock<T>, make: impl FnOnce() -> T) -> &T {
    if let Some(made) = cell.get() {
        return made;
    }
    let made = make();
    cell.get_or_init(|| made)
}

impl Index {
    /// Makes exemplars ready to be searched for patches of up to `max_patch` rows and columns.
    pub fn new(exemplars: Vec<Exemplar>, channels: usize, max_patch: [usize; 2]) -> Result<Self> {
        if exemplars.is_empty() || channels == 0 {
            let message = format!(
                "needs an exemplar and a channel, got {} of {channels} channels",
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

    /// Makes exemplars ready of which all is known but where they are looked into, and for what.
    fn with(
        exemplars: Vec<Exemplar>,
        channels: usize,
        max_patch: [usize; 2],
        known: Arc<Known>,
    ) -> Result<Self> {
        let samples = exemplars.iter().map(|e| e.data.len()).sum();
        memory::room("what patches are searched in", samples, 24)?;
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

    /// Channels of the exemplars.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Rows and columns of the exemplars.
    pub fn shapes(&self) -> Vec<[usize; 2]> {
        self.exemplars.iter().map(|e| e.shape).collect()
    }

    /// The exemplars, in the order in which they came.
    pub fn exemplars(&self) -> &[Exemplar] {
        &self.exemplars
    }

    /// The largest patch that can be looked for.
    pub fn max_patch(&self) -> [usize; 2] {
        self.max_patch
    }

    /// The best matches, by rising (cost, exemplar, row, column).
    ///
    /// Greedy: the best position of all, then the best of those far enough from the ones taken, and so on. Fewer than
    /// `count` come back where separation, ratio or the allowed positions leave no more.
    pub fn best(&self, query: &Query<'_>, pick: &Pick, monitor: &Monitor) -> Result<Vec<Match>> {
        check_pick(pick)?;
        let mut workspace = self.workspaces.take();
        let found = self.search(query, pick, monitor, &mut workspace);
        self.workspaces.give(workspace);
        found
    }

    /// The cost of one position.
    pub fn at(&self, query: &Query<'_>, exemplar: usize, row: usize, column: usize) -> Result<f64> {
        let found = self.best_among(query, &[[exemplar, row, column]], &Pick::default())?;
        Ok(found[0].cost)
    }

    /// [`Self::best`] among the given (exemplar, row, column); the `allowed` positions play no part.
    pub fn best_among(
        &self,
        query: &Query<'_>,
        candidates: &[[usize; 3]],
        pick: &Pick,
    ) -> Result<Vec<Match>> {
        check_pick(pick)?;
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
                    "(exemplar, row, column) = ({exemplar}, {row}, {column}) leaves no room for a patch of {:?} \
                     in {} exemplars of {:?}",
                    query.shape,
                    self.exemplars.len(),
                    shape.unwrap_or_default()
                );
                return Err(Error::value("candidates", message));
            }
        }
        // What is too dear next to any other is none of the matches, however dear. Bits of numbers that are not negative
        // are ordered as they are.
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

    /// The costs of all positions of one exemplar as the filter sees them, (rows - p + 1) x (columns - q + 1), and how far
    /// they may be from the true ones. Forbidden positions are infinite.
    pub fn cost_map(
        &self,
        query: &Query<'_>,
        exemplar: usize,
        monitor: &Monitor,
    ) -> Result<(Vec<f32>, f64)> {
        let Some(e) = self.exemplars.get(exemplar) else {
            let message = format!("{exemplar}, but there are {}", self.exemplars.len());
            return Err(Error::value("exemplar", message));
        };
        let shape = e.shape;
        if query.shape[0] > shape[0] || query.shape[1] > shape[1] {
            let message = format!(
                "{:?} does not fit into the exemplar of {shape:?}",
                query.shape
            );
            return Err(Error::value("patch", message));
        }
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
    // No product where the ratio is infinite: it would be NaN for a perfect match.
    pick.ratio.is_finite() && next.cost > pick.ratio * first.cost
}

fn order(a: &Match, b: &Match) -> std::cmp::Ordering {
    a.cost
        .total_cmp(&b.cost)
        .then_with(|| (a.exemplar, a.row, a.column).cmp(&(b.exemplar, b.row, b.column)))
}

/// One position of so many, at most, is allowed where these are listed.
const FEW: usize = 4;

/// The positions that are allowed in an exemplar, if few are.
fn list_open(exemplar: &Exemplar) -> Option<Vec<u32>> {
    let allowed = exemplar.allowed.as_ref()?;
    let count = allowed.iter().filter(|&&open| open).count();
    let open = || allowed.iter().enumerate().filter(|(_, open)| **open);
    (count <= allowed.len() / FEW).then(|| open().map(|(at, _)| at as u32).collect())
}

#[cfg(test)]
mod tests;
