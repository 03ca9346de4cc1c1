"""More of a plane that was photographed: the picture goes on beyond its borders, in the same perspective.

What is beyond them is a hole that is filled by example (`texrs.complete`), with a scale map that goes on too: that of the
picture's plane, which is said, or found.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from texrs._arrays import as_image, as_int, as_size, check_memory
from texrs._typing import Array, Progress
from texrs._verbs import takes_materials
from texrs.completion import complete
from texrs.errors import InvalidInput
from texrs.materials import Material
from texrs.planes import Plane, View
from texrs.planes._choose import see
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["extend"]

MOST = 8192
"""Pixels that are added on a side, at most."""
LEAST = 0.05
"""Nearer to the horizon than this share of the middle's scale a picture does not go on."""


@takes_materials("image")
def extend(
    image: Array | Material,
    *,
    top: int = 0,
    bottom: int = 0,
    left: int = 0,
    right: int = 0,
    to: int | Sequence[int] | None = None,
    view: View | Plane | None = None,
    boundary: int = 0,
    seed: int = 0,
    progress: Progress | None = None,
) -> Synthesis:
    """Make a photograph of a plane larger, on any side, in the same perspective.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        The photograph, any real dtype, each side at least 64.
    top, bottom, left, right : int
        Pixels that are added there, 0 to 8192; some somewhere. Towards the horizon only as far as it.
    to : int or (rows, columns), optional
        Size of the larger picture: what the sides above do not add to it is added evenly, but towards the horizon only as far
        as the plane goes, and on the other side then.
    view : View or Plane, optional
        How the photograph shows the plane, as far as that is to be said; what is not is found. Of its ground alone is
        copied.
    boundary : int
        How many known pixels at the border may change, 0 to 64, which hides it better; by default none.
    seed : int
        Chooses among what fits.
    progress : callable, optional
        Called as ``progress(stage, share)``, with the share of the stage that is done; raising stops the work.

    Returns
    -------
    Synthesis
        The larger picture, in the dtype and with the channels of the photograph, of which no pixel changes but those within
        ``boundary``. Its source map leads to the photograph. The report has the plane and what was added.

    Raises
    ------
    InvalidInput
        Options out of their ranges, nothing to add, two ways to say how the plane lies, or a picture that would reach the
        horizon.

    Warns
    -----
    UserWarning
        A plane that was found with a confidence below 0.4: give corners, or angles.

    Examples
    --------
    >>> import texrs
    >>> floor = texrs.samples.tilted_discs((128, 128))
    >>> larger = texrs.extend(floor.image, right=64, view=texrs.View(slant=35, fov=60), seed=1)
    >>> larger.image.shape, bool((larger.image[:, :128] == floor.image).all())
    ((128, 192, 3), True)

    """
    pixels = as_image(image, minimum=64)
    rows, columns = pixels.shape[:2]
    added = {
        name: as_int(value, name, 0, MOST)
        for name, value in (("top", top), ("bottom", bottom), ("left", left), ("right", right))
    }
    size = add_sizes((rows, columns), added) if to is None else as_size(to, "to")
    missing = [n - m for n, m in zip(size, add_sizes((rows, columns), added), strict=True)]
    if min(missing) < 0 or max(missing) > 2 * MOST:
        raise InvalidInput(
            f"to: needs {rows} x {columns} pixels, and what the sides add, at least, and at most {2 * MOST} more; got "
            f"{size[0]} x {size[1]}"
        )
    if size == (rows, columns):
        raise InvalidInput("top, bottom, left, right: all are 0, so there is nothing to add")
    check_memory(size[0] * size[1] * (64 + pixels.shape[2] * pixels.itemsize), "top, bottom, left, right")
    rim = as_int(boundary, "boundary", 0, 64)
    watch = progress or (lambda stage, share: None)
    watch("plane", 0.0)
    seen = see(pixels, View.of(view))
    watch("plane", 1.0)
    for axis, before, after in ((1, "left", "right"), (0, "top", "bottom")):
        added[before] += missing[axis] // 2
        added[after] += missing[axis] - missing[axis] // 2
        room = measure_room(seen.plane, added, axis)
        if missing[axis] and sum(room) >= added[before] + added[after]:
            over = max(0, added[before] - room[0]) - max(0, added[after] - room[1])
            added[before], added[after] = added[before] - over, added[after] + over
    first = np.array([added["top"], added["left"]])
    places = np.moveaxis(np.indices(size), 0, -1) - first
    width = seen.plane.width(places)
    if width.min() < LEAST:
        raise InvalidInput(
            "top, bottom, left, right: the picture would reach the plane's horizon; add fewer pixels, or say how the plane lies"
        )
    inner = (slice(first[0], first[0] + rows), slice(first[1], first[1] + columns))
    canvas, hole = np.zeros((*size, pixels.shape[2]), pixels.dtype), np.ones(size, np.bool_)
    canvas[inner], hole[inner] = pixels, False
    allowed = None
    if not seen.ground.all():
        allowed = np.zeros(size, np.bool_)
        allowed[inner] = seen.ground
    scale = width.astype(np.float32)
    made = complete(canvas, hole, allowed=allowed, scale_map=scale, boundary=rim, seed=seed, progress=progress)
    # It copies nothing from beyond the photograph's borders.
    inside = np.clip(places, 0, [rows - 1, columns - 1]).astype(np.float32)
    source = made.source.compose(SourceMap.from_coordinates(inside, (rows, columns)))
    source = source.finished((False, False), antialias=True)
    report: dict[str, Any] = {**made.report, "plane": seen.plane.as_dict(), "found": seen.found, "added": added}
    composite = source.render(pixels, antialias=True)
    if np.asarray(image).ndim == 2:
        composite = composite[..., 0]
    stages = {"known": made.stages["known"], "patches": made.stages["patches"], "composite": composite}
    return Synthesis(composite, source, stages, report)


def add_sizes(shape: tuple[int, int], added: Mapping[str, int]) -> tuple[int, int]:
    """Return the size of a picture with what is added on its sides."""
    return shape[0] + added["top"] + added["bottom"], shape[1] + added["left"] + added["right"]


def measure_room(plane: Plane, added: Mapping[str, int], axis: int) -> tuple[int, int]:
    """Return by how many pixels a picture can go on before and after it along an axis, up to the horizon, `MOST` at most."""
    low = -np.array([added["top"], added["left"]])
    high = np.array(plane.shape) - 1 + np.array([added["bottom"], added["right"]])
    low[axis], high[axis] = 0, plane.shape[axis] - 1
    corners = np.array([[y, x] for y in (low[0], high[0]) for x in (low[1], high[1])], np.float64)
    step = np.zeros(2)
    step[axis] = 1.0
    # Widths grow evenly along each axis.
    rise = float(np.diff(plane.width(np.stack([np.zeros(2), step])))[0])
    found = []
    for end, sign in ((low, -1), (high, 1)):
        width = float(plane.width(corners[corners[:, axis] == end[axis]]).min())
        fall = -sign * rise
        found.append(MOST if fall <= 0 else int(min(MOST, max(0.0, (width - LEAST) / fall * 0.999))))
    return found[0], found[1]
