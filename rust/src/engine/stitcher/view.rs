//! What a window of a canvas shows, and what its points may do while patches are tried there.

use super::canvas::{Canvas, FREE, HELD, Window};
use super::source::{CHANNELS, Look, Source};
use crate::foundation::fixed::Place;

/// What a point of a window must do.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Tie {
    /// It shows nothing, and will not.
    Out,
    Old,
    New,
    Either,
}

/// A window, point by point: read many times while patches are tried there.
pub(super) struct View<const D: usize> {
    pub places: Vec<Place<D>>,
    pub patches: Vec<u32>,
    /// Cost of the seam from each point to the next one, along each axis.
    pub seams: [Vec<f32>; D],
    /// The sum of all seams.
    pub total: f64,
    /// Empty where nothing is bent.
    pub distortion: Vec<f32>,
    /// What points cost by themselves that stay as they are; empty where that is nothing.
    pub points: Vec<f32>,
    /// Of points that show something.
    pub looks: Looks,
    /// What each point may do when a patch comes that covers some of them.
    pub ties: Vec<Tie>,
}

impl<const D: usize> View<D> {
    /// What a window shows where a patch comes that covers a mask. Points of its core must take it; empty for none.
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

    /// The same from what the points show, of which none is bent.
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

    /// What a point costs by itself that stays as it is.
    #[inline(always)]
    pub(super) fn cost(&self, i: usize) -> f32 {
        self.points.get(i).copied().unwrap_or(0.0)
    }
}

/// What points show, plane by plane, so that rows of pairs are judged in wide registers.
#[derive(Debug, Default)]
pub(super) struct Looks {
    colour: [Vec<f32>; CHANNELS],
    depth: Vec<f32>,
    beside: Vec<f32>,
    class: Vec<u8>,
}

impl Looks {
    /// Makes room for so many points. What points show that are not set is left open.
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

    /// Takes over what a point shows.
    #[inline(always)]
    pub(super) fn copy(&mut self, i: usize, from: &Self) {
        for c in 0..CHANNELS {
            self.colour[c][i] = from.colour[c][i];
        }
        self.depth[i] = from.depth[i];
        self.beside[i] = from.beside[i];
        self.class[i] = from.class[i];
    }

    /// How far the colour of a point is from that of a look.
    #[inline(always)]
    pub(super) fn distance(&self, i: usize, look: &Look) -> f32 {
        let mut sum = 0.0;
        for c in 0..CHANNELS {
            sum += (self.colour[c][i] - look.colour[c]).abs();
        }
        sum
    }

    /// What `n` points in a row show.
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

/// What the points of a row show.
#[derive(Clone, Copy)]
pub(super) struct Row<'a> {
    pub colour: [&'a [f32]; CHANNELS],
    pub depth: &'a [f32],
    /// 1 in an element and beside one, else 0.
    pub beside: &'a [f32],
    pub class: &'a [u8],
}
