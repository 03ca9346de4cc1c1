//! A frame field integrated over a window: the map whose derivatives are nearest to the frames, by least squares.

use super::canvas::Window;
use crate::foundation::fixed::{Frame, ONE};
use crate::foundation::grid::Grid;

/// Number of intervals along an axis of the coarse lattice that a bent chart is integrated on.
const NODES: usize = 16;
/// Maximum number of steps of conjugate gradients, which converge much earlier.
const STEPS: usize = 60;

/// A coarse lattice over a window, with the frames at its nodes.
pub(super) struct Mesh<const D: usize> {
    grid: Grid<D>,
    spacing: [f64; D],
    frames: Vec<Frame<D>>,
}

impl<const D: usize> Mesh<D> {
    pub(super) fn new(window: &Window<D>, frames: &[Frame<D>]) -> Self {
        let shape = window.grid.shape();
        let nodes = shape.map(|n| n.clamp(1, NODES + 1));
        let spacing = std::array::from_fn(|a| (shape[a] - 1) as f64 / (nodes[a].max(2) - 1) as f64);
        // The lattice is not empty because the window is not.
        let grid = Grid::new(nodes, [false; D]).unwrap_or(window.grid);
        let mut at = Vec::with_capacity(grid.len());
        for i in 0..grid.len() {
            let node = grid.point(i);
            let near: [usize; D] =
                std::array::from_fn(|a| (node[a] as f64 * spacing[a]).round() as usize);
            at.push(frames[window.points[window.grid.index(near)] as usize]);
        }
        Self {
            grid,
            spacing,
            frames: at,
        }
    }

    /// Returns the potential of one row of the frames by least squares: conjugate gradients on the normal equations.
    pub(super) fn integrate(&self, row: usize) -> Vec<f64> {
        let (n, strides) = (self.grid.len(), self.grid.strides());
        let edges = |f: &mut dyn FnMut(usize, usize, usize)| {
            for i in 0..n {
                let point = self.grid.point(i);
                for axis in 0..D {
                    if point[axis] + 1 < self.grid.shape()[axis] {
                        f(axis, i, i + strides[axis]);
                    }
                }
            }
        };
        // The wanted difference of the potential between two nodes follows from the mean of their frames.
        let slope = |axis: usize, i: usize, j: usize| {
            let both = f64::from(self.frames[i][row][axis]) + f64::from(self.frames[j][row][axis]);
            both * 0.5 / f64::from(ONE) * self.spacing[axis]
        };
        let weight = |axis: usize| 1.0 / (self.spacing[axis] * self.spacing[axis]).max(1e-9);
        let apply = |x: &[f64], out: &mut [f64]| {
            out.fill(0.0);
            edges(&mut |axis, i, j| {
                let d = (x[j] - x[i]) * weight(axis);
                out[j] += d;
                out[i] -= d;
            });
        };
        // Start from the frame in the middle, which is close to the solution.
        let middle = &self.frames[self.grid.index(self.grid.shape().map(|s| s / 2))][row];
        let mut x: Vec<f64> = (0..n)
            .map(|i| {
                let p = self.grid.point(i);
                (0..D)
                    .map(|a| f64::from(middle[a]) / f64::from(ONE) * p[a] as f64 * self.spacing[a])
                    .sum()
            })
            .collect();
        let (mut residual, mut image) = (vec![0.0; n], vec![0.0; n]);
        apply(&x, &mut image);
        // The residual is the right-hand side minus the operator applied to the start.
        edges(&mut |axis, i, j| {
            let d = slope(axis, i, j) * weight(axis);
            residual[j] += d;
            residual[i] -= d;
        });
        residual.iter_mut().zip(&image).for_each(|(r, a)| *r -= a);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let mut direction = residual.clone();
        let mut norm = dot(&residual, &residual);
        // Iterate conjugate gradients until the residual is negligible.
        for _ in 0..STEPS {
            if norm < 1e-8 {
                break;
            }
            apply(&direction, &mut image);
            let length = norm / dot(&direction, &image).max(1e-300);
            for i in 0..n {
                x[i] += length * direction[i];
                residual[i] -= length * image[i];
            }
            let new = dot(&residual, &residual);
            let keep = new / norm;
            norm = new;
            for i in 0..n {
                direction[i] = residual[i] + keep * direction[i];
            }
        }
        x
    }

    /// Returns a potential at a point of the window, interpolated between nodes.
    pub(super) fn at(&self, potential: &[f64], point: [f64; D]) -> f64 {
        let shape = self.grid.shape();
        let (mut first, mut part) = ([0; D], [0.0; D]);
        for axis in 0..D {
            if shape[axis] < 2 {
                continue;
            }
            let x = point[axis] / self.spacing[axis].max(1e-9);
            first[axis] = (x as usize).min(shape[axis] - 2);
            part[axis] = x - first[axis] as f64;
        }
        let mut sum = 0.0;
        // Sum over the corners of the cell. An axis with a single node has only the first corner.
        for corner in 0..1usize << D {
            let (mut node, mut w) = (first, 1.0);
            for axis in 0..D {
                let side = corner >> axis & 1;
                if shape[axis] < 2 {
                    w *= (1 - side) as f64;
                } else {
                    node[axis] += side;
                    w *= if side == 1 {
                        part[axis]
                    } else {
                        1.0 - part[axis]
                    };
                }
            }
            if w != 0.0 {
                sum += w * potential[self.grid.index(node)];
            }
        }
        sum
    }
}
