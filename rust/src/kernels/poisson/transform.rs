//! Transforms along one axis that diagonalise its second difference.
//!
//! They are sine transforms for fixed ends, cosine transforms for free ends, and real Fourier
//! series for a wrapped axis. One complex transform of the axis's own length serves two rows, and
//! several such pairs are transformed together. See Press et al., *Numerical Recipes*, 12.4, and
//! Makhoul, *A fast cosine transform in one and two dimensions*, IEEE ASSP 1980.

use std::f64::consts::PI;

use super::Edge;
use crate::foundation::fft::{Complex, LANES, Lanes, Lines, split};
use crate::foundation::libm::sincos;

/// The transform of an axis of `len` unknowns.
pub(super) struct Transform {
    edge: Edge,
    len: usize,
    lines: Lines<Lanes>,
    /// Sines for folding the rows (fixed ends), or rotations by half a sample (free ends).
    twiddles: Vec<Complex<f32>>,
    /// Eigenvalue of each coefficient.
    pub(super) eigenvalues: Vec<f64>,
}

/// Scratch memory of a transform.
#[derive(Default)]
pub(super) struct Scratch {
    line: Vec<Complex<Lanes>>,
    work: Vec<Complex<Lanes>>,
}

impl Transform {
    pub(super) fn new(edge: Edge, len: usize) -> Self {
        // Sines of n unknowns have a period of n + 1 steps.
        let size = if edge == Edge::Fixed { len + 1 } else { len };
        let n = size as f64;
        let twiddles = match edge {
            Edge::Fixed => (0..size)
                .map(|j| Complex::new(sincos(PI * j as f64 / n).0 as f32, 0.0))
                .collect(),
            Edge::Free => (0..size)
                .map(|k| {
                    let (sin, cos) = sincos(PI * k as f64 / (2.0 * n));
                    Complex::new(cos as f32, sin as f32)
                })
                .collect(),
            Edge::Wrap => Vec::new(),
        };
        let eigenvalues = (0..len)
            .map(|slot| {
                let turn = match edge {
                    Edge::Fixed => PI * (slot + 1) as f64 / n,
                    Edge::Free => PI * slot as f64 / n,
                    Edge::Wrap => 2.0 * PI * slot.div_ceil(2) as f64 / n,
                };
                4.0 * sincos(turn / 2.0).0.powi(2)
            })
            .collect();
        Self {
            edge,
            len,
            lines: Lines::new(size),
            twiddles,
            eigenvalues,
        }
    }

    /// Replaces pairs of rows by their coefficients. `a` contains the first row of each pair, `b`
    /// the second.
    pub(super) fn forward(&self, a: &mut [Lanes], b: &mut [Lanes], scratch: &mut Scratch) {
        let Scratch { line, work } = scratch;
        match self.edge {
            Edge::Fixed => self.sines(a, b, 1.0, line, work),
            Edge::Free => self.cosines(a, b, line, work),
            Edge::Wrap => {
                line.clear();
                line.extend(a.iter().zip(b.iter()).map(|(&a, &b)| Complex::new(a, b)));
                self.lines.forward(line, work);
                let n = self.len;
                (a[0], b[0]) = (line[0].re, line[0].im);
                for k in 1..n.div_ceil(2) {
                    let (u, v) = split(line[k], line[n - k]);
                    (a[2 * k - 1], a[2 * k]) = (u.re, u.im);
                    (b[2 * k - 1], b[2 * k]) = (v.re, v.im);
                }
                if n.is_multiple_of(2) {
                    (a[n - 1], b[n - 1]) = (line[n / 2].re, line[n / 2].im);
                }
            }
        }
    }

    /// Replaces the coefficients of pairs of rows by the rows.
    pub(super) fn inverse(&self, a: &mut [Lanes], b: &mut [Lanes], scratch: &mut Scratch) {
        let Scratch { line, work } = scratch;
        let n = self.len;
        match self.edge {
            // The sine transform is its own inverse, except for a factor.
            Edge::Fixed => self.sines(a, b, 2.0 / (n + 1) as f32, line, work),
            Edge::Free => {
                line.clear();
                let norm = Lanes::all(1.0 / n as f32);
                line.push(Complex::new(a[0], b[0]) * norm);
                // Combine (a - i a2) + i (b - i b2), and rotate by half a sample.
                let ends = a[1..].iter().zip(a[1..].iter().rev());
                let others = b[1..].iter().zip(b[1..].iter().rev());
                let turned = ends.zip(others).zip(&self.twiddles[1..]);
                line.extend(turned.map(|(((a, a2), (b, b2)), t)| {
                    Complex::new(*a + *b2, *b - *a2) * spread(t) * norm
                }));
                self.lines.inverse(line, work);
                for j in 0..n.div_ceil(2) {
                    (a[2 * j], b[2 * j]) = (line[j].re, line[j].im);
                }
                for j in 0..n / 2 {
                    let z = line[n - 1 - j];
                    (a[2 * j + 1], b[2 * j + 1]) = (z.re, z.im);
                }
            }
            Edge::Wrap => {
                line.clear();
                line.resize(n, Complex::default());
                let norm = Lanes::all(1.0 / n as f32);
                line[0] = Complex::new(a[0], b[0]) * norm;
                for k in 1..n.div_ceil(2) {
                    let u = Complex::new(a[2 * k - 1], a[2 * k]) * norm;
                    let v = Complex::new(b[2 * k - 1], b[2 * k]) * norm;
                    line[k] = Complex::new(u.re - v.im, u.im + v.re);
                    line[n - k] = Complex::new(u.re + v.im, v.re - u.im);
                }
                if n.is_multiple_of(2) {
                    line[n / 2] = Complex::new(a[n - 1], b[n - 1]) * norm;
                }
                self.lines.inverse(line, work);
                for ((a, b), z) in a.iter_mut().zip(b.iter_mut()).zip(line.iter()) {
                    (*a, *b) = (z.re, z.im);
                }
            }
        }
    }

    fn sines(
        &self,
        a: &mut [Lanes],
        b: &mut [Lanes],
        factor: f32,
        line: &mut Vec<Complex<Lanes>>,
        work: &mut Vec<Complex<Lanes>>,
    ) {
        line.clear();
        line.push(Complex::default());
        let ends = a.iter().zip(a.iter().rev());
        let others = b.iter().zip(b.iter().rev());
        let folded = ends.zip(others).zip(&self.twiddles[1..]);
        line.extend(folded.map(|(((a1, a2), (b1, b2)), s)| {
            let (s, half) = (Lanes::all(s.re), Lanes::all(0.5));
            Complex::new(
                s * (*a1 + *a2) + half * (*a1 - *a2),
                s * (*b1 + *b2) + half * (*b1 - *b2),
            )
        }));
        self.lines.forward(line, work);
        // Odd coefficients are a running sum, in f64 so that errors do not accumulate.
        let (mut sum_a, mut sum_b) = ([0.0; LANES], [0.0; LANES]);
        let run = |sum: &mut [f64; LANES], part: f64, next: Lanes| {
            for (sum, next) in sum.iter_mut().zip(next.0) {
                *sum += part * f64::from(next);
            }
            Lanes(std::array::from_fn(|k| factor * sum[k] as f32))
        };
        a[0] = run(&mut sum_a, 0.5, line[0].re);
        b[0] = run(&mut sum_b, 0.5, line[0].im);
        let minus = Lanes::all(-factor);
        let mirrored = line[1..].iter().zip(line[1..].iter().rev());
        let slots = a[1..].chunks_mut(2).zip(b[1..].chunks_mut(2));
        for ((a, b), (&z, &mirror)) in slots.zip(mirrored) {
            let (u, v) = split(z, mirror);
            (a[0], b[0]) = (minus * u.im, minus * v.im);
            let next = (run(&mut sum_a, 1.0, u.re), run(&mut sum_b, 1.0, v.re));
            if let ([_, a], [_, b]) = (a, b) {
                (*a, *b) = next;
            }
        }
    }

    fn cosines(
        &self,
        a: &mut [Lanes],
        b: &mut [Lanes],
        line: &mut Vec<Complex<Lanes>>,
        work: &mut Vec<Complex<Lanes>>,
    ) {
        let n = self.len;
        line.clear();
        line.extend((0..n.div_ceil(2)).map(|j| Complex::new(a[2 * j], b[2 * j])));
        line.extend(
            (0..n / 2)
                .rev()
                .map(|j| Complex::new(a[2 * j + 1], b[2 * j + 1])),
        );
        self.lines.forward(line, work);
        (a[0], b[0]) = (line[0].re, line[0].im);
        let mirrored = line[1..].iter().zip(line[1..].iter().rev());
        let slots = a[1..].iter_mut().zip(&mut b[1..]);
        for (((a, b), (&z, &mirror)), t) in slots.zip(mirrored).zip(&self.twiddles[1..]) {
            let (u, v) = split(z, mirror);
            let t = spread(t);
            *a = u.re * t.re + u.im * t.im;
            *b = v.re * t.re + v.im * t.im;
        }
    }
}

/// Returns the same complex number for all lanes.
#[inline(always)]
fn spread(z: &Complex<f32>) -> Complex<Lanes> {
    Complex::new(Lanes::all(z.re), Lanes::all(z.im))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns the second difference of a row.
    fn difference(row: &[f32], edge: Edge) -> Vec<f32> {
        let n = row.len();
        let at = |i: isize, own: f32| match edge {
            Edge::Fixed => usize::try_from(i)
                .ok()
                .and_then(|i| row.get(i))
                .copied()
                .unwrap_or(0.0),
            Edge::Free => usize::try_from(i)
                .ok()
                .and_then(|i| row.get(i))
                .copied()
                .unwrap_or(own),
            Edge::Wrap => row[i.rem_euclid(n as isize) as usize],
        };
        (0..n)
            .map(|i| {
                let own = row[i];
                2.0 * own - at(i as isize - 1, own) - at(i as isize + 1, own)
            })
            .collect()
    }

    proptest! {
        #[test]
        fn multiplies_by_the_eigenvalues(
            n in 1usize..70,
            edge in prop::sample::select(vec![Edge::Fixed, Edge::Wrap, Edge::Free]),
            seed: u64,
        ) {
            let noise = crate::foundation::hash::Noise::new(seed);
            let rows: [Vec<f32>; 2 * LANES] = std::array::from_fn(|r| {
                (0..n as u32).map(|i| noise.uniform([i, r as u32, 0, 0]) as f32 - 0.5).collect()
            });
            let beside = |first: usize| -> Vec<Lanes> {
                (0..n).map(|i| Lanes(std::array::from_fn(|k| rows[first + 2 * k][i]))).collect()
            };
            let transform = Transform::new(edge, n);
            let mut scratch = Scratch::default();
            let (mut a, mut b) = (beside(0), beside(1));
            transform.forward(&mut a, &mut b, &mut scratch);
            for (k, &l) in transform.eigenvalues.iter().enumerate() {
                a[k] = a[k] * Lanes::all(l as f32);
            }
            transform.inverse(&mut a, &mut b, &mut scratch);
            for k in 0..LANES {
                for (x, y) in a.iter().zip(difference(&rows[2 * k], edge)) {
                    prop_assert!((x.0[k] - y).abs() < 1e-4, "{:?} {}", x, y);
                }
                for (x, y) in b.iter().zip(&rows[2 * k + 1]) {
                    prop_assert!((x.0[k] - y).abs() < 1e-5, "{:?} {}", x, y);
                }
            }
        }
    }
}
