"""Render images of volumes: slices, oblique slices, a solid block, and a turntable animation."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import cos, radians, sin
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_float, as_image, as_int, as_size, as_tuple, guidance, try_array
from texrs._conversion import as_ndarray
from texrs._progress import answering, ask, listen
from texrs._typing import Array, Floats, Interpolation, Path, Progress
from texrs.errors import FileError, InvalidInput, LimitExceeded
from texrs.io import atomic
from texrs.io.files import as_path
from texrs.kernels.gather import gather
from texrs.volume.values import as_direction

__all__ = ["oblique_slice", "render_block", "slices", "turntable"]

_LARGEST = 4096
"""Maximum side of an image of a block, in pixels."""
_MOST = 2**26
"""Maximum number of pixels of all frames of a turntable."""
_MARGIN = 1.04
_FINE = 3
"""Number of rays per pixel along each side."""
_BAND = 16
"""Number of image rows that are rendered at once."""
_LIGHT = np.array([0.86, 1.0, 0.72], np.float32)
"""Brightness of the faces perpendicular to planes, rows and columns. The light comes from above."""


def slices(volume: ArrayLike, at: Sequence[int] | None = None, *, gap: int = 2) -> Array:
    """Return an image of three slices side by side: one plane, one slice across the rows and one across the columns.

    Parameters
    ----------
    volume : array_like
        Volume of shape (D, H, W) or (D, H, W, C).
    at : sequence of 3 int, optional
        Plane, row and column of the slices. Negative numbers count from the end. Default: the middle of the volume.
    gap : int
        Width of the gaps between the slices, in pixels. Gaps and unused areas are white (the largest value). Default:
        2.

    Returns
    -------
    ndarray
        Image in the dtype of the volume. The first slice shows rows and columns, the second planes and columns, and
        the third planes and rows.

    Raises
    ------
    InvalidInput
        The volume is invalid, or a slice is outside it.

    Examples
    --------
    >>> from texrs import samples, volume
    >>> volume.slices(samples.stripes((32, 40, 48)).image).shape
    (40, 140, 3)

    """
    volume = as_ndarray(volume, "volume", axes=3)
    v = as_image(volume, "volume", axes=3)
    places = [n // 2 for n in v.shape[:3]] if at is None else list(as_tuple(at, "at", 3, "plane, row and column"))
    places = [as_int(p, "at", -n, n - 1) for p, n in zip(places, v.shape[:3], strict=True)]
    space = as_int(gap, "gap", 0, 1024)
    cuts = [np.take(v, place, axis=axis) for axis, place in enumerate(places)]
    height = max(c.shape[0] for c in cuts)
    width = sum(c.shape[1] for c in cuts) + 2 * space
    white = np.iinfo(v.dtype).max if v.dtype.kind in "ui" else max(1.0, float(v.max())) if v.dtype.kind == "f" else True
    out = np.full((height, width, v.shape[3]), white, v.dtype)
    left = 0
    for cut in cuts:
        out[: cut.shape[0], left : left + cut.shape[1]] = cut
        left += cut.shape[1] + space
    return out if np.ndim(volume) == 4 else out[..., 0]


def oblique_slice(
    volume: ArrayLike,
    point: Sequence[float] | None = None,
    normal: Sequence[float] | None = None,
    *,
    axes: ArrayLike | None = None,
    size: int | Sequence[int] | None = None,
    interpolation: Interpolation = "linear",
) -> Array:
    """Return the slice of a volume along an oblique plane.

    Parameters
    ----------
    volume : array_like
        Volume of shape (D, H, W) or (D, H, W, C).
    point : sequence of 3 float, optional
        (plane, row, column) of a point of the slice, in voxels. Default: the centre of the volume.
    normal : sequence of 3 float, optional
        Normal (plane, row, column) of the slice. The columns of the image are as parallel as possible to the columns
        of the volume, or to its rows if the normal points along the columns. Give either ``normal`` or ``axes``.
    axes : (2, 3) array_like, optional
        Steps (plane, row, column), in voxels, from one row and from one column of the image to the next. They replace
        ``normal``. Default: None.
    size : int or (rows, columns), optional
        Size of the image in pixels, with the point at its centre. Default: large enough for the whole slice.
    interpolation : {"linear", "cubic", "nearest"}
        Interpolation between voxels. Use "nearest" for labels. Default: "linear".

    Returns
    -------
    ndarray
        Image in the dtype of the volume, with 0 outside the volume.

    Raises
    ------
    InvalidInput
        The volume, the point or the direction is invalid, or the slice does not meet the volume.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> ramp = np.arange(20)[:, None, None] * np.ones((20, 20, 20), np.float32)
    >>> cut = volume.oblique_slice(ramp, (10, 10, 10), normal=(1, 1, 0))
    >>> cut.shape  # from corner to corner across, and a side
    (25, 20)

    """
    volume = as_ndarray(volume, "volume", axes=3)
    v = as_image(volume, "volume", axes=3)
    shape = np.array(v.shape[:3])
    middle = (shape - 1) / 2 if point is None else as_direction(point, "point")
    steps = as_steps(normal, axes)
    if size is None:
        low, high = _clip_ray(steps, middle, shape)
        start, sides = np.ceil(low), tuple((np.floor(high) - np.ceil(low) + 1).astype(int).tolist())
        if min(sides) < 1:
            raise InvalidInput("point, normal: must specify a slice that crosses the volume")
    else:
        sides = as_size(size, "size")
        start = -(np.array(sides) - 1) / 2
    as_size(sides, "size")
    rows, columns = (s + np.arange(n) for s, n in zip(start, sides, strict=True))
    out = np.zeros((*sides, v.shape[3]), v.dtype)
    for top in range(0, sides[0], 256):
        part = slice(top, top + 256)
        at = middle + rows[part, np.newaxis, np.newaxis] * steps[0] + columns[:, np.newaxis] * steps[1]
        inside = ((at >= -0.5) & (at <= shape - 0.5)).all(axis=-1)
        found = gather(v, np.clip(at, 0, shape - 1), interpolation=interpolation)
        out[part] = np.where(inside[..., np.newaxis], found, np.zeros((), v.dtype))
    return out if np.ndim(volume) == 4 else out[..., 0]


def render_block(
    volume: ArrayLike,
    size: int = 512,
    *,
    azimuth: float = 40,
    elevation: float = 30,
    interpolation: Interpolation = "linear",
) -> NDArray[np.uint8]:
    """Render a volume as a solid block, seen from the front, the right and above.

    The front is plane 0. The face to its right is the last column, and the face above is row 0.

    Parameters
    ----------
    volume : array_like
        Volume of shape (D, H, W) or (D, H, W, C). Transparent voxels are shown over mid grey. If there are more than 4
        channels, only the first 3 are shown.
    size : int
        Longer side of the image in pixels, 16 to 4096. Default: 512.
    azimuth : float
        Angle of the view to the right of the front, in degrees. If 0, the right face is not visible. Default: 40.
    elevation : float
        Angle of the view above the front, in degrees, -90 to 90. Default: 30.
    interpolation : {"linear", "cubic", "nearest"}
        Interpolation between voxels. "nearest" shows each voxel as a square. Default: "linear".

    Returns
    -------
    ndarray
        Image of shape (rows, columns, 4), uint8: antialiased colours, and alpha 0 outside the block.

    Raises
    ------
    InvalidInput
        The volume or an angle is invalid.

    Examples
    --------
    >>> from texrs import samples, volume
    >>> picture = volume.render_block(samples.wood_solid((32, 32, 32)).image, 128)
    >>> picture.shape[1:], picture[0, 0, 3], picture[60, 60, 3]
    ((115, 4), np.uint8(0), np.uint8(255))

    """
    longer, around, above = check_cube(size, azimuth, elevation)
    view = _view(around, above)
    colours = guidance(as_image(volume, "volume", axes=3))
    half = np.array(colours.shape[:3]) / 2
    reach = np.abs(view[:2]) @ half * _MARGIN
    pixel = 2 * reach.max() / longer
    sides = np.maximum(np.ceil(2 * reach / pixel - 1e-6), 1).astype(int)
    return _render(colours, view, (int(sides[0]), int(sides[1])), float(pixel), interpolation)


def turntable(
    volume: ArrayLike,
    path: Path,
    *,
    frames: int = 24,
    size: int = 320,
    elevation: float = 25,
    seconds: float = 4,
    background: Sequence[int] = (255, 255, 255),
    interpolation: Interpolation = "linear",
    overwrite: bool = True,
    progress: Progress | bool | None = None,
) -> None:
    """Write an animated GIF of a rotating volume, in an endless loop.

    Parameters
    ----------
    volume : array_like
        Volume of shape (D, H, W) or (D, H, W, C). Transparent voxels are shown over mid grey. If there are more than 4
        channels, only the first 3 are shown.
    path : path_like
        File with the suffix .gif. If writing fails, an existing file is unchanged.
    frames : int
        Number of frames per turn, 2 to 360. Default: 24.
    size : int
        Side of the image in pixels, 16 to 1024. Default: 320.
    elevation : float
        Angle of the view above the front, in degrees, -90 to 90. Default: 25.
    seconds : float
        Duration of a turn in seconds, 0.1 to 600. Default: 4.
    background : sequence of 3 int
        Red, green and blue of the background, 0 to 255 each. Default: white.
    interpolation : {"linear", "cubic", "nearest"}
        Interpolation between voxels. "nearest" shows each voxel as a square. Default: "linear".
    overwrite : bool
        If True, an existing file is replaced. Default: True.
    progress : callable or True, optional
        Function that is called with the name of the stage and its completed share, 0 to 1. An exception that it raises
        stops the work. True shows a progress bar. Default: None.

    Raises
    ------
    InvalidInput
        The volume is invalid, or a number is out of its range.
    LimitExceeded
        All frames together have more than 2^26 pixels.
    FileError
        The suffix is not .gif, or the file cannot be written.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> from texrs import samples, volume
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = pathlib.Path(folder, "turn.gif")
    ...     volume.turntable(samples.stripes((32, 32, 32)).image, path, frames=3, size=64)
    ...     path.read_bytes()[:6]
    b'GIF89a'

    """
    progress = listen(progress)
    from PIL import Image

    count, side, above, period = check_turntable(frames, size, elevation, seconds)
    if as_path(path).suffix.lower() != ".gif":
        raise FileError(f"{path}: the suffix must be .gif")
    shade = as_tuple(background, "background", 3, "three integers")
    ground = np.array([as_int(b, "background", 0, 255) for b in shade], np.float32)
    colours = guidance(as_image(volume, "volume", axes=3))
    half = np.array(colours.shape[:3]) / 2
    # Choose the scale so that the volume fits into the image in every view.
    wide = float(np.hypot(half[0], half[2]))
    tall = abs(cos(radians(above))) * half[1] + abs(sin(radians(above))) * wide
    pixel = 2 * max(wide, float(tall)) * _MARGIN / side
    pictures = []
    with atomic(path, overwrite=overwrite) as temporary:
        for i in range(count):
            if progress is not None:
                progress("turning", i / count)
            with answering(progress, "turning", i / count):
                seen = _render(colours, _view(360 * i / count, above), (side, side), pixel, interpolation)
            alpha = seen[..., 3:] / np.float32(255)
            pictures.append(np.rint(seen[..., :3] * alpha + ground * (1 - alpha)).astype(np.uint8))
        # Use one palette for all frames, because different palettes would flicker.
        few = Image.fromarray(np.concatenate(pictures[:: max(1, count // 6)]))
        palette = few.quantize(256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
        images: list[Any] = []
        for picture in pictures:
            if progress is not None:
                progress("turning", 1.0)
            images.append(Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE))
        duration = max(20, round(1000 * period / count))
        images[0].save(
            temporary, format="GIF", save_all=True, append_images=images[1:], duration=duration, loop=0, optimize=False
        )
    if progress is not None:
        progress("turning", 1.0)


def check_cube(size: int = 512, azimuth: float = 40, elevation: float = 30) -> tuple[int, float, float]:
    """Check the options of `render_block` before the volume is read, and raise the same errors."""
    turned = as_float(azimuth, "azimuth", -1e6, 1e6), as_float(elevation, "elevation", -90, 90)
    return as_int(size, "size", 16, _LARGEST), *turned


def check_turntable(
    frames: int = 24, size: int = 320, elevation: float = 25, seconds: float = 4
) -> tuple[int, int, float, float]:
    """Check the options of `turntable` before the volume is read, and raise the same errors."""
    count, side = as_int(frames, "frames", 2, 360), as_int(size, "size", 16, 1024)
    above, period = as_float(elevation, "elevation", -90, 90), as_float(seconds, "seconds", 0.1, 600)
    if count * side * side > _MOST:
        raise LimitExceeded(
            f"frames, size: must have at most {_MOST} pixels in total, got {count} images of {side} x {side}"
        )
    return count, side, above, period


def _render(
    colours: Floats, view: NDArray[np.float64], sides: tuple[int, int], pixel: float, interpolation: Interpolation
) -> NDArray[np.uint8]:
    """Cast parallel rays at a block in the centre of the image."""
    shape = np.array(colours.shape[:3])
    half, (down, right, forward) = shape / 2, view
    out = np.zeros((*sides, 4), np.uint8)
    # Avoid division by zero for rays that are parallel to a face and never meet it.
    slope = np.where(np.abs(forward) < 1e-6, 1e-6, forward)
    across = ((np.arange(sides[1] * _FINE) + 0.5) / _FINE - sides[1] / 2) * pixel
    for top in range(0, sides[0], _BAND):
        ask()
        rows = min(_BAND, sides[0] - top)
        along = ((np.arange(rows * _FINE) + 0.5) / _FINE + top - sides[0] / 2) * pixel
        eye = [np.add.outer(along * down[k], across * right[k]).astype(np.float32) for k in range(3)]
        near = [(np.float32(-half[k] * np.sign(slope[k])) - eye[k]) / np.float32(slope[k]) for k in range(3)]
        entry = np.maximum(np.maximum(near[0], near[1]), near[2])
        leave = [near[k] + np.float32(2 * half[k] / abs(slope[k])) for k in range(3)]
        hit = entry < np.minimum(np.minimum(leave[0], leave[1]), leave[2])
        if not hit.any():
            continue
        way = entry[hit]
        face = np.where(way == near[0][hit], 0, np.where(way == near[1][hit], 1, 2))
        at = np.stack([eye[k][hit] + way * np.float32(forward[k]) + np.float32(half[k] - 0.5) for k in range(3)], -1)
        found = gather(colours, np.clip(at, 0, shape - 1), interpolation=interpolation)
        shaded = np.zeros((*hit.shape, 4), np.float32)
        shaded[hit, :3] = np.clip(found, 0, 1) * _LIGHT[face][:, np.newaxis]
        shaded[hit, 3] = 1
        total = shaded.reshape(rows, _FINE, sides[1], _FINE, 4).sum(axis=(1, 3))
        weight = total[..., 3:]
        total[..., :3] /= np.maximum(weight, 1)
        total[..., 3:] = weight / _FINE**2
        out[top : top + rows] = np.rint(total * 255)
    return out


def _view(azimuth: float, elevation: float) -> NDArray[np.float64]:
    """Return the unit vectors down, right and away from the viewer, as (plane, row, column)."""
    a, e = radians(azimuth), radians(elevation)
    return np.array(
        [
            [-sin(e) * cos(a), cos(e), sin(e) * sin(a)],
            [sin(a), 0.0, cos(a)],
            [cos(e) * cos(a), sin(e), -cos(e) * sin(a)],
        ]
    )


def as_steps(normal: object, axes: object) -> NDArray[np.float64]:
    """Return the steps of image rows and columns in voxels, (2, 3), perpendicular to a normal or as given."""
    if (normal is None) == (axes is None):
        raise InvalidInput("normal, axes: exactly one of these must be given")
    if axes is not None:
        steps = try_array(axes, np.float64)
        if steps.shape != (2, 3) or not np.isfinite(steps).all() or np.linalg.norm(np.cross(*steps)) < 1e-6:
            raise InvalidInput("axes: must be two directions that are not parallel, each of three numbers")
        return steps
    # A normal along an axis gives the same image as an ordinary slice.
    across = as_direction(normal, "normal")
    n = across / np.linalg.norm(across)
    along = np.eye(3)[2 if abs(n[2]) < 0.9 else 1]
    columns = along - n * (n @ along)
    columns /= np.linalg.norm(columns)
    rows = np.cross(n, columns)
    return np.stack([rows * (1 if rows[np.abs(rows).argmax()] > 0 else -1), columns])


def _clip_ray(
    steps: NDArray[np.float64], point: NDArray[np.float64], shape: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the minimum and maximum (row, column) steps from the point to the outline of the slice."""
    corners = np.array(list(product((0, 1), repeat=3))) * (shape - 1)
    normal = np.cross(*steps)
    side = (corners - point) @ normal
    found = [corners[i] for i in np.flatnonzero(np.abs(side) < 1e-9)]
    for i, j in product(range(8), repeat=2):
        if side[i] * side[j] < 0 and (corners[i] != corners[j]).sum() == 1:
            found.append(corners[i] + (corners[j] - corners[i]) * side[i] / (side[i] - side[j]))
    if not found:
        return np.zeros(2), -np.ones(2)
    at = np.linalg.lstsq(steps.T, (np.array(found) - point).T, rcond=None)[0]
    return at.min(axis=1) - 1e-6, at.max(axis=1) + 1e-6
