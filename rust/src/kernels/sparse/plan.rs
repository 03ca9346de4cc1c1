//! The pattern of a factor: the rows of each block, and the positions of its values.
//!
//! The terms are from the multifrontal method of Duff and Reid (1983). The front of a block is a dense array with the
//! columns of its own unknowns. The *rest* of a block is a square over its further rows: its contribution to later
//! blocks. The rest is added to the parent, whose rows include all these rows.

use std::ops::Range;

use super::order::{Block, Order};
use super::{Checked, NONE};
use crate::Result;
use crate::foundation::memory;
use crate::foundation::par::Monitor;

/// Number of rows, and of columns, that are processed together. Fronts are padded to multiples of
/// it.
pub(super) const TILE: usize = 4;

/// A block of the factor.
#[derive(Debug, Clone)]
pub(super) struct Front {
    /// First unknown, in the order of elimination.
    pub(super) start: usize,
    /// Number of own unknowns.
    pub(super) own: usize,
    /// Range in [`Plan::rows`] of the further rows, which are below the own unknowns.
    pub(super) rows: Range<usize>,
    /// Position of the block's values in the factor. The column of each own unknown starts at its diagonal.
    pub(super) values: usize,
    /// The block that receives the rest.
    pub(super) parent: Option<usize>,
    /// Depth in the tree, from the root. The rests of even and of odd depth are on separate piles.
    pub(super) depth: usize,
    /// Number of previous blocks that are below this block in the tree.
    pub(super) beneath: usize,
}

impl Front {
    /// Number of own unknowns, padded.
    pub(super) fn columns(&self) -> usize {
        self.own.next_multiple_of(TILE)
    }

    /// Number of further rows, padded.
    pub(super) fn rest(&self) -> usize {
        self.rows.len().next_multiple_of(TILE)
    }

    /// Number of all rows.
    pub(super) fn height(&self) -> usize {
        self.columns() + self.rest()
    }

    /// Number of values of the block in the factor.
    pub(super) fn len(&self) -> usize {
        self.own * (self.own + 1) / 2 + self.own * self.rows.len()
    }

    /// Number of values of the own columns during the factorisation.
    pub(super) fn area(&self) -> usize {
        self.columns() * self.height()
    }

    /// Approximate number of multiplications.
    pub(super) fn work(&self) -> u64 {
        let (columns, height) = (self.columns() as u64, self.height() as u64);
        columns * height * height / 2
    }
}

/// The pattern of a factor.
#[derive(Debug)]
pub(super) struct Plan {
    /// The unknown at each place of the order.
    pub(super) unknown: Vec<u32>,
    /// Number of unknowns that are not coupled to others. They come first.
    pub(super) alone: usize,
    /// Blocks, each after the blocks below it in the tree.
    pub(super) fronts: Vec<Front>,
    /// Further rows of the blocks: places in the order, increasing within a block.
    pub(super) rows: Vec<u32>,
    /// Rows of the parent's front that correspond to `rows`.
    pub(super) into: Vec<u32>,
    /// Number of values of the factor, over all blocks.
    pub(super) len: usize,
    /// Independent pieces of work.
    pub(super) jobs: Vec<Job>,
    /// Maximum number of values that the work takes in addition to the factor.
    pub(super) room: usize,
}

/// Work on blocks that does not depend on other jobs.
#[derive(Debug)]
pub(super) enum Job {
    /// Work on a range of blocks, one after the other.
    Run(Range<usize>),
    /// Work on one block, after the jobs below it.
    Join(Vec<Job>, usize),
}

/// Number of multiplications below which work is not divided.
const LITTLE: u64 = 1 << 21;
/// Work is divided further if it exceeds the total work divided by this number.
const SHARES: u64 = 16;
/// Maximum depth of the tree of jobs.
const DEEP: usize = 6;
/// Maximum number of jobs that one job waits for.
const MOST: usize = 8;

/// The entries of a matrix, sorted by the columns of the factor.
#[derive(Debug)]
pub(super) struct Entries {
    /// Start of the entries of each place in the order, and the end of the last entries.
    pub(super) starts: Vec<u32>,
    /// Rows in the front of the block.
    pub(super) rows: Vec<u32>,
    /// The entries.
    pub(super) values: Vec<f64>,
}

impl Entries {
    /// Assigns each entry to the column of its first eliminated unknown. The rows are places in the order of
    /// elimination. Rows of the front replace them later.
    fn new(matrix: &Checked<'_>, unknown: &[u32]) -> Result<Self> {
        let (what, size) = ("the order of the matrix", unknown.len());
        let mut place: Vec<u32> = memory::filled(what, 0, size)?;
        for (at, &unknown) in unknown.iter().enumerate() {
            place[unknown as usize] = at as u32;
        }
        let mut starts: Vec<u32> = memory::filled(what, 0, size + 1)?;
        for column in 0..size {
            let own = place[column];
            for &row in matrix.rows(column) {
                starts[own.min(place[row as usize]) as usize] += 1;
            }
        }
        let mut sum = 0;
        for start in &mut starts {
            sum += *start;
            *start = sum;
        }
        let mut rows: Vec<u32> = memory::filled(what, 0, sum as usize)?;
        let mut values: Vec<f64> = memory::filled(what, 0.0, sum as usize)?;
        // Iterate backwards, so that each start ends at the right position.
        for column in (0..size).rev() {
            let own = place[column];
            let (of, numbers) = (matrix.rows(column), matrix.values(column));
            for (&row, &value) in of.iter().zip(numbers).rev() {
                let other = place[row as usize];
                let at = &mut starts[own.min(other) as usize];
                *at -= 1;
                rows[*at as usize] = own.max(other);
                values[*at as usize] = value;
            }
        }
        Ok(Self {
            starts,
            rows,
            values,
        })
    }

    /// Returns the positions of the entries of a range of places.
    pub(super) fn of(&self, places: Range<usize>) -> Range<usize> {
        self.starts[places.start] as usize..self.starts[places.end] as usize
    }
}

impl Plan {
    /// Plans the factor of a matrix, and sorts its entries.
    pub(super) fn new(
        matrix: &Checked<'_>,
        order: Order,
        monitor: &Monitor,
    ) -> Result<(Self, Entries)> {
        let what = "the pattern of the factor";
        let mut entries = Entries::new(matrix, &order.unknown)?;
        let count = order.blocks.len();
        let size = order.unknown.len();
        // Row in the current front of each place in the order, and the last front that contains the
        // place.
        let mut place: Vec<u32> = memory::filled(what, 0, size)?;
        let mut whose: Vec<u32> = memory::filled(what, NONE, size)?;
        let mut fronts: Vec<Front> = Vec::with_capacity(count);
        let (mut rows, mut into): (Vec<u32>, Vec<u32>) = Default::default();
        // Blocks whose parent has not been processed yet. The last of them are the children of the next block.
        let mut waiting: Vec<usize> = Vec::new();
        let mut len = 0;
        for (number, &Block { start, end, parent }) in order.blocks.iter().enumerate() {
            monitor.check()?;
            let first = rows.len();
            let own = entries.of(start as usize..end as usize);
            let is_child = |&&child: &&usize| order.blocks[child].parent == number as u32;
            let children = waiting.len() - waiting.iter().rev().take_while(is_child).count();
            // Collect the further rows: the rows of the children and of the matrix entries.
            let most: usize = waiting[children..]
                .iter()
                .map(|&child| fronts[child].rows.len())
                .sum();
            memory::reserve(what, &mut rows, most + own.len())?;
            let mut gather = |row: u32, rows: &mut Vec<u32>| {
                if row >= end && whose[row as usize] != number as u32 {
                    whose[row as usize] = number as u32;
                    rows.push(row);
                }
            };
            let mut beneath = 0;
            for &child in &waiting[children..] {
                for at in fronts[child].rows.clone() {
                    gather(rows[at], &mut rows);
                }
                beneath += fronts[child].beneath + 1;
            }
            for &row in &entries.rows[own.clone()] {
                gather(row, &mut rows);
            }
            // The rows of each child are already sorted, which makes `sort` fast.
            rows[first..].sort();
            let columns = ((end - start) as usize).next_multiple_of(TILE) as u32;
            for (i, row) in (start..end).enumerate() {
                place[row as usize] = i as u32;
            }
            for (i, &row) in rows[first..].iter().enumerate() {
                place[row as usize] = columns + i as u32;
            }
            memory::reserve(what, &mut into, rows.len() - first)?;
            into.resize(rows.len(), 0);
            // Replace places by rows of this front, in the children's rows and in the entries.
            for child in waiting.drain(children..) {
                let of = fronts[child].rows.clone();
                for (into, &row) in into[of.clone()].iter_mut().zip(&rows[of]) {
                    *into = place[row as usize];
                }
            }
            for row in &mut entries.rows[own] {
                *row = place[*row as usize];
            }
            let front = Front {
                start: start as usize,
                own: (end - start) as usize,
                rows: first..rows.len(),
                values: len,
                parent: (parent != NONE).then_some(parent as usize),
                depth: 0,
                beneath,
            };
            len += front.len();
            fronts.push(front);
            waiting.push(number);
        }
        for number in (0..count).rev() {
            if let Some(parent) = fronts[number].parent {
                fronts[number].depth = fronts[parent].depth + 1;
            }
        }
        let jobs = share_out(&fronts);
        let room = jobs.iter().map(|job| job.room(&fronts)).sum();
        let plan = Self {
            unknown: order.unknown,
            alone: order.alone,
            fronts,
            rows,
            into,
            len,
            jobs,
            room,
        };
        Ok((plan, entries))
    }
}

/// Divides the work into jobs. The division depends only on the matrix, not on the number of
/// threads.
fn share_out(fronts: &[Front]) -> Vec<Job> {
    let mut work: Vec<u64> = fronts.iter().map(Front::work).collect();
    for (number, front) in fronts.iter().enumerate() {
        if let Some(parent) = front.parent {
            work[parent] += work[number];
        }
    }
    let roots = || (0..fronts.len()).filter(|&number| fronts[number].parent.is_none());
    let total: u64 = roots().map(|root| work[root]).sum();
    let share = (total / SHARES).max(LITTLE);
    // Small trees are collected into runs. Large trees are divided further.
    let mut jobs = Vec::new();
    let (mut first, mut sum) = (0, 0);
    for root in roots() {
        let begin = root - fronts[root].beneath;
        if sum + work[root] > share {
            if first < begin {
                jobs.push(Job::Run(first..begin));
            }
            (first, sum) = (begin, 0);
        }
        if work[root] > share {
            jobs.push(Job::of(root, fronts, &work, share, 0));
            first = root + 1;
        } else {
            sum += work[root];
        }
    }
    if first < fronts.len() {
        jobs.push(Job::Run(first..fronts.len()));
    }
    jobs
}

impl Job {
    /// Returns the job that processes a block and all blocks below it.
    fn of(last: usize, fronts: &[Front], work: &[u64], share: u64, level: usize) -> Self {
        let first = last - fronts[last].beneath;
        let mut children = Vec::new();
        let mut end = last;
        while end > first && children.len() <= MOST {
            children.push(end - 1);
            end -= fronts[end - 1].beneath + 1;
        }
        if work[last] <= share || level == DEEP || children.len() > MOST {
            return Self::Run(first..last + 1);
        }
        let beneath = children.iter().rev();
        Self::Join(
            beneath
                .map(|&child| Self::of(child, fronts, work, share, level + 1))
                .collect(),
            last,
        )
    }

    /// Returns the maximum number of values that the job takes in addition to the factor.
    fn room(&self, fronts: &[Front]) -> usize {
        match self {
            Self::Run(range) => {
                let own = fronts[range.clone()].iter().map(Front::area).max();
                own.unwrap_or(0) + measure_piles(fronts, range.clone()).iter().sum::<usize>()
            }
            Self::Join(jobs, last) => {
                let beneath: usize = jobs.iter().map(|job| job.room(fronts)).sum();
                beneath + fronts[*last].area() + fronts[*last].rest().pow(2)
            }
        }
    }
}

/// Returns the maximum sizes of the two piles of rests, of even and of odd depth.
pub(super) fn measure_piles(fronts: &[Front], range: Range<usize>) -> [usize; 2] {
    let (mut now, mut most) = ([0; 2], [0; 2]);
    let mut waiting: Vec<usize> = Vec::new();
    for number in range {
        let pile = fronts[number].depth % 2;
        now[pile] += fronts[number].rest().pow(2);
        most[pile] = most[pile].max(now[pile]);
        while let Some(&child) = waiting.last()
            && fronts[child].parent == Some(number)
        {
            now[1 - pile] -= fronts[child].rest().pow(2);
            waiting.pop();
        }
        waiting.push(number);
    }
    most
}
