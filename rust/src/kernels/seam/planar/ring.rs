//! The cheapest seam around a core.
//!
//! The outside and the inside must each be connected. The outside may be connected across the border of the grid. All
//! seams are then closed paths on an annulus of the dual. Like a cylinder, the annulus is cut open along a shortest
//! path P from the outside to the inside.

use super::cylinder::Cycle;
use super::dual::Dual;
use super::{NEVER, Strip};
use crate::Result;
use crate::foundation::par::Monitor;

/// Required side of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Either side.
    Free,
    /// Outside the seam.
    Outside,
    /// Inside the seam.
    Inside,
}

/// A grid of pixels. Some must be inside a seam and others outside.
#[derive(Debug, Clone, Copy)]
pub struct Ring<'a> {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    /// Required side of each pixel.
    pub sides: &'a [Side],
    /// Cost of separating each pixel from the next one in its row, less than 2^27. The last column
    /// is ignored.
    pub across: &'a [i32],
    /// Cost of separating each pixel from the next one in its column, less than 2^27. The last row
    /// is ignored.
    pub along: &'a [i32],
}

/// Seams of at least this cost are left to another solver, so that sums do not overflow.
const DEAREST: u32 = 1 << 28;
/// The pixels around a face: the angle (south-east, south-west, north-west, north-east), and the
/// offset down and to the right from the north-western pixel.
const AROUND: [(usize, [usize; 2]); 4] = [(1, [1, 1]), (3, [1, 0]), (5, [0, 0]), (7, [0, 1])];

/// Returns the pixels inside the cheapest seam, or inside the innermost of several cheapest seams. The result is
/// `None` if this solver does not apply. Then the inside is missing or not connected, the outside has parts that do
/// not meet the border, or costs are too large.
///
/// # Errors
/// The monitor was cancelled.
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
    // Cut the annulus open along a path from the outside to the inside, and search the closed
    // paths.
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
    // Remove the frame.
    let rows = far.chunks_exact(annulus.columns).skip(1).take(ring.rows);
    Ok(Some(
        rows.flat_map(|row| &row[1..=ring.columns])
            .copied()
            .collect(),
    ))
}

/// The grid with a frame of outside pixels.
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
        // Pixels that must be on the same side are never separated.
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

    /// Returns whether the outside is connected and the inside is connected.
    fn is_whole(&self) -> bool {
        let count = |side| self.sides.iter().filter(|&&s| s == side).count();
        let Some(core) = self.sides.iter().position(|&s| s == Side::Inside) else {
            return false;
        };
        self.piece(core) == count(Side::Inside) && self.piece(0) == count(Side::Outside)
    }

    /// Returns the number of pixels of the same side that are connected to a pixel.
    fn piece(&self, seed: usize) -> usize {
        let (side, columns) = (self.sides[seed], self.columns);
        let n = self.sides.len();
        let mut seen = vec![false; n];
        seen[seed] = true;
        let (mut waiting, mut count) = (vec![seed], 0);
        while let Some(p) = waiting.pop() {
            count += 1;
            // The frame connects the ends of each row with the next row.
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

    /// Returns the faces that touch both this side and other pixels.
    fn faces(&self, side: Side) -> Vec<u32> {
        let (columns, width) = (self.columns, self.columns - 1);
        let mut faces = Vec::new();
        for r in 0..self.rows - 1 {
            for c in 0..width {
                let p = r * columns + c;
                let here = [p, p + 1, p + columns, p + columns + 1].map(|p| self.sides[p] == side);
                if here != [here[0]; 4] {
                    // A face is above row r + 1, and the first row of faces is padding.
                    faces.push(((r + 2) * width + c) as u32);
                }
            }
        }
        faces
    }

    /// Returns the angle, in eighths of a turn, from a face to an adjacent pixel of this side.
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
