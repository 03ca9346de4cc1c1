//! Hierarchies of regions: pairs of neighbouring regions are merged in order of a cost.
//!
//! | part | content |
//! |---|---|
//! | [`merge`] | merge trees of a region adjacency graph |
//! | [`candidates`] | all nodes of several trees without duplicates, also with their holes filled |
//! | [`measure`] | sums over the regions of each set and along its border, and the shape of its convex hull |

pub mod candidates;
pub mod measure;
pub mod merge;

use crate::foundation::memory;
use crate::{Error, Result};

/// Sets of regions.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sets {
    starts: Vec<usize>,
    members: Vec<u32>,
}

impl Default for Sets {
    fn default() -> Self {
        Self {
            starts: vec![0],
            members: Vec::new(),
        }
    }
}

impl Sets {
    /// Returns sets from the starts of all sets and the end of the last one, and all members.
    ///
    /// # Errors
    /// The starts do not begin at 0, decrease, or do not end at the number of members.
    pub fn new(starts: Vec<usize>, members: Vec<u32>) -> Result<Self> {
        let sound = starts.first() == Some(&0)
            && starts.last() == Some(&members.len())
            && starts.is_sorted();
        if !sound {
            let message = format!(
                "must rise from 0 to {}, the number of members",
                members.len()
            );
            return Err(Error::value("starts", message));
        }
        Ok(Self { starts, members })
    }

    /// Adds a set.
    ///
    /// # Errors
    /// Memory is short.
    pub fn push(&mut self, members: &[u32]) -> Result<()> {
        let room = self.members.capacity();
        if room - self.members.len() < members.len() {
            // The capacity at least doubles. Leave as much again for the rest of the work.
            memory::room("sets of regions", room.max(members.len()), 16)?;
        }
        self.members.extend_from_slice(members);
        self.starts.push(self.members.len());
        Ok(())
    }

    /// Returns the starts of all sets and the end of the last one, and the members of all sets.
    pub fn into_parts(self) -> (Vec<usize>, Vec<u32>) {
        (self.starts, self.members)
    }

    /// Number of sets.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Returns whether the list of sets is empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the members of a set.
    pub fn get(&self, i: usize) -> &[u32] {
        &self.members[self.starts[i]..self.starts[i + 1]]
    }

    /// Returns a number above all members.
    pub fn bound(&self) -> usize {
        self.members.iter().max().map_or(0, |&m| m as usize + 1)
    }
}

/// Regions, and the borders between them.
#[derive(Debug, Clone, Copy)]
pub struct Graph<'a> {
    /// Number of pixels of each region.
    pub area: &'a [f64],
    /// Mean values of each region, such as a colour.
    pub mean: &'a [[f64; 3]],
    /// Pairs of regions that touch, each once.
    pub pairs: &'a [[u32; 2]],
    /// Length of the border of each pair, and the sum of the strength along it.
    pub arcs: &'a [[f64; 2]],
}

impl Graph<'_> {
    /// Number of regions.
    pub fn len(&self) -> usize {
        self.area.len()
    }

    /// Returns whether the image has zero regions.
    pub fn is_empty(&self) -> bool {
        self.area.is_empty()
    }

    /// Returns an error if the sizes of the arrays do not match or a value is out of range.
    pub(crate) fn check(&self) -> Result<()> {
        let n = self.len();
        if self.mean.len() != n {
            return Err(Error::value(
                "mean",
                format!("must have {n} rows, got {}", self.mean.len()),
            ));
        }
        if self.arcs.len() != self.pairs.len() {
            let message = format!(
                "must have {} rows, got {}",
                self.pairs.len(),
                self.arcs.len()
            );
            return Err(Error::value("arcs", message));
        }
        if self.area.iter().any(|&a| !(a.is_finite() && a > 0.0)) {
            return Err(Error::value("area", "must be finite and above 0"));
        }
        check_finite("mean", self.mean.as_flattened())?;
        check_finite("arcs", self.arcs.as_flattened())?;
        check_pairs(self.pairs, n)
    }

    /// Returns the neighbours of each region, in order of the pairs.
    pub(crate) fn neighbours(&self) -> Vec<Vec<u32>> {
        let mut out = vec![Vec::new(); self.len()];
        for &[p, q] in self.pairs {
            out[p as usize].push(q);
            out[q as usize].push(p);
        }
        out
    }
}

/// Returns an error if a value is not finite.
pub(crate) fn check_finite(argument: &'static str, values: &[f64]) -> Result<()> {
    match values.iter().find(|v| !v.is_finite()) {
        Some(bad) => Err(Error::value(argument, format!("must be finite, got {bad}"))),
        None => Ok(()),
    }
}

/// Returns an error if a pair does not consist of two different regions with numbers below `count`.
pub(crate) fn check_pairs(pairs: &[[u32; 2]], count: usize) -> Result<()> {
    match pairs
        .iter()
        .find(|&&[p, q]| p == q || p.max(q) as usize >= count)
    {
        Some(pair) => {
            let message = format!("must be of two different regions below {count}, got {pair:?}");
            Err(Error::value("pairs", message))
        }
        None => Ok(()),
    }
}
