"""Drawn layouts: points, lattices, cells and courses as arrangements of elements.

Each layout is a `texrs.elements.ElementAnalysis` like that of an image, with a drawing of the layout as its image. It
can be the second argument of `texrs.splice`, and an entry of a `texrs.TextureDatabase`. `from_dict` creates a layout
from a description in plain JSON types, as the command line does.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_items, as_seed, as_size, as_wrap, check_memory, try_array
from texrs._typing import Array, Labels
from texrs.elements import ElementAnalysis, Layout
from texrs.errors import InvalidInput
from texrs.point_sets import nearest_distances

__all__ = ["cells", "courses", "from_dict", "lattice", "points"]

Points = NDArray[np.float64]

GROUND, ELEMENT = 208, 72
"""Grey values of the background and of the elements in the drawing."""
DISC = 0.35
"""Radius of a drawn point, as a share of the median distance to the nearest point."""
SHORTEST = 16
"""Minimum side of a drawing, in pixels."""
LARGEST = 1 << 24
"""Maximum number of pixels of a drawing."""
MOST = 1 << 18
"""Maximum number of points or bricks."""


def points(places: object, size: int | Sequence[int], *, wrap: bool | Sequence[bool] = False) -> ElementAnalysis:
    """Return a layout of points.

    Parameters
    ----------
    places : (n, 2) array
        Rows and columns in pixels, at least three points within ``size``, all different.
    size : int or (rows, columns)
        Size of the drawing, sides of at least 16. With ``texrs.splice(layout_scale=1)`` its pixels are those of the
        result.
    wrap : bool or (bool, bool)
        If True, the layout repeats along rows and columns. Default: False.

    Returns
    -------
    ElementAnalysis
        Separate elements on a drawing (rows, columns) uint8.

    Raises
    ------
    InvalidInput
        There are too few points, or some are outside or equal.

    Examples
    --------
    >>> import texrs
    >>> from texrs.elements import ElementAnalysis
    >>> ring = [[64 + 40 * s, 64 + 40 * c] for s, c in [(0, 1), (1, 0), (0, -1), (-1, 0), (0.7, 0.7), (-0.7, -0.7)]]
    >>> layout = texrs.layouts.points(ring, 128)
    >>> buttons = ElementAnalysis.of_sample(texrs.samples.dots((128, 128)))
    >>> made = texrs.splice(buttons, layout, 128, layout_scale=1)
    >>> len(made.report["matches"])
    6

    """
    shape, around = _as_shape(size), as_wrap(wrap, "wrap")
    at = try_array(places, np.float64)
    if at.ndim != 2 or at.shape[1] != 2 or not np.isfinite(at).all():
        raise InvalidInput(
            f"places: must be finite (row, column) pairs of shape (n, 2), got {at.dtype} of shape {at.shape}"
        )
    at = np.asarray(at, np.float64)
    if not 3 <= len(at) <= MOST:
        raise InvalidInput(f"places: must be between 3 and {MOST} points, got {len(at)}")
    # Points may be half a pixel beyond the centres of border pixels, because pixels extend that far.
    outside = ((at < -0.5) | (at > np.array(shape) - 0.5)).any(axis=1)
    if outside.any():
        raise InvalidInput(f"places: must be inside a layout of size {shape}, got {at[outside][0].tolist()}")
    if len(np.unique(at, axis=0)) < len(at):
        raise InvalidInput("places: must be different, got the same place twice")
    return _draw_points(at, shape, (around[0], around[1]))


def lattice(
    size: int | Sequence[int],
    first: Sequence[float],
    second: Sequence[float],
    *,
    origin: Sequence[float] | None = None,
) -> ElementAnalysis:
    """Return a layout of the points of a lattice, which continues beyond the drawing.

    Parameters
    ----------
    size : int or (rows, columns)
        Size of the drawing, sides of at least 16.
    first, second : (row, column)
        Vectors from a point to two of its neighbours, in pixels. Hexagons have, for example, ``(0, 20)`` and ``(17.3,
        10)``.
    origin : (row, column), optional
        One of the points. Default: the middle of the drawing.

    Returns
    -------
    ElementAnalysis
        Separate elements on a drawing (rows, columns) uint8.

    Raises
    ------
    InvalidInput
        The vectors are parallel, or the drawing contains fewer than three or too many points.

    Examples
    --------
    >>> import texrs
    >>> len(texrs.layouts.lattice(100, (0, 20), (17.3, 10)).points)
    23

    """
    shape = _as_shape(size)
    basis = np.array([_as_pair(first, "first"), _as_pair(second, "second")])
    area = abs(float(np.linalg.det(basis)))
    if area < 0.05 * float(np.hypot(*basis[0]) * np.hypot(*basis[1])) or not area:
        raise InvalidInput(
            f"second: must not be parallel to first, {tuple(basis[0].tolist())}, got {tuple(basis[1].tolist())}"
        )
    if np.prod(shape) / area > MOST:
        raise InvalidInput(
            f"first, second: must give at most {MOST} points in a layout of size {shape}; use longer vectors"
        )
    middle = (np.array(shape) - 1) / 2 if origin is None else np.array(_as_pair(origin, "origin"))
    # The coordinates of the corners in the basis bound the indices of all visible points.
    corners = np.array([[y, x] for y in (0, shape[0] - 1) for x in (0, shape[1] - 1)]) - middle
    ends = corners @ np.linalg.inv(basis)
    low, high = np.floor(ends.min(axis=0)).astype(int), np.ceil(ends.max(axis=0)).astype(int)
    index = np.stack(np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(low, high, strict=True)), indexing="ij"), -1)
    at = np.round(index.reshape(-1, 2) @ basis + middle, 6)
    at = at[((at >= 0) & (at <= np.array(shape) - 1)).all(axis=1)]
    if len(at) < 3:
        raise InvalidInput(f"size: must be large enough for at least 3 points of the lattice, got {len(at)} in {shape}")
    return _draw_points(at, shape, (False, False))


def cells(labels: Array, *, wrap: bool | Sequence[bool] = False) -> ElementAnalysis:
    """Return a layout of cells: a tessellation, such as the stones of a pavement.

    Parameters
    ----------
    labels : (H, W) array of int
        Cell of each pixel, any positive number; 0 is a joint. There must be at least three cells, and sides of at
        least 16.
    wrap : bool or (bool, bool)
        If True, the layout repeats along rows and columns. Default: False.

    Returns
    -------
    ElementAnalysis
        Jointed cells, one for each label, on a drawing (H, W) uint8.

    Raises
    ------
    InvalidInput
        There are fewer than three labels.

    Examples
    --------
    >>> import numpy as np
    >>> import texrs
    >>> from texrs.elements import ElementAnalysis
    >>> panes = np.add.outer(10 * (np.arange(96) // 24), np.arange(96) // 32) + 1
    >>> wall = ElementAnalysis.of_sample(texrs.samples.bricks((160, 160)))
    >>> texrs.splice(wall, texrs.layouts.cells(panes), 96).report["method"]
    'cells'

    """
    given: NDArray[Any] = try_array(labels, None)
    if given.ndim != 2 or min(given.shape) < SHORTEST:
        raise InvalidInput(f"labels: must have shape (H, W) with sides of at least {SHORTEST}, got shape {given.shape}")
    check_memory(4 * given.size, "labels")
    image = np.full(given.shape, GROUND, np.uint8)
    found = ElementAnalysis.of_labels(image, given, layout=Layout.JOINTED, wrap=wrap)
    # Draw dark joints between light cells, even if the labels contain no joints.
    image[~found.mask] = ELEMENT
    return found


def courses(
    size: int | Sequence[int],
    height: float | Sequence[float],
    length: float,
    *,
    shift: float = 0.5,
    vary: float = 0.0,
    joint: float = 2.0,
    seed: int = 0,
) -> ElementAnalysis:
    """Return a layout of courses of bricks or stones, each independent of the others.

    Parameters
    ----------
    size : int or (rows, columns)
        Size of the drawing, sides of at least 16.
    height : float, or sequence of float
        Height of a course in pixels, including the joint, at least 4. Several heights repeat in order.
    length : float
        Mean length of a brick in pixels, including the joint, at least 4.
    shift : float
        Shift of each course relative to the course above, in brick lengths: 0.5 is a running bond, 0 a stack. Default:
        0.5.
    vary : float
        Variation of lengths, 0 to 0.9: bricks are ``1 - vary`` to ``1 + vary`` times the mean length. Default: 0.
    joint : float
        Width of the joints in pixels, 0 to half of the height and of the shortest length. Default: 2.
    seed : int
        Seed of the varying lengths. Default: 0.

    Returns
    -------
    ElementAnalysis
        Jointed cells on a drawing (rows, columns) uint8.

    Raises
    ------
    InvalidInput
        A number is out of its range, or so large that fewer than three bricks are visible.

    Examples
    --------
    >>> import texrs
    >>> texrs.layouts.courses(128, height=[16, 24], length=40, shift=1 / 3, vary=0.3)
    Elements(30 of box (15, 31) in 128 x 128, jointed)

    """
    shape, number = _as_shape(size), as_seed(seed)
    listed = as_items(height, "height") if isinstance(height, Sequence | np.ndarray) else [height]
    heights = [as_float(h, "height", 4, 1e6) for h in listed]
    if not heights:
        raise InvalidInput("height: must have at least one entry")
    long, moved = as_float(length, "length", 4, 1e6), as_float(shift, "shift", -1e6, 1e6)
    spread = as_float(vary, "vary", 0, 0.9)
    wide = as_float(joint, "joint", 0, min(*heights, long * (1 - spread), 1e6) / 2)
    if shape[0] / min(heights) * (shape[1] / long + 2) > MOST:
        raise InvalidInput(
            f"height, length: must give at most {MOST} bricks in a layout of size {shape}; use larger bricks"
        )
    noise, labels = np.random.default_rng(number), np.zeros(shape, np.int32)
    rows, columns = np.arange(shape[0]) + 0.5, np.arange(shape[1]) + 0.5
    # Label the courses from the top. Each course begins up to one brick to the left of the drawing.
    top, course, count = 0.0, 0, 0
    while top < shape[0]:
        tall = heights[course % len(heights)]
        sides = long * (1 + spread * noise.uniform(-1, 1, int(shape[1] / (long * (1 - spread))) + 3))
        ends = np.concatenate([[0.0], np.cumsum(sides)]) + long * ((moved * course) % 1 - 1)
        brick = np.searchsorted(ends, columns, side="right") - 1
        beside = np.minimum(columns - ends[brick], ends[brick + 1] - columns)
        inside = np.minimum(rows - top, top + tall - rows) >= wide / 2
        within = (rows >= top) & (rows < top + tall) & inside
        labels[within] = np.where(beside >= wide / 2, count + brick + 1, 0)
        top, course, count = top + tall, course + 1, count + len(sides)
    return cells(labels)


def from_dict(description: Mapping[str, Any]) -> ElementAnalysis:
    """Create a layout from a description in plain JSON types.

    Parameters
    ----------
    description : mapping
        Name and arguments of a layout: ``{"layout": "points", "places": [[row, column], ...], "size": [128, 128]}``.
        The other layouts are ``"lattice"``, ``"cells"`` and ``"courses"``, with the arguments of the function of that
        name.

    Returns
    -------
    ElementAnalysis

    Raises
    ------
    InvalidInput
        The layout or one of its arguments does not exist, or an argument is out of range.

    Examples
    --------
    >>> import texrs
    >>> texrs.layouts.from_dict({"layout": "lattice", "size": 96, "first": [0, 24], "second": [24, 0]})
    Elements(9 of box (17, 17) in 96 x 96, disjoint)

    """
    import inspect

    if not isinstance(description, Mapping) or description.get("layout") not in _MADE:
        raise InvalidInput(
            f"layout: must be a mapping whose entry 'layout' is one of {', '.join(_MADE)}; got {description!r}"
        )
    function = _MADE[description["layout"]]
    given = {str(name): value for name, value in description.items() if name != "layout"}
    # Check the arguments here, because a TypeError of the call would not name the layout.
    known = inspect.signature(function).parameters
    for name in given:
        if name not in known:
            raise InvalidInput(
                f"layout: arguments of {description['layout']} must be among {', '.join(known)}; got {name!r}"
            )
    for name, parameter in known.items():
        if parameter.default is parameter.empty and name not in given:
            raise InvalidInput(f"layout: {description['layout']} requires {name!r}")
    return function(**given)


_MADE: dict[str, Callable[..., ElementAnalysis]] = {
    "points": points,
    "lattice": lattice,
    "cells": cells,
    "courses": courses,
}


def __dir__() -> list[str]:
    return __all__


def _as_shape(size: object) -> tuple[int, int]:
    rows, columns = as_size(size, minimum=SHORTEST, limit=LARGEST)
    return rows, columns


def _as_pair(value: object, name: str) -> tuple[float, float]:
    pair = try_array(value, np.float64)
    if pair.shape != (2,) or not np.isfinite(pair).all():
        raise InvalidInput(f"{name}: must be two finite numbers (row, column), got {value!r}")
    return as_float(float(pair[0]), name, -1e6, 1e6), as_float(float(pair[1]), name, -1e6, 1e6)


def _draw_points(at: Points, shape: tuple[int, int], wrap: tuple[bool, bool]) -> ElementAnalysis:
    """Draw points as discs of one size that do not touch."""
    from scipy.spatial import cKDTree

    radius = max(1.0, DISC * float(np.median(nearest_distances(at, 1))))
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), -1).reshape(-1, 2)
    far, nearest = cKDTree(at).query(grid, distance_upper_bound=radius)
    owner: Labels = np.where(np.isfinite(far), nearest + 1, 0).reshape(shape).astype(np.int32)
    # Give each point its own pixel, even if other discs cover it.
    pixel = np.clip(np.rint(at), 0, np.array(shape) - 1).astype(np.intp)
    owner[pixel[:, 0], pixel[:, 1]] = np.arange(1, len(at) + 1)
    image = np.where(owner > 0, ELEMENT, GROUND).astype(np.uint8)
    side = 2 * round(radius) + 1
    return ElementAnalysis(image, at, owner > 0, (side, side), Layout.DISJOINT, np.ones(len(at)), wrap=wrap)
