"""Holes filled and the ground made whole again: section 4.3 of `texrs.papers.splice`.

The warp leaves holes, and stretches what is not rigid. Both are mended in coordinates: each pixel names the pixel of
the texture that it shows, and those that may change take what fits their neighbours (k-coherence, at two resolutions).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_image, guidance
from texrs._engine.appearance import Corrected
from texrs._engine.coherence import correct, jitter
from texrs._engine.pyramid import ONE, Region, to_fixed
from texrs._progress import stage
from texrs._typing import Bools, Floats, Progress
from texrs.exemplar import Exemplar
from texrs.exemplar.analysis import COARSEST
from texrs.exemplar.patches import mark_corners
from texrs.growth import from_draft, grow
from texrs.growth.constraints import Asked
from texrs.kernels.inpaint import inpaint
from texrs.kernels.patch_search import PatchIndex

__all__ = ["Draft", "Refinement", "correct_draft", "fill", "fill_with_patches", "refine_places"]

Places = NDArray[np.int32]
Kinds = NDArray[np.uint8]

BITS = ONE.bit_length() - 1
"""Of places, after the point."""
JITTER = 1.0
"""Samples of a level that places of what is not rigid are displaced by before they are corrected."""
PASSES = 2
WIDE = 1.0
"""A hole wider than so many spacings is filled with patches; less is grown over from its boundary."""
PATCH, LEAST = 0.33, 6
"""Of the spacing: the side of those patches; and the least side in pixels of one whose roughness says anything."""
STROKE, ROUGH, MOST = 2.5, 0.95, 1.1
"""How many times the usual gradient is an edge, and no roughness; how rough a patch must be, in that of the ground; how much of
roughness and edges together it may show."""
CHOICE, FEWEST, PLENTY = 100, 32, 4000
"""Patches to choose from, of those as rough as the ground; and of any; and how many are enough: of a plain ground all fit."""
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
    """Fill the holes: wide ones with patches of the ground alone, the others with what goes on from their boundary."""
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
        filled = fill_with_patches(image, draft, ground, scale, seed, progress)
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


def fill_with_patches(
    image: NDArray[np.generic],
    draft: Draft,
    ground: Bools,
    scale: float,
    seed: int,
    progress: Progress | None,
    *,
    hidden: Bools | None = None,
) -> Draft | None:
    """Return the draft with its holes filled by patches of the ground alone; none where it has no place for a patch.

    What is ``hidden`` will not be seen, and is not filled.
    """
    guide = guidance(as_image(image))
    found = find_patches(guide, ground, scale)
    if found is None:
        return None
    side, allowed = found
    known, colours = draft.known, guide[draft.places[..., 0], draft.places[..., 1]]
    if hidden is not None:
        # As the ground is on the whole: no patch fits better or worse for it.
        known, colours[hidden] = known | hidden, guide[ground].mean(axis=0)
        if known.all():
            return replace(draft, known=known)
    filled = inpaint(
        colours,
        known,
        PatchIndex([guide], allowed=[allowed], max_patch=side),
        patch_size=min(side, *known.shape),
        keep=known,
        seed=seed,
        progress=stage(progress, "fill"),
    )
    places, new = draft.places.copy(), ~known
    places[new] = np.rint(filled.coordinates[new]).astype(np.int32)
    return replace(draft, places=places, known=np.ones_like(new), mirrored=draft.mirrored & draft.known[..., None])


def find_patches(guide: Floats, ground: Bools, scale: float) -> tuple[int, Bools] | None:
    """Return the side of patches of a ground, and the corners of those that may be copied.

    Of noise the smoothest patches fit best, so that what is filled with any looks blurred. Taken are those that are as rough as
    the ground is, and show no more of what lies about in it; any, where these are too few.
    """
    steep = np.sqrt(sum((np.gradient(guide, axis=axis) ** 2).sum(axis=-1) for axis in range(2)))
    inner = mark_corners(ground, 3)
    shown = steep[1:-1, 1:-1][inner[:-2, :-2]] if inner.any() else steep[ground]
    rough = np.minimum(steep, STROKE * float(np.median(shown)) if shown.size else 0.0)
    usual = (float(np.minimum(shown, rough.max()).mean()), float(shown.mean())) if shown.size else (0.0, 0.0)
    first = int(np.clip(PATCH * scale, LEAST, 24))
    for side in range(first, LEAST - 1, -1):
        noise, all_of_it = (average_windows(of, side) for of in (rough, steep))
        fits = mark_corners(ground, side) & (noise >= ROUGH * usual[0] - 1e-5) & (all_of_it <= MOST * usual[1] + 1e-5)
        if np.count_nonzero(fits) >= CHOICE:
            return side, thin_out(fits)
    for side in range(first, 3, -1):
        allowed = mark_corners(ground, side)
        if np.count_nonzero(allowed) >= FEWEST:
            return side, thin_out(allowed)
    return None


def thin_out(places: Bools) -> Bools:
    """Return so many of the places as are enough, evenly."""
    at = np.flatnonzero(places)
    out = np.zeros(places.shape, bool)
    out.flat[at[:: -(-len(at) // PLENTY)]] = True
    return out


def average_windows(values: NDArray[np.floating], side: int) -> NDArray[np.float64]:
    """Return the mean of each window by its first corner; 0 where it does not fit in."""
    total = np.pad(np.asarray(values, np.float64).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    out = np.zeros(values.shape)
    means = (total[side:, side:] - total[:-side, side:] - total[side:, :-side] + total[:-side, :-side]) / side**2
    out[: means.shape[0], : means.shape[1]] = means
    return out


def refine_places(
    image: NDArray[np.generic], wrap: tuple[bool, bool], draft: Draft, seed: int, progress: Progress | None
) -> Places:
    """Return corrected places of what may change: at half the resolution first, then at the full one.

    The engine of `texrs.growth` starts from the draft, and its corrector is `Refinement`.

    Returns
    -------
    (H, W, 2) int32
        Pixels of the texture.

    """
    return correct_draft(Refinement.of(image, wrap, draft, seed), wrap, progress)


def correct_draft(refinement: Refinement, wrap: tuple[bool, bool], progress: Progress | None) -> Places:
    """Return corrected places of what a refinement may change."""
    draft, image = refinement.draft, refinement.exemplar.image
    grown = grow(
        Region.whole(draft.fixed.shape),
        refinement.levels,
        from_draft(0, refinement.begin),
        refinement.correct,
        refinement.frames,
        ask=refinement.at,
        progress=progress,
    )
    # Of whole numbers a shift, which rounds down as well, takes a tenth of the time of a division.
    result = (grown.places.reshape(draft.places.shape) + ONE // 2) >> BITS
    for axis, n in enumerate(image.shape[:2]):
        along = result[..., axis]
        along[...] = along % n if wrap[axis] else along.clip(0, n - 1)
    np.copyto(result, draft.places, where=draft.fixed[..., None])
    return result


@dataclass(frozen=True, slots=True, eq=False)
class Refinement:
    """What the engine does for a draft: pixels that are not rigid are jittered, and choose among similar ones of their kind.

    Attributes
    ----------
    exemplar : Exemplar
        The texture.
    draft : Draft
        The picture.
    seed : int
        Of the jitter.
    coarsest : int
        Least side of the texture at half its resolution.
    levels : int
        Two, or one where the texture is too small to be halved.

    """

    exemplar: Exemplar
    draft: Draft
    seed: int
    coarsest: int
    levels: int

    @classmethod
    def of(cls, image: NDArray[np.generic], wrap: tuple[bool, bool], draft: Draft, seed: int) -> Refinement:
        """Analyse the texture at the resolutions of the refinement."""
        exemplar = Exemplar(image, labels=False, repeat=wrap)
        coarsest = max(COARSEST, min(exemplar.shape) // 2 - 1)
        count = len(exemplar.analyse(coarsest=coarsest).levels)
        return cls(exemplar, draft, seed, coarsest, count)

    def begin(self, region: Region) -> Places:
        """Return the draft at the first level."""
        places = self.draft.places.astype(np.int32, copy=False) << BITS
        if self.levels == 1:
            return places.reshape(-1)
        # The coarse sample that lies between this pixel and the next, at (S + 1/2) / 2 - 1/2.
        return np.ascontiguousarray((places[::2, ::2] - ONE // 2) >> 1).reshape(-1)

    def frames(self, region: Region, spacing: int) -> NDArray[np.int16]:
        """Return the Jacobian of each pixel: 1 or -1 along each axis."""
        mirrored = self.draft.mirrored[::spacing, ::spacing]
        if not mirrored.any():
            return to_fixed(None, region)
        out = np.zeros((region.points, 2, 2), np.int16)
        for axis in range(2):
            out[:, axis, axis] = np.where(mirrored[..., axis].ravel(), -ONE, ONE)
        return out

    def at(self, level: int, region: Region, spacing: int) -> Asked:
        """Return what is rigid; at the first level it has its places already."""
        held = self.draft.fixed[::spacing, ::spacing].ravel()
        return Asked(held=held, given=None if level == 0 else (self.draft.places << BITS).reshape(-1))

    def correct(
        self,
        places: Places,
        level: int,
        region: Region,
        frames: NDArray[np.int16],
        asked: Asked,
        progress: Progress | None,
    ) -> Corrected:
        """One level: jitter what is not rigid, then choose among similar samples of the right kind."""
        here = self.exemplar.analyse(coarsest=self.coarsest).levels[level]
        apart = max(3, 2 * int(APART * min(here.shape)) + 1)
        sets = self.exemplar.similarity(level, coarsest=self.coarsest, k=K, n=apart)
        spacing = 1 << (self.levels - 1 - level)
        kinds, wanted = self.draft.kinds, self.draft.wanted[::spacing, ::spacing]
        still = asked.held | (wanted.ravel() == 1) if asked.held is not None else None
        number = level + 2 - self.levels
        found = correct(
            here,
            sets,
            jitter(places, region, JITTER, seed=self.seed, level=number, held=still),
            region,
            frames,
            passes=PASSES,
            held=asked.held,
            kinds=(kinds if spacing == 1 else _halve_kinds(kinds), wanted),
            progress=stage(progress, f"refine {number + 1} of 2"),
        )
        return Corrected(found, PASSES, 0.0)


def _halve_kinds(kinds: Kinds) -> Kinds:
    """Return the kinds of the coarser texture: ground where all that it is made from is."""
    rows, columns = (n // 2 * 2 for n in kinds.shape)
    four = kinds[:rows, :columns].reshape(rows // 2, 2, columns // 2, 2)
    found: Kinds = four.max(axis=(1, 3))
    return found
