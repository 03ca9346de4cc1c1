//! Nested dissection: the order of elimination of the unknowns, and the tree of blocks that are
//! eliminated together.
//!
//! George, "Nested dissection of a regular finite element mesh", SIAM Journal on Numerical Analysis
//! 10(2), 1973. The unknowns on both sides of a separator are not coupled, so elimination does not
//! fill in entries between them. The separator comes last.
//!
//! Unknowns of a grid are divided along its lines, straight or diagonal. If each unknown is coupled to all unknowns
//! within k steps, a diagonal separator encloses twice as much as a straight separator of equal size. Other unknowns
//! are divided along the levels of a breadth-first search (George and Liu's automatic nested dissection).

use super::cut::{Cut, Scratch};
use super::grid::{AXES, Grid, Item, Links};
use super::{Checked, NONE};
use crate::Result;
use crate::foundation::memory;
use crate::foundation::par::Monitor;

/// Maximum number of unknowns in a part that is not divided any further.
const LEAF: usize = 20;

/// Unknowns that are eliminated together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    /// First unknown, in the order of elimination.
    pub(super) start: u32,
    /// End of the range, exclusive.
    pub(super) end: u32,
    /// The parent block in the tree, which is eliminated later, or [`NONE`].
    pub(super) parent: u32,
}

/// Order of elimination of the unknowns.
#[derive(Debug)]
pub(super) struct Order {
    /// The unknown at each place of the order.
    pub(super) unknown: Vec<u32>,
    /// Number of unknowns that are not coupled to others. They come first.
    pub(super) alone: usize,
    /// All other unknowns, block by block. Each block follows after its children.
    pub(super) blocks: Vec<Block>,
}

/// Orders the unknowns of a matrix.
pub(super) fn dissect(matrix: &Checked<'_>, monitor: &Monitor) -> Result<Order> {
    let what = "the order of the matrix";
    let size = matrix.size();
    // Group connected unknowns, and describe each unknown by its place on the grid or by its
    // number.
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
    // The last part is processed first, so that in reverse order every block comes after its
    // children.
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
        // A divided part becomes a block for the separator and two tasks for the sides.
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
    // Reverse the blocks and their parents' numbers.
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

/// Lists unknowns group by group, where a group is connected. Uncoupled unknowns come first. Also
/// returns the end of each group and the number of uncoupled unknowns.
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
    // Find connected groups by union-find. The lowest unknown is the root.
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
    // From here on, `count` is the position of the next unknown of each group.
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
