"""SOLID: textures of two and three dimensions under a frame field.

Y.-L. Su, C.-C. Chang, Z.-C. Shih and W.-K. Tai, "Vector-field-based deformations for three-dimensional texture
synthesis" (appearance vectors, similarity sets and a pyramid of corrections after Lefebvre and Hoppe, SIGGRAPH 2005
and 2006). The steps are:

1. Analyse the exemplar: its separate elements, and its adjacent colours (`texrs.Exemplar.stitcher`).
2. Map patches of it into the output through the field around their centres.
3. Cut each in at the best of several places, and repair torn elements (`texrs._engine.stitcher`).
4. Look the exemplar up through the coordinates.

With ``quality="fast"`` steps 2 and 3 are those of the paper. Coordinates are upsampled from level to level with the
field's Jacobian (Eq. 1 and 2). They are corrected by the windows around each point, warped by the field (Eq. 3 and 4).
Both are the engine of `texrs.growth`. Unbounded textures place patches over each other in tilings of the world
(`texrs.papers.solid.layers`), so that a patch depends on few others. With ``quality="fast"`` they are a chain of
corrections (`texrs.papers.solid.world`).

Departures, with their reasons:

- Patches stitched along minimum cuts replace the pyramid of corrections. Correcting single points tears and fuses
  elements larger than a window. When the particles of `texrs.samples.particles` are wound round an axis, 29 % of them
  were torn, and none are torn now (`texrs.volume.integrity`). Cells in walls gain more.
- The cost of a cut depends on the resulting pair: the old voxel at p next to the new one at q. It does not depend on
  the difference of the two textures at both.
- Patches of separate elements are rotated as a whole, and patches of textures with a direction bend with the field.
- The elements of an image may be unreliable, as in a heap. The elements of `texrs.exemplar.segmentation` then still
  have a cost for cuts, but are not repaired. The length of seams inside them falls to a quarter.
- More patches are tried at the most visible seams, half as many as before. They need not fit the existing patches,
  and are used if the seams become less visible.
- Places that were shown often and overrepresented classes of colour have a cost, because cuts are cheapest if rare
  elements are left out.

Departures of the corrections:

- The start is a lattice of hashed coherent blocks that fit each other, not one coordinate with jitter at every level.
  From jitter, sparse particles never form, whatever the correction does.
- The cost of a block is divided by its own contrast. With squared differences alone blocks of low contrast win, and
  rare elements become rarer.
- The correction changes a point to a random match only if the gain is more than twice the exemplar's own spacing.
  Otherwise repeated corrections remove rare elements.
- A pass corrects every other point, as on a chess board, and only where pieces of the exemplar meet. If all points
  change at once, neighbours on both sides of a seam swap and nothing is gained. Votes, which solved this, cost a third
  of the low-frequency features.
- Windows are compensated for the offset of the lattice (o - J step), which the paper omits. Without it rotated
  textures have the wrong scale (``method="paper-compensated"`` adds only this).
- A row vector in Eq. 1 and a column vector in Eq. 3 rotate in opposite directions. Here J is the inverse of the frame
  in both.
- The pyramid is decimated, windows are 5^3 at each level, and full colour windows are compared. The paper's eight
  diagonal neighbours separate into lattices that exchange nothing.
- If the exemplar is measured to be periodic, its coordinates are periodic.

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
    """Synthesise a volume from an example volume, under a frame field.

    Parameters
    ----------
    exemplar : (D, H, W) or (D, H, W, C) array, or Exemplar
        Example volume, of any real dtype and number of channels, at least 16 voxels a side. A `texrs.Exemplar` with
        ``axes=3`` states whether its values are labels and along which axes it is periodic, which are otherwise
        measured.
    size : int or (planes, rows, columns)
        Size of the result in voxels. One number is a cube.
    field : Field, str, array_like or path_like, optional
        Field that rotates and scales the texture at each voxel (`texrs.fields`). Python accepts a field or its words.
        Python also accepts directions (P, R, C, 3) or frames (P, R, C, 3, 3) over the output, as an array or a file.
        None leaves the texture as it is.
    seed : int
        Seed of the random choices, 0 to 2^64 - 1. The same seed gives the same bytes. Default: 0.
    wrap : bool or (planes, rows, columns), optional
        Axes along which the result is periodic. Default: none.
    quality : {"preserve", "fast", "optimise"}
        Amount of work. "preserve" stitches patches along minimum cuts, which keeps elements whole. "optimise" tries
        three times as many source positions for each patch. "fast" corrects blocks point by point, for textures
        without elements. Default: "preserve".
    bend_patches : bool, optional
        If True, patches bend with the field, as courses and nets need. If False, they are rotated and scaled as a
        whole, as separate elements need. Default: False if the exemplar has separate elements.
    method : {None, "paper", "paper-compensated"}
        Algorithm to use. "paper" is the algorithm as printed, for comparison. "paper-compensated" adds the windows of
        Lefebvre and Hoppe, which the paper omits. Both have no ``quality``, take neither constraints nor a guide, and
        look up the nearest sample by default. Default: the algorithm with departures from the paper.
    constraints : Constraints, optional
        Given voxels, by their values or by their source coordinates (`texrs.Constraints`).
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
        Maximum memory of the work in bytes. Default: the limits in force (`texrs.limits`).
    progress : callable or True, optional
        Called as ``progress(stage, share)`` with the stage and its completed share. An exception that it raises stops
        the work. True shows a bar.

    Returns
    -------
    Synthesis
        The volume in the exemplar's dtype, and its source map with the frames of its patches. The stages are images of
        the middle plane at each level.

        Stages:

        - ``patches``: Patches in their first places. For quality "preserve" and "optimise".
        - ``blocks``: Blocks in their first places. For quality "fast" and the paper.
        - ``level N``: The middle plane after level N, counted from 1.
        - ``before_blending``: The result before known voxels are set.

        Report:

        - ``method``: "default", "paper" or "paper-compensated".
        - ``quality``: "preserve", "fast" or "optimise"; None for the paper.
        - ``seed``: The seed.
        - ``field``: The field in words, or None.
        - ``periodic_axes``: Axes along which the example repeats.
        - ``interpolation``: Interpolation between samples of the example.
        - ``constrained_points``: Number of constrained points.
        - ``guided``: Whether a guide was given.
        - ``elements``: Number of separate elements that were found, or None.
        - ``stitched``: Number of ``patches``, whether they were ``bent``, mean cost of the ``seams`` and number of
          ``healed`` patches; None if points were corrected.
        - ``levels``: For each level: its ``shape``, number of ``passes`` and the share of points that ``changed``.
        - ``spacing``: (plane, row, column) distances, if they were given.
        - ``patches``: How patches were chosen; only if they were.
        - ``candidates``: The figures of each method that was tried, or None. They are ``score`` (0 is best), ``torn``,
          ``broken``, ``seam_blur``, ``repetition`` and ``coverage`` of `texrs.metrics.evaluate`.

    Raises
    ------
    InvalidInput
        If the exemplar is too small or not finite, or a field has other axes or is singular somewhere. Also if
        constraints or maps have other shapes, or an option is out of its range.
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
    """Synthesise an image from an example image, under a frame field.

    Parameters
    ----------
    exemplar : (H, W) or (H, W, C) array, or Exemplar
        Example image, of any real dtype and number of channels, at least 16 pixels a side. A `texrs.Exemplar` states
        whether its values are labels and along which axes it is periodic, which are otherwise measured.
    size : int or (int, int)
        Size of the result in pixels. One number is a square.
    field : Field, str, array_like or path_like, optional
        Field that rotates and scales the texture at each pixel (`texrs.fields`). Python accepts a field or its words.
        Python also accepts directions (R, C, 2) or frames (R, C, 2, 2) over the output, as an array or a file. None
        leaves the texture as it is.
    seed : int
        Seed of the random choices, 0 to 2^64 - 1. The same seed gives the same bytes. Default: 0.
    wrap : bool or (rows, columns), optional
        Axes along which the result is periodic. Default: none.
    quality : {"preserve", "fast", "optimise"}
        Amount of work. "preserve" stitches patches along minimum cuts, which keeps elements whole. "optimise" tries
        three times as many source positions for each patch. "fast" corrects blocks point by point, for textures
        without elements. Default: "preserve".
    bend_patches : bool, optional
        If True, patches bend with the field, as courses and nets need. If False, they are rotated and scaled as a
        whole, as separate elements need. Default: False if the exemplar has separate elements.
    patches : {"auto", "default", "large", "unmasked", "unmasked-large"}
        Method of stitching. "large": patches a quarter larger than the default, which tear fewer elements but copy
        larger parts. "unmasked": seams may cross elements. "unmasked-large": both. "auto": each method is tried twice
        at the exemplar's size and evaluated (`texrs.metrics`). A clearly better one replaces the default. The report
        key "candidates" contains the figures of each. Default: "default".
    method : {None, "paper", "paper-compensated"}
        Algorithm to use. "paper" is the algorithm as printed, for comparison. "paper-compensated" adds the windows of
        Lefebvre and Hoppe, which the paper omits. Both have no ``quality``, take neither constraints nor a guide, and
        look up the nearest sample by default. Default: the algorithm with departures from the paper.
    constraints : Constraints, optional
        Given pixels, by their values or by their source coordinates (`texrs.Constraints`).
    guide : Guide, optional
        A map that the result should follow, for exemplars with a trend, such as grains that grow downwards
        (`texrs.Guide`).
    interpolation : {"nearest", "linear", "cubic"}, optional
        Interpolation between the exemplar's samples in the final look-up. Labels always use the nearest sample.
        Default: "cubic".
    memory_limit : int, optional
        Maximum memory of the work in bytes. Default: the limits in force (`texrs.limits`).
    progress : callable or True, optional
        Called as ``progress(stage, share)`` with the stage and its completed share. An exception that it raises stops
        the work. True shows a bar.

    Returns
    -------
    Synthesis
        The image in the exemplar's dtype, and its source map with the frames of its patches. The stages and the keys
        of the report are as in `solid`, without ``spacing``.

    Raises
    ------
    InvalidInput
        If the exemplar is too small or not finite, or a field has other axes or is singular somewhere. Also if
        constraints or maps have other shapes, or an option is out of its range.
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
    """Compute the source map, coarse to fine or from patches, and look the exemplar up through it."""
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
    """Stitch patches along minimum cuts, at full resolution, without corrections. Return the method too."""
    name, tried = choose_plan(asked.exemplar, asked.patches, asked.quality, partial(try_plan, asked, progress))
    start = PLANS[name].start(asked.exemplar, asked.seed, asked.quality, asked.bend_patches)
    frames = partial(to_fixed, asked.field)
    grown = grow(asked.region, 1, start, keep, frames, ask=asked.conditions.at, show=show, progress=progress)
    return grown, {"patches": name, "candidates": tried}


def try_plan(asked: Request, progress: Progress | None, plan: Plan, seed: int) -> SourceMap:
    """Make an image of the exemplar's size by a method, without a field or constraints."""
    stage(progress, "try")
    region = Region.whole(asked.exemplar.shape, (False, False))
    grown = grow(region, 1, plan.start(asked.exemplar, seed, asked.quality, None), keep, partial(to_fixed, None))
    return SourceMap.from_coordinates(as_coordinates(grown.places, region), asked.exemplar.shape)


def analyse(asked: Request) -> Windows:
    """Return the exemplar's pyramid of windows, and the settings of each level."""
    return Windows(asked.exemplar.analyse(FAST.radii).levels, FAST, asked.seed, asked.field)


def as_source(asked: Request, grown: Grown) -> SourceMap:
    """Return places as a source map, with the frames of rigid patches or of the field."""
    coordinates, shape = as_coordinates(grown.places, asked.region), asked.exemplar.shape
    if grown.patches is None:
        return SourceMap.from_coordinates(coordinates, shape, jacobian=asked.field)
    rigid = asked.field is not None and asked.field.constant is None and not grown.patches.bent
    frame = grown.patches.frames if rigid else asked.field
    labels = grown.patches.labels.reshape(asked.region.shape)
    return SourceMap.from_coordinates(coordinates, shape, label=labels, jacobian=frame)


def as_coordinates(places: Places, region: Region) -> Array:
    """Return places in fixed point as coordinates (..., A) float32."""
    shape = (*region.shape, len(region.shape))
    return (places.reshape(shape) / np.float32(ONE)).astype(np.float32, copy=False)


def show_places(image: Array, places: Places, region: Region, spacing: int) -> Array:
    """Return an image of places: a whole image, or the middle plane of a volume, looked up in the exemplar."""
    axes = len(region.shape)
    shown = places.reshape(*region.shape, axes)
    if axes == 3:
        shown = shown[region.shape[0] // 2]
    fine = (np.rint(shown / np.float32(ONE)) + 0.5) * spacing - 0.5
    at = tuple(np.clip(np.rint(fine[..., a]).astype(np.intp), 0, image.shape[a] - 1) for a in range(axes))
    return image[at]


def describe(asked: Request, grown: Grown) -> dict[str, Any]:
    """Return the report as JSON types."""
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
    """Return the number of separate elements, if they were searched for."""
    if asked.method is not None or asked.quality == "fast":
        return None
    found = asked.exemplar.instances
    return 0 if found is None else found.count
