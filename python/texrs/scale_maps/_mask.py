"""Scale maps measured from a feature mask (equations 1 and 2)."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_bool, as_choice, as_image, as_int, as_mask, exp_single, log_single
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput
from texrs.scale_maps._extrapolation import extend
from texrs.scale_maps._kinds import AREAS, Kind, ScaleMap
from texrs.scale_maps._maps import centre_logs
from texrs.scale_maps._trend import Trend, as_trend, follow_kind, gradient
from texrs.scale_maps._windows import Lattice, smooth

Measure: TypeAlias = Literal["boundary", "skeleton", "count", "area"]
"""What of a mask is counted."""

_MEASURES = ("boundary", "skeleton", "count", "area")
SMALLEST = 16
"""Pixels across the smallest picture and the smallest window."""
_PERIODS = 8
"""Spacings of the features across a window: some sixty features, so that their number is known to a tenth."""
_FEWEST = 6
"""Features without which a window says nothing."""
_WIDEST = 4.0
"""A window may say that elements are so many times as large, or as small, as the middle one."""
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
    """Return the scale map of a mask: the size of elements, by how densely the features of the mask lie.

    Where elements are seen twice as large there are half as many outlines in a window (equation 1 of [1]_, which counts
    the pixels of the mask and has it the other way round). What is measured so is smoothed (equation 2), on logarithms.

    Parameters
    ----------
    mask : array_like of bool
        Shape (H, W): the features, as of `auto_mask`, or drawn.
    measure : {"boundary", "skeleton", "count", "area"}
        ``"boundary"``: the length of the outlines; it does not matter which side of them is marked. ``"skeleton"``: the
        length of the features' middle lines, for curves. ``"count"``: how many features there are, for clean masks of
        elements that do not touch. ``"area"``: the pixels of the mask, in windows of 32, larger where there are more of
        them: the paper's equations as printed. They hold for none but drawn curves, and those they turn round; how
        much of a window is covered by areas does not depend on their size.
    window : int, optional
        Side of the windows in pixels, 16 or more. By default eight times the spacing of the features, up to a third of
        the shorter side.
    trend : {"none", "plane", "linear", "quadratic"}
        What the map is brought to by a robust fit: ``"plane"``, a flat surface in perspective, on which widths are linear in
        the picture; ``"linear"`` or ``"quadratic"``, log S is.
    foreshortened : bool
        Whether the picture shows a plane aslant. A mask gives the size of elements as the square root of their area; in
        perspective that is the 3/2 power of their width across the slope, which is what `from_angles` gives. With True
        the map is that width.
    known : array_like of bool, optional
        Shape (H, W): where the mask holds. What is not known is no part of any window; the map is continued into it
        (`extend`).

    Returns
    -------
    ScaleMap
        Float32, (H, W), with a geometric mean of 1; of areas, or if ``foreshortened`` of widths.

    Raises
    ------
    InvalidInput
        A mask that is empty, full, or holds too few features to be counted; a picture smaller than 16 pixels.

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
        raise InvalidInput("known: no pixel of the mask is known; there must be some to measure")
    if marked in (0, total):
        what = "marks nothing" if marked == 0 else "marks every pixel"
        raise InvalidInput(
            f"mask: {what}, so there are no features to count; mark the elements or the gaps between them, or give the "
            "scale by angles"
        )


def _measure(mask: Bools, known: Bools | None, what: str, window: int | None) -> Floats:
    """Return log S as the mask has it."""
    size = mask.shape[0], mask.shape[1]
    features, spacing, power = _find_features(mask, known, what)
    if window is None:
        window = int(np.clip(_PERIODS * spacing, SMALLEST, max(SMALLEST, min(size) / 3)))
    lattice = Lattice.of(size, window)
    density, enough, rows, columns = lattice.densities(features, known)
    typical = float(np.median(density[enough]))
    if typical <= 0 or _count_area(mask, known) < _FEWEST * spacing**2:
        raise InvalidInput(
            f"mask: holds too few features to count them in windows of {window} pixels; a mask with more of them, a "
            "larger window, or a scale by angles is needed"
        )
    ratio = np.clip(density / typical, _WIDEST ** (-1 / power), _WIDEST ** (1 / power))
    logs = np.float32(-power) * log_single(ratio)
    # What a window says holds at the middle of what it sees.
    cells = np.indices(logs.shape) * float(lattice.cell)
    down, across = gradient(logs, cells[0] - rows, cells[1] - columns, enough)
    logs += (down * rows + across * columns).astype(np.float32)
    logs = smooth(logs, enough, _ROUNDS)
    if not enough.all():
        logs = log_single(extend(ScaleMap(exp_single(logs), "area"), enough))
    return lattice.spread(logs)


def _find_features(mask: Bools, known: Bools | None, what: str) -> tuple[Array, float, float]:
    """Return what is counted at each pixel, how far apart features are, and the power of S in their density's inverse."""
    if what == "skeleton":
        from skimage.morphology import skeletonize

        lines = skeletonize(mask) if known is None else skeletonize(mask & known) & known
        return lines.view(np.uint8), _measure_spacing(int(np.count_nonzero(lines)), mask, known), 1.0
    if what == "count":
        points = _mark_middles(mask, known)
        number = max(1, int(points.sum(dtype=np.int64))) / 2
        return points, float(np.sqrt(_count_area(mask, known) / number)), 0.5
    outlines = _count_outlines(mask, known)
    # A line through a feature enters and leaves it, and there are lines along two axes.
    return outlines, _measure_spacing(int(outlines.sum(dtype=np.int64)) / 4, mask, known), 1.0


def _measure_spacing(lines: float, mask: Bools, known: Bools | None) -> float:
    return _count_area(mask, known) / max(0.25, lines)


def _count_area(mask: Bools, known: Bools | None) -> int:
    return mask.size if known is None else int(np.count_nonzero(known))


def _count_outlines(mask: Bools, known: Bools | None) -> NDArray[np.uint8]:
    """Count at each pixel how many of its neighbours, the next row's and the next column's, differ from it."""
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
    """Put 2 at the middle of each feature; 1 if the border or a hole cuts it, for half of those have theirs beyond."""
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
    """Equations 1 and 2 as printed: zeros beyond the border, and larger scales where more is marked."""
    from scipy import ndimage

    marked = (mask if known is None else mask & known).astype(np.float32)
    count = ndimage.uniform_filter(marked, window or _PAPER_WINDOW, mode="constant")
    middle = (float(count.min()) + float(count.max())) / 2
    scale = np.clip(count / middle, 1 / _WIDEST, _WIDEST)  # (1)
    mean = ndimage.uniform_filter(scale, _PAPER_SIZE, mode="nearest")
    scale = 0.8 * mean + 0.2 * ndimage.median_filter(scale, _PAPER_SIZE, mode="nearest")  # (2)
    return log_single(scale)
