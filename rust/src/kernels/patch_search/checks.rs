//! Checks of exemplars, patch sizes and the options of a search.

use super::{Exemplar, Pick};
use crate::foundation::error::check_shape;
use crate::{Error, Result};

/// Exclusive limit of the number of positions of an exemplar, because a candidate has 32-bit coordinates.
const LONGEST: usize = u32::MAX as usize;

pub(super) fn check_exemplar(exemplar: &Exemplar, channels: usize) -> Result<()> {
    let [rows, columns] = exemplar.shape;
    check_shape("exemplars", &[rows, columns, channels], exemplar.data.len())?;
    if exemplar.data.is_empty() || exemplar.data.len() / channels >= LONGEST {
        let message = format!(
            "must have at least 1 and fewer than {LONGEST} positions, got {rows} x {columns}"
        );
        return Err(Error::value("exemplars", message));
    }
    // Check block by block, without branches inside a block, so that the loop vectorises.
    let sound = |block: &[f32]| block.iter().fold(true, |all, x| all & x.is_finite());
    let block = exemplar.data.chunks(4096).find(|block| !sound(block));
    if let Some(bad) = block.and_then(|block| block.iter().find(|x| !x.is_finite())) {
        return Err(Error::value(
            "exemplars",
            format!("samples must be finite, got {bad}"),
        ));
    }
    match &exemplar.allowed {
        Some(allowed) => check_shape("allowed", &exemplar.shape, allowed.len()),
        None => Ok(()),
    }
}

pub(super) fn check_side(max_patch: [usize; 2]) -> Result<()> {
    if max_patch.contains(&0) {
        let message = format!("must be at least 1 on each side, got {max_patch:?}");
        return Err(Error::value("max_patch", message));
    }
    Ok(())
}

pub(super) fn check_pick(pick: &Pick) -> Result<()> {
    if pick.count == 0 {
        return Err(Error::value("count", "must be at least 1, got 0"));
    }
    if pick.ratio.is_nan() || pick.ratio < 1.0 {
        let message = format!("must be at least 1, got {}", pick.ratio);
        return Err(Error::value("ratio", message));
    }
    Ok(())
}
