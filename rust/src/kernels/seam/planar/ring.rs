//! The least seam around a core.
//!
//! What must stay outside and what must be inside are each in one piece, the former if it may be joined around the grid. So
//! all seams are closed paths on an annulus of the dual, which is cut open along a shortest path P from the one to the other
//! as a cylinder is.

use super::cylinder::Cycle;
use super::dual::Dual;
use super::{NEVER, Strip};
use crate::Result;
use crate::foundation::par::Monitor;

/// Where a pixel must be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Anywhere.
    Free,
    /// Outside of the seam.
    Outside,
    /// Inside.
    Inside,
}

/// A grid of pixels of which some must be inside of a seam and others outside.
#[derive(Debug, Clone, Copy)]
pub struct Ring<'a> {
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub columns: usize,
    /// Where each pixel must be.
    pub sides: &'a [Side],
    /// Cost of parting each pixel from the next one in its row, the last column ignored; less than 2^27.
    pub across: &'a [i32],
    /// Cost of parting each pixel from the next one in its column, the last row ignored; less than 2^27.
    pub along: &'a [i32],
}

/// Seams that cost this or more are left to others, so that no sum overflows.
const DEAREST: u32 = 1 << 28;
/// The pixels at a face, by the angle at which they lie: south-east, south-west, north-west, north-east; their distance
/// down and to the right of the one in the north-west.
const AROUND: [(usize, [usize; 2]); 4] = [(1, [1, 1]), (3, [1, 0]), (5, [0, 0]), (7, [0, 1])];

/// Which pixels are inside of the least seam: of all least seams the innermost. None where the problem is another one: the
/// inside absent or in pieces, the outside in pieces that do not all meet the border, or costs that are too large.
///
/// # Errors
/// A monitor that was cancelled.
pub fn least_ring(ring: &Ring<'_>, monitor: &Monitor) -> Result<Option<Vec<bool>>> {
    let annulus = Annulus::new(ring);
    if !annulus.is_whole() {
        return Ok(None);
    }
    let mut dual = annulus.dual();
    let (outer, inner) = (annulus.faces(Side::Outside), annulus.faces(Side::Inside));
    let mut arrived = vec![false; dual.faces.len()];
    for &f in &inner {
        arrived[f as usize] = true;
    }
    dual.lay_path(&outer, &inner, |f| arrived[f as usize], monitor)?;
    let [first, last] = [dual.path[0], dual.path[dual.path.len() - 1]];
    let back = annulus.angle(first, Side::Outside);
    let on = annulus.angle(last, Side::Inside);
    let (Some(back), Some(on)) = (back, on) else {
        return Ok(None);
    };
    dual.cut_open(back, on);
    let cycle: Cycle = dual.around(monitor)?;
    if cycle.value >= DEAREST {
        return Ok(None);
    }
    let inside = (0..annulus.sides.len()).filter(|&p| annulus.sides[p] == Side::Inside);
    let Some(far) = dual.innermost(&cycle, inside.collect(), monitor)? else {
        return Ok(None);
    };
    let rows = far.chunks_exact(annulus.columns).skip(1).take(ring.rows);
    Ok(Some(
        rows.flat_map(|row| &row[1..=ring.columns])
            .copied()
            .collect(),
    ))
}

/// The grid with a frame of pixels outside.
struct Annulus {
    rows: usize,
    columns: usize,
    sides: Vec<Side>,
    across: Vec<u32>,
    along: Vec<u32>,
}

impl Annulus {
    fn new(ring: &Ring<'_>) -> Self {
        let (rows, columns) = (ring.rows + 2, ring.columns + 2);
        let mut sides = vec![Side::Outside; rows * columns];
        let (mut across, mut along) = (vec![0; rows * columns], vec![0; rows * columns]);
        for r in 0..ring.rows {
            let (from, to) = (r * ring.columns, (r + 1) * columns + 1);
            sides[to..][..ring.columns].copy_from_slice(&ring.sides[from..][..ring.columns]);
            for c in 0..ring.columns {
                if c + 1 < ring.columns {
                    across[to + c] = ring.across[from + c] as u32;
                }
                if r + 1 < ring.rows {
                    along[to + c] = ring.along[from + c] as u32;
                }
            }
        }
        // What is on one side is never parted.
        let tied = |p: usize, q: usize| sides[p] == sides[q] && sides[p] != Side::Free;
        for p in 0..sides.len() {
            if p + 1 < sides.len() && tied(p, p + 1) {
                across[p] = NEVER;
            }
            if p + columns < sides.len() && tied(p, p + columns) {
                along[p] = NEVER;
            }
        }
        Self {
            rows,
            columns,
            sides,
            across,
            along,
        }
    }

    /// Whether the outside and the inside are each in one piece.
    fn is_whole(&self) -> bool {
        let count = |side| self.sides.iter().filter(|&&s| s == side).count();
        let Some(core) = self.sides.iter().position(|&s| s == Side::Inside) else {
            return false;
        };
        self.piece(core) == count(Side::Inside) && self.piece(0) == count(Side::Outside)
    }

    /// Pixels of the piece of its side that a pixel is in.
    fn piece(&self, seed: usize) -> usize {
        let (side, columns) = (self.sides[seed], self.columns);
        let n = self.sides.len();
        let mut seen = vec![false; n];
        seen[seed] = true;
        let (mut waiting, mut count) = (vec![seed], 0);
        while let Some(p) = waiting.pop() {
            count += 1;
            // Around the ends of the rows the frame is one piece.
            let beside = [
                p.checked_sub(columns),
                p.checked_sub(1),
                Some(p + 1),
                Some(p + columns),
            ];
            for q in beside.into_iter().flatten().filter(|&q| q < n) {
                if !seen[q] && self.sides[q] == side {
                    seen[q] = true;
                    waiting.push(q);
                }
            }
        }
        count
    }

    fn dual(&self) -> Dual {
        let mut dual = Dual::new(&Strip {
            rows: self.rows,
            columns: self.columns,
            cyclic: false,
            across: &self.across,
            along: &self.along,
        });
        let costs = || self.across.iter().chain(&self.along);
        let real = || costs().copied().filter(|&c| c != NEVER && c > 0);
        let (sum, count) = real().fold((0, 0), |(sum, n), c| (sum + u64::from(c), n + 1u64));
        dual.largest = real().max().unwrap_or(0);
        dual.mean = (sum / count.max(1)) as u32;
        dual
    }

    /// The faces at pixels of a side that are at others too.
    fn faces(&self, side: Side) -> Vec<u32> {
        let (columns, width) = (self.columns, self.columns - 1);
        let mut faces = Vec::new();
        for r in 0..self.rows - 1 {
            for c in 0..width {
                let p = r * columns + c;
                let here = [p, p + 1, p + columns, p + columns + 1].map(|p| self.sides[p] == side);
                if here != [here[0]; 4] {
                    // The face above row r + 1; the first row of faces is no face.
                    faces.push(((r + 2) * width + c) as u32);
                }
            }
        }
        faces
    }

    /// At which angle a pixel of a side lies at a face.
    fn angle(&self, face: u32, side: Side) -> Option<usize> {
        let (columns, width) = (self.columns, self.columns - 1);
        let (r, c) = (
            (face as usize / width).checked_sub(2)?,
            face as usize % width,
        );
        AROUND
            .iter()
            .find(|(_, [down, right])| self.sides[(r + down) * columns + c + right] == side)
            .map(|&(angle, _)| angle)
    }
}

#[cfg(test)]
#[path = "ring_tests.rs"]
mod tests;
