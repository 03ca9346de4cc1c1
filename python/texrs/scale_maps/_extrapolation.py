"""Continuation of scale maps into unknown pixels."""

from __future__ import annotations

import numpy as np

from texrs._arrays import as_image, as_mask, exp_single, log_single, try_array
from texrs._typing import Floats
from texrs.errors import InvalidInput
from texrs.kernels import poisson
from texrs.scale_maps.kinds import find_kind, keep_kind
from texrs.scale_maps.maps import MAX_SCALE, MIN_SCALE, as_map
from texrs.scale_maps.trend import Trend, as_trend, follow_kind


def extend(scale: object, known: object, *, trend: Trend = "plane") -> Floats:
    """Continue a scale map into its holes and beyond its known part.

    A trend is fitted to the known part and evaluated at unknown pixels. The difference between map and trend at the
    boundary of a hole is spread over the hole like a membrane. The result therefore has no step at the boundary. It is
    clipped to a quarter of the smallest and to four times the largest known scale.

    Parameters
    ----------
    scale : array_like
        Scale map, (H, W). Its values at unknown pixels are ignored, even NaN.
    known : array_like of bool
        Mask of the pixels where the map is valid, (H, W). Their values do not change.
    trend : {"plane", "linear", "quadratic", "none"}
        Model of the known part. ``"plane"``: a plane in perspective, whose widths vary linearly in the image.
        ``"linear"``: log S varies linearly. ``"quadratic"``: log S varies quadratically, for curved surfaces.
        ``"none"``: only the membrane. Default: "plane".

    Returns
    -------
    ndarray
        Float32, (H, W); a `ScaleMap` if ``scale`` is one.

    Raises
    ------
    InvalidInput
        If no pixel is known, the shapes differ, or known scales are not positive.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import scale_maps
    >>> floor = scale_maps.from_angles((64, 64), slant=50, tilt=90)
    >>> known = np.ones((64, 64), bool)
    >>> known[20:50, 10:40] = False
    >>> filled = scale_maps.extend(np.where(known, floor, 1), known)
    >>> bool(np.abs(np.log(filled / floor)).max() < 0.01)
    True

    """
    given, holds = try_array(scale), find_kind(scale)
    there = as_mask(known, "known", given.shape[:2])
    if not there.any():
        raise InvalidInput("known: must mark at least one pixel, got none")
    if given.dtype.kind == "f" and given.shape == there.shape:
        given = np.where(there, given, given.dtype.type(1))
    kind = as_trend(trend)
    values = as_map(as_image(given, "scale"))
    if there.all():
        return keep_kind(values, holds)
    logs = log_single(values)
    course = follow_kind(logs, kind, holds, there)
    logs -= course
    logs[~there] = 0
    # Solve the Laplace equation in the unknown part, with the differences from the trend as boundary values.
    nothing = np.zeros_like(logs)
    membrane = poisson.solve(logs, nothing, nothing, screening=0, boundary="free", mask=~there)
    # Clip like the trend, to a factor of four beyond the known scales.
    low, high = max(MIN_SCALE, float(values[there].min()) / 4), min(MAX_SCALE, float(values[there].max()) * 4)
    filled = np.where(there, values, np.clip(exp_single(course + membrane), np.float32(low), np.float32(high)))
    return keep_kind(filled, holds)
