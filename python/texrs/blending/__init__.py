"""Seams that disappear: the colours of a composite corrected so that its differences are those of the exemplar.

Section 3.6 (Eq. 5 and 6) of Shen, Jin, Mao and Feng, "Completion-based texture design using deformation", 2006, after
Agarwala et al., "Interactive digital photomontage", SIGGRAPH 2004. As printed, the differences wanted are those of the
composite itself, whose solution is the composite; here they come from the sources on both sides of a seam. Where a seam runs
along the outline of a thing the step across it is right, and stays: evened out, it would leave a fog around the thing.

The correction depends on the source map and on one map of the exemplar alone, so it can be made for each map of a
material: colours, heights, normals, in any dtype.
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

SCREENING = 0.15
"""Weight of the values: with less, rare colours drift by three grey levels and more, with this by two; seams show 1 to
2 % more than with 0.1."""


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

    Minimises ``sum((v[q] - v[p] - g[p, q]) ** 2) + screening * sum((v - I) ** 2)`` over neighbours p, q, for each
    channel by itself, where I is ``source.render(exemplars)`` [1]_. Where the source continues from p to q the
    difference wanted, g, is that of I. Across a seam it is the mean of what the sources of p and of q would show there,
    of those that lie inside their exemplar: ``I(S(p) + J(p) e) - I(S(p))`` and ``I(S(q)) - I(S(q) - J(q) e)``; 0 where
    neither does. Where the seam runs along the outline of a thing, which one of the sources shows there itself, g goes over to
    the step that there is; outlines are those of all channels together.

    Parameters
    ----------
    source : SourceMap
        Of a picture, shape (H, W).
    exemplars : array, or a sequence of one an exemplar
        Any map of the exemplar's height and width: (h, w) or (h, w, C).
    wrap : bool or (rows, columns)
        Axes along which the picture is cyclic. Along the others the outermost pixels keep their values,
        unless ``within`` says which do.
    screening : float
        Weight of the values against the differences, at least 0; 0 is the paper's. Colours drift over about
        ``screening ** -0.5`` pixels: 0.01 makes the transitions of smooth exemplars softer.
    band : int, optional
        Correct only what is at most this many pixels from a seam; all else keeps its values. By default everything.
    within : (H, W) bool or integers, path or Mask, optional
        Mask of the pixels that are corrected, such as the hole of an image that was filled. All others keep their values.
    known : (h, w) bool or integers, or a sequence of one an exemplar, optional
        What of the exemplars may be looked at beyond a seam. By default all.
    across : bool
        Whether values are corrected also where two exemplars meet. `texrs.design` does not: flowers on moss end at an edge,
        and one would stain the other.
    parts : (H, W) integers, optional
        What each pixel belongs to, as a floor or a wall: nothing is corrected where two of these meet.
    outlines : bool
        Whether the step across a seam stays where it is the outline of a thing. False: all steps are evened out, as the
        paper does.
    interpolation : {"cubic", "linear", "nearest"}
        As in `SourceMap.render`.
    antialias : bool
        As in `SourceMap.render`.
    map_type, green
        As in `SourceMap.render`. The slopes of normals are corrected, and normals get unit length again; only the channels that
        store normals are corrected.
    progress : callable or True, optional
        Called as ``progress("blend", share)``, with the share that is done; raising stops the work. True shows a bar.

    Returns
    -------
    (H, W) or (H, W, C) array
        In the dtype of the exemplar, within the range of its values in each channel; integers are rounded.

    Raises
    ------
    InvalidInput
        The map of a volume; another number of exemplars, or of another size, than the map was made from; an option out
        of range.

    Notes
    -----
    Some values have no meaning between them, and come back as `SourceMap.render` gives them: the last of two or of four
    channels (transparency), and whatever is bool, signed integers or ``interpolation="nearest"`` (labels).

    Pictures of more than 2^22 pixels are solved in overlapping strips of rows, so that beside the result at most
    0.4 GB are needed, if the screening lets corrections die out within a strip: at 0.01, up to 2^15 pixels wide, at
    0.001, up to 2^13. Others, as all without screening, are solved whole, one channel after another: 8 bytes a pixel,
    and 24 for normals.

    References
    ----------
    .. [1] J. Shen, X. Jin, X. Mao, J. Feng, "Completion-based texture design using deformation", The Visual Computer
       22, 2006, section 3.6. :doi:`10.1007/s00371-006-0079-2`

    Examples
    --------
    Two parts of a ramp meet in a step of 40. The ramp goes on across it:

    >>> import numpy as np
    >>> import texrs
    >>> ramp = np.tile(np.uint8(2) * np.arange(60, dtype=np.uint8), (16, 1))
    >>> whole = texrs.SourceMap.identity((16, 60))
    >>> places = np.concatenate([whole.coordinates[:, :20], whole.coordinates[:, 40:]], axis=1)
    >>> source = texrs.SourceMap(places, whole.exemplar[:, :40], whole.label[:, :40], None, whole.shapes)
    >>> int(np.diff(source.render(ramp)[8].astype(int)).max())
    42
    >>> int(np.diff(texrs.blend(source, ramp, wrap=False)[8].astype(int)).max())
    10

    """
    progress = listen(progress)
    as_instance(source, "source", SourceMap)
    if source.axes != 2:
        raise InvalidInput("source: a picture is needed, got the source map of a volume")
    cyclic, across, outlines = as_wrap(wrap), as_bool(across, "across"), as_bool(outlines, "outlines")
    weight = as_float(screening, "screening", 0, 1e6)
    width = None if band is None else as_int(band, "band", 1, 2**31)
    inside = None if within is None else as_mask(within, "within", source.shape)
    if inside is not None and not inside.any():
        raise InvalidInput("within: marks nothing, so there is nothing to correct")
    apart = None if parts is None else as_array(parts, "parts", np.uint16, source.shape)
    several = [as_ndarray(e, "exemplars") for e in as_list(exemplars)]
    result = source.render(several, interpolation=interpolation, antialias=antialias, map_type=map_type, green=green)
    shown = None if known is None else as_known(known, source.shapes)
    samples = Samples.scale([as_image(e) for e in several], map_type)
    if samples is None or interpolation == "nearest":
        return result
    turned: Literal["colour", "vector", "slope"] = "slope" if map_type == "normal" else map_type
    # Seen with a channel axis; what is written to it is written to the result.
    pixels = result.reshape((*source.shape, -1))
    strips = list(divide_strips(source.shape, cyclic[0], weight))
    groups = samples.group_channels(len(strips), math.prod(source.shape), map_type)
    steps = [(part, channels) for part in strips for channels in groups]
    seen: list[Seam] = []
    for number, (part, channels) in enumerate(steps):
        closed = (part.cyclic, cyclic[1])
        if channels == groups[0]:
            own = None if apart is None else apart[part.rows]
            rows = take_rows(source, part.rows)
            look = Look(samples, shown, rows, across, own, outlines, interpolation, turned, green)
            seen = [look.find_seams(axis, closed[axis]) for axis in range(2)]
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
    """Look a map up through a source map, and finish it as the verb that made the source map finished its picture.

    The type of the map is stated here; `texrs.apply` takes it from the name of a file.

    Parameters
    ----------
    source : SourceMap
        Source map of a picture or a volume.
    exemplars : (H, W[, C]) or (D, H, W[, C]) array, or a sequence of one an exemplar
        Any map of the exemplar's height and width (and depth), any dtype and channels.
    map_type : {"colour", "normal", "vector", "label"}
        Meaning of the values (see `texrs.apply`).
    green : {"up", "down"}
        Direction of the y axis of normals and vectors: up (OpenGL) or down (DirectX).
    finish : RenderOptions, optional
        Another finish than that of the map.
    progress : callable or True, optional
        Called as ``progress("blend", share)`` while seams are corrected; raising stops the work. True shows a bar.

    Returns
    -------
    array
        Shape of the output with the map's channels, in the map's dtype.

    Raises
    ------
    InvalidInput
        Another number of exemplars, or of another size, than the map was made from; an unknown type of map.

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
    """Look maps up and correct their seams, in even light or with light that is followed if the finish says so."""
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
    """Look a map up, and correct its seams if they are to be."""
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
    """Look a map up in even light, and give what is new the light of where it is shown."""
    assert how.light is not None
    assert how.within is not None
    pixels = as_image(exemplar)
    rows, columns = pixels.shape[:2]
    owner = np.zeros(source.shape, np.uint16) if how.parts is None else how.parts
    y, x = (np.arange(n) - o for n, o in zip((rows, columns), how.light, strict=True))
    own = owner[np.ix_(np.clip(y, 0, source.shape[0] - 1), np.clip(x, 0, source.shape[1] - 1))]
    known = np.ones((rows, columns), np.bool_) if how.known is None else how.known[0]
    parts = [(own == number) & known for number in range(int(owner.max()) + 1)]
    lights = measure_lights(pixels, parts)
    if all(light is None for light in lights):
        return _even_out(source, exemplar, how, "colour", "up", progress)
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
    """Check masks of the exemplars; 1 is what they have."""
    several = as_list(value)
    if len(several) != len(shapes):
        raise InvalidInput(f"known: needs a mask for each of {len(shapes)} exemplars, got {len(several)}")
    return [as_mask(k, "known", shape).astype(np.float32) for k, shape in zip(several, shapes, strict=True)]
