//! A shape moved by an affine map: the source coordinates of the pixels that it may cover.

use super::Point;
use crate::foundation::grid::Grid;
use crate::foundation::memory;
use crate::foundation::par::Monitor;
use crate::kernels::gather::{Exemplar, Interpolation, gather};
use crate::{Error, Result};

/// A shape as the signed distance to its outline over a box. Distances are positive inside.
#[derive(Debug, Clone, Copy)]
pub struct Shape<'a> {
    /// Distances in pixels, row by row.
    pub distance: &'a [f32],
    /// Shape of the box.
    pub grid: Grid<2>,
    /// First pixel of the box in the source.
    pub origin: Point,
}

/// An affine map `p -> centre + shift + matrix (p - centre)`, and the inverse of its matrix.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    centre: Point,
    shift: Point,
    matrix: [[f64; 2]; 2],
    inverse: [[f64; 2]; 2],
}

/// The window of a canvas that a moved shape may cover.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// First pixel.
    pub low: [usize; 2],
    /// Rows and columns.
    pub shape: [usize; 2],
}

/// A moved shape. All arrays have one entry for each pixel of the window.
#[derive(Debug, Clone)]
pub struct Placed {
    /// Source coordinates of each pixel.
    pub places: Vec<[f32; 2]>,
    /// Distance to the outline at the source, in source pixels.
    pub distance: Vec<f32>,
    /// Flags of the pixels whose source coordinates are on the canvas, which source and output share.
    pub inside: Vec<bool>,
    /// Flags of the pixels whose source is on the canvas and more than the requested depth inside the shape.
    pub deep: Vec<bool>,
    /// Number of pixels whose source is on the canvas and inside the shape.
    pub count: usize,
}

impl Motion {
    /// Returns a map with a linear part about a centre, followed by a shift.
    ///
    /// # Errors
    /// A value is not finite, or the linear part is not invertible.
    pub fn new(centre: Point, shift: Point, matrix: [[f64; 2]; 2]) -> Result<Self> {
        let given = centre.iter().chain(&shift).chain(matrix.as_flattened());
        let inverse = invert(matrix).filter(|_| given.clone().all(|x| x.is_finite()));
        let inverse = inverse.ok_or_else(|| {
            Error::value(
                "matrix",
                format!(
                    "must be finite and invertible, with finite centre and shift, got {matrix:?}"
                ),
            )
        })?;
        Ok(Self {
            centre,
            shift,
            matrix,
            inverse,
        })
    }

    /// The linear part of the inverse map.
    pub fn inverse(&self) -> [[f64; 2]; 2] {
        self.inverse
    }

    fn apply(&self, point: Point) -> Point {
        let away = [point[0] - self.centre[0], point[1] - self.centre[1]];
        std::array::from_fn(|axis| {
            let row = self.matrix[axis];
            self.centre[axis] + self.shift[axis] + (row[0] * away[0] + row[1] * away[1])
        })
    }

    /// Returns whether the map moves whole pixels to whole pixels.
    fn is_whole(&self) -> bool {
        let mut parts = self.matrix.as_flattened().iter().chain(&self.shift);
        parts.all(|x| x.round_ties_even() == *x)
    }

    /// Returns the window of a canvas that a shape may cover, or `None` if the shape is outside the
    /// canvas.
    pub fn window(&self, shape: &Shape<'_>, canvas: [usize; 2]) -> Option<Window> {
        // Map the corners of the box, and clip their bounding box to the canvas.
        let [rows, columns] = shape.grid.shape().map(|n| (n - 1) as f64);
        let corners = [[0.0, 0.0], [0.0, columns], [rows, 0.0], [rows, columns]]
            .map(|away| self.apply([shape.origin[0] + away[0], shape.origin[1] + away[1]]));
        let (mut low, mut extent) = ([0; 2], [0; 2]);
        for axis in 0..2 {
            let along = corners.map(|corner| corner[axis]);
            let least = along.into_iter().fold(f64::INFINITY, f64::min);
            let most = along.into_iter().fold(f64::NEG_INFINITY, f64::max);
            // A cast clamps negative values to zero.
            let (first, last) = (least.floor() as usize, (most.ceil() + 1.0) as usize);
            let last = last.min(canvas[axis]);
            if last <= first {
                return None;
            }
            low[axis] = first;
            extent[axis] = last - first;
        }
        Some(Window { low, shape: extent })
    }

    /// Moves a shape. Returns the source coordinates and distances of the pixels of a window.
    ///
    /// # Errors
    /// The number of distances does not match the box, memory for the window is not available, or the monitor was
    /// cancelled.
    pub fn place(
        &self,
        shape: &Shape<'_>,
        window: &Window,
        canvas: [usize; 2],
        depth: f32,
        monitor: &Monitor,
    ) -> Result<Placed> {
        let pixels = memory::product("window", &window.shape)?;
        memory::room("the moved shape", pixels, 24)?;
        let away = |axis: usize, i: usize| {
            (window.low[axis] + i) as f64 - self.centre[axis] - self.shift[axis]
        };
        // Compute the source coordinates of the window.
        let whole = self.is_whole();
        let inverse = &self.inverse;
        let columns: Vec<f64> = (0..window.shape[1]).map(|i| away(1, i)).collect();
        let mut places = Vec::with_capacity(pixels);
        for row in (0..window.shape[0]).map(|i| away(0, i)) {
            places.extend(columns.iter().map(|&column| -> [f32; 2] {
                std::array::from_fn(|axis| {
                    let back = inverse[axis][0] * row + inverse[axis][1] * column;
                    let at = back + self.centre[axis];
                    // Round if whole pixels map to whole pixels, because subtracting and adding the centre causes
                    // rounding errors.
                    (if whole { at.round_ties_even() } else { at }) as f32
                })
            }));
        }
        // Interpolate the distance to the outline at these coordinates.
        let origin = shape.origin.map(|x| x as f32);
        let within: Vec<[f32; 2]> = places
            .iter()
            .map(|at| [at[0] - origin[0], at[1] - origin[1]])
            .collect();
        let mut distance = vec![0.0f32; places.len()];
        let outline = Exemplar::new(shape.distance, shape.grid, 1)?;
        let linear = Interpolation::Linear;
        gather(&[outline], &[], &within, linear, &mut distance, monitor)?;
        // Mark the pixels whose source is on the canvas.
        let last = canvas.map(|n| (n as f32) - 1.0);
        let has = |at: &[f32; 2]| (0..2).all(|axis| (0.0..=last[axis]).contains(&at[axis]));
        let inside: Vec<bool> = places.iter().map(has).collect();
        let marked = |least: f32| {
            inside
                .iter()
                .zip(&distance)
                .map(move |(&i, &d)| i && d > least)
        };
        Ok(Placed {
            count: marked(0.0).filter(|m| *m).count(),
            deep: marked(depth).collect(),
            places,
            distance,
            inside,
        })
    }
}

/// Returns the inverse of a matrix, by elimination with the larger entry of the first column as
/// pivot, or `None` if it is singular.
fn invert(matrix: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let turned = matrix[1][0].abs() > matrix[0][0].abs();
    let (first, second) = if turned {
        (matrix[1], matrix[0])
    } else {
        (matrix[0], matrix[1])
    };
    let reciprocal = 1.0 / first[0];
    let factor = second[0] * reciprocal;
    let rest = 1.0 / (second[1] - factor * first[1]);
    if !reciprocal.is_finite() || !rest.is_finite() {
        return None;
    }
    // Solve for the two columns of the identity. Their rows are exchanged like those of the matrix.
    let mut inverse = [[0.0; 2]; 2];
    for (column, (a, b)) in [(1.0, 0.0), (0.0, 1.0)].into_iter().enumerate() {
        let (a, b) = if turned { (b, a) } else { (a, b) };
        let lower = (b - factor * a) * rest;
        inverse[0][column] = (a - first[1] * lower) * reciprocal;
        inverse[1][column] = lower;
    }
    Some(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(distance: &[f32]) -> Shape<'_> {
        Shape {
            distance,
            grid: Grid::new([3, 4], [false; 2]).unwrap(),
            origin: [2.0, 1.0],
        }
    }

    #[test]
    fn a_shift_by_whole_pixels_moves_samples() {
        let distance: Vec<f32> = (0..12).map(|i| i as f32 - 4.0).collect();
        let shape = shape(&distance);
        let motion = Motion::new([3.1, 2.7], [4.0, -2.0], [[1.0, 0.0], [0.0, 1.0]]).unwrap();
        let window = motion.window(&shape, [20, 20]).unwrap();
        // The centre causes rounding, so the window may have one more pixel on each side.
        assert!(window.low[0] <= 6 && window.low[0] + window.shape[0] >= 9);
        assert_eq!(window.low[1], 0);
        let placed = motion
            .place(&shape, &window, [20, 20], 3.0, &Monitor::default())
            .unwrap();
        let columns = window.shape[1];
        for (k, at) in placed.places.iter().enumerate() {
            let (row, column) = (window.low[0] + k / columns, window.low[1] + k % columns);
            assert_eq!(*at, [row as f32 - 4.0, column as f32 + 2.0]);
            assert_eq!(placed.deep[k], placed.distance[k] > 3.0);
        }
        assert_eq!(
            placed.count,
            placed.distance.iter().filter(|d| **d > 0.0).count()
        );
    }

    #[test]
    fn the_inverse_undoes_the_matrix() {
        for matrix in [
            [[0.8, -0.6], [0.6, 0.8]],
            [[0.1, 2.0], [-3.0, 0.4]],
            [[0.0, 1.0], [1.0, 0.0]],
        ] {
            let inverse = invert(matrix).unwrap();
            for (i, row) in matrix.iter().enumerate() {
                for j in 0..2 {
                    let entry = row[0] * inverse[0][j] + row[1] * inverse[1][j];
                    assert!((entry - f64::from(u8::from(i == j))).abs() < 1e-12);
                }
            }
        }
        assert!(invert([[1.0, 2.0], [2.0, 4.0]]).is_none());
        assert!(Motion::new([0.0; 2], [f64::NAN, 0.0], [[1.0, 0.0], [0.0, 1.0]]).is_err());
    }

    #[test]
    fn what_leaves_the_canvas_has_no_window() {
        let distance = [1.0; 12];
        let away = Motion::new([3.0, 2.0], [-9.0, 0.0], [[1.0, 0.0], [0.0, 1.0]]).unwrap();
        assert_eq!(away.window(&shape(&distance), [20, 20]), None);
        let past = Motion::new([3.0, 2.0], [0.0, 40.0], [[1.0, 0.0], [0.0, 1.0]]).unwrap();
        assert_eq!(past.window(&shape(&distance), [20, 20]), None);
    }
}
