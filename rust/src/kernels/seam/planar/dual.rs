//! The faces between the pixels of a strip, and the steps between them.

use super::{EAST, NEVER, NORTH, SOUTH, START, Strip, WEST};
use crate::kernels::seam::queue::Queue;

/// A face of the grid: between columns `j` and `j + 1`, and above row `l`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Face {
    pub(super) distance: u32,
    /// Cost of the step south, through row `l`.
    pub(super) south: u32,
    /// Cost of the step east, between rows `l - 1` and `l` at column `j + 1`.
    pub(super) east: u32,
    /// Direction of the last step of the shortest path to this face.
    pub(super) step: u8,
    /// Bits of the directions whose neighbour is not the adjacent face in memory.
    pub(super) odd: u8,
}

impl Face {
    pub(super) const NONE: Self = Self {
        distance: NEVER,
        south: NEVER,
        east: NEVER,
        step: START,
        odd: 0,
    };
}

impl Face {
    /// Takes a path to this face if it is shorter than the known path.
    #[inline(always)]
    pub(super) fn offer(&mut self, distance: u32, step: usize) {
        let nearer = distance < self.distance;
        self.distance = if nearer { distance } else { self.distance };
        self.step = if nearer { step as u8 } else { self.step };
    }
}

pub(super) struct Dual {
    /// The faces, row by row, with a row of [`Face::NONE`] before and after them, then the top
    /// copies of P.
    pub(super) faces: Vec<Face>,
    /// Distance of each face from the bottom of the opened strip.
    pub(super) ahead: Vec<u32>,
    pub(super) rows: usize,
    pub(super) width: usize,
    pub(super) cyclic: bool,
    pub(super) queue: Queue,
    pub(super) largest: u32,
    pub(super) mean: u32,
    /// The faces of P. `steps` contains the direction from each face to the next face, and `down` the bits of the
    /// directions that leave P downwards. `place` contains the index on P of each face.
    pub(super) path: Vec<u32>,
    pub(super) steps: Vec<usize>,
    pub(super) down: Vec<u8>,
    pub(super) place: Vec<u32>,
    /// For each pixel, the number of the last seam to its left, plus one, or 0 if there is none.
    pub(super) cell: Vec<u32>,
    pub(super) touched: Vec<u32>,
}

impl Dual {
    pub(super) fn new(strip: &Strip<'_>) -> Self {
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
            // Index of the row of pixels above this level of faces. The first and the last level of an open strip have
            // pixels on one side only.
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

    /// Returns the target and the cost of a step. The cost of a missing step is [`NEVER`].
    #[inline(always)]
    pub(super) fn neighbour(&self, f: u32, direction: usize) -> (u32, u32) {
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

    /// [`Self::neighbour`] across the ends of rows and across P.
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
        // Index on P of a face, if the direction leaves P downwards there.
        let downwards = |p: u32, d: usize| {
            let k = *self.place.get(p as usize)?;
            (k != NEVER && self.down[k as usize] >> d & 1 == 1).then_some(k)
        };
        match (copy, downwards(from, direction)) {
            // Steps downwards from P belong to the copies. Copies and faces share the steps along
            // P.
            (None, Some(_)) => (f, NEVER),
            (Some(k), None) if self.steps.get(k) == Some(&direction) => (f + 1, cost),
            (Some(k), None) if k > 0 && self.steps[k - 1] == direction ^ 2 => (f - 1, cost),
            (Some(_), None) => (f, NEVER),
            _ => (downwards(to, direction ^ 2).map_or(to, |k| top + k), cost),
        }
    }

    /// Returns the face next to an original face, modulo the rows if they wrap around.
    pub(super) fn beside(&self, f: u32, direction: usize) -> u32 {
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

    /// Returns the cost of a step from an original face.
    pub(super) fn cost(&self, f: u32, direction: usize) -> u32 {
        match direction {
            EAST => self.faces[f as usize].east,
            WEST => self.faces[f as usize - 1].east,
            SOUTH => self.faces[f as usize].south,
            _ => self.faces[self.beside(f, NORTH) as usize].south,
        }
    }

    /// Returns the original of a face that may be a top copy.
    pub(super) fn original(&self, f: u32) -> u32 {
        let top = self.faces.len() - self.path.len();
        (f as usize).checked_sub(top).map_or(f, |k| self.path[k])
    }

    /// Returns the horizontal pairs of pixels that the path to a face separates, as `row * width +
    /// column`.
    pub(super) fn crossings(&self, mut f: u32) -> Vec<u32> {
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

    /// Returns the faces of the path to a face, and their distances.
    pub(super) fn trail(&self, mut f: u32) -> Vec<(u32, u32)> {
        let mut trail = Vec::new();
        loop {
            let Face { distance, step, .. } = self.faces[f as usize];
            trail.push((f, distance));
            if step == START {
                return trail;
            }
            f = self.neighbour(f, usize::from(step) ^ 2).0;
        }
    }
}
