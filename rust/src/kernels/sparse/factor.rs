//! The numbers of a factor, block by block.

use std::ops::Range;

use super::plan::{Entries, Front, Job, Plan, measure_piles};
use super::{dense, not_definite};
use crate::Result;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};

const WHAT: &str = "the factor of the matrix";

/// The numbers of blocks that follow each other.
#[derive(Debug)]
pub(super) struct Part {
    /// Which blocks these are.
    pub(super) fronts: Range<usize>,
    /// Of each block, one after the other, the columns of its own unknowns: one by the diagonal, what is below it, further rows.
    pub(super) values: Vec<f64>,
}

impl Part {
    /// Blocks, with their numbers.
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
    // Alone, a worker keeps all in one piece.
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

/// Parts of the factor, and what the last block leaves to its parent: a square of as many rows as that has further ones.
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
            // Other threads stay asleep.
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

    /// Factors a block whose children are done.
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

    /// Factors blocks one after the other, the last of which may leave something.
    fn run(&self, range: Range<usize>) -> Result<Done> {
        let fronts = &self.plan.fronts[range.clone()];
        let largest = fronts.iter().map(Front::area).max();
        let mut bench = Bench::new(largest.unwrap_or(0))?;
        let mut values = Vec::new();
        memory::reserve(WHAT, &mut values, fronts.iter().map(Front::len).sum())?;
        // What blocks of even and of odd depth leave: the last ones are the children of the next block, whose own comes last in
        // the other.
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

    /// Lays a block's own columns out, with the matrix's entries.
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
        // What a block is filled up with stands for itself.
        for k in front.own..columns {
            bench.own[k * height + k] = 1.0;
        }
    }

    /// Adds what a child has left.
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

    /// Factors a block, takes off what it leaves, and keeps its numbers.
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

/// What one worker has at hand.
struct Bench {
    /// The columns of a block.
    own: Vec<f64>,
    /// Rows that follow each other in a child and in a block.
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
