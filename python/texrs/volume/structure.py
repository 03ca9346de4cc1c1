"""Statistics of the arrangement of values in an image or a volume: frequency, orientation, artefacts.

Each takes values of one channel, such as a `lightness`, in 2-D or in 3-D.
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
from texrs.fields._spaced import as_distances, find_distances, space
from texrs.volume._values import as_values, by_distance, check_field, correlate, drop_first, drop_last, turn_in_space

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
"""Frequencies in cycles a voxel. Lower ones are the trend of a slice, and higher ones its grain."""


def autocorrelation(
    values: ArrayLike, reach: int = 12, *, spacing: Sequence[float] | None = None
) -> NDArray[np.float64]:
    """Return the correlation of values with those a number of steps further, along each axis.

    Parameters
    ----------
    values : array_like
        Values (H, W) or (D, H, W), such as a `lightness`.
    reach : int
        Longest step in pixels, at least 1. Steps longer than a side give NaN.
    spacing : sequence of float, optional
        Distances between samples along each axis. Column k is then a distance of k times the smallest of them,
        interpolated between steps. Default: the spacing that the file of the volume
        states, else 1.

    Returns
    -------
    ndarray
        Curves of shape (A, reach + 1), 1 at step 0. One minus this is the variogram divided by the variance.

    Raises
    ------
    InvalidInput
        If values are not finite numbers of two or three axes, or reach is below 1.

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
    """Return the mean spectral frequency of a texture, in cycles a pixel.

    Each axis slice is cut into windows that overlap by half, with a Hann window. Frequencies from 1/30 to 0.45 are
    weighted by their power. The result is the mean over the slices.

    Parameters
    ----------
    values : array_like
        Values (H, W) or (D, H, W), such as a `lightness`. An image is its own only slice.
    window : int, optional
        Side of the windows, at least 16. Default: 64, or the shortest side. Compared values need the same windows.
    whole : bool
        If True, use the spectrum of the volume and not of its slices. It does not change when the volume is rotated,
        but slices show an oblique layer as wider.

    Returns
    -------
    float
        Frequency from 1/30 to 0.45. NaN if all values are equal.

    Raises
    ------
    InvalidInput
        If values are not finite numbers of two or three axes, a side is below 16, or a window is longer than a side.

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
    """Return the mean change from each plane or line to the next along each axis, divided by the median.

    Values far from 1 at regular places are traces of an algorithm's lattice.

    Parameters
    ----------
    values : array_like
        Values (H, W) or (D, H, W), such as a `lightness`.
    wrap : bool or one per axis
        Axes along which the last plane is followed by the first.

    Returns
    -------
    tuple of ndarray
        One number a step for each axis. Number i belongs to the step from plane i to plane i + 1.

    Raises
    ------
    InvalidInput
        If values are not finite numbers of two or three axes, or wrap is invalid.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> picture = np.random.default_rng(0).random((64, 64))
    >>> picture[:, 32:] += 1
    >>> [int(change.argmax()) for change in volume.seam_planes(picture)][1]
    31

    """
    # Use halves, because the difference of two values may exceed single precision. The ratios are the same.
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
    """Return the share of voxels or pixels that differ from the median of their neighbourhood, 3 a side.

    Parameters
    ----------
    values : array_like
        Values (H, W) or (D, H, W), such as a `lightness`.
    threshold : float
        Minimum difference, in the units of the values, at least 0.

    Returns
    -------
    float
        Share from 0 to 1.

    Raises
    ------
    InvalidInput
        If values are not finite numbers of two or three axes, or the threshold is negative.

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
    """Return the Wasserstein distance of the values of each axis slice to those of the whole exemplar.

    Parameters
    ----------
    exemplar : array_like
        Values of the exemplar, (H, W) or (D, H, W), such as a `lightness`.
    values : array_like
        Values of the output, (H, W) or (D, H, W).
    quantiles : int
        Number of quantiles, 2 to 2^16.

    Returns
    -------
    ndarray
        One number a slice, slices across the first axis first. An image gives one number.

    Raises
    ------
    InvalidInput
        If values are not finite numbers of two or three axes, or the number of quantiles is out of range.

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
    """Return the direction of the largest change of an exemplar, the normal of its layers.

    Parameters
    ----------
    values : array_like
        Values (H, W) or (D, H, W), such as a `lightness`.
    spacing : sequence of float, optional
        Distances between samples along each axis. The direction is in space. Default: the spacing that the file of the
        volume states, else 1.

    Returns
    -------
    (A,) float64
        Direction of length 1. Its largest entry is positive.

    Raises
    ------
    InvalidInput
        If values are not finite numbers of two or three axes.

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
    """Return the angle between the layers of a texture and the exemplar's layers after a field.

    The actual normal is the main direction of the structure tensor (gradients of a Gaussian of sigma 1, summed under
    one of sigma 4). The expected one is J^T n, the transformation of normals, with the exemplar's normal n.

    Parameters
    ----------
    values : array_like
        Values (H, W) or (D, H, W), such as a `lightness`.
    field : Field, optional
        Field of the texture. Default: the identity.
    normal : array_like, optional
        Normal n of the exemplar, (A,). Default: `texture_normal` of the values themselves.
    margin : int
        Pixels at the border that are left out, because the structure tensor lacks data there.
    step : int
        Distance in pixels between measured points along each axis.
    spacing : sequence of float, optional
        Distances between samples along each axis. The field, the normal and the angles are in space. Default: the
        spacing that the file of the volume states, else 1.

    Returns
    -------
    ndarray
        Degrees from 0 to 90, float32, of the shape less two margins, divided by the step.

    Raises
    ------
    InvalidInput
        If the number of axes differs, the normal has no length, or the margin leaves nothing.

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
        raise InvalidInput(f"margin: must leave a part of {v.shape}, got {edge} on both sides")
    turned, spacing = check_field(field, v.ndim), find_distances(spacing, values, v.ndim)
    turned = None if turned is None else space(turned, spacing)
    n = texture_normal(v, spacing=spacing) if normal is None else try_array(normal, np.float64)
    if n.shape != (v.ndim,) or not 1e-12 < float(np.abs(n).max()) < 1e12:
        raise InvalidInput(f"normal: must be {v.ndim} numbers, not all zero, got shape {n.shape}")
    inner = (slice(edge, -edge or None, each),) * v.ndim
    tensor = _measure_structure(v, 4.0, spacing)[inner]
    out = np.empty(tensor.shape[: v.ndim], np.float32)
    for i, plane in enumerate(
        tensor
    ):  # Process a plane at a time: a dense field of a large volume is many times its size.
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
    """Return the mean over some arrays of the mean frequency of each. NaN if all are constant."""
    axes = arrays[0].ndim
    weights, square = np.ones((side,) * axes, np.float32), np.zeros((side,) * axes)
    for a in range(axes):
        line = (slice(None),) + (np.newaxis,) * (axes - 1 - a)
        weights *= np.hanning(side + 2)[1:-1][line].astype(np.float32)
        square += np.fft.fftfreq(side)[line] ** 2
    # The spectrum of real data is symmetric. Keep half of the last axis, and count each column twice, except the first
    # and (for even sides) the last.
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
