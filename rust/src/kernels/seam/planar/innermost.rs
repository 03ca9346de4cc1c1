//! The innermost of all cheapest seams around a core.
//!
//! A cheapest seam is found together with a maximum flow across it. See Miller and Naor, *Flow in
//! planar graphs with multiple sources and sinks*, SIAM J. Computing 1995. Each face gets a
//! potential. Potentials at the two ends of a step differ by at most its cost, and rise by the
//! value of the seam once around. Their differences are the flow across the edges. The pixels that
//! can still send flow to the core are inside all cheapest seams.
//!
//! 1. Along the seam found, potentials are the distances. Inside it, they are the lengths of the
//!    shortest paths from the seam. Across P they change by the value of the seam, which makes some
//!    steps negative, but no closed path.
//! 2. From the core outwards, take each pixel with residual capacity towards a taken pixel.

use super::cylinder::Cycle;
use super::dual::Dual;
use super::{BREATH, EAST, NEVER, SOUTH, WEST, sides};
use crate::Result;
use crate::foundation::par::Monitor;

impl Dual {
    /// Returns the pixels inside the innermost cheapest seam, or `None` if a potential is too
    /// large. The pixels of `core` are inside all seams.
    pub(super) fn innermost(
        &mut self,
        cycle: &Cycle,
        core: Vec<usize>,
        monitor: &Monitor,
    ) -> Result<Option<Vec<bool>>> {
        let within = sides(&cycle.crossings, self.rows, self.width);
        self.close(&within);
        if !self.potentials(cycle, monitor)? {
            return Ok(None);
        }
        Ok(Some(self.residual(i64::from(cycle.value), core)))
    }

    /// Sets the cost of all steps between two pixels outside the seam to [`NEVER`].
    fn close(&mut self, within: &[bool]) {
        let (width, columns) = (self.width, self.width + 1);
        for l in 0..=self.rows {
            for j in 0..width {
                let face = &mut self.faces[(l + 1) * width + j];
                let below = l * columns + j;
                if l < self.rows && !within[below] && !within[below + 1] {
                    face.south = NEVER;
                }
                if l > 0 && l < self.rows && !within[below + 1] && !within[below + 1 - columns] {
                    face.east = NEVER;
                }
            }
        }
    }

    /// Sets the distance of each face inside a seam to its potential. Returns false if a potential is out of range.
    fn potentials(&mut self, cycle: &Cycle, monitor: &Monitor) -> Result<bool> {
        let (top, value) = (self.faces.len() - self.path.len(), cycle.value);
        // Paths that wind around P can lead to potentials below their start, by less than twice the
        // value.
        let base = 2 * value;
        // Keys below the last taken key are found in the next turn of the queue.
        self.queue.reset(2 * value + self.largest, self.mean / 4);
        self.queue.begin(base);
        for &(f, along) in &cycle.trail {
            let copy = f as usize >= top;
            let (f, potential) = (self.original(f), base + along + u32::from(copy) * value);
            let face = &mut self.faces[f as usize];
            if potential < face.distance {
                face.distance = potential;
                self.queue.push(potential, f, potential);
            }
        }
        let mut taken = 0usize;
        while let Some((f, distance)) = self.queue.pop(u32::MAX) {
            taken += 1;
            if taken.is_multiple_of(BREATH) {
                monitor.check()?;
            }
            if self.faces[f as usize].distance != distance {
                continue;
            }
            for direction in 0..4 {
                let (to, cost) = self.plain(f, direction);
                if cost == NEVER {
                    continue;
                }
                // A step across P changes the potential by the value of the seam.
                let mut next = i64::from(distance) + i64::from(cost);
                if self.faces[f as usize].odd >> direction & 1 == 1 {
                    next += self.winding(f, direction, to) * i64::from(value);
                }
                if !(0..i64::from(NEVER)).contains(&next) {
                    return Ok(false);
                }
                let next = next as u32;
                if next < self.faces[to as usize].distance {
                    self.faces[to as usize].distance = next;
                    self.queue.push(next, to, next);
                }
            }
        }
        Ok(true)
    }

    /// Returns the pixels that have residual capacity to the core, directly or over several edges.
    fn residual(&self, value: i64, core: Vec<usize>) -> Vec<bool> {
        let (width, columns) = (self.width, self.width + 1);
        let mut taken = vec![false; self.rows * columns];
        for &p in &core {
            taken[p] = true;
        }
        let mut waiting = core;
        while let Some(q) = waiting.pop() {
            let (r, c) = (q / columns, q % columns);
            let face = |l: usize, j: usize| ((l + 1) * width + j) as u32;
            // A step has the first pixel of the pair on its left. Flow runs from right to left.
            let around = [
                (q - columns, face(r, c - 1), EAST, 1),
                (q + columns, face(r + 1, c - 1), EAST, -1),
                (q - 1, face(r, c - 1), SOUTH, -1),
                (q + 1, face(r, c), SOUTH, 1),
            ];
            for (p, f, direction, sign) in around {
                if taken[p] {
                    continue;
                }
                let (to, cost) = self.plain(f, direction);
                if cost == NEVER {
                    continue;
                }
                let potential = |f: u32| i64::from(self.faces[f as usize].distance);
                let mut rise = potential(to) - potential(f);
                if self.faces[f as usize].odd >> direction & 1 == 1 {
                    rise -= self.winding(f, direction, to) * value;
                }
                if i64::from(cost) + sign * rise > 0 {
                    taken[p] = true;
                    waiting.push(p);
                }
            }
        }
        taken
    }

    /// Returns the number of times that a step crosses P upwards, minus the number of times downwards.
    fn winding(&self, f: u32, direction: usize, to: u32) -> i64 {
        let downwards = |p: u32, d: usize| {
            let k = self.place[p as usize];
            k != NEVER && self.down[k as usize] >> d & 1 == 1
        };
        i64::from(downwards(to, direction ^ 2)) - i64::from(downwards(f, direction))
    }

    /// Returns the target and the cost of a step in a strip whose rows do not wrap around, ignoring P.
    #[inline(always)]
    fn plain(&self, f: u32, direction: usize) -> (u32, u32) {
        let (at, width) = (f as usize, self.width);
        match direction {
            EAST => (f + 1, self.faces[at].east),
            SOUTH => (f + width as u32, self.faces[at].south),
            WEST => (f - 1, self.faces[at - 1].east),
            _ => (f - width as u32, self.faces[at - width].south),
        }
    }
}
