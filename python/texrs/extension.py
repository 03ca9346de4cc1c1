"""Extension of a photographed plane beyond the image borders, in the same perspective.

The area beyond the borders is a hole. It is filled by example from the plane in the image, as in `texrs.remove`. The
plane is given or found.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from texrs._arrays import as_bool, as_float, as_image, as_int, as_ndarray, as_seed, as_size, check_work
from texrs._progress import answering, listen
from texrs._typing import Array, Progress
from texrs._verbs import takes_materials
from texrs.blending import apply
from texrs.errors import InvalidInput
from texrs.inpainting.planes import LEAST, Part, add_rest, fill_parts
from texrs.materials import Material
from texrs.planes import Plane, PlaneView
from texrs.planes.choose import as_views, find_grounds, follow_plane
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis

__all__ = ["extend"]

MOST = 8192
"""Maximum number of pixels to add on a side."""


@takes_materials("image")
def extend(
    image: Array | Material,
    *,
    top: int = 0,
    bottom: int = 0,
    left: int = 0,
    right: int = 0,
    size: int | Sequence[int] | None = None,
    view: PlaneView | Plane | Sequence[PlaneView | Plane] | None = None,
    boundary_width: int = 0,
    screening: float | None = 0.1,
    match_lighting: bool = True,
    seed: int = 0,
    progress: Progress | bool | None = None,
) -> Synthesis:
    """Extend a photograph of a plane on any side, in the same perspective.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        The photograph, of any real dtype, at least 64 pixels a side.
    top : int
        Pixels to add at the top, 0 to 8192. Unless ``size`` is given, at least one side must be above 0. Nothing is
        added beyond the horizon. Default: 0.
    bottom : int
        Pixels to add at the bottom, 0 to 8192. Default: 0.
    left : int
        Pixels to add on the left, 0 to 8192. Default: 0.
    right : int
        Pixels to add on the right, 0 to 8192. Default: 0.
    size : int or (rows, columns), optional
        Size of the larger image, in pixels. Pixels beyond those requested for single sides are distributed evenly over
        opposite sides. If one side would pass the horizon, the other side takes the rest.
    view : PlaneView or Plane, or a sequence of them, optional
        Position of the plane in the photograph, as far as it is known. The rest is found. If the result is uncertain,
        or the plane is seen from the front, patches are copied without a change of scale. Background such as the sky
        above a floor continues, but objects on the plane do not. Several planes, such as a floor and a wall, continue
        separately up to the line where they meet. Only one of them may lack a ground.
    boundary_width : int
        Width of the band along the photograph's border that may change to hide the border, in pixels, 0 to 64.
        Default: 0.
    screening : float, optional
        Weight of the original values in the colour correction of the added pixels, as in `texrs.inpaint`. None or 0:
        no correction. Default: 0.1.
    match_lighting : bool
        If True, the added pixels follow gradual changes of light, such as towards a window. Beyond the photograph, the
        light is the same as at the border. Default: True.
    seed : int
        Seed of the random choices. Default: 0.
    progress : callable or True, optional
        Called as ``progress(stage, share)`` with the completed share of the stage. An exception that it raises stops
        the work. True shows a bar.

    Returns
    -------
    Synthesis
        The larger image, in the dtype and with the channels of the photograph. No pixel of the photograph changes,
        except within ``boundary_width``. Its source map refers to the photograph. The report contains the planes and
        the added pixels.

        Stages:

        - ``known``: The image with the marked part in one colour.
        - ``ground``: The planes, each in its own shade.
        - ``patches``: The patches, each in its own shade.
        - ``before_blending``: The result before colours are corrected.

        Report:

        - ``added``: Pixels at the ``top``, ``bottom``, ``left`` and ``right``.
        - ``patches``: For each plane, the number of patches.
        - ``replaced_outside``: Number of known pixels that changed.
        - ``boundary_width``: Width of the band that could change, in pixels.
        - ``screening``: Weight of the values in the colour correction.
        - ``match_lighting``: Whether added pixels follow gradual changes of light.
        - ``seed``: The seed.
        - ``planes``: For each plane: ``plane`` with its slant, tilt and angle of view, and whether it was ``found`` in
          the image.
        - ``ground``: For each plane, the share of the image where it is visible.

    Raises
    ------
    InvalidInput
        If options are out of their ranges, nothing is added, the plane is described twice, or the image would reach
        the horizon.

    Warns
    -----
    UserWarning
        If a plane is found with a confidence below 0.4. It is not used; give corners or angles.

    Examples
    --------
    >>> import texrs
    >>> floor = texrs.samples.tilted_discs((128, 128))
    >>> larger = texrs.extend(floor.image, right=64, view=texrs.PlaneView(slant=35, fov=60), seed=1)
    >>> larger.image.shape, bool((larger.image[:, :128] == floor.image).all())
    ((128, 192, 3), True)

    """
    progress = listen(progress)
    image = as_ndarray(image, "image")
    pixels = as_image(image, minimum=64)
    rows, columns = pixels.shape[:2]
    added = {
        name: as_int(value, name, 0, MOST)
        for name, value in (("top", top), ("bottom", bottom), ("left", left), ("right", right))
    }
    sides = _add_sizes((rows, columns), added) if size is None else as_size(size, "size")
    missing = [n - m for n, m in zip(sides, _add_sizes((rows, columns), added), strict=True)]
    if min(missing) < 0 or max(missing) > 2 * MOST:
        raise InvalidInput(
            f"size: must be at least {_add_sizes((rows, columns), added)} pixels, and at most {2 * MOST} pixels larger, "
            f"got {sides}"
        )
    if sides == (rows, columns):
        raise InvalidInput("top, bottom, left, right: at least one must be above 0")
    check_work("extend", [pixels], sides, "top, bottom, left, right" if size is None else "size")
    screening = as_float(0.0 if screening is None else screening, "screening", 0, 1e6)
    rim, number, follow = (
        as_int(boundary_width, "boundary_width", 0, 64),
        as_seed(seed),
        as_bool(match_lighting, "match_lighting"),
    )
    watch = progress or (lambda stage, share: None)
    views = as_views(view)
    settled = [v.settle((rows, columns)) for v in views]
    watch("plane", 0.0)
    with answering(progress, "plane", 0.0):
        grounds = find_grounds(pixels, settled, np.ones((rows, columns), np.bool_), everywhere=True)
        planes = [
            follow_plane(pixels, ground, said, v.fov)
            for v, (said, _), ground in zip(views, settled, grounds, strict=True)
        ]
    watch("plane", 1.0)
    # If no other part of the image, such as a sky, continues, nothing can be added beyond the horizon of the plane.
    alone = len(add_rest([Part(ground) for ground in grounds], np.zeros((rows, columns), np.bool_), pixels)) == 1
    for axis, before, after in ((1, "left", "right"), (0, "top", "bottom")):
        added[before] += missing[axis] // 2
        added[after] += missing[axis] - missing[axis] // 2
        room = (MOST, MOST) if planes[0][0] is None else _measure_room(planes[0][0], added, axis)
        if alone and missing[axis] and sum(room) >= added[before] + added[after]:
            over = max(0, added[before] - room[0]) - max(0, added[after] - room[1])
            added[before], added[after] = added[before] - over, added[after] + over
    # Place the photograph on a larger canvas, whose other pixels are one hole.
    first = np.array([added["top"], added["left"]])
    inner = (slice(first[0], first[0] + rows), slice(first[1], first[1] + columns))
    canvas, hole = np.zeros((*sides, pixels.shape[2]), pixels.dtype), np.ones(sides, np.bool_)
    canvas[inner], hole[inner] = pixels, False
    parts = []
    for shown, (plane, _) in zip(grounds, planes, strict=True):
        ground = np.zeros(sides, np.bool_)
        ground[inner] = shown
        parts.append(Part.of(ground, plane, (-added["top"], -added["left"])))
    parts = add_rest(parts, hole, canvas)
    reach = parts[0].reach
    if len(parts) == 1 and reach is not None and (hole & ~reach).any():
        raise InvalidInput(
            "top, bottom, left, right: the image would reach the horizon of the plane; add fewer pixels, or give "
            "another view"
        )
    made = fill_parts(canvas, hole, parts, boundary=rim, light=follow, seed=number, progress=progress)
    lit = (-added["top"], -added["left"]) if follow else None
    # Change the source map from positions on the canvas to positions in the photograph. All sources are inside it.
    places = np.moveaxis(np.indices(sides), 0, -1) - first
    inside = np.clip(places, 0, [rows - 1, columns - 1]).astype(np.float32)
    source = made.source.compose(SourceMap.from_coordinates(inside, (rows, columns)))
    source = source.with_finish((False, False), antialias=True, **made.finish(screening, lit))
    result = apply(source, pixels, progress=progress)
    watch("done", 1.0)
    stages = made.show(canvas, hole) | {"before_blending": source.render(pixels, antialias=True)}
    if image.ndim == 2:
        result = result.reshape(sides)
        stages |= {name: stages[name].reshape(sides) for name in ("known", "before_blending")}
    report: dict[str, Any] = {
        "added": added,
        "patches": list(made.counts),
        "replaced_outside": int(np.count_nonzero(made.replaced & ~hole)),
        "boundary_width": rim,
        "screening": screening,
        "match_lighting": follow,
        "seed": number,
        "planes": [{"plane": None if plane is None else plane.as_dict(), "found": found} for plane, found in planes],
        "ground": [round(float(ground.mean()), 4) for ground in grounds],
    }
    return Synthesis(result, source, stages, report)


def _add_sizes(shape: tuple[int, int], added: Mapping[str, int]) -> tuple[int, int]:
    """Return the sides of an image with the added pixels."""
    return shape[0] + added["top"] + added["bottom"], shape[1] + added["left"] + added["right"]


def _measure_room(plane: Plane, added: Mapping[str, int], axis: int) -> tuple[int, int]:
    """Return the pixels that can be added on both ends of an axis, up to the horizon and at most `MOST`."""
    low = -np.array([added["top"], added["left"]])
    high = np.array(plane.shape) - 1 + np.array([added["bottom"], added["right"]])
    low[axis], high[axis] = 0, plane.shape[axis] - 1
    corners = np.array([[y, x] for y in (low[0], high[0]) for x in (low[1], high[1])], np.float64)
    step = np.zeros(2)
    step[axis] = 1.0
    # Widths of elements change linearly along an axis, so the difference of two widths is the rate everywhere.
    rise = float(np.diff(plane.width(np.stack([np.zeros(2), step])))[0])
    found = []
    for end, sign in ((low, -1), (high, 1)):
        width = float(plane.width(corners[corners[:, axis] == end[axis]]).min())
        fall = -sign * rise
        found.append(MOST if fall <= 0 else int(min(MOST, max(0.0, (width - LEAST) / fall * 0.999))))
    return found[0], found[1]
