"""Statistics of the materials of an image or a volume: colour classes, volume fractions, and connected components.

Values are scaled to [0, 1] by the range of their dtype. Floats outside [0, 1] are scaled by their own range (in
`compare`, by the range of the exemplar).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_int
from texrs._show import brief
from texrs._typing import Floats
from texrs.errors import InvalidInput
from texrs.fields.spaced import as_distances, find_distances
from texrs.volume.values import as_colours, as_region, by_distance, correlate, drop_first, drop_last

__all__ = [
    "Classes",
    "ComponentStatistics",
    "classes",
    "component_statistics",
    "lightness",
    "lineal_path_function",
    "two_point_correlation",
]

_SAMPLE = 2**15
"""Number of pixels that classes are computed from."""
_RESTARTS, _TURNS = 6, 40


@dataclass(frozen=True, slots=True, eq=False)
class Classes:
    """Colours that represent the materials of a texture, from dark to light, and classify other pixels.

    Attributes
    ----------
    centres : (K, C) float32
        Mean colour of each class, in [0, 1].

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> volume.classes(np.array([[0, 255], [255, 250]], np.uint8), 2).centres.shape
    (2, 1)

    """

    centres: Floats

    __repr__ = brief

    def of(self, image: ArrayLike, *, axes: int | None = None) -> NDArray[np.uint8]:
        """Return the class of each pixel or voxel: the nearest centre, or the lower index of two equally near centres.

        Parameters
        ----------
        image : (H, W[, C]) or (D, H, W[, C]) array_like
            Image or volume with the channels of the exemplar.
        axes : int, optional
            Number of spatial axes, 2 or 3. Default: from the shape. An array of three axes is an image with channels
            if its last axis has at most 4 entries, and otherwise a volume.

        Returns
        -------
        (H, W) or (D, H, W) uint8
            Index of the nearest centre in `centres`.

        Raises
        ------
        InvalidInput
            The number of channels differs, or values are not finite.

        Examples
        --------
        >>> import numpy as np
        >>> from texrs import volume
        >>> picture = np.array([[0, 255], [255, 250]], np.uint8)
        >>> volume.classes(picture, 2).of(picture)
        array([[0, 1],
               [1, 1]], dtype=uint8)

        """
        colours = as_colours(image, "image", axes)
        if colours.shape[-1] != self.centres.shape[1]:
            raise InvalidInput(f"image: must have {self.centres.shape[1]} colour channels, got {colours.shape[-1]}")
        return self._find_nearest(colours)

    def shares(self, image: ArrayLike, *, axes: int | None = None) -> NDArray[np.float64]:
        """Return the fraction of the pixels or voxels in each class.

        Parameters
        ----------
        image : (H, W[, C]) or (D, H, W[, C]) array_like
            Image or volume with the channels of the exemplar.
        axes : int, optional
            Number of spatial axes, 2 or 3. Default: from the shape. An array of three axes is an image with channels
            if its last axis has at most 4 entries, and otherwise a volume.

        Returns
        -------
        (K,) float64
            Fractions, whose sum is 1.

        Raises
        ------
        InvalidInput
            The number of channels differs, or values are not finite.

        Examples
        --------
        >>> import numpy as np
        >>> from texrs import volume
        >>> picture = np.array([[0, 255], [255, 250]], np.uint8)
        >>> volume.classes(picture, 2).shares(picture)
        array([0.25, 0.75])

        """
        labels = self.of(image, axes=axes)
        return np.bincount(labels.ravel(), minlength=len(self.centres)) / labels.size

    def _find_nearest(self, colours: Floats) -> NDArray[np.uint8]:
        best = np.full(colours.shape[:-1], np.inf, np.float32)
        label = np.zeros(colours.shape[:-1], np.uint8)
        for k, centre in enumerate(self.centres):
            far = ((colours - centre) ** 2).sum(axis=-1, dtype=np.float32)
            nearer = far < best
            label[nearer], best[nearer] = k, far[nearer]
        return label


@dataclass(frozen=True, slots=True)
class ComponentStatistics:
    """Number and sizes of the connected components of a material (see `component_statistics`).

    Attributes
    ----------
    count : int
        Number of components of at least the minimum size.
    density : float
        Components per 100 000 pixels or voxels. If a spacing was given: per 100 000 units of area or volume.
    mean, median : float
        Size in pixels or voxels, or in units of area or volume if a spacing was given. NaN if there are no components.
    deciles : tuple of float
        The nine sizes that 10 %, 20 %, ... 90 % of the components do not exceed.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> mask = np.zeros((12, 12), bool)
    >>> mask[1:5, 1:5] = mask[7:11, 7:11] = True
    >>> found = volume.component_statistics(mask)
    >>> found.count, found.mean
    (2, 16.0)

    """

    count: int
    density: float
    mean: float
    median: float
    deciles: tuple[float, ...]

    __repr__ = brief


def lightness(image: ArrayLike, *, axes: int | None = None) -> Floats:
    """Return the mean of the colour channels at each point. Transparent points are shown over mid grey.

    Parameters
    ----------
    image : (H, W[, C]) or (D, H, W[, C]) array_like
        Image or volume, with or without channels.
    axes : int, optional
        Number of spatial axes, 2 or 3. Default: from the shape. An array of three axes is an image with channels if its
        last axis has at most 4 entries, and otherwise a volume.

    Returns
    -------
    (H, W) or (D, H, W) float32
        Lightness in [0, 1].

    Raises
    ------
    InvalidInput
        The argument is not an image or a volume, or not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> volume.lightness(np.full((2, 2, 3), 51, np.uint8))
    array([[0.2, 0.2],
           [0.2, 0.2]], dtype=float32)

    """
    return np.asarray(as_colours(image, "image", axes).mean(axis=-1, dtype=np.float32))


def classes(exemplar: ArrayLike, count: int = 4, *, axes: int | None = None) -> Classes:
    """Find the colours that best represent an exemplar (k-means), from dark to light.

    Parameters
    ----------
    exemplar : (H, W[, C]) or (D, H, W[, C]) array_like
        Image or volume, with or without channels.
    count : int
        Number of classes, 2 to 16. If the exemplar has fewer colours, each colour is a class. Default: 4.
    axes : int, optional
        Number of spatial axes, 2 or 3. Default: from the shape. An array of three axes is an image with channels if
        its last axis has at most 4 entries, and otherwise a volume.

    Returns
    -------
    Classes
        Class colours, which can classify any image of the same channels.

    Raises
    ------
    InvalidInput
        The exemplar is not an image or a volume, or not finite, or ``count`` is out of range.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> found = volume.classes(np.repeat([10, 20, 200], 100).astype(np.uint8).reshape(3, 10, 10), 3)
    >>> (found.centres.ravel() * 255).round()
    array([ 10.,  20., 200.], dtype=float32)

    """
    k = as_int(count, "count", 2, 16)
    colours = as_colours(exemplar, "exemplar", axes)
    flat = colours.reshape(-1, colours.shape[-1])
    rng = np.random.default_rng(0)
    if len(flat) > _SAMPLE:
        flat = flat[rng.choice(len(flat), _SAMPLE, replace=False)]
    points, weights = np.unique(flat, axis=0, return_counts=True)
    k = min(k, len(points))
    best, least = points[:k].astype(np.float64), np.inf
    for _ in range(_RESTARTS):
        centres, spread = _find_means(points, weights.astype(np.float64), k, rng)
        if spread < least * (1 - 1e-9):
            best, least = centres, spread
    return Classes(np.ascontiguousarray(best[np.argsort(best.mean(axis=1), kind="stable")], np.float32))


def two_point_correlation(
    mask: ArrayLike, reach: int = 16, *, spacing: Sequence[float] | None = None
) -> NDArray[np.float64]:
    """Return the two-point correlation S2 along each axis: the chance that two points at a distance are in a material.

    Parameters
    ----------
    mask : array_like
        Mask of the material, bool, (H, W) or (D, H, W).
    reach : int
        Longest distance in pixels, at least 1. Distances longer than a side give NaN. Default: 16.
    spacing : sequence of float, optional
        Distances between samples along each axis, in any unit. Column k is then the value at k times the smallest
        spacing, by linear interpolation. Default: the spacing that the file of the volume states, else 1.

    Returns
    -------
    ndarray
        One curve per axis, of shape (A, reach + 1). The value at distance 0 is the fraction of the material.

    Raises
    ------
    InvalidInput
        The argument is not a mask of two or three axes, or ``reach`` is below 1.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> stripes = np.arange(40) % 4 < 2
    >>> volume.two_point_correlation(np.tile(stripes, (40, 1)), 4)[1].round(2)
    array([0.5 , 0.26, 0.  , 0.24, 0.5 ])

    """
    phase, far = as_region(mask), as_int(reach, "reach", 1, 2**20)
    return by_distance(correlate(phase, far, np.logical_and), find_distances(spacing, mask, phase.ndim))


def lineal_path_function(
    mask: ArrayLike, reach: int = 16, *, spacing: Sequence[float] | None = None
) -> NDArray[np.float64]:
    """Return the lineal path function along each axis: the probability that a whole segment is in a material.

    Parameters
    ----------
    mask : array_like
        Mask of the material, bool, (H, W) or (D, H, W).
    reach : int
        Longest segment in pixels, at least 1. Segments longer than a side give NaN. Default: 16.
    spacing : sequence of float, optional
        Distances between samples along each axis, in any unit. Column k is then the value at k times the smallest
        spacing, by linear interpolation. Default: the spacing that the file of the volume states, else 1.

    Returns
    -------
    ndarray
        One curve per axis, of shape (A, reach + 1). The value at length 0 is the fraction of the material.

    Raises
    ------
    InvalidInput
        The argument is not a mask of two or three axes, or ``reach`` is below 1.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> volume.lineal_path_function(np.tile(np.arange(40) % 4 < 2, (40, 1)), 2)[1].round(2)
    array([0.5 , 0.26, 0.  ])

    """
    phase, far = as_region(mask), as_int(reach, "reach", 1, 2**20)
    out = np.full((phase.ndim, far + 1), np.nan)
    for axis in range(phase.ndim):
        path = phase
        for step in range(min(far + 1, phase.shape[axis])):
            if step:
                path = drop_last(path, axis, 1) & drop_first(phase, axis, step)
            out[axis, step] = path.mean()
    return by_distance(out, find_distances(spacing, mask, phase.ndim))


def component_statistics(
    mask: ArrayLike, *, least: int = 8, spacing: Sequence[float] | None = None
) -> ComponentStatistics:
    """Return the number and sizes of the connected components of a material. Connected points share a side.

    Parameters
    ----------
    mask : array_like
        Mask of the material, bool, (H, W) or (D, H, W).
    least : int
        Minimum size of a component in pixels or voxels, at least 1. Smaller components are treated as noise and not
        counted. Default: 8.
    spacing : sequence of float, optional
        Distances between samples along each axis, in any unit. Sizes and density then use this unit. Default: the
        spacing that the file of the volume states, else 1.

    Returns
    -------
    ComponentStatistics
        Number, density and sizes of the components.

    Raises
    ------
    InvalidInput
        The argument is not a mask of two or three axes.

    Examples
    --------
    >>> from texrs import samples, volume
    >>> stone = samples.particles((48, 48, 48))
    >>> volume.component_statistics(stone.mask).count >= len(stone.centres)  # a piece at the border may be two
    True

    """
    from scipy.ndimage import label

    phase, low = as_region(mask), as_int(least, "least", 1, 2**40)
    pieces, count = label(phase)
    sizes: NDArray[Any] = np.bincount(pieces.ravel(), minlength=count + 1)[1:]
    cell = float(np.prod(as_distances(find_distances(spacing, mask, phase.ndim), phase.ndim)))
    sizes = sizes[sizes >= low] * cell
    if not len(sizes):
        return ComponentStatistics(0, 0.0, np.nan, np.nan, (np.nan,) * 9)
    deciles = np.quantile(sizes, np.arange(1, 10) / 10, method="inverted_cdf")
    return ComponentStatistics(
        len(sizes),
        1e5 * len(sizes) / (phase.size * cell),
        float(sizes.mean()),
        float(np.median(sizes)),
        tuple(deciles.astype(float).tolist()),
    )


def _find_means(
    points: Floats, weights: NDArray[np.float64], k: int, rng: np.random.Generator
) -> tuple[NDArray[np.float64], float]:
    """Return k cluster centres by Lloyd iterations, and the remaining variance. The initial centres are far apart."""
    p = points.astype(np.float64)
    centres = p[rng.choice(len(p), 1, p=weights / weights.sum())]
    while len(centres) < k:
        far = _measure_squares(p, centres).min(axis=1) * weights
        centres = np.concatenate([centres, p[rng.choice(len(p), 1, p=far / far.sum())]])
    for _ in range(_TURNS):
        label = _measure_squares(p, centres).argmin(axis=1)
        total = np.asarray(np.bincount(label, weights, k), np.float64)
        moved = np.stack([np.asarray(np.bincount(label, weights * c, k), np.float64) for c in p.T], axis=1)
        moved = np.where(total[:, np.newaxis] > 0, moved / np.maximum(total, 1e-30)[:, np.newaxis], centres)
        if np.abs(moved - centres).max() < 1e-6:
            break
        centres = moved
    return centres, float((_measure_squares(p, centres).min(axis=1) * weights).sum())


def _measure_squares(points: NDArray[np.float64], centres: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([((points - c) ** 2).sum(axis=1) for c in centres], axis=1)
