"""The scale map of a plane seen aslant (equations 3 and 4)."""

from __future__ import annotations

from collections.abc import Sequence
from math import acos, cos, degrees, radians, sin, sqrt, tan

import numpy as np

from texrs._arrays import as_float, as_size
from texrs.errors import InvalidInput
from texrs.scale_maps._kinds import ScaleMap
from texrs.scale_maps._maps import MIN_SCALE

MAX_SLANT = 85.0
"""Degrees of slant up to which a plane can be asked for."""


def from_angles(shape: Sequence[int] | int, slant: float, tilt: float, *, fov: float | None = None) -> ScaleMap:
    """Return the scale map of a plane seen aslant.

    The size of elements falls linearly in the direction in which depth grows. Without ``fov`` its ends are set by the
    slant alone, 1 / cos(slant) in the nearest corner and cos(slant) in the farthest [1]_, with three corrections: the
    largest scale, not a coordinate, begins equation 4; the picture's middle is (size - 1) / 2; and the extreme corners
    are those of the tilt, whichever way it points. With ``fov`` the map is that of a pinhole camera: 1 in the middle,
    and as wide as the angle of view makes it. Cameras see more than the slant alone says: at 45 degrees of slant the nearest
    elements are 2 times as large as the farthest without ``fov``, 2.1 times with one of 40 degrees, 3.7 times with 60. So give
    it where it is known (`texrs.io.read_fov`). It is the width of elements across the slope; along it they are
    foreshortened besides, so that the square root of their area is the 3/2 power of it.

    Parameters
    ----------
    shape : (int, int) or int
        Rows and columns.
    slant : float
        Degrees between the line of sight and the plane's normal, 0 (seen from the front) to 85.
    tilt : float
        Direction in the picture in which depth grows: degrees counter-clockwise from +x with y up, 90 for a floor.
        Any angle; that of the paper is 90 - tilt.
    fov : float, optional
        Degrees that the longer side of the picture spans, 1 to 170, where they are known.

    Returns
    -------
    ScaleMap
        Float32, (rows, columns), of widths.

    Raises
    ------
    InvalidInput
        Angles outside these ranges, or a plane whose horizon lies inside the picture.

    References
    ----------
    .. [1] W. Dong, N. Zhou and J.-C. Paul, "Perspective-aware texture analysis and synthesis", The Visual Computer 24,
       2008. :doi:`10.1007/s00371-008-0232-1`

    Examples
    --------
    Near below, far above, and four times as large there at 60 degrees:

    >>> from texrs import scale_maps
    >>> scale_maps.from_angles((4, 1), slant=60, tilt=90).ravel().tolist()
    [0.5, 1.0, 1.5, 2.0]

    """
    size = as_size(shape, "shape")
    lean = radians(as_float(slant, "slant", 0, MAX_SLANT))
    angle = radians(as_float(tilt, "tilt", -1e6, 1e6) % 360)
    right, up = cos(angle), sin(angle)
    # Of quarter turns the one component is nothing but a rounding error.
    right, up = (0.0 if abs(c) < 1e-12 else c for c in (right, up))
    rows, columns = (np.arange(n) - (n - 1) / 2 for n in size)
    # Y_proj of equation 4: how far along the slope, from the middle.
    far = columns * right - rows[:, np.newaxis] * up
    if fov is None:
        # Y_max of equation 3; in a picture of one pixel there is no slope.
        reach = (size[1] - 1) / 2 * abs(right) + (size[0] - 1) / 2 * abs(up) or 1.0
        largest, least = 1 / cos(lean), cos(lean)
        scale = largest - (far + reach) * ((largest - least) / (2 * reach))
    else:
        focal = max(size) / 2 / tan(radians(as_float(fov, "fov", 1, 170)) / 2)
        scale = 1 - far * (tan(lean) / focal)
        if scale.min() < MIN_SCALE:
            raise InvalidInput(
                f"slant: at {slant:g} degrees the plane's horizon lies inside a picture that spans {fov:g} degrees; "
                "a smaller slant, a smaller fov or a crop of the near part has none in it"
            )
    return ScaleMap(scale.astype(np.float32), "width")


def slant_for_ratio(ratio: float) -> float:
    """Return the slant at which the nearest elements are ``ratio`` times as large as the farthest.

    The inverse of what `from_angles` does without ``fov``, where the ratio is 1 / cos(slant)^2.

    Parameters
    ----------
    ratio : float
        The largest scale over the least, 1 to 131.

    Returns
    -------
    float
        Degrees.

    Raises
    ------
    InvalidInput
        A ratio outside this range.

    Examples
    --------
    >>> from texrs import scale_maps
    >>> round(scale_maps.slant_for_ratio(4), 6)
    60.0

    """
    return degrees(acos(1 / sqrt(as_float(ratio, "ratio", 1, 131))))
