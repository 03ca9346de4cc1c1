//! Sums over the regions of each set and along its border, and the shape of its convex hull.

use super::{Sets, check_finite, check_pairs};
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::kernels::watershed::{DIRECTIONS, directions};
use crate::{Error, Result};

/// Number of sets of a task.
const CHUNK: usize = 256;

/// Regions with values, and borders with values.
#[derive(Debug, Clone, Copy)]
pub struct Values<'a, const A: usize> {
    /// Pairs of regions that touch, each once.
    pub pairs: &'a [[u32; 2]],
    /// Values of the border of each pair. The first one is its length.
    pub arcs: &'a [[f64; A]],
    /// Histogram of each region: `bins` values, whose sum is the region's area.
    pub histograms: &'a [f32],
    /// Number of bins.
    pub bins: usize,
    /// Extreme pixels of each region, see [`crate::kernels::watershed::Regions`].
    pub extremes: &'a [[[f32; 2]; DIRECTIONS]],
}

/// Measurements of a set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measures<const A: usize> {
    /// Sums of the values of the set's border.
    pub outer: [f64; A],
    /// Sums of the values of borders between regions of the set.
    pub inner: [f64; A],
    /// Area of the convex hull of the set, in pixels. The hull encloses whole pixels, not only their centres.
    pub hull: f64,
    /// Area of the smallest rectangle around the set, among rectangles in 16 orientations.
    pub rectangle: f64,
    /// Sum of the height and the width of the set, in pixels.
    pub extent: f64,
    /// Distance between the histograms of the set and of the neighbours, 0 to 1, averaged along the border.
    pub contrast: f64,
    /// Share of the border where this distance is below `ALIKE`.
    pub alike: f64,
}

/// Distance of histograms below which two regions look the same.
const ALIKE: f64 = 0.35;

/// Measures each set.
///
/// # Errors
/// The sizes of the arrays do not match, or a set has a member without values. A value is not finite, or a histogram has
/// a negative value.
pub fn measure<const A: usize>(
    sets: &Sets,
    values: &Values<'_, A>,
    monitor: &Monitor,
) -> Result<Vec<Measures<A>>> {
    let n = values.extremes.len();
    check_pairs(values.pairs, n)?;
    if values.arcs.len() != values.pairs.len() {
        let message = format!(
            "must have {} rows, got {}",
            values.pairs.len(),
            values.arcs.len()
        );
        return Err(Error::value("arcs", message));
    }
    if Some(values.histograms.len()) != n.checked_mul(values.bins) {
        return Err(Error::value(
            "histograms",
            format!("must have {n} rows of {} values", values.bins),
        ));
    }
    check_finite("arcs", values.arcs.as_flattened())?;
    let sound = |&v: &f32| v.is_finite() && v >= 0.0;
    if !values.histograms.iter().all(sound) {
        let message = "must be finite and at least 0";
        return Err(Error::value("histograms", message));
    }
    let points = values.extremes.as_flattened().as_flattened();
    if points.iter().any(|v| !v.is_finite()) {
        return Err(Error::value("extremes", "must be finite"));
    }
    if sets.bound() > n {
        return Err(Error::value(
            "members",
            format!("must be below {n}, got {}", sets.bound() - 1),
        ));
    }
    monitor.check()?;
    let work = n.saturating_mul(64 + 4 * par::threads());
    let bytes = work + 40 * values.pairs.len() + 2 * sets.len() * size_of::<Measures<A>>();
    memory::room("the measures of sets", bytes, 1)?;
    // The borders of each region: the region on the other side, and the index of the pair.
    let mut near: Vec<Vec<[u32; 2]>> = vec![Vec::new(); n];
    for (k, &[p, q]) in values.pairs.iter().enumerate() {
        near[p as usize].push([q, k as u32]);
        near[q as usize].push([p, k as u32]);
    }
    let directions = directions();
    let tasks = par::map(sets.len().div_ceil(CHUNK), |task| {
        let mut work = Work {
            inside: vec![0; n],
            search: 0,
            own: vec![0.0; values.bins],
        };
        let range = task * CHUNK..((task + 1) * CHUNK).min(sets.len());
        range
            .map(|i| work.measure(sets.get(i), values, &near, &directions))
            .collect::<Vec<_>>()
    });
    monitor.check()?;
    Ok(tasks.concat())
}

/// Returns the sums of values over the members of each set. Each region has `columns` values.
///
/// # Errors
/// A set has a member without values.
pub fn sums(sets: &Sets, values: &[f64], columns: usize, monitor: &Monitor) -> Result<Vec<f64>> {
    if columns == 0
        || !values.len().is_multiple_of(columns)
        || sets.bound() > values.len() / columns
    {
        let message = format!(
            "must have at least {} rows of at least 1 value, got {columns} columns",
            sets.bound()
        );
        return Err(Error::value("values", message));
    }
    monitor.check()?;
    let total = memory::product("values", &[sets.len(), columns])?;
    let mut out = memory::filled("the sums of sets", 0.0, total)?;
    par::chunks_mut(&mut out, CHUNK * columns, |chunk, out| {
        for (k, sums) in out.chunks_exact_mut(columns).enumerate() {
            for &i in sets.get(chunk * CHUNK + k) {
                let row = &values[i as usize * columns..][..columns];
                sums.iter_mut()
                    .zip(row)
                    .for_each(|(sum, value)| *sum += value);
            }
        }
    });
    Ok(out)
}

struct Work {
    inside: Vec<u32>,
    search: u32,
    own: Vec<f32>,
}

impl Work {
    fn measure<const A: usize>(
        &mut self,
        set: &[u32],
        values: &Values<'_, A>,
        near: &[Vec<[u32; 2]>],
        directions: &[[f64; 2]; DIRECTIONS],
    ) -> Measures<A> {
        self.search += 1;
        let bins = values.bins;
        self.own.fill(0.0);
        for &i in set {
            self.inside[i as usize] = self.search;
            for (sum, value) in self
                .own
                .iter_mut()
                .zip(&values.histograms[i as usize * bins..])
            {
                *sum += value;
            }
        }
        let total = self.own.iter().sum::<f32>().max(1e-6);
        self.own.iter_mut().for_each(|v| *v /= total);
        let (mut outer, mut inner) = ([0.0; A], [0.0; A]);
        let (mut contrast, mut alike) = (0.0, 0.0);
        for &i in set {
            for &[q, k] in &near[i as usize] {
                let arc = &values.arcs[k as usize];
                if self.inside[q as usize] == self.search {
                    // Each inner border is visited twice, once from each side.
                    (0..A).for_each(|a| inner[a] += 0.5 * arc[a]);
                    continue;
                }
                (0..A).for_each(|a| outer[a] += arc[a]);
                let away = distance(&self.own, &values.histograms[q as usize * bins..][..bins]);
                contrast += arc[0] * away;
                alike += if away < ALIKE { arc[0] } else { 0.0 };
            }
        }
        let length = outer[0].max(1.0);
        let shape = Shape::new(set, values.extremes, directions);
        Measures {
            outer,
            inner,
            hull: shape.hull,
            rectangle: shape.rectangle,
            extent: shape.extent,
            contrast: contrast / length,
            alike: alike / length,
        }
    }
}

/// Returns half the chi-square distance of two histograms, 0 to 1. The first one sums to 1.
fn distance(own: &[f32], other: &[f32]) -> f64 {
    let scale = 1.0 / other.iter().sum::<f32>().max(1e-6);
    let mut sum = 0.0f32;
    for (a, b) in own.iter().zip(other) {
        let b = b * scale;
        sum += (a - b) * (a - b) / (a + b + 1e-6);
    }
    0.5 * f64::from(sum)
}

struct Shape {
    hull: f64,
    rectangle: f64,
    extent: f64,
}

impl Shape {
    fn new(
        set: &[u32],
        extremes: &[[[f32; 2]; DIRECTIONS]],
        directions: &[[f64; 2]; DIRECTIONS],
    ) -> Self {
        let mut corners = [[0.0f64; 2]; DIRECTIONS];
        let mut far = [f64::NEG_INFINITY; DIRECTIONS];
        for &i in set {
            for (k, point) in extremes[i as usize].iter().enumerate() {
                let point = point.map(f64::from);
                let along = point[0] * directions[k][0] + point[1] * directions[k][1];
                if along > far[k] {
                    far[k] = along;
                    corners[k] = point;
                }
            }
        }
        if set.is_empty() {
            return Self {
                hull: 0.0,
                rectangle: 0.0,
                extent: 0.0,
            };
        }
        let (mut double, mut around) = (0.0, 0.0);
        for k in 0..DIRECTIONS {
            let (a, b) = (corners[k], corners[(k + 1) % DIRECTIONS]);
            double += a[1] * b[0] - a[0] * b[1];
            around += ((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])).sqrt();
        }
        let half = DIRECTIONS / 2;
        // The corners are centres of pixels, so a width lacks half a pixel on both sides.
        let width = |k: usize| far[k % DIRECTIONS] + far[(k + half) % DIRECTIONS] + 1.0;
        let rectangle = (0..half / 2)
            .map(|k| width(k) * width(k + half / 2))
            .fold(f64::INFINITY, f64::min);
        Self {
            hull: 0.5 * double.abs() + 0.5 * around + 1.0,
            rectangle,
            extent: width(0) + width(half / 2),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::watershed::adjacency;

    #[test]
    fn a_rectangle_of_two_regions_is_measured() {
        // Two regions of 4 x 3 pixels inside a third one.
        let shape = [10, 12];
        let label: Vec<u32> = (0..120)
            .map(|p| match (p / 12, p % 12) {
                (3..7, 2..5) => 0,
                (3..7, 5..8) => 1,
                _ => 2,
            })
            .collect();
        let monitor = Monitor::default();
        let found = adjacency(&label, &[1.0; 120], shape, 3, 0.5, &monitor).unwrap();
        let histograms = [12.0, 0.0, 12.0, 0.0, 0.0, 96.0];
        let values = Values {
            pairs: &found.pairs,
            arcs: &found.arcs,
            histograms: &histograms,
            bins: 2,
            extremes: &found.extremes,
        };
        let sets = Sets::new(vec![0, 2, 3], vec![0, 1, 0]).unwrap();
        let both = measure(&sets, &values, &monitor).unwrap();
        assert_eq!((both[0].outer[0], both[0].inner[0]), (20.0, 4.0));
        assert_eq!(
            (both[0].hull, both[0].rectangle, both[0].extent),
            (24.0, 24.0, 10.0)
        );
        assert!(both[0].contrast > 0.99 && both[0].alike == 0.0);
        assert!((both[1].alike - 4.0 / 14.0).abs() < 1e-9);
        let wrong = Sets::new(vec![0, 1], vec![3]).unwrap();
        assert!(measure(&wrong, &values, &monitor).is_err());
        assert!(Sets::new(vec![0, 3], vec![0]).is_err());
        let holes = Values {
            histograms: &[f32::NAN; 6],
            ..values
        };
        assert!(measure(&sets, &holes, &monitor).is_err());
    }

    #[test]
    fn sums_that_do_not_fit_are_errors() {
        let monitor = Monitor::default();
        let empty = Sets::new(vec![0, 0, 0], vec![]).unwrap();
        for columns in [0, 1 << 50, usize::MAX / 2, usize::MAX] {
            assert!(sums(&empty, &[], columns, &monitor).is_err());
        }
        assert_eq!(sums(&empty, &[], 2, &monitor).unwrap(), [0.0; 4]);
    }
}
