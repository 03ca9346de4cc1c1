//! Screened Poisson: the image whose differences are nearest to given ones and whose values stay near a given image.
//!
//! Minimises `sum over edges (v_q - v_p - g_pq)^2 + screening * sum (v - I)^2` (Pérez, Gangnet and Blake, *Poisson image
//! editing*, SIGGRAPH 2003; the screening as in Bhat et al., *Fourier analysis of the 2D screened Poisson equation*, ECCV
//! 2008). What is solved for is the correction `v - I`: it is small, so that `f32` is enough, and nothing where values
//! are kept.
//!
//! A rectangle is solved directly: a transform along the rows, then tridiagonal systems across them. Pixels under a mask
//! are solved by conjugate gradients preconditioned with multigrid.

mod multigrid;
mod sweep;
mod transform;

use crate::par::{self, Monitor};
use crate::{Error, Result};
use sweep::PANEL;
use transform::Transform;

/// What happens at both ends of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// The first and the last pixel keep their values (Dirichlet).
    Fixed,
    /// The last pixel is next to the first.
    Wrap,
    /// Nothing lies beyond (Neumann).
    Free,
}

/// A problem: images in row-major order, channels last.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    /// The values to stay near.
    pub image: &'a [f32],
    /// The differences wanted to the next row, of the image's shape; those of the last row count on a cyclic axis alone.
    pub gradient_rows: &'a [f32],
    /// The differences wanted to the next column.
    pub gradient_columns: &'a [f32],
    /// Rows, columns and channels.
    pub shape: [usize; 3],
    /// What happens at the ends of the rows' axis and of the columns' axis.
    pub edges: [Edge; 2],
    /// Weight of the image against the differences, not negative.
    pub screening: f64,
    /// Which pixels to solve; the others keep their values.
    pub mask: Option<&'a [bool]>,
}

/// Rows that a task takes at a time; even, since transforms take two.
const ROWS: usize = 8;

/// The solution. Without screening, and with nothing fixed, the mean of the image is kept.
pub fn solve(problem: &Problem<'_>, monitor: &Monitor) -> Result<Vec<f32>> {
    check(problem)?;
    let mut out = problem.image.to_vec();
    let [rows, columns, channels] = problem.shape;
    if out.is_empty() {
        return Ok(out);
    }
    match problem.mask {
        Some(mask) if !mask.iter().all(|&m| m) => match inner_rectangle(mask, [rows, columns]) {
            Some(window) => cut_out(problem, window, &mut out, monitor)?,
            None => multigrid::solve(problem, mask, &mut out, monitor)?,
        },
        _ => {
            let [low, columns] =
                [(0, rows), (1, columns)].map(|(axis, n)| match problem.edges[axis] {
                    Edge::Fixed => n.saturating_sub(2),
                    _ => n,
                });
            if low > 0 && columns > 0 && channels > 0 {
                rectangle(problem, [low, columns], &mut out, monitor);
            }
        }
    }
    monitor.check()?;
    Ok(out)
}

/// The rectangle (first and number of rows, of columns) that a mask is, if it is one and fixed pixels lie all around.
fn inner_rectangle(mask: &[bool], shape: [usize; 2]) -> Option<[(usize, usize); 2]> {
    let [rows, columns] = shape;
    let first = mask.iter().position(|&m| m)?;
    let last = mask.iter().rposition(|&m| m)?;
    let (top, left) = (first / columns, first % columns);
    let (bottom, right) = (last / columns, last % columns);
    let inside = top > 0 && left > 0 && bottom + 1 < rows && right + 1 < columns && left <= right;
    let whole = |(y, row): (usize, &[bool])| {
        let expected = |x| (top..=bottom).contains(&y) && (left..=right).contains(&x);
        row.iter().enumerate().all(|(x, &m)| m == expected(x))
    };
    let is_one = inside && mask.chunks_exact(columns).enumerate().all(whole);
    is_one.then_some([(top, bottom + 1 - top), (left, right + 1 - left)])
}

/// Solves a rectangle within the image as an image of its own, with a ring of fixed pixels around it.
fn cut_out(
    problem: &Problem<'_>,
    [(top, rows), (left, columns)]: [(usize, usize); 2],
    out: &mut [f32],
    monitor: &Monitor,
) -> Result<()> {
    let [_, width, channels] = problem.shape;
    let shape = [rows + 2, columns + 2, channels];
    let line = shape[1] * channels;
    let start = |r: usize| ((top - 1 + r) * width + left - 1) * channels;
    let cut = |data: &[f32]| -> Vec<f32> {
        let rows = (0..shape[0]).flat_map(|r| &data[start(r)..][..line]);
        rows.copied().collect()
    };
    let inner = Problem {
        image: &cut(problem.image),
        gradient_rows: &cut(problem.gradient_rows),
        gradient_columns: &cut(problem.gradient_columns),
        shape,
        edges: [Edge::Fixed; 2],
        mask: None,
        ..*problem
    };
    let solved = solve(&inner, monitor)?;
    for (r, row) in solved.chunks_exact(line).enumerate() {
        out[start(r)..][..line].copy_from_slice(row);
    }
    Ok(())
}

fn check(problem: &Problem<'_>) -> Result<()> {
    let [rows, columns, channels] = problem.shape;
    let pixels = rows.checked_mul(columns);
    let samples = pixels.and_then(|n| n.checked_mul(channels));
    for (argument, got) in [
        ("image", problem.image.len()),
        ("gradient_rows", problem.gradient_rows.len()),
        ("gradient_columns", problem.gradient_columns.len()),
    ] {
        if samples != Some(got) {
            return Err(Error::Shape {
                argument,
                expected: problem.shape.to_vec(),
                got: vec![got],
            });
        }
    }
    if let Some(mask) = problem.mask
        && pixels != Some(mask.len())
    {
        return Err(Error::Shape {
            argument: "mask",
            expected: vec![rows, columns],
            got: vec![mask.len()],
        });
    }
    if !problem.screening.is_finite() || problem.screening < 0.0 {
        let message = format!("must be finite and not negative, got {}", problem.screening);
        return Err(Error::value("screening", message));
    }
    Ok(())
}

/// The right-hand side in row `y`, channels last: what flows in by the differences that the image lacks.
fn residual(problem: &Problem<'_>, y: usize, out: &mut [f32]) {
    let [rows, columns, channels] = problem.shape;
    let width = columns * channels;
    let Problem {
        image,
        gradient_rows,
        gradient_columns,
        edges,
        ..
    } = *problem;
    let here = &image[y * width..][..width];
    let cyclic = edges[0] == Edge::Wrap;
    out.fill(0.0);
    if y > 0 || cyclic {
        let before = (y + rows - 1) % rows * width;
        let ends = here.iter().zip(&image[before..]);
        for ((out, wanted), (to, from)) in out.iter_mut().zip(&gradient_rows[before..]).zip(ends) {
            *out += wanted - (to - from);
        }
    }
    if y + 1 < rows || cyclic {
        let ends = here.iter().zip(&image[(y + 1) % rows * width..]);
        let wanted = &gradient_rows[y * width..];
        for ((out, wanted), (from, to)) in out.iter_mut().zip(wanted).zip(ends) {
            *out -= wanted - (to - from);
        }
    }
    // Each pixel once as the start and once as the end of a difference.
    let wanted = &gradient_columns[y * width..][..width];
    let ends = here.iter().zip(&here[channels..]);
    for ((out, wanted), (from, to)) in out.iter_mut().zip(wanted).zip(ends) {
        *out -= wanted - (to - from);
    }
    let ends = here.iter().zip(&here[channels..]);
    for ((out, wanted), (from, to)) in out[channels..].iter_mut().zip(wanted).zip(ends) {
        *out += wanted - (to - from);
    }
    if edges[1] == Edge::Wrap {
        let inner = width - channels;
        for c in 0..channels {
            let lack = wanted[inner + c] - (here[c] - here[inner + c]);
            out[inner + c] -= lack;
            out[c] += lack;
        }
    }
}

/// Solves for `unknown` rows and columns and adds the correction to `out`.
fn rectangle(problem: &Problem<'_>, unknown: [usize; 2], out: &mut [f32], monitor: &Monitor) {
    let [_, columns, channels] = problem.shape;
    let [rows, slots] = unknown;
    let width = columns * channels;
    let [top, left] = problem.edges.map(|e| usize::from(e == Edge::Fixed));
    let transform = Transform::new(problem.edges[1], slots);
    monitor.expect(3);

    // 1. Right-hand sides, transformed along the rows: row, channel, slot.
    let mut spectrum = vec![0.0f32; rows * channels * slots];
    par::chunks_mut(&mut spectrum, ROWS * channels * slots, |chunk, out| {
        if monitor.check().is_err() {
            return;
        }
        let mut scratch = transform::Scratch::default();
        let mut sides = [vec![0.0; width], vec![0.0; width]];
        let mut lines = [vec![0.0; slots], vec![0.0; slots]];
        for (pair, out) in out.chunks_mut(2 * channels * slots).enumerate() {
            let first = chunk * ROWS + 2 * pair;
            let present = out.len() / (channels * slots);
            for (r, side) in sides.iter_mut().take(present).enumerate() {
                residual(problem, top + first + r, side);
            }
            for c in 0..channels {
                for (line, side) in lines.iter_mut().zip(&sides) {
                    let samples = side[left * channels + c..].iter().step_by(channels);
                    line.iter_mut().zip(samples).for_each(|(l, s)| *l = *s);
                }
                let [a, b] = &mut lines;
                transform.forward(a, b, &mut scratch);
                for (r, line) in lines.iter().take(present).enumerate() {
                    out[(r * channels + c) * slots..][..slots].copy_from_slice(line);
                }
            }
        }
    });
    let _ = monitor.advance(1);

    // 2. Systems across the rows: panel, channel, row.
    let mut panels = vec![0.0f32; slots.div_ceil(PANEL) * channels * rows * PANEL];
    let panels = panels.as_chunks_mut::<PANEL>().0;
    par::chunks_mut(panels, channels * rows, |p, panel| {
        if monitor.check().is_err() {
            return;
        }
        let first = p * PANEL;
        let present = PANEL.min(slots - first);
        for (c, lines) in panel.chunks_exact_mut(rows).enumerate() {
            for (r, line) in lines.iter_mut().enumerate() {
                let from = &spectrum[(r * channels + c) * slots + first..][..present];
                match <&[f32; PANEL]>::try_from(from) {
                    Ok(whole) => *line = *whole,
                    Err(_) => line[..present].copy_from_slice(from),
                }
            }
        }
        let shifts = std::array::from_fn(|l| {
            let eigenvalue = transform.eigenvalues.get(first + l);
            eigenvalue.map_or(1.0, |e| e + problem.screening)
        });
        let mut scratch = sweep::Scratch::default();
        sweep::solve(problem.edges[0], &shifts, rows, panel, &mut scratch);
    });
    let _ = monitor.advance(1);
    drop(spectrum);

    // 3. Back, and added.
    let inner = &mut out[top * width..][..rows * width];
    par::chunks_mut(inner, ROWS * width, |chunk, out| {
        if monitor.check().is_err() {
            return;
        }
        let mut scratch = transform::Scratch::default();
        let mut lines = [vec![0.0; slots], vec![0.0; slots]];
        for (pair, out) in out.chunks_mut(2 * width).enumerate() {
            let first = chunk * ROWS + 2 * pair;
            let present = out.len() / width;
            for c in 0..channels {
                for (r, line) in lines.iter_mut().take(present).enumerate() {
                    for (p, part) in line.chunks_mut(PANEL).enumerate() {
                        let from = &panels[(p * channels + c) * rows + first + r];
                        match <&mut [f32; PANEL]>::try_from(&mut *part) {
                            Ok(whole) => *whole = *from,
                            Err(_) => part.copy_from_slice(&from[..part.len()]),
                        }
                    }
                }
                let [a, b] = &mut lines;
                transform.inverse(a, b, &mut scratch);
                for (out, line) in out.chunks_exact_mut(width).zip(&lines) {
                    let samples = out[left * channels + c..].iter_mut().step_by(channels);
                    samples.zip(line).for_each(|(o, l)| *o += l);
                }
            }
        }
    });
    let _ = monitor.advance(1);
}

#[cfg(test)]
mod tests;
