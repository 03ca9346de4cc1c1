//! Transforms of real volumes, by all threads; an image is a volume of one row a plane.

use std::sync::Arc;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use super::{Complex, Lines};
use crate::foundation::par;

/// Transforms of real volumes of one size, of `f32`.
///
/// A spectrum is the half that tells the rest, with its axes reversed: each pass then reads and writes whole planes.
pub(crate) struct Volumes {
    size: [usize; 3],
    real: Arc<dyn RealToComplex<f32>>,
    back: Arc<dyn ComplexToReal<f32>>,
    /// Along the first axis and the second one.
    lines: [Lines<f32>; 2],
}

impl Volumes {
    /// Plans the transforms of volumes of so many planes, rows and columns.
    pub(crate) fn new(size: [usize; 3]) -> Self {
        let mut planner = RealFftPlanner::new();
        Self {
            size,
            real: planner.plan_fft_forward(size[2]),
            back: planner.plan_fft_inverse(size[2]),
            lines: [Lines::new(size[0]), Lines::new(size[1])],
        }
    }

    /// A size of at least `n` along an axis whose transform is fast.
    pub(crate) fn fast(n: usize) -> usize {
        let smooth = |mut m: usize| {
            for p in [2, 3, 5] {
                while m.is_multiple_of(p) {
                    m /= p;
                }
            }
            m == 1
        };
        (n..).find(|&m| smooth(m)).unwrap_or(n)
    }

    /// Columns of a spectrum.
    fn half(&self) -> usize {
        self.size[2] / 2 + 1
    }

    /// The spectrum of a volume.
    pub(crate) fn forward(&self, volume: &[f32]) -> Vec<Complex<f32>> {
        let ([planes, rows, columns], half) = (self.size, self.half());
        let zero = Complex::default();
        // Plane by plane: columns, then rows.
        let mut middle = vec![zero; planes * half * rows];
        par::chunks_mut(&mut middle, half * rows, |plane, out| {
            let mut line = vec![0.0; columns];
            let mut spectrum = vec![zero; half];
            let mut work = vec![zero; self.real.get_scratch_len()];
            for row in 0..rows {
                line.copy_from_slice(&volume[(plane * rows + row) * columns..][..columns]);
                // The lengths are those of the plan, so the transform cannot refuse them.
                let _ = self
                    .real
                    .process_with_scratch(&mut line, &mut spectrum, &mut work);
                for (column, &value) in spectrum.iter().enumerate() {
                    out[column * rows + row] = value;
                }
            }
            if rows > 1 {
                self.lines[1].forward(out, &mut work);
            }
        });
        // Column by column: planes.
        let mut spectrum = vec![zero; middle.len()];
        par::chunks_mut(&mut spectrum, rows * planes, |column, out| {
            for plane in 0..planes {
                let from = &middle[(plane * half + column) * rows..][..rows];
                for (row, &value) in from.iter().enumerate() {
                    out[row * planes + plane] = value;
                }
            }
            self.lines[0].forward(out, &mut Vec::new());
        });
        spectrum
    }

    /// The volume of a spectrum, which is used up; times the number of its points.
    pub(crate) fn inverse(&self, mut spectrum: Vec<Complex<f32>>) -> Vec<f32> {
        let ([planes, rows, columns], half) = (self.size, self.half());
        let zero = Complex::default();
        par::chunks_mut(&mut spectrum, rows * planes, |_, column| {
            self.lines[0].inverse(column, &mut Vec::new());
            // So that a plane's rows lie together.
            let old = column.to_vec();
            for plane in 0..planes {
                for row in 0..rows {
                    column[plane * rows + row] = old[row * planes + plane];
                }
            }
        });
        let mut volume = vec![0.0; planes * rows * columns];
        par::chunks_mut(&mut volume, rows * columns, |plane, out| {
            let mut lines = vec![zero; half * rows];
            let mut line = vec![zero; half];
            let mut work = vec![zero; self.back.get_scratch_len()];
            for column in 0..half {
                let from = &spectrum[(column * planes + plane) * rows..][..rows];
                lines[column * rows..][..rows].copy_from_slice(from);
            }
            if rows > 1 {
                self.lines[1].inverse(&mut lines, &mut work);
            }
            for row in 0..rows {
                for (column, value) in line.iter_mut().enumerate() {
                    *value = lines[column * rows + row];
                }
                // Of a real line these are real; rounding left a trace that the transform would refuse.
                line[0].im = 0.0;
                if columns % 2 == 0 {
                    line[half - 1].im = 0.0;
                }
                let out = &mut out[row * columns..][..columns];
                let _ = self.back.process_with_scratch(&mut line, out, &mut work);
            }
        });
        volume
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::foundation::hash::Noise;

    #[test]
    fn there_and_back_multiplies_by_the_points() {
        for size in [[1, 1, 1], [6, 1, 7], [4, 5, 6], [7, 8, 9]] {
            let points: usize = size.iter().product();
            let noise = Noise::new(1);
            let volume: Vec<f32> = (0..points)
                .map(|i| noise.uniform([i as u32, 0, 0, 0]) as f32 - 0.5)
                .collect();
            let plan = Volumes::new(size);
            let spectrum = plan.forward(&volume);
            let total: f32 = volume.iter().sum();
            assert!((spectrum[0].re - total).abs() < 1e-4);
            let back = plan.inverse(spectrum);
            for (x, y) in volume.iter().zip(back) {
                assert!((x - y / points as f32).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn fast_sizes_have_small_factors() {
        let sizes: Vec<_> = [1, 7, 31, 64, 97, 127].map(Volumes::fast).into();
        assert_eq!(sizes, [1, 8, 32, 64, 100, 128]);
    }
}
