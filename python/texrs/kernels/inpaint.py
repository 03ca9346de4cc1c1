"""Fill holes with patches of exemplars. Each patch is a good match, joined to the known pixels by a minimum cut."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from texrs import _rust
from texrs._arrays import as_array, as_bool, as_float, as_int, as_mask, as_progress, as_seed, as_size, as_wrap
from texrs._typing import Array, Bools, Floats
from texrs.errors import InvalidInput
from texrs.kernels.patch_search import PatchIndex

__all__ = ["Inpainting", "inpaint"]


def __dir__() -> list[str]:
    return __all__


@dataclass(frozen=True, slots=True, eq=False)
class Inpainting:
    """Image without holes, and the source of each new pixel.

    Attributes
    ----------
    colours : (H, W, C) float32
        Filled image.
    label : (H, W) int32
        Index of the patch that each pixel comes from, in the order of pasting; -1 for known pixels that were not
        replaced.
    source : (patches,) int
        Index of the exemplar of each patch.
    coordinates : (H, W, 2) float32
        Source coordinates (row, column) in that exemplar; 0 for known pixels that were not replaced.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.kernels.inpaint import inpaint
    >>> from texrs.kernels.patch_search import PatchIndex
    >>> stripes = np.tile(np.float32([0, 0, 1, 1]), (24, 6))[..., np.newaxis]
    >>> known = np.ones((24, 24), bool)
    >>> known[8:14, 9:16] = False
    >>> filled = inpaint(stripes * known[..., np.newaxis], known, PatchIndex([stripes]), patch_size=12)
    >>> filled.label.shape, int(filled.label[0, 0]), bool((filled.label[~known] >= 0).all())
    ((24, 24), -1, True)

    """

    colours: Floats
    label: NDArray[np.int32]
    source: NDArray[np.int64]
    coordinates: Floats


def inpaint(
    colours: Array,
    known: Bools,
    index: PatchIndex,
    *,
    patch_size: int | tuple[int, int],
    keep: Bools | None = None,
    count: int = 5,
    separation: int = 4,
    ratio: float = 3.0,
    wrap: bool | Sequence[bool] = False,
    seed: int = 0,
    paper: bool = False,
    shown: int | None = None,
    lattice: Array | None = None,
    progress: Callable[[float], object] | None = None,
) -> Inpainting:
    """Fill the unknown pixels of an image patch by patch, from the boundary of the hole inwards.

    Each step takes a window on the boundary of the hole, and searches the exemplars for good matches of its known
    pixels [1]_. Matches that would repeat or mirror their surroundings are rejected. The three best matches are joined
    to the known pixels by a minimum cut [2]_, and the match with the cheapest cut is pasted.

    Parameters
    ----------
    colours : (H, W, C) array_like
        Image of any real dtype, converted to float32, with the same scale of values as the exemplars. Unknown pixels
        can have any value.
    known : (H, W) array_like of bool
        Mask of the known pixels, False in the holes.
    index : PatchIndex
        Index of the exemplars that patches are copied from. They must have C channels.
    patch_size : int or (rows, columns)
        Size of a patch in pixels, from 1 to the minimum of the image size, the largest exemplar and
        ``index.max_patch``.
    keep : (H, W) array_like of bool, optional
        Known pixels that patches must not replace. Default: no pixels, so seams can run through all known pixels.
    count : int
        Maximum number of matches to compare, 1 to 1000. Default: 5.
    separation : int
        Distance in pixels, 0 to 2^31. The rows or the columns of two matches in one exemplar differ by more than this.
        Default: 4.
    ratio : float
        Maximum cost of a match, as a multiple of the best one, 1 to 1e9. Default: 3.
    wrap : bool or (rows, columns)
        Axes along which the image is periodic. One value for both axes, or one for each. Default: False.
    seed : int
        Random seed, 0 to 2^64 - 1. It is only used if no pixel is known, to choose patches. Default: 0.
    paper : bool
        If True, follow Shen, Jin, Mao and Feng (2006) literally. Holes are then filled in scan order, and windows are
        centred on unknown pixels instead of the place with most known pixels. All known pixels have the same weight,
        instead of a higher weight near the hole. The exact best matches are compared, by plain cut costs. With
        ``count=1`` this is their completion. Default: False.
    shown : int, optional
        Index in ``index`` of the exemplar that is this image itself, if there is one. The surroundings of a hole are
        then not copied or mirrored into the hole from this exemplar. Patches never repeat their neighbours, and mirror
        images in ``index`` are recognised. Default: None.
    lattice : (2, 2) array_like of float, optional
        Lattice of the image ``shown``: two shifts after which it repeats, (row, column), one in each column. Patches are
        then copied from places in step with it, as long as there are any. Default: None.
    progress : callable, optional
        Function that is called with the filled fraction of the holes, 0 to 1. An exception that it raises stops the
        work. Default: None.

    Returns
    -------
    Inpainting
        Filled image, and the source of each new pixel.

    Raises
    ------
    InvalidInput
        Shapes differ, a patch does not fit, or values are not finite or out of range.
    Cancelled
        The work was stopped.

    References
    ----------
    .. [1] A. Criminisi, P. Perez, K. Toyama, "Region filling and object removal by exemplar-based image inpainting",
       IEEE Trans. Image Processing 13(9), 2004.
    .. [2] V. Kwatra et al., "Graphcut textures: image and video synthesis using graph cuts", SIGGRAPH 2003.

    Examples
    --------
    >>> import numpy as np
    >>> from texrs.kernels.patch_search import PatchIndex
    >>> stripes = np.tile(np.float32([0, 0, 1, 1]), (24, 6))[..., np.newaxis]
    >>> known = np.ones((24, 24), bool)
    >>> known[8:14, 9:16] = False
    >>> filled = inpaint(stripes * known[..., np.newaxis], known, PatchIndex([stripes]), patch_size=12)
    >>> bool((filled.colours == stripes).all())
    True

    """
    if not isinstance(index, PatchIndex):
        raise InvalidInput(f"index: must be an instance of PatchIndex, got {type(index).__name__}")
    picture = as_array(colours, "colours", np.float32, ("rows", "columns", "channels"))
    mask = as_mask(known, "known", picture.shape[:2])
    # A copy takes 25 % of the time of `np.where`, which would expand the mask over the channels.
    picture = picture.copy()
    picture[~mask] = 0
    if not np.isfinite(picture).all():
        raise InvalidInput("colours: must be finite at known pixels")
    sides = as_size(patch_size, "patch_size")
    rows, columns = (as_int(s, "patch_size", 1, n) for s, n in zip(sides, picture.shape[:2], strict=True))
    pick = (
        as_int(count, "count", 1, 1000),
        as_int(separation, "separation", 0, 2**31),
        as_float(ratio, "ratio", 1, 1e9),
    )
    filled, label, patches = _rust.complete(
        picture,
        mask,
        None if keep is None else as_mask(keep, "keep", picture.shape[:2]),
        index._index,
        as_wrap(wrap),
        (rows, columns),
        pick,
        as_seed(seed),
        as_bool(paper, "paper"),
        None if shown is None else as_int(shown, "shown", 0, len(index.shapes) - 1),
        None if lattice is None else as_array(lattice, "lattice", np.float64, (2, 2)).tolist(),
        as_progress(progress),
    )
    coordinates = np.zeros((*mask.shape, 2), np.float32)
    # This takes 10 % of the time of `np.nonzero`, which processes each axis separately.
    new = np.unravel_index(np.flatnonzero(label >= 0), label.shape)
    of = patches[label[new]]
    for axis, (at, length) in enumerate(zip(new, mask.shape, strict=True)):
        coordinates[..., axis][new] = (at - of[:, 3 + axis]) % length + of[:, 1 + axis]
    return Inpainting(filled, label, patches[:, 0], coordinates)
