//! Coordinates and frames in fixed point.
//!
//! A synthesis transforms coordinates by frames many thousand times, and its choices depend on how
//! they round. In fixed point every step is exact, so the result is the same on any machine and in
//! any order of work. Coordinates that overflow 32 bits wrap around. This is harmless: such
//! coordinates are far outside any exemplar and are mapped back into it like all others.

use crate::{Error, Result};

/// Number of fractional bits.
pub const BITS: u32 = 12;
/// The fixed-point value of one sample.
pub const ONE: i32 = 1 << BITS;

/// A position in an exemplar, in units of 1 / [`ONE`] of a sample. Sample centres are at the
/// multiples of [`ONE`].
pub type Place<const D: usize> = [i32; D];

/// A Jacobian dS/dp in units of 1 / [`ONE`]: entries range from -8 to 8. Rows are axes of the
/// exemplar; columns are axes of the output.
pub type Frame<const D: usize> = [[i16; D]; D];

/// The identity frame.
pub const fn identity<const D: usize>() -> Frame<D> {
    let mut frame = [[0; D]; D];
    let mut axis = 0;
    while axis < D {
        frame[axis][axis] = ONE as i16;
        axis += 1;
    }
    frame
}

/// Returns the sample nearest to a position. Ties round up.
#[inline(always)]
pub fn nearest<const D: usize>(place: Place<D>) -> [i32; D] {
    place.map(|x| x.wrapping_add(ONE / 2) >> BITS)
}

/// Returns the displacement `J * step`, in fixed point, of a step in whole samples of the output.
#[inline(always)]
pub fn apply<const D: usize>(frame: &Frame<D>, step: [i32; D]) -> Place<D> {
    let mut moved = [0i32; D];
    for i in 0..D {
        for j in 0..D {
            moved[i] = moved[i].wrapping_add(i32::from(frame[i][j]).wrapping_mul(step[j]));
        }
    }
    moved
}

/// Returns `a + b`.
#[inline(always)]
pub fn add<const D: usize>(a: Place<D>, b: Place<D>) -> Place<D> {
    let mut sum = a;
    for i in 0..D {
        sum[i] = sum[i].wrapping_add(b[i]);
    }
    sum
}

/// Returns `a - b`.
#[inline(always)]
pub fn sub<const D: usize>(a: Place<D>, b: Place<D>) -> Place<D> {
    let mut difference = a;
    for i in 0..D {
        difference[i] = difference[i].wrapping_sub(b[i]);
    }
    difference
}

/// The frames of a region: one frame for the whole region or one frame for each point.
#[derive(Debug, Clone, Copy)]
pub enum Frames<'a, const D: usize> {
    /// The same frame at every point.
    Constant(Frame<D>),
    /// One frame for each point, in row-major order.
    Dense(&'a [Frame<D>]),
}

impl<const D: usize> Frames<'_, D> {
    /// Returns the frame of the point at a row-major position.
    #[inline(always)]
    pub fn at(&self, index: usize) -> Frame<D> {
        match self {
            Self::Constant(frame) => *frame,
            Self::Dense(frames) => frames[index],
        }
    }

    /// Returns an error unless there is one frame for all points, or one for each of `points`.
    pub fn check(&self, points: usize) -> Result<()> {
        match self {
            Self::Dense(frames) if frames.len() != points => Err(Error::Shape {
                argument: "frames",
                expected: vec![points, D, D],
                got: vec![frames.len(), D, D],
            }),
            _ => Ok(()),
        }
    }

    /// Returns whether the frame is the identity at every point.
    pub fn is_identity(&self) -> bool {
        matches!(self, Self::Constant(frame) if *frame == identity())
    }
}

/// Returns F = J^-1 in fixed point, with entries clamped to the range from -64 to 64, or the
/// identity if the frame is singular.
pub fn inverse<const D: usize>(frame: &Frame<D>) -> [[i32; D]; D] {
    // Gauss-Jordan elimination with row pivoting.
    let mut a = frame.map(|row| row.map(f64::from));
    let mut b = [[0.0; D]; D];
    for i in 0..D {
        b[i][i] = 1.0;
    }
    for column in 0..D {
        let mut pivot = column;
        for row in column + 1..D {
            if a[row][column].abs() > a[pivot][column].abs() {
                pivot = row;
            }
        }
        if a[pivot][column] == 0.0 {
            return identity().map(|row| row.map(i32::from));
        }
        a.swap(column, pivot);
        b.swap(column, pivot);
        let scale = 1.0 / a[column][column];
        for j in 0..D {
            a[column][j] *= scale;
            b[column][j] *= scale;
        }
        for row in 0..D {
            if row != column {
                let factor = a[row][column];
                for j in 0..D {
                    a[row][j] -= factor * a[column][j];
                    b[row][j] -= factor * b[column][j];
                }
            }
        }
    }
    let unit = f64::from(ONE);
    // Larger entries would spread a window beyond any lattice.
    let most = 64.0 * unit;
    b.map(|row| row.map(|x| (x * unit * unit).clamp(-most, most).round() as i32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn half_way_goes_up_on_both_sides_of_zero() {
        assert_eq!(nearest([ONE / 2, -ONE / 2, ONE / 2 - 1]), [1, 0, 0]);
    }

    proptest! {
        #[test]
        fn the_inverse_undoes_a_rotation(turn in 0.0f64..6.0, step in prop::array::uniform2(-4i32..5)) {
            let one = f64::from(ONE);
            let [c, s] = [turn.cos(), turn.sin()].map(|x| (x * one).round() as i16);
            let frame = [[c, -s], [s, c]];
            let back = inverse(&frame);
            let there = apply(&frame, step);
            for i in 0..2 {
                let x: i64 = (0..2).map(|j| i64::from(back[i][j]) * i64::from(there[j])).sum();
                prop_assert!((x / i64::from(ONE) - i64::from(step[i] * ONE)).abs() < 16);
            }
        }
    }
}
