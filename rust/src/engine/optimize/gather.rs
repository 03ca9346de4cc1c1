//! Windows of the output, aligned with the axes of the exemplar.

use super::{CHUNK, Level};
use crate::engine::appearance::{Colour, Feature};
use crate::foundation::fixed::{
    BITS, Frame, Frames, ONE, Place, add, apply, identity, inverse, nearest, sub,
};
use crate::foundation::par;
use std::ops::Range;

/// The colours of a range of points of the output, and of all points within the reach of their windows. This is filled
/// only if all frames are the identity, because then a window is a box of these colours.
#[derive(Default)]
pub(super) struct Seen {
    first: usize,
    colours: Vec<Colour>,
}

impl Seen {
    /// Reads the colours of a range of points.
    pub(super) fn look<const D: usize>(
        &mut self,
        level: &Level<'_, D>,
        places: &[Place<D>],
        range: Range<usize>,
    ) {
        if !level.frames.is_identity() {
            return;
        }
        let margin = level.margin();
        self.first = range.start.saturating_sub(margin);
        let last = places.len().min(range.end + margin);
        self.colours.resize(last - self.first, [0; 4]);
        let places = &places[self.first..last];
        par::chunks_mut(&mut self.colours, CHUNK, |c, colours| {
            for (colour, &place) in colours.iter_mut().zip(&places[c * CHUNK..]) {
                *colour = level
                    .appearance
                    .colour(level.appearance.clamped(nearest(place)));
            }
        });
    }
}

impl<const D: usize> Level<'_, D> {
    /// Returns the maximum distance in memory, in points, between the centre of a window and a point of the window.
    pub(super) fn margin(&self) -> usize {
        let rows: usize = self.region.grid.strides().iter().sum();
        self.appearance.radius() * rows
    }
}

/// The position that is read for an offset o of a window.
struct Look<const D: usize> {
    /// The step to the point of the output nearest to F o; `across` is the same step in row-major order.
    step: [i32; D],
    across: isize,
    /// The remainder o - J step. Without it, rotated textures would have the wrong scale.
    rest: Place<D>,
}

/// Reads windows one after another, and recomputes their positions only if the frame changes.
pub(super) struct Eye<'a, const D: usize> {
    level: &'a Level<'a, D>,
    seen: &'a Seen,
    window: Vec<i16>,
    frame: Option<Frame<D>>,
    looks: Vec<Look<D>>,
    /// Maximum distance from the centre of a window to its positions, along each axis of the output. `None` if each
    /// position must be checked.
    reach: Option<[usize; D]>,
}

impl<'a, const D: usize> Eye<'a, D> {
    /// Creates a reader. If the frame is constant, its positions are computed here, once.
    pub(super) fn new(level: &'a Level<'a, D>, seen: &'a Seen) -> Self {
        let mut eye = Self {
            level,
            seen,
            window: level.appearance.scratch(),
            frame: None,
            looks: Vec::with_capacity(level.appearance.offsets().len()),
            reach: None,
        };
        if let Frames::Constant(frame) = level.frames {
            eye.turn(frame);
        }
        eye
    }

    /// Returns the appearance vector of the window around a point.
    #[inline(always)]
    pub(super) fn window(&mut self, places: &[Place<D>], p: usize) -> Feature {
        let grid = &self.level.region.grid;
        let frame = self.level.frames.at(p);
        if self.frame != Some(frame) {
            self.turn(frame);
        }
        let point = grid.point(p);
        let interior = self.reach.is_some_and(|reach| {
            (0..D).all(|a| point[a] >= reach[a] && point[a] + reach[a] < grid.shape()[a])
        });
        // Choose the fastest way of reading that is allowed at this point.
        if !interior {
            self.look_around(places, p, point);
        } else if self.seen.colours.is_empty() {
            self.look(places, p);
        } else {
            let appearance = self.level.appearance;
            for (k, look) in self.looks.iter().enumerate() {
                let at = (p - self.seen.first) as isize + look.across;
                let colour = self.seen.colours[at as usize];
                appearance.put(&mut self.window, k, colour);
            }
        }
        self.level.appearance.project(&mut self.window)
    }

    /// Computes the positions that windows read under a frame.
    fn turn(&mut self, frame: Frame<D>) {
        let appearance = self.level.appearance;
        let strides = self.level.region.grid.strides();
        let radius = appearance.radius() as i32;
        let back = inverse(&frame);
        self.looks.clear();
        self.looks.extend(appearance.offsets().iter().map(|&o| {
            let mut step = [0; D];
            let mut across = 0;
            for i in 0..D {
                let mut x = ONE / 2;
                for j in 0..D {
                    x += back[i][j] * o[j];
                }
                step[i] = x >> BITS;
                across += step[i] as isize * strides[i] as isize;
            }
            let rest = sub(o.map(|x| x * ONE), apply(&frame, step));
            Look { step, across, rest }
        }));
        self.frame = Some(frame);
        // Skip the checks if the remainders are short. Each place has its window inside the exemplar, and the margin
        // of the exemplar is wider than windows.
        let near = frame == identity()
            || frame
                .iter()
                .all(|row| row.iter().map(|&x| i32::from(x).abs()).sum::<i32>() / 2 < radius * ONE);
        self.reach = near.then(|| {
            back.map(|row| (row.iter().map(|x| x.abs()).sum::<i32>() * radius / ONE + 1) as usize)
        });
    }

    /// Reads a window that is entirely inside the region.
    #[inline(always)]
    fn look(&mut self, places: &[Place<D>], p: usize) {
        let appearance = self.level.appearance;
        let padding = appearance.padding();
        for (k, look) in self.looks.iter().enumerate() {
            let sample = nearest(add(places[(p as isize + look.across) as usize], look.rest));
            appearance.put(&mut self.window, k, padding.colour(sample));
        }
    }

    /// Reads a window near the border of the region or with long remainders. Outside the region, the patch of the
    /// point continues.
    fn look_around(&mut self, places: &[Place<D>], p: usize, point: [usize; D]) {
        let appearance = self.level.appearance;
        let looks = self.looks.iter().zip(appearance.offsets());
        for (k, (look, o)) in looks.enumerate() {
            let place = match self.level.region.step(point, look.step) {
                Some(q) => add(places[q], look.rest),
                None => add(places[p], o.map(|x| x * ONE)),
            };
            let at = appearance.clamped(nearest(place));
            appearance.put(&mut self.window, k, appearance.colour(at));
        }
    }
}
