//! Principal components of many samples.
//!
//! Only the leading components are computed, by subspace iteration (Golub and Van Loan, *Matrix
//! Computations*, section 8.2) with the covariance matrix. This takes a few products with a thin
//! matrix instead of a full decomposition. The start vectors are hashed, sums have a fixed order,
//! and the largest entry of each component is made positive. The same samples therefore always give
//! the same axes.

use crate::foundation::hash::Noise;
use crate::foundation::par;

/// Number of products with the covariance matrix. Relevant components converge much earlier.
const ROUNDS: usize = 24;
/// Number of vectors that are iterated in addition to the requested ones. They make the last
/// requested vectors converge faster.
const SPARE: usize = 8;
/// Number of covariance rows that one task computes.
const ROWS: usize = 8;

/// The mean and the principal axes of a set of samples.
#[derive(Debug, Clone)]
pub struct Principal {
    /// Mean sample.
    pub mean: Vec<f32>,
    /// Orthonormal axes, in order of decreasing variance.
    pub axes: Vec<Vec<f32>>,
    /// Variance of the samples, summed over all dimensions.
    pub variance: f64,
    /// Fraction of the variance that the axes keep, 0 to 1.
    pub kept: f64,
}

/// Returns the `keep` leading principal components of samples of `n` numbers each.
pub fn principal(samples: &[f32], n: usize, keep: usize) -> Principal {
    let count = samples.len() / n;
    let mut sums = vec![0.0f64; n];
    for sample in samples.chunks_exact(n) {
        for (sum, &x) in sums.iter_mut().zip(sample) {
            *sum += f64::from(x);
        }
    }
    let mean: Vec<f32> = sums
        .iter()
        .map(|&s| (s / count.max(1) as f64) as f32)
        .collect();
    let covariance = covariance(samples, &mean);
    let variance: f64 = (0..n).map(|i| covariance[i * n + i]).sum();
    let keep = keep.min(n);
    let width = (keep + SPARE).min(n);
    // Start from hashed vectors, so that the result is reproducible.
    let noise = Noise::new(0);
    let mut basis: Vec<Vec<f64>> = (0..width)
        .map(|k| {
            (0..n)
                .map(|i| noise.uniform([i as u32, k as u32, 0, 0]) - 0.5)
                .collect()
        })
        .collect();
    orthonormalise(&mut basis);
    for _ in 0..ROUNDS {
        basis = par::map(width, |k| multiply(&covariance, &basis[k]));
        orthonormalise(&mut basis);
    }
    // Compute the eigenvectors of the small matrix B^T C B within the subspace.
    let images = par::map(width, |k| multiply(&covariance, &basis[k]));
    let mut small: Vec<Vec<f64>> = (0..width)
        .map(|i| (0..width).map(|j| dot(&basis[i], &images[j])).collect())
        .collect();
    let turn = jacobi(&mut small);
    // Sort the eigenvectors by decreasing variance, and transform them back to the space of the
    // samples.
    let mut order: Vec<usize> = (0..width).collect();
    order.sort_by(|&a, &b| small[b][b].total_cmp(&small[a][a]).then(a.cmp(&b)));
    let mut kept = 0.0;
    let axes = order[..keep]
        .iter()
        .map(|&k| {
            kept += small[k][k].max(0.0);
            let mut axis = vec![0.0f64; n];
            for (row, vector) in turn.iter().zip(&basis) {
                for (a, &b) in axis.iter_mut().zip(vector) {
                    *a += row[k] * b;
                }
            }
            let largest = axis
                .iter()
                .fold(0.0f64, |m, &x| if x.abs() > m.abs() { x } else { m });
            let sign = if largest < 0.0 { -1.0 } else { 1.0 };
            axis.iter().map(|&x| (x * sign) as f32).collect()
        })
        .collect();
    Principal {
        mean,
        axes,
        variance,
        kept: if variance > 0.0 { kept / variance } else { 1.0 },
    }
}

/// Returns the covariance matrix as rows of f64.
fn covariance(samples: &[f32], mean: &[f32]) -> Vec<f64> {
    let n = mean.len();
    let count = (samples.len() / n).max(1);
    let mut matrix = vec![0.0f64; n * n];
    par::chunks_mut(&mut matrix, ROWS * n, |block, rows| {
        let first = block * ROWS;
        let mut sums = vec![0.0f32; rows.len()];
        let mut centred = vec![0.0f32; n];
        // Sum short runs in f32, which the compiler vectorises, and add the runs in f64. The
        // rounding error is that of a short run.
        for run in samples.chunks(64 * n) {
            sums.fill(0.0);
            for sample in run.chunks_exact(n) {
                for (c, (&x, &m)) in centred.iter_mut().zip(sample.iter().zip(mean)) {
                    *c = x - m;
                }
                for (i, row) in sums.chunks_exact_mut(n).enumerate() {
                    let x = centred[first + i];
                    for (sum, &c) in row.iter_mut().zip(&centred) {
                        *sum += x * c;
                    }
                }
            }
            for (to, &sum) in rows.iter_mut().zip(&sums) {
                *to += f64::from(sum);
            }
        }
        for x in rows {
            *x /= count as f64;
        }
    });
    matrix
}

fn multiply(matrix: &[f64], vector: &[f64]) -> Vec<f64> {
    matrix
        .chunks_exact(vector.len())
        .map(|row| dot(row, vector))
        .collect()
}

/// Returns a dot product. Eight partial sums let the compiler use SIMD registers.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (heads, tails) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = heads
        .remainder()
        .iter()
        .zip(tails.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (x, y) in heads.zip(tails) {
        for i in 0..8 {
            sums[i] += x[i] * y[i];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Orthonormalises vectors by the Gram-Schmidt process, twice for accuracy. A vector that depends
/// on previous vectors becomes zero.
fn orthonormalise(basis: &mut [Vec<f64>]) {
    for k in 0..basis.len() {
        let (before, rest) = basis.split_at_mut(k);
        let vector = &mut rest[0];
        let length = dot(vector, vector).sqrt();
        for _ in 0..2 {
            for other in before.iter() {
                let along = dot(vector, other);
                for (x, &y) in vector.iter_mut().zip(other) {
                    *x -= along * y;
                }
            }
        }
        let left = dot(vector, vector).sqrt();
        let scale = if left > 1e-10 * length {
            1.0 / left
        } else {
            0.0
        };
        for x in vector.iter_mut() {
            *x *= scale;
        }
    }
}

/// Makes a small symmetric matrix diagonal by Jacobi rotations, and returns the product of the
/// rotations.
fn jacobi(a: &mut [Vec<f64>]) -> Vec<Vec<f64>> {
    let n = a.len();
    let mut turn: Vec<Vec<f64>> = (0..n)
        .map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect())
        .collect();
    // At most 30 sweeps over all pairs (p, q). Each rotation makes the entry (p, q) zero.
    for _ in 0..30 {
        let off: f64 = (0..n)
            .flat_map(|i| (0..i).map(move |j| (i, j)))
            .map(|(i, j)| a[i][j] * a[i][j])
            .sum();
        let diagonal: f64 = (0..n).map(|i| a[i][i] * a[i][i]).sum();
        if off <= 1e-24 * diagonal {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for k in 0..n {
                    let (x, y) = (a[k][p], a[k][q]);
                    (a[k][p], a[k][q]) = (c * x - s * y, s * x + c * y);
                }
                for k in 0..n {
                    let (x, y) = (a[p][k], a[q][k]);
                    (a[p][k], a[q][k]) = (c * x - s * y, s * x + c * y);
                    let (x, y) = (turn[k][p], turn[k][q]);
                    (turn[k][p], turn[k][q]) = (c * x - s * y, s * x + c * y);
                }
            }
        }
    }
    turn
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples with known axes: independent coefficients, with decreasing spread, along cosine
    /// directions.
    fn samples(n: usize, count: usize) -> Vec<f32> {
        let noise = Noise::new(3);
        let mut out = Vec::with_capacity(n * count);
        for s in 0..count {
            let coefficient: Vec<f64> = (0..n)
                .map(|k| (noise.uniform([s as u32, k as u32, 1, 0]) - 0.5) * 8.0 / (1.0 + k as f64))
                .collect();
            for i in 0..n {
                let x: f64 = (0..n).map(|k| coefficient[k] * cosine(n, k, i)).sum();
                out.push(x as f32 + 5.0);
            }
        }
        out
    }

    fn cosine(n: usize, k: usize, i: usize) -> f64 {
        let scale = if k == 0 { 1.0 } else { 2.0f64.sqrt() } / (n as f64).sqrt();
        scale * (std::f64::consts::PI * (i as f64 + 0.5) * k as f64 / n as f64).cos()
    }

    #[test]
    fn finds_the_axes_of_known_samples() {
        let n = 20;
        let found = principal(&samples(n, 4000), n, 4);
        for (k, axis) in found.axes.iter().enumerate() {
            let along: f64 = (0..n).map(|i| f64::from(axis[i]) * cosine(n, k, i)).sum();
            assert!(along.abs() > 0.98, "axis {k}: {along}");
            let largest = axis
                .iter()
                .fold(0.0f32, |m, &x| if x.abs() > m.abs() { x } else { m });
            assert!(largest > 0.0);
        }
        assert!((0.85..0.95).contains(&found.kept), "{}", found.kept);
        assert!(found.mean.iter().all(|m| (m - 5.0).abs() < 0.3));
    }

    #[test]
    fn constant_samples_have_no_variance() {
        let found = principal(&[2.0; 60], 6, 3);
        assert_eq!(found.variance, 0.0);
        assert_eq!(found.kept, 1.0);
        assert!(found.axes.iter().flatten().all(|x| x.is_finite()));
    }

    #[test]
    fn threads_do_not_change_a_bit() {
        let data = samples(30, 500);
        let [one, two, seven] =
            [1, 2, 7].map(|t| par::install(t, || principal(&data, 30, 6).axes).unwrap());
        assert_eq!(one, two);
        assert_eq!(one, seven);
    }
}
