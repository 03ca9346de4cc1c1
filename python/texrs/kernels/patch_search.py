"""Exact search for the best matches of a masked, weighted patch over all positions of one or several images."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from texrs import _rust
from texrs._arrays import (
    as_array,
    as_float,
    as_image,
    as_int,
    as_items,
    as_list,
    as_mask,
    as_size,
    as_tuple,
    check_finite,
)
from texrs._typing import Bools, Floats
from texrs.errors import InvalidInput

__all__ = ["Match", "PatchIndex"]


def __dir__() -> list[str]:
    return __all__


_MOST = 2**31 - 1


@dataclass(frozen=True, slots=True, order=True)
class Match:
    """Position of a match and its cost. Matches are sorted by cost, then by position.

    Attributes
    ----------
    cost : float
        Weighted sum of squared differences, in the units of the images; at least 0.
    exemplar : int
        Index of the image, from 0.
    row, column : int
        Top-left corner of the patch in this image, in pixels.

    Examples
    --------
    >>> from texrs.kernels.patch_search import Match
    >>> min(Match(2.0, 0, 1, 1), Match(0.5, 0, 3, 2))
    Match(cost=0.5, exemplar=0, row=3, column=2)

    """

    cost: float
    exemplar: int
    row: int
    column: int


class PatchIndex:
    """Index of images for the search of many patches.

    The cost of a position is ``sum(weight * (patch - window) ** 2)`` over the pixels and channels. Approximate costs
    of all positions are computed by Fourier correlation, as in Kwatra et al. [1]_. Positions that could be the
    minimum, given the error of the approximation, are then computed exactly in float64. Results are therefore exact,
    and the same for any number of threads and any processor. If costs are equal, the lowest (exemplar, row, column) is
    first.

    Parameters
    ----------
    images : (H, W) or (H, W, C) array_like, or a list or tuple of them
        One image, or several images with the same number of channels, of any size. Any real dtype except 64-bit
        integers. They are converted to float32 and compared in their units.
    allowed : (H, W) array_like of bool, or a list or tuple of them, optional
        Mask of the positions (top-left corners of patches) that can be used. For several images, one mask for each, or
        None to allow all its positions. Default: all positions.
    max_patch : int or (rows, columns), optional
        Size of the largest patch to search for, in pixels. Smaller sizes need less time. Default: 64, or the largest
        size that fits into the images.

    Raises
    ------
    InvalidInput
        Images are missing, values exceed the range of float32, numbers of channels differ, or a mask does not fit its
        image.

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

    Pixels with weight 0 are ignored:

    >>> patch = image[20:36, 50:66].astype(float)
    >>> known = np.ones((16, 16))
    >>> patch[:, :9], known[:, :9] = np.nan, 0
    >>> index.best(patch, known)
    [Match(cost=0.0, exemplar=0, row=20, column=50)]

    """

    def __init__(
        self, images: object, *, allowed: object = None, max_patch: int | tuple[int, int] | None = None
    ) -> None:
        single = not isinstance(images, list | tuple)
        given = as_list(images)
        masks = _as_masks(allowed, len(given), single)
        if not given:
            raise InvalidInput("images: must contain at least one image, got none")
        name = "images" if single else "images[{}]"
        arrays = [_as_floats(v, name.format(i)) for i, v in enumerate(given)]
        channels = [a.shape[2] for a in arrays]
        if len(set(channels)) > 1:
            raise InvalidInput(f"images: must have the same number of channels, got {channels}")
        self.shapes: tuple[tuple[int, ...], ...] = tuple(a.shape for a in arrays)
        """Shape (H, W, C) of each image."""
        self._index = _rust.PatchIndex(arrays, _check_masks(masks, self.shapes, single), _as_patch(max_patch))

    def __repr__(self) -> str:
        return f"PatchIndex(shapes={self.shapes}, max_patch={self.max_patch})"

    def again(self, *, allowed: object = None, max_patch: int | tuple[int, int] | None = None) -> PatchIndex:
        """Return an index of the same images with another maximum patch size or other allowed positions.

        Data that depend only on the images are computed once and shared.

        Parameters
        ----------
        allowed : (H, W) array_like of bool, or a list or tuple of them, optional
            Mask of the positions that can be used. Default: all positions.
        max_patch : int or (rows, columns), optional
            Size of the largest patch to search for, in pixels. Default: 64, or the largest size that fits into the
            images.

        Returns
        -------
        PatchIndex
            Index with the same results as a newly created one.

        Raises
        ------
        InvalidInput
            A mask does not have the size of its image.

        Examples
        --------
        >>> index = PatchIndex(np.arange(20.0).reshape(4, 5), max_patch=1)
        >>> index.again(max_patch=2).best([[6, 7], [11, 12]])
        [Match(cost=0.0, exemplar=0, row=1, column=1)]

        """
        single = len(self.shapes) == 1 and not isinstance(allowed, list | tuple)
        masks = _check_masks(_as_masks(allowed, len(self.shapes), single), self.shapes, single)
        made = PatchIndex.__new__(PatchIndex)
        made.shapes = self.shapes
        made._index = self._index.again(masks, _as_patch(max_patch))
        return made

    @property
    def max_patch(self) -> tuple[int, int]:
        """Number of rows and columns of the largest patch that can be searched for."""
        rows, columns = self._index.max_patch
        return rows, columns

    def best(
        self, patch: object, weight: object = None, *, count: int = 1, separation: int = 4, ratio: float = math.inf
    ) -> list[Match]:
        """Find the positions in the images that match a patch best.

        The search is greedy: the first match is the best position, the second is the best position far enough from the
        first, and so on.

        Parameters
        ----------
        patch : (p, q) or (p, q, C) array_like
            Patch of any real dtype, in the units of the images. Pixels of weight 0 can have any value, including NaN.
        weight : (p, q) array_like, optional
            Weight of each pixel, at least 0, or a bool mask. Use 0 for unknown pixels. If all weights are 0, every
            position costs 0 and the first positions are returned. Default: 1 everywhere.
        count : int
            Maximum number of matches, 1 to 2^31 - 1. Default: 1.
        separation : int
            Distance in pixels, 0 to 2^31 - 1. The rows or the columns of two matches in one image differ by more than
            this. Default: 4.
        ratio : float
            Maximum cost of a match, as a multiple of the lowest cost; at least 1. Infinity is allowed. Default:
            infinity.

        Returns
        -------
        list of Match
            Matches in the order of increasing cost. There are fewer than ``count`` if separation, ratio or the allowed
            positions exclude the others.

        Raises
        ------
        InvalidInput
            The patch does not fit into any image or is larger than ``max_patch``, a weight is negative, or another
            argument is out of range.

        Examples
        --------
        >>> import numpy as np
        >>> index = PatchIndex(np.arange(20.0).reshape(4, 5))
        >>> [(match.row, match.column) for match in index.best([[6, 7], [11, 12]], count=2, separation=1)]
        [(1, 1), (1, 3)]

        """
        samples, weights = self._as_query(patch, weight)
        count, separation, ratio = _as_choice(count, separation, ratio)
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
        """Return the best matches among given positions.

        Parameters
        ----------
        patch : (p, q) or (p, q, C) array_like
            Patch of any real dtype, in the units of the images. Pixels of weight 0 can have any value, including NaN.
        weight : (p, q) array_like, optional
            Weight of each pixel, at least 0, or a bool mask. Use 0 for unknown pixels. Default: 1 everywhere.
        candidates : iterable of (exemplar, row, column)
            Integer positions to compare. The masks ``allowed`` are ignored.
        count : int
            Maximum number of matches, 1 to 2^31 - 1. Default: 1.
        separation : int
            Distance in pixels, 0 to 2^31 - 1. The rows or the columns of two matches in one image differ by more than
            this. Default: 4.
        ratio : float
            Maximum cost of a match, as a multiple of the lowest cost; at least 1. Infinity is allowed. Default:
            infinity.

        Returns
        -------
        list of Match
            Matches in the order of increasing cost. There are fewer than ``count`` if separation, ratio or the
            candidates exclude the others.

        Raises
        ------
        InvalidInput
            The patch at a candidate is not inside its image, or an argument is invalid for `best`.

        Examples
        --------
        >>> import numpy as np
        >>> index = PatchIndex(np.arange(20.0).reshape(4, 5))
        >>> index.best_among([[6, 7], [11, 12]], candidates=[(0, 0, 0), (0, 2, 1)])
        [Match(cost=100.0, exemplar=0, row=2, column=1)]

        """
        samples, weights = self._as_query(patch, weight)
        most = (len(self.shapes) - 1, _MOST, _MOST)
        positions: Any = [
            # Check the type first, because there can be many candidates, and this takes 10 % of the time of the full
            # check.
            tuple(
                n if type(n) is int and 0 <= n <= high else as_int(n, "candidates", 0, high)
                for n, high in zip(
                    as_tuple(place, "candidates", 3, "(exemplar, row, column) for each candidate"), most, strict=True
                )
            )
            for place in as_items(candidates, "candidates")
        ]
        count, separation, ratio = _as_choice(count, separation, ratio)
        found = self._index.best_among(samples, weights, positions, count, separation, ratio)
        return [Match(*m) for m in found]

    def cost_map(self, patch: object, weight: object = None, *, exemplar: int = 0) -> Floats:
        """Return the costs of all positions in one image as a map.

        Parameters
        ----------
        patch : (p, q) or (p, q, C) array_like
            Patch of any real dtype, in the units of the images. Pixels of weight 0 can have any value, including NaN.
        weight : (p, q) array_like, optional
            Weight of each pixel, at least 0, or a bool mask. Use 0 for unknown pixels. Default: 1 everywhere.
        exemplar : int
            Index of the image, from 0. Default: 0.

        Returns
        -------
        (H - p + 1, W - q + 1) float32
            Approximate costs, with an error of about 1e-5 of the typical cost. Positions that are not allowed have
            infinity. `best` and `best_among` return exact costs.

        Raises
        ------
        InvalidInput
            The image does not exist or is smaller than the patch, or an argument is invalid for `best`.

        Examples
        --------
        >>> import numpy as np
        >>> PatchIndex(np.eye(3)).cost_map(np.eye(2)).round(3)
        array([[0., 3.],
               [3., 0.]], dtype=float32)

        """
        samples, weights = self._as_query(patch, weight)
        which = as_int(exemplar, "exemplar", 0, len(self.shapes) - 1)
        return self._index.cost_map(samples, weights, which)[0]

    def _as_query(self, patch: object, weight: object) -> tuple[Floats, Floats]:
        samples = as_array(patch, "patch", np.float32)
        if samples.ndim == 2:
            samples = samples[..., np.newaxis]
        samples = as_array(samples, "patch", np.float32, ("rows", "columns", self.shapes[0][2]))
        shape = samples.shape[:2]
        weights = np.ones(shape, np.float32) if weight is None else as_array(weight, "weight", np.float32, shape)
        return samples, weights


def _as_masks(allowed: object, images: int, single: bool) -> list[object]:
    if allowed is None:
        return [None] * images
    if single:
        return [allowed]
    if not isinstance(allowed, list | tuple) or len(allowed) != images:
        raise InvalidInput(f"allowed: must be a list of {images} masks (or None), one for each image")
    return list(allowed)


def _check_masks(masks: list[object], shapes: Sequence[tuple[int, ...]], single: bool) -> list[Bools | None]:
    name = "allowed" if single else "allowed[{}]"
    return [
        None if mask is None else as_mask(mask, name.format(i), shape[:2])
        for i, (mask, shape) in enumerate(zip(masks, shapes, strict=True))
    ]


def _as_patch(max_patch: int | tuple[int, int] | None) -> tuple[int, int]:
    rows, columns = (64, 64) if max_patch is None else as_size(max_patch, "max_patch")
    return rows, columns


def _as_floats(value: object, name: str) -> Floats:
    floats = as_array(as_image(value, name), name, np.float32)
    check_finite(floats, name)
    return floats


def _as_choice(count: object, separation: object, ratio: object) -> tuple[int, int, float]:
    return (
        as_int(count, "count", 1, _MOST),
        as_int(separation, "separation", 0, _MOST),
        as_float(ratio, "ratio", 1.0, math.inf),
    )
