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

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from texrs._engine.pyramid import ONE, Region, to_fixed
from texrs._progress import answering, listen, stage
from texrs._typing import Array, Interpolation, Progress
from texrs._verbs import takes_materials
from texrs.exemplar import Exemplar
from texrs.fields import FieldLike
from texrs.growth import Constraints, Grown, Guide, Windows, grow, keep
from texrs.growth.engine import Places, Show
from texrs.materials import Material
from texrs.papers.solid.literal import grow_as_printed
from texrs.papers.solid.plans import PLANS, Choice, Plan, choose_plan
from texrs.papers.solid.request import Method, Request
from texrs.papers.solid.settings import FAST, Quality
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["solid", "synthesize"]


@takes_materials("exemplar")
def solid(
    exemplar: Array | Exemplar | Material,
    size: int | Sequence[int],
    *,
    field: FieldLike | None = None,
    seed: int = 0,
    wrap: bool | Sequence[bool] | None = None,
    quality: Quality = "preserve",
    bend_patches: bool | None = None,
    method: Method = None,
    constraints: Constraints | None = None,
    guide: Guide | None = None,
    interpolation: Interpolation | None = None,
    spacing: Sequence[float] | None = None,
    memory_limit: int | None = None,
    progress: Progress | bool | None = None,
) -> Synthesis:
    """Synthesise a volume from an example volume. The texture can follow a frame field.

    Parameters
    ----------
    exemplar : (D, H, W) or (D, H, W, C) array, or Exemplar
        Example volume, of any real dtype and number of channels, at least 16 voxels a side. A `texrs.Exemplar` with
        ``axes=3`` states whether its values are labels, and along which axes it is periodic; for other types, both are
        measured.
    size : int or (planes, rows, columns)
        Size of the result in voxels. One number gives a cube.
    field : Field, str, array_like or path_like, optional
        Field that rotates and scales the texture at each voxel (`texrs.fields`). Python accepts a field or its words.
        Python also accepts directions (P, R, C, 3) or frames (P, R, C, 3, 3) over the output, as an array or a file.
        None leaves the texture as it is.
    seed : int
        Seed of the random choices, 0 to 2^64 - 1. The same seed gives the same bytes. Default: 0.
    wrap : bool or (planes, rows, columns), optional
        Axes along which the result is periodic. Default: none.
    quality : {"preserve", "fast", "optimise"}
        Balance of quality and speed. "preserve" stitches patches along minimum cuts, which keeps elements whole.
        "optimise" tries three times as many source positions for each patch. "fast" corrects blocks point by point,
        for textures without elements. Default: "preserve".
    bend_patches : bool, optional
        If True, patches are bent along the field, which suits courses and nets. If False, they are rotated and scaled
        as a whole, which suits separate elements. Default: False if the exemplar has separate elements.
    method : {None, "paper", "paper-compensated"}
        Algorithm to use. "paper" is the algorithm as printed, for comparison. "paper-compensated" adds the windows of
        Lefebvre and Hoppe, which the paper omits. Neither can be combined with ``quality``, constraints or a guide,
        and both look up the nearest sample by default. Default: the algorithm with departures from the paper.
    constraints : Constraints, optional
        Given voxels, specified by their values or by their source coordinates (`texrs.Constraints`).
    guide : Guide, optional
        A map that the result should follow, for exemplars with a trend, such as grains that grow downwards
        (`texrs.Guide`).
    interpolation : {"nearest", "linear", "cubic"}, optional
        Interpolation between the exemplar's samples in the final look-up. Labels always use the nearest sample.
        Default: "cubic".
    spacing : (plane, row, column) float, optional
        Voxel size along each axis of the exemplar and of the result, in any unit. The field rotates and scales the
        texture in space, not in voxels, and its places and lengths are in this unit. Default: the spacing that the
        exemplar's file states, else 1.
    memory_limit : int, optional
        Maximum memory of the computation in bytes. Default: the available memory, unless a lower limit is set
        (`texrs.limits`).
    progress : callable or True, optional
        Function called as ``progress(stage, share)`` with the completed share of the stage. An exception that it
        raises stops the work. True shows a progress bar.

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
    progress = listen(progress)
    request = Request.check(
        exemplar,
        size,
        axes=3,
        field=field,
        seed=seed,
        wrap=wrap,
        quality=quality,
        bend_patches=bend_patches,
        method=method,
        constraints=constraints,
        guide=guide,
        interpolation=interpolation,
        memory_limit=memory_limit,
        spacing=spacing,
    )
    return grow_texture(request, progress)


@takes_materials("exemplar")
def synthesize(
    exemplar: Array | Exemplar | Material,
    size: int | Sequence[int],
    *,
    field: FieldLike | None = None,
    seed: int = 0,
    wrap: bool | Sequence[bool] | None = None,
    quality: Quality = "preserve",
    bend_patches: bool | None = None,
    patches: Choice = "default",
    method: Method = None,
    constraints: Constraints | None = None,
    guide: Guide | None = None,
    interpolation: Interpolation | None = None,
    memory_limit: int | None = None,
    progress: Progress | bool | None = None,
) -> Synthesis:
    """Synthesise an image from an example image. The texture can follow a frame field.

    Parameters
    ----------
    exemplar : (H, W) or (H, W, C) array, or Exemplar
        Example image, of any real dtype and number of channels, at least 16 pixels a side. A `texrs.Exemplar` states
        whether its values are labels, and along which axes it is periodic; for other types, both are measured.
    size : int or (int, int)
        Size of the result in pixels. One number gives a square.
    field : Field, str, array_like or path_like, optional
        Field that rotates and scales the texture at each pixel (`texrs.fields`). Python accepts a field or its words.
        Python also accepts directions (R, C, 2) or frames (R, C, 2, 2) over the output, as an array or a file. None
        leaves the texture as it is.
    seed : int
        Seed of the random choices, 0 to 2^64 - 1. The same seed gives the same bytes. Default: 0.
    wrap : bool or (rows, columns), optional
        Axes along which the result is periodic. Default: none.
    quality : {"preserve", "fast", "optimise"}
        Balance of quality and speed. "preserve" stitches patches along minimum cuts, which keeps elements whole.
        "optimise" tries three times as many source positions for each patch. "fast" corrects blocks point by point,
        for textures without elements. Default: "preserve".
    bend_patches : bool, optional
        If True, patches are bent along the field, which suits courses and nets. If False, they are rotated and scaled
        as a whole, which suits separate elements. Default: False if the exemplar has separate elements.
    patches : {"auto", "default", "large", "unmasked", "unmasked-large"}
        Method of stitching. "large": patches a quarter larger than the default, which tear fewer elements but copy
        larger parts. "unmasked": seams may cross elements. "unmasked-large": both. "auto": each method is tried twice
        on a small image and evaluated (`texrs.metrics`), and a clearly better one replaces the default. The report key
        "candidates" contains the measures of each. Default: patches of the usual size, and seams that avoid elements
        ("default").
    method : {None, "paper", "paper-compensated"}
        Algorithm to use. "paper" is the algorithm as printed, for comparison. "paper-compensated" adds the windows of
        Lefebvre and Hoppe, which the paper omits. Neither can be combined with ``quality``, constraints or a guide,
        and both look up the nearest sample by default. Default: the algorithm with departures from the paper.
    constraints : Constraints, optional
        Given pixels, specified by their values or by their source coordinates (`texrs.Constraints`).
    guide : Guide, optional
        A map that the result should follow, for exemplars with a trend, such as grains that grow downwards
        (`texrs.Guide`).
    interpolation : {"nearest", "linear", "cubic"}, optional
        Interpolation between the exemplar's samples in the final look-up. Labels always use the nearest sample.
        Default: "cubic".
    memory_limit : int, optional
        Maximum memory of the computation in bytes. Default: the available memory, unless a lower limit is set
        (`texrs.limits`).
    progress : callable or True, optional
        Function called as ``progress(stage, share)`` with the completed share of the stage. An exception that it
        raises stops the work. True shows a progress bar.

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
    progress = listen(progress)
    request = Request.check(
        exemplar,
        size,
        axes=2,
        field=field,
        seed=seed,
        wrap=wrap,
        quality=quality,
        bend_patches=bend_patches,
        patches=patches,
        method=method,
        constraints=constraints,
        guide=guide,
        interpolation=interpolation,
        memory_limit=memory_limit,
    )
    return grow_texture(request, progress)


def grow_texture(asked: Request, progress: Progress | None) -> Synthesis:
    """Synthesise an image or a volume: compute its source map, and look up the exemplar."""
    said: dict[str, Any] = {"patches": None, "candidates": None}
    show = partial(show_places, asked.exemplar.pixels)
    if asked.method is not None:
        grown = grow_as_printed(
            asked.exemplar,
            asked.field,
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
    source = as_source(asked, grown).with_finish(asked.region.wrap, interpolation=asked.interpolation)
    composite = source.render(asked.exemplar.image, interpolation=asked.interpolation)
    last = {} if grown.patches else {f"level {len(grown.levels)}": show(grown.places, asked.region, 1)}
    stages = {**grown.stages, **last, "before_blending": composite}
    return Synthesis(asked.conditions.show(composite), source, stages, describe(asked, grown) | said)


def stitch(asked: Request, show: Show, progress: Progress | None) -> tuple[Grown, dict[str, Any]]:
    """Stitch patches along minimum cuts, at full resolution. Return the result, and report keys of the method."""
    name, tried = choose_plan(asked.exemplar, asked.patches, asked.quality, partial(try_plan, asked, progress))
    start = PLANS[name].start(asked.exemplar, asked.seed, asked.quality, asked.bend_patches)
    frames = partial(to_fixed, asked.field)
    grown = grow(asked.region, 1, start, keep, frames, ask=asked.conditions.at, show=show, progress=progress)
    return grown, {"patches": name, "candidates": tried}


def try_plan(asked: Request, progress: Progress | None, plan: Plan, seed: int) -> SourceMap:
    """Synthesise an image of the exemplar's size by one method, without a field or constraints."""
    stage(progress, "try")
    region = Region.whole(asked.exemplar.shape, (False, False))
    grown = grow(region, 1, plan.start(asked.exemplar, seed, asked.quality, None), keep, partial(to_fixed, None))
    return SourceMap.from_coordinates(as_coordinates(grown.places, region), asked.exemplar.shape)


def analyse(asked: Request) -> Windows:
    """Return the start and corrector of quality "fast": windows of the exemplar at each level, with their settings."""
    return Windows(asked.exemplar.analyse(FAST.radii).levels, FAST, asked.seed, asked.field)


def as_source(asked: Request, grown: Grown) -> SourceMap:
    """Return a source map from fixed-point coordinates, with the Jacobians of rigid patches or of the field."""
    coordinates, shape = as_coordinates(grown.places, asked.region), asked.exemplar.shape
    if grown.patches is None:
        return SourceMap.from_coordinates(coordinates, shape, jacobian=asked.field)
    rigid = asked.field is not None and asked.field.constant is None and not grown.patches.bent
    frame = grown.patches.frames if rigid else asked.field
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


def describe(asked: Request, grown: Grown) -> dict[str, Any]:
    """Return the report of a synthesis, in JSON types."""
    levels = [done.report() for done in grown.levels]
    if asked.method is not None:
        levels = [{"shape": level["shape"], "passes": level["passes"]} for level in levels]
    elif asked.quality == "fast":
        known = asked.exemplar.analyse(FAST.radii).levels[-len(levels) :]
        levels = [{**level, "spacing": round(here.spacing, 6)} for here, level in zip(known, levels, strict=True)]
    return {
        "method": asked.method or "default",
        "quality": None if asked.method else asked.quality,
        "seed": asked.seed,
        "field": None if asked.field is None else asked.field.describe(),
        "periodic_axes": list(asked.exemplar.repeat),
        "interpolation": asked.interpolation,
        "constrained_points": asked.conditions.count,
        "guided": asked.conditions.maps is not None,
        "elements": _count_elements(asked),
        "stitched": None if grown.patches is None else grown.patches.report(),
        "levels": levels,
        **({} if asked.spacing is None else {"spacing": list(asked.spacing)}),
    }


def _count_elements(asked: Request) -> int | None:
    """Return the number of separate elements in the exemplar, or None if they were not searched."""
    if asked.method is not None or asked.quality == "fast":
        return None
    found = asked.exemplar.instances
    return 0 if found is None else found.count
