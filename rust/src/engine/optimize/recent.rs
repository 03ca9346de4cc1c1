//! Recent changes. Only points near a change are corrected again. Elsewhere a window is nearly the same as at the last
//! correction, so another search would find the same match. A change next to a point often changes its match, but a
//! distant change rarely does.

use super::CHUNK;
use crate::foundation::fixed::Place;
use crate::foundation::grid::Grid;
use crate::foundation::par;

/// Flags of the points near a change in one of the last two passes, which together correct both colours of the
/// chessboard.
pub(super) struct Recent {
    radius: usize,
    /// For each point, one bit for each of the last two passes, set if the pass changed the point. The lowest bit is
    /// the latest pass.
    changed: Vec<u8>,
    /// Not zero at points near a change. Empty until two passes are complete.
    near: Vec<u8>,
}

impl Recent {
    /// Creates flags without changes.
    pub(super) fn new(points: usize, radius: usize) -> Self {
        Self {
            radius,
            changed: vec![0; points],
            near: Vec::new(),
        }
    }

    /// Returns whether there is a change near a point.
    #[inline(always)]
    pub(super) fn near(&self, p: usize) -> bool {
        self.near.is_empty() || self.near[p] != 0
    }

    /// Records the changes of a pass, and returns their number.
    pub(super) fn note<const D: usize>(
        &mut self,
        before: &[Place<D>],
        after: &[Place<D>],
    ) -> usize {
        par::chunks_mut(&mut self.changed, CHUNK, |c, changed| {
            let first = c * CHUNK;
            for (i, bits) in changed.iter_mut().enumerate() {
                let moved = before[first + i] != after[first + i];
                *bits = (*bits << 1 | u8::from(moved)) & 3;
            }
        });
        let count = |c: usize| {
            let chunk = &self.changed[c * CHUNK..before.len().min((c + 1) * CHUNK)];
            chunk
                .iter()
                .map(|&bits| usize::from(bits & 1))
                .sum::<usize>()
        };
        par::map(before.len().div_ceil(CHUNK), count)
            .into_iter()
            .sum()
    }

    /// Marks all points in a box around each change, one axis after another.
    pub(super) fn spread<const D: usize>(&mut self, grid: &Grid<D>) {
        let row = grid.shape()[D - 1];
        let mut from = self.changed.clone();
        self.near.resize(from.len(), 0);
        for axis in 0..D {
            let across = grid.strides()[axis] / row;
            par::chunks_mut(&mut self.near, row, |r, to| {
                if axis == D - 1 {
                    along(&from[r * row..][..row], to, self.radius, grid.wrap()[axis]);
                    return;
                }
                to.fill(0);
                let at = (r / across % grid.shape()[axis]) as isize;
                for away in -(self.radius as isize)..=self.radius as isize {
                    if let Some(there) = grid.inside(axis, at + away) {
                        let other = (r as isize + (there as isize - at) * across as isize) as usize;
                        join(to, &from[other * row..][..row]);
                    }
                }
            });
            std::mem::swap(&mut from, &mut self.near);
        }
        std::mem::swap(&mut from, &mut self.near);
    }
}

/// Sets the bits of `from` in `to`.
fn join(to: &mut [u8], from: &[u8]) {
    for (to, &from) in to.iter_mut().zip(from) {
        *to |= from;
    }
}

/// Spreads the bits along a row.
fn along(from: &[u8], to: &mut [u8], radius: usize, wrap: bool) {
    let n = from.len();
    to.copy_from_slice(from);
    for away in 1..=radius {
        let turn = away % n;
        if away < n {
            join(&mut to[away..], &from[..n - away]);
            join(&mut to[..n - away], &from[away..]);
        }
        if wrap {
            join(&mut to[..turn], &from[n - turn..]);
            join(&mut to[n - turn..], &from[..turn]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn near_is_what_a_box_around_a_change_holds(
            shape in prop::array::uniform3(1usize..8),
            wrap in prop::array::uniform3(any::<bool>()),
            radius in 0usize..4,
            seed in 0usize..1000,
        ) {
            let grid = Grid::new(shape, wrap).unwrap();
            let changed = seed % grid.len();
            let before = vec![[0; 3]; grid.len()];
            let mut after = before.clone();
            after[changed] = [1; 3];
            let mut recent = Recent::new(grid.len(), radius);
            prop_assert_eq!(recent.note(&before, &after), 1);
            prop_assert!((0..grid.len()).all(|p| recent.near(p)));
            prop_assert_eq!(recent.note(&after, &after), 0);
            recent.spread(&grid);
            let at = grid.point(changed);
            for p in 0..grid.len() {
                let point = grid.point(p);
                let near = (0..3).all(|a| {
                    let d = point[a].abs_diff(at[a]);
                    d <= radius || wrap[a] && shape[a] - d <= radius
                });
                prop_assert_eq!(recent.near(p), near);
            }
            recent.note(&after, &after);
            recent.spread(&grid);
            prop_assert!((0..grid.len()).all(|p| !recent.near(p)));
        }
    }
}
