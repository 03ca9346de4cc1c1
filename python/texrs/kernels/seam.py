"""Minimum cuts on grids: the least visible seam between two images, and binary labels of minimum energy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from texrs import _rust
from texrs._arrays import as_array, as_bool, as_choice, as_float, as_image, as_int, as_items, as_tuple, as_wrap, to_unit
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput

__all__ = ["Cut", "Labels", "OldSeams", "Strip", "binary_labels", "cut", "cut_strip", "cut_strips"]


def __dir__() -> list[str]:
    return __all__


Cost: TypeAlias = Literal["gradient", "paper"]


@dataclass(frozen=True, slots=True)
class Cut:
    """Result of `cut` and `cut_strip`: the choice between image A and image B at each pixel.

    Attributes
    ----------
    mask : (H, W) or (D, H, W) bool
        True for pixels of B. Pixels with False are of A, if A covers them.
    value : float
        Sum of the costs along the seam inside the overlap, including old seams that remain; at least 0.
    edges : int
        Number of pairs of neighbours in the overlap that the seam separates.

    Examples
    --------
    >>> from texrs.kernels import seam
    >>> found = seam.cut_strip([[0, 0.5, 0.9, 0.8]] * 2, [[0.6, 0.5, 0.2, 0.3]] * 2, cost="paper")
    >>> isinstance(found, seam.Cut), found.edges
    (True, 2)

    """

    mask: Bools
    value: float
    edges: int


@dataclass(frozen=True, slots=True)
class OldSeams:
    """Costs of seams that A already contains. Each field has one array of the shape of the canvas for each axis.

    Entry ``p`` of an axis is for the pair of ``p`` and the next pixel ``q`` along this axis. A contains source ``S``
    at ``p`` and source ``T`` at ``q``. ``M(p, q, S, T)`` is the cost of a seam between ``p`` from ``S`` and ``q`` from
    ``T``.

    Attributes
    ----------
    kept : sequence of array_like
        Cost ``M(p, q, S, T)``, at least 0, if both pixels keep A. Use 0 without an old seam. The pair then has its
        ordinary cost.
    ab : sequence of array_like
        Cost ``M(p, q, S, B)``, at least 0, if ``p`` keeps A and ``q`` takes B.
    ba : sequence of array_like
        Cost ``M(p, q, B, T)``, at least 0, if ``p`` takes B and ``q`` keeps A.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.kernels.seam import OldSeams
    >>> nothing = [np.zeros((4, 5)), np.zeros((4, 5))]  # an array an axis
    >>> len(OldSeams(kept=nothing, ab=nothing, ba=nothing).kept)
    2

    """

    kept: Sequence[ArrayLike]
    ab: Sequence[ArrayLike]
    ba: Sequence[ArrayLike]


@dataclass(frozen=True, slots=True)
class Labels:
    """Result of `binary_labels`: labels of minimum energy.

    Attributes
    ----------
    mask : (H, W) or (D, H, W) bool
        Labels. If several solutions are optimal, the labels with the fewest True.
    energy : float
        Sum of the costs of all points and pairs, in the units of the costs.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.kernels import seam
    >>> found = seam.binary_labels(np.array([[[0.0, 1.0], [1.0, 0.0]]]), 0.25)
    >>> found.mask.tolist(), round(found.energy, 3)
    ([[False, True]], 0.25)

    """

    mask: Bools
    energy: float


def cut(
    a: object,
    b: object,
    mask_a: object,
    mask_b: object,
    *,
    core_a: object | None = None,
    core_b: object | None = None,
    penalty: ArrayLike | None = None,
    old: OldSeams | None = None,
    cost: Cost = "gradient",
    wrap: bool | Sequence[bool] = False,
) -> Cut:
    """Find the least visible seam between two overlapping images, by an exact minimum cut [1]_.

    Pixels that only one image covers take that image. The cores are hard constraints: pixels of ``core_a`` take A, and
    pixels of ``core_b`` take B. Next, neighbours of pixels that only A covers take A, and then neighbours of pixels
    that only B covers take B. The other pixels are chosen so that the sum of the costs of all separated pairs of
    neighbours is minimal. If several choices are minimal, the choice with the fewest pixels of B is returned. If no
    pixel is constrained to B, no pixel takes B.

    Parameters
    ----------
    a, b : array_like
        Existing and new image on a common canvas, (H, W) or (H, W, C), or volumes (D, H, W[, C]) with masks of three
        axes. They can have any dtype, must be finite everywhere, and are scaled to [0, 1] together.
    mask_a, mask_b : (H, W) or (D, H, W) array_like of bool
        Masks of the pixels that A and B cover.
    core_a, core_b : array_like of bool, optional
        Pixels that must keep A, and pixels that must take B, as arrays of the masks' shape. Each core must be inside
        the mask of its image. Default: none.
    penalty : float or array_like of float, optional
        Penalty of each pixel, at least 0, of the masks' shape. The cost of a pair is multiplied by one plus the mean
        penalty of its two pixels. Penalties keep seams out of elements that should stay whole. Default: none.
    old : OldSeams, optional
        Costs of seams that A already contains, which B can cover. If an old seam costs more than the two seams that
        replace it, this sum is used instead. That only occurs with a cost that violates the triangle inequality.
        Default: None.
    cost : {"gradient", "paper"}
        Cost of separating neighbours s and t. "paper": ``|A(s) - B(s)| + |A(t) - B(t)|``, summed over channels.
        "gradient": this value divided by ``|A(s) - A(t)| + |B(s) - B(t)| + 0.05``, which hides seams along edges. Both
        add 1e-4, so that the shorter of two equal seams is chosen. Default: "gradient".
    wrap : bool or sequence of bool
        Axes along which the canvas is periodic. One value for all axes, or one for each. Default: False.

    Returns
    -------
    Cut
        Mask of B, cost of the seam, and number of separated pairs.

    Raises
    ------
    InvalidInput
        Shapes differ, values are not finite, penalties are negative, a core is outside its image, or the cores
        overlap.

    Notes
    -----
    Costs are rounded to multiples of 2^-16, or of a larger power of two if the largest cost exceeds 2^10. The time
    grows with the bounding box of the overlap. One connected core of B in an image can be surrounded by pixels
    constrained to A. The seam is then found as a shortest closed path on the dual of the grid [2]_. The result is the
    same as by maximum flow, but several times faster.

    References
    ----------
    .. [1] V. Kwatra, A. Schödl, I. Essa, G. Turk and A. Bobick, "Graphcut textures: image and video
       synthesis using graph cuts", ACM Transactions on Graphics 22(3), 2003.
       :doi:`10.1145/882262.882264`
    .. [2] J. Reif, "Minimum s-t cut of a planar undirected network in O(n log^2 n) time", SIAM
       Journal on Computing 12(1), 1983. :doi:`10.1137/0212005`

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.kernels import seam
    >>> a = np.array([[10, 20, 30, 40, 0, 0]] * 2, np.uint8)
    >>> b = np.array([[0, 90, 30, 40, 50, 60]] * 2, np.uint8)
    >>> covered = np.arange(6)
    >>> found = seam.cut(a, b, [covered < 5] * 2, [covered > 0] * 2)
    >>> found.mask.astype(int)
    array([[0, 0, 0, 1, 1, 1],
           [0, 0, 0, 1, 1, 1]])
    >>> found.edges
    2

    """
    covered = as_array(mask_a, "mask_a", np.bool_)
    axes = covered.ndim
    if axes not in (2, 3):
        raise InvalidInput(f"mask_a: must have shape (rows, columns) or (planes, rows, columns), got {axes} axes")
    first, second = _as_pair(a, b, axes)
    shape = first.shape[:-1]
    mask, value, edges = _rust.seam_cut(
        first,
        second,
        as_array(covered, "mask_a", np.bool_, shape),
        as_array(mask_b, "mask_b", np.bool_, shape),
        None if core_a is None else as_array(core_a, "core_a", np.bool_, shape),
        None if core_b is None else as_array(core_b, "core_b", np.bool_, shape),
        None if penalty is None else _as_floats(penalty, "penalty", shape),
        None if old is None else _as_seams(old, shape),
        _as_cost(cost),
        as_wrap(wrap, axes=axes),
    )
    return Cut(mask.reshape(shape), value, edges)


def cut_strip(
    a: object,
    b: object,
    *,
    axis: int = 1,
    cyclic: bool = False,
    penalty: ArrayLike | None = None,
    cost: Cost = "gradient",
) -> Cut:
    """Find the least visible seam, from border to border, between two images that overlap completely.

    The first line along ``axis`` takes A, and the last line takes B. The seam can also run backwards, because it is an
    exact minimum cut. It is found as a shortest path on the dual of the grid, hundreds of times faster than by maximum
    flow [1]_.

    Parameters
    ----------
    a, b : (H, W) or (H, W, C) array_like
        Images of the same shape, finite and of any real dtype. They are scaled to [0, 1] together.
    axis : {0, 1}
        Axis that the seam crosses: 1 for A on the left and B on the right, 0 for A above B. Default: 1.
    cyclic : bool
        If True, the other axis is periodic and the seam is closed [2]_. If False, the ends of the seam are
        independent. Default: False.
    penalty : float or (H, W) array_like of float, optional
        Penalty of each pixel, at least 0. The cost of a pair is multiplied by one plus the mean penalty of its two
        pixels. Default: none.
    cost : {"gradient", "paper"}
        Cost of separating neighbours s and t. "paper": ``|A(s) - B(s)| + |A(t) - B(t)|``, summed over channels.
        "gradient": this value divided by ``|A(s) - A(t)| + |B(s) - B(t)| + 0.05``. Default: "gradient".

    Returns
    -------
    Cut
        Mask of B, cost of the seam, and number of separated pairs.

    Raises
    ------
    InvalidInput
        Shapes differ, there are fewer than two pixels along ``axis``, values are not finite, or penalties are
        negative.

    References
    ----------
    .. [1] R. Hassin, "Maximum flow in (s,t) planar networks", Information Processing Letters 13(3),
       1981. :doi:`10.1016/0020-0190(81)90120-4`
    .. [2] J. Reif, "Minimum s-t cut of a planar undirected network in O(n log^2 n) time", SIAM
       Journal on Computing 12(1), 1983. :doi:`10.1137/0212005`

    Examples
    --------
    >>> from texrs.kernels import seam
    >>> found = seam.cut_strip([[0, 0.5, 0.9, 0.8]] * 2, [[0.6, 0.5, 0.2, 0.3]] * 2, cost="paper")
    >>> found.mask.astype(int)
    array([[0, 1, 1, 1],
           [0, 1, 1, 1]])

    """
    first, second = _as_pair(a, b, 2)
    shape = first.shape[:-1]
    dear = None if penalty is None else _as_floats(penalty, "penalty", shape)
    crossed = as_int(axis, "axis", 0, 1)
    [(mask, value, edges)] = _rust.seam_strips(
        [(first, second, crossed, dear)], as_bool(cyclic, "cyclic"), _as_cost(cost)
    )
    return Cut(mask.reshape(shape), value, edges)


@dataclass(frozen=True, slots=True, eq=False)
class Strip:
    """Pair of images of the same shape that overlap completely, for `cut_strips`.

    Attributes
    ----------
    a, b : (H, W, C) array_like
        Finite images with values of about 0 to 1, because costs are computed without rescaling.
    axis : {0, 1}
        Axis that the seam crosses.
    penalty : float or (H, W) array_like of float, optional
        Penalty of each pixel, at least 0, as in `cut`. Default: none.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.kernels.seam import Strip
    >>> Strip(np.zeros((8, 4, 3)), np.ones((8, 4, 3)), axis=1).axis
    1

    """

    a: ArrayLike
    b: ArrayLike
    axis: int
    penalty: ArrayLike | None = None


def cut_strips(strips: Sequence[Strip], *, cyclic: bool = False, cost: Cost = "gradient") -> list[Cut]:
    """Find the seams of many strips in parallel, with the same results as `cut_strip`.

    Parameters
    ----------
    strips : sequence of Strip
        Strips, which can differ in shape.
    cyclic : bool
        If True, all seams are closed, because the axis along the seam is periodic. Default: False.
    cost : {"gradient", "paper"}
        Cost of separating neighbours in all strips (see `cut_strip`). Default: "gradient".

    Returns
    -------
    list of Cut
        Cut of each strip, in their order.

    Raises
    ------
    InvalidInput
        An entry is not a `Strip`, or is invalid for `cut_strip`.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.kernels import seam
    >>> a, b = np.zeros((2, 4, 1)), np.array([[[0.4], [0.1], [0.3], [0.3]]] * 2)
    >>> [found.mask.astype(int)[0].tolist() for found in seam.cut_strips([seam.Strip(a, b, 1)] * 2, cost="paper")]
    [[0, 0, 1, 1], [0, 0, 1, 1]]

    """
    given = []
    for strip in as_items(strips, "strips"):
        if not isinstance(strip, Strip):
            raise InvalidInput(f"strips: each entry must be an instance of Strip, got {type(strip).__name__}")
        first = as_array(strip.a, "strips: a", np.float32, ("rows", "columns", "channels"))
        second = as_array(strip.b, "strips: b", np.float32, first.shape)
        dear = None if strip.penalty is None else _as_floats(strip.penalty, "strips: penalty", first.shape[:2])
        given.append((first, second, as_int(strip.axis, "strips: axis", 0, 1), dear))
    found = _rust.seam_strips(given, as_bool(cyclic, "cyclic"), _as_cost(cost))
    return [
        Cut(mask.reshape(one[0].shape[:2]), value, edges)
        for one, (mask, value, edges) in zip(given, found, strict=True)
    ]


def binary_labels(
    unary: ArrayLike,
    pairwise: float | Sequence[ArrayLike | tuple[ArrayLike, ArrayLike]],
    *,
    wrap: bool | Sequence[bool] = False,
) -> Labels:
    """Label each point of a grid True or False so that the total cost is minimal [1]_.

    Parameters
    ----------
    unary : (H, W, 2) or (D, H, W, 2) array_like of float
        Costs of the labels False and True at each point. Infinity forbids a label.
    pairwise : float or sequence
        Cost of neighbours with different labels, at least 0: a single number, or a sequence with one entry for each
        axis. An entry is a number or an array of the grid's shape. Its value at ``p`` is for the pair of ``p`` and the
        next point. An entry can also be a tuple of two arrays: for False followed by True, and for True followed by
        False.
    wrap : bool or sequence of bool
        Axes along which the grid is periodic. One value for all axes, or one for each. Default: False.

    Returns
    -------
    Labels
        Labels and their energy.

    Raises
    ------
    InvalidInput
        Shapes do not fit, pairwise costs are negative or infinite, values are NaN, or both labels of a point are
        forbidden.

    Notes
    -----
    Costs are rounded to multiples of a power of two. It is chosen so that the largest pairwise cost is 2^25 to 2^26
    multiples.

    References
    ----------
    .. [1] D. Greig, B. Porteous and A. Seheult, "Exact maximum a posteriori estimation for binary
       images", Journal of the Royal Statistical Society B 51(2), 1989.
       :doi:`10.1111/j.2517-6161.1989.tb01764.x`

    Examples
    --------
    A line of noisy values is divided into two segments:

    >>> import numpy as np
    >>> from texrs.kernels import seam
    >>> values = np.array([[0.1, 0.2, 0.6, 0.1, 0.9, 0.4, 0.8, 0.9]])
    >>> found = seam.binary_labels(np.stack([values, 1 - values], axis=-1), 0.3)
    >>> found.mask.astype(int)
    array([[0, 0, 0, 0, 1, 1, 1, 1]])

    """
    costs = as_array(unary, "unary", np.float32)
    axes = costs.ndim - 1
    if axes not in (2, 3) or costs.shape[-1] != 2 or costs.size == 0:
        raise InvalidInput(
            f"unary: must have shape (rows, columns, 2) or (planes, rows, columns, 2), got {costs.shape}"
        )
    shape = costs.shape[:-1]
    what = f"a number or {axes} entries, one per axis"
    entries = (pairwise,) * axes if isinstance(pairwise, Real) else as_tuple(pairwise, "pairwise", axes, what)
    both = [entry if isinstance(entry, tuple) else (entry, entry) for entry in entries]
    if any(len(entry) != 2 for entry in both):
        raise InvalidInput("pairwise: a tuple must contain two costs, of False before True and of True before False")
    forward, backward = ([_as_floats(entry[i], "pairwise", shape) for entry in both] for i in (0, 1))
    mask, energy = _rust.seam_labels(costs, forward, backward, as_wrap(wrap, axes=axes))
    return Labels(mask.reshape(shape), energy)


def _as_pair(a: object, b: object, axes: int) -> tuple[Floats, Floats]:
    """Return two images of the same shape, scaled to [0, 1] by their common range."""
    first, second = as_image(a, "a", axes=axes), as_image(b, "b", axes=axes)
    if first.shape != second.shape:
        raise InvalidInput(f"b: must have the shape of a, {first.shape}, got {second.shape}")
    if first.dtype.kind == second.dtype.kind == "f" and not (_is_unit(first) and _is_unit(second)):
        both = to_unit(np.stack([first, second]))
        return both[0], both[1]
    return np.ascontiguousarray(_bring_to_unit(first)), np.ascontiguousarray(_bring_to_unit(second))


def _is_unit(image: Array) -> bool:
    return bool(image.min() >= 0 and image.max() <= 1)


def _bring_to_unit(image: Array) -> Floats:
    return image if image.dtype == np.float32 else to_unit(image)


def _as_floats(value: object, name: str, shape: tuple[int, ...]) -> Floats:
    """Return an array of floats of the given shape. A single number is broadcast."""
    if isinstance(value, Real):
        most = float(np.finfo(np.float32).max)
        return np.full(shape, as_float(value, name, -most, most), np.float32)
    return as_array(value, name, np.float32, shape)


def _as_seams(old: object, shape: tuple[int, ...]) -> list[list[Floats]]:
    if not isinstance(old, OldSeams):
        raise InvalidInput(f"old: must be an instance of OldSeams, got {type(old).__name__}")
    fields = []
    for name in ("old.kept", "old.ab", "old.ba"):
        arrays = as_tuple(getattr(old, name[4:]), name, len(shape), f"{len(shape)} arrays, one per axis")
        fields.append([_as_floats(array, name, shape) for array in arrays])
    return fields


def _as_cost(cost: object) -> str:
    return as_choice(cost, "cost", ("gradient", "paper"))
