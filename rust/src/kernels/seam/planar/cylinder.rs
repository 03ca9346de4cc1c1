//! The cheapest closed seam.

use super::dual::{Dual, Face};
use super::search::Between;
use super::{EAST, NEVER, NORTH, SOUTH, START, WEST, eighths, sides};
use crate::Result;
use crate::foundation::par::Monitor;

/// A shortest closed path on the dual.
#[derive(Debug, Default)]
pub(super) struct Cycle {
    pub(super) value: u32,
    /// The horizontal pairs of pixels that the path separates, as `row * width + column`.
    pub(super) crossings: Vec<u32>,
    /// The faces of the path, which may be top copies, and their distances along it.
    pub(super) trail: Vec<(u32, u32)>,
}

impl Dual {
    /// Returns the value and the crossings of the shortest path around the cylinder.
    pub(super) fn closed(&mut self, monitor: &Monitor) -> Result<(u32, Vec<u32>)> {
        let (width, rows) = (self.width, self.rows);
        for f in 0..width {
            self.faces[width + f].odd |= 1 << NORTH;
            self.faces[rows * width + f].odd |= 1 << SOUTH;
        }
        let first: Vec<u32> = (1..=rows).map(|l| (l * width) as u32).collect();
        let last: Vec<u32> = first.iter().map(|f| f + width as u32 - 1).collect();
        self.lay_path(
            &first,
            &last,
            |f| f % width as u32 == width as u32 - 1,
            monitor,
        )?;
        self.cut_open(eighths(WEST), eighths(EAST));
        let cycle = self.around(monitor)?;
        Ok((cycle.value, cycle.crossings))
    }

    /// Returns the shortest path from the top copy of a face of P to the face itself, over all faces of P. Its value
    /// is `u32::MAX` if such a path does not exist.
    pub(super) fn around(&mut self, monitor: &Monitor) -> Result<Cycle> {
        let (width, rows) = (self.width, self.rows);
        let top = self.faces.len() - self.path.len();
        // Distances from the bottom guide all later searches.
        let bottom = self.path.clone();
        self.queue.reset(self.largest, self.mean / 4);
        self.start(&bottom);
        self.search::<false>(|_| false, NEVER, Between::ALL, monitor)?;
        self.ahead = self.faces.iter().map(|f| f.distance).collect();
        self.forget();

        self.cell = vec![0; rows * (width + 1)];
        let bound: Vec<u32> = self.ahead[top..].to_vec();
        let n = bound.len();
        let mut best = Cycle {
            value: u32::MAX,
            ..Cycle::default()
        };
        // Search the most promising face first, because its result prunes the others. After that,
        // always search the middle face of a range.
        let first = (0..n).min_by_key(|&k| bound[k]).unwrap_or(0);
        let mut ranges = vec![(0, n, first, Between::ALL)];
        while let Some((from, to, k, between)) = ranges.pop() {
            if bound[from..to].iter().all(|&b| b >= best.value) {
                continue;
            }
            let (start, goal) = ((top + k) as u32, self.path[k]);
            let (mut left, mut right) = (between, between);
            self.queue.reset(2 * self.largest, self.mean / 4);
            self.queue.begin(bound[k]);
            self.touched.push(start);
            let face = &mut self.faces[start as usize];
            (face.distance, face.step) = (0, START);
            self.queue.push(bound[k], start, 0);
            self.search::<true>(|f| f == goal, NEVER, between, monitor)?;
            let value = self.faces[goal as usize].distance;
            // The goal may be unreachable if an earlier seam runs along P here. That seam is shorter than any seam
            // through this face.
            if value != NEVER {
                let crossings = self.crossings(goal);
                let name = k as u32 + 1;
                self.split(&crossings, name, between);
                if value < best.value {
                    best = Cycle {
                        value,
                        crossings,
                        trail: self.trail(goal),
                    };
                }
                // The new seam bounds the searches to its left and to its right.
                left.right = name;
                right.left = name;
            }
            self.forget();
            ranges.push((k + 1, to, (k + 1 + to) / 2, right));
            ranges.push((from, k, (from + k) / 2, left));
        }
        Ok(best)
    }

    /// Computes P, the shortest path from the faces `from` to the faces `to`.
    pub(super) fn lay_path(
        &mut self,
        from: &[u32],
        to: &[u32],
        arrived: impl Fn(u32) -> bool,
        monitor: &Monitor,
    ) -> Result<()> {
        self.queue.reset(self.largest, self.mean / 4);
        self.start(from);
        self.search::<false>(arrived, NEVER, Between::ALL, monitor)?;
        let mut at = self.nearest(to.iter().copied());
        self.path.push(at);
        loop {
            let step = self.faces[at as usize].step;
            if step == START {
                break;
            }
            at = self.beside(at, usize::from(step) ^ 2);
            self.steps.push(usize::from(step));
            self.path.push(at);
        }
        self.path.reverse();
        self.steps.reverse();
        self.forget();
        Ok(())
    }

    /// Adds the top copies of the faces of P. The cut continues beyond both ends of P to the borders. `back` and `on`
    /// are the directions of the cut at the first and the last face, in eighths of a turn clockwise from east.
    pub(super) fn cut_open(&mut self, back: usize, on: usize) {
        let path = std::mem::take(&mut self.path);
        self.place = vec![NEVER; self.faces.len()];
        for (k, &p) in path.iter().enumerate() {
            self.place[p as usize] = k as u32;
            // Directions clockwise from the next step to the previous one are to the right of P.
            let on = self.steps.get(k).map_or(on, |&step| eighths(step));
            let back = k
                .checked_sub(1)
                .map_or(back, |k| eighths(self.steps[k] ^ 2));
            let between = (1..8)
                .map(|turn| (on + turn) % 8)
                .take_while(|&angle| angle != back)
                .filter(|angle| angle % 2 == 0);
            self.down
                .push(between.fold(0, |bits, angle| bits | 1 << (angle / 2)));
        }
        // Mark the steps across P as irregular, at both of their faces.
        for (k, &p) in path.iter().enumerate() {
            for d in (0..4).filter(|d| self.down[k] >> d & 1 == 1) {
                if self.cost(p, d) != NEVER {
                    let q = self.beside(p, d);
                    self.faces[p as usize].odd |= 1 << d;
                    self.faces[q as usize].odd |= 1 << (d ^ 2);
                }
            }
        }
        let copy = Face {
            odd: 0b1111,
            ..Face::NONE
        };
        self.faces.resize(self.faces.len() + path.len(), copy);
        self.path = path;
    }

    /// Returns whether a step separates two pixels and at least one of these pixels is between two seams.
    pub(super) fn within(&self, f: u32, direction: usize, between: Between) -> bool {
        let f = self.original(f) as usize;
        let (below, j) = (f / self.width - 1, f % self.width);
        let above = if below == 0 { self.rows - 1 } else { below - 1 };
        let at = |row: usize, column: usize| self.cell[row * (self.width + 1) + column];
        let (a, b) = match direction {
            EAST => (at(above, j + 1), at(below, j + 1)),
            SOUTH => (at(below, j), at(below, j + 1)),
            WEST => (at(above, j), at(below, j)),
            _ => (at(above, j), at(above, j + 1)),
        };
        a.max(b) >= between.left && a.min(b) < between.right
    }

    /// Labels the pixels to the right of a seam with its number, within the range that it was
    /// searched in.
    fn split(&mut self, crossings: &[u32], name: u32, between: Between) {
        let far = sides(crossings, self.rows, self.width);
        for (cell, far) in self.cell.iter_mut().zip(far) {
            if far && (between.left..between.right).contains(cell) {
                *cell = name;
            }
        }
    }
}
