"""Statistics of how the values of a picture or a volume are arranged: frequency, orientation, artefacts.

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
from texrs.fields._spaced import as_distances, space
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
"""Cycles a voxel: longer waves are the trend of a slice, shorter ones its grain."""


def autocorrelation(
    values: ArrayLike, reach: int = 12, *, spacing: Sequence[float] | None = None
) -> NDArray[np.float64]:
    """Return the correlation of values with those some steps further, along each axis.

    Parameters
    ----------
    values : array_like
        (H, W) or (D, H, W), such as a `lightness`.
    reach : int
        Longest step in pixels, at least 1; one that is longer than a side is NaN there.
    spacing : sequence of float, optional
        Distances between samples along each axis. Column k is then a distance of k times the smallest of them, interpolated
        between steps. Default: 1.

    Returns
    -------
    ndarray
        Shape (A, reach + 1); 1 at step 0. One less this is the variogram over the variance.

    Raises
    ------
    InvalidInput
        Not finite numbers of two or three axes, or a reach below 1.

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
    return by_distance(correlate(v, far, np.multiply) / variance, spacing)


def frequency(values: ArrayLike, *, window: int | None = None, whole: bool = False) -> float:
    """Return the mean spectral frequency of a texture, in cycles a pixel.

    Of each axis slice: it is cut into windows that overlap by half, under a Hann window; frequencies from 1/30 to
    0.45 are weighted by their power. The result is the mean over the slices.

    Parameters
    ----------
    values : array_like
        (H, W) or (D, H, W), such as a `lightness`. A picture is its own only slice.
    window : int, optional
        Side of the windows, at least 16; by default 64, or the shortest side. What is compared needs the same.
    whole : bool
        Whether the spectrum is that of the volume, not of its slices: turning the volume does not change it, where
        slices see an oblique layer as wider.

    Returns
    -------
    float
        From 1/30 to 0.45; NaN where nothing changes.

    Raises
    ------
    InvalidInput
        Not finite numbers of two or three axes, a side below 16, or a window that is longer than a side.

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
    """Return, for each axis, the mean change from each plane (or line) to the next, over the median of all.

    Values far from 1 at regular places are the traces of an algorithm's lattice.

    Parameters
    ----------
    values : array_like
        (H, W) or (D, H, W), such as a `lightness`.
    wrap : bool or one an axis
        Axes along which the last plane is followed by the first.

    Returns
    -------
    tuple of ndarray
        For each axis one number a step: number i stands for that from plane i to plane i + 1.

    Raises
    ------
    InvalidInput
        Not finite numbers of two or three axes, or not such a choice of axes.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> picture = np.random.default_rng(0).random((64, 64))
    >>> picture[:, 32:] += 1
    >>> [int(change.argmax()) for change in volume.seam_planes(picture)][1]
    31

    """
    # Of halves, for two values may differ by more than single precision can be; shares are the same.
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
    """Return the share of voxels (pixels) that differ from the median of their surroundings, 3 a side.

    Parameters
    ----------
    values : array_like
        (H, W) or (D, H, W), such as a `lightness`.
    threshold : float
        By how much they differ at least, in the units of the values, from 0.

    Returns
    -------
    float
        0 to 1.

    Raises
    ------
    InvalidInput
        Not finite numbers of two or three axes, or a negative threshold.

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
        (H, W) or (D, H, W), such as a `lightness`.
    values : array_like
        Those of the output, (H, W) or (D, H, W).
    quantiles : int
        How many are compared, 2 to 2^16.

    Returns
    -------
    ndarray
        One number a slice, those across the first axis first; of a picture one number, of the whole.

    Raises
    ------
    InvalidInput
        Not finite numbers of two or three axes, or a number of quantiles out of range.

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
    """Return the direction in which an exemplar changes most, the normal of its layers.

    Parameters
    ----------
    values : array_like
        (H, W) or (D, H, W), such as a `lightness`.
    spacing : sequence of float, optional
        Distances between samples along each axis. The direction is one of space. Default: 1.

    Returns
    -------
    (A,) float64
        Of length 1; its largest entry is positive.

    Raises
    ------
    InvalidInput
        Not finite numbers of two or three axes.

    Examples
    --------
    >>> from texrs import samples, volume
    >>> normal = volume.texture_normal(volume.lightness(samples.stripes((32, 40, 40)).image))
    >>> bool(normal[0] > 0.95)
    True

    """
    tensor = _measure_structure(as_values(values), 0.0, spacing)
    if not np.isfinite(tensor).all():
        raise InvalidInput("values: are so large that their products are infinite")
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
    """Return the angle between the layers of a texture and where a field turns those of its exemplar.

    The normal that is there is the main direction of the structure tensor (gradients of a Gaussian of sigma 1, summed
    under one of sigma 4). The wanted one is J^T n, as normals go, for the exemplar's normal n.

    Parameters
    ----------
    values : array_like
        (H, W) or (D, H, W), such as a `lightness`.
    field : Field, optional
        By default the identity.
    normal : array_like, optional
        n, (A,); by default `texture_normal` of the values themselves, which is that of an exemplar.
    margin : int
        Pixels at the border that are left out: there the structure tensor sees too little.
    step : int
        Every so many pixels along each axis are looked at.
    spacing : sequence of float, optional
        Distances between samples along each axis. The field, the normal and the angles are those of space. Default: 1.

    Returns
    -------
    ndarray
        Degrees from 0 to 90, float32, of the shape less two margins, divided by the step.

    Raises
    ------
    InvalidInput
        Another number of axes, or a normal of no length, or nothing within the margin.

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
        raise InvalidInput(f"margin: {edge} on both sides leaves nothing of {v.shape}")
    turned = check_field(field, v.ndim)
    turned = None if turned is None else space(turned, spacing)
    n = texture_normal(v, spacing=spacing) if normal is None else try_array(normal, np.float64)
    if n.shape != (v.ndim,) or not 1e-12 < float(np.abs(n).max()) < 1e12:
        raise InvalidInput(f"normal: needs {v.ndim} numbers, not all zero, got shape {n.shape}")
    inner = (slice(edge, -edge or None, each),) * v.ndim
    tensor = _measure_structure(v, 4.0, spacing)[inner]
    out = np.empty(tensor.shape[: v.ndim], np.float32)
    for i, plane in enumerate(tensor):  # A plane at once: a dense field of a large volume is many times its size.
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
    """Return the mean over some arrays of the mean frequency of each; NaN where none changes at all."""
    axes = arrays[0].ndim
    weights, square = np.ones((side,) * axes, np.float32), np.zeros((side,) * axes)
    for a in range(axes):
        line = (slice(None),) + (np.newaxis,) * (axes - 1 - a)
        weights *= np.hanning(side + 2)[1:-1][line].astype(np.float32)
        square += np.fft.fftfreq(side)[line] ** 2
    # A real spectrum repeats itself: of the last axis half of it is enough, but for its ends twice.
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
