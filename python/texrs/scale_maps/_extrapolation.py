"""Scale maps continued into what is not known of them."""

from __future__ import annotations

import numpy as np

from texrs._arrays import as_image, as_mask, exp_single, log_single, try_array
from texrs._typing import Floats
from texrs.errors import InvalidInput
from texrs.kernels import poisson
from texrs.scale_maps._kinds import find_kind, keep_kind
from texrs.scale_maps._maps import MAX_SCALE, MIN_SCALE, as_map
from texrs.scale_maps._trend import Trend, as_trend, follow_kind


def extend(scale: object, known: object, *, trend: Trend = "plane") -> Floats:
    """Return a scale map that is continued into holes, and beyond what is known of it.

    The trend of the known part says how scales go on; by how much the map differs from it at the hole boundary is spread over
    the hole as a membrane would, so that nothing jumps where the known part begins.

    Parameters
    ----------
    scale : array_like
        Shape (H, W). What it holds where it is not known does not matter, not even NaN.
    known : array_like of bool
        Shape (H, W): where the map holds. Known pixels come back as they are.
    trend : {"plane", "linear", "quadratic", "none"}
        ``"plane"``: a flat surface in perspective, on which widths are linear in the picture. ``"linear"`` and ``"quadratic"``:
        log S is, for what is curved. ``"none"``: the membrane alone.

    Returns
    -------
    ndarray
        Float32, (H, W); a `ScaleMap` if ``scale`` is one.

    Raises
    ------
    InvalidInput
        Nothing is known, another shape, or scales that are not positive where they are known.

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
        raise InvalidInput("known: no pixel of the map is known; there must be some to go on from")
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
    nothing = np.zeros_like(logs)
    membrane = poisson.solve(logs, nothing, nothing, screening=0, boundary="free", mask=~there)
    # As the trend, no more than four times beyond what is known.
    low, high = max(MIN_SCALE, float(values[there].min()) / 4), min(MAX_SCALE, float(values[there].max()) * 4)
    filled = np.where(there, values, np.clip(exp_single(course + membrane), np.float32(low), np.float32(high)))
    return keep_kind(filled, holds)
