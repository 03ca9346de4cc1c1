"""What is added to a picture so that its seams disappear, solved for in strips of rows."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs._typing import Bools, Floats
from texrs.blending import _values
from texrs.blending._seams import Seam, wrap_rows
from texrs.kernels.poisson import Boundary, spread

REACH = 9.0
"""Strips overlap by this over the root of the screening, in pixels: corrections fall to exp(-9) there."""


def solve_correction(
    shape: tuple[int, ...],
    seen: Sequence[Seam],
    channels: slice,
    wrap: tuple[bool, bool],
    screening: float,
    band: int | None,
    within: Bools | None,
    progress: Callable[[float], object] | None,
) -> Floats:
    """Return what must be added to some channels of the composite, (H, W, C) in [0, 1].

    With v = I + c the differences wanted of c are g less those of I: nothing but at seams.
    """
    flow = np.zeros((*shape, channels.stop - channels.start), np.float32)
    near = np.zeros(shape if band is not None else (0, 0), bool)
    for seam in seen:
        flow[seam.at] -= seam.lack[:, channels]
        flow[seam.after] += seam.lack[:, channels]
        if band is not None:
            near[seam.at] = near[seam.after] = True
    free = within is not None and not within.all()
    rows, columns = (_choose_boundary(w, free) for w in wrap)
    mask = within
    if band is not None:
        close = _mark_close(near, band, wrap)
        mask = close if within is None else close & within
    spread(flow, screening=screening, boundary=(rows, columns), mask=mask, progress=progress)
    return flow


def _choose_boundary(wrap: bool, free: bool) -> Boundary:
    return "periodic" if wrap else "free" if free else "dirichlet"


def _mark_close(near: Bools, band: int, wrap: tuple[bool, bool]) -> Bools:
    """Mark what is at most ``band`` pixels from a marked pixel, around cyclic axes."""
    from scipy.ndimage import distance_transform_edt

    pads = [min(band, n) if w else 0 for n, w in zip(near.shape, wrap, strict=True)]
    padded = np.pad(near, [(p, p) for p in pads], mode="wrap")
    close = distance_transform_edt(~padded) <= band
    result: Bools = close[pads[0] : pads[0] + near.shape[0], pads[1] : pads[1] + near.shape[1]]
    return result


@dataclass(frozen=True, slots=True, eq=False)
class Strip:
    """Rows that are solved together."""

    rows: slice | NDArray[np.intp]
    kept: slice
    """The rows whose result is kept."""
    inner: slice
    """Where they lie among ``rows``."""
    cyclic: bool


def divide_strips(shape: tuple[int, ...], wrap: bool, screening: float) -> Iterator[Strip]:
    """Divide a picture into strips of rows, each with a margin in which corrections from beyond it die out."""
    height, width = shape
    margin = math.ceil(REACH / math.sqrt(screening)) if screening > 0 else height
    rows = max(_values.STRIP // width, 2 * margin)
    whole = height * width <= _values.STRIP or rows + 2 * margin >= height
    if whole or (rows + 2 * margin) * width > 4 * _values.STRIP:
        yield Strip(slice(0, height), slice(0, height), slice(0, height), wrap)
        return
    for start in range(0, height, rows):
        stop = min(start + rows, height)
        first, last = start - margin, stop + margin
        if not wrap:
            first, last = max(first, 0), min(last, height)
        inner = slice(start - first, stop - first)
        yield Strip(wrap_rows(first, last, height), slice(start, stop), inner, False)
