"""The flat texture of a photographed oblique plane.

The plane is flattened at one resolution. Parts that would be blurred, because they are too far away or too much
foreshortened, are not used. The largest rectangle of the rest is the texture. A larger or tileable one is grown from
it. The source map refers to the photograph, so any map in register with it is rectified in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_choice, as_float, as_image, as_ndarray, as_seed, as_size, as_wrap, check_work, guidance
from texrs._progress import answering, listen
from texrs._typing import Array, Bools, Interpolation, Progress
from texrs._verbs import takes_materials
from texrs.blending import apply
from texrs.errors import InvalidInput
from texrs.materials import Material
from texrs.planes import Plane, PlaneView
from texrs.planes.choose import see
from texrs.source_map import SourceMap
from texrs.synthesis import Synthesis
from texrs.tiling import tile

__all__ = ["rectify"]

SHARP = 0.5
"""Minimum number of photograph pixels per texture pixel for a sharp result, along the direction with the fewest."""
SMALLEST = 32
"""Minimum side of the flat texture, in pixels."""
LEAST = 0.05
"""Minimum scale that is used, as a share of the scale in the middle. Smaller scales are near the horizon."""
LARGER = 8
"""Maximum number of pixels of the flattened plane, as a multiple of the photograph's."""
SHOWN = 640
"""Maximum side of the first flattened image, in pixels."""
CELLS = 160
"""Number of cells along each side of the lattice that is searched for the largest rectangle."""
COURSES = 0.35
"""Minimum agreement of edges in two perpendicular directions. Above it, the texture is rotated to level them."""


@takes_materials("image")
def rectify(
    image: Array | Material,
    *,
    view: PlaneView | Plane | None = None,
    resolution: float | None = None,
    size: int | Sequence[int] | None = None,
    wrap: bool | Sequence[bool] | None = None,
    seed: int = 0,
    interpolation: Interpolation = "cubic",
    progress: Progress | bool | None = None,
) -> Synthesis:
    """Make a flat texture from a photograph of an oblique plane.

    Parameters
    ----------
    image : (H, W) or (H, W, C) array
        The photograph, of any real dtype, at least 64 pixels a side.
    view : PlaneView or Plane, optional
        Position of the plane in the photograph, as far as it is known. The rest is found.
    resolution : float, optional
        Pixels of the texture for one pixel in the middle of the photograph, 0.05 to 8. Default: the median scale of
        the visible plane, or less if the flattened plane would be too large.
    size : int or (rows, columns), optional
        Size of the texture, in pixels. A texture that is larger than the largest sharp rectangle is synthesised from
        the rectangle. A smaller size is the middle of the rectangle. Default: the size of the rectangle.
    wrap : bool or (rows, columns), optional
        Axes along which the texture will be tileable (`texrs.tile`). Default: none.
    seed : int
        Seed of the random choices of the synthesis. Default: 0.
    interpolation : {"cubic", "linear", "nearest"}
        Interpolation between pixels of the photograph. Default: "cubic".
    progress : callable or True, optional
        Called as ``progress(stage, share)`` with the completed share of the stage. An exception that it raises stops
        the work. True shows a bar. Default: no reports.

    Returns
    -------
    Synthesis
        The texture, in the dtype and with the channels of the photograph. Its source map refers to the photograph,
        with the frames of the plane, which also rotate normals. The stages are ``"flat"`` (the visible part of the
        plane), ``"sharp"`` (the part that is used), and ``"before_blending"``. The report contains the plane.

        Stages:

        - ``flat``: The visible part of the plane, flattened.
        - ``sharp``: The part of the flattened plane that is sharp enough.
        - ``before_blending``: The result before seams are corrected.

        Report:

        - ``plane``: ``slant``, ``tilt``, ``fov`` and ``rotation`` in degrees, the ``shape`` of the image in pixels and
          the ``confidence``, 0 to 1.
        - ``found``: Whether the plane was found in the image.
        - ``resolution``: Pixels of the texture for one pixel in the middle of the photograph.
        - ``sharp``: Share of the flattened plane that is sharp enough.
        - ``rectangle``: (rows, columns) of the largest sharp rectangle.
        - ``grown``: Method that made the result from the rectangle: ``"nothing"``, ``"tile"`` or ``"design"``.
        - ``wrap``: Whether the result repeats along (rows, columns).
        - ``seed``: The seed.
        - ``interpolation``: Interpolation between pixels of the photograph.

    Raises
    ------
    InvalidInput
        If options are out of their ranges, the plane is described twice, or too little of it is sharp.

    Warns
    -----
    UserWarning
        If the plane is found with a confidence below 0.4: give corners or angles.

    Examples
    --------
    >>> import texrs
    >>> floor = texrs.samples.tilted_discs((192, 192))
    >>> flat = texrs.rectify(floor.image, view=texrs.PlaneView(slant=50, fov=53))
    >>> flat.source_map.shapes, flat.report["plane"]["slant"]
    (((192, 192),), 50.0)

    """
    progress = listen(progress)
    image = as_ndarray(image, "image")
    pixels = as_image(image, minimum=64)
    watch = progress or (lambda stage, share: None)
    cyclic, number = as_wrap(wrap, usual=False), as_seed(seed)
    asked = None if size is None else as_size(size, minimum=SMALLEST)
    fine = None if resolution is None else as_float(resolution, "resolution", 0.05, 8)
    as_choice(interpolation, "interpolation", ("nearest", "linear", "cubic"))
    check_work("rectify", [pixels], asked or pixels.shape[:2], "image" if asked is None else "size")
    watch("plane", 0.0)
    with answering(progress, "plane", 0.0):
        seen = see(pixels, PlaneView.of(view))
    watch("plane", 1.0)
    plane = seen.plane
    fine = _choose_resolution(plane, seen.ground, fine)
    sheet = _FlatSheet.of(plane, seen.ground, fine)
    if seen.found:
        # A found plane has an arbitrary rotation, so level its courses.
        plane = _level(plane, sheet.source.render(pixels, interpolation="linear"), sheet.sharp)
        sheet = _FlatSheet.of(plane, seen.ground, fine)
    start, sides = sheet.find_rectangle()
    if min(sides) < SMALLEST:
        raise InvalidInput(
            f"image: must show at least {SMALLEST} x {SMALLEST} sharp pixels of the plane, got {sides[0]} x {sides[1]}; give "
            "a smaller resolution, or another plane"
        )
    # Render only the sharp rectangle at the full resolution.
    known, _ = _lay(plane, start, sides, fine)
    texture = known.render(pixels, interpolation=interpolation, antialias=True)
    laid, grown = _grow(texture, asked, cyclic, number, watch)
    # Correct the seams of a grown texture with the options of the verb that grew it.
    rest = {} if laid.finish is None else {"screening": laid.finish.screening, "across": laid.finish.across}
    source = laid.compose(known).with_finish(cyclic, interpolation=interpolation, antialias=True, **rest)
    # A texture that was not grown does not have to be rendered again.
    as_it_is = source.shape == known.shape and not any(cyclic)
    composite = texture if as_it_is else source.render(pixels, interpolation=interpolation, antialias=True)
    squeeze = image.ndim == 2
    shown = apply(source, pixels, progress=watch) if rest.get("screening") else composite
    stages = {
        "flat": sheet.source.render(pixels, interpolation="linear"),
        "sharp": sheet.sharp,
        "before_blending": composite[..., 0] if squeeze else composite,
    }
    report: dict[str, Any] = {
        "plane": plane.as_dict(),
        "found": seen.found,
        "resolution": round(fine, 6),
        "sharp": round(float(sheet.sharp.mean()), 4),
        "rectangle": list(sides),
        "grown": grown,
        "wrap": list(cyclic),
        "seed": number,
        "interpolation": interpolation,
    }
    return Synthesis(shown[..., 0] if squeeze and shown.ndim == 3 else shown, source, stages, report)


def _list_points(ground: Bools) -> NDArray[np.intp]:
    """Return the outermost ground pixels of an image and a sample of the others: enough to measure a plane."""
    step = max(1, min(ground.shape) // 256)
    thin = np.zeros_like(ground)
    thin[::step, ::step] = thin[[0, -1]] = thin[:, [0, -1]] = True
    return np.argwhere(ground & thin)


def _choose_resolution(plane: Plane, ground: Bools, asked: float | None) -> float:
    """Return the requested resolution, or the median scale of the visible plane."""
    width = plane.width(_list_points(ground))
    if np.count_nonzero(width > LEAST) < SMALLEST:
        raise InvalidInput(
            "ground: must contain more of the plane in front of its horizon; give another mask, or another plane"
        )
    resolution = asked or float(np.median(width[width > LEAST]))
    while True:
        low, high = _measure_extent(plane, ground, resolution)
        most = (LARGER * ground.size / max(float(np.prod(high - low)), 1e-9)) ** 0.5
        if resolution <= most:
            return resolution
        if asked is not None:
            raise InvalidInput(f"resolution: must be at most {most:.3g} for this plane, got {resolution:.3g}")
        # Reduce the resolution by 10 % more than needed, because at a coarser resolution a larger part of the plane is
        # sharp.
        resolution = 0.9 * most


def _measure_extent(plane: Plane, ground: Bools, resolution: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the minimum and maximum (row, column) of the part of a plane that may be sharp."""
    grid = _list_points(ground)
    near = grid[plane.width(grid) > max(LEAST, SHARP * resolution)]
    if len(near) < SMALLEST:
        raise InvalidInput(
            f"resolution: must be smaller for this plane, got {resolution:.3g}; almost no part of the plane is sharp"
        )
    points = plane.flatten(near)
    return points.min(axis=0), points.max(axis=0)


@dataclass(frozen=True, slots=True)
class _FlatSheet:
    """The part of a plane that may be sharp, flattened at a distance of several texture pixels."""

    source: SourceMap
    sharp: Bools
    low: NDArray[np.float64]
    """Point of the plane at the first pixel."""
    step: int
    resolution: float
    """Resolution of the texture."""

    @classmethod
    def of(cls, plane: Plane, ground: Bools, resolution: float) -> _FlatSheet:
        """Flatten a plane, and find where it is sharp enough for a resolution."""
        from scipy.ndimage import minimum_filter

        low, high = _measure_extent(plane, ground, resolution)
        sides = (high - low) * resolution
        step = max(1, ceil(float(sides.max()) / SHOWN))
        source, inside = _lay(plane, low, (int(sides[0] / step) + 1, int(sides[1] / step) + 1), resolution / step)
        # Pixels between the samples of the coarse sheet must also be ground.
        solid = ground if step == 1 or ground.all() else minimum_filter(ground, 2 * step + 1)
        nearest = np.rint(source.coordinates).astype(np.intp)
        inside &= solid[nearest[..., 0], nearest[..., 1]]
        # The smallest singular value of a frame is the minimum number of photograph pixels that a texture pixel
        # covers.
        frames = source.jacobians()
        squares, area = np.square(frames).sum(axis=(-2, -1)), _cross(frames[..., 0, :], frames[..., 1, :])
        fewest = np.sqrt(np.maximum(squares - np.sqrt(np.maximum(squares**2 - 4 * area**2, 0)), 0) / 2)
        return cls(source, np.asarray(inside & (fewest >= SHARP * step)), low, step, resolution)

    def find_rectangle(self) -> tuple[NDArray[np.float64], tuple[int, int]]:
        """Return the first point of approximately the largest sharp rectangle, and its sides in texture pixels."""
        top, bottom, left, right = _find_rectangle(self.sharp)
        start = self.low + np.array([top, left]) * (self.step / self.resolution)
        rows, columns = (max(0, (n - 1) * self.step + 1) for n in (bottom - top, right - left))
        return start, (rows, columns)


def _cross(one: Array, other: Array) -> Array:
    """Return the area between vectors (..., 2)."""
    return np.asarray(one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


def _lay(plane: Plane, low: NDArray[np.float64], sides: tuple[int, int], resolution: float) -> tuple[SourceMap, Bools]:
    """Return the map of a rectangle of a plane, and its position within the photograph."""
    most = np.array(plane.shape) - 1
    flat = low + np.moveaxis(np.indices(sides), 0, -1) / resolution
    with np.errstate(invalid="ignore", divide="ignore"):
        at, frames = plane.project(flat), plane.projection_jacobians(flat) / resolution
        inside: Bools = np.asarray(((at >= 0) & (at <= most)).all(axis=-1))
    at[~inside], frames[~inside] = 0, np.eye(2)
    return SourceMap.from_coordinates(at.astype(np.float32), plane.shape, jacobian=frames.astype(np.float32)), inside


def _level(plane: Plane, flat: Array, sharp: Bools) -> Plane:
    """Rotate a plane so that courses of its flat texture, if there are any, are along an axis."""
    from scipy.ndimage import binary_erosion, gaussian_filter

    light = guidance(flat).mean(axis=-1, dtype=np.float64)
    rows, columns = np.gradient(gaussian_filter(light, 1.5))
    slope = (columns - 1j * rows)[binary_erosion(sharp, iterations=4)]
    energy = np.abs(slope) ** 2
    total = float(energy.sum())
    if total < 1e-9 * max(1, energy.size):
        return plane
    fourth = complex((slope**4 / np.maximum(energy, 1e-300)).sum()) / total
    if abs(fourth) < COURSES:
        return plane
    return replace(plane, rotation=float(f"{plane.rotation - np.degrees(np.angle(fourth)) / 4:.5g}"))


def _find_rectangle(mask: Bools) -> tuple[int, int, int, int]:
    """Return the rows and columns of approximately the largest rectangle of full cells in a mask."""
    step = max(1, -(-max(mask.shape) // CELLS))
    rows, columns = (n // step for n in mask.shape)
    cells = np.asarray(mask[: rows * step, : columns * step].reshape(rows, step, columns, step).all(axis=(1, 3)))
    heights: NDArray[np.intp] = np.zeros(columns + 1, np.intp)
    best = (0, 0, 0, 0, 0)
    for row in range(rows):
        heights[:-1] = np.where(cells[row], heights[:-1] + 1, 0)
        # Keep a stack of columns with growing heights. A column gives a rectangle over all columns where it is the
        # lowest.
        open_: list[tuple[int, int]] = []
        for column, height in enumerate(heights.tolist()):
            start = column
            while open_ and open_[-1][1] >= height:
                start, tall = open_.pop()
                best = max(best, (tall * (column - start), row + 1 - tall, row + 1, start, column))
            open_.append((start, height))
    _, top, bottom, left, right = best
    return top * step, bottom * step, left * step, right * step


def _cut(source: SourceMap, box: tuple[slice, slice]) -> SourceMap:
    """Return a rectangle of a map."""
    return SourceMap.from_coordinates(source.coordinates[box], source.shapes[0], jacobian=source.jacobians()[box])


def _grow(
    flat: Array, size: tuple[int, ...] | None, wrap: tuple[bool, ...], seed: int, watch: Progress
) -> tuple[SourceMap, str]:
    """Return the map of a texture of any size, tileable or not, into a flat one, and the method."""
    shape = (flat.shape[0], flat.shape[1])
    if any(wrap):
        made = tile(flat, wrap=wrap, size=size, progress=watch)
        return made.source_map, "tile"
    if size is None or size == shape:
        return SourceMap.identity(shape), "nothing"
    if all(n <= m for n, m in zip(size, shape, strict=True)):
        places = [slice((m - n) // 2, (m - n) // 2 + n) for n, m in zip(size, shape, strict=True)]
        return _cut(SourceMap.identity(shape), (places[0], places[1])), "nothing"
    from texrs.papers.design import design

    return design(flat, size, seed=seed, wrap=False, progress=watch).source_map, "design"
