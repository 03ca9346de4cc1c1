"""Holes filled and the ground made whole again: section 4.3 of `texrs.papers.splice`.

The warp leaves holes, and stretches what is not rigid. Both are mended in coordinates: each pixel names the pixel of
the texture that it shows, and those that may change take what fits their neighbours (k-coherence, at two resolutions).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, guidance
from texrs._engine.coherence import correct, jitter
from texrs._engine.pyramid import ONE, Region, upsample
from texrs._progress import stage
from texrs._typing import Bools, Progress
from texrs.exemplar.patches import mark_corners
from texrs.exemplar.analysis import COARSEST, Analysis, analyse, similarity
from texrs.kernels.complete import complete
from texrs.kernels.patch_search import PatchIndex

__all__ = ["Draft", "fill", "refined_places"]

Places = NDArray[np.int32]
Kinds = NDArray[np.uint8]

BITS = ONE.bit_length() - 1
"""Of places, after the point."""
JITTER = 2.0
"""Pixels that places of what is not rigid are displaced by before they are corrected."""
PASSES = 2
WIDE = 1.0
"""A hole wider than so many spacings is filled with patches; less is grown over from its rim."""
K, APART = 3, 0.05
"""Size of a similarity set, and how far apart its samples are, as a share of the shorter side."""


@dataclass(frozen=True, slots=True, eq=False)
class Draft:
    """A picture before its refinement.

    Attributes
    ----------
    places : (H, W, 2) int32
        The pixel of the texture that each one shows; anything in the holes.
    known : (H, W) bool
        False in the holes.
    fixed : (H, W) bool
        What is rigid and stays as it is.
    kinds : (h, w) uint8
        Of the texture's pixels: what may take the place of what. Ground is 0.
    wanted : (H, W) uint8
        The kind that each pixel is to show.
    mirrored : (H, W, 2) bool
        Along which axes the texture is mirrored there.

    """

    places: Places
    known: Bools
    fixed: Bools
    kinds: Kinds
    wanted: Kinds
    mirrored: Bools


def fill(image: NDArray[np.generic], draft: Draft, scale: float, seed: int, progress: Progress | None) -> Draft:
    """Fill the holes: wide ones with patches of the ground alone, the others with what goes on from their rim."""
    from scipy.ndimage import distance_transform_edt

    holes = ~draft.known
    if not holes.any():
        return draft
    places = draft.places.copy()
    if holes.all():
        ground = np.argwhere(draft.kinds == 0)
        places[...] = ground[np.random.default_rng(seed).integers(len(ground), size=holes.shape)]
        return replace(draft, places=places, known=holes, mirrored=np.zeros_like(draft.mirrored))
    depth, near = distance_transform_edt(holes, return_indices=True)
    ground = draft.kinds == 0
    if float(depth.max()) > 0.5 * WIDE * scale:
        filled = _patches(image, draft, ground, scale, seed, progress)
        if filled is not None:
            return filled
    # From the nearest pixel that is known, as if the ground went on: where that is no ground, some ground at random.
    at = np.argwhere(holes)
    start = near[:, holes].T
    there = places[start[:, 0], start[:, 1]] + (at - start)
    limits = np.array(ground.shape)
    inside = ((there >= 0) & (there < limits)).all(axis=1)
    sound = np.zeros(len(at), bool)
    sound[inside] = ground[there[inside, 0], there[inside, 1]]
    choices = np.flatnonzero(ground)
    if len(choices) and not sound.all():
        drawn = choices[np.random.default_rng(seed).integers(len(choices), size=np.count_nonzero(~sound))]
        there[~sound] = np.stack(np.divmod(drawn, ground.shape[1]), axis=-1)
    places[holes] = np.clip(there, 0, limits - 1)
    return replace(draft, places=places, known=np.ones_like(holes), mirrored=draft.mirrored & ~holes[..., None])


def _patches(
    image: NDArray[np.generic], draft: Draft, ground: Bools, scale: float, seed: int, progress: Progress | None
) -> Draft | None:
    """Fill the holes with patches of the ground alone, or give nothing where it has no place for a patch."""
    guide = guidance(as_image(image))
    for side in range(int(np.clip(scale / 2, 6, 24)), 3, -1):
        allowed = mark_corners(ground, side)
        if np.count_nonzero(allowed) >= 32:
            break
    else:
        return None
    colours = guide[draft.places[..., 0], draft.places[..., 1]]
    index = PatchIndex([guide], allowed=[allowed], max_patch=side)
    found = complete(
        colours,
        draft.known,
        index,
        patch=min(side, *draft.known.shape),
        keep=draft.known,
        seed=seed,
        progress=stage(progress, "fill"),
    )
    places = draft.places.copy()
    new = ~draft.known
    places[new] = np.rint(found.coordinates[new]).astype(np.int32)
    return replace(draft, places=places, known=np.ones_like(new), mirrored=draft.mirrored & draft.known[..., None])


def analysed(image: NDArray[np.generic], wrap: tuple[bool, bool]) -> Analysis:
    """Analyse the texture at the two resolutions of the refinement."""
    least = max(COARSEST, min(image.shape[:2]) // 2 - 1)
    return analyse(image, axes=2, wrap=wrap, labels=False, coarsest=least)


def refined_places(
    image: NDArray[np.generic],
    wrap: tuple[bool, bool],
    draft: Draft,
    seed: int,
    progress: Progress | None,
    *,
    reach: float = JITTER,
    passes: int = PASSES,
) -> Places:
    """Correct the places of what may change, first at half the resolution, then at the full one.

    Returns
    -------
    (H, W, 2) int32
        Pixels of the texture.

    """
    analysis = analysed(image, wrap)
    levels = analysis.levels[-2:]
    size = draft.fixed.shape
    fine = Region.whole(size)
    places = draft.places.astype(np.int32, copy=False) << BITS
    if len(levels) == 2:
        coarse = fine.parents()
        pick = tuple(slice(None, None, 2) for _ in size)
        # The coarse sample that lies between this pixel and the next, at (S + 1/2) / 2 - 1/2.
        half = (places[pick] - ONE // 2) >> 1
        kinds = _halved(draft.kinds)
        half = _corrected(analysis, 0, half, coarse, sampled(draft, pick, kinds), reach / 2, passes, seed, progress)
        grown = upsample(half.reshape(-1), coarse, fine, frames(draft.mirrored)).reshape(*size, 2)
        places = np.where(draft.fixed[..., None], places, grown)
    found = _corrected(analysis, 1, places, fine, draft, reach / 2, passes, seed, progress)
    # Of whole numbers a shift, which rounds down as well, takes a tenth of the time of a division.
    result = (found + ONE // 2) >> BITS
    for axis, n in enumerate(image.shape[:2]):
        along = result[..., axis]
        along[...] = along % n if wrap[axis] else along.clip(0, n - 1)
    np.copyto(result, draft.places, where=draft.fixed[..., None])
    return result


def _halved(kinds: Kinds) -> Kinds:
    """Return the kinds of the coarser texture: ground where all that it is made from is."""
    rows, columns = (n // 2 * 2 for n in kinds.shape)
    four = kinds[:rows, :columns].reshape(rows // 2, 2, columns // 2, 2)
    found: Kinds = four.max(axis=(1, 3))
    return found


def sampled(draft: Draft, pick: tuple[slice, ...], kinds: Kinds) -> Draft:
    """Return what is asked of every other pixel."""
    return Draft(
        draft.places[pick], draft.known[pick], draft.fixed[pick], kinds, draft.wanted[pick], draft.mirrored[pick]
    )


def frames(mirrored: Bools) -> NDArray[np.int16]:
    """Return the Jacobian of each pixel: 1 or -1 along each axis."""
    if not mirrored.any():
        return np.asarray(np.eye(2)[None] * ONE, np.int16)
    out = np.zeros((mirrored.shape[0] * mirrored.shape[1], 2, 2), np.int16)
    for axis in range(2):
        out[:, axis, axis] = np.where(mirrored[..., axis].ravel(), -ONE, ONE)
    return out


def _corrected(
    analysis: Analysis,
    level: int,
    places: Places,
    region: Region,
    draft: Draft,
    reach: float,
    passes: int,
    seed: int,
    progress: Progress | None,
) -> Places:
    """One level: jitter what is not rigid, then choose among similar samples of the right kind."""
    number = len(analysis.levels) - 2 + level if len(analysis.levels) > 1 else 0
    here = analysis.levels[number]
    apart = 2 * int(APART * min(here.shape)) + 1
    sets = similarity(analysis, number, k=K, n=max(3, apart))
    still = draft.fixed | (draft.wanted == 1)
    flat = np.ascontiguousarray(places).reshape(-1)
    found = correct(
        here,
        sets,
        jitter(flat, region, reach, seed=seed, level=level, held=still),
        region,
        frames(draft.mirrored),
        passes=passes,
        held=draft.fixed.ravel(),
        kinds=(draft.kinds, draft.wanted),
        progress=stage(progress, f"refine {level + 1} of 2"),
    )
    return found.reshape(*region.shape, 2)
