//! Solution with the factor: forward and backward substitution, block by block.

use super::Cholesky;
use super::plan::TILE;
use crate::Result;
use crate::foundation::memory;
use crate::foundation::simd::wide_fn;

/// Replaces all right-hand sides by the solutions at the same time, so that each value of the factor is read once.
pub(super) fn solve<const N: usize>(factor: &Cholesky, sides: [&mut [f64]; N]) -> Result<()> {
    let (plan, what) = (&factor.plan, "the solution");
    let most = plan
        .fronts
        .iter()
        .map(|f| f.own + f.rows.len())
        .max()
        .unwrap_or(0);
    // Bring the right-hand sides into the order of elimination.
    let mut part: [Vec<f64>; N] = std::array::from_fn(|_| Vec::new());
    let mut all: [Vec<f64>; N] = std::array::from_fn(|_| Vec::new());
    for n in 0..N {
        part[n] = memory::filled(what, 0.0, most)?;
        all[n] = memory::filled(what, 0.0, plan.unknown.len())?;
        for (x, &unknown) in all[n].iter_mut().zip(&plan.unknown) {
            *x = sides[n][unknown as usize];
        }
        for (x, &by) in all[n].iter_mut().zip(&factor.alone) {
            *x *= by;
        }
    }
    // Forward substitution.
    for (front, numbers) in factor.parts.iter().flat_map(|part| part.blocks(plan)) {
        let rows = &plan.rows[front.rows.clone()];
        for (part, all) in part.iter_mut().zip(&all) {
            part[..front.own].copy_from_slice(&all[front.start..][..front.own]);
            part[front.own..front.own + rows.len()].fill(0.0);
        }
        forward::<N>(numbers, front.own, front.own + rows.len(), &mut part);
        for (part, all) in part.iter().zip(&mut all) {
            all[front.start..][..front.own].copy_from_slice(&part[..front.own]);
            for (&row, x) in rows.iter().zip(&part[front.own..]) {
                all[row as usize] += x;
            }
        }
    }
    // Backward substitution.
    for (front, numbers) in factor
        .parts
        .iter()
        .rev()
        .flat_map(|part| part.blocks(plan).rev())
    {
        let rows = &plan.rows[front.rows.clone()];
        for (part, all) in part.iter_mut().zip(&all) {
            part[..front.own].copy_from_slice(&all[front.start..][..front.own]);
            for (&row, x) in rows.iter().zip(&mut part[front.own..]) {
                *x = all[row as usize];
            }
        }
        backward::<N>(numbers, front.own, front.own + rows.len(), &mut part);
        for (part, all) in part.iter().zip(&mut all) {
            all[front.start..][..front.own].copy_from_slice(&part[..front.own]);
        }
    }
    // Bring the solutions back into the order of the matrix.
    for (all, side) in all.iter().zip(sides) {
        for (x, &unknown) in all.iter().zip(&plan.unknown) {
            side[unknown as usize] = *x;
        }
    }
    Ok(())
}

/// Splits off `B` columns of a block. The first column has `height` values, and each further column has one value
/// less.
#[inline(always)]
fn split<const B: usize>(numbers: &[f64], height: usize) -> ([&[f64]; B], &[f64]) {
    let mut left = numbers;
    let columns = std::array::from_fn(|j| {
        let (own, after) = left.split_at(height - j);
        left = after;
        own
    });
    (columns, left)
}

/// Forward substitution: solves for `B` unknowns, and subtracts their contribution from the unknowns after them.
/// Returns the remaining values of the block.
#[inline(always)]
fn forward_columns<'a, const N: usize, const B: usize>(
    numbers: &'a [f64],
    x: &mut [Vec<f64>; N],
    at: usize,
    height: usize,
) -> &'a [f64] {
    let (columns, left) = split::<B>(numbers, height - at);
    let rest = height - at - B;
    let mut own = [[0.0; B]; N];
    for (own, x) in own.iter_mut().zip(x.iter_mut()) {
        for j in 0..B {
            let mut sum = x[at + j];
            for before in 0..j {
                sum -= columns[before][j - before] * own[before];
            }
            own[j] = sum * columns[j][0];
            x[at + j] = own[j];
        }
    }
    let of: [&[f64]; B] = std::array::from_fn(|j| &columns[j][B - j..][..rest]);
    for (own, x) in own.iter().zip(x) {
        for (i, x) in x[at + B..][..rest].iter_mut().enumerate() {
            let mut sum = *x;
            for j in 0..B {
                sum -= of[j][i] * own[j];
            }
            *x = sum;
        }
    }
    left
}

/// Backward substitution: solves for `B` unknowns, given the unknowns after them.
#[inline(always)]
fn backward_columns<const N: usize, const B: usize>(
    numbers: &[f64],
    x: &mut [Vec<f64>; N],
    at: usize,
    height: usize,
) {
    const LANES: usize = 8;
    let (columns, _) = split::<B>(numbers, height - at);
    let rest = height - at - B;
    let of: [&[f64]; B] = std::array::from_fn(|j| &columns[j][B - j..][..rest]);
    for x in x {
        let (own, after) = x[at..height].split_at_mut(B);
        // Sum every eighth row separately, and combine the eight sums in a fixed order.
        let mut sums = [[0.0; LANES]; B];
        let whole = rest - rest % LANES;
        for i in (0..whole).step_by(LANES) {
            let Some(from) = after[i..].first_chunk::<LANES>() else {
                return;
            };
            for j in 0..B {
                let Some(by) = of[j][i..].first_chunk::<LANES>() else {
                    return;
                };
                for lane in 0..LANES {
                    sums[j][lane] += by[lane] * from[lane];
                }
            }
        }
        let mut total = [0.0; B];
        for j in 0..B {
            let mut four = [0.0; LANES / 2];
            for lane in 0..LANES / 2 {
                four[lane] = sums[j][lane] + sums[j][lane + LANES / 2];
            }
            total[j] = (four[0] + four[2]) + (four[1] + four[3]);
            for (by, from) in of[j][whole..].iter().zip(&after[whole..]) {
                total[j] += by * from;
            }
        }
        for j in (0..B).rev() {
            let mut sum = own[j] - total[j];
            for later in j + 1..B {
                sum -= columns[j][later - j] * own[later];
            }
            own[j] = sum * columns[j][0];
        }
    }
}

wide_fn! {
    /// Forward substitution for the `own` unknowns of a block with `height` rows. Subtracts their contribution from
    /// the further rows.
    fn forward<const N: usize>(
        numbers: &[f64],
        own: usize,
        height: usize,
        x: &mut [Vec<f64>; N],
    ) {
        let mut left = numbers;
        let mut at = 0;
        while at + TILE <= own {
            left = forward_columns::<N, TILE>(left, x, at, height);
            at += TILE;
        }
        while at < own {
            left = forward_columns::<N, 1>(left, x, at, height);
            at += 1;
        }
    }
}

wide_fn! {
    /// Backward substitution for the `own` unknowns of a block with `height` rows, given the further rows.
    fn backward<const N: usize>(
        numbers: &[f64],
        own: usize,
        height: usize,
        x: &mut [Vec<f64>; N],
    ) {
        let mut at = own;
        let mut end = numbers.len();
        while !at.is_multiple_of(TILE) {
            at -= 1;
            end -= height - at;
            backward_columns::<N, 1>(&numbers[end..], x, at, height);
        }
        while at > 0 {
            at -= TILE;
            end -= (0..TILE).map(|j| height - at - j).sum::<usize>();
            backward_columns::<N, TILE>(&numbers[end..], x, at, height);
        }
    }
}
