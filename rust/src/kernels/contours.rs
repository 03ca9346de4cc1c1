//! Strength of contours: how fast the local histogram of labels changes along the steepest direction.
//!
//! Histograms are weighted by a Gaussian. Their change is measured by Fisher's information metric,
//! the sum over all labels of `dh dh' / h`. The strength is the square root of its largest
//! eigenvalue, times the standard deviation of the Gaussian.

use crate::foundation::error::check_shape;
use crate::foundation::libm::exp;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::foundation::simd::wide_fn;
use crate::{Error, Result};

/// Number of rows of a task.
const ROWS: usize = 32;
/// The number of labels is padded to a multiple of this number, so that the compiler vectorises loops over labels.
const LANES: usize = 8;
/// Maximum number of labels.
pub const MOST: usize = 64;
/// Added to each value of a histogram, so that a label that is absent has a finite weight. A label
/// must cover 2 % of a window to count.
const RARE: f32 = 0.02;

/// Returns the strength at each pixel of an image of labels, which are below `count`. `sigma` is
/// the standard deviation of the window, in pixels.
///
/// # Errors
/// The size of `labels` does not match the shape, or a label, the count or `sigma` is out of range.
pub fn strength(
    labels: &[u8],
    shape: [usize; 2],
    count: usize,
    sigma: f64,
    monitor: &Monitor,
) -> Result<Vec<f32>> {
    check_shape("labels", &shape, labels.len())?;
    if !(1..=MOST).contains(&count) {
        let message = format!("must be from 1 to {MOST}, got {count}");
        return Err(Error::value("count", message));
    }
    if !(0.3..=30.0).contains(&sigma) {
        return Err(Error::value(
            "sigma",
            format!("must be from 0.3 to 30, got {sigma}"),
        ));
    }
    if let Some(label) = labels.iter().find(|&&label| usize::from(label) >= count) {
        return Err(Error::value(
            "labels",
            format!("must be below {count}, got {label}"),
        ));
    }
    let [rows, columns] = shape;
    if rows == 0 || columns == 0 {
        return Ok(Vec::new());
    }
    monitor.check()?;
    let weights = gaussian(sigma);
    let lanes = count.next_multiple_of(LANES);
    // Each thread has the histograms of the rows of one task and of the rows around it.
    let high = ROWS.min(rows) + 2 * weights.len() + 3;
    let tasks = rows.div_ceil(ROWS).min(par::threads());
    let values = rows + tasks * high * lanes;
    memory::room("the strength of contours", columns, 4 * values)?;
    let mut out = vec![0.0f32; rows * columns];
    par::chunks_mut(&mut out, ROWS * columns, |chunk, out| {
        let first = chunk * ROWS;
        let window = Window {
            labels,
            shape,
            lanes,
            weights: &weights,
        };
        window.fill(first, out, sigma as f32);
    });
    monitor.check()?;
    Ok(out)
}

/// Returns normalised weights of a Gaussian at distance 0, 1, ... up to three standard deviations.
fn gaussian(sigma: f64) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil() as usize;
    let raw: Vec<f64> = (0..=reach)
        .map(|i| exp(-0.5 * (i as f64 / sigma) * (i as f64 / sigma)))
        .collect();
    let total = 2.0 * raw.iter().sum::<f64>() - raw[0];
    raw.iter().map(|w| (w / total) as f32).collect()
}

/// Maps an index that may be beyond the ends of an axis into the axis, by mirroring.
fn mirror(place: isize, count: usize) -> usize {
    let n = count as isize;
    let at = place.rem_euclid(2 * n);
    at.min(2 * n - 1 - at) as usize
}

struct Window<'a> {
    labels: &'a [u8],
    shape: [usize; 2],
    lanes: usize,
    weights: &'a [f32],
}

impl Window<'_> {
    /// Writes the strength of some rows, from row `first` on.
    fn fill(&self, first: usize, out: &mut [f32], sigma: f32) {
        let [_, columns] = self.shape;
        let width = columns * self.lanes;
        let (count, reach) = (out.len() / columns, self.weights.len() - 1);
        // Histograms summed along rows. The window needs `reach` more rows on each side, and the strength one more.
        let mut along = vec![0.0f32; (count + 2 * reach + 2) * width];
        for (i, row) in along.chunks_exact_mut(width).enumerate() {
            self.smooth_row(first as isize + i as isize - reach as isize - 1, row);
        }
        let row = |i: usize| &along[i * width..][..width];
        let mut histograms: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; width]);
        // The three buffers contain the histograms of the last three rows, and each new row replaces the oldest.
        for i in 0..count + 2 {
            let sums = &mut histograms[i % 3];
            scale(sums, row(i + reach), self.weights[0]);
            for (k, &weight) in self.weights.iter().enumerate().skip(1) {
                add_pair(sums, row(i + reach - k), row(i + reach + k), weight);
            }
            if i >= 2 {
                let [above, here, below] = [i - 2, i - 1, i].map(|j| &histograms[j % 3][..]);
                let out = &mut out[(i - 2) * columns..][..columns];
                roots(above, here, below, self.lanes, sigma, out);
            }
        }
    }

    /// Sums the weights of each label along a row. A row beyond the border is mirrored.
    fn smooth_row(&self, row: isize, out: &mut [f32]) {
        let [rows, columns] = self.shape;
        let labels = &self.labels[mirror(row, rows) * columns..][..columns];
        let reach = self.weights.len() as isize - 1;
        for (x, sums) in out.chunks_exact_mut(self.lanes).enumerate() {
            let x = x as isize;
            for k in -reach..=reach {
                let at = x + k;
                let at = if (0..columns as isize).contains(&at) {
                    at as usize
                } else {
                    mirror(at, columns)
                };
                sums[usize::from(labels[at])] += self.weights[k.unsigned_abs()];
            }
        }
    }
}

wide_fn! {
    fn scale(sums: &mut [f32], values: &[f32], weight: f32) {
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum = value * weight;
        }
    }
}

wide_fn! {
    fn add_pair(sums: &mut [f32], above: &[f32], below: &[f32], weight: f32) {
        for ((sum, a), b) in sums.iter_mut().zip(above).zip(below) {
            *sum += (a + b) * weight;
        }
    }
}

wide_fn! {
    /// Writes the strength along a row from the histograms of three rows.
    fn roots(above: &[f32], here: &[f32], below: &[f32], lanes: usize, sigma: f32, out: &mut [f32]) {
        let columns = out.len();
        for (x, out) in out.iter_mut().enumerate() {
            let at = x * lanes;
            let before = x.saturating_sub(1) * lanes;
            let after = (x + 1).min(columns - 1) * lanes;
            let (mut xx, mut xy, mut yy) = ([0.0f32; LANES], [0.0f32; LANES], [0.0f32; LANES]);
            for k in (0..lanes).step_by(LANES) {
                let part = |row: &[f32], at: usize| -> [f32; LANES] {
                    row[at + k..].first_chunk::<LANES>().copied().unwrap_or([0.0; LANES])
                };
                let (h, up, down) = (part(here, at), part(above, at), part(below, at));
                let (left, right) = (part(here, before), part(here, after));
                for lane in 0..LANES {
                    let dx = 0.5 * (right[lane] - left[lane]);
                    let dy = 0.5 * (down[lane] - up[lane]);
                    let weight = 1.0 / (h[lane] + RARE);
                    xx[lane] += dx * dx * weight;
                    xy[lane] += dx * dy * weight;
                    yy[lane] += dy * dy * weight;
                }
            }
            let [xx, xy, yy] = [xx, xy, yy].map(|v| v.iter().sum::<f32>());
            let half = 0.5 * (xx - yy);
            let root = 0.5 * (xx + yy) + (half * half + xy * xy).sqrt();
            *out = root.max(0.0).sqrt() * sigma;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::foundation::par::install;

    /// Returns an image of two labels, whose border is the column `at`.
    fn halves(shape: [usize; 2], at: usize) -> Vec<u8> {
        (0..shape[0] * shape[1])
            .map(|i| u8::from(i % shape[1] >= at))
            .collect()
    }

    #[test]
    fn a_border_of_two_labels_is_strongest_along_itself() {
        let shape = [20, 40];
        let found = strength(&halves(shape, 17), shape, 2, 2.0, &Monitor::default()).unwrap();
        for row in found.chunks_exact(40) {
            let peak = (0..40).max_by(|&a, &b| row[a].total_cmp(&row[b])).unwrap();
            assert!(
                (16..=17).contains(&peak) && row[peak] > 0.5,
                "{peak} {}",
                row[peak]
            );
            assert!(row[3] < 1e-3 && row[36] < 1e-3);
        }
    }

    #[test]
    fn one_label_has_no_contours() {
        let found = strength(&[3; 35], [5, 7], 4, 1.5, &Monitor::default()).unwrap();
        assert!(found.iter().all(|&v| v.abs() < 1e-5));
    }

    #[test]
    fn threads_do_not_change_the_result() {
        let shape = [70, 33];
        let labels: Vec<u8> = (0..70 * 33).map(|i| ((i * 7919) % 13 % 5) as u8).collect();
        let with = |n| {
            install(n, || strength(&labels, shape, 5, 1.5, &Monitor::default()))
                .unwrap()
                .unwrap()
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn arguments_out_of_range_are_errors() {
        let monitor = Monitor::default();
        assert!(strength(&[0; 5], [2, 3], 1, 1.0, &monitor).is_err());
        assert!(strength(&[4; 6], [2, 3], 4, 1.0, &monitor).is_err());
        assert!(strength(&[0; 6], [2, 3], 0, 1.0, &monitor).is_err());
        assert!(strength(&[0; 6], [2, 3], 1, f64::NAN, &monitor).is_err());
        assert_eq!(strength(&[], [0, 3], 1, 1.0, &monitor), Ok(Vec::new()));
        assert_eq!(strength(&[0], [1, 1], 1, 1.0, &monitor).unwrap().len(), 1);
    }
}
