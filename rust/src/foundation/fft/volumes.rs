//! Transforms of real volumes, on all threads. An image is a volume whose planes have one row.

use super::{Complex, Lines, join, split};
use crate::foundation::par;

/// Transforms of real `f32` volumes of one size.
///
/// A spectrum contains only the half that determines the rest, with its axes in reverse order. Each
/// pass then reads and writes whole planes.
pub(crate) struct Volumes {
    size: [usize; 3],
    /// Transforms along each axis.
    lines: [Lines<f32>; 3],
}

impl Volumes {
    /// Plans the transforms of volumes of `size` planes, rows and columns.
    pub(crate) fn new(size: [usize; 3]) -> Self {
        Self {
            size,
            lines: size.map(Lines::new),
        }
    }

    /// Returns the smallest size of at least `n` that has only the prime factors 2, 3 and 5,
    /// because its transform is fast.
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

    /// Number of columns of a spectrum.
    fn half(&self) -> usize {
        self.size[2] / 2 + 1
    }

    /// Returns the spectrum of a volume.
    pub(crate) fn forward(&self, volume: &[f32]) -> Vec<Complex<f32>> {
        let ([planes, rows, columns], half) = (self.size, self.half());
        let zero = Complex::default();
        // Transform along columns, then along rows, two planes at a time.
        let mut middle = vec![zero; planes * half * rows];
        par::chunks_mut(&mut middle, 2 * half * rows, |pair, out| {
            let (mut line, mut work) = (vec![zero; columns], Vec::new());
            let first = &volume[2 * pair * rows * columns..];
            let second = first.get(rows * columns..).unwrap_or_default();
            for row in 0..rows {
                for (column, z) in line.iter_mut().enumerate() {
                    let at = row * columns + column;
                    *z = Complex::new(first[at], second.get(at).copied().unwrap_or(0.0));
                }
                self.lines[2].forward(&mut line, &mut work);
                for column in 0..half {
                    let (a, b) = split(line[column], line[(columns - column) % columns]);
                    out[column * rows + row] = a;
                    if let Some(out) = out.get_mut((half + column) * rows + row) {
                        *out = b;
                    }
                }
            }
            if rows > 1 {
                self.lines[1].forward(out, &mut work);
            }
        });
        // Transform along planes, one column at a time.
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

    /// Returns the volume of a spectrum, multiplied by the number of its points.
    pub(crate) fn inverse(&self, mut spectrum: Vec<Complex<f32>>) -> Vec<f32> {
        let ([planes, rows, columns], half) = (self.size, self.half());
        let zero = Complex::default();
        par::chunks_mut(&mut spectrum, rows * planes, |_, column| {
            self.lines[0].inverse(column, &mut Vec::new());
            // Store the rows of each plane next to each other.
            let old = column.to_vec();
            for plane in 0..planes {
                for row in 0..rows {
                    column[plane * rows + row] = old[row * planes + plane];
                }
            }
        });
        let mut volume = vec![0.0; planes * rows * columns];
        par::chunks_mut(&mut volume, 2 * rows * columns, |pair, out| {
            // The last plane of an odd number is paired with zeros.
            let (mut lines, mut work) = (vec![zero; 2 * half * rows], Vec::new());
            for (plane, lines) in (2 * pair..planes).zip(lines.chunks_exact_mut(half * rows)) {
                for column in 0..half {
                    let from = &spectrum[(column * planes + plane) * rows..][..rows];
                    lines[column * rows..][..rows].copy_from_slice(from);
                }
            }
            if rows > 1 {
                self.lines[1].inverse(&mut lines, &mut work);
            }
            let mut line = vec![zero; columns];
            for row in 0..rows {
                join(&mut line, |k| {
                    (lines[k * rows + row], lines[(half + k) * rows + row])
                });
                self.lines[2].inverse(&mut line, &mut work);
                for (column, z) in line.iter().enumerate() {
                    out[row * columns + column] = z.re;
                    if let Some(out) = out.get_mut((rows + row) * columns + column) {
                        *out = z.im;
                    }
                }
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
        for size in [[1, 1, 1], [6, 1, 7], [7, 1, 6], [4, 5, 6], [7, 8, 9]] {
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
