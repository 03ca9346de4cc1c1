"""Arguments of `texrs.design`, checked before any work begins."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from texrs._arrays import (
    as_choice,
    as_float,
    as_int,
    as_list,
    as_method,
    as_seed,
    as_size,
    as_wrap,
    check_work,
    to_unit,
    try_array,
)
from texrs._typing import Array, Progress
from texrs.elements import ElementAnalysis
from texrs.errors import InvalidInput
from texrs.exemplar import ElementOptions, Exemplar, as_exemplar
from texrs.materials import Material
from texrs.papers.design.options import DeformationOptions
from texrs.papers.design.plan import Way

__all__ = ["Arguments", "Choice", "Density", "Exemplars", "Method", "Size", "Weights", "check_arguments"]

Exemplars: TypeAlias = (
    Array | Exemplar | ElementAnalysis | Material | Sequence[Array | Exemplar | ElementAnalysis | Material]
)
Size: TypeAlias = int | Sequence[int] | None
Weights: TypeAlias = Sequence[float] | Array | None
Density: TypeAlias = float | Sequence[float] | Array | None
Method: TypeAlias = Literal["paper"] | None
Choice: TypeAlias = Literal["auto"] | Way

MINIMUM_SIDE = 16
"""Minimum side of an exemplar, in pixels. A smaller image is too small for a texture."""
LARGER = "texrs.CornerTiles creates an unbounded design in parts"
"""Remedy in error messages about a size that exceeds a limit."""


@dataclass(frozen=True, slots=True, eq=False)
class Arguments:
    """Checked arguments of `texrs.design`."""

    exemplars: list[Exemplar]
    guides: list[Exemplar]
    """The same exemplars on one common scale of values, which is used for all decisions of the algorithm."""
    size: tuple[int, int]
    seeds: list[int]
    wrap: tuple[bool, bool]
    shares: NDArray[np.float64]
    """Share of each exemplar: (n,) for the whole texture, or (rows, columns, n)."""
    density: NDArray[np.float64] | None
    """Share of the area that elements of each exemplar after the first cover: (n - 1,), or (rows, columns, n - 1)."""
    elements: ElementOptions
    deformation: DeformationOptions
    way: Choice
    copies: int
    side: int | None
    """Side of the patches that fill holes, in pixels, or None for the default."""
    screening: float
    literal: bool
    """If True, the paper is followed as printed."""
    watch: Progress

    @property
    def shapes(self) -> tuple[tuple[int, ...], ...]:
        """Height and width of each exemplar."""
        return tuple(e.shape for e in self.exemplars)

    @property
    def images(self) -> list[Array]:
        """The exemplars in their original dtype and values."""
        return [e.image for e in self.exemplars]


def check_arguments(
    exemplar: Exemplars,
    count: int,
    size: Size,
    *,
    seed: int,
    wrap: bool | Sequence[bool] | None,
    weights: Weights,
    density: Density,
    elements: ElementOptions | ElementAnalysis,
    deformation: DeformationOptions,
    way: Choice,
    copies: int,
    patch_size: int | None,
    screening: float | None,
    method: Method,
    progress: Progress | None,
) -> Arguments:
    """Check the arguments of `texrs.design_variants`."""
    given = as_list(exemplar)
    exemplars = [as_exemplar(e.image if isinstance(e, ElementAnalysis) else e, minimum=MINIMUM_SIDE) for e in given]
    chosen = take_entries(given, exemplars, elements)
    for name, value, kind in (("elements", chosen, ElementOptions), ("deformation", deformation, DeformationOptions)):
        if not isinstance(value, kind):
            raise InvalidInput(f"{name}: must be {kind.__name__}(...), got {value!r}")
    check_together(exemplars, chosen.labels)
    sides = size if size is not None else [2 * n for n in exemplars[0].shape]
    rows, columns = as_size(sides, minimum=MINIMUM_SIDE, way=LARGER)
    first, cyclic = as_seed(seed), as_wrap(wrap, usual=True)
    # Check the shares after the size, because a map of shares must have the size of the result.
    shares = as_shares(weights, len(exemplars), (rows, columns))
    as_method(method, None, "paper")
    if density is not None and (weights is not None or method is not None):
        other = "weights" if weights is not None else "method"
        raise InvalidInput(
            f"density: cannot be combined with {other}, because density scatters elements over the first exemplar"
        )
    as_choice(way, "way", ("auto", *get_args(Way)))
    arguments = Arguments(
        exemplars,
        scale_together(exemplars),
        (rows, columns),
        [(first + k) % 2**64 for k in range(as_int(count, "count", 1, 4096))],
        (cyclic[0], cyclic[1]),
        shares,
        None if density is None else as_density(density, len(exemplars), (rows, columns)),
        chosen,
        deformation,
        way,
        as_int(copies, "copies", 1, 64),
        None if patch_size is None else as_int(patch_size, "patch_size", 4, min(min(e.shape) for e in exemplars)),
        as_float(0.0 if screening is None else screening, "screening", 0, 1e6),
        method == "paper",
        progress or (lambda stage, share: None),
    )
    # Check that the required memory is available before the work begins.
    check_work("design", [e.pixels for e in exemplars], (rows, columns), way=LARGER, method=method)
    return arguments


def take_entries(given: Sequence[object], exemplars: Sequence[Exemplar], elements: Any) -> Any:
    """Return the element options, with the labels of those exemplars that are element analyses.

    If ``elements`` is set explicitly, it overrides the labels of the element analyses.
    """
    if isinstance(elements, ElementAnalysis):
        shapes = [e.shape for e in exemplars]
        if shapes != [elements.mask.shape]:
            raise InvalidInput(
                f"elements: an ElementAnalysis of shape {elements.mask.shape} requires one exemplar of the same shape, got "
                f"shapes {shapes}; for several exemplars, pass each ElementAnalysis as exemplar"
            )
        return ElementOptions(labels=part_at_borders(elements))
    plain = isinstance(elements, ElementOptions) and (elements.layers, elements.segmentation) == (None, "auto")
    if not plain or elements.labels is not None or not any(isinstance(e, ElementAnalysis) for e in given):
        return elements
    labels: list[Any] = [part_at_borders(e) if isinstance(e, ElementAnalysis) else None for e in given]
    return ElementOptions(labels=labels if len(labels) > 1 else labels[0])


def part_at_borders(entry: ElementAnalysis) -> NDArray[np.integer[Any]]:
    """Return the labels of analysed elements, where elements that cross a periodic border are split.

    This is necessary because elements can only move within the exemplar.
    """
    from scipy.ndimage import label

    if not any(entry.wrap):
        return entry.labels
    pieces, count = label(entry.labels > 0)
    return np.asarray(entry.labels * (int(count) + 1) + pieces)


def check_together(exemplars: Sequence[Exemplar], labels: object) -> None:
    """Check that the exemplars can be mixed, and that labels are given for all exemplars or none."""
    if not exemplars:
        raise InvalidInput("exemplar: must contain at least one exemplar, got none")
    kinds = [(e.pixels.dtype.name, e.pixels.shape[-1]) for e in exemplars]
    if len(set(kinds)) > 1:
        raise InvalidInput(f"exemplar: all exemplars must have the same dtype and number of channels, got {kinds}")
    if isinstance(labels, list | tuple) and len(labels) != len(exemplars):
        raise InvalidInput(f"labels: must be a list of {len(exemplars)} entries, one per exemplar, got {len(labels)}")
    if labels is not None and not isinstance(labels, list | tuple) and len(exemplars) > 1:
        raise InvalidInput("labels: must be a list with one entry per exemplar if there are several exemplars")


def scale_together(exemplars: list[Exemplar]) -> list[Exemplar]:
    """Return float exemplars scaled to [0, 1] by one common scale.

    Integers are unchanged, because their dtype sets the scale.
    """
    if len(exemplars) == 1 or exemplars[0].pixels.dtype.kind != "f":
        return exemplars
    pixels = [e.pixels for e in exemplars]
    flat = to_unit(np.concatenate([p.reshape(-1, p.shape[-1]) for p in pixels]))
    ends = np.cumsum([p.shape[0] * p.shape[1] for p in pixels])[:-1]
    return [Exemplar(part.reshape(p.shape)) for part, p in zip(np.split(flat, ends), pixels, strict=True)]


def as_shares(weights: object, count: int, size: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the checked shares of the exemplars: (count,) for the whole texture, or (rows, columns, count)."""
    if weights is None:
        return np.full(count, 1 / count)
    array = try_array(weights, np.float64)
    if array.shape == size and np.asarray(weights).dtype.kind in "iu":
        if array.min() < 0 or array.max() >= count:
            raise InvalidInput(
                f"weights: exemplar numbers must be integers from 0 to {count - 1}, got {array.min()} to {array.max()}"
            )
        return np.eye(count)[array.astype(np.intp)]
    if array.shape not in ((count,), (*size, count)):
        raise InvalidInput(
            f"weights: must be {count} numbers (one per exemplar), an integer array of shape {size}, "
            f"or an array of shape {(*size, count)}; got shape {array.shape}"
        )
    if not np.isfinite(array).all() or array.min() < 0 or (array.sum(axis=-1) <= 0).any():
        raise InvalidInput("weights: must be finite and at least 0, with a sum above 0 in each pixel")
    shares: NDArray[np.float64] = array / array.sum(axis=-1, keepdims=True)
    return shares


def as_density(density: object, count: int, size: tuple[int, ...]) -> NDArray[np.float64]:
    """Return the checked densities of the exemplars after the first: (count - 1,) or (rows, columns, count - 1)."""
    if count < 2:
        raise InvalidInput(
            "density: requires at least two exemplars, because it scatters elements of the further exemplars over the "
            "first; got one"
        )
    array = try_array(density, np.float64)
    if array.ndim == 0:
        array = np.full(count - 1, float(array))
    elif array.shape == size:
        array = np.repeat(array[..., np.newaxis], count - 1, axis=-1)
    if array.shape not in ((count - 1,), (*size, count - 1)):
        raise InvalidInput(
            f"density: must be one number, {count - 1} numbers (one per exemplar after the first), or an array of "
            f"shape {size} or {(*size, count - 1)}; got shape {array.shape}"
        )
    if not np.isfinite(array).all() or array.min() < 0 or array.sum(axis=-1).max() > 1:
        raise InvalidInput("density: must be shares of the area from 0 to 1 whose sum is at most 1")
    return array
