//! Image quilting: patches are inserted one by one, each chosen for a barely visible seam and little repetition.
//!
//! The method is by Efros and Freeman, *Image quilting for texture synthesis and transfer*, SIGGRAPH 2001. For each
//! window in turn:
//!
//! 1. *pool*: find the places that fit the present content best, at half the size (`pool`);
//! 2. *charge*: add a penalty if other patches show the same place, or if the patch continues its neighbour exactly
//!    (`penalties`);
//! 3. *refine*: improve the best few to the exact pixel;
//! 4. *cut*: let the stitcher insert each of them along a minimum cut, and keep the cheapest.
//!
//! The documentation of `texrs.quilting` lists the departures from the paper. The windows of a wave do not overlap.
//! Their patches are chosen in parallel, from the texture before the wave.

mod penalties;
mod pool;
mod window;

use crate::engine::stitcher::{Pasted, Pasting, Samples};
use crate::foundation::error::check_shape;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::kernels::patch_search::{Exemplar, Index, Match};
use crate::{Error, Result};
use penalties::Penalties;
use pool::halve;
use window::Around;
pub use window::{Span, Window};

/// Marks a pixel of the texture that no patch covers yet.
const FREE: u32 = u32::MAX;
/// Number of matches of the pool that are inserted on trial.
const CANDIDATES: usize = 3;
/// Side in pixels of the cells whose use is counted. Overlaps are compared at pixels with the same spacing.
const CELL: usize = 8;

/// An image that patches are taken from, such as the exemplar or its mirror image.
#[derive(Debug, Clone)]
pub struct Picture {
    /// The colours, `rows * columns * channels`.
    pub colours: Vec<f32>,
    /// Number of rows and columns.
    pub shape: [usize; 2],
    /// The lattice that the image repeats on, if the texture keeps it. Each column is a shift (row, column). The second
    /// shift is 0 if the image repeats along the first one only.
    pub lattice: Option<[[f64; 2]; 2]>,
    /// Position in the image that corresponds to the origin of the first image, up to shifts of the lattice.
    pub phase: [f64; 2],
}

/// Properties of the pixels of all images, concatenated.
#[derive(Debug, Clone)]
pub struct Pixels {
    /// Index of the exemplar that each pixel is from.
    pub exemplar: Vec<u16>,
    /// Coordinates of each pixel in that exemplar.
    pub coordinates: Vec<[f32; 2]>,
    /// True if a pixel shows the exemplar itself, false if it shows a mirror image.
    pub hands: Vec<bool>,
    /// Number of the exemplar cell that each pixel is in.
    pub cells: Vec<u32>,
}

/// Options of a quilt.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Rows and columns of the texture.
    pub size: [usize; 2],
    /// True for each periodic axis.
    pub wrap: [bool; 2],
    /// Rows and columns of each patch.
    pub patch: [usize; 2],
    /// If true, the images repeat on a lattice.
    pub regular: bool,
    /// The axis along which patches keep their coordinates from the images. By default none.
    pub fixed: Option<usize>,
}

/// A texture that is being quilted.
pub struct Quilt<'a> {
    options: Options,
    samples: &'a Samples,
    pictures: Vec<Place>,
    pixels: Pixels,
    channels: usize,
    whole: Index,
    /// The images at half the size. `None` if an axis is fixed, because then all places are compared exactly.
    half: Option<Index>,
    /// The image pixel that each pixel of the texture shows, as a position among the pixels of all images, or
    /// [`FREE`].
    place: Vec<u32>,
    label: Vec<u32>,
    seams: Vec<[f32; 2]>,
    /// Number of patches that show each cell.
    used: Vec<u32>,
    pastes: u32,
    /// Offset from the origin of the first image to its place in the texture, from the first patch.
    step: Option<[f64; 2]>,
}

/// Properties of an image except its colours.
struct Place {
    shape: [usize; 2],
    /// Position of the image's first pixel among the pixels of all images.
    first: usize,
    lattice: Option<[[f64; 2]; 2]>,
    phase: [f64; 2],
}

impl Place {
    /// Returns the offset from the origin of the first image to its place in the texture, if a patch begins at a corner.
    fn moved(&self, corner: [usize; 2], found: &Match) -> [f64; 2] {
        let at = [found.row, found.column];
        [0, 1].map(|a| corner[a] as f64 - at[a] as f64 + self.phase[a])
    }
}

/// A patch that has been chosen for a window.
struct Chosen {
    found: Match,
    around: Around,
    pasted: Pasted,
}

impl<'a> Quilt<'a> {
    /// Creates an empty texture.
    ///
    /// # Errors
    /// Returns an error if patches do not fit into an image, or if the sizes of arrays do not match.
    pub fn new(
        pictures: Vec<Picture>,
        pixels: Pixels,
        samples: &'a Samples,
        options: Options,
    ) -> Result<Self> {
        let points = memory::product("size", &options.size)?;
        let count: usize = pictures.iter().map(|p| p.shape[0] * p.shape[1]).sum();
        let Some(first) = pictures.first().filter(|p| !p.colours.is_empty()) else {
            return Err(Error::value(
                "pictures",
                "must contain at least one image with pixels, got none",
            ));
        };
        let channels = first.colours.len() / (first.shape[0] * first.shape[1]).max(1);
        memory::room("a quilt", points, 20)?;
        memory::room("the images of a quilt", count * channels, 16)?;
        for got in [
            pixels.exemplar.len(),
            pixels.coordinates.len(),
            pixels.hands.len(),
            pixels.cells.len(),
            samples.len(),
        ] {
            check_shape("pixels", &[count], got)?;
        }
        let fits = |p: &Picture| (0..2).all(|a| (1..=p.shape[a]).contains(&options.patch[a]));
        if let Some(bad) = pictures.iter().find(|p| !fits(p)) {
            let message = format!(
                "must be from 1 to {1:?} on each side, got {0:?}",
                options.patch, bad.shape
            );
            return Err(Error::value("patch", message));
        }
        if options.fixed.is_some_and(|axis| axis > 1) {
            return Err(Error::value("fixed", "must be axis 0 or 1"));
        }
        let exemplar = |data: Vec<f32>, shape| Exemplar {
            data: data.into(),
            shape,
            allowed: None,
        };
        // Build the search index at half the size, where a search costs much less.
        let half = match options.fixed {
            Some(_) => None,
            None => {
                let smaller = pictures.iter().map(|p| {
                    let data = halve(&p.colours, p.shape, channels);
                    exemplar(data, p.shape.map(|n| n / 2))
                });
                let patch = options.patch.map(|n| n / 2);
                Some(Index::new(smaller.collect(), channels, patch)?)
            }
        };
        // Concatenate the images.
        let mut begin = 0;
        let mut places = Vec::new();
        let mut exemplars = Vec::new();
        for p in pictures {
            places.push(Place {
                shape: p.shape,
                first: begin,
                lattice: p.lattice,
                phase: p.phase,
            });
            begin += p.shape[0] * p.shape[1];
            exemplars.push(exemplar(p.colours, p.shape));
        }
        let cells = pixels.cells.iter().max().map_or(0, |&c| c as usize + 1);
        Ok(Self {
            whole: Index::new(exemplars, channels, options.patch)?,
            half,
            pictures: places,
            channels,
            used: memory::filled("the use of cells", 0, cells)?,
            pixels,
            samples,
            place: memory::filled("a quilt", FREE, points)?,
            label: memory::filled("a quilt", 0, points)?,
            seams: memory::filled("a quilt", [0.0; 2], points)?,
            pastes: 0,
            step: None,
            options,
        })
    }

    /// Copies the first patch, without a cut.
    ///
    /// # Errors
    /// Returns an error if the window does not fit, or if a patch at this place does not fit into the image.
    pub fn lay_first(&mut self, window: &Window, picture: usize, at: [usize; 2]) -> Result<()> {
        self.check(window)?;
        let patch = self.options.patch;
        let there = self.pictures.get(picture);
        if !there.is_some_and(|p| (0..2).all(|a| at[a] + patch[a] <= p.shape[a])) {
            return Err(Error::value(
                "place",
                format!("must leave room for a patch of {patch:?}, got {at:?}"),
            ));
        }
        let found = Match {
            cost: 0.0,
            exemplar: picture,
            row: at[0],
            column: at[1],
        };
        self.lay(window, &found, |_| true);
        Ok(())
    }

    /// Inserts a patch into each window of the waves.
    ///
    /// # Errors
    /// Returns an error if a window does not fit, or if the monitor was cancelled.
    pub fn paste(&mut self, waves: &[Vec<Window>], monitor: &Monitor) -> Result<()> {
        monitor.expect(waves.len() as u64);
        for wave in waves {
            wave.iter().try_for_each(|window| self.check(window))?;
            let chosen = par::map(wave.len(), |i| self.choose(&wave[i], monitor));
            for (window, chosen) in wave.iter().zip(chosen) {
                let Chosen {
                    found,
                    around,
                    pasted,
                } = chosen?;
                // Write the results in order, after all windows of the wave have chosen.
                let (bounds, size) = (&around.bounds, self.options.size);
                for (i, seam) in bounds.points(size).zip(&pasted.seams) {
                    self.seams[i] = *seam;
                }
                let width = bounds.shape()[1];
                let [top, left] = around.inner;
                let columns = self.options.patch[1];
                self.lay(window, &found, |k| {
                    pasted.take[(top + k / columns) * width + left + k % columns]
                });
            }
            monitor.advance(1)?;
        }
        Ok(())
    }

    /// Returns the image pixel that each pixel shows, as a position among the pixels of all images, and the number of
    /// its patch.
    pub fn into_map(self) -> (Vec<u32>, Vec<u32>) {
        (self.place, self.label)
    }

    /// Returns an error if a window does not fit.
    fn check(&self, window: &Window) -> Result<()> {
        if window.fits(self.options.size, self.options.patch) {
            return Ok(());
        }
        let message = format!(
            "must contain windows that fit into a texture of {:?}, got {window:?}",
            self.options.size
        );
        Err(Error::value("waves", message))
    }

    /// Returns the positions of the image pixels that a match copies, in each `step`-th row and column.
    fn places(&self, found: &Match, step: usize) -> impl Iterator<Item = u32> + use<'_> {
        let picture = &self.pictures[found.exemplar];
        let (width, [rows, columns]) = (picture.shape[1], self.options.patch);
        let corner = picture.first + found.row * width + found.column;
        (0..rows).step_by(step).flat_map(move |r| {
            let line = corner + r * width;
            (0..columns).step_by(step).map(move |c| (line + c) as u32)
        })
    }

    /// Copies the pixels of a patch for which `take` is true into the texture.
    fn lay(&mut self, window: &Window, found: &Match, take: impl Fn(usize) -> bool) {
        let corner = window.corner();
        // The first patch fixes the lattice that the others should agree with.
        let moved = self.pictures[found.exemplar].moved(corner, found);
        self.step.get_or_insert(moved);
        let places: Vec<u32> = self.places(found, 1).collect();
        let points = window.bounds().points(self.options.size);
        for (k, (i, &place)) in points.zip(&places).enumerate() {
            if take(k) {
                self.place[i] = place;
                self.label[i] = self.pastes;
            }
        }
        // Count the use of each cell once for each patch.
        let mut cells: Vec<u32> = self
            .places(found, CELL)
            .map(|place| self.pixels.cells[place as usize])
            .collect();
        cells.sort_unstable();
        cells.dedup();
        for cell in cells {
            self.used[cell as usize] += 1;
        }
        self.pastes += 1;
    }

    /// Inserts the most promising matches into the present content on trial. Returns the match with the least visible
    /// seam and the least repetition.
    fn choose(&self, window: &Window, monitor: &Monitor) -> Result<Chosen> {
        let bounds = window.bounds();
        let old: Vec<u32> = bounds
            .points(self.options.size)
            .map(|i| self.place[i])
            .collect();
        let known = window.known();
        let colours = self.colours(&old);
        let pool = self.find_pool(&colours, &known, window, monitor)?;
        // Choose the candidates by misfit and penalty, and improve them to the exact pixel.
        let mut penalties = Penalties::of(self, window, &pool, &old, &known);
        let best = penalties.promising(CANDIDATES);
        let matches: Vec<Match> = best.iter().map(|&k| pool[k]).collect();
        let exact = self.refine(&matches, &colours, &known)?;
        // Let the stitcher insert each candidate on trial, with a margin of one pixel for the gradients.
        let around = window.around(self.options.size, self.options.wrap);
        let points: Vec<usize> = around.bounds.points(self.options.size).collect();
        let shown: Vec<u32> = points.iter().map(|&i| self.place[i]).collect();
        let seams: Vec<[f32; 2]> = points.iter().map(|&i| self.seams[i]).collect();
        let (mask, core) = around.masks(window, &shown);
        let pasting = Pasting {
            shape: around.bounds.shape(),
            shown: &shown,
            seams: &seams,
            mask: &mask,
            core: &core,
        };
        let patches: Vec<Vec<u32>> = exact
            .iter()
            .map(|found| self.spread(found, &around))
            .collect();
        let patches: Vec<&[u32]> = patches.iter().map(|p| &p[..]).collect();
        penalties.finish();
        let pick = |seams: &[f64]| penalties.cheapest(&best, seams);
        let (chosen, pasted) = self.samples.cut_best(&pasting, &patches, pick, monitor)?;
        Ok(Chosen {
            found: exact[chosen],
            around,
            pasted,
        })
    }

    /// Returns the position of the image pixel that a match copies to each pixel of the bounds. Outside the window it
    /// is 0.
    fn spread(&self, found: &Match, around: &Around) -> Vec<u32> {
        let [_, width] = around.bounds.shape();
        let [top, left] = around.inner;
        let columns = self.options.patch[1];
        let mut all = vec![0; around.bounds.len()];
        for (k, place) in self.places(found, 1).enumerate() {
            all[(top + k / columns) * width + left + k % columns] = place;
        }
        all
    }

    /// Returns the colours of places. Free places get an arbitrary colour.
    fn colours(&self, places: &[u32]) -> Vec<f32> {
        let last = self.pixels.cells.len() - 1;
        let mut colours = Vec::with_capacity(places.len() * self.channels);
        for &place in places {
            colours.extend_from_slice(self.colour((place as usize).min(last)));
        }
        colours
    }

    /// Returns the colour of a pixel, by its position among the pixels of all images.
    fn colour(&self, place: usize) -> &[f32] {
        let which = self.pictures.partition_point(|p| p.first <= place) - 1;
        let at = (place - self.pictures[which].first) * self.channels;
        &self.whole.exemplars()[which].data[at..][..self.channels]
    }
}

#[cfg(test)]
mod tests;
