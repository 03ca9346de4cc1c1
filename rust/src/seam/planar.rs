//! The minimum cut between two opposite borders of a 2-D grid, as a shortest path on its dual.
//!
//! A seam between the left and the right border crosses from face to face of the grid: its cost is the length of a path on
//! the planar dual, so the least seam is a shortest path (Ford and Fulkerson 1956; Hassin, *Maximum flow in (s,t) planar
//! networks*, Information Processing Letters 1981). The path may turn back: this is not a row-by-row recurrence.
//!
//! Where the rows are cyclic the seam must close on itself (Reif, *Minimum s-t cut of a planar undirected network in
//! O(n log^2 n) time*, SIAM J. Computing 1983):
//!
//! 1. a shortest path P from the left to the right border of the dual; some least seam crosses it once;
//! 2. the cylinder is cut open along P, whose faces become two: a *top* copy and the face itself at the bottom;
//! 3. for a face of P, the shortest path from its top copy to itself is the least seam through it;
//! 4. such paths need not cross each other, so each one splits the strip, and the faces to its left and right on P are
//!    searched on their side only.
//!
//! Departures: distances from the bottom of the opened strip are computed once. They lead every search (A*) and bound the
//! seams through each face of P from below, so that faces that cannot do better are never searched: on natural images
//! that leaves a few searches of the hundreds.

use crate::par::Monitor;
use crate::{Error, Result};

use super::queue::Queue;

/// A strip of pixels: the first column is on one side of the seam, the last column on the other.
#[derive(Debug, Clone, Copy)]
pub struct Strip<'a> {
    /// Rows, along which the seam runs.
    pub rows: usize,
    /// Columns, at least two.
    pub columns: usize,
    /// Whether the last row is followed by the first.
    pub cyclic: bool,
    /// Cost of parting each pixel from the next one in its row: rows x columns, the last column ignored.
    pub across: &'a [u32],
    /// Cost of parting each pixel from the next one in its column: rows x columns, the last row ignored unless cyclic.
    pub along: &'a [u32],
}

/// A least seam.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seam {
    /// Whether each pixel is on the side of the last column.
    pub far: Vec<bool>,
    /// Cost of all edges that are cut.
    pub value: u32,
}

/// No edge, no distance; the sum of two fits.
const NEVER: u32 = u32::MAX >> 1;
/// No sum of a whole straight row or column may reach this, so that no distance overflows.
pub(super) const LONGEST: u64 = 1 << 30;
/// Directions on the dual, clockwise: opposite ones differ by two.
const EAST: usize = 0;
const SOUTH: usize = 1;
const WEST: usize = 2;
const NORTH: usize = 3;
/// Step that led to a start.
const START: u8 = 4;
/// Faces taken between two looks at the monitor.
const BREATH: usize = 1 << 14;

/// A face of the grid: between columns `j` and `j + 1`, and above row `l`.
#[derive(Debug, Clone, Copy)]
struct Face {
    distance: u32,
    /// Cost of the step south, through row `l`.
    south: u32,
    /// Cost of the step east, between rows `l - 1` and `l` at column `j + 1`.
    east: u32,
    /// Direction of the last step of the shortest path to it.
    step: u8,
    /// Directions, as bits, in which the neighbour is not the next face in memory.
    odd: u8,
}

impl Face {
    const NONE: Self = Self {
        distance: NEVER,
        south: NEVER,
        east: NEVER,
        step: START,
        odd: 0,
    };
}

impl Face {
    /// Takes a shorter way.
    #[inline(always)]
    fn offer(&mut self, distance: u32, step: usize) {
        let nearer = distance < self.distance;
        self.distance = if nearer { distance } else { self.distance };
        self.step = if nearer { step as u8 } else { self.step };
    }
}

/// The least seam of a strip.
///
/// # Errors
/// Fewer than two columns, arrays that do not fit, or costs of which a straight row or column sums to 2^30 or more.
pub fn least_seam(strip: &Strip<'_>, monitor: &Monitor) -> Result<Seam> {
    check(strip)?;
    let mut dual = Dual::new(strip);
    let (value, crossings) = if !strip.cyclic {
        dual.open(monitor)?
    } else if strip.rows == 1 {
        // The only face of a column is its own neighbour.
        let row = &strip.across[..strip.columns - 1];
        let j = (0..row.len()).min_by_key(|&j| row[j]).unwrap_or(0);
        (row[j], vec![j as u32])
    } else {
        dual.closed(monitor)?
    };
    Ok(Seam {
        far: sides(&crossings, strip.rows, dual.width),
        value,
    })
}

/// Which pixels lie beyond a seam that parts these pairs of pixels (`row * width + column`) of rows of `width` pairs. Pairs
/// that are parted twice are not parted.
fn sides(crossings: &[u32], rows: usize, width: usize) -> Vec<bool> {
    let mut far = vec![false; rows * (width + 1)];
    for &at in crossings {
        let (row, column) = (at as usize / width, at as usize % width);
        far[row * (width + 1) + column + 1] ^= true;
    }
    for row in far.chunks_exact_mut(width + 1) {
        let mut side = false;
        for far in row {
            side ^= *far;
            *far = side;
        }
    }
    far
}

fn check(strip: &Strip<'_>) -> Result<()> {
    let (rows, columns) = (strip.rows, strip.columns);
    if rows == 0 || columns < 2 {
        return Err(Error::value(
            "strip",
            format!("{rows} rows and {columns} columns; at least 1 and 2 are needed"),
        ));
    }
    let pixels = rows.saturating_mul(columns);
    if pixels >= i32::MAX as usize / 2 {
        return Err(Error::Limit {
            what: "a strip".into(),
            needed: format!("{pixels} pixels"),
            limit: format!("{} pixels", i32::MAX / 2),
        });
    }
    super::cost::check_len("across", pixels, strip.across.len())?;
    super::cost::check_len("along", pixels, strip.along.len())?;
    let longest = longest(
        rows,
        columns,
        |p| u64::from(strip.across[p]),
        |p| u64::from(strip.along[p]),
    );
    if longest >= LONGEST {
        return Err(Error::value(
            "across, along",
            format!("a straight line sums to {longest}, less than {LONGEST} is allowed"),
        ));
    }
    Ok(())
}

/// The largest sum of costs along a straight seam or straight across it: no shortest path is longer.
pub(super) fn longest<T>(
    rows: usize,
    columns: usize,
    across: impl Fn(usize) -> T,
    along: impl Fn(usize) -> T,
) -> T
where
    T: Copy + Default + PartialOrd + std::ops::AddAssign,
{
    let mut sums = vec![T::default(); columns];
    let mut longest = T::default();
    for r in 0..rows {
        let mut row = T::default();
        for (c, sum) in sums.iter_mut().enumerate() {
            if c + 1 < columns {
                *sum += across(r * columns + c);
            }
            row += along(r * columns + c);
        }
        if row > longest {
            longest = row;
        }
    }
    sums.into_iter()
        .fold(longest, |m, s| if s > m { s } else { m })
}

struct Dual {
    /// Faces from `first` on, row by row; before and after them a row of [`Face::NONE`]; then the top copies of P.
    faces: Vec<Face>,
    /// Distance from the bottom of the opened strip.
    ahead: Vec<u32>,
    rows: usize,
    width: usize,
    cyclic: bool,
    queue: Queue,
    largest: u32,
    mean: u32,
    /// P; the direction from each of its faces to the next one; those that leave it downwards, as bits; the place on P of
    /// each face.
    path: Vec<u32>,
    steps: Vec<usize>,
    down: Vec<u8>,
    place: Vec<u32>,
    /// For each pixel the last seam that it is right of, plus one: 0 where it is left of all.
    cell: Vec<u32>,
    touched: Vec<u32>,
}

/// Between which seams a search stays: pixels right of all seams have cells from `left` on and below `right`.
#[derive(Debug, Clone, Copy)]
struct Between {
    left: u32,
    right: u32,
}

impl Between {
    const ALL: Self = Self {
        left: 0,
        right: u32::MAX,
    };
}

impl Dual {
    fn new(strip: &Strip<'_>) -> Self {
        let (rows, columns) = (strip.rows, strip.columns);
        let width = columns - 1;
        let levels = rows + usize::from(!strip.cyclic);
        let mut faces = vec![Face::NONE; (levels + 2) * width];
        let (mut largest, mut sum) = (0, 0u64);
        for l in 0..levels {
            let row = &mut faces[(l + 1) * width..][..width];
            if l < rows {
                for (face, &cost) in row.iter_mut().zip(&strip.across[l * columns..]) {
                    face.south = cost;
                    largest = largest.max(cost);
                    sum += u64::from(cost);
                }
            }
            // The row above this level; the first and the last level of an open strip have pixels on one side only.
            let above = match (l, strip.cyclic) {
                (0, true) if rows > 1 => rows - 1,
                (0, _) => continue,
                (l, false) if l == rows => continue,
                (l, _) => l - 1,
            };
            for (face, &cost) in row[..width - 1]
                .iter_mut()
                .zip(&strip.along[above * columns + 1..])
            {
                face.east = cost;
                largest = largest.max(cost);
                sum += u64::from(cost);
            }
        }
        Self {
            faces,
            ahead: Vec::new(),
            rows,
            width,
            cyclic: strip.cyclic,
            queue: Queue::default(),
            largest,
            mean: (sum / (2 * rows * width) as u64) as u32,
            path: Vec::new(),
            steps: Vec::new(),
            down: Vec::new(),
            place: Vec::new(),
            cell: Vec::new(),
            touched: Vec::new(),
        }
    }

    /// The shortest path from above the first row to below the last one.
    fn open(&mut self, monitor: &Monitor) -> Result<(u32, Vec<u32>)> {
        let width = self.width;
        let start: Vec<u32> = (width..2 * width).map(|f| f as u32).collect();
        let goal = ((self.rows + 1) * width) as u32;
        // Most shortest paths never turn back, or once: sweeps find these, in the order of memory, and leave the rest to
        // the queue.
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

    /// The shortest path around the cylinder.
    fn closed(&mut self, monitor: &Monitor) -> Result<(u32, Vec<u32>)> {
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

    /// Makes faces the starts of searches.
    fn start(&mut self, start: &[u32]) {
        for &f in start {
            let face = &mut self.faces[f as usize];
            (face.distance, face.step) = (0, START);
            self.queue.push(0, f, 0);
        }
    }

    /// Finds the shortest paths that begin with what is in the queue, to all that is no farther than the nearest goal, or
    /// than `last`. `LED` searches look ahead and stay between two seams.
    fn search<const LED: bool>(
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
                // Its bucket may hold nearer ones.
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

    /// Carries distances along each row both ways and on to the next row, over all rows of an open strip.
    fn sweep(&mut self, southwards: bool) {
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

    /// Puts the faces of an open strip from which a shorter way leads on into the queue.
    fn enqueue(&mut self, last: u32) {
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

    /// The nearest of some faces, the first one of equals.
    fn nearest(&self, faces: impl Iterator<Item = u32>) -> u32 {
        faces
            .min_by_key(|&f| self.faces[f as usize].distance)
            .expect("a dual has faces in each row and column")
    }

    /// Makes all distances unknown again.
    fn forget(&mut self) {
        // A search that was led lists what it touched; others touch nearly everything.
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

    /// Where a step leads, and its cost: [`NEVER`] where there is no such step.
    #[inline(always)]
    fn neighbour(&self, f: u32, direction: usize) -> (u32, u32) {
        let (at, width) = (f as usize, self.width);
        let face = &self.faces[at];
        if face.odd >> direction & 1 == 1 {
            return self.odd(f, direction);
        }
        match direction {
            EAST => (f + 1, face.east),
            SOUTH => (f + width as u32, face.south),
            WEST => (f - 1, self.faces[at - 1].east),
            _ => (f - width as u32, self.faces[at - width].south),
        }
    }

    /// [`Self::neighbour`] across the ends of the rows and across P.
    #[cold]
    fn odd(&self, f: u32, direction: usize) -> (u32, u32) {
        let top = (self.faces.len() - self.path.len()) as u32;
        let copy = f.checked_sub(top).map(|k| k as usize);
        let from = copy.map_or(f, |k| self.path[k]);
        let cost = self.cost(from, direction);
        if cost == NEVER {
            return (f, NEVER);
        }
        let to = self.beside(from, direction);
        // The place on P of a face that a direction leaves downwards.
        let downwards = |p: u32, d: usize| {
            let k = *self.place.get(p as usize)?;
            (k != NEVER && self.down[k as usize] >> d & 1 == 1).then_some(k)
        };
        match (copy, downwards(from, direction)) {
            // The steps downwards from P belong to the copies, which share the steps along P with the faces themselves.
            (None, Some(_)) => (f, NEVER),
            (Some(k), None) if self.steps.get(k) == Some(&direction) => (f + 1, cost),
            (Some(k), None) if k > 0 && self.steps[k - 1] == direction ^ 2 => (f - 1, cost),
            (Some(_), None) => (f, NEVER),
            _ => (downwards(to, direction ^ 2).map_or(to, |k| top + k), cost),
        }
    }

    /// The face next to an original one, around the cylinder.
    fn beside(&self, f: u32, direction: usize) -> u32 {
        let (width, last) = (self.width as u32, (self.rows * self.width) as u32);
        match direction {
            EAST => f + 1,
            WEST => f - 1,
            SOUTH if self.cyclic && f >= last => f + width - last,
            SOUTH => f + width,
            _ if self.cyclic && f < 2 * width => f + last - width,
            _ => f - width,
        }
    }

    /// Cost of a step from an original face.
    fn cost(&self, f: u32, direction: usize) -> u32 {
        match direction {
            EAST => self.faces[f as usize].east,
            WEST => self.faces[f as usize - 1].east,
            SOUTH => self.faces[f as usize].south,
            _ => self.faces[self.beside(f, NORTH) as usize].south,
        }
    }

    /// The original of a face.
    fn original(&self, f: u32) -> u32 {
        let top = self.faces.len() - self.path.len();
        (f as usize).checked_sub(top).map_or(f, |k| self.path[k])
    }

    /// The pairs of pixels in a row, as `row * width + column`, that the path to a face parts.
    fn crossings(&self, mut f: u32) -> Vec<u32> {
        let mut crossings = Vec::new();
        loop {
            let step = self.faces[f as usize].step;
            if step == START {
                return crossings;
            }
            let before = self.neighbour(f, usize::from(step) ^ 2).0;
            match usize::from(step) {
                SOUTH => crossings.push(self.original(before) - self.width as u32),
                NORTH => crossings.push(self.original(f) - self.width as u32),
                _ => {}
            }
            f = before;
        }
    }

    /// Whether a step parts two pixels of which one at least is between two seams.
    fn within(&self, f: u32, direction: usize, between: Between) -> bool {
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

#[cfg(test)]
#[path = "planar_tests.rs"]
mod tests;
