"""Keep the colours of images with a palette or few colours: their results contain no other colours.

Interpolation, antialiasing and seam correction would add new colours. Each pixel of a result is therefore copied from
the nearest pixel of the example.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from texrs._conversion import as_ndarray
from texrs._masks import Mask
from texrs._notices import assume
from texrs._typing import Array
from texrs.errors import TexrsError
from texrs.io import origins
from texrs.materials.material import Material
from texrs.source_map import RenderOptions, SourceMap
from texrs.synthesis import Synthesis

__all__ = ["Palette", "ask", "find", "has_few_colours", "keep_material", "keeps_colours", "make_plain"]

MOST = 64
"""Maximum number of colours of an image with few colours. Pixel art has up to 64.

Few photographs have so few grey levels.
"""
SPARE = 8
"""Minimum number of pixels per colour. Almost every pixel has its own colour in a small crop of a photograph."""
STEP, SHARE = 8, 0.75
"""Minimum difference of adjacent pixels, of 255 levels, and minimum fraction of unequal pairs that reach it.

Adjacent pixels of smooth images differ by 1 or 2 levels.
"""
ENOUGH = 2**18
"""Approximate number of pixels whose neighbours are compared, in rows and columns spread over the image."""
CHUNK, MANY = 2**16, 2**12
"""Number of pixels whose colours are collected at once, and number of colours above which sorting all pixels is faster.
"""
OFF = "use --no-palette or another interpolation to change this"
"""End of each notice, which explains how to allow other colours."""
_ASKED: ContextVar[bool | None] = ContextVar("palette", default=None)
"""True: all images keep their colours. False: no image keeps them. None: only indexed images and images of
few colours keep them."""


@dataclass(frozen=True, slots=True)
class Palette:
    """Examples of a verb whose result contains only the colours of the examples."""

    images: list[Array]
    count: int

    def keep(self, made: Synthesis) -> Synthesis:
        """Return the result with its pixels copied from the examples, without interpolation or correction."""
        if made.source_map.axes != 2:
            return made
        source = make_plain(made.source_map)
        image = source.render(self.images if len(self.images) > 1 else self.images[0], interpolation="nearest")
        known = {"screening": 0.0, "interpolation": "nearest"}
        report = {**made.report, **{key: value for key, value in known.items() if key in made.report}}
        stages = {name: image if name == "before_blending" else stage for name, stage in made.stages.items()}
        return replace(made, image=image, source_map=source, stages=stages, report={**report, "palette": self.count})


@contextmanager
def ask(kept: bool | None) -> Iterator[None]:
    """Set for a ``with`` block whether results keep the colours of images. None decides for each image."""
    token = _ASKED.set(kept)
    try:
        yield
    finally:
        _ASKED.reset(token)


def find(given: dict[str, Any], names: Sequence[str], usual: Mapping[str, Any]) -> Palette | None:
    """Return the examples in the arguments of a verb if its result must contain only their colours, else None.

    A path in the arguments is replaced by its image. Arguments that request other colours disable the palette.
    """
    asked, weight, how = _ASKED.get(), given.get("screening"), given.get("interpolation")
    # Weights of other types are invalid, and the verb itself raises the error.
    wanted = isinstance(weight, int | float) and weight not in (0, usual.get("screening"))
    smooth = isinstance(how, str) and how not in ("nearest", usual.get("interpolation"))
    fading = any(isinstance(value, Mask) and value.feather for value in given.values())
    if asked is False or wanted or smooth or fading or given.get("flatten_lighting") is True:
        return None
    images: list[tuple[str, Array]] = []
    for name in names:
        value = given.get(name)
        if isinstance(value, str | os.PathLike):
            with suppress(TexrsError):
                # A verb that fills holes does not use nodata pixels as colours, so do not report them.
                value = given[name] = as_ndarray(value, name, used="mask" not in usual)
        elif isinstance(value, list | tuple) and any(isinstance(each, str | os.PathLike) for each in value):
            with suppress(TexrsError):
                paths = (str, os.PathLike)
                value = given[name] = [as_ndarray(e, name) if isinstance(e, paths) else e for e in value]
        images += [(name, image) for image in _list_images(value)]
    if not images or not all(image.ndim in (2, 3) and image.shape[2:] < (5,) for _, image in images):
        return None
    known = [origins.find(image) for _, image in images]
    if not asked:
        indexed = [origin is not None and origin[1] for origin in known]
        kept = [_keeps(image, has_table) for (_, image), has_table in zip(images, indexed, strict=True)]
        if not all(kept):
            return None
    tables = [_list_colours(image) for _, image in images]
    for (name, _), origin, table in zip(images, known, tables, strict=True):
        what = name if origin is None else origin[0]
        assume(f"{what}: has only {len(table)} colours, so pixels are neither interpolated nor corrected; {OFF}")
    return Palette([image for _, image in images], len(np.unique(np.concatenate(tables))))


def has_few_colours(image: Array) -> bool:
    """Return True if an image has so few colours that a new colour would be visible.

    Examples
    --------
    >>> import texrs
    >>> has_few_colours(texrs.samples.pebbles((64, 64)).image)
    False
    >>> has_few_colours(np.kron(np.eye(8, dtype=np.uint8), np.full((4, 4), 255, np.uint8)))
    True

    """
    if image.dtype not in (np.uint8, np.uint16) or image.ndim not in (2, 3) or image.shape[2:] >= (5,):
        return False
    if min(image.shape) == 0:
        return False
    if not 2 <= len(_list_colours(image, MOST)) <= min(MOST, image.shape[0] * image.shape[1] // SPARE):
        return False
    pixels, apart = image.reshape(*image.shape[:2], -1), max(1, image.shape[0] * image.shape[1] // ENOUGH)
    lines = (pixels[::apart], pixels[:, ::apart].swapaxes(0, 1))
    steps = np.concatenate([np.abs(np.diff(p.astype(np.int32), axis=1)).max(axis=-1).ravel() for p in lines])
    least = STEP * np.iinfo(image.dtype).max // 255
    return bool((steps >= least).sum() >= SHARE * (steps > 0).sum())


def keeps_colours(image: Array) -> bool:
    """Return True if results keep the colours of an image, and report it."""
    asked = _ASKED.get()
    kept = has_few_colours(image) if asked is None else asked
    if kept:
        assume(
            "exemplar: has only a few colours, so pixels are not interpolated; "
            "use --no-palette or another interpolation to change this"
        )
    return kept


def make_plain(source: SourceMap) -> SourceMap:
    """Return a source map that copies the nearest pixel, without interpolation and correction."""
    wrap = (False, False) if source.finish is None else source.finish.wrap
    return replace(source, finish=RenderOptions(wrap, interpolation="nearest"))


def keep_material(made: Synthesis, materials: Sequence[Material]) -> Synthesis:
    """Return a result whose maps are copied from the nearest pixels, if its materials have few colours."""
    asked, bases = _ASKED.get(), [m.base for m in materials]
    few = asked is not False and made.source_map.axes == 2 and all(has_few_colours(base) for base in bases)
    if not few and not asked:
        return made
    assume(f"maps: have only a few colours, so pixels are neither interpolated nor corrected; {OFF}")
    return replace(made, source_map=make_plain(made.source_map))


def _keeps(image: Array, indexed: bool) -> bool:
    """Return True if results keep the colours of this image.

    An image with a palette of many greys counts as a photograph, whose colours are not kept.
    """
    if not indexed or image.dtype != np.uint8:
        return has_few_colours(image)
    grey = image.ndim == 2 or (image.shape[2] >= 3 and bool((image[..., :3] == image[..., :1]).all()))
    return has_few_colours(image) or not (grey and len(_list_colours(image, MOST)) > MOST)


def _list_images(value: object) -> Iterator[Array]:
    """Yield the images in an argument: an array, an object with an image, or a list of them."""
    several = value if isinstance(value, list | tuple) else [value]
    for each in several:
        image = each if isinstance(each, np.ndarray) else getattr(each, "image", None)
        if image is None and type(each).__module__.startswith("PIL."):
            image = as_ndarray(each, "image")
        if isinstance(image, np.ndarray):
            yield image


def _list_colours(image: Array, most: int = MANY) -> Array:
    """Return the different colours of an image as integers. If there are more than ``most``, only some are returned."""
    found, rows = _pack(image[:0]), max(1, CHUNK // max(image.shape[1], 1))
    for first in range(0, image.shape[0], rows):
        found = np.union1d(found, _pack(image[first : first + rows]))
        if len(found) > most:
            return found if most < MANY else np.unique(_pack(image))
    return found


def _pack(image: Array) -> Array:
    """Return the colour of each pixel as a single value."""
    if image.ndim == 2:
        return image.ravel()
    flat = np.ascontiguousarray(image).reshape(-1, image.shape[2])
    if image.dtype.kind in "bu" and image.dtype.itemsize <= 2:
        return flat.astype(np.uint64) @ np.array([1 << 16 * k for k in range(image.shape[2])], np.uint64)
    return flat.view(f"V{flat.itemsize * flat.shape[1]}").ravel()
