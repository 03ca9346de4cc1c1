"""Growth from a sheet: patches of the sizes that a map asks for, stitched along minimum cuts, around what is held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import log_single
from texrs._engine.appearance import Demand
from texrs._engine.pyramid import ONE, Region
from texrs._engine.stitcher import Stitched, Weights
from texrs._progress import answering, stage
from texrs._typing import Floats, Progress
from texrs.exemplar.sheet import Sheet, code

__all__ = ["FromSheet", "stitch_sheet"]

LEAST, MOST = 8.0, 160.0
"""Side of a patch, in samples of the sheet."""
FITS = 0.7
"""Of a sheet's shorter side: a patch must have somewhere to lie."""
OVERLAP = 0.33
"""Share of a patch by which neighbours overlap."""
CANDIDATES = 4
"""Places that are tried for each patch, of which the best stays."""
COLOUR, SURPRISE = 0.4, 0.5
"""Weights of seams: edges meet edges of the same size only here and there, so colours count more than where all is one size."""
UNIT = 512
"""Weight of a demand, in 1/256 of the square of a unit of its logarithms, at which a factor of e costs as much as windows that
have nothing to do with each other."""


@dataclass(frozen=True, slots=True, eq=False)
class FromSheet:
    """What has been stitched from a sheet.

    Attributes
    ----------
    coordinates : (rows, columns, 2) float32
        Where in the exemplar each pixel looks.
    patches : (rows, columns) uint32
        The patch that each shows; one beyond the last for what was given.
    frames : (rows, columns, 2, 2) float32
        How the exemplar is seen there: dS/dp.
    error : float
        Median of how far the logarithms of the scales are from the target's.
    side : float
        Of the patches, in samples of the sheet.
    stitched : Stitched
        What the stitcher says of it.

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
    """Stitch an output whose elements are as large as a map says.

    Parameters
    ----------
    sheet : Sheet
        What patches are cut from.
    region : Region
        What to fill, of the size of the target.
    target : (rows, columns) float32
        The scales that are wanted.
    strength : float
        How much scales count; 1 is the usual amount.
    side : float, optional
        Of a patch, in samples of the sheet; None goes by how much there is.
    seed : int
        Chooses the texture.
    held : (rows, columns) bool, optional
        Pixels that keep their places.
    given : (rows, columns, 2) int32, optional
        The places of those in the sheet, in fixed point.
    loose : (rows, columns) bool, optional
        Which of those patches may take all the same, where seams show less then.
    frames : (N, 2, 2) int16, optional
        How the sheet is to be seen, in all or at each pixel, in fixed point; None goes by the target.
    progress : callable, optional
        Called with the stage and the share of it that is done.

    Returns
    -------
    FromSheet

    """
    with answering(progress, "sheet", 0.0):
        stitcher, elements = sheet.stitcher
    wanted = sheet.side(target) if side is None else side
    patch = float(max(min(wanted, FITS * min(sheet.free.shape), MOST), LEAST))
    frames = sheet.frames(target, region.wrap) if frames is None else frames
    weight = np.array([round(UNIT * sheet.weight)], np.uint16)
    made = stitcher.stitch(
        region,
        frames,
        patch=patch,
        overlap=OVERLAP,
        candidates=CANDIDATES,
        bend=len(frames) > 1,
        heal=sheet.heal,
        weights=Weights(colour=COLOUR, surprise=1.0 if elements is None else SURPRISE, guide=sheet.guide),
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
    # In double precision and in one order, for matrix products differ in the last bit from processor to processor.
    jacobians = np.einsum("...ij,...jk->...ik", seen, frames / np.float64(ONE), dtype=np.float64).astype(np.float32)
    return FromSheet(
        coordinates.reshape(places.shape),
        np.minimum(made.patches, np.uint32(len(made.frames))).reshape(region.shape),
        jacobians.reshape(*region.shape, 2, 2),
        sheet.measure_error(places, target, frames),
        patch,
        made,
    )
