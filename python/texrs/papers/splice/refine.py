"""Fill holes and refine the background: section 4.3 of `texrs.papers.splice`.

The warp leaves holes, and stretches pixels that are not rigid. Both are repaired in the source map. Pixels that may
change get a source pixel that fits the source pixels of their neighbours (k-coherence, at two resolutions).
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
"""Number of fractional bits of a fixed-point position."""
JITTER = 1.0
"""Maximum random displacement of non-rigid pixels before their correction, in samples of a level."""
PASSES = 2
WIDE = 1.0
"""Width of a hole, in spacings, above which it is filled with patches.

Narrower holes are filled by continuing the pixels at their boundary.
"""
PATCH, LEAST = 0.33, 6
"""Side of the patches that fill wide holes, as a share of the spacing, and minimum side in pixels.

Smaller patches have no reliable roughness.
"""
STROKE, ROUGH, MOST = 2.5, 0.95, 1.1
"""Maximum gradient that counts as roughness, in median gradients. A larger gradient counts as an edge.

The second number is the minimum roughness of a patch, relative to the background. The third is the maximum mean
gradient of a patch, edges included, relative to the background.
"""
CHOICE, FEWEST, PLENTY = 100, 32, 4000
"""Number of patches as rough as the background that is sufficient, so that other patches are not used.

The second number is the minimum number of patches of any roughness. The third is the maximum number of patches that
are tried, because all patches of a plain background fit.
"""
K, APART = 3, 0.05
"""Number of samples in a similarity set, and minimum distance between them, as a share of the shorter side."""


@dataclass(frozen=True, slots=True, eq=False)
class Draft:
    """Source pixels of an image before its refinement.

    Attributes
    ----------
    places : (H, W, 2) int32
        Source pixel in the texture of each pixel. Values in the holes are undefined.
    known : (H, W) bool
        False for pixels in the holes.
    fixed : (H, W) bool
        True for rigid pixels, which do not change.
    kinds : (h, w) uint8
        Kind of each texture pixel. A pixel may only be replaced by pixels of the kind that it requests. Background is
        0.
    wanted : (H, W) uint8
        Requested kind of each pixel, or 255 for any kind.
    mirrored : (H, W, 2) bool
        True for each axis along which the texture is mirrored at a pixel.

    """

    places: Places
    known: Bools
    fixed: Bools
    kinds: Kinds
    wanted: Kinds
    mirrored: Bools


def fill(image: NDArray[np.generic], draft: Draft, scale: float, seed: int, progress: Progress | None) -> Draft:
    """Fill wide holes of a draft with patches of background, and other holes by continuing their boundary."""
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
    # Continue the source coordinates of the nearest known pixel over the hole. If the coordinates reach a pixel that
    # is not background, use a random background pixel.
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
    """Return the draft with its holes filled by background patches, or None if no patch fits into the background.

    ``hidden`` pixels will be covered later, and are not filled.
    """
    guide = guidance(as_image(image))
    found = find_patches(guide, ground, scale)
    if found is None:
        return None
    side, allowed = found
    known, colours = draft.known, guide[draft.places[..., 0], draft.places[..., 1]]
    if hidden is not None:
        # Hidden pixels get the mean background colour, so that they do not influence the choice of patches.
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
    """Return the side of background patches in pixels, and True for the first corners of patches that may be copied.

    The smoothest patches of a noisy background fit best, so a filling from all patches looks blurred. Therefore only
    patches as rough as the background, and without more edges, are used. If there are too few of these, all patches
    are used.
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
    """Return an evenly spaced selection of at most `PLENTY` places."""
    at = np.flatnonzero(places)
    out = np.zeros(places.shape, bool)
    out.flat[at[:: -(-len(at) // PLENTY)]] = True
    return out


def average_windows(values: NDArray[np.floating], side: int) -> NDArray[np.float64]:
    """Return the mean of each window, stored at its first corner, or 0 if the window extends beyond the array."""
    total = np.pad(np.asarray(values, np.float64).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    out = np.zeros(values.shape)
    means = (total[side:, side:] - total[:-side, side:] - total[side:, :-side] + total[:-side, :-side]) / side**2
    out[: means.shape[0], : means.shape[1]] = means
    return out


def refine_places(
    image: NDArray[np.generic], wrap: tuple[bool, bool], draft: Draft, seed: int, progress: Progress | None
) -> Places:
    """Return corrected source pixels: first at half the resolution, then at the full one.

    The engine of `texrs.growth` starts from the draft, with `Refinement` as its corrector.

    Returns
    -------
    (H, W, 2) int32
        Source pixel in the texture of each pixel.

    """
    return correct_draft(Refinement.of(image, wrap, draft, seed), wrap, progress)


def correct_draft(refinement: Refinement, wrap: tuple[bool, bool], progress: Progress | None) -> Places:
    """Correct the pixels of a draft that may change, and return the source pixel of each pixel."""
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
    # Shift instead of dividing. Both round down, but a shift of integers takes a tenth of the time.
    result = (grown.places.reshape(draft.places.shape) + ONE // 2) >> BITS
    for axis, n in enumerate(image.shape[:2]):
        along = result[..., axis]
        along[...] = along % n if wrap[axis] else along.clip(0, n - 1)
    np.copyto(result, draft.places, where=draft.fixed[..., None])
    return result


@dataclass(frozen=True, slots=True, eq=False)
class Refinement:
    """Corrector of a draft in the engine of `texrs.growth`.

    Attributes
    ----------
    exemplar : Exemplar
        The texture.
    draft : Draft
        The image before its refinement.
    seed : int
        Seed of the jitter.
    coarsest : int
        Minimum side of the texture at half its resolution, in pixels.
    levels : int
        Number of resolutions: 2, or 1 if the texture is too small to be halved.

    """

    exemplar: Exemplar
    draft: Draft
    seed: int
    coarsest: int
    levels: int

    @classmethod
    def of(cls, image: NDArray[np.generic], wrap: tuple[bool, bool], draft: Draft, seed: int) -> Refinement:
        """Prepare the refinement of a draft: analyse the texture at one or two resolutions."""
        exemplar = Exemplar(image, labels=False, repeat=wrap)
        coarsest = max(COARSEST, min(exemplar.shape) // 2 - 1)
        count = len(exemplar.analyse(coarsest=coarsest).levels)
        return cls(exemplar, draft, seed, coarsest, count)

    def begin(self, region: Region) -> Places:
        """Return the source positions of the draft at the first level."""
        places = self.draft.places.astype(np.int32, copy=False) << BITS
        if self.levels == 1:
            return places.reshape(-1)
        # Convert source coordinates S to the coarse level, whose samples are between two fine samples: (S + 1/2) / 2 -
        # 1/2.
        return np.ascontiguousarray((places[::2, ::2] - ONE // 2) >> 1).reshape(-1)

    def frames(self, region: Region, spacing: int) -> NDArray[np.int16]:
        """Return the Jacobian of each pixel: 1, or -1 along an axis where the texture is mirrored."""
        mirrored = self.draft.mirrored[::spacing, ::spacing]
        if not mirrored.any():
            return to_fixed(None, region)
        out = np.zeros((region.points, 2, 2), np.int16)
        for axis in range(2):
            out[:, axis, axis] = np.where(mirrored[..., axis].ravel(), -ONE, ONE)
        return out

    def at(self, level: int, region: Region, spacing: int) -> Asked:
        """Return the rigid pixels as a constraint. They already have their positions at the first level."""
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
        """Correct one level: displace non-rigid pixels at random, then choose among similar samples of their kind."""
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
    """Return the kinds of the coarser texture: background if all four pixels are background."""
    rows, columns = (n // 2 * 2 for n in kinds.shape)
    four = kinds[:rows, :columns].reshape(rows // 2, 2, columns // 2, 2)
    found: Kinds = four.max(axis=(1, 3))
    return found
