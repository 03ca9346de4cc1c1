//! Merge trees of a region adjacency graph: the cheapest pair of neighbours is merged first.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BinaryHeap};

use super::Graph;
use crate::Result;
use crate::foundation::libm::pow;
use crate::foundation::par::Monitor;

/// Cost of merging two regions: the mean strength along their border and the distance of their mean values, each with
/// a weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Weight of the mean strength.
    pub arcs: f64,
    /// Weight of the distance of the mean values.
    pub means: f64,
    /// Area in pixels below which a region is cheaper to merge, or 0.
    pub small: f64,
}

/// Exponent of the area of the smaller region in a cost. A ten times smaller area reduces the cost by 30 %.
const POWER: f64 = 0.15;

/// A merge tree. Nodes below the number of regions are the regions. Each later node has two parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    /// The two parts of each later node.
    pub parts: Vec<[u32; 2]>,
    /// Mean strength of the border between the two parts. It is reduced if one of them is small.
    pub seam: Vec<f64>,
    /// Number of pixels of each node, regions first.
    pub area: Vec<f64>,
}

/// A possible merge.
struct Offer {
    cost: f64,
    pair: [u32; 2],
}

impl PartialEq for Offer {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Offer {}
impl PartialOrd for Offer {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Offer {
    /// The cheapest offer is the greatest, so that the heap returns it first. Ties go to the lowest indices.
    fn cmp(&self, other: &Self) -> Ordering {
        other
            .cost
            .total_cmp(&self.cost)
            .then_with(|| other.pair.cmp(&self.pair))
    }
}

/// Returns the merge trees of a graph. Nodes of more than `most` pixels absorb their neighbours in the
/// same order, but are not part of a tree.
///
/// # Errors
/// The monitor was cancelled.
pub fn merge(graph: &Graph<'_>, cost: Cost, most: f64, monitor: &Monitor) -> Result<Tree> {
    let n = graph.len();
    let mut tree = Tree {
        parts: Vec::new(),
        seam: Vec::new(),
        area: graph.area.to_vec(),
    };
    let mut mean = graph.mean.to_vec();
    let mut near: Vec<BTreeMap<u32, [f64; 2]>> = vec![BTreeMap::new(); n];
    for (&[p, q], &arc) in graph.pairs.iter().zip(graph.arcs) {
        near[p as usize].insert(q, arc);
        near[q as usize].insert(p, arc);
    }
    let price = |arc: [f64; 2], area: [f64; 2], mean: [[f64; 3]; 2]| {
        let mut value = cost.arcs * arc[1] / arc[0].max(1.0);
        if cost.means != 0.0 {
            let square: f64 = (0..3)
                .map(|i| (mean[0][i] - mean[1][i]) * (mean[0][i] - mean[1][i]))
                .sum();
            value += cost.means * square.sqrt();
        }
        if cost.small > 0.0 {
            value *= pow(area[0].min(area[1]) / cost.small, POWER);
        }
        value
    };
    let offers = graph.pairs.len();
    let mut queue: BinaryHeap<Offer> = BinaryHeap::with_capacity(3 * offers);
    for (&[p, q], &arc) in graph.pairs.iter().zip(graph.arcs) {
        let (i, j) = (p as usize, q as usize);
        let cost = price(arc, [tree.area[i], tree.area[j]], [mean[i], mean[j]]);
        queue.push(Offer { cost, pair: [p, q] });
    }
    let mut gone = vec![false; n];
    while let Some(Offer { pair: [p, q], .. }) = queue.pop() {
        let (i, j) = (p as usize, q as usize);
        if gone[i] || gone[j] {
            continue;
        }
        monitor.check()?;
        // At most one offer for each pair of the graph is useful. Remove the others, which would need quadratic memory
        // if a region has many neighbours.
        if queue.len() > 2 * offers {
            queue.retain(|offer| offer.pair.iter().all(|&p| !gone[p as usize]));
        }
        let area = [tree.area[i], tree.area[j]];
        let total = area[0] + area[1];
        let large = [area[0] > most, area[1] > most];
        if large[0] || large[1] {
            // The larger part keeps its index. Its mean hardly changes, so only the offers of the
            // other part's neighbours are new.
            let (kept, lost) = if area[0] >= area[1] { (p, q) } else { (q, p) };
            let (k, l) = (kept as usize, lost as usize);
            let share = tree.area[l] / total;
            let other = mean[l];
            mean[k]
                .iter_mut()
                .zip(other)
                .for_each(|(m, o)| *m += share * (o - *m));
            tree.area[k] = total;
            gone[l] = true;
            for (r, arc) in std::mem::take(&mut near[l]) {
                let i = r as usize;
                near[i].remove(&lost);
                if r == kept {
                    continue;
                }
                let entry = near[k].entry(r).or_insert([0.0; 2]);
                *entry = [entry[0] + arc[0], entry[1] + arc[1]];
                let arc = *entry;
                near[i].insert(kept, arc);
                let cost = price(arc, [total, tree.area[i]], [mean[k], mean[i]]);
                queue.push(Offer {
                    cost,
                    pair: [r, kept],
                });
            }
            continue;
        }
        let new = near.len() as u32;
        let arc = near[i].get(&q).copied().unwrap_or([1.0, 0.0]);
        tree.parts.push([p, q]);
        tree.seam
            .push(arc[1] / arc[0].max(1.0) * (3.0 * area[0].min(area[1]) / total).min(1.0));
        tree.area.push(total);
        mean.push(std::array::from_fn(|k| {
            (mean[i][k] * area[0] + mean[j][k] * area[1]) / total
        }));
        gone[i] = true;
        gone[j] = true;
        gone.push(false);
        // Join the neighbours of both parts.
        let (first, second) = (std::mem::take(&mut near[i]), std::mem::take(&mut near[j]));
        let mut joined = first;
        joined.remove(&q);
        for (r, arc) in second {
            if r != p {
                let entry = joined.entry(r).or_insert([0.0; 2]);
                *entry = [entry[0] + arc[0], entry[1] + arc[1]];
            }
        }
        for (&r, &arc) in &joined {
            let other = &mut near[r as usize];
            other.remove(&p);
            other.remove(&q);
            other.insert(new, arc);
            let k = r as usize;
            let cost = price(arc, [total, tree.area[k]], [mean[new as usize], mean[k]]);
            queue.push(Offer {
                cost,
                pair: [r, new],
            });
        }
        near.push(joined);
    }
    Ok(tree)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weakest_border_goes_first() {
        let graph = Graph {
            area: &[10.0, 10.0, 20.0],
            mean: &[[0.0; 3]; 3],
            pairs: &[[0, 1], [1, 2]],
            arcs: &[[4.0, 4.0], [4.0, 2.0]],
        };
        let tree = merge(
            &graph,
            Cost {
                arcs: 1.0,
                means: 0.0,
                small: 0.0,
            },
            100.0,
            &Monitor::default(),
        )
        .unwrap();
        assert_eq!(tree.parts, [[1, 2], [0, 3]]);
        assert_eq!(tree.area[3..], [30.0, 40.0]);
        assert_eq!(tree.seam[0], 0.5);
    }

    #[test]
    fn large_nodes_absorb_their_neighbours() {
        let graph = Graph {
            area: &[10.0, 10.0, 20.0, 5.0],
            mean: &[[0.0; 3]; 4],
            pairs: &[[0, 1], [1, 2], [0, 3]],
            arcs: &[[4.0, 4.0], [4.0, 2.0], [1.0, 3.0]],
        };
        let tree = merge(
            &graph,
            Cost {
                arcs: 1.0,
                means: 0.0,
                small: 0.0,
            },
            25.0,
            &Monitor::default(),
        )
        .unwrap();
        assert_eq!(tree.parts, [[1, 2]]);
    }

    #[test]
    fn parts_that_do_not_touch_stay_apart() {
        let graph = Graph {
            area: &[1.0; 3],
            mean: &[[0.0; 3]; 3],
            pairs: &[[0, 2]],
            arcs: &[[1.0, 1.0]],
        };
        let tree = merge(
            &graph,
            Cost {
                arcs: 1.0,
                means: 1.0,
                small: 1.0,
            },
            9.0,
            &Monitor::default(),
        )
        .unwrap();
        assert_eq!(tree.parts, [[0, 2]]);
    }

    #[test]
    fn a_region_with_many_neighbours_is_merged_with_all_of_them() {
        // Each merge changes the costs of all neighbours that are left, so old offers are removed many times.
        let n = 200;
        let pairs: Vec<[u32; 2]> = (1..n).map(|i| [0, i]).collect();
        let arcs: Vec<[f64; 2]> = (1..n).map(|i| [1.0, f64::from(i * 37 % n)]).collect();
        let graph = Graph {
            area: &vec![1.0; n as usize],
            mean: &vec![[0.0; 3]; n as usize],
            pairs: &pairs,
            arcs: &arcs,
        };
        let cost = Cost {
            arcs: 1.0,
            means: 0.0,
            small: 0.0,
        };
        let tree = merge(&graph, cost, 1e9, &Monitor::default()).unwrap();
        // The weakest borders go first.
        let order: Vec<u32> = tree.parts.iter().map(|&[p, q]| p.min(q) * 37 % n).collect();
        assert_eq!(order[1..], (2..n).collect::<Vec<u32>>());
        let stopped = Monitor::default();
        stopped.cancel();
        assert!(merge(&graph, cost, 1e9, &stopped).is_err());
    }
}
