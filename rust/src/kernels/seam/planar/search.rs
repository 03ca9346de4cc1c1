//! Shortest paths on the dual.

use super::dual::Dual;
use super::{BREATH, EAST, NEVER, NORTH, SOUTH, START, WEST};
use crate::Result;
use crate::foundation::par::Monitor;

/// The seams that a search stays between. Pixels between them have cells from `left` (inclusive) to
/// `right` (exclusive).
#[derive(Debug, Clone, Copy)]
pub(super) struct Between {
    pub(super) left: u32,
    pub(super) right: u32,
}

impl Between {
    pub(super) const ALL: Self = Self {
        left: 0,
        right: u32::MAX,
    };
}

impl Dual {
    /// Returns the value and the crossings of the shortest path from above the first row to below
    /// the last one.
    pub(super) fn open(&mut self, monitor: &Monitor) -> Result<(u32, Vec<u32>)> {
        let width = self.width;
        let start: Vec<u32> = (width..2 * width).map(|f| f as u32).collect();
        let goal = ((self.rows + 1) * width) as u32;
        // Most shortest paths turn back at most once. Sweeps in memory order find these, and the
        // queue finds the rest.
        for &f in &start {
            self.faces[f as usize].distance = 0;
        }
        self.sweep(true);
        self.sweep(false);
        let goals = goal..goal + width as u32;
        let last = self.faces[self.nearest(goals.clone()) as usize].distance;
        self.queue.reset(self.largest, self.mean / 4);
        self.enqueue(last);
        self.search::<false>(|f| f >= goal, last, Between::ALL, monitor)?;
        let end = self.nearest(goals);
        Ok((self.faces[end as usize].distance, self.crossings(end)))
    }

    /// Makes faces the starts of a search.
    pub(super) fn start(&mut self, start: &[u32]) {
        for &f in start {
            let face = &mut self.faces[f as usize];
            (face.distance, face.step) = (0, START);
            self.queue.push(0, f, 0);
        }
    }

    /// Finds the shortest paths from the faces in the queue to all faces up to the distance of the nearest goal, or up
    /// to `last`. With `LED`, the search is guided by the distances in `ahead` and stays between two seams.
    pub(super) fn search<const LED: bool>(
        &mut self,
        goals: impl Fn(u32) -> bool,
        mut last: u32,
        between: Between,
        monitor: &Monitor,
    ) -> Result<()> {
        let mut taken = 0usize;
        while let Some((f, distance)) = self.queue.pop(last) {
            taken += 1;
            if taken.is_multiple_of(BREATH) {
                monitor.check()?;
            }
            if self.faces[f as usize].distance != distance {
                continue;
            }
            if goals(f) {
                // The same bucket may contain nearer faces, so continue.
                last = last.min(distance);
                continue;
            }
            for direction in 0..4 {
                let (to, cost) = self.neighbour(f, direction);
                let next = distance + cost;
                if next > last || next >= self.faces[to as usize].distance {
                    continue;
                }
                let mut key = next;
                if LED {
                    if !self.within(f, direction, between) {
                        continue;
                    }
                    if self.faces[to as usize].distance == NEVER {
                        self.touched.push(to);
                    }
                    key += self.ahead[to as usize];
                }
                let face = &mut self.faces[to as usize];
                face.distance = next;
                face.step = direction as u8;
                self.queue.push(key, to, next);
            }
        }
        Ok(())
    }

    /// Propagates distances along each row in both directions and on to the next row, over all rows
    /// of an open strip.
    pub(super) fn sweep(&mut self, southwards: bool) {
        let width = self.width;
        for i in 0..=self.rows {
            let l = if southwards { i } else { self.rows - i };
            let (above, rest) = self.faces[l * width..].split_at_mut(width);
            let (row, below) = rest.split_at_mut(width);
            let mut next = NEVER;
            for face in row.iter_mut() {
                face.offer(next, EAST);
                next = face.distance + face.east;
            }
            let mut distance = NEVER;
            for face in row.iter_mut().rev() {
                face.offer(distance + face.east, WEST);
                distance = face.distance;
            }
            if southwards {
                for (face, below) in row.iter().zip(below) {
                    below.offer(face.distance + face.south, SOUTH);
                }
            } else {
                for (face, above) in row.iter().zip(above) {
                    above.offer(face.distance + above.south, NORTH);
                }
            }
        }
    }

    /// Queues the faces of an open strip that offer a shorter path to a neighbour.
    pub(super) fn enqueue(&mut self, last: u32) {
        let width = self.width;
        for f in width..(self.rows + 2) * width {
            let face = self.faces[f];
            let (east, south) = (self.faces[f + 1], self.faces[f + width]);
            let (west, north) = (self.faces[f - 1], self.faces[f - width]);
            let leads_on = (face.distance + face.east < east.distance)
                | (face.distance + face.south < south.distance)
                | (face.distance + west.east < west.distance)
                | (face.distance + north.south < north.distance);
            if leads_on && face.distance <= last {
                self.queue.push(face.distance, f as u32, face.distance);
            }
        }
    }

    /// Returns the nearest of some faces. Ties go to the first.
    pub(super) fn nearest(&self, faces: impl Iterator<Item = u32>) -> u32 {
        faces
            .min_by_key(|&f| self.faces[f as usize].distance)
            .expect("a dual has faces in each row and column")
    }

    /// Resets all distances.
    pub(super) fn forget(&mut self) {
        // A guided search lists the faces that it touched. Other searches touch nearly all faces.
        if self.ahead.is_empty() || self.cell.is_empty() {
            for face in &mut self.faces {
                face.distance = NEVER;
            }
        } else {
            for &f in &self.touched {
                self.faces[f as usize].distance = NEVER;
            }
        }
        self.touched.clear();
    }
}
