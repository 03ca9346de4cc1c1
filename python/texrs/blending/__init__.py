"""Blending: correct the colours of a composite so that its seams disappear.

The method is section 3.6 (Eq. 5 and 6) of Shen, Jin, Mao and Feng, "Completion-based texture design using
deformation", 2006. It follows Agarwala et al., "Interactive digital photomontage", SIGGRAPH 2004. The paper uses, as
printed, the differences of the composite itself as the target, so the composite would be the solution. Here the target
differences come from the sources on both sides of a seam. If a seam follows the outline of an element, the step across
it is correct and is kept. If such a step were smoothed, a fog around the element would remain.

The correction depends only on the source map and on one map of the exemplar. It therefore works for each map of a
material (colours, heights, normals) in any dtype.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np

from texrs._arrays import (
    as_array,
    as_bool,
    as_choice,
    as_float,
    as_image,
    as_instance,
    as_int,
    as_list,
    as_mask,
    as_ndarray,
    as_wrap,
)
from texrs._light import divide_out, measure_lights
from texrs._lighting_correction import flatten_lighting
from texrs._masks import Mask
from texrs._progress import listen
from texrs._typing import Array, Floats, Interpolation, Progress
from texrs.blending._correction import divide_strips, solve_correction
from texrs.blending._fade import fade_in
from texrs.blending._seams import Look, Seam, take_rows
from texrs.blending._values import Samples
from texrs.blending._visibility import Visibility, measure_visibility
from texrs.errors import InvalidInput
from texrs.source_map import RenderOptions, SourceMap

__all__ = ["SCREENING", "Visibility", "apply", "blend", "measure_visibility"]

SCREENING = 0.02
"""Default weight of the original values. It evens out steps of tone, and keeps colours.

It was chosen on 24 pictures and measured on 23 others. The excess of steps of tone at seams falls from 0.013 with a
weight of 0.15 to 0.010, and with 0.01 no further. Averaged over 20 pixels, 1 % of the colours change by more than 0.034
of the exemplar's deviation.
"""


def blend(
    source: SourceMap,
    exemplars: Array | Sequence[Array],
    *,
    wrap: bool | Sequence[bool],
    screening: float = SCREENING,
    band: int | None = None,
    within: Array | Mask | str | None = None,
    known: Array | Sequence[Array] | None = None,
    across: bool = True,
    parts: Array | None = None,
    outlines: bool = True,
    interpolation: Interpolation = "cubic",
    antialias: bool = False,
    map_type: Literal["colour", "normal", "vector"] = "colour",
    green: Literal["up", "down"] = "up",
    progress: Progress | bool | None = None,
) -> Array:
    """Render a map of the exemplar through a source map, and correct its values so that seams disappear.

    The result v minimises ``sum((v[q] - v[p] - g[p, q]) ** 2) + screening * sum((v - I) ** 2)`` [1]_. The sums are
    over neighbours p, q, in each channel, and I is ``source.render(exemplars)``. If the source continues from p to q,
    the target difference g is the difference of I.

    Across a seam, g is the mean of the differences in the sources of p and q: ``I(S(p) + J(p) e) - I(S(p))`` and
    ``I(S(q)) - I(S(q) - J(q) e)``. Only differences inside the exemplars count; g is 0 if neither is inside. If one of
    the sources contains the step itself, the seam follows the outline of an element, and g is the actual step.
    Outlines are detected in all channels together.

    Parameters
    ----------
    source : SourceMap
        Source map of an image, (H, W).
    exemplars : array, or a sequence of one per exemplar
        Any map of the exemplar, of its height and width: (h, w) or (h, w, C).
    wrap : bool or (rows, columns)
        Axes along which the image is periodic. Along other axes, the outermost pixels keep their values, unless
        ``within`` selects the corrected pixels.
    screening : float
        Weight of the original values relative to the differences, at least 0. The paper uses 0. Colours drift over
        about ``screening ** -0.5`` pixels. Default: 0.02.
    band : int, optional
        Maximum distance of corrected pixels from a seam, in pixels, at least 1. All other pixels keep their values.
        Default: unlimited.
    within : (H, W) bool or integers, path or Mask, optional
        Mask of the pixels to correct, such as the filled hole of an image. All other pixels keep their values.
        Default: all.
    known : (h, w) bool or integers, or a sequence of one per exemplar, optional
        Masks of the exemplar pixels that may be used beyond a seam. Default: all.
    across : bool
        If True, also correct seams between two exemplars. `texrs.design` uses False, because the colours of two
        exemplars, such as flowers and moss, would bleed into each other. Default: True.
    parts : (H, W) integers, optional
        Index of the part of each pixel, such as floor or wall. Seams between two parts are not corrected. Default: one
        part.
    outlines : bool
        If True, keep the step across a seam that follows the outline of an element. If False, smooth all steps, as the
        paper does. Default: True.
    interpolation : {"cubic", "linear", "nearest"}
        Interpolation, as in `SourceMap.render`. Default: "cubic".
    antialias : bool
        If True, smooth the exemplar where it is reduced, as in `SourceMap.render`. Default: False.
    map_type, green
        Type of the map and direction of y, as in `SourceMap.render`. For normals, the slopes are corrected, and the
        normals are then normalised. Only the channels that store normals are corrected.
    progress : callable or True, optional
        Function called as ``progress("blend", share)`` with the completed share. If it raises an exception, the work
        stops. True shows a bar.

    Returns
    -------
    (H, W) or (H, W, C) array
        Image in the dtype of the exemplar, within the range of its values in each channel. Integers are rounded.

    Raises
    ------
    InvalidInput
        If the source map is of a volume, an option is out of range, or the number or size of the exemplars differs from
        the source map.

    Notes
    -----
    Some values cannot be interpolated, so they are returned as `SourceMap.render` gives them. These are transparency
    (the last of two or of four channels), bool and signed integers, and all values with ``interpolation="nearest"``
    (labels).

    Images of more than 2^22 pixels are solved in overlapping strips of rows, if the screening makes corrections decay
    within a strip. This is the case up to a width of 2^15 pixels at a screening of 0.01, and of 2^13 at 0.001. Strips
    need at most 0.4 GB in addition to the result. Other images, such as all images without screening, are solved
    whole, one channel after another. They need 8 bytes per pixel, and 24 for normals.

    References
    ----------
    .. [1] J. Shen, X. Jin, X. Mao, J. Feng, "Completion-based texture design using deformation", The Visual Computer
       22, 2006, section 3.6. :doi:`10.1007/s00371-006-0079-2`

    Examples
    --------
    Two parts of a ramp meet in a step of 40. After blending, the ramp continues across it:

    >>> import numpy as np
    >>> import texrs
    >>> ramp = np.tile(np.uint8(2) * np.arange(60, dtype=np.uint8), (16, 1))
    >>> whole = texrs.SourceMap.identity((16, 60))
    >>> places = np.concatenate([whole.coordinates[:, :20], whole.coordinates[:, 40:]], axis=1)
    >>> source = texrs.SourceMap(places, whole.exemplar[:, :40], whole.label[:, :40], None, whole.shapes)
    >>> int(np.diff(source.render(ramp)[8].astype(int)).max())
    42
    >>> int(np.diff(texrs.blend(source, ramp, wrap=False)[8].astype(int)).max())
    6

    """
    progress = listen(progress)
    as_instance(source, "source", SourceMap)
    if source.axes != 2:
        raise InvalidInput("source: must be the source map of an image, got the source map of a volume")
    cyclic, across, outlines = as_wrap(wrap), as_bool(across, "across"), as_bool(outlines, "outlines")
    weight = as_float(screening, "screening", 0, 1e6)
    width = None if band is None else as_int(band, "band", 1, 2**31)
    inside = None if within is None else as_mask(within, "within", source.shape)
    if inside is not None and not inside.any():
        raise InvalidInput("within: must mark at least one pixel, got none")
    apart = None if parts is None else as_array(parts, "parts", np.uint16, source.shape)
    several = [as_ndarray(e, "exemplars") for e in as_list(exemplars)]
    result = source.render(several, interpolation=interpolation, antialias=antialias, map_type=map_type, green=green)
    shown = None if known is None else as_known(known, source.shapes)
    # Do not correct values that cannot be interpolated, such as labels.
    samples = Samples.scale([as_image(e) for e in several], map_type)
    if samples is None or interpolation == "nearest":
        return result
    turned: Literal["colour", "vector", "slope"] = "slope" if map_type == "normal" else map_type
    # This view with a channel axis shares memory with the result, so writing to it changes the result.
    pixels = result.reshape((*source.shape, -1))
    strips = list(divide_strips(source.shape, cyclic[0], weight))
    groups = samples.group_channels(len(strips), math.prod(source.shape), map_type)
    # Look up the seams of a strip once for all its groups of channels.
    steps = [(part, channels) for part in strips for channels in groups]
    seen: list[Seam] = []
    for number, (part, channels) in enumerate(steps):
        closed = (part.cyclic, cyclic[1])
        if channels == groups[0]:
            own = None if apart is None else apart[part.rows]
            rows = take_rows(source, part.rows)
            look = Look(samples, shown, rows, across, own, outlines, interpolation, turned, green)
            seen = [look.find_seams(axis, closed[axis]) for axis in range(2)]
        # A strip without seams needs no correction.
        if any(len(seam.lack) for seam in seen):
            report = None if progress is None else _scale_progress(progress, number, len(steps))
            marked = None if inside is None else inside[part.rows]
            correction = solve_correction(look.source.shape, seen, channels, closed, weight, width, marked, report)
            samples.correct(pixels[part.kept], correction[part.inner], channels, map_type)
        if progress is not None:
            progress("blend", (number + 1) / len(steps))
    return result


def apply(
    source: SourceMap,
    exemplars: Array | Sequence[Array],
    *,
    map_type: Literal["colour", "normal", "vector", "label"] = "colour",
    green: Literal["up", "down"] = "up",
    finish: RenderOptions | None = None,
    progress: Progress | bool | None = None,
) -> Array:
    """Render a map through a source map, with the options that the verb used for its image.

    Specify the type of the map here. `texrs.apply` infers it from the name of a file.

    Parameters
    ----------
    source : SourceMap
        Source map of an image or a volume.
    exemplars : (H, W[, C]) or (D, H, W[, C]) array, or a sequence of one per exemplar
        Any map of the exemplar, of its height and width (and depth), with any dtype and channels.
    map_type : {"colour", "normal", "vector", "label"}
        Meaning of the values (see `texrs.apply`). Default: "colour".
    green : {"up", "down"}
        Direction of the y axis of normals and vectors: up (OpenGL) or down (DirectX). Default: "up".
    finish : RenderOptions, optional
        Render options. Default: the options of the source map.
    progress : callable or True, optional
        Function called as ``progress("blend", share)`` while seams are corrected. If it raises an exception, the work
        stops. True shows a bar.

    Returns
    -------
    array
        Map in its own dtype and channels, with the shape of the output.

    Raises
    ------
    InvalidInput
        If the number or size of the exemplars differs from the source map, or the type of the map is unknown.

    Examples
    --------
    >>> import texrs
    >>> pebbles = texrs.samples.pebbles((64, 64)).image
    >>> result = texrs.design(pebbles, 64)
    >>> bool((texrs.blending.apply(result.source_map, pebbles) == result.image).all())
    True

    """
    progress = listen(progress)
    as_instance(source, "source", SourceMap)
    as_choice(map_type, "map_type", ("colour", "normal", "vector", "label"))
    if finish is not None:
        as_instance(finish, "finish", RenderOptions)
    how = finish or source.finish
    several: Sequence[Array] = as_list(exemplars)
    made = _look_up(source, several, how, map_type, green, progress)
    return made if how is None or how.fade is None else fade_in(made, several[0], how.fade, map_type)


def _look_up(
    source: SourceMap,
    several: Sequence[Array],
    how: RenderOptions | None,
    map_type: Literal["colour", "normal", "vector", "label"],
    green: Literal["up", "down"],
    progress: Progress | None,
) -> Array:
    """Render maps and correct their seams. The finish specifies whether the light is removed, or applied again."""
    if map_type == "label":
        return source.render(several, interpolation="nearest")
    if how is not None and how.flatten_lighting and map_type == "colour":
        several = [flatten_lighting(as_ndarray(each, "exemplars")) for each in several]
    if (
        how is not None
        and how.light is not None
        and how.within is not None
        and map_type == "colour"
        and len(several) == 1
    ):
        return _follow_light(source, several[0], how, progress)
    return _even_out(source, several, how, map_type, green, progress)


def _even_out(
    source: SourceMap,
    exemplars: Array | Sequence[Array],
    how: RenderOptions | None,
    map_type: Literal["colour", "normal", "vector"],
    green: Literal["up", "down"],
    progress: Progress | None,
) -> Array:
    """Render a map, and correct its seams if the finish requests it."""
    if how is None or how.screening is None:
        rest: dict[str, Any] = {} if how is None else {"interpolation": how.interpolation, "antialias": how.antialias}
        return source.render(exemplars, map_type=map_type, green=green, **rest)
    return blend(
        source,
        exemplars,
        wrap=how.wrap,
        screening=how.screening,
        band=how.band,
        within=how.within,
        known=how.known,
        across=how.across,
        parts=how.parts,
        outlines=how.outlines,
        interpolation=how.interpolation,
        antialias=how.antialias,
        map_type=map_type,
        green=green,
        progress=progress,
    )


def _follow_light(source: SourceMap, exemplar: Array, how: RenderOptions, progress: Progress | None) -> Array:
    """Render a map without its uneven light, then apply the light of the new place to new pixels."""
    assert how.light is not None
    assert how.within is not None
    pixels = as_image(exemplar)
    rows, columns = pixels.shape[:2]
    owner = np.zeros(source.shape, np.uint16) if how.parts is None else how.parts
    y, x = (np.arange(n) - o for n, o in zip((rows, columns), how.light, strict=True))
    # Measure the light of each part in the exemplar, which may be offset from the image.
    own = owner[np.ix_(np.clip(y, 0, source.shape[0] - 1), np.clip(x, 0, source.shape[1] - 1))]
    known = np.ones((rows, columns), np.bool_) if how.known is None else how.known[0]
    parts = [(own == number) & known for number in range(int(owner.max()) + 1)]
    lights = measure_lights(pixels, parts)
    if all(light is None for light in lights):
        return _even_out(source, exemplar, how, "colour", "up", progress)
    # Blend the images without their light, then multiply the new pixels by the light of their part.
    even = _even_out(source, divide_out(pixels, lights, parts), how, "colour", "up", progress)
    result = source.render(exemplar, interpolation=how.interpolation, antialias=how.antialias)
    shown = result.reshape((*source.shape, -1))
    count = shown.shape[-1] - (shown.shape[-1] in (2, 4))
    for number, light in enumerate(lights):
        at = np.nonzero(how.within & (owner == number))
        lit = even[at]
        if light is not None:
            lit[:, :count] *= light.at(at[0] + how.light[0], at[1] + how.light[1])[:, np.newaxis]
        if result.dtype.kind == "u":
            lit = np.clip(np.rint(lit), 0, np.iinfo(result.dtype).max)
        shown[at] = lit
    return result


def _scale_progress(progress: Progress, number: int, steps: int) -> Callable[[float], object]:
    return lambda share: progress("blend", (number + share) / steps)


def as_known(value: object, shapes: Sequence[tuple[int, ...]]) -> list[Floats]:
    """Check the masks of the exemplars, and return them with the values 0 and 1."""
    several = as_list(value)
    if len(several) != len(shapes):
        raise InvalidInput(f"known: must be a mask for each of {len(shapes)} exemplars, got {len(several)}")
    return [as_mask(k, "known", shape).astype(np.float32) for k, shape in zip(several, shapes, strict=True)]
