//! Outlines of labelled regions as minimum cuts in bands around their first outlines.
//!
//! Y. Boykov, G. Funka-Lea, *Graph cuts and efficient N-D image segmentation*, IJCV 70, 2006, applied to each region
//! separately. Deep pixels of the region are inside. Far pixels and deep pixels of other regions are outside. The cut
//! of least energy separates them.
//!
//! 1. Measure the distance of each pixel from the first outline.
//! 2. Cut the band. The energy is the sum of the evidence of pixels, a pull towards the first outline, and the prices
//!    of pairs across the outline.
//! 3. Keep the largest connected part, and fill its holes.
//! 4. A pixel that several regions claim stays with its first region, or goes to the nearest one.

use super::maxflow::{Graph, Solver};
use crate::foundation::error::check_shape;
use crate::foundation::grid::Grid;
use crate::foundation::memory;
use crate::foundation::par::{self, Monitor};
use crate::{Error, Result};

/// Capacity of a price of 1.
const UNIT: f32 = 65536.0;
/// Capacity that is never cut.
const FIXED: i32 = 1 << 28;
/// Maximum evidence and price. Larger values are clipped.
const MOST: f32 = 64.0;
/// Regions are cut together while their windows have less than this number of times the pixels of the image. The limit
/// bounds the memory for the pixels that many overlapping regions claim. It has no influence on the result.
const TOGETHER: usize = 4;
/// Bytes for each pixel of a window while its region is cut.
const CUT: usize = 112;

/// Data that determine the new outlines.
#[derive(Debug, Clone, Copy)]
pub struct Evidence<'a> {
    /// Evidence that a pixel is inside (positive) or outside (negative) of any region.
    pub inside: &'a [f32],
    /// Price of an outline that passes a pixel, at least 0.
    pub price: &'a [f32],
    /// Evidence for the first outline. A pixel at distance d from it, positive inside, has the evidence `pull * d /
    /// reach`, where `reach` is the half-width of the band.
    pub pull: f32,
}

/// Returns labels with new outlines. 0 is the background. The outline of label `i` moves by at most `reach[i]` pixels,
/// and not at all if that is 0. Then only the largest part of a label is kept, and its holes are filled.
///
/// # Errors
/// Sizes of arrays differ, a label is out of range, a reach exceeds 64, a value is not finite, or a price is negative.
pub fn refine(
    labels: &[i32],
    shape: [usize; 2],
    evidence: &Evidence<'_>,
    reach: &[u8],
    monitor: &Monitor,
) -> Result<Vec<i32>> {
    check_shape("labels", &shape, labels.len())?;
    check_shape("inside", &shape, evidence.inside.len())?;
    check_shape("price", &shape, evidence.price.len())?;
    if let Some(bad) = labels
        .iter()
        .find(|&&l| l < 0 || l as usize >= reach.len().max(1))
    {
        let message = format!("must be from 0 to below {}, got {bad}", reach.len().max(1));
        return Err(Error::value("labels", message));
    }
    if evidence.inside.iter().any(|v| !v.is_finite()) {
        return Err(Error::value("inside", "must be finite"));
    }
    if !evidence.pull.is_finite() {
        let message = format!("must be finite, got {}", evidence.pull);
        return Err(Error::value("pull", message));
    }
    if evidence.price.iter().any(|v| !(v.is_finite() && *v >= 0.0)) {
        return Err(Error::value("price", "must be finite and at least 0"));
    }
    if let Some(bad) = reach.iter().find(|&&r| r > 64) {
        return Err(Error::value(
            "reach",
            format!("must be at most 64, got {bad}"),
        ));
    }
    if u32::try_from(labels.len()).is_err() {
        return Err(Error::value("labels", "must have less than 2^32 pixels"));
    }
    memory::room("outlines", labels.len(), 8)?;
    memory::room("outlines", reach.len(), 160)?;
    monitor.check()?;
    let windows: Vec<(usize, Window)> = boxes(labels, shape, reach.len())
        .into_iter()
        .enumerate()
        .filter_map(|(i, area)| Some((i, Window::new(area?, shape, reach[i]))))
        .collect();
    // If several regions claim a pixel, assign it to its first region, or else to the nearest region. Ties go to the
    // lowest label.
    let mut out = vec![0i32; labels.len()];
    let mut best = vec![f32::NEG_INFINITY; labels.len()];
    let mut left = &windows[..];
    while !left.is_empty() {
        let (now, later) = left.split_at(together(left, TOGETHER * labels.len()));
        left = later;
        let largest = now.iter().map(|(_, w)| w.pixels()).max().unwrap_or(0);
        let claimed: usize = now.iter().map(|(_, w)| w.pixels()).sum();
        let cuts = now.len().min(par::threads());
        memory::room("outlines", CUT * cuts * largest + 8 * claimed, 1)?;
        let claims = par::map(now.len(), |k| {
            let (i, window) = now[k];
            Band::new(labels, shape[1], window, i as i32, reach[i]).cut(evidence, monitor)
        });
        for (&(i, _), claims) in now.iter().zip(claims) {
            for (p, depth) in claims? {
                let p = p as usize;
                let own = labels[p] == i as i32;
                let depth = if own { f32::INFINITY } else { depth };
                if depth > best[p] {
                    best[p] = depth;
                    out[p] = i as i32;
                }
            }
        }
    }
    Ok(out)
}

/// Returns how many of the first windows have at most `most` pixels together, at least 1.
fn together(windows: &[(usize, Window)], most: usize) -> usize {
    let mut sum = 0;
    let fits = |(_, window): &&(usize, Window)| {
        sum += window.pixels();
        sum <= most
    };
    windows.iter().take_while(fits).count().max(1)
}

/// First and last row and column.
type Box2 = [[usize; 2]; 2];

/// Returns the box around each label.
fn boxes(labels: &[i32], [_, columns]: [usize; 2], count: usize) -> Vec<Option<Box2>> {
    let mut out: Vec<Option<Box2>> = vec![None; count];
    for (p, &label) in labels.iter().enumerate() {
        if label > 0 {
            let (y, x) = (p / columns, p % columns);
            let [ys, xs] = out[label as usize].get_or_insert([[y, y], [x, x]]);
            ys[1] = y;
            xs[0] = xs[0].min(x);
            xs[1] = xs[1].max(x);
        }
    }
    out
}

/// The rectangle around a region that its new outline may reach.
#[derive(Debug, Clone, Copy)]
struct Window {
    origin: [usize; 2],
    shape: [usize; 2],
}

impl Window {
    fn new([ys, xs]: Box2, [rows, columns]: [usize; 2], reach: u8) -> Self {
        let margin = usize::from(reach) + 2;
        let origin = [ys[0].saturating_sub(margin), xs[0].saturating_sub(margin)];
        let end = [
            (ys[1] + margin + 1).min(rows),
            (xs[1] + margin + 1).min(columns),
        ];
        let shape = [end[0] - origin[0], end[1] - origin[1]];
        Self { origin, shape }
    }

    fn pixels(&self) -> usize {
        self.shape[0] * self.shape[1]
    }
}

/// The surroundings of one region.
struct Band {
    window: Window,
    columns: usize,
    reach: u8,
    /// Distance of each pixel from the first outline, positive inside.
    depth: Vec<f32>,
    /// Flags of the pixels deep in another region.
    other: Vec<bool>,
}

impl Band {
    fn new(labels: &[i32], columns: usize, window: Window, label: i32, reach: u8) -> Self {
        let Window { origin, shape } = window;
        let mut own = Vec::with_capacity(window.pixels());
        let mut alien = Vec::with_capacity(window.pixels());
        for y in origin[0]..origin[0] + shape[0] {
            for &l in &labels[y * columns + origin[1]..][..shape[1]] {
                own.push(l == label);
                alien.push(l != label && l != 0);
            }
        }
        let depth = signed(&own, distance(&own, shape));
        // Pixels of other regions that are deeper than half of the band stay in these regions.
        let other = if alien.contains(&true) {
            let inside = signed(&alien, distance(&alien, shape));
            inside.iter().map(|&d| d > 0.5 * f32::from(reach)).collect()
        } else {
            alien
        };
        Self {
            window,
            columns,
            reach,
            depth,
            other,
        }
    }

    /// Returns the index and the depth of each pixel inside the new outline.
    fn cut(&self, evidence: &Evidence<'_>, monitor: &Monitor) -> Result<Vec<(u32, f32)>> {
        let [rows, columns] = self.window.shape;
        let origin = self.window.origin;
        let place = |i: usize| (origin[0] + i / columns) * self.columns + origin[1] + i % columns;
        let mut inside: Vec<bool> = self.depth.iter().map(|&d| d > 0.0).collect();
        if self.reach > 0 {
            let reach = f32::from(self.reach);
            let mut terminal = Vec::with_capacity(inside.len());
            let mut price = Vec::with_capacity(inside.len());
            let deepest = self.depth.iter().copied().fold(0.0, f32::max);
            // If the region is thinner than the band, keep its inner part.
            let core = reach.min(0.7 * deepest);
            for (i, &depth) in self.depth.iter().enumerate() {
                let p = place(i);
                let value = evidence.inside[p] + evidence.pull * depth / reach;
                terminal.push(if depth > core {
                    FIXED
                } else if depth < -reach || (self.other[i] && depth < 0.0) {
                    -FIXED
                } else {
                    (value.clamp(-MOST, MOST) * UNIT) as i32
                });
                price.push(evidence.price[p].min(MOST));
            }
            let pair = |step: usize| -> Vec<i32> {
                let next = |i: usize| price.get(i + step).copied().unwrap_or(0.0);
                (0..price.len())
                    .map(|i| (0.5 * (price[i] + next(i)) * UNIT) as i32)
                    .collect()
            };
            let (down, right) = (pair(columns), pair(1));
            let graph = Graph {
                grid: Grid::new([rows, columns], [false; 2])?,
                terminal: &terminal,
                forward: [&down, &right],
                backward: [&down, &right],
            };
            let cut = Solver::default().min_cut(&graph, monitor)?;
            inside = cut.sink.iter().map(|&s| !s).collect();
        }
        self.tidy(&mut inside);
        let mut claims = Vec::with_capacity(inside.iter().filter(|&&flag| flag).count());
        let claimed = inside.iter().enumerate().filter(|(_, flag)| **flag);
        claims.extend(claimed.map(|(i, _)| (place(i) as u32, self.depth[i])));
        Ok(claims)
    }

    /// Keeps the largest connected part, and fills holes that are not deep in another region.
    fn tidy(&self, inside: &mut [bool]) {
        let parts = parts(inside, self.window.shape, |_| false);
        let largest = parts
            .1
            .iter()
            .enumerate()
            .max_by_key(|&(i, &size)| (size, std::cmp::Reverse(i)));
        let Some((largest, _)) = largest else { return };
        inside
            .iter_mut()
            .zip(&parts.0)
            .for_each(|(flag, &part)| *flag = part == largest as u32);
        let outside: Vec<bool> = inside.iter().map(|flag| !flag).collect();
        let [rows, columns] = self.window.shape;
        let edge = |i: usize| {
            let (y, x) = (i / columns, i % columns);
            y == 0 || x == 0 || y + 1 == rows || x + 1 == columns || self.other[i]
        };
        let holes = self::parts(&outside, self.window.shape, edge);
        for (flag, &part) in inside.iter_mut().zip(&holes.0) {
            // Parts that touch the edge of the window, or pixels deep in another region, have size 0. They are not
            // holes.
            if part != u32::MAX && holes.1[part as usize] > 0 {
                *flag = true;
            }
        }
    }
}

/// Returns the number of the connected part of each true pixel, and the size of each part. The size is 0 if `open` is
/// true for one of its pixels.
fn parts(
    flags: &[bool],
    [rows, columns]: [usize; 2],
    open: impl Fn(usize) -> bool,
) -> (Vec<u32>, Vec<usize>) {
    let (mut part, mut sizes) = (vec![u32::MAX; flags.len()], Vec::new());
    let mut stack = Vec::new();
    for start in 0..flags.len() {
        if !flags[start] || part[start] != u32::MAX {
            continue;
        }
        let number = sizes.len() as u32;
        let (mut size, mut is_open) = (0, false);
        part[start] = number;
        stack.push(start);
        while let Some(p) = stack.pop() {
            size += 1;
            is_open |= open(p);
            let (y, x) = (p / columns, p % columns);
            let around = [
                (y > 0).then(|| p - columns),
                (x > 0).then(|| p - 1),
                (x + 1 < columns).then_some(p + 1),
                (y + 1 < rows).then_some(p + columns),
            ];
            for q in around.into_iter().flatten() {
                if flags[q] && part[q] == u32::MAX {
                    part[q] = number;
                    stack.push(q);
                }
            }
        }
        sizes.push(if is_open { 0 } else { size });
    }
    (part, sizes)
}

/// Returns distances with a negative sign where a flag is false.
fn signed(flags: &[bool], mut distance: Vec<f32>) -> Vec<f32> {
    for (value, &flag) in distance.iter_mut().zip(flags) {
        *value = if flag { *value } else { -*value };
    }
    distance
}

/// Returns the chamfer distance of each pixel from the nearest pixel with another flag, with steps of 1 and 4/3. It is
/// 0.5 next to such a pixel, because the outline is half a pixel from the pixels on both sides.
fn distance(flags: &[bool], [rows, columns]: [usize; 2]) -> Vec<f32> {
    const DIAGONAL: f32 = 4.0 / 3.0;
    let mut out = vec![(rows + columns) as f32; flags.len()];
    let relax = |out: &mut [f32], p: usize, q: usize, step: f32| {
        let value = if flags[p] == flags[q] {
            out[q] + step
        } else {
            step - 0.5
        };
        out[p] = out[p].min(value);
    };
    for y in 0..rows {
        for x in 0..columns {
            let p = y * columns + x;
            if x > 0 {
                relax(&mut out, p, p - 1, 1.0);
            }
            if y > 0 {
                relax(&mut out, p, p - columns, 1.0);
                if x > 0 {
                    relax(&mut out, p, p - columns - 1, DIAGONAL);
                }
                if x + 1 < columns {
                    relax(&mut out, p, p - columns + 1, DIAGONAL);
                }
            }
        }
    }
    for y in (0..rows).rev() {
        for x in (0..columns).rev() {
            let p = y * columns + x;
            if x + 1 < columns {
                relax(&mut out, p, p + 1, 1.0);
            }
            if y + 1 < rows {
                relax(&mut out, p, p + columns, 1.0);
                if x > 0 {
                    relax(&mut out, p, p + columns - 1, DIAGONAL);
                }
                if x + 1 < columns {
                    relax(&mut out, p, p + columns + 1, DIAGONAL);
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::foundation::par::install;

    /// Returns labels of a square in an image of 30 x 30 pixels, and a price. The square is `off` pixels too small on
    /// each side, and the price is low along the true outline.
    fn square(off: usize) -> (Vec<i32>, Vec<f32>, Vec<i32>) {
        let inside = |p: usize, margin: usize| {
            let range = 8 + margin..22 - margin;
            range.contains(&(p / 30)) && range.contains(&(p % 30))
        };
        let truth = (0..900).map(|p| i32::from(inside(p, 0))).collect();
        let first = (0..900).map(|p| i32::from(inside(p, off))).collect();
        let near = |p: usize| {
            (inside(p, 0) && !inside(p, 1))
                || (!inside(p, 0) && (7..23).contains(&(p / 30)) && (7..23).contains(&(p % 30)))
        };
        (
            first,
            (0..900).map(|p| if near(p) { 0.1 } else { 1.0 }).collect(),
            truth,
        )
    }

    #[test]
    fn an_outline_moves_to_the_contour() {
        let (first, price, truth) = square(2);
        let evidence = Evidence {
            inside: &[0.0; 900],
            price: &price,
            pull: 0.0,
        };
        let found = refine(&first, [30, 30], &evidence, &[0, 5], &Monitor::default()).unwrap();
        assert_eq!(found, truth);
        let stays = refine(&first, [30, 30], &evidence, &[0, 0], &Monitor::default()).unwrap();
        assert_eq!(stays, first);
    }

    #[test]
    fn threads_do_not_change_the_result() {
        let labels: Vec<i32> = (0..900)
            .map(|p| {
                if p / 30 % 7 == 0 {
                    0
                } else {
                    1 + p / 30 / 7 * 3 + p % 30 / 10
                }
            })
            .collect();
        let noise: Vec<f32> = (0..900)
            .map(|p| ((p * 7919) % 101) as f32 / 101.0)
            .collect();
        let evidence = Evidence {
            inside: &noise,
            price: &noise,
            pull: 0.2,
        };
        let with = |n| {
            install(n, || {
                refine(&labels, [30, 30], &evidence, &[3; 16], &Monitor::default())
            })
            .unwrap()
            .unwrap()
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn bad_values_are_errors() {
        let evidence = Evidence {
            inside: &[0.0; 4],
            price: &[1.0; 4],
            pull: 0.0,
        };
        let monitor = Monitor::default();
        let refine = |labels: &[i32], evidence: &Evidence<'_>| {
            refine(labels, [2, 2], evidence, &[0, 3], &monitor)
        };
        assert!(refine(&[0, 1, 2, 0], &evidence).is_err());
        assert!(refine(&[0, -1, 0, 0], &evidence).is_err());
        assert!(refine(&[0, 1, 0], &evidence).is_err());
        assert!(
            refine(
                &[0, 1, 0, 0],
                &Evidence {
                    price: &[-1.0; 4],
                    ..evidence
                }
            )
            .is_err()
        );
        assert!(
            refine(
                &[0, 1, 0, 0],
                &Evidence {
                    inside: &[f32::NAN; 4],
                    ..evidence
                }
            )
            .is_err()
        );
        let pull = f32::INFINITY;
        let error = refine(&[0, 1, 0, 0], &Evidence { pull, ..evidence }).unwrap_err();
        assert!(error.to_string().starts_with("pull"));
        assert_eq!(refine(&[1; 4], &evidence).unwrap(), [1; 4]);
    }

    #[test]
    fn regions_whose_windows_overlap_are_cut_in_several_groups() {
        // Each of 900 regions has one pixel, and its window is most of the image.
        let labels: Vec<i32> = (1..=900).collect();
        let evidence = Evidence {
            inside: &[0.0; 900],
            price: &[1.0; 900],
            pull: 1.0,
        };
        let found = refine(&labels, [30, 30], &evidence, &[9; 901], &Monitor::default());
        assert_eq!(found.unwrap(), labels);
    }
}
