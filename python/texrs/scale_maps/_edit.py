"""Edits of scale maps: a list of steps that can be saved, changed and replayed."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Mapping, Sequence
from math import log
from typing import Any

import numpy as np

from texrs._arrays import exp_single, log_single
from texrs._typing import Floats
from texrs.errors import InvalidInput
from texrs.scale_maps._blur import blur
from texrs.scale_maps._regions import as_number, as_points, centre, stroke, weights
from texrs.scale_maps.kinds import find_kind, keep_kind
from texrs.scale_maps.maps import as_map

_LEAST, _LARGEST = 1 / 8, 8.0
"""Smallest and largest scale that a step can produce."""
_MOST = 10_000


def edit(scale: object, steps: Sequence[Mapping[str, Any] | str] | str) -> Floats:
    """Return a scale map that is changed by a list of steps.

    Each step is a mapping with the name of the operation, ``"op"``, and its options, or only the name. A region is a
    rectangle ``[top, left, bottom, right]``, a disc ``[row, column, radius]``, or a list of the points ``[row,
    column]`` of a polygon. By default, a step applies to the whole map. The edges of a region are ``"feather"`` pixels
    wide, by default a quarter of the region's shorter side. All operations work on log S, and no step moves a scale
    out of 1/8 to 8.

    ===========  =============================================  ====================================================
    op           takes                                          does
    ===========  =============================================  ====================================================
    `magnify`    factor (1 to 8, by default 1.25), region       makes elements larger
    `minify`     factor (1 to 8, by default 1.25), region       makes elements smaller
    `set`        value, region                                  sets all scales to a value
    `vary`       gain (-8 to 8), region                         multiplies differences from the mean; 0 removes them
    `ramp`       start, end (points), values (two), region      varies scales linearly from one point to the other
    `duplicate`  region, to (point), mode                       copies the scales of the region to a point; mode
                                                                ``"ratio"`` copies their ratios to the region's mean
    `brush`      points, radius, factor (1/8 to 8)              draws a line with larger or smaller elements
    `smooth`     sigma (pixels), region                         removes finer variation
    ===========  =============================================  ====================================================

    To undo a step, replay the list without it. To save the list, use ``json.dumps``.

    Parameters
    ----------
    scale : array_like
        Scale map, (H, W). It is not changed.
    steps : sequence of mappings, or str
        Steps of the edit, in order. Python also accepts their JSON text.

    Returns
    -------
    ndarray
        Float32, (H, W); a `ScaleMap` if ``scale`` is one.

    Raises
    ------
    InvalidInput
        If the array is not a scale map, or a step is not valid. The message contains the number of the step.

    Examples
    --------
    >>> import json
    >>> import numpy as np
    >>> from texrs import scale_maps
    >>> flat = np.ones((64, 64), np.float32)
    >>> steps = [
    ...     {"op": "magnify", "region": [32, 32, 16], "factor": 2},
    ...     {"op": "set", "region": [0, 0, 8, 8], "value": 0.5, "feather": 0},
    ... ]
    >>> changed = scale_maps.edit(flat, steps)
    >>> changed[32, 32], changed[4, 4], changed[60, 4]
    (np.float32(2.0), np.float32(0.5), np.float32(1.0))
    >>> undone = scale_maps.edit(flat, steps[:-1])
    >>> again = scale_maps.edit(flat, json.dumps(steps))
    >>> bool(undone[4, 4] == 1 and (again == changed).all())
    True

    """
    given = as_map(scale)
    before = log_single(given)
    logs = before
    for number, (operation, options) in enumerate(_read_all(steps), start=1):
        try:
            changed = _OPERATIONS[operation](logs, **options)
        except InvalidInput as error:
            raise InvalidInput(f"steps: step {number}, {operation}: {error}") from None
        # Scales that were beyond the limits before may stay there.
        low, high = np.minimum(logs, np.float32(log(_LEAST))), np.maximum(logs, np.float32(log(_LARGEST)))
        logs = np.clip(changed, low, high).astype(np.float32)
    # Keep the exact bits of pixels that no step changed.
    return keep_kind(np.where(logs == before, given, exp_single(logs)), find_kind(scale))


def _read_all(steps: object) -> list[tuple[str, dict[str, Any]]]:
    """Check a list of steps or its JSON text, and return the operation and options of each step."""
    if isinstance(steps, str):
        try:
            steps = json.loads(steps)
        except (ValueError, RecursionError) as error:
            raise InvalidInput(f"steps: must be JSON ({error})") from None
    if not isinstance(steps, Sequence) or isinstance(steps, str | bytes):
        raise InvalidInput(f"steps: must be a list of steps, got {type(steps).__name__}")
    if len(steps) > _MOST:
        raise InvalidInput(f"steps: must contain at most {_MOST} steps, got {len(steps)}")
    return [_read(one, number) for number, one in enumerate(steps, start=1)]


def _read(one: object, number: int) -> tuple[str, dict[str, Any]]:
    options = {"op": one} if isinstance(one, str) else dict(one) if isinstance(one, Mapping) else {}
    operation = options.pop("op", None)
    if not isinstance(operation, str) or operation not in _OPERATIONS:
        raise InvalidInput(f"steps: step {number} must have an 'op', one of {', '.join(_OPERATIONS)}; got {one!r}")
    _, *parameters = inspect.signature(_OPERATIONS[operation]).parameters.values()
    allowed = [p.name for p in parameters]
    for key in options:
        if key not in allowed:
            raise InvalidInput(
                f"steps: step {number}, {operation}, has no option {key}; its options are {', '.join(allowed)}"
            )
    for parameter in parameters:
        if parameter.default is parameter.empty and parameter.name not in options:
            raise InvalidInput(f"steps: step {number}, {operation}, requires {parameter.name}")
    return operation, options


# --- operations, on log S ------------------------------------------------------------------------------------------


def _magnify(logs: Floats, factor: object = 1.25, region: object = None, feather: object = None) -> Floats:
    amount = np.log(as_number(factor, "factor", 1, 8))
    return np.asarray(logs + amount * weights(region, feather, logs.shape))


def _minify(logs: Floats, factor: object = 1.25, region: object = None, feather: object = None) -> Floats:
    amount = np.log(as_number(factor, "factor", 1, 8))
    return np.asarray(logs - amount * weights(region, feather, logs.shape))


def _set(logs: Floats, value: object, region: object = None, feather: object = None) -> Floats:
    wanted = np.log(as_number(value, "value", _LEAST, _LARGEST))
    return np.asarray(logs + (wanted - logs) * weights(region, feather, logs.shape))


def _vary(logs: Floats, gain: object, region: object = None, feather: object = None) -> Floats:
    inside = weights(region, feather, logs.shape)
    away = logs - _average(logs, inside)
    return np.asarray(logs + (as_number(gain, "gain", -8, 8) - 1) * away * inside)


def _ramp(
    logs: Floats, start: object, end: object, values: object, region: object = None, feather: object = None
) -> Floats:
    first, last = as_points([start], "start")[0], as_points([end], "end")[0]
    if not isinstance(values, list | tuple) or len(values) != 2:
        raise InvalidInput(f"values must be two scales, one at the start and one at the end, got {values!r}")
    low, high = (np.log(as_number(v, "values", _LEAST, _LARGEST)) for v in values)
    along = last - first
    length = float(along @ along)
    if length == 0:
        raise InvalidInput("end must differ from start")
    rows, columns = np.arange(logs.shape[0])[:, np.newaxis] - first[0], np.arange(logs.shape[1]) - first[1]
    share = np.clip((rows * along[0] + columns * along[1]) / length, 0, 1)
    return np.asarray(logs + (low + (high - low) * share - logs) * weights(region, feather, logs.shape))


def _duplicate(logs: Floats, region: object, to: object, mode: object = "copy", feather: object = None) -> Floats:
    if mode not in ("copy", "ratio"):
        raise InvalidInput(f"mode must be 'copy' or 'ratio', got {mode!r}")
    if region is None:
        raise InvalidInput("region must be given, got None")
    step = np.rint(as_points([to], "to")[0] - centre(region)).astype(int)
    inside = weights(region, feather, logs.shape)
    if not inside.any():
        raise InvalidInput(f"region must overlap the map of {logs.shape[0]} x {logs.shape[1]} pixels")
    # Copy only the part whose source is inside the map. The rest of the target does not change.
    there = [slice(max(0, d), min(n, n + d)) for d, n in zip(step, logs.shape, strict=True)]
    here = [slice(max(0, -d), min(n, n - d)) for d, n in zip(step, logs.shape, strict=True)]
    if any(s.stop <= s.start for s in there):
        raise InvalidInput(
            f"to must place a part of the region inside the map of {logs.shape[0]} x {logs.shape[1]} pixels, got {to}"
        )
    source, share = logs[tuple(here)], inside[tuple(here)]
    part = logs[tuple(there)]
    result = logs.copy()
    result[tuple(there)] += share * (source - (part if mode == "copy" else _average(logs, inside)))
    return result


def _brush(logs: Floats, points: object, radius: object, factor: object) -> Floats:
    amount = np.log(as_number(factor, "factor", 1 / 8, 8))
    drawn = as_points(points, "points")
    return np.asarray(logs + amount * stroke(drawn, as_number(radius, "radius", 0.5, 1e5), logs.shape))


def _smooth(logs: Floats, sigma: object, region: object = None, feather: object = None) -> Floats:
    blurred = blur(logs, as_number(sigma, "sigma", 0.1, 1000))
    return np.asarray(logs + (blurred - logs) * weights(region, feather, logs.shape))


def _average(logs: Floats, inside: Floats) -> float:
    total = float(np.sum(inside, dtype=np.float64))
    return float(np.sum(logs * inside, dtype=np.float64)) / total if total > 0 else 0.0


_OPERATIONS: dict[str, Callable[..., Floats]] = {
    "magnify": _magnify,
    "minify": _minify,
    "set": _set,
    "vary": _vary,
    "ramp": _ramp,
    "duplicate": _duplicate,
    "brush": _brush,
    "smooth": _smooth,
}
"""Operations on log S by name. Their parameters are the options of a step."""
