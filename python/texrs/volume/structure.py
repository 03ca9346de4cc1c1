"""Statistics of the spatial structure of an image or a volume: frequency, orientation and artefacts.

Each function needs an array with one value per pixel or voxel, such as the `lightness`.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_bool, as_float, as_int, as_wrap, try_array
from texrs._typing import Floats
from texrs.errors import InvalidInput
from texrs.fields import Field
from texrs.fields.spaced import as_distances, find_distances, space
from texrs.volume.values import as_values, by_distance, check_field, correlate, drop_first, drop_last, turn_in_space

__all__ = [
    "autocorrelation",
    "frequency",
    "orientation_errors",
    "seam_planes",
    "slice_distances",
    "speckle",
    "texture_normal",
]

_BAND = (1 / 30, 0.45)
"""Frequencies that are used, in cycles per voxel.

Lower frequencies are the trend of a slice, and higher frequencies are noise.
"""


def autocorrelation(
    values: ArrayLike, reach: int = 12, *, spacing: Sequence[float] | None = None
) -> NDArray[np.float64]:
    """Return the autocorrelation along each axis: the correlation of values at a distance.

    Parameters
    ----------
    values : array_like
        Values (H, W) or (D, H, W), such as the `lightness`.
    reach : int
        Longest distance in pixels, at least 1. Distances longer than a side give NaN. Default: 12.
    spacing : sequence of float, optional
        Distances between samples along each axis, in any unit. Column k is then the value at k times the smallest
        spacing, by linear interpolation. Default: the spacing that the file of the volume states, else 1.

    Returns
    -------
    ndarray
        One curve per axis, of shape (A, reach + 1), with 1 at distance 0. One minus the curve is the variogram divided
        by the variance.

    Raises
    ------
    InvalidInput
        The values are not finite, do not have two or three axes, or ``reach`` is below 1.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> waves = np.sin(np.arange(160) * np.pi / 8)[None] * np.ones((8, 1))
    >>> volume.autocorrelation(waves, 16)[1, [0, 8, 16]].round(3)
    array([ 1., -1.,  1.])

    """
    v, far = as_values(values), as_int(reach, "reach", 1, 2**20)
    v = v - v.mean(dtype=np.float64)
    variance = max(float((v * v).mean(dtype=np.float64)), 1e-30)
    return by_distance(correlate(v, far, np.multiply) / variance, find_distances(spacing, values, v.ndim))


def frequency(values: ArrayLike, *, window: int | None = None, whole: bool = False) -> float:
    """Return the mean spectral frequency of a texture, in cycles per pixel.

    Slices across each axis are cut into half-overlapping windows with a Hann weight. Frequencies from 1/30 to 0.45 are
    averaged with their power as the weight. The result is the mean over all slices.

    Parameters
    ----------
    values : array_like
        Values (H, W) or (D, H, W), such as the `lightness`. An image is treated as one slice.
    window : int, optional
        Side of the windows in pixels, at least 16. Use the same windows for values that you compare. Default: 64, or
        the shortest side.
    whole : bool
        If True, the spectrum of the whole volume is used instead of slices. It does not change when the volume is
        rotated, whereas in slices oblique layers look wider. Default: False.

    Returns
    -------
    float
        Frequency from 1/30 to 0.45 cycles per pixel. NaN if all values are equal.

    Raises
    ------
    InvalidInput
        The values are not finite or do not have two or three axes, a side is below 16, or a window is longer than a
        side.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> waves = np.sin(np.arange(64) * 2 * np.pi / 8)[None] * np.ones((64, 1))
    >>> round(volume.frequency(waves), 3)
    0.125

    """
    v = as_values(values)
    if min(v.shape) < 16:
        raise InvalidInput(f"values: each side must be at least 16, got {v.shape}")
    side = min(64, *v.shape) if window is None else as_int(window, "window", 16, min(v.shape))
    if as_bool(whole, "whole") or v.ndim == 2:
        return _average_frequency([v], side)
    return _average_frequency([plane for axis in range(3) for plane in np.moveaxis(v, axis, 0)], side)


def seam_planes(values: ArrayLike, *, wrap: bool | Sequence[bool] = False) -> tuple[NDArray[np.float64], ...]:
    """Return the mean change between adjacent planes (or lines) along each axis, divided by the median change.

    Values far from 1 at regular distances reveal the grid of an algorithm.

    Parameters
    ----------
    values : array_like
        Values (H, W) or (D, H, W), such as the `lightness`.
    wrap : bool or one per axis
        Axes along which the values are periodic, so that the last plane is adjacent to the first. Default: False.

    Returns
    -------
    tuple of ndarray
        One array per axis. Entry i is the change from plane i to plane i + 1.

    Raises
    ------
    InvalidInput
        The values are not finite or do not have two or three axes, or ``wrap`` is invalid.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> picture = np.random.default_rng(0).random((64, 64))
    >>> picture[:, 32:] += 1
    >>> [int(change.argmax()) for change in volume.seam_planes(picture)][1]
    31

    """
    # Halve the values, because the difference of two values can exceed the range of float32. The ratios are the same.
    v = as_values(values) * np.float32(0.5)
    out = []
    for axis, cyclic in enumerate(as_wrap(wrap, axes=v.ndim)):
        others = tuple(a for a in range(v.ndim) if a != axis)
        after = np.roll(v, -1, axis) if cyclic else drop_first(v, axis, 1)
        before = v if cyclic else drop_last(v, axis, 1)
        change = np.abs(after - before).mean(axis=others, dtype=np.float64)
        out.append(change / max(float(np.median(change)) if change.size else 0.0, 1e-30))
    return tuple(out)


def speckle(values: ArrayLike, threshold: float = 0.35) -> float:
    """Return the fraction of points that differ from the median of their 3 x 3 (x 3) neighbourhood.

    Parameters
    ----------
    values : array_like
        Values (H, W) or (D, H, W), such as the `lightness`.
    threshold : float
        Difference above which a point counts, in the units of the values, at least 0. Default: 0.35.

    Returns
    -------
    float
        Fraction from 0 to 1.

    Raises
    ------
    InvalidInput
        The values are not finite or do not have two or three axes, or the threshold is negative.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> cube = np.zeros((10, 10, 10))
    >>> cube[5, 5, 5] = 1
    >>> volume.speckle(cube)
    0.001

    """
    from scipy.ndimage import median_filter

    v = as_values(values)
    limit = as_float(threshold, "threshold", 0, 1e9)
    around = np.ones((3,) * v.ndim, np.bool_)
    around[(1,) * v.ndim] = False
    return float((np.abs(v - median_filter(v, footprint=around, mode="reflect")) > limit).mean())


def slice_distances(exemplar: ArrayLike, values: ArrayLike, *, quantiles: int = 256) -> NDArray[np.float64]:
    """Return the Wasserstein distance between the values of each slice and the values of the exemplar.

    Parameters
    ----------
    exemplar : array_like
        Values of the exemplar, (H, W) or (D, H, W), such as its `lightness`.
    values : array_like
        Values of the output, (H, W) or (D, H, W), whose slices are compared.
    quantiles : int
        Number of compared quantiles of the distributions, 2 to 2^16. Default: 256.

    Returns
    -------
    ndarray
        One distance per slice, starting with the slices across the first axis. An image gives one distance.

    Raises
    ------
    InvalidInput
        The values are not finite or do not have two or three axes, or the number of quantiles is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> cube = np.random.default_rng(0).random((8, 8, 8))
    >>> volume.slice_distances(cube, cube + 0.5).mean().round(1)
    np.float64(0.5)

    """
    e, v = as_values(exemplar, "exemplar"), as_values(values)
    at = (np.arange(as_int(quantiles, "quantiles", 2, 2**16)) + 0.5) / quantiles
    wanted = np.quantile(e, at)
    if v.ndim == 2:
        return np.array([np.abs(np.quantile(v, at) - wanted).mean()])
    found = [np.quantile(plane, at) for axis in range(3) for plane in np.moveaxis(v, axis, 0)]
    return np.asarray(np.abs(np.array(found) - wanted).mean(axis=1))


def texture_normal(values: ArrayLike, *, spacing: Sequence[float] | None = None) -> NDArray[np.float64]:
    """Return the direction of the largest change in an exemplar, which is the normal of its layers.

    Parameters
    ----------
    values : array_like
        Values (H, W) or (D, H, W), such as the `lightness`.
    spacing : sequence of float, optional
        Distances between samples along each axis, in any unit, so that the direction is correct in space. Default: the
        spacing that the file of the volume states, else 1.

    Returns
    -------
    (A,) float64
        Unit vector whose largest component is positive.

    Raises
    ------
    InvalidInput
        The values are not finite or do not have two or three axes.

    Examples
    --------
    >>> from texrs import samples, volume
    >>> normal = volume.texture_normal(volume.lightness(samples.stripes((32, 40, 40)).image))
    >>> bool(normal[0] > 0.95)
    True

    """
    v = as_values(values)
    tensor = _measure_structure(v, 0.0, find_distances(spacing, values, v.ndim))
    if not np.isfinite(tensor).all():
        raise InvalidInput("values: must be small enough that their products are finite")
    vectors = np.linalg.eigh(tensor.reshape(-1, *tensor.shape[-2:]).mean(axis=0))[1]
    normal: NDArray[np.float64] = vectors[:, -1]
    return normal * (1 if normal[np.abs(normal).argmax()] > 0 else -1)


def orientation_errors(
    values: ArrayLike,
    field: Field | None = None,
    normal: ArrayLike | None = None,
    *,
    margin: int = 6,
    step: int = 1,
    spacing: Sequence[float] | None = None,
) -> Floats:
    """Return the angles between the layers of a texture and their expected direction in a field.

    The actual normal is the main direction of the structure tensor (gradients of a Gaussian of sigma 1 pixel, averaged
    with a Gaussian of sigma 4). The expected normal is J^T n, where n is the exemplar's normal and J the Jacobian of
    the field.

    Parameters
    ----------
    values : array_like
        Values (H, W) or (D, H, W), such as the `lightness`.
    field : Field, optional
        Field of the texture. Default: the identity.
    normal : array_like, optional
        Normal n of the exemplar, (A,). Default: `texture_normal` of ``values``.
    margin : int
        Width of the border in pixels that is excluded, because the structure tensor is not reliable there. Default: 6.
    step : int
        Distance between measured points along each axis, in pixels. Default: 1.
    spacing : sequence of float, optional
        Distances between samples along each axis, in any unit, so that the field, the normal and the angles are
        correct in space. Default: the spacing that the file of the volume states, else 1.

    Returns
    -------
    ndarray
        Angles in degrees, 0 to 90, in float32. The shape is the shape of ``values`` without the margins, divided by
        ``step``.

    Raises
    ------
    InvalidInput
        The number of axes differs, the normal is zero, or the margins leave no points.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import samples, volume
    >>> stripes = volume.lightness(samples.stripes((40, 40, 40)).image)
    >>> float(np.median(volume.orientation_errors(stripes))) < 10
    True

    """
    v, edge = as_values(values), as_int(margin, "margin", 0, 2**20)
    each = as_int(step, "step", 1, 2**20)
    if min(v.shape) <= 2 * edge:
        raise InvalidInput(f"margin: must be less than half of each side of the array, {v.shape}, got {edge}")
    turned, spacing = check_field(field, v.ndim), find_distances(spacing, values, v.ndim)
    turned = None if turned is None else space(turned, spacing)
    n = texture_normal(v, spacing=spacing) if normal is None else try_array(normal, np.float64)
    if n.shape != (v.ndim,) or not 1e-12 < float(np.abs(n).max()) < 1e12:
        received = n.tolist() if n.size <= v.ndim else f"shape {n.shape}"
        raise InvalidInput(
            f"normal: must be {v.ndim} numbers whose largest magnitude is from 1e-12 to 1e12; got {received}"
        )
    inner = (slice(edge, -edge or None, each),) * v.ndim
    tensor = _measure_structure(v, 4.0, spacing)[inner]
    out = np.empty(tensor.shape[: v.ndim], np.float32)
    for i, plane in enumerate(
        tensor
    ):  # Process one plane at a time, because a dense field of a large volume needs many times its memory.
        found = np.linalg.eigh(plane)[1][..., -1]
        wanted = n
        if turned is not None:
            index = np.stack(np.meshgrid(*map(np.arange, (1, *plane.shape[: v.ndim - 1])), indexing="ij"), axis=-1)[0]
            points = (index + np.eye(v.ndim, dtype=int)[0] * i) * each + edge
            wanted = np.einsum("...ji,j->...i", turn_in_space(turned, points, spacing), n)
        length = np.linalg.norm(wanted, axis=-1)
        cosine = np.abs((found * wanted).sum(axis=-1)) / np.maximum(length, 1e-30)
        out[i] = np.degrees(np.arccos(np.minimum(cosine, 1)))
    return out


def _measure_structure(v: Floats, sigma: float, spacing: Sequence[float] | None) -> NDArray[np.float64]:
    from scipy.ndimage import gaussian_filter

    gradients = [
        gaussian_filter(v, 1.0, order=[int(a == b) for b in range(v.ndim)]) / np.float32(step)
        for a, step in enumerate(as_distances(spacing, v.ndim))
    ]
    tensor = np.empty((*v.shape, v.ndim, v.ndim), np.float64)
    for i in range(v.ndim):
        for j in range(i, v.ndim):
            entry = gradients[i] * gradients[j]
            entry = gaussian_filter(entry, sigma) if sigma else entry
            tensor[..., i, j] = tensor[..., j, i] = entry
    return tensor


def _average_frequency(arrays: list[Floats], side: int) -> float:
    """Return the mean frequency of each array, averaged over the arrays. NaN if all are constant."""
    axes = arrays[0].ndim
    weights, square = np.ones((side,) * axes, np.float32), np.zeros((side,) * axes)
    for a in range(axes):
        line = (slice(None),) + (np.newaxis,) * (axes - 1 - a)
        weights *= np.hanning(side + 2)[1:-1][line].astype(np.float32)
        square += np.fft.fftfreq(side)[line] ** 2
    # The spectrum of real values is symmetric. Keep half of the last axis, and count each column twice, except the
    # first and (for even sides) the last.
    half = side // 2 + 1
    at = np.sqrt(square[..., :half])
    share = np.where((np.arange(half) == 0) | (2 * np.arange(half) == side), 1.0, 2.0)
    share = np.where((at >= _BAND[0]) & (at <= _BAND[1]), share, 0.0)
    found = []
    for v in arrays:
        power = np.zeros(at.shape)
        for start in product(*(_list_starts(n, side) for n in v.shape)):
            part = v[tuple(slice(s, s + side) for s in start)]
            spectrum = np.fft.rfftn((part - part.mean(dtype=np.float64)) * weights)
            power += spectrum.real**2 + spectrum.imag**2
        power *= share
        if power.sum() > 1e-20 * part.size:
            found.append(float((power * at).sum() / power.sum()))
    return float(np.mean(found)) if found else float("nan")


def _list_starts(length: int, side: int) -> list[int]:
    count = max(1, -(-(length - side) * 2 // side) + 1)
    return sorted({round(float(start)) for start in np.linspace(0, length - side, count)})
