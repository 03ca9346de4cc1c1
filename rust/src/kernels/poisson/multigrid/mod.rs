//! Solver for pixels under a mask: conjugate gradients, preconditioned by a multigrid cycle.
//!
//! McAdams, Sifakis and Teran, *A parallel multigrid Poisson solver for fluids simulation on large
//! grids*, SCA 2010, describe the combination. Cells of 2 x 2 pixels are merged, interpolation is
//! bilinear, and each level has the same five-point operator. The search directions are those of
//! Polak and Ribière, which tolerate a cycle that is not quite symmetric. Sides of odd length make
//! it asymmetric.

mod level;

use super::{Domain, Edge};
use crate::foundation::par::{self, Monitor};
use crate::foundation::simd::wide_fn;
use crate::{Error, Result};
use level::{Level, Side, Vectors};

/// Stopping criterion: norm of the residual relative to the first right-hand side. The error is
/// then far below a grey level.
const TOLERANCE: f64 = 1e-5;
/// Maximum number of cycles, far more than any tested mask needs.
const MAX_CYCLES: usize = 200;
/// Step lengths of the relaxation: reciprocals of the roots of the Chebyshev polynomial on [1/2,
/// 2]. This is the part of the spectrum that the coarser level does not represent.
const STEPS: [f32; 2] = [0.561, 1.390];
/// Number of pairs of relaxations, one for each step length, that solve the coarsest level.
const COARSEST: usize = 8;
/// Number of samples in each parallel task.
const CHUNK: usize = 1 << 14;

pub(super) fn spread(
    domain: &Domain<'_>,
    mask: &[bool],
    flow: &mut [f32],
    monitor: &Monitor,
) -> Result<()> {
    // Find the window of the free pixels and the conditions at its sides.
    let [rows, columns, channels] = domain.shape;
    let free = |y: usize, x: usize| {
        mask[y * columns + x]
            && (domain.edges[0] != Edge::Fixed || (y > 0 && y + 1 < rows))
            && (domain.edges[1] != Edge::Fixed || (x > 0 && x + 1 < columns))
    };
    let Some([(top, height), (left, width)]) = window(domain, free) else {
        flow.fill(0.0);
        return Ok(());
    };
    let ends = [(top, height, rows), (left, width, columns)];
    let sides = std::array::from_fn(|axis| {
        let (first, count, all) = ends[axis];
        [first == 0, first + count == all].map(|at_end| match domain.edges[axis] {
            Edge::Wrap => Side::Wrap,
            Edge::Free if at_end => Side::Mirror,
            _ => Side::Fixed,
        })
    });
    // Build the levels until the coarsest has at most 3 pixels on each side.
    let screening = domain.screening as f32;
    let inside = |r: usize, c: usize| free(top + r, left + c);
    let mut levels = vec![Level::finest([height, width], sides, screening, inside)];
    while let Some(last) = levels.last()
        && last.rows.max(last.columns) > 3
    {
        let coarse = last.coarser();
        levels.push(coarse);
    }
    let fine = &levels[0];
    let mut vectors: Vec<Vectors> = levels.iter().map(Level::vectors).collect();
    // Solve the channels one after the other.
    monitor.expect(channels as u64);
    for c in 0..channels {
        fine.each_row(&mut vectors[0].b, |r, out| {
            let from = ((top + r) * columns + left) * channels + c;
            let samples = flow[from..].iter().step_by(channels);
            for (x, (out, sample)) in out.iter_mut().zip(samples).enumerate() {
                *out = if inside(r, x) { *sample } else { 0.0 };
            }
        });
        let solution = conjugate_gradients(&levels, &mut vectors, monitor)?;
        par::chunks_mut(flow, columns * channels, |y, out| {
            out.iter_mut()
                .skip(c)
                .step_by(channels)
                .for_each(|o| *o = 0.0);
            if (top..top + height).contains(&y) {
                let from = &solution[fine.at(y - top, 0)..][..width];
                let out = out[left * channels + c..].iter_mut().step_by(channels);
                out.zip(from).for_each(|(o, s)| *o = *s);
            }
        });
        monitor.advance(1)?;
    }
    Ok(())
}

/// Returns the rows and the columns (first, number) that contain all free pixels. A wrapped axis is
/// kept whole.
fn window(domain: &Domain<'_>, free: impl Fn(usize, usize) -> bool) -> Option<[(usize, usize); 2]> {
    let [rows, columns, _] = domain.shape;
    let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
    for y in 0..rows {
        let mut found = (0..columns).filter(|&x| free(y, x));
        let Some(first) = found.next() else {
            continue;
        };
        let last = (first..columns).rfind(|&x| free(y, x)).unwrap_or(first);
        low = [low[0].min(y), low[1].min(first)];
        high = [high[0].max(y), high[1].max(last)];
    }
    if low[0] == usize::MAX {
        return None;
    }
    Some(std::array::from_fn(|axis| {
        if domain.edges[axis] == Edge::Wrap {
            (0, domain.shape[axis])
        } else {
            (low[axis], high[axis] + 1 - low[axis])
        }
    }))
}

/// Performs one cycle: `vectors[0].x` becomes an approximate solution for `vectors[0].b`.
fn cycle(levels: &[Level], vectors: &mut [Vectors]) {
    let (Some((level, coarser)), Some((v, below))) =
        (levels.split_first(), vectors.split_first_mut())
    else {
        return;
    };
    level.begin(v, STEPS);
    let (Some(next), Some(w)) = (coarser.first(), below.first_mut()) else {
        for _ in 1..COARSEST {
            STEPS.iter().for_each(|&step| level.relax(v, step));
        }
        return;
    };
    level.restrict(v, next, &mut w.b);
    cycle(coarser, below);
    level.prolong(next, &below[0].x, &mut v.x);
    STEPS.iter().rev().for_each(|&step| level.relax(v, step));
}

/// Solves for the right-hand side `vectors[0].b`, and overwrites it. Sums run over fixed chunks in order, so the
/// result does not depend on the number of threads.
fn conjugate_gradients(
    levels: &[Level],
    vectors: &mut [Vectors],
    monitor: &Monitor,
) -> Result<Vec<f32>> {
    let level = &levels[0];
    let [mut x, mut p, mut ap] = std::array::from_fn(|_| level.zeros());
    let [first] = inner(level, &vectors[0].b, [&vectors[0].b]);
    let (mut rz, mut alpha) = (0.0, 0.0);
    for step in 0..MAX_CYCLES {
        if first == 0.0 {
            return Ok(x);
        }
        monitor.check()?;
        // The cycle preconditions the residual.
        cycle(levels, vectors);
        let Vectors { x: z, b: r, .. } = &mut vectors[0];
        let [next, along] = inner(level, z, [&*r, &ap]);
        let previous = std::mem::replace(&mut rz, next);
        let beta = if step == 0 {
            0.0
        } else {
            (-alpha * along / previous) as f32
        };
        level.each_row(&mut p, |r, p| {
            turn(p, beta, &z[level.at(r, 0)..]);
        });
        // Advance along the new direction to the minimum.
        level.apply(&p, &mut ap);
        let [curvature] = inner(level, &p, [&ap]);
        if !(curvature > 0.0 && rz.is_finite()) {
            break;
        }
        alpha = rz / curvature;
        let length = alpha as f32;
        level.each_row(&mut x, |r, x| {
            advance(x, length, &p[level.at(r, 0)..]);
        });
        level.each_row(r, |y, r| {
            advance(r, -length, &ap[level.at(y, 0)..]);
        });
        let [left] = inner(level, r, [&*r]);
        if left <= TOLERANCE * TOLERANCE * first {
            return Ok(x);
        }
    }
    if x.iter().all(|v| v.is_finite()) && first.is_finite() {
        return Ok(x);
    }
    Err(Error::value(
        "image",
        "values and differences are too large for the solver; scale both down",
    ))
}

wide_fn! {
    /// Computes `p = z + beta p`.
    fn turn(p: &mut [f32], beta: f32, z: &[f32]) {
        p.iter_mut().zip(z).for_each(|(p, z)| *p = z + beta * *p);
    }
}

wide_fn! {
    /// Computes `x += step p`.
    fn advance(x: &mut [f32], step: f32, p: &[f32]) {
        x.iter_mut().zip(p).for_each(|(x, p)| *x += step * p);
    }
}

/// Returns the dot products of one vector with others, without the margins.
fn inner<const N: usize>(level: &Level, a: &[f32], others: [&[f32]; N]) -> [f64; N] {
    let rows = level.chunk();
    let parts = par::map(level.rows.div_ceil(rows), |chunk| {
        let mut lanes = [[0.0f64; 8]; N];
        for r in chunk * rows..((chunk + 1) * rows).min(level.rows) {
            let row = level.at(r, 0)..level.at(r, level.columns);
            multiply::<N>(&a[row.clone()], others.map(|b| &b[row.clone()]), &mut lanes);
        }
        lanes.map(|lanes| lanes.iter().sum::<f64>())
    });
    std::array::from_fn(|k| parts.iter().map(|part| part[k]).sum())
}

wide_fn! {
    /// Multiplies a row by each of the other rows, element by element, and adds the products to that row's eight
    /// partial sums (`lanes`).
    fn multiply<const N: usize>(a: &[f32], others: [&[f32]; N], lanes: &mut [[f64; 8]; N]) {
        for (lanes, b) in lanes.iter_mut().zip(others) {
            let mut sums = *lanes;
            let (a, a_rest) = a.as_chunks::<8>();
            let (b, b_rest) = b.as_chunks::<8>();
            for (a, b) in a.iter().zip(b) {
                for l in 0..8 {
                    sums[l] += f64::from(a[l]) * f64::from(b[l]);
                }
            }
            for (sum, (a, b)) in sums.iter_mut().zip(a_rest.iter().zip(b_rest)) {
                *sum += f64::from(*a) * f64::from(*b);
            }
            *lanes = sums;
        }
    }
}
