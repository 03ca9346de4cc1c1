//! Triangles rasterised in bands of rows.
//!
//! Each band draws the triangles in the same order, so the visible triangle of a pixel does not depend on the number
//! of threads. Rows of mesh cells whose bounds do not reach a band are skipped.

use super::{Point, Warped};
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// Number of rows of a band.
const BAND: usize = 32;
/// Barycentric tolerance. A pixel slightly outside a triangle belongs to it, so that neighbours
/// leave no gap.
const SLACK: f64 = -1e-9;
/// Margin around the bounds of a triangle, in pixels.
const REACH: f64 = 1e-6;
/// Minimum doubled area of a drawn triangle, in square pixels.
const FLAT: f64 = 1e-9;

/// A dense mesh: a vertex at the centre of each source pixel, and two triangles for each cell.
#[derive(Debug, Clone, Copy)]
pub struct Mesh<'a> {
    /// Rows and columns of the source.
    pub shape: [usize; 2],
    /// Target position of each source pixel.
    pub target: &'a [Point],
    /// Weight of each vertex. If several triangles cover a pixel, the one with the largest total weight is visible.
    /// Triangles with a vertex of weight [`Mesh::VOID`] are not drawn.
    pub weight: &'a [u8],
}

impl Mesh<'_> {
    /// Weight of a vertex that is not drawn.
    pub const VOID: u8 = 255;
}

/// A triangle: target and source positions of its corners, and their total weight.
#[derive(Clone, Copy)]
pub(super) struct Triangle {
    pub target: [Point; 3],
    pub source: [Point; 3],
    pub weight: u32,
}

impl Triangle {
    /// Returns twice the signed area after and before the warp. The signs differ if the triangle is
    /// flipped.
    fn areas(&self) -> (f64, f64) {
        (doubled(&self.target), doubled(&self.source))
    }

    /// Returns whether the warp flips or flattens the triangle.
    #[inline(always)]
    pub(super) fn turned(&self) -> bool {
        let (after, before) = self.areas();
        (after > 0.0) != (before > 0.0) || after.abs() < FLAT
    }
}

fn doubled([a, b, c]: &[Point; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Rows of an output that are drawn together.
pub(super) struct Band<'a> {
    first: usize,
    columns: usize,
    places: &'a mut [[f32; 2]],
    triangle: &'a mut [u32],
    best: Vec<u32>,
}

impl Band<'_> {
    pub(super) fn rows(&self) -> [f64; 2] {
        let last = self.first + self.triangle.len() / self.columns - 1;
        [self.first as f64, last as f64]
    }

    /// Draws triangle `number` at pixels without a heavier triangle.
    #[inline(always)]
    pub(super) fn draw(&mut self, number: u32, t: &Triangle) {
        let [a, b, c] = t.target;
        let low = |axis: usize| a[axis].min(b[axis]).min(c[axis]) - REACH;
        let high = |axis: usize| a[axis].max(b[axis]).max(c[axis]) + REACH;
        // Return early if no pixel centre of this band can be inside the triangle.
        let y = pixels(
            low(0),
            high(0),
            self.first,
            self.triangle.len() / self.columns,
        );
        let x = pixels(low(1), high(1), 0, self.columns);
        if y.is_empty() || x.is_empty() {
            return;
        }
        let (after, before) = t.areas();
        if after.abs() < FLAT || after.is_nan() {
            return;
        }
        // The rank increases with the weight. With equal weights, an unflipped triangle ranks above a flipped one.
        let rank = 1 + 2 * t.weight + u32::from((after > 0.0) == (before > 0.0));
        let scale = 1.0 / after;
        for y in y {
            for x in x.clone() {
                let (py, px) = ((y + self.first) as f64 - a[0], x as f64 - a[1]);
                let u = (py * (c[1] - a[1]) - px * (c[0] - a[0])) * scale;
                let v = ((b[0] - a[0]) * px - (b[1] - a[1]) * py) * scale;
                let w = 1.0 - u - v;
                let inside = u >= SLACK && v >= SLACK && w >= SLACK;
                if !inside {
                    continue;
                }
                let at = y * self.columns + x;
                if rank > self.best[at] {
                    self.best[at] = rank;
                    self.triangle[at] = number;
                    let mix = |axis: usize| {
                        w * t.source[0][axis] + u * t.source[1][axis] + v * t.source[2][axis]
                    };
                    self.places[at] = [mix(0) as f32, mix(1) as f32];
                }
            }
        }
    }
}

impl Band<'_> {
    /// Draws both triangles of a cell. They have the numbers `number` and `number + 1`, and the
    /// cell starts at `corner`.
    #[inline(always)]
    fn draw_cell(&mut self, number: u32, corner: [usize; 2], cell: &Cell) {
        let [a, b, c, d] = cell.target;
        let low = |axis: usize| a[axis].min(b[axis]).min(c[axis].min(d[axis])) - REACH;
        let high = |axis: usize| a[axis].max(b[axis]).max(c[axis].max(d[axis])) + REACH;
        let ys = pixels(
            low(0),
            high(0),
            self.first,
            self.triangle.len() / self.columns,
        );
        let xs = pixels(low(1), high(1), 0, self.columns);
        if ys.is_empty() || xs.is_empty() {
            return;
        }
        for (k, (corners, weight)) in cell.triangles().into_iter().enumerate() {
            let Some(weight) = weight else { continue };
            let [a, b, c] = corners;
            let area = doubled(&corners);
            if area.abs() < FLAT || !area.is_finite() {
                continue;
            }
            let rank = 1 + 2 * weight + u32::from(area < 0.0);
            let scale = 1.0 / area;
            let (b0, b1, c0, c1) = (b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]);
            // Changes of the barycentric coordinates from each pixel of a row to the next. They are exact if the cell
            // moves by whole pixels.
            let (along_u, along_v) = (-c0 * scale, b0 * scale);
            let px = f64::from(xs.start as i32) - a[1];
            let mut py = f64::from((ys.start + self.first) as i32) - a[0];
            for y in ys.clone() {
                let mut u = (py * c1 - px * c0) * scale;
                let mut v = (b0 * px - b1 * py) * scale;
                py += 1.0;
                for x in xs.clone() {
                    let (here_u, here_v) = (u, v);
                    u += along_u;
                    v += along_v;
                    let (u, v) = (here_u, here_v);
                    // The test is false for NaN, which results if products overflow.
                    let inside = (u >= SLACK) & (v >= SLACK) & (u + v <= 1.0 - SLACK);
                    if !inside {
                        continue;
                    }
                    let at = y * self.columns + x;
                    if rank > self.best[at] {
                        self.best[at] = rank;
                        self.triangle[at] = number + k as u32;
                        let [y, x] = corner.map(|i| i as f64);
                        self.places[at] = if k == 0 {
                            [(y + v) as f32, (x + u) as f32]
                        } else {
                            [(y + u + v) as f32, (x + 1.0 - v) as f32]
                        };
                    }
                }
            }
        }
    }
}

/// Returns the integers in [low, high], minus `first`, that are below `count`. Rounding is done
/// by casts, because the compiler would call library functions for it otherwise.
#[inline(always)]
fn pixels(low: f64, high: f64, first: usize, count: usize) -> std::ops::Range<usize> {
    let (low, high) = (low - first as f64, high - first as f64);
    // The comparisons also exclude NaN.
    if high < 0.0 || low > count as f64 || high.is_nan() || low.is_nan() {
        return 0..0;
    }
    let start = if low <= 0.0 {
        0
    } else {
        let whole = low as i32;
        (whole + i32::from(f64::from(whole) < low)) as usize
    };
    start..(high.min(count as f64) as i32 as usize + 1).min(count)
}

/// Draws an output in bands, and returns the source coordinates and the triangle number of each pixel. `draw` is
/// called with each band, and must draw the triangles that reach its rows in order.
pub(super) fn bands(
    shape: [usize; 2],
    monitor: &Monitor,
    draw: impl Fn(&mut Band<'_>) + Sync + Send,
) -> Result<(Vec<[f32; 2]>, Vec<u32>)> {
    let [rows, columns] = shape;
    if shape.iter().any(|n| !(1..=i32::MAX as usize).contains(n)) {
        let message = format!("sides must be from 1 to 2^31 - 1, got {shape:?}");
        return Err(Error::value("shape", message));
    }
    let pixels = memory::product("shape", &shape)?;
    let mut places = memory::filled("the output", [f32::NAN; 2], pixels)?;
    let mut triangle = memory::filled("the output", 0u32, pixels)?;
    monitor.expect(rows.div_ceil(BAND) as u64);
    // Each band is a task with its own rows of the output.
    let mut pairs: Vec<_> = places
        .chunks_mut(BAND * columns)
        .zip(triangle.chunks_mut(BAND * columns))
        .collect();
    par::chunks_mut(&mut pairs, 1, |number, pair| {
        if monitor.advance(1).is_err() {
            return;
        }
        for (places, triangle) in pair {
            draw(&mut Band {
                first: number * BAND,
                columns,
                best: vec![0; triangle.len()],
                places,
                triangle,
            });
        }
    });
    monitor.check()?;
    Ok((places, triangle))
}

/// Warps a dense mesh into an output of `shape`.
pub fn mesh(source: &Mesh<'_>, shape: [usize; 2], monitor: &Monitor) -> Result<Warped> {
    let [rows, columns] = source.shape;
    let vertices = rows.saturating_mul(columns);
    if source.target.len() != vertices || source.weight.len() != vertices {
        return Err(Error::Shape {
            argument: "target",
            expected: vec![rows, columns],
            got: vec![source.target.len(), source.weight.len()],
        });
    }
    if rows < 2 || columns < 2 || vertices > (u32::MAX / 2) as usize {
        return Err(Error::value(
            "target",
            format!(
                "must have at least 2 pixels along each axis and fewer than 2^31, got {rows} x {columns}"
            ),
        ));
    }
    // Compute the bounds of each row of vertices, and count flipped triangles row by row.
    let bounds: Vec<[f64; 2]> = par::map(rows, |y| {
        source.target[y * columns..][..columns]
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| {
                [low.min(p[0]), high.max(p[0])]
            })
    });
    let counts = par::map(rows - 1, |y| {
        let mut counts = [0usize; 3];
        for x in 0..columns - 1 {
            let cell = Cell::of(source, y, x);
            for (corners, weight) in cell.triangles() {
                if let Some(weight) = weight {
                    // The unwarped mesh has negative areas, so other areas mean a flipped or
                    // flattened triangle.
                    let area = doubled(&corners);
                    let turned = area > -FLAT || area.is_nan();
                    counts[0] += 1;
                    counts[1] += usize::from(turned);
                    counts[2] += usize::from(turned && weight == 3);
                }
            }
        }
        counts
    });
    // Draw the rows of cells that reach each band.
    let (places, triangle) = bands(shape, monitor, |band| {
        let [low, high] = band.rows();
        for y in 0..rows - 1 {
            let (top, bottom) = (
                bounds[y][0].min(bounds[y + 1][0]),
                bounds[y][1].max(bounds[y + 1][1]),
            );
            if bottom < low - 1e-6 || top > high + 1e-6 {
                continue;
            }
            for x in 0..columns - 1 {
                let number = 2 * (y * (columns - 1) + x) as u32 + 1;
                band.draw_cell(number, [y, x], &Cell::of(source, y, x));
            }
        }
    })?;
    let sum = |k: usize| counts.iter().map(|c| c[k]).sum();
    Ok(Warped {
        places,
        triangle,
        drawn: sum(0),
        flipped: sum(1),
        flipped_heavy: sum(2),
    })
}

/// A cell of the mesh: targets and weights of its corners, row by row.
struct Cell {
    target: [Point; 4],
    weight: [u8; 4],
}

/// Corners of the two triangles of a cell, which share a diagonal.
const HALVES: [[usize; 3]; 2] = [[0, 1, 2], [1, 3, 2]];

impl Cell {
    #[inline(always)]
    fn of(source: &Mesh<'_>, y: usize, x: usize) -> Self {
        let columns = source.shape[1];
        let at = y * columns + x;
        let (t, w) = (
            &source.target[at..at + columns + 2],
            &source.weight[at..at + columns + 2],
        );
        Self {
            target: [t[0], t[1], t[columns], t[columns + 1]],
            weight: [w[0], w[1], w[columns], w[columns + 1]],
        }
    }

    /// Returns both triangles, with their weights if they are drawn.
    #[inline(always)]
    fn triangles(&self) -> [([Point; 3], Option<u32>); 2] {
        HALVES.map(|half| {
            let weights = half.map(|k| self.weight[k]);
            let drawn = !weights.contains(&Mesh::VOID);
            (
                half.map(|k| self.target[k]),
                drawn.then(|| weights.iter().map(|&w| u32::from(w)).sum()),
            )
        })
    }
}
