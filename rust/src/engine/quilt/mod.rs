//! A quilt in the making: patches cut in one by one, each the one that shows and repeats the least.
//!
//! Efros and Freeman, *Image quilting for texture synthesis and transfer*, SIGGRAPH 2001. For each window in turn:
//!
//! 1. *pool*: the places that fit what is there already best, looked for at half the size (`pool`);
//! 2. *charge*: each for what others show already, and for going on with what lies beside it (`penalties`);
//! 3. *refine*: the best few, to the pixel;
//! 4. *cut*: all of these are cut in by the stitcher, and the cheapest stays.
//!
//! Departures are told where the verb is, `texrs.quilting`. Windows of a wave lie apart and are chosen side by side, each as if it
//! were the first of them.

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

/// A pixel that shows nothing yet.
const FREE: u32 = u32::MAX;
/// Matches of the pool that are cut in.
const CANDIDATES: usize = 3;
/// Use is counted in cells of so many pixels a side, and overlaps are compared on as many rows and columns.
const CELL: usize = 8;

/// A picture that patches are taken from.
#[derive(Debug, Clone)]
pub struct Picture {
    /// `rows * columns * channels` colours.
    pub colours: Vec<f32>,
    /// Rows and columns.
    pub shape: [usize; 2],
    /// The lattice that it repeats on, a shift (row, column) in each column, where the texture has it too.
    pub lattice: Option<[[f64; 2]; 2]>,
}

/// What is known of the pixels of all pictures, which stand in one row.
#[derive(Debug, Clone)]
pub struct Pixels {
    /// From which exemplar each comes.
    pub exemplar: Vec<u16>,
    /// From where.
    pub coordinates: Vec<[f32; 2]>,
    /// Whether it shows the exemplar, and not its mirror image.
    pub hands: Vec<bool>,
    /// Number of the cell of the exemplars that it shows.
    pub cells: Vec<u32>,
}

/// What a quilt is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Rows and columns of the texture.
    pub size: [usize; 2],
    /// Along which axes it is cyclic.
    pub wrap: [bool; 2],
    /// Rows and columns of all patches.
    pub patch: [usize; 2],
    /// Whether the pictures repeat on a lattice.
    pub regular: bool,
    /// The axis along which patches keep the places that they have in the pictures.
    pub fixed: Option<usize>,
}

/// The texture in the making.
pub struct Quilt<'a> {
    options: Options,
    samples: &'a Samples,
    pictures: Vec<Place>,
    pixels: Pixels,
    channels: usize,
    whole: Index,
    /// At half the size; where an axis is fixed all places are compared exactly.
    half: Option<Index>,
    /// The place in the row that each pixel shows, or [`FREE`].
    place: Vec<u32>,
    label: Vec<u32>,
    seams: Vec<[f32; 2]>,
    /// Patches that show each cell.
    used: Vec<u32>,
    pastes: u32,
}

/// What is known of a picture beside its colours.
struct Place {
    shape: [usize; 2],
    /// Where it begins in the row.
    first: usize,
    lattice: Option<[[f64; 2]; 2]>,
    /// From where in it to where in the texture its first patch has gone.
    step: Option<[f64; 2]>,
}

/// A patch that has been chosen for a window.
struct Chosen {
    found: Match,
    around: Around,
    pasted: Pasted,
}

impl<'a> Quilt<'a> {
    /// An empty texture.
    ///
    /// # Errors
    /// Pictures that patches do not fit into, or arrays of other sizes than theirs.
    pub fn new(
        pictures: Vec<Picture>,
        pixels: Pixels,
        samples: &'a Samples,
        options: Options,
    ) -> Result<Self> {
        let points = memory::product("size", &options.size)?;
        let count: usize = pictures.iter().map(|p| p.shape[0] * p.shape[1]).sum();
        let Some(first) = pictures.first().filter(|p| !p.colours.is_empty()) else {
            return Err(Error::value("pictures", "needs one at least"));
        };
        let channels = first.colours.len() / (first.shape[0] * first.shape[1]).max(1);
        memory::room("a quilt", points, 20)?;
        memory::room("the pictures of a quilt", count * channels, 16)?;
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
            let message = format!("{:?} does not fit into {:?}", options.patch, bad.shape);
            return Err(Error::value("patch", message));
        }
        if options.fixed.is_some_and(|axis| axis > 1) {
            return Err(Error::value("fixed", "an axis, 0 or 1, is allowed"));
        }
        let exemplar = |data: Vec<f32>, shape| Exemplar {
            data: data.into(),
            shape,
            allowed: None,
        };
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
        let mut begin = 0;
        let mut places = Vec::new();
        let mut exemplars = Vec::new();
        for p in pictures {
            places.push(Place {
                shape: p.shape,
                first: begin,
                lattice: p.lattice,
                step: None,
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
            options,
        })
    }

    /// Lays a patch, whole: the first one.
    ///
    /// # Errors
    /// A window that does not fit, or a place at which there is no such patch.
    pub fn lay_first(&mut self, window: &Window, picture: usize, at: [usize; 2]) -> Result<()> {
        self.check(window)?;
        let patch = self.options.patch;
        let there = self.pictures.get(picture);
        if !there.is_some_and(|p| (0..2).all(|a| at[a] + patch[a] <= p.shape[a])) {
            return Err(Error::value("place", format!("no patch lies at {at:?}")));
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

    /// Cuts a patch into each window of some waves.
    ///
    /// # Errors
    /// A window that does not fit, or a monitor that was cancelled.
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

    /// The place in the row that each pixel shows, and the number of the patch.
    pub fn into_map(self) -> (Vec<u32>, Vec<u32>) {
        (self.place, self.label)
    }

    fn check(&self, window: &Window) -> Result<()> {
        if window.fits(self.options.size, self.options.patch) {
            return Ok(());
        }
        let message = format!("{window:?} is none of a texture of {:?}", self.options.size);
        Err(Error::value("waves", message))
    }

    /// The places in the row that a match copies: of each `step`-th row and column.
    fn places(&self, found: &Match, step: usize) -> impl Iterator<Item = u32> + use<'_> {
        let picture = &self.pictures[found.exemplar];
        let (width, [rows, columns]) = (picture.shape[1], self.options.patch);
        let corner = picture.first + found.row * width + found.column;
        (0..rows).step_by(step).flat_map(move |r| {
            let line = corner + r * width;
            (0..columns).step_by(step).map(move |c| (line + c) as u32)
        })
    }

    /// Lays a patch, or what of it is taken.
    fn lay(&mut self, window: &Window, found: &Match, take: impl Fn(usize) -> bool) {
        let corner = window.corner();
        let step = [found.row, found.column];
        let step = [0, 1].map(|a| corner[a] as f64 - step[a] as f64);
        self.pictures[found.exemplar].step.get_or_insert(step);
        let places: Vec<u32> = self.places(found, 1).collect();
        let points = window.bounds().points(self.options.size);
        for (k, (i, &place)) in points.zip(&places).enumerate() {
            if take(k) {
                self.place[i] = place;
                self.label[i] = self.pastes;
            }
        }
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

    /// Cuts the most promising matches into what is there, and returns the one that shows and repeats the least.
    fn choose(&self, window: &Window, monitor: &Monitor) -> Result<Chosen> {
        let bounds = window.bounds();
        let old: Vec<u32> = bounds
            .points(self.options.size)
            .map(|i| self.place[i])
            .collect();
        let known = window.known();
        let colours = self.colours(&old);
        let pool = self.find_pool(&colours, &known, window, monitor)?;
        let mut penalties = Penalties::of(self, window, &pool, &old, &known);
        let best = penalties.promising(CANDIDATES);
        let matches: Vec<Match> = best.iter().map(|&k| pool[k]).collect();
        let exact = self.refine(&matches, &colours, &known)?;
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

    /// What each pixel of a window and beside it would show of a match; beside the match the first sample of all.
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

    /// The colours of places; of those that are free any.
    fn colours(&self, places: &[u32]) -> Vec<f32> {
        let last = self.pixels.cells.len() - 1;
        let mut colours = Vec::with_capacity(places.len() * self.channels);
        for &place in places {
            colours.extend_from_slice(self.colour((place as usize).min(last)));
        }
        colours
    }

    fn colour(&self, place: usize) -> &[f32] {
        let which = self.pictures.partition_point(|p| p.first <= place) - 1;
        let at = (place - self.pictures[which].first) * self.channels;
        &self.whole.exemplars()[which].data[at..][..self.channels]
    }
}

#[cfg(test)]
mod tests;
