//! Candidates: the nodes of several merge trees without duplicates, and the same nodes with their holes filled.

use std::collections::HashMap;

use super::merge::{Cost, Tree, merge};
use super::{Graph, Sets, check_finite};
use crate::foundation::hash::Noise;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// Maximum area of one hole that is filled, relative to the area of the node.
const HOLES: f64 = 0.6;

/// Candidates, and the strength of the border between the two parts of each candidate, or 0 for single regions and
/// filled nodes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Candidates {
    /// The regions of each candidate, in order.
    pub sets: Sets,
    /// Largest strength of the border between the two parts, over all trees.
    pub seam: Vec<f64>,
}

/// Returns all nodes of the trees of all costs with an area from `least` to `most` pixels. `open` marks regions that
/// cannot be part of a hole, such as regions at the border of the image.
///
/// # Errors
/// The sizes of the arrays do not match. An area is not above 0, or a value is not finite. `least` or `most` is NaN.
pub fn candidates(
    graph: &Graph<'_>,
    costs: &[Cost],
    open: &[bool],
    [least, most]: [f64; 2],
    monitor: &Monitor,
) -> Result<Candidates> {
    graph.check()?;
    if open.len() != graph.len() {
        return Err(Error::value(
            "open",
            format!("must have {} values, got {}", graph.len(), open.len()),
        ));
    }
    for cost in costs {
        check_finite("costs", &[cost.arcs, cost.means, cost.small])?;
    }
    for (argument, value) in [("least", least), ("most", most)] {
        if value.is_nan() {
            return Err(Error::value(argument, "must be a number, got NaN"));
        }
    }
    monitor.check()?;
    // Each merge needs a small map for each region. All trees are kept.
    let each = 420 * graph.len() + 200 * graph.pairs.len();
    let merges = costs.len().min(par::threads()).max(1);
    let kept = graph.len().saturating_mul(costs.len()).saturating_mul(128);
    let bytes = each.saturating_mul(merges).saturating_add(kept);
    memory::room("the merge trees", bytes, 1)?;
    let trees = par::map(costs.len(), |i| merge(graph, costs[i], most, monitor));
    let trees: Vec<Tree> = trees.into_iter().collect::<Result<_>>()?;
    let near = graph.neighbours();
    let noise = Noise::new(0);
    let keys: Vec<u128> = (0..graph.len())
        .map(|i| {
            noise
                .words([i as u32, 0, 0, 0])
                .iter()
                .fold(0, |key, &w| (key << 32) | u128::from(w))
        })
        .collect();
    let mut found = Found {
        keys,
        seen: HashMap::new(),
        out: Candidates::default(),
    };
    let mut holes = Holes::new(graph, &near, open);
    for tree in &trees {
        monitor.check()?;
        let nodes = Nodes::new(tree, graph.len());
        for i in 0..tree.parts.len() {
            let area = tree.area[graph.len() + i];
            if area > most {
                continue;
            }
            let node = nodes.get(i);
            if area >= least {
                found.add(node, tree.seam[i])?;
            }
            if let Some((filled, area)) = holes.fill(node, HOLES * area)
                && (least..=most).contains(&area)
            {
                found.add(&filled, 0.0)?;
            }
        }
    }
    for (i, &area) in graph.area.iter().enumerate() {
        if (least..=most).contains(&area) {
            found.add(&[i as u32], 0.0)?;
        }
    }
    Ok(found.out)
}

/// The regions of each node of a tree, as ranges of one list.
struct Nodes {
    order: Vec<u32>,
    ranges: Vec<[usize; 2]>,
}

impl Nodes {
    fn new(tree: &Tree, regions: usize) -> Self {
        // A node comes after its parts. Therefore visit the nodes from the last to the first, and the parts below each
        // node.
        let total = regions + tree.parts.len();
        let mut below = vec![false; total];
        for part in tree.parts.iter().flatten() {
            below[*part as usize] = true;
        }
        let (mut order, mut ranges) = (Vec::with_capacity(regions), vec![[0, 0]; total]);
        let mut stack: Vec<(u32, bool)> = Vec::new();
        for root in (0..total as u32).rev().filter(|&i| !below[i as usize]) {
            stack.push((root, false));
            while let Some((node, done)) = stack.pop() {
                let i = node as usize;
                if done {
                    ranges[i][1] = order.len();
                    continue;
                }
                ranges[i][0] = order.len();
                if i < regions {
                    order.push(node);
                    ranges[i][1] = order.len();
                } else {
                    stack.push((node, true));
                    let [p, q] = tree.parts[i - regions];
                    stack.push((q, false));
                    stack.push((p, false));
                }
            }
        }
        ranges.drain(..regions);
        Self { order, ranges }
    }

    fn get(&self, i: usize) -> &[u32] {
        let [from, to] = self.ranges[i];
        &self.order[from..to]
    }
}

/// The candidates found, without duplicates. A set is identified by the sum of the random keys (128 bits) of its
/// regions.
struct Found {
    keys: Vec<u128>,
    seen: HashMap<u128, usize>,
    out: Candidates,
}

impl Found {
    fn add(&mut self, set: &[u32], seam: f64) -> Result<()> {
        let key = set
            .iter()
            .fold(0u128, |key, &i| key.wrapping_add(self.keys[i as usize]));
        let next = self.out.seam.len();
        let at = *self.seen.entry(key).or_insert(next);
        if at < next {
            self.out.seam[at] = self.out.seam[at].max(seam);
            return Ok(());
        }
        let mut sorted = set.to_vec();
        sorted.sort_unstable();
        self.out.sets.push(&sorted)?;
        self.out.seam.push(seam);
        Ok(())
    }
}

/// Search for regions that a node encloses.
struct Holes<'a> {
    area: &'a [f64],
    near: &'a [Vec<u32>],
    open: &'a [bool],
    /// Number of the last search that found a region inside the node, or next to it.
    inside: Vec<u32>,
    beside: Vec<u32>,
    group: Vec<u32>,
    search: u32,
    groups: u32,
}

impl<'a> Holes<'a> {
    fn new(graph: &Graph<'a>, near: &'a [Vec<u32>], open: &'a [bool]) -> Self {
        let none = || vec![0; graph.len()];
        Self {
            area: graph.area,
            near,
            open,
            inside: none(),
            beside: none(),
            group: none(),
            search: 0,
            groups: 0,
        }
    }

    /// Returns a node with its holes and the area of both, or `None` if it has no holes of at most
    /// `limit` pixels each.
    fn fill(&mut self, node: &[u32], limit: f64) -> Option<(Vec<u32>, f64)> {
        self.search += 1;
        for &i in node {
            self.inside[i as usize] = self.search;
        }
        let mut filled: Vec<u32> = Vec::new();
        let (mut stack, mut group) = (Vec::new(), Vec::new());
        for &i in node {
            for &start in &self.near[i as usize] {
                let s = start as usize;
                if self.inside[s] == self.search || self.beside[s] == self.search {
                    continue;
                }
                self.groups += 1;
                stack.clear();
                group.clear();
                stack.push(start);
                self.group[s] = self.groups;
                let (mut total, mut closed) = (0.0, true);
                while let Some(r) = stack.pop() {
                    let r = r as usize;
                    group.push(r as u32);
                    total += self.area[r];
                    if self.open[r] || total > limit || self.beside[r] == self.search {
                        closed = false;
                        break;
                    }
                    for &q in &self.near[r] {
                        let k = q as usize;
                        if self.inside[k] != self.search && self.group[k] != self.groups {
                            self.group[k] = self.groups;
                            stack.push(q);
                        }
                    }
                }
                for &r in group.iter().chain(&stack) {
                    self.beside[r as usize] = self.search;
                }
                if closed {
                    filled.extend(&group);
                }
            }
        }
        if filled.is_empty() {
            return None;
        }
        filled.extend(node);
        let area = filled.iter().map(|&i| self.area[i as usize]).sum();
        Some((filled, area))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ring of regions 1 to 4 around region 0, in region 5.
    const PAIRS: [[u32; 2]; 12] = [
        [0, 1],
        [0, 2],
        [0, 3],
        [0, 4],
        [1, 2],
        [2, 3],
        [3, 4],
        [1, 4],
        [1, 5],
        [2, 5],
        [3, 5],
        [4, 5],
    ];

    #[test]
    fn a_ring_is_found_with_and_without_its_hole() {
        let mut arcs = [[1.0, 1.0]; 12];
        for arc in &mut arcs[4..8] {
            arc[1] = 0.1;
        }
        let area = [4.0, 5.0, 5.0, 5.0, 5.0, 100.0];
        let graph = Graph {
            area: &area,
            mean: &[[0.0; 3]; 6],
            pairs: &PAIRS,
            arcs: &arcs,
        };
        let costs = [Cost {
            arcs: 1.0,
            means: 0.0,
            small: 0.0,
        }];
        let open = [false, false, false, false, false, true];
        let found = candidates(&graph, &costs, &open, [4.0, 50.0], &Monitor::default()).unwrap();
        let sets: Vec<&[u32]> = (0..found.sets.len()).map(|i| found.sets.get(i)).collect();
        assert!(sets.contains(&&[1, 2, 3, 4][..]) && sets.contains(&&[0, 1, 2, 3, 4][..]));
        assert!(!sets.iter().any(|s| s.contains(&5)));
        for (i, set) in sets.iter().enumerate() {
            assert!(!sets[..i].contains(set));
        }
    }

    #[test]
    fn bad_graphs_are_errors() {
        let graph = Graph {
            area: &[1.0],
            mean: &[[0.0; 3]],
            pairs: &[[0, 0]],
            arcs: &[[1.0, 1.0]],
        };
        assert!(candidates(&graph, &[], &[true], [0.0, 1.0], &Monitor::default()).is_err());
        let graph = Graph {
            pairs: &[],
            arcs: &[],
            ..graph
        };
        assert!(candidates(&graph, &[], &[], [0.0, 1.0], &Monitor::default()).is_err());
        let one = |graph: &Graph<'_>, weight: f64, most: f64| {
            let costs = [Cost {
                arcs: weight,
                means: 0.0,
                small: 0.0,
            }];
            candidates(graph, &costs, &[true], [0.0, most], &Monitor::default())
        };
        assert!(one(&graph, 1.0, f64::INFINITY).is_ok());
        assert!(one(&graph, f64::NAN, 1.0).is_err() && one(&graph, 1.0, f64::NAN).is_err());
        for area in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let area = &[area];
            assert!(one(&Graph { area, ..graph }, 1.0, 1.0).is_err());
        }
        assert_eq!(
            candidates(&graph, &[], &[true], [0.0, 1.0], &Monitor::default())
                .unwrap()
                .sets
                .len(),
            1
        );
    }
}
