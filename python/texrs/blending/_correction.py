"""The correction of an image that makes its seams disappear, solved in strips of rows."""

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
"""Margin of a strip in pixels, times the square root of the screening. Corrections decay to exp(-9) over it."""


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
    """Return the correction, (H, W, C), to add to some channels of the composite, whose values are in [0, 1].

    With v = I + c, the target differences of c are g minus the differences of I. They are 0 except at seams.
    """
    # Sum the divergence of the missing differences, which is the right-hand side of the equations.
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
    """Mark all pixels at most ``band`` pixels from a marked pixel, across the border of periodic axes."""
    from scipy.ndimage import distance_transform_edt

    pads = [min(band, n) if w else 0 for n, w in zip(near.shape, wrap, strict=True)]
    padded = np.pad(near, [(p, p) for p in pads], mode="wrap")
    close = distance_transform_edt(~padded) <= band
    result: Bools = close[pads[0] : pads[0] + near.shape[0], pads[1] : pads[1] + near.shape[1]]
    return result


@dataclass(frozen=True, slots=True, eq=False)
class Strip:
    """Rows that are solved together, with margins."""

    rows: slice | NDArray[np.intp]
    kept: slice
    """Rows of the image whose result is kept."""
    inner: slice
    """Positions of the kept rows in ``rows``."""
    cyclic: bool


def divide_strips(shape: tuple[int, ...], wrap: bool, screening: float) -> Iterator[Strip]:
    """Divide an image into strips of rows, with margins where corrections from outside decay."""
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
