"""The scale map of an oblique plane, from its angles (equations 3 and 4 of Dong, Zhou and Paul)."""

from __future__ import annotations

from collections.abc import Sequence
from math import acos, cos, degrees, radians, sin, sqrt, tan

import numpy as np

from texrs._arrays import as_float, as_size
from texrs.errors import InvalidInput
from texrs.scale_maps.kinds import ScaleMap
from texrs.scale_maps.maps import MIN_SCALE

MAX_SLANT = 85.0
"""Maximum slant of a plane, in degrees."""


def from_angles(shape: Sequence[int] | int, slant: float, tilt: float, *, fov: float | None = None) -> ScaleMap:
    """Return the scale map of an oblique plane.

    The size of elements falls linearly with distance along the slope in the image. Without ``fov``, the slant alone
    determines the range: 1 / cos(slant) in the nearest corner and cos(slant) in the farthest corner [1]_. Three errors
    of the paper are corrected. Equation 4 begins with the largest scale, not with a coordinate. The middle of the
    image is (size - 1) / 2. The nearest and farthest corners depend on the tilt, for tilts of any angle.

    With ``fov``, the map is that of a pinhole camera: it is 1 in the middle, and its range grows with the angle of
    view. The range is usually larger than without ``fov``. For a slant of 45 degrees, without ``fov``, the nearest
    elements are 2x as large as the farthest elements. With an angle of view of 40 degrees they are 2.1x as large, and
    with 60 degrees 3.7x. Pass the angle of view if it is known (`texrs.io.read_fov`).

    The scale is the width of elements across the slope. Elements are also foreshortened along the slope, so the square
    root of their area is the power 3/2 of the width.

    Parameters
    ----------
    shape : (int, int) or int
        Rows and columns of the map.
    slant : float
        Angle between the line of sight and the plane's normal, in degrees: 0 (seen from the front) to 85.
    tilt : float
        Direction of increasing depth in the image, in degrees counter-clockwise from +x with y up: 90 for a ground
        plane. Any angle is valid. The paper's angle is 90 - tilt.
    fov : float, optional
        Angle of view of the longer side of the image, in degrees, 1 to 170. Default: unknown, so that the slant alone
        determines the map.

    Returns
    -------
    ScaleMap
        Float32, (rows, columns), of kind "width".

    Raises
    ------
    InvalidInput
        If an angle is outside its range, or the plane's horizon is inside the image.

    References
    ----------
    .. [1] W. Dong, N. Zhou and J.-C. Paul, "Perspective-aware texture analysis and synthesis", The Visual Computer 24,
       2008. :doi:`10.1007/s00371-008-0232-1`

    Examples
    --------
    The bottom is near and the top is far. The nearest elements are four times as large as the farthest if the slant is
    60:

    >>> from texrs import scale_maps
    >>> scale_maps.from_angles((4, 1), slant=60, tilt=90).ravel().tolist()
    [0.5, 1.0, 1.5, 2.0]

    """
    size = as_size(shape, "shape")
    lean = radians(as_float(slant, "slant", 0, MAX_SLANT))
    angle = radians(as_float(tilt, "tilt", -1e6, 1e6) % 360)
    right, up = cos(angle), sin(angle)
    # At multiples of 90 degrees, one component is only a rounding error, so set it to 0.
    right, up = (0.0 if abs(c) < 1e-12 else c for c in (right, up))
    rows, columns = (np.arange(n) - (n - 1) / 2 for n in size)
    # Y_proj of equation 4 is the distance along the slope from the middle of the image.
    far = columns * right - rows[:, np.newaxis] * up
    if fov is None:
        # Y_max of equation 3 is the distance of the extreme corners. It is 0 in an image of one pixel, so replace it
        # by 1.
        reach = (size[1] - 1) / 2 * abs(right) + (size[0] - 1) / 2 * abs(up) or 1.0
        largest, least = 1 / cos(lean), cos(lean)
        scale = largest - (far + reach) * ((largest - least) / (2 * reach))
    else:
        focal = max(size) / 2 / tan(radians(as_float(fov, "fov", 1, 170)) / 2)
        scale = 1 - far * (tan(lean) / focal)
        if scale.min() < MIN_SCALE:
            raise InvalidInput(
                f"slant: at {slant:g} degrees the horizon is inside an image with a fov of {fov:g}; "
                "reduce slant or fov, or crop the image"
            )
    return ScaleMap(scale.astype(np.float32), "width")


def slant_for_ratio(ratio: float) -> float:
    """Return the slant at which the nearest elements are ``ratio`` times as large as the farthest.

    This is the inverse of `from_angles` without ``fov``, where the ratio is 1 / cos(slant)^2.

    Parameters
    ----------
    ratio : float
        Ratio of the largest to the smallest scale, 1 to 131.

    Returns
    -------
    float
        Slant in degrees.

    Raises
    ------
    InvalidInput
        If the ratio is outside its range.

    Examples
    --------
    >>> from texrs import scale_maps
    >>> round(scale_maps.slant_for_ratio(4), 6)
    60.0

    """
    return degrees(acos(1 / sqrt(as_float(ratio, "ratio", 1, 131))))
