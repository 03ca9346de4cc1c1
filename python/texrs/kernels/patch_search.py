"""Exact best matches of a masked, weighted patch over all positions of one or several images."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from texrs import _rust
from texrs._arrays import as_float, as_image, as_int, as_mask, as_size
from texrs._typing import Array, Floats
from texrs.errors import InvalidInput

__all__ = ["Match", "PatchIndex"]

_MOST = 2**31 - 1


@dataclass(frozen=True, slots=True, order=True)
class Match:
    """A position and its cost; sorts by cost, then by position."""

    cost: float
    """Weighted sum of squared differences."""
    exemplar: int
    """Which of the images."""
    row: int
    """Row of the patch's top-left corner."""
    column: int
    """Column of the patch's top-left corner."""


class PatchIndex:
    """Images made ready to be searched many times.

    The cost of a position is ``sum(weight * (patch - window) ** 2)`` over the pixels and channels.
    All positions are filtered by Fourier correlation as in Kwatra et al. [1]_; those that could be
    the minimum within the error bound of the filter are scored again in float64. So results are
    exact, the same for any number of threads and any CPU, and ties go to the lowest (exemplar,
    row, column).

    Parameters
    ----------
    images : array_like or sequence of array_like
        One image (H, W) or (H, W, C), or a list of images that agree in channels. Any real dtype;
        compared as float32, in the units given.
    allowed : array_like or sequence, optional
        Bool masks of the images' shapes (H, W): which positions (top-left corners of patches) may
        be used. One for a single image; for a list a list, in which None allows all.
    max_patch : int or (int, int), optional
        Rows and columns of the largest patch that will be looked for. The smaller, the less there
        is to compute. By default 64, or what fits into the images.

    Raises
    ------
    InvalidInput
        No images, different numbers of channels, or a mask that does not fit its image.

    References
    ----------
    .. [1] V. Kwatra, A. Schödl, I. Essa, G. Turk and A. Bobick, "Graphcut textures", SIGGRAPH 2003.
       :doi:`10.1145/882262.882264`

    Examples
    --------
    >>> import numpy as np
    >>> image = np.random.default_rng(0).integers(0, 256, (80, 100, 3), dtype=np.uint8)
    >>> index = PatchIndex(image, max_patch=16)
    >>> index.best(image[20:36, 50:66])
    [Match(cost=0.0, exemplar=0, row=20, column=50)]

    Pixels without weight are not looked at:

    >>> patch = image[20:36, 50:66].astype(float)
    >>> known = np.ones((16, 16))
    >>> patch[:, :9], known[:, :9] = np.nan, 0
    >>> index.best(patch, known)
    [Match(cost=0.0, exemplar=0, row=20, column=50)]

    """

    def __init__(
        self,
        images: object,
        *,
        allowed: object = None,
        max_patch: int | tuple[int, int] | None = None,
    ) -> None:
        single = not isinstance(images, list | tuple)
        given = list(images) if isinstance(images, list | tuple) else [images]
        masks = _masks(allowed, len(given), single)
        if not given:
            raise InvalidInput("images: needs at least one image, got none")
        name = "images" if single else "images[{}]"
        arrays = [_floats(as_image(v, name.format(i)), name.format(i)) for i, v in enumerate(given)]
        channels = [a.shape[2] for a in arrays]
        if len(set(channels)) > 1:
            raise InvalidInput(f"images: must agree in channels, got {channels}")
        mask_name = "allowed" if single else "allowed[{}]"
        checked = [
            None if m is None else as_mask(m, mask_name.format(i), a.shape[:2])
            for i, (m, a) in enumerate(zip(masks, arrays, strict=True))
        ]
        rows, columns = (64, 64) if max_patch is None else as_size(max_patch, "max_patch")
        self.shapes: tuple[tuple[int, ...], ...] = tuple(a.shape for a in arrays)
        """Shape (H, W, C) of each image."""
        self._index = _rust.PatchIndex(arrays, checked, (rows, columns))

    def __repr__(self) -> str:
        return f"PatchIndex(shapes={self.shapes}, max_patch={self.max_patch})"

    @property
    def max_patch(self) -> tuple[int, int]:
        """Rows and columns of the largest patch that can be looked for."""
        rows, columns = self._index.max_patch
        return rows, columns

    def best(
        self,
        patch: object,
        weight: object = None,
        *,
        count: int = 1,
        separation: int = 4,
        ratio: float = math.inf,
    ) -> list[Match]:
        """Find the best positions of a patch.

        Greedy: the best position of all, then the best one far enough from it, and so on.

        Parameters
        ----------
        patch : array_like
            Shape (p, q) or (p, q, C). Where the weight is zero anything, NaN too.
        weight : array_like, optional
            Shape (p, q), not negative; zero where the patch is unknown, bool allowed. By default 1
            everywhere. If all are zero every position costs nothing, and the first ones are
            returned.
        count : int
            At most this many matches.
        separation : int
            Matches in one image are more than this many pixels apart, along rows or along columns.
        ratio : float
            No match costs more than this times the least cost; at least 1.

        Returns
        -------
        list of Match
            By rising cost; fewer than ``count`` where separation, ratio or the allowed positions
            leave no more.

        Raises
        ------
        InvalidInput
            A patch that fits into no image or is larger than ``max_patch``, a negative weight.

        """
        samples, weights = self._query(patch, weight)
        count, separation, ratio = _pick(count, separation, ratio)
        return [Match(*m) for m in self._index.best(samples, weights, count, separation, ratio)]

    def best_among(
        self,
        patch: object,
        weight: object = None,
        *,
        candidates: Iterable[Sequence[int]],
        count: int = 1,
        separation: int = 4,
        ratio: float = math.inf,
    ) -> list[Match]:
        """Find the best of some positions, given as (exemplar, row, column).

        Otherwise as :meth:`best`; the masks ``allowed`` play no part.
        """
        samples, weights = self._query(patch, weight)
        most = (("exemplar", len(self.shapes) - 1), ("row", _MOST), ("column", _MOST))
        positions: Any = [
            # The type first: it costs a tenth of the full check, and there may be many.
            tuple(
                n if type(n) is int and 0 <= n <= high else as_int(n, f"candidates: {name}", 0, high)
                for n, (name, high) in zip(place, most, strict=True)
            )
            for place in candidates
        ]
        count, separation, ratio = _pick(count, separation, ratio)
        found = self._index.best_among(samples, weights, positions, count, separation, ratio)
        return [Match(*m) for m in found]

    def cost_map(self, patch: object, weight: object = None, *, exemplar: int = 0) -> Floats:
        """Return the costs of all positions in one image.

        Returns
        -------
        ndarray
            Float32, (H - p + 1, W - q + 1): as the filter sees them, with an error of about 1e-5
            of the typical cost. Infinite where not allowed. :meth:`best` and :meth:`best_among`
            give exact costs.

        """
        samples, weights = self._query(patch, weight)
        which = as_int(exemplar, "exemplar", 0, len(self.shapes) - 1)
        return self._index.cost_map(samples, weights, which)[0]

    def _query(self, patch: object, weight: object) -> tuple[Floats, Floats]:
        try:
            samples = np.asarray(patch)
            weights = np.ones(samples.shape[:2]) if weight is None else np.asarray(weight)
        except (ValueError, TypeError) as error:
            raise InvalidInput(f"patch, weight: not arrays of numbers ({error})") from None
        if samples.dtype.kind not in "buif" or weights.dtype.kind not in "buif":
            raise InvalidInput(f"patch, weight: need real numbers, got dtypes {samples.dtype}, {weights.dtype}")
        if samples.ndim == 2:
            samples = samples[..., np.newaxis]
        channels = self.shapes[0][2]
        if samples.ndim != 3 or samples.shape[2] != channels or samples.size == 0:
            raise InvalidInput(f"patch: needs shape (rows, columns, {channels}), got {samples.shape}")
        if weights.shape != samples.shape[:2]:
            raise InvalidInput(f"weight: needs shape {samples.shape[:2]}, got {weights.shape}")
        with np.errstate(over="ignore"):
            return (
                np.ascontiguousarray(samples, dtype=np.float32),
                np.ascontiguousarray(weights, dtype=np.float32),
            )


def _masks(allowed: object, images: int, single: bool) -> list[object]:
    if allowed is None:
        return [None] * images
    if single:
        return [allowed]
    if not isinstance(allowed, list | tuple) or len(allowed) != images:
        raise InvalidInput(f"allowed: needs a list of {images} masks (or None), one an image")
    return list(allowed)


def _floats(array: Array, name: str) -> Floats:
    with np.errstate(over="ignore"):
        floats = np.ascontiguousarray(array, dtype=np.float32)
    if not np.isfinite(floats).all():
        raise InvalidInput(f"{name}: values up to {np.finfo(np.float32).max:.3g} are allowed")
    return floats


def _pick(count: object, separation: object, ratio: object) -> tuple[int, int, float]:
    return (
        as_int(count, "count", 1, _MOST),
        as_int(separation, "separation", 0, _MOST),
        as_float(ratio, "ratio", 1.0, math.inf),
    )
