//! Data that depend only on the exemplars. Indices for patches of several sizes share them.

use std::sync::{Arc, OnceLock};

use super::checks::check_side;
use super::half::halve;
use super::spectra::moments;
use super::{Exemplar, Index, once};
use crate::Result;
use crate::foundation::error::check_shape;
use crate::foundation::par;

/// Data that depend only on the samples of the exemplars.
pub(super) struct Known {
    /// Mean of each channel.
    pub(super) mean: Vec<f64>,
    /// A power of two that is at least the largest distance from the mean.
    pub(super) scale: f64,
    halves: OnceLock<Halves>,
    turned: OnceLock<Vec<Turned>>,
}

/// The exemplars at half the resolution, and the data that depend on them.
pub(super) struct Halves {
    pub(super) data: Vec<Arc<Vec<f32>>>,
    pub(super) known: Arc<Known>,
}

/// The first exemplar that an exemplar mirrors (itself if there is none), and the mirrored axes.
type Turned = (usize, [bool; 2]);

impl Known {
    pub(super) fn of(data: &[&[f32]], channels: usize) -> Self {
        let (mean, scale) = moments(data, channels);
        Self {
            mean,
            scale,
            halves: OnceLock::new(),
            turned: OnceLock::new(),
        }
    }

    /// Returns the exemplars at half the resolution, which are computed at the first call.
    pub(super) fn halves(&self, exemplars: &[Exemplar], channels: usize) -> &Halves {
        once(&self.halves, || {
            let data = par::map(exemplars.len(), |i| {
                Arc::new(halve(&exemplars[i], channels))
            });
            let all: Vec<_> = data.iter().map(|d| &d[..]).collect();
            let known = Arc::new(Self::of(&all, channels));
            Halves { data, known }
        })
    }
}

impl Index {
    /// Returns an index of the same exemplars with other allowed positions, for patches up to
    /// another size. Data that depend only on the samples are shared.
    pub fn again(&self, allowed: Vec<Option<Vec<bool>>>, max_patch: [usize; 2]) -> Result<Self> {
        check_side(max_patch)?;
        check_shape("allowed", &[self.exemplars.len()], allowed.len())?;
        let mut exemplars = Vec::with_capacity(allowed.len());
        for (of, allowed) in self.exemplars.iter().zip(allowed) {
            if let Some(allowed) = &allowed {
                check_shape("allowed", &of.shape, allowed.len())?;
            }
            exemplars.push(Exemplar {
                data: of.data.clone(),
                shape: of.shape,
                allowed,
            });
        }
        Self::with(exemplars, self.channels, max_patch, self.known.clone())
    }

    /// Returns the first exemplar that each exemplar mirrors (itself if there is none), and the
    /// mirrored axes.
    pub(crate) fn turned(&self) -> &[Turned] {
        let turned: &Vec<_> = once(&self.known.turned, || {
            let all = &self.exemplars;
            let turns = [[false, true], [true, false], [true, true]];
            (0..all.len())
                .map(|k| {
                    (0..k)
                        .flat_map(|first| turns.map(|flip| (first, flip)))
                        .find(|&(first, flip)| mirrors(&all[first], &all[k], self.channels, flip))
                        .unwrap_or((k, [false; 2]))
                })
                .collect()
        });
        turned
    }
}

/// Returns whether one exemplar is the mirror image of the other along the given axes.
fn mirrors(one: &Exemplar, other: &Exemplar, channels: usize, flip: [bool; 2]) -> bool {
    one.shape == other.shape
        && match channels {
            1 => turned::<1>(one, other, channels, flip),
            3 => turned::<3>(one, other, channels, flip),
            _ => turned::<0>(one, other, channels, flip),
        }
}

/// [`mirrors`] for exemplars of the same shape. `C` is the number of channels if this is 1 or 3, so that whole pixels
/// are compared in one step. For other numbers `C` is 0.
fn turned<const C: usize>(
    one: &Exemplar,
    other: &Exemplar,
    channels: usize,
    flip: [bool; 2],
) -> bool {
    let n = if C == 0 { channels } else { C };
    let [rows, columns] = one.shape;
    let line = |r: usize| r * columns * n..(r + 1) * columns * n;
    (0..rows).all(|r| {
        let back = if flip[0] { rows - 1 - r } else { r };
        let (a, b) = (&one.data[line(r)], &other.data[line(back)]);
        if !flip[1] {
            return a == b;
        }
        let pairs = a.chunks_exact(n).zip(b.chunks_exact(n).rev());
        // Compare whole rows without an early exit, which is faster for exemplars that are mirror images.
        pairs.fold(true, |same, (a, b)| {
            (0..n).fold(same, |same, k| same & (a[k] == b[k]))
        })
    })
}
