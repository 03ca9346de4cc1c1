"""Numbers that say whether a synthesised picture or volume is like its exemplar.

Each is a small function of arrays, usable alone, in 2-D and in 3-D. Values are brought to [0, 1] by the dtype, or, of
floats beyond that, by their own range (`compare` uses one range for both of what it compares).
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from texrs._arrays import as_float, as_image, as_int, guidance
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput
from texrs.fields import Field

__all__ = [
    "Classes",
    "Particles",
    "autocorrelation",
    "classes",
    "frequency",
    "isolated",
    "lightness",
    "lineal_path",
    "orientation_errors",
    "particles",
    "seam_planes",
    "slice_distances",
    "texture_normal",
    "two_point",
]

_SAMPLE = 2**15
"""Pixels that classes are found on."""
_RESTARTS, _TURNS = 6, 40
_BAND = (1 / 30, 0.45)
"""Cycles a voxel: longer waves are the trend of a slice, shorter ones its grain."""


@dataclass(frozen=True, slots=True, eq=False)
class Classes:
    """Colours that stand for the materials of a texture, from dark to light.

    Attributes
    ----------
    centres : (K, C) float32
        The mean colour of each, in [0, 1].

    """

    centres: Floats

    def of(self, image: ArrayLike, *, axes: int | None = None) -> NDArray[np.uint8]:
        """Give the class of each pixel or voxel: the nearest centre; the lower one of two as near."""
        colours = _colours(image, "image", axes)
        if colours.shape[-1] != self.centres.shape[1]:
            raise InvalidInput(f"image: needs {self.centres.shape[1]} colour channels, got {colours.shape[-1]}")
        return self._nearest(colours)

    def shares(self, image: ArrayLike, *, axes: int | None = None) -> NDArray[np.float64]:
        """Give the share of each class, (K,); they sum to 1."""
        labels = self.of(image, axes=axes)
        return np.bincount(labels.ravel(), minlength=len(self.centres)) / labels.size

    def _nearest(self, colours: Floats) -> NDArray[np.uint8]:
        best = np.full(colours.shape[:-1], np.inf, np.float32)
        label = np.zeros(colours.shape[:-1], np.uint8)
        for k, centre in enumerate(self.centres):
            far = ((colours - centre) ** 2).sum(axis=-1, dtype=np.float32)
            nearer = far < best
            label[nearer], best[nearer] = k, far[nearer]
        return label


@dataclass(frozen=True, slots=True)
class Particles:
    """How many connected pieces of a material there are, and how large (see `particles`).

    Attributes
    ----------
    count : int
        Pieces of at least the least size.
    density : float
        Pieces for each 100 000 pixels or voxels.
    mean, median : float
        Size, in pixels or voxels; NaN where there are none.
    deciles : tuple of float
        The nine sizes that 10 %, 20 % ... of the pieces are not above.

    """

    count: int
    density: float
    mean: float
    median: float
    deciles: tuple[float, ...]


def lightness(image: ArrayLike, *, axes: int | None = None) -> Floats:
    """Give the mean of the colour channels in [0, 1], float32; transparency counts as mid grey.

    Parameters
    ----------
    image : array_like
        A picture or a volume, with or without channels.
    axes : int, optional
        2 for a picture, 3 for a volume; by default by its shape: up to 4 along the last axis are channels.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> volume.lightness(np.full((2, 2, 3), 51, np.uint8))
    array([[0.2, 0.2],
           [0.2, 0.2]], dtype=float32)

    """
    return np.asarray(_colours(image, "image", axes).mean(axis=-1, dtype=np.float32))


def classes(exemplar: ArrayLike, count: int = 4, *, axes: int | None = None) -> Classes:
    """Find the colours that best stand for an exemplar's own (k-means), from dark to light.

    Parameters
    ----------
    exemplar : array_like
        A picture or a volume.
    count : int
        How many, 2 to 16. An exemplar of fewer colours has as many classes as colours.
    axes : int, optional
        As of `lightness`.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> found = volume.classes(np.repeat([10, 20, 200], 100).astype(np.uint8).reshape(3, 10, 10), 3)
    >>> (found.centres.ravel() * 255).round()
    array([ 10.,  20., 200.], dtype=float32)

    """
    k = as_int(count, "count", 2, 16)
    colours = _colours(exemplar, "exemplar", axes)
    flat = colours.reshape(-1, colours.shape[-1])
    rng = np.random.default_rng(0)
    if len(flat) > _SAMPLE:
        flat = flat[rng.choice(len(flat), _SAMPLE, replace=False)]
    points, weights = np.unique(flat, axis=0, return_counts=True)
    k = min(k, len(points))
    best, least = points[:k].astype(np.float64), np.inf
    for _ in range(_RESTARTS):
        centres, spread = _means(points, weights.astype(np.float64), k, rng)
        if spread < least * (1 - 1e-9):
            best, least = centres, spread
    return Classes(np.ascontiguousarray(best[np.argsort(best.mean(axis=1), kind="stable")], np.float32))


def two_point(mask: ArrayLike, reach: int = 16) -> NDArray[np.float64]:
    """Give the two-point correlation S2 along each axis: how often both ends of a step are in a material.

    Parameters
    ----------
    mask : array_like
        Bool, (H, W) or (D, H, W): where the material is.
    reach : int
        Longest step; one that is longer than a side is NaN there.

    Returns
    -------
    ndarray
        Shape (A, reach + 1); at step 0 the material's share.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> stripes = np.arange(40) % 4 < 2
    >>> volume.two_point(np.tile(stripes, (40, 1)), 4)[1].round(2)
    array([0.5 , 0.26, 0.  , 0.24, 0.5 ])

    """
    phase, far = _mask(mask), as_int(reach, "reach", 1, 2**20)
    out = np.full((phase.ndim, far + 1), np.nan)
    for axis in range(phase.ndim):
        for step in range(min(far + 1, phase.shape[axis])):
            out[axis, step] = (_from(phase, axis, step) & _to(phase, axis, step)).mean()
    return out


def lineal_path(mask: ArrayLike, reach: int = 16) -> NDArray[np.float64]:
    """Give the lineal path along each axis: how often all of a step, with its ends, is in a material.

    Parameters
    ----------
    mask : array_like
        Bool, (H, W) or (D, H, W).
    reach : int
        Longest step; one that is longer than a side is NaN there.

    Returns
    -------
    ndarray
        Shape (A, reach + 1); at step 0 the material's share.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> volume.lineal_path(np.tile(np.arange(40) % 4 < 2, (40, 1)), 2)[1].round(2)
    array([0.5 , 0.26, 0.  ])

    """
    phase, far = _mask(mask), as_int(reach, "reach", 1, 2**20)
    out = np.full((phase.ndim, far + 1), np.nan)
    for axis in range(phase.ndim):
        path = phase
        for step in range(min(far + 1, phase.shape[axis])):
            if step:
                path = _from(path, axis, 1) & _to(phase, axis, step)
            out[axis, step] = path.mean()
    return out


def particles(mask: ArrayLike, *, least: int = 8) -> Particles:
    """Count the connected pieces of a material, of neighbours that share a side.

    Parameters
    ----------
    mask : array_like
        Bool, (H, W) or (D, H, W).
    least : int
        Smaller pieces are grain and are not counted.

    Examples
    --------
    >>> from texrs import samples, volume
    >>> stone = samples.particles((48, 48, 48))
    >>> volume.particles(stone.mask).count >= len(stone.centres)  # a piece at the border may be two
    True

    """
    from scipy.ndimage import label

    phase, low = _mask(mask), as_int(least, "least", 1, 2**40)
    pieces, count = label(phase)
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)[1:]
    sizes = sizes[sizes >= low]
    if not len(sizes):
        return Particles(0, 0.0, np.nan, np.nan, (np.nan,) * 9)
    deciles = np.quantile(sizes, np.arange(1, 10) / 10, method="inverted_cdf")
    return Particles(
        len(sizes),
        1e5 * len(sizes) / phase.size,
        float(sizes.mean()),
        float(np.median(sizes)),
        tuple(deciles.astype(float).tolist()),
    )


def autocorrelation(values: ArrayLike, reach: int = 12) -> NDArray[np.float64]:
    """Give the correlation of values with those some steps further, along each axis.

    Parameters
    ----------
    values : array_like
        (H, W) or (D, H, W), such as a `lightness`.
    reach : int
        Longest step; one that is longer than a side is NaN there.

    Returns
    -------
    ndarray
        Shape (A, reach + 1); 1 at step 0. One less this is the variogram over the variance.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> waves = np.sin(np.arange(160) * np.pi / 8)[None] * np.ones((8, 1))
    >>> volume.autocorrelation(waves, 16)[1, [0, 8, 16]].round(3)
    array([ 1., -1.,  1.])

    """
    v, far = _scalar(values), as_int(reach, "reach", 1, 2**20)
    v = v - v.mean(dtype=np.float64)
    variance = max(float((v * v).mean(dtype=np.float64)), 1e-30)
    out = np.full((v.ndim, far + 1), np.nan)
    for axis in range(v.ndim):
        for step in range(min(far + 1, v.shape[axis])):
            out[axis, step] = (_from(v, axis, step) * _to(v, axis, step)).mean(dtype=np.float64) / variance
    return out


def frequency(values: ArrayLike, *, window: int | None = None, whole: bool = False) -> float:
    """Give the mean spectral frequency, in cycles a pixel: how fine a texture is.

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

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> waves = np.sin(np.arange(64) * 2 * np.pi / 8)[None] * np.ones((64, 1))
    >>> round(volume.frequency(waves), 3)
    0.125

    """
    v = _scalar(values)
    if min(v.shape) < 16:
        raise InvalidInput(f"values: each side must be at least 16, got {v.shape}")
    side = min(64, *v.shape) if window is None else as_int(window, "window", 16, min(v.shape))
    if whole or v.ndim == 2:
        return _mean_frequency([v], side)
    return _mean_frequency([plane for axis in range(3) for plane in np.moveaxis(v, axis, 0)], side)


def seam_planes(values: ArrayLike) -> tuple[NDArray[np.float64], ...]:
    """Give, for each axis, the mean change from each plane (or line) to the next, over the median of all.

    Values far from 1 at regular places are the traces of an algorithm's lattice; number i stands for the step from
    plane i to plane i + 1.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> picture = np.random.default_rng(0).random((64, 64))
    >>> picture[:, 32:] += 1
    >>> [int(change.argmax()) for change in volume.seam_planes(picture)][1]
    31

    """
    v = _scalar(values)
    out = []
    for axis in range(v.ndim):
        others = tuple(a for a in range(v.ndim) if a != axis)
        change = np.abs(np.diff(v, axis=axis)).mean(axis=others, dtype=np.float64)
        out.append(change / max(float(np.median(change)) if change.size else 0.0, 1e-30))
    return tuple(out)


def isolated(values: ArrayLike, threshold: float = 0.35) -> float:
    """Give the share of voxels (pixels) that differ from the median of their surroundings, 3 a side: speckle.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> cube = np.zeros((10, 10, 10))
    >>> cube[5, 5, 5] = 1
    >>> volume.isolated(cube)
    0.001

    """
    from scipy.ndimage import median_filter

    v = _scalar(values)
    limit = as_float(threshold, "threshold", 0, 1e9)
    return float((np.abs(v - median_filter(v, size=3, mode="reflect")) > limit).mean())


def slice_distances(exemplar: ArrayLike, values: ArrayLike, *, quantiles: int = 256) -> NDArray[np.float64]:
    """Give the Wasserstein distance of the values of each axis slice to those of the whole exemplar.

    Returns
    -------
    ndarray
        One number a slice, those across the first axis first; of a picture one number, of the whole.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs import volume
    >>> cube = np.random.default_rng(0).random((8, 8, 8))
    >>> volume.slice_distances(cube, cube + 0.5).mean().round(1)
    np.float64(0.5)

    """
    e, v = _scalar(exemplar, "exemplar"), _scalar(values)
    at = (np.arange(as_int(quantiles, "quantiles", 2, 2**16)) + 0.5) / quantiles
    wanted = np.quantile(e, at)
    if v.ndim == 2:
        return np.array([np.abs(np.quantile(v, at) - wanted).mean()])
    found = [np.quantile(plane, at) for axis in range(3) for plane in np.moveaxis(v, axis, 0)]
    return np.asarray(np.abs(np.array(found) - wanted).mean(axis=1))


def texture_normal(values: ArrayLike) -> NDArray[np.float64]:
    """Give the direction in which an exemplar changes most, (A,): the normal of its layers.

    Examples
    --------
    >>> from texrs import samples, volume
    >>> normal = volume.texture_normal(volume.lightness(samples.stripes((32, 40, 40)).image))
    >>> bool(normal[0] > 0.95)
    True

    """
    tensor = _structure(_scalar(values), 0.0)
    vectors = np.linalg.eigh(tensor.reshape(-1, *tensor.shape[-2:]).mean(axis=0))[1]
    normal: NDArray[np.float64] = vectors[:, -1]
    return normal * (1 if normal[np.abs(normal).argmax()] > 0 else -1)


def orientation_errors(
    values: ArrayLike,
    field: Field | None = None,
    normal: ArrayLike | None = None,
    *,
    margin: int = 6,
) -> Floats:
    """Give the angle between the layers of a texture and where a field turns those of its exemplar.

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

    Returns
    -------
    ndarray
        Degrees from 0 to 90, float32, of the shape less two margins.

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
    v, edge = _scalar(values), as_int(margin, "margin", 0, 2**20)
    if min(v.shape) <= 2 * edge:
        raise InvalidInput(f"margin: {edge} on both sides leaves nothing of {v.shape}")
    if field is not None and (not isinstance(field, Field) or field.axes != v.ndim):
        raise InvalidInput(
            f"field: needs a field of {v.ndim} axes, got {field if isinstance(field, Field) else type(field).__name__}"
        )
    n = texture_normal(v) if normal is None else np.asarray(normal, np.float64)
    if n.shape != (v.ndim,) or not 1e-12 < float(np.abs(n).max()) < 1e12:
        raise InvalidInput(f"normal: needs {v.ndim} numbers, not all zero, got shape {n.shape}")
    inner = (slice(edge, -edge or None),) * v.ndim
    tensor = _structure(v, 4.0)[inner]
    out = np.empty(tensor.shape[: v.ndim], np.float32)
    for i, plane in enumerate(tensor):  # A plane at once: a dense field of a large volume is many times its size.
        found = np.linalg.eigh(plane)[1][..., -1]
        wanted = n
        if field is not None:
            index = np.stack(np.meshgrid(*map(np.arange, plane.shape[: v.ndim - 1]), indexing="ij"), axis=-1) + edge
            points = np.concatenate([np.full((*index.shape[:-1], 1), i + edge), index], axis=-1)
            wanted = np.einsum("...ji,j->...i", field.jacobians(points).astype(np.float64), n)
        length = np.linalg.norm(wanted, axis=-1)
        cosine = np.abs((found * wanted).sum(axis=-1)) / np.maximum(length, 1e-30)
        out[i] = np.degrees(np.arccos(np.minimum(cosine, 1)))
    return out


def _structure(v: Floats, sigma: float) -> NDArray[np.float64]:
    from scipy.ndimage import gaussian_filter

    gradients = [gaussian_filter(v, 1.0, order=[int(a == b) for b in range(v.ndim)]) for a in range(v.ndim)]
    tensor = np.empty((*v.shape, v.ndim, v.ndim), np.float64)
    for i in range(v.ndim):
        for j in range(i, v.ndim):
            entry = gradients[i] * gradients[j]
            entry = gaussian_filter(entry, sigma) if sigma else entry
            tensor[..., i, j] = tensor[..., j, i] = entry
    return tensor


def _mean_frequency(arrays: list[Floats], side: int) -> float:
    """Give the mean over some arrays of the mean frequency of each; NaN where none changes at all."""
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
        for start in product(*(_starts(n, side) for n in v.shape)):
            part = v[tuple(slice(s, s + side) for s in start)]
            power += np.abs(np.fft.rfftn((part - part.mean(dtype=np.float64)) * weights)) ** 2
        power *= share
        if power.sum() > 1e-20 * part.size:
            found.append(float((power * at).sum() / power.sum()))
    return float(np.mean(found)) if found else float("nan")


def _means(
    points: Floats, weights: NDArray[np.float64], k: int, rng: np.random.Generator
) -> tuple[NDArray[np.float64], float]:
    """Give k centres by Lloyd's turns, and the spread about them; starts are spread out by their distance."""
    p = points.astype(np.float64)
    centres = p[rng.choice(len(p), 1, p=weights / weights.sum())]
    while len(centres) < k:
        far = _squared(p, centres).min(axis=1) * weights
        centres = np.concatenate([centres, p[rng.choice(len(p), 1, p=far / far.sum())]])
    for _ in range(_TURNS):
        label = _squared(p, centres).argmin(axis=1)
        total = np.asarray(np.bincount(label, weights, k), np.float64)
        moved = np.stack([np.asarray(np.bincount(label, weights * c, k), np.float64) for c in p.T], axis=1)
        moved = np.where(total[:, np.newaxis] > 0, moved / np.maximum(total, 1e-30)[:, np.newaxis], centres)
        if np.abs(moved - centres).max() < 1e-6:
            break
        centres = moved
    return centres, float((_squared(p, centres).min(axis=1) * weights).sum())


def _squared(points: NDArray[np.float64], centres: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([((points - c) ** 2).sum(axis=1) for c in centres], axis=1)


def _starts(length: int, side: int) -> list[int]:
    count = max(1, -(-(length - side) * 2 // side) + 1)
    return sorted({round(float(start)) for start in np.linspace(0, length - side, count)})


def _from(array: Array, axis: int, step: int) -> Array:
    return array[(slice(None),) * axis + (slice(0, array.shape[axis] - step),)]


def _to(array: Array, axis: int, step: int) -> Array:
    return array[(slice(None),) * axis + (slice(step, None),)]


def axes_of(image: Array) -> int:
    """Guess how many axes are not channels: up to 4 along the last one of three are channels."""
    return {2: 2, 4: 3}.get(image.ndim, 2 if image.ndim == 3 and image.shape[-1] <= 4 else 3)


def _colours(image: ArrayLike, name: str, axes: int | None) -> Floats:
    if axes is None:
        with suppress(ValueError, TypeError):  # Of what is no array `as_image` tells.
            axes = axes_of(np.asarray(image))
    count = 3 if axes is None else axes
    if count not in (2, 3):
        raise InvalidInput(f"axes: needs 2 or 3, got {axes!r}")
    return guidance(as_image(image, name, axes=count))


def _scalar(values: ArrayLike, name: str = "values") -> Floats:
    array = np.asarray(values)
    if array.dtype.kind not in "buif" or array.ndim not in (2, 3) or array.size == 0:
        raise InvalidInput(f"{name}: needs numbers of shape (H, W) or (D, H, W), got {array.dtype} of {array.shape}")
    out = np.ascontiguousarray(array, np.float32)
    if not np.isfinite(out).all():
        raise InvalidInput(f"{name}: all must be finite")
    return out


def _mask(mask: ArrayLike) -> Bools:
    array = np.asarray(mask)
    if array.dtype.kind not in "bui" or array.ndim not in (2, 3) or array.size == 0:
        raise InvalidInput(f"mask: needs bool of shape (H, W) or (D, H, W), got {array.dtype} of {array.shape}")
    return np.ascontiguousarray(array != 0)
