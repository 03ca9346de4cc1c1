//! Odd-even reduction: before any transform, every second row is eliminated, then every second of
//! the remaining rows.
//!
//! Rows are coupled by `A u[r] - u[r-1] - u[r+1] = f[r]`, where A acts along a row. For the rows
//! that stay, let `p[r] = A^-1 f[r]` and `u[r] = p[r] + w[r]`. At twice the step, a system of the
//! same kind remains:
//!
//! `(A^2 - 2) w[r] - w[r-2] - w[r+2] = f[r-1] + f[r+1] + 2 p[r] + p[r-2] + p[r+2]`.
//!
//! The eliminated rows are `u[r] = A^-1 (f[r] + u[r-1] + u[r+1])` (Hockney, *A fast direct solution
//! of Poisson's equation using Fourier analysis*, JACM 1965). The use of p avoids multiplications
//! by A, so errors do not grow. This is Buneman's variant (Buzbee, Golub and Nielson, *On direct
//! methods for solving Poisson's equations*, SIAM Journal on Numerical Analysis 1970). A transform
//! of a row takes many times as long as a system along it, because solutions of A decay within a
//! few pixels.
//!
//! The last row may have its own operator B. If it stays, `B p[r] = f[r]` and `(A B - 1) w[r] -
//! w[r-2] = f[r-1] + p[r] + p[r-2]`. The reduced system then also has its own operator in this row,
//! which stays again. Eliminating it would multiply the system of its neighbour by B.

use super::along::{Inverse, Scratch};
use super::{Edge, Field, Layout, ROWS, sweep::Systems, transformed};
use crate::foundation::par::{self, Monitor};
use crate::foundation::simd::wide_fn;

/// Maximum number of reductions. Each reduction saves half as much as the previous one, and needs
/// twice as many systems for each row.
const DEPTH: usize = 2;

/// Number of rows below which a reduction is not worthwhile.
const FEW: usize = 4;

/// Rows that are added to a solution: every second row of an array.
#[derive(Clone, Copy)]
pub(super) struct Base<'a> {
    rows: &'a [f32],
    layout: Layout,
    first: usize,
}

impl Base<'_> {
    /// Adds the base row that belongs to row `r`.
    pub(super) fn add_to(&self, row: &mut [f32], r: usize) {
        let base = self.layout.row(self.rows, self.first + 2 * r);
        row.iter_mut().zip(base).for_each(|(x, b)| *x += b);
    }
}

/// Rows to solve: all rows, or the rows that remain after a reduction.
pub(super) struct Level<'a> {
    pub(super) systems: Systems,
    pub(super) layout: Layout,
    pub(super) base: Option<Base<'a>>,
    /// Number of progress steps that follow after these rows.
    pub(super) ahead: u64,
}

/// Solves all rows in place and adds their base rows.
pub(super) fn solve(field: &Field, level: &Level<'_>, rows: &mut [f32], monitor: &Monitor) {
    let Level {
        systems,
        layout,
        base,
        ahead,
    } = level;
    let Layout { width, len, .. } = *layout;
    let count = rows.len() / width;
    let Some(first) = first_to_stay(systems, count) else {
        return transformed(field, level, rows, monitor);
    };
    // Prepare the inverse of A for inner rows, and of B for the ends.
    let inverses = [false, true].map(|end| {
        let roots = roots(systems, end);
        let diagonals: Vec<f64> = roots.iter().map(|r| 4.0 + field.screening - r).collect();
        Inverse::new(field.edge, len / field.channels, field.channels, &diagonals)
    });
    let inverse = |r: usize| {
        let [top, bottom] = systems.ends.each_ref().map(Option::is_some);
        &inverses[usize::from(top && r == 0 || bottom && r + 1 == count)]
    };
    let beside = |r: usize, step: isize| -> Option<usize> {
        let at = r as isize + step;
        match systems.edge {
            Edge::Wrap => Some(at.rem_euclid(count as isize) as usize),
            _ => usize::try_from(at).ok().filter(|&r| r < count),
        }
    };
    let nothing = vec![0.0; len];

    // Step 1: compute p for the rows that stay.
    par::chunks_mut(rows, ROWS * width, |chunk, out| {
        let mut scratch = Scratch::default();
        for (r, row) in (chunk * ROWS..).zip(out.chunks_exact_mut(width)) {
            if r % 2 == first && monitor.check().is_ok() {
                let fill = |to: &mut [f32], row: &[f32]| to.copy_from_slice(row);
                inverse(r).apply(layout.of_mut(row), fill, &mut scratch);
            }
        }
    });

    // Step 2: compute the right-hand sides of the reduced system.
    let whole = &*rows;
    let row = |r: Option<usize>| r.map_or(&nothing[..], |r| layout.row(whole, r));
    let mut half = vec![0.0; (count - first).div_ceil(2) * len];
    par::chunks_mut(&mut half, ROWS * len, |chunk, out| {
        if monitor.check().is_err() {
            return;
        }
        for (i, out) in (chunk * ROWS..).zip(out.chunks_exact_mut(len)) {
            let r = first + 2 * i;
            let next = [-1, 1].map(|step| beside(r, step));
            let own = next.iter().flatten().count() as f32;
            let two_on = [-2, 2].map(|step| row(beside(r, step)));
            left_over(out, next.map(row), own, row(Some(r)), two_on);
        }
    });

    // Step 3: solve the reduced system, and add p.
    let kept = [first == 0, (count - 1 - first).is_multiple_of(2)];
    let below = Base {
        rows: whole,
        layout: *layout,
        first,
    };
    let compact = Layout {
        width: len,
        first: 0,
        len,
    };
    let next = Level {
        systems: systems.squared(kept),
        layout: compact,
        base: Some(below),
        ahead: ahead + count as u64,
    };
    solve(field, &next, &mut half, monitor);

    // Step 4: solve the eliminated rows between.
    let solved = |r: Option<usize>| r.map_or(&nothing[..], |r| compact.row(&half, (r - first) / 2));
    par::chunks_mut(rows, ROWS * width, |chunk, out| {
        if monitor.check().is_err() {
            return;
        }
        let mut scratch = Scratch::default();
        for (r, out) in (chunk * ROWS..).zip(out.chunks_exact_mut(width)) {
            let out = layout.of_mut(out);
            if r % 2 == first {
                out.copy_from_slice(solved(Some(r)));
            } else {
                let [a, b] = [-1, 1].map(|step| solved(beside(r, step)));
                let fill = |to: &mut [f32], row: &[f32]| add_rows(to, row, a, b);
                inverse(r).apply(out, fill, &mut scratch);
            }
            if let Some(base) = base {
                base.add_to(out, r);
            }
        }
        let _ = monitor.advance((out.len() / width) as u64);
    });
}

/// Returns the first row to stay, 0 or 1, or `None` if neither choice leaves a system of the same
/// kind. Ends with their own operator stay, and an end that is eliminated must have a neighbour
/// that stays.
fn first_to_stay(systems: &Systems, count: usize) -> Option<usize> {
    let [top, bottom] = systems.ends.each_ref().map(Option::is_some);
    let even = count.is_multiple_of(2);
    match systems.edge {
        _ if systems.times == DEPTH || count < FEW || !systems.can_be_squared() => None,
        Edge::Wrap => even.then_some(1),
        _ if top && bottom && even => None,
        _ => Some(usize::from(!top && (even || !bottom))),
    }
}

/// Returns the roots of A or B after some reductions: the operator is the product of `A - root`,
/// where A is the first operator.
fn roots(systems: &Systems, end: bool) -> Vec<f64> {
    let pair = |middle: f64, apart: f64| vec![middle - apart, middle + apart];
    match (systems.times, end, systems.edge) {
        (0, false, _) => vec![0.0],
        (0, true, _) => vec![1.0],
        (_, false, _) => pair(0.0, 2f64.sqrt()),
        // The polynomials are A (A - 1) - 1 and A^2 - 1.
        (_, true, Edge::Free) => pair(0.5, 1.25f64.sqrt()),
        (_, true, _) => pair(0.0, 1.0),
    }
}

wide_fn! {
    fn left_over(out: &mut [f32], next: [&[f32]; 2], own: f32, p: &[f32], two_on: [&[f32]; 2]) {
        let ([a, b], [c, d]) = (next, two_on);
        let rows = a.iter().zip(b).zip(c.iter().zip(d)).zip(p);
        for (out, (((a, b), (c, d)), p)) in out.iter_mut().zip(rows) {
            *out = (a + b) + (c + d) + own * p;
        }
    }
}

wide_fn! {
    fn add_rows(out: &mut [f32], a: &[f32], b: &[f32], c: &[f32]) {
        for (out, (a, (b, c))) in out.iter_mut().zip(a.iter().zip(b.iter().zip(c))) {
            *out = a + (b + c);
        }
    }
}
