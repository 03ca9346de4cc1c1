"""Fill holes with patches of exemplars: the best match, joined to the known pixels by a minimum cut."""

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
    """A picture without holes, and where its new pixels come from.

    Attributes
    ----------
    colours : (H, W, C) float32
        The picture.
    label : (H, W) int32
        The patch that a pixel comes from, counted from 0 in the order of pasting; -1 where the picture was kept.
    source : (patches,) int
        The exemplar of each patch.
    coordinates : (H, W, 2) float32
        The place in that exemplar, (row, column); 0 where the picture was kept.

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
    progress: Callable[[float], object] | None = None,
) -> Inpainting:
    """Return a picture whose unknown pixels are filled from the hole boundary inwards, patch by patch.

    At each step: good matches of the known pixels in a window on the boundary [1]_, less those that would repeat or
    mirror what lies near; the three most promising are joined to the known pixels by a minimum cut [2]_, and the cheapest
    is pasted.

    Parameters
    ----------
    colours : (H, W, C) array_like
        The picture, of any real dtype, as float32 in the units of the exemplars; anything where it is unknown.
    known : (H, W) array_like of bool
        False at the holes.
    index : PatchIndex
        The exemplars that patches are taken from, of C channels.
    patch_size : int or (rows, columns)
        Size of a patch in pixels, 1 to that of the picture, of an exemplar and of ``index.max_patch``.
    keep : (H, W) array_like of bool, optional
        Known pixels that no patch may replace; by default seams may run through all of them.
    count : int
        How many matches are considered, 1 to 1000.
    separation : int
        Matches in one exemplar are more than this many pixels apart, 0 to 2^31.
    ratio : float
        No match considered costs more than this times the best, 1 to 1e9.
    wrap : bool or (rows, columns)
        Axes along which the picture is cyclic.
    seed : int
        0 to 2^64 - 1; chooses patches where nothing is known.
    paper : bool
        As Shen, Jin, Mao and Feng (2006) print it: holes in scan order, windows centred on them instead of those with
        the best share of known pixels, all known pixels of one weight instead of more beside the hole, the exact best
        matches, all of them cut, and plain cut costs. With ``count=1`` that is their completion.
    shown : int, optional
        The image of ``index``, from 0, that the picture shows in place, if it does: what lies beside a hole is then not
        repeated or mirrored in it. Patches know of each other in any case, and which images of ``index`` are mirrors of others.
    progress : callable, optional
        Called with the share of the holes that is filled, 0 to 1; raising stops the work.

    Returns
    -------
    Inpainting
        The filled picture and its sources.

    Raises
    ------
    InvalidInput
        Shapes that do not agree, a patch that does not fit, values that are not finite or out of range.
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
        raise InvalidInput(f"index: needs a PatchIndex, got {type(index).__name__}")
    picture = as_array(colours, "colours", np.float32, ("rows", "columns", "channels"))
    mask = as_mask(known, "known", picture.shape[:2])
    # In a quarter of the time of `np.where`, which spreads the mask over the channels.
    picture = picture.copy()
    picture[~mask] = 0
    if not np.isfinite(picture).all():
        raise InvalidInput("colours: known pixels must be finite")
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
        as_progress(progress),
    )
    coordinates = np.zeros((*mask.shape, 2), np.float32)
    # In a tenth of the time of `np.nonzero`, which looks at each axis apart.
    new = np.unravel_index(np.flatnonzero(label >= 0), label.shape)
    of = patches[label[new]]
    for axis, (at, length) in enumerate(zip(new, mask.shape, strict=True)):
        coordinates[..., axis][new] = (at - of[:, 3 + axis]) % length + of[:, 1 + axis]
    return Inpainting(filled, label, patches[:, 0], coordinates)
