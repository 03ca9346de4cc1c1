"""Scale maps measured from a mask of features (equations 1 and 2 of Dong, Zhou and Paul)."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_bool, as_choice, as_image, as_int, as_mask, exp_single, log_single
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput
from texrs.scale_maps._extrapolation import extend
from texrs.scale_maps._windows import Lattice, smooth
from texrs.scale_maps.kinds import AREAS, Kind, ScaleMap
from texrs.scale_maps.maps import centre_logs
from texrs.scale_maps.trend import Trend, as_trend, follow_kind, gradient

Measure: TypeAlias = Literal["boundary", "skeleton", "count", "area"]
"""Quantity to measure in a mask."""

_MEASURES = ("boundary", "skeleton", "count", "area")
SMALLEST = 16
"""Minimum side of an image, and of a window, in pixels."""
_PERIODS = 8
"""Default side of a window, as a multiple of the spacing of the features.

It then contains about 64 features, whose number is known to about 10 %.
"""
_FEWEST = 6
"""Minimum number of features in a mask, estimated as its area divided by the square of their spacing."""
_WIDEST = 4.0
"""Maximum ratio between the scale in a window and the typical scale, in either direction."""
_ROUNDS = 4
_PAPER_WINDOW, _PAPER_SIZE = 32, 9


def from_mask(
    mask: object,
    *,
    measure: Measure = "boundary",
    window: int | None = None,
    trend: Trend = "none",
    foreshortened: bool = False,
    known: object = None,
) -> ScaleMap:
    """Measure a scale map from a mask of features: the denser the features, the smaller the elements.

    If elements appear twice as large, a window contains half the length of outlines. Equation 1 of [1]_ counts the
    pixels of the mask instead, and has the relation reversed. The logarithms of the measured scales are
    smoothed (equation 2).

    Parameters
    ----------
    mask : array_like of bool
        Mask of the features, (H, W), from `auto_mask` or drawn by hand.
    measure : {"boundary", "skeleton", "count", "area"}
        Quantity to measure. ``"boundary"``: the length of the outlines. Features and gaps may be swapped.
        ``"skeleton"``: the length of the features' centre lines, for features that are curves. ``"count"``: the number
        of features, if the mask is clean and elements do not touch. ``"area"``: the number of mask pixels in windows
        of 32 pixels, by the equations of the paper as printed. This is only useful for drawn curves, and gives their
        reciprocal scale. For areas, the covered share of a window does not depend on their size. Default: "boundary".
    window : int, optional
        Side of the windows in pixels, at least 16. Default: eight times the spacing of the features, at most a third
        of the shorter side.
    trend : {"none", "plane", "linear", "quadratic"}
        Model fitted robustly to the map. ``"none"``: no fit. ``"plane"``: a plane in perspective, whose widths vary
        linearly in the image. ``"linear"``: log S varies linearly. ``"quadratic"``: log S varies quadratically.
        Default: "none".
    foreshortened : bool
        If True, the image must show an oblique plane, and the map contains widths across the slope (see
        `from_angles`). If False, it contains the square roots of areas, which are the power 3/2 of the widths on such
        a plane. Default: False.
    known : array_like of bool, optional
        Mask of the valid pixels, (H, W). Other pixels do not count in any window, and the map is continued into them
        (`extend`). Default: all.

    Returns
    -------
    ScaleMap
        Float32, (H, W), with a geometric mean of 1. Its kind is "width" if ``foreshortened``, otherwise "area".

    Raises
    ------
    InvalidInput
        If the mask is empty or full, has too few features to measure, or has a side below 16 pixels.

    References
    ----------
    .. [1] W. Dong, N. Zhou and J.-C. Paul, "Perspective-aware texture analysis and synthesis", The Visual Computer 24,
       2008. :doi:`10.1007/s00371-008-0232-1`

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import samples, scale_maps
    >>> floor = samples.tilted_discs((192, 192))
    >>> scale = scale_maps.from_mask(floor.mask, trend="plane")
    >>> bool(np.corrcoef(np.log(scale).ravel(), np.log(floor.scale_map).ravel())[0, 1] > 0.97)
    True

    """
    given = as_mask(mask, "mask", as_image(mask, "mask").shape[:2])
    what, kind = as_choice(measure, "measure", _MEASURES), as_trend(trend)
    size = given.shape[0], given.shape[1]
    if min(size) < SMALLEST:
        raise InvalidInput(f"mask: each side must be at least {SMALLEST}, got {size}")
    there = None if known is None else as_mask(known, "known", size)
    if there is not None and there.all():
        there = None
    _refuse_bare(given, there)
    side = None if window is None else as_int(window, "window", SMALLEST, max(SMALLEST, *size))
    logs = _measure_as_printed(given, there, side) if what == "area" else _measure(given, there, what, side)
    # A mask measures areas. Convert them to widths before the fit, because only widths are linear on a plane.
    if as_bool(foreshortened, "foreshortened"):
        logs *= np.float32(AREAS)
    holds: Kind = "width" if foreshortened else "area"
    if kind != "none":
        logs = follow_kind(logs, kind, holds, there)
    elif there is not None:
        return ScaleMap(extend(ScaleMap(centre_logs(logs), holds), there), holds)
    return ScaleMap(centre_logs(logs), holds)


def _refuse_bare(mask: Bools, known: Bools | None) -> None:
    marked = np.count_nonzero(mask if known is None else mask & known)
    total = _count_area(mask, known)
    if total == 0:
        raise InvalidInput("known: must mark at least one pixel, got none")
    if marked in (0, total):
        what = "marks nothing" if marked == 0 else "marks every pixel"
        raise InvalidInput(
            f"mask: must mark features, but it {what}; mark the elements or the gaps between them, or give the scale by angles"
        )


def _measure(mask: Bools, known: Bools | None, what: str, window: int | None) -> Floats:
    """Return log S measured from the features of a mask."""
    size = mask.shape[0], mask.shape[1]
    features, spacing, power = _find_features(mask, known, what)
    if window is None:
        window = int(np.clip(_PERIODS * spacing, SMALLEST, max(SMALLEST, min(size) / 3)))
    lattice = Lattice.of(size, window)
    density, enough, rows, columns = lattice.densities(features, known)
    typical = float(np.median(density[enough]))
    if typical <= 0 or _count_area(mask, known) < _FEWEST * spacing**2:
        raise InvalidInput(
            f"mask: must mark more features per window of {window} pixels; mark more features, use a larger "
            "window, or give the scale by angles"
        )
    ratio = np.clip(density / typical, _WIDEST ** (-1 / power), _WIDEST ** (1 / power))
    logs = np.float32(-power) * log_single(ratio)
    # The density of a window belongs to the centroid of its known part. Shift it to the centre of the cell by the
    # overall gradient.
    cells = np.indices(logs.shape) * float(lattice.cell)
    down, across = gradient(logs, cells[0] - rows, cells[1] - columns, enough)
    logs += (down * rows + across * columns).astype(np.float32)
    logs = smooth(logs, enough, _ROUNDS)
    if not enough.all():
        logs = log_single(extend(ScaleMap(exp_single(logs), "area"), enough))
    return lattice.spread(logs)


def _find_features(mask: Bools, known: Bools | None, what: str) -> tuple[Array, float, float]:
    """Return the counts at each pixel, the spacing of the features, and the power p in S ~ density^-p."""
    if what == "skeleton":
        from skimage.morphology import skeletonize

        lines = skeletonize(mask) if known is None else skeletonize(mask & known) & known
        return lines.view(np.uint8), _measure_spacing(int(np.count_nonzero(lines)), mask, known), 1.0
    if what == "count":
        points = _mark_middles(mask, known)
        number = max(1, int(points.sum(dtype=np.int64))) / 2
        return points, float(np.sqrt(_count_area(mask, known) / number)), 0.5
    outlines = _count_outlines(mask, known)
    # Divide by 4: a line through a feature crosses its outline twice, and differences are counted along two axes.
    return outlines, _measure_spacing(int(outlines.sum(dtype=np.int64)) / 4, mask, known), 1.0


def _measure_spacing(lines: float, mask: Bools, known: Bools | None) -> float:
    return _count_area(mask, known) / max(0.25, lines)


def _count_area(mask: Bools, known: Bools | None) -> int:
    return mask.size if known is None else int(np.count_nonzero(known))


def _count_outlines(mask: Bools, known: Bools | None) -> NDArray[np.uint8]:
    """Count the neighbours below and to the right that differ from each pixel."""
    count = np.zeros(mask.shape, np.uint8)
    for part, first, second in (
        (count[:-1], (slice(None, -1), slice(None)), (slice(1, None), slice(None))),
        (count[:, :-1], (slice(None), slice(None, -1)), (slice(None), slice(1, None))),
    ):
        differ = mask[first] ^ mask[second]
        if known is not None:
            differ &= known[first] & known[second]
        part += differ.view(np.uint8)
    return count


def _mark_middles(mask: Bools, known: Bools | None) -> NDArray[np.uint16]:
    """Set 2 at the centre of each feature, or 1 if the border or a hole cuts the feature.

    A cut feature counts half, because about half of these features have their centre on the other side.
    """
    from scipy import ndimage

    labels, number = ndimage.label(mask if known is None else mask & known, np.ones((3, 3)))
    cut = np.zeros(number + 1, np.bool_)
    for border in (labels[0], labels[-1], labels[:, 0], labels[:, -1]):
        cut[border] = True
    if known is not None:
        cut[labels[ndimage.binary_dilation(~known, np.ones((3, 3)))]] = True
    flat = labels.ravel()
    areas = np.bincount(flat, minlength=number + 1)
    rows, columns = (
        (np.bincount(flat, np.broadcast_to(at, mask.shape).ravel(), number + 1) // np.maximum(areas, 1)).astype(np.intp)
        for at in (np.arange(mask.shape[0])[:, np.newaxis], np.arange(mask.shape[1]))
    )
    count = np.zeros(mask.shape, np.uint16)
    np.add.at(count, (rows[1:], columns[1:]), np.where(cut[1:], 1, 2).astype(np.uint16))
    return count


def _measure_as_printed(mask: Bools, known: Bools | None, window: int | None) -> Floats:
    """Return log S from equations 1 and 2 as printed: zeros outside the image, larger scales where more is marked."""
    from scipy import ndimage

    marked = (mask if known is None else mask & known).astype(np.float32)
    count = ndimage.uniform_filter(marked, window or _PAPER_WINDOW, mode="constant")
    middle = (float(count.min()) + float(count.max())) / 2
    scale = np.clip(count / middle, 1 / _WIDEST, _WIDEST)  # (1)
    mean = ndimage.uniform_filter(scale, _PAPER_SIZE, mode="nearest")
    scale = 0.8 * mean + 0.2 * ndimage.median_filter(scale, _PAPER_SIZE, mode="nearest")  # (2)
    return log_single(scale)
