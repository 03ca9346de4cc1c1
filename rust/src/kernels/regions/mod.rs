//! Regions of one colour: the graph-based merge of Felzenszwalb and Huttenlocher, *Efficient graph-based image segmentation*,
//! IJCV 59(2), 2004, section 3, with eight neighbours a pixel.
//!
//! 1. `weights`: the image is smoothed, and each edge between neighbours weighs as much as their colours differ (section 5.1).
//! 2. Edges are taken from the lightest on. One joins its two regions where it is lighter than what either bears: the heaviest
//!    edge within, and the scale over the area (equation 4).
//! 3. What is smaller than the least area joins its neighbour over the lightest edge (section 5).
//!
//! Weights are worked out in double precision and rounded to single; of equal ones the first pixel's goes first, and of its own
//! those along the row, along the column, and the two diagonals, in this order. Regions are numbered by their first pixels.
//!
//! Departure: three of five edges are never sorted, and the result is the same. See `dormant`.

mod dormant;
mod forest;
mod weights;

use crate::foundation::error::check_shape;
use crate::foundation::grid::Grid;
use crate::foundation::memory;
use crate::foundation::par::Monitor;
use crate::{Error, Result};
use forest::Forest;

/// The largest standard deviation of the smoothing, in pixels.
pub const MAX_BLUR: f64 = 64.0;

/// The largest sample and scale.
pub const MAX_VALUE: f64 = 1e15;

/// Bytes that are taken for a pixel, and for a sample of a row that is smoothed: measured.
const PIXEL: usize = 128;
const SAMPLE: usize = 64;

/// The merge's parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// How much a region of one pixel bears beyond its heaviest edge, in the units of the image (k in the paper); one of n
    /// pixels bears an n-th of it. More makes larger regions.
    pub scale: f64,
    /// Standard deviation of the Gaussian that smooths the image, in pixels.
    pub blur: f64,
    /// The least area, in pixels.
    pub least: usize,
    /// Which axes are cyclic.
    pub wrap: [bool; 2],
}

/// The region of each pixel of an image of `shape` (rows, columns, channels), from 0.
pub fn merge(
    image: &[f32],
    shape: [usize; 3],
    options: &Options,
    monitor: &Monitor,
) -> Result<Vec<i32>> {
    let [rows, columns, channels] = shape;
    let grid = Grid::new([rows, columns], options.wrap)?;
    check_shape("image", &shape, image.len())?;
    if channels == 0 {
        return Err(Error::value("image", "needs a channel"));
    }
    let frame = Frame::new(&grid)?;
    check(image, options)?;
    let rows_in_work = (columns * channels).saturating_mul(SAMPLE) / PIXEL;
    memory::room(
        "the edges between pixels",
        frame.len() + rows_in_work,
        PIXEL,
    )?;
    monitor.expect(STEPS);
    let mut weights = weights::measure(image, channels, &frame, options.blur, monitor)?;
    monitor.advance(STEPS / 4)?;
    dormant::mark(&mut weights, &frame);
    let awake = dormant::list_others(&weights, &frame)?;
    monitor.advance(STEPS / 8)?;
    let awake = sort(awake)?;
    monitor.advance(STEPS / 8)?;
    let mut forest = Forest::new(&frame, options.scale)?;
    let left = forest.join_alike(&awake, &weights, monitor)?;
    monitor.advance(STEPS / 4)?;
    forest.join_small(&left, options.least);
    forest.number(&frame)
}

/// What the whole is, for those who watch it.
const STEPS: u64 = 16;

fn check(image: &[f32], options: &Options) -> Result<()> {
    if !(options.scale >= 0.0 && options.scale <= MAX_VALUE) {
        let message = format!("from 0 to {MAX_VALUE:e}, got {}", options.scale);
        return Err(Error::value("scale", message));
    }
    if !(options.blur >= 0.0 && options.blur <= MAX_BLUR) {
        let message = format!("from 0 to {MAX_BLUR} pixels, got {}", options.blur);
        return Err(Error::value("blur", message));
    }
    let bad = |x: &&f32| x.is_nan() || f64::from(x.abs()) > MAX_VALUE;
    match image.iter().find(bad) {
        Some(bad) => {
            let message = format!("values up to {MAX_VALUE:e} are allowed, got {bad}");
            Err(Error::value("image", message))
        }
        None => Ok(()),
    }
}

/// The pixels with a margin of one around them: what is over an edge there, where an axis is cyclic, and nothing otherwise. No
/// loop over neighbours then asks where it is.
struct Frame {
    shape: [usize; 2],
    wrap: [bool; 2],
    /// From a row to the next.
    stride: usize,
}

impl Frame {
    /// Of as many pixels as edges can be numbered of by 32 bits.
    fn new(grid: &Grid<2>) -> Result<Self> {
        let shape = grid.shape();
        let all = shape.map(|n| n as u128 + 2).iter().product::<u128>();
        if all >= 1 << 30 {
            return Err(Error::Limit {
                what: "a merge".into(),
                needed: format!("{} pixels", grid.len()),
                limit: format!("{} pixels", 1 << 30),
            });
        }
        Ok(Self {
            shape,
            wrap: grid.wrap(),
            stride: shape[1] + 2,
        })
    }

    /// Pixels, the margin included.
    fn len(&self) -> usize {
        (self.shape[0] + 2) * self.stride
    }

    /// Copies into the margin what is over the edges of `lines`, each of which is a row: `each` of them belong to one row of
    /// pixels.
    fn wrap_lines<T: Copy>(&self, lines: &mut [T], each: usize) {
        let [rows, columns] = self.shape;
        if self.wrap[1] {
            for line in lines.chunks_exact_mut(self.stride) {
                line[0] = line[columns];
                line[columns + 1] = line[1];
            }
        }
        if self.wrap[0] {
            let row = each * self.stride;
            lines.copy_within(rows * row..(rows + 1) * row, 0);
            lines.copy_within(row..2 * row, (rows + 1) * row);
        }
    }
}

/// An edge: its weight in the high half, as bits that are in the order of the numbers, and in the low half four times the pixel
/// that it is counted with and its direction.
type Edge = u64;

/// Directions of edges from their pixel: along the row, along the column, along both; the last one goes from the pixel's
/// neighbour in the row to that in the column.
const DIRECTIONS: usize = 4;

fn pack(weight: f32, pixel: usize, direction: usize) -> Edge {
    u64::from(weight.to_bits()) << 32 | (pixel * DIRECTIONS + direction) as u64
}

fn weight(edge: Edge) -> f32 {
    f32::from_bits((edge >> 32) as u32)
}

/// The edges from the lightest on, equal ones in the order of their numbers, in which they must come: by digits of their weights.
fn sort(mut edges: Vec<Edge>) -> Result<Vec<Edge>> {
    const BITS: u32 = 11;
    let digit =
        |edge: Edge, pass: usize| (edge >> (32 + BITS * pass as u32)) as usize % (1 << BITS);
    let mut starts = memory::filled("digits", [[0u32; 1 << BITS]; 3], 1)?;
    let starts = &mut starts[0];
    for &edge in &edges {
        for (pass, starts) in starts.iter_mut().enumerate() {
            starts[digit(edge, pass)] += 1;
        }
    }
    let mut sorted = memory::filled("edges between pixels", 0, edges.len())?;
    for (pass, starts) in starts.iter_mut().enumerate() {
        if starts.iter().any(|&n| n as usize == edges.len()) {
            continue;
        }
        let mut next = 0;
        for start in starts.iter_mut() {
            next += std::mem::replace(start, next);
        }
        for &edge in &edges {
            let start = &mut starts[digit(edge, pass)];
            sorted[*start as usize] = edge;
            *start += 1;
        }
        std::mem::swap(&mut edges, &mut sorted);
    }
    Ok(edges)
}

#[cfg(test)]
mod tests;
