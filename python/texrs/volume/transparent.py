"""Render transparent volumes: colours are accumulated from front to back along parallel rays.

A transfer function gives each voxel a colour and an opacity. The results are interpolated, and not the values, so that
no new colours appear. Surfaces, where the opacity changes, are shaded with a light from behind the viewer.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_bool, as_float, as_image, as_rgb, guidance, to_unit
from texrs._conversion import as_ndarray
from texrs._typing import Floats
from texrs.errors import InvalidInput
from texrs.kernels.gather import gather
from texrs.volume.rendering import _MARGIN, _view, check_cube

__all__ = ["Stop", "parse_transfer", "render_volume"]

Stop: TypeAlias = tuple[float, "str | Sequence[float] | None", float]
"""Stop of a transfer function: a value, its colour, and the opacity of one voxel."""

_BAND = 32
"""Number of image rows that are rendered at once."""
_AT_ONCE = 16
"""Number of steps along the rays that are sampled at once."""
_ENOUGH = np.float32(0.002)
"""Fraction of the light below which the voxels behind are no longer visible."""
_AMBIENT = 0.55
"""Brightness of surfaces that face away from the light."""
_LIGHT = (-0.45, -0.35, -0.82)
"""Direction of the light (down, right, away from the viewer)."""
_LEVELS = 12
"""Number of levels per channel of the histogram that finds the background colour."""
_NEAR, _FAR = 0.35, 0.75
"""Fractions of the largest difference from the background: voxels begin to be visible, or are fully visible."""
_THICK = 8.0
"""Number of visible voxels that absorb most of the light, if the longest side has 100 voxels."""


def render_volume(
    volume: ArrayLike,
    size: int = 512,
    *,
    azimuth: float = 40,
    elevation: float = 30,
    transfer: str | Sequence[Stop] | None = None,
    shading: bool = True,
) -> NDArray[np.uint8]:
    """Render a transparent volume, seen from the same side as in `render_block`.

    Parameters
    ----------
    volume : array_like
        Volume of shape (D, H, W) or (D, H, W, C). A fourth channel is alpha. If there are more than 4 channels, only
        the first 3 are shown.
    size : int
        Longer side of the image in pixels, 16 to 4096. Default: 512.
    azimuth : float
        Angle of the view to the right of the front, in degrees. If 0, the volume is seen from the front. Default: 40.
    elevation : float
        Angle of the view above the front, in degrees, -90 to 90. Default: 30.
    transfer : str or sequence of (value, colour, alpha), optional
        Stops of the transfer function (1 to 256), with increasing values. Colour and alpha are interpolated linearly
        between stops. The value is the lightness, 0 to 1: integers are scaled by their full range, and floats outside
        0 to 1 by their own range. The colour is "#rrggbb", three numbers from 0 to 255, or None for the colour of the
        voxel. Alpha, 0 to 1, is the opacity of one voxel. A text has the form ``value:colour:alpha,...``, such as
        ``0:own:0,0.4:own:0,0.6:#cc3322:0.2``. Default: voxels that differ from the most frequent colour are shown in
        their own colour.
    shading : bool
        If True, surfaces that face away from the light are darkened. Default: True.

    Returns
    -------
    ndarray
        Image of shape (rows, columns, 4), uint8: colours and alpha, with alpha 0 where nothing is visible.

    Raises
    ------
    InvalidInput
        The volume or the transfer function is invalid.

    Notes
    -----
    Rays are sampled at every half voxel and composited from front to back, as in Levoy [1]_.

    References
    ----------
    .. [1] M. Levoy, "Display of surfaces from volume data", IEEE Computer Graphics and Applications 8(3), 1988.

    Examples
    --------
    >>> from texrs import samples, volume
    >>> picture = volume.render_volume(samples.particles((32, 32, 32)).image, 64)
    >>> picture.shape[1:], bool((picture[..., 3] > 200).any()), picture[0, 0, 3]
    ((58, 4), True, np.uint8(0))

    """
    voxels = as_image(as_ndarray(volume, "volume", axes=3), "volume", axes=3)
    longer, *angles = check_cube(size, azimuth, elevation)
    view, stops = _view(*angles), check_transfer(transfer)
    half = np.array(voxels.shape[:3]) / 2
    reach = (np.abs(view[:2]) * half).sum(axis=1) * _MARGIN
    pixel = 2 * reach.max() / longer
    sides = np.maximum(np.ceil(2 * reach / pixel - 1e-6), 1).astype(int)
    shown = _classify(voxels, stops)
    if as_bool(shading, "shading"):
        _shade(shown, view)
    return _look(shown, view, (int(sides[0]), int(sides[1])), float(pixel))


def parse_transfer(text: str) -> list[Stop]:
    """Parse a transfer function such as ``0:own:0,0.4:own:0,0.6:#cc3322:0.2`` into its stops.

    Raises
    ------
    InvalidInput
        The text is not a transfer function.

    Examples
    --------
    >>> parse_transfer("0:own:0, 1:#ff8000:0.5")
    [(0.0, None, 0.0), (1.0, '#ff8000', 0.5)]

    """
    stops: list[Stop] = []
    for part in text.split(","):
        words = [w.strip() for w in part.split(":")]
        try:
            value, colour, alpha = words
            stops.append((float(value), None if colour == "own" else colour, float(alpha)))
        except ValueError:
            raise InvalidInput(
                f"transfer: must be VALUE:COLOUR:ALPHA stops separated by commas, such as "
                f"0:own:0,0.6:#cc3322:0.2; got {part.strip()!r}"
            ) from None
    return stops


def check_transfer(transfer: str | Sequence[Stop] | None) -> NDArray[np.float64] | None:
    """Check a transfer function before the volume is read, and raise the same errors as `render_volume`."""
    return None if transfer is None else _as_stops(parse_transfer(transfer) if isinstance(transfer, str) else transfer)


def _as_stops(transfer: Sequence[Stop]) -> NDArray[np.float64]:
    """Return (value, alpha, 1 if a colour is given, red, green, blue) of each stop, (N, 6)."""
    flat = getattr(transfer, "ndim", 1) == 0
    if flat or not isinstance(transfer, Sequence | np.ndarray) or not 1 <= len(transfer) <= 256:
        raise InvalidInput(f"transfer: must be 1 to 256 stops (value, colour, alpha), got {str(transfer)[:60]}")
    rows = []
    for stop in transfer:
        if not isinstance(stop, Sequence) or len(stop) != 3:
            raise InvalidInput(f"transfer: each stop must be (value, colour, alpha), got {str(stop)[:60]}")
        value, colour, alpha = stop
        given = colour is not None
        rgb = _as_colour(colour) if given else (0.0, 0.0, 0.0)
        numbers = as_float(value, "transfer", 0, 1), as_float(alpha, "transfer", 0, 1)
        rows.append((*numbers, float(given), *rgb))
    found = np.array(rows)
    if (np.diff(found[:, 0]) < 0).any():
        raise InvalidInput(
            f"transfer: the values of the stops must not decrease, got {', '.join(f'{v:g}' for v in found[:, 0])}"
        )
    return found


def _as_colour(colour: object) -> tuple[float, float, float]:
    if isinstance(colour, str) and (m := re.fullmatch(r"#([0-9a-fA-F]{3}|[0-9a-fA-F]{6})", colour)):
        digits = m[1] if len(m[1]) == 6 else "".join(2 * d for d in m[1])
        red, green, blue = (int(digits[i : i + 2], 16) / 255 for i in (0, 2, 4))
        return red, green, blue
    if isinstance(colour, Sequence | np.ndarray) and not isinstance(colour, str) and len(colour) == 3:
        red, green, blue = (as_float(c, "transfer", 0, 255) / 255 for c in colour)
        return red, green, blue
    raise InvalidInput(
        f"transfer: a colour must be #rrggbb, three numbers, or own (in Python None) for the colour of the voxel; "
        f"got {colour!r}"
    )


def _classify(voxels: NDArray[np.generic], stops: NDArray[np.float64] | None) -> Floats:
    """Return the premultiplied colours and the alpha of each voxel, (D, H, W, 4)."""
    unit = to_unit(voxels[..., :3] if voxels.shape[-1] > 4 else voxels)
    clear = unit[..., -1] if voxels.shape[-1] in (2, 4) else None
    own = as_rgb(unit[..., :-1] if clear is not None else unit)
    if stops is None:
        alpha, colours = _set_apart(own), own
    else:
        value = guidance(voxels).mean(axis=-1, dtype=np.float32).astype(np.float64)
        alpha, weight, *rgb = (np.interp(value, stops[:, 0], stops[:, k]) for k in range(1, 6))
        colours = own * (1 - weight)[..., np.newaxis] + np.stack(rgb, axis=-1)
    alpha = np.asarray(alpha if clear is None else alpha * clear, np.float32)
    shown = np.empty((*voxels.shape[:3], 4), np.float32)
    shown[..., :3] = np.clip(colours, 0, 1) * alpha[..., np.newaxis]
    shown[..., 3] = alpha
    return shown


def _set_apart(own: Floats) -> NDArray[np.float64]:
    """Return opacities that rise with the difference between a voxel's colour and the most frequent colour."""
    flat = own.reshape(-1, 3)
    levels = np.minimum((flat * np.float32(_LEVELS)).astype(np.int64), _LEVELS - 1) @ np.array([_LEVELS**2, _LEVELS, 1])
    # Also count adjacent levels of each channel, because the colour can be at the border of two levels.
    counts = np.bincount(levels, minlength=_LEVELS**3).reshape(_LEVELS, _LEVELS, _LEVELS)
    around = counts.copy()
    for axis in range(3):
        moved = np.moveaxis(around, axis, 0)
        total = moved.copy()
        total[1:] += moved[:-1]
        total[:-1] += moved[1:]
        around = np.moveaxis(total, 0, axis)
    middle = np.array(np.unravel_index(int(around.argmax()), around.shape))
    near = (np.abs(np.stack(np.unravel_index(levels, counts.shape), axis=-1) - middle) <= 1).all(axis=-1)
    ground = np.median(flat[near], axis=0).astype(np.float64)
    far = np.sqrt(((flat - ground) ** 2).sum(axis=-1))
    most = float(np.partition(far, int(0.99 * (len(far) - 1)))[int(0.99 * (len(far) - 1))])
    share = np.clip((far / max(most, 1e-6) - _NEAR) / (_FAR - _NEAR), 0, 1)
    thick = min(0.9, 100 / (_THICK * max(own.shape[:3])) + 0.02)
    return np.asarray((share * share * (3 - 2 * share) * thick).reshape(own.shape[:3]))


def _shade(shown: Floats, view: NDArray[np.float64]) -> None:
    """Darken voxels at surfaces that face away from the light."""
    alpha = shown[..., 3]
    slopes = [np.gradient(alpha, axis=k) if alpha.shape[k] > 1 else np.zeros_like(alpha) for k in range(3)]
    light = (np.array(_LIGHT)[:, np.newaxis] * view).sum(axis=0)
    light = light / np.sqrt((light**2).sum())
    steep = np.sqrt(slopes[0] ** 2 + slopes[1] ** 2 + slopes[2] ** 2)
    # The surface normal points outwards, opposite to the gradient of the opacity.
    towards = -(slopes[0] * np.float32(light[0]) + slopes[1] * np.float32(light[1]) + slopes[2] * np.float32(light[2]))
    facing = np.clip(towards / np.maximum(steep, np.float32(1e-6)), 0, 1)
    # Shade only where the opacity changes clearly, because there is no surface elsewhere.
    sure = np.clip(steep / max(float(steep.max()) * 0.25, 1e-6), 0, 1)
    bright = 1 - sure * (1 - (np.float32(_AMBIENT) + np.float32(1 - _AMBIENT) * facing))
    shown[..., :3] *= bright[..., np.newaxis]


def _look(shown: Floats, view: NDArray[np.float64], sides: tuple[int, int], pixel: float) -> NDArray[np.uint8]:
    """Accumulate colours along parallel rays from front to back, at every half voxel."""
    from scipy.ndimage import maximum_filter

    shape = np.array(shown.shape[:3])
    half, (down, right, forward) = shape / 2, view
    # Convert the opacity of a voxel to half a voxel, so that two half voxels transmit as much light as one voxel.
    thin = shown.copy()
    kept = 1 - np.sqrt(1 - np.minimum(shown[..., 3], np.float32(1)))
    thin[..., :3] *= np.where(shown[..., 3] > 0, kept / np.maximum(shown[..., 3], np.float32(1e-12)), 0)[
        ..., np.newaxis
    ]
    thin[..., 3] = kept
    busy = maximum_filter(kept > 0, 2, origin=-1).reshape(-1)
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    depth = float((np.abs(forward) * half).sum())
    steps = np.arange(-np.ceil(depth * 2), np.ceil(depth * 2) + 1) / 2
    out = np.zeros((*sides, 4), np.uint8)
    across = (np.arange(sides[1]) + 0.5 - sides[1] / 2) * pixel
    for top in range(0, sides[0], _BAND):
        along = (np.arange(top, min(top + _BAND, sides[0])) + 0.5 - sides[0] / 2) * pixel
        eye = np.stack(
            [np.add.outer(along * down[k], across * right[k]) + (half[k] - 0.5) for k in range(3)], axis=-1
        ).reshape(-1, 3)
        total, light = np.zeros((len(eye), 4), np.float32), np.ones(len(eye), np.float32)
        # Find where rays enter and leave the volume. The lower limit avoids division by zero for rays that are
        # parallel to a face.
        slope = np.where(np.abs(forward) < 1e-9, 1e-9, forward)
        ends = np.sort(np.stack([(-0.5 - eye) / slope, (shape - 0.5 - eye) / slope]), axis=0)
        enter, leave = ends[0].max(axis=-1), ends[1].min(axis=-1)
        for first in range(0, len(steps), _AT_ONCE):
            some = steps[first : first + _AT_ONCE]
            here = np.flatnonzero((enter < some[-1]) & (some[0] < leave) & (light > _ENOUGH))
            if not here.size:
                continue
            at = np.clip(eye[here] + some[:, np.newaxis, np.newaxis] * forward, 0, shape - 1)
            inside = (enter[here] < some[:, np.newaxis]) & (some[:, np.newaxis] < leave[here])
            inside &= busy[(at.astype(np.int64) * strides).sum(axis=-1)]
            found = np.zeros((*inside.shape, 4), np.float32)
            found[inside] = gather(thin, at[inside].astype(np.float32))
            for each in found:
                total[here] += each * light[here, np.newaxis]
                light[here] *= 1 - each[:, 3]
        alpha = total[:, 3:]
        seen = np.concatenate([total[:, :3] / np.maximum(alpha, np.float32(1e-6)), alpha], axis=-1)
        seen[alpha[:, 0] < np.float32(1 / 512)] = 0
        out[top : top + len(along)] = np.rint(np.clip(seen, 0, 1) * 255).reshape(len(along), sides[1], 4)
    return out
