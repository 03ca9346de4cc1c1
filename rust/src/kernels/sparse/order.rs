//! Nested dissection: unknowns in the order of their elimination, and the tree of blocks that are eliminated together.
//!
//! George, "Nested dissection of a regular finite element mesh", SIAM Journal on Numerical Analysis 10(2), 1973: what lies on
//! either side of a separator has nothing to do with the other, and fills in nothing there; the separator comes last. The
//! unknowns of a grid are cut along lines of it, straight or aslant: where each has to do with those that lie so many steps away, a
//! separator aslant encloses twice as much as a straight one of as many unknowns. Those of all else are cut along the levels of
//! a breadth-first search (George and Liu's automatic nested dissection).

use super::cut::{Cut, Scratch};
use super::grid::{AXES, Grid, Item, Links};
use super::{Checked, NONE};
use crate::Result;
use crate::foundation::memory;
use crate::foundation::par::Monitor;

/// Unknowns that are not parted any more.
const LEAF: usize = 20;

/// Unknowns that are eliminated together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    /// The first of them, in the order of elimination.
    pub(super) start: u32,
    /// The one after the last.
    pub(super) end: u32,
    /// The block that is waited for next, or [`NONE`].
    pub(super) parent: u32,
}

/// In what order unknowns are eliminated.
#[derive(Debug)]
pub(super) struct Order {
    /// The unknown at each place of the order.
    pub(super) unknown: Vec<u32>,
    /// How many come first that have to do with no other.
    pub(super) alone: usize,
    /// All others, block by block, each after those that it is the parent of.
    pub(super) blocks: Vec<Block>,
}

/// Orders the unknowns of a matrix.
pub(super) fn dissect(matrix: &Checked<'_>, monitor: &Monitor) -> Result<Order> {
    let what = "the order of the matrix";
    let size = matrix.size();
    let (list, ends, alone) = part(matrix)?;
    let grid = Grid::recognise(matrix)?;
    let links = match grid {
        Some(_) => Links::default(),
        None => Links::new(matrix)?,
    };
    let columns = grid.map_or(0, |grid| grid.columns);
    let mut items: Vec<Item> = memory::filled(what, [0; AXES], size)?;
    for (item, &unknown) in items.iter_mut().zip(&list) {
        *item = match grid {
            Some(grid) => grid.place(unknown),
            None => [0, unknown, 0, 0],
        };
    }
    let mut scratch = Scratch::new(size, grid.is_some())?;
    let mut blocks: Vec<Block> = Vec::new();
    let mut tasks: Vec<(usize, usize, u32)> = Vec::new();
    let mut first = alone;
    for &end in &ends {
        tasks.push((first, end, NONE));
        first = end;
    }
    // The last part first: read backwards, every block comes after its children.
    while let Some((first, end, parent)) = tasks.pop() {
        monitor.check()?;
        if first == end {
            continue;
        }
        let part = &mut items[first..end];
        let cut = match (part.len() > LEAF, grid) {
            (false, _) => Cut::Leaf,
            (true, Some(grid)) => scratch.cut_grid(part, grid),
            (true, None) => scratch.cut_levels(part, &links),
        };
        match cut {
            Cut::Leaf => blocks.push(Block {
                start: first as u32,
                end: end as u32,
                parent,
            }),
            Cut::Parts { low, high } => {
                let (middle, last) = (first + low, first + low + high);
                let own = if last < end {
                    blocks.push(Block {
                        start: last as u32,
                        end: end as u32,
                        parent,
                    });
                    blocks.len() as u32 - 1
                } else {
                    parent
                };
                tasks.push((first, middle, own));
                tasks.push((middle, last, own));
            }
            Cut::Pieces(sizes) => {
                let mut at = first;
                for size in sizes {
                    tasks.push((at, at + size, parent));
                    at += size;
                }
            }
        }
    }
    blocks.reverse();
    let last = blocks.len() as u32;
    for block in &mut blocks {
        if block.parent != NONE {
            block.parent = last - 1 - block.parent;
        }
    }
    let mut unknown = list;
    for (unknown, item) in unknown.iter_mut().zip(&items) {
        *unknown = item[0] * columns + item[1];
    }
    Ok(Order {
        unknown,
        alone,
        blocks,
    })
}

/// Lists unknowns by what they have to do with each other, those that are alone first; with where each group ends.
fn part(matrix: &Checked<'_>) -> Result<(Vec<u32>, Vec<usize>, usize)> {
    let size = matrix.size();
    let what = "the order of the matrix";
    let mut root: Vec<u32> = memory::filled(what, 0, size)?;
    for (i, root) in root.iter_mut().enumerate() {
        *root = i as u32;
    }
    let find = |root: &mut [u32], mut i: u32| {
        while root[i as usize] != i {
            let next = root[root[i as usize] as usize];
            root[i as usize] = next;
            i = next;
        }
        i
    };
    for column in 0..size {
        let mut own = find(&mut root, column as u32);
        for &row in matrix.below(column) {
            if root[row as usize] == own {
                continue;
            }
            let other = find(&mut root, row);
            let (low, high) = (own.min(other), own.max(other));
            root[high as usize] = low;
            own = low;
        }
    }
    let mut count: Vec<u32> = memory::filled(what, 0, size)?;
    for i in 0..size as u32 {
        let own = find(&mut root, i);
        root[i as usize] = own;
        count[own as usize] += 1;
    }
    let alone = count.iter().filter(|&&n| n == 1).count();
    let (mut single, mut next, mut ends) = (0, alone, Vec::new());
    // From here on, where the next of a group goes.
    for count in &mut count {
        match *count {
            0 => {}
            1 => {
                *count = single;
                single += 1;
            }
            n => {
                *count = next as u32;
                next += n as usize;
                ends.push(next);
            }
        }
    }
    let mut list: Vec<u32> = memory::filled(what, 0, size)?;
    for (i, &own) in root.iter().enumerate() {
        let at = &mut count[own as usize];
        list[*at as usize] = i as u32;
        *at += 1;
    }
    Ok((list, ends, alone))
}
