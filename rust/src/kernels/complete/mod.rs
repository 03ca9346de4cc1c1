//! Filling holes by example: from the rim inwards, the best matching patch, cut into what is known.
//!
//! After Criminisi, Perez and Toyama (*Region filling and object removal by exemplar-based inpainting*, IEEE TIP 2004) with the
//! graph-cut paste of Kwatra et al. (*Graphcut textures*, SIGGRAPH 2003), as Shen et al. 2006, section 3.4, combine them:
//!
//! 1. take the hole that has most around it, and the window over it whose known share is nearest to 0.6;
//! 2. find good matches of what is known in it, near pixels of the hole counting most;
//! 3. drop those that would repeat or mirror what lies near; cut the best of the others into the known part, and take the one
//!    whose cut is the cheapest;
//! 4. paste it, and go on until no hole is left.
//!
//! The literal method goes in scan order, centres the window and takes the best match at once. In scan order the last rows
//! meet the far border of a hole with no choice left, which tears what is large; from the rim inwards patches meet patches,
//! between which a cut may run. Offering several windows, and judging matches by the cut that they really get, leaves fewer
//! visible seams.

mod choose;
mod front;
mod window;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::foundation::grid::Grid;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::kernels::patch_search::{Index, Pick};
use crate::kernels::seam::stitch::Stitcher;
use crate::{Error, Result};
use choose::Chooser;
use front::{Front, corner};
use window::Window;

/// Where the hole may sit in the window, as a share of its side.
const ANCHORS: [f64; 5] = [0.25, 0.4, 0.5, 0.6, 0.75];
/// The share of a window that is best known already.
const KNOWN_SHARE: f64 = 0.6;
/// Weight of a known pixel far from the hole; next to it the weight is one more.
const FAR_WEIGHT: f32 = 0.05;
/// How many times more a pixel that must stay weighs beside the hole, half as far: a cut cannot move away from it.
const KEPT_WEIGHT: f32 = 10.0;
/// Half of what cuts add to the gradients by which they divide.
const FLAT: f32 = 0.025;

/// How holes are filled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Rows and columns of a patch.
    pub patch: [usize; 2],
    /// Which matches are considered; the literal method cuts them all, the other one the three most promising.
    pub pick: Pick,
    /// Seed of the patches that have nothing to match.
    pub seed: u64,
    /// As Shen et al. (2006) print it: scan order, windows centred on the hole, all known pixels of one weight, the exact
    /// best matches, plain differences as the cost of a cut.
    pub paper: bool,
    /// The exemplar that the known part of the canvas shows in place, if it does: then what lies beside a hole is not
    /// repeated in it.
    pub shown: Option<usize>,
}

/// One pasted patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patch {
    /// The exemplar it was copied from.
    pub exemplar: usize,
    /// Its top-left corner there.
    pub from: [usize; 2],
    /// Its top-left corner on the canvas.
    pub to: [usize; 2],
}

/// What was pasted where.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Completion {
    /// The patch that each pixel of the canvas comes from; -1 where nothing was pasted.
    pub label: Vec<i32>,
    /// The patches, in the order in which they were pasted.
    pub patches: Vec<Patch>,
}

/// A picture with holes.
pub struct Canvas<'a> {
    /// Shape, and which axes are cyclic.
    pub grid: Grid<2>,
    /// Samples (rows, columns, channels); anything where unknown.
    pub colours: &'a mut [f32],
    /// What is known (rows, columns).
    pub known: &'a mut [bool],
    /// Known pixels that nothing may be pasted over; none if absent.
    pub keep: Option<&'a [bool]>,
    /// Samples a pixel.
    pub channels: usize,
}

/// Fills every hole of the canvas with patches of the exemplars.
pub fn complete(
    canvas: &mut Canvas<'_>,
    index: &Index,
    options: &Options,
    monitor: &Monitor,
) -> Result<Completion> {
    let [rows, columns] = canvas.grid.shape();
    let Options { patch, paper, .. } = *options;
    memory::room("the completion", canvas.grid.len(), 32)?;
    if canvas.channels != index.channels() {
        let message = format!(
            "has {} channels, the exemplars have {}",
            canvas.channels,
            index.channels()
        );
        return Err(Error::value("colours", message));
    }
    if canvas.known.len() != canvas.grid.len()
        || canvas.colours.len() != canvas.grid.len() * canvas.channels
    {
        let (expected, got) = (
            vec![rows, columns, canvas.channels],
            vec![canvas.known.len(), canvas.colours.len()],
        );
        return Err(Error::Shape {
            argument: "colours",
            expected,
            got,
        });
    }
    if canvas
        .keep
        .is_some_and(|keep| keep.len() != canvas.grid.len())
    {
        return Err(Error::Shape {
            argument: "keep",
            expected: vec![rows, columns],
            got: vec![canvas.keep.map_or(0, <[bool]>::len)],
        });
    }
    if (0..2).any(|axis| patch[axis] == 0 || patch[axis] > canvas.grid.shape()[axis]) {
        let message = format!(
            "each side needs 1 to the canvas's {:?}, got {patch:?}",
            canvas.grid.shape()
        );
        return Err(Error::value("patch", message));
    }
    if options.shown.is_some_and(|shown| {
        index
            .exemplars()
            .get(shown)
            .is_none_or(|e| e.shape != [rows, columns])
    }) {
        let message = format!(
            "{:?} is no exemplar of the shape of the canvas, {:?}",
            options.shown,
            [rows, columns]
        );
        return Err(Error::value("shown", message));
    }
    let mut result = Completion {
        label: vec![-1; canvas.grid.len()],
        patches: Vec::new(),
    };
    let mut window = Window::new(patch, canvas.channels);
    let chooser = Chooser::new(index, options, canvas.grid);
    let mut stitchers: Vec<Mutex<Stitcher<2>>> = Vec::new();
    let holes = canvas.known.iter().filter(|known| !**known).count();
    monitor.expect(holes as u64);
    let mut order = if paper {
        Order::Scan(0)
    } else {
        Order::Inwards(Front::new(canvas.grid, patch, canvas.known))
    };
    while let Some(to) = order.next(canvas, patch) {
        window.read(canvas, to);
        if paper {
            window.level();
        }
        let matches = chooser.matches(&window, to, &result.patches, monitor)?;
        stitchers.resize_with(matches.len().max(stitchers.len()), Mutex::default);
        // The least cost so far; bits of numbers that are not negative are ordered as they are.
        let least = AtomicU64::new(f64::INFINITY.to_bits());
        let cuts = par::map(matches.len(), |i| {
            let bound = f64::from_bits(least.load(Ordering::Relaxed));
            let stitcher = stitchers[i].lock();
            let mut stitcher = stitcher.unwrap_or_else(PoisonError::into_inner);
            let cut = window.cut(index, &matches[i], paper, bound, &mut stitcher, monitor)?;
            if let Some((value, _)) = &cut {
                least.fetch_min(value.to_bits(), Ordering::Relaxed);
            }
            Ok(cut)
        });
        let mut best: Option<(f64, usize, Vec<bool>)> = None;
        for (i, cut) in cuts.into_iter().enumerate() {
            if let Some((value, taken)) = cut?
                && best.as_ref().is_none_or(|&(least, ..)| value < least)
            {
                best = Some((value, i, taken));
            }
        }
        let Some((_, chosen, taken)) = best else {
            unreachable!("the cheapest is within any bound")
        };
        let filled = window.paste(canvas, index, &matches[chosen], &taken, to, &mut result);
        debug_assert!(!filled.is_empty());
        if let Order::Inwards(front) = &mut order {
            front.filled(to, canvas.known);
        }
        monitor.advance(filled.len() as u64)?;
    }
    Ok(result)
}

/// How holes follow each other.
enum Order {
    /// Row by row, from this pixel on.
    Scan(usize),
    Inwards(Front),
}

impl Order {
    /// The corner of the next window.
    fn next(&mut self, canvas: &Canvas<'_>, patch: [usize; 2]) -> Option<[usize; 2]> {
        match self {
            Self::Scan(cursor) => {
                *cursor += canvas.known[*cursor..].iter().position(|known| !known)?;
                Some(corner(
                    &canvas.grid,
                    patch,
                    canvas.grid.point(*cursor),
                    [0.5; 2],
                ))
            }
            Self::Inwards(front) => {
                let hole = canvas.grid.point(front.next()?);
                let pixels = (patch[0] * patch[1]) as f64;
                let mut best = (f64::INFINITY, [0, 0]);
                for down in ANCHORS {
                    for across in ANCHORS {
                        let to = front.corner(hole, [down, across]);
                        let known = 1.0 - front.unknown(to) as f64 / pixels;
                        let off = (known - KNOWN_SHARE).abs();
                        if off < best.0 {
                            best = (off, to);
                        }
                    }
                }
                Some(best.1)
            }
        }
    }
}
