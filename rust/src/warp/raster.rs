//! Triangles rasterised in bands of rows. A band looks at every triangle in order, so what a pixel shows cannot depend
//! on threads; rows of cells that do not reach the band are passed over by their bounds.

use super::{Point, Warped};
use crate::par::{self, Monitor};
use crate::{Error, Result};

/// Rows of a band.
const BAND: usize = 32;
/// A pixel that lies so little outside of a triangle belongs to it: neighbours leave no gap.
const SLACK: f64 = -1e-9;
/// Triangles of less area, doubled, are not drawn.
const FLAT: f64 = 1e-9;

/// A dense mesh: a vertex at the centre of each pixel of a source, two triangles a cell.
#[derive(Debug, Clone, Copy)]
pub struct Mesh<'a> {
    /// Rows and columns of the source.
    pub shape: [usize; 2],
    /// Where each pixel goes.
    pub target: &'a [Point],
    /// Which of several layers is seen; void vertices, whose triangles are not drawn, have [`Mesh::VOID`].
    pub weight: &'a [u8],
}

impl Mesh<'_> {
    /// Weight of a vertex that is not drawn.
    pub const VOID: u8 = 255;
}

/// Three corners: where they go, where they come from, and what they weigh.
#[derive(Clone, Copy)]
pub(super) struct Triangle {
    pub target: [Point; 3],
    pub source: [Point; 3],
    pub weight: u32,
}

impl Triangle {
    /// Twice the signed area after and before: of opposite signs where the triangle is turned over.
    fn areas(&self) -> (f64, f64) {
        (doubled(&self.target), doubled(&self.source))
    }

    /// Whether the warp turns it over, or leaves nothing of it.
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

    /// Draws a triangle, the `number`-th, where nothing heavier was drawn.
    #[inline(always)]
    pub(super) fn draw(&mut self, number: u32, t: &Triangle) {
        let (after, before) = t.areas();
        if after.abs() < FLAT || !after.is_finite() {
            return;
        }
        let rank = 1 + 2 * t.weight + u32::from((after > 0.0) == (before > 0.0));
        let [low, high] = self.rows();
        let bounds = |axis: usize| {
            let [a, b, c] = t.target.map(|p| p[axis]);
            (a.min(b).min(c), a.max(b).max(c))
        };
        let ((top, bottom), (left, right)) = (bounds(0), bounds(1));
        // The casts saturate, and what is not finite was left out above.
        let y0 = (top - 1e-6).ceil().max(low) as i64;
        let y1 = (bottom + 1e-6).floor().min(high) as i64;
        let x0 = (left - 1e-6).ceil().max(0.0) as i64;
        let x1 = (right + 1e-6).floor().min(self.columns as f64 - 1.0) as i64;
        let [a, b, c] = t.target;
        let scale = 1.0 / after;
        for y in y0..=y1 {
            let row = (y as usize - self.first) * self.columns;
            for x in x0..=x1 {
                let (py, px) = (y as f64, x as f64);
                let u = ((py - a[0]) * (c[1] - a[1]) - (px - a[1]) * (c[0] - a[0])) * scale;
                let v = ((b[0] - a[0]) * (px - a[1]) - (b[1] - a[1]) * (py - a[0])) * scale;
                let w = 1.0 - u - v;
                if u < SLACK || v < SLACK || w < SLACK {
                    continue;
                }
                let at = row + x as usize;
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

/// Draws an output: `draw` gets each band, and draws what reaches its rows in the order of the triangles.
pub(super) fn bands(
    shape: [usize; 2],
    monitor: &Monitor,
    draw: impl Fn(&mut Band<'_>) + Sync + Send,
) -> Result<(Vec<[f32; 2]>, Vec<u32>)> {
    let [rows, columns] = shape;
    let mut places = vec![[f32::NAN; 2]; rows * columns];
    let mut triangle = vec![0; rows * columns];
    monitor.expect(rows.div_ceil(BAND) as u64);
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
            format!("needs 2 to 2^31 pixels, two or more along each axis, got {rows} x {columns}"),
        ));
    }
    // Bounds of each row of vertices, and what was turned over, row by row.
    let bounds: Vec<[f64; 2]> = par::map(rows, |y| {
        source.target[y * columns..][..columns]
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| {
                [low.min(p[0]), high.max(p[0])]
            })
    });
    let cell = |y: usize, x: usize| cell(source, y, x);
    let counts = par::map(rows - 1, |y| {
        let mut counts = [0usize; 3];
        for x in 0..columns - 1 {
            for t in cell(y, x).into_iter().flatten() {
                let turned = t.turned();
                counts[0] += 1;
                counts[1] += usize::from(turned);
                counts[2] += usize::from(turned && t.weight == 3);
            }
        }
        counts
    });
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
                for (k, t) in cell(y, x).iter().enumerate() {
                    if let Some(t) = t {
                        band.draw(number + k as u32, t);
                    }
                }
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

/// The two triangles of a cell, those of them that are drawn.
#[inline(always)]
fn cell(source: &Mesh<'_>, y: usize, x: usize) -> [Option<Triangle>; 2] {
    let columns = source.shape[1];
    let corners = [[y, x], [y, x + 1], [y + 1, x], [y + 1, x + 1]];
    [[0, 1, 2], [1, 3, 2]].map(|three: [usize; 3]| {
        let at = three.map(|k| corners[k][0] * columns + corners[k][1]);
        let weights = at.map(|i| source.weight[i]);
        if weights.contains(&Mesh::VOID) {
            return None;
        }
        Some(Triangle {
            target: at.map(|i| source.target[i]),
            source: three.map(|k| corners[k].map(|i| i as f64)),
            weight: weights.iter().map(|&w| u32::from(w)).sum(),
        })
    })
}
