//! The windows of patches in a texture.

/// The extent of a patch along an axis, and its overlaps with earlier patches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// The first pixel.
    pub start: usize,
    /// Number of pixels.
    pub extent: usize,
    /// Overlap at the start, in pixels.
    pub before: usize,
    /// Overlap at the end, in pixels.
    pub after: usize,
}

/// The rows and columns that a patch covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window(pub [Span; 2]);

/// A box of a texture. It may cross the ends of periodic axes.
pub(super) struct Box2 {
    ends: [[i64; 2]; 2],
}

/// A window with a margin of one pixel, clipped where the texture ends.
pub(super) struct Around {
    pub bounds: Box2,
    /// Offset of the window in the bounds.
    pub inner: [usize; 2],
    /// Axes whose whole period the window spans, so that it is its own neighbour.
    closed: [bool; 2],
}

impl Box2 {
    /// Returns the number of rows and columns.
    pub(super) fn shape(&self) -> [usize; 2] {
        self.ends.map(|[low, high]| (high - low) as usize)
    }

    /// Returns the number of pixels.
    pub(super) fn len(&self) -> usize {
        self.shape().iter().product()
    }

    /// Returns the positions of the box's pixels in a texture of the given size. Coordinates wrap around its ends.
    pub(super) fn points(&self, size: [usize; 2]) -> impl Iterator<Item = usize> + use<> {
        let [rows, columns] = self.ends;
        let around = |i: i64, axis: usize| i.rem_euclid(size[axis] as i64) as usize;
        let lines: Vec<usize> = (rows[0]..rows[1]).map(|r| around(r, 0) * size[1]).collect();
        let columns: Vec<usize> = (columns[0]..columns[1]).map(|c| around(c, 1)).collect();
        lines
            .into_iter()
            .flat_map(move |line| columns.clone().into_iter().map(move |c| line + c))
    }
}

impl Window {
    /// Returns whether the window fits into the texture and has the size of patches.
    pub(super) fn fits(&self, size: [usize; 2], patch: [usize; 2]) -> bool {
        (0..2).all(|a| {
            let span = &self.0[a];
            span.extent == patch[a]
                && span.start < size[a]
                && span.extent <= size[a]
                && span.before < span.extent
                && span.after < span.extent
        })
    }

    /// Returns the first row and column.
    pub(super) fn corner(&self) -> [usize; 2] {
        self.0.map(|span| span.start)
    }

    pub(super) fn shape(&self) -> [usize; 2] {
        self.0.map(|span| span.extent)
    }

    /// Returns the box of the window.
    pub(super) fn bounds(&self) -> Box2 {
        Box2 {
            ends: self
                .0
                .map(|s| [s.start as i64, (s.start + s.extent) as i64]),
        }
    }

    /// Returns the pixels of the window that earlier patches cover.
    pub(super) fn known(&self) -> Vec<bool> {
        let [rows, columns] = self.0.map(|s| {
            let line = move |i: usize| i < s.before || i >= s.extent - s.after;
            (0..s.extent).map(line).collect::<Vec<bool>>()
        });
        rows.iter()
            .flat_map(|&r| columns.iter().map(move |&c| r || c))
            .collect()
    }

    /// Returns whether a pixel is in the core, which the patch always covers. The core is the part outside the
    /// overlaps or, if there is none, the place where the overlaps meet.
    fn is_core(&self, point: [usize; 2]) -> bool {
        (0..2).all(|a| {
            let s = &self.0[a];
            let end = (s.extent - s.after).saturating_sub(1);
            (s.before.min(end)..=s.before.max(end)).contains(&point[a])
        })
    }

    /// Adds a margin of one pixel.
    pub(super) fn around(&self, size: [usize; 2], wrap: [bool; 2]) -> Around {
        let mut around = Around {
            bounds: self.bounds(),
            inner: [0; 2],
            closed: [false; 2],
        };
        for axis in 0..2 {
            let [low, high] = &mut around.bounds.ends[axis];
            let (start, length) = (*low, size[axis] as i64);
            around.closed[axis] = wrap[axis] && *high - *low + 2 > length;
            if around.closed[axis] {
                continue;
            }
            (*low, *high) = (*low - 1, *high + 1);
            if !wrap[axis] {
                (*low, *high) = ((*low).max(0), (*high).min(length));
            }
            around.inner[axis] = (start - *low) as usize;
        }
        around
    }
}

impl Around {
    /// Returns two masks of the bounds: the pixels that the patch may cover, and the pixels that it must cover.
    pub(super) fn masks(&self, window: &Window, shown: &[u32]) -> (Vec<bool>, Vec<bool>) {
        let ([rows, columns], width) = (window.shape(), self.bounds.shape()[1]);
        let (mut mask, mut core) = (vec![false; shown.len()], vec![false; shown.len()]);
        for r in 0..rows {
            for c in 0..columns {
                let i = (self.inner[0] + r) * width + self.inner[1] + c;
                // If the window spans the period, the patch meets itself, so the pixels shown in its first and last
                // line are kept.
                let end = self.closed[0] && (r == 0 || r + 1 == rows)
                    || self.closed[1] && (c == 0 || c + 1 == columns);
                mask[i] = !end || shown[i] == super::FREE;
                core[i] = window.is_core([r, c]);
            }
        }
        (mask, core)
    }
}
