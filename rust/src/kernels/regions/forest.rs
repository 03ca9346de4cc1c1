//! Regions as trees of pixels, joined over edges.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::{DIRECTIONS, Edge, Frame, pack, weight};
use crate::foundation::memory;
use crate::foundation::par::Monitor;
use crate::{Error, Result};

/// Number of edges whose ends are looked up together. One by one, each lookup would wait for the
/// previous join.
const BATCH: usize = 64;

/// Number of batches between checks for cancellation.
const ASK: usize = 1024;

/// Data of a region, stored at the root of its tree.
#[derive(Clone, Copy)]
struct Tree {
    area: u32,
    /// Limit of the weights: an edge joins the region only if its weight is below this limit.
    bears: f32,
}

pub(super) struct Forest {
    scale: f64,
    /// Parent of each pixel of the frame. Roots are their own parents. The parent of a pixel in the margin of a
    /// wrapped axis is the pixel that it copies.
    parents: Vec<u32>,
    trees: Vec<Tree>,
    /// For each direction, the step from the first end of an edge to the second end.
    steps: [u32; DIRECTIONS],
    triangles: [Vec<Triangle>; DIRECTIONS],
    /// Inactive edges that have woken, the lightest first.
    woken: BinaryHeap<Reverse<Edge>>,
}

/// A triangle that an edge belongs to. It contains the step from the edge's pixel to the third
/// corner, and the two other sides. Side `one` goes from the first end of the edge to that corner.
struct Triangle {
    corner: isize,
    one: Side,
    other: Side,
}

#[derive(Clone, Copy)]
struct Side {
    /// Step to the pixel of the side.
    pixel: isize,
    direction: usize,
    /// Step to the weight of the side, from the weight of direction 0 at the edge's pixel.
    weight: isize,
}

/// A triangle of an edge: (row, column) of the third corner, then direction, row and column of the
/// two sides.
type Corner = ((isize, isize), [(usize, isize, isize); 2]);
const ALONG: [Corner; 4] = [
    ((1, 0), [(1, 0, 0), (3, 0, 0)]),
    ((1, 1), [(2, 0, 0), (1, 0, 1)]),
    ((-1, 0), [(1, -1, 0), (2, -1, 0)]),
    ((-1, 1), [(3, -1, 0), (1, -1, 1)]),
];
const DOWN: [Corner; 4] = [
    ((0, 1), [(0, 0, 0), (3, 0, 0)]),
    ((1, 1), [(2, 0, 0), (0, 1, 0)]),
    ((0, -1), [(0, 0, -1), (2, 0, -1)]),
    ((1, -1), [(3, 0, -1), (0, 1, -1)]),
];
const FALLING: [Corner; 2] = [
    ((0, 1), [(0, 0, 0), (1, 0, 1)]),
    ((1, 0), [(1, 0, 0), (0, 1, 0)]),
];
const RISING: [Corner; 2] = [
    ((0, 0), [(0, 0, 0), (1, 0, 0)]),
    ((1, 1), [(1, 0, 1), (0, 1, 0)]),
];

impl Forest {
    /// Returns a forest whose trees are single pixels.
    pub(super) fn new(frame: &Frame, scale: f64) -> Result<Self> {
        let mut parents = memory::filled("regions of pixels", 0, frame.len())?;
        (0..).zip(&mut parents).for_each(|(i, parent)| *parent = i);
        frame.wrap_lines(&mut parents, 1);
        let alone = Tree {
            area: 1,
            bears: scale as f32,
        };
        let stride = frame.stride as isize;
        let place = |row: isize, column: isize| row * stride + column;
        let side = |(direction, row, column): (usize, isize, isize)| Side {
            pixel: place(row, column),
            direction,
            weight: place(row * DIRECTIONS as isize + direction as isize, column),
        };
        let triangle = |&((row, column), [one, other]): &Corner| Triangle {
            corner: place(row, column),
            one: side(one),
            other: side(other),
        };
        let all = [&ALONG[..], &DOWN, &FALLING, &RISING];
        Ok(Self {
            scale,
            parents,
            trees: memory::filled("regions of pixels", alone, frame.len())?,
            steps: [1, stride as u32, stride as u32 + 1, stride as u32 - 1],
            triangles: all.map(|corners| corners.iter().map(triangle).collect()),
            woken: BinaryHeap::new(),
        })
    }

    /// Joins similar regions over all edges. `edges` contains the edges that are not inactive. Returns the pairs of
    /// roots that these edges did not join.
    pub(super) fn join_alike(
        &mut self,
        edges: &[Edge],
        weights: &[f32],
        monitor: &Monitor,
    ) -> Result<Vec<[u32; 2]>> {
        let mut left = Vec::new();
        let mut apart = [(0, [0; 2]); BATCH];
        for (i, batch) in edges.chunks(BATCH).enumerate() {
            if i % ASK == 0 {
                monitor.check()?;
            }
            let mut count = 0;
            for &edge in batch {
                let ends = self.ends(edge).map(|end| self.shorten(end));
                // Write without a branch. Edges inside one tree are overwritten by the next edge.
                apart[count] = (edge, ends);
                count += usize::from(ends[0] != ends[1]);
            }
            for &(edge, ends) in &apart[..count] {
                self.join_woken(edge);
                self.join(edge, ends, weights, &mut left)?;
            }
        }
        self.join_woken(Edge::MAX);
        Ok(left)
    }

    /// Returns the two pixels of an edge.
    #[inline(always)]
    fn ends(&self, edge: Edge) -> [u32; 2] {
        let number = edge as u32;
        let direction = number as usize % DIRECTIONS;
        let first = number / DIRECTIONS as u32 + u32::from(direction == 3);
        [first, first + self.steps[direction]]
    }

    /// Returns the ancestor three steps nearer to the root, and makes it the parent of the pixel.
    #[inline(always)]
    fn shorten(&mut self, pixel: u32) -> u32 {
        let parents = &mut self.parents;
        let mut near = pixel;
        for _ in 0..3 {
            near = parents[near as usize];
        }
        parents[pixel as usize] = near;
        near
    }

    #[inline(always)]
    fn root(&self, mut pixel: u32) -> u32 {
        loop {
            let parent = self.parents[pixel as usize];
            if parent == pixel {
                return pixel;
            }
            pixel = parent;
        }
    }

    /// Joins two trees. The root of the larger tree becomes the root of both.
    #[inline(always)]
    fn unite(&mut self, roots: [u32; 2]) -> &mut Tree {
        let [one, other] = roots.map(|root| self.trees[root as usize].area);
        let [root, joined] = if one < other {
            [roots[1], roots[0]]
        } else {
            roots
        };
        self.parents[joined as usize] = root;
        let tree = &mut self.trees[root as usize];
        tree.area = one + other;
        tree
    }

    /// Returns, for both trees, whether the weight of an edge reaches the limit of the tree.
    #[inline(always)]
    fn are_full(&self, roots: [u32; 2], weight: f32) -> [bool; 2] {
        roots.map(|root| weight >= self.trees[root as usize].bears)
    }

    #[inline(always)]
    fn unite_over(&mut self, roots: [u32; 2], weight: f32) {
        let scale = self.scale;
        let tree = self.unite(roots);
        tree.bears = (f64::from(weight) + scale / f64::from(tree.area)) as f32;
    }

    #[inline(always)]
    fn join(
        &mut self,
        edge: Edge,
        ends: [u32; 2],
        weights: &[f32],
        left: &mut Vec<[u32; 2]>,
    ) -> Result<()> {
        let roots = ends.map(|end| self.root(end));
        if roots[0] == roots[1] {
            return Ok(());
        }
        match self.are_full(roots, weight(edge)) {
            [false, false] => self.unite_over(roots, weight(edge)),
            full => {
                if left.len() == left.capacity() {
                    left.try_reserve(left.len().max(1 << 10)).map_err(no_room)?;
                }
                left.push(roots);
                if full[0] != full[1] {
                    self.wake(edge, usize::from(full[0]), roots, weights)?;
                }
            }
        }
        Ok(())
    }

    /// Joins regions over woken edges that are lighter than the given edge.
    #[inline(always)]
    fn join_woken(&mut self, before: Edge) {
        while let Some(&Reverse(edge)) = self.woken.peek()
            && edge < before
        {
            self.woken.pop();
            let roots = self.ends(edge).map(|end| self.root(end));
            if roots[0] != roots[1] && self.are_full(roots, weight(edge)) == [false; 2] {
                self.unite_over(roots, weight(edge));
            }
        }
    }

    /// Wakes the sides of an edge's triangles that are the heaviest of their triangle. A side is woken only if it
    /// connects the end of the edge whose tree is not full with another tree that is not full.
    fn wake(&mut self, edge: Edge, end: usize, roots: [u32; 2], weights: &[f32]) -> Result<()> {
        let (pixel, direction) = (
            edge as u32 as usize / DIRECTIONS,
            edge as usize % DIRECTIONS,
        );
        let stride = self.steps[1] as usize;
        let own = pixel + (DIRECTIONS - 1) * (pixel / stride) * stride;
        let at = |from: usize, by: isize| from.wrapping_add_signed(by);
        // The weights of a row are stored in one line for each direction.
        for triangle in &self.triangles[direction] {
            let sides = [triangle.one, triangle.other];
            let (side, other) = (sides[end], sides[1 - end]);
            let [heavy, light] = [side, other].map(|s| weights[at(own, s.weight)].abs());
            if !(heavy > light && heavy > weight(edge) && heavy < f32::INFINITY) {
                continue;
            }
            let corner = self.root(at(pixel, triangle.corner) as u32);
            if corner != roots[end] && weight(edge) < self.trees[corner as usize].bears {
                self.woken.try_reserve(1).map_err(no_room)?;
                let edge = pack(heavy, at(pixel, side.pixel), side.direction);
                self.woken.push(Reverse(edge));
            }
        }
        Ok(())
    }

    /// Joins trees below an area to their neighbours. `left` contains the edges between them, in
    /// the order of their weights.
    pub(super) fn join_small(&mut self, left: &[[u32; 2]], least: usize) {
        for roots in left {
            let roots = roots.map(|root| self.root(root));
            let areas = roots.map(|root| self.trees[root as usize].area as usize);
            if roots[0] != roots[1] && (areas[0] < least || areas[1] < least) {
                self.unite(roots);
            }
        }
    }

    /// Returns the number of the tree of each pixel. Trees are numbered in the order of their first
    /// pixels.
    pub(super) fn number(mut self, frame: &Frame) -> Result<Vec<i32>> {
        let [rows, columns] = frame.shape;
        memory::check::<i32>("regions", rows * columns)?;
        let mut numbers = Vec::with_capacity(rows * columns);
        let mut next = 0;
        for row in 1..=rows {
            for pixel in (row * frame.stride + 1..).take(columns) {
                let root = self.root(pixel as u32);
                self.parents[pixel] = root;
                let tree = &mut self.trees[root as usize];
                if tree.bears >= 0.0 {
                    // This is the first pixel of the tree, so its area is replaced by its number.
                    *tree = Tree {
                        area: next,
                        bears: -1.0,
                    };
                    next += 1;
                }
                numbers.push(tree.area as i32);
            }
        }
        Ok(numbers)
    }
}

fn no_room<E>(_: E) -> Error {
    Error::Limit {
        what: "edges between regions".into(),
        needed: "more memory".into(),
        limit: "the available memory".into(),
    }
}
