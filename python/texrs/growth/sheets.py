"""Synthesis from a sheet, an image with copies of several sizes: patches follow a scale map, around fixed points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import log_single
from texrs._engine.appearance import Demand
from texrs._engine.pyramid import ONE, Region
from texrs._engine.stitcher import Stitched
from texrs._progress import answering, stage
from texrs._typing import Floats, Progress
from texrs.exemplar.sheet import Sheet, code
from texrs.growth.start import weights_of

__all__ = ["FromSheet", "stitch_sheet"]

LEAST, MOST = 8.0, 160.0
"""Minimum and maximum side of a patch, in samples of the sheet."""
FITS = 0.7
"""Maximum side of a patch, as a share of the sheet's shorter side, so that a patch has several source positions."""
OVERLAP = 0.33
"""Overlap of neighbouring patches, as a share of the patch side."""
CANDIDATES = 4
"""Number of source positions that are tried for each patch. The best one is used."""
COLOUR = 0.4
"""Weight of colours at seams. Colours have more weight than for a single scale, because edges of equal size rarely meet."""
UNIT = 512
"""Weight of a scale error, in 1/256 of a squared unit of log scale.

An error by a factor of e costs as much as two unrelated windows at this weight.
"""


@dataclass(frozen=True, slots=True, eq=False)
class FromSheet:
    """Result of stitching from a sheet.

    Attributes
    ----------
    coordinates : (rows, columns, 2) float32
        Source coordinates of each pixel in the exemplar.
    patches : (rows, columns) uint32
        Patch of each pixel. Fixed pixels have the number after the last patch.
    frames : (rows, columns, 2, 2) float32
        Jacobian of the source coordinates at each pixel, dS/dp.
    error : float
        Median absolute difference of the log scale from the target.
    side : float
        Side of the patches, in samples of the sheet.
    stitched : Stitched
        Result of the stitcher.

    """

    coordinates: Floats
    patches: NDArray[np.uint32]
    frames: Floats
    error: float
    side: float
    stitched: Stitched


def stitch_sheet(
    sheet: Sheet,
    region: Region,
    target: Floats,
    *,
    strength: float = 1.0,
    side: float | None = None,
    seed: int = 0,
    held: NDArray[np.bool_] | None = None,
    given: NDArray[np.int32] | None = None,
    loose: NDArray[np.bool_] | None = None,
    frames: NDArray[np.int16] | None = None,
    progress: Progress | None = None,
) -> FromSheet:
    """Stitch an output whose elements have the sizes of a scale map.

    Parameters
    ----------
    sheet : Sheet
        Sheet that patches are cut from.
    region : Region
        Region to fill, of the size of the target.
    target : (rows, columns) float32
        Requested scale of each pixel.
    strength : float
        Factor that multiplies the weight of the scales. Default: 1.
    side : float, optional
        Side of a patch, in samples of the sheet. Default: chosen from the sheet's usable area.
    seed : int
        Seed of the random choices.
    held : (rows, columns) bool, optional
        True for pixels whose coordinates are fixed.
    given : (rows, columns, 2) int32, optional
        Coordinates of the fixed pixels in the sheet, in units of 1/4096 of a sample.
    loose : (rows, columns) bool, optional
        True for fixed pixels that patches may still replace if this makes seams less visible.
    frames : (N, 2, 2) int16, optional
        Jacobians of the sheet, one for all pixels or one per pixel, in units of 1/4096. Default: derived from the
        target.
    progress : callable, optional
        Function called with the stage and its completed share.

    Returns
    -------
    FromSheet

    """
    with answering(progress, "sheet", 0.0):
        stitcher, _ = sheet.stitcher
    wanted = sheet.side(target) if side is None else side
    patch = float(max(min(wanted, FITS * min(sheet.free.shape), MOST), LEAST))
    frames = sheet.frames(target, region.wrap) if frames is None else frames
    weight = np.array([round(UNIT * sheet.weight)], np.uint16)
    # Request the scales as a guide, so that they are weighed against the visibility of seams.
    made = stitcher.stitch(
        region,
        frames,
        patch=patch,
        overlap=OVERLAP,
        candidates=CANDIDATES,
        bend=len(frames) > 1,
        heal=sheet.heal,
        weights=replace(weights_of(stitcher), colour=COLOUR, guide=sheet.guide),
        seed=seed,
        held=held,
        given=None if given is None else given.reshape(-1),
        loose=loose,
        demand=Demand(
            sheet.values(strength), code(log_single(target), strength).reshape(-1), weight, excess=sheet.excess
        ),
        progress=stage(progress, "patches"),
    )
    places = made.places.reshape(*region.shape, 2)
    coordinates, seen = sheet.locate(places.reshape(-1, 2))
    # Sum in double precision and in a fixed order, because matrix products differ in the last bit between processors.
    jacobians = np.einsum("...ij,...jk->...ik", seen, frames / np.float64(ONE), dtype=np.float64).astype(np.float32)
    return FromSheet(
        coordinates.reshape(places.shape),
        np.minimum(made.patches, np.uint32(len(made.frames))).reshape(region.shape),
        jacobians.reshape(*region.shape, 2, 2),
        sheet.measure_error(places, target, frames),
        patch,
        made,
    )
