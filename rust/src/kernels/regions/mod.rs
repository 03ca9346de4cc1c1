//! Regions of similar colour by graph-based segmentation. Felzenszwalb and Huttenlocher, *Efficient
//! graph-based image segmentation*, IJCV 59(2), 2004, section 3. Each pixel has eight neighbours.
//!
//! 1. `weights`: the image is smoothed, and the weight of an edge is the colour difference of its
//!    two pixels (section 5.1).
//! 2. Edges are taken in the order of their weights. An edge joins its two regions if it is lighter
//!    than the limits of both. The limit of a region is its heaviest inner edge, plus the scale
//!    divided by the area (equation 4).
//! 3. Regions below the minimum area join their neighbour over the lightest edge (section 5).
//!
//! Weights are computed in double precision and rounded to single. Edges of equal weight are taken in the order of
//! their first pixels. For one pixel the order is along the row, along the column, and the two diagonals. Regions are
//! numbered by their first pixels.
//!
//! Departure from the paper: 60 % of the edges are never sorted, and the result is the same. See
//! `inactive`.

mod forest;
mod inactive;
mod weights;

use crate::foundation::error::check_shape;
use crate::foundation::grid::Grid;
use crate::foundation::memory;
use crate::foundation::par::Monitor;
use crate::{Error, Result};
use forest::Forest;

/// Maximum standard deviation of the smoothing, in pixels.
pub const MAX_BLUR: f64 = 64.0;

/// Maximum absolute sample value, and maximum scale.
pub const MAX_VALUE: f64 = 1e15;

/// Memory for a pixel, and for a sample of a row that is being smoothed, in bytes (measured).
const PIXEL: usize = 128;
const SAMPLE: usize = 64;

/// Parameters of the segmentation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Limit of a region of one pixel, in the units of the image (k in the paper). The limit of a region of n pixels
    /// is its heaviest inner edge plus `scale / n`. A larger scale gives larger regions.
    pub scale: f64,
    /// Standard deviation of the Gaussian that smooths the image, in pixels.
    pub blur: f64,
    /// Minimum area of a region, in pixels.
    pub least: usize,
    /// Flags of the axes that wrap.
    pub wrap: [bool; 2],
}

/// Returns the number of the region of each pixel, from 0. The image has the given `shape` (rows,
/// columns, channels).
pub fn felzenszwalb(
    image: &[f32],
    shape: [usize; 3],
    options: &Options,
    monitor: &Monitor,
) -> Result<Vec<i32>> {
    // Check the arguments and the memory.
    let [rows, columns, channels] = shape;
    let grid = Grid::new([rows, columns], options.wrap)?;
    check_shape("image", &shape, image.len())?;
    if channels == 0 {
        return Err(Error::value("image", "must have at least 1 channel, got 0"));
    }
    let frame = Frame::new(&grid)?;
    check(image, options)?;
    let rows_in_work = (columns * channels).saturating_mul(SAMPLE) / PIXEL;
    memory::room(
        "the edges between pixels",
        frame.len() + rows_in_work,
        PIXEL,
    )?;
    // Measure the weights of the edges, and list and sort the edges that are not inactive.
    monitor.expect(STEPS);
    let mut weights = weights::measure(image, channels, &frame, options.blur, monitor)?;
    monitor.advance(STEPS / 4)?;
    inactive::mark(&mut weights, &frame);
    let awake = inactive::list_others(&weights, &frame)?;
    monitor.advance(STEPS / 8)?;
    let awake = sort(awake)?;
    monitor.advance(STEPS / 8)?;
    // Join similar regions, then regions below the minimum area.
    let mut forest = Forest::new(&frame, options.scale)?;
    let left = forest.join_alike(&awake, &weights, monitor)?;
    monitor.advance(STEPS / 4)?;
    forest.join_small(&left, options.least);
    forest.number(&frame)
}

/// Total number of progress steps.
const STEPS: u64 = 16;

fn check(image: &[f32], options: &Options) -> Result<()> {
    if !(options.scale >= 0.0 && options.scale <= MAX_VALUE) {
        let message = format!("must be from 0 to {MAX_VALUE:e}, got {}", options.scale);
        return Err(Error::value("scale", message));
    }
    if !(options.blur >= 0.0 && options.blur <= MAX_BLUR) {
        let message = format!("must be from 0 to {MAX_BLUR} pixels, got {}", options.blur);
        return Err(Error::value("blur", message));
    }
    let bad = |x: &&f32| x.is_nan() || f64::from(x.abs()) > MAX_VALUE;
    match image.iter().find(bad) {
        Some(bad) => {
            let message = format!("values must be within {MAX_VALUE:e} of zero, got {bad}");
            Err(Error::value("image", message))
        }
        None => Ok(()),
    }
}

/// The pixels with a margin of one around them. If an axis wraps, the margin contains copies of the
/// pixels across the edge. Loops over neighbours then need no test of the position.
struct Frame {
    shape: [usize; 2],
    wrap: [bool; 2],
    /// Distance in memory between rows.
    stride: usize,
}

impl Frame {
    /// Returns the frame of a grid.
    ///
    /// # Errors
    /// The grid has more edges than 32 bits can index.
    fn new(grid: &Grid<2>) -> Result<Self> {
        let shape = grid.shape();
        let all = shape.map(|n| n as u128 + 2).iter().product::<u128>();
        if all >= 1 << 30 {
            return Err(Error::Limit {
                what: "a segmentation".into(),
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

    /// Number of pixels, including the margin.
    fn len(&self) -> usize {
        (self.shape[0] + 2) * self.stride
    }

    /// Copies the pixels across the edges into the margin. Each row of pixels has `each` lines.
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

/// An edge. The high half contains the weight, as bits that have the order of the numbers. The low
/// half contains four times the pixel of the edge, plus the direction.
type Edge = u64;

/// Number of directions of edges. Three start at the edge's pixel: along the row, along the column, and along the
/// falling diagonal. The fourth goes from the pixel's neighbour in the row to its neighbour in the column.
const DIRECTIONS: usize = 4;

fn pack(weight: f32, pixel: usize, direction: usize) -> Edge {
    u64::from(weight.to_bits()) << 32 | (pixel * DIRECTIONS + direction) as u64
}

fn weight(edge: Edge) -> f32 {
    f32::from_bits((edge >> 32) as u32)
}

/// Sorts edges by weight with a radix sort. It is stable, so edges that are given in the order of
/// their numbers keep this order in ties.
fn sort(mut edges: Vec<Edge>) -> Result<Vec<Edge>> {
    const BITS: u32 = 11;
    let digit =
        |edge: Edge, pass: usize| (edge >> (32 + BITS * pass as u32)) as usize % (1 << BITS);
    let mut starts = memory::filled("digits", [[0u32; 1 << BITS]; 3], 1)?;
    let starts = &mut starts[0];
    // Count the digits of all passes at once.
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
        // Convert counts to positions, and distribute the edges.
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
