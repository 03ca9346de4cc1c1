//! Two images of the same shape that overlap completely: the least visible seam from border to
//! border.
//!
//! Efros and Freeman, *Image quilting for texture synthesis and transfer*, SIGGRAPH 2001. The seam
//! may turn back, because it is the exact minimum cut (see [`super::planar`]).

use super::cost::{Cost, FARTHEST, Pair, check_costs};
use super::planar::{LONGEST, Strip, least_seam, longest};
use super::stitch::Stitched;
use crate::foundation::error::check_shape;
use crate::foundation::grid::Grid;
use crate::foundation::memory;
use crate::foundation::par::Monitor;
use crate::{Error, Result};
use std::borrow::Cow;

/// Number of pixels that are compared together to find edges that a seam cuts.
const SIMILAR: usize = 64;

/// Two images, and their arrangement.
#[derive(Debug, Clone, Copy)]
pub struct Pasted<'a> {
    /// Rows and columns of both images.
    pub shape: [usize; 2],
    /// Number of channels of both images.
    pub channels: usize,
    /// The image at the start of `axis`.
    pub a: &'a [f32],
    /// The image at the end of `axis`.
    pub b: &'a [f32],
    /// The axis that the seam crosses. The first line along it takes A, and the last line takes B.
    pub axis: usize,
    /// If true, the other axis wraps and the seam is closed.
    pub cyclic: bool,
    /// Penalty of each pixel. The cost of an edge is multiplied by 1 plus the mean penalty of its
    /// ends.
    pub penalty: Option<&'a [f32]>,
    /// Cost of a seam.
    pub cost: Cost,
}

/// Returns the least visible seam.
///
/// Costs are rounded to multiples of 2^-16, or to coarser multiples if a straight seam costs 2^13 or more.
///
/// # Errors
/// The sizes of the arrays do not match, or there are fewer than two pixels along `axis`. Values or penalties are not
/// finite, or a penalty is negative.
pub fn cut(pasted: &Pasted<'_>, monitor: &Monitor) -> Result<Stitched> {
    let pixels = pasted.shape[0].saturating_mul(pasted.shape[1]);
    memory::room("the costs of the seam", pixels, 64)?;
    let costs = match pasted.channels {
        1 => weigh::<1>(pasted),
        3 => weigh::<3>(pasted),
        _ => weigh::<0>(pasted),
    }?;
    let [rows, columns] = pasted.shape;
    // The solver separates the first column from the last column, so transpose images that are arranged along axis 0.
    let (shape, across, along) = match pasted.axis {
        1 => ([rows, columns], Cow::from(&costs[1]), Cow::from(&costs[0])),
        _ => {
            let [across, along] = costs.each_ref().map(|c| transposed(c, pasted.shape));
            ([columns, rows], Cow::from(across), Cow::from(along))
        }
    };
    let longest = longest(shape[1], &across, &along, f64::from);
    if !longest.is_finite() {
        return Err(Error::value(
            "penalty",
            "must be smaller, because the cost of the seam is infinite",
        ));
    }
    let mut scale = 65536.0;
    while longest * scale >= (LONGEST / 2) as f64 {
        scale *= 0.5;
    }
    // No single cost exceeds the largest sum along a line, so each rounded cost fits `i32`.
    let rounded = |costs: &[f32]| -> Vec<u32> {
        let round = |&c: &f32| (f64::from(c) * scale + 0.5) as i32 as u32;
        costs.iter().map(round).collect()
    };
    let strip = Strip {
        rows: shape[0],
        columns: shape[1],
        cyclic: pasted.cyclic,
        across: &rounded(&across),
        along: &rounded(&along),
    };
    let far = least_seam(&strip, monitor)?.far;
    let b = match pasted.axis {
        1 => far,
        _ => transposed(&far, shape),
    };
    // Sum the costs of the cut edges, skipping runs without cut edges.
    let (mut value, mut edges) = (0.0, 0);
    let grid = grid(pasted)?;
    for (axis, costs) in costs.iter().enumerate() {
        runs(&grid, axis, |s, t, len| {
            let ends = b[s..][..len]
                .chunks(SIMILAR)
                .zip(b[t..][..len].chunks(SIMILAR));
            for (i, (here, there)) in ends.enumerate().filter(|(_, (here, there))| here != there) {
                let costs = &costs[s + i * SIMILAR..];
                for ((here, there), &cost) in here.iter().zip(there).zip(costs) {
                    if here != there {
                        value += f64::from(cost);
                        edges += 1;
                    }
                }
            }
        });
    }
    Ok(Stitched { b, value, edges })
}

/// Returns the transposed array.
fn transposed<T: Copy + Default>(values: &[T], [rows, columns]: [usize; 2]) -> Vec<T> {
    /// Number of rows that are read together, so that they stay in the cache.
    const BAND: usize = 16;
    let mut out = vec![T::default(); values.len()];
    for top in (0..rows).step_by(BAND) {
        let bottom = rows.min(top + BAND);
        for (c, out) in out.chunks_exact_mut(rows).enumerate() {
            for (r, out) in (top..bottom).zip(&mut out[top..bottom]) {
                *out = values[r * columns + c];
            }
        }
    }
    out
}

fn grid(pasted: &Pasted<'_>) -> Result<Grid<2>> {
    Grid::new(
        pasted.shape,
        std::array::from_fn(|axis| pasted.cyclic && axis != pasted.axis),
    )
}

/// Calls `f(p, q, n)` for runs of `n` points. A run starts at `p`, and the next points along an
/// axis start at `q`.
fn runs(grid: &Grid<2>, axis: usize, mut f: impl FnMut(usize, usize, usize)) {
    let [rows, columns] = grid.shape();
    let closes = grid.wrap()[axis];
    if axis == 0 {
        let inner = (rows - 1) * columns;
        f(0, columns, inner);
        if closes && rows > 1 {
            f(inner, 0, columns);
        }
        return;
    }
    for start in (0..grid.len()).step_by(columns) {
        let last = start + columns - 1;
        f(start, start + 1, columns - 1);
        if closes && columns > 1 {
            f(last, start, 1);
        }
    }
}

/// Returns the costs of the edges along each axis.
fn weigh<const C: usize>(pasted: &Pasted<'_>) -> Result<[Vec<f32>; 2]> {
    let grid = grid(pasted)?;
    let n = grid.len();
    if pasted.axis > 1 {
        return Err(Error::value(
            "axis",
            format!("must be 0 or 1, got {}", pasted.axis),
        ));
    }
    if pasted.shape[pasted.axis] < 2 {
        return Err(Error::value(
            "a, b",
            format!(
                "must have at least 2 pixels along axis {1}, got shape {0:?}",
                pasted.shape, pasted.axis
            ),
        ));
    }
    let samples = n.saturating_mul(pasted.channels);
    check_shape("a", &[samples], pasted.a.len())?;
    check_shape("b", &[samples], pasted.b.len())?;
    if let Some(penalty) = pasted.penalty {
        check_shape("penalty", &[n], penalty.len())?;
        check_costs("penalty", penalty)?;
    }
    let pair = Pair::<C> {
        a: pasted.a,
        b: pasted.b,
        channels: pasted.channels,
    };
    // Without channels, all differences are zero.
    let differences = match pasted.channels {
        0 => vec![0.0; n],
        _ => pair.differences(),
    };
    // Test all differences before looking for the position of a bad one, so that the loop vectorises.
    let far = |d: &f32| !(0.0..=FARTHEST).contains(d);
    if differences.iter().fold(false, |any, d| any | far(d)) {
        let at = differences.iter().position(far).unwrap_or(0);
        return Err(Error::value(
            "a, b",
            format!(
                "must be finite and not too far apart, which fails at {:?}",
                grid.point(at)
            ),
        ));
    }
    let mut costs = [vec![0.0; n], vec![0.0; n]];
    for (axis, costs) in costs.iter_mut().enumerate() {
        runs(&grid, axis, |s, t, len| {
            let costs = &mut costs[s..][..len];
            pair.edges(pasted.cost, s, t, &differences, costs);
            if let Some(penalty) = pasted.penalty {
                for (k, cost) in costs.iter_mut().enumerate() {
                    *cost *= 1.0 + 0.5 * (penalty[s + k] + penalty[t + k]);
                }
            }
        });
    }
    Ok(costs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernels::seam::cost::EXTREMES;
    use crate::kernels::seam::stitch::{Overlap, cut as cut_any};
    use proptest::prelude::*;

    proptest! {
        /// The general cut with the borders as cores must find a seam of the same cost.
        #[test]
        fn equals_the_general_cut(
            shape in prop::array::uniform2(2usize..9),
            axis in 0usize..2,
            cyclic in any::<bool>(),
            values in prop::collection::vec(0.0f32..1.0, 5 * 64),
            gradient in any::<bool>(),
        ) {
            let n = shape[0] * shape[1];
            let (a, b, penalty) = (&values[..2 * n], &values[128..128 + 2 * n], &values[256..256 + n]);
            let cost = if gradient { Cost::Gradient } else { Cost::Difference };
            let pasted = Pasted { shape, channels: 2, a, b, axis, cyclic, penalty: Some(penalty), cost };
            let found = cut(&pasted, &Monitor::default()).unwrap();
            let coordinate = |p: usize| if axis == 0 { p / shape[1] } else { p % shape[1] };
            let core_a: Vec<bool> = (0..n).map(|p| coordinate(p) == 0).collect();
            let core_b: Vec<bool> = (0..n).map(|p| coordinate(p) == shape[axis] - 1).collect();
            let all = vec![true; n];
            let overlap = Overlap {
                core_a: Some(&core_a),
                core_b: Some(&core_b),
                penalty: Some(penalty),
                cost,
                ..Overlap::new(grid(&pasted).unwrap(), 2, a, b, &all, &all)
            };
            let general = cut_any(&overlap, &Monitor::default()).unwrap();
            prop_assert!((found.value - general.value).abs() < 1e-3, "{} {}", found.value, general.value);
            for p in 0..n {
                prop_assert!(!(core_a[p] && found.b[p]) && (!core_b[p] || found.b[p]));
            }
        }
    }

    proptest! {
        #[test]
        fn extremes_are_refused_or_cost_something(
            images in prop::collection::vec(prop::sample::select(EXTREMES.to_vec()), 12),
            penalty in prop::collection::vec(prop::sample::select(EXTREMES.to_vec()), 6),
            gradient in any::<bool>(),
        ) {
            let penalty: Vec<f32> = penalty.iter().map(|x| x.abs()).collect();
            let pasted = Pasted {
                shape: [2, 3],
                channels: 1,
                a: &images[..6],
                b: &images[6..],
                axis: 1,
                cyclic: false,
                penalty: Some(&penalty),
                cost: if gradient { Cost::Gradient } else { Cost::Difference },
            };
            if let Ok(found) = cut(&pasted, &Monitor::default()) {
                prop_assert!(found.value.is_finite() && found.value > 0.0);
            }
        }
    }

    #[test]
    fn refuses_what_cannot_be_cut() {
        let pasted = Pasted {
            shape: [3, 1],
            channels: 1,
            a: &[0.0; 3],
            b: &[0.0; 3],
            axis: 1,
            cyclic: false,
            penalty: None,
            cost: Cost::Gradient,
        };
        let cut = |p: Pasted<'_>| cut(&p, &Monitor::default());
        // Too few pixels, an unknown axis, NaN values and a negative penalty are errors.
        assert!(cut(pasted).is_err());
        assert!(cut(Pasted { axis: 2, ..pasted }).is_err());
        assert!(
            cut(Pasted {
                axis: 0,
                a: &[f32::NAN; 3],
                ..pasted
            })
            .is_err()
        );
        assert!(
            cut(Pasted {
                axis: 0,
                penalty: Some(&[-1.0; 3]),
                ..pasted
            })
            .is_err()
        );
        assert_eq!(cut(Pasted { axis: 0, ..pasted }).unwrap().edges, 1);
        // Images without channels can be cut.
        let bare = Pasted {
            axis: 0,
            channels: 0,
            a: &[],
            b: &[],
            ..pasted
        };
        assert_eq!(cut(bare).unwrap().edges, 1);
    }
}
