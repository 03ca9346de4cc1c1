//! Pairs of neighbouring points of a window, row by row.

use super::view::Tie;
use crate::foundation::grid::Grid;

/// Pairs of neighbours along an axis: `p` and `q`, and the next `n - 1` pairs of their rows.
#[derive(Clone, Copy)]
pub(super) struct Run {
    pub axis: usize,
    pub p: usize,
    pub q: usize,
    pub n: usize,
}

/// Calls `f` with the pairs of each row, along each axis.
pub(super) fn runs<const D: usize>(grid: &Grid<D>, mut f: impl FnMut(Run)) {
    let (shape, strides) = (grid.shape(), grid.strides());
    let n = shape[D - 1];
    for p in (0..grid.len()).step_by(n) {
        let point = grid.point(p);
        for axis in 0..D - 1 {
            if point[axis] + 1 < shape[axis] {
                let q = p + strides[axis];
                f(Run { axis, p, q, n });
            }
        }
        f(Run {
            axis: D - 1,
            p,
            q: p + 1,
            n: n - 1,
        });
    }
}

/// Marks the points that have a choice, and the points next to a point with a different tie.
pub(super) fn judged<const D: usize>(grid: &Grid<D>, ties: &[Tie]) -> Vec<bool> {
    let mut judged: Vec<bool> = ties.iter().map(|&t| t == Tie::Either).collect();
    runs(grid, |Run { p, q, n, .. }| {
        for k in 0..n {
            let differ = ties[p + k] != ties[q + k];
            judged[p + k] |= differ;
            judged[q + k] |= differ;
        }
    });
    judged
}

/// Returns a mask that is extended by one point along each axis.
pub(super) fn widen<const D: usize>(grid: &Grid<D>, mask: &[bool]) -> Vec<bool> {
    let mut wide = mask.to_vec();
    runs(grid, |Run { p, q, n, .. }| {
        for k in 0..n {
            wide[p + k] |= mask[q + k];
            wide[q + k] |= mask[p + k];
        }
    });
    wide
}
