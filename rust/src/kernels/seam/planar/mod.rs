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
//!
//! A seam around a core ([`ring`]) is the same on an annulus, with P from its rim to the core.

mod cylinder;
mod dual;
mod innermost;
pub mod ring;
mod search;

use crate::foundation::error::check_shape;
use crate::foundation::par::Monitor;
use crate::{Error, Result};
use dual::Dual;

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

/// A direction as an angle in eighths of a turn, clockwise from east.
const fn eighths(direction: usize) -> usize {
    2 * direction
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
    check_shape("across", &[pixels], strip.across.len())?;
    check_shape("along", &[pixels], strip.along.len())?;
    let longest = longest(columns, strip.across, strip.along, u64::from);
    if longest >= LONGEST {
        return Err(Error::value(
            "across, along",
            format!("a straight line sums to {longest}, less than {LONGEST} is allowed"),
        ));
    }
    Ok(())
}

/// The largest sum of costs along a straight seam or straight across it: no shortest path is longer.
pub(super) fn longest<C: Copy, T>(
    columns: usize,
    across: &[C],
    along: &[C],
    value: impl Fn(C) -> T,
) -> T
where
    T: Copy + Default + PartialOrd + std::ops::Add<Output = T>,
{
    let larger = |a: T, b: T| if b > a { b } else { a };
    let mut sums = vec![T::default(); columns];
    let mut longest = T::default();
    for (across, along) in across
        .chunks_exact(columns)
        .zip(along.chunks_exact(columns))
    {
        for (sum, &cost) in sums[..columns - 1].iter_mut().zip(across) {
            *sum = *sum + value(cost);
        }
        // Sums beside each other, for one alone waits for each addition.
        let (chunks, rest) = along.as_chunks::<8>();
        let mut lanes = [T::default(); 8];
        for chunk in chunks {
            for (sum, &cost) in lanes.iter_mut().zip(chunk) {
                *sum = *sum + value(cost);
            }
        }
        let rest = rest.iter().map(|&cost| value(cost));
        longest = larger(
            longest,
            lanes
                .into_iter()
                .chain(rest)
                .fold(T::default(), |a, b| a + b),
        );
    }
    sums.into_iter().fold(longest, larger)
}

#[cfg(test)]
mod tests;
