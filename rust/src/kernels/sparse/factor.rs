//! Numeric factorisation, block by block.

use std::ops::Range;

use super::plan::{Entries, Front, Job, Plan, measure_piles};
use super::{dense, not_definite};
use crate::Result;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};

const WHAT: &str = "the factor of the matrix";

/// Entries of the factor in consecutive blocks.
#[derive(Debug)]
pub(super) struct Part {
    /// Range of the blocks.
    pub(super) fronts: Range<usize>,
    /// Columns of the own unknowns of each block, one block after the other. A column contains the reciprocal of its
    /// diagonal entry, then the values of the own unknowns below it and of the further rows.
    pub(super) values: Vec<f64>,
}

impl Part {
    /// Returns the blocks with their values.
    pub(super) fn blocks<'a>(
        &'a self,
        plan: &'a Plan,
    ) -> impl DoubleEndedIterator<Item = (&'a Front, &'a [f64])> {
        let fronts = &plan.fronts[self.fronts.clone()];
        let first = fronts.first().map_or(0, |front| front.values);
        fronts
            .iter()
            .map(move |front| (front, &self.values[front.values - first..][..front.len()]))
    }
}

/// Factors a matrix by its plan.
pub(super) fn factor(plan: &Plan, entries: &Entries, monitor: &Monitor) -> Result<Vec<Part>> {
    let task = Task {
        plan,
        entries,
        monitor,
    };
    let mut parts = Vec::new();
    // With a single thread, factor everything as one job.
    let whole = [Job::Run(0..plan.fronts.len())];
    let jobs = if par::threads() > 1 {
        &plan.jobs
    } else {
        &whole[..]
    };
    for (done, _) in task.work_all(jobs)? {
        parts.extend(done);
    }
    Ok(parts)
}

/// Parts of the factor, and the contribution of the last block to its parent: a square with the
/// further rows of that block.
type Done = (Vec<Part>, Vec<f64>);

#[derive(Clone, Copy)]
struct Task<'a> {
    plan: &'a Plan,
    entries: &'a Entries,
    monitor: &'a Monitor,
}

impl Task<'_> {
    fn work_all(&self, jobs: &[Job]) -> Result<Vec<Done>> {
        match jobs {
            // A single job runs on this thread, so that other threads stay asleep.
            [one] => Ok(vec![self.work(one)?]),
            _ => par::map(jobs.len(), |i| self.work(&jobs[i]))
                .into_iter()
                .collect(),
        }
    }

    fn work(&self, job: &Job) -> Result<Done> {
        match job {
            Job::Run(range) => self.run(range.clone()),
            Job::Join(jobs, last) => self.join(self.work_all(jobs)?, *last),
        }
    }

    /// Factors a block after its children are done.
    fn join(&self, beneath: Vec<Done>, last: usize) -> Result<Done> {
        let front = &self.plan.fronts[last];
        let mut parts = Vec::new();
        let mut bench = Bench::new(front.area())?;
        let mut rest = memory::filled(WHAT, 0.0, front.rest().pow(2))?;
        self.lay_out(front, &mut bench);
        for (done, left) in beneath {
            let child = done.last().map_or(last, |part| part.fronts.end) - 1;
            self.hand_on(child, &left, front, &mut bench, &mut rest);
            parts.extend(done);
        }
        let mut values = Vec::new();
        memory::reserve(WHAT, &mut values, front.len())?;
        self.finish(front, &mut bench, &mut rest, &mut values)?;
        parts.push(Part {
            fronts: last..last + 1,
            values,
        });
        Ok((parts, rest))
    }

    /// Factors blocks one after the other. The last block may have a contribution to a parent outside the range.
    fn run(&self, range: Range<usize>) -> Result<Done> {
        let fronts = &self.plan.fronts[range.clone()];
        let largest = fronts.iter().map(Front::area).max();
        let mut bench = Bench::new(largest.unwrap_or(0))?;
        let mut values = Vec::new();
        memory::reserve(WHAT, &mut values, fronts.iter().map(Front::len).sum())?;
        // Contributions of blocks of even and of odd depth are on separate piles. The last
        // contributions of one pile come from the children of the next block, whose own
        // contribution goes on the other pile.
        let [even, odd] = measure_piles(&self.plan.fronts, range.clone());
        let mut piles = [
            memory::filled(WHAT, 0.0, even)?,
            memory::filled(WHAT, 0.0, odd)?,
        ];
        let mut used = [0; 2];
        let mut waiting: Vec<usize> = Vec::new();
        for (number, front) in range.clone().zip(fronts) {
            self.monitor.check()?;
            self.lay_out(front, &mut bench);
            let (mine, theirs) = (front.depth % 2, 1 - front.depth % 2);
            let [even, odd] = &mut piles;
            let (own, beneath) = if mine == 0 { (even, odd) } else { (odd, even) };
            let size = front.rest();
            let rest = &mut own[used[mine]..][..size * size];
            dense::clear(rest, size);
            used[mine] += size * size;
            let is_child = |&&child: &&usize| self.plan.fronts[child].parent == Some(number);
            // Take the children's contributions from their pile, and add them to the front.
            let children = waiting.len() - waiting.iter().rev().take_while(is_child).count();
            let left = |child: &usize| self.plan.fronts[*child].rest().pow(2);
            used[theirs] -= waiting[children..].iter().map(left).sum::<usize>();
            let mut at = used[theirs];
            for child in waiting.drain(children..) {
                self.hand_on(child, &beneath[at..], front, &mut bench, rest);
                at += left(&child);
            }
            self.finish(front, &mut bench, rest, &mut values)?;
            waiting.push(number);
        }
        let last = fronts
            .last()
            .map_or((0, 0), |f| (f.depth % 2, f.rest().pow(2)));
        let mut rest = std::mem::take(&mut piles[last.0]);
        rest.truncate(last.1);
        let part = Part {
            fronts: range,
            values,
        };
        Ok((vec![part], rest))
    }

    /// Writes the matrix entries into the own columns of a block.
    fn lay_out(&self, front: &Front, bench: &mut Bench) {
        let (height, columns) = (front.height(), front.columns());
        bench.own.clear();
        bench.own.resize(front.area(), 0.0);
        for k in 0..front.own {
            let of = self.entries.of(front.start + k..front.start + k + 1);
            let column = &mut bench.own[k * height..][..height];
            for (&row, &value) in self.entries.rows[of.clone()]
                .iter()
                .zip(&self.entries.values[of])
            {
                column[row as usize] += value;
            }
        }
        // Padding columns are columns of the identity.
        for k in front.own..columns {
            bench.own[k * height + k] = 1.0;
        }
    }

    /// Adds the contribution of a child to a front and to its rest.
    fn hand_on(
        &self,
        child: usize,
        left: &[f64],
        front: &Front,
        bench: &mut Bench,
        rest: &mut [f64],
    ) {
        let of = &self.plan.fronts[child];
        let into = &self.plan.into[of.rows.clone()];
        let [height, columns] = [front.height(), front.columns()];
        dense::list_runs(into, columns, &mut bench.runs);
        dense::hand_on(
            left,
            of.rest(),
            &bench.runs,
            &mut bench.own,
            rest,
            [height, columns],
        );
    }

    /// Factors a block, subtracts its contribution from the rest, and stores its values.
    fn finish(
        &self,
        front: &Front,
        bench: &mut Bench,
        rest: &mut [f64],
        values: &mut Vec<f64>,
    ) -> Result<()> {
        let (height, columns) = (front.height(), front.columns());
        if !dense::factor(&mut bench.own, height, self.monitor)? {
            return Err(not_definite());
        }
        dense::take_off(rest, front.rest(), &bench.own, height, self.monitor)?;
        for (k, column) in bench.own.chunks_exact(height).take(front.own).enumerate() {
            values.extend_from_slice(&column[k..front.own]);
            values.extend_from_slice(&column[columns..][..front.rows.len()]);
        }
        Ok(())
    }
}

/// Buffers of one worker.
struct Bench {
    /// The columns of a block.
    own: Vec<f64>,
    /// Runs of rows that are consecutive both in a child's contribution and in its parent's front.
    runs: Vec<dense::Run>,
}

impl Bench {
    fn new(largest: usize) -> Result<Self> {
        let mut own = Vec::new();
        memory::reserve(WHAT, &mut own, largest)?;
        Ok(Self {
            own,
            runs: Vec::new(),
        })
    }
}
