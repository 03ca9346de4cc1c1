//! Watersheds: regions of an image around its local minima, and the borders between them.
//!
//! F. Meyer, *Topographic distance and watershed lines*, Signal Processing 38, 1994, by flooding
//! from the minima in order of height, without lines between regions. Each pixel has four
//! neighbours. Heights are rounded to 4096 levels, so that the queue is a list for each level.

use crate::foundation::error::check_shape;
use crate::foundation::libm::sincos;
use crate::foundation::memory;
use crate::foundation::par::Monitor;
use crate::{Error, Result};

/// Number of levels that heights are rounded to.
const LEVELS: usize = 4096;
/// Value for no pixel and for no region.
const NONE: u32 = u32::MAX;
/// Maximum reach. The time grows with the reach, and the element finder uses 2.
const FARTHEST: usize = 64;
/// Number of directions of [`Regions::extremes`].
pub const DIRECTIONS: usize = 32;

/// Returns the region of each pixel and the number of regions. A region begins at each pixel that is the lowest within
/// `reach` rows and columns. Adjacent pixels of this kind begin the same region.
///
/// # Errors
/// The size of `height` does not match the shape. A height or the range of heights is not finite. `reach` exceeds 64.
pub fn flood(
    height: &[f32],
    shape: [usize; 2],
    reach: usize,
    monitor: &Monitor,
) -> Result<(Vec<u32>, usize)> {
    check_shape("height", &shape, height.len())?;
    if reach > FARTHEST {
        let message = format!("must be at most {FARTHEST}, got {reach}");
        return Err(Error::value("reach", message));
    }
    let (least, most) = height
        .iter()
        .fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), &v| {
            (a.min(v), b.max(v))
        });
    // The range overflows if heights are near both ends of the type, which leaves no order of heights.
    if height.iter().any(|v| !v.is_finite()) || most - least == f32::INFINITY {
        let message = "must be finite, and their range also";
        return Err(Error::value("height", message));
    }
    if height.len() >= NONE as usize {
        return Err(Error::value(
            "height",
            format!("must have less than {NONE} pixels"),
        ));
    }
    memory::room("a watershed", height.len(), 20)?;
    monitor.check()?;
    let (mut label, count) = components(&minima(height, shape, reach), shape);
    // Flood. The first region that reaches a pixel adds it to the queue, at the level of the water.
    let scale = (LEVELS - 1) as f32 / (most - least).max(f32::MIN_POSITIVE);
    let level = |p: usize| (((height[p] - least) * scale) as usize).min(LEVELS - 1);
    let mut queue = Levels::new(height.len());
    for p in 0..height.len() {
        if label[p] != NONE {
            queue.push(level(p), p as u32);
        }
    }
    let mut water = 0;
    while let Some(p) = queue.pop(&mut water) {
        neighbours(p as usize, shape, |q| {
            if label[q] == NONE {
                label[q] = label[p as usize];
                queue.push(level(q).max(water), q as u32);
            }
        });
    }
    monitor.check()?;
    Ok((label, count))
}

/// Calls `f` for the four neighbours of a pixel.
#[inline(always)]
fn neighbours(p: usize, [rows, columns]: [usize; 2], mut f: impl FnMut(usize)) {
    let (y, x) = (p / columns, p % columns);
    if y > 0 {
        f(p - columns);
    }
    if x > 0 {
        f(p - 1);
    }
    if x + 1 < columns {
        f(p + 1);
    }
    if y + 1 < rows {
        f(p + columns);
    }
}

/// Returns whether each pixel is the lowest within `reach` rows and columns.
fn minima(height: &[f32], shape: [usize; 2], reach: usize) -> Vec<bool> {
    let low = least_nearby(height, shape, reach);
    height.iter().zip(&low).map(|(a, b)| a == b).collect()
}

/// Returns the least value of each window of `2 reach + 1` rows and columns.
fn least_nearby(values: &[f32], [rows, columns]: [usize; 2], reach: usize) -> Vec<f32> {
    let mut along = values.to_vec();
    for y in 0..rows {
        let row = &values[y * columns..][..columns];
        for x in 0..columns {
            let window = &row[x.saturating_sub(reach)..(x + reach + 1).min(columns)];
            along[y * columns + x] = window.iter().fold(f32::INFINITY, |a, &b| a.min(b));
        }
    }
    let mut out = along.clone();
    for y in 0..rows {
        for other in y.saturating_sub(reach)..(y + reach + 1).min(rows) {
            for x in 0..columns {
                let value = along[other * columns + x];
                let least = &mut out[y * columns + x];
                *least = least.min(value);
            }
        }
    }
    out
}

/// Returns the number of the connected component of each true pixel, in order of their first
/// pixels, and the number of components.
fn components(flags: &[bool], shape: [usize; 2]) -> (Vec<u32>, usize) {
    let (mut label, mut count) = (vec![NONE; flags.len()], 0);
    let mut stack: Vec<u32> = Vec::new();
    for p in 0..flags.len() {
        if !flags[p] || label[p] != NONE {
            continue;
        }
        label[p] = count;
        stack.push(p as u32);
        while let Some(p) = stack.pop() {
            neighbours(p as usize, shape, |q| {
                if flags[q] && label[q] == NONE {
                    label[q] = count;
                    stack.push(q as u32);
                }
            });
        }
        count += 1;
    }
    (label, count as usize)
}

/// A queue with levels. Within a level, the pixel that was added first is taken first.
struct Levels {
    first: Vec<u32>,
    last: Vec<u32>,
    next: Vec<u32>,
}

impl Levels {
    fn new(pixels: usize) -> Self {
        Self {
            first: vec![NONE; LEVELS],
            last: vec![NONE; LEVELS],
            next: vec![NONE; pixels],
        }
    }

    fn push(&mut self, level: usize, p: u32) {
        if self.first[level] == NONE {
            self.first[level] = p;
        } else {
            self.next[self.last[level] as usize] = p;
        }
        self.last[level] = p;
    }

    fn pop(&mut self, level: &mut usize) -> Option<u32> {
        while self.first[*level] == NONE {
            *level += 1;
            if *level == LEVELS {
                return None;
            }
        }
        let p = self.first[*level];
        self.first[*level] = self.next[p as usize];
        Some(p)
    }
}

/// The adjacency of regions, and their extreme pixels.
#[derive(Debug, Clone, PartialEq)]
pub struct Regions {
    /// Pairs of regions that touch, the lower one first, in order.
    pub pairs: Vec<[u32; 2]>,
    /// Length of the border of each pair in pixel sides, sum of the strength along it, and length
    /// with a strength below the threshold.
    pub arcs: Vec<[f64; 3]>,
    /// For each region and each of [`DIRECTIONS`], the pixel (row, column) that is farthest in this direction.
    /// Directions are counted from the second axis towards the first.
    pub extremes: Vec<[[f32; 2]; DIRECTIONS]>,
}

/// Returns unit vectors (row, column) of all directions.
pub fn directions() -> [[f64; 2]; DIRECTIONS] {
    std::array::from_fn(|i| {
        let angle = std::f64::consts::TAU * i as f64 / DIRECTIONS as f64;
        let (sine, cosine) = sincos(angle);
        [sine, cosine]
    })
}

/// Returns the adjacency of `count` regions. The strength between two pixels is the larger of their strengths. The
/// extreme pixels of a region without pixels are (0, 0).
///
/// # Errors
/// The sizes of the arrays do not match the shape. A region is out of range, a strength is not finite, or `weak` is NaN.
pub fn adjacency(
    label: &[u32],
    strength: &[f32],
    shape: [usize; 2],
    count: usize,
    weak: f32,
    monitor: &Monitor,
) -> Result<Regions> {
    check_shape("labels", &shape, label.len())?;
    check_shape("strength", &shape, strength.len())?;
    if let Some(bad) = label.iter().find(|&&l| l as usize >= count) {
        return Err(Error::value(
            "labels",
            format!("must be below {count}, got {bad}"),
        ));
    }
    if strength.iter().any(|v| !v.is_finite()) {
        return Err(Error::value("strength", "must be finite"));
    }
    if weak.is_nan() {
        return Err(Error::value("weak", "must be a number, got NaN"));
    }
    monitor.check()?;
    let [rows, columns] = shape;
    let mut length = 0;
    for p in 0..label.len() {
        neighbours(p, shape, |q| {
            length += usize::from(q > p && label[p] != label[q]);
        });
    }
    let extreme = count.saturating_mul(DIRECTIONS * 16);
    let bytes = extreme.saturating_add(length.saturating_mul(56));
    memory::room("the adjacency of regions", bytes, 1)?;
    let mut sides: Vec<(u64, f32)> = Vec::with_capacity(length);
    let directions = directions();
    let mut far = vec![[f64::NEG_INFINITY; DIRECTIONS]; count];
    let mut extremes = vec![[[0.0f32; 2]; DIRECTIONS]; count];
    for y in 0..rows {
        for x in 0..columns {
            let p = y * columns + x;
            let mut edge = y == 0 || x == 0 || y + 1 == rows || x + 1 == columns;
            neighbours(p, shape, |q| {
                let (a, b) = (label[p], label[q]);
                if a == b {
                    return;
                }
                edge = true;
                if q > p {
                    let key = (u64::from(a.min(b)) << 32) | u64::from(a.max(b));
                    sides.push((key, strength[p].max(strength[q])));
                }
            });
            if edge {
                // Only pixels at the border of a region are extreme.
                let region = label[p] as usize;
                for (k, d) in directions.iter().enumerate() {
                    let along = y as f64 * d[0] + x as f64 * d[1];
                    if along > far[region][k] {
                        far[region][k] = along;
                        extremes[region][k] = [y as f32, x as f32];
                    }
                }
            }
        }
    }
    // The sort is stable, so strengths are summed in the order of pixels.
    sides.sort_by_key(|side| side.0);
    let runs = || sides.chunk_by(|a, b| a.0 == b.0);
    let touching = runs().count();
    let mut pairs: Vec<[u32; 2]> = Vec::with_capacity(touching);
    let mut arcs: Vec<[f64; 3]> = Vec::with_capacity(touching);
    for run in runs() {
        pairs.push([(run[0].0 >> 32) as u32, run[0].0 as u32]);
        let mut sums = [0.0; 3];
        for &(_, value) in run {
            sums[0] += 1.0;
            sums[1] += f64::from(value);
            sums[2] += f64::from(u8::from(value < weak));
        }
        arcs.push(sums);
    }
    Ok(Regions {
        pairs,
        arcs,
        extremes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_basins_meet_at_the_crest() {
        let row = [3.0, 1.0, 2.0, 5.0, 2.0, 0.0, 1.0];
        let height: Vec<f32> = row.iter().chain(&row).copied().collect();
        let monitor = Monitor::default();
        let (label, count) = flood(&height, [2, 7], 1, &monitor).unwrap();
        assert_eq!(count, 2);
        assert_eq!(label[..3], [0, 0, 0]);
        assert_eq!(label[4..7], [1, 1, 1]);
        let found = adjacency(&label, &height, [2, 7], count, 4.0, &monitor).unwrap();
        assert_eq!(found.pairs, [[0, 1]]);
        assert_eq!(found.arcs, [[2.0, 10.0, 0.0]]);
        assert_eq!(found.extremes[1][0][1], 6.0);
    }

    #[test]
    fn every_pixel_has_a_connected_region() {
        let shape = [23, 31];
        let height: Vec<f32> = (0..23 * 31).map(|i| ((i * 7919) % 101) as f32).collect();
        let (label, count) = flood(&height, shape, 2, &Monitor::default()).unwrap();
        assert!(label.iter().all(|&l| (l as usize) < count));
        for region in 0..count as u32 {
            let flags: Vec<bool> = label.iter().map(|&l| l == region).collect();
            assert_eq!(components(&flags, shape).1, 1);
        }
    }

    #[test]
    fn flat_and_tiny_images_are_one_region() {
        let monitor = Monitor::default();
        assert_eq!(
            flood(&[2.0; 12], [3, 4], 2, &monitor).unwrap(),
            (vec![0; 12], 1)
        );
        assert_eq!(flood(&[2.0], [1, 1], 2, &monitor).unwrap(), (vec![0], 1));
        assert_eq!(flood(&[], [0, 4], 2, &monitor).unwrap(), (vec![], 0));
        assert!(flood(&[f32::NAN], [1, 1], 2, &monitor).is_err());
        assert!(adjacency(&[1], &[0.0], [1, 1], 1, 0.0, &monitor).is_err());
    }

    #[test]
    fn values_out_of_range_are_errors() {
        let monitor = Monitor::default();
        let named = |error: Result<(Vec<u32>, usize)>, name: &str| {
            assert!(error.unwrap_err().to_string().starts_with(name));
        };
        named(flood(&[1.0, 2.0], [1, 2], usize::MAX, &monitor), "reach");
        named(flood(&[f32::MIN, f32::MAX], [1, 2], 2, &monitor), "height");
        let touch = |strength: f32, count: usize, weak: f32| {
            adjacency(&[0, 0], &[strength; 2], [1, 2], count, weak, &monitor)
        };
        assert!(touch(f32::NAN, 1, 0.0).is_err() && touch(0.0, 1, f32::NAN).is_err());
        assert!(matches!(
            touch(0.0, usize::MAX / 64, 0.0),
            Err(Error::Limit { .. })
        ));
        // Regions without pixels are allowed.
        assert_eq!(touch(0.0, 3, 0.0).unwrap().extremes.len(), 3);
    }
}
