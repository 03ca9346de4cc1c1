//! The content of a window of a canvas, and which points may or must take the new patch while patches are tried.

use super::canvas::{Canvas, FREE, HELD, Window};
use super::source::{CHANNELS, Look, Source};
use crate::foundation::fixed::Place;

/// Sample that a point of a window shows after a patch is inserted: the old one, the new one, or either.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Tie {
    /// The point stays empty.
    Out,
    Old,
    New,
    Either,
}

/// Content of a window. It is copied from the canvas once and read for every candidate.
pub(super) struct View<const D: usize> {
    pub places: Vec<Place<D>>,
    pub patches: Vec<u32>,
    /// Cost of the seam from each point to the next one, along each axis.
    pub seams: [Vec<f32>; D],
    /// The sum of all seams.
    pub total: f64,
    /// Difference between the patch and the field at each point. Empty if there is one frame for all points.
    pub distortion: Vec<f32>,
    /// Cost of each point that is kept, without its pairs. Empty if these costs are zero.
    pub points: Vec<f32>,
    /// Appearance of the points that are not empty.
    pub looks: Looks,
    /// Sample that each point shows if a patch covers the mask.
    pub ties: Vec<Tie>,
}

impl<const D: usize> View<D> {
    /// Returns the content of a window before a patch with a mask is inserted. Points of the core must take the patch.
    /// `core` may be empty.
    pub(super) fn new(
        canvas: &Canvas<D>,
        window: &Window<D>,
        mask: &[bool],
        core: &[bool],
        source: &Source<D>,
    ) -> Self {
        let points = || window.points.iter().map(|&p| p as usize);
        let patches: Vec<u32> = points().map(|p| canvas.patches[p]).collect();
        let places: Vec<Place<D>> = points().map(|p| canvas.places[p]).collect();
        let seams = std::array::from_fn(|axis| points().map(|p| canvas.seams[p][axis]).collect());
        let mut view = Self::bare(places, patches, seams, mask, core, source);
        if !canvas.distortion.is_empty() {
            view.distortion = points().map(|p| canvas.distortion[p]).collect();
        }
        view
    }

    /// Returns the content of a window from arrays, without bent patches.
    pub(super) fn bare(
        places: Vec<Place<D>>,
        patches: Vec<u32>,
        seams: [Vec<f32>; D],
        mask: &[bool],
        core: &[bool],
        source: &Source<D>,
    ) -> Self {
        let mut looks = Looks::default();
        looks.fit(patches.len());
        let mut ties = Vec::with_capacity(patches.len());
        for (i, &patch) in patches.iter().enumerate() {
            if patch != FREE {
                looks.set(i, &source.look(places[i]));
            }
            // Decide which points have a choice: only those that show a sample and are in the mask, outside the core.
            ties.push(match (patch, mask[i]) {
                (FREE, false) => Tie::Out,
                (FREE, true) => Tie::New,
                (HELD, _) | (_, false) => Tie::Old,
                _ if core.get(i).is_some_and(|&c| c) => Tie::New,
                _ => Tie::Either,
            });
        }
        Self {
            total: seams.iter().flatten().map(|&s| f64::from(s)).sum(),
            places,
            patches,
            seams,
            distortion: Vec::new(),
            points: Vec::new(),
            looks,
            ties,
        }
    }

    /// Returns the cost of a point that is kept, without its pairs.
    #[inline(always)]
    pub(super) fn cost(&self, i: usize) -> f32 {
        self.points.get(i).copied().unwrap_or(0.0)
    }
}

/// Appearance of points in one array per value, so that rows of pairs are judged with SIMD instructions.
#[derive(Debug, Default)]
pub(super) struct Looks {
    colour: [Vec<f32>; CHANNELS],
    depth: Vec<f32>,
    beside: Vec<f32>,
    class: Vec<u8>,
}

impl Looks {
    /// Makes room for a number of points. The values of new points are not defined.
    pub(super) fn fit(&mut self, n: usize) {
        for plane in &mut self.colour {
            plane.resize(n, 0.0);
        }
        self.depth.resize(n, 0.0);
        self.beside.resize(n, 0.0);
        self.class.resize(n, 0);
    }

    #[inline(always)]
    pub(super) fn set(&mut self, i: usize, look: &Look) {
        for c in 0..CHANNELS {
            self.colour[c][i] = look.colour[c];
        }
        self.depth[i] = look.depth;
        self.beside[i] = f32::from(u8::from(look.beside));
        self.class[i] = look.class;
    }

    /// Copies the appearance of a point.
    #[inline(always)]
    pub(super) fn copy(&mut self, i: usize, from: &Self) {
        for c in 0..CHANNELS {
            self.colour[c][i] = from.colour[c][i];
        }
        self.depth[i] = from.depth[i];
        self.beside[i] = from.beside[i];
        self.class[i] = from.class[i];
    }

    /// Returns the difference of colours between a point and an appearance.
    #[inline(always)]
    pub(super) fn distance(&self, i: usize, look: &Look) -> f32 {
        let mut sum = 0.0;
        for c in 0..CHANNELS {
            sum += (self.colour[c][i] - look.colour[c]).abs();
        }
        sum
    }

    /// Returns the appearance of `n` points in a row.
    #[inline(always)]
    pub(super) fn row(&self, from: usize, n: usize) -> Row<'_> {
        let to = from + n;
        Row {
            colour: std::array::from_fn(|c| &self.colour[c][from..to]),
            depth: &self.depth[from..to],
            beside: &self.beside[from..to],
            class: &self.class[from..to],
        }
    }
}

/// Appearance of the points of a row.
#[derive(Clone, Copy)]
pub(super) struct Row<'a> {
    pub colour: [&'a [f32]; CHANNELS],
    pub depth: &'a [f32],
    /// 1 in an element and next to one, else 0.
    pub beside: &'a [f32],
    pub class: &'a [u8],
}
