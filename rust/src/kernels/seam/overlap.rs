//! Two images on one canvas: their coverage, their cores, and the window that contains their
//! overlap.

use super::cost::{Cost, check_costs};
use super::planar::ring::Side;
use crate::foundation::error::check_shape;
use crate::foundation::grid::Grid;
use crate::{Error, Result};

/// Existing seams of A. Entries belong to the pair of a point and the next one along the axis.
#[derive(Debug, Clone, Copy)]
pub struct OldSeams<'a, const D: usize> {
    /// Cost of the existing seam, paid if both points keep A. Zero without a seam.
    pub kept: [&'a [f32]; D],
    /// Cost of a seam between the first point's old source and B. It is paid if the first point keeps A and the next
    /// takes B.
    pub ab: [&'a [f32]; D],
    /// Cost if the first point takes B and the next keeps A.
    pub ba: [&'a [f32]; D],
}

/// Two images to stitch. Arrays are in row-major order over `grid`, images with their channels
/// last.
#[derive(Debug, Clone, Copy)]
pub struct Overlap<'a, const D: usize> {
    /// Shape and wrapped axes of the canvas.
    pub grid: Grid<D>,
    /// Number of channels of both images.
    pub channels: usize,
    /// The existing image. Values outside `mask_a` are never read.
    pub a: &'a [f32],
    /// The added image.
    pub b: &'a [f32],
    /// Flags of the pixels that A covers.
    pub mask_a: &'a [bool],
    /// Flags of the pixels that B covers.
    pub mask_b: &'a [bool],
    /// Flags of the overlap pixels that must keep A.
    pub core_a: Option<&'a [bool]>,
    /// Flags of the overlap pixels that must take B.
    pub core_b: Option<&'a [bool]>,
    /// Penalty of each pixel. The cost of an edge is multiplied by 1 plus the mean penalty of its
    /// ends.
    pub penalty: Option<&'a [f32]>,
    /// Existing seams of A. The penalty applies to them too.
    pub old: Option<OldSeams<'a, D>>,
    /// Cost of a seam.
    pub cost: Cost,
}

impl<'a, const D: usize> Overlap<'a, D> {
    /// Returns an overlap without cores, penalty or old seams, with the gradient cost.
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

    /// Checks shapes, cores, penalty and old seams. The errors are described at
    /// [`super::stitch::Stitcher::cut`].
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
        // Cores must be inside their masks and disjoint.
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
                            "must be inside the mask of its image, got {:?}",
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
                format!("must not overlap, got {:?} in both", self.grid.point(at)),
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

    /// Returns the side of a pixel: outside pixels keep A, inside pixels take B.
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
        // A pixel next to a pixel that only one image covers is tied to this image. A has priority.
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

    /// Returns the bounding window of the overlap, or `None` if the images do not overlap.
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
        // An axis that wraps is kept only if the overlap reaches both of its ends.
        if low[0] == usize::MAX {
            return Ok(None);
        }
        let whole: [bool; D] =
            std::array::from_fn(|axis| wrap[axis] && low[axis] == 0 && high[axis] == shape[axis]);
        let grid = Grid::new(std::array::from_fn(|axis| high[axis] - low[axis]), whole)?;
        Ok(Some(Window { grid, from: low }))
    }
}

/// The part of the canvas that contains the overlap. A wrapped axis is kept whole if the overlap
/// reaches both of its ends.
pub(super) struct Window<const D: usize> {
    pub(super) grid: Grid<D>,
    from: [usize; D],
}

impl<const D: usize> Window<D> {
    /// Returns the index on the canvas of a point of the window.
    pub(super) fn canvas(&self, i: usize, grid: &Grid<D>) -> u32 {
        let mut point = self.grid.point(i);
        for (p, from) in point.iter_mut().zip(self.from) {
            *p += from;
        }
        grid.index(point) as u32
    }
}
