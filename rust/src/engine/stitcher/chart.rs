//! A chart: the map of one patch from the output into the exemplar, relative to its centre.

use super::canvas::{Canvas, Window};
use super::mesh::Mesh;
use crate::foundation::fixed::{Frame, Frames, ONE, Place, apply, inverse};
use crate::foundation::grid::Grid;

/// Fractions of the side of a bent patch that are tried in turn, until the field varies little enough inside the
/// patch.
const SHRINK: [f32; 4] = [1.0, 0.8, 0.65, 0.5];
/// Maximum mean difference between the frame of the centre and the field in the inner part of a bent patch.
const ADAPT: f32 = 0.7;
/// Maximum difference between the derivatives of a bent patch and the field. Points above it are left to other
/// patches.
const TORN: f32 = 0.45;
/// Divisor of the patch side at a pole of the field, where patches are rigid.
const POLE: f32 = 1.75;
/// Ratio of the window sides of a bent patch and of a rigid patch.
const BENT: f32 = 1.2;

/// The map of a patch: exemplar coordinates of its points, relative to the coordinates of its centre.
pub(super) struct Chart<const D: usize> {
    pub window: Window<D>,
    /// Relative exemplar coordinates of each point of the window.
    pub steps: Vec<Place<D>>,
    /// Whether each point of the window is in the patch. Points on the window's border are not.
    pub mask: Vec<bool>,
    /// Difference between the chart and the field at each point. Empty if there is one frame for all points.
    pub distortion: Vec<f32>,
    /// The Jacobian at the centre.
    pub frame: Frame<D>,
    /// Whether the chart is an affine map with the frame of the centre.
    pub rigid: bool,
}

impl<const D: usize> Chart<D> {
    /// Returns the chart of a patch around a point. `side` is in samples of the exemplar. The chart is rigid or follows
    /// the field.
    pub(super) fn new(
        canvas: &Canvas<D>,
        frames: Frames<'_, D>,
        centre: [i32; D],
        side: f32,
        bend: bool,
    ) -> Option<Self> {
        let frame = frame_at(canvas, frames, centre);
        let mut side = side;
        let varies = matches!(frames, Frames::Dense(_));
        if bend && varies {
            let mut shares = SHRINK.iter();
            let fits = |share: f32| {
                let chart = Self::rigid(canvas, frames, frame, centre, 0.6 * share * side);
                chart.is_some_and(|c| mean(&c.distortion, &c.mask) < ADAPT)
            };
            side *= *shares.find(|&&s| fits(s)).unwrap_or(&SHRINK[3]);
            let bent = Self::bent(canvas, frames, frame, centre, side);
            if bent.as_ref().is_some_and(|c| c.has(centre)) {
                return bent;
            }
            side /= POLE;
        }
        Self::rigid(canvas, frames, frame, centre, side)
    }

    /// Returns the chart of a patch that fills a window, up to a side of `most` samples. The chart is rigid or follows
    /// the field.
    pub(super) fn over(
        window: Window<D>,
        canvas: &Canvas<D>,
        frames: Frames<'_, D>,
        most: f32,
        bend: bool,
    ) -> Self {
        let sides = window.grid.shape();
        let centre = std::array::from_fn(|a| window.low[a] + sides[a] as i32 / 2);
        let here = centre.map(|x| x as usize);
        let frame = frames.at(canvas.grid.index(here));
        if bend {
            let bent = Self::integrated(window.clone(), canvas, frames, frame, centre, most);
            if let Some(chart) = bent.filter(|c| c.has(centre)) {
                return chart;
            }
        }
        Self::affine(window, canvas, frames, frame, centre, Some(most))
    }

    /// Returns the ends of the box around a patch, with a margin of one point: the first point, and the point after the
    /// last.
    pub(super) fn reach(
        canvas: &Canvas<D>,
        frames: Frames<'_, D>,
        centre: [i32; D],
        side: f32,
        bend: bool,
    ) -> ([i32; D], [i32; D]) {
        let frame = frame_at(canvas, frames, centre);
        let bend = bend && matches!(frames, Frames::Dense(_));
        Self::bounds(canvas, &frame, centre, side, if bend { BENT } else { 1.0 })
    }

    fn bounds(
        canvas: &Canvas<D>,
        frame: &Frame<D>,
        centre: [i32; D],
        side: f32,
        more: f32,
    ) -> ([i32; D], [i32; D]) {
        let back = inverse(frame);
        let (mut low, mut high) = ([0; D], [0; D]);
        for axis in 0..D {
            let reach: i64 = back[axis].iter().map(|&x| i64::from(x.abs())).sum();
            let half = (side * 0.5 * reach as f32 / ONE as f32 * more).ceil() as i32 + 1;
            // A patch must not meet itself around a periodic axis.
            let most = canvas.grid.shape()[axis] as i32;
            let half = if canvas.grid.wrap()[axis] {
                half.min((most - 1) / 2)
            } else {
                half.min(1 << 20)
            };
            low[axis] = centre[axis] - half;
            high[axis] = centre[axis] + half + 1;
        }
        (low, high)
    }

    fn window(
        canvas: &Canvas<D>,
        frame: &Frame<D>,
        centre: [i32; D],
        side: f32,
        more: f32,
    ) -> Option<Window<D>> {
        let (low, high) = Self::bounds(canvas, frame, centre, side, more);
        canvas.window(low, high)
    }

    /// Returns the affine chart of a frame around a point.
    pub(super) fn rigid(
        canvas: &Canvas<D>,
        frames: Frames<'_, D>,
        frame: Frame<D>,
        centre: [i32; D],
        side: f32,
    ) -> Option<Self> {
        let window = Self::window(canvas, &frame, centre, side, 1.0)?;
        Some(Self::affine(
            window,
            canvas,
            frames,
            frame,
            centre,
            Some(side),
        ))
    }

    /// Returns the affine chart of a frame over a window. The patch has the given side, or fills the window if there
    /// is none.
    pub(super) fn affine(
        window: Window<D>,
        canvas: &Canvas<D>,
        frames: Frames<'_, D>,
        frame: Frame<D>,
        centre: [i32; D],
        side: Option<f32>,
    ) -> Self {
        let n = window.grid.len();
        let mut steps = Vec::with_capacity(n);
        for point in window.grid.points() {
            let at = window.at(point);
            steps.push(apply(&frame, std::array::from_fn(|a| at[a] - centre[a])));
        }
        let mut chart = Self {
            mask: Vec::new(),
            distortion: Vec::new(),
            window,
            steps,
            frame,
            rigid: true,
        };
        // Measure how far the rigid map deviates from the field at each point.
        if let Frames::Dense(all) = frames {
            chart.distortion = chart
                .window
                .points
                .iter()
                .map(|&p| difference(&frame, &all[p as usize]))
                .collect();
        }
        chart.mask = chart.inside(canvas, side);
        chart
    }

    /// Returns a chart integrated from the field: the map whose derivatives are nearest to the frames.
    fn bent(
        canvas: &Canvas<D>,
        frames: Frames<'_, D>,
        frame: Frame<D>,
        centre: [i32; D],
        side: f32,
    ) -> Option<Self> {
        let window = Self::window(canvas, &frame, centre, side, BENT)?;
        Self::integrated(window, canvas, frames, frame, centre, side)
    }

    /// Returns the integrated chart over a given window.
    fn integrated(
        window: Window<D>,
        canvas: &Canvas<D>,
        frames: Frames<'_, D>,
        frame: Frame<D>,
        centre: [i32; D],
        side: f32,
    ) -> Option<Self> {
        let Frames::Dense(all) = frames else {
            return None;
        };
        // Integrate the frames on a coarse lattice, once for each exemplar axis, and interpolate the potentials at the
        // points.
        let mesh = Mesh::new(&window, all);
        let potentials: Vec<Vec<f64>> = (0..D).map(|i| mesh.integrate(i)).collect();
        let at = |p: [f64; D]| -> [f64; D] { std::array::from_fn(|i| mesh.at(&potentials[i], p)) };
        let middle = at(std::array::from_fn(|a| {
            f64::from(centre[a] - window.low[a])
        }));
        let n = window.grid.len();
        let mut steps = Vec::with_capacity(n);
        for point in window.grid.points() {
            let value = at(point.map(|x| x as f64));
            let step: Place<D> =
                std::array::from_fn(|a| ((value[a] - middle[a]) * f64::from(ONE)).round() as i32);
            steps.push(step);
        }
        let mut chart = Self {
            mask: Vec::new(),
            distortion: vec![0.0; n],
            window,
            steps,
            frame,
            rigid: false,
        };
        chart.measure(all);
        chart.mask = chart.inside(canvas, Some(side));
        // Leave points that deviate too much to other patches.
        for (mask, &d) in chart.mask.iter_mut().zip(&chart.distortion) {
            *mask &= d < TORN;
        }
        chart.keep_connected(centre);
        Some(chart)
    }

    /// Measures the difference between the chart's derivatives and the frames.
    fn measure(&mut self, frames: &[Frame<D>]) {
        let (grid, strides) = (self.window.grid, self.window.grid.strides());
        for (i, point) in grid.points().enumerate() {
            let mut slope = frames[self.window.points[i] as usize];
            for axis in 0..D {
                if grid.shape()[axis] < 2 {
                    continue;
                }
                let p = if point[axis] + 1 < grid.shape()[axis] {
                    i
                } else {
                    i - strides[axis]
                };
                let (a, b) = (self.steps[p], self.steps[p + strides[axis]]);
                for row in 0..D {
                    slope[row][axis] = (b[row] - a[row]).clamp(-32000, 32000) as i16;
                }
            }
            self.distortion[i] = difference(&slope, &frames[self.window.points[i] as usize]);
        }
    }

    /// Returns the points within half a side of the centre along each axis of the exemplar. Points on the window's
    /// border are excluded, unless the canvas ends there.
    fn inside(&self, canvas: &Canvas<D>, side: Option<f32>) -> Vec<bool> {
        let half = side.map_or(i32::MAX, |s| ((s * 0.5 - 0.01) * ONE as f32) as i32);
        let grid = &self.window.grid;
        grid.points()
            .enumerate()
            .map(|(i, point)| {
                let at = self.window.at(point);
                let border = (0..D).any(|a| {
                    let (n, open) = (
                        canvas.grid.shape()[a] as i32,
                        !canvas.grid.wrap()[a] && !canvas.part,
                    );
                    (point[a] == 0 && !(open && at[a] == 0))
                        || (point[a] + 1 == grid.shape()[a] && !(open && at[a] + 1 == n))
                });
                !border && self.steps[i].iter().all(|x| x.abs() <= half)
            })
            .collect()
    }

    /// Returns whether a point of the canvas is in the patch.
    fn has(&self, centre: [i32; D]) -> bool {
        self.index(centre).is_some_and(|i| self.mask[i])
    }

    fn index(&self, at: [i32; D]) -> Option<usize> {
        let mut point = [0; D];
        for axis in 0..D {
            let i = at[axis] - self.window.low[axis];
            if i < 0 || i as usize >= self.window.grid.shape()[axis] {
                return None;
            }
            point[axis] = i as usize;
        }
        Some(self.window.grid.index(point))
    }

    /// Removes points that are not connected to the centre.
    fn keep_connected(&mut self, centre: [i32; D]) {
        let Some(start) = self.index(centre).filter(|&i| self.mask[i]) else {
            self.mask.fill(false);
            return;
        };
        let connected = flood(&self.window.grid, &self.mask, &[start]);
        self.mask = connected;
    }
}

/// Returns the Jacobian at a point of the canvas.
fn frame_at<const D: usize>(
    canvas: &Canvas<D>,
    frames: Frames<'_, D>,
    centre: [i32; D],
) -> Frame<D> {
    let here = std::array::from_fn(|a| canvas.grid.resolve(a, centre[a] as isize));
    frames.at(canvas.grid.index(here))
}

/// Returns the points of a mask that are connected to given points of it.
pub(super) fn flood<const D: usize>(grid: &Grid<D>, mask: &[bool], from: &[usize]) -> Vec<bool> {
    let mut reached = vec![false; mask.len()];
    let mut open = Vec::new();
    for &i in from {
        if mask[i] && !reached[i] {
            reached[i] = true;
            open.push(i);
        }
    }
    let strides = grid.strides();
    while let Some(i) = open.pop() {
        let point = grid.point(i);
        for axis in 0..D {
            let mut visit = |j: usize| {
                if mask[j] && !reached[j] {
                    reached[j] = true;
                    open.push(j);
                }
            };
            if point[axis] > 0 {
                visit(i - strides[axis]);
            }
            if point[axis] + 1 < grid.shape()[axis] {
                visit(i + strides[axis]);
            }
        }
    }
    reached
}

/// Returns the root mean square, over the axes, of the difference of two frames.
pub(super) fn difference<const D: usize>(a: &Frame<D>, b: &Frame<D>) -> f32 {
    let mut sum = 0.0;
    for i in 0..D {
        for j in 0..D {
            let d = f32::from(a[i][j]) - f32::from(b[i][j]);
            sum += d * d;
        }
    }
    (sum / D as f32).sqrt() / ONE as f32
}

/// Returns the mean of the values in a mask, and 0 for an empty mask.
pub(super) fn mean(values: &[f32], mask: &[bool]) -> f32 {
    let (mut sum, mut count) = (0.0f64, 0.0);
    for (&v, _) in values.iter().zip(mask).filter(|(_, m)| **m) {
        sum += f64::from(v);
        count += 1.0;
    }
    if count > 0.0 {
        (sum / count) as f32
    } else {
        0.0
    }
}
