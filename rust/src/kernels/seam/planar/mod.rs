//! The minimum cut between two opposite borders of a 2-D grid, as a shortest path on its dual.
//!
//! A seam between the left and the right border runs from face to face of the grid. Its cost is the
//! length of a path on the planar dual, so the cheapest seam is a shortest path. See Ford and
//! Fulkerson 1956, and Hassin, *Maximum flow in (s,t) planar networks*, Information Processing
//! Letters 1981. The path may turn back, in contrast to a row-by-row recurrence.
//!
//! If the rows wrap around, the seam must be closed. The method is that of Reif, *Minimum s-t cut of a planar
//! undirected network in O(n log^2 n) time*, SIAM J. Computing 1983:
//!
//! 1. a shortest path P leads from the left to the right border of the dual; some cheapest seam
//!    crosses it once;
//! 2. the cylinder is cut open along P, whose faces are doubled: a *top* copy, and the face itself
//!    at the bottom;
//! 3. for a face of P, the shortest path from its top copy to itself is the cheapest seam through
//!    it;
//! 4. such paths need not cross each other, so each path splits the strip. The faces of P to its
//!    left and right are searched only on their side.
//!
//! Departure from the paper: distances from the bottom of the opened strip are computed once. They guide every search
//! (A*) and are lower bounds of the seams through each face of P. Faces that cannot have a cheaper seam are not
//! searched. On natural images, a few out of hundreds of searches remain.
//!
//! A seam around a core ([`ring`]) is the same problem on an annulus, with P from its rim to the
//! core.

mod cylinder;
mod dual;
mod innermost;
pub mod ring;
mod search;

use crate::foundation::error::check_shape;
use crate::foundation::par::Monitor;
use crate::{Error, Result};
use dual::Dual;

/// A strip of pixels. The first column is on one side of the seam, the last column on the other
/// side.
#[derive(Debug, Clone, Copy)]
pub struct Strip<'a> {
    /// Number of rows. The seam crosses all of them.
    pub rows: usize,
    /// Number of columns, at least two.
    pub columns: usize,
    /// If true, the first row follows the last row and the seam is closed.
    pub cyclic: bool,
    /// Cost of separating each pixel from the next one in its row, an array of rows x columns. The last column is
    /// ignored.
    pub across: &'a [u32],
    /// Cost of separating each pixel from the next one in its column, an array of rows x columns. The last row is
    /// ignored unless the rows wrap around.
    pub along: &'a [u32],
}

/// A cheapest seam.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seam {
    /// Flags of the pixels on the side of the last column.
    pub far: Vec<bool>,
    /// Sum of the costs of all cut edges.
    pub value: u32,
}

/// Cost of a missing edge, and an unknown distance. The sum of two such values fits `u32`.
const NEVER: u32 = u32::MAX >> 1;
/// Limit of the sum along a whole straight row or column, so that distances do not overflow.
pub(super) const LONGEST: u64 = 1 << 30;
/// Directions on the dual, clockwise. Opposite directions differ by two.
const EAST: usize = 0;
const SOUTH: usize = 1;
const WEST: usize = 2;
const NORTH: usize = 3;
/// Value of `Face::step` where a search starts.
const START: u8 = 4;
/// Number of faces taken from the queue between checks for cancellation.
const BREATH: usize = 1 << 14;

/// Returns a direction as an angle in eighths of a turn, clockwise from east.
const fn eighths(direction: usize) -> usize {
    2 * direction
}

/// Returns the cheapest seam of a strip.
///
/// # Errors
/// There are fewer than two columns, or the sizes of the arrays do not match. Costs along a straight row or column sum
/// to 2^30 or more.
pub fn least_seam(strip: &Strip<'_>, monitor: &Monitor) -> Result<Seam> {
    check(strip)?;
    let mut dual = Dual::new(strip);
    let (value, crossings) = if !strip.cyclic {
        dual.open(monitor)?
    } else if strip.rows == 1 {
        // With a single row, each face is its own neighbour, so the seam crosses only the cheapest edge of the row.
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

/// Returns the pixels beyond a seam. `crossings` are the separated pairs (`row * width + column`)
/// in rows of `width` pairs. A pair that occurs twice is not separated.
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
            format!("must have at least 1 row and 2 columns, got {rows} and {columns}"),
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
            format!("must sum to less than {LONGEST} along a straight line, got {longest}"),
        ));
    }
    Ok(())
}

/// Returns the largest sum of costs along a straight seam or straight across it. No shortest path
/// is longer.
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
        // Use several partial sums, because with one sum each addition would wait for the previous
        // one.
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
