//! Signed distances to the outlines of labelled pieces of an image.
//!
//! Meijster, Roerdink and Hesselink, *A general algorithm for computing distance transforms in
//! linear time*, ISMM 2000. The method finds the nearest mark along each column, then the lower
//! envelope of parabolas along each row. Squared distances are integers, so the distances are
//! exact.

use crate::foundation::error::check_shape;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// A piece of a label image, and the window around it.
#[derive(Debug, Clone, Copy)]
pub struct Piece {
    /// Label of the piece.
    pub label: i32,
    /// First pixel of the window. The window may extend beyond the image, whose edge pixels are
    /// then repeated.
    pub low: [i64; 2],
    /// Rows and columns of the window.
    pub shape: [usize; 2],
}

/// Maximum number of pixels of a window along an axis. Squares of distances then fit integers
/// exactly.
const MOST: usize = 1 << 20;

/// Returns the signed distances of each piece's window: from each pixel to the nearest pixel across the outline, in
/// pixels. Distances are negative outside the piece. The result is `None` if all pixels of the window are on the same
/// side of the outline.
///
/// # Errors
/// The size of the label image does not match its shape, a window is empty or too large, or the monitor was cancelled.
pub fn outlines(
    labels: &[i32],
    shape: [usize; 2],
    pieces: &[Piece],
    monitor: &Monitor,
) -> Result<Vec<Option<Vec<f32>>>> {
    check_shape("labels", &shape, labels.len())?;
    if labels.is_empty() {
        return Err(Error::value(
            "labels",
            format!("must have at least 1 pixel along each axis, got shape {shape:?}"),
        ));
    }
    // Check the windows, then compute the distances of the pieces in parallel.
    let fits = |n: &usize| (1..=MOST).contains(n);
    if let Some(piece) = pieces.iter().find(|p| !p.shape.iter().all(fits)) {
        return Err(Error::value(
            "windows",
            format!(
                "must have 1 to {MOST} pixels on each side, got {:?}",
                piece.shape
            ),
        ));
    }
    let pixels = |p: &Piece| p.shape[0].saturating_mul(p.shape[1]);
    let all = pieces.iter().map(pixels).fold(0, usize::saturating_add);
    memory::room("the distances", all, 24)?;
    par::map(pieces.len(), |k| {
        monitor.check()?;
        Ok(measure(
            &cut_out(labels, shape, &pieces[k]),
            pieces[k].shape,
        ))
    })
    .into_iter()
    .collect()
}

/// Returns a flag for each pixel of the window: true if the pixel belongs to the piece.
fn cut_out(labels: &[i32], shape: [usize; 2], piece: &Piece) -> Vec<bool> {
    let bring = |axis: usize, i: usize| {
        let at = piece.low[axis].saturating_add(i as i64);
        at.clamp(0, shape[axis] as i64 - 1) as usize
    };
    let columns: Vec<usize> = (0..piece.shape[1]).map(|i| bring(1, i)).collect();
    let mut mine = Vec::with_capacity(piece.shape[0] * piece.shape[1]);
    for row in (0..piece.shape[0]).map(|i| bring(0, i) * shape[1]) {
        mine.extend(columns.iter().map(|c| labels[row + c] == piece.label));
    }
    mine
}

/// Returns the signed distances of the pixels of a window, or `None` if all or none of them belong to the piece.
fn measure(mine: &[bool], shape: [usize; 2]) -> Option<Vec<f32>> {
    if mine.iter().all(|m| *m) || !mine.contains(&true) {
        return None;
    }
    let (inner, outer) = (squares(mine, shape, false), squares(mine, shape, true));
    let signed = |((&m, i), o): ((&bool, &i64), &i64)| {
        if m {
            (*i as f64).sqrt() as f32
        } else {
            -(*o as f64).sqrt() as f32
        }
    };
    Some(mine.iter().zip(&inner).zip(&outer).map(signed).collect())
}

/// Returns the squared distance of each pixel to the nearest pixel whose flag equals `mark`.
fn squares(mine: &[bool], [rows, columns]: [usize; 2], mark: bool) -> Vec<i64> {
    // This value exceeds every distance between two pixels of the window.
    let far = (rows + columns) as i64;
    let mut along = vec![far; mine.len()];
    for row in 0..rows {
        for c in 0..columns {
            let i = row * columns + c;
            along[i] = if mine[i] == mark {
                0
            } else if row > 0 {
                (along[i - columns] + 1).min(far)
            } else {
                far
            };
        }
    }
    for row in (0..rows - 1).rev() {
        for c in 0..columns {
            let i = row * columns + c;
            along[i] = along[i].min(along[i + columns] + 1);
        }
    }
    // Combine the distances along columns into distances in the plane, row by row.
    let mut envelope = Envelope::default();
    for row in along.chunks_exact_mut(columns) {
        envelope.lower(row);
    }
    along
}

/// The lower envelope of the parabolas of a row.
#[derive(Default)]
struct Envelope {
    heights: Vec<i64>,
    /// The vertex of each parabola in the envelope, and the first position where it is the lowest.
    parts: Vec<(i64, i64)>,
}

impl Envelope {
    /// Replaces distances along columns by squared distances in the plane.
    fn lower(&mut self, row: &mut [i64]) {
        self.heights.clear();
        self.heights.extend(row.iter().map(|g| g * g));
        let (heights, parts) = (&self.heights, &mut self.parts);
        let value = |x: i64, middle: i64| (x - middle) * (x - middle) + heights[middle as usize];
        parts.clear();
        parts.push((0, 0));
        // Build the envelope from left to right. A parabola that is above the new one at its own
        // start is removed.
        for u in 1..row.len() as i64 {
            while let Some(&(middle, from)) = parts.last() {
                if value(from, middle) <= value(from, u) {
                    break;
                }
                parts.pop();
            }
            match parts.last() {
                None => parts.push((u, 0)),
                Some(&(middle, _)) => {
                    // Last position where the previous parabola is not higher.
                    let (a, b) = (heights[middle as usize], heights[u as usize]);
                    let until = (u * u - middle * middle + b - a).div_euclid(2 * (u - middle));
                    if until + 1 < row.len() as i64 {
                        parts.push((u, until + 1));
                    }
                }
            }
        }
        // Read the envelope from right to left.
        for x in (0..row.len()).rev() {
            while let Some(&(_, from)) = parts.last()
                && from > x as i64
            {
                parts.pop();
            }
            if let Some(&(middle, _)) = parts.last() {
                row[x] = value(x as i64, middle);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn distances_are_those_to_the_nearest_pixel_across(
            rows in 1usize..9, columns in 1usize..9, seed in prop::collection::vec(0i32..3, 64),
        ) {
            let labels = &seed[..rows * columns];
            let piece = Piece { label: 1, low: [-2, -1], shape: [rows + 3, columns + 4] };
            let found = &outlines(labels, [rows, columns], &[piece], &Monitor::default()).unwrap()[0];
            let mine = cut_out(labels, [rows, columns], &piece);
            let n = piece.shape[1];
            let Some(found) = found else {
                prop_assert!(mine.iter().all(|m| *m) || !mine.contains(&true));
                return Ok(());
            };
            for (i, &here) in mine.iter().enumerate() {
                let across = (0..mine.len()).filter(|&j| mine[j] != here);
                let nearest = across.map(|j| {
                    let (down, right) = ((i / n).abs_diff(j / n), (i % n).abs_diff(j % n));
                    down * down + right * right
                });
                let distance = (nearest.min().unwrap() as f64).sqrt() as f32;
                prop_assert_eq!(found[i], if here { distance } else { -distance });
            }
        }
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let piece = Piece {
            label: 1,
            low: [i64::MIN, i64::MAX],
            shape: [2, 2],
        };
        let monitor = Monitor::default();
        assert_eq!(
            outlines(&[1; 4], [2, 2], &[piece], &monitor).unwrap(),
            [None]
        );
        assert!(outlines(&[1; 4], [2, 3], &[piece], &monitor).is_err());
        assert!(outlines(&[], [0, 0], &[], &monitor).is_err());
        let empty = Piece {
            shape: [0, 2],
            ..piece
        };
        assert!(outlines(&[1; 4], [2, 2], &[empty], &monitor).is_err());
    }
}
