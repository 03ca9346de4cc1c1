//! The insertion of unwarped patches, which another search has found, into a window.
//!
//! A place is the number of a sample in one row of samples, which may come from several images. The neighbours of a
//! sample in the row are not used.

use super::canvas::{FREE, Window};
use super::cut::{Cutter, Cutting, Proposal};
use super::source::Source;
use super::view::View;
use super::weights::Weights;
use crate::foundation::error::check_shape;
use crate::foundation::fixed::{ONE, Place};
use crate::foundation::grid::Grid;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// Number of samples in a line of the grid. Samples are arranged in lines because one coordinate has too few bits for
/// their numbers.
const LINE: usize = 1 << 14;
/// Pairs of a number of points and a side of blocks. Windows with more points are cut between blocks of this side, to
/// compare patches (`JUDGED`) or to insert a patch (`CUT`).
const JUDGED: (usize, usize) = (1 << 12, 4);
const CUT: (usize, usize) = (1 << 15, 2);
/// Points up to this distance from a cut between blocks are cut again one by one.
const REACH: usize = 8;

/// A window of an output, and the points that a patch may take. All arrays have one entry per point.
#[derive(Debug, Clone, Copy)]
pub struct Pasting<'a> {
    /// Rows and columns.
    pub shape: [usize; 2],
    /// The sample that each point shows; `u32::MAX` for an empty point.
    pub shown: &'a [u32],
    /// Cost of the seam from each point to the next one along each axis.
    pub seams: &'a [[f32; 2]],
    /// Points that a patch covers.
    pub mask: &'a [bool],
    /// Points that must take the patch.
    pub core: &'a [bool],
}

/// The result of the insertion of a patch into a window.
#[derive(Debug, Clone)]
pub struct Pasted {
    /// Whether each point takes the patch.
    pub take: Vec<bool>,
    /// Costs of the window's seams after the cut.
    pub seams: Vec<[f32; 2]>,
}

/// A row of samples that patches consist of.
#[derive(Debug, Clone)]
pub struct Samples {
    source: Source<2>,
    count: usize,
    weights: Weights,
}

impl Samples {
    /// Prepares samples from their colours, their depth inside an element, and the weights of seams.
    ///
    /// # Errors
    /// Returns an error if sizes of arrays do not match, values are not finite or out of their range, or there are too
    /// many samples.
    pub fn new(colours: &[f32], channels: usize, depth: &[f32], weights: Weights) -> Result<Self> {
        weights.check()?;
        let count = depth.len();
        if count >= FREE as usize {
            return Err(Error::value(
                "depth",
                format!("must have fewer than {FREE} samples, got {count}"),
            ));
        }
        let grid = Grid::new([count.div_ceil(LINE), LINE.min(count)], [false; 2])?;
        let source = Source::row(colours, grid, channels, depth)?;
        Ok(Self {
            source,
            count,
            weights,
        })
    }

    /// Returns the cost of the window's seams after only one patch is inserted, separately for each of the patches. A
    /// patch contains the sample that each point would show. Large patches are cut between blocks of points, which is
    /// precise enough to compare them.
    ///
    /// # Errors
    /// Returns an error if sizes of arrays do not match the window, samples do not exist, or the monitor was
    /// cancelled.
    pub fn judge(
        &self,
        pasting: &Pasting<'_>,
        patches: &[&[u32]],
        monitor: &Monitor,
    ) -> Result<Vec<f64>> {
        let (window, view) = self.open(pasting)?;
        let cutter = self.cutter();
        let block = side(&window, JUDGED);
        let values = par::map(patches.len(), |k| {
            let patch = self.propose(pasting, &window, patches[k])?;
            Ok(cutter.cut_between(&view, &patch, block, monitor)?.value)
        });
        values.into_iter().collect()
    }

    /// Returns the number of samples.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Returns whether the number of samples is 0.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Inserts the patch that `choose` selects from the costs of [`Self::judge`]. Returns its number and the result.
    ///
    /// # Errors
    /// Returns the same errors as [`Self::judge`].
    pub fn cut_best(
        &self,
        pasting: &Pasting<'_>,
        patches: &[&[u32]],
        choose: impl FnOnce(&[f64]) -> usize,
        monitor: &Monitor,
    ) -> Result<(usize, Pasted)> {
        let (window, view) = self.open(pasting)?;
        let cutter = self.cutter();
        let [judged, last] = [JUDGED, CUT].map(|sizes| side(&window, sizes));
        let tried = par::map(patches.len(), |k| {
            let patch = self.propose(pasting, &window, patches[k])?;
            cutter.cut_between(&view, &patch, judged, monitor)
        });
        let mut tried = tried.into_iter().collect::<Result<Vec<_>>>()?;
        let values: Vec<f64> = tried.iter().map(|cut| cut.value).collect();
        let chosen = choose(&values);
        let patch = self.propose(pasting, &window, patches[chosen])?;
        // If all cuts are between points, the cut is already computed.
        let coarse = if judged == last {
            tried.swap_remove(chosen)
        } else {
            cutter.cut_between(&view, &patch, last, monitor)?
        };
        let cut = cutter.refine_within(&view, &patch, coarse, REACH, monitor)?;
        Ok((chosen, paste(pasting, cut)))
    }

    /// Inserts a patch into a window along the minimum cut between its points. If the window is very large, the cut is
    /// first computed between blocks.
    ///
    /// # Errors
    /// Returns the same errors as [`Self::judge`].
    pub fn cut(&self, pasting: &Pasting<'_>, patch: &[u32], monitor: &Monitor) -> Result<Pasted> {
        let (window, view) = self.open(pasting)?;
        let patch = self.propose(pasting, &window, patch)?;
        let cutter = self.cutter();
        let coarse = cutter.cut_between(&view, &patch, side(&window, CUT), monitor)?;
        let cut = cutter.refine_within(&view, &patch, coarse, REACH, monitor)?;
        Ok(paste(pasting, cut))
    }

    fn cutter(&self) -> Cutter<'_, 2> {
        // The list of block sides is empty, because each call of `cut_between` specifies the side.
        Cutter::new(&self.source, self.weights, None, &[])
    }

    /// Returns a window and its content.
    fn open(&self, pasting: &Pasting<'_>) -> Result<(Window<2>, View<2>)> {
        let window = Window::alone(pasting.shape)?;
        let n = window.points.len();
        for (argument, got) in [
            ("shown", pasting.shown.len()),
            ("seams", pasting.seams.len()),
            ("mask", pasting.mask.len()),
            ("core", pasting.core.len()),
        ] {
            check_shape(argument, &pasting.shape, got)?;
        }
        let costs = pasting.seams.as_flattened();
        if !costs.iter().all(|s| (0.0..=f32::MAX).contains(s)) {
            return Err(Error::value("seams", "must be finite and at least 0"));
        }
        // Cuts only distinguish free points from others here, so all samples belong to patch 0.
        let mut patches = vec![FREE; n];
        for (patch, &sample) in patches.iter_mut().zip(pasting.shown) {
            if sample != FREE {
                self.find("shown", sample)?;
                *patch = 0;
            }
        }
        let view = View::bare(
            pasting.shown.iter().map(|&k| place(k)).collect(),
            patches,
            [0, 1].map(|axis| pasting.seams.iter().map(|s| s[axis]).collect()),
            pasting.mask,
            pasting.core,
            &self.source,
        );
        Ok((window, view))
    }

    /// Returns a patch for a window.
    fn propose<'a>(
        &self,
        pasting: &Pasting<'a>,
        window: &'a Window<2>,
        samples: &[u32],
    ) -> Result<Proposal<'a, 2>> {
        check_shape("patches", &pasting.shape, samples.len())?;
        for (&sample, _) in samples.iter().zip(pasting.mask).filter(|(_, mask)| **mask) {
            self.find("patches", sample)?;
        }
        Ok(Proposal {
            window,
            mask: pasting.mask,
            places: samples.iter().map(|&k| place(k)).collect(),
            points: Vec::new(),
        })
    }

    fn find(&self, argument: &'static str, sample: u32) -> Result<()> {
        if (sample as usize) < self.count {
            return Ok(());
        }
        Err(Error::value(
            argument,
            format!(
                "must be below the number of samples ({}), got {sample}",
                self.count
            ),
        ))
    }
}

/// Returns the window after a cut.
fn paste(pasting: &Pasting<'_>, cut: Cutting<2>) -> Pasted {
    let mut seams = pasting.seams.to_vec();
    for (i, axis, cost) in cut.seams {
        seams[i as usize][usize::from(axis)] = cost;
    }
    Pasted {
        take: cut.take,
        seams,
    }
}

/// Returns the side of the blocks between which a window is cut.
fn side(window: &Window<2>, (most, block): (usize, usize)) -> usize {
    if window.points.len() > most { block } else { 1 }
}

/// Returns the exemplar coordinates of a sample in the row.
fn place(sample: u32) -> Place<2> {
    let at = sample as usize;
    [(at / LINE) as i32 * ONE, (at % LINE) as i32 * ONE]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::foundation::hash::Noise;
    use crate::kernels::seam::links;

    const SHAPE: [usize; 2] = [3, 3];
    const WEIGHTS: Weights = Weights {
        colour: 1.0,
        depth: 0.5,
        ..Weights::NONE
    };

    /// Returns samples for two windows. The mean of their standard deviations is 1 after preparation.
    fn samples(seed: u64, weights: Weights) -> Samples {
        let noise = Noise::new(seed);
        let colours: Vec<f32> = (0..18)
            .map(|i| noise.uniform([i, 0, 0, 0]) as f32)
            .collect();
        let depth: Vec<f32> = (0..18)
            .map(|i| (noise.uniform([i, 1, 0, 0]) * 8.0 - 2.0).max(0.0) as f32)
            .collect();
        Samples::new(&colours, 1, &depth, weights).unwrap()
    }

    fn pasting<'a>(
        shown: &'a [u32],
        seams: &'a [[f32; 2]],
        mask: &'a [bool],
        core: &'a [bool],
    ) -> Pasting<'a> {
        Pasting {
            shape: SHAPE,
            shown,
            seams,
            mask,
            core,
        }
    }

    proptest! {
        /// The cut has the lowest cost of the resulting pairs, and covered seams disappear.
        #[test]
        fn the_cut_is_the_least_of_all(seed in 0u64..500) {
            let samples = samples(seed, WEIGHTS);
            let noise = Noise::new(seed + 1000);
            let shown: Vec<u32> = (0..9).collect();
            let patch: Vec<u32> = (9..18).collect();
            let seams: Vec<[f32; 2]> = (0..9)
                .map(|i| [0, 1].map(|a| if seed % 2 == 0 { 0.0 } else { noise.uniform([i, a, 2, 0]) as f32 * 0.004 }))
                .collect();
            let mask: Vec<bool> = (0..9).map(|i| noise.uniform([i, 0, 1, 0]) < 0.8).collect();
            let core: Vec<bool> = (0..9).map(|i| i == 4 && mask[4]).collect();
            let look = |sample: u32| samples.source.look(place(sample));
            let pair = |l: u32, r: u32, p: usize, q: usize| {
                // Points that the patch does not cover are not compared.
                let apart = |i: usize| {
                    if mask[i] { look(shown[i]).colour[0] - look(patch[i]).colour[0] } else { 0.0 }
                };
                let depth = look(l).depth.min(6.0) + look(r).depth.min(6.0);
                2e-3 + (apart(p).powi(2) + apart(q).powi(2)) / 8.0 + 0.5 * depth / 6.0
            };
            let grid = Grid::new(SHAPE, [false; 2]).unwrap();
            let value = |take: &[bool]| {
                let mut sum = 0.0;
                for axis in 0..2 {
                    links(&grid, axis, |p, q| {
                        sum += match (take[p], take[q]) {
                            (false, true) => pair(shown[p], patch[q], p, q),
                            (true, false) => pair(patch[p], shown[q], p, q),
                            (false, false) => seams[p][axis],
                            (true, true) => 0.0,
                        };
                    });
                }
                sum
            };
            let best = (0..512u32)
                .map(|code| (0..9).map(|i| code >> i & 1 == 1).collect::<Vec<bool>>())
                .filter(|take| (0..9).all(|i| (!take[i] || mask[i]) && (take[i] || !core[i])))
                .map(|take| value(&take))
                .fold(f32::INFINITY, f32::min);
            let window = pasting(&shown, &seams, &mask, &core);
            let found = samples.cut(&window, &patch, &Monitor::default()).unwrap();
            prop_assert!((value(&found.take) - best).abs() < 1e-3, "{} {best}", value(&found.take));
            let left: f32 = found.seams.as_flattened().iter().sum();
            let ends: f32 = [2, 5, 8].map(|i| seams[i][1]).iter().sum::<f32>() + [6, 7, 8].map(|i| seams[i][0]).iter().sum::<f32>();
            prop_assert!((left - ends - best).abs() < 1e-3);
            let judged = samples.judge(&window, &[&patch], &Monitor::default()).unwrap();
            prop_assert!(judged[0] >= f64::from(best) - 1e-3);
        }
    }

    #[test]
    fn what_shows_nothing_takes_the_patch() {
        let samples = samples(1, WEIGHTS);
        let (shown, patch) = ([FREE, FREE, 2, FREE, FREE, 5, 6, 7, 8], [9; 9]);
        let mask = [true, true, true, true, true, true, false, false, false];
        let found = samples.cut(
            &pasting(&shown, &[[0.0; 2]; 9], &mask, &[false; 9]),
            &patch,
            &Monitor::default(),
        );
        let take = found.unwrap().take;
        assert_eq!([take[0], take[1], take[3], take[4]], [true; 4]);
        assert_eq!(take[6..], [false; 3]);
    }

    #[test]
    fn bad_arrays_are_refused() {
        let samples = samples(1, WEIGHTS);
        let (shown, seams, none) = ([0; 9], [[0.0; 2]; 9], [true; 9]);
        let cut = |pasting: Pasting<'_>, patch: &[u32]| {
            samples.cut(&pasting, patch, &Monitor::default()).is_err()
        };
        let fine = pasting(&shown, &seams, &none, &none);
        assert!(!cut(fine, &[1; 9]));
        assert!(cut(fine, &[1; 8]));
        assert!(cut(fine, &[18; 9]));
        assert!(cut(pasting(&[18; 9], &seams, &none, &none), &[1; 9]));
        assert!(cut(pasting(&shown[..8], &seams, &none, &none), &[1; 9]));
        assert!(cut(pasting(&shown, &[[-1.0; 2]; 9], &none, &none), &[1; 9]));
        assert!(cut(
            pasting(&shown, &[[f32::NAN; 2]; 9], &none, &none),
            &[1; 9]
        ));
        assert!(cut(
            Pasting {
                shape: [0, 9],
                ..fine
            },
            &[1; 9]
        ));
        assert!(Samples::new(&[0.0; 9], 1, &[0.0; 8], WEIGHTS).is_err());
        assert!(Samples::new(&[f32::NAN; 8], 1, &[0.0; 8], WEIGHTS).is_err());
        assert!(Samples::new(&[], 1, &[], WEIGHTS).is_err());
        let wrong = Weights {
            depth: -1.0,
            ..WEIGHTS
        };
        assert!(Samples::new(&[0.0; 8], 1, &[0.0; 8], wrong).is_err());
    }
}
