//! Windows of the output, in the axes of the exemplar.

use std::ops::Range;

use super::{CHUNK, Level};
use crate::appearance::{Colour, Feature};
use crate::fixed::{BITS, Frame, ONE, Place, add, apply, inverse, nearest, sub};
use crate::par;
use crate::wide::wide;

/// The output as it is, where frames leave everything in place: a window is a box of it.
pub(super) struct Seen {
    colours: Vec<Colour>,
    /// Position in the exemplar.
    at: Vec<u32>,
}

impl Seen {
    pub(super) fn new<const D: usize>(level: &Level<'_, D>, places: &[Place<D>]) -> Self {
        if !level.still {
            return Self {
                colours: Vec::new(),
                at: Vec::new(),
            };
        }
        let mut at = vec![0; places.len()];
        par::chunks_mut(&mut at, CHUNK, |c, at| {
            for (at, &place) in at.iter_mut().zip(&places[c * CHUNK..]) {
                *at = level.appearance.clamped(nearest(place)) as u32;
            }
        });
        let mut colours = vec![[0; 4]; places.len()];
        par::chunks_mut(&mut colours, CHUNK, |c, colours| {
            for (colour, &at) in colours.iter_mut().zip(&at[c * CHUNK..]) {
                *colour = level.appearance.colour(at as usize);
            }
        });
        Self { colours, at }
    }
}

/// Where a window looks: the step to a point of the output, and what is left to the exact place in the exemplar.
type Look<const D: usize> = ([i32; D], Place<D>);

impl<const D: usize> Level<'_, D> {
    /// The appearance vectors of the windows around the points of some planes.
    pub(super) fn windows(
        &self,
        places: &[Place<D>],
        seen: &Seen,
        planes: &Range<usize>,
        out: &mut [Feature],
    ) {
        let first = planes.start * self.plane();
        let offsets = self.appearance.offsets();
        let looks: Vec<Look<D>> = match self.frames {
            crate::fixed::Frames::Constant(frame) => {
                let back = inverse(&frame);
                offsets.iter().map(|&o| look(&frame, &back, o)).collect()
            }
            crate::fixed::Frames::Dense(_) => Vec::new(),
        };
        let lines = self.lines();
        par::chunks_mut(out, CHUNK, |chunk, out| {
            wide(|| {
                let mut window = self.appearance.scratch();
                for (i, feature) in out.iter_mut().enumerate() {
                    let p = first + chunk * CHUNK + i;
                    *feature = if self.still {
                        self.still_window(places, seen, p, &lines, &mut window)
                    } else {
                        self.turned_window(places, p, &looks, &mut window);
                        self.appearance.project(&mut window)
                    };
                }
            });
        });
    }

    /// Positions of the lines of a window relative to its centre, in the output and in the exemplar.
    fn lines(&self) -> Vec<[isize; 2]> {
        let [out, exemplar] = [self.region.grid.strides(), self.appearance.grid().strides()];
        let side = 2 * self.appearance.radius() + 1;
        let relative = |strides: [usize; D], o: &[i32; D]| -> isize {
            o.iter()
                .zip(strides)
                .map(|(&x, s)| x as isize * s as isize)
                .sum()
        };
        self.appearance
            .offsets()
            .iter()
            .step_by(side)
            .map(|o| [relative(out, o), relative(exemplar, o)])
            .collect()
    }

    #[inline(always)]
    fn still_window(
        &self,
        places: &[Place<D>],
        seen: &Seen,
        p: usize,
        lines: &[[isize; 2]],
        window: &mut [i16],
    ) -> Feature {
        let (grid, radius) = (&self.region.grid, self.appearance.radius());
        let (point, side) = (grid.point(p), 2 * radius + 1);
        let interior =
            (0..D).all(|axis| point[axis] >= radius && point[axis] + radius < grid.shape()[axis]);
        if !interior {
            self.border_window(places, p, window);
            return self.appearance.project(window);
        }
        // A window that is copied in one piece looks like where it was copied from.
        let mine = seen.at[p] as isize;
        let whole = lines.iter().all(|&[out, exemplar]| {
            let line = &seen.at[(p as isize + out) as usize..][..side];
            let start = (mine + exemplar) as u32;
            line.iter()
                .enumerate()
                .all(|(k, &at)| at == start.wrapping_add(k as u32))
        });
        if whole && self.appearance.inside(nearest(places[p])).is_some() {
            return *self.appearance.feature(seen.at[p] as usize);
        }
        let mut k = 0;
        for &[out, _] in lines {
            for &colour in &seen.colours[(p as isize + out) as usize..][..side] {
                self.appearance.put(window, k, colour);
                k += 1;
            }
        }
        self.appearance.project(window)
    }

    /// A window that reaches beyond the region: what is not there goes on as the point's own piece of the exemplar.
    fn border_window(&self, places: &[Place<D>], p: usize, window: &mut [i16]) {
        let point = self.region.grid.point(p);
        let own = nearest(places[p]);
        for (k, &o) in self.appearance.offsets().iter().enumerate() {
            let sample = match self.region.step(point, o) {
                Some(q) => nearest(places[q]),
                None => std::array::from_fn(|axis| own[axis] + o[axis]),
            };
            let colour = self.appearance.colour(self.appearance.clamped(sample));
            self.appearance.put(window, k, colour);
        }
    }

    #[inline(always)]
    fn turned_window(&self, places: &[Place<D>], p: usize, looks: &[Look<D>], window: &mut [i16]) {
        let point = self.region.grid.point(p);
        let frame = self.frames.at(p);
        let back = if looks.is_empty() {
            inverse(&frame)
        } else {
            [[0; D]; D]
        };
        for (k, &o) in self.appearance.offsets().iter().enumerate() {
            let (step, rest) = match looks.get(k) {
                Some(&known) => known,
                None => look(&frame, &back, o),
            };
            let place = match self.region.step(point, step) {
                Some(q) => add(places[q], rest),
                None => add(places[p], o.map(|x| x * ONE)),
            };
            let at = self.appearance.clamped(nearest(place));
            self.appearance.put(window, k, self.appearance.colour(at));
        }
    }
}

/// The point of the output nearest to F o, and o - J step: without it turned textures come out at the wrong scale.
#[inline(always)]
fn look<const D: usize>(frame: &Frame<D>, back: &[[i32; D]; D], o: [i32; D]) -> Look<D> {
    let mut step = [0; D];
    for i in 0..D {
        let mut x = ONE / 2;
        for j in 0..D {
            x += back[i][j] * o[j];
        }
        step[i] = x >> BITS;
    }
    (step, sub(o.map(|x| x * ONE), apply(frame, step)))
}
