//! Screened Poisson equation: the image whose differences between neighbours are nearest to given differences, and
//! whose values stay near a given image.
//!
//! It minimises `sum over edges (v_q - v_p - g_pq)^2 + screening * sum (v - I)^2` (Pérez, Gangnet
//! and Blake, *Poisson image editing*, SIGGRAPH 2003). The screening is that of Bhat et al.,
//! *Fourier analysis of the 2D screened Poisson equation*, ECCV 2008. The unknown is the correction
//! `v - I`. It is small, so `f32` is enough, and 0 at pixels that keep their values.
//!
//! A rectangle is solved directly: a transform along every fourth row, then tridiagonal systems
//! across these rows. The rows between follow from systems along them. Pixels under a mask are
//! solved by conjugate gradients preconditioned with multigrid.

mod along;
mod multigrid;
mod reduce;
mod sweep;
mod transform;

use crate::foundation::fft::{LANES, Lanes};
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::foundation::simd::wide;
use crate::{Error, Result};
use reduce::Level;
use sweep::{PANEL, Systems};
use transform::Transform;

/// Boundary condition at both ends of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Edge {
    /// The first and the last pixel keep their values (Dirichlet).
    Fixed,
    /// The last pixel is next to the first.
    Wrap,
    /// The ends have no neighbours beyond (Neumann).
    Free,
}

/// Shape, boundary conditions and mask of a problem.
#[derive(Debug, Clone, Copy)]
pub struct Domain<'a> {
    /// Rows, columns and channels.
    pub shape: [usize; 3],
    /// Boundary conditions of the axis of rows and of the axis of columns.
    pub edges: [Edge; 2],
    /// Weight of the image relative to the differences, not negative.
    pub screening: f64,
    /// Flags of the pixels to solve. The others keep their values.
    pub mask: Option<&'a [bool]>,
}

/// A problem: images in row-major order, channels last.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    /// The image whose values the solution stays near.
    pub image: &'a [f32],
    /// Target differences to the next row and to the next column, each in the shape of the image.
    /// The differences at the end of an axis count only if the axis wraps. If `None`, all target
    /// differences are 0.
    pub gradients: Option<[&'a [f32]; 2]>,
    /// The pixels of the problem.
    pub domain: Domain<'a>,
}

/// Maximum screening. Beyond it the correction is 0 in `f32`, and larger values would overflow.
const STRONGEST: f64 = 1e30;

/// Number of rows in each parallel task, whose transforms are computed together.
const ROWS: usize = 2 * LANES;

/// Returns the solution. Without screening and without fixed pixels, it has the mean of the image.
pub fn solve(problem: &Problem<'_>, monitor: &Monitor) -> Result<Vec<f32>> {
    let Domain {
        shape: [_, columns, channels],
        ..
    } = problem.domain;
    problem.domain.check("image", problem.image.len())?;
    for (argument, axis) in [("gradient_rows", 0), ("gradient_columns", 1)] {
        if let Some(gradients) = problem.gradients {
            problem.domain.check(argument, gradients[axis].len())?;
        }
    }
    // Compute the right-hand side, which is the flow into each pixel. Solve for the correction, and add it to the
    // image.
    memory::room("the solution", problem.image.len(), 4)?;
    let width = columns * channels;
    let mut out = vec![0.0; problem.image.len()];
    par::chunks_mut(&mut out, ROWS * width, |chunk, out| {
        wide(
            #[inline(always)]
            || {
                for (r, out) in out.chunks_exact_mut(width).enumerate() {
                    residual(problem, chunk * ROWS + r, out);
                }
            },
        );
    });
    spread(&problem.domain, &mut out, monitor)?;
    par::chunks_mut(&mut out, ROWS * width, |chunk, out| {
        let image = &problem.image[chunk * ROWS * width..];
        out.iter_mut().zip(image).for_each(|(o, i)| *o += i);
    });
    Ok(out)
}

/// Solves `(L + screening) v = flow` in place, where L sums the differences to the neighbours. The
/// solution is 0 at pixels that keep their values.
pub fn spread(domain: &Domain<'_>, flow: &mut [f32], monitor: &Monitor) -> Result<()> {
    domain.check("flow", flow.len())?;
    let domain = &Domain {
        screening: domain.screening.min(STRONGEST),
        ..*domain
    };
    let [rows, columns, channels] = domain.shape;
    // Check the memory for half of the rows, half of these and a transposed copy, or for the levels of the pyramid.
    memory::room("the solution", rows * columns, 12 * channels + 32)?;
    if !flow.is_empty() {
        // If the mask is a rectangle, solve directly. Otherwise use multigrid.
        match domain.mask {
            Some(mask) if !mask.iter().all(|&m| m) => {
                match inner_rectangle(mask, [rows, columns]) {
                    Some(window) => rectangle(domain, [Edge::Fixed; 2], window, flow, monitor),
                    None => multigrid::spread(domain, mask, flow, monitor)?,
                }
            }
            _ => {
                // All pixels except the ring that fixed edges keep.
                let window = [0, 1].map(|axis| {
                    let ring = usize::from(domain.edges[axis] == Edge::Fixed);
                    (ring, domain.shape[axis].saturating_sub(2 * ring))
                });
                rectangle(domain, domain.edges, window, flow, monitor);
            }
        }
    }
    monitor.check()
}

/// Returns the rectangle that a mask marks: (first row, number of rows), and the same for the columns. The result is
/// `None` if the marked pixels are not a rectangle, or if fixed pixels do not surround it.
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
    is_one.then(|| [(top, bottom + 1 - top), (left, right + 1 - left)])
}

impl Domain<'_> {
    /// Returns an error unless `samples` is the size of the domain, the mask fits, and the
    /// screening is valid.
    fn check(&self, argument: &'static str, samples: usize) -> Result<()> {
        let [rows, columns, channels] = self.shape;
        let pixels = rows.checked_mul(columns);
        if pixels.and_then(|n| n.checked_mul(channels)) != Some(samples) {
            return Err(Error::Shape {
                argument,
                expected: self.shape.to_vec(),
                got: vec![samples],
            });
        }
        if let Some(mask) = self.mask
            && pixels != Some(mask.len())
        {
            return Err(Error::Shape {
                argument: "mask",
                expected: vec![rows, columns],
                got: vec![mask.len()],
            });
        }
        if !self.screening.is_finite() || self.screening < 0.0 {
            let message = format!("must be finite and not negative, got {}", self.screening);
            return Err(Error::value("screening", message));
        }
        Ok(())
    }
}

/// Adds the flow into the pixels of row `y`: the target differences minus the differences of the image, channels last.
#[inline(always)]
fn residual(problem: &Problem<'_>, y: usize, out: &mut [f32]) {
    let Domain {
        shape: [rows, columns, channels],
        edges,
        ..
    } = problem.domain;
    let width = columns * channels;
    let image = problem.image;
    let row = |r: usize| &image[r % rows * width..][..width];
    let wanted = |axis: usize, r: usize| {
        let rows = problem.gradients.map(|g| &g[axis][r % rows * width..]);
        rows.map(|row| &row[..width])
    };
    let here = row(y);
    let cyclic = edges[0] == Edge::Wrap;
    if y > 0 || cyclic {
        let before = y + rows - 1;
        lack(out, wanted(0, before), row(before), here, 1.0);
    }
    if y + 1 < rows || cyclic {
        lack(out, wanted(0, y), here, row(y + 1), -1.0);
    }
    // Each pixel is once the start and once the end of a difference.
    let beside = &here[channels..];
    lack(out, wanted(1, y), here, beside, -1.0);
    lack(&mut out[channels..], wanted(1, y), here, beside, 1.0);
    if edges[1] == Edge::Wrap {
        let last = width - channels;
        let wanted = wanted(1, y).map(|w| &w[last..]);
        lack(&mut out[last..], wanted, &here[last..], here, -1.0);
        lack(out, wanted, &here[last..], here, 1.0);
    }
}

/// Adds the target differences minus the differences from `from` to `to`, multiplied by `sign`.
#[inline(always)]
fn lack(out: &mut [f32], wanted: Option<&[f32]>, from: &[f32], to: &[f32], sign: f32) {
    let pairs = out.iter_mut().zip(from.iter().zip(to));
    match wanted {
        Some(wanted) => pairs
            .zip(wanted)
            .for_each(|((o, (from, to)), w)| *o += sign * (w - (to - from))),
        None => pairs.for_each(|(o, (from, to))| *o += sign * (from - to)),
    }
}

/// Solves a window, and sets the pixels around it to 0. The window is given by (first row, number of rows), and the
/// same for the columns.
fn rectangle(
    domain: &Domain<'_>,
    edges: [Edge; 2],
    [(top, rows), (left, slots)]: [(usize, usize); 2],
    flow: &mut [f32],
    monitor: &Monitor,
) {
    let [_, columns, channels] = domain.shape;
    let layout = Layout {
        width: columns * channels,
        first: left * channels,
        len: slots * channels,
    };
    if rows == 0 || layout.len == 0 {
        return flow.fill(0.0);
    }
    // The pixels around the window are fixed, so their correction is 0.
    let (above, rest) = flow.split_at_mut(top * layout.width);
    let (inner, below) = rest.split_at_mut(rows * layout.width);
    above.fill(0.0);
    below.fill(0.0);
    for row in inner.chunks_exact_mut(layout.width) {
        row[..layout.first].fill(0.0);
        row[layout.first + layout.len..].fill(0.0);
    }
    let field = Field {
        channels,
        edge: edges[1],
        screening: domain.screening,
        transform: Transform::new(edges[1], slots),
    };
    let shifts = field.transform.eigenvalues.iter();
    let shifts = shifts.map(|e| e + domain.screening).collect();
    let level = Level {
        systems: Systems::new(edges[0], shifts),
        layout,
        base: None,
        ahead: 0,
    };
    reduce::solve(&field, &level, inner, monitor);
}

/// Data that depend only on the columns.
struct Field {
    channels: usize,
    /// Boundary condition of the axis of columns.
    edge: Edge,
    screening: f64,
    transform: Transform,
}

/// Position of the unknowns in an array: `len` samples of each row, starting at `first`.
#[derive(Clone, Copy)]
struct Layout {
    width: usize,
    first: usize,
    len: usize,
}

impl Layout {
    /// Returns the unknowns of a row.
    fn row<'a>(&self, rows: &'a [f32], r: usize) -> &'a [f32] {
        self.of(&rows[r * self.width..])
    }

    fn of<'a>(&self, row: &'a [f32]) -> &'a [f32] {
        &row[self.first..][..self.len]
    }

    fn of_mut<'a>(&self, row: &'a mut [f32]) -> &'a mut [f32] {
        &mut row[self.first..][..self.len]
    }
}

/// Solves rows in place by transforms along them, and adds the base solution. During the solution, the coefficients of
/// a row replace its samples, one channel after another.
fn transformed(field: &Field, level: &Level<'_>, inner: &mut [f32], monitor: &Monitor) {
    let (transform, channels) = (&field.transform, field.channels);
    let (layout, width) = (level.layout, level.layout.width);
    let (rows, slots) = (inner.len() / width, layout.len / channels);
    monitor.expect((2 * rows + slots) as u64 + level.ahead);

    // Step 1: transform along the rows, several pairs of rows together. Missing rows are 0.
    par::chunks_mut(inner, ROWS * width, |_, out| {
        if monitor.check().is_err() {
            return;
        }
        let mut scratch = transform::Scratch::default();
        let mut lines = [(); 2].map(|()| vec![Lanes::default(); channels * slots]);
        for (r, row) in out.chunks_exact(width).enumerate() {
            for (c, line) in lines[r % 2].chunks_exact_mut(slots).enumerate() {
                let samples = layout.of(row)[c..].iter().step_by(channels);
                line.iter_mut()
                    .zip(samples)
                    .for_each(|(l, s)| l.0[r / 2] = *s);
            }
        }
        let [a, b] = &mut lines;
        for (a, b) in a.chunks_exact_mut(slots).zip(b.chunks_exact_mut(slots)) {
            transform.forward(a, b, &mut scratch);
        }
        for (r, row) in out.chunks_exact_mut(width).enumerate() {
            let row = layout.of_mut(row).iter_mut();
            row.zip(&lines[r % 2]).for_each(|(s, l)| *s = l.0[r / 2]);
        }
        let _ = monitor.advance((out.len() / width) as u64);
    });

    // Step 2: solve the systems across the rows. Memory order is panel, channel, row.
    let spectrum = &*inner;
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
                let from = &layout.row(spectrum, r)[c * slots + first..][..present];
                match <&[f32; PANEL]>::try_from(from) {
                    Ok(whole) => *line = *whole,
                    Err(_) => line[..present].copy_from_slice(from),
                }
            }
        }
        let (systems, mut scratch) = (level.systems.panel(first), sweep::Scratch::default());
        wide(
            #[inline(always)]
            || sweep::solve(&systems, rows, panel, &mut scratch),
        );
        let _ = monitor.advance(present as u64);
    });

    // Step 3: transform back.
    let panels = &*panels;
    par::chunks_mut(inner, ROWS * width, |chunk, out| {
        if monitor.check().is_err() {
            return;
        }
        let mut scratch = transform::Scratch::default();
        let mut lines = [(); 2].map(|()| vec![Lanes::default(); slots]);
        for c in 0..channels {
            for r in 0..out.len() / width {
                for (p, part) in lines[r % 2].chunks_mut(PANEL).enumerate() {
                    let from = &panels[(p * channels + c) * rows + chunk * ROWS + r];
                    part.iter_mut().zip(from).for_each(|(l, s)| l.0[r / 2] = *s);
                }
            }
            let [a, b] = &mut lines;
            transform.inverse(a, b, &mut scratch);
            for (r, row) in out.chunks_exact_mut(width).enumerate() {
                let samples = layout.of_mut(row)[c..].iter_mut().step_by(channels);
                samples
                    .zip(&lines[r % 2])
                    .for_each(|(s, l)| *s = l.0[r / 2]);
            }
        }
        if let Some(base) = level.base {
            for (r, row) in (chunk * ROWS..).zip(out.chunks_exact_mut(width)) {
                base.add_to(layout.of_mut(row), r);
            }
        }
        let _ = monitor.advance((out.len() / width) as u64);
    });
}

#[cfg(test)]
mod tests;
