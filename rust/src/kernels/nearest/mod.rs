//! The nearest of many vectors, exactly: windows of a picture in the axes of their principal components, say.
//!
//! A tree of boxes, eight to a node, bounds distances by the numbers that spread most (Bentley, *Multidimensional binary
//! search trees*, CACM 1975, as wide as a register); what it leaves is compared eight numbers at a time, and given up as soon
//! as those are far enough. Both in `f32`, with room for its errors: what may be nearest is compared in `f64`, in a fixed
//! order, and of equally near ones the first is taken. Queries that follow each other are often near each other, as windows
//! are: each looks first at what goes on where the last one's nearest ended. That changes nothing but the time.

mod tree;

use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

use self::tree::{Query, Tree};

/// Queries that a task takes, one after the other.
const CHUNK: usize = 256;
/// How far behind the last nearest the next may be: windows side by side, or every second one.
const AHEAD: usize = 3;

/// Vectors, made ready to be searched.
pub struct Nearest {
    numbers: usize,
    vectors: Vec<f64>,
    tree: Tree,
}

/// The nearest vector of each query, and how far it is.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Found {
    /// Which, in the order in which they were given.
    pub index: Vec<u32>,
    /// Euclidean distances.
    pub distance: Vec<f64>,
}

impl Nearest {
    /// Takes vectors of `numbers` numbers, one after the other.
    pub fn new(vectors: Vec<f64>, numbers: usize) -> Result<Self> {
        if numbers == 0 || vectors.is_empty() || !vectors.len().is_multiple_of(numbers) {
            return Err(Error::Shape {
                argument: "vectors",
                expected: vec![1, numbers.max(1)],
                got: vec![vectors.len()],
            });
        }
        if vectors.len() / numbers > u32::MAX as usize / 2 {
            let count = vectors.len() / numbers;
            return Err(Error::value("vectors", format!("{count} are too many")));
        }
        check("vectors", &vectors)?;
        let tree = Tree::new(&vectors, numbers);
        Ok(Self {
            numbers,
            vectors,
            tree,
        })
    }

    /// Numbers of a vector.
    pub fn numbers(&self) -> usize {
        self.numbers
    }

    /// The nearest vector of each query.
    pub fn query(&self, queries: &[f64], monitor: &Monitor) -> Result<Found> {
        if !queries.len().is_multiple_of(self.numbers) {
            return Err(Error::Shape {
                argument: "queries",
                expected: vec![queries.len() / self.numbers, self.numbers],
                got: vec![queries.len()],
            });
        }
        check("queries", queries)?;
        self.search(queries, false, monitor)
    }

    /// The nearest other vector of each of the vectors; there must be two.
    pub fn others(&self, monitor: &Monitor) -> Result<Found> {
        if self.vectors.len() == self.numbers {
            return Err(Error::value("vectors", "one alone has no other"));
        }
        self.search(&self.vectors, true, monitor)
    }

    fn search(&self, queries: &[f64], others: bool, monitor: &Monitor) -> Result<Found> {
        let count = queries.len() / self.numbers;
        let mut found = vec![(0.0, 0); count];
        monitor.expect(count as u64);
        par::chunks_mut(&mut found, CHUNK, |chunk, found| {
            if monitor.check().is_err() {
                return;
            }
            let first = chunk * CHUNK;
            let mut query = Query::new(&self.tree);
            let mut last = None;
            for (i, to) in (first..).zip(found.iter_mut()) {
                let vector = &queries[i * self.numbers..][..self.numbers];
                let own = others.then_some(i as u32);
                let mut best = (f64::INFINITY, u32::MAX);
                for near in last.into_iter().flat_map(|l| l..l + AHEAD) {
                    if own != Some(near as u32)
                        && let Some(other) = self.vectors.get(near * self.numbers..)
                        && !other.is_empty()
                    {
                        let found = (apart(vector, &other[..self.numbers]), near as u32);
                        best = if found < best { found } else { best };
                    }
                }
                *to = query.nearest(&self.vectors, vector, own, best);
                last = Some(to.1 as usize);
            }
            let _ = monitor.advance(found.len() as u64);
        });
        monitor.check()?;
        Ok(Found {
            index: found.iter().map(|f| f.1).collect(),
            distance: found.iter().map(|f| f.0.sqrt()).collect(),
        })
    }
}

fn check(argument: &'static str, numbers: &[f64]) -> Result<()> {
    match numbers.iter().find(|x| x.is_nan() || x.abs() > LARGEST) {
        Some(bad) => Err(Error::value(
            argument,
            format!("numbers within {LARGEST:e} are allowed, got {bad}"),
        )),
        None => Ok(()),
    }
}

/// Numbers whose squares can be added.
const LARGEST: f64 = 1e150;

/// The squared distance of two vectors, in four sums.
#[inline(always)]
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let ((fours, rest), (others, last)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (a, b) in fours.iter().zip(others) {
        for k in 0..4 {
            sums[k] += (a[k] - b[k]) * (a[k] - b[k]);
        }
    }
    let mut sum = sums[0] + sums[1] + sums[2] + sums[3];
    for (a, b) in rest.iter().zip(last) {
        sum += (a - b) * (a - b);
    }
    sum
}

#[cfg(test)]
mod tests;
