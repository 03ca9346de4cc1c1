//! Two images on one canvas: where each covers it, what is tied to which, and where both meet.

use super::cost::{Cost, check_costs};
use super::planar::ring::Side;
use crate::foundation::error::check_shape;
use crate::foundation::grid::Grid;
use crate::{Error, Result};

/// Seams that A already contains. Entries belong to the pair of a point and the next one along the axis.
#[derive(Debug, Clone, Copy)]
pub struct OldSeams<'a, const D: usize> {
    /// Cost of the seam that is there, paid where both points keep A; 0 where there is none.
    pub kept: [&'a [f32]; D],
    /// Cost where the first point keeps A and the next takes B: the first one's old source against B.
    pub ab: [&'a [f32]; D],
    /// Cost where the first point takes B and the next keeps A.
    pub ba: [&'a [f32]; D],
}

/// What is to be stitched. Arrays are in row-major order over `grid`, images with their channels last.
#[derive(Debug, Clone, Copy)]
pub struct Overlap<'a, const D: usize> {
    /// The canvas, and which of its axes are cyclic.
    pub grid: Grid<D>,
    /// Channels of both images.
    pub channels: usize,
    /// The image that is there. Values where it does not cover the canvas are never read.
    pub a: &'a [f32],
    /// The image that is added.
    pub b: &'a [f32],
    /// Where A covers the canvas.
    pub mask_a: &'a [bool],
    /// Where B covers the canvas.
    pub mask_b: &'a [bool],
    /// Pixels of the overlap that must keep A.
    pub core_a: Option<&'a [bool]>,
    /// Pixels of the overlap that must take B.
    pub core_b: Option<&'a [bool]>,
    /// Costs of edges are multiplied by one plus the mean of this at their ends.
    pub penalty: Option<&'a [f32]>,
    /// Seams that A already contains; they bear the penalty too.
    pub old: Option<OldSeams<'a, D>>,
    /// How visible a seam is.
    pub cost: Cost,
}

impl<'a, const D: usize> Overlap<'a, D> {
    /// An overlap without cores, penalty or old seams, at the gradient cost.
    pub fn new(
        grid: Grid<D>,
        channels: usize,
        a: &'a [f32],
        b: &'a [f32],
        mask_a: &'a [bool],
        mask_b: &'a [bool],
    ) -> Self {
        Self {
            grid,
            channels,
            a,
            b,
            mask_a,
            mask_b,
            core_a: None,
            core_b: None,
            penalty: None,
            old: None,
            cost: Cost::Gradient,
        }
    }

    /// Arrays that do not fit the grid, and what cannot be: see [`super::stitch::Stitcher::cut`].
    pub(super) fn check(&self) -> Result<()> {
        let n = self.grid.len();
        if n > i32::MAX as usize {
            return Err(Error::Limit {
                what: "a canvas to stitch on".into(),
                needed: format!("{n} pixels"),
                limit: format!("{} pixels", i32::MAX),
            });
        }
        let samples = n.saturating_mul(self.channels);
        check_shape("a", &[samples], self.a.len())?;
        check_shape("b", &[samples], self.b.len())?;
        check_shape("mask_a", &[n], self.mask_a.len())?;
        check_shape("mask_b", &[n], self.mask_b.len())?;
        for (argument, core, mask) in [
            ("core_a", self.core_a, self.mask_a),
            ("core_b", self.core_b, self.mask_b),
        ] {
            if let Some(core) = core {
                check_shape(argument, &[n], core.len())?;
                if let Some(at) = (0..n).find(|&i| core[i] && !mask[i]) {
                    return Err(Error::value(
                        argument,
                        format!(
                            "holds {:?}, which its image does not cover",
                            self.grid.point(at)
                        ),
                    ));
                }
            }
        }
        if let (Some(core_a), Some(core_b)) = (self.core_a, self.core_b)
            && let Some(at) = (0..n).find(|&i| core_a[i] && core_b[i])
        {
            return Err(Error::value(
                "core_a, core_b",
                format!(
                    "both hold {:?}; a pixel can be tied to one image only",
                    self.grid.point(at)
                ),
            ));
        }
        if let Some(penalty) = self.penalty {
            check_shape("penalty", &[n], penalty.len())?;
            check_costs("penalty", penalty)?;
        }
        if let Some(old) = self.old {
            for costs in old.kept.iter().chain(&old.ab).chain(&old.ba) {
                check_shape("old", &[n], costs.len())?;
                check_costs("old", costs)?;
            }
        }
        Ok(())
    }

    /// Where a pixel must be: outside it keeps A, inside it takes B.
    pub(super) fn tie(&self, at: usize) -> Side {
        match (self.mask_a[at], self.mask_b[at]) {
            (true, true) => {}
            (true, false) => return Side::Outside,
            (false, true) => return Side::Inside,
            (false, false) => return Side::Free,
        }
        if self.core_b.is_some_and(|core| core[at]) {
            return Side::Inside;
        }
        if self.core_a.is_some_and(|core| core[at]) {
            return Side::Outside;
        }
        let point = self.grid.point(at);
        let mut found = Side::Free;
        for axis in 0..D {
            for step in [-1, 1] {
                let mut beside = point;
                let Some(i) = self.grid.inside(axis, point[axis] as isize + step) else {
                    continue;
                };
                beside[axis] = i;
                let beside = self.grid.index(beside);
                match (self.mask_a[beside], self.mask_b[beside]) {
                    (true, false) => return Side::Outside,
                    (false, true) => found = Side::Inside,
                    _ => {}
                }
            }
        }
        found
    }

    /// The part of the canvas that both images cover some of; none where they do not meet.
    pub(super) fn window(&self) -> Result<Option<Window<D>>> {
        let (shape, wrap) = (self.grid.shape(), self.grid.wrap());
        let (mut low, mut high) = ([usize::MAX; D], [0; D]);
        let row = shape[D - 1];
        for (r, (a, b)) in self
            .mask_a
            .chunks_exact(row)
            .zip(self.mask_b.chunks_exact(row))
            .enumerate()
        {
            let both = |i: &usize| a[*i] && b[*i];
            if let Some(first) = (0..row).find(both) {
                let last = (0..row).rfind(both).unwrap_or(first);
                let mut point = self.grid.point(r * row);
                for end in [first, last] {
                    point[D - 1] = end;
                    for axis in 0..D {
                        low[axis] = low[axis].min(point[axis]);
                        high[axis] = high[axis].max(point[axis] + 1);
                    }
                }
            }
        }
        if low[0] == usize::MAX {
            return Ok(None);
        }
        let whole: [bool; D] =
            std::array::from_fn(|axis| wrap[axis] && low[axis] == 0 && high[axis] == shape[axis]);
        let grid = Grid::new(std::array::from_fn(|axis| high[axis] - low[axis]), whole)?;
        Ok(Some(Window { grid, from: low }))
    }
}

/// The part of the canvas that the overlap lies in. A cyclic axis along which it meets both ends is taken whole.
pub(super) struct Window<const D: usize> {
    pub(super) grid: Grid<D>,
    from: [usize; D],
}

impl<const D: usize> Window<D> {
    /// The index on the canvas of a point of the window.
    pub(super) fn canvas(&self, i: usize, grid: &Grid<D>) -> u32 {
        let mut point = self.grid.point(i);
        for (p, from) in point.iter_mut().zip(self.from) {
            *p += from;
        }
        grid.index(point) as u32
    }
}
