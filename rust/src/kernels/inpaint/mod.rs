//! Exemplar-based filling of holes: from the rim inwards, the best matching patch is joined to the known pixels by a
//! minimum cut.
//!
//! The method follows Criminisi, Perez and Toyama (*Region filling and object removal by exemplar-based inpainting*,
//! IEEE TIP 2004). Patches are pasted by the graph cuts of Kwatra et al. (*Graphcut textures*, SIGGRAPH 2003). Shen et
//! al. 2006, section 3.4, combined both:
//!
//! 1. take the unknown pixel with the most known pixels around it, and the window over it whose known fraction is
//!    nearest to 0.6;
//! 2. find good matches of the known pixels in the window, with the largest weights near the hole;
//! 3. increase the cost of matches that would repeat or mirror their neighbourhood, and choose the match whose minimum
//!    cut is cheapest;
//! 4. paste this match, and repeat until no hole is left.
//!
//! The literal method visits unknown pixels in scan order, centres the window on the pixel and takes the best match at
//! once. Its last patches must fit known pixels on several sides, which tears large elements. In the order from the
//! rim inwards, patches meet other patches, and a cut may run between them. Trying several windows and judging matches
//! by their actual cuts leaves fewer visible seams.

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

/// Positions of the unknown pixel in the windows that are tried, as fractions of the window's side.
const ANCHORS: [f64; 5] = [0.25, 0.4, 0.5, 0.6, 0.75];
/// Preferred fraction of known pixels in a window.
const KNOWN_SHARE: f64 = 0.6;
/// Weight of a known pixel far from the hole. Next to the hole the weight is larger by 1.
const FAR_WEIGHT: f32 = 0.05;
/// Weight of a pixel that must stay and is next to the hole. It is large because a cut cannot move away from such a
/// pixel. It falls off at half the distance of other weights.
const KEPT_WEIGHT: f32 = 10.0;
/// Constant that is added to the gradient in the cost of a seam along pixels that must stay. It is half the constant
/// that cuts add to the sum of two gradients.
const FLAT: f32 = 0.025;

/// Parameters of the filling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Rows and columns of a patch.
    pub patch: [usize; 2],
    /// Choice of the matches that are considered. The literal method computes the cut of each of them, the default
    /// method only of the three most promising.
    pub pick: Pick,
    /// Seed for the patches of windows without known pixels.
    pub seed: u64,
    /// If true, use the method of Shen et al. (2006) as printed: scan order, windows centred on the unknown pixel, and
    /// equal weights of all known pixels. It takes the exact best matches, and the cost of a cut is the plain
    /// difference.
    pub paper: bool,
    /// Index of the exemplar that equals the known part of the canvas, if there is one. Matches that repeat the
    /// surroundings of a hole then cost more.
    pub shown: Option<usize>,
    /// Lattice of the image `shown`, with a shift in each column. If given, patches are copied from places of it that
    /// are in step with the lattice, as long as there are any.
    pub lattice: Option<[[f64; 2]; 2]>,
}

/// A pasted patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patch {
    /// Index of the exemplar that the patch was copied from.
    pub exemplar: usize,
    /// Top-left corner in the exemplar.
    pub from: [usize; 2],
    /// Top-left corner on the canvas.
    pub to: [usize; 2],
}

/// The pasted patches and their pixels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Inpainting {
    /// Number of the patch that each pixel of the canvas comes from, or -1 if no patch was pasted
    /// there.
    pub label: Vec<i32>,
    /// The patches, in the order of pasting.
    pub patches: Vec<Patch>,
}

/// An image with holes.
pub struct Canvas<'a> {
    /// Shape and wrapped axes.
    pub grid: Grid<2>,
    /// Samples (rows, columns, channels). Unknown pixels may have any value.
    pub colours: &'a mut [f32],
    /// Flags of the known pixels (rows, columns).
    pub known: &'a mut [bool],
    /// Flags of the known pixels that must not be pasted over, if any.
    pub keep: Option<&'a [bool]>,
    /// Number of channels.
    pub channels: usize,
}

/// Fills every hole of the canvas with patches of the exemplars.
pub fn inpaint(
    canvas: &mut Canvas<'_>,
    index: &Index,
    options: &Options,
    monitor: &Monitor,
) -> Result<Inpainting> {
    let [rows, columns] = canvas.grid.shape();
    let Options { patch, paper, .. } = *options;
    // Check the arguments.
    // Places in step with a lattice are listed, and scored, all at once.
    let each = if options.lattice.is_some() { 96 } else { 32 };
    memory::room("the inpainting", canvas.grid.len(), each)?;
    if canvas.channels != index.channels() {
        let message = format!(
            "must have {1} channels like the exemplars, got {0}",
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
            "must have sides from 1 to those of the canvas, {:?}, got {patch:?}",
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
            "must be an exemplar of the shape {1:?} of the canvas, got {0:?}",
            options.shown,
            [rows, columns]
        );
        return Err(Error::value("shown", message));
    }
    if let Some([[a, b], [c, d]]) = options.lattice {
        let area = a * d - b * c;
        if !area.is_finite() || area.abs() < 1.0 || options.shown.is_none() {
            return Err(Error::value(
                "lattice",
                "must have finite columns that span at least a pixel, and needs shown",
            ));
        }
    }
    // Prepare the search, the stitchers and the order of the unknown pixels.
    let mut result = Inpainting {
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
        // Find matches for the next window.
        window.read(canvas, to);
        if paper {
            window.level();
        }
        let matches = chooser.matches(&window, to, &result.patches, monitor)?;
        stitchers.resize_with(matches.len().max(stitchers.len()), Mutex::default);
        // Lowest cost so far, stored as bits, because the bits of non-negative floats have the same order as the
        // floats.
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
        // Take the cheapest cut. Ties go to the better match.
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

/// Order of visiting the unknown pixels.
enum Order {
    /// Row by row, starting at this pixel.
    Scan(usize),
    Inwards(Front),
}

impl Order {
    /// Returns the corner of the next window.
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
                // Try windows that contain the pixel at several positions, and take the window whose known fraction is
                // nearest to the preferred fraction.
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
