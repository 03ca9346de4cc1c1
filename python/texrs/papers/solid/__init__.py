"""SOLID: synthesis of images and volumes that follow a frame field (`texrs.synthesize` and `texrs.solid`).

Y.-L. Su, C.-C. Chang, Z.-C. Shih and W.-K. Tai, "Vector-field-based deformations for three-dimensional texture
synthesis". The paper's appearance vectors, similarity sets and pyramid of corrections follow Lefebvre and Hoppe,
SIGGRAPH 2005 and 2006. The steps are:

1. Analyse the exemplar: find its separate elements, and which colours are adjacent (`texrs.Exemplar.stitcher`).
2. Map patches of the exemplar into the output, rotated and scaled by the field at their centres.
3. Cut each patch in along minimum cuts, from the best of several source positions, and repair torn elements
   (`texrs._engine.stitcher`).
4. Look up the exemplar at the resulting coordinates.

With ``quality="fast"`` steps 2 and 3 are the steps of the paper. Coordinates are upsampled from level to level with
the field's Jacobian (Eq. 1 and 2). They are corrected by comparing the windows around each point, which the field
warps (Eq. 3 and 4). The engine of `texrs.growth` does both. Unbounded textures place patches over each other in
shifted tilings (`texrs.papers.solid.layers`), so that a patch depends on few others. With ``quality="fast"`` they are
a chain of corrections (`texrs.papers.solid.world`).

Departures from the paper, with their reasons:

- Patches stitched along minimum cuts replace the pyramid of corrections. Correcting single points tears and fuses
  elements that are larger than a window. Example: the particles of `texrs.samples.particles` in a field that rotates
  around an axis. Corrections tore 29 % of them, and patches none (`texrs.volume.integrity`). Textures of cells gain
  more.
- The cost of a cut depends on the two voxels that become neighbours: the old voxel at p and the new one at q. It does
  not depend on the difference of the two textures at both places.
- Patches of separate elements are rotated as a whole. Patches of textures with a direction bend with the field.
- The elements of some images are unreliable, for example in a heap. The elements of `texrs.exemplar.segmentation` are
  then used for the costs of cuts, but are not repaired. This reduces the length of seams inside elements to a quarter.
- More patches, half as many as in the first round, are tried at the most visible seams. They need not fit the existing
  patches, and are used if the seams become less visible.
- Patches of an image are in step with its lattice or single period. This is not done if a field varies, if points are
  given, or if the output is periodic. On 14 pictures the lost regularity falls from 0.079 to 0.050.
- Source positions that were used often have a cost, and so have overrepresented classes of colour. Without these
  costs, rare elements disappear, because cuts are cheapest without them.

Departures from the paper in the corrections (``quality="fast"``):

- Synthesis starts from a lattice of coherent blocks that fit each other, instead of one coordinate with jitter at
  every level. Starting from jitter, sparse particles never form, whatever the correction is.
- The cost of a block is divided by its own contrast. With plain squared differences, blocks of low contrast are
  preferred, and rare elements become rarer.
- The correction changes a point to a random match only if the gain is large. It must be more than twice the median
  distance from a window of the exemplar to the nearest other one. Otherwise repeated corrections remove rare elements.
- A pass corrects every other point, as on a chess board, and only where pieces of the exemplar meet. If all points
  change at once, the two sides of a seam exchange their values and nothing is gained. Votes also solve this, but
  remove a third of the low-frequency features.
- The paper does not compensate windows for the offset of the lattice (o - J step), so rotated textures have the wrong
  scale. Here windows are compensated (``method="paper-compensated"`` adds only this).
- A row vector in Eq. 1 and a column vector in Eq. 3 rotate in opposite directions. Here J is the inverse of the frame
  in both equations.
- The pyramid is decimated, windows are 5^3 at each level, and full colour windows are compared. With the paper's eight
  diagonal neighbours, points separate into lattices that do not exchange anything.
- If the exemplar is found to be periodic, its coordinates are periodic.

``method="paper"`` omits the departures (`texrs.papers.solid.literal`).
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._engine.pyramid import ONE, Region, to_fixed
from texrs._progress import answering, stage
from texrs._typing import Array, Progress
from texrs._verbs import verb
from texrs.exemplar import Exemplar
from texrs.growth import Grown, Windows, grow, keep
from texrs.growth.engine import Places, Show
from texrs.papers.solid.literal import grow_as_printed
from texrs.papers.solid.plans import PLANS, Plan, choose_plan
from texrs.papers.solid.request import GrowthRequest, Solid, Synthesize
from texrs.papers.solid.settings import FAST
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["solid", "synthesize"]


@verb(Solid, "exemplar")
def solid(asked: Solid) -> Synthesis:
    """Synthesise a volume from an example volume. The texture can follow a frame field.

    Parameters
    ----------
    {parameters}

    Returns
    -------
    Synthesis
        The volume in the exemplar's dtype, and its source map with the frames of its patches. The stages are images of
        the middle plane at each level.

        Stages:

        - ``patches``: The patches in their first places, for quality "preserve" and "optimise".
        - ``blocks``: The blocks in their first places, for quality "fast" and for ``method="paper"``.
        - ``level N``: The middle plane after level N, counted from 1.
        - ``before_blending``: The result before the values of given voxels are set.

        Report:

        - ``method``: "default", "paper" or "paper-compensated".
        - ``quality``: "preserve", "fast" or "optimise"; None for ``method="paper"``.
        - ``seed``: The seed.
        - ``field``: The field in words, or None.
        - ``periodic_axes``: For each axis, True if the exemplar is periodic along it.
        - ``interpolation``: Interpolation between samples of the exemplar.
        - ``constrained_points``: Number of constrained points.
        - ``guided``: True if a guide was given.
        - ``elements``: Number of separate elements that were found in the exemplar, or None if they were not searched.
        - ``stitched``: Number of ``patches``, whether they are ``bent`` with the field, mean cost of the ``seams`` per
          point, and number of moves that ``healed`` torn elements. None for quality "fast".
        - ``levels``: One entry per level: its ``shape``, number of ``passes``, and share of points that the last
          passes ``changed``.
        - ``spacing``: (plane, row, column) voxel size, if it was given.
        - ``patches``: Method of stitching; None for quality "fast".
        - ``candidates``: The measures of each method that was tried, or None. They are ``score`` (0 is best),
          ``torn``, ``broken``, ``seam_blur``, ``repetition`` and ``coverage`` of `texrs.metrics.evaluate`.
        - ``in_step``: True if patches were kept in step with the lattice or the single period of an image.

    Raises
    ------
    InvalidInput
        If the exemplar is too small or not finite, or a field has another number of axes or is singular somewhere.
        The error is also raised if constraints or maps have the wrong shape, or an option is out of its range.
    LimitExceeded
        If the work would take more memory than allowed.
    Cancelled
        If the work was stopped.

    See Also
    --------
    synthesize : The same in two dimensions.
    texrs.SolidTexture : Any window of an unbounded volume.

    References
    ----------
    .. [1] Y.-L. Su, C.-C. Chang, Z.-C. Shih and W.-K. Tai, "Vector-field-based deformations for three-dimensional
       texture synthesis".

    Examples
    --------
    >>> import texrs
    >>> from texrs import fields, samples
    >>> stripes = samples.stripes((32, 32, 32)).image
    >>> result = texrs.solid(stripes, 40, field=fields.circular(axis="x"), seed=1)
    >>> result.image.shape, result.image.dtype
    ((40, 40, 40, 3), dtype('uint8'))

    """
    return grow_texture(asked)


@verb(Synthesize, "exemplar")
def synthesize(asked: Synthesize) -> Synthesis:
    """Synthesise an image from an example image. The texture can follow a frame field.

    Parameters
    ----------
    {parameters}

    Returns
    -------
    Synthesis
        The image in the exemplar's dtype, and its source map with the frames of its patches. The stages and the keys
        of the report are as in `solid`, without ``spacing``.

    Raises
    ------
    InvalidInput
        If the exemplar is too small or not finite, or a field has another number of axes or is singular somewhere.
        The error is also raised if constraints or maps have the wrong shape, or an option is out of its range.
    LimitExceeded
        If the work would take more memory than allowed.
    Cancelled
        If the work was stopped.

    See Also
    --------
    solid : The same in three dimensions.
    texrs.PlaneTexture : Any window of an unbounded image.

    References
    ----------
    .. [1] Y.-L. Su, C.-C. Chang, Z.-C. Shih and W.-K. Tai, "Vector-field-based deformations for three-dimensional
       texture synthesis".

    Examples
    --------
    >>> import texrs
    >>> from texrs import fields, samples
    >>> weave = samples.weave((64, 64)).image
    >>> texrs.synthesize(weave, (96, 128), field=fields.zigzag(period=64, axes=2)).image.shape
    (96, 128, 3)

    """
    return grow_texture(asked)


def grow_texture(asked: GrowthRequest) -> Synthesis:
    """Synthesise an image or a volume: compute its source map, and look up the exemplar."""
    said: dict[str, Any] = {"patches": None, "candidates": None, "in_step": False}
    progress = asked.progress
    show = partial(show_places, asked.example.pixels)
    if asked.method is not None:
        grown = grow_as_printed(
            asked.example,
            asked.frames,
            asked.seed,
            asked.region,
            show,
            compensated=asked.method == "paper-compensated",
            progress=progress,
        )
    elif asked.quality == "fast":
        with answering(progress, "exemplar", 0.0):
            windows = analyse(asked)
        grown = windows.grow(asked.region, ask=asked.conditions.at, show=show, progress=progress)
    else:
        grown, said = stitch(asked, show, progress)
    source = as_source(asked, grown).with_finish(asked.region.wrap, interpolation=asked.sampling)
    composite = source.render(asked.example.image, interpolation=asked.sampling)
    last = {} if grown.patches else {f"level {len(grown.levels)}": show(grown.places, asked.region, 1)}
    stages = {**grown.stages, **last, "before_blending": composite}
    return Synthesis(asked.conditions.show(composite), source, stages, describe(asked, grown) | said)


def stitch(asked: GrowthRequest, show: Show, progress: Progress | None) -> tuple[Grown, dict[str, Any]]:
    """Stitch patches along minimum cuts, at full resolution. Return the result, and report keys of the method."""
    name, tried = choose_plan(asked.example, asked.plan, asked.quality, partial(try_plan, asked, progress))
    lattice = find_steps(asked)
    start = PLANS[name].start(asked.example, asked.seed, asked.quality, asked.bend_patches, lattice)
    frames = partial(to_fixed, asked.frames)
    grown = grow(asked.region, 1, start, keep, frames, ask=asked.conditions.at, show=show, progress=progress)
    return grown, {"patches": name, "candidates": tried, "in_step": lattice is not None}


def try_plan(asked: GrowthRequest, progress: Progress | None, plan: Plan, seed: int) -> SourceMap:
    """Synthesise an image of the exemplar's size by one method, without a field or constraints."""
    stage(progress, "try")
    region = Region.whole(asked.example.shape, (False, False))
    repeats = find_repeats(asked.example)
    grown = grow(
        region, 1, plan.start(asked.example, seed, asked.quality, None, repeats), keep, partial(to_fixed, None)
    )
    return SourceMap.from_coordinates(as_coordinates(grown.places, region), asked.example.shape)


def find_steps(asked: GrowthRequest) -> NDArray[np.float64] | None:
    """Return the lattice that patches are kept in step with, or None if anything else decides where they are."""
    varies = asked.frames is not None and asked.frames.constant is None
    held = asked.conditions.count or asked.conditions.maps is not None
    return None if varies or held or any(asked.region.wrap) else find_repeats(asked.example)


def find_repeats(example: Exemplar) -> NDArray[np.float64] | None:
    """Return the lattice or the single period of an image, or None if there is none."""
    found = example.segment().repeats if example.axes == 2 and not example.labels else None
    return None if found is None else found.vectors


def analyse(asked: GrowthRequest) -> Windows:
    """Return the start and corrector of quality "fast": windows of the exemplar at each level, with their settings."""
    return Windows(asked.example.analyse(FAST.radii).levels, FAST, asked.seed, asked.frames)


def as_source(asked: GrowthRequest, grown: Grown) -> SourceMap:
    """Return a source map from fixed-point coordinates, with the Jacobians of rigid patches or of the field."""
    coordinates, shape = as_coordinates(grown.places, asked.region), asked.example.shape
    if grown.patches is None:
        return SourceMap.from_coordinates(coordinates, shape, jacobian=asked.frames)
    rigid = asked.frames is not None and asked.frames.constant is None and not grown.patches.bent
    frame = grown.patches.frames if rigid else asked.frames
    labels = grown.patches.labels.reshape(asked.region.shape)
    return SourceMap.from_coordinates(coordinates, shape, label=labels, jacobian=frame)


def as_coordinates(places: Places, region: Region) -> Array:
    """Convert fixed-point coordinates to an array (..., A) of float32, in samples."""
    shape = (*region.shape, len(region.shape))
    return (places.reshape(shape) / np.float32(ONE)).astype(np.float32, copy=False)


def show_places(image: Array, places: Places, region: Region, spacing: int) -> Array:
    """Look up the exemplar at given coordinates: return the whole image, or the middle plane of a volume."""
    axes = len(region.shape)
    shown = places.reshape(*region.shape, axes)
    if axes == 3:
        shown = shown[region.shape[0] // 2]
    fine = (np.rint(shown / np.float32(ONE)) + 0.5) * spacing - 0.5
    at = tuple(np.clip(np.rint(fine[..., a]).astype(np.intp), 0, image.shape[a] - 1) for a in range(axes))
    return image[at]


def describe(asked: GrowthRequest, grown: Grown) -> dict[str, Any]:
    """Return the report of a synthesis, in JSON types."""
    levels = [done.report() for done in grown.levels]
    if asked.method is not None:
        levels = [{"shape": level["shape"], "passes": level["passes"]} for level in levels]
    elif asked.quality == "fast":
        known = asked.example.analyse(FAST.radii).levels[-len(levels) :]
        levels = [{**level, "spacing": round(here.spacing, 6)} for here, level in zip(known, levels, strict=True)]
    return {
        "method": asked.method or "default",
        "quality": None if asked.method else asked.quality,
        "seed": asked.seed,
        "field": None if asked.frames is None else asked.frames.describe(),
        "periodic_axes": list(asked.example.repeat),
        "interpolation": asked.sampling,
        "constrained_points": asked.conditions.count,
        "guided": asked.conditions.maps is not None,
        "elements": _count_elements(asked),
        "stitched": None if grown.patches is None else grown.patches.report(),
        "levels": levels,
        **({} if asked.steps is None else {"spacing": list(asked.steps)}),
    }


def _count_elements(asked: GrowthRequest) -> int | None:
    """Return the number of separate elements in the exemplar, or None if they were not searched."""
    if asked.method is not None or asked.quality == "fast":
        return None
    found = asked.example.instances
    return 0 if found is None else found.count
