"""Unbounded textures of images and volumes: `texrs.PlaneTexture` and `texrs.SolidTexture`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from texrs._arrays import as_size
from texrs._progress import listen
from texrs._typing import Array, Progress
from texrs.errors import InvalidInput
from texrs.papers.solid.ranges import MAX_COORDINATE
from texrs.papers.solid.unbounded import Texture
from texrs.volume.rendering import as_steps
from texrs.volume.values import as_direction

__all__ = ["PlaneTexture", "SolidTexture"]

TILE = 128
"""Side of the tiles of a slice that are computed one after the other, in pixels."""


class PlaneTexture(Texture):
    """An unbounded image texture. Any window of it can be computed.

    A pixel is the same in all windows and for any number of threads. The pixels differ from the result of
    `texrs.synthesize`, which has free borders. The object can be pickled, and gives the same pixels in every process.

    Parameters
    ----------
    exemplar : (H, W) or (H, W, C) array, Exemplar or Material
        Example image, of any real dtype and number of channels, at least 16 pixels a side. A `texrs.Exemplar` states
        whether its values are labels, and along which axes it is periodic; for other types, both are measured.
    field : Field, str, array_like or path_like, optional
        Frame field with two axes: rotation and scale of the texture at each point (`texrs.fields`). A centre or length
        that the text does not state has the default for an unbounded texture. None leaves the texture as it is.
    seed : int
        Seed of the random choices, 0 to 2^64 - 1. The same seed gives the same bytes. Default: 0.
    quality : {"preserve", "fast", "optimise"}
        Balance of quality and speed. "preserve" stitches patches along minimum cuts, which keeps elements whole.
        "optimise" tries three times as many source positions for each patch. "fast" corrects blocks point by point,
        for textures without elements. The three give different textures. Default: "preserve".
    interpolation : {"nearest", "linear", "cubic"}, optional
        Interpolation between the exemplar's samples. Labels always use the nearest sample. Default: "nearest" for an
        exemplar of few colours, so that no colours are added, else "cubic".
    spacing : sequence of 2 float, optional
        Distances between rows and columns, in any unit. The field rotates in space, where pixels can be rectangles.
        The places and lengths of the field are in the same unit. Windows and points are still in pixels. Default: 1.
    cache_bytes : int
        Maximum memory for finished parts, in bytes, 0 or more. Finished parts make windows next to them faster.
        Default: 256 MiB.
    memory_limit : int, optional
        Maximum memory of one window in bytes. Default: the available memory, unless a lower limit is set
        (`texrs.limits`).

    Raises
    ------
    InvalidInput
        If the exemplar is too small or not finite, a field has another number of axes, or an option is out of its
        range.
    LimitExceeded
        If the analysis of the exemplar would take more memory than allowed.

    Examples
    --------
    >>> import texrs
    >>> plane = texrs.PlaneTexture(texrs.samples.weave((64, 64)).image, seed=2)
    >>> plane[-40:24, 1000:1064].shape
    (64, 64, 3)
    >>> bool((plane[-8:8, 1000:1064] == plane[-40:24, 1000:1064][32:48]).all())
    True

    """

    axes = 2


class SolidTexture(Texture):
    """An unbounded volume texture. Any window and any slice of it can be computed.

    A voxel is the same in all windows and for any number of threads. The voxels differ from the result of
    `texrs.solid`, which has free borders. The object can be pickled, and gives the same voxels in every process.

    Parameters
    ----------
    exemplar : (D, H, W) or (D, H, W, C) array, Exemplar or Material
        Example volume, of any real dtype and number of channels, at least 16 voxels a side. A `texrs.Exemplar` with
        ``axes=3`` states whether its values are labels, and along which axes it is periodic; for other types, both are
        measured.
    field : Field, str, array_like or path_like, optional
        Frame field with three axes: rotation and scale of the texture at each point (`texrs.fields`). A centre or
        length that the text does not state has the default for an unbounded texture. None leaves the texture as it is.
    seed : int
        Seed of the random choices, 0 to 2^64 - 1. The same seed gives the same bytes. Default: 0.
    quality : {"preserve", "fast", "optimise"}
        Balance of quality and speed. "preserve" stitches patches along minimum cuts, which keeps elements whole.
        "optimise" tries three times as many source positions for each patch. "fast" corrects blocks point by point,
        for textures without elements. The three give different textures. Default: "preserve".
    interpolation : {"nearest", "linear", "cubic"}, optional
        Interpolation between the exemplar's samples. Labels always use the nearest sample. Default: "cubic".
    spacing : (plane, row, column) float, optional
        Voxel size along each axis, in any unit. The field rotates in space, where voxels need not be cubes. The places
        and lengths of the field are in the same unit. Windows and points are still in voxels. Default: the spacing
        that the exemplar's file states, else 1.
    cache_bytes : int
        Maximum memory for finished parts, in bytes, 0 or more. Finished parts make windows next to them faster.
        Default: 256 MiB.
    memory_limit : int, optional
        Maximum memory of one window in bytes. Default: the available memory, unless a lower limit is set
        (`texrs.limits`).

    Raises
    ------
    InvalidInput
        If the exemplar is too small or not finite, a field has another number of axes, or an option is out of its
        range.
    LimitExceeded
        If the analysis of the exemplar would take more memory than allowed.

    Examples
    --------
    >>> import texrs
    >>> texture = texrs.SolidTexture(texrs.samples.stripes((32, 32, 32)).image, seed=1)
    >>> texture[-8:8, 0:24, 100:120].shape, texture[5, 0:24, 100:120].shape
    ((16, 24, 20, 3), (24, 20, 3))
    >>> texture.slice((0, 0, 0), normal=(1, 1, 0), size=24).shape
    (24, 24, 3)

    """

    axes = 3

    def slice(
        self,
        point: Sequence[float],
        normal: Sequence[float] | None = None,
        *,
        axes: ArrayLike | None = None,
        size: int | Sequence[int],
        progress: Progress | bool | None = None,
    ) -> Array:
        """Cut the texture along any plane, and return the cut as an image.

        Source coordinates are interpolated between voxels, not colours. A point q looks up S(p) + J(p) (q - p), where
        p is the nearest voxel. An oblique slice is therefore as sharp as the exemplar.

        Parameters
        ----------
        point : sequence of 3 float
            (plane, row, column) of the middle of the image, in voxels.
        normal : sequence of 3 float, optional
            Normal of the plane, (plane, row, column), of any length.
        axes : (2, 3) array_like, optional
            Steps from one row and from one column of the image to the next, each (plane, row, column) in voxels.
            Replaces ``normal``.
        size : int or (rows, columns)
            Size of the image, in pixels.
        progress : callable or True, optional
            Function called as ``progress(stage, share)`` with the completed share of the stage. An exception that it
            raises stops the work. True shows a progress bar.

        Returns
        -------
        (rows, columns[, C]) array
            Image in the exemplar's dtype.

        Raises
        ------
        InvalidInput
            If the point, the direction or the size is invalid.
        Cancelled
            If the work was stopped.

        Examples
        --------
        >>> import texrs
        >>> texture = texrs.SolidTexture(texrs.samples.stripes((32, 32, 32)).image, quality="fast")
        >>> texture.slice((0, 0, 0), (1, 1, 0), size=(8, 12)).shape
        (8, 12, 3)

        """
        progress = listen(progress)
        middle, steps = as_direction(point, "point"), as_steps(normal, axes)
        sides = as_size(size)
        reach = np.abs(middle) + np.abs(steps).T @ np.array(sides)
        if reach.max() >= MAX_COORDINATE:
            raise InvalidInput(f"point, axes, size: the slice must be within {MAX_COORDINATE} voxels of the origin")
        image = self._exemplar.image if self._material is None else self._material.base
        out = np.empty((*sides, *image.shape[3:]), image.dtype)
        for top in range(0, sides[0], TILE):
            for left in range(0, sides[1], TILE):
                rows, columns = (
                    np.arange(a, min(a + TILE, n)) - (n - 1) / 2 for a, n in zip((top, left), sides, strict=True)
                )
                at = middle + rows[:, np.newaxis, np.newaxis] * steps[0] + columns[:, np.newaxis] * steps[1]
                shown = self.sample(at, progress=progress)
                out[top : top + TILE, left : left + TILE] = shown
        return out
