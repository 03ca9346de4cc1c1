//! Pixels under a mask: conjugate gradients, preconditioned by a multigrid cycle on squares of two by two.
//!
//! McAdams, Sifakis and Teran, *A parallel multigrid Poisson solver for fluids simulation on large grids*, SCA 2010, for the
//! combination; squares are joined as in Braess, *Towards algebraic multigrid for elliptic problems of second
//! order*, Computing 1995: sums of the links between them, halved because constants overrate a coarse difference.

mod level;

use super::{Edge, Problem, residual};
use crate::par::{self, Monitor};
use crate::{Error, Result};
use level::{Level, Vectors};

/// The right-hand side left over, relative to the first, at which the solution is good: far below a grey level.
const TOLERANCE: f64 = 1e-5;
/// More cycles than any mask was seen to need, by far.
const MAX_CYCLES: usize = 200;
/// Steps of relaxation: the roots of the Chebyshev polynomial on [1/2, 2], the part of the spectrum that the coarser
/// level does not see.
const STEPS: [f32; 2] = [0.561, 1.390];
/// Relaxations that solve the coarsest level.
const COARSEST: usize = 8;
/// Samples a task takes at a time.
const CHUNK: usize = 1 << 14;

pub(super) fn solve(
    problem: &Problem<'_>,
    mask: &[bool],
    out: &mut [f32],
    monitor: &Monitor,
) -> Result<()> {
    let [rows, columns, channels] = problem.shape;
    let free = |y: usize, x: usize| {
        mask[y * columns + x]
            && (problem.edges[0] != Edge::Fixed || (y > 0 && y + 1 < rows))
            && (problem.edges[1] != Edge::Fixed || (x > 0 && x + 1 < columns))
    };
    let Some(window) = window(problem, free) else {
        return Ok(());
    };
    let levels = hierarchy(problem, window, free);
    let fine = &levels[0];
    let mut vectors: Vec<Vectors> = levels.iter().map(Level::vectors).collect();
    monitor.expect(channels as u64);
    let [top, left] = window.map(|w| w.0);
    let mut right = vec![0.0; fine.len()];
    let mut side = vec![0.0; columns * channels];
    for c in 0..channels {
        for y in 0..fine.rows {
            residual(problem, top + y, &mut side);
            for x in 0..fine.columns {
                let inside = free(top + y, left + x);
                right[fine.at(y, x)] = if inside {
                    side[(left + x) * channels + c]
                } else {
                    0.0
                };
            }
        }
        let x = conjugate_gradients(&levels, &mut vectors, &mut right, monitor)?;
        for y in 0..fine.rows {
            for column in 0..fine.columns {
                let at = ((top + y) * columns + left + column) * channels + c;
                out[at] += x[fine.at(y, column)];
            }
        }
        monitor.advance(1)?;
    }
    Ok(())
}

/// The rows and the columns (first, number) that hold all free pixels; a cyclic axis is kept whole.
fn window(
    problem: &Problem<'_>,
    free: impl Fn(usize, usize) -> bool,
) -> Option<[(usize, usize); 2]> {
    let [rows, columns, _] = problem.shape;
    let (mut low, mut high) = ([usize::MAX; 2], [0; 2]);
    for y in 0..rows {
        for x in (0..columns).filter(|&x| free(y, x)) {
            low = [low[0].min(y), low[1].min(x)];
            high = [high[0].max(y), high[1].max(x)];
        }
    }
    if low[0] == usize::MAX {
        return None;
    }
    Some(std::array::from_fn(|axis| {
        if problem.edges[axis] == Edge::Wrap {
            (0, problem.shape[axis])
        } else {
            (low[axis], high[axis] + 1 - low[axis])
        }
    }))
}

fn hierarchy(
    problem: &Problem<'_>,
    window: [(usize, usize); 2],
    free: impl Fn(usize, usize) -> bool,
) -> Vec<Level> {
    let [(top, rows), (left, columns)] = window;
    let wrap = problem.edges.map(|e| e == Edge::Wrap);
    let mut fine = Level::empty(rows, columns, wrap);
    let [height, width, _] = problem.shape;
    for r in 0..rows {
        for c in 0..columns {
            let (y, x) = (top + r, left + c);
            if !free(y, x) {
                continue;
            }
            let i = fine.at(r, c);
            fine.screened[i] = problem.screening as f32;
            let next_row = if wrap[0] {
                Some((y + 1) % height)
            } else {
                Some(y + 1).filter(|&n| n < height)
            };
            let next_column = if wrap[1] {
                Some((x + 1) % width)
            } else {
                Some(x + 1).filter(|&n| n < width)
            };
            let row_before = if wrap[0] {
                Some((y + height - 1) % height)
            } else {
                y.checked_sub(1)
            };
            let column_before = if wrap[1] {
                Some((x + width - 1) % width)
            } else {
                x.checked_sub(1)
            };
            // A cyclic axis of one pixel has no differences.
            if let Some(n) = next_row.filter(|&n| n != y) {
                if free(n, x) {
                    fine.down[i] = 1.0
                } else {
                    fine.tied[i] += 1.0
                }
            }
            if let Some(n) = next_column.filter(|&n| n != x) {
                if free(y, n) {
                    fine.right[i] = 1.0
                } else {
                    fine.tied[i] += 1.0
                }
            }
            if row_before.is_some_and(|n| n != y && !free(n, x)) {
                fine.tied[i] += 1.0;
            }
            if column_before.is_some_and(|n| n != x && !free(y, n)) {
                fine.tied[i] += 1.0;
            }
        }
    }
    fine.finish();
    let mut levels = vec![fine];
    while let Some(last) = levels.last()
        && last.rows.max(last.columns) > 3
    {
        let coarse = last.coarser();
        levels.push(coarse);
    }
    levels
}

/// One symmetric cycle: `vectors[0].x` becomes about the solution for `vectors[0].b`.
fn cycle(levels: &[Level], vectors: &mut [Vectors]) {
    let (Some((level, coarser)), Some((v, below))) =
        (levels.split_first(), vectors.split_first_mut())
    else {
        return;
    };
    level.begin(v, STEPS[0]);
    level.relax(v, STEPS[1]);
    let times = if coarser.is_empty() { COARSEST } else { 1 };
    for _ in 1..times {
        STEPS.iter().for_each(|&step| level.relax(v, step));
    }
    if let (Some(next), Some(w)) = (coarser.first(), below.first_mut()) {
        let Vectors { x, other, b } = &mut *v;
        level.lack(x, b, other);
        next.each_row(&mut w.b, |r, out| {
            out.fill(0.0);
            for r in 2 * r..(2 * r + 2).min(level.rows) {
                let row = &other[level.at(r, 0)..][..level.columns];
                for (out, pair) in out.iter_mut().zip(row.chunks(2)) {
                    *out += pair.iter().sum::<f32>();
                }
            }
        });
        cycle(coarser, below);
        let coarse = &below[0].x;
        level.each_row(&mut v.x, |r, out| {
            let from = &coarse[next.at(r / 2, 0)..][..next.columns];
            let free = level.reciprocal[level.at(r, 0)..][..level.columns].chunks(2);
            for ((out, free), from) in out.chunks_mut(2).zip(free).zip(from) {
                for (out, free) in out.iter_mut().zip(free) {
                    *out += if *free > 0.0 { *from } else { 0.0 };
                }
            }
        });
    }
    for _ in 0..times {
        STEPS.iter().rev().for_each(|&step| level.relax(v, step));
    }
}

/// Solves for `r`, which is used up. Dot products are summed by fixed chunks, in order.
fn conjugate_gradients(
    levels: &[Level],
    vectors: &mut [Vectors],
    r: &mut [f32],
    monitor: &Monitor,
) -> Result<Vec<f32>> {
    let level = &levels[0];
    let mut x = vec![0.0f32; level.len()];
    let first = dot(r, r);
    if first == 0.0 {
        return Ok(x);
    }
    let mut p = vec![0.0f32; level.len()];
    let mut ap = vec![0.0f32; level.len()];
    let mut rz = 0.0;
    for step in 0..MAX_CYCLES {
        monitor.check()?;
        vectors[0].b.copy_from_slice(r);
        cycle(levels, vectors);
        let z = &vectors[0].x;
        let previous = std::mem::replace(&mut rz, inner(level, r, z));
        let beta = if step == 0 {
            0.0
        } else {
            (rz / previous) as f32
        };
        par::chunks_mut(&mut p, CHUNK, |i, p| {
            let z = &z[i * CHUNK..];
            p.iter_mut().zip(z).for_each(|(p, z)| *p = z + beta * *p);
        });
        level.apply(&p, &mut ap);
        let curvature = inner(level, &p, &ap);
        if !(curvature > 0.0 && rz.is_finite()) {
            break;
        }
        let alpha = (rz / curvature) as f32;
        par::chunks_mut(&mut x, CHUNK, |i, x| {
            let p = &p[i * CHUNK..];
            x.iter_mut().zip(p).for_each(|(x, p)| *x += alpha * p);
        });
        par::chunks_mut(r, CHUNK, |i, r| {
            let ap = &ap[i * CHUNK..];
            r.iter_mut().zip(ap).for_each(|(r, ap)| *r -= alpha * ap);
        });
        if inner(level, r, r) <= TOLERANCE * TOLERANCE * first {
            return Ok(x);
        }
    }
    if r.iter().all(|v| v.is_finite()) {
        return Ok(x);
    }
    Err(Error::value(
        "image",
        "values and differences are too large for the solver; scale them down",
    ))
}

fn dot(a: &[f32], b: &[f32]) -> f64 {
    let parts = par::map(a.len().div_ceil(CHUNK), |chunk| {
        let (a, b) = (&a[chunk * CHUNK..], &b[chunk * CHUNK..]);
        let n = CHUNK.min(a.len());
        let mut lanes = [0.0f64; 8];
        for (a, b) in a[..n].chunks(8).zip(b[..n].chunks(8)) {
            for (lane, (a, b)) in lanes.iter_mut().zip(a.iter().zip(b)) {
                *lane += f64::from(*a) * f64::from(*b);
            }
        }
        lanes.iter().sum::<f64>()
    });
    parts.iter().sum()
}

/// [`dot`] of two vectors without what the margins repeat.
fn inner(level: &Level, a: &[f32], b: &[f32]) -> f64 {
    if level.wrap == [false; 2] {
        return dot(a, b);
    }
    let rows = par::map(level.rows, |r| {
        let at = level.at(r, 0);
        let (a, b) = (&a[at..][..level.columns], &b[at..][..level.columns]);
        let products = a.iter().zip(b).map(|(&a, &b)| f64::from(a) * f64::from(b));
        products.sum::<f64>()
    });
    rows.iter().sum()
}
