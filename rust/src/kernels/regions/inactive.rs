//! Edges that need not be sorted because they are heavier than the two other edges of a triangle. They stay inactive
//! until one of these edges has separated two regions.
//!
//! A region is *full* after an edge was too heavy for it. All later edges are heavier, so the
//! region does not change any more. Let u-v be the heaviest edge of a triangle u, v, y. There are
//! two cases:
//!
//! - u-v would join two regions that are not full. Then u-y and y-v came before, and did not both join their regions,
//!   because otherwise u and v would be in one region. So y is in a third region, which was full when the first of the
//!   two edges came. It is therefore enough to consider u-v from the time when an edge separates a full region from a
//!   region that is not full. This is detected at u-y or at y-v.
//! - u-v would join the small region of v to the region of u. Then y-v, which came before, has joined v and y, so both
//!   have the area of their union. The lighter edge u-y has joined u and y, or has separated two regions that are
//!   large enough. So u-v is never the edge that joins a small region.
//!
//! The heaviest edges of triangles are therefore left out of the list of edges. An edge stays in the list if, in all
//! its triangles, both other edges are heaviest edges themselves. Such edges might not wake it. `Forest` wakes
//! inactive edges. For photographs, 40 % of the edges are sorted, and 1 in 80 of the others wakes.

use super::{DIRECTIONS, Edge, Frame, pack};
use crate::Result;
use crate::foundation::memory;
use crate::foundation::simd::wide_fn;

/// Marks the heaviest edges of triangles by a negative sign of their weights.
pub(super) fn mark(weights: &mut [f32], frame: &Frame) {
    let ([rows, columns], row) = (frame.shape, DIRECTIONS * frame.stride);
    let mut bounds = vec![0.0; DIRECTIONS * columns];
    for first in (1..=rows).map(|r| r * row) {
        let [above, here, below] =
            [first - row, first, first + row].map(|at| &weights[at..][..row]);
        bound::<false>([above, here, below], frame.stride, &mut bounds);
        let lines = weights[first..][..row].chunks_exact_mut(frame.stride);
        for (line, bounds) in lines.zip(bounds.chunks_exact(columns)) {
            sign(&mut line[1..=columns], bounds);
        }
    }
    frame.wrap_lines(weights, DIRECTIONS);
}

wide_fn! {
    fn sign(line: &mut [f32], bounds: &[f32]) {
        for (weight, bound) in line.iter_mut().zip(bounds) {
            let sign = if *weight > *bound { 1u32 << 31 } else { 0 };
            *weight = f32::from_bits(weight.to_bits() | sign);
        }
    }
}

/// Returns the edges that are not inactive, in the order of their numbers.
pub(super) fn list_others(weights: &[f32], frame: &Frame) -> Result<Vec<Edge>> {
    let ([rows, columns], stride) = (frame.shape, frame.stride);
    let row = DIRECTIONS * stride;
    let mut bounds = vec![0.0; DIRECTIONS * columns];
    let mut list = memory::filled("edges between pixels", 0, DIRECTIONS * rows * columns)?;
    let mut length = 0;
    for r in 1..=rows {
        let [above, here, below] = [r - 1, r, r + 1].map(|r| &weights[r * row..][..row]);
        bound::<true>([above, here, below], stride, &mut bounds);
        let lines: [&[f32]; DIRECTIONS] =
            std::array::from_fn(|d| &here[d * stride + 1..][..columns]);
        let bounds: [&[f32]; DIRECTIONS] =
            std::array::from_fn(|d| &bounds[d * columns..][..columns]);
        let list = &mut list[length..][..DIRECTIONS * columns];
        let mut count = 0;
        for x in 0..columns {
            for direction in 0..DIRECTIONS {
                let weight = lines[direction][x].abs();
                let awake = weight <= bounds[direction][x] && weight < f32::INFINITY;
                // Write without a branch, which would be unpredictable. Rejected edges are
                // overwritten by the next edge.
                list[count] = pack(weight, r * stride + x + 1, direction);
                count += usize::from(awake);
            }
        }
        length += count;
    }
    list.truncate(length);
    Ok(list)
}

wide_fn! {
    /// Computes the weights above which the edges of a row are inactive, one line for each direction. The bound is the
    /// minimum over the triangles of an edge of the heavier of their two other edges. With `WITNESS`, triangles whose
    /// two other edges are both marked are ignored.
    fn bound<const WITNESS: bool>(rows: [&[f32]; 3], stride: usize, out: &mut [f32]) {
        let n = stride - 2;
        // Returns the edge weights of one row in one direction, starting at the first pixel, or at the pixel before or
        // after it.
        let line = |row: usize, direction: usize, shift: usize| {
            &rows[row][direction * stride + shift..][..n]
        };
        let (before, at, after) = (0, 1, 2);
        let (above, here, below) = (0, 1, 2);
        let (along, down, falling, rising) = (0, 1, 2, 3);
        let (first, rest) = out.split_at_mut(n);
        least::<WITNESS>(first, [
            [line(here, down, at), line(here, rising, at)],
            [line(here, down, after), line(here, falling, at)],
            [line(above, down, at), line(above, falling, at)],
            [line(above, down, after), line(above, rising, at)],
        ]);
        let (second, rest) = rest.split_at_mut(n);
        least::<WITNESS>(second, [
            [line(here, along, at), line(here, rising, at)],
            [line(below, along, at), line(here, falling, at)],
            [line(here, along, before), line(here, falling, before)],
            [line(below, along, before), line(here, rising, before)],
        ]);
        let (third, fourth) = rest.split_at_mut(n);
        let (tops, bottoms) = (line(here, along, at), line(below, along, at));
        let (lefts, rights) = (line(here, down, at), line(here, down, after));
        least_of_two::<WITNESS>(third, [[tops, rights], [bottoms, lefts]]);
        least_of_two::<WITNESS>(fourth, [[tops, lefts], [bottoms, rights]]);
    }
}

#[inline(always)]
fn least<const WITNESS: bool>(out: &mut [f32], [a, b, c, d]: [[&[f32]; 2]; 4]) {
    for (i, out) in out.iter_mut().enumerate() {
        // Avoid a closure over the four lines, because it would not be compiled for SIMD registers.
        let (a, b) = (heavier::<WITNESS>(a, i), heavier::<WITNESS>(b, i));
        let (c, d) = (heavier::<WITNESS>(c, i), heavier::<WITNESS>(d, i));
        *out = lesser(lesser(a, b), lesser(c, d));
    }
}

#[inline(always)]
fn least_of_two<const WITNESS: bool>(out: &mut [f32], [a, b]: [[&[f32]; 2]; 2]) {
    for (i, out) in out.iter_mut().enumerate() {
        *out = lesser(heavier::<WITNESS>(a, i), heavier::<WITNESS>(b, i));
    }
}

#[inline(always)]
fn heavier<const WITNESS: bool>([one, other]: [&[f32]; 2], i: usize) -> f32 {
    let (one, other) = (one[i], other[i]);
    let (a, b) = (one.abs(), other.abs());
    let more = if a > b { a } else { b };
    if !WITNESS {
        return more;
    }
    let both = ((one.to_bits() & other.to_bits()) as i32 >> 31) as u32;
    f32::from_bits(more.to_bits() & !both | f32::INFINITY.to_bits() & both)
}

#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
