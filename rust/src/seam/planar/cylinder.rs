//! The least seam that closes on itself.

use super::dual::{Dual, Face};
use super::search::Between;
use super::{EAST, NEVER, NORTH, SOUTH, START, WEST, sides};
use crate::Result;
use crate::par::Monitor;

impl Dual {
    /// The shortest path around the cylinder.
    pub(super) fn closed(&mut self, monitor: &Monitor) -> Result<(u32, Vec<u32>)> {
        let (width, rows) = (self.width, self.rows);
        for f in 0..width {
            self.faces[width + f].odd |= 1 << NORTH;
            self.faces[rows * width + f].odd |= 1 << SOUTH;
        }
        self.cut_open(monitor)?;
        let top = self.faces.len() - self.path.len();
        // Distances from the bottom lead all searches to come.
        let bottom = self.path.clone();
        self.queue.reset(self.largest, self.mean / 4);
        self.start(&bottom);
        self.search::<false>(|_| false, NEVER, Between::ALL, monitor)?;
        self.ahead = self.faces.iter().map(|f| f.distance).collect();
        self.forget();

        self.cell = vec![0; rows * (width + 1)];
        let bound: Vec<u32> = self.ahead[top..].to_vec();
        let n = bound.len();
        let mut best = (u32::MAX, Vec::new());
        // The most promising face first, for it prunes the others; then always the middle one.
        let first = (0..n).min_by_key(|&k| bound[k]).unwrap_or(0);
        let mut ranges = vec![(0, n, first, Between::ALL)];
        while let Some((from, to, k, between)) = ranges.pop() {
            if bound[from..to].iter().all(|&b| b >= best.0) {
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
            // Not to be reached: an earlier seam runs along P here, and is shorter than any seam through this face.
            if value != NEVER {
                let crossings = self.crossings(goal);
                let name = k as u32 + 1;
                self.split(&crossings, name, between);
                if value < best.0 {
                    best = (value, crossings);
                }
                left.right = name;
                right.left = name;
            }
            self.forget();
            ranges.push((k + 1, to, (k + 1 + to) / 2, right));
            ranges.push((from, k, (from + k) / 2, left));
        }
        Ok(best)
    }

    /// Finds P and gives its faces their top copies.
    fn cut_open(&mut self, monitor: &Monitor) -> Result<()> {
        let width = self.width as u32;
        let start: Vec<u32> = (1..=self.rows as u32).map(|l| l * width).collect();
        let last = width - 1;
        self.queue.reset(self.largest, self.mean / 4);
        self.start(&start);
        self.search::<false>(|f| f % width == last, NEVER, Between::ALL, monitor)?;
        let mut at = self.nearest(start.iter().map(|f| f + last));
        let mut path = vec![at];
        while !at.is_multiple_of(width) {
            let step = usize::from(self.faces[at as usize].step);
            at = self.beside(at, step ^ 2);
            self.steps.push(step);
            path.push(at);
        }
        path.reverse();
        self.steps.reverse();
        self.forget();
        self.place = vec![NEVER; self.faces.len()];
        for (k, &p) in path.iter().enumerate() {
            self.place[p as usize] = k as u32;
            // Clockwise from the way on to the way back: what lies to the right of one who walks along P.
            let on = self.steps.get(k).copied().unwrap_or(EAST);
            let back = k.checked_sub(1).map_or(WEST, |k| self.steps[k] ^ 2);
            let between = (1..4)
                .map(|turn| (on + turn) % 4)
                .take_while(|&d| d != back);
            self.down.push(between.fold(0, |bits, d| bits | 1 << d));
        }
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
        Ok(())
    }

    /// Whether a step parts two pixels of which one at least is between two seams.
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

    /// Gives the pixels right of a seam its name, between the seams that it was searched between.
    fn split(&mut self, crossings: &[u32], name: u32, between: Between) {
        let far = sides(crossings, self.rows, self.width);
        for (cell, far) in self.cell.iter_mut().zip(far) {
            if far && (between.left..between.right).contains(cell) {
                *cell = name;
            }
        }
    }
}
