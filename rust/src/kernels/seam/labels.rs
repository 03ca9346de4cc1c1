//! Binary labels of minimum energy on a grid.
//!
//! The energy has a cost for each label of each point, and one for each pair of neighbours with
//! different labels. See Greig, Porteous, Seheult, *Exact maximum a posteriori estimation for
//! binary images*, J. Royal Statistical Society B 1989.

use super::cost::{capacity, check_costs, finest};
use super::links;
use super::maxflow::{Graph, Solver};
use crate::foundation::error::check_shape;
use crate::foundation::grid::Grid;
use crate::foundation::memory;
use crate::foundation::par::Monitor;
use crate::{Error, Result};

/// Costs of labels.
#[derive(Debug, Clone, Copy)]
pub struct Energy<'a, const D: usize> {
    /// Shape and wrapped axes.
    pub grid: Grid<D>,
    /// Costs of false and of true at each point, which may be negative. One of them may be
    /// infinite, which forbids the label.
    pub unary: &'a [[f32; 2]],
    /// Cost if a point has label false and the next point along the axis has label true, at least 0. Entries without a
    /// next point are ignored.
    pub forward: [&'a [f32]; D],
    /// Cost if a point has label true and the next point along the axis has label false.
    pub backward: [&'a [f32]; D],
}

/// Labels of minimum energy.
#[derive(Debug, Clone, PartialEq)]
pub struct Labels {
    /// Label of each point. If several labellings have this energy, it is the labelling with the fewest true labels.
    pub labels: Vec<bool>,
    /// Sum of the costs of all points and pairs.
    pub energy: f64,
}

/// Returns the labels of minimum energy.
///
/// Costs are rounded to multiples of a power of two. The largest pairwise cost has more than 2^25
/// and at most 2^26 such steps.
///
/// # Errors
/// The sizes of the arrays do not match, or a pairwise cost is negative or not finite. A unary cost is NaN or minus
/// infinity, or forbids both labels.
pub fn least_energy<const D: usize>(energy: &Energy<'_, D>, monitor: &Monitor) -> Result<Labels> {
    let n = energy.grid.len();
    check_shape("unary", &[n], energy.unary.len())?;
    memory::room("the graph of the labels", n, 64 * D)?;
    let mut largest = 0.0f32;
    for costs in energy.forward.iter().chain(&energy.backward) {
        check_shape("pairwise", &[n], costs.len())?;
        largest = largest.max(check_costs("pairwise", costs)?);
    }
    // Both costs must be above minus infinity and one of them below infinity. NaN fails both
    // comparisons.
    let sound = |&[a, b]: &[f32; 2]| {
        (a > f32::NEG_INFINITY)
            & (b > f32::NEG_INFINITY)
            & ((a < f32::INFINITY) | (b < f32::INFINITY))
    };
    if let Some(at) = energy.unary.iter().position(|u| !sound(u)) {
        return Err(Error::value(
            "unary",
            format!(
                "must be finite, or infinite for one of the labels, got {:?} at {:?}",
                energy.unary[at],
                energy.grid.point(at)
            ),
        ));
    }
    // Without pairwise costs, scale by the largest unary difference.
    let difference = |u: &[f32; 2]| f64::from(u[1]) - f64::from(u[0]);
    let mut largest = f64::from(largest);
    if largest == 0.0 {
        let finite = energy.unary.iter().map(|u| difference(u).abs());
        largest = finite.filter(|d| d.is_finite()).fold(0.0, f64::max);
    }
    let scale = finest(largest);
    let rounded = |costs: &[f32]| -> Vec<i32> {
        costs
            .iter()
            .map(|&c| capacity(f64::from(c), scale))
            .collect()
    };
    let forward: [Vec<i32>; D] = energy.forward.map(rounded);
    let backward: [Vec<i32>; D] = energy.backward.map(rounded);
    // A unary difference that exceeds the sum of all pairwise costs of a point decides its label. Clip it there, so
    // that large and infinite costs forbid a label in the same way.
    let most = (2 * D) as f64 * f64::from(capacity(largest, scale)) + 1.0;
    let terminal: Vec<i32> = energy
        .unary
        .iter()
        .map(|u| {
            let steps = (difference(u) * scale).clamp(-most, most);
            // `f64::round` would be a function call unless the compiler's target is known to have a rounding
            // instruction.
            (steps + 0.5f64.copysign(steps)) as i32
        })
        .collect();
    let graph = Graph {
        grid: energy.grid,
        terminal: &terminal,
        forward: std::array::from_fn(|axis| &forward[axis][..]),
        backward: std::array::from_fn(|axis| &backward[axis][..]),
    };
    let labels = Solver::default().min_cut(&graph, monitor)?.sink;
    let energy = value(energy, &labels);
    Ok(Labels { labels, energy })
}

fn value<const D: usize>(energy: &Energy<'_, D>, labels: &[bool]) -> f64 {
    let mut sum = 0.0;
    for (unary, &label) in energy.unary.iter().zip(labels) {
        sum += f64::from(unary[usize::from(label)]);
    }
    for axis in 0..D {
        links(&energy.grid, axis, |p, q| {
            sum += f64::from(match (labels[p], labels[q]) {
                (false, true) => energy.forward[axis][p],
                (true, false) => energy.backward[axis][p],
                _ => 0.0,
            });
        });
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn costs(n: usize) -> impl Strategy<Value = Vec<f32>> {
        prop::collection::vec(0.0f32..1.0, n)
    }

    proptest! {
        #[test]
        fn no_labelling_is_cheaper(
            shape in prop::array::uniform2(1usize..4),
            wrap in any::<[bool; 2]>(),
            unary in prop::collection::vec(prop::array::uniform2(-2.0f32..2.0), 9),
            pairwise in costs(36),
            size in prop::sample::select(vec![1e-6f32, 1.0, 1e6]),
            smoothness in prop::sample::select(vec![0.0f32, 1.0]),
        ) {
            let grid = Grid::new(shape, wrap).unwrap();
            let n = grid.len();
            let unary: Vec<_> = unary[..n].iter().map(|u| u.map(|c| c * size)).collect();
            let pairwise: Vec<f32> = pairwise.iter().map(|c| c * size * smoothness).collect();
            let energy = Energy {
                grid,
                unary: &unary,
                forward: [&pairwise[..n], &pairwise[9..9 + n]],
                backward: [&pairwise[18..18 + n], &pairwise[27..27 + n]],
            };
            let found = least_energy(&energy, &Monitor::default()).unwrap();
            let least = (0..1u32 << n)
                .map(|bits| value(&energy, &(0..n).map(|i| bits >> i & 1 == 1).collect::<Vec<_>>()))
                .fold(f64::INFINITY, f64::min);
            prop_assert!((found.energy - least).abs() <= 1e-5 * f64::from(size));
        }
    }

    #[test]
    fn infinity_forbids_a_label() {
        let grid = Grid::new([1, 3], [false; 2]).unwrap();
        let unary = [[0.0, f32::INFINITY], [3.0, 0.0], [0.0, 1e30]];
        let smooth = [2.0; 3];
        fn energy<'a>(grid: Grid<2>, unary: &'a [[f32; 2]], smooth: &'a [f32]) -> Energy<'a, 2> {
            Energy {
                grid,
                unary,
                forward: [smooth; 2],
                backward: [smooth; 2],
            }
        }
        let found = least_energy(&energy(grid, &unary, &smooth), &Monitor::default()).unwrap();
        assert_eq!((found.labels, found.energy), (vec![false; 3], 3.0));
        for bad in [
            [f32::INFINITY; 2],
            [f32::NAN, 0.0],
            [0.0, f32::NEG_INFINITY],
        ] {
            let bad = [bad; 3];
            assert!(least_energy(&energy(grid, &bad, &smooth), &Monitor::default()).is_err());
        }
    }
}
