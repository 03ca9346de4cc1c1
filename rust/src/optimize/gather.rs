//! Windows of the output, in the axes of the exemplar.

use std::ops::Range;

use super::{CHUNK, Level};
use crate::appearance::{Colour, Feature};
use crate::fixed::{BITS, Frame, ONE, Place, add, apply, inverse, nearest, sub};
use crate::par;

/// Side of a window, and steps of the output that one looks across, of which tables are made.
const SIDE: usize = 7;
const REACH: usize = 12;

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
        if looks.is_empty() {
            let back = inverse(&frame);
            if self.interior_window(places, p, point, &frame, &back, window) {
                return;
            }
            for (k, &o) in self.appearance.offsets().iter().enumerate() {
                self.look_at(places, p, point, k, o, look(&frame, &back, o), window);
            }
        } else {
            for (k, (&o, &known)) in self.appearance.offsets().iter().zip(looks).enumerate() {
                self.look_at(places, p, point, k, o, known, window);
            }
        }
    }

    #[inline(always)]
    #[allow(clippy::too_many_arguments)] // one point of one window
    fn look_at(
        &self,
        places: &[Place<D>],
        p: usize,
        point: [usize; D],
        k: usize,
        o: [i32; D],
        (step, rest): Look<D>,
        window: &mut [i16],
    ) {
        let place = match self.region.step(point, step) {
            Some(q) => add(places[q], rest),
            None => add(places[p], o.map(|x| x * ONE)),
        };
        let at = self.appearance.clamped(nearest(place));
        self.appearance.put(window, k, self.appearance.colour(at));
    }

    /// The window of a point far from all borders, by adding columns of F and J instead of multiplying; `false` where
    /// that is not known to hold.
    #[inline(always)]
    fn interior_window(
        &self,
        places: &[Place<D>],
        p: usize,
        point: [usize; D],
        frame: &Frame<D>,
        back: &[[i32; D]; D],
        window: &mut [i16],
    ) -> bool {
        let (shape, strides) = (self.region.grid.shape(), self.region.grid.strides());
        let (radius, side) = (
            self.appearance.radius() as i32,
            2 * self.appearance.radius() + 1,
        );
        if side > SIDE || self.appearance.grid().wrap() != [false; D] {
            return false;
        }
        for axis in 0..D {
            let reach: i32 = back[axis].iter().map(|x| x.abs()).sum::<i32>() * radius / ONE + 1;
            let rest: i32 = frame[axis].iter().map(|&x| i32::from(x).abs()).sum();
            let at = point[axis] as i32;
            if reach > REACH as i32
                || at < reach
                || at + reach >= shape[axis] as i32
                || rest / 2 >= radius * ONE
            {
                return false;
            }
        }
        // F o and J step for each value of one axis.
        let mut forth = [[[0; D]; SIDE]; D];
        let mut moved = [[[0; D]; 2 * REACH + 1]; D];
        for axis in 0..D {
            for k in 0..side {
                for i in 0..D {
                    forth[axis][k][i] = back[i][axis] * (k as i32 - radius);
                }
            }
            for k in 0..=2 * REACH {
                for i in 0..D {
                    moved[axis][k][i] = i32::from(frame[i][axis]) * (k as i32 - REACH as i32);
                }
            }
        }
        let exemplar = self.appearance.grid().strides();
        for (line, first) in self.appearance.offsets().chunks_exact(side).enumerate() {
            let mut start = [ONE / 2; D];
            for axis in 0..D - 1 {
                start = add(start, forth[axis][(first[0][axis] + radius) as usize]);
            }
            // Half a sample more, for the place to be rounded down.
            let mut o = first[0].map(|x| x * ONE + ONE / 2);
            for k in 0..side {
                let step = add(start, forth[D - 1][k]).map(|x| x >> BITS);
                let mut q = p as isize;
                let mut place = o;
                for axis in 0..D {
                    q += step[axis] as isize * strides[axis] as isize;
                    place = sub(place, moved[axis][(step[axis] + REACH as i32) as usize]);
                }
                place = add(place, places[q as usize]);
                let mut at = 0;
                for axis in 0..D {
                    at += (place[axis] >> BITS) as usize * exemplar[axis];
                }
                self.appearance
                    .put(window, line * side + k, self.appearance.colour(at));
                o[D - 1] += ONE;
            }
        }
        true
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
