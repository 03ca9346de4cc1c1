"""What `texrs.design` is given, checked, and what it knows of an exemplar before it makes anything of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import as_float, as_int, to_unit
from texrs._typing import Array, Floats
from texrs.errors import InvalidInput
from texrs.exemplar.regularity import direction, polarity
from texrs.exemplar.segmentation import Segmentation
from texrs.exemplar.symmetry import Flip, flip, mirrors
from texrs.kernels.patch_search import PatchIndex
from texrs.papers.design.operations import Moves, chaotic_sequence

__all__ = ["Source", "as_shares", "check_moves", "check_sources", "to_unit_together"]


def check_sources(pixels: Sequence[Array], labels: object) -> None:
    """Check that exemplars can be mixed."""
    if not pixels:
        raise InvalidInput("exemplar: at least one is needed, got none")
    kinds = [(p.dtype.name, p.shape[-1]) for p in pixels]
    if len(set(kinds)) > 1:
        raise InvalidInput(f"exemplar: several must agree in dtype and channels, got {kinds}")
    if isinstance(labels, list | tuple) and len(labels) != len(pixels):
        raise InvalidInput(f"labels: needs one an exemplar, {len(pixels)}, got {len(labels)}")
    if labels is not None and not isinstance(labels, list | tuple) and len(pixels) > 1:
        raise InvalidInput("labels: needs a list of one an exemplar when there are several")


def to_unit_together(pixels: Sequence[Array]) -> list[Floats]:
    """Bring exemplars to [0, 1] on one scale."""
    flat = to_unit(np.concatenate([p.reshape(-1, p.shape[-1]) for p in pixels]))
    ends = np.cumsum([p.shape[0] * p.shape[1] for p in pixels])[:-1]
    return [part.reshape(p.shape) for part, p in zip(np.split(flat, ends), pixels, strict=True)]


def as_shares(weights: object, count: int, size: tuple[int, ...]) -> NDArray[np.float64]:
    """Check the shares of the exemplars: (count,) for the whole, or (rows, columns, count) over the texture."""
    if weights is None:
        return np.full(count, 1 / count)
    try:
        array = np.asarray(weights, np.float64)
    except (TypeError, ValueError):
        raise InvalidInput(f"weights: needs numbers, got {weights!r}") from None
    if array.shape == size and np.asarray(weights).dtype.kind in "iu":
        if array.min() < 0 or array.max() >= count:
            raise InvalidInput(
                f"weights: a map of exemplars holds 0 to {count - 1}, got {array.min()} to {array.max()}"
            )
        return np.eye(count)[array.astype(np.intp)]
    if array.shape not in ((count,), (*size, count)):
        raise InvalidInput(
            f"weights: needs one an exemplar, {count}, a map of exemplars {size} of integers, "
            f"or weights {(*size, count)}; got shape {array.shape}"
        )
    if not np.isfinite(array).all() or array.min() < 0 or (array.sum(axis=-1) <= 0).any():
        raise InvalidInput("weights: must be finite, not negative, and positive somewhere in each place")
    shares: NDArray[np.float64] = array / array.sum(axis=-1, keepdims=True)
    return shares


def check_moves(
    operations: int,
    translate: float,
    rotate: float,
    scale: Sequence[float],
    mirror: bool,
    x0: float | None,
    chaos: float,
) -> Moves:
    """Check the arguments of `design` that say what elements may do."""
    if not isinstance(scale, Sequence) or len(scale) != 2:
        raise InvalidInput(f"scale: needs (least, largest), got {scale!r}")
    low, high = (as_float(s, "scale", 0.5, 2) for s in scale)
    if low > high:
        raise InvalidInput(f"scale: the least comes first, got {scale!r}")
    if not isinstance(mirror, bool | np.bool_):
        raise InvalidInput(f"mirror: needs True or False, got {mirror!r}")
    strength = as_float(chaos, "chaos", 0, 2)
    if x0 is not None:
        chaotic_sequence(x0, strength)
    return Moves(
        as_int(operations, "operations", 0, 8),
        as_float(translate, "translate", 0, 0.5),
        as_float(rotate, "rotate", 0, 180),
        (low, high),
        bool(mirror),
        x0,
        strength,
    )


# --- analysis ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """An exemplar, analysed: made once, and used by all variants."""

    guide: Floats
    parts: Segmentation
    index: PatchIndex
    flips: list[Flip]
    moves: Moves
    side: int
    paper: bool
    """Whether the paper is followed to the letter."""

    @classmethod
    def of(
        cls, guide: Floats, parts: Segmentation, moves: Moves, *, automatic: bool, side: int | None, paper: bool = False
    ) -> Source:
        """Settle what depends on the exemplar: rotations, the side of a patch, and what holes are filled from."""
        if paper:
            parts, moves = replace(parts, children="none", lattice=None), replace(moves, mirror=False)
        extent = side or patch_side(guide.shape[0], guide.shape[1])
        flips = mirrors(moves.mirror)
        if len(flips) > 1:
            rows, columns, oblique = polarity(guide)
            # Each mirror turns two of the three round, which are evidence apart from each other.
            odd = {(True, False): (rows, oblique), (False, True): (columns, oblique), (True, True): (rows, columns)}
            like = {f: math.hypot(*sure) < POLAR for f, sure in odd.items()}
            flips = [f for f in flips if like.get(f, True)]
            moves = replace(moves, axes=(like[True, False], like[False, True]))
        if parts.lattice:
            shifts = parts.lattice.shifts(moves.translate * min(guide.shape[:2])) if moves.translate else []
            moves = replace(moves, rotate=0.0, scale=(1.0, 1.0), mirror=False, shifts=tuple(shifts))
        elif automatic and parts.children != "grid" and direction(guide) < DIRECTED:
            moves = replace(moves, rotate=ROTATE)
        if parts.children == "grid":
            # Cells are no elements: turned or scaled they would show their outline, and mirrored they would meet the mirror
            # image of what they show.
            moves = replace(moves, rotate=0.0, scale=(1.0, 1.0), mirror=False)
        return cls(guide, parts, filling(guide, parts, flips, extent), flips, moves, extent, paper)


def patch_side(height: int, width: int) -> int:
    """Return the default side of a completion patch: about the size of an element."""
    return min(height, width, max(12, min(32, min(height, width) // 6)))


ROTATE, DIRECTED = 60.0, 0.25
"""Largest rotation by default, in degrees, and the directedness from which on nothing is turned."""


POLAR = 5.0
"""How surely, in standard errors, an example differs from a mirror image of itself from which on it is not mirrored so."""

BACKGROUND_PLACES = 64
"""Places for a patch of pure background from which on holes are filled with background alone."""


def filling(guide: Floats, parts: Segmentation, flips: Sequence[Flip], side: int) -> PatchIndex:
    """Make the index of patches that holes are filled from: of background alone, if there is enough of it."""
    from scipy.ndimage import minimum_filter

    pictures = [flip(guide, f) for f in flips]
    allowed = None
    if parts.children in ("components", "labels"):
        free = [flip(parts.elements, f) == 0 for f in flips]
        # The origin puts the top-left corner of the window on the pixel.
        masks = [minimum_filter(m, side, mode="constant", cval=0, origin=-(side // 2)) for m in free]
        if sum(int(m.sum()) for m in masks) >= BACKGROUND_PLACES * len(flips):
            allowed = masks
    return PatchIndex(pictures, allowed=allowed, max_patch=side)
