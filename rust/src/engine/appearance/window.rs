//! Windows of an exemplar: their offsets, and the samples whose windows are inside the exemplar.

use crate::foundation::grid::Grid;
use crate::{Error, Result};

/// Maximum number of samples along an axis. A coordinate is a 32-bit number with 12 fractional bits, so 2^18 samples
/// need 30 bits. The other bits are needed for steps out of the exemplar.
const SIDE: usize = 1 << 18;

/// Samples whose windows are inside an exemplar.
pub(crate) struct Centres<const D: usize> {
    pub(super) ranges: [[i32; 2]; D],
}

impl<const D: usize> Centres<D> {
    /// Returns the number of samples.
    pub(crate) fn len(&self) -> usize {
        self.ranges
            .iter()
            .map(|r| (r[1] - r[0] + 1) as usize)
            .product()
    }

    /// Returns the `number`-th sample in row-major order.
    pub(crate) fn get(&self, mut number: usize) -> [i32; D] {
        let mut sample = [0; D];
        for axis in (0..D).rev() {
            let [low, high] = self.ranges[axis];
            let n = (high - low + 1) as usize;
            sample[axis] = low + (number % n) as i32;
            number /= n;
        }
        sample
    }
}

/// Returns the number of values in a window.
pub(super) fn numbers<const D: usize>(radius: usize, channels: usize) -> usize {
    let side = radius.saturating_mul(2).saturating_add(1);
    side.saturating_pow(D as u32).saturating_mul(channels)
}

/// Returns an error if windows of `radius` do not fit, or if 32 bits cannot address the exemplar with its margin.
pub(super) fn check_sides<const D: usize>(grid: &Grid<D>, radius: usize) -> Result<()> {
    let (shape, least) = (grid.shape(), 2 * radius + 2);
    if shape.iter().any(|&n| n < least) {
        return Err(Error::value(
            "exemplar",
            format!(
                "must have sides of at least {least} for windows of radius {radius}, got shape {shape:?}"
            ),
        ));
    }
    // The margin counts as well, because it is stored.
    let wide = shape.map(|n| n.saturating_add(least));
    let points = wide.iter().fold(1usize, |n, &side| n.saturating_mul(side));
    if shape.iter().any(|&n| n > SIDE) || points > i32::MAX as usize {
        return Err(Error::Limit {
            what: format!("an exemplar of {shape:?}"),
            needed: format!("{points} samples with its margin"),
            limit: format!("{} samples, {SIDE} along an axis", i32::MAX),
        });
    }
    Ok(())
}

/// Returns the offsets of a window, in row-major order.
pub(super) fn window<const D: usize>(radius: usize) -> Vec<[i32; D]> {
    let side = 2 * radius + 1;
    (0..side.pow(D as u32))
        .map(|mut k| {
            let mut offset = [0; D];
            for axis in (0..D).rev() {
                offset[axis] = (k % side) as i32 - radius as i32;
                k /= side;
            }
            offset
        })
        .collect()
}
