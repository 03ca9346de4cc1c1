"""Look exemplars of any dtype and any number of channels up through coordinates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from texrs import _rust
from texrs._arrays import as_image, as_kernel, as_wrap
from texrs._typing import Array, Interpolation
from texrs.errors import InvalidInput

__all__ = ["gather"]


def gather(
    exemplars: Array | Sequence[Array],
    coordinates: Array,
    which: Array | None = None,
    *,
    interpolation: Interpolation = "linear",
    wrap: bool | Sequence[bool] = False,
) -> Array:
    """Sample exemplars at coordinates.

    A coordinate that falls on a sample gives that sample, bit for bit, whatever the interpolation. ``"cubic"``
    (Catmull-Rom [1]_) is clipped to the range of its taps, so it neither rings nor leaves the range of the data.

    Parameters
    ----------
    exemplars : (h, w[, C]) or (d, h, w[, C]) array, or a sequence of them
        Any real dtype; several must agree in dtype and channels, not in size.
    coordinates : (..., 2) or (..., 3) array of float
        (row, column) or (plane, row, column), in samples; sample centres are at the integers.
    which : (...) array of int, optional
        The exemplar of each pixel, when there are several.
    interpolation : {"nearest", "linear", "cubic"}
        How values between samples are made. Integers are rounded to the nearest.
    wrap : bool or one an axis
        Axes along which the exemplars are cyclic; along the others the edge repeats.

    Returns
    -------
    (..., [C]) array
        In the dtype of the exemplars; with channels if they have a channel axis.

    Raises
    ------
    InvalidInput
        Coordinates that are not finite, an index beyond the exemplars, or exemplars that do not agree.

    References
    ----------
    .. [1] R. Keys, "Cubic convolution interpolation for digital image processing", IEEE Trans. ASSP 29(6), 1981.

    Examples
    --------
    >>> import numpy as np
    >>> ramp = np.arange(12, dtype=np.uint8).reshape(3, 4) * 10
    >>> gather(ramp, np.array([[1.0, 1.0], [1.0, 1.5]]))
    array([50, 55], dtype=uint8)

    """
    points = np.asarray(coordinates)
    axes = points.shape[-1] if points.ndim else 0
    if axes not in (2, 3) or points.dtype.kind not in "iuf":
        raise InvalidInput(
            f"coordinates: needs numbers of shape (..., 2) or (..., 3), got {points.dtype} {points.shape}"
        )
    several = exemplars if isinstance(exemplars, list | tuple) else [exemplars]
    if not several:
        raise InvalidInput("exemplars: at least one is needed, got none")
    images = [as_image(e, "exemplars", axes=axes) for e in several]
    kinds = {(e.dtype.str, e.shape[-1]) for e in images}
    if len(kinds) > 1:
        raise InvalidInput(f"exemplars: must agree in dtype and channels, got {sorted(kinds)}")
    shape = points.shape[:-1]
    if which is None:
        index = np.zeros(0, np.uint16)
    else:
        index = np.asarray(which)
        if index.shape != shape or index.dtype.kind not in "iu":
            raise InvalidInput(f"which: needs integers of shape {shape}, got {index.dtype} {index.shape}")
        if index.size and (index.min() < 0 or index.max() >= len(images)):
            raise InvalidInput(f"which: allowed are 0 to {len(images) - 1}, got {index.min()} to {index.max()}")
    out = _rust.gather(
        [as_kernel(e) for e in images],
        as_wrap(wrap, axes=axes),
        np.ascontiguousarray(index, np.uint16).reshape(-1),
        np.ascontiguousarray(points, np.float32).reshape(-1, axes),
        interpolation,
    )
    dtype = images[0].dtype
    if dtype == np.bool_:
        out = out.view(np.bool_)
    elif dtype != out.dtype:
        out = out.astype(dtype)
    had_channels = np.asarray(several[0]).ndim > axes
    return out.reshape((*shape, -1) if had_channels else shape)
